//! The covariance of the pose that a fit adds, joint with that of the parameters, and the motions of the model within
//! itself, which have none.

use super::invariance::Invariance;
use super::sandwich::Uncertainty;
use crate::eigen;
use crate::fit::problem::level::Level;
use crate::fit::refine::schedule::Solution;
use crate::fit::result::{PoseCovariance, Symmetry};
use crate::fit::tuning::{NAMED, SYMMETRIC};
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

/// A motion along which the pose is held, in scaled local coordinates.
struct Held {
    motion: DVector<f64>,
    /// The patches that it moves, of which the scan shows nothing there; none if the model moves within itself.
    moved: Vec<usize>,
}

/// The joint covariance of some parameters, given by their indices, and the pose. None where no pose was added.
pub(crate) fn joint(solution: &Solution, uncertainty: &Uncertainty, parameters: &[usize]) -> Option<PoseCovariance> {
    let Level { problem, space, .. } = &solution.level;
    if !(space.moving && problem.pose.report_pose) {
        return None;
    }
    let (first, motion) = (space.free.len(), solution.estimate.motion);
    let held = held(solution, uncertainty);
    let mut fixed = DMatrix::identity(space.dim(), space.dim());
    for Held { motion, .. } in &held {
        let mut view = fixed.view_mut((first, first), (6, 6));
        view -= motion * motion.transpose();
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
    Some(PoseCovariance {
        centre: motion.apply(space.centre).to_array(),
        parameters: names.collect(),
        matrix: matrix.row_iter().map(|row| row.iter().copied().collect()).collect(),
        symmetries: held.iter().map(|held| held.symmetry(solution)).collect(),
    })
}

/// Sentences on the motions alone that the scan does not determine, of a model that is not symmetric or whose pose is
/// among its parameters.
pub(crate) fn undetermined(solution: &Solution, uncertainty: &Uncertainty) -> Vec<String> {
    let told = |held: &Held| match held.moved.is_empty() {
        true => {
            "the scan does not determine the whole pose: the model is symmetric, and can be turned or shifted within \
                 itself"
                .to_owned()
        }
        false => format!("the scan does not determine the whole pose: {}", held.symmetry(solution).text),
    };
    let motions = Motions::new(&uncertainty.undetermined, solution.level.space.free.len());
    separated(solution, motions.held).iter().map(told).collect()
}

/// Motions along which the pose is held: those that the scan does not determine at all, and those that are much less
/// certain than others because the model moves within itself.
fn held(solution: &Solution, uncertainty: &Uncertainty) -> Vec<Held> {
    let first = solution.level.space.free.len();
    let mut without = Motions::new(&uncertainty.undetermined, first);
    without.add_without_influence(&uncertainty.naive, first);
    let known = without.held.len();
    let all = without.and_hardly_known(&uncertainty.naive, first);
    let (none, hardly) = all.split_at(known);
    let mut held = separated(solution, none.to_vec());
    held.extend(separated(solution, hardly.to_vec()).into_iter().filter(|held| held.moved.is_empty()));
    held
}

/// Motions that span the same as others, with what each moves of the model.
fn separated(solution: &Solution, motions: Vec<DVector<f64>>) -> Vec<Held> {
    if motions.is_empty() {
        return Vec::new();
    }
    match Invariance::of(solution) {
        Some(invariance) => {
            let held = |motion: DVector<f64>| Held { moved: invariance.moved(&motion), motion };
            invariance.separated(&motions).into_iter().map(held).collect()
        }
        None => motions.into_iter().map(|motion| Held { motion, moved: Vec::new() }).collect(),
    }
}

impl Held {
    fn symmetry(&self, solution: &Solution) -> Symmetry {
        let Level { problem, space, .. } = &solution.level;
        let motion = solution.estimate.motion;
        let part = |k: usize| motion.rotation * DVec3::new(self.motion[k], self.motion[k + 1], self.motion[k + 2]);
        let (shift, turn) = (part(0), part(3) / space.radius);
        let symmetry = Symmetry::of(shift, turn, motion.apply(space.centre), space.radius);
        let moves: Vec<String> = self.moved.iter().map(|patch| problem.model.parts()[*patch].name.clone()).collect();
        symmetry.of_parts(moves)
    }
}

/// Unit directions among the coordinates of the motion, orthogonal to each other.
struct Motions {
    held: Vec<DVector<f64>>,
}

impl Motions {
    /// Those that change no distance and no parameter, of all directions that change no distance; the coordinates
    /// of the motion begin at `first`.
    fn new(undetermined: &[DVector<f64>], first: usize) -> Self {
        let mut motions = Self { held: Vec::new() };
        for direction in undetermined {
            let (shape, pose) = direction.as_slice().split_at(first);
            if shape.iter().all(|s| s.abs() <= NAMED * direction.amax()) {
                motions.add(DVector::from_column_slice(pose));
            }
        }
        motions
    }

    /// Adds coordinates of the motion without any influence, which have no variance.
    fn add_without_influence(&mut self, covariance: &DMatrix<f64>, first: usize) {
        let count = covariance.nrows() - first;
        let largest = covariance.view((first, first), (count, count)).amax();
        for k in (0..count).filter(|k| covariance[(first + k, first + k)] <= NO_VARIANCE * largest) {
            self.add(DVector::from_fn(count, |i, _| f64::from(u8::from(i == k))));
        }
    }

    /// Adds what of a motion is not among the others yet.
    fn add(&mut self, mut motion: DVector<f64>) {
        let norm = motion.norm();
        self.held.iter().for_each(|held| motion.axpy(-held.dot(&motion), held, 1.0));
        if motion.norm() > NAMED * norm {
            self.held.push(motion.normalize());
        }
    }

    /// These and those whose deviation is beyond `SYMMETRIC` times the least one.
    fn and_hardly_known(self, covariance: &DMatrix<f64>, first: usize) -> Vec<DVector<f64>> {
        let count = covariance.nrows() - first;
        let mut rest = DMatrix::identity(count, count);
        self.held.iter().for_each(|held| rest -= held * held.transpose());
        let eigen = eigen::symmetric(&rest * covariance.view((first, first), (count, count)) * &rest);
        let none = NO_VARIANCE * eigen.eigenvalues.amax();
        let least = eigen.eigenvalues.iter().copied().filter(|value| *value > none).fold(f64::INFINITY, f64::min);
        let pairs = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
        let hardly = pairs.filter(|(value, _)| **value > SYMMETRIC.powi(2) * least);
        let hardly = hardly.map(|(_, direction)| direction.into_owned());
        self.held.into_iter().chain(hardly).collect()
    }
}

/// Directions that the scan does not determine at all have no variance but rounding, this part of the largest.
const NO_VARIANCE: f64 = 1e-14;

/// Unit directions, among the coordinates of the motion, by which the model moves within itself, or the scan cannot
/// tell whether it does, orthogonal to each other: about the axis of a body of revolution no distance changes, or so
/// little that rounding and noise remain. They are those without variance, and eigenvectors of the coordinates'
/// covariance, of which those of the motion begin at `first`, with a deviation beyond `SYMMETRIC` times the least one.
pub(super) fn within_itself(
    covariance: &DMatrix<f64>,
    undetermined: &[DVector<f64>],
    first: usize,
) -> Vec<DVector<f64>> {
    if covariance.nrows() == first {
        return Vec::new();
    }
    let mut motions = Motions::new(undetermined, first);
    motions.add_without_influence(covariance, first);
    motions.and_hardly_known(covariance, first)
}

impl Symmetry {
    /// A motion by a shift of `centre` (millimetres) and a turn (radians), of a model of the size `radius`.
    fn of(shift: DVec3, turn: DVec3, centre: DVec3, radius: f64) -> Self {
        let listed = |v: DVec3, digits: usize| format!("({:.digits$}, {:.digits$}, {:.digits$})", v.x, v.y, v.z);
        let turns = turn.length() * radius > NAMED * shift.length();
        if !turns {
            let shift = shift.normalize_or_zero();
            let text = format!("a shift along {} changes nothing", listed(shift, 3));
            return Self { shift: shift.to_array(), turn: [0.0; 3], text, moves: Vec::new() };
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
        Self { shift: shift.to_array(), turn: turn.to_array(), text, moves: Vec::new() }
    }

    /// The same of a model of which it moves some parts.
    fn of_parts(mut self, moves: Vec<String>) -> Self {
        if !moves.is_empty() {
            let parts: Vec<String> = moves.iter().map(|part| format!("`{part}`")).collect();
            let them = if parts.len() == 1 { "it" } else { "them" };
            self.text = format!(
                "{} of what was scanned, but it moves {}: the scan shows nothing of {them} that tells",
                self.text,
                parts.join(", ")
            );
        }
        self.moves = moves;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_hardly_known_beside_the_rest_is_a_symmetry() {
        // One parameter, then motions: the last two are without variance, and a thousand times less certain.
        let covariance = DMatrix::from_diagonal(&DVector::from_vec(vec![9.0, 1.0, 2.0, 4.0, 3.0, 0.0, 5e6]));
        let mut found: Vec<usize> = within_itself(&covariance, &[], 1).iter().map(DVector::iamax).collect();
        found.sort_unstable();
        assert_eq!(found, [4, 5]);
    }

    #[test]
    fn an_undetermined_motion_is_not_where_the_covariance_vanishes() {
        // In coordinates in which a turn about z is told a hundred times as well as a shift along y, their sum is not
        // determined: that is the motion (0.01, 1) of turn and shift. What is known is (0.01, -1), which is not at
        // right angles to it: no variance is along (1, 0.01).
        let (turn, shift) = (0.01, 1.0);
        let along = DVector::from_vec(vec![0.01, -1.0]) * 3.0;
        let mut covariance = DMatrix::identity(6, 6);
        for (a, i) in [5, 1].into_iter().enumerate() {
            for (b, j) in [5, 1].into_iter().enumerate() {
                covariance[(i, j)] = along[a] * along[b];
            }
        }
        let mut direction = DVector::zeros(6);
        (direction[5], direction[1]) = (turn, shift);
        let [found] = &within_itself(&covariance, &[direction], 0)[..] else { panic!("one motion") };
        assert!(found[1].abs() > 0.999 && (found[5] / found[1] - 0.01).abs() < 1e-12, "{found}");
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
