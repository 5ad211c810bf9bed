//! What casting rays from every texel found.

use crate::model::Texels;

/// Distances from texels to the scan along the surface's normal. Sign convention: positive = the scan lies outside
/// the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Deviations {
    /// From where; the arrays below have an entry for every texel, in its order.
    pub texels: Texels,
    /// How far rays went. Millimetres.
    pub max_distance: f64,
    /// Distance to the scan along +normal; NaN where the ray met nothing within `max_distance`.
    pub outward: Vec<f32>,
    /// Distance to the scan along -normal, positive; NaN likewise.
    pub inward: Vec<f32>,
    /// Whether what is nearest is a hole of the scan that was closed ([`FilledHoles`](super::FilledHoles)): such a texel has no distance, since nothing was
    /// measured there. Empty where no holes were closed.
    pub filled: Vec<bool>,
    /// Cosine of the angle between the direction in which texel i looks and the surface's own normal there, where normals are averaged
    /// ([`average_normals`](super::average_normals)); empty where texels look along the surface's normals.
    pub cosine: Vec<f32>,
}

impl Deviations {
    /// Whether texel i looks at a hole of the scan that was closed.
    #[must_use]
    pub fn is_filled(&self, i: usize) -> bool {
        self.filled.get(i).copied().unwrap_or(false)
    }

    /// The deviation of texel i: the nearer of the two hits, positive outward; NaN where there is none ("no data"). Perpendicular to the
    /// surface: what was found along an averaged normal counts as far as a scan parallel to the surface is away from it. All
    /// figures are of these.
    #[must_use]
    pub fn signed(&self, i: usize) -> f32 {
        self.along(i) * self.cosine.get(i).copied().unwrap_or(1.0)
    }

    /// Likewise the distance in the direction in which texel i looks, by which the surface is displaced to lie on the scan.
    #[must_use]
    pub fn along(&self, i: usize) -> f32 {
        let (out, inw) = (self.outward[i], self.inward[i]);
        match (out.is_nan(), inw.is_nan()) {
            (true, true) => f32::NAN,
            (false, true) => out,
            (true, false) => -inw,
            (false, false) if out <= inw => out,
            (false, false) => -inw,
        }
    }
}
