//! Other shapes of a part that explain the scan as well: a piece of a cubic is a cubic, and where a handle's end is not
//! seen, another piece of the same curve may end on the same wall. The curvature at the optimum knows nothing of them,
//! nor of how far a curved valley reaches. They are looked for by the profile of the loss: one parameter of a group is
//! held at other values, and the others of the group find the best that there is (Bates and Watts 1988, section 6.1).

use super::convergence::{self, Assessed};
use super::sandwich::Uncertainty;
use super::witness::{self, Witness};
use crate::fit::correspond::layout::Layout;
use crate::fit::optimise::gauss_newton::{self, Stop};
use crate::fit::problem::level::Level;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::Objective;
use crate::fit::problem::parameterization::{Estimate, Parameterization};
use crate::fit::problem::points::Points;
use crate::fit::problem::sides::Sides;
use crate::fit::refine::schedule::{Guess, POLISH, Solution, polish};
use crate::fit::register::group::{Group, groups};
use crate::fit::tuning::{
    MODEL_SIZE, PART_CHORD, RIVAL_BETTER, RIVAL_COARSE, RIVAL_CONTRADICTED, RIVAL_DEVIATIONS, RIVAL_DOUBLINGS,
    RIVAL_EVIDENCE, RIVAL_ITERATIONS, RIVAL_LEAST_POINTS, RIVAL_POINTS, RIVAL_STEP, RIVAL_VALUES, RIVAL_WORSE,
    RIVALS_ADOPTED, RIVALS_JOINTLY, THIN_POINTS,
};
use rayon::prelude::*;

/// Another shape of the parts of one group.
#[derive(Clone, Debug)]
pub(crate) struct Rival {
    pub(crate) estimate: Estimate,
    /// The scaled step of the free parameters from the solution to here.
    pub(crate) step: Vec<f64>,
    /// Positions of the group's parameters in the list of free ones.
    pub(crate) members: Vec<usize>,
    /// By patch, whether the group shapes it.
    pub(crate) patches: Vec<bool>,
    /// n ln(ratio of the mean loss to the solution's), with the effective points: below zero it explains the scan
    /// better.
    pub(crate) evidence: f64,
    /// By how many standard deviations the mean of the points' differences in loss is above zero (Vuong 1989): a few
    /// outliers that lie near one of the two shapes by chance make evidence, but no mean.
    pub(crate) certainty: f64,
    /// The model's surface that the scan contradicts. Square millimetres; zero where the scan does not say.
    pub(crate) contradicted: f64,
}

/// A solution with its uncertainty, and the rivals that the covariance holds.
pub(crate) struct Weighed<'a> {
    pub(crate) solution: Solution<'a>,
    pub(crate) uncertainty: Option<Uncertainty>,
    pub(crate) rivals: Vec<Rival>,
}

/// Looks for rivals of a solution, goes over to the one that the scan prefers if there is one, and puts the others into
/// the uncertainty.
pub(crate) fn weigh(assessed: Assessed) -> Weighed {
    let Assessed { mut solution, uncertainty } = assessed;
    let monitor = solution.level.problem.monitor;
    let Some(mut uncertainty) = uncertainty else { return Weighed { solution, uncertainty: None, rivals: Vec::new() } };
    // Other shapes are judged by the scan's points, and not by the term that holds the ends.
    let rounds = if solution.level.coverage.is_some() { 0 } else { RIVALS_ADOPTED };
    for _ in 0..rounds {
        let found = find(&solution, &uncertainty);
        if monitor.cancelled() {
            break;
        }
        let Some(preferred) = found.preferred() else {
            let (uncertainty, rivals) = found.include(uncertainty);
            return Weighed { solution, uncertainty: Some(uncertainty), rivals };
        };
        let next = convergence::assess(preferred.solution(&solution));
        match next.uncertainty {
            Some(known) => (solution, uncertainty) = (next.solution, known),
            None => break,
        }
    }
    Weighed { solution, uncertainty: Some(uncertainty), rivals: Vec::new() }
}

