//! Unobserved parts: a handle that was not scanned hides in a wall, takes some of the wall's points, and looks as well
//! determined as if it had been there.

use super::sandwich::Uncertainty;
use crate::fit::problem::objective::Objective;
use crate::fit::refine::schedule::Solution;
use crate::fit::register::group::{Group, groups};
use crate::fit::result::WithoutSd;
use crate::fit::tuning::UNEXPLAINED_SHARE;
use std::collections::BTreeSet;

/// Marks parameters as not determined whose parts the scan does not show, with a warning.
pub(crate) fn mark(solution: &Solution, mut uncertainty: Uncertainty) -> Uncertainty {
    let level = &solution.level;
    for group in groups(level) {
        if is_observed(solution, &uncertainty, &group) != Some(false) {
            continue;
        }
        for k in &group.members {
            uncertainty.without[*k] = Some(WithoutSd::NotScanned);
        }
        let parts = level.problem.model.parts().iter().zip(&group.patches).filter(|(_, shaped)| **shaped);
        let mut names: Vec<String> = parts.map(|(part, _)| format!("`{}`", part.group)).collect();
        let mut known = BTreeSet::new();
        names.retain(|name| known.insert(name.clone()));
        let of = |k: &usize| format!("`{}`", level.problem.model.parameters()[level.space.free[*k]].name);
        let members: Vec<String> = group.members.iter().map(of).collect();
        level.problem.monitor.warn(format!(
            "the scan does not show {}: the other parts explain its points as well, and it determines none of {}",
            names.join(", "),
            members.join(", ")
        ));
    }
    uncertainty
}

/// Whether a group's parts have points of their own, or else earn their parameters by Schwarz's criterion: without them
/// the mean loss would be larger by so much that n ln(mean loss) grows by more than k ln n, for k parameters and n
/// effective points. None where that cannot be said: where the group has no points at all, of which another warning
/// speaks, or the model does not exist.
fn is_observed(solution: &Solution, uncertainty: &Uncertainty, group: &Group) -> Option<bool> {
    let level = &solution.level;
    let points = &level.problem.thin;
    let objective = Objective { signs: Some(&solution.signs), ..level.objective(points, solution.loss) };
    let losses = group.losses(&objective, &solution.estimate)?;
    let (all, alone) = losses.own_points().fold((0.0, 0.0), |(all, alone), i| {
        let prior = points.prior(i);
        (all + prior, if losses.without[i] >= 0.5 { alone + prior } else { alone })
    });
    if alone > UNEXPLAINED_SHARE * all {
        return Some(true);
    }
    let mean = |losses: &[f64]| {
        losses.iter().enumerate().map(|(i, loss)| points.prior(i) * loss).sum::<f64>() / points.weight()
    };
    let (with, without) = (mean(&losses.with), mean(&losses.without));
    if !(without > with) || !(with > 0.0) {
        return None;
    }
    let n = uncertainty.effective_points.max(2.0);
    Some(n * (without / with).ln() > group.members.len() as f64 * n.ln())
}
