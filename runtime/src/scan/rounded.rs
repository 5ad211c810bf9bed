//! The frames in which a file's coordinates are rounded, and their steps there. A pose that a reader applies turns the
//! steps with the points: along the axes of the scan nothing is then seen of them.

use super::attributes::{Station, Stations};
use super::steps;
use crate::mesh::{TriangleMesh, retain_marked};
use glam::{DAffine3, DMat3, DVec3};

/// To what the coordinates of a scan's points are rounded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rounded {
    /// Empty where no steps are coarse beside the noise, or none are seen.
    pub frames: Vec<Frame>,
    /// By point, the index of its frame in `frames`; empty where all have the first one. What is beyond the end of
    /// `frames` has none.
    pub of_points: Vec<u16>,
}

/// A frame in which coordinates are rounded: coordinate k of a point p is `rows[k]` (p - `origin`) there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The rows of a matrix.
    pub rows: [[f64; 3]; 3],
    /// Millimetres (of a file: its unit), in the scan's frame.
    pub origin: [f64; 3],
    /// The steps of its coordinates, likewise; 0 where they are finer than the noise, or none are seen.
    pub steps: [f64; 3],
    /// Whether they are those of numbers of so many digits, of which only the larger ones have them.
    pub(crate) of_digits: [bool; 3],
}

impl Frame {
    /// The scan's own.
    pub(crate) fn own(steps: [f64; 3]) -> Self {
        Self {
            rows: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            origin: [0.0; 3],
            steps,
            of_digits: [false; 3],
        }
    }

    /// That of points which a reader has moved.
    pub(crate) fn moved_by(transform: DAffine3) -> Self {
        let rows = transform.matrix3.inverse().transpose().to_cols_array_2d();
        Self { rows, origin: transform.translation.into(), steps: [0.0; 3], of_digits: [false; 3] }
    }

    /// A scanner's, of which a reader has applied the pose.
    fn of_station(station: &Station) -> Self {
        // Rotations that a file has with few digits are none exactly: what was applied is undone.
        let matrix3 = DMat3::from_cols_array_2d(&station.rotation).transpose();
        Self::moved_by(DAffine3 { matrix3, translation: station.place.into() })
    }

    /// A point's coordinates in it.
    pub(crate) fn local(&self, p: [f64; 3]) -> [f64; 3] {
        self.rows.map(|row| (0..3).map(|k| row[k] * (p[k] - self.origin[k])).sum())
    }

    /// The unit vector along which coordinate k is rounded, and the length of its step in the scan.
    pub(crate) fn step(&self, k: usize) -> (DVec3, f64) {
        let row = DVec3::from(self.rows[k]);
        let length = row.length();
        if length > 0.0 { (row / length, self.steps[k] / length) } else { (DVec3::ZERO, 0.0) }
    }

    /// The same with the steps of some points.
    fn with_steps_of(self, positions: &[[f64; 3]]) -> Self {
        let found = steps::steps(positions, &self);
        Self { steps: found.map(|step| step.length), of_digits: found.map(|step| step.of_digits), ..self }
    }

    /// The longest of its steps in the scan.
    fn longest(&self) -> f64 {
        (0..3).map(|k| self.step(k).1).fold(0.0, f64::max)
    }

    /// The variance of rounding along a unit vector.
    fn variance(&self, along: DVec3) -> f64 {
        (0..3).map(|k| self.step(k)).map(|(axis, step)| (step * axis.dot(along)).powi(2) / 12.0).sum()
    }
}

impl Rounded {
    /// All points in one frame, the scan's own.
    #[must_use]
    pub fn to(steps: [f64; 3]) -> Self {
        if steps == [0.0; 3] {
            Self::default()
        } else {
            Self { frames: vec![Frame::own(steps)], of_points: Vec::new() }
        }
    }

    /// The frame of a point, if it is rounded.
    pub(crate) fn of(&self, point: usize) -> Option<&Frame> {
        self.frames.get(self.index(point))
    }

    /// The index of a point's frame.
    pub(crate) fn index(&self, point: usize) -> usize {
        self.of_points.get(point).map_or(0, |frame| usize::from(*frame))
    }

