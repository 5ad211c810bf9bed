//! Whether the scan contradicts a value at which a parameter was held: Wald's test, on the fit with it released.

use super::descent::Last;
use super::options::FitOptions;
use super::result::HypothesisTest;
use super::setting::Setting;
use super::significance::chi_squared_tail;
use nalgebra::{DMatrix, DVector};

/// Tests every parameter that was fixed at a value of `options.start`, each by itself (the others released as well), and all
/// of them together where there are several.
pub(crate) fn test(
    setting: &Setting,
    last: &Last,
    options: &FitOptions,
    fixed: &[bool],
    warnings: &mut Vec<String>,
) -> Vec<HypothesisTest> {
    let parameters = setting.model.parameters();
    let tested: Vec<usize> =
        (0..fixed.len()).filter(|i| fixed[*i] && options.start.contains_key(&parameters[*i].name)).collect();
    if tested.is_empty() || setting.progress.cancelled() {
        return Vec::new();
    }
    let found = released(setting, last, &tested);
    if found.is_none() {
        warnings.push(
            "whether the scan contradicts the fixed values cannot be tested: it does not determine them".to_owned(),
        );
    }
    let Some((x, values, covariance)) = found else { return Vec::new() };
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

/// The parameters held, the values that the tested ones take when released, and their covariance.
fn released(setting: &Setting, last: &Last, tested: &[usize]) -> Option<(Vec<f64>, Vec<f64>, DMatrix<f64>)> {
    let space = &setting.space;
    let x = space.x(&last.estimate.z)?;
    let mut free: Vec<usize> = space.free.iter().chain(tested).copied().collect();
    free.sort_unstable();
    let ties = &space.ties;
    let wider = Setting::new(
        setting.model,
        (setting.points, &setting.thin),
        &x,
        (free, ties),
        space.moving,
        setting.radius,
        setting.evaluations,
    );
    let mut wider = wider.ok()?;
    wider.progress = setting.progress;
    wider.coverage = setting.coverage.clone();
    let at = wider.space.estimate(&x, last.estimate.motion);
    wider.remodel(&at, 0.002 * setting.radius).ok()?;
    let mut iterations = 0;
    let found = wider.polish(setting.points, at, last.loss, last.signs.clone(), &mut iterations);
    let values = wider.space.x(&found.estimate.z)?;
    let uncertainty = wider.uncertainty(&found)?;
    let slope = wider.space.chain(&found.estimate);
    let rows: Vec<DVector<f64>> = tested.iter().map(|i| slope.row(*i).transpose()).collect();
    let determined = |row: &DVector<f64>| row.iter().zip(&uncertainty.known).all(|(s, known)| *s == 0.0 || *known);
    if !rows.iter().all(determined) {
        return None;
    }
    let covariance =
        DMatrix::from_fn(rows.len(), rows.len(), |a, b| rows[a].dot(&(&uncertainty.covariance * &rows[b])));
    Some((x, tested.iter().map(|i| values[*i]).collect(), covariance))
}
