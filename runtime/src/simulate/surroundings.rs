//! What else the scanner sees: a table under the object, and boxes and balls beside it.

use super::CLUTTER_STREAM;
use super::scanner::Scanner;
use crate::mesh::{Bounds, TriangleMesh};
use glam::{DVec2, DVec3};
use rand::{Rng, RngExt};
use std::f64::consts::{PI, TAU};

/// Width of the ring around the object in which the clutter stands, in radii of the object.
const RING: f64 = 1.5;
/// Radii of the clutter's bounding balls, in radii of the object.
const SIZES: std::ops::Range<f64> = 0.1..0.3;
/// Places that are tried for one that is apart from what stands there already.
const TRIALS: usize = 50;

/// The object with its surroundings.
pub(super) struct Surroundings {
    /// The triangles of the object come first, then those of the table, then those of the clutter.
    pub(super) mesh: TriangleMesh,
    /// Height of the table's plane.
    pub(super) floor: Option<f64>,
    /// The number of the object's triangles, and of these and the table's.
    pub(super) ends: [usize; 2],
}

impl Surroundings {
    /// Those of an object that has a triangle, whose corners are valid.
    pub(super) fn of(object: &TriangleMesh, scanner: &Scanner) -> Self {
        let used = object.triangles.iter().flat_map(|t| object.corners(*t));
        let bounds: Bounds = used.clone().collect();
        let (centre, radius) = (bounds.centre(), bounds.diagonal() / 2.0);
        // A vertical cylinder holds the object, and all else stands outside of it.
        let inner = used.map(|p| p.truncate().distance(centre.truncate())).fold(0.0, f64::max);
        let floor = bounds.low.z;
        let mut mesh = TriangleMesh {
            positions: object.positions.clone(),
            triangles: object.triangles.clone(),
            ..TriangleMesh::default()
        };
        let object_end = mesh.triangles.len();
        if scanner.table {
            let half = inner + (RING + 0.2) * radius;
            let corner = |x: f64, y: f64| centre.with_z(floor) + half * DVec3::new(x, y, 0.0);
            let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            append(&mut mesh, &corners, &[[0, 1, 2], [0, 2, 3]]);
        }
        let table_end = mesh.triangles.len();
        let ring = Ring { centre: centre.truncate(), floor, inner, radius };
        ring.fill(&mut mesh, scanner.clutter, &mut scanner.random(CLUTTER_STREAM));
        Self { mesh, floor: scanner.table.then_some(floor), ends: [object_end, table_end] }
    }
}

/// Where the clutter stands.
struct Ring {
    centre: DVec2,
    floor: f64,
    inner: f64,
    radius: f64,
}

impl Ring {
    /// Adds boxes and balls by turns, apart from each other where there is room.
    fn fill(&self, mesh: &mut TriangleMesh, count: usize, random: &mut impl Rng) {
        let mut there: Vec<(DVec2, f64)> = Vec::new();
        for number in 0..count {
            let mut place = self.place(random);
            for _ in 1..TRIALS {
                if there.iter().all(|(at, size)| at.distance(place.0) > size + place.1) {
                    break;
                }
                place = self.place(random);
            }
            there.push(place);
            let (at, size) = (place.0.extend(self.floor), place.1);
            if number % 2 == 0 { cuboid(mesh, at, size, random) } else { ball(mesh, at, size) }
        }
    }

    /// A place and the radius of a circle around it that is outside of the object's cylinder.
    fn place(&self, random: &mut impl Rng) -> (DVec2, f64) {
        let size = self.radius * random.random_range(SIZES);
        let gap = 0.02 * self.radius;
        let from = self.inner + size + gap;
        let distance = random.random_range(from..self.inner + RING * self.radius - size + 2.0 * gap);
        let (sin, cos) = (TAU * random.random::<f64>()).sin_cos();
        (self.centre + distance * DVec2::new(cos, sin), size)
    }
}

/// A box whose base has the given half diagonal, turned about the vertical.
fn cuboid(mesh: &mut TriangleMesh, at: DVec3, size: f64, random: &mut impl Rng) {
    let shape = random.random_range(0.3..PI / 2.0 - 0.3);
    let turn = TAU * random.random::<f64>();
    let height = size * random.random_range(0.5..2.5);
    let base = [shape, PI - shape, PI + shape, -shape].map(|angle| {
        let (sin, cos) = (angle + turn).sin_cos();
        at + size * DVec3::new(cos, sin, 0.0)
    });
    let corners = [base, base.map(|p| p + height * DVec3::Z)].concat();
    let mut triangles = vec![[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]];
    for i in 0..4 {
        let j = (i + 1) % 4;
        triangles.extend([[i, j, j + 4], [i, j + 4, i + 4]]);
    }
    append(mesh, &corners, &triangles);
}

/// A ball that stands on the floor.
fn ball(mesh: &mut TriangleMesh, at: DVec3, size: f64) {
    const RINGS: u32 = 24;
    const ROUND: u32 = 48;
    let mut positions = Vec::new();
    for i in 0..=RINGS {
        let (sin, cos) = (PI * f64::from(i) / f64::from(RINGS)).sin_cos();
        for j in 0..ROUND {
            let (y, x) = (TAU * f64::from(j) / f64::from(ROUND)).sin_cos();
            positions.push(at + size * DVec3::new(sin * x, sin * y, 1.0 - cos));
        }
    }
    let place = |i: u32, j: u32| i * ROUND + j % ROUND;
    let cells = (0..RINGS).flat_map(|i| (0..ROUND).map(move |j| (i, j)));
    let triangles: Vec<[u32; 3]> = cells
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [place(i, j), place(i, j + 1), place(i + 1, j + 1), place(i + 1, j)];
            [(i > 0).then_some([a, b, c]), (i + 1 < RINGS).then_some([a, c, d])]
        })
        .flatten()
        .collect();
    append(mesh, &positions, &triangles);
}

fn append(mesh: &mut TriangleMesh, positions: &[DVec3], triangles: &[[u32; 3]]) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(positions.iter().map(|p| p.to_array()));
    mesh.triangles.extend(triangles.iter().map(|t| t.map(|corner| first + corner)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_reaches_into_the_object_and_all_of_it_stands_on_the_table() {
        let mut object = TriangleMesh::default();
        ball(&mut object, DVec3::new(5.0, -3.0, 7.0), 10.0);
        let scanner = Scanner { table: true, clutter: 40, ..Scanner::default() };
        let all = Surroundings::of(&object, &scanner);
        assert_eq!(all.floor, Some(7.0));
        let [object_end, table_end] = all.ends;
        assert_eq!((object_end, table_end), (object.triangles.len(), object.triangles.len() + 2));
        let table: Bounds =
            all.mesh.triangles[object_end..table_end].iter().flat_map(|t| all.mesh.corners(*t)).collect();
        for p in all.mesh.triangles[table_end..].iter().flat_map(|t| all.mesh.corners(*t)) {
            assert!(p.truncate().distance(DVec2::new(5.0, -3.0)) > 10.0 && p.z >= 7.0 - 1e-12, "{p}");
            assert!(p.cmpge(table.low - 1e-9).all() && p.truncate().cmple(table.high.truncate()).all(), "{p}");
        }
        for t in &all.mesh.triangles[object_end..] {
            assert!(all.mesh.triangle_normal(*t).is_some(), "every triangle has an area");
        }
    }
}
