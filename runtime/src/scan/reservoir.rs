//! Keeps the points of a cloud that is read, as many as the memory holds.
//!
//! A cloud of more points is thinned: of the points in a cube one is kept, each with the same probability (Vitter,
//! 'Random sampling with a reservoir', 1985), however many come. Kept points are points of the scan, no means, so that
//! its noise stays what it is.

use super::attributes::{Attributes, Stations};
use super::cloud::{Entry, NoPoint, Points, RawPoint};
use super::crop::Sides;
use super::error::ScanFault;
use super::raw::RawMesh;
use super::source::Cleaning;
use super::thinned::mixed;
use crate::mesh::Bounds;
use crate::progress::Progress;
use foldhash::fast::RandomState;
use glam::DVec3;
use std::collections::HashMap;

/// The most points that are kept. With 8 GB of memory so many are fitted and measured.
pub(super) const MOST_POINTS: usize = 1 << 24;
/// The first cubes of a cloud that turns out to be too large are so many times as small as those of which a surface as
/// wide as the cloud has `MOST_POINTS`.
const FINER: f64 = 4.0;

/// The number of points of each scan in a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Counted {
    pub(super) entry: Entry,
    pub(super) points: u64,
}

/// Takes the points of a file and keeps those that are wanted.
pub(super) struct Reservoir<'a> {
    progress: &'a dyn Progress,
    /// What the user says of the unit, in millimetres.
    given: Option<f64>,
    /// What the file says, or what is usual.
    stated: Option<f64>,
    is_usual: bool,
    crop: Option<Box<Sides>>,
    /// The edge of the cubes; none as long as all points are kept.
    edge: Option<f64>,
    most: usize,
    cells: HashMap<[i32; 3], Cell, RandomState>,
    /// Cubes are counted from the first point.
    origin: Option<DVec3>,
    kept: Kept,
    pub(super) scans: Vec<Counted>,
    /// The index of the current station.
    station: u16,
    pub(super) counts: Cleaning,
    warnings: Vec<String>,
    /// Names of fields that are not read.
    ignored: Vec<String>,
}

/// A cube that has points.
#[derive(Clone, Copy)]
struct Cell {
    /// The place of the point that is kept.
    slot: u32,
    /// The number of points that it was chosen from.
    count: u32,
}

#[derive(Default)]
struct Kept {
    positions: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    attributes: Attributes,
    /// Numbers of points that each was chosen from.
    counts: Vec<u32>,
}

impl Kept {
    fn len(&self) -> usize {
        self.positions.len()
    }

    fn push(&mut self, point: &RawPoint, station: u16) {
        let before = self.len();
        self.positions.push(point.position);
        add(&mut self.normals, before, point.normal.map(|n| n.map(f64::from)));
        add(&mut self.attributes.colours, before, point.colour);
        add(&mut self.attributes.intensities, before, point.intensity);
        self.attributes.stations.of_points.push(station);
        self.counts.push(1);
    }

    fn replace(&mut self, slot: usize, point: &RawPoint, station: u16) {
        self.positions[slot] = point.position;
        put(&mut self.normals, slot, point.normal.map(|n| n.map(f64::from)));
        put(&mut self.attributes.colours, slot, point.colour);
        put(&mut self.attributes.intensities, slot, point.intensity);
        self.attributes.stations.of_points[slot] = station;
    }

    fn copy_within(&mut self, from: usize, to: usize) {
        self.positions[to] = self.positions[from];
        move_within(&mut self.normals, from, to);
        move_within(&mut self.attributes.colours, from, to);
        move_within(&mut self.attributes.intensities, from, to);
        self.attributes.stations.of_points[to] = self.attributes.stations.of_points[from];
    }

    fn truncate(&mut self, count: usize) {
        self.positions.truncate(count);
        self.normals.truncate(count);
        self.attributes.colours.truncate(count);
        self.attributes.intensities.truncate(count);
        self.attributes.stations.of_points.truncate(count);
        self.counts.truncate(count);
    }
}

