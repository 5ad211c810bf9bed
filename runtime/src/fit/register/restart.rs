//! Multi-start restarts of parameters that shape only some parts (a handle): the rest of the model may fit well while
//! they are in the basin of another local minimum, or while the model is turned about the rest's axis of symmetry.

use super::Seeds;
use super::area::area;
use super::candidate::{Candidate, by_value, minimise, objective};
use super::group::{Group, Rest, groups, loss_ratio, rest};
use super::symmetry::equivalents;
use crate::fit::correspond::layout::Layout;
use crate::fit::optimise::gauss_newton::{self, Stop};
use crate::fit::problem::level::Level;
use crate::fit::problem::objective::{Objective, Order};
use crate::fit::problem::parameterization::{Estimate, Parameterization};
use crate::fit::problem::points::Points;
use crate::fit::tuning::{
    ACCEPTED, ALONE, ALONE_COARSE, ALONE_FINE, ALONE_ITERATIONS, ALONE_STEP, ANGLES, AREA_WEIGHT, AROUND_START, BATCH,
    CLEAR, EQUAL_VALUES, JOINT, JOINT_ITERATIONS, JOINT_POINTS, JOINT_STEP, LEAST_UNEXPLAINED, MODEL_SIZE, PART_CHORD,
    RANKED_POINTS, RESTART_ROUNDS, SAME_START, SMALL_GROUP, SMALL_GROUP_POINTS, SMALL_GROUP_STARTS, UNEXPLAINED_POINTS,
    VARIANTS, WORTH_ANOTHER_ROUND,
};
use crate::sampling::halton;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// The settings that the restarts of a candidate share.
#[derive(Clone, Copy)]
pub(crate) struct Restart<'s> {
    pub(crate) level: &'s Level<'s>,
    pub(crate) seeds: &'s Seeds,
    /// Points by which candidates are compared.
    pub(crate) points: &'s Points,
    /// Scale of the loss, in radii of the scan.
    pub(crate) scale: f64,
    pub(crate) scope: Scope,
    /// The part of the stage's time that the restarts take, for those who watch it.
    pub(crate) span: (f64, f64),
}

impl Restart<'_> {
    /// Shows how many rounds are done: the first one takes about half of the time, and so on.
    fn reach(&self, rounds: f64) {
        let (from, to) = self.span;
        self.level.problem.monitor.reach(to + (from - to) * (-rounds).exp2(), "parts in other places");
    }
}

/// The groups that are restarted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scope {
    /// All of them: even where nothing is wrong, another name for the same surface may be nearer to the reference.
    All,
    /// Those whose own points fit worse than the others, or of which a parameter is at a bound. The others are compared
    /// with the seeds' values once: what fits as well may not be the only thing that does.
    Doubtful,
}

/// Tries other values of every group of local parameters; returns the candidate, or a better one. Among equally good
/// ones (a curve run backwards is the same curve) it takes the one nearest to the reference.
pub(crate) fn restart(plan: &Restart, candidate: Candidate) -> Candidate {
    let groups = groups(plan.level);
    let mut best = candidate;
    for round in 0..RESTART_ROUNDS {
        let mut again = false;
        for (n, group) in groups.iter().enumerate() {
            plan.reach(round as f64 + n as f64 / groups.len() as f64);
            let Some(Restarted { better, ratio }) = restart_group(plan, group, round, &best) else { continue };
            // A group that still fits badly is tried once more with other values; and a rest that fits better shows
            // more clearly which points it leaves over, if there is any doubt or another group left.
            again |= !(ratio < ACCEPTED);
            if let Some(better) = better {
                let improved = better.value < (1.0 - WORTH_ANOTHER_ROUND) * best.value;
                again |= improved && (!(ratio < CLEAR) || groups.len() > 1);
                best = better;
            }
        }
        if !again {
            break;
        }
    }
    best
}

/// The outcome of the restarts of one group.
struct Restarted {
    better: Option<Candidate>,
    /// See `loss_ratio`, in the end.
    ratio: f64,
}

