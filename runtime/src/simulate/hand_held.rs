//! A scanner that is led around the object by hand: line profiles from a helix, while the hand sways to and fro. The
//! points of all places are one cloud.

use super::error::SimulationError;
use super::holes::Holes;
use super::instrument::{Instrument, Measured};
use super::probe::probe;
use super::scanner::Scanner;
use super::scene::Scene;
use super::truth::{Gathered, VirtualScan};
use super::view::View;
use super::{DROPOUT_STREAM, MOST_POINTS, MOST_RAYS, Object};
use crate::progress::Progress;
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Distance of the path from the object's centre, in its radii.
const DISTANCE: f64 = 2.0;
/// Turns of the helix.
const TURNS: f64 = 9.0;
/// How often the hand sways to and fro along the whole path: no multiple of the turns.
const SWAYS: f64 = 67.0;
/// How high and low the path goes, of its distance from the centre.
const HIGHEST: f64 = 0.95;
/// Places of the path from which coverage is found.
const PLACES: usize = 60;
/// Profiles, and rays of each, of the trial that tells how many profiles there must be.
const TRIAL: [usize; 2] = [500, 60];
/// Profiles that are measured at a time.
const BLOCK: usize = 512;

/// The path, as long as 1.
struct Path {
    centre: DVec3,
    radius: f64,
    /// Heights of its ends, of its distance from the centre.
    heights: [f64; 2],
}

/// The rays of a profile.
struct Profile {
    eye: DVec3,
    directions: Vec<DVec3>,
}

pub(super) fn scan(
    object: &Object<'_>,
    scene: &Scene<'_>,
    scanner: &Scanner,
    progress: &dyn Progress,
) -> Result<VirtualScan, SimulationError> {
    let path = Path::around(object, scene);
    let eyes = (0..PLACES).map(|i| path.eye((i as f64 + 0.5) / PLACES as f64));
    let views: Vec<View> = eyes.map(|eye| View::from(eye, object.centre, object.radius)).collect();
    let none = SimulationError::NothingInSight { stations: PLACES };
    let seen = probe(object, &views, scene, scanner).map_err(|error| match error {
        SimulationError::NothingSeen { .. } => none.clone(),
        other => other,
    })?;
    let rays = (path.width() / scanner.spacing).floor() + 1.0;
    let wanted = seen.coverage * object.mesh.area() / scanner.spacing.powi(2);
    let share = path.share_of_hits(scene);
    if share == 0.0 {
        return Err(none);
    }
    let count = (wanted / (share * rays)).ceil().max(1.0);
    let limit = MOST_RAYS.min(MOST_POINTS as f64 / share);
    if count * rays > limit {
        let (spacing, size) = (scanner.spacing, 2.0 * object.radius);
        return Err(SimulationError::TooFine { spacing, size, rays: count * rays, limit });
    }
    let (rays, count) = (rays as usize, count as usize);
    let instrument = Instrument::new(scanner, scene, Holes::on(object.mesh, scanner));
    let mut cloud = Gathered::default();
    for from in (0..count).step_by(BLOCK) {
        if progress.cancelled() {
            return Err(SimulationError::Cancelled);
        }
        progress.report("scanning", from as f64 / count as f64, "along the path");
        let profiles: Vec<Measured> = (from..count.min(from + BLOCK))
            .into_par_iter()
            .map(|number| {
                let mut random = scanner.random(DROPOUT_STREAM + number as u64);
                let Profile { eye, directions } = path.profile((number as f64 + 0.5) / count as f64, rays);
                instrument.measure(eye, &directions, number as u64, &mut random)
            })
            .collect();
        for profile in profiles {
            cloud.dropouts += profile.dropouts;
            profile.samples.iter().flatten().for_each(|sample| cloud.add(sample));
        }
        cloud.require_room()?;
    }
    cloud.require_points(count)?;
    Ok(cloud.finish(scanner, scanner.spacing, seen.coverage))
}

impl Path {
    /// Above the table, if there is one.
    fn around(object: &Object<'_>, scene: &Scene<'_>) -> Self {
        let (centre, radius) = (object.centre, object.radius);
        let lowest = scene.floor().map_or(-HIGHEST, |floor| (floor - centre.z) / (DISTANCE * radius) + 0.1);
        Self { centre, radius, heights: [HIGHEST, lowest.max(-HIGHEST)] }
    }

    /// The direction from the centre to the place at t, from 0 to 1.
    fn outward(&self, t: f64) -> DVec3 {
        let [from, to] = self.heights;
        let z = from + t * (to - from);
        let (y, x) = (TAU * TURNS * t).sin_cos();
        DVec3::new(x, y, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z
    }

    fn eye(&self, t: f64) -> DVec3 {
        self.centre + DISTANCE * self.radius * self.outward(t)
    }

    /// Width of the silhouette of the object's sphere in the plane through its centre.
    fn width(&self) -> f64 {
        2.0 * self.radius / (1.0 - DISTANCE.powi(-2)).sqrt()
    }

    /// The line across the path, beside the object's centre by as much as the hand sways.
    fn profile(&self, t: f64, rays: usize) -> Profile {
        let (outward, eye) = (self.outward(t), self.eye(t));
        let along = DVec3::Z.cross(outward).normalize_or(DVec3::X);
        let across = outward.cross(along);
        let phase = (SWAYS * t).fract();
        let sway = self.width() * ((2.0 * phase - 1.0).abs() - 0.5);
        let middle = self.centre + sway * along - eye;
        let step = self.width() / rays as f64;
        let at = |i: usize| (i as f64 + 0.5) * step - 0.5 * self.width();
        Profile { eye, directions: (0..rays).map(|i| (middle + at(i) * across).normalize()).collect() }
    }

    /// The share of the rays that meet the object.
    fn share_of_hits(&self, scene: &Scene<'_>) -> f64 {
        let [count, rays] = TRIAL;
        let hits = |i: usize| {
            let Profile { eye, directions } = self.profile((i as f64 + 0.5) / count as f64, rays);
            directions.iter().filter(|direction| scene.meets_object(eye, **direction)).count()
        };
        (0..count).into_par_iter().map(hits).sum::<usize>() as f64 / (count * rays) as f64
    }
}
