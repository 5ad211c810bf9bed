//! The kinds of scanners, and what stands around the object.

use super::{exact, joined, radius, sphere};
use crate::mesh::TriangleMesh;
use crate::progress::Silent;
use crate::simulate::{Kind, Scanner, SimulationError, VirtualScan, scan};
use std::f64::consts::PI;

/// Area of a sphere.
fn area(radius: f64) -> f64 {
    4.0 * PI * radius * radius
}

/// For every cell of every grid with a point its column, its row, and the point in the station's own frame.
fn cells(scan: &VirtualScan) -> Vec<(usize, usize, usize, [f64; 3])> {
    let stations = &scan.attributes.stations;
    let mut found = Vec::new();
    let mut next = 0;
    for (k, (grid, station)) in scan.grids.iter().zip(&stations.places).enumerate() {
        assert_eq!(grid.cells.len(), grid.columns * grid.rows);
        for (cell, point) in grid.cells.iter().enumerate().filter(|(_, point)| **point != u32::MAX) {
            assert_eq!(*point, next, "points follow each other column by column");
            next += 1;
            assert_eq!(usize::from(stations.of_points[*point as usize]), k);
            let own = station.to_own(scan.mesh.positions[*point as usize]);
            found.push((k, cell / grid.rows, cell % grid.rows, own));
        }
    }
    assert_eq!(next as usize, scan.mesh.positions.len());
    found
}

/// The step of a quantity by a count, the same for all: found from the first and the last.
fn require_linear(values: &[(usize, f64)], what: &str) {
    let (low, high) = (values.iter().min_by_key(|v| v.0).unwrap(), values.iter().max_by_key(|v| v.0).unwrap());
    let step = (high.1 - low.1) / (high.0 - low.0) as f64;
    for (count, value) in values {
        let expected = low.1 + (count - low.0) as f64 * step;
        assert!((value - expected).abs() < 1e-9, "{what} {count}: {value} for {expected}");
    }
}

/// The station, column, row and place of a cell.
type Cell = (usize, usize, usize, [f64; 3]);

#[test]
fn a_panorama_keeps_the_grids_of_its_stations() {
    let scanner = Scanner { kind: Kind::Panorama, stations: 3, noise: 0.3, random_pose: true, ..exact() };
    let scan = scan(&sphere(30.0), &scanner, &Silent).unwrap();
    assert_eq!((scan.grids.len(), scan.truth.stations.len(), scan.mesh.triangles.len()), (3, 3, 0));
    let cells = cells(&scan);
    for k in 0..3 {
        let of = |value: fn(&Cell) -> (usize, f64)| -> Vec<(usize, f64)> {
            let around = cells.iter().find(|c| c.0 == k).unwrap().3;
            let middle = around[1].atan2(around[0]);
            cells
                .iter()
                .filter(|c| c.0 == k)
                .map(|c| {
                    let (count, angle) = value(c);
                    // Angles about the first one, so that none jumps by a turn.
                    if count == c.1 { (count, (angle - middle).sin().asin()) } else { (count, angle) }
                })
                .collect()
        };
        // Noise is along the rays, so that their angles are exact.
        require_linear(&of(|c| (c.1, c.3[1].atan2(c.3[0]))), "azimuth of column");
        let rows: Vec<(usize, f64)> =
            cells.iter().filter(|c| c.0 == k).map(|c| (c.2, c.3[2].atan2(c.3[0].hypot(c.3[1])))).collect();
        require_linear(&rows, "elevation of row");
    }
    // Each station sees less than half of the sphere.
    assert!((0.5..1.0).contains(&scan.truth.coverage), "{}", scan.truth.coverage);
}

#[test]
fn a_station_within_a_room_looks_all_around() {
    let scanner = Scanner { kind: Kind::Panorama, places: vec![[1.0, 2.0, 3.0]], spacing: 0.5, ..exact() };
    let scan = scan(&sphere(30.0), &scanner, &Silent).unwrap();
    let grid = &scan.grids[0];
    assert!(grid.columns as f64 * 0.5 / 30.0 > 0.99 * 2.0 * PI, "{}", grid.columns);
    // But for what is below 60 degrees.
    let seen = grid.cells.iter().filter(|cell| **cell != u32::MAX).count() as f64 / grid.cells.len() as f64;
    assert!(seen > 0.99, "{seen}");
    assert!(scan.mesh.positions.iter().all(|p| (radius(*p) - 30.0).abs() < 0.02));
}

