use super::FilledHoles;
use crate::bvh::Bvh;
use crate::mesh::TriangleMesh;
use crate::model::Texels;
use crate::scan::ScanSource;
use crate::variance::cast::{closest, hide_behind_filled};
use crate::variance::{Device, DistanceKind, Facing, VarianceReport, cast};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// A sphere of triangles, without those whose centre is within so many radians of one of the directions.
fn punched(radius: f64, holes: &[(DVec3, f64)]) -> TriangleMesh {
    let (rings, sectors) = (120u32, 240u32);
    let mut positions = vec![[0.0, 0.0, radius], [0.0, 0.0, -radius]];
    for i in 1..rings {
        for j in 0..sectors {
            let (t, f) = (PI * f64::from(i) / f64::from(rings), TAU * f64::from(j) / f64::from(sectors));
            positions.push([radius * t.sin() * f.cos(), radius * t.sin() * f.sin(), radius * t.cos()]);
        }
    }
    let at = |i: u32, j: u32| 2 + (i - 1) * sectors + j % sectors;
    let mut triangles = Vec::new();
    for j in 0..sectors {
        triangles.extend([[0, at(1, j), at(1, j + 1)], [1, at(rings - 1, j + 1), at(rings - 1, j)]]);
        for i in 1..rings - 1 {
            triangles.extend([[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]);
        }
    }
    let mut mesh = TriangleMesh { positions, triangles, ..TriangleMesh::default() };
    let positions = mesh.positions.clone();
    mesh.triangles.retain(|t| {
        let centre = t.iter().map(|i| DVec3::from(positions[*i as usize])).sum::<DVec3>();
        holes.iter().all(|(d, angle)| centre.angle_between(*d) > *angle)
    });
    mesh
}

const SMALL: [(DVec3, f64); 3] = [(DVec3::X, 0.1), (DVec3::Z, 0.15), (DVec3::new(0.0, -0.8, -0.6), 0.12)];
const LARGE: (DVec3, f64) = (DVec3::new(-1.0, 0.2, 0.1), 0.6);

fn texels(radius: f64, count: u32) -> Texels {
    // Fibonacci's lattice: all of the same area.
    let direction = |i: u32| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let (sin, cos) = (f64::from(i) * 2.399_963_229_728_653).sin_cos();
        DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
    };
    let n = count as usize;
    Texels {
        width: count,
        height: 1,
        index: (0..count).collect(),
        part: vec![0; n],
        position: (0..count).map(|i| (direction(i) * radius).to_array()).collect(),
        normal: (0..count).map(|i| direction(i).as_vec3().to_array()).collect(),
        area: vec![(4.0 * PI * radius * radius / f64::from(count)) as f32; n],
        side: vec![(4.0 * PI / f64::from(count)).sqrt() as f32 * radius as f32; n],
        part_names: vec!["sphere".to_owned()],
    }
}

#[test]
fn small_holes_of_a_sphere_are_closed_and_large_ones_are_not() {
    let mut all = SMALL.to_vec();
    all.push(LARGE);
    let scan = punched(20.0, &all);
    let found = FilledHoles::new(&scan, 8.0);
    assert_eq!((found.summary.filled, found.summary.open), (3, 1));
    // Caps of the sphere, seen flat: their rims are at the angles of the holes, up to half a triangle.
    let expected: f64 = SMALL.iter().map(|(_, angle)| PI * (20.0 * angle.sin()).powi(2)).sum();
    assert!((found.summary.area / expected - 1.0).abs() < 0.12, "{} {expected}", found.summary.area);
    // With them every edge around a small hole has two triangles: only the large one's rim is left.
    let mut together = scan.clone();
    let first = together.positions.len() as u32;
    together.positions.extend(&found.mesh.positions);
    together.triangles.extend(found.mesh.triangles.iter().map(|t| t.map(|i| i + first)));
    let weld = |p: [f64; 3]| together.positions.iter().position(|q| *q == p).expect("it is there") as u32;
    let welded: Vec<u32> = found.mesh.positions.iter().map(|p| weld(*p)).collect();
    let filled = found.mesh.triangles.iter().map(|t| t.map(|i| welded[i as usize]));
    let closed = TriangleMesh {
        positions: scan.positions.clone(),
        triangles: scan.triangles.iter().copied().chain(filled).collect(),
        ..TriangleMesh::default()
    };
    assert_eq!(crate::rims::find(&closed).len(), 1);
    assert_eq!(FilledHoles::new(&closed, 8.0).summary.filled, 0);
}

