//! Distances from the texels to the scan.

use super::without_sag;
use crate::model::Texels;

/// Distances from texels to the scan along the surface's normal. Sign convention: positive = the scan lies outside
/// the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Deviations {
    /// The origins of the rays. The arrays below have an entry for every texel, in its order.
    pub texels: Texels,
    /// Length of the rays. Millimetres.
    pub max_distance: f64,
    /// Distance to the scan along +normal; NaN where the ray met nothing within `max_distance`.
    pub outward: Vec<f32>,
    /// Distance to the scan along -normal, positive; NaN if there is none.
    pub inward: Vec<f32>,
    /// Whether a closed hole of the scan is nearer than the scan: such a texel
    /// has no distance, since nothing was measured there. Empty if no holes were closed.
    pub filled: Vec<bool>,
    /// Whether the surface there is inside of the model's own material, where nothing can be measured: such texels
    /// are no part of any statistic. Empty where that is not known.
    pub buried: Vec<bool>,
    /// Whether the surface there has no distance, and stands where the scan shows empty space. Empty where that is not
    /// known.
    pub contradicted: Vec<bool>,
    /// Whether the texel has no distance because what its ray meets belongs to another place of the model, or to a
    /// spike of the scan. Empty where no hit was refused.
    pub ambiguous: Vec<bool>,
    /// Whether what the texel sees of the scan is a triangle across an edge or a step: it is no point of its part, and
    /// decides no verdict. Empty where none does.
    pub bridged: Vec<bool>,
    /// How far the triangle of the scan that the texel sees lies off a surface through its corners that is curved as
    /// the model is, positive outside; NaN where that is not known. Empty where it is known nowhere, as of clouds.
    /// Millimetres.
    pub sag: Vec<f32>,
    /// Standard uncertainty of a distance to a cloud, by the scatter of the points about the texel; NaN where there is
    /// no distance. Empty for distances to triangles, whose noise is that of the points. Millimetres.
    pub uncertainty: Vec<f32>,
    /// Standard deviation of the scan's noise along its normals; 0 where it is not known. Millimetres.
    pub noise: f64,
    /// Standard deviation, along the normals, of the rounding of the scan's coordinates in the file, where that is
    /// coarse beside the noise: a whole face may be off by it, so that no mean is free of it. The noise and the
    /// uncertainties hold it. Millimetres.
    pub rounding: f64,
    /// The rounding of the distances, which are computed in single precision: those that differ by less are equal.
    /// Millimetres.
    pub precision: f64,
    /// Cosine of the angle between the direction of texel i's ray and the surface's own normal, if normals are averaged
    /// ([`DistanceKind::AveragedNormal`](super::DistanceKind)); empty if rays follow the surface's normals.
    pub cosine: Vec<f32>,
}

impl Deviations {
    /// Exact distances along the surface's own normals, of which nothing else is known: no texel is filled, buried,
    /// contradicted or ambiguous, and the scan has no noise. `max_distance` and the distances are in millimetres, one
    /// of these for every texel.
    #[must_use]
    pub fn new(texels: Texels, max_distance: f64, outward: Vec<f32>, inward: Vec<f32>) -> Self {
        Self {
            texels,
            max_distance,
            outward,
            inward,
            filled: Vec::new(),
            buried: Vec::new(),
            contradicted: Vec::new(),
            ambiguous: Vec::new(),
            bridged: Vec::new(),
            sag: Vec::new(),
            uncertainty: Vec::new(),
            noise: 0.0,
            rounding: 0.0,
            precision: 0.0,
            cosine: Vec::new(),
        }
    }

    /// Takes the rounding of the scan's coordinates into account, by its standard deviation along the normals in
    /// millimetres: noise is at least that, and the uncertainty of the distance to a cloud holds it beside the scatter.
    pub(in crate::variance) fn round(&mut self, rounding: f64) {
        self.rounding = rounding;
        self.noise = self.noise.max(rounding);
        self.uncertainty.iter_mut().for_each(|u| *u = u.hypot(rounding as f32));
    }