impl Rival {
    /// The optimum at the rival, over all points.
    fn solution<'a>(&self, from: &Solution<'a>) -> Solution<'a> {
        let (level, guess) = from.clone().into_guess();
        let signs = Sides::of(&level, &self.estimate, guess.loss).map_or(guess.signs, |sides| sides.signs);
        let points = &level.problem.points;
        polish(level, points, Guess { estimate: self.estimate.clone(), signs, ..guess }, Some(POLISH))
    }
}

/// The rivals of a solution, and the area of its own surface that the scan contradicts.
pub(crate) struct Rivals {
    pub(crate) rivals: Vec<Rival>,
    /// Square millimetres.
    pub(crate) contradicted: f64,
    /// More contradicted area than this is no chance. Square millimetres.
    pub(crate) chance: f64,
}

/// Looks for shapes of every group of parameters that explain the scan as well as the solution does.
pub(crate) fn find(solution: &Solution, uncertainty: &Uncertainty) -> Rivals {
    // Not the sample of the registration, which is even in space and not in noise.
    let sample = solution.level.problem.points.every(THIN_POINTS);
    let groups = groups(&solution.level);
    let base = Base::new(solution, uncertainty, &sample).filter(|_| !groups.is_empty());
    let of_group = |group: &Group| Some(Alone::new(base.as_ref()?, group)?.rivals());
    let found: Vec<Rival> = groups.iter().filter_map(of_group).flatten().collect();
    let none = Rivals { rivals: Vec::new(), contradicted: 0.0, chance: 0.0 };
    if found.is_empty() {
        return none;
    }
    let witness = Witness::of(solution);
    let area = |at: &Estimate| Some(witness::total(&witness.as_ref()?.contradicted(at)?));
    let (contradicted, chance) = area(&solution.estimate).unwrap_or_default();
    // What stands where the scan shows empty space is no rival.
    let rivals = found.into_iter().filter_map(|rival| {
        let (there, _) = area(&rival.estimate).unwrap_or_default();
        (there <= contradicted + RIVAL_CONTRADICTED * chance).then_some(Rival { contradicted: there, ..rival })
    });
    Rivals { rivals: rivals.collect(), contradicted, chance }
}

impl Rivals {
    /// The rival that the scan prefers to the solution: one that explains it clearly better, or as well with clearly
    /// less surface where the scan shows empty space.
    pub(crate) fn preferred(&self) -> Option<&Rival> {
        let better = |r: &&Rival| {
            let explains_more = r.evidence < -RIVAL_EVIDENCE && r.certainty < -RIVAL_BETTER;
            explains_more || r.contradicted < self.contradicted - RIVAL_CONTRADICTED * self.chance
        };
        self.rivals.iter().filter(better).min_by(|a, b| {
            let key = |r: &Rival| (r.contradicted / self.chance.max(f64::MIN_POSITIVE)).floor();
            key(a).total_cmp(&key(b)).then(a.evidence.total_cmp(&b.evidence))
        })
    }

    /// The uncertainty with the rivals: of a shape and another one that explains the scan as well, each has half of the
    /// probability, and the covariance of the two is a quarter of the square of their difference. Rivals that the
    /// covariance holds already are left out. The second value are those that were not.
    pub(crate) fn include(mut self, mut uncertainty: Uncertainty) -> (Uncertainty, Vec<Rival>) {
        let deviations = |uncertainty: &Uncertainty, rival: &Rival| largest(uncertainty, &rival.members, &rival.step);
        self.rivals.sort_by(|a, b| deviations(&uncertainty, b).total_cmp(&deviations(&uncertainty, a)));
        let mut included = Vec::new();
        for rival in self.rivals {
            if !(deviations(&uncertainty, &rival) > RIVAL_DEVIATIONS) {
                continue;
            }
            let known: Vec<usize> = rival.members.iter().copied().filter(|k| uncertainty.determines(*k)).collect();
            for a in &known {
                for b in &known {
                    uncertainty.covariance[(*a, *b)] += 0.25 * rival.step[*a] * rival.step[*b];
                }
            }
            included.push(rival);
        }
        (uncertainty, included)
    }
}

