//! Parts that the scan does not show: a handle that was not scanned hides in a wall, takes some of the wall's points, and looks
//! as well determined as if it had been there.

use super::descent::Last;
use super::group::{Group, groups};
use super::objective::Objective;
use super::setting::Setting;
use super::uncertainty::Uncertainty;

/// Takes away what is said to be known of parameters whose parts the scan does not show, and says so.
pub(crate) fn mark(setting: &Setting, last: &Last, uncertainty: &mut Uncertainty, warnings: &mut Vec<String>) {
    for group in groups(setting) {
        if is_shown(setting, last, uncertainty, &group) != Some(false) {
            continue;
        }
        for k in &group.members {
            uncertainty.known[*k] = false;
        }
        let parts = setting.model.parts().iter().zip(&group.patches).filter(|(_, own)| **own);
        let mut names: Vec<String> = parts.map(|(part, _)| format!("`{}`", part.group)).collect();
        names.dedup();
        let of = |k: &usize| format!("`{}`", setting.model.parameters()[setting.space.free[*k]].name);
        let members: Vec<String> = group.members.iter().map(of).collect();
        warnings.push(format!(
            "the scan does not show {}: the other parts explain its points as well, and it determines none of {}",
            names.join(", "),
            members.join(", ")
        ));
    }
}

/// Whether a group's parts earn their parameters by Schwarz's criterion: without them, the mean of psi would be larger by so
/// much that n ln(mean psi) grows by more than k ln n, for k parameters and n effective points. None where that cannot be
/// said: where the group has no points at all, which is said elsewhere, or the model does not exist.
fn is_shown(setting: &Setting, last: &Last, uncertainty: &Uncertainty, group: &Group) -> Option<bool> {
    let points = &setting.thin;
    let objective = Objective { signs: Some(&last.signs), ..setting.objective(&setting.space, points, last.loss) };
    let mut placed = objective.place(&last.estimate).ok()?;
    let motion = &last.estimate.motion;
    let psi = |placed: &_| {
        let mut psi = vec![1.0; points.len()];
        objective.feet(placed, motion).iter().for_each(|(i, foot)| psi[*i] = objective.loss.psi(foot.d2));
        psi.iter().sum::<f64>() / points.len().max(1) as f64
    };
    let with = psi(&placed);
    placed.facets.remove(|patch| group.patches[patch]);
    let without = psi(&placed);
    if !(without > with) || !(with > 0.0) {
        return None;
    }
    let n = uncertainty.effective_points.max(2.0);
    Some(n * (without / with).ln() > group.members.len() as f64 * n.ln())
}

#[cfg(test)]
mod tests {
    use crate::fit::tests::cup::{SYNTHETIC, check, synthetic};
    use crate::fit::tests::shapes::cup;
    use crate::fit::{FitOptions, FitResult, fit};
    use crate::progress::Silent;
    use crate::scan::Scan;
    use glam::{DQuat, DVec3};

    fn fitted(scan: &Scan) -> FitResult {
        fit(&cup(), scan, &FitOptions::default(), &Silent).unwrap()
    }

    #[test]
    fn a_handle_that_was_not_scanned_is_not_known() {
        let mut scan = synthetic(0.1, 8000, 5);
        let shown = fitted(&scan);
        check(&shown, &SYNTHETIC);
        assert!(shown.warnings.is_empty() && shown.parameters[9].sd.is_some(), "{:?}", shown.warnings);
        // What lies more than a radius from the axis is the handle.
        let [alpha, beta, gamma] = [3, 4, 5].map(|i| SYNTHETIC[i]);
        let turn = DQuat::from_rotation_z(gamma) * DQuat::from_rotation_y(beta) * DQuat::from_rotation_x(alpha);
        let base = DVec3::from_slice(&SYNTHETIC[..3]);
        let keep: Vec<bool> = scan
            .mesh
            .positions
            .iter()
            .map(|p| (turn.inverse() * (DVec3::from_array(*p) - base)).truncate().length() < SYNTHETIC[7] + 1.0)
            .collect();
        for list in [&mut scan.mesh.positions, &mut scan.mesh.normals] {
            let mut kept = keep.iter();
            list.retain(|_| *kept.next().unwrap());
        }
        let hidden = fitted(&scan);
        let said =
            hidden.warnings.iter().any(|w| w.contains("does not show `handle`") || w.contains("belongs to `handle`"));
        assert!(said, "{:?}", hidden.warnings);
        let [radius, handle] = [7, 10].map(|i| &hidden.parameters[i]);
        assert!((radius.value - SYNTHETIC[7]).abs() < 0.15 && radius.sd.is_some(), "{radius:?}");
        assert!(handle.sd.is_none(), "{handle:?}");
    }
}
