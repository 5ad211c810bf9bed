//! Integrals over patches: area, enclosed volume and its moments, with their derivatives by the parameters.
//!
//! The derivative of what a closed surface encloses is an integral of the motion along the normal (Hadamard's formula;
//! Delfour and Zolésio, Shapes and Geometries, 2011): edges that move between two patches add as much to the one as
//! they take from the other. That of an area has the stretch of the surface, and at the edge of a trimmed patch how
//! fast the edge moves outwards.

use super::edges;
use super::rule::Rule;
use crate::model::{EvaluationError, Instance, Model, Partials, Tessellation};
use glam::DVec3;
use rayon::prelude::*;
use std::borrow::Borrow;
use std::ops::{AddAssign, Range};

/// How far the triangles by which trimmed patches are integrated leave the surface, as a part of the model's diagonal.
/// What lies between a chord and the edge is added as a parabola: a bore in a plate of ten times its radius is then
/// exact to 1e-6.
const CHORD: f64 = 1e-4;

/// Integrals over a patch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sums {
    /// Of |N|, with N = dS/du x dS/dv. Square millimetres.
    pub(crate) area: f64,
    /// Of (S - o) . N / 3, from a place o near it: of a closed surface the volume. Cubic millimetres.
    pub(crate) volume: f64,
    /// Of (S - o)_k^2 N_k / 2: of a closed surface the integrals of the coordinates from o over what it encloses.
    pub(crate) moments: [f64; 3],
}

impl Sums {
    pub(super) fn add(&mut self, weight: f64, p: &Partials, origin: DVec3) {
        let normal = weight * DVec3::from(p.du).cross(DVec3::from(p.dv));
        let from = DVec3::from(p.point) - origin;
        self.area += if weight < 0.0 { -normal.length() } else { normal.length() };
        self.volume += from.dot(normal) / 3.0;
        let moments = 0.5 * from * from * normal;
        *self += Self { moments: moments.into(), ..Self::default() };
    }
}

impl AddAssign for Sums {
    fn add_assign(&mut self, other: Self) {
        self.area += other.area;
        self.volume += other.volume;
        for (sum, moment) in self.moments.iter_mut().zip(other.moments) {
            *sum += moment;
        }
    }
}

/// The integrals over all patches, of trimmed ones over what is there of them.
pub(crate) fn over_patches(
    model: &dyn Model,
    instance: &dyn Instance,
    origin: DVec3,
) -> Result<Vec<Sums>, EvaluationError> {
    let patches: Vec<usize> = (0..model.parts().len()).collect();
    let rules = rules(model, instance, &patches, || fine(model, instance))?;
    patches.par_iter().zip(&rules).map(|(patch, rule)| rule.sums(instance, *patch, origin)).collect()
}

/// The triangles by which trimmed patches are integrated, and which say how patches meet.
pub(super) fn fine(model: &dyn Model, instance: &dyn Instance) -> Result<Tessellation, EvaluationError> {
    Tessellation::relative(model, instance, CHORD)
}

/// The rules of some patches; `fine` makes the triangles, if one of them needs them.
pub(super) fn rules<T: Borrow<Tessellation>>(
    model: &dyn Model,
    instance: &dyn Instance,
    patches: &[usize],
    fine: impl FnOnce() -> Result<T, EvaluationError>,
) -> Result<Vec<Rule>, EvaluationError> {
    let whole = |patch: &usize| match model.keep(*patch) {
        Some(_) => Ok(None),
        None => Rule::of_patch(instance, *patch),
    };
    let whole: Vec<Option<Rule>> = patches.par_iter().map(whole).collect::<Result<_, _>>()?;
    if whole.iter().all(Option::is_some) {
        return Ok(whole.into_iter().flatten().collect());
    }
    let fine = fine()?;
    let fine: &Tessellation = fine.borrow();
    let numbers = fine.mesh.position_numbers();
    // The triangles follow corners, too.
    let of_triangles = |patch: &usize| Rule::of_triangles(instance, fine, *patch, model.keep(*patch), &numbers);
    patches.par_iter().zip(whole).map(|(patch, rule)| rule.map_or_else(|| of_triangles(patch), Ok)).collect()
}

