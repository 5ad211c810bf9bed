//! Whether points can have been seen from where a file says that the scanner stood. A cloud that was put together of
//! several scans, or made of a model, may have a place all the same: from there half of a closed object's points lie
//! behind the others.

use super::attributes::Stations;
use super::neighbours::Neighbours;
use crate::mesh::{Bounds, TriangleMesh};
use glam::DVec3;
use gml_compiler::number::plain;
use rayon::prelude::*;

/// Of a station with fewer points nothing is said.
const FEWEST: usize = 200;
/// Points of a station among which neighbours by direction are sought, and those for which they are.
const POINTS: usize = 100_000;
const JUDGED: usize = 2000;
/// The neighbours by direction that may hide a point.
const NEIGHBOURS: usize = 6;
/// A point is behind another one whose range is shorter by more than so many times the distance of the two rays there
/// (a surface that both are on is inclined by 76 degrees), ...
const STEEP: f64 = 4.0;
/// ... by more than this share of the size of all (which no noise is), ...
const DEEP: f64 = 0.05;
/// ... and which is off the other's tangential plane by more than this share of their distance: the points of a floor
/// that stretches away are on it.
const OFF_PLANE: f64 = 0.3;
/// The share of hidden points from which a station is none. Beside the edges of what stands in front there are 1 to
/// 10 % of them; of closed objects that are seen from all sides it is 40 to 50 %.
const HIDDEN: f64 = 0.3;

/// Scanners hardly see a surface under less than 2 degrees (the cosine of the incidence), ...
const GRAZING: f64 = 0.035;
/// ... so that a place from which this share of the points would be seen so is none: it lies in a face, as the origin
/// of a model's own frame does. A floor that is seen from 1.7 m above has such points 50 m away only.
const GRAZED: f64 = 0.15;

/// Takes away stations that cannot have seen their points, which then have none. `normals` of the mesh need no signs.
/// Returns sentences on them.
pub(super) fn take_away_impossible(mesh: &TriangleMesh, stations: &mut Stations, path: &str) -> Vec<String> {
    if !mesh.triangles.is_empty() || stations.of_points.is_empty() {
        return Vec::new();
    }
    let mut by_station: Vec<Vec<u32>> = vec![Vec::new(); stations.places.len()];
    for (i, station) in (0..).zip(&stations.of_points) {
        if let Some(of_station) = by_station.get_mut(usize::from(*station)) {
            of_station.push(i);
        }
    }
    let mut sentences = Vec::new();
    for (station, points) in by_station.into_iter().enumerate() {
        let place = stations.places[station].place;
        if points.len() < FEWEST {
            continue;
        }
        let hidden = hidden_share(mesh, place.into(), &points);
        let grazed = grazed_share(mesh, place.into(), &points);
        let why = if hidden > HIDDEN {
            Some(format!("{:.0} % lie behind others from there", 100.0 * hidden))
        } else {
            (grazed > GRAZED)
                .then(|| format!("{:.0} % would be seen under less than 2 degrees from there", 100.0 * grazed))
        };
        if let Some(why) = why {
            points.iter().for_each(|i| stations.of_points[*i as usize] = Stations::UNKNOWN);
            let at = place.map(|c| format!("{c:.1}").parse().map_or_else(|_| plain(c), plain)).join(", ");
            sentences.push(format!(
                "`{path}`: the scanner cannot have stood at ({at}) mm, as the file says: of the points that belong to it {why}; the place is not used"
            ));
        }
    }
    sentences
}

