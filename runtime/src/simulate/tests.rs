//! Scans of shapes whose truth is a formula.

mod kinds;
mod noise;

use super::*;
use crate::bvh::Bvh;
use crate::model::{Fineness, Model, Motion, Tessellation};
use crate::progress::Silent;
use gml_compiler::program::{Options, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use std::f64::consts::{PI, TAU};

/// The surface of revolution about z of a profile of (radius, height).
fn revolve(profile: &[[f64; 2]], n: usize) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for &[r, z] in profile {
        for j in 0..n {
            let (sin, cos) = (TAU * j as f64 / n as f64).sin_cos();
            mesh.positions.push([r * cos, r * sin, z]);
        }
    }
    let at = |i: usize, j: usize| (i * n + j % n) as u32;
    for i in 0..profile.len() - 1 {
        for j in 0..n {
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
            mesh.triangles.push([at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
        }
    }
    mesh
}

fn sphere(radius: f64) -> TriangleMesh {
    let profile: Vec<[f64; 2]> = (0..=100)
        .map(|i| {
            let (sin, cos) = (PI * f64::from(i) / 100.0).sin_cos();
            [radius * sin, -radius * cos]
        })
        .collect();
    revolve(&profile, 200)
}

fn joined(mut a: TriangleMesh, b: &TriangleMesh) -> TriangleMesh {
    let offset = a.positions.len() as u32;
    a.positions.extend(&b.positions);
    a.triangles.extend(b.triangles.iter().map(|t| t.map(|i| i + offset)));
    a
}

/// No noise, nothing lost, no pose.
fn exact() -> Scanner {
    Scanner { spacing: 1.2, noise: 0.0, outliers: 0.0, dropouts: 0.0, random_pose: false, ..Scanner::default() }
}

fn radius(p: [f64; 3]) -> f64 {
    DVec3::from(p).length()
}

#[test]
fn a_sphere_is_covered_once() {
    let scan = scan(&sphere(30.0), &exact(), &Silent).unwrap();
    let sphere_area = 4.0 * PI * 30.0 * 30.0;
    assert!((scan.truth.coverage - 1.0).abs() < 1e-3, "{}", scan.truth.coverage);
    // Neither gaps nor overlaps between views add up to more than 2 per cent.
    let covered = scan.mesh.area() / sphere_area;
    assert!((covered - 1.0).abs() < 0.02, "{covered}");
    // One point a squared spacing; borders of regions repeat some points.
    let expected = sphere_area / 1.44;
    let points = scan.truth.points as f64 / expected;
    assert!((0.95..1.15).contains(&points), "{points}");
    for &triangle in &scan.mesh.triangles {
        let corner = DVec3::from(scan.mesh.positions[triangle[0] as usize]);
        assert!(scan.mesh.triangle_normal(triangle).unwrap().dot(corner) > 0.0, "faces outwards");
    }
    // The tessellated sphere lies up to 30 (1 - cos(pi / 200)) + the same along the meridians inside the true one.
    assert!(scan.mesh.positions.iter().all(|&p| (29.99 - 2e-2..30.001).contains(&radius(p))));
}

/// The paper's cup with shape 4, r 40, h 90, without its handle: outside, lip, inside.
fn cup() -> TriangleMesh {
    let steps = |n: u32| (0..=n).map(move |i| f64::from(i) / f64::from(n));
    let rim = (24.0_f64 / 25.0).powf(1.0 / 6.0) - 0.1;
    let outside = steps(200).map(|t| [40.0 * t, 90.0 * t.powi(7)]);
    let inside = steps(200).map(|t| [40.0 * rim * t, 90.0 * (0.04 + (rim * t + 0.1).powi(6))]);
    let profile: Vec<[f64; 2]> = outside.chain(inside.rev()).collect();
    revolve(&profile, 400)
}

/// A tube of radius 5 around the cubic Bezier curve of the cup's handle.
fn handle() -> TriangleMesh {
    let control = [[39.2, 78.13], [76.0, 85.5], [72.0, 18.0], [34.0, 28.85]].map(|[x, z]| DVec3::new(x, 0.0, z));
    let [a, b, c, d] = control;
    let mut mesh = TriangleMesh::default();
    for i in 0..=100_u32 {
        let (t, s) = (f64::from(i) / 100.0, 1.0 - f64::from(i) / 100.0);
        let point = a * s.powi(3) + b * (3.0 * s * s * t) + c * (3.0 * s * t * t) + d * t.powi(3);
        let slope = ((b - a) * s * s + (c - b) * (2.0 * s * t) + (d - c) * t * t).normalize();
        for j in 0..60_u32 {
            let (sin, cos) = (TAU * f64::from(j) / 60.0).sin_cos();
            mesh.positions.push((point + 5.0 * (cos * slope.cross(DVec3::Y) + sin * DVec3::Y)).into());
            if i > 0 {
                let (k, l) = (60 * (i - 1) + j, 60 * (i - 1) + (j + 1) % 60);
                mesh.triangles.push([k, k + 60, l + 60]);
                mesh.triangles.push([k, l + 60, l]);
            }
        }
    }
    mesh
}

#[test]
fn the_papers_cup_gets_about_its_numbers() {
    let scan = scan(&joined(cup(), &handle()), &Scanner { holes: 8, ..Scanner::default() }, &Silent).unwrap();
    assert!((60_000..72_000).contains(&scan.truth.points), "{}", scan.truth.points);
    assert!((115_000..140_000).contains(&scan.truth.triangles), "{}", scan.truth.triangles);
}

#[test]
fn what_is_hidden_is_missing() {
    let nested = joined(sphere(30.0), &sphere(20.0));
    let scan = scan(&nested, &exact(), &Silent).unwrap();
    assert!(scan.mesh.positions.iter().all(|&p| radius(p) > 29.0));
    assert!((scan.truth.coverage - 9.0 / 13.0).abs() < 0.02, "{}", scan.truth.coverage);
}

#[test]
fn a_beaker_is_seen_inside_through_its_opening() {
    // Outside, rim, inside; wall 2, depth 57.
    let beaker =
        revolve(&[[0.01, 0.0], [30.0, 0.0], [30.0, 60.0], [28.0, 60.0], [28.0, 3.0], [0.01, 3.0]].map(|p| p), 200);
    let scan = scan(&beaker, &exact(), &Silent).unwrap();
    let inside = |t: &[u32; 3]| {
        let [x, y, z] = scan.mesh.positions[t[0] as usize];
        x.hypot(y) < 28.1 && z > 2.9
    };
    let seen: f64 = scan.mesh.triangles.iter().filter(|t| inside(t)).map(|&t| scan.mesh.triangle_area(t)).sum();
    let share = seen / (TAU * 28.0 * 57.0 + PI * 28.0 * 28.0);
    assert!((0.8..1.02).contains(&share), "{share}");
    // No triangle bridges the rim from one wall to the other beside the flat.
    let bvh = Bvh::build(&beaker).unwrap();
    for triangle in &scan.mesh.triangles {
        let centroid = triangle.iter().map(|&i| DVec3::from(scan.mesh.positions[i as usize])).sum::<DVec3>() / 3.0;
        let distance = bvh.closest_point(centroid, f64::INFINITY).unwrap().distance;
        assert!(distance < 0.55, "{distance} at {centroid}");
    }
}

#[test]
fn noise_is_as_ordered_and_the_pose_undoes() {
    let scanner = Scanner { spacing: 1.2, noise: 0.3, outliers: 0.02, dropouts: 0.1, seed: 4, ..Scanner::default() };
    let scan = scan(&sphere(30.0), &scanner, &Silent).unwrap();
    let truth = &scan.truth;
    let centre = DVec3::from(truth.pose.translation);
    let mut off: Vec<f64> =
        scan.mesh.positions.iter().map(|&p| (DVec3::from(p).distance(centre) - 30.0).abs()).collect();
    off.sort_by(f64::total_cmp);
    // Views are up to 25 degrees off the normal; the median absolute deviation is robust against the outliers.
    let sd = 1.4826 * off[off.len() / 2];
    assert!((0.27..0.32).contains(&sd), "{sd}");
    let outliers = truth.outliers as f64 / truth.points as f64;
    assert!((outliers / 0.02 - 1.0).abs() < 0.2, "{outliers}");
    let far = off.iter().filter(|&&d| d > 1.5).count() as f64;
    assert!((far / truth.outliers as f64 - 0.92).abs() < 0.1, "{far} of {}", truth.outliers);
    // With a tenth of the points lost, a cell keeps both triangles if it keeps all four points, and one if it keeps
    // three.
    let whole = scan_area_of_sphere(&Scanner { dropouts: 0.0, noise: 0.0, outliers: 0.0, ..scanner.clone() });
    let lost = scan_area_of_sphere(&Scanner { noise: 0.0, outliers: 0.0, ..scanner });
    let expected = 0.9_f64.powi(4) + 2.0 * 0.1 * 0.9_f64.powi(3);
    assert!((lost / whole - expected).abs() < 0.02, "{}", lost / whole);
}

fn scan_area_of_sphere(scanner: &Scanner) -> f64 {
    scan(&sphere(30.0), scanner, &Silent).unwrap().mesh.area()
}

#[test]
fn the_estimate_of_the_noise_agrees() {
    let scanner = Scanner { noise: 0.2, ..Scanner::default() };
    let virtual_scan = scan(&sphere(30.0), &scanner, &Silent).unwrap();
    let scan = crate::scan::from_mesh(virtual_scan.mesh.clone(), "virtual").unwrap();
    // Along the normal there is cos(incidence) of the range noise.
    assert!((0.17..0.22).contains(&scan.noise), "{}", scan.noise);
    assert_eq!(scan.source.triangles, virtual_scan.truth.triangles, "none is degenerate");
}

#[test]
fn holes_are_punched_on_one_side_only() {
    let scanner = Scanner { holes: 3, hole_radius: 6.0, seed: 9, ..exact() };
    let (with, without) = (scan_area_of_sphere(&scanner), scan_area_of_sphere(&exact()));
    // Each a cap of chord 6; they may overlap.
    let cap = PI * 36.0;
    assert!((without - with) / cap < 3.1 && (without - with) / cap > 1.5, "{}", (without - with) / cap);
    let sheet = joined(sphere(30.0), &sphere(28.0));
    assert!(scan(&sheet, &Scanner { holes: 10, hole_radius: 1e3, ..exact() }, &Silent).is_err());
}

#[test]
fn the_seed_alone_decides() {
    let scanner = Scanner { spacing: 2.0, holes: 1, ..Scanner::default() };
    let in_pool = |threads: usize, scanner: &Scanner| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| scan(&sphere(30.0), scanner, &Silent).unwrap())
    };
    let (one, three) = (in_pool(1, &scanner), in_pool(3, &scanner));
    assert_eq!((&one.mesh, &one.truth), (&three.mesh, &three.truth));
    let other = in_pool(1, &Scanner { seed: 1, ..scanner });
    assert_ne!(one.mesh, other.mesh);
    assert_ne!(one.truth.pose, other.truth.pose);
}