/// Places at which motions are evaluated at once: for 100 parameters they take some 50 MB.
const BATCH: usize = 4096;

/// The derivatives of the integrals over a patch by every parameter of the model.
pub(super) fn gradient(
    model: &dyn Model,
    instance: &dyn Instance,
    rule: &Rule,
    patch: usize,
    origin: DVec3,
) -> Result<Vec<Sums>, EvaluationError> {
    let mut gradient = vec![Sums::default(); model.parameters().len()];
    let active = &model.parts()[patch].active;
    let partials = rule.partials(instance, patch)?;
    for first in (0..partials.len()).step_by(BATCH) {
        let batch = first..partials.len().min(first + BATCH);
        let motions = Motions::new(instance, patch, rule, batch.clone(), active.len())?;
        for (i, (p, weight)) in partials[batch.clone()].iter().zip(&rule.weights[batch]).enumerate() {
            let (du, dv) = (DVec3::from(p.du), DVec3::from(p.dv));
            let normal = du.cross(dv);
            let unit = normal.normalize_or_zero();
            let from = DVec3::from(p.point) - origin;
            for (a, parameter) in active.iter().enumerate() {
                let k = i * active.len() + a;
                let swept = weight * motions.here[k].dot(normal);
                let [motion_u, motion_v] = motions.slopes(i, k);
                gradient[*parameter as usize] += Sums {
                    area: weight * unit.dot(motion_u.cross(dv) + du.cross(motion_v)),
                    volume: swept,
                    moments: (from * swept).into(),
                };
            }
        }
    }
    if let Some(keep) = model.keep(patch) {
        for (parameter, flux) in edges::flux(&rule.edges, instance, [patch, keep], model.keep_active(patch))? {
            gradient[parameter as usize].area += flux;
        }
    }
    Ok(gradient)
}

/// How the points at some places of a rule move by each of the patch's active parameters, and beside them.
struct Motions {
    here: Vec<DVec3>,
    /// Beside each place in u and in v: the motions before and after it, and the distances between these two.
    beside: [([Vec<DVec3>; 2], Vec<f64>); 2],
}

impl Motions {
    fn new(
        instance: &dyn Instance,
        patch: usize,
        rule: &Rule,
        places: Range<usize>,
        active: usize,
    ) -> Result<Self, EvaluationError> {
        let at = [&rule.u[places.clone()], &rule.v[places.clone()]];
        let motion = |u: &[f64], v: &[f64]| -> Result<Vec<DVec3>, EvaluationError> {
            let mut out = vec![0.0; u.len() * active * 3];
            instance.jacobian(patch, u, v, &mut out)?;
            Ok(out.chunks_exact(3).map(DVec3::from_slice).collect())
        };
        let beside = |axis: usize| {
            let shifted = |sign: f64| -> Vec<f64> {
                let shift = |(t, steps): (&f64, &[f64; 2])| (t + sign * steps[axis]).clamp(0.0, 1.0);
                at[axis].iter().zip(&rule.steps[places.clone()]).map(shift).collect()
            };
            let (before, after) = (shifted(-1.0), shifted(1.0));
            let moved = |t: &[f64]| if axis == 0 { motion(t, at[1]) } else { motion(at[0], t) };
            let distances = before.iter().zip(&after).map(|(a, b)| b - a).collect();
            Ok(([moved(&before)?, moved(&after)?], distances))
        };
        Ok(Self { here: motion(at[0], at[1])?, beside: [beside(0)?, beside(1)?] })
    }

    /// The derivatives of a motion by u and by v at place i of the batch; k is its index among all motions.
    fn slopes(&self, i: usize, k: usize) -> [DVec3; 2] {
        self.beside.each_ref().map(|([before, after], distances)| (after[k] - before[k]) / distances[i])
    }
}
