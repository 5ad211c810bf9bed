//! From where the registration ended to the optimum: from coarse to fine, in the scale of the loss and in points
//! (graduated non-convexity), to the scale that the scan's noise suggests.

use super::earlier;
use crate::fit::correspond::cache::FootCache;
use crate::fit::correspond::foot::Foot;
use crate::fit::optimise;
use crate::fit::optimise::gauss_newton::{self, Minimum, Stop};
use crate::fit::problem::level::Level;
use crate::fit::problem::loss::{Loss, LossKind, robust_deviation};
use crate::fit::problem::objective::{Evaluation, Objective, Order, Placed, foot_cache};
use crate::fit::problem::parameterization::Estimate;
use crate::fit::problem::points::Points;
use crate::fit::problem::sides::Sides;
use crate::fit::register::Registration;
use crate::fit::register::candidate::Candidate;
use crate::fit::register::restart::{Restart, Scope, restart};
use crate::fit::tuning::{
    ANNEALING_ITERATIONS, ANNEALING_LEVELS, ANNEALING_POINTS, ANNEALING_START, ANNEALING_STEP, FOOT_TOLERANCE,
    INLIER_DEVIATIONS, LEAST_SPREAD, POLISH_ITERATIONS, POLISH_STEP, SCALE_FASTEST, SCALE_SETTLED, SMALL_PART_POINTS,
    SMALL_PART_SEARCHED, SQUARED_STEP, SQUARED_TOLERANCE, THIN_POINTS, WIDEST_NOISE,
};
use std::sync::Arc;

/// An estimate with the loss by which it is judged.
#[derive(Clone)]
pub(crate) struct Guess {
    pub(crate) estimate: Estimate,
    pub(crate) loss: Loss,
    /// Per patch, which way is out (see `Facing`).
    pub(crate) signs: Vec<i8>,
    /// Iterations of the optimisers so far.
    pub(crate) iterations: u32,
}

/// The end of a stage: an optimum with the level on which it was found and the loss by which it is judged.
#[derive(Clone)]
pub(crate) struct Solution<'a> {
    pub(crate) level: Level<'a>,
    pub(crate) estimate: Estimate,
    pub(crate) evaluation: Evaluation,
    pub(crate) loss: Loss,
    pub(crate) signs: Vec<i8>,
    pub(crate) converged: bool,
    /// The feet of the points that were fitted.
    pub(crate) cache: Arc<FootCache>,
    /// Iterations of the optimisers in all stages.
    pub(crate) iterations: u32,
    /// The coordinates at which no wall was found to pass through another one, if that was looked at.
    pub(crate) apart_at: Option<Vec<f64>>,
}

impl<'a> Solution<'a> {
    /// The objective by which the solution is judged, over some points: that of its loss, cancelled or not.
    pub(crate) fn objective<'s>(&'s self, points: &'s Points) -> Objective<'s> {
        self.objective_on(&self.level, points)
    }

    /// The same with the facets and the scales of another level.
    pub(crate) fn objective_on<'s>(&'s self, level: &'s Level<'s>, points: &'s Points) -> Objective<'s> {
        Objective {
            signs: Some(&self.signs),
            tolerance: FOOT_TOLERANCE * self.loss.sigma,
            cancellable: false,
            ..level.objective(points, self.loss)
        }
    }

    /// The feet of the inliers among an objective's points, with the points' indices.
    pub(crate) fn inlier_feet(&self, objective: &Objective, placed: &Placed) -> Vec<(usize, Foot)> {
        let mut feet = objective.feet(placed);
        feet.retain(|(_, foot)| self.loss.value(foot.d2) < 0.5);
        feet
    }

    /// The solution as the beginning of another stage.
    pub(crate) fn into_guess(self) -> (Level<'a>, Guess) {
        let Self { level, estimate, loss, signs, iterations, .. } = self;
        (level, Guess { estimate, loss, signs, iterations })
    }
}

/// Shares of the refinement's time until the scale of the loss has come down, and until parts have been restarted.
const ANNEALED: f64 = 0.05;
const RESTARTED: f64 = 0.9;