#[test]
fn a_cloud_of_structured_light_keeps_the_views_apart() {
    let scanner = Scanner { cloud: true, views: 6, noise: 0.1, random_pose: true, ..exact() };
    let scan = scan(&sphere(30.0), &scanner, &Silent).unwrap();
    assert_eq!((scan.grids.len(), scan.mesh.triangles.len()), (6, 0));
    for (_, column, row, p) in cells(&scan) {
        // Rays pass through a square grid in a plane.
        let step = scan.truth.pitch / (4.0 * scan.truth_radius());
        let middle = (scan.grids[0].columns - 1) as f64 / 2.0;
        let (x, y) = (p[0] / -p[2] / step, p[1] / -p[2] / step);
        // The grid begins at a whole pitch from one side.
        assert!((x - (column as f64 - middle)).abs() < 1.0 && (y - (row as f64 - middle)).abs() < 1.0, "{x} {column}");
    }
    // Views overlap, so that there are more points than a square spacing has.
    assert!(scan.truth.points as f64 > 1.2 * area(30.0) / 1.44);
}

impl VirtualScan {
    /// Half the diagonal of the box around a sphere of 30 mm.
    fn truth_radius(&self) -> f64 {
        30.0 * 3.0_f64.sqrt()
    }
}

#[test]
fn a_hand_held_scan_has_a_point_a_squared_spacing() {
    let scanner = Scanner { kind: Kind::HandHeld, ..exact() };
    let scan = scan(&sphere(30.0), &scanner, &Silent).unwrap();
    assert!(scan.grids.is_empty() && scan.attributes.stations.places.is_empty());
    // Of the rays that meet it a few are beyond the largest angle of incidence.
    let expected = area(30.0) / 1.44;
    let points = scan.truth.points as f64 / expected;
    assert!((0.85..1.05).contains(&points), "{points}");
    // By octants and by the poles: nowhere fewer than half of the mean.
    let caps = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.6, -0.8, 0.0], [0.48, 0.64, -0.6]];
    for cap in caps {
        let within = |p: &&[f64; 3]| (0..3).map(|k| p[k] * cap[k]).sum::<f64>() > 0.9 * 30.0;
        let share = scan.mesh.positions.iter().filter(within).count() as f64 / (0.05 * scan.truth.points as f64);
        assert!((0.5..1.7).contains(&share), "{share} at {cap:?}");
    }
}

/// Noise is along the rays, which meet the surface at all angles up to the largest. Of rays from two radii that are
/// even over the ball's silhouette the median of |c x|, c the cosine and x normal, times 1.4826 is 0.62 (found by
/// drawing them).
#[test]
fn the_noise_of_a_scan_by_hand_is_estimated_along_the_normals() {
    for noise in [0.4, 0.8, 1.6] {
        let scanner = Scanner { kind: Kind::HandHeld, spacing: 0.8, noise, ..exact() };
        let cloud = scan(&sphere(30.0), &scanner, &Silent).unwrap().mesh;
        let mut off: Vec<f64> = cloud.positions.iter().map(|p| (radius(*p) - 30.0).abs()).collect();
        let along = 1.4826 * crate::robust::median(&mut off).unwrap();
        assert!((0.57..0.68).contains(&(along / noise)), "{along} of {noise}");
        let found = crate::scan::from_mesh(cloud, "by hand").unwrap().noise;
        assert!((found / along - 1.0).abs() < 0.2, "{found} for {along} of {noise}");
    }
}

#[test]
fn computed_tomography_has_the_inside_as_well() {
    let nested = joined(sphere(30.0), &sphere(20.0));
    let scanner = Scanner { kind: Kind::Ct, spacing: 1.0, noise: 0.0, ..exact() };
    let clean = scan(&nested, &scanner, &Silent).unwrap();
    assert!(clean.mesh.boundary_edges().is_empty(), "closed");
    let both = area(30.0) + area(20.0);
    assert!((clean.mesh.area() / both - 1.0).abs() < 0.02, "{}", clean.mesh.area() / both);
    let points = clean.truth.points as f64 / both;
    assert!((0.85..1.15).contains(&points), "{points}");
    let noise = 0.05;
    let noisy =
        scan(&nested, &Scanner { noise, correlation: 4.0, correlated: 1.0, ..scanner.clone() }, &Silent).unwrap();
    let off = |(p, q): (&[f64; 3], &[f64; 3])| radius(*p) - radius(*q);
    let errors: Vec<f64> = noisy.mesh.positions.iter().zip(&clean.mesh.positions).map(off).collect();
    // Of some 1000 places with errors of their own the deviation is known to 3 %.
    let deviation = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    assert!((deviation / noise - 1.0).abs() < 0.1, "{deviation}");
    let along = |t: &[u32; 3]| errors[t[0] as usize] * errors[t[1] as usize];
    let neighbours = noisy.mesh.triangles.iter().map(along).sum::<f64>() / noisy.mesh.triangles.len() as f64;
    // Neighbours are about one spacing apart: exp(-1 / 32).
    assert!((neighbours / noise.powi(2) - 0.96).abs() < 0.2, "{neighbours}");
    let refused = scan(&nested, &Scanner { noise_angle: true, ..scanner }, &Silent).unwrap_err();
    assert!(matches!(refused, SimulationError::NoSuchProperty { .. }), "{refused}");
}

