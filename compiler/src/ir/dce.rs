//! Dropping what no result needs.

use super::{Binary, Function, Op, Unary, Value};

impl Function {
    /// Of each parameter, whether a node or a result uses it.
    #[must_use]
    pub fn used_params(&self) -> Vec<bool> {
        let mut used = vec![false; self.params.len()];
        let mut mark = |v: Value| {
            if let Some(used) = used.get_mut(v.0 as usize) {
                *used = true;
            }
        };
        self.nodes.iter().for_each(|n| n.op.visit_operands(&mut mark));
        self.results.iter().copied().for_each(&mut mark);
        used
    }

    /// Drops the nodes that no result needs and renumbers the rest. Parameters stay.
    pub fn drop_unused(&mut self) {
        let mut used = vec![false; self.nodes.len()];
        used[..self.params.len()].fill(true);
        for result in &self.results {
            used[result.0 as usize] = true;
        }
        for i in (0..self.nodes.len()).rev() {
            if used[i] {
                self.nodes[i].op.visit_operands(|v| used[v.0 as usize] = true);
            }
        }
        if used.iter().all(|used| *used) {
            return;
        }
        let mut renumbered = vec![Value(u32::MAX); self.nodes.len()];
        let mut kept = Vec::with_capacity(self.nodes.len());
        for (i, mut node) in std::mem::take(&mut self.nodes).into_iter().enumerate() {
            if used[i] {
                renumbered[i] = Value(kept.len() as u32);
                node.op.for_each_operand(|v| *v = renumbered[v.0 as usize]);
                kept.push(node);
            }
        }
        self.nodes = kept;
        for result in &mut self.results {
            *result = renumbered[result.0 as usize];
        }
    }

    /// Makes `-(x - y)` to `y - x`, where nothing else uses the difference. (The builder cannot know that nothing will;
    /// it prefers a negation, which sums and products absorb, to a second difference.)
    pub(super) fn turn_differences(&mut self) {
        if !self.nodes.iter().any(|n| matches!(n.op, Op::Unary(Unary::Neg, _))) {
            return;
        }
        let mut uses = vec![0_usize; self.nodes.len()];
        for node in &self.nodes {
            node.op.visit_operands(|v| uses[v.0 as usize] += 1);
        }
        self.results.iter().for_each(|r| uses[r.0 as usize] += 1);
        let mut turned = false;
        for i in 0..self.nodes.len() {
            if let Op::Unary(Unary::Neg, a) = self.nodes[i].op
                && let Op::Binary(Binary::Sub, x, y) = *self.op(a)
                && uses[a.0 as usize] == 1
            {
                self.nodes[i].op = Op::Binary(Binary::Sub, y, x);
                turned = true;
            }
        }
        if turned {
            self.drop_unused();
        }
    }
}