/// From the registration's scale of the loss to the final one.
pub(crate) fn refine<'a>(registration: Registration<'a>) -> Solution<'a> {
    let Registration { level, candidate, seeds, .. } = registration;
    let problem = level.problem;
    let Candidate { estimate, signs, .. } = candidate;
    // A model that cannot be evaluated where it has come to keeps its facets.
    let level = level.around(&estimate).unwrap_or(level);
    // Here nearly every point is nearest to its own patch, whichever way that faces: what the scan's normals said from
    // farther off gives way to what the script says.
    let wide = Loss::welsch(ANNEALING_START * problem.radius);
    let mut sides = Sides::of(&level, &estimate, wide).unwrap_or(Sides { signs, ..Sides::default() });
    let signs = sides.signs.clone();
    if let Some(guess) = earlier::converged(&level, &estimate) {
        sides.warn(&level);
        return polish(level, &problem.points, guess, Some(POLISH));
    }
    let few = problem.thin.sample(ANNEALING_POINTS);
    let given = problem.options.sigma.map(|sigma| Loss { kind: problem.options.loss, sigma });
    let mut guess = Guess { estimate, loss: given.unwrap_or(wide), signs, iterations: 0 };
    guess = anneal(&level, &few, guess, given);
    problem.monitor.reach(ANNEALED, "");
    if !problem.monitor.cancelled() {
        // At so fine a scale, parts that passed for right before may be wrong.
        let (estimate, signs) = (guess.estimate.clone(), guess.signs.clone());
        let from = Candidate { estimate, signs, value: f64::INFINITY };
        let scale = guess.loss.sigma / problem.radius;
        let plan = Restart {
            level: &level,
            seeds: &seeds,
            points: &few,
            scale,
            scope: Scope::Doubtful,
            span: (ANNEALED, RESTARTED),
        };
        let Candidate { estimate, value, .. } = restart(&plan, from);
        // A candidate that no restart has improved has no value still.
        let improved = value.is_finite();
        if improved {
            guess.estimate = estimate;
        }
        sides = Sides::of(&level, &guess.estimate, guess.loss).unwrap_or(sides);
        if improved || sides.signs != guess.signs {
            guess.signs = sides.signs.clone();
            guess = anneal(&level, &with_small_parts(&level, few, &guess), guess, given);
        }
    }
    sides.warn(&level);
    problem.monitor.reach(RESTARTED, "");
    // Only now may it rise to the noise's: restarts need the finer scale to see small parts.
    guess.loss = given.unwrap_or_else(|| final_loss(&level, &guess));
    // A sample as dense as the scan itself comes first: all points then have hardly anything left to do. Where the
    // motion is still to be put into the script's parameters, they wait for that.
    let sample = problem.points.every(THIN_POINTS);
    let solution = polish(level, &sample, guess, Some(POLISH));
    if problem.pose.write_back || sample.len() == problem.points.len() {
        return solution;
    }
    let (level, guess) = solution.into_guess();
    polish(level, &problem.points, guess, Some(POLISH))
}

/// The stage of the trace in which the scale of the loss is final.
pub(crate) const POLISH: &str = "polish";

/// `few` of the points, and more of parts that have hardly any among them: a hole that the restarts have found would
/// be lost again where two or three points speak for it.
fn with_small_parts(level: &Level, few: Points, guess: &Guess) -> Points {
    let points = level.problem.points.every(SMALL_PART_SEARCHED);
    if points.len() <= few.len() {
        return few;
    }
    let objective = Objective { signs: Some(&guess.signs), ..level.objective(&points, guess.loss) };
    let Ok(placed) = objective.place(&guess.estimate) else { return few };
    let mut of_patches: Vec<Vec<usize>> = vec![Vec::new(); level.problem.model.parts().len()];
    for (point, patch) in objective.patches(&placed) {
        of_patches[patch].push(point);
    }
    let small = |of_patch: &Vec<usize>| of_patch.len() * few.len() < SMALL_PART_POINTS * points.len();
    let more = of_patches.into_iter().filter(small).flat_map(|of_patch| {
        let step = of_patch.len().div_ceil(SMALL_PART_POINTS).max(1);
        of_patch.into_iter().step_by(step)
    });
    let chosen: Vec<usize> = more.collect();
    // The points of a sample count alike.
    let more = points.pick(chosen.into_iter()).alike();
    few.and(&more)
}

/// Follows the scale of the loss down to the one that the residuals suggest, unless one is `given`.
pub(crate) fn anneal(level: &Level, points: &Points, mut guess: Guess, given: Option<Loss>) -> Guess {
    for _ in 0..ANNEALING_LEVELS {
        if level.problem.monitor.cancelled() {
            break;
        }
        let loss = guess.loss;
        let objective = Objective {
            signs: Some(&guess.signs),
            cache: Some(foot_cache(points, loss.sigma)),
            stage: Some("refine"),
            ..level.objective(points, loss)
        };
        let stop = Stop { iterations: ANNEALING_ITERATIONS, step: ANNEALING_STEP * loss.sigma };
        if let Some(minimum) = optimise::minimise(&objective, guess.estimate.clone(), stop) {
            guess = Guess { estimate: minimum.estimate, iterations: guess.iterations + minimum.iterations, ..guess };
        }
        guess.loss = given.unwrap_or_else(|| suggested_loss(level, points, &guess));
        if guess.loss.sigma > SCALE_SETTLED * loss.sigma {
            break;
        }
    }
    guess
}

