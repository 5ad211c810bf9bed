//! Turns a solution into the result: values, standard deviations, warnings.

mod warnings;

use crate::fit::infer::misfit::Residual;
use crate::fit::infer::rivals::Rival;
use crate::fit::infer::sandwich::Uncertainty;
use crate::fit::infer::{Inference, pose};
use crate::fit::monitor::Records;
use crate::fit::problem::free_space::Contradicted;
use crate::fit::problem::level::Level;
use crate::fit::problem::walls::described;
use crate::fit::problem::{Problem, extent};
use crate::fit::refine::apart;
use crate::fit::refine::cover::covered;
use crate::fit::refine::schedule::Solution;
use crate::fit::refine::unexplained::{self, Piece};
use crate::fit::refine::witness::{self, Witness};
use crate::fit::result::{
    Alternative, ContradictedPart, Covariance, FitResult, FittedParameter, PassedPart, UnexplainedPiece, WithoutSd,
};
use crate::fit::room::shown_to;
use crate::fit::tuning::{EXPLAINED, INSEPARABLE, NAMED};
use gml_compiler::program::Part;
use nalgebra::DVector;
use std::collections::BTreeSet;

/// The result of a fit; `residuals` are those of its inliers, which `near` marks among the scan's vertices.
pub(crate) fn result(inference: Inference, residuals: Option<&[Residual]>, near: &[bool]) -> FitResult {
    let Inference { solution, uncertainty, tests, bootstrap, rivals } = inference;
    let solution = &solution;
    let Level { problem, space, .. } = &solution.level;
    let monitor = problem.monitor;
    let fixed = &problem.start.fixed;
    let x = space.x(&solution.estimate.z).unwrap_or_default();
    let weight = problem.points.weight();
    let inliers = solution.evaluation.inliers();
    let covariance = uncertainty.as_ref().map(|u| covariance(solution, u));
    let pose_covariance = uncertainty.as_ref().and_then(|u| pose::joint(solution, u, &determined(solution, u)));
    let mut deviations = vec![None; fixed.len()];
    if let Some(known) = &covariance {
        for (a, name) in known.parameters.iter().enumerate() {
            if let Some(i) = problem.model.parameters().iter().position(|p| p.name == *name) {
                deviations[i] = Some(known.matrix[a][a].max(0.0).sqrt());
            }
        }
    }
    let biases = uncertainty.as_ref().map(|u| space.chain(&solution.estimate) * &u.bias);
    let mut at_bound = vec![false; fixed.len()];
    for (i, at) in space.free.iter().zip(space.at_bound(&solution.estimate)) {
        for i in space.followers(*i) {
            at_bound[i] = at;
        }
    }
    let parameters: Vec<FittedParameter> = problem
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
            lower: Some(p.lower).filter(|bound| bound.is_finite()),
            upper: Some(p.upper).filter(|bound| bound.is_finite()),
            sd: deviations[i],
            bias: deviations[i].and(biases.as_ref()).map(|biases| biases[i]),
            without_sd: match deviations[i] {
                Some(_) => None,
                None => Some(without_sd(solution, uncertainty.as_ref(), i)),
            },
        })
        .collect();
    warnings::of_parameters(problem, &parameters, &solution.evaluation, &deviations);
    if inliers < EXPLAINED * weight {
        monitor.warn(format!(
            "only {:.0} % of the scan's points lie within {:.3} mm of the model: the scan shows much else or another object, or the fit has failed",
            100.0 * inliers / weight,
            solution.loss.half()
        ));
    }
    let rms = solution.evaluation.rms();
    if let Some(residuals) = residuals {
        warnings::of_residuals(problem, residuals);
    }
    let interrupted = monitor.cancelled();
    if interrupted {
        monitor.warn("interrupted: this is the best that was found until then, not a finished fit");
        if covariance.is_none() {
            monitor.warn("interrupted: standard deviations were not computed");
        }
    } else {
        warnings::of_mixed_faces(solution);
    }
    if let Some(uncertainty) = &uncertainty {
        warnings::of_bounds(solution, uncertainty);
    }
    let alternatives = alternatives(solution, &rivals, &deviations);
    let coverage = if interrupted { None } else { covered(solution) };
    let contradicted = if interrupted { None } else { contradicted(solution) };
    let unexplained = if interrupted { Vec::new() } else { unexplained(solution, near) };
    let passed_through = if interrupted { Vec::new() } else { passed_through(solution) };
    let Records { trace, warnings, seconds } = monitor.records();
    FitResult {
        model: problem.model.name().to_owned(),
        script: String::new(),
        script_sha256: None,
        inputs: Vec::new(),
        scan: problem.scan.source.clone(),
        scans: Vec::new(),
        parameters,
        measures: Vec::new(),
        equal: equal(problem),
        pose: problem.pose.report_pose.then(|| solution.estimate.motion.into()),
        objective: solution.evaluation.value,
        sigma: solution.loss.sigma,
        noise: problem.scan.noise,
        inliers: share(inliers, weight),
        rms,
        iterations: u64::from(solution.iterations),
        evaluations: monitor.evaluations(),
        converged: solution.converged,
        covariance,
        pose_covariance,
        tests,
        bootstrap,
        coverage,
        contradicted,
        unexplained,
        alternatives,
        passed_through,
        search: None,
        degenerate: extent::degenerate(problem).is_some(),
        seconds,
        warnings,
        loss: solution.loss.kind,
        weights: problem.options.weights,
        interrupted,
        provenance: None,
        trace,
    }
}