/// The optimum over a sample of the points, next to the solution: other shapes are optima over the same points.
struct Base<'s> {
    solution: &'s Solution<'s>,
    uncertainty: &'s Uncertainty,
    sample: &'s Points,
    estimate: Estimate,
    /// The parameters, the losses of the sample's points and their mean.
    x: Vec<f64>,
    losses: Vec<f64>,
    mean: f64,
}

impl<'s> Base<'s> {
    /// None where the model does not exist or the fit is cancelled.
    fn new(solution: &'s Solution<'s>, uncertainty: &'s Uncertainty, sample: &'s Points) -> Option<Self> {
        let (estimate, mean) = optimum(solution, sample, solution.estimate.clone())?;
        let losses = losses(solution, sample, &estimate)?;
        let x = solution.level.space.x(&estimate.z)?;
        Some(Self { solution, uncertainty, sample, estimate, x, losses, mean })
    }

    fn level(&self) -> &'s Level<'s> {
        &self.solution.level
    }

    /// The largest difference of two shapes in a parameter of a group, in standard deviations.
    fn apart(&self, group: &Group, a: &[f64], b: &[f64]) -> f64 {
        let space = &self.level().space;
        let [a, b] = [a, b].map(|x| space.estimate(x, self.estimate.motion));
        largest(self.uncertainty, &group.members, &space.step(&a, &b))
    }

    /// A shape as a rival of the solution over all of the sample, after some steps of all parameters. None where it
    /// explains the scan worse or turns out to be the same.
    fn rival(&self, group: &Group, shape: &Shape) -> Option<Rival> {
        let Level { space, .. } = self.level();
        let from = space.estimate(&shape.x, self.estimate.motion);
        let (estimate, _) = optimum(self.solution, self.sample, from)?;
        let there = losses(self.solution, self.sample, &estimate)?;
        let Compared { evidence, certainty } = Compared::of(self, &there);
        let worse = evidence > RIVAL_EVIDENCE && certainty > RIVAL_WORSE;
        let step = space.step(&self.estimate, &estimate);
        let distinct = largest(self.uncertainty, &group.members, &step) > RIVAL_DEVIATIONS;
        let mut padded = step.clone();
        padded.resize(space.dim(), 0.0);
        // The sample's own error is that of both optima.
        let estimate = space.retract(&self.solution.estimate, &padded);
        (distinct && !worse).then(|| Rival {
            estimate,
            step,
            members: group.members.clone(),
            patches: group.patches.clone(),
            evidence,
            certainty,
            contradicted: 0.0,
        })
    }
}

/// The optimum of all parameters over some points, and the mean loss there. None where the model does not exist or the
/// fit is cancelled.
fn optimum(solution: &Solution, points: &Points, from: Estimate) -> Option<(Estimate, f64)> {
    let objective = Objective { cancellable: true, ..solution.objective(points) };
    let stop = Stop { iterations: RIVAL_ITERATIONS, step: RIVAL_STEP * solution.loss.sigma };
    let minimum = gauss_newton::minimise(&objective, from, stop)?;
    Some((minimum.estimate, minimum.evaluation.value))
}

fn losses(solution: &Solution, points: &Points, at: &Estimate) -> Option<Vec<f64>> {
    let objective = solution.objective(points);
    let placed = objective.place(at).ok()?;
    Some(objective.losses(&placed))
}

/// The largest part of a step along some coordinates, in standard deviations.
fn largest(uncertainty: &Uncertainty, members: &[usize], step: &[f64]) -> f64 {
    let deviation = |k: usize| uncertainty.covariance[(k, k)].sqrt().max(f64::MIN_POSITIVE);
    let determined = members.iter().filter(|k| uncertainty.determines(**k));
    determined.map(|k| step[*k].abs() / deviation(*k)).fold(0.0, f64::max)
}

