//! Creases: edges along which patches meet, or the two sides of a break.

use super::CANCELLED;
use super::segments::Segment;
use crate::bvh::{Bvh, ClosestPoint};
use crate::model::Tessellation;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Points of one patch are on different sheets of it if their parameters differ by more than this.
const APART: f64 = 0.25;

/// ... or if the cosine of the angle between their normals is below this.
const ALIKE: f64 = 0.9998;

/// Smaller corrections are rounding: the patches are tangent.
const SMOOTH: f64 = 1e-6;

/// A patch near a point of an edge.
#[derive(Clone, Copy, Debug)]
struct Sheet {
    patch: u32,
    /// (u, v) of the nearest point.
    parameters: [f64; 2],
    point: DVec3,
    normal: DVec3,
    distance: f64,
}

/// The sheets that meet at a point of an edge, with the corrections of their normals.
struct Junction(Vec<(Sheet, DVec3)>);

/// For every patch the segments along which it meets others, or itself at a break, with the corrections of its normals.
/// The tessellation has origins.
pub(super) fn find(tessellation: &Tessellation, bvh: &Bvh, tolerance: f64) -> Vec<Vec<Segment>> {
    let mut creases = vec![Vec::new(); tessellation.mesh.groups.len()];
    for line in &tessellation.lines {
        let junctions: Vec<Junction> =
            line.iter().map(|i| junction(tessellation, bvh, *i as usize, tolerance)).collect();
        for pair in junctions.windows(2) {
            for (patch, segment) in segments(&pair[0], &pair[1]) {
                creases[patch as usize].push(segment);
            }
        }
    }
    creases
}

/// The sheets that meet at a vertex.
fn junction(tessellation: &Tessellation, bvh: &Bvh, vertex: usize, tolerance: f64) -> Junction {
    let mut sheets: Vec<Sheet> = Vec::new();
    bvh.all_within(tessellation.mesh.positions[vertex].into(), tolerance, |found| {
        let Some(sheet) = sheet(tessellation, &found) else { return };
        match sheets.iter_mut().find(|s| same(s, &sheet)) {
            // The nearest triangle of a sheet gives its normal.
            Some(known) if sheet.distance < known.distance => *known = sheet,
            Some(_) => {}
            None => sheets.push(sheet),
        }
    });
    let mean: DVec3 = sheets.iter().map(|s| angle(s.parameters) * s.normal).sum();
    if mean.length() < CANCELLED {
        return Junction(Vec::new());
    }
    let mean = mean.normalize();
    Junction(sheets.into_iter().map(|s| (s, mean - s.normal)).collect())
}

/// The sheet to which a point of a triangle belongs.
fn sheet(tessellation: &Tessellation, found: &ClosestPoint) -> Option<Sheet> {
    let corners = tessellation.mesh.triangles[found.triangle as usize].map(|i| i as usize);
    let origins = corners.map(|i| tessellation.origins[i]);
    let mix = |values: [f64; 3]| (0..3).map(|k| found.weights[k] * values[k]).sum::<f64>();
    let normal: DVec3 =
        corners.iter().zip(found.weights).map(|(i, w)| w * DVec3::from(tessellation.mesh.normals[*i])).sum();
    Some(Sheet {
        patch: origins[0].patch,
        parameters: [mix(origins.map(|o| o.u)), mix(origins.map(|o| o.v))],
        point: found.point,
        normal: normal.try_normalize()?,
        distance: found.distance,
    })
}

fn same(a: &Sheet, b: &Sheet) -> bool {
    let near = |k: usize| (a.parameters[k] - b.parameters[k]).abs() <= APART;
    a.patch == b.patch && near(0) && near(1) && a.normal.dot(b.normal) > ALIKE
}

/// The angle of a patch at a point of its boundary, approximately: a quarter turn at a corner, otherwise half a turn.
fn angle(parameters: [f64; 2]) -> f64 {
    let at_end = |t: f64| !(1e-6..=1.0 - 1e-6).contains(&t);
    if at_end(parameters[0]) && at_end(parameters[1]) { FRAC_PI_2 } else { PI }
}

/// Segments from each sheet at a junction to the same sheet at the next, if its normal is corrected at both.
fn segments<'a>(from: &'a Junction, to: &'a Junction) -> impl Iterator<Item = (u32, Segment)> + 'a {
    from.0.iter().filter_map(|(sheet, correction)| {
        let difference = |other: &Sheet| {
            (0..2).map(|k| (other.parameters[k] - sheet.parameters[k]).abs()).sum::<f64>()
                - other.normal.dot(sheet.normal)
        };
        let others = to.0.iter().filter(|(other, _)| other.patch == sheet.patch);
        let (other, next) = others.min_by(|(a, _), (b, _)| difference(a).total_cmp(&difference(b)))?;
        let creased = correction.length() > SMOOTH && next.length() > SMOOTH;
        let segment = Segment { ends: [sheet.point, other.point], corrections: [*correction, *next] };
        creased.then_some((sheet.patch, segment))
    })
}
