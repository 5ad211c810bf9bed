//! The covariance of the pose that a fit adds, joint with that of the parameters, and the motions of the model within
//! itself, which have none.

use super::sandwich::Uncertainty;
use crate::eigen;
use crate::fit::problem::level::Level;
use crate::fit::refine::schedule::Solution;
use crate::fit::result::{PoseCovariance, Symmetry};
use crate::fit::tuning::{NAMED, SYMMETRIC};
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

/// The joint covariance of some parameters, given by their indices, and the pose. None where no pose was added.
pub(crate) fn joint(solution: &Solution, uncertainty: &Uncertainty, parameters: &[usize]) -> Option<PoseCovariance> {
    let Level { problem, space, .. } = &solution.level;
    if !(space.moving && problem.pose.report_pose) {
        return None;
    }
    let (first, motion) = (space.free.len(), solution.estimate.motion);
    let held = within_itself(&uncertainty.naive, first);
    let mut fixed = DMatrix::identity(space.dim(), space.dim());
    for direction in &held {
        let mut view = fixed.view_mut((first, first), (6, 6));
        view -= direction * direction.transpose();
    }
    // From scaled local coordinates to the parameters, and to shift and turn in the scan's frame.
    let chain = space.chain(&solution.estimate);
    let local = |k: usize, column: usize| {
        let at = chain.nrows() - 6 + k;
        DVec3::new(chain[(at, column)], chain[(at + 1, column)], chain[(at + 2, column)])
    };
    let rows =
        DMatrix::from_fn(parameters.len() + 6, space.dim(), |row, column| match row.checked_sub(parameters.len()) {
            None => chain[(parameters[row], column)],
            Some(k) => (motion.rotation * local(k / 3 * 3, column))[k % 3],
        }) * fixed;
    let matrix = &rows * &uncertainty.covariance * rows.transpose();
    let names = parameters.iter().map(|i| problem.model.parameters()[*i].name.clone());
    let centre = motion.apply(space.centre);
    let symmetry = |direction: &DVector<f64>| {
        let part = |k: usize| motion.rotation * DVec3::new(direction[k], direction[k + 1], direction[k + 2]);
        Symmetry::of(part(0), part(3) / space.radius, centre, space.radius)
    };
    Some(PoseCovariance {
        centre: centre.to_array(),
        parameters: names.collect(),
        matrix: matrix.row_iter().map(|row| row.iter().copied().collect()).collect(),
        symmetries: held.iter().map(symmetry).collect(),
    })
}

/// Unit directions, among the coordinates of the motion, by which the model moves within itself, orthogonal to each
/// other: about the axis of a body of revolution no distance changes, or so little that rounding and noise remain. They
/// are eigenvectors of the coordinates' covariance, of which those of the motion begin at `first`, with a deviation
/// beyond `SYMMETRIC` times the least one, or without any.
pub(super) fn within_itself(covariance: &DMatrix<f64>, first: usize) -> Vec<DVector<f64>> {
    let count = covariance.nrows() - first;
    if count == 0 {
        return Vec::new();
    }
    let eigen = eigen::symmetric(covariance.view((first, first), (count, count)).into_owned());
    let largest = eigen.eigenvalues.amax();
    // Directions that the scan does not determine at all have no variance but rounding.
    let none = |value: f64| value <= 1e-14 * largest;
    let least = eigen.eigenvalues.iter().copied().filter(|value| !none(*value)).fold(f64::INFINITY, f64::min);
    let chosen = |value: f64| none(value) || value > SYMMETRIC.powi(2) * least;
    let pairs = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    pairs.filter(|(value, _)| chosen(**value)).map(|(_, direction)| direction.into_owned()).collect()
}

impl Symmetry {
    /// A motion by a shift of `centre` (millimetres) and a turn (radians), of a model of the size `radius`.
    fn of(shift: DVec3, turn: DVec3, centre: DVec3, radius: f64) -> Self {
        let listed = |v: DVec3, digits: usize| format!("({:.digits$}, {:.digits$}, {:.digits$})", v.x, v.y, v.z);
        let turns = turn.length() * radius > NAMED * shift.length();
        if !turns {
            let shift = shift.normalize_or_zero();
            let text = format!("a shift along {} changes nothing", listed(shift, 3));
            return Self { shift: shift.to_array(), turn: [0.0; 3], text };
        }
        let (shift, turn) = (shift / turn.length(), turn.normalize());
        let place = centre + turn.cross(shift);
        let along = shift.dot(turn);
        let screw = if along.abs() > NAMED * radius {
            format!(" with {along:.3} mm along it per radian")
        } else {
            String::new()
        };
        let text = format!("a turn about {} through {} mm{screw} changes nothing", listed(turn, 3), listed(place, 1));
        Self { shift: shift.to_array(), turn: turn.to_array(), text }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_hardly_known_beside_the_rest_is_a_symmetry() {
        // One parameter, then motions: the last two are without variance, and a thousand times less certain.
        let covariance = DMatrix::from_diagonal(&DVector::from_vec(vec![9.0, 1.0, 2.0, 4.0, 3.0, 0.0, 5e6]));
        let mut found: Vec<usize> = within_itself(&covariance, 1).iter().map(DVector::iamax).collect();
        found.sort_unstable();
        assert_eq!(found, [4, 5]);
    }

    #[test]
    fn a_turn_names_its_axis() {
        // A turn about the vertical axis through (3, 4, 0), seen from the origin: it moves this by -axis x place.
        let (axis, place) = (DVec3::Z, DVec3::new(3.0, 4.0, 0.0));
        let symmetry = Symmetry::of(0.02 * place.cross(axis), 0.02 * axis, DVec3::ZERO, 10.0);
        assert_eq!(symmetry.text, "a turn about (0.000, 0.000, 1.000) through (3.0, 4.0, 0.0) mm changes nothing");
        assert_eq!(symmetry.turn, [0.0, 0.0, 1.0]);
        let slide = Symmetry::of(DVec3::new(0.0, -0.5, 0.0), DVec3::ZERO, DVec3::ZERO, 10.0);
        assert_eq!(
            (slide.shift, slide.text.as_str()),
            ([0.0, -1.0, 0.0], "a shift along (0.000, -1.000, 0.000) changes nothing")
        );
    }
}