#[test]
fn a_thin_wall_keeps_both_sides() {
    let sheet = joined(sphere(30.0), &inside_out(sphere(29.8)));
    let scan = scan(&sheet, &Scanner { kind: Kind::Ct, spacing: 1.0, ..exact() }, &Silent).unwrap();
    assert!(scan.mesh.boundary_edges().is_empty());
    assert!((scan.mesh.area() / (area(30.0) + area(29.8)) - 1.0).abs() < 0.02);
}

fn inside_out(mut mesh: TriangleMesh) -> TriangleMesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh
}

#[test]
fn a_table_hides_and_is_counted_as_is_the_clutter() {
    for kind in Kind::ALL {
        let scanner = Scanner { kind, table: true, clutter: 6, spacing: 2.0, ..exact() };
        let scan = scan(&sphere(30.0), &scanner, &Silent).unwrap();
        let surfaces = scan.truth.surfaces;
        let sum = surfaces.object + surfaces.table + surfaces.clutter;
        assert_eq!((sum, sum), (scan.truth.points, scan.mesh.positions.len()), "{kind:?}");
        assert!(surfaces.object > 0 && surfaces.table > 0 && surfaces.clutter > 0, "{kind:?}: {surfaces:?}");
        assert!(scan.mesh.positions.iter().all(|p| p[2] > -30.001), "{kind:?}: nothing is below the table");
        let ball = scan.mesh.positions.iter().filter(|p| (radius(**p) - 30.0).abs() < 0.1 && p[2] > -25.0).count();
        assert!(ball <= surfaces.object && 2 * ball > surfaces.object, "{kind:?}: {ball} of {surfaces:?}");
    }
}

#[test]
fn the_seed_alone_decides_about_every_kind() {
    for kind in Kind::ALL {
        let rays = if kind == Kind::Ct { 0.0 } else { 1.0 };
        let scanner = Scanner {
            kind,
            spacing: 4.0,
            noise: 0.2,
            noise_range: 1e-5 * rays,
            beam: 0.5 * rays,
            correlation: 5.0,
            holes: 2,
            table: true,
            clutter: 3,
            dropouts: 0.05,
            ..Scanner::default()
        };
        let in_pool = |threads: usize, scanner: &Scanner| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| scan(&sphere(30.0), scanner, &Silent).unwrap())
        };
        let (one, three) = (in_pool(1, &scanner), in_pool(3, &scanner));
        assert_eq!(
            (&one.mesh, &one.attributes, &one.truth),
            (&three.mesh, &three.attributes, &three.truth),
            "{kind:?}"
        );
        assert_ne!(one.mesh, in_pool(1, &Scanner { seed: 1, ..scanner }).mesh, "{kind:?}");
    }
}

#[test]
fn holes_of_clouds_are_places_without_points() {
    for kind in [Kind::Panorama, Kind::HandHeld, Kind::StructuredLight] {
        let whole = Scanner { kind, cloud: true, ..exact() };
        let holes = Scanner { holes: 5, hole_radius: 8.0, ..whole.clone() };
        let count = |scanner: &Scanner| scan(&sphere(30.0), scanner, &Silent).unwrap().truth.points as f64;
        let lost = 1.0 - count(&holes) / count(&whole);
        // Each is a cap of chord 8: 1.8 % of the sphere. They may overlap, or lie where fewer points are.
        assert!((0.02..0.15).contains(&lost), "{kind:?}: {lost}");
    }
}

#[test]
fn places_from_which_nothing_is_seen_are_refused() {
    let scanner = Scanner { kind: Kind::Panorama, table: true, places: vec![[100.0, 0.0, -100.0]], ..exact() };
    let error = scan(&sphere(30.0), &scanner, &Silent).unwrap_err();
    assert_eq!(error, SimulationError::NothingInSight { stations: 0 });
    let fine = Scanner { spacing: 1e-3, places: Vec::new(), ..scanner };
    assert!(scan(&sphere(30.0), &fine, &Silent).unwrap_err().to_string().contains("wider spacing"));
}
