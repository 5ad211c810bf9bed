//! Whether a closed mesh goes round every place once or not at all.

use crate::mesh::TriangleMesh;
use crate::model::Winding;
use crate::sampling::halton;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Why there is no volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum NoVolume {
    /// Some border belongs to one part, or one triangle, only.
    #[serde(rename = "it is not closed")]
    Open,
    /// Parts lie in the material of others, or on them, so that volumes of bodies do not add up.
    #[serde(rename = "its parts overlap")]
    Overlapping,
    /// All of its surface is there twice, once facing each way.
    #[serde(rename = "it has no inside")]
    Flat,
}

impl NoVolume {
    /// The reason as JSON has it.
    #[must_use]
    pub fn text(self) -> &'static str {
        match self {
            Self::Open => "it is not closed",
            Self::Overlapping => "its parts overlap",
            Self::Flat => "it has no inside",
        }
    }
}

/// Places of the triangles beside which the winding number is looked at, by area.
const LOOKED_AT: f64 = 4000.0;

/// How far from the triangles, as a share of the mesh's size: thinner walls have no volume to speak of.
const BESIDE: f64 = 1e-7;

/// The share of their area that may be wrong: where parts meet, chords cross a little, and beside tangent edges a great
/// many triangles have next to no area.
const STRAY: f64 = 2e-3;

/// Whether a closed mesh goes round every place once or not at all, so that the volumes of its bodies add up.
pub(crate) fn simply_enclosed(mesh: &TriangleMesh) -> Result<(), NoVolume> {
    let winding = Winding::new(mesh.triangles.iter().map(|t| mesh.corners(*t)).collect());
    let aside = BESIDE * mesh.bounds().diagonal();
    let whole = mesh.area();
    // The winding numbers on both sides, with the area that a place stands for.
    let beside = |triangle: &[u32; 3]| -> Vec<([i32; 2], f64)> {
        let [a, b, c] = mesh.corners(*triangle);
        let Some(normal) = mesh.triangle_normal(*triangle) else { return Vec::new() };
        let area = mesh.triangle_area(*triangle);
        let count = (LOOKED_AT * area / whole).ceil();
        let look = |k: usize| {
            let [mut s, mut t] = [0, 1].map(|dimension| halton(k + 1, dimension));
            if s + t > 1.0 {
                (s, t) = (1.0 - s, 1.0 - t);
            }
            let place = a + (b - a) * s + (c - a) * t;
            ([aside, -aside].map(|aside| winding.at(place + aside * normal).round() as i32), area / count)
        };
        (0..count as usize).map(look).collect()
    };
    // Of very many triangles some stand for all.
    let step = ((mesh.triangles.len() as f64 / LOOKED_AT) as usize).max(1);
    let numbers: Vec<([i32; 2], f64)> = mesh.triangles.par_iter().step_by(step).flat_map_iter(beside).collect();
    let is_strange = |sides: &[i32; 2]| sides.iter().any(|number| !(0..=1).contains(number));
    let strange: f64 = numbers.iter().filter(|(sides, _)| is_strange(sides)).map(|(_, area)| area).sum();
    if strange > STRAY * numbers.iter().map(|(_, area)| area).sum::<f64>() {
        return Err(NoVolume::Overlapping);
    }
    if numbers.iter().all(|(sides, _)| *sides == [0, 0]) { Err(NoVolume::Flat) } else { Ok(()) }
}