/// Adds a value to a list that has one for each point, or none at all so far.
fn add<T: Copy + Default>(values: &mut Vec<T>, before: usize, value: Option<T>) {
    if value.is_some() && values.is_empty() {
        values.resize(before, T::default());
    }
    if value.is_some() || !values.is_empty() {
        values.push(value.unwrap_or_default());
    }
}

fn put<T: Copy + Default>(values: &mut [T], slot: usize, value: Option<T>) {
    if let Some(place) = values.get_mut(slot) {
        *place = value.unwrap_or_default();
    }
}

fn move_within<T: Copy>(values: &mut [T], from: usize, to: usize) {
    if !values.is_empty() {
        values[to] = values[from];
    }
}

impl<'a> Reservoir<'a> {
    /// `given` is the user's unit in millimetres, `voxel` the edge of cubes in millimetres.
    pub(super) fn new(
        given: Option<f64>,
        crop: Option<Bounds>,
        voxel: Option<f64>,
        most: usize,
        progress: &'a dyn Progress,
    ) -> Self {
        Self {
            progress,
            given,
            stated: None,
            is_usual: false,
            crop: crop.map(|bounds| Box::new(Sides::new(bounds))),
            edge: voxel,
            most,
            cells: HashMap::default(),
            origin: None,
            kept: Kept::default(),
            scans: Vec::new(),
            station: Stations::UNKNOWN,
            counts: Cleaning::default(),
            warnings: Vec::new(),
            ignored: Vec::new(),
        }
    }

    fn unit_in_millimetres(&self) -> f64 {
        self.given.or(self.stated).unwrap_or(1.0)
    }

    /// The cube of a point; none where it is too far away for its cubes to be numbered, and then it has one of its own.
    fn cell(&self, position: [f64; 3], edge: f64) -> Option<[i32; 3]> {
        let offset = (DVec3::from(position) - self.origin.unwrap_or_default()) * self.unit_in_millimetres();
        let cube = (offset / edge).floor();
        (cube.abs().max_element() < f64::from(i32::MAX)).then(|| cube.as_ivec3().to_array())
    }

    fn keep(&mut self, point: &RawPoint) {
        let Some(edge) = self.edge else {
            self.kept.push(point, self.station);
            if self.kept.len() >= self.most {
                self.begin_to_thin();
            }
            return;
        };
        self.origin.get_or_insert(DVec3::from(point.position));
        let key = self.cell(point.position, edge);
        let slot = self.kept.len() as u32;
        let mut alone = Cell { slot, count: 0 };
        let cell = match key {
            Some(key) => self.cells.entry(key).or_insert(alone),
            None => &mut alone,
        };
        cell.count = cell.count.saturating_add(1);
        if cell.count == 1 {
            self.kept.push(point, self.station);
            if self.kept.len() >= self.most {
                self.coarsen(2.0 * edge);
            }
            return;
        }
        let (slot, count) = (cell.slot as usize, cell.count);
        self.kept.counts[slot] = count;
        self.counts.thinned += 1;
        if mixed(self.counts.points).is_multiple_of(count.into()) {
            self.kept.replace(slot, point, self.station);
        }
    }

    /// More points come than can be kept.
    fn begin_to_thin(&mut self) {
        let bounds: Bounds = self.kept.positions.iter().map(|p| DVec3::from(*p)).collect();
        let size = bounds.diagonal() * self.unit_in_millimetres();
        self.origin = self.kept.positions.first().map(|p| DVec3::from(*p));
        // All in one place: any cube holds it.
        let edge = if size > 0.0 { size / (self.most as f64).sqrt() / FINER } else { 1.0 };
        self.coarsen(edge);
    }

    /// Sorts the points into cubes of an edge, or of twice that and so on, until no more than half of the most are
    /// kept.
    fn coarsen(&mut self, mut edge: f64) {
        loop {
            self.sort_into(edge);
            if self.kept.len() <= self.most / 2 {
                break;
            }
            edge *= 2.0;
        }
        self.edge = Some(edge);
    }

