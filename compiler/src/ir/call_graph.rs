//! The graph of functions and those that they name.

use super::hash::{HashMap, HashSet};
use super::{CustomDerivative, Function, FunctionId, Module, Op};

/// The functions that some roots reach, with the strongly connected components of their references. Building it takes
/// time with what is reached, not with the module.
#[derive(Clone, Debug, Default)]
pub(crate) struct CallGraph {
    /// The reached functions, each after those that it names (except those in its own cycle).
    pub order: Vec<FunctionId>,
    recursive: HashSet<FunctionId>,
    component: HashMap<FunctionId, FunctionId>,
}

impl CallGraph {
    /// The graph below some roots.
    #[must_use]
    pub(crate) fn new(module: &Module, roots: &[FunctionId]) -> CallGraph {
        CallGraph::along(module, roots, |_| true)
    }

    /// The graph below some roots along only the operations that `follow` accepts.
    #[must_use]
    pub(crate) fn along(module: &Module, roots: &[FunctionId], follow: impl Fn(&Op) -> bool) -> CallGraph {
        let mut search =
            Search { module, follow, visited: HashMap::default(), stack: Vec::new(), graph: CallGraph::default() };
        for root in roots {
            search.visit(*root);
        }
        search.graph
    }

    /// Whether a function can come to run itself.
    #[must_use]
    pub(crate) fn is_recursive(&self, function: FunctionId) -> bool {
        self.recursive.contains(&function)
    }

    /// Whether two functions are in one cycle, or are one.
    #[must_use]
    pub(crate) fn in_one_cycle(&self, f: FunctionId, g: FunctionId) -> bool {
        self.component.get(&f) == self.component.get(&g)
    }
}

/// Tarjan's algorithm for strongly connected components (Depth-first search and linear graph algorithms, 1972).
struct Search<'m, F> {
    module: &'m Module,
    follow: F,
    /// The rank of every visited function in the order of the visits; `None` once its component is complete.
    visited: HashMap<FunctionId, Option<usize>>,
    stack: Vec<FunctionId>,
    graph: CallGraph,
}

impl<F: Fn(&Op) -> bool> Search<'_, F> {
    /// Visits a function; returns the lowest rank among the incomplete functions that it reaches.
    fn visit(&mut self, f: FunctionId) -> usize {
        if let Some(visit) = self.visited.get(&f) {
            return visit.unwrap_or(usize::MAX);
        }
        let rank = self.visited.len();
        self.visited.insert(f, Some(rank));
        self.stack.push(f);
        let mut low = rank;
        for g in self.successors(f) {
            // A script decides how deep the references go.
            low = low.min(stacker::maybe_grow(32 << 10, 1 << 20, || self.visit(g)));
            if f == g {
                self.graph.recursive.insert(f);
            }
        }
        if low == rank {
            self.complete(f);
        }
        low
    }

    fn successors(&self, f: FunctionId) -> Vec<FunctionId> {
        let ops = self.module.function(f).nodes.iter().map(|node| &node.op).filter(|op| (self.follow)(op));
        // A custom derivative is run where its function is called.
        let custom = self.module.custom_derivatives.get(&f).map(|d| d.function);
        let custom = custom.filter(|d| (self.follow)(&Op::Call { function: *d, args: Vec::new() }));
        ops.flat_map(Op::functions).chain(custom).collect()
    }

    /// Takes the component whose first visited function is `f` from the stack.
    fn complete(&mut self, f: FunctionId) {
        let start = self.stack.iter().rposition(|g| *g == f).unwrap_or(0);
        let members = self.stack.split_off(start);
        if members.len() > 1 {
            self.graph.recursive.extend(&members);
        }
        for g in members.into_iter().rev() {
            self.visited.insert(g, None);
            self.graph.component.insert(g, f);
            self.graph.order.push(g);
        }
    }
}

impl Module {
    /// Drops the functions that the roots do not reach, and gives the roots their new ids.
    pub fn drop_unreached(&mut self, roots: &mut [FunctionId]) {
        let mut reached = CallGraph::new(self, roots).order;
        reached.sort_unstable();
        let mut renumbered = vec![None; self.functions.len()];
        for (new, old) in reached.iter().enumerate() {
            renumbered[old.0 as usize] = Some(FunctionId(new as u32));
        }
        let new_id = |id: FunctionId| renumbered[id.0 as usize].unwrap_or(id);
        let mut functions = std::mem::take(&mut self.functions);
        self.functions = reached.iter().map(|old| std::mem::take(&mut functions[old.0 as usize])).collect();
        for node in self.functions.iter_mut().flat_map(|f| &mut f.nodes) {
            node.op.replace_functions(new_id);
        }
        let custom = std::mem::take(&mut self.custom_derivatives).into_iter();
        self.custom_derivatives = custom
            .filter_map(|(f, d)| {
                Some((renumbered[f.0 as usize]?, CustomDerivative { function: new_id(d.function), ..d }))
            })
            .collect();
        roots.iter_mut().for_each(|root| *root = new_id(*root));
    }

    /// A copy with what the roots reach; the other functions are empty, so that ids stay.
    #[must_use]
    pub fn reached(&self, roots: &[FunctionId]) -> Module {
        let mut functions = vec![Function::default(); self.functions.len()];
        for id in CallGraph::new(self, roots).order {
            functions[id.0 as usize] = self.function(id).clone();
        }
        let custom = self.custom_derivatives.iter().filter(|(f, _)| !functions[f.0 as usize].results.is_empty());
        let custom_derivatives = custom.map(|(f, d)| (*f, d.clone())).collect();
        Module { functions, failures: self.failures.clone(), custom_derivatives, limits: self.limits }
    }

    /// Takes over the functions of a copy beyond the first `shared`, which were there when it was made. The result maps
    /// the copy's ids to the new ones. (What a pass made of the shared functions in the copy is left: it computes the
    /// same.)
    pub fn adopt(&mut self, copy: Module, shared: usize) -> impl Fn(FunctionId) -> FunctionId + use<> {
        let first = self.functions.len();
        let shift = move |id: FunctionId| match (id.0 as usize).checked_sub(shared) {
            Some(beyond) => FunctionId((first + beyond) as u32),
            None => id,
        };
        for mut function in copy.functions.into_iter().skip(shared) {
            function.nodes.iter_mut().for_each(|node| node.op.replace_functions(shift));
            self.functions.push(function);
        }
        shift
    }
}