/// Another shape compared with the base by the losses of the same points.
struct Compared {
    evidence: f64,
    certainty: f64,
}

impl Compared {
    fn of(base: &Base, there: &[f64]) -> Self {
        let (mut before, mut after, mut squares) = (0.0, 0.0, 0.0);
        for (i, (present, there)) in base.losses.iter().zip(there).enumerate() {
            let prior = base.sample.prior(i);
            before += prior * present;
            after += prior * there;
            squares += (prior * (there - present)).powi(2);
        }
        Self {
            evidence: base.uncertainty.effective_points * (after / before.max(f64::MIN_POSITIVE)).ln(),
            certainty: (after - before) / squares.sqrt().max(f64::MIN_POSITIVE),
        }
    }
}

/// The patches of one group alone, with the points that are theirs.
struct Alone<'s> {
    base: &'s Base<'s>,
    group: &'s Group,
    layout: Layout,
    points: Points,
    /// n times the share of these points in the weight of all, over the mean loss of all.
    per_loss: f64,
    /// The parameters at the optimum over these points next to the base, and the mean loss there.
    x: Vec<f64>,
    loss: f64,
}

/// A shape with the evidence against it, by the group's own points.
#[derive(Clone)]
struct Shape {
    x: Vec<f64>,
    evidence: f64,
}

impl<'s> Alone<'s> {
    /// None where the group has hardly any points, or the model does not exist.
    fn new(base: &'s Base<'s>, group: &'s Group) -> Option<Self> {
        let Base { solution, uncertainty, sample, .. } = base;
        let problem = solution.level.problem;
        let near = group.own_points(&solution.objective(sample), &base.estimate)?;
        if near.len() < RIVAL_LEAST_POINTS {
            return None;
        }
        let own = sample.pick(near.iter().copied());
        let instance = problem.model.instantiate(&base.x).ok()?;
        let (tolerance, size) = (PART_CHORD * problem.radius, MODEL_SIZE * problem.radius);
        let layout = Layout::of_patches(problem.model, &*instance, tolerance, size, |patch| group.patches[patch]);
        let share = own.weight() / sample.weight();
        let per_loss = uncertainty.effective_points * share / base.mean.max(f64::MIN_POSITIVE);
        let points = own.every(RIVAL_POINTS);
        let alone = Self { base, group, layout, points, per_loss, x: base.x.clone(), loss: 0.0 };
        let Shape { x, evidence } = alone.best(&base.x, None, false)?;
        Some(Self { loss: evidence / per_loss, x, ..alone })
    }