    /// Whether the ray of texel i meets a closed hole of the scan.
    #[must_use]
    pub fn is_filled(&self, i: usize) -> bool {
        self.filled.get(i).copied().unwrap_or(false)
    }

    /// Whether texel i is inside of the model's own material.
    #[must_use]
    pub fn is_buried(&self, i: usize) -> bool {
        self.buried.get(i).copied().unwrap_or(false)
    }

    /// Whether texel i stands where the scan shows empty space.
    #[must_use]
    pub fn is_contradicted(&self, i: usize) -> bool {
        self.contradicted.get(i).copied().unwrap_or(false)
    }

    /// Whether what the ray of texel i meets belongs elsewhere.
    #[must_use]
    pub fn is_ambiguous(&self, i: usize) -> bool {
        self.ambiguous.get(i).copied().unwrap_or(false)
    }

    /// Whether texel i sees a triangle across an edge or a step.
    #[must_use]
    pub fn is_bridged(&self, i: usize) -> bool {
        self.bridged.get(i).copied().unwrap_or(false)
    }

    /// Marks texels as seeing triangles across edges: those that bridge edges of the model, and moved ones.
    pub(in crate::variance) fn mark_bridged(&mut self, mut bridges: Vec<bool>, moved: &[bool]) {
        bridges.iter_mut().zip(moved).for_each(|(bridged, moved)| *bridged |= moved);
        self.bridged = if bridges.contains(&true) { bridges } else { Vec::new() };
    }

    /// Removes distances of texels along +normal or -normal. Texels that have none left are ambiguous.
    pub(in crate::variance) fn refuse(&mut self, refused: &[(usize, [bool; 2])]) {
        if refused.is_empty() {
            return;
        }
        self.ambiguous = vec![false; self.outward.len()];
        for &(i, [outward, inward]) in refused {
            if outward {
                self.outward[i] = f32::NAN;
            }
            if inward {
                self.inward[i] = f32::NAN;
            }
            self.ambiguous[i] = self.along(i).is_nan();
        }
    }

    /// Marks texels as standing in empty space, which says more than that they are ambiguous.
    pub(in crate::variance) fn contradict(&mut self, contradicted: Vec<bool>) {
        for (ambiguous, contradicted) in self.ambiguous.iter_mut().zip(&contradicted) {
            *ambiguous &= !contradicted;
        }
        self.contradicted = contradicted;
    }

    /// Marks texels as buried and removes what their rays have met.
    pub(in crate::variance) fn bury(&mut self, buried: Vec<bool>) {
        for i in (0..buried.len()).filter(|i| buried[*i]) {
            (self.outward[i], self.inward[i]) = (f32::NAN, f32::NAN);
            if let Some(filled) = self.filled.get_mut(i) {
                *filled = false;
            }
        }
        self.buried = buried;
    }

    /// The deviation of texel i in millimetres, perpendicular to the surface: the nearer of the two hits, positive
    /// outward; NaN if there is none ("no data"). A distance along an averaged normal is multiplied by the cosine,
    /// which gives the distance of a scan that is parallel to the surface. All statistics are of these.
    #[must_use]
    pub fn signed(&self, i: usize) -> f32 {
        self.along(i) * self.cosine.get(i).copied().unwrap_or(1.0)
    }

    /// The deviation of texel i [without the sag](without_sag) of the scan's triangle. Millimetres.
    #[must_use]
    pub fn without_sag(&self, i: usize) -> f32 {
        without_sag(self.signed(i), self.sag.get(i).copied().unwrap_or(f32::NAN))
    }

    /// The signed distance of texel i along its ray in millimetres, by which the surface is displaced to lie on the
    /// scan.
    #[must_use]
    pub fn along(&self, i: usize) -> f32 {
        let (outward, inward) = (self.outward[i], self.inward[i]);
        match (outward.is_nan(), inward.is_nan()) {
            (true, true) => f32::NAN,
            (false, true) => outward,
            (true, false) => -inward,
            (false, false) if outward <= inward => outward,
            (false, false) => -inward,
        }
    }
}
