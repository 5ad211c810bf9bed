//! The same surface by other parameters: a block turned by a right angle, its lengths exchanged, is the same block, and
//! a curve run backwards the same curve.

use super::base::Base;
use super::largest;
use crate::fit::optimise::gauss_newton::{self, Stop};
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::level::Level;
use crate::fit::problem::objective::Objective;
use crate::fit::problem::parameterization::Estimate;
use crate::fit::problem::points::Points;
use crate::fit::refine::schedule::Solution;
use crate::fit::tuning::{
    CHORD, RIVAL_DEVIATIONS, RIVAL_ITERATIONS, RIVAL_STEP, SAME_SURFACE_APART, SAME_SURFACE_PLACES,
};
use glam::DVec3;

impl Base<'_> {
    /// How far the parameters are from those of the start.
    pub(super) fn distance_to_start(&self, at: &Estimate) -> f64 {
        let Level { problem, space, .. } = self.level();
        let members: Vec<usize> = (0..space.free.len()).collect();
        let start = space.estimate(&problem.start.x, self.estimate.motion);
        space.normalised_distance(&members, at, &start, problem.radius)
    }

    /// The parameters and the pose by which a shape is the base's surface; None where it is another one. Where the scan
    /// leaves values open, as the width between open sides, the two need not have the same: then the shape takes the
    /// base's open values, or the base's values are exchanged as the shape has them, and the pose follows.
    pub(super) fn relabelled(&self, level: &Level, there: &Estimate) -> Option<Estimate> {
        if self.is_same_surface(level, there) {
            return Some(there.clone());
        }
        let ways = [self.with_own_open_values(there), self.exchanged_as(there)];
        ways.into_iter().flatten().find_map(|x| self.posed(&x, there))
    }

    /// A shape in the pose in which it is the base's surface, from the pose of another one. None where there is none.
    fn posed(&self, x: &[f64], there: &Estimate) -> Option<Estimate> {
        let space = &self.level().space;
        let motion = if space.moving { self.moved_onto_base(x, there.motion)? } else { there.motion };
        let same = space.estimate(x, motion);
        let level = self.level().around(&same).ok()?;
        self.is_same_surface(&level, &same).then_some(same)
    }

    /// The motion by which a shape comes next to the base's surface, from another motion.
    fn moved_onto_base(&self, x: &[f64], from: Isometry) -> Option<Isometry> {
        let Level { problem, space, .. } = self.level();
        let only_pose = space.of_motions(x);
        let start = only_pose.estimate(x, from);
        let posed = Level::new(problem, only_pose, &start, CHORD).ok()?;
        let own = places_of(&self.solution.objective(self.sample), &self.estimate, &inside(), &inside())?;
        let loss = self.solution.loss;
        let objective = Objective { tolerance: 0.1 * SAME_SURFACE_APART * loss.sigma, ..posed.objective(&own, loss) };
        let stop = Stop { iterations: RIVAL_ITERATIONS, step: RIVAL_STEP * loss.sigma };
        Some(gauss_newton::minimise(&objective, start, stop)?.estimate.motion)
    }

    /// A shape's parameters with the base's values where the scan leaves them open. None where it leaves none.
    fn with_own_open_values(&self, there: &Estimate) -> Option<Vec<f64>> {
        let space = &self.level().space;
        let mut x = space.x(&there.z)?;
        let open = || space.free.iter().enumerate().filter(|(k, _)| !self.uncertainty.determines(*k)).map(|(_, i)| *i);
        open().for_each(|i| x[i] = self.x[i]);
        (open().count() > 0).then_some(x)
    }

    /// The base's parameters with those pairs exchanged that a shape has exchanged. None where it has none.
    fn exchanged_as(&self, there: &Estimate) -> Option<Vec<f64>> {
        let space = &self.level().space;
        let far = |a: usize, b: usize, x: &[f64]| {
            let step = space.step(there, &space.estimate(x, there.motion));
            largest(self.uncertainty, &[a, b], &step)
        };
        let mut x = self.x.clone();
        for a in 0..space.free.len() {
            for b in a + 1..space.free.len() {
                let mut swapped = x.clone();
                swapped.swap(space.free[a], space.free[b]);
                if far(a, b, &x) > RIVAL_DEVIATIONS && far(a, b, &swapped) < RIVAL_DEVIATIONS {
                    x = swapped;
                }
            }
        }
        (x != self.x).then_some(x)
    }

    fn is_same_surface(&self, level: &Level, there: &Estimate) -> bool {
        let own = (self.level(), &self.estimate);
        self.lies_on(own, (level, there)) && self.lies_on((level, there), own)
    }

    /// Whether a shape lies on another one: the insides of its patches to the first distance, and their borders to the
    /// scan's spacing, since open ends are no better known.
    fn lies_on(&self, (of, shape): (&Level, &Estimate), (on, other): (&Level, &Estimate)) -> bool {
        let Solution { loss, level, .. } = self.solution;
        let (inside, ends) = (inside(), [0.0, 1.0]);
        let apart = SAME_SURFACE_APART * loss.sigma;
        let loosely = apart.max(level.problem.points.spacing());
        let none = Points::default();
        let near = |u: &[f64], v: &[f64], apart: f64| {
            let points = places_of(&of.objective(&none, *loss), shape, u, v)?;
            let objective = Objective { tolerance: 0.1 * apart, ..on.objective(&points, *loss) };
            let feet = objective.feet(&objective.place(other).ok()?);
            Some(feet.len() == points.len() && feet.iter().all(|(_, foot)| foot.d2 <= apart * apart))
        };
        let is_near = |u: &[f64], v: &[f64], apart: f64| near(u, v, apart).unwrap_or(false);
        is_near(&inside, &inside, apart) && is_near(&ends, &inside, loosely) && is_near(&inside, &ends, loosely)
    }
}

/// Values of u or v inside of a patch.
fn inside() -> Vec<f64> {
    (0..SAME_SURFACE_PLACES).map(|k| (f64::from(k) + 0.5) / f64::from(SAME_SURFACE_PLACES)).collect()
}

/// Places of all patches of a shape, at all pairs of some u and v. None where a patch does not exist.
fn places_of(objective: &Objective, at: &Estimate, u: &[f64], v: &[f64]) -> Option<Points> {
    let placed = objective.place(at).ok()?;
    let mut places = Vec::new();
    for patch in 0..objective.space.model.parts().len() {
        let mut points = vec![[0.0; 3]; u.len() * v.len()];
        placed.instance.points_grid(patch, u, v, &mut points).ok()?;
        places.extend(points.iter().map(|p| placed.motion.apply(DVec3::from_array(*p))));
    }
    places.iter().all(|p| p.is_finite()).then(|| Points::at(places))
}
