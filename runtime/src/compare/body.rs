//! Areas and volumes of surfaces.

use super::prepared::Prepared;
use crate::mesh::TriangleMesh;
use crate::model::{
    Breaks, Closedness, EvaluationError, Fineness, Instance, Model, Partials, Tessellation, Winding, spans,
};
use crate::sampling::halton;
use crate::variance::{MeasureError, enclosed_volume};
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The sizes of a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// Corners of the bounding box: the least coordinates. Millimetres.
    pub low: [f64; 3],
    /// The greatest coordinates.
    pub high: [f64; 3],
    /// Area of all of the surface. Square millimetres.
    pub area: f64,
    /// The volume that it encloses, if it is closed. Cubic millimetres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub volume: Option<f64>,
    /// Why there is no volume.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub without_volume: Option<NoVolume>,
}

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

/// The sizes of a surface.
pub(super) fn of(prepared: &Prepared<'_>) -> Result<Body, MeasureError> {
    let surface = &prepared.surface;
    let mesh = &surface.tessellation.mesh;
    let bounds = mesh.bounds();
    let (area, volume) = match &surface.parametrised {
        None => {
            let enclosed = enclosed_volume(mesh).map(f64::abs).ok_or(NoVolume::Open);
            (mesh.area(), enclosed.and_then(|volume| simply_enclosed(mesh).map(|()| volume)))
        }
        Some(model) => {
            let instance = &*model.reach.instance;
            let integrals = integrals(model.reach.model, instance, mesh.bounds().centre())?;
            let signed = |(i, inverted): (&Integral, &bool)| if *inverted { -i.volume } else { i.volume };
            let volume: f64 = integrals.iter().zip(&surface.inverted).map(signed).sum();
            let volume = match () {
                () if !Closedness::of(model.reach.model, instance)?.is_closed() => Err(NoVolume::Open),
                () if surface.buried.contains(&true) => Err(NoVolume::Overlapping),
                () => simply_enclosed(mesh).map(|()| volume),
            };
            (integrals.iter().map(|i| i.area).sum(), volume)
        }
    };
    let (low, high) = (bounds.low.into(), bounds.high.into());
    Ok(Body { low, high, area, volume: volume.ok(), without_volume: volume.err() })
}

/// The integrals over all patches; of trimmed ones over what is there of them.
fn integrals(model: &dyn Model, instance: &dyn Instance, origin: DVec3) -> Result<Vec<Integral>, EvaluationError> {
    let patches = model.parts().len();
    let fine = match model.is_trimmed() {
        true => {
            let diagonal = Tessellation::rough_diagonal(model, instance, 8)?;
            let fineness = Fineness { chord: FINE_CHORD * diagonal, ..Fineness::default() };
            Tessellation::new(model, instance, fineness)?.mesh
        }
        false => TriangleMesh::default(),
    };
    let of_patch = |patch: usize| match model.keep(patch) {
        Some(_) => Ok(Integral::of_triangles(&fine, fine.groups[patch].start..fine.groups[patch].end, origin)),
        None => Integral::of_patch(instance, patch, origin),
    };
    (0..patches).into_par_iter().map(of_patch).collect()
}

/// Places of the triangles beside which the winding number is looked at, by area.
const LOOKED_AT: f64 = 4000.0;

/// How far from the triangles, as a share of the mesh's size: thinner walls have no volume to speak of.
const BESIDE: f64 = 1e-7;

/// The share of these places that may be wrong: where parts meet, chords cross a little.
const STRAY: f64 = 2e-3;

/// Whether a closed mesh goes round every place once or not at all, so that the volumes of its bodies add up.
fn simply_enclosed(mesh: &TriangleMesh) -> Result<(), NoVolume> {
    let winding = Winding::new(mesh.triangles.iter().map(|t| mesh.corners(*t)).collect());
    let aside = BESIDE * mesh.bounds().diagonal();
    let whole = mesh.area();
    let beside = |triangle: &[u32; 3]| -> Vec<[i32; 2]> {
        let [a, b, c] = mesh.corners(*triangle);
        let Some(normal) = mesh.triangle_normal(*triangle) else { return Vec::new() };
        let count = (LOOKED_AT * mesh.triangle_area(*triangle) / whole).ceil();
        let look = |k: usize| {
            let [mut s, mut t] = [0, 1].map(|dimension| halton(k + 1, dimension));
            if s + t > 1.0 {
                (s, t) = (1.0 - s, 1.0 - t);
            }
            let place = a + (b - a) * s + (c - a) * t;
            [aside, -aside].map(|aside| winding.at(place + aside * normal).round() as i32)
        };
        (0..count as usize).map(look).collect()
    };
    // Of very many triangles some stand for all.
    let step = ((mesh.triangles.len() as f64 / LOOKED_AT) as usize).max(1);
    let numbers: Vec<[i32; 2]> = mesh.triangles.par_iter().step_by(step).flat_map_iter(beside).collect();
    let strange = numbers.iter().filter(|sides| sides.iter().any(|number| !(0..=1).contains(number))).count();
    if strange as f64 > STRAY * numbers.len() as f64 {
        return Err(NoVolume::Overlapping);
    }
    if numbers.iter().all(|sides| *sides == [0, 0]) { Err(NoVolume::Flat) } else { Ok(()) }
}