#[test]
fn impossible_orders_are_refused() {
    let sphere = sphere(30.0);
    let message = |scanner: Scanner| scan(&sphere, &scanner, &Silent).unwrap_err().to_string();
    assert_eq!(message(Scanner { spacing: f64::NAN, ..exact() }), "the scanner's spacing is NaN, but must be positive");
    assert!(message(Scanner { views: 0, ..exact() }).contains("number of views is 0"));
    assert!(message(Scanner { dropouts: 1.5, ..exact() }).contains("between 0 and 1"));
    assert!(message(Scanner { spacing: 1e-4, ..exact() }).contains("wider spacing"));
    assert!(message(Scanner { dropouts: 1.0, ..exact() }).contains("no ray of the 24 views"));
    let empty = scan(&TriangleMesh::default(), &exact(), &Silent).unwrap_err();
    assert_eq!(empty, SimulationError::NoSurface);
    let flat = TriangleMesh { positions: vec![[1.0; 3]], triangles: vec![[0, 0, 0]], ..TriangleMesh::default() };
    assert_eq!(scan(&flat, &exact(), &Silent).unwrap_err(), SimulationError::NoSurface);
}

#[test]
fn points_lie_on_the_exact_surface() {
    let text = "model m {
      part wall = cylinder(20mm, 40mm)
      part ball = sphere(15mm).translate((60mm, 0mm, 0mm))
      part block = extrude(rectangle(30mm, 20mm), 25mm).translate((0mm, 60mm, 0mm))
    }";
    let script = SourceFile { name: "m.gml".to_owned(), text: text.to_owned() };
    let program = compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program;
    let instance = Model::instantiate(&program, &[]).unwrap();
    // Chords far coarser than what is asked of the points.
    let fineness = Fineness { chord: 0.2, ..Fineness::default() };
    let tessellation = Tessellation::new(&program, &*instance, fineness).unwrap();
    let surface = ExactSurface { tessellation: &tessellation, instance: &*instance, motion: Motion::IDENTITY };
    let rectangle = |p: DVec3| {
        let q = (p - DVec3::new(0.0, 60.0, 0.0)).abs() - DVec3::new(15.0, 10.0, 0.0);
        q.x.max(q.y).abs()
    };
    let distance = |p: &[f64; 3]| {
        let p = DVec3::from_array(*p);
        let wall = (p.truncate().length() - 20.0).abs();
        let ball = (p.distance(DVec3::new(60.0, 0.0, 0.0)) - 15.0).abs();
        wall.min(ball).min(rectangle(p))
    };
    for kind in Kind::ALL {
        let scanner = Scanner { kind, spacing: 2.0, ..exact() };
        let scan = scan_exact(surface, &scanner, &Silent).unwrap();
        let (points, farthest) =
            (scan.mesh.positions.len(), scan.mesh.positions.iter().map(distance).fold(0.0, f64::max));
        assert!(points > 1000 && farthest < 1e-9, "{kind:?}: {points} {farthest}");
        if kind == Kind::Ct {
            // Open borders are rounded by up to half a voxel; folds would add to the area.
            let whole = TAU * 20.0 * 40.0 + 4.0 * PI * 15.0 * 15.0 + 100.0 * 25.0;
            assert!((0.85..1.01).contains(&(scan.mesh.area() / whole)), "{} of {whole}", scan.mesh.area());
            // The mesh itself is as far off as its chords are.
            let of_mesh = super::scan(&tessellation.mesh, &scanner, &Silent).unwrap();
            let farthest = of_mesh.mesh.positions.iter().map(distance).fold(0.0, f64::max);
            assert!((1e-3..0.25).contains(&farthest), "{farthest}");
        }
    }
}
