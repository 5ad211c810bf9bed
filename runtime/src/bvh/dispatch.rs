//! The choice between code for eight lanes and for four, by what the processor has.

use super::Bvh;
use super::packet::{BothWays, HitCriteria, Line, Octant};

impl Bvh {
    /// Casts lines of one octant, eight at a time where the processor can, else four. The hits are the same, bit by
    /// bit.
    pub(super) fn cast_octant(&self, lines: &[Line], octant: Octant, criteria: HitCriteria, hits: &mut [BothWays]) {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has what the function was compiled for.
            return unsafe { self.cast_eight(lines, octant, criteria, hits) };
        }
        self.cast_groups::<4, 4>(lines, octant, criteria, hits);
    }

    /// Calling this is unsafe only because the processor may lack the instructions that it is compiled to.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn cast_eight(&self, lines: &[Line], octant: Octant, criteria: HitCriteria, hits: &mut [BothWays]) {
        self.cast_groups::<8, 2>(lines, octant, criteria, hits);
    }
}