    /// The longest step. Millimetres; 0 where there is none.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.frames.iter().map(Frame::longest).fold(0.0, f64::max)
    }

    /// The standard deviation along the normals of points that are rounded so.
    pub(crate) fn deviation(&self, normals: &[[f64; 3]]) -> f64 {
        if self.frames.is_empty() {
            return 0.0;
        }
        if normals.is_empty() {
            let of_frame = |frame: &Frame| (0..3).map(|k| frame.step(k).1.powi(2) / 36.0).sum::<f64>();
            return self.frames.iter().map(of_frame).fold(0.0, f64::max).sqrt();
        }
        let along = |(i, n): (usize, &[f64; 3])| self.of(i).map_or(0.0, |frame| frame.variance((*n).into()));
        (normals.iter().enumerate().map(along).sum::<f64>() / normals.len() as f64).sqrt()
    }

    pub(crate) fn retain_marked(&mut self, marks: &[bool]) {
        retain_marked(&mut self.of_points, marks);
    }

    /// The same in millimetres, of a unit that is so long.
    pub(super) fn scaled(mut self, unit: f64) -> Self {
        for frame in &mut self.frames {
            frame.origin = frame.origin.map(|c| c * unit);
            frame.steps = frame.steps.map(|step| step * unit);
        }
        self
    }

    /// The mirror image: x is turned round.
    pub(super) fn mirror(&mut self) {
        for frame in &mut self.frames {
            frame.rows.iter_mut().for_each(|row| row[0] = -row[0]);
            frame.origin[0] = -frame.origin[0];
        }
    }

    /// The steps of a file's points: in the frames that a reader has `given`, or in the file's own and, where scanners'
    /// poses were applied, in theirs.
    pub(super) fn find(positions: &[[f64; 3]], given: &Self, stations: &Stations) -> Self {
        let mut found = given.clone();
        let own = Frame::own([0.0; 3]).with_steps_of(positions);
        if !found.frames.is_empty() {
            let by_frame = found.by_frame(positions);
            for (frame, of_frame) in found.frames.iter_mut().zip(by_frame) {
                *frame = frame.with_steps_of(&of_frame);
            }
            return found;
        }
        if stations.of_points.is_empty() || stations.places.iter().all(|place| *place == Station::at([0.0; 3])) {
            return Self { frames: vec![own], of_points: Vec::new() };
        }
        let mut found = Self::of_stations(stations);
        let by_frame = found.by_frame(positions);
        for (frame, of_frame) in found.frames.iter_mut().zip(by_frame) {
            // Points that a file has in its own frame are rounded there, wherever the scanner stood.
            let turned = frame.with_steps_of(&of_frame);
            let here = if of_frame.len() < steps::FEWEST { own } else { own.with_steps_of(&of_frame) };
            *frame = if turned.longest() > here.longest() { turned } else { here };
        }
        found
    }

    fn by_frame(&self, positions: &[[f64; 3]]) -> Vec<Vec<[f64; 3]>> {
        let mut by_frame: Vec<Vec<[f64; 3]>> = vec![Vec::new(); self.frames.len()];
        for (i, p) in positions.iter().enumerate() {
            if let Some(of_frame) = by_frame.get_mut(self.index(i)) {
                of_frame.push(*p);
            }
        }
        by_frame
    }

    /// A frame for every station, and one for the points that have none.
    fn of_stations(stations: &Stations) -> Self {
        let own = Frame::own([0.0; 3]);
        let frames: Vec<Frame> = stations.places.iter().map(Frame::of_station).chain([own]).collect();
        let unknown = stations.places.len() as u16;
        let of_points = stations.of_points.iter().map(|n| (*n).min(unknown)).collect();
        Self { frames, of_points }
    }

    /// The frames of which steps are coarse beside the noise (see `steps::coarse`); none if there are none.
    pub(super) fn coarse(mut self, mesh: &TriangleMesh, noise: f64, coincident: f64) -> Self {
        if !steps::any_coarse(&self.frames, mesh, noise) {
            return Self::default();
        }
        let largest = self.largest_coordinates(&mesh.positions);
        steps::coarse(&mut self.frames, &largest, mesh, noise, coincident);
        self.without_lattices(mesh);
        if self.frames.iter().all(|frame| frame.steps == [0.0; 3]) { Self::default() } else { self }
    }

    /// Sets steps to 0 that coordinates have along faces and not across them.
    fn without_lattices(&mut self, mesh: &TriangleMesh) {
        // By frame and axis, the coordinates of points, and how much their normals are along the axis.
        let mut coordinates: Vec<[Vec<(f64, f64)>; 3]> = vec![Default::default(); self.frames.len()];
        for (i, (position, normal)) in mesh.positions.iter().zip(&mesh.normals).enumerate() {
            let Some(frame) = self.of(i) else { continue };
            let local = frame.local(*position);
            for k in (0..3).filter(|k| frame.steps[*k] > 0.0) {
                coordinates[self.index(i)][k].push((local[k], frame.step(k).0.dot((*normal).into()).abs()));
            }
        }
        for (frame, coordinates) in self.frames.iter_mut().zip(coordinates) {
            for (step, coordinates) in frame.steps.iter_mut().zip(coordinates) {
                if steps::are_of_a_lattice(&coordinates, *step) {
                    *step = 0.0;
                }
            }
        }
    }

    /// By frame, the largest coordinates of its points in it.
    fn largest_coordinates(&self, positions: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut largest = vec![[0.0_f64; 3]; self.frames.len()];
        for (i, p) in positions.iter().enumerate() {
            let n = self.index(i);
            let Some(frame) = self.frames.get(n) else { continue };
            let local = frame.local(*p);
            (0..3).for_each(|k| largest[n][k] = largest[n][k].max(local[k].abs()));
        }
        largest
    }
}

