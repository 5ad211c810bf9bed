//! Groups of parameters that shape only some parts of the model, and what the scan says of such parts by themselves.

use crate::fit::problem::level::Level;
use crate::fit::problem::objective::Objective;
use crate::fit::problem::parameterization::Estimate;
use glam::DVec3;
use gml_compiler::program::Part;
use nalgebra::{Matrix6, SymmetricEigen, Vector6};

/// Points of a group whose mean psi is less than this times that of the others need no other values; with so much less, what else
/// there may be need not even be looked at.
const SETTLED_BELOW: f64 = 1.1;
const CLEAR_BELOW: f64 = 0.5;

/// A rotation as shift and turn a radian.
pub(crate) type Axis = (DVec3, DVec3);

/// Parameters that shape the same patches, and not all of them.
pub(crate) struct Group {
    /// Positions in the space's list of free parameters.
    pub(crate) members: Vec<usize>,
    pub(crate) patches: Vec<bool>,
}

impl Group {
    /// So many for each of the group's parameters, but not more than the most.
    pub(crate) fn of(&self, (each, most): (usize, usize)) -> usize {
        (each * self.members.len()).min(most)
    }

    /// Signs of which those of the group's patches are not known.
    pub(crate) fn unsigned(&self, signs: &[i8]) -> Vec<i8> {
        signs.iter().zip(&self.patches).map(|(sign, own)| if *own { 0 } else { *sign }).collect()
    }
}

/// All groups of a fit's free parameters.
pub(crate) fn groups(level: &Level) -> Vec<Group> {
    let parts = level.problem.model.parts();
    let mut groups: Vec<Group> = Vec::new();
    for (k, i) in level.space.free.iter().enumerate() {
        let shapes = |p: &Part| level.space.followers(*i).any(|i| p.active.contains(&(i as u32)));
        let patches: Vec<bool> = parts.iter().map(shapes).collect();
        if patches.iter().all(|p| *p) || !patches.contains(&true) {
            continue;
        }
        match groups.iter_mut().find(|g| g.patches == patches) {
            Some(group) => group.members.push(k),
            None => groups.push(Group { members: vec![k], patches }),
        }
    }
    groups
}

/// How well a group explains the points that no other patch does.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(crate) enum Verdict {
    /// Worse than other points are explained.
    Doubtful,
    /// As well.
    Settled,
    /// Much better: a fit with a scale of psi that is coarse for the noise.
    Clear,
}

/// What the points that only the group can explain say of it; None where the model does not exist.
pub(crate) fn judge(objective: &Objective, at: &Estimate, explained: &[bool]) -> Option<Verdict> {
    let placed = objective.place(at).ok()?;
    let psi = objective.psi_of_points(&placed, &at.motion);
    let mean = |side: bool| {
        let chosen = psi.iter().zip(explained).filter(|(_, e)| **e == side).map(|(p, _)| *p);
        let (sum, count) = chosen.fold((0.0, 0.0), |(sum, count), p| (sum + p, count + 1.0));
        sum / f64::max(count, 1.0)
    };
    let (own, others) = (mean(false), mean(true));
    Some(if own < CLEAR_BELOW * others {
        Verdict::Clear
    } else if own < SETTLED_BELOW * others {
        Verdict::Settled
    } else {
        Verdict::Doubtful
    })
}

/// Which points patches outside the group explain, and the rotation (shift and turn a radian) that leaves those
/// patches' surface where it is, if there is one and the motion is a variable (else it would be no part of the result).
pub(crate) fn unexplained(objective: &Objective, at: &Estimate, group: &Group) -> Option<(Vec<bool>, Option<Axis>)> {
    let mut placed = objective.place(at).ok()?;
    placed.facets.remove(|patch| group.patches[patch]);
    let centre = objective.space.centre;
    let radius = objective.space.radius;
    let half2 = objective.loss.half().powi(2);
    let mut explained = vec![false; objective.points.len()];
    let (mut gram, mut count) = (Matrix6::zeros(), 0.0);
    for (i, foot) in objective.feet(&placed, &at.motion) {
        if foot.d2 < half2 {
            explained[i] = true;
            let n = foot.normal.normalize_or_zero();
            let turn = (foot.point - centre).cross(n) / radius;
            let row = Vector6::new(n.x, n.y, n.z, turn.x, turn.y, turn.z);
            gram += row * row.transpose();
            count += 1.0;
        }
    }
    if count < 20.0 || !objective.space.moving {
        return Some((explained, None));
    }
    let eigen = SymmetricEigen::new(gram / count);
    let axis = (0..6).filter(|k| eigen.eigenvalues[*k] < 1e-3).find_map(|k| {
        let e = eigen.eigenvectors.column(k);
        let turn = DVec3::new(e[3], e[4], e[5]) / radius;
        let rate = turn.length();
        // Mostly a translation (of a plane, along a cylinder) is no rotation.
        (rate * radius > 0.3).then(|| (DVec3::new(e[0], e[1], e[2]) / rate, turn / rate))
    });
    Some((explained, axis))
}
