//! Dead-code elimination.

use super::{Binary, Function, Op, Unary, Value};

impl Function {
    /// For each node, whether it is one of some values or one of them is computed from it.
    #[must_use]
    pub(super) fn needed_by(&self, values: impl IntoIterator<Item = Value>) -> Vec<bool> {
        let mut needed = vec![false; self.nodes.len()];
        values.into_iter().for_each(|v| needed[v.0 as usize] = true);
        for i in (0..self.nodes.len()).rev() {
            if needed[i] {
                self.nodes[i].op.visit_operands(|v| needed[v.0 as usize] = true);
            }
        }
        needed
    }

    /// For each parameter, whether a result needs it.
    #[must_use]
    pub fn used_params(&self) -> Vec<bool> {
        let mut used = self.needed_by(self.results.iter().copied());
        used.truncate(self.params.len());
        used
    }

    /// Drops the nodes that no result needs and renumbers the others. Parameters stay.
    pub fn drop_unused(&mut self) {
        let mut used = self.needed_by(self.results.iter().copied());
        used[..self.params.len()].fill(true);
        if used.iter().all(|used| *used) {
            return;
        }
        let mut renumbered = vec![Value::NONE; self.nodes.len()];
        let mut live = Vec::with_capacity(self.nodes.len());
        for (i, mut node) in std::mem::take(&mut self.nodes).into_iter().enumerate() {
            if used[i] {
                renumbered[i] = Value(live.len() as u32);
                node.op.replace_operands(|v| renumbered[v.0 as usize]);
                live.push(node);
            }
        }
        self.nodes = live;
        for result in &mut self.results {
            *result = renumbered[result.0 as usize];
        }
    }

    /// Rewrites `-(x - y)` to `y - x` where nothing else uses the difference. (While it builds, the builder cannot know
    /// whether another use follows; it prefers a negation, which sums and products absorb, to a second difference.)
    pub(super) fn reverse_negated_differences(&mut self) {
        if !self.nodes.iter().any(|n| matches!(n.op, Op::Unary(Unary::Neg, _))) {
            return;
        }
        let mut uses = vec![0_usize; self.nodes.len()];
        for node in &self.nodes {
            node.op.visit_operands(|v| uses[v.0 as usize] += 1);
        }
        self.results.iter().for_each(|r| uses[r.0 as usize] += 1);
        let mut reversed = false;
        for i in 0..self.nodes.len() {
            if let Op::Unary(Unary::Neg, a) = self.nodes[i].op
                && let Op::Binary(Binary::Sub, x, y) = *self.op(a)
                && uses[a.0 as usize] == 1
            {
                self.nodes[i].op = Op::Binary(Binary::Sub, y, x);
                reversed = true;
            }
        }
        if reversed {
            self.drop_unused();
        }
    }
}