/// Restarts one group. None where the rest explains nearly all points, where the model does not exist, or where there
/// is no need to any more.
fn restart_group(plan: &Restart, group: &Group, round: usize, from: &Candidate) -> Option<Restarted> {
    let Restart { level, seeds, points, scale, scope, .. } = *plan;
    let thin = &level.problem.thin;
    let present = objective(level, thin, scale, Some(&from.signs));
    let rest = rest(&present, &from.estimate, group)?;
    // Points that the rest explains say nothing about this group.
    let unexplained = thin.pick((0..rest.explained.len()).filter(|i| !rest.explained[*i]));
    if unexplained.len() < LEAST_UNEXPLAINED {
        return None;
    }
    // At a bound a parameter is more often stuck than right.
    let at_bound = level.space.at_bound(&from.estimate);
    let ratio = |at: &Candidate| loss_ratio(&present, &at.estimate, &rest.explained);
    let doubtful = group.members.iter().any(|k| at_bound[*k]) || !(ratio(from)? < ACCEPTED);
    if scope == Scope::Doubtful && !doubtful && round > 0 {
        return None;
    }
    let unexplained = unexplained.sample(UNEXPLAINED_POINTS);
    // A small part has hardly a point among few: the unexplained ones are counted twice, and where few values are
    // tried, there are more of all.
    let small = group.members.len() <= SMALL_GROUP;
    let joint_points = thin.every(if small { SMALL_GROUP_POINTS } else { JOINT_POINTS }).and(&unexplained);
    let signs = &from.signs;
    // The sides of the group's patches are learnt anew: a curve run backwards turns its tube inside out.
    let from = &Candidate { signs: group.unsigned(signs), ..from.clone() };
    let local = Local::new(level, group, &rest, &unexplained, from)?;
    let value = objective(level, &joint_points, scale, Some(signs)).evaluate(&from.estimate, Order::Value)?.value;
    let value = value + local.surface(&from.estimate)?;
    let starts = starts(plan, group, from, round);
    let restarted = if doubtful {
        // At the final scale what is accepted is right; at a coarser one, it may be the next local minimum.
        let enough = if scope == Scope::All { CLEAR } else { ACCEPTED };
        let accepted = |at: &Candidate| ratio(at).is_some_and(|ratio| ratio < enough);
        if small {
            local.small_group(&starts, &joint_points, scale)
        } else {
            local.batches(&starts, &joint_points, scale, accepted)
        }
    } else if scope == Scope::Doubtful {
        local.jointly(&joint_points, scale, local.alone(scale, &local.known(&starts)))
    } else {
        vec![Candidate { value, ..from.clone() }]
    };
    let restarted = local.with_equivalents(plan, &joint_points, restarted);
    let least = restarted.first()?.value;
    let reference = &seeds.reference;
    let from_reference =
        |c: &Candidate| level.space.normalised_distance(&group.members, &c.estimate, reference, level.problem.radius);
    let equal = restarted.into_iter().take_while(|c| c.value <= least * (1.0 + EQUAL_VALUES));
    let best = equal.min_by(|a, b| from_reference(a).total_cmp(&from_reference(b)))?;
    let better = best.value < value * (1.0 - EQUAL_VALUES)
        || (best.value <= value * (1.0 + EQUAL_VALUES) && from_reference(&best) < from_reference(from));
    let ratio = ratio(if better { &best } else { from })?;
    if !better {
        return Some(Restarted { better: None, ratio });
    }
    // Its value is to be compared with others' again.
    let value = objective(level, points, scale, Some(&best.signs)).evaluate(&best.estimate, Order::Value)?.value;
    Some(Restarted { better: Some(Candidate { value, ..best }), ratio })
}

/// Estimates to restart from: the present values of the group's parameters, the seeds', and values spread over the
/// bounds and about the start's. `KNOWN` of them are known already.
fn starts(plan: &Restart, group: &Group, from: &Candidate, round: usize) -> Vec<Estimate> {
    let Restart { level, seeds: Seeds { start, reference }, .. } = *plan;
    let with = |values: &dyn Fn(usize) -> f64| {
        let mut estimate = from.estimate.clone();
        for (n, k) in group.members.iter().enumerate() {
            estimate.z[*k] = values(n);
        }
        estimate
    };
    let range = |k: &usize| level.space.search_range(*k, start.z[*k], level.problem.radius);
    let ranges: Vec<(f64, f64)> = group.members.iter().map(range).collect();
    let mut starts = vec![from.estimate.clone()];
    starts.extend([start, reference].map(|seed| with(&|n| seed.z[group.members[n]])));
    let count = group.effort(VARIANTS);
    let first = 1 + round * count;
    starts.extend((first..first + count).map(|i| {
        with(&|n| {
            let (low, high) = ranges[n];
            low + (high - low) * halton(i, n)
        })
    }));
    // If the start is near, values that resemble it are likelier than the rest.
    starts.extend((first..first + count / 2).map(|i| {
        with(&|n| {
            let ((low, high), middle) = (ranges[n], start.z[group.members[n]]);
            (middle + AROUND_START * (high - low) * (halton(i, n) - 0.5)).min(high).max(low)
        })
    }));
    starts
}

/// The number of known starts: the present values and the two seeds'.
const KNOWN: usize = 3;