/// The share of some points that lie behind others, as seen from a place.
fn hidden_share(mesh: &TriangleMesh, place: DVec3, points: &[u32]) -> f64 {
    let every = points.len().div_ceil(POINTS).max(1);
    let all: Vec<u32> = points.iter().copied().step_by(every).collect();
    let at = |i: u32| DVec3::from(mesh.positions[i as usize]) - place;
    let least = DEEP * all.iter().map(|i| at(*i)).collect::<Bounds>().diagonal();
    let directions: Vec<[f64; 3]> = all.iter().map(|i| at(*i).normalize_or_zero().into()).collect();
    let tree = Neighbours::new(&directions);
    let is_behind = |own: usize, other: usize| {
        let (p, q) = (at(all[own]), at(all[other]));
        let (range, gap) = (q.length(), p.length() - q.length());
        let apart = DVec3::from(directions[own]).distance(directions[other].into()) * range;
        let normal = mesh.normals.get(all[other] as usize).map_or(DVec3::ZERO, |n| DVec3::from(*n));
        gap > least.max(STEEP * apart) && normal.dot(p - q).abs() > OFF_PLANE * p.distance(q)
    };
    let judged: Vec<usize> = (0..all.len()).step_by(all.len().div_ceil(JUDGED).max(1)).collect();
    let is_hidden = |own: &&usize| {
        let near = tree.nearest(directions[**own], NEIGHBOURS + 1);
        near.into_iter().any(|other| other as usize != **own && is_behind(**own, other as usize))
    };
    judged.par_iter().filter(is_hidden).count() as f64 / judged.len() as f64
}

/// The share of some points whose surface would be seen from a place at hardly any angle.
fn grazed_share(mesh: &TriangleMesh, place: DVec3, points: &[u32]) -> f64 {
    let is_grazed = |i: &&u32| {
        let ray = (DVec3::from(mesh.positions[**i as usize]) - place).normalize_or_zero();
        mesh.normals.get(**i as usize).is_some_and(|normal| ray.dot(DVec3::from(*normal)).abs() < GRAZING)
    };
    let judged: Vec<u32> = points.iter().copied().step_by(points.len().div_ceil(JUDGED).max(1)).collect();
    judged.iter().filter(is_grazed).count() as f64 / judged.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::attributes::Station;
    use crate::scan::normals;
    use crate::scan::thinned::mixed;

    /// Points on a sphere of radius 40, those that face a place only, or all; a wall stands behind it.
    fn sphere(place: DVec3, all: bool) -> TriangleMesh {
        let unit = |i: u64| (mixed(i) % 100_000) as f64 / 50_000.0 - 1.0;
        let on = |i: u64| DVec3::new(unit(3 * i), unit(3 * i + 1), unit(3 * i + 2)).normalize_or_zero();
        let faces = |n: &DVec3| all || n.dot(place - 40.0 * *n) > 0.0;
        let sphere = (0..4000).map(on).filter(faces).map(|n| 40.0 * n);
        let wall = (0..1000).map(|i| DVec3::new(-100.0, 150.0 * unit(7 * i), 150.0 * unit(7 * i + 5)));
        let is_seen = |p: &DVec3| {
            let d = (*p - place).normalize();
            place.distance_squared(DVec3::ZERO) - place.dot(d).powi(2) > 1600.0
        };
        let positions = sphere.chain(wall.filter(is_seen)).map(Into::into).collect();
        let mut mesh = TriangleMesh { positions, ..TriangleMesh::default() };
        mesh.normals = normals::compute(&mesh);
        mesh
    }

    #[test]
    fn a_place_from_which_half_of_the_points_are_hidden_is_none() {
        let place = DVec3::new(300.0, 20.0, 50.0);
        for all in [false, true] {
            let mesh = sphere(place, all);
            let of_points = vec![0; mesh.positions.len()];
            let mut stations = Stations { places: vec![Station::at(place.into())], of_points };
            let said = take_away_impossible(&mesh, &mut stations, "a.ptx");
            assert_eq!((said.len(), stations.of(0).is_none()), (usize::from(all), all), "{said:?}");
        }
        // In the wall.
        let mesh = sphere(place, false);
        let of_points = vec![0; mesh.positions.len()];
        let mut stations = Stations { places: vec![Station::at([-99.9, 10.0, 20.0])], of_points };
        let said = take_away_impossible(&mesh, &mut stations, "a.ptx");
        assert!(said.len() == 1 && said[0].contains("under less than 2 degrees"), "{said:?}");
    }
}