/// The loss of the last stage, of the user's kind, at the end of the annealing: at the scale that the residuals suggest
/// and not below the noise's.
pub(crate) fn final_loss(level: &Level, guess: &Guess) -> Loss {
    let problem = level.problem;
    let noise = (INLIER_DEVIATIONS * problem.scan.noise).min(WIDEST_NOISE * problem.radius);
    let noise = Loss::with_half_at(guess.loss.kind, noise).sigma;
    let suggested = Loss::welsch(suggested_loss(level, &problem.thin, guess).sigma.max(noise));
    Loss::with_half_at(problem.options.loss, suggested.half())
}

/// The scale that the residuals suggest: the loss is 1/2 (\[VA\] sect. 3) at three robust standard
/// deviations of the distances, which hold both the noise and what the model's family cannot follow. Never above the
/// present scale.
pub(crate) fn suggested_loss(level: &Level, points: &Points, guess: &Guess) -> Loss {
    let loss = guess.loss;
    let objective = Objective { signs: Some(&guess.signs), ..level.objective(points, loss) };
    let Ok(placed) = objective.place(&guess.estimate) else { return loss };
    let mut distances: Vec<(f64, f64)> =
        objective.feet(&placed).iter().map(|(i, f)| (f.d2.sqrt(), points.prior(*i))).collect();
    let problem = level.problem;
    let spread = robust_deviation(&mut distances, loss.cutoff()).max(LEAST_SPREAD * problem.radius);
    let next = Loss::with_half_at(loss.kind, INLIER_DEVIATIONS * spread.max(problem.scan.noise));
    Loss::welsch(next.sigma.min(loss.sigma).max(SCALE_FASTEST * loss.sigma))
}

/// The distance to which feet are exact at the final scale. Millimetres. Least squares is for those who want every
/// digit.
pub(crate) fn foot_tolerance(loss: Loss, radius: f64) -> f64 {
    match loss.kind {
        LossKind::Squared => SQUARED_TOLERANCE * radius,
        _ => FOOT_TOLERANCE * loss.sigma,
    }
}

/// Gauss-Newton at the final scale. Steps are traced as those of `stage`, if there is one.
pub(crate) fn polish<'a>(level: Level<'a>, points: &Points, guess: Guess, stage: Option<&'static str>) -> Solution<'a> {
    let Guess { estimate, loss, signs, iterations } = guess;
    let tolerance = foot_tolerance(loss, level.problem.radius);
    let step = match loss.kind {
        LossKind::Squared => SQUARED_STEP * level.problem.radius,
        // Shorter steps are about as large as those by which single points that change patches move the optimum.
        _ => POLISH_STEP * loss.sigma,
    };
    let cache = foot_cache(points, loss.sigma);
    let objective = Objective {
        signs: Some(&signs),
        tolerance,
        cache: Some(cache.clone()),
        curved: true,
        stage,
        ..level.objective(points, loss)
    };
    let stop = Stop { iterations: POLISH_ITERATIONS, step };
    let minimum = gauss_newton::minimise(&objective, estimate.clone(), stop).unwrap_or_else(|| {
        // Cancelled, or the model does not exist here. What it is worth is still to be said: who cancelled does not
        // wait for all points of a large scan.
        let few = if level.problem.monitor.cancelled() { Some(points.standing_for_all(THIN_POINTS)) } else { None };
        let points = few.as_ref().unwrap_or(points);
        let objective = Objective {
            cancellable: false,
            signs: Some(&signs),
            tolerance,
            curved: true,
            ..level.objective(points, loss)
        };
        let evaluation =
            objective.evaluate(&estimate, Order::Value).unwrap_or_else(|| Evaluation::absent(&level.space));
        Minimum { estimate, evaluation, iterations: 0, converged: false }
    });
    let Minimum { estimate, evaluation, converged, iterations: more } = minimum;
    let iterations = iterations + more;
    Solution { level, estimate, evaluation, loss, signs, converged, cache, iterations, apart_at: None }
}
