//! Which functions name which.

use super::{ByHand, FunctionId, Module, Op};

/// The functions that some roots reach, with the strongly connected components of their references.
#[derive(Clone, Debug)]
pub struct References {
    /// Reached functions, each after the functions that it names (but for those in its own cycle).
    pub order: Vec<FunctionId>,
    recursive: Vec<bool>,
    component: Vec<usize>,
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
        let n = module.functions.len();
        let mut search = Search {
            index: vec![None; n],
            low: vec![0; n],
            on_stack: vec![false; n],
            stack: Vec::new(),
            visited: 0,
            found: References { order: Vec::new(), recursive: vec![false; n], component: vec![usize::MAX; n] },
        };
        let successors = |f: usize| -> Vec<usize> {
            let nodes = &module.functions[f].nodes;
            let ops = nodes.iter().map(|node| &node.op).filter(|op| follow(op));
            // A derivative by hand is run where its function is called.
            let by_hand = module.by_hand.get(&FunctionId(f as u32)).map(|d| d.function);
            let by_hand = by_hand.filter(|d| follow(&Op::Call { function: *d, args: Vec::new() }));
            ops.flat_map(Op::functions).chain(by_hand).map(|g| g.0 as usize).collect()
        };
        for root in roots {
            search.from(root.0 as usize, &successors);
        }
        search.found
    }

    /// Whether a function can come to run itself.
    #[must_use]
    pub fn is_recursive(&self, function: FunctionId) -> bool {
        self.recursive[function.0 as usize]
    }

    /// Whether two functions are in one cycle, or are one.
    #[must_use]
    pub fn in_one_cycle(&self, f: FunctionId, g: FunctionId) -> bool {
        self.component[f.0 as usize] == self.component[g.0 as usize]
    }
}

/// Tarjan's algorithm ("Depth-first search and linear graph algorithms", 1972) without recursion, since a script
/// decides how deep the references go.
struct Search {
    index: Vec<Option<usize>>,
    low: Vec<usize>,
    on_stack: Vec<bool>,
    stack: Vec<usize>,
    visited: usize,
    found: References,
}

impl Search {
    fn from(&mut self, root: usize, successors: &impl Fn(usize) -> Vec<usize>) {
        if self.index[root].is_some() {
            return;
        }
        self.enter(root);
        let mut path = vec![(root, successors(root).into_iter())];
        while let Some((f, rest)) = path.last_mut() {
            let f = *f;
            match rest.next() {
                Some(g) if self.index[g].is_none() => {
                    self.enter(g);
                    path.push((g, successors(g).into_iter()));
                }
                Some(g) => {
                    if self.on_stack[g] {
                        self.low[f] = self.low[f].min(self.index[g].unwrap_or(0));
                        self.found.recursive[f] |= f == g;
                    }
                }
                None => {
                    path.pop();
                    if let Some((parent, _)) = path.last() {
                        self.low[*parent] = self.low[*parent].min(self.low[f]);
                    }
                    self.leave(f);
                }
            }
        }
    }

    fn enter(&mut self, f: usize) {
        self.index[f] = Some(self.visited);
        self.low[f] = self.visited;
        self.visited += 1;
        self.stack.push(f);
        self.on_stack[f] = true;
    }

    /// Closes a component if f is its root.
    fn leave(&mut self, f: usize) {
        if Some(self.low[f]) != self.index[f] {
            return;
        }
        let start = self.stack.iter().rposition(|g| *g == f).unwrap_or(0);
        let members = self.stack.split_off(start);
        let several = members.len() > 1;
        for g in members.into_iter().rev() {
            self.on_stack[g] = false;
            self.found.recursive[g] |= several;
            self.found.component[g] = f;
            self.found.order.push(FunctionId(g as u32));
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
}
