//! Other shapes of a part that explain the scan as well: a piece of a cubic is a cubic, and where a handle's end is not
//! seen, another piece of the same curve may end on the same wall. The curvature at the optimum knows nothing of them,
//! nor of how far a curved valley reaches. They are looked for by the profile of the loss: one parameter of a group is
//! held at other values, and the others of the group find the best that there is (Bates and Watts 1988, section 6.1).

mod alone;
mod base;
mod frames;
mod names;
mod relabelled;
mod turned;

use super::convergence::{self, Assessed};
use super::sandwich::Uncertainty;
use crate::fit::problem::level::Level;
use crate::fit::problem::parameterization::Estimate;
use crate::fit::problem::sides::Sides;
use crate::fit::refine::schedule::{Guess, POLISH, Solution, polish};
use crate::fit::refine::witness::{self, Witness};
use crate::fit::register::group::{chains, groups};
use crate::fit::tuning::{
    RIVAL_BETTER, RIVAL_CONTRADICTED, RIVAL_DEVIATIONS, RIVAL_EVIDENCE, RIVALS_ADOPTED, THIN_POINTS, TURN_BETTER,
    TURN_EVIDENCE,
};
use alone::Alone;
use base::Base;

/// The difference between a solution and its rival.
#[derive(Clone, Debug)]
pub(crate) struct RivalOf {
    /// Positions of the parameters in the list of free ones.
    pub(crate) members: Vec<usize>,
    /// By patch, whether they shape it.
    pub(crate) patches: Vec<bool>,
    /// Whether the whole model is turned.
    pub(crate) turned: bool,
    /// Positions of the parameters whose values the scan leaves open in the rival.
    pub(crate) open: Vec<usize>,
}

impl RivalOf {
    /// Whether the scan prefers such a shape to the solution (see [`Rival`]). Of two poses of one shape, which a fit
    /// may begin at as well, the better one is the optimum: it need not be so clearly better as a shape that few points
    /// may have made.
    fn is_preferred(&self, evidence: f64, certainty: f64) -> bool {
        let [more, better] = if self.turned { [TURN_EVIDENCE, TURN_BETTER] } else { [RIVAL_EVIDENCE, RIVAL_BETTER] };
        evidence < -more && certainty < -better
    }
}

/// Another shape of the parts of one group, or another pose of the whole model.
#[derive(Clone, Debug)]
pub(crate) struct Rival {
    pub(crate) estimate: Estimate,
    /// The scaled step of the free parameters from the solution to here.
    pub(crate) step: Vec<f64>,
    pub(crate) of: RivalOf,
    /// n ln(ratio of the mean loss to the solution's), with the effective points: below zero it explains the scan
    /// better.
    pub(crate) evidence: f64,
    /// By how many standard deviations the mean of the points' differences in loss is above zero (Vuong 1989): a few
    /// outliers that lie near one of the two shapes by chance make evidence, but no mean.
    pub(crate) certainty: f64,
    /// It is the solution's surface, by parameters that are nearer to the start.
    pub(crate) relabelled: bool,
    /// The model's surface that the scan contradicts. Square millimetres; zero where the scan does not say.
    pub(crate) contradicted: f64,
}

/// Looks for rivals of a solution, goes over to the one that the scan prefers if there is one, and puts the others into
/// the uncertainty: they are the second value.
pub(crate) fn weigh(mut assessed: Assessed) -> (Assessed, Vec<Rival>) {
    let monitor = assessed.solution.level.problem.monitor;
    // Other shapes are judged by the scan's points, and not by the term that holds the ends.
    let is_judged = assessed.solution.level.coverage.is_none();
    let Some(uncertainty) = assessed.uncertainty.as_ref().filter(|_| is_judged) else { return (assessed, Vec::new()) };
    let mut found = find(&assessed.solution, uncertainty);
    for _ in 0..RIVALS_ADOPTED {
        let Some(preferred) = found.preferred().filter(|_| !monitor.cancelled()) else { break };
        let next = convergence::assess(preferred.solution(&assessed.solution));
        let Some(uncertainty) = &next.uncertainty else { break };
        found = find(&next.solution, uncertainty);
        assessed = next;
    }
    // What was found by a search that was cancelled is chance.
    let found = if monitor.cancelled() { Rivals::default() } else { found };
    let (uncertainty, rivals) = assessed.uncertainty.map(|uncertainty| found.include(uncertainty)).unzip();
    (Assessed { uncertainty, ..assessed }, rivals.unwrap_or_default())
}

impl Rival {
    /// The optimum at the rival, over all points.
    fn solution<'a>(&self, from: &Solution<'a>) -> Solution<'a> {
        let (level, guess) = from.clone().into_guess();
        let level = match level.around(&self.estimate) {
            Ok(around) => Level { coverage: level.coverage, separation: level.separation, ..around },
            Err(_) => level,
        };
        let signs = Sides::of(&level, &self.estimate, guess.loss).map_or(guess.signs, |sides| sides.signs);
        let points = &level.problem.points;
        polish(level, points, Guess { estimate: self.estimate.clone(), signs, ..guess }, Some(POLISH))
    }
}