/// The names of the parameters that are held equal, by group.
fn equal(problem: &Problem) -> Vec<Vec<String>> {
    let ties = &problem.start.ties;
    let parameters = problem.model.parameters();
    let group = |leader: usize| {
        let is_member = |i: &usize| *i == leader || ties.contains(&(leader, *i));
        (0..parameters.len()).filter(is_member).map(|i| parameters[i].name.clone()).collect()
    };
    let leads = |i: &usize| ties.iter().any(|(leader, _)| leader == i);
    (0..parameters.len()).filter(leads).map(group).collect()
}

/// The model's surface that stands in empty space, by part, with a warning where that is more than a few places.
/// None where the scan does not say what is empty.
fn contradicted(solution: &Solution) -> Option<Vec<ContradictedPart>> {
    let problem = solution.level.problem;
    let find = || Witness::of(solution)?.contradicted(&solution.estimate);
    let of_patches = problem.monitor.stage("free space", find)?;
    let (_, chance) = witness::total(&of_patches);
    let parts = problem.model.parts().iter().zip(&of_patches).filter(|(_, c)| c.area > 0.0);
    let found = |(part, c): (&Part, &Contradicted)| {
        let share = c.area / c.of;
        if c.area > chance {
            let [x, y, z] = c.place.to_array();
            let shaped_by =
                warnings::quoted(problem, &|i| solution.level.space.varies(i) && part.active.contains(&(i as u32)));
            problem.monitor.warn(format!(
                "{:.0} mm2 of `{}` ({:.0} % of it), about ({x:.1}, {y:.1}, {z:.1}) mm, stand where the scan shows empty space: that piece was removed from the object, or the fit is wrong in what shapes the part ({shaped_by}), whatever their standard deviations",
                c.area,
                part.name,
                100.0 * share
            ));
        }
        ContradictedPart { part: part.name.clone(), area: c.area, share, place: c.place.to_array() }
    };
    Some(parts.map(found).collect())
}

/// The pieces of the scan's surface that the model does not explain.
fn unexplained(solution: &Solution, near: &[bool]) -> Vec<UnexplainedPiece> {
    let Level { problem, space, .. } = &solution.level;
    let parts = problem.model.parts();
    let found = |piece: Piece| {
        let Piece { share, area, place, beside } = piece;
        let beside = |part: &usize| beside[*part];
        let shapes = |i: usize| (0..parts.len()).filter(beside).any(|part| parts[part].active.contains(&(i as u32)));
        let names = problem.model.parameters().iter().enumerate();
        UnexplainedPiece {
            share,
            area,
            place: place.to_array(),
            beside: (0..parts.len()).filter(beside).map(|part| parts[part].name.clone()).collect(),
            shaped_by: names.filter(|(i, _)| space.varies(*i) && shapes(*i)).map(|(_, p)| p.name.clone()).collect(),
        }
    };
    unexplained::pieces(solution, near).unwrap_or_default().into_iter().map(found).collect()
}

