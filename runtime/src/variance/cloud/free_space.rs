//! Where a cloud shows empty space: the scanner saw past the place, to points behind it.

use crate::robust::median;
use crate::scan::{EmptySpace, Neighbours, Scan};
use crate::variance::Deviations;
use crate::variance::contradicted::where_empty;
use glam::DVec3;

/// Lines of sight that must pass a place, all of them.
const LINES: usize = 4;

/// They pass it no farther aside than so much of the distance from the scan within which nothing is said.
const ASIDE: f64 = 0.75;

/// A place is looked at from so far behind the surface, in units of that distance: along a wall that it does not see a
/// scanner looks past the front of it.
const BEHIND: f64 = 1.0;

/// What the scanner saw from one of its positions.
struct Sights {
    station: DVec3,
    /// Unit directions to the points.
    directions: Vec<[f64; 3]>,
    /// How far off they are. Millimetres.
    ranges: Vec<f64>,
}

/// By texel, whether it has no distance although the scanner saw past it; nothing for a cloud whose file does not tell
/// where the scanner stood. `spacing` is how far apart the points are. Millimetres.
pub(in crate::variance) fn contradicted(deviations: &Deviations, scan: &Scan, spacing: &[f64]) -> Vec<bool> {
    let stations = &scan.attributes.stations;
    let mut sights: Vec<Sights> = stations
        .places
        .iter()
        .map(|s| Sights { station: s.place.into(), directions: Vec::new(), ranges: Vec::new() })
        .collect();
    for (station, position) in stations.of_points.iter().zip(&scan.mesh.positions) {
        let Some(sights) = sights.get_mut(usize::from(*station)) else { continue };
        let offset = DVec3::from(*position) - sights.station;
        if let Some(direction) = offset.try_normalize() {
            sights.directions.push(direction.into());
            sights.ranges.push(offset.length());
        }
    }
    sights.retain(|sights| sights.ranges.len() >= LINES);
    if sights.is_empty() {
        return Vec::new();
    }
    let trees: Vec<Neighbours> = sights.iter().map(|sights| Neighbours::new(&sights.directions)).collect();
    let points = Neighbours::new(&scan.mesh.positions);
    let usual = median(&mut spacing.to_vec()).unwrap_or(0.0);
    let near = EmptySpace::nearness(scan.noise, 2.0 * usual);
    let is_away = |place: DVec3| {
        let closest = points.nearest(place.into(), 1);
        closest.first().is_none_or(|i| DVec3::from(scan.mesh.positions[*i as usize]).distance(place) > near)
    };
    where_empty(deviations, |place, outward| {
        let from = place - BEHIND * near * outward;
        let sees_past = |(sights, tree): (&Sights, &Neighbours)| sights.see_past(tree, from, near);
        is_away(place) && sights.iter().zip(&trees).any(sees_past)
    })
}

impl Sights {
    /// Whether lines of sight pass a place, and end farther off than `near` behind it. Millimetres.
    fn see_past(&self, tree: &Neighbours, place: DVec3, near: f64) -> bool {
        let offset = place - self.station;
        let range = offset.length();
        let Some(direction) = offset.try_normalize() else { return false };
        tree.nearest(direction.into(), LINES).iter().all(|i| {
            let i = *i as usize;
            let aside = range * DVec3::from(self.directions[i]).distance(direction);
            aside <= ASIDE * near && self.ranges[i] > range + near
        })
    }
}
