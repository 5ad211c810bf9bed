//! The finished tree: the functions that are used, each after those that it calls, numbered anew.

use super::context::Checker;
use super::typed::{Closure, Expr, Function, FunctionId, Model};
use std::collections::{HashMap, HashSet};

/// Moves the functions that the model uses into it, with closures and locals.
pub(super) fn finish(checker: &Checker<'_>, model: &mut Model) {
    let mut order =
        Order { checker, visits: HashMap::new(), waiting: Vec::new(), recursive: HashSet::new(), done: Vec::new() };
    let mut roots = Vec::new();
    model.for_each_root(&mut |e| callees(e, &mut roots));
    for root in roots {
        order.visit(root);
    }
    let numbers: HashMap<FunctionId, FunctionId> =
        order.done.iter().enumerate().map(|(new, (old, _))| (*old, FunctionId(new as u32))).collect();
    let recursive = order.recursive;
    model.functions = order
        .done
        .into_iter()
        .map(|(id, function)| Function { recursive: recursive.contains(&id), ..function })
        .collect();
    model.for_each_root_mut(&mut |e| renumber(e, &numbers));
    for function in &mut model.functions {
        renumber(&mut function.body, &numbers);
        if let Some(by_hand) = &mut function.by_hand
            && let Some(number) = numbers.get(&by_hand.function)
        {
            by_hand.function = *number;
        }
    }
    model.closures = checker
        .closures
        .iter()
        .map(|c| Closure {
            name: c.name.to_string(),
            captures: c.captures.iter().map(|(name, ty)| ((*name).to_owned(), ty.clone())).collect(),
        })
        .collect();
    model.locals = checker.locals.clone();
}

/// A function on the way: its number in the order of visits, and the least such number that it reaches.
struct Visit {
    number: usize,
    least: usize,
    /// Whether its circle of recursion is complete.
    closed: bool,
}

struct Order<'c, 'a> {
    checker: &'c Checker<'a>,
    visits: HashMap<FunctionId, Visit>,
    /// Functions whose circle is not complete (Tarjan's stack).
    waiting: Vec<FunctionId>,
    recursive: HashSet<FunctionId>,
    done: Vec<(FunctionId, Function)>,
}

impl Order<'_, '_> {
    /// Depth first, without recursion, finding circles of calls as Tarjan does (Depth-first search and linear graph
    /// algorithms, 1972).
    fn visit(&mut self, root: FunctionId) {
        let mut path: Vec<(FunctionId, Vec<FunctionId>)> = Vec::new();
        self.open(root, &mut path);
        while let Some((id, rest)) = path.last_mut() {
            let id = *id;
            let Some(callee) = rest.pop() else {
                path.pop();
                self.close(id, path.last().map(|(caller, _)| *caller));
                continue;
            };
            if callee == id {
                self.recursive.insert(id);
            }
            match self.visits.get(&callee) {
                None => self.open(callee, &mut path),
                Some(visit) if !visit.closed => {
                    let number = visit.number;
                    self.lower(id, number);
                }
                Some(_) => {}
            }
        }
    }

    fn open(&mut self, id: FunctionId, path: &mut Vec<(FunctionId, Vec<FunctionId>)>) {
        if self.visits.contains_key(&id) {
            return;
        }
        let mut rest = Vec::new();
        if let Some(function) = self.checker.function(id) {
            callees(&function.body, &mut rest);
            rest.extend(function.by_hand.iter().map(|d| d.function));
        }
        rest.reverse();
        let number = self.visits.len();
        self.visits.insert(id, Visit { number, least: number, closed: false });
        self.waiting.push(id);
        path.push((id, rest));
    }

    fn lower(&mut self, id: FunctionId, number: usize) {
        if let Some(visit) = self.visits.get_mut(&id) {
            visit.least = visit.least.min(number);
        }
    }

    fn close(&mut self, id: FunctionId, caller: Option<FunctionId>) {
        if let Some(function) = self.checker.function(id) {
            self.done.push((id, function.clone()));
        }
        let Some(visit) = self.visits.get(&id) else { return };
        let (number, least) = (visit.number, visit.least);
        if let Some(caller) = caller {
            self.lower(caller, least);
        }
        if number != least {
            return;
        }
        let start = self.waiting.iter().rposition(|f| *f == id).unwrap_or(0);
        let circle = self.waiting.split_off(start);
        for member in &circle {
            if circle.len() > 1 {
                self.recursive.insert(*member);
            }
            if let Some(visit) = self.visits.get_mut(member) {
                visit.closed = true;
            }
        }
    }
}

fn callees(e: &Expr, out: &mut Vec<FunctionId>) {
    if let Some(call) = e.call() {
        out.push(call.function);
    }
    e.for_each_child(&mut |child| callees(child, out));
}

fn renumber(e: &mut Expr, numbers: &HashMap<FunctionId, FunctionId>) {
    if let Some(call) = e.call_mut()
        && let Some(number) = numbers.get(&call.function)
    {
        call.function = *number;
    }
    e.for_each_child_mut(&mut |child| renumber(child, numbers));
}
