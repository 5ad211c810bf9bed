//! The probability of conformance of each texel.

use super::footprints::Footprint;
use super::rule::{Estimate, probability};
use crate::variance::{Deviations, Tolerance};

/// Writes the probability that the surface at each texel of a part is within its tolerance, by the texel's own
/// deviation with the noise of a single point of the scan. `common` are standard uncertainties that neighbouring texels
/// share, one for each footprint. Millimetres.
pub(super) fn fill(
    map: &mut [f32],
    deviations: &Deviations,
    tolerance: Tolerance,
    noise: f64,
    footprints: &[Footprint],
    common: &[f64],
) {
    for (footprint, common) in footprints.iter().zip(common) {
        let sd = noise.hypot(*common);
        for i in footprint.texels.iter().map(|i| *i as usize) {
            let estimate = Estimate { value: f64::from(deviations.without_sag(i)), sd };
            map[i] = probability(tolerance, [estimate; 2]) as f32;
        }
    }
}
