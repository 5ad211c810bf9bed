//! Corners and steps along curves that are not lines of constant u or v.

use super::classify::{CORNER, STEP};
use super::{Gaps, Patch};
use crate::model::surface::Partials;
use crate::model::tessellation::normal;
use glam::{DVec2, DVec3};
use gml_compiler::program::EvaluationError;

/// Points of the lattice along u and along v.
const LATTICE: u32 = 33;

/// Most crossings between neighbouring points that are looked at.
const MOST_CROSSINGS: usize = 64;

/// How far apart both sides of a crossing are when they are compared. (Closer, the rounding of derivatives and a change
/// of decisions that rounds otherwise would count.)
const APART: f64 = 1e-9;

/// Whether the surface has a corner or a step where the decisions of both parameters change.
pub(super) fn is_oblique(patch: Patch<'_>, gaps: &Gaps, size: f64) -> Result<bool, EvaluationError> {
    let mut crossings = crossings(patch)?;
    let every = crossings.len().div_ceil(MOST_CROSSINGS).max(1);
    crossings = crossings.into_iter().step_by(every).collect();
    bisect(patch, &mut crossings)?;
    // On lines of constant u or v the breaks are known.
    let is_known = |c: &Crossing| {
        let near = |gaps: &[super::Gap], t: f64| gaps.iter().any(|g| g.before - APART < t && t < g.after + APART);
        near(&gaps[0], c.ends[0].x) || near(&gaps[1], c.ends[0].y)
    };
    crossings.retain(|c| !is_known(c));
    Ok(crossings.iter().any(|c| jumps(patch, c, size)))
}

/// A pair of sites between which the decisions of both parameters change.
struct Crossing {
    ends: [DVec2; 2],
    signatures: [f64; 2],
}

/// Crossings between neighbours of the lattice, whose points lie a little aside from lines on which symmetric surfaces
/// have their edges.
fn crossings(patch: Patch<'_>) -> Result<Vec<Crossing>, EvaluationError> {
    let n = LATTICE as usize;
    let at = |i: usize, aside: f64| (i as f64 + aside) / f64::from(LATTICE);
    let sites: Vec<DVec2> =
        (0..n * n).map(|k| DVec2::new(at(k % n, 0.4871 + 0.05 * ((k / n) as f64).sin()), at(k / n, 0.5217))).collect();
    let signatures = signatures(patch, &sites)?;
    let mut found = Vec::new();
    for k in 0..n * n {
        let right = (k % n + 1 < n).then_some(k + 1);
        let up = (k / n + 1 < n).then_some(k + n);
        for next in right.into_iter().chain(up).filter(|next| signatures[k] != signatures[*next]) {
            found.push(Crossing { ends: [sites[k], sites[next]], signatures: [signatures[k], signatures[next]] });
        }
    }
    Ok(found)
}

fn signatures(patch: Patch<'_>, sites: &[DVec2]) -> Result<Vec<f64>, EvaluationError> {
    let (u, v): (Vec<f64>, Vec<f64>) = sites.iter().map(|s| (s.x, s.y)).unzip();
    patch.oblique_signatures(&u, &v)
}

/// Brings the ends of crossings so close together as they are compared.
fn bisect(patch: Patch<'_>, crossings: &mut [Crossing]) -> Result<(), EvaluationError> {
    let widest = |all: &[Crossing]| all.iter().map(|c| c.ends[0].distance(c.ends[1])).fold(0.0, f64::max);
    while widest(crossings) > APART {
        let middles: Vec<DVec2> = crossings.iter().map(|c| (c.ends[0] + c.ends[1]) / 2.0).collect();
        for ((c, middle), signature) in crossings.iter_mut().zip(&middles).zip(signatures(patch, &middles)?) {
            let side = usize::from(signature != c.signatures[0]);
            c.ends[side] = *middle;
            c.signatures[side] = signature;
        }
    }
    Ok(())
}

/// Whether the surface or its normal jumps at a crossing. (The normal turns by its curvature, too, in between.)
fn jumps(patch: Patch<'_>, crossing: &Crossing, size: f64) -> bool {
    let [u, v] = [crossing.ends.map(|e| e.x), crossing.ends.map(|e| e.y)];
    let mut sides = [Partials::default(); 2];
    if patch.instance.partials(patch.patch, &u, &v, &mut sides).is_err() {
        return false;
    }
    let [a, b] = sides.map(|s| DVec3::from_array(s.point));
    let speed = |p: &Partials| DVec3::from_array(p.du).length() + DVec3::from_array(p.dv).length();
    if a.distance(b) > STEP * size + 2.0 * APART * (speed(&sides[0]) + speed(&sides[1])) {
        return true;
    }
    match [normal(&sides[0]), normal(&sides[1])] {
        [Some((a, _)), Some((b, _))] => a.distance(b) > CORNER,
        _ => false,
    }
}
