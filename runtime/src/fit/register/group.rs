//! Groups of parameters that shape only some parts of the model, and what the scan says of such parts by themselves.

use crate::eigen;
use crate::fit::correspond::foot::Foot;
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::level::Level;
use crate::fit::problem::objective::Objective;
use crate::fit::problem::parameterization::Estimate;
use crate::fit::tuning::{AXIS_EIGENVALUE, AXIS_POINTS, AXIS_TURN, PerMember};
use glam::DVec3;
use gml_compiler::program::Part;
use nalgebra::{Matrix6, Vector6};

/// A rotation about an axis, as shift and turn by a radian.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    shift: DVec3,
    turn: DVec3,
}

impl Axis {
    /// A point of the axis and its direction. Local motions turn about `centre`.
    pub(crate) fn line(&self, centre: DVec3) -> (DVec3, DVec3) {
        (centre + self.turn.cross(self.shift) / self.turn.length_squared(), self.turn.normalize_or_zero())
    }

    /// A motion after a rotation by an angle (radians). Local motions turn about `centre`.
    pub(crate) fn rotated(&self, motion: &Isometry, angle: f64, centre: DVec3) -> Isometry {
        motion.after_local(self.shift * angle, self.turn * angle, centre)
    }
}

/// Parameters that shape the same patches, and not all of them.
pub(crate) struct Group {
    /// Positions in the list of free parameters.
    pub(crate) members: Vec<usize>,
    /// By patch, whether they shape it.
    pub(crate) patches: Vec<bool>,
}

impl Group {
    /// An effort that grows with the number of parameters.
    pub(crate) fn effort(&self, PerMember { each, most }: PerMember) -> usize {
        (each * self.members.len()).min(most)
    }

    /// The losses of an objective's points with the group's patches and without them. None where the model does not
    /// exist.
    pub(crate) fn losses(&self, objective: &Objective, at: &Estimate) -> Option<GroupLosses> {
        let mut placed = objective.place(at).ok()?;
        let with = objective.losses(&placed);
        placed.facets.remove(|patch| self.patches[patch]);
        Some(GroupLosses { with, without: objective.losses(&placed) })
    }

    /// Signs of which those of the group's patches are not known.
    pub(crate) fn unsigned(&self, signs: &[i8]) -> Vec<i8> {
        signs.iter().zip(&self.patches).map(|(sign, shaped)| if *shaped { 0 } else { *sign }).collect()
    }
}

/// The losses of points with a group's patches and without them.
pub(crate) struct GroupLosses {
    pub(crate) with: Vec<f64>,
    pub(crate) without: Vec<f64>,
}

impl GroupLosses {
    /// The points near the model whose nearest patch is one of the group's: those for which it makes a difference.
    pub(crate) fn own_points(&self) -> impl Iterator<Item = usize> + Clone {
        (0..self.with.len()).filter(|i| self.is_own(*i))
    }

    /// These, and those near no patch: they may be of one of the group's that is in a wrong place.
    pub(crate) fn own_or_unexplained_points(&self) -> impl Iterator<Item = usize> + Clone {
        (0..self.with.len()).filter(|i| self.is_own(*i) || self.with[*i] >= 0.5)
    }