/// Other shapes that explain the scan as well, each with a warning that names the parameters in which they differ by
/// more than a standard deviation; `deviations` are those of all parameters.
fn alternatives(solution: &Solution, rivals: &[Rival], deviations: &[Option<f64>]) -> Vec<Alternative> {
    let Level { problem, space, .. } = &solution.level;
    let Some(present) = space.x(&solution.estimate.z) else { return Vec::new() };
    let mut said = BTreeSet::new();
    let of = |rival: &Rival| {
        let x = space.x(&rival.estimate.z)?;
        let shaped = problem.model.parts().iter().zip(&rival.of.patches).filter(|(_, shaped)| **shaped);
        let mut parts: Vec<String> = Vec::new();
        for (part, _) in shaped {
            if !parts.contains(&part.group) {
                parts.push(part.group.clone());
            }
        }
        let members: Vec<usize> = rival.of.members.iter().flat_map(|k| space.followers(space.free[*k])).collect();
        let parameter = |i: &usize| &problem.model.parameters()[*i];
        let differs = |i: &&usize| (x[**i] - present[**i]).abs() > deviations[**i].unwrap_or(0.0);
        let value = |i: &usize| {
            let digit = (x[*i] - present[*i]).abs() / 100.0;
            let at = |x: &[f64]| shown_to(x[*i], digit, parameter(i).quantity);
            format!("`{}` {} (here {})", parameter(i).name, at(&x), at(&present))
        };
        let differing: Vec<String> = members.iter().filter(differs).map(value).collect();
        let other = if rival.of.turned {
            let turn = solution.estimate.motion.rotation.angle_between(rival.estimate.motion.rotation);
            // The same model where it is: no other shape.
            if differing.is_empty() && turn < LEAST_TURN {
                return None;
            }
            turned(turn)
        } else {
            format!("another shape of {}", parts.iter().map(|p| format!("`{p}`")).collect::<Vec<_>>().join(", "))
        };
        let differing = if differing.is_empty() { String::new() } else { format!(": {}", differing.join(", ")) };
        let sentence = format!(
            "{other} explains the scan as well{differing}. The two differ where nothing was scanned, or the scan cannot tell; the standard deviations hold both"
        );
        // Two searches may end at one shape, to the digits that are shown.
        if !said.insert(sentence.clone()) {
            return None;
        }
        problem.monitor.warn(sentence);
        let values = members.iter().map(|i| (parameter(i).name.clone(), x[*i])).collect();
        Some(Alternative { parts, values, evidence: rival.evidence })
    };
    rivals.iter().filter_map(of).collect()
}

/// A part of the points' weight as a share of all of it. The two sums are rounded apart: that of all points can come
/// out as a little more than all.
fn share(of: f64, all: f64) -> f64 {
    (of / all).min(1.0)
}

/// The angle in radians from which on a turned model is said to be turned: poses of one surface differ by less, as the
/// scan leaves them open.
const LEAST_TURN: f64 = 0.5 * std::f64::consts::PI / 180.0;

/// A model in another pose, in words: in whole degrees, where there are any.
fn turned(angle: f64) -> String {
    match angle.to_degrees().round() {
        _ if angle < LEAST_TURN => "the model in nearly the same pose, with other values,".to_owned(),
        degrees if degrees < 2.0 => "the model in another pose, turned by about a degree,".to_owned(),
        degrees => format!("the model in another pose, turned by some {degrees:.0} degrees,"),
    }
}

/// The parts that have passed through walls of the model, with a warning.
fn passed_through(solution: &Solution) -> Vec<PassedPart> {
    let monitor = solution.level.problem.monitor;
    let Some((_, passed)) = monitor.stage("walls", || apart::passed(solution)) else { return Vec::new() };
    monitor.warn(format!("walls of the model pass through each other: {}", described(&passed)));
    passed
}

/// The reason for which parameter `i` has no standard deviation.
fn without_sd(solution: &Solution, uncertainty: Option<&Uncertainty>, i: usize) -> WithoutSd {
    let Level { problem, space, .. } = &solution.level;
    if problem.start.fixed[i] {
        return WithoutSd::Fixed;
    }
    if problem.rigid.without_influence.contains(&i) {
        return WithoutSd::NoInfluence;
    }
    if problem.pose.stands_for.contains(&i) && !space.varies(i) {
        return WithoutSd::InPose;
    }
    let slope = space.chain(&solution.estimate);
    let reason = match uncertainty {
        Some(uncertainty) => uncertainty.without(slope.row(i).iter()),
        None if problem.monitor.cancelled() => Some(WithoutSd::Interrupted),
        None if !solution.converged => Some(WithoutSd::NotConverged),
        None => None,
    };
    let shapes = |part: &Part| part.active.contains(&(i as u32));
    let mut shaped = problem.model.parts().iter().zip(&solution.evaluation.patches).filter(|(part, _)| shapes(part));
    match reason {
        None | Some(WithoutSd::NotDetermined) if shaped.all(|(_, sum)| sum.is_hidden()) => WithoutSd::NotScanned,
        reason => reason.unwrap_or(WithoutSd::NotDetermined),
    }
}

/// The parameters that have a standard deviation.
pub(crate) fn determined(solution: &Solution, uncertainty: &Uncertainty) -> Vec<usize> {
    let slope = solution.level.space.chain(&solution.estimate);
    let determined = |i: &usize| slope.row(*i).amax() > 0.0 && uncertainty.without(slope.row(*i).iter()).is_none();
    (0..solution.level.problem.model.parameters().len()).filter(determined).collect()
}