/// Abscissae and weights of Gauss and Legendre's rule of four points on [-1, 1].
const GAUSS: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

/// Cells each way of every smooth stretch of a patch: at first and at most; they are doubled until area and volume
/// change by less than this, relative to the area and to the area times its root.
const FIRST_CELLS: usize = 4;
const MOST_CELLS: usize = 128;
const SETTLED: f64 = 1e-9;

/// How far the triangles leave the surface by which trimmed patches are integrated, as a part of the model's diagonal:
/// areas and volumes are then exact to some 1e-4.
const FINE_CHORD: f64 = 2e-5;

/// Integrals over a patch.
#[derive(Clone, Copy, Debug, Default)]
struct Integral {
    /// Of |dS/du x dS/dv|. Square millimetres.
    area: f64,
    /// Of S . (dS/du x dS/dv) / 3, from a place near it: of a closed surface the volume. Cubic millimetres.
    volume: f64,
}

impl Integral {
    fn of_triangles(mesh: &TriangleMesh, triangles: Range<usize>, origin: DVec3) -> Self {
        let mut sum = Self::default();
        for triangle in &mesh.triangles[triangles] {
            let [a, b, c] = mesh.corners(*triangle).map(|corner| corner - origin);
            let across = 0.5 * (b - a).cross(c - a);
            sum.area += across.length();
            sum.volume += a.dot(across) / 3.0;
        }
        sum
    }

    fn of_patch(instance: &dyn Instance, patch: usize, origin: DVec3) -> Result<Self, EvaluationError> {
        let breaks = Breaks::of_patch(instance, patch)?;
        let stretches = [&breaks.u, &breaks.v]
            .map(|breaks| spans(breaks.iter().map(|b| (b.before, b.after))).collect::<Vec<(f64, f64)>>());
        let most = MOST_CELLS / stretches[0].len().max(stretches[1].len()).clamp(1, MOST_CELLS / FIRST_CELLS);
        let mut cells = FIRST_CELLS;
        let mut last = Self::on_grid(instance, patch, origin, &stretches, cells)?;
        while 2 * cells <= most {
            cells *= 2;
            let next = Self::on_grid(instance, patch, origin, &stretches, cells)?;
            let settled = (next.area - last.area).abs() <= SETTLED * next.area
                && (next.volume - last.volume).abs() <= SETTLED * next.area * next.area.sqrt();
            last = next;
            if settled {
                break;
            }
        }
        Ok(last)
    }

    fn on_grid(
        instance: &dyn Instance,
        patch: usize,
        origin: DVec3,
        stretches: &[Vec<(f64, f64)>; 2],
        cells: usize,
    ) -> Result<Self, EvaluationError> {
        let nodes = |stretches: &Vec<(f64, f64)>| -> (Vec<f64>, Vec<f64>) {
            let node = |(start, end): (f64, f64), cell: usize, (x, weight): (f64, f64)| {
                let half = 0.5 * (end - start) / cells as f64;
                (start + half * ((2 * cell + 1) as f64 + x), half * weight)
            };
            let all = stretches.iter().flat_map(|stretch| {
                (0..cells).flat_map(move |cell| GAUSS.into_iter().map(move |gauss| node(*stretch, cell, gauss)))
            });
            all.unzip()
        };
        let [(u, along), (v, across)] = [nodes(&stretches[0]), nodes(&stretches[1])];
        let mut partials = vec![Partials::default(); u.len() * v.len()];
        instance.partials_grid(patch, &u, &v, &mut partials)?;
        let mut sum = Self::default();
        for (row, weight) in partials.chunks_exact(u.len()).zip(across) {
            for (p, other) in row.iter().zip(&along) {
                let normal = weight * other * DVec3::from(p.du).cross(DVec3::from(p.dv));
                sum.area += normal.length();
                sum.volume += (DVec3::from(p.point) - origin).dot(normal) / 3.0;
            }
        }
        Ok(sum)
    }
}
