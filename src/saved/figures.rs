//! Whether the figures of a fit's file can be those of a fit, beside its values, pose and covariances.

use super::sound::{FARTHEST, ROUNDING};
use super::texts::{self, quoted};
use gml_compiler::program::{Program, Quantity};
use gml_runtime::fit::{FitResult, FittedInput, FittedMeasure, HypothesisTest, PoseCovariance};
use gml_runtime::variance::without_indices;
use std::collections::HashSet;

/// Refuses what no fit has; the error is a predicate.
pub(super) fn check(fit: &FitResult) -> Result<(), String> {
    fit.inputs.iter().try_for_each(input)?;
    if let Some(p) = fit.parameters.iter().find(|p| p.sd.is_some() && p.without_sd.is_some()) {
        return Err(format!("has both `sd` and `without_sd` for {}; remove one", quoted(&p.name)));
    }
    let is_varied = |name: &str| fit.covariance.iter().any(|c| c.parameters.iter().any(|p| p == name));
    if let Some(p) = fit.parameters.iter().find(|p| p.sd.is_some() && !is_varied(&p.name)) {
        return Err(format!("has a standard deviation of {} that is not in `covariance`", quoted(&p.name)));
    }
    for group in &fit.equal {
        of_parameters(fit, "equal", group)?;
        if group.len() < 2 {
            return Err("has a group of `equal` with fewer than two parameters".to_owned());
        }
    }
    fit.tests.iter().try_for_each(|t| test(fit, t))?;
    measures(fit)?;
    for a in &fit.alternatives {
        of_parameters(fit, "alternatives", a.values.keys())?;
        a.values.values().try_for_each(|v| between("value", "alternatives", *v, -FARTHEST, FARTHEST))?;
    }
    surfaces(fit)?;
    if let Some(c) = &fit.pose_covariance {
        symmetries(c)?;
    }
    inference(fit)
}

/// Refuses parts, and groups of parts, that a program does not have, which is that of the fit. Those of a loop may have
/// one name, without numbers.
pub(super) fn check_parts(fit: &FitResult, program: &Program) -> Result<(), String> {
    let is_known = |name: &str| {
        let is_of =
            |part: &str| part.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']));
        program.parts().iter().any(|part| is_of(&part.name) || is_of(&without_indices(&part.name)))
    };
    match texts::parts(fit).find(|name| !is_known(name)) {
        Some(name) => Err(format!("names the part {}, which the model '{}' has not", quoted(name), program.name())),
        None => Ok(()),
    }
}

/// Refuses a figure that is none of a list's; not-a-number is in no range.
fn between(figure: &str, of: &str, value: f64, low: f64, high: f64) -> Result<(), String> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(format!("has {figure} {value:e} in `{of}`, which is not between {low:e} and {high:e}"))
}

/// Refuses values that the types of inputs do not have.
fn input(input: &FittedInput) -> Result<(), String> {
    let FittedInput { name, value, quantity, .. } = input;
    // Whole numbers beyond are not exact.
    let is_whole = value.fract() == 0.0 && value.abs() < (1u64 << f64::MANTISSA_DIGITS) as f64;
    let kind = match quantity {
        Quantity::Int if !is_whole => "a whole number",
        Quantity::Bool if *value != 0.0 && *value != 1.0 => "0 or 1",
        _ => return Ok(()),
    };
    Err(format!("has the input {} = {value}, which is {kind}", quoted(name)))
}

/// Refuses a list with a parameter that is not the fit's, or one twice.
pub(super) fn of_parameters<'n>(
    fit: &FitResult,
    list: &str,
    names: impl IntoIterator<Item = &'n String>,
) -> Result<(), String> {
    let mut seen = HashSet::new();
    for name in names {
        if fit.parameters.iter().all(|p| p.name != *name) {
            return Err(format!("has a `{list}` of {}, which is not one of its parameters", quoted(name)));
        }
        if !seen.insert(name) {
            return Err(format!("has a `{list}` of {} twice", quoted(name)));
        }
    }
    Ok(())
}

fn test(fit: &FitResult, test: &HypothesisTest) -> Result<(), String> {
    let HypothesisTest { parameters, held, free, sd, statistic, degrees, p } = test;
    of_parameters(fit, "tests", parameters)?;
    let many = parameters.len();
    if many == 0 || [held.len(), free.len(), sd.len()].iter().any(|n| *n != many) || !(1..=many).contains(degrees) {
        return Err("has an entry of `tests` whose lists or degrees are not as many as its parameters".to_owned());
    }
    held.iter().chain(free).try_for_each(|value| between("the value", "tests", *value, -FARTHEST, FARTHEST))?;
    sd.iter().try_for_each(|sd| between("the sd", "tests", *sd, 0.0, FARTHEST))?;
    between("the statistic", "tests", *statistic, 0.0, f64::MAX)?;
    between("p =", "tests", *p, 0.0, 1.0)
}

