//! Dropping what no result needs.

use super::{Function, Value};

impl Function {
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
        let mut renumbered = vec![Value(u32::MAX); self.nodes.len()];
        let mut kept = Vec::with_capacity(self.nodes.len());
        for (i, mut node) in std::mem::take(&mut self.nodes).into_iter().enumerate() {
            if used[i] {
                renumbered[i] = Value(kept.len() as u32);
                node.op = node.op.map_operands(|v| renumbered[v.0 as usize]);
                kept.push(node);
            }
        }
        self.nodes = kept;
        for result in &mut self.results {
            *result = renumbered[result.0 as usize];
        }
    }
}