/// The group's patches alone, with the points that no other patch explains.
///
/// There are two searches over a group's starts. One start costs a minimisation over the group alone, which is cheap,
/// or over everything, which is not. `batches` spends the latter on few winners of the former. That fails for small
/// parts: patches of the rest hide all their points, so that alone they feel nothing. `small_group` minimises over
/// everything from all known starts, which it can afford as few parameters have few starts.
struct Local<'s> {
    level: &'s Level<'s>,
    group: &'s Group,
    rest: &'s Rest,
    /// The points that the rest does not explain.
    unexplained: &'s Points,
    from: &'s Candidate,
    layout: Layout,
    /// The group's parameters as positions in the model's list.
    free: Vec<usize>,
    /// The area of the whole model. Square millimetres.
    whole_area: f64,
}

impl<'s> Local<'s> {
    fn new(
        level: &'s Level<'s>,
        group: &'s Group,
        rest: &'s Rest,
        unexplained: &'s Points,
        from: &'s Candidate,
    ) -> Option<Self> {
        let problem = level.problem;
        let instance = problem.model.instantiate(&level.space.x(&from.estimate.z)?).ok()?;
        let (tolerance, size) = (PART_CHORD * problem.radius, MODEL_SIZE * problem.radius);
        let layout = Layout::of_patches(problem.model, &*instance, tolerance, size, |patch| group.patches[patch]);
        let free = group.members.iter().map(|k| level.space.free[*k]).collect();
        let whole_area = area(level, &from.estimate, |_| true)?;
        Some(Self { level, group, rest, unexplained, from, layout, free, whole_area })
    }

    /// The price of the group's surface: of two that explain the scan alike the lesser one is the object's. A tube that
    /// ends on a wall may as well run on inside of it, to where its curve meets the wall's surface again.
    fn surface(&self, at: &Estimate) -> Option<f64> {
        Some(AREA_WEIGHT * area(self.level, at, |patch| self.group.patches[patch])? / self.whole_area)
    }

    /// Minimises over everything from every candidate. The values are those of the surface, too.
    fn jointly(&self, points: &Points, scale: f64, candidates: Vec<Candidate>) -> Vec<Candidate> {
        let level = self.level;
        let stop = Stop { iterations: JOINT_ITERATIONS, step: JOINT_STEP * level.problem.radius };
        let minimise = |from: Candidate| {
            let objective = objective(level, points, scale, Some(&from.signs));
            let minimum = minimise(level, &objective, &from, stop, true)?;
            Some(Candidate { value: minimum.value + self.surface(&minimum.estimate)?, ..minimum })
        };
        candidates.into_par_iter().filter_map(minimise).collect()
    }

    /// The present values and the seeds', those that are not the same.
    fn known(&self, starts: &[Estimate]) -> Vec<Candidate> {
        let Ranked { known, all } = self.rank(&starts[..KNOWN]);
        self.spread(known, all, KNOWN, SAME_START)
    }

