//! Structured light: range images from views all around.

use super::error::SimulationError;
use super::holes::Holes;
use super::instrument::Instrument;
use super::layer::Layer;
use super::probe::probe;
use super::scanner::Scanner;
use super::scene::Scene;
use super::truth::{Gathered, VirtualScan};
use super::view::View;
use super::{HOLE_STREAM, Object, few_enough};
use crate::progress::Progress;
use glam::DVec3;
use rand::RngExt;

pub(super) fn scan(
    object: &Object<'_>,
    scene: &Scene<'_>,
    scanner: &Scanner,
    progress: &dyn Progress,
) -> Result<VirtualScan, SimulationError> {
    let views = View::around(object.centre, object.radius, scanner.views);
    let seen = probe(object, &views, scene, scanner)?;
    few_enough(&views[0], scanner, seen.pitch, 2.0 * object.radius)?;
    // Of the merged layer, holes take whole triangles.
    let holes = if scanner.cloud { Holes::on(object.mesh, scanner) } else { Holes::default() };
    let instrument = Instrument::new(scanner, scene, holes);
    let (mut layer, mut cloud) = (Layer::default(), Gathered::default());
    let mut dropouts = 0;
    for (number, view) in views.iter().enumerate() {
        if progress.cancelled() {
            return Err(SimulationError::Cancelled);
        }
        progress.report("scanning", number as f64 / views.len() as f64, &format!("view {}", number + 1));
        if !scene.has_room_at(view.eye) {
            continue;
        }
        let image = view.scan(number, seen.pitch, &instrument);
        dropouts += image.dropouts;
        if scanner.cloud {
            let mut cells = Vec::with_capacity(image.samples.len());
            (0..image.width).for_each(|column| cloud.add_cells(&mut cells, image.column(column)));
            cloud.end_station(view.frame(), image.width, cells);
            cloud.require_room()?;
        } else {
            layer.add(&image, number, &views, scene, scanner.least_cosine());
        }
    }
    if scanner.cloud {
        cloud.require_points(views.len())?;
    } else {
        if layer.triangles.is_empty() {
            return Err(SimulationError::NothingSeen { views: views.len() });
        }
        punch_holes(&mut layer, scanner);
        if layer.triangles.is_empty() {
            return Err(SimulationError::NothingLeft { radius: scanner.hole_radius });
        }
        cloud = gathered(layer, &views);
    }
    cloud.dropouts = dropouts;
    Ok(cloud.finish(scanner, seen.pitch, seen.coverage))
}

/// The points of a layer, with their stations: views follow each other in it.
fn gathered(layer: Layer, views: &[View]) -> Gathered {
    let mut gathered = Gathered::default();
    let mut last = None;
    for (sample, view) in layer.samples.iter().zip(&layer.views) {
        if last != Some(*view) {
            last = Some(*view);
            gathered.stations.push(views[usize::from(*view)].frame());
        }
        gathered.add(sample);
        gathered.of_points.push(gathered.stations.len() as u16 - 1);
    }
    gathered.triangles = layer.triangles;
    gathered
}

/// Removes the triangles that lie around randomly chosen ones and face the same way: the other side of a thin wall
/// stays.
fn punch_holes(layer: &mut Layer, scanner: &Scanner) {
    let mut random = scanner.random(HOLE_STREAM);
    let holes: Vec<(DVec3, DVec3)> = (0..scanner.holes)
        .map(|_| layer.place(&layer.triangles[random.random_range(0..layer.triangles.len())]))
        .collect();
    if holes.is_empty() {
        return;
    }
    let places: Vec<(DVec3, DVec3)> = layer.triangles.iter().map(|triangle| layer.place(triangle)).collect();
    let inside = |&(point, normal): &(DVec3, DVec3)| {
        holes.iter().any(|hole| hole.0.distance(point) < scanner.hole_radius && hole.1.dot(normal) > 0.0)
    };
    let mut gone = places.iter().map(inside).collect::<Vec<_>>().into_iter();
    layer.retain(|_| gone.next() == Some(false));
}
