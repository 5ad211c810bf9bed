//! Packets in code for wider vectors, where the processor has them.

use super::Bvh;
use super::group::Lines;
use super::packet::{BothWays, Line, Octant, Search};

impl Bvh {
    /// Lines of one octant, eight at a time where the processor can, else four. What is found is the same, bit by bit.
    pub(super) fn cast_octant(&self, lines: &[Line], octant: Octant, search: Search, found: &mut [BothWays]) {
        let lines = Lines::new(lines);
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has what the function was compiled for.
            return unsafe { self.cast_eight(&lines, octant, search, found) };
        }
        self.cast_groups::<4, 4>(&lines, octant, search, found);
    }

    /// Safe but for the instructions that it is made of.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn cast_eight(&self, lines: &Lines, octant: Octant, search: Search, found: &mut [BothWays]) {
        self.cast_groups::<8, 2>(lines, octant, search, found);
    }
}
