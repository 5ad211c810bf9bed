//! Second chances for parameters that shape only some parts (a handle): the rest of the model may fit well while they are
//! stuck in a wrong valley, or while the model is turned about the rest's axis of symmetry.

use super::group::{Axis, Group, Verdict, groups, judge, unexplained};
use super::proposals::halton;
use super::screening::Candidate;
use super::symmetry::relabelled;
use crate::fit::correspond::layout::Layout;
use crate::fit::problem::level::Level;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::{Objective, Order};
use crate::fit::problem::parameterization::{Estimate, Parameterization};
use crate::fit::problem::points::Points;
use crate::fit::refine::gauss_newton::{self, Stop};
use rayon::prelude::*;

/// Values of a group's parameters that are tried, beside the present ones and the start's: so many a parameter, and at most.
const VARIANTS: (usize, usize) = (12, 48);
/// Angles about an axis of symmetry.
const ANGLES: u32 = 16;
/// Points on which everything is optimised; so many for groups with so few members.
const PURSUING: usize = 800;
const MANY: usize = 3000;
const FEW_MEMBERS: usize = 2;
/// Points by which variants are ranked.
const RANKED: usize = 80;
/// The variants that are always optimised: the present values, the start's and those at home.
const KNOWN: usize = 3;
/// Others that are optimised alone: so many a parameter, and at most.
const SETTLED: (usize, usize) = (4, 20);
/// Rounds over all groups, at most.
const ROUNDS: usize = 3;
/// So many of them at a time, of which so many at most are then optimised with everything else.
const AT_ONCE: usize = 8;
const PURSUED: usize = 2;
/// How far, in the scan's radii, a group's parameters move the surface between two values that are the same.
const SAME: f64 = 0.1;
/// The scale of psi with which variants are ranked, as a fraction of the scan's radius.
const COARSE: f64 = 0.1;

/// Tries other values of every group of local parameters; returns the candidate, or a better one. Among equally good ones (a
/// curve run backwards is the same curve) it takes the one nearest to `home`.
pub(crate) fn restart(
    level: &Level,
    seeds: &Seeds,
    points: &Points,
    scale: f64,
    scope: Scope,
    candidate: Candidate,
) -> Candidate {
    let mut best = candidate;
    for round in 0..ROUNDS {
        let mut again = false;
        let groups = groups(level);
        for group in &groups {
            let look = Look { points, scale, scope, round };
            let Some(Retried { better, verdict }) = retry(level, seeds, look, group, &best) else { continue };
            // What did not succeed is tried once more with other values; and a rest that fits better shows more clearly what it
            // leaves over, if there is any doubt or another group left.
            again |= verdict == Verdict::Doubtful;
            if let Some(better) = better {
                again |= better.value < 0.99 * best.value && (verdict < Verdict::Clear || groups.len() > 1);
                best = better;
            }
        }
        if !again {
            break;
        }
    }
    best
}

/// Values that parameters may well have.
pub(crate) struct Seeds {
    /// The user's.
    pub(crate) start: Estimate,
    /// Those that decide between two names for the same surface.
    pub(crate) reference: Estimate,
}

/// Which groups are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scope {
    /// All of them: even where nothing is wrong, another name for the same surface may be nearer to home.
    All,
    /// Those whose own points fit worse than the others, or of which a parameter is at a bound.
    Doubtful,
}

/// How a group is looked at.
#[derive(Clone, Copy)]
struct Look<'s> {
    /// By which candidates are compared with others.
    points: &'s Points,
    /// Of psi, as a fraction of the scan's radius.
    scale: f64,
    scope: Scope,
    round: usize,
}

/// What came of other values for a group.
struct Retried {
    better: Option<Candidate>,
    /// What the points that only the group can explain say in the end.
    verdict: Verdict,
}