    fn is_own(&self, i: usize) -> bool {
        self.with[i] < 0.5 && self.with[i] != self.without[i]
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

/// Groups with those that shape some of their patches and no others: where one part is moved by the length of another,
/// that one may be longer by what this one is shorter, and neither finds that alone.
pub(crate) fn chains(groups: &[Group]) -> Vec<Group> {
    let within = |inner: &Group, outer: &Group| inner.patches.iter().zip(&outer.patches).all(|(a, b)| !a || *b);
    let chain = |outer: &Group| {
        let members: Vec<usize> =
            groups.iter().filter(|inner| within(inner, outer)).flat_map(|inner| inner.members.clone()).collect();
        (members.len() > outer.members.len()).then(|| Group { members, patches: outer.patches.clone() })
    };
    groups.iter().filter_map(chain).collect()
}

/// The mean loss of the points that only the group can explain over that of the others: about 1 where the group fits as
/// well as the rest. None where the model does not exist.
pub(crate) fn loss_ratio(objective: &Objective, at: &Estimate, explained: &[bool]) -> Option<f64> {
    let placed = objective.place(at).ok()?;
    let losses = objective.losses(&placed);
    let mean = |side: bool| {
        let chosen = (0..losses.len()).filter(|i| explained[*i] == side);
        let add = |(sum, weight): (f64, f64), i| {
            let prior = objective.points.prior(i);
            (sum + prior * losses[i], weight + prior)
        };
        let (sum, weight) = chosen.fold((0.0, 0.0), add);
        if weight > 0.0 { sum / weight } else { 0.0 }
    };
    Some(mean(false) / mean(true))
}

/// The patches outside of a group.
pub(crate) struct Rest {
    /// By point, whether they explain it.
    pub(crate) explained: Vec<bool>,
    /// The rotation that leaves their surface where it is, if there is one and the motion is a variable (else it would
    /// be no part of the result).
    pub(crate) axis: Option<Axis>,
}

/// The patches outside of a group. None where the model does not exist.
pub(crate) fn rest(objective: &Objective, at: &Estimate, group: &Group) -> Option<Rest> {
    let mut placed = objective.place(at).ok()?;
    placed.facets.remove(|patch| group.patches[patch]);
    let centre = objective.space.centre;
    let radius = objective.space.radius;
    let half2 = objective.loss.half().powi(2);
    let mut explained = vec![false; objective.points.len()];
    let (mut gram, mut count, mut weight) = (Matrix6::zeros(), 0, 0.0);
    for (i, foot) in objective.feet(&placed) {
        if foot.d2 < half2 {
            explained[i] = true;
            let row = moved_by_motions(&foot, centre, radius);
            gram += row * row.transpose() * objective.points.prior(i);
            weight += objective.points.prior(i);
            count += 1;
        }
    }
    if count < AXIS_POINTS || !objective.space.moving {
        return Some(Rest { explained, axis: None });
    }
    Some(Rest { explained, axis: axis(gram / weight, radius, AXIS_EIGENVALUE) })
}

/// The turn that moves the surface least along its normals, where a scan's points are near it. None where there are
/// hardly any, or the motion is not a variable.
pub(crate) fn least_turn(objective: &Objective, at: &Estimate) -> Option<Axis> {
    let placed = objective.place(at).ok()?;
    let space = objective.space;
    let feet = objective.feet(&placed);
    if feet.len() < AXIS_POINTS as usize || !space.moving {
        return None;
    }
    let rows = feet.iter().map(|(_, foot)| moved_by_motions(foot, space.centre, space.radius));
    let gram = rows.fold(Matrix6::zeros(), |gram, row| gram + row * row.transpose());
    axis(gram / feet.len() as f64, space.radius, f64::INFINITY)
}

/// How fast a shift along x, y and z, and a turn about them (in radians times `radius`), move a foot along its normal.
fn moved_by_motions(foot: &Foot, centre: DVec3, radius: f64) -> Vector6<f64> {
    let n = foot.normal.normalize_or_zero();
    let turn = (foot.point - centre).cross(n) / radius;
    Vector6::new(n.x, n.y, n.z, turn.x, turn.y, turn.z)
}

/// The rotation whose mean square of that rate is least, and below `most`.
fn axis(gram: Matrix6<f64>, radius: f64, most: f64) -> Option<Axis> {
    let eigen = eigen::symmetric(gram);
    let mut order: Vec<usize> = (0..6).filter(|k| eigen.eigenvalues[*k] < most).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    order.into_iter().find_map(|k| {
        let e = eigen.eigenvectors.column(k);
        let turn = DVec3::new(e[3], e[4], e[5]) / radius;
        let rate = turn.length();
        // A motion that is mostly a translation (of a plane, along a cylinder) is not a rotation.
        let shift = DVec3::new(e[0], e[1], e[2]);
        (rate * radius > AXIS_TURN).then(|| Axis { shift: shift / rate, turn: turn / rate })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_that_move_a_part_are_varied_with_those_that_shape_it() {
        // A shank and its length move the thread and the point behind it; the last group shapes a part of its own.
        let group =
            |members: &[usize], patches: [bool; 4]| Group { members: members.to_vec(), patches: patches.into() };
        let groups = [
            group(&[0], [true, true, true, false]),
            group(&[1, 2], [false, true, true, false]),
            group(&[3], [false, true, false, false]),
            group(&[4], [false, false, false, true]),
            group(&[5], [false, false, true, true]),
        ];
        let found: Vec<(Vec<usize>, Vec<bool>)> = chains(&groups).into_iter().map(|g| (g.members, g.patches)).collect();
        let expected = [
            (vec![0, 1, 2, 3], vec![true, true, true, false]),
            (vec![1, 2, 3], vec![false, true, true, false]),
            (vec![4, 5], vec![false, false, true, true]),
        ];
        assert_eq!(found, expected);
    }
}
