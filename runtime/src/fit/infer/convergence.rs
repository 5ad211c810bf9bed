//! Whether a fit stands at an optimum: the step that Newton's method would still take, against the standard deviations
//! of the coordinates, whatever optimiser came here and whatever made it stop. A fit that has stalled goes on in other
//! ways.

use super::pose::within_itself;
use super::sandwich::Uncertainty;
use crate::fit::optimise::gauss_newton::{Minimum, Stop};
use crate::fit::optimise::in_box::pushed;
use crate::fit::optimise::{gauss_newton, lbfgs};
use crate::fit::problem::objective::{Objective, Order};
use crate::fit::problem::parameterization::Estimate;
use crate::fit::refine::schedule::{POLISH, Solution, foot_tolerance};
use crate::fit::tuning::{
    AVERAGED_PAIRS, AVERAGED_REACH, EQUAL_FITS, HELD_NOISE, HELD_STEP, MANY_POINTS, POLISH_ITERATIONS, RESUMED_STEP,
    SETTLED_ROUNDING, SETTLED_STEP, STALLED_NAMED,
};
use crate::sampling::halton;
use nalgebra::DVector;

/// A solution of which it is known whether it is an optimum.
pub(crate) struct Assessed<'a> {
    /// With `converged` as it was found here.
    pub(crate) solution: Solution<'a>,
    /// None where the fit was cancelled or the scan determines nothing.
    pub(crate) uncertainty: Option<Uncertainty>,
    /// Why it is no optimum.
    pub(crate) warning: Option<String>,
}

/// A way on from a place at which an optimiser has stopped short of the optimum.
#[derive(Clone, Copy)]
enum Continuation {
    /// Gauss-Newton again, down to shorter steps and from little damping.
    GaussNewton,
    /// The step that remains, with a gradient and a Hessian that are averaged over correspondence switches.
    Averaged,
    /// L-BFGS, whose steps need no model of the distances, then Gauss-Newton.
    QuasiNewton,
    /// A place a standard deviation beside this one, then Gauss-Newton.
    Beside,
}

const CONTINUATIONS: [Continuation; 7] = {
    use Continuation::{Averaged, Beside, GaussNewton, QuasiNewton};
    [GaussNewton, Averaged, Averaged, QuasiNewton, Averaged, Beside, Averaged]
};

impl Continuation {
    /// Whether it takes an optimisation from another place or by another optimiser.
    fn is_long(self) -> bool {
        matches!(self, Self::QuasiNewton | Self::Beside)
    }
}

/// A solution with its uncertainty and the step that remains.
struct Candidate<'a> {
    solution: Solution<'a>,
    uncertainty: Uncertainty,
    remaining: Remaining,
}

/// The step that Newton's method would still take.
struct Remaining {
    /// By scaled local coordinates. Millimetres.
    step: DVector<f64>,
    /// The standard deviations of the coordinates. Millimetres.
    unit: Vec<f64>,
}

/// Decides whether a solution is an optimum, and goes on from one that is not.
pub(crate) fn assess(mut solution: Solution) -> Assessed {
    let problem = solution.level.problem;
    // A user who has cancelled does not wait for standard deviations.
    let uncertainty = if problem.monitor.cancelled() { None } else { super::uncertainty(&solution) };
    let Some(uncertainty) = uncertainty else {
        let cancelled = problem.monitor.cancelled();
        let warning = (!cancelled && !solution.converged).then(|| "the last stage did not converge".to_owned());
        solution.converged &= !cancelled;
        return Assessed { solution, uncertainty: None, warning };
    };
    let mut at = Candidate::new(solution, uncertainty);
    for way in CONTINUATIONS {
        if at.is_near_enough() || way.is_long() && at.is_lost_in_noise() || problem.monitor.cancelled() {
            break;
        }
        at = at.on(way);
    }
    at.concluded()
}

impl<'a> Candidate<'a> {
    fn new(solution: Solution<'a>, uncertainty: Uncertainty) -> Self {
        let remaining = Remaining::of(&solution, &solution.evaluation.gradient, &uncertainty);
        let mut new = Self { solution, uncertainty, remaining };
        if !new.is_near_enough()
            && let Some(gradient) = new.averaged_gradient()
        {
            new.remaining = Remaining::of(&new.solution, &gradient, &new.uncertainty);
        }
        new
    }