/// The rivals of a solution, and the area of its own surface that the scan contradicts.
#[derive(Default)]
pub(crate) struct Rivals {
    pub(crate) rivals: Vec<Rival>,
    /// Square millimetres.
    pub(crate) contradicted: f64,
    /// More contradicted area than this is no chance. Square millimetres.
    pub(crate) chance: f64,
}

/// Looks for shapes of every group of parameters that explain the scan as well as the solution does.
pub(crate) fn find(solution: &Solution, uncertainty: &Uncertainty) -> Rivals {
    let found = by_points(solution, uncertainty);
    if found.is_empty() {
        return Rivals::default();
    }
    let witness = Witness::of(solution);
    let area = |at: &Estimate| Some(witness::total(&witness.as_ref()?.contradicted(at)?));
    let (contradicted, chance) = area(&solution.estimate).unwrap_or_default();
    // A shape that stands where the scan shows empty space is no rival.
    let rivals = found.into_iter().filter_map(|rival| {
        let (there, _) = area(&rival.estimate).unwrap_or_default();
        (there <= contradicted + RIVAL_CONTRADICTED * chance).then_some(Rival { contradicted: there, ..rival })
    });
    Rivals { rivals: rivals.collect(), contradicted, chance }
}

/// The rivals by the scan's points, whatever stands in empty space and whether walls pass through each other: the term
/// that holds them apart takes longer than all points do.
fn by_points(solution: &Solution, uncertainty: &Uncertainty) -> Vec<Rival> {
    let solution = &Solution { level: solution.level.without_separation(), ..solution.clone() };
    let mut groups = groups(&solution.level);
    groups.extend(chains(&groups));
    if groups.is_empty() && !solution.level.space.moving {
        return Vec::new();
    }
    // Not the sample of the registration, which is even in space and not in noise.
    let points = &solution.level.problem.points;
    let sample = points.every(THIN_POINTS);
    let Some(base) = Base::new(solution, uncertainty, &sample) else { return Vec::new() };
    let mut rivals: Vec<Rival> =
        groups.iter().filter_map(|group| Some(Alone::new(&base, group)?.rivals())).flatten().collect();
    rivals.extend(turned::rivals(&base));
    if rivals.is_empty() || sample.len() == points.len() {
        return rivals;
    }
    // Two optima of a sample may be one over all points, and two of its outliers may speak for another shape.
    let Some(of_all) = Base::new(solution, uncertainty, points) else { return Vec::new() };
    rivals.retain(|rival| {
        let by_all = |level: Level| of_all.rival(&level, rival.of.clone(), rival.estimate.clone());
        rival.relabelled || solution.level.around(&rival.estimate).ok().and_then(by_all).is_some()
    });
    rivals
}

impl Rivals {
    /// The rival that the scan prefers to the solution: one that explains it clearly better, or as well with clearly
    /// less surface where the scan shows empty space.
    pub(crate) fn preferred(&self) -> Option<&Rival> {
        let better = |r: &&Rival| {
            r.relabelled
                || r.of.is_preferred(r.evidence, r.certainty)
                || r.contradicted < self.contradicted - RIVAL_CONTRADICTED * self.chance
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
        let deviations =
            |uncertainty: &Uncertainty, rival: &Rival| largest(uncertainty, &rival.of.members, &rival.step);
        self.rivals.retain(|rival| !rival.relabelled);
        self.rivals.sort_by(|a, b| deviations(&uncertainty, b).total_cmp(&deviations(&uncertainty, a)));
        let mut included = Vec::new();
        for rival in self.rivals {
            if !(deviations(&uncertainty, &rival) > RIVAL_DEVIATIONS) {
                continue;
            }
            let known: Vec<usize> = rival.of.members.iter().copied().filter(|k| uncertainty.determines(*k)).collect();
            for a in &known {
                for b in &known {
                    uncertainty.covariance[(*a, *b)] += 0.25 * rival.step[*a] * rival.step[*b];
                }
            }
            // By the rival's names the scan does not show what has this one.
            rival.of.open.iter().for_each(|k| uncertainty.leave_open(*k));
            included.push(rival);
        }
        (uncertainty, included)
    }
}

/// The largest part of a step along some coordinates, in standard deviations.
fn largest(uncertainty: &Uncertainty, members: &[usize], step: &[f64]) -> f64 {
    let deviation = |k: usize| uncertainty.covariance[(k, k)].sqrt().max(f64::MIN_POSITIVE);
    let determined = members.iter().filter(|k| uncertainty.determines(**k));
    determined.map(|k| step[*k].abs() / deviation(*k)).fold(0.0, f64::max)
}
