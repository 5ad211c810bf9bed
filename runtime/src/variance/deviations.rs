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
}

impl Deviations {
    /// The signed distance of texel i: the nearer of the two hits, positive outward; NaN where there is none ("no data").
    #[must_use]
    pub fn signed(&self, i: usize) -> f32 {
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