    fn sort_into(&mut self, edge: f64) {
        let mut cells: HashMap<[i32; 3], Cell, RandomState> = HashMap::default();
        let mut next = 0;
        for from in 0..self.kept.len() {
            let key = self.cell(self.kept.positions[from], edge);
            let count = self.kept.counts[from];
            let mut alone = Cell { slot: next, count: 0 };
            let cell = match key {
                Some(key) => cells.entry(key).or_insert(alone),
                None => &mut alone,
            };
            cell.count = cell.count.saturating_add(count);
            let slot = cell.slot as usize;
            let is_first = cell.slot == next;
            if is_first {
                next += 1;
            } else {
                self.counts.thinned += 1;
            }
            let lot = mixed(self.counts.points ^ (from as u64) << 32) % u64::from(cell.count);
            if is_first || lot < u64::from(count) {
                self.kept.copy_within(from, slot);
            }
            self.kept.counts[slot] = cell.count;
        }
        self.kept.truncate(next as usize);
        self.cells = cells;
    }

    /// The points that were kept, in the file's unit.
    pub(super) fn finish(mut self) -> (RawMesh, Cleaning, Vec<Counted>) {
        let Kept { positions, normals, mut attributes, .. } = self.kept;
        if attributes.stations.places.is_empty() {
            attributes.stations.of_points = Vec::new();
        }
        self.counts.voxel = self.edge.filter(|_| self.counts.thinned > 0);
        let raw = RawMesh {
            positions,
            normals,
            attributes,
            unit: self.stated,
            is_usual_unit: self.is_usual,
            sides: self.crop,
            warnings: self.warnings,
            ignored: self.ignored,
            ..RawMesh::default()
        };
        (raw, self.counts, self.scans)
    }
}

