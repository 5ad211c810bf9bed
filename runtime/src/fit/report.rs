//! Turns the last estimate into the result: values, standard deviations, warnings.

use super::objective::Evaluation;
use super::pose::RigidParameters;
use super::result::{FitResult, FittedParameter};
use super::schedule::{Last, Setting};
use crate::scan::Scan;
use std::collections::BTreeMap;
use std::sync::atomic::Ordering;

/// What a fit ended with.
pub(crate) struct Outcome {
    pub(crate) last: Last,
    pub(crate) fixed: Vec<bool>,
    pub(crate) rigid: RigidParameters,
    pub(crate) iterations: u32,
    pub(crate) warnings: Vec<String>,
    pub(crate) seconds: BTreeMap<String, f64>,
    pub(crate) report_pose: bool,
}

/// The result of a fit.
pub(crate) fn result(setting: &Setting, scan: &Scan, outcome: Outcome) -> FitResult {
    let Outcome { last, fixed, rigid, iterations, mut warnings, seconds, report_pose } = outcome;
    let space = &setting.space;
    let x = space.x(&last.estimate.z).unwrap_or_default();
    let points = setting.points.len() as f64;
    let inliers = last.evaluation.inliers();
    let d2: f64 = last.evaluation.patches.iter().map(|p| p.d2).sum();
    let deviations = deviations(setting, &last);
    let mut at_bound = vec![false; fixed.len()];
    for (i, at) in space.free.iter().zip(space.at_bound(&last.estimate)) {
        at_bound[*i] = at;
    }
    let parameters: Vec<FittedParameter> = setting
        .model
        .parameters()
        .iter()
        .enumerate()
        .map(|(i, p)| FittedParameter {
            name: p.name.clone(),
            value: x.get(i).copied().unwrap_or(p.default),
            unit: p.quantity.unit().to_owned(),
            quantity: p.quantity,
            fixed: fixed[i],
            at_bound: at_bound[i],
            sd: deviations[i],
        })
        .collect();
    warn(setting, &parameters, &last.evaluation, &rigid, &deviations, &mut warnings);
    if inliers < 0.5 * points {
        warnings.push(format!(
            "only {:.0} % of the scan's points lie near the model: it does not explain this scan, or the fit has failed",
            100.0 * inliers / points
        ));
    }
    if !last.converged {
        warnings.push("the last stage did not converge".to_owned());
    }
    let motion = last.estimate.motion;
    FitResult {
        model: setting.model.name().to_owned(),
        script: String::new(),
        scan: scan.source.clone(),
        parameters,
        pose: report_pose
            .then(|| crate::model::Motion { rotation: motion.rows(), translation: motion.translation.to_array() }),
        objective: last.evaluation.value,
        sigma: last.loss.sigma,
        noise: scan.noise,
        inliers: inliers / points,
        rms: (d2 / inliers.max(1.0)).sqrt(),
        iterations: u64::from(iterations),
        evaluations: setting.evaluations.load(Ordering::Relaxed),
        converged: last.converged,
        seconds,
        warnings,
    }
}

/// Standard deviation by parameter from the weighted Gauss-Newton matrix: s^2 (sum w J^T J)^-1 with s^2 = sum w d^2 / sum w.
/// Assumes that the distances of different points are independent; they are not where the model's family cannot
/// follow the shape. None for a parameter that is fixed, at a bound or without influence.
fn deviations(setting: &Setting, last: &Last) -> Vec<Option<f64>> {
    let space = &setting.space;
    let mut by_parameter = vec![None; setting.model.parameters().len()];
    let normal = &last.evaluation.normal;
    let bound = space.at_bound(&last.estimate);
    let largest = normal.diagonal().amax();
    let kept: Vec<usize> = (0..normal.nrows())
        .filter(|k| normal[(*k, *k)] > 1e-12 * largest && !bound.get(*k).is_some_and(|b| *b))
        .collect();
    if kept.is_empty() {
        return by_parameter;
    }
    let matrix = nalgebra::DMatrix::from_fn(kept.len(), kept.len(), |a, b| normal[(kept[a], kept[b])]);
    let Some(factor) = matrix.cholesky() else { return by_parameter };
    let inverse = factor.inverse();
    let weight: f64 = last.evaluation.patches.iter().map(|p| p.weight).sum();
    let d2: f64 = last.evaluation.patches.iter().map(|p| p.weighted_d2).sum();
    // normal = 2 / (sigma^2 N) sum w J^T J.
    let scale = 2.0 / (last.loss.sigma * last.loss.sigma * setting.points.len() as f64);
    let variance = d2 / weight.max(f64::MIN_POSITIVE) * scale;
    let slope = space.chain(&last.estimate);
    for i in &space.free {
        let row: Vec<f64> = kept.iter().map(|k| slope[(*i, *k)]).collect();
        let own = space.free.binary_search(i).is_ok_and(|k| kept.contains(&k));
        let mut sum = 0.0;
        for (a, ra) in row.iter().enumerate() {
            for (b, rb) in row.iter().enumerate() {
                sum += ra * rb * inverse[(a, b)];
            }
        }
        if own && sum.is_finite() && sum >= 0.0 {
            by_parameter[*i] = Some((variance * sum).sqrt());
        }
    }
    by_parameter
}

fn warn(
    setting: &Setting,
    parameters: &[FittedParameter],
    evaluation: &Evaluation,
    rigid: &RigidParameters,
    deviations: &[Option<f64>],
    warnings: &mut Vec<String>,
) {
    for (i, p) in parameters.iter().enumerate() {
        if p.fixed {
            continue;
        }
        if rigid.without_influence.contains(&i) {
            warnings.push(format!("`{}` has no influence on the surface and kept its start value", p.name));
        } else if p.at_bound {
            warnings.push(format!("`{}` ended at a bound ({} {})", p.name, p.value, p.unit));
        } else if let Some(sd) = deviations[i]
            && sd > 0.1 * setting.radius.max(p.value.abs())
            && p.unit == "mm"
        {
            warnings.push(format!("the scan hardly determines `{}` (standard deviation {sd:.3} mm)", p.name));
        }
    }
    for (part, sum) in setting.model.parts().iter().zip(&evaluation.patches) {
        if sum.inliers < 10.0 {
            warnings.push(format!(
                "almost no point of the scan belongs to `{}`: what only shapes it is not determined",
                part.name
            ));
        }
    }
    if evaluation.absent > 0 {
        warnings.push(format!("{} of the model's patches could not be evaluated", evaluation.absent));
    }
}