fn retry(
    level: &Level,
    seeds: &Seeds,
    Look { points, scale, scope, round }: Look,
    group: &Group,
    from: &Candidate,
) -> Option<Retried> {
    let fine = Loss::welsch(scale * level.problem.radius);
    let objective = Objective { signs: Some(&from.signs), ..level.objective(&level.problem.thin, fine) };
    // What the other patches explain says nothing about this group.
    let (explained, axis) = unexplained(&objective, &from.estimate, group)?;
    let rest = level.problem.thin.pick((0..explained.len()).filter(|i| !explained[*i]));
    if rest.len() < 8 {
        return None;
    }
    // At a bound a parameter is more often stuck than right.
    let at_bound = level.space.at_bound(&from.estimate);
    let stuck = group.members.iter().any(|k| at_bound[*k]);
    let verdict = |at: &Candidate| judge(&objective, &at.estimate, &explained);
    let doubtful = stuck || verdict(from)? == Verdict::Doubtful;
    if scope == Scope::Doubtful && !doubtful {
        return None;
    }
    let rest = rest.sample(200);
    // A small part has hardly a point among few: its own are counted beside them, and where few values are tried, more.
    let few = level.problem.thin.every(if group.members.len() <= FEW_MEMBERS { MANY } else { PURSUING }).and(&rest);
    // Which way the group's patches face is learnt anew: a curve run backwards turns its tube inside out.
    let from = &Candidate { signs: group.unsigned(&from.signs), ..from.clone() };
    let local = Local::new(level, group, &rest, from)?;
    // At the final scale what is settled is right; at a coarser one, it may be the next valley.
    let enough = if scope == Scope::All { Verdict::Clear } else { Verdict::Settled };
    let settles = |at: &Candidate| verdict(at) >= Some(enough);
    let mut pursued = if doubtful {
        let tried = variants(level, seeds, group, from, round);
        local.pursue_likely(tried, axis, group, &few, scale, settles)
    } else {
        vec![from.clone()]
    };
    pursued.sort_by(|a, b| a.value.total_cmp(&b.value));
    if let Some(best) = pursued.first() {
        let alone = local.objective(&level.space, scale);
        let same = relabelled(&alone, &best.estimate, &group.members, &seeds.reference, level.problem.radius);
        let signs = group.unsigned(&best.signs);
        let with = |estimate| Candidate { estimate, signs: signs.clone(), ..best.clone() };
        let same: Vec<Candidate> = same.into_iter().map(with).collect();
        pursued.extend(same.into_iter().filter_map(|candidate| pursue(level, &few, scale, candidate)));
        pursued.sort_by(|a, b| a.value.total_cmp(&b.value));
    }
    let least = pursued.first()?.value;
    let away = |c: &Candidate| {
        level.space.normalised_distance(&group.members, &c.estimate, &seeds.reference, level.problem.radius)
    };
    let best =
        pursued.into_iter().take_while(|c| c.value <= least * 1.002).min_by(|a, b| away(a).total_cmp(&away(b)))?;
    let present = Objective { signs: objective.signs, ..level.objective(&few, fine) };
    let present = present.evaluate(&from.estimate, Order::Value)?.value;
    let better = best.value < present * 0.998 || (best.value <= present * 1.002 && away(&best) < away(from));
    let verdict = verdict(if better { &best } else { from })?;
    if !better {
        return Some(Retried { better: None, verdict });
    }
    // Its value is to be compared with others' again.
    let there = Objective { signs: Some(&best.signs), ..level.objective(points, fine) };
    let value = there.evaluate(&best.estimate, Order::Value)?.value;
    Some(Retried { better: Some(Candidate { value, ..best }), verdict })
}

/// Some of what is ranked (best first): the best of each of the first `known` variants, and the best `count` others of which
/// no two are within `near` (scan's radii) of each other.
fn diverse(
    level: &Level,
    group: &Group,
    ranked: Vec<(usize, Candidate)>,
    [known, count]: [usize; 2],
    near: f64,
) -> Vec<(usize, Candidate)> {
    let mut chosen: Vec<(usize, Candidate)> = Vec::new();
    for wanted in 0..known {
        chosen.extend(ranked.iter().find(|(number, _)| *number == wanted).cloned());
    }
    let apart = |a: &Estimate, b: &Estimate| {
        let c = level.space.centre;
        let turned = a.motion.rotation.angle_between(b.motion.rotation) > 0.1;
        turned || a.motion.apply(c).distance(b.motion.apply(c)) > 0.1 * level.problem.radius || {
            let moved = |k: &usize| level.space.coordinate_distance(*k, a, b);
            group.members.iter().map(moved).fold(0.0, f64::max) > near * level.problem.radius
        }
    };
    for (number, candidate) in ranked {
        if chosen.len() < known + count && chosen.iter().all(|(_, c)| apart(&c.estimate, &candidate.estimate)) {
            chosen.push((number, candidate));
        }
    }
    chosen
}

