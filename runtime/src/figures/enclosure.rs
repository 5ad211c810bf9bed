//! Whether a closed mesh goes round every place once or not at all.

use super::integrals::fine;
use super::reach::{may_reach, reaching};
use crate::mesh::TriangleMesh;
use crate::model::{EvaluationError, Instance, Model, Winding};
use crate::sampling::halton;
use glam::DVec3;
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

/// Places beside a mesh: the winding numbers above and below its triangles.
struct Beside {
    place: DVec3,
    sides: [i32; 2],
    /// The area that the place stands for.
    area: f64,
}

/// Some thousands of places beside a mesh.
fn beside(mesh: &TriangleMesh) -> Vec<Beside> {
    let winding = Winding::new(mesh.triangles.iter().map(|t| mesh.corners(*t)).collect());
    let aside = BESIDE * mesh.bounds().diagonal();
    let whole = mesh.area();
    let beside = |triangle: &[u32; 3]| -> Vec<Beside> {
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
            let sides = [aside, -aside].map(|aside| winding.at(place + aside * normal).round() as i32);
            Beside { place, sides, area: area / count }
        };
        (0..count as usize).map(look).collect()
    };
    // Of very many triangles some stand for all.
    let step = ((mesh.triangles.len() as f64 / LOOKED_AT) as usize).max(1);
    mesh.triangles.par_iter().step_by(step).flat_map_iter(beside).collect()
}

/// Those of some places at which a winding number is strange, if these stand for more area than may be wrong.
fn strange(places: &[Beside], is_strange: impl Fn(i32) -> bool) -> Vec<&Beside> {
    let found: Vec<&Beside> = places.iter().filter(|place| place.sides.iter().any(|n| is_strange(*n))).collect();
    let area = |sum: f64, place: &Beside| sum + place.area;
    let is_worth_it = found.iter().copied().fold(0.0, area) > STRAY * places.iter().fold(0.0, area);
    if is_worth_it { found } else { Vec::new() }
}

/// Whether a closed mesh goes round every place once or not at all, so that the volumes of its bodies add up.
pub(crate) fn simply_enclosed(mesh: &TriangleMesh) -> Result<(), NoVolume> {
    let places = beside(mesh);
    if !strange(&places, |number| !(0..=1).contains(&number)).is_empty() {
        return Err(NoVolume::Overlapping);
    }
    if places.iter().all(|place| place.sides == [0, 0]) { Err(NoVolume::Flat) } else { Ok(()) }
}

/// Where the triangles of a closed mesh lie in each other.
#[derive(Clone, Copy, Debug)]
pub struct Overlap {
    /// One place of it. Millimetres.
    pub place: [f64; 3],
    /// The same of fine triangles; none where only the chord is too large for thin walls or gaps.
    pub of_bodies: Option<[f64; 3]>,
}

/// Where the triangles of a model's closed mesh lie in each other, if so much of them does that it is worth a sentence.
///
/// # Errors
/// The surface cannot be evaluated.
pub fn overlap(
    model: &dyn Model,
    instance: &dyn Instance,
    mesh: &TriangleMesh,
) -> Result<Option<Overlap>, EvaluationError> {
    if let Some(place) = twice_enclosed(mesh) {
        let fine = fine(model, instance)?;
        return Ok(Some(Overlap { place, of_bodies: twice_enclosed(&fine.mesh).or_else(|| reaching(&fine.mesh)) }));
    }
    if !may_reach(mesh) {
        return Ok(None);
    }
    Ok(reaching(&fine(model, instance)?.mesh).map(|place| Overlap { place, of_bodies: Some(place) }))
}

/// A place beside a closed mesh that it goes round more than once.
fn twice_enclosed(mesh: &TriangleMesh) -> Option<[f64; 3]> {
    let places = beside(mesh);
    let found = strange(&places, |number| number > 1);
    found.get(found.len() / 2).map(|beside| beside.place.to_array())
}