/// The covariance of the parameters; with those named that the scan does not determine.
fn covariance(solution: &Solution, uncertainty: &Uncertainty) -> Covariance {
    let Level { problem, space, .. } = &solution.level;
    let monitor = problem.monitor;
    let slope = space.chain(&solution.estimate);
    let parameters = problem.model.parameters();
    let chosen = determined(solution, uncertainty);
    let rows = slope.select_rows(&chosen);
    let matrix = &rows * &uncertainty.covariance * rows.transpose();
    let naive = &rows * &uncertainty.naive * rows.transpose();
    let n = chosen.len();
    let sd: Vec<f64> = (0..n).map(|a| matrix[(a, a)].max(0.0).sqrt()).collect();
    let correlation = |a: usize, b: usize| {
        if a == b { 1.0 } else { (matrix[(a, b)] / (sd[a] * sd[b]).max(f64::MIN_POSITIVE)).clamp(-1.0, 1.0) }
    };
    let name = |a: usize| &parameters[chosen[a]].name;
    for a in 0..n {
        for b in 0..a {
            // What other shapes add to the covariance says nothing of the scan.
            let alone = naive[(a, b)] / (naive[(a, a)] * naive[(b, b)]).sqrt().max(f64::MIN_POSITIVE);
            let r = correlation(a, b);
            let tied = space
                .ties
                .iter()
                .any(|t| space.followers(t.0).filter(|i| *i == chosen[a] || *i == chosen[b]).count() > 1);
            if r.abs() > INSEPARABLE && alone.abs() > INSEPARABLE && !tied {
                let (b, a) = (name(b), name(a));
                monitor.warn(format!("`{b}` and `{a}` are not separable in this scan: correlation {r:.4}"));
            }
        }
    }
    pose::undetermined(solution, uncertainty).into_iter().for_each(|sentence| monitor.warn(sentence));
    for sentence in uncertainty.undetermined.iter().filter_map(|d| undetermined(&solution.level, d)) {
        monitor.warn(sentence);
    }
    let square = |f: &dyn Fn(usize, usize) -> f64| (0..n).map(|a| (0..n).map(|b| f(a, b)).collect()).collect();
    Covariance {
        parameters: (0..n).map(|a| name(a).clone()).collect(),
        matrix: square(&|a, b| matrix[(a, b)]),
        correlations: square(&correlation),
        naive: (0..n).map(|a| naive[(a, a)].max(0.0).sqrt()).collect(),
        effective_points: uncertainty.effective_points,
        block: uncertainty.blocks.map(|b| b.edge),
    }
}

/// A sentence on a combination of coordinates that leaves every distance as it is. None of motions alone.
fn undetermined(level: &Level, direction: &DVector<f64>) -> Option<String> {
    let Level { problem, space, .. } = level;
    let (shape, pose) = direction.as_slice().split_at(space.free.len());
    let largest = direction.amax();
    let named: Vec<String> = space
        .free
        .iter()
        .zip(shape)
        .filter(|(_, s)| s.abs() > NAMED * largest)
        .map(|(i, s)| format!("{:+.2} `{}`", s / largest, problem.model.parameters()[*i].name))
        .collect();
    let moves = pose.iter().any(|p| p.abs() > NAMED * largest);
    match (named.is_empty(), moves) {
        (true, _) => None,
        (false, true) => {
            Some(format!("the scan does not determine a common change of the pose and of {}", named.join(" ")))
        }
        (false, false) => Some(format!(
            "the scan does not determine the combination {} (in millimetres of surface moved): it leaves every distance as it is",
            named.join(" ")
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::{share, turned};

    #[test]
    fn no_share_is_beyond_one() {
        assert_eq!((share(1.0000000000000016 * 3.0, 3.0), share(1.0, 4.0)), (1.0, 0.25));
    }

    /// A turn that is told is one that people can see: never by 0 degrees.
    #[test]
    fn turned_models_are_turned_by_a_degree_at_least() {
        for (degrees, expected) in [
            (0.0, "the model in nearly the same pose, with other values,"),
            (0.4, "the model in nearly the same pose, with other values,"),
            (0.5001, "the model in another pose, turned by about a degree,"),
            (1.4, "the model in another pose, turned by about a degree,"),
            (90.2, "the model in another pose, turned by some 90 degrees,"),
        ] {
            assert_eq!(turned(f64::to_radians(degrees)), expected, "{degrees}");
        }
    }
}