    /// The mean gradient over places about a part of a standard deviation away in every direction. The gradient jumps
    /// where a point of the scan changes from one patch to another, and with it the step that remains wherever few
    /// points determine a coordinate; its mean over the neighbourhood vanishes at the optimum all the same, as the
    /// Hessian of the sandwich is a mean over the confidence region. None where the model does not exist there.
    fn averaged_gradient(&self) -> Option<DVector<f64>> {
        let Solution { level, estimate, .. } = &self.solution;
        let objective = Objective { stage: None, ..self.objective() };
        let dim = level.space.dim();
        let mut sum = DVector::zeros(dim);
        for draw in 1..=AVERAGED_PAIRS {
            let mut away = DVector::from_fn(dim, |k, _| {
                if !self.uncertainty.determines(k) {
                    return 0.0;
                }
                AVERAGED_REACH * self.remaining.unit[k] * (2.0 * halton(draw, k) - 1.0)
            });
            for _ in 0..2 {
                let there = level.space.retract(estimate, away.as_slice());
                let mut gradient = objective.evaluate(&there, Order::Gradient)?.gradient;
                level.space.pull_to(away.as_slice(), &mut gradient);
                sum += gradient;
                away.neg_mut();
            }
        }
        Some(sum / (2 * AVERAGED_PAIRS) as f64)
    }

    /// The better one of this candidate and the place to which a continuation leads.
    fn on(self, way: Continuation) -> Self {
        let next = self.minimum(way).and_then(|minimum| {
            let Minimum { estimate, evaluation, iterations, .. } = minimum;
            let iterations = self.solution.iterations + iterations;
            let solution = Solution { estimate, evaluation, iterations, ..self.solution.clone() };
            let uncertainty = super::uncertainty(&solution)?;
            Some(Self::new(solution, uncertainty))
        });
        // Points whose nearest facet is not on their nearest patch make steps in the objective. Values that are equal
        // to rounding, or to less than the scan can tell apart, therefore leave it to the gradient.
        let better = |next: &Self| {
            let (before, after) = (self.solution.evaluation.value, next.solution.evaluation.value);
            let equal = before * (gauss_newton::ROUNDING + EQUAL_FITS / self.uncertainty.effective_points);
            after < before - equal || (after <= before + equal && next.remaining.largest() < self.remaining.largest())
        };
        next.filter(better).unwrap_or(self)
    }

    /// Where no continuation leads any farther. A short step that remains is the place's own uncertainty, beside that
    /// of the optimum; a longer one is said.
    fn concluded(self) -> Assessed<'a> {
        let lost = self.is_lost_in_noise();
        let Self { mut solution, mut uncertainty, remaining } = self;
        let monitor = solution.level.problem.monitor;
        solution.converged = remaining.largest() <= HELD_STEP || lost;
        if solution.converged && !remaining.is_settled() {
            uncertainty.covariance += &remaining.step * remaining.step.transpose();
        }
        let warning = (!solution.converged && !monitor.cancelled()).then(|| remaining.warning(&solution));
        Assessed { solution, uncertainty: Some(uncertainty), warning }
    }

    /// Whether no shorter step is looked for, not even by the ways that take the least time.
    fn is_near_enough(&self) -> bool {
        let many = self.solution.level.problem.points.len() > MANY_POINTS;
        self.remaining.is_settled() || many && self.is_lost_in_noise()
    }

    /// Whether the step that remains is no longer than one standard deviation in every coordinate and moves the surface
    /// (root mean square over the points) by far less than the points' spread about it.
    fn is_lost_in_noise(&self) -> bool {
        let Solution { evaluation, loss, .. } = &self.solution;
        let step = &self.remaining.step;
        // The normal matrix is that of the mean loss, over sigma^2 / 2.
        let moves = || (0.5 * step.dot(&(&evaluation.normal * step))).sqrt() * loss.sigma;
        self.remaining.largest() <= 1.0 && moves() <= HELD_NOISE * evaluation.rms()
    }

    /// The objective of the last stage.
    fn objective(&self) -> Objective<'_> {
        let Solution { level, loss, signs, cache, .. } = &self.solution;
        Objective {
            signs: Some(signs),
            tolerance: foot_tolerance(*loss, level.problem.radius),
            cache: Some(cache.clone()),
            curved: true,
            stage: Some(POLISH),
            ..level.objective(&level.problem.points, *loss)
        }
    }

    /// The end of a continuation. None where the model does not exist there or the fit is cancelled.
    fn minimum(&self, way: Continuation) -> Option<Minimum> {
        let Self { solution: Solution { level, estimate, .. }, uncertainty, remaining, .. } = self;
        let objective = self.objective();
        let determined = || (0..remaining.unit.len()).filter(|k| uncertainty.determines(*k));
        let least = determined().map(|k| deviation(uncertainty, k)).fold(f64::INFINITY, f64::min);
        let stop = Stop { iterations: POLISH_ITERATIONS, step: RESUMED_STEP * SETTLED_STEP * least };
        let beside = |step: &[f64]| level.space.retract(estimate, step);
        let from: Estimate = match way {
            Continuation::GaussNewton => estimate.clone(),
            Continuation::Averaged => {
                let there = beside(remaining.step.as_slice());
                let evaluation = objective.evaluate(&there, Order::Normal)?;
                return Some(Minimum { estimate: there, evaluation, iterations: 1, converged: false });
            }
            Continuation::QuasiNewton => lbfgs::minimise(&objective, estimate.clone())?.estimate,
            Continuation::Beside => {
                let mut step = vec![0.0; remaining.unit.len()];
                determined().for_each(|k| step[k] = if k % 2 == 0 { 1.0 } else { -1.0 } * deviation(uncertainty, k));
                beside(&step)
            }
        };
        gauss_newton::minimise(&objective, from, stop)
    }
}