    fn objective<'o>(&'o self, space: &'o Parameterization<'o>, scale: f64) -> Objective<'o> {
        let objective = objective(self.level, self.unexplained, scale, Some(&self.from.signs));
        Objective { space, layout: &self.layout, ..objective }
    }

    /// Candidates, and those that follow from the best one by exchanges of parameters; best first.
    fn with_equivalents(&self, plan: &Restart, points: &Points, candidates: Vec<Candidate>) -> Vec<Candidate> {
        let Restart { level, seeds: Seeds { reference, .. }, scale, .. } = *plan;
        let mut candidates = by_value(candidates);
        let Some(best) = candidates.first() else { return candidates };
        let alone = self.objective(&level.space, scale);
        let estimates = equivalents(&alone, &best.estimate, &self.group.members, reference, level.problem.radius);
        let signs = self.group.unsigned(&best.signs);
        let exchanged = estimates.into_iter().map(|estimate| Candidate { estimate, signs: signs.clone(), ..*best });
        candidates.extend(self.jointly(points, scale, exchanged.collect()));
        by_value(candidates)
    }

    /// A group of few parameters: minimises over everything from the known starts and from the best optimum of the
    /// group alone. At a fine scale all known starts may be too far off to feel the points, and that optimum is not.
    fn small_group(&self, starts: &[Estimate], points: &Points, scale: f64) -> Vec<Candidate> {
        let Ranked { known, all } = self.rank(starts);
        let near = SAME_START.min(SMALL_GROUP_STARTS * scale);
        let spread = self.spread(known.clone(), all.clone(), KNOWN + self.group.effort(ALONE), near);
        let mut chosen = self.spread(known, all, KNOWN + 1, SAME_START);
        chosen.extend(self.alone(scale, &spread).into_iter().take(1));
        self.jointly(points, scale, chosen)
    }

    /// A group of many: the likeliest starts first, batch by batch, until a candidate is `accepted`. Each is optimised
    /// over the group's parameters alone, and the best of a batch over everything.
    fn batches(
        &self,
        starts: &[Estimate],
        points: &Points,
        scale: f64,
        accepted: impl Fn(&Candidate) -> bool,
    ) -> Vec<Candidate> {
        let mut restarted: Vec<Candidate> = Vec::new();
        // Often a known start is in the basin of the right minimum.
        for only_known in [true, false] {
            let candidates = if only_known {
                self.known(starts)
            } else {
                self.spread(Vec::new(), self.rank(starts).all, self.group.effort(ALONE), SAME_START)
            };
            for batch in candidates.chunks(BATCH) {
                let best = self.spread(Vec::new(), self.alone(scale, batch), JOINT, SAME_START);
                restarted.extend(self.jointly(points, scale, best));
                if restarted.iter().min_by(|a, b| a.value.total_cmp(&b.value)).is_some_and(&accepted) {
                    return restarted;
                }
            }
        }
        restarted
    }

    /// Every start at every angle about the axis of symmetry.
    fn rank(&self, starts: &[Estimate]) -> Ranked {
        let points = &self.unexplained.every(RANKED_POINTS);
        let coarse = Objective { points, ..self.objective(&self.level.space, ALONE_COARSE) };
        let angles = if self.rest.axis.is_some() { ANGLES } else { 1 };
        let of_start = |start: &Estimate| {
            let placed = coarse.place(start).ok();
            let turned = |turn: u32| {
                let mut estimate = start.clone();
                if let Some(axis) = &self.rest.axis {
                    let angle = TAU * f64::from(turn) / f64::from(ANGLES);
                    estimate.motion = axis.rotated(&start.motion, angle, self.level.space.centre);
                }
                let value = coarse.rough_value(&placed.as_ref()?.facets, &estimate.motion);
                Some(Candidate { estimate, value, ..self.from.clone() })
            };
            (0..angles).filter_map(turned).collect()
        };
        let turned: Vec<Vec<Candidate>> = starts.par_iter().map(of_start).collect();
        let best = |turned: &Vec<Candidate>| turned.iter().min_by(|a, b| a.value.total_cmp(&b.value)).cloned();
        Ranked { known: turned.iter().take(KNOWN).filter_map(best).collect(), all: by_value(turned.concat()) }
    }

    /// Minimises over the group's parameters alone, from every candidate; best first.
    fn alone(&self, scale: f64, candidates: &[Candidate]) -> Vec<Candidate> {
        let minimise = |from: &Candidate| {
            let level = self.level;
            let x = level.space.x(&from.estimate.z)?;
            let mut space = Parameterization::new(level.problem.model, &x, self.free.clone(), false, &level.space.ties);
            space.copy_scale(&level.space);
            let stop = Stop { iterations: ALONE_ITERATIONS, step: ALONE_STEP * level.problem.radius };
            let at = space.estimate(&x, from.estimate.motion);
            let at = gauss_newton::minimise(&self.objective(&space, ALONE_COARSE), at, stop)?.estimate;
            let minimum = gauss_newton::minimise(&self.objective(&space, ALONE_FINE * scale), at, stop)?;
            let estimate = level.space.estimate(&space.x(&minimum.estimate.z)?, minimum.estimate.motion);
            Some(Candidate { estimate, value: minimum.evaluation.value, ..from.clone() })
        };
        by_value(candidates.par_iter().filter_map(minimise).collect())
    }

    /// Some candidates and the best of others, `most` in all, of which no two are within `near` (scan's radii) of each
    /// other or of the former.
    fn spread(&self, mut chosen: Vec<Candidate>, others: Vec<Candidate>, most: usize, near: f64) -> Vec<Candidate> {
        let (space, radius) = (&self.level.space, self.level.problem.radius);
        let apart = |a: &Estimate, b: &Estimate| {
            let turned = a.motion.rotation.angle_between(b.motion.rotation) > SAME_START;
            turned || a.motion.apply(space.centre).distance(b.motion.apply(space.centre)) > SAME_START * radius || {
                let moved = |k: &usize| space.coordinate_distance(*k, a, b);
                self.group.members.iter().map(moved).fold(0.0, f64::max) > near * radius
            }
        };
        for other in others {
            if chosen.len() < most && chosen.iter().all(|c| apart(&c.estimate, &other.estimate)) {
                chosen.push(other);
            }
        }
        chosen
    }
}

/// Candidates at the starts, ranked by a coarse objective.
struct Ranked {
    /// The best of each of the known starts.
    known: Vec<Candidate>,
    /// All of them, best first.
    all: Vec<Candidate>,
}