impl Points for Reservoir<'_> {
    fn unit(&mut self, millimetres: f64) {
        self.stated = Some(millimetres);
    }

    fn usual_unit(&mut self, millimetres: f64) {
        (self.stated, self.is_usual) = (Some(millimetres), true);
    }

    fn begin(&mut self, entry: Entry) {
        let places = &mut self.kept.attributes.stations.places;
        self.station = Stations::UNKNOWN;
        if let Some(station) = entry.station
            && places.len() < usize::from(Stations::UNKNOWN)
        {
            self.station = places.len() as u16;
            places.push(station);
        }
        self.scans.push(Counted { entry, points: 0 });
    }

    fn take(&mut self, points: &[RawPoint]) -> Result<(), ScanFault> {
        if self.progress.cancelled() {
            return Err(ScanFault::Cancelled);
        }
        if self.scans.is_empty() {
            self.scans.push(Counted::default());
        }
        let scale = self.unit_in_millimetres();
        for point in points {
            if point.position.iter().any(|c| c.is_nan()) {
                self.counts.empty += 1;
                continue;
            }
            self.counts.points += 1;
            if let Some(scan) = self.scans.last_mut() {
                scan.points += 1;
            }
            let at = DVec3::from(point.position) * scale;
            if self.crop.as_mut().is_some_and(|sides| !sides.take(at)) {
                self.counts.cropped += 1;
                continue;
            }
            self.keep(point);
        }
        Ok(())
    }

    fn leave_out(&mut self, why: NoPoint, count: u64) {
        match why {
            NoPoint::Marked => self.counts.marked += count,
            NoPoint::Empty => self.counts.empty += count,
        }
    }

    fn ignore(&mut self, field: &str) {
        if !self.ignored.iter().any(|known| known == field) {
            self.ignored.push(field.to_owned());
        }
    }

    fn progress(&mut self, share: f64) {
        let detail = format!("{:.1} million points", self.counts.points as f64 / 1e6);
        self.progress.report("reading the scan", share, &detail);
    }

    fn warn(&mut self, sentence: String) {
        self.warnings.push(sentence);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;

    /// Points on a line with a spread across it, in order of the number that their intensity has.
    fn points(count: usize) -> Vec<RawPoint> {
        let point = |i: usize| RawPoint {
            position: [(mixed(i as u64) % 1000) as f64 * 0.01, 0.0, (mixed(7 + i as u64) % 100) as f64 * 1e-4],
            intensity: Some(i as f32),
            ..RawPoint::default()
        };
        (0..count).map(point).collect()
    }

    fn read(points: &[RawPoint], voxel: Option<f64>, most: usize) -> (RawMesh, Cleaning) {
        let mut reservoir = Reservoir::new(None, None, voxel, most, &Silent);
        points.chunks(100).for_each(|batch| reservoir.take(batch).unwrap());
        let (raw, counts, _) = reservoir.finish();
        (raw, counts)
    }

    #[test]
    fn every_point_of_a_cube_is_as_likely_as_the_others() {
        // Ten cubes of 400 points each: which of them is kept, by the tenth of the order in which they come.
        let mut tenths = [0; 10];
        for run in 0..100 {
            let mut points = points(4000);
            points.iter_mut().for_each(|p| p.position = [p.position[0] + f64::from(run) * 1e-6, 0.0, 0.0]);
            points.rotate_left(run as usize * 20 % 4000);
            points.iter_mut().enumerate().for_each(|(i, p)| p.intensity = Some(i as f32));
            // Lots go by the number of a point: others come first, elsewhere, so that every run draws other ones.
            let elsewhere = RawPoint { position: [1000.0; 3], intensity: Some(-1.0), ..RawPoint::default() };
            let all = [vec![elsewhere; 1 + 4001 * run as usize], points].concat();
            let (raw, counts) = read(&all, Some(1.0), usize::MAX);
            assert!((11..=13).contains(&raw.positions.len()));
            assert_eq!(counts.thinned as usize + raw.positions.len(), all.len());
            let chosen = raw.attributes.intensities.iter().filter(|i| **i >= 0.0);
            chosen.for_each(|i| tenths[*i as usize / 400] += 1);
        }
        let expected = f64::from(tenths.iter().sum::<u32>()) / 10.0;
        // Chi-squared of nine degrees of freedom: above 30 in one run of 2,300.
        let squared: f64 = tenths.iter().map(|n| (f64::from(*n) - expected).powi(2) / expected).sum();
        assert!(squared < 30.0, "{tenths:?}");
    }

    #[test]
    fn cubes_too_small_to_be_numbered_hold_one_point_each() {
        let (raw, counts) = read(&points(500), Some(1e-12), usize::MAX);
        let (all, _) = read(&points(500), None, usize::MAX);
        // But the few points around the first one, from which cubes are counted, and its doubles.
        assert!(raw.positions.len() + counts.thinned as usize == 500 && counts.thinned < 20, "{}", counts.thinned);
        assert_eq!(all.positions.len(), 500);
    }

    #[test]
    fn a_cloud_that_is_too_large_is_thinned_to_less_than_the_most() {
        let points = points(50_000);
        let (raw, counts) = read(&points, None, 500);
        assert!((100..=500).contains(&raw.positions.len()), "{}", raw.positions.len());
        assert_eq!(counts.thinned as usize + raw.positions.len(), 50_000);
        assert!(counts.voxel.is_some_and(|edge| edge > 0.0));
        // Real points, with what belongs to them.
        for (position, i) in raw.positions.iter().zip(&raw.attributes.intensities) {
            assert_eq!(*position, points[*i as usize].position);
        }
        let (all, counts) = read(&points[..499], None, 500);
        assert_eq!((all.positions.len(), counts.thinned, counts.voxel), (499, 0, None));
    }

    #[test]
    fn what_is_no_point_is_counted() {
        let crop = Bounds { low: DVec3::ZERO, high: DVec3::splat(500.0) };
        let mut reservoir = Reservoir::new(None, Some(crop), None, 100, &Silent);
        reservoir.unit(1000.0);
        let at = |x: f64| RawPoint { position: [x, 0.1, 0.2], ..RawPoint::default() };
        reservoir.begin(Entry::default());
        reservoir.take(&[at(0.1), at(f64::NAN), at(0.6), at(0.5)]).unwrap();
        reservoir.leave_out(NoPoint::Marked, 3);
        let (raw, counts, scans) = reservoir.finish();
        assert_eq!(raw.positions, [[0.1, 0.1, 0.2], [0.5, 0.1, 0.2]]);
        assert_eq!((counts.points, counts.empty, counts.cropped, counts.marked), (3, 1, 1, 3));
        assert_eq!((scans.len(), scans[0].points, raw.unit), (1, 3, Some(1000.0)));
    }
}