/// The group's patches alone, with the points that no other patch explains.
struct Local<'s> {
    level: &'s Level<'s>,
    rest: &'s Points,
    from: &'s Candidate,
    layout: Layout,
    /// The group's parameters as positions in the model's list.
    free: Vec<usize>,
}

impl<'s> Local<'s> {
    fn new(level: &'s Level<'s>, group: &Group, rest: &'s Points, from: &'s Candidate) -> Option<Self> {
        let x = level.space.x(&from.estimate.z)?;
        let instance = level.problem.model.instantiate(&x).ok()?;
        let (tolerance, size) = (0.005 * level.problem.radius, 2.0 * level.problem.radius);
        let layout = Layout::of_patches(level.problem.model, &*instance, tolerance, size, |patch| group.patches[patch]);
        let free = group.members.iter().map(|k| level.space.free[*k]).collect();
        Some(Self { level, rest, from, layout, free })
    }

    fn objective<'o>(&'o self, space: &'o Parameterization<'o>, scale: f64) -> Objective<'o> {
        let problem = self.level.problem;
        let loss = Loss::welsch(scale * problem.radius);
        let objective = Objective::new(space, &self.layout, self.rest, loss, problem.monitor);
        Objective { signs: Some(&self.from.signs), ..objective }
    }

    /// Every variant at every angle about an axis of symmetry, with its number, best first.
    fn rank(&self, variants: Vec<Estimate>, axis: Option<Axis>) -> Vec<(usize, Candidate)> {
        let few = self.rest.every(RANKED);
        let coarse = Objective { points: &few, ..self.objective(&self.level.space, COARSE) };
        let turns = if axis.is_some() { ANGLES } else { 1 };
        let mut ranked: Vec<(usize, Candidate)> = variants
            .into_par_iter()
            .enumerate()
            .flat_map_iter(|(number, estimate)| {
                let placed = coarse.place(&estimate).ok();
                let tried: Vec<(usize, Candidate)> = (0..turns)
                    .filter_map(|turn| {
                        let mut at = estimate.clone();
                        if let Some((shift, rotation)) = axis {
                            let angle = std::f64::consts::TAU * f64::from(turn) / f64::from(ANGLES);
                            at.motion = at.motion.after_local(shift * angle, rotation * angle, self.level.space.centre);
                        }
                        let value = coarse.rough_value(placed.as_ref()?, &at.motion);
                        Some((number, Candidate { estimate: at, value, ..self.from.clone() }))
                    })
                    .collect();
                tried
            })
            .collect();
        ranked.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
        ranked
    }

    /// Optimises variants, the likeliest ones first, until one `settles` the matter: first the group's parameters alone, then
    /// those of them that are best with everything else.
    fn pursue_likely(
        &self,
        variants: Vec<Estimate>,
        axis: Option<Axis>,
        group: &Group,
        few: &Points,
        scale: f64,
        settles: impl Fn(&Candidate) -> bool,
    ) -> Vec<Candidate> {
        let level = self.level;
        let pursue_all = |chosen: Vec<(usize, Candidate)>| -> Vec<Candidate> {
            chosen.into_par_iter().filter_map(|(_, candidate)| pursue(level, few, scale, candidate)).collect()
        };
        if group.members.len() <= FEW_MEMBERS {
            // What the other parts explain may hide all points of a small one: its known values are tried on everything. At a fine
            // scale they may all be too far off to feel the points, which the best of what the part alone comes to does.
            let ranked = self.rank(variants, axis);
            let likely = diverse(level, group, ranked.clone(), [KNOWN, group.of(SETTLED)], SAME.min(3.0 * scale));
            let mut chosen = diverse(level, group, ranked, [KNOWN, 1], SAME);
            chosen.extend(self.settle_all(scale, &likely).into_iter().take(1));
            return pursue_all(chosen);
        }
        let mut pursued: Vec<Candidate> = Vec::new();
        // Often what is known already lies in the right valley.
        let known = variants[..KNOWN].to_vec();
        for (variants, count) in [(known, [KNOWN, 0]), (variants, [0, group.of(SETTLED)])] {
            for likely in diverse(level, group, self.rank(variants, axis), count, SAME).chunks(AT_ONCE) {
                let settled = self.settle_all(scale, likely);
                pursued.extend(pursue_all(diverse(level, group, settled, [0, PURSUED], SAME)));
                if pursued.iter().min_by(|a, b| a.value.total_cmp(&b.value)).is_some_and(&settles) {
                    return pursued;
                }
            }
        }
        pursued
    }

    /// Optimises the group's parameters alone, of every candidate; best first.
    fn settle_all(&self, scale: f64, candidates: &[(usize, Candidate)]) -> Vec<(usize, Candidate)> {
        let settle = |(number, candidate): &(usize, Candidate)| Some((*number, self.settle(scale, candidate.clone())?));
        let mut settled: Vec<(usize, Candidate)> = candidates.par_iter().filter_map(settle).collect();
        settled.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
        settled
    }

    /// Optimises the group's parameters alone.
    fn settle(&self, scale: f64, candidate: Candidate) -> Option<Candidate> {
        let level = self.level;
        let x = level.space.x(&candidate.estimate.z)?;
        let mut space = Parameterization::new(level.problem.model, &x, self.free.clone(), false, &level.space.ties);
        space.copy_scale(&level.space);
        let stop = Stop { iterations: 10, step: 1e-3 * level.problem.radius };
        let at = space.estimate(&x, candidate.estimate.motion);
        let at = gauss_newton::minimise(&self.objective(&space, COARSE), at, stop)?.estimate;
        let found = gauss_newton::minimise(&self.objective(&space, 0.8 * scale), at, stop)?;
        let estimate = level.space.estimate(&space.x(&found.estimate.z)?, found.estimate.motion);
        Some(Candidate { estimate, value: found.evaluation.value, ..candidate })
    }
}

