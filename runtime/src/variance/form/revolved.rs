//! The axis of a measured surface of revolution whose profile is the model's.

use super::FEWEST;
use super::associated::{Associated, of_those_on_it};
use super::datum::Datum;
use super::linear::{self, MOST, Row};
use super::members::Member;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

/// The first unknowns are those of a cylinder: an even distance, two shifts and two tilts of the axis. The last one is
/// the shift along it.
const AXIAL: usize = 5;

/// Relative singular values below this are combinations of unknowns that the profile does not tell apart, such as size
/// and shift of what is nearly a cone.
const SINGULAR: f64 = 1e-10;

/// The surface that the model's surface of revolution about `axis` (a point and a direction) becomes with another axis,
/// place along it, and even distance. It is described by a cylinder about the measured axis. Distances are those from
/// the tangent planes of the model's places, which lie beside the feet by the shift: the error, its square over twice
/// the radius, is even around the axis.
pub(super) fn associated(members: &[Member], (origin, direction): (DVec3, DVec3)) -> Option<Associated> {
    if members.len() < FEWEST {
        return None;
    }
    let radius = |m: &Member| (m.place.position - origin).reject_from_normalized(direction).length();
    let size = members.iter().map(radius).sum::<f64>() / members.len() as f64;
    let model = Datum::about(origin, direction, 0.0, size, false);
    let rows: Vec<Row> = members.iter().map(|member| row(member, &model)).collect();
    let (first, _) = linear::least_squares(rows.iter().copied(), MOST)?;
    let heights = |motion: &[f64; MOST]| rows.iter().map(|row| row.error(motion)).collect();
    let fitted = |kept: &[usize]| Some(linear::least_squares(kept.iter().map(|i| rows[*i]), MOST)?.0);
    let (motion, kept) = of_those_on_it(first, heights, fitted)?;
    let by: [f64; MOST] = std::array::from_fn(|k| if k < AXIAL { motion[k] } else { 0.0 });
    let measured = model.moved(&by);
    let covariance = covariance(kept.iter().map(|i| &rows[*i]), &motion)?;
    let turn = between_frames(model.axis, measured.axis);
    let centre = |of: fn(&Member) -> DVec3| kept.iter().map(|i| of(&members[*i])).sum::<DVec3>() / kept.len() as f64;
    let centres = [centre(|m| m.point), centre(|m| m.place.position)];
    Some(Associated { measured, model, centres, covariance: &turn * covariance * turn.transpose() })
}

/// The distance of a point from its place, and by how much each unknown explains it. A tilt t of the axis a moves a
/// place r by (a x t) x r = t (a . r) - a (t . r).
fn row(member: &Member, model: &Datum) -> Row {
    let (x, y) = model.axis.any_orthonormal_pair();
    let (normal, from) = (member.place.normal, member.place.position - model.origin);
    let tilted = |t: DVec3| normal.dot(t * model.axis.dot(from) - model.axis * t.dot(from));
    let factors = [1.0, normal.dot(x), normal.dot(y), tilted(x), tilted(y), normal.dot(model.axis)];
    Row { factors, value: (member.point - member.place.position).dot(normal) }
}

/// The covariance of the unknowns of the axis, with the variance of the points about the surface.
fn covariance<'r>(rows: impl ExactSizeIterator<Item = &'r Row>, motion: &[f64; MOST]) -> Option<DMatrix<f64>> {
    let degrees = rows.len().checked_sub(MOST).filter(|n| *n > 0)?;
    let mut normal = DMatrix::<f64>::zeros(MOST, MOST);
    let mut squares = 0.0;
    for row in rows {
        let factors = DVector::from_row_slice(&row.factors);
        normal.ger(1.0, &factors, &factors, 1.0);
        squares += row.error(motion).powi(2);
    }
    // Unknowns of different units are scaled.
    let scale = DMatrix::from_diagonal(&normal.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 }));
    let inverse = (&scale * normal * &scale).pseudo_inverse(SINGULAR).ok()?;
    let all = &scale * inverse * &scale * (squares / degrees as f64);
    Some(all.view((0, 0), (AXIAL, AXIAL)).into_owned())
}

/// What unknowns in the frame of one axis are in the frame of another that is nearly parallel.
fn between_frames(from: DVec3, to: DVec3) -> DMatrix<f64> {
    let ((a, b), (x, y)) = (from.any_orthonormal_pair(), to.any_orthonormal_pair());
    let mut turn = DMatrix::<f64>::identity(AXIAL, AXIAL);
    for first in [1, 3] {
        for (i, to) in [x, y].into_iter().enumerate() {
            for (k, from) in [a, b].into_iter().enumerate() {
                turn[(first + i, first + k)] = to.dot(from);
            }
        }
    }
    turn
}