/// Texels opposite a closed hole are counted as such and not as measured, and nothing else changes.
#[test]
fn texels_that_look_at_closed_holes_are_a_class_of_their_own() {
    let mut all = SMALL.to_vec();
    all.push(LARGE);
    let scan = punched(20.0, &all);
    let bvh = Bvh::build(&scan).expect("a mesh");
    let holes = FilledHoles::new(&scan, 8.0);
    // Without a side, and so far that rays through holes reach the other side of the sphere.
    let before = cast(texels(19.5, 40_000), &bvh, 60.0, Facing::Any, Device::Cpu).expect("a distance").deviations;
    let mut after = before.clone();
    hide_behind_filled(&mut after, &holes, &bvh, Facing::Any, DistanceKind::Normal).expect("a mesh");
    let (mut filled, mut beyond) = (0, 0);
    for i in 0..before.outward.len() {
        let direction = DVec3::from(before.texels.position[i]).normalize();
        // Rims follow the triangles: within a triangle of them either may be.
        let beside = SMALL.iter().any(|(d, angle)| (direction.angle_between(*d) - angle).abs() < 0.03);
        let within = SMALL.iter().any(|(d, angle)| direction.angle_between(*d) < *angle);
        // Through the large hole and out by a small one on the other side.
        let through = direction.angle_between(LARGE.0) < LARGE.1 + 0.03;
        if !beside && !through {
            assert_eq!(after.is_filled(i), within, "{direction}");
        }
        if after.is_filled(i) {
            filled += 1;
            beyond += usize::from(through);
            assert!(after.signed(i).is_nan());
        } else if before.outward[i] < 1.0 {
            assert_eq!(before.outward[i], after.outward[i]);
        }
    }
    let statistics = VarianceReport::new(&after, &ScanSource::default(), "cpu", &[]).overall;
    assert_eq!(statistics.filled_texels, filled);
    let each = 4.0 * PI * 19.5 * 19.5 / 40_000.0;
    let expected: f64 = SMALL.iter().map(|(_, angle)| TAU * 19.5 * 19.5 * (1.0 - angle.cos())).sum();
    let area = statistics.filled_area - each * beyond as f64;
    assert!((area / expected - 1.0).abs() < 0.12, "{area} {expected}");
    // Through the large hole, which is still open, rays meet nothing outside but the far side inside.
    assert_eq!(statistics.texels, statistics.measured_texels + filled);
}

#[test]
fn closest_points_on_closed_holes_are_not_measured() {
    let scan = punched(20.0, &SMALL);
    let bvh = Bvh::build(&scan).expect("a mesh");
    let holes = FilledHoles::new(&scan, 8.0);
    let mut found = closest(texels(19.9, 20_000), &bvh, &scan, 5.0, Facing::SAME).expect("a distance").deviations;
    hide_behind_filled(&mut found, &holes, &bvh, Facing::SAME, DistanceKind::Closest).expect("a mesh");
    for i in 0..found.outward.len() {
        let direction = DVec3::from(found.texels.position[i]).normalize();
        let inside = SMALL.iter().any(|(d, angle)| direction.angle_between(*d) < angle - 0.04);
        let outside = SMALL.iter().all(|(d, angle)| direction.angle_between(*d) > angle + 0.04);
        if inside {
            assert!(found.is_filled(i), "{direction}");
        } else if outside {
            assert!((found.signed(i) - 0.1).abs() < 0.02, "{direction} {}", found.signed(i));
        }
    }
}

/// The border of a plate is no hole, however small the plate; the hole within it is one.
#[test]
fn borders_are_not_closed() {
    let mut mesh = TriangleMesh::default();
    for j in 0..=6 {
        mesh.positions.extend((0..=6).map(|i| [f64::from(i), f64::from(j), 0.0]));
    }
    for j in 0..6u32 {
        for i in 0..6u32 {
            if (2..4).contains(&i) && (2..4).contains(&j) {
                continue;
            }
            let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| 7 * j + i);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let found = FilledHoles::new(&mesh, 100.0);
    assert_eq!((found.summary.filled, found.summary.open), (1, 1));
    assert!((found.summary.area - 4.0).abs() < 1e-12);
    for t in &found.mesh.triangles {
        assert_eq!(found.mesh.triangle_normal(*t), Some(DVec3::Z));
    }
    assert_eq!(FilledHoles::new(&mesh, 2.8).summary.filled, 0, "the hole's diagonal is 2.83");
}

/// Two holes that touch in a vertex are two; a rim of a thousand vertices is closed, too, and what it encloses is
/// covered once.
#[test]
fn rims_that_touch_and_long_rims_are_closed() {
    let quad = |i: u32, j: u32| [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| 5 * j + i);
    let mut mesh = TriangleMesh::default();
    for j in 0..5 {
        mesh.positions.extend((0..5).map(|i| [f64::from(i), f64::from(j), 0.0]));
    }
    for (i, j) in (0..16).map(|k| (k % 4, k / 4)).filter(|c| ![(1, 1), (2, 2)].contains(c)) {
        let [a, b, c, d] = quad(i, j);
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    let found = FilledHoles::new(&mesh, 2.0);
    assert_eq!((found.summary.filled, found.summary.open, found.mesh.triangles.len()), (2, 1, 4));

    let count = 1000u32;
    let mut ring = TriangleMesh::default();
    for radius in [10.0, 12.0] {
        ring.positions.extend((0..count).map(|i| {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(count)).sin_cos();
            // A star, which is not convex, on a saddle.
            let r = radius * (1.0 + 0.3 * (5.0 * TAU * f64::from(i) / f64::from(count)).cos());
            [r * cos, r * sin, 0.02 * r * r * (cos * cos - sin * sin)]
        }));
    }
    for i in 0..count {
        let (j, k) = ((i + 1) % count, count);
        ring.triangles.extend([[i, k + i, k + j], [i, k + j, j]]);
    }
    let found = FilledHoles::new(&ring, 30.0);
    assert_eq!((found.summary.filled, found.summary.open, found.mesh.triangles.len()), (1, 1, count as usize - 2));
    // The star's area is pi r^2 (1 + 0.3^2 / 2), somewhat more on the saddle.
    let flat = PI * 100.0 * 1.045;
    assert!((1.0..1.12).contains(&(found.summary.area / flat)), "{}", found.summary.area / flat);
}
