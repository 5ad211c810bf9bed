//! Whether the scan contradicts a value at which a parameter was held: Wald's test, on the fit with it released.

use super::significance::chi_squared_tail;
use crate::fit::problem::level::Level;
use crate::fit::problem::parameterization::Parameterization;
use crate::fit::refine::schedule::{Guess, Solution, polish};
use crate::fit::result::HypothesisTest;
use crate::fit::tuning::CHORD;
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
    let Some(Released { x, values, covariance }) = released(solution, &tested) else {
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

/// Goes on from a solution with some held parameters released. None where the scan does not determine them.
fn released(solution: &Solution, tested: &[usize]) -> Option<Released> {
    let Level { problem, space, coverage, .. } = &solution.level;
    let x = space.x(&solution.estimate.z)?;
    let mut free: Vec<usize> = space.free.iter().chain(tested).copied().collect();
    free.sort_unstable();
    let wider = Parameterization::new(problem.model, &x, free, space.moving, &space.ties);
    let estimate = wider.estimate(&x, solution.estimate.motion);
    let level = Level::new(problem, wider, &estimate, CHORD).ok()?;
    let level = Level { coverage: coverage.clone(), ..level };
    let guess = Guess { estimate, loss: solution.loss, signs: solution.signs.clone(), iterations: 0 };
    let refitted = polish(level, &problem.points, guess, None);
    let values = refitted.level.space.x(&refitted.estimate.z)?;
    let uncertainty = super::uncertainty(&refitted)?;
    let slope = refitted.level.space.chain(&refitted.estimate);
    let rows: Vec<DVector<f64>> = tested.iter().map(|i| slope.row(*i).transpose()).collect();
    let determined =
        |row: &DVector<f64>| row.iter().zip(&uncertainty.determined).all(|(s, determined)| *s == 0.0 || *determined);
    if !rows.iter().all(determined) {
        return None;
    }
    let covariance =
        DMatrix::from_fn(rows.len(), rows.len(), |a, b| rows[a].dot(&(&uncertainty.covariance * &rows[b])));
    Some(Released { x, values: tested.iter().map(|i| values[*i]).collect(), covariance })
}
