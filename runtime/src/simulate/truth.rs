//! A virtual scan and what is known of it.

use super::error::SimulationError;
use super::instrument::Sample;
use super::pose;
use super::scanner::Scanner;
use super::scene::Surface;
use super::{MOST_POINTS, POSE_STREAM};
use crate::export::scan::Grid;
use crate::mesh::TriangleMesh;
use crate::model::Motion;
use crate::scan::{Attributes, Station};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A scan and its truth.
#[derive(Clone, Debug)]
pub struct VirtualScan {
    /// Measured points and their triangles, facing the scanner, in the scanner's coordinates: the model moved by
    /// `truth.pose`. No normals; of a cloud no triangles.
    pub mesh: TriangleMesh,
    /// Intensities, and the stations where they are known: points of a station follow each other.
    pub attributes: Attributes,
    /// Of a cloud with stations, the points of each as the cells of its grid.
    pub grids: Vec<Grid>,
    /// Its truth.
    pub truth: Truth,
}

/// The truth of a virtual scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// The object's pose: a point p of the model was scanned at `rotation` p + `translation`.
    pub pose: Motion,
    /// The rotation as angles about x, then y, then z. Radians.
    pub euler: [f64; 3],
    /// The options.
    pub scanner: Scanner,
    /// Distance between rays at the object's centre. Millimetres.
    pub pitch: f64,
    /// Fraction of the model's area that a view sees (before dropouts and holes).
    pub coverage: f64,
    /// Points of the scan.
    pub points: usize,
    /// Triangles of the scan.
    pub triangles: usize,
    /// Outliers among the points.
    pub outliers: usize,
    /// Rays whose points were lost, over all views.
    pub dropouts: usize,
    /// Points between two surfaces that the beam met.
    #[serde(default)]
    pub mixed: usize,
    /// What the points belong to, by their numbers.
    #[serde(default)]
    pub surfaces: Surfaces,
    /// Where the scanner stood: a point p of its own frame lies at `rotation` p + `translation` in the scan's.
    #[serde(default)]
    pub stations: Vec<Motion>,
}

/// Numbers of points by what they belong to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Surfaces {
    /// Points of the object.
    pub object: usize,
    /// Points of the table.
    pub table: usize,
    /// Points of what stands beside the object.
    pub clutter: usize,
}

/// The frame of a station, before the pose: where it stands and the directions of its axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) eye: DVec3,
    pub(super) axes: [DVec3; 3],
}

/// A scan that grows, in the object's own coordinates.
#[derive(Default)]
pub(super) struct Gathered {
    pub(super) positions: Vec<[f64; 3]>,
    pub(super) intensities: Vec<f32>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) stations: Vec<Frame>,
    pub(super) of_points: Vec<u16>,
    pub(super) grids: Vec<Grid>,
    pub(super) surfaces: Surfaces,
    pub(super) outliers: usize,
    pub(super) dropouts: usize,
    pub(super) mixed: usize,
}

impl Gathered {
    pub(super) fn add(&mut self, sample: &Sample) {
        self.positions.push(sample.measured.to_array());
        self.intensities.push(sample.intensity);
        self.outliers += usize::from(sample.outlier);
        self.mixed += usize::from(sample.mixed);
        *self.surfaces.of(sample.surface) += 1;
    }

    /// Takes the cells of a station's grid, column by column, to the ones that were taken before.
    pub(super) fn add_cells<'s>(&mut self, cells: &mut Vec<u32>, samples: impl Iterator<Item = &'s Option<Sample>>) {
        cells.extend(samples.map(|sample| match sample {
            Some(sample) => {
                self.add(sample);
                self.positions.len() as u32 - 1
            }
            None => Grid::EMPTY,
        }));
    }

    /// Ends a station, whose points are the last; one that saw nothing is left out.
    pub(super) fn end_station(&mut self, frame: Frame, columns: usize, cells: Vec<u32>) {
        let number = self.stations.len() as u16;
        if self.of_points.len() == self.positions.len() {
            return;
        }
        self.of_points.resize(self.positions.len(), number);
        self.stations.push(frame);
        self.grids.push(Grid { columns, rows: cells.len() / columns.max(1), cells });
    }

    /// A scan without points is none.
    pub(super) fn require_points(&self, stations: usize) -> Result<(), SimulationError> {
        if self.positions.is_empty() { Err(SimulationError::NothingInSight { stations }) } else { Ok(()) }
    }

    pub(super) fn require_room(&self) -> Result<(), SimulationError> {
        let points = self.positions.len();
        if points > MOST_POINTS { Err(SimulationError::TooManyPoints { limit: MOST_POINTS }) } else { Ok(()) }
    }

    /// Puts everything into the pose.
    pub(super) fn finish(self, scanner: &Scanner, pitch: f64, coverage: f64) -> VirtualScan {
        let pose = if scanner.random_pose {
            pose::random(&mut scanner.random(POSE_STREAM), scanner.reach)
        } else {
            Motion::IDENTITY
        };
        let mut positions = self.positions;
        positions.iter_mut().for_each(|p| *p = pose.point(*p));
        let places: Vec<Station> = self.stations.iter().map(|frame| frame.moved(&pose)).collect();
        let motion = |station: &Station| Motion { rotation: station.rotation, translation: station.place };
        let truth = Truth {
            pose,
            euler: pose::euler(&pose),
            scanner: scanner.clone(),
            pitch,
            coverage,
            points: positions.len(),
            triangles: self.triangles.len(),
            outliers: self.outliers,
            dropouts: self.dropouts,
            mixed: self.mixed,
            surfaces: self.surfaces,
            stations: places.iter().map(motion).collect(),
        };
        let stations = crate::scan::Stations { places, of_points: self.of_points };
        let attributes = Attributes { intensities: self.intensities, stations, ..Attributes::default() };
        let mesh = TriangleMesh { positions, triangles: self.triangles, ..TriangleMesh::default() };
        VirtualScan { mesh, attributes, grids: self.grids, truth }
    }
}

impl Surfaces {
    pub(super) fn of(&mut self, surface: Surface) -> &mut usize {
        match surface {
            Surface::Object => &mut self.object,
            Surface::Table => &mut self.table,
            Surface::Clutter => &mut self.clutter,
        }
    }
}

impl Frame {
    /// The station after the pose.
    fn moved(&self, pose: &Motion) -> Station {
        let columns = self.axes.map(|axis| pose.direction(axis.to_array()));
        let rotation = [0, 1, 2].map(|row| columns.map(|column| column[row]));
        Station { place: pose.point(self.eye.to_array()), rotation }
    }
}