/// Of several scans, each moved into a common frame; `counts` has their points.
pub(super) fn merged(scans: &[&Rounded], frames: &[Station], counts: &[usize]) -> Rounded {
    let mut all = Rounded::default();
    if scans.iter().all(|rounded| rounded.frames.is_empty()) {
        return all;
    }
    for ((rounded, station), count) in scans.iter().zip(frames).zip(counts) {
        let (first, end) = (all.frames.len(), all.frames.len() + rounded.frames.len());
        let moved = |frame: &Frame| Frame {
            rows: frame.rows.map(|row| station.direction(row)),
            origin: station.point(frame.origin),
            ..*frame
        };
        all.frames.extend(rounded.frames.iter().map(moved));
        let number = |i: usize| match first + rounded.index(i) {
            n if n < end => u16::try_from(n).unwrap_or(u16::MAX),
            _ => u16::MAX,
        };
        all.of_points.extend((0..*count).map(number));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::thinned::mixed;
    use glam::DQuat;

    /// Points of 60 x 60 x 60 on steps of half a unit, but for shifts that keep faces from lying on them.
    fn lattice(count: u64) -> Vec<DVec3> {
        let at = |i: u64| (mixed(i) % 120) as f64 * 0.5 - 20.0;
        (0..count).map(|i| DVec3::new(at(3 * i), at(3 * i + 1), at(3 * i + 2))).collect()
    }

    #[test]
    fn steps_are_found_in_the_frame_in_which_they_are() {
        let turn = DQuat::from_scaled_axis(DVec3::new(0.3, -1.0, 2.0));
        let shift = DVec3::new(4e5, -2e3, 7.0);
        let moved: Vec<[f64; 3]> = lattice(4000).iter().map(|p| (turn * *p + shift).to_array()).collect();
        let rotation = DMat3::from_quat(turn).transpose().to_cols_array_2d();
        let places = vec![Station { place: shift.into(), rotation }];
        let stations = Stations { places, of_points: vec![0; 4000] };
        let found = Rounded::find(&moved, &Rounded::default(), &stations);
        assert!(found.frames[0].steps.iter().all(|step| (step - 0.5).abs() < 1e-6), "{found:?}");
        assert!((found.largest() - 0.5).abs() < 1e-6 && found.frames.len() == 2);
        // Along the scan's own axes there are none.
        let none = Rounded::find(&moved, &Rounded::default(), &Stations::default());
        assert_eq!(none.largest(), 0.0);
        // A node that is turned, and a tenth as large.
        let transform = DAffine3::from_scale_rotation_translation(DVec3::splat(0.1), turn, shift);
        let points: Vec<[f64; 3]> = lattice(4000).iter().map(|p| transform.transform_point3(*p).to_array()).collect();
        let given = Rounded { frames: vec![Frame::moved_by(transform)], of_points: Vec::new() };
        let found = Rounded::find(&points, &given, &Stations::default());
        assert!((found.largest() - 0.05).abs() < 1e-6, "{found:?}");
        // The variance of rounding is a twelfth of the squared step in every direction, if all axes have it.
        assert!((found.deviation(&[[0.0, 0.6, 0.8]; 4000]) - 0.05 / 12f64.sqrt()).abs() < 1e-6);
    }

    #[test]
    fn frames_of_several_scans_turn_with_them() {
        let quarter =
            Station { place: [5.0, 0.0, 0.0], rotation: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]] };
        let (rounded, exact) = (Rounded::to([0.1, 0.0, 0.0]), Rounded::default());
        let all = merged(&[&exact, &rounded], &[Station::at([0.0; 3]), quarter], &[2, 1]);
        assert!(all.of(0).is_none() && all.of(1).is_none());
        let (axis, step) = all.of(2).expect("a frame").step(0);
        assert_eq!((axis, step), (DVec3::Y, 0.1));
        assert_eq!(all.of(2).expect("a frame").local([5.0, 3.0, 1.0]), [3.0, 0.0, 1.0]);
        assert_eq!(merged(&[&exact], &[quarter], &[3]), Rounded::default());
    }
}