impl Remaining {
    /// The step at a solution with a gradient that is its own or an average about it.
    fn of(solution: &Solution, gradient: &DVector<f64>, uncertainty: &Uncertainty) -> Self {
        let Solution { level, estimate, evaluation, loss, .. } = solution;
        let dim = level.space.dim();
        if gradient.len() != dim {
            // A stand-in for a model that does not exist here.
            return Self { step: DVector::repeat(dim, f64::INFINITY), unit: vec![1.0; dim] };
        }
        let sum = 0.5 * loss.sigma.powi(2) * level.problem.points.weight();
        let mut step = uncertainty.newton_step(gradient, sum);
        let held = within_itself(&uncertainty.naive, &uncertainty.undetermined, level.space.free.len());
        without_motions(&mut step, &held);
        let least = SETTLED_ROUNDING * level.problem.radius / SETTLED_STEP;
        let mut unit: Vec<f64> = (0..dim).map(|k| deviation(uncertainty, k).max(least)).collect();
        (0..dim).filter(|k| !uncertainty.determines(*k)).for_each(|k| step[k] = 0.0);
        let room = level.space.room(estimate);
        let noise = evaluation.rms();
        for (k, _) in level.space.at_bound(estimate).iter().enumerate().filter(|(_, at_bound)| **at_bound) {
            let (gradient, curvature) = (gradient[k], evaluation.normal[(k, k)]);
            if !pushed(gradient, room[k]) && curvature > 0.0 {
                // The bound does not hold it: it would move away from it, whatever the others do.
                step[k] = (-gradient / curvature).max(room[k].0).min(room[k].1);
                unit[k] = (noise / (curvature * sum).sqrt()).max(least);
            }
        }
        Self { step, unit }
    }

    /// The step in coordinate k, in standard deviations.
    fn deviations(&self, k: usize) -> f64 {
        self.step[k].abs() / self.unit[k]
    }

    fn largest(&self) -> f64 {
        (0..self.unit.len()).map(|k| self.deviations(k)).fold(0.0, f64::max)
    }

    fn is_settled(&self) -> bool {
        self.largest() <= SETTLED_STEP
    }

    /// A sentence that names the coordinates with the longest steps.
    fn warning(&self, solution: &Solution) -> String {
        let space = &solution.level.space;
        let mut longest: Vec<usize> = (0..self.unit.len()).filter(|k| self.deviations(*k) > SETTLED_STEP).collect();
        longest.sort_by(|a, b| self.deviations(*b).total_cmp(&self.deviations(*a)));
        let mut named: Vec<String> = Vec::new();
        for k in longest {
            let of = match space.free.get(k) {
                Some(i) => format!("`{}`", solution.level.problem.model.parameters()[*i].name),
                None => "the pose".to_owned(),
            };
            if named.len() < STALLED_NAMED && !named.iter().any(|n| n.starts_with(&of)) {
                named.push(format!("{of} ({:.2})", self.deviations(k)));
            }
        }
        format!(
            "the fit stopped short of the optimum, farthest in {}: the remaining step in standard deviations",
            named.join(", ")
        )
    }
}

