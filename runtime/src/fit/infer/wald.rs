//! Whether the scan contradicts a value at which a parameter was held: Wald's test, on the fit with it released.

use super::bias;
use super::significance::chi_squared_tail;
use crate::fit::monitor::Monitor;
use crate::fit::options::FitOptions;
use crate::fit::plan;
use crate::fit::problem::Problem;
use crate::fit::problem::level::Level;
use crate::fit::problem::parameterization::Parameterization;
use crate::fit::refine::schedule::{Guess, Solution, polish};
use crate::fit::refine::solve::solve;
use crate::fit::result::HypothesisTest;
use crate::fit::tuning::{CHORD, SIGNIFICANT};
use nalgebra::{DMatrix, DVector};

/// Tests every parameter that was fixed at a value of `options.start`, each by itself (the others released as well),
/// and all of them together where there are several.
pub(crate) fn test(solution: &Solution) -> Vec<HypothesisTest> {
    let problem = solution.level.problem;
    let parameters = problem.model.parameters();
    let given = |i: &usize| problem.start.fixed[*i] && problem.options.start.contains_key(&parameters[*i].name);
    let tested: Vec<usize> = (0..parameters.len()).filter(given).collect();
    if tested.is_empty() || problem.monitor.cancelled() {
        return Vec::new();
    }
    let released = problem.monitor.stage("test", || released(solution, &tested));
    if problem.monitor.cancelled() {
        return Vec::new();
    }
    let Some(Released { x, values, covariance }) = released else {
        problem
            .monitor
            .warn("whether the scan contradicts the fixed values cannot be tested: it does not determine them");
        return Vec::new();
    };
    let one = |chosen: &[usize]| {
        let off = DVector::from_iterator(chosen.len(), chosen.iter().map(|a| values[*a] - x[tested[*a]]));
        let block = DMatrix::from_fn(chosen.len(), chosen.len(), |a, b| covariance[(chosen[a], chosen[b])]);
        let statistic = off.dot(&block.cholesky()?.solve(&off));
        Some(HypothesisTest {
            parameters: chosen.iter().map(|a| parameters[tested[*a]].name.clone()).collect(),
            held: chosen.iter().map(|a| x[tested[*a]]).collect(),
            free: chosen.iter().map(|a| values[*a]).collect(),
            sd: chosen.iter().map(|a| covariance[(*a, *a)].sqrt()).collect(),
            statistic,
            degrees: chosen.len(),
            p: chi_squared_tail(statistic, chosen.len()),
        })
    };
    let all: Vec<usize> = (0..tested.len()).collect();
    let mut tests: Vec<HypothesisTest> = all.iter().filter_map(|a| one(&[*a])).collect();
    if all.len() > 1 {
        tests.extend(one(&all));
    }
    tests
}

/// A fit in which tested parameters are no longer held.
struct Released {
    /// The parameters with the tested ones held.
    x: Vec<f64>,
    /// The values that the tested ones take when released.
    values: Vec<f64>,
    /// The covariance of these.
    covariance: DMatrix<f64>,
}

/// Releases some held parameters: in a whole new fit, and at the held solution, which may lie in another minimum. Both
/// minimise the same loss, the one of smaller scale. None where the scan does not determine the parameters.
fn released(solution: &Solution, tested: &[usize]) -> Option<Released> {
    let problem = solution.level.problem;
    let x = solution.level.space.x(&solution.estimate.z)?;
    let options = released_options(problem, tested);
    let piece = problem.monitor.piece();
    let monitor = Monitor::of_stages(&piece, plan::to_solution(&options[0]));
    let again = options.iter().find_map(|o| Problem::new(problem.model, problem.scan, o, &monitor).ok());
    let anew = again.as_ref().and_then(|problem| solve(problem).ok());
    problem.monitor.count(monitor.evaluations());
    if problem.monitor.cancelled() {
        return None;
    }
    // The new fit has nothing to say on parameters of the pose that the motion stands for.
    let anew = anew.filter(|anew| tested.iter().all(|i| anew.level.space.varies(*i)));
    let loss = match &anew {
        Some(anew) if anew.loss.sigma < solution.loss.sigma => anew.loss,
        _ => solution.loss,
    };
    let anew = anew.map(|anew| match anew.loss == loss {
        true => anew,
        false => {
            let (level, guess) = anew.into_guess();
            polish(level, &problem.points, Guess { loss, ..guess }, None)
        }
    });
    let space = &solution.level.space;
    let Level { coverage, separation, .. } = anew.as_ref().map_or(&solution.level, |anew| &anew.level);
    let (coverage, separation) = (coverage.clone(), separation.clone());
    let mut free: Vec<usize> = space.free.iter().chain(tested).copied().collect();
    free.sort_unstable();
    let wider = Parameterization::new(problem.model, &x, free, space.moving, &space.ties);
    let estimate = wider.estimate(&x, solution.estimate.motion);
    let level = Level::new(problem, wider, &estimate, CHORD).ok()?;
    let guess = Guess { estimate, loss, signs: solution.signs.clone(), iterations: 0 };
    let near = polish(Level { coverage, separation, ..level }, &problem.points, guess, None);
    match anew.filter(|anew| clearly_better(anew, &near, tested.len())) {
        Some(anew) => values_of(&anew, tested, x),
        None => values_of(&near, tested, x),
    }
}

/// The user's options without the holds under test. Their other start values may be outside of bounds that depend on
/// the tested parameters, unless these begin at the values at which they were held: the second choice.
fn released_options(problem: &Problem, tested: &[usize]) -> [FitOptions; 2] {
    let names: Vec<&String> = tested.iter().map(|i| &problem.model.parameters()[*i].name).collect();
    let mut near = problem.options.clone();
    near.fixed.retain(|name| !names.contains(&name));
    // Where an earlier fit ended, the values under test may have decided.
    let mut anew = FitOptions { earlier: None, ..near.clone() };
    anew.start.retain(|name, _| !names.contains(&name));
    [anew, near]
}

/// Whether the mean loss of the new fit is smaller than that of the fit near the held solution by more than chance, in
/// `degrees` parameters: by n ln(ratio), as in Schwarz's criterion. Otherwise the two may differ in name only: in the
/// angles of one rotation, or by a symmetry of the model.
fn clearly_better(anew: &Solution, near: &Solution, degrees: usize) -> bool {
    if !(anew.evaluation.value < near.evaluation.value) {
        return false;
    }
    let Some(uncertainty) = super::uncertainty(anew) else { return false };
    let ratio = near.evaluation.value / anew.evaluation.value.max(f64::MIN_POSITIVE);
    chi_squared_tail(uncertainty.effective_points * ratio.ln(), degrees) < SIGNIFICANT
}

/// The tested parameters in a fit that has them free.
fn values_of(refitted: &Solution, tested: &[usize], x: Vec<f64>) -> Option<Released> {
    let values = refitted.level.space.x(&refitted.estimate.z)?;
    let uncertainty = bias::include(refitted, super::uncertainty(refitted)?);
    let slope = refitted.level.space.chain(&refitted.estimate);
    let rows: Vec<DVector<f64>> = tested.iter().map(|i| slope.row(*i).transpose()).collect();
    if rows.iter().any(|row| uncertainty.without(row.iter()).is_some()) {
        return None;
    }
    let covariance =
        DMatrix::from_fn(rows.len(), rows.len(), |a, b| rows[a].dot(&(&uncertainty.covariance * &rows[b])));
    Some(Released { x, values: tested.iter().map(|i| values[*i]).collect(), covariance })
}
