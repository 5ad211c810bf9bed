//! Sentences of warning about a solution.

use crate::fit::infer::misfit::{self, Lopsided, Pattern, Residual};
use crate::fit::infer::sandwich::Uncertainty;
use crate::fit::problem::Problem;
use crate::fit::problem::coverage::patch_area;
use crate::fit::problem::level::Level;
use crate::fit::problem::objective::Evaluation;
use crate::fit::refine::mixed::{self, Mixed};
use crate::fit::refine::schedule::Solution;
use crate::fit::result::FittedParameter;
use crate::fit::room::{shown, shown_to};
use crate::fit::tuning::{BIASED, FOREIGN_RADIUS, HARDLY_DETERMINED, LEAST_PATTERN, LOPSIDED_NAMED, SETTLED_ROUNDING};
use gml_compiler::program::Part;

/// Warns where the residuals have a pattern that is not noise, or are noise with a tail on one side.
pub(super) fn of_residuals(problem: &Problem, residuals: &[Residual]) {
    match misfit::pattern(residuals).filter(|pattern| pattern.size() >= LEAST_PATTERN * problem.radius) {
        Some(pattern) => of_pattern(problem, pattern),
        None => of_tails(problem, &misfit::lopsided(residuals, SETTLED_ROUNDING * problem.radius)),
    }
}

fn of_pattern(problem: &Problem, pattern: Pattern) {
    let failed = if pattern.size() > FOREIGN_RADIUS * problem.radius {
        ": no model of this family has it, or the fit has failed"
    } else {
        ""
    };
    let (Pattern { correlation, rms }, size) = (pattern, pattern.size());
    problem.monitor.warn(format!(
        "the model does not have the scan's shape{failed}: of the {rms:.3} mm (root mean square) by which what lies near it is off, {size:.3} mm are a pattern and no noise (correlation of neighbours {correlation:.2})"
    ));
}

fn of_tails(problem: &Problem, lopsided: &[Lopsided]) {
    let Some(farthest) = lopsided.first() else { return };
    let name = |one: &Lopsided| format!("`{}`", problem.model.parts()[one.patch].name);
    let mut names: Vec<String> = lopsided.iter().take(LOPSIDED_NAMED).map(name).collect();
    if lopsided.len() > names.len() {
        names.push(format!("{} more parts", lopsided.len() - names.len()));
    }
    problem.monitor.warn(format!(
        "the residuals of {} have a tail on one side, as dust, burrs and the edges of a beam leave it: most points lie up to {:.3} mm beside the fitted surface, on its other side, and values may be off by that, whatever their standard deviations",
        names.join(", "),
        farthest.shift.abs(),
    ));
}

/// Warns where the scan cannot tell the faces of thin walls apart.
pub(super) fn of_mixed_faces(solution: &Solution) {
    let Level { problem, space, .. } = &solution.level;
    let Some(Mixed { patches, distance, noise }) = mixed::find(solution) else { return };
    let parts: Vec<&Part> = patches.iter().map(|patch| &problem.model.parts()[*patch]).collect();
    let names: Vec<String> = parts.iter().map(|part| format!("`{}`", part.name)).collect();
    let shaped_by = |i: usize| space.varies(i) && parts.iter().any(|part| part.active.contains(&(i as u32)));
    problem.monitor.warn(format!(
        "the scan does not tell which way {} {}, and the other face of the wall is only {distance:.3} mm away, with noise of {noise:.3} mm: points may belong to the wrong one, and {} may be off by more than their standard deviations say",
        names.join(", "),
        if names.len() > 1 { "face" } else { "faces" },
        quoted(problem, &shaped_by)
    ));
}

/// The names of some parameters.
pub(super) fn quoted(problem: &Problem, chosen: &dyn Fn(usize) -> bool) -> String {
    let names = problem.model.parameters().iter().enumerate().filter(|(i, _)| chosen(*i));
    names.map(|(_, p)| format!("`{}`", p.name)).collect::<Vec<_>>().join(", ")
}

/// Warns of parameters that are so certain, or where they are, only because others ended at a bound.
pub(super) fn of_bounds(solution: &Solution, uncertainty: &Uncertainty) {
    let Level { problem, space, .. } = &solution.level;
    let position = |i: usize| space.free.iter().position(|free| *free == i);
    let named = |chosen: &dyn Fn(usize) -> bool| quoted(problem, &|i| position(i).is_some_and(chosen));
    let certain = named(&|k| uncertainty.bounds_decide(k));
    if !certain.is_empty() {
        let at_bound = space.at_bound(&solution.estimate);
        problem.monitor.warn(format!(
            "{certain} would be less certain by far, not determined, or elsewhere if {} could leave the bound: the values and standard deviations hold only if the bound is the object's",
            named(&|k| at_bound[k])
        ));
    }
}

/// Warns of parts that the scan does not show.
fn of_hidden_parts(problem: &Problem, parameters: &[FittedParameter], evaluation: &Evaluation) {
    let x: Vec<f64> = parameters.iter().map(|p| p.value).collect();
    let instance = problem.model.instantiate(&x).ok();
    // Of a trimmed part nothing may be left, as of the end of a hole.
    let is_there = |patch: usize| {
        let area = instance.as_ref().and_then(|instance| patch_area(problem.model, &**instance, patch));
        problem.model.keep(patch).is_none() || area != Some(0.0)
    };
    let hidden =
        (0..evaluation.patches.len()).filter(|patch| evaluation.patches[*patch].is_hidden() && is_there(*patch));
    let hidden: Vec<String> = hidden.map(|patch| format!("`{}`", problem.model.parts()[patch].name)).collect();
    if !hidden.is_empty() {
        let them = if hidden.len() > 1 { "them" } else { "it" };
        let hidden = hidden.join(", ");
        problem.monitor.warn(format!(
            "almost no point of the scan lies close to {hidden}: what only shapes {them} is not determined"
        ));
    }
}

/// Warns of parameters that are not what their values say, and of parts that the scan does not show.
pub(super) fn of_parameters(
    problem: &Problem,
    parameters: &[FittedParameter],
    evaluation: &Evaluation,
    deviations: &[Option<f64>],
) {
    let monitor = problem.monitor;
    for (i, p) in parameters.iter().enumerate() {
        if p.fixed {
            continue;
        }
        if problem.rigid.without_influence.contains(&i) {
            monitor.warn(format!("`{}` has no influence on the surface and kept its start value", p.name));
        } else if p.at_bound {
            monitor.warn(format!("`{}` ended at a bound ({})", p.name, shown(p.value, p.quantity)));
        } else if let (Some(sd), Some(bias)) = (p.sd, p.bias)
            && bias.abs() > BIASED * sd
        {
            let side = if bias > 0.0 { "large" } else { "small" };
            let by = shown_to(bias.abs(), bias.abs() / 10.0, p.quantity);
            monitor.warn(format!(
                "noise of {:.3} mm makes `{}` too {side} by about {by}, which its standard deviation holds: the surface \
                 is curved there too much for so much noise",
                problem.scan.noise, p.name
            ));
        } else if let Some(sd) = deviations[i]
            && sd > HARDLY_DETERMINED * problem.radius.max(p.value.abs())
            && p.unit == "mm"
        {
            monitor.warn(format!("the scan hardly determines `{}` (standard deviation {sd:.3} mm)", p.name));
        }
    }
    of_hidden_parts(problem, parameters, evaluation);
    if evaluation.absent > 0 {
        monitor.warn(format!("{} of the model's patches could not be evaluated", evaluation.absent));
    }
}
