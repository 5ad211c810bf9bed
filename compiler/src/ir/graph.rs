//! Which functions name which.

use super::hash::{HashMap, HashSet};
use super::{ByHand, Function, FunctionId, Module, Op};

/// The functions that some roots reach, with the strongly connected components of their references. What it takes
/// depends on what is reached, not on the module.
#[derive(Clone, Debug, Default)]
pub struct References {
    /// Reached functions, each after the functions that it names (but for those in its own cycle).
    pub order: Vec<FunctionId>,
    recursive: HashSet<FunctionId>,
    component: HashMap<FunctionId, FunctionId>,
}

impl References {
    /// Of these roots.
    #[must_use]
    pub fn new(module: &Module, roots: &[FunctionId]) -> References {
        References::along(module, roots, |_| true)
    }

    /// Of these roots, following only the operations that `follow` accepts.
    #[must_use]
    pub fn along(module: &Module, roots: &[FunctionId], follow: impl Fn(&Op) -> bool) -> References {
        let mut search = Search::default();
        let successors = |f: FunctionId| -> Vec<FunctionId> {
            let ops = module.function(f).nodes.iter().map(|node| &node.op).filter(|op| follow(op));
            // A derivative by hand is run where its function is called.
            let by_hand = module.by_hand.get(&f).map(|d| d.function);
            let by_hand = by_hand.filter(|d| follow(&Op::Call { function: *d, args: Vec::new() }));
            ops.flat_map(Op::functions).chain(by_hand).collect()
        };
        for root in roots {
            search.from(*root, &successors);
        }
        search.found
    }

    /// Whether a function can come to run itself.
    #[must_use]
    pub fn is_recursive(&self, function: FunctionId) -> bool {
        self.recursive.contains(&function)
    }

    /// Whether two functions are in one cycle, or are one.
    #[must_use]
    pub fn in_one_cycle(&self, f: FunctionId, g: FunctionId) -> bool {
        self.component.get(&f) == self.component.get(&g)
    }
}

/// Tarjan's algorithm ("Depth-first search and linear graph algorithms", 1972) without recursion, since a script
/// decides how deep the references go.
#[derive(Default)]
struct Search {
    visits: HashMap<FunctionId, Visit>,
    stack: Vec<FunctionId>,
    found: References,
}

struct Visit {
    index: usize,
    low: usize,
    on_stack: bool,
}

impl Search {
    fn from(&mut self, root: FunctionId, successors: &impl Fn(FunctionId) -> Vec<FunctionId>) {
        if self.visits.contains_key(&root) {
            return;
        }
        self.enter(root);
        let mut path = vec![(root, successors(root).into_iter())];
        while let Some((f, rest)) = path.last_mut() {
            let f = *f;
            match rest.next() {
                Some(g) => match self.visits.get(&g) {
                    None => {
                        self.enter(g);
                        path.push((g, successors(g).into_iter()));
                    }
                    Some(seen) if seen.on_stack => {
                        let low = seen.low;
                        self.lower(f, low);
                        if f == g {
                            self.found.recursive.insert(f);
                        }
                    }
                    Some(_) => {}
                },
                None => {
                    path.pop();
                    if let Some((parent, _)) = path.last() {
                        let low = self.visits[&f].low;
                        self.lower(*parent, low);
                    }
                    self.leave(f);
                }
            }
        }
    }

    fn enter(&mut self, f: FunctionId) {
        let index = self.visits.len();
        self.visits.insert(f, Visit { index, low: index, on_stack: true });
        self.stack.push(f);
    }

    fn lower(&mut self, f: FunctionId, low: usize) {
        if let Some(visit) = self.visits.get_mut(&f) {
            visit.low = visit.low.min(low);
        }
    }

    /// Closes a component if f is its root.
    fn leave(&mut self, f: FunctionId) {
        if self.visits[&f].low != self.visits[&f].index {
            return;
        }
        let start = self.stack.iter().rposition(|g| *g == f).unwrap_or(0);
        let members = self.stack.split_off(start);
        let several = members.len() > 1;
        for g in members.into_iter().rev() {
            if let Some(visit) = self.visits.get_mut(&g) {
                visit.on_stack = false;
            }
            if several {
                self.found.recursive.insert(g);
            }
            self.found.component.insert(g, f);
            self.found.order.push(g);
        }
    }
}

impl Module {
    /// Drops the functions that the roots do not reach, and gives the roots their new ids.
    pub fn drop_unreached(&mut self, roots: &mut [FunctionId]) {
        let mut kept = References::new(self, roots).order;
        kept.sort_unstable();
        let mut renumbered = vec![FunctionId(u32::MAX); self.functions.len()];
        for (new, old) in kept.iter().enumerate() {
            renumbered[old.0 as usize] = FunctionId(new as u32);
        }
        let mut functions = std::mem::take(&mut self.functions);
        self.functions = kept.iter().map(|old| std::mem::take(&mut functions[old.0 as usize])).collect();
        for node in self.functions.iter_mut().flat_map(|f| &mut f.nodes) {
            if !node.op.functions().is_empty() {
                node.op = node.op.map_functions(|f| renumbered[f.0 as usize]);
            }
        }
        let by_hand = std::mem::take(&mut self.by_hand).into_iter();
        let kept = by_hand.filter(|(f, _)| renumbered[f.0 as usize] != FunctionId(u32::MAX));
        self.by_hand = kept
            .map(|(f, d)| (renumbered[f.0 as usize], ByHand { function: renumbered[d.function.0 as usize], ..d }))
            .collect();
        for root in roots {
            *root = renumbered[root.0 as usize];
        }
    }

    /// A copy with what the roots reach; the other functions are empty, so that ids stay.
    #[must_use]
    pub fn reached(&self, roots: &[FunctionId]) -> Module {
        let mut functions = vec![Function::default(); self.functions.len()];
        for id in References::new(self, roots).order {
            functions[id.0 as usize] = self.function(id).clone();
        }
        let by_hand = self.by_hand.iter().filter(|(f, _)| !functions[f.0 as usize].results.is_empty());
        let by_hand = by_hand.map(|(f, d)| (*f, d.clone())).collect();
        Module { functions, failures: self.failures.clone(), by_hand, limits: self.limits }
    }

    /// Takes over the functions of a copy beyond the first `shared`, which were there when it was made. The result gives
    /// the new ids. (What the copy has made of the others it keeps: they compute the same.)
    pub fn adopt(&mut self, copy: Module, shared: usize) -> impl Fn(FunctionId) -> FunctionId + use<> {
        let first = self.functions.len();
        let shift = move |id: FunctionId| match (id.0 as usize).checked_sub(shared) {
            Some(beyond) => FunctionId((first + beyond) as u32),
            None => id,
        };
        for mut function in copy.functions.into_iter().skip(shared) {
            for node in &mut function.nodes {
                if !node.op.functions().is_empty() {
                    node.op = node.op.map_functions(shift);
                }
            }
            self.functions.push(function);
        }
        shift
    }
}
