//! Whether a closed mesh goes round every place once or not at all.

use super::MOST_FOR_THIN;
use super::integrals::fine;
use super::reach::{may_reach, reaching};
use crate::bvh::Bvh;
use crate::mesh::{Group, TriangleMesh};
use crate::model::{CHORD_OF_THIN, EvaluationError, Instance, Model, Tessellation, Winding, bodies};
use crate::sampling::{halton, in_triangle};
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

/// How near surfaces are that touch, in chords: the triangles of both are off by one each.
const CHORDS_OF_CONTACT: f64 = 3.0;

/// Places beside a mesh: the winding numbers above and below its triangles.
struct Beside {
    place: DVec3,
    normal: DVec3,
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
            let (s, t) = in_triangle(halton(k + 1, 0), halton(k + 1, 1));
            let place = a + (b - a) * s + (c - a) * t;
            let sides = [aside, -aside].map(|aside| winding.at(place + aside * normal).round() as i32);
            Beside { place, normal, sides, area: area / count }
        };
        (0..count as usize).map(look).collect()
    };
    // Of very many triangles some stand for all.
    let step = ((mesh.triangles.len() as f64 / LOOKED_AT) as usize).max(1);
    mesh.triangles.par_iter().step_by(step).flat_map_iter(beside).collect()
}

/// Where the bodies of a mesh touch: triangles of surfaces that coincide, as those of a bolt in its nut, pass through
/// each other by their chords.
struct Contacts {
    bvh: Bvh,
    /// Of every triangle.
    normals: Vec<DVec3>,
    bodies: Vec<usize>,
    /// How near surfaces are that touch. Millimetres.
    near: f64,
}

impl Contacts {
    /// None where there is one body, which does not touch another.
    fn new(mesh: &TriangleMesh, chord: f64) -> Option<Self> {
        let of_groups = bodies(mesh.groups.iter().map(|group| group.name.as_str()));
        if of_groups.iter().all(|body| *body == 0) {
            return None;
        }
        let in_group = |(group, body): (&Group, usize)| std::iter::repeat_n(body, group.end - group.start);
        let bodies = mesh.groups.iter().zip(of_groups).flat_map(in_group).collect();
        let normals = mesh.triangles.iter().map(|t| mesh.triangle_normal(*t).unwrap_or_default()).collect();
        Some(Self { bvh: Bvh::build(mesh).ok()?, normals, bodies, near: CHORDS_OF_CONTACT * chord })
    }

    /// Whether a body faces another one at a place.
    fn is_at(&self, beside: &Beside) -> bool {
        let (mut own, mut opposite) = (None, Vec::new());
        self.bvh.all_within(beside.place, self.near, |found| {
            let triangle = found.triangle as usize;
            let along = self.normals[triangle].dot(beside.normal);
            if along < -0.5 {
                opposite.push(self.bodies[triangle]);
            } else if along > 0.5 && own.is_none_or(|(distance, _)| found.distance < distance) {
                own = Some((found.distance, self.bodies[triangle]));
            }
        });
        own.is_some_and(|(_, own)| opposite.iter().any(|other| *other != own))
    }
}

/// Those of some places at which a winding number is strange, if these stand for more area than may be wrong; those at
/// which bodies touch do not count, where the chord of the triangles is given.
fn strange<'b>(
    mesh: &TriangleMesh,
    places: &'b [Beside],
    chord: Option<f64>,
    is_strange: impl Fn(i32) -> bool,
) -> Vec<&'b Beside> {
    let mut found: Vec<&Beside> = places.iter().filter(|place| place.sides.iter().any(|n| is_strange(*n))).collect();
    if let Some(contacts) = chord.filter(|_| !found.is_empty()).and_then(|chord| Contacts::new(mesh, chord)) {
        found.retain(|place| !contacts.is_at(place));
    }
    let area = |sum: f64, place: &Beside| sum + place.area;
    let is_worth_it = found.iter().copied().fold(0.0, area) > STRAY * places.iter().fold(0.0, area);
    if is_worth_it { found } else { Vec::new() }
}

/// Whether a closed mesh goes round every place once or not at all, so that the volumes of its bodies add up. With the
/// chord of its triangles, bodies that touch are not taken for bodies in each other.
pub(crate) fn simply_enclosed(mesh: &TriangleMesh, chord: Option<f64>) -> Result<(), NoVolume> {
    let places = beside(mesh);
    if !strange(mesh, &places, chord, |number| !(0..=1).contains(&number)).is_empty() {
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
    if let Some(place) = twice_enclosed(mesh, None) {
        return Ok(Some(Overlap { place, of_bodies: of_bodies(model, instance)? }));
    }
    if !may_reach(mesh) {
        return Ok(None);
    }
    Ok(reaching(&fine(model, instance)?.mesh).map(|place| Overlap { place, of_bodies: Some(place) }))
}

/// Where the bodies of a model lie in each other, by fine triangles: those of surfaces that coincide do so by chords,
/// so that finer ones decide.
fn of_bodies(model: &dyn Model, instance: &dyn Instance) -> Result<Option<[f64; 3]>, EvaluationError> {
    let fine = fine(model, instance)?;
    let Some(place) = twice_enclosed(&fine.mesh, None) else { return Ok(reaching(&fine.mesh)) };
    if fine.mesh.triangles.len() > MOST_FOR_THIN || !may_reach(&fine.mesh) {
        return Ok(Some(place));
    }
    let finer = Tessellation::relative(model, instance, CHORD_OF_THIN)?;
    Ok(twice_enclosed(&finer.mesh, Some(finer.chord)).or_else(|| reaching(&finer.mesh)))
}

/// A place beside a closed mesh that it goes round more than once.
fn twice_enclosed(mesh: &TriangleMesh, chord: Option<f64>) -> Option<[f64; 3]> {
    let places = beside(mesh);
    let found = strange(mesh, &places, chord, |number| number > 1);
    found.get(found.len() / 2).map(|beside| beside.place.to_array())
}