    /// The space of the group's parameters about `x`, one of them held at its value there.
    fn space(&self, x: &[f64], held: Option<usize>) -> Parameterization<'s> {
        let Level { problem, space: all, .. } = self.base.level();
        let free = self.group.members.iter().filter(|k| Some(**k) != held).map(|k| all.free[*k]).collect();
        let mut space = Parameterization::new(problem.model, x, free, false, &all.ties);
        space.copy_scale(all);
        space
    }

    fn objective<'o>(&'o self, space: &'o Parameterization<'o>, loss: Loss) -> Objective<'o> {
        let objective = self.base.solution.objective(&self.points);
        Objective {
            space,
            layout: &self.layout,
            loss,
            coverage: None,
            separation: None,
            cancellable: true,
            ..objective
        }
    }

    /// The best shape from `x` on, one parameter held at its value there: at a coarse scale first where that is asked
    /// for.
    fn best(&self, x: &[f64], held: Option<usize>, coarse: bool) -> Option<Shape> {
        let space = self.space(x, held);
        let Base { solution: Solution { loss, level, .. }, estimate, .. } = self.base;
        let stop = Stop { iterations: RIVAL_ITERATIONS, step: RIVAL_STEP * loss.sigma };
        let mut at = space.estimate(x, estimate.motion);
        if coarse {
            let loss = Loss::welsch(loss.sigma.max(RIVAL_COARSE * level.problem.radius));
            at = gauss_newton::minimise(&self.objective(&space, loss), at, stop)?.estimate;
        }
        let minimum = gauss_newton::minimise(&self.objective(&space, *loss), at, stop)?;
        let evidence = self.per_loss * (minimum.evaluation.value - self.loss);
        Some(Shape { x: space.x(&minimum.estimate.z)?, evidence })
    }

    /// All rivals of the solution in this group.
    fn rivals(&self) -> Vec<Rival> {
        let ways: Vec<(usize, f64)> = self.group.members.iter().flat_map(|k| [(*k, 1.0), (*k, -1.0)]).collect();
        let walked = ways.into_par_iter().flat_map_iter(|(k, side)| {
            let mut shapes = self.in_other_basins(k, side);
            shapes.extend(self.along_valley(k, side));
            shapes
        });
        let shapes: Vec<Shape> = walked.filter(|shape| shape.evidence < RIVALS_JOINTLY).collect();
        let mut distinct: Vec<Shape> = Vec::new();
        for shape in shapes {
            let apart = |other: &[f64]| self.base.apart(self.group, other, &shape.x) > RIVAL_DEVIATIONS;
            if apart(&self.x) && distinct.iter().all(|other| apart(&other.x)) {
                distinct.push(shape);
            }
        }
        distinct.into_par_iter().filter_map(|shape| self.base.rival(self.group, &shape)).collect()
    }

    /// The farthest shape on one side of the solution's, at distances in parameter k that double as long as it explains
    /// the scan as well.
    fn along_valley(&self, k: usize, side: f64) -> Option<Shape> {
        let Base { uncertainty, estimate, .. } = self.base;
        let space = &self.base.level().space;
        let deviation = uncertainty.covariance[(k, k)].sqrt();
        if !(deviation > 0.0) {
            return None;
        }
        let present = space.estimate(&self.x, estimate.motion);
        let mut farthest: Option<Shape> = None;
        for n in 0..RIVAL_DOUBLINGS {
            let mut step = vec![0.0; space.dim()];
            step[k] = side * 1.5 * RIVAL_DEVIATIONS * deviation * f64::from(1 << n);
            let there = space.retract(&present, &step);
            let mut x = farthest.as_ref().map_or_else(|| self.x.clone(), |shape| shape.x.clone());
            let Some(moved) = space.x(&there.z).filter(|_| there.z[k] != present.z[k]) else { break };
            self.set(&mut x, k, &moved);
            match self.best(&x, Some(k), false).filter(|shape| shape.evidence < RIVAL_EVIDENCE) {
                Some(shape) => farthest = Some(shape),
                None => break,
            }
        }
        farthest
    }

    /// Shapes that are found from values of parameter k all over its bounds, on one side of the solution's.
    fn in_other_basins(&self, k: usize, side: f64) -> Vec<Shape> {
        let Level { problem, space, .. } = self.base.level();
        let present = space.estimate(&self.x, self.base.estimate.motion);
        let (low, high) = space.search_range(k, present.z[k], problem.radius);
        let values = (0..RIVAL_VALUES).map(|n| low + (high - low) * (f64::from(n) + 0.5) / f64::from(RIVAL_VALUES));
        let mut values: Vec<f64> = values.filter(|z| side * (z - present.z[k]) > 0.0).collect();
        values.sort_by(|a, b| (side * a).total_cmp(&(side * b)));
        let mut x = self.x.clone();
        let mut shapes = Vec::new();
        for value in values {
            let mut there = present.clone();
            there.z[k] = value;
            let Some(moved) = space.x(&there.z) else { break };
            self.set(&mut x, k, &moved);
            let Some(held) = self.best(&x, Some(k), true) else { break };
            shapes.extend(self.best(&held.x, None, false));
            x = held.x;
        }
        shapes
    }

    /// Takes the value of parameter k, and of those that follow it, from another list.
    fn set(&self, x: &mut [f64], k: usize, from: &[f64]) {
        let space = &self.base.level().space;
        space.followers(space.free[k]).for_each(|i| x[i] = from[i]);
    }
}