fn measures(fit: &FitResult) -> Result<(), String> {
    let mut seen = HashSet::new();
    for m in &fit.measures {
        let FittedMeasure { name, value, sd, nominal, tolerance, at_bound, derivatives, .. } = m;
        let shown = quoted(name);
        if !seen.insert(name) {
            return Err(format!("has the measure {shown} twice; remove one"));
        }
        let limits = tolerance.iter().flat_map(|t| [t.lower, t.upper]);
        for figure in value.iter().chain(nominal).copied().chain(limits) {
            // Measures may be powers of lengths.
            between(&format!("for {shown}"), "measures", figure, -f64::MAX, f64::MAX)?;
        }
        if let Some(sd) = sd {
            between(&format!("for {shown} the sd"), "measures", *sd, 0.0, f64::MAX)?;
        }
        if let Some(t) = tolerance.filter(|t| t.lower > t.upper) {
            return Err(format!("has the tolerance {:e} to {:e} for {shown}, which leaves nothing", t.lower, t.upper));
        }
        of_parameters(fit, "measures", at_bound)?;
        of_parameters(fit, "measures", derivatives.keys())?;
    }
    Ok(())
}

/// Areas, shares and places of what the scan and the model show.
fn surfaces(fit: &FitResult) -> Result<(), String> {
    const MOST: f64 = FARTHEST * FARTHEST;
    let share = |list: &str, share: f64| between("the share", list, share, 0.0, 1.0 + ROUNDING);
    let area = |list: &str, area: f64| between("the area", list, area, 0.0, MOST);
    let place = |list: &str, place: [f64; 3]| {
        place.iter().try_for_each(|x| between("the coordinate", list, *x, -FARTHEST, FARTHEST))
    };
    for c in fit.contradicted.iter().flatten() {
        share("contradicted", c.share)?;
        area("contradicted", c.area)?;
        place("contradicted", c.place)?;
    }
    for piece in &fit.unexplained {
        share("unexplained", piece.share)?;
        piece.area.map_or(Ok(()), |a| area("unexplained", a))?;
        place("unexplained", piece.place)?;
        of_parameters(fit, "unexplained", &piece.shaped_by)?;
    }
    for part in &fit.passed_through {
        area("passed_through", part.area)?;
        between("the depth", "passed_through", part.depth, 0.0, FARTHEST)?;
        place("passed_through", part.place)?;
    }
    if let Some(covered) = &fit.coverage {
        share("coverage", covered.share)?;
        between("the sigma", "coverage", covered.sigma, 0.0, FARTHEST)?;
    }
    Ok(())
}

/// Refuses motions that are not written as those of a symmetry are.
fn symmetries(covariance: &PoseCovariance) -> Result<(), String> {
    const NAME: &str = "pose_covariance";
    covariance.centre.iter().try_for_each(|x| between("the centre", NAME, *x, -FARTHEST, FARTHEST))?;
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    for symmetry in &covariance.symmetries {
        let (turn, shift) = (length(symmetry.turn), length(symmetry.shift));
        let is_unit = |length: f64| (length - 1.0).abs() <= ROUNDING;
        if !(turn == 0.0 || is_unit(turn)) {
            return Err(format!("has a symmetry whose `turn` has the length {turn:e}, neither 1 nor 0"));
        }
        if turn == 0.0 && !(shift == 0.0 || is_unit(shift)) {
            return Err(format!("has a symmetry without a turn whose `shift` has the length {shift:e}, not 1"));
        }
        between("the shift", NAME, shift, 0.0, FARTHEST)?;
    }
    Ok(())
}

/// Counts and deviations of inference, and times.
fn inference(fit: &FitResult) -> Result<(), String> {
    if let Some(c) = &fit.covariance {
        between("the effective_points", "covariance", c.effective_points, 0.0, FARTHEST)?;
        if !(c.naive.is_empty() || c.naive.len() == c.parameters.len()) {
            return Err("has as `naive` in `covariance` another number of deviations than of parameters".to_owned());
        }
        c.naive.iter().chain(&c.block).try_for_each(|x| between("the length", "covariance", *x, 0.0, FARTHEST))?;
    }
    if let Some(b) = &fit.bootstrap {
        of_parameters(fit, "bootstrap", b.parameters.iter().map(|p| &p.name))?;
        b.block.map_or(Ok(()), |block| between("the block", "bootstrap", block, 0.0, FARTHEST))?;
        for p in &b.parameters {
            between("the sd", "bootstrap", p.sd, 0.0, FARTHEST)?;
            between("the high end", "bootstrap", p.high, -FARTHEST, FARTHEST)?;
            between("the low end", "bootstrap", p.low, -FARTHEST, p.high)?;
        }
    }
    if let Some(s) = &fit.search {
        let figures = [s.sigma, s.effective_points];
        let objectives = s.candidates.iter().filter_map(|c| c.objective);
        let all = figures.into_iter().chain(s.margin).chain(objectives);
        all.into_iter().try_for_each(|x| between("the figure", "search", x, 0.0, FARTHEST))?;
    }
    fit.seconds.values().try_for_each(|s| between("the time", "seconds", *s, 0.0, FARTHEST))
}
