//! Shapes in which parameters of the same quantity have changed places. Where the scan leaves values open, any of a
//! block's three lengths may be the one that was cut away: which they are, only a bore may tell that was cut away too.

use super::largest;
use super::turned::{Turned, Turns};
use crate::fit::optimise::gauss_newton::{self, Stop};
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::objective::Objective;
use crate::fit::problem::parameterization::Estimate;
use crate::fit::tuning::{
    NAMES_AGAIN, NAMES_PLACED, NAMES_REFINED, OPEN_VALUES, RIVAL_DEVIATIONS, RIVAL_ITERATIONS, RIVAL_STEP,
};
use crate::mesh::Bounds;
use crate::sampling::halton;
use glam::{DQuat, DVec3};
use rayon::prelude::*;

/// A shape by other names.
#[derive(Clone)]
pub(super) struct Named {
    pub(super) estimate: Estimate,
    /// The middle of its surface.
    pub(super) middle: DVec3,
    /// By free parameter, whether the scan leaves the value open that it has here.
    open: Vec<bool>,
}

/// A shape by other names where it explains the points best.
struct Placed {
    turned: Turned,
    shape: Named,
}

impl Turns<'_> {
    /// The solution by its own names.
    pub(super) fn named(&self) -> Named {
        let Self { base, middle, .. } = self;
        let open = (0..base.level().space.free.len()).map(|k| !base.uncertainty.determines(k)).collect();
        Named { estimate: base.estimate.clone(), middle: *middle, open }
    }

    /// The shapes in which two parameters of the same quantity have each taken the other's value: of those that differ,
    /// and that both may have.
    pub(super) fn exchanged(&self, of: &Named) -> Vec<Named> {
        let space = self.objective.space;
        let quantity = |k: usize| space.model.parameters()[space.free[k]].quantity;
        let pairs = (0..space.free.len()).flat_map(|a| (a + 1..space.free.len()).map(move |b| (a, b)));
        let alike = pairs.filter(|(a, b)| quantity(*a) == quantity(*b) && !(of.open[*a] && of.open[*b]));
        alike.filter_map(|(a, b)| self.with_exchanged(of, a, b)).collect()
    }

    fn with_exchanged(&self, of: &Named, a: usize, b: usize) -> Option<Named> {
        let space = self.objective.space;
        let (mut x, mut open) = (space.x(&of.estimate.z)?, of.open.clone());
        x.swap(space.free[a], space.free[b]);
        open.swap(a, b);
        let estimate = space.estimate(&x, of.estimate.motion);
        let step = space.step(&of.estimate, &estimate);
        let there = space.x(&estimate.z)?;
        let takes = |k: usize| {
            let (there, asked) = (there[space.free[k]], x[space.free[k]]);
            open[k] || (there - asked).abs() <= 1e-9 * asked.abs()
        };
        if !takes(a) || !takes(b) || !(largest(self.base.uncertainty, &[a, b], &step) > RIVAL_DEVIATIONS) {
            return None;
        }
        let exists = |estimate: Estimate| {
            let middle = self.objective.place(&estimate).ok()?.facets.moments().0;
            Some(Named { estimate, middle, open: open.clone() })
        };
        // A bore need not be inside of what is a side now: where it is, is open.
        exists(estimate.clone()).or_else(|| self.with_open_values(&estimate, &open).find_map(exists))
    }

    /// The same shape with other values all over the bounds where they are open; none where none is.
    fn with_open_values<'t>(&'t self, of: &'t Estimate, open: &'t [bool]) -> impl Iterator<Item = Estimate> + 't {
        let space = self.objective.space;
        let count = if open.contains(&true) { OPEN_VALUES } else { 0 };
        (1..=count).map(move |n| {
            let mut z = of.z.clone();
            for (axis, k) in (0..z.len()).filter(|k| open[*k]).enumerate() {
                let (low, high) = space.search_range(k, of.z[k], space.radius);
                z[k] = low + (high - low) * halton(n, axis);
            }
            Estimate { z, motion: of.motion }
        })
    }

    /// Other names of a shape of which the scan leaves values open, each in the best of some rotations and with the
    /// best values where they are open, which the solution's own loss tells; none of a shape that is seen as a whole.
    pub(super) fn renamed(&self, rotations: &[DQuat], own_loss: &Objective) -> Vec<Turned> {
        let own = self.named();
        if !own.open.contains(&true) || rotations.is_empty() {
            return Vec::new();
        }
        let placed = |shapes: Vec<Named>| -> Vec<Placed> {
            let best = |shape: Named| {
                let poses = rotations.iter().filter_map(|rotation| self.at_ends(&shape.estimate, *rotation));
                let turned = poses.min_by(|a, b| a.loss.total_cmp(&b.loss))?;
                Some(Placed { turned, shape })
            };
            let mut placed: Vec<Placed> = shapes.into_par_iter().filter_map(best).collect();
            placed.sort_by(|a, b| a.turned.loss.total_cmp(&b.turned.loss));
            placed
        };
        let mut found = placed(self.exchanged(&own));
        let mut new: Vec<Named> = Vec::new();
        for Placed { shape, .. } in found.iter().take(NAMES_AGAIN) {
            for other in self.exchanged(shape) {
                let known = found.iter().map(|known| &known.shape).chain(&new).chain([&own]);
                if known.into_iter().all(|known| !other.has_names_of(known)) {
                    new.push(other);
                }
            }
        }
        found.extend(placed(new));
        found.sort_by(|a, b| a.turned.loss.total_cmp(&b.turned.loss));
        found.truncate(NAMES_PLACED);
        let mut found: Vec<Turned> =
            found.into_par_iter().filter_map(|placed| self.elsewhere(placed, own_loss)).collect();
        found.sort_by(|a, b| a.loss.total_cmp(&b.loss));
        found.truncate(NAMES_REFINED);
        found
    }

    /// A shape near its optimum, and with the best values where they are open; none where it comes back to the
    /// solution's.
    fn elsewhere(&self, Placed { turned, shape }: Placed, own_loss: &Objective) -> Option<Turned> {
        let space = self.objective.space;
        let placed = self.with_best_open_values(turned, &shape.open, self.objective);
        let stop = Stop { iterations: RIVAL_ITERATIONS, step: RIVAL_STEP * self.objective.loss.sigma };
        let near = gauss_newton::minimise(self.objective, placed.estimate, stop)?.estimate;
        let members: Vec<usize> = (0..space.free.len()).collect();
        let step = space.step(&self.base.estimate, &near);
        if !(largest(self.base.uncertainty, &members, &step) > RIVAL_DEVIATIONS) {
            return None;
        }
        let best = self.with_best_open_values(Turned::by(own_loss, near), &shape.open, own_loss);
        let open = (0..space.free.len()).filter(|k| shape.open[*k]).collect();
        Some(Turned { open, ..best })
    }

    /// The best of a shape with other values where they are open, by an objective: along every axis, one of its ends
    /// stays where it is.
    fn with_best_open_values(&self, turned: Turned, open: &[bool], by: &Objective) -> Turned {
        let bounds = |at: &Estimate| self.objective.place(at).ok()?.facets.bounds();
        let Some(own) = bounds(&turned.estimate) else { return turned };
        let moved = |estimate: Estimate| {
            let there = bounds(&estimate)?;
            let shifts = ends(own.low - there.low, own.high - there.high, 0.0);
            let shifted = shifts.into_iter().map(|shift| {
                let Isometry { rotation, .. } = estimate.motion;
                let motion = Isometry::taking(rotation, DVec3::ZERO, estimate.motion.apply(shift));
                Turned::by(by, Estimate { motion, ..estimate.clone() })
            });
            shifted.min_by(|a, b| a.loss.total_cmp(&b.loss))
        };
        let others: Vec<Turned> = self.with_open_values(&turned.estimate, open).filter_map(moved).collect();
        others.into_iter().fold(turned, |best, other| if other.loss < best.loss { other } else { best })
    }

    /// A shape in a rotation, where it explains the points best with its surface ending where what is scanned ends, on
    /// one side or the other.
    fn at_ends(&self, shape: &Estimate, rotation: DQuat) -> Option<Turned> {
        let own = self.objective.place(shape).ok()?.facets.bounds()?;
        let back = rotation.inverse();
        let seen: Bounds = self.feet.iter().map(|foot| back * *foot).collect();
        let base = self.base.estimate.motion;
        let placed =
            ends(seen.low - own.low, seen.high - own.high, self.objective.loss.sigma).into_iter().map(|shift| {
                let to = base.apply(rotation * shift);
                let motion = Isometry::taking(base.rotation * rotation, DVec3::ZERO, to);
                self.at(Estimate { motion, ..shape.clone() })
            });
        placed.min_by(|a, b| a.loss.total_cmp(&b.loss))
    }
}

/// The shifts that bring the low ends or the high ends together along each axis, whose distances are given. What is not
/// farther `apart` is one.
fn ends(low: DVec3, high: DVec3, apart: f64) -> Vec<DVec3> {
    let mut shifts = vec![DVec3::ZERO];
    for (axis, unit) in DVec3::AXES.into_iter().enumerate() {
        let (low, high) = (low[axis], high[axis]);
        let either = if (low - high).abs() > apart { vec![low, high] } else { vec![0.5 * (low + high)] };
        let with = |shift: DVec3| either.iter().map(move |by| shift + *by * unit).collect::<Vec<_>>();
        shifts = shifts.into_iter().flat_map(with).collect();
    }
    shifts
}

impl Named {
    /// Whether the same parameters have the values that the scan shows.
    fn has_names_of(&self, other: &Self) -> bool {
        let shown = self.estimate.z.iter().zip(&other.estimate.z).zip(&self.open);
        self.open == other.open && shown.filter(|(_, open)| !**open).all(|((a, b), _)| a == b)
    }
}