/// Optimises everything.
fn pursue(level: &Level, points: &Points, scale: f64, candidate: Candidate) -> Option<Candidate> {
    let objective = Objective {
        signs: Some(&candidate.signs),
        ..level.objective(points, Loss::welsch(scale * level.problem.radius))
    };
    let stop = Stop { iterations: 12, step: 5e-4 * level.problem.radius };
    let minimum = gauss_newton::minimise(&objective, candidate.estimate.clone(), stop)?;
    let signs = level.problem.facing(&minimum.evaluation, &candidate.signs);
    Some(Candidate { estimate: minimum.estimate, value: minimum.evaluation.value, signs, ..candidate })
}

/// The present values, those that are known, and values spread over the bounds.
fn variants(level: &Level, seeds: &Seeds, group: &Group, from: &Candidate, round: usize) -> Vec<Estimate> {
    let with = |values: &dyn Fn(usize) -> f64| {
        let mut estimate = from.estimate.clone();
        for (n, k) in group.members.iter().enumerate() {
            estimate.z[*k] = values(n);
        }
        estimate
    };
    let ranges: Vec<(f64, f64)> =
        group.members.iter().map(|k| level.space.search_range(*k, seeds.start.z[*k], level.problem.radius)).collect();
    let mut variants = vec![from.estimate.clone()];
    variants.extend([&seeds.start, &seeds.reference].map(|known| with(&|n| known.z[group.members[n]])));
    let count = group.of(VARIANTS);
    let first = 1 + round * count;
    variants.extend((first..first + count).map(|i| {
        with(&|n| {
            let (low, high) = ranges[n];
            low + (high - low) * halton(i, n)
        })
    }));
    // Where the start is near, what resembles it is more likely than the rest.
    variants.extend((first..first + count / 2).map(|i| {
        with(&|n| {
            let ((low, high), middle) = (ranges[n], seeds.start.z[group.members[n]]);
            (middle + 0.4 * (high - low) * (halton(i, n) - 0.5)).min(high).max(low)
        })
    }));
    variants
}