/// Takes motions out of a step by which the surface hardly leaves itself: about the axis of a body of revolution both
/// the gradient and the curvature are rounding, and their ratio says nothing. They are among the last coordinates.
pub(super) fn without_motions(step: &mut DVector<f64>, motions: &[DVector<f64>]) {
    for direction in motions {
        let first = step.len() - direction.len();
        let along = direction.dot(&step.rows(first, direction.len()));
        step.rows_mut(first, direction.len()).axpy(-along, direction, 1.0);
    }
}

/// The standard deviation of a scaled local coordinate. Millimetres.
fn deviation(uncertainty: &Uncertainty, k: usize) -> f64 {
    uncertainty.covariance[(k, k)].max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::FitOptions;
    use crate::fit::monitor::Monitor;
    use crate::fit::problem::Problem;
    use crate::fit::refine::solve::solve;
    use crate::fit::tests::cup::scan_of;
    use crate::fit::tests::shapes::{Simple, simple};
    use nalgebra::DMatrix;

    /// Checks the assessed fit of a torus to a scan with noise.
    fn with_torus(check: impl FnOnce(Solution, Uncertainty, &Monitor)) {
        let truth = [47.0, 9.0];
        let scan = scan_of(&simple(Simple::Torus, &truth), &truth, 0.05, 3000, 9);
        let (model, options, monitor) =
            (simple(Simple::Torus, &[40.0, 12.0]), FitOptions::default(), Monitor::default());
        let problem = Problem::new(&model, &scan, &options, &monitor).unwrap();
        let Assessed { solution, uncertainty, .. } = assess(solve(&problem).unwrap());
        check(solution, uncertainty.unwrap(), &monitor);
    }

    #[test]
    fn a_place_beside_the_optimum_does_not_pass_for_it_and_is_left() {
        with_torus(|solution, uncertainty, monitor| {
            assert!(solution.converged, "{:?}", monitor.records().warnings);
            // Two standard deviations off in the first parameter alone, by an optimiser that says it has converged.
            let off = 2.0 * deviation(&uncertainty, 0);
            let at = Candidate::new(solution.clone(), uncertainty.clone());
            let mut step = vec![0.0; solution.level.space.dim()];
            step[0] = off;
            let estimate = solution.level.space.retract(&solution.estimate, &step);
            let evaluation = at.objective().evaluate(&estimate, Order::Normal).unwrap();
            let beside = Solution { estimate, evaluation, converged: true, ..solution.clone() };
            let remaining = Remaining::of(&beside, &beside.evaluation.gradient, &uncertainty);
            assert!((remaining.step[0] + off).abs() < 0.1 * off && remaining.deviations(1) < 0.2, "{}", remaining.step);
            let warning = remaining.warning(&beside);
            assert!(warning.contains("`a` (2.0") || warning.contains("`a` (1.9"), "{warning}");
            // From there the optimum is found after all.
            let again = assess(beside).solution;
            let apart = again.level.space.coordinate_distance(0, &again.estimate, &solution.estimate);
            assert!(again.converged && apart < 0.05 * off, "{apart} of {off}");
        });
    }

    #[test]
    fn a_short_step_that_remains_widens_the_interval_and_a_long_one_is_said() {
        with_torus(|solution, uncertainty, _| {
            let unit = deviation(&uncertainty, 0);
            let concluded = |deviations: f64| {
                let mut at = Candidate::new(solution.clone(), uncertainty.clone());
                at.remaining.step.fill(0.0);
                at.remaining.step[0] = deviations * unit;
                let Assessed { solution, uncertainty, warning } = at.concluded();
                assert_eq!(solution.converged, warning.is_none_or(|w| !w.contains("stopped short")));
                (solution.converged, deviation(&uncertainty.unwrap(), 0) / unit)
            };
            for (step, wider) in [(0.04, 1.0), (0.3, 1.0 + 0.3_f64.powi(2))] {
                let (converged, ratio) = concluded(step);
                assert!(converged && (ratio.powi(2) - wider).abs() < 1e-9, "{step}: {ratio}");
            }
            assert_eq!(concluded(0.5), (false, 1.0));
        });
    }

    #[test]
    fn motions_of_a_symmetric_body_within_itself_are_not_steps() {
        // The third motion is a thousand times less certain than the others, beside one parameter of the shape.
        let covariance = DMatrix::from_diagonal(&DVector::from_vec(vec![4.0, 1.0, 2.0, 4e6]));
        let mut step = DVector::from_vec(vec![0.5, 0.25, -0.125, 70.0]);
        without_motions(&mut step, &within_itself(&covariance, &[], 1));
        assert!((step - DVector::from_vec(vec![0.5, 0.25, -0.125, 0.0])).amax() < 1e-12);
    }
}
