//! A terrestrial scanner: from each of some stations a grid of azimuth and elevation, the first echo of every ray.

use super::error::SimulationError;
use super::holes::Holes;
use super::instrument::{Instrument, Measured};
use super::probe::probe;
use super::scanner::Scanner;
use super::scene::Scene;
use super::truth::{Frame, Gathered, VirtualScan};
use super::view::View;
use super::{DROPOUT_STREAM, MOST_RAYS, MOST_RAYS_A_VIEW, Object, STATION_STREAM};
use crate::mesh::Bounds;
use crate::progress::Progress;
use glam::DVec3;
use rand::RngExt;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Distance of the stations that gmlc chooses from the object's centre, in its radii.
const DISTANCE: f64 = 3.0;
/// Their elevations above the object's centre, by turns. Radians.
const ELEVATIONS: [f64; 2] = [0.25, 0.7];
/// The lowest ray of a station among what it scans: below it stands its tripod. Radians.
const LOWEST: f64 = -60.0 / 180.0 * PI;
/// Columns that are measured at a time.
const BLOCK: usize = 64;

/// A station and the grid of its rays.
struct Panorama {
    frame: Frame,
    /// The first azimuth and elevation, in its own frame.
    first: [f64; 2],
    columns: usize,
    rows: usize,
    /// Angle between neighbours. Radians.
    step: f64,
}

pub(super) fn scan(
    object: &Object<'_>,
    scene: &Scene<'_>,
    scanner: &Scanner,
    progress: &dyn Progress,
) -> Result<VirtualScan, SimulationError> {
    let eyes: Vec<DVec3> = eyes(object, scanner).into_iter().filter(|eye| scene.has_room_at(*eye)).collect();
    let none = SimulationError::NothingInSight { stations: eyes.len() };
    let views: Vec<View> = eyes.iter().map(|eye| View::from(*eye, object.centre, object.radius)).collect();
    let seen = probe(object, &views, scene, scanner).map_err(|error| match error {
        SimulationError::NothingSeen { .. } => none,
        other => other,
    })?;
    let mut random = scanner.random(STATION_STREAM);
    let panorama = |eye: &DVec3| Panorama::new(*eye, random.random_range(0.0..TAU), object, scene, scanner);
    let stations: Vec<Panorama> = eyes.iter().map(panorama).collect();
    require_few_rays(&stations, object, scanner)?;
    let instrument = Instrument::new(scanner, scene, Holes::on(object.mesh, scanner));
    let mut cloud = Gathered::default();
    for (number, station) in stations.iter().enumerate() {
        let mut cells = Vec::with_capacity(station.columns * station.rows);
        for from in (0..station.columns).step_by(BLOCK) {
            if progress.cancelled() {
                return Err(SimulationError::Cancelled);
            }
            let share = (number as f64 + from as f64 / station.columns as f64) / stations.len() as f64;
            progress.report("scanning", share, &format!("station {}", number + 1));
            let columns: Vec<Measured> = (from..station.columns.min(from + BLOCK))
                .into_par_iter()
                .map(|column| station.measure(column, number, &instrument))
                .collect();
            for column in columns {
                cloud.dropouts += column.dropouts;
                cloud.add_cells(&mut cells, column.samples.iter());
            }
            cloud.require_room()?;
        }
        cloud.end_station(station.frame, station.columns, cells);
    }
    cloud.require_points(stations.len())?;
    Ok(cloud.finish(scanner, scanner.spacing, seen.coverage))
}

/// Where the scanner stands.
fn eyes(object: &Object<'_>, scanner: &Scanner) -> Vec<DVec3> {
    if !scanner.places.is_empty() {
        return scanner.places.iter().map(|place| DVec3::from_array(*place)).collect();
    }
    let eye = |i: usize| {
        let (y, x) = (TAU * i as f64 / scanner.stations as f64).sin_cos();
        let (up, level) = ELEVATIONS[i % ELEVATIONS.len()].sin_cos();
        object.centre + DISTANCE * object.radius * DVec3::new(level * x, level * y, up)
    };
    (0..scanner.stations).map(eye).collect()
}

/// Refuses grids that would take too long.
fn require_few_rays(stations: &[Panorama], object: &Object<'_>, scanner: &Scanner) -> Result<(), SimulationError> {
    let most = MOST_RAYS_A_VIEW.min(MOST_RAYS / stations.len().max(1) as f64);
    let rays = stations.iter().map(|station| station.columns as f64 * station.rows as f64).fold(0.0, f64::max);
    if rays > most {
        let size = 2.0 * object.radius;
        return Err(SimulationError::TooFine { spacing: scanner.spacing, size, rays, limit: most });
    }
    Ok(())
}

impl Panorama {
    /// The grid of a station that was set up towards any azimuth, `heading`: the window that the scene is in; a station
    /// in the midst of it looks all around.
    fn new(eye: DVec3, heading: f64, object: &Object<'_>, scene: &Scene<'_>, scanner: &Scanner) -> Self {
        let bounds: Bounds = scene.bounds();
        let (centre, radius) = (bounds.centre(), bounds.diagonal() / 2.0);
        let towards = centre - eye;
        let distance = towards.length();
        let level = towards.truncate().length();
        let half = (radius / distance).min(1.0).asin();
        let azimuth = towards.y.atan2(towards.x) - heading;
        let elevation = towards.z.atan2(level);
        let is_among = radius >= 0.999 * distance;
        // As seen from above, the sphere around the scene may hold the station.
        let width = if is_among || radius >= level { PI } else { (radius / level).asin() };
        let [low, high] = if is_among {
            [LOWEST, FRAC_PI_2]
        } else {
            [(elevation - half).max(-FRAC_PI_2), (elevation + half).min(FRAC_PI_2)]
        };
        let step = scanner.spacing / (object.centre - eye).length().max(object.radius);
        let count = |range: f64| (range / step).floor().min(1e12) as usize + 1;
        let (y, x) = heading.sin_cos();
        let axes = [DVec3::new(x, y, 0.0), DVec3::new(-y, x, 0.0), DVec3::Z];
        Self {
            frame: Frame { eye, axes },
            first: [azimuth - width, low],
            columns: if width < PI { count(2.0 * width) } else { (TAU / step).floor().clamp(1.0, 1e12) as usize },
            rows: count(high - low),
            step,
        }
    }

    fn measure(&self, column: usize, number: usize, instrument: &Instrument<'_>) -> Measured {
        let mut random = instrument.scanner.random(DROPOUT_STREAM + ((number as u64) << 32) + column as u64);
        let azimuth = self.first[0] + column as f64 * self.step;
        let (sin, cos) = azimuth.sin_cos();
        let [x, y, z] = self.frame.axes;
        let ahead = cos * x + sin * y;
        let direction = |row: usize| {
            let (up, level) = (self.first[1] + row as f64 * self.step).sin_cos();
            (level * ahead + up * z).normalize()
        };
        let directions: Vec<DVec3> = (0..self.rows).map(direction).collect();
        instrument.measure(self.frame.eye, &directions, number as u64, &mut random)
    }
}
