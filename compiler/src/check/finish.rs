//! The finished tree: the functions that are used, each after those that it calls, numbered anew.

use super::context::Checker;
use super::typed::{Closure, Expr, Function, FunctionId, Model};
use std::collections::HashMap;

/// Moves the functions that the model uses into it, with closures and locals.
pub(super) fn finish(checker: &Checker<'_>, model: &mut Model) {
    let mut order = Order { checker, state: HashMap::new(), done: Vec::new() };
    let mut roots = Vec::new();
    model.for_each_root(&mut |e| callees(e, &mut roots));
    for root in roots {
        order.visit(root);
    }
    let numbers: HashMap<FunctionId, FunctionId> =
        order.done.iter().enumerate().map(|(new, (old, _))| (*old, FunctionId(new as u32))).collect();
    model.functions = order.done.into_iter().map(|(_, function)| function).collect();
    model.for_each_root_mut(&mut |e| renumber(e, &numbers));
    for function in &mut model.functions {
        renumber(&mut function.body, &numbers);
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

#[derive(Clone, Copy, PartialEq)]
enum State {
    Open,
    Done,
}

struct Order<'c, 'a> {
    checker: &'c Checker<'a>,
    state: HashMap<FunctionId, State>,
    done: Vec<(FunctionId, Function)>,
}

impl Order<'_, '_> {
    /// Depth first, without recursion. A call of a function that is still open closes a circle: all on the path since are recursive.
    fn visit(&mut self, root: FunctionId) {
        let mut path: Vec<(FunctionId, Vec<FunctionId>, bool)> = Vec::new();
        self.open(root, &mut path);
        while let Some((id, rest, _)) = path.last_mut() {
            let id = *id;
            match rest.pop() {
                Some(callee) => match self.state.get(&callee) {
                    None => self.open(callee, &mut path),
                    Some(State::Open) => {
                        let start = path.iter().position(|(f, ..)| *f == callee).unwrap_or(0);
                        path[start..].iter_mut().for_each(|(.., recursive)| *recursive = true);
                    }
                    Some(State::Done) => {}
                },
                None => {
                    let recursive = path.pop().is_some_and(|(.., recursive)| recursive);
                    self.state.insert(id, State::Done);
                    if let Some(function) = self.checker.function(id) {
                        self.done.push((id, Function { recursive, ..function.clone() }));
                    }
                }
            }
        }
    }

    fn open(&mut self, id: FunctionId, path: &mut Vec<(FunctionId, Vec<FunctionId>, bool)>) {
        if self.state.contains_key(&id) {
            return;
        }
        let mut rest = Vec::new();
        if let Some(function) = self.checker.function(id) {
            callees(&function.body, &mut rest);
        }
        rest.reverse();
        self.state.insert(id, State::Open);
        path.push((id, rest, false));
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
