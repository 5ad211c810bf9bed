//! The same virtual objects as meshes and as clouds, and known deviations.

use super::cylinder::{Sample, plane_at_axis};
use crate::mesh::TriangleMesh;
use crate::model::{Fineness, Model, Motion, Tessellation};
use crate::progress::Silent;
use crate::scan::{Scan, Station, from_mesh};
use crate::simulate::{ExactSurface, Scanner, Truth, scan_exact};
use crate::variance::{
    Device, DistanceKind, MeasureError, MeasureOptions, Measurement, Outcome, Reference, Resolution, Tolerance,
    VerdictOptions, measure,
};
use glam::{DVec2, DVec3};
use gml_compiler::program::{Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const NOISE: f64 = 0.05;

fn program(text: &str) -> Program {
    let script = SourceFile { name: "object.gml".to_owned(), text: text.to_owned() };
    compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program
}

/// A vessel with a wall of 2 mm.
fn vessel() -> Program {
    program(
        "use std.surface (revolve, disc, flip, cylinder)
        use std.frame (translate)
        model vessel {
          param r: length = 20mm
          part outside = cylinder(r, 40mm)
          part inside = flip(cylinder(r - 2mm, 38mm)).translate((0mm, 0mm, 2mm))
          part lip = revolve(|t| (mix(r, r - 2mm, t), 40mm))
          part bottom = flip(disc(r))
          part floor = disc(r - 2mm).translate((0mm, 0mm, 2mm))
        }",
    )
}

/// A virtual scan of a model at some parameters, with its truth.
fn scanned(program: &Program, x: &[f64], scanner: &Scanner) -> (TriangleMesh, Truth) {
    let instance = Model::instantiate(program, x).unwrap();
    let fineness = Fineness { chord: 0.02 * scanner.spacing, ..Fineness::default() };
    let tessellation = Tessellation::new(program, &*instance, fineness).unwrap();
    let surface = ExactSurface { tessellation: &tessellation, instance: &*instance, motion: Motion::IDENTITY };
    let scan = scan_exact(surface, scanner, &Silent).unwrap();
    (scan.mesh, scan.truth)
}

fn scanner() -> Scanner {
    Scanner { views: 14, spacing: 0.6, noise: NOISE, outliers: 0.0, dropouts: 0.02, seed: 5, ..Scanner::default() }
}

/// The points of a mesh, with the normals of its triangles if `sided`.
fn cloud(mesh: &TriangleMesh, sided: bool) -> Scan {
    let normals = if sided { mesh.vertex_normals() } else { Vec::new() };
    let cloud = TriangleMesh { positions: mesh.positions.clone(), normals, ..TriangleMesh::default() };
    from_mesh(cloud, "cloud").unwrap()
}

fn options() -> MeasureOptions {
    MeasureOptions {
        resolution: Resolution::Side(256),
        max_distance: Some(3.0),
        device: Device::Cpu,
        tolerance: Some(Tolerance { lower: -0.2, upper: 0.2 }),
        ..MeasureOptions::default()
    }
}

fn measured(program: &Program, x: &[f64], motion: Motion, scan: &Scan, options: &MeasureOptions) -> Measurement {
    measure(Reference::Model { model: program, x, motion }, scan, None, options, &Silent).unwrap()
}

#[test]
fn a_cloud_has_the_statistics_of_the_mesh_of_its_points() {
    let program = vessel();
    // The radius is off by 0.1 mm.
    let (mesh, truth) = scanned(&program, &[20.1], &scanner());
    let of = |scan: &Scan| measured(&program, &[20.0], truth.pose, scan, &options()).report;
    let by_rays = of(&from_mesh(mesh.clone(), "mesh").unwrap());
    for sided in [true, false] {
        let by_cylinders = of(&cloud(&mesh, sided));
        assert!(by_rays.cylinder.is_none() && by_cylinders.cylinder.is_some());
        assert_eq!(by_cylinders.matching, "mutual");
        for (a, b) in by_rays.parts.iter().zip(&by_cylinders.parts) {
            let (name, a_moments, b_moments) = (&a.name, &a.statistics.weighted, &b.statistics.weighted);
            println!(
                "{sided} {name}: {a_moments:?}\n {b_moments:?} {} {}",
                a.statistics.coverage, b.statistics.coverage
            );
            // A part has 500 points and more, whose mean is known to 0.0025 mm.
            assert!((a_moments.signed.mean - b_moments.signed.mean).abs() < 0.01, "{name}");
            assert!((a_moments.signed.median - b_moments.signed.median).abs() < 0.01, "{name}");
            // A ray meets a triangle, whose noise is 0.6 to 1 of a point's, a cylinder has 0.3 of it.
            for (x, y) in [(a_moments.signed.sd, b_moments.signed.sd), (a_moments.rms, b_moments.rms)] {
                assert!(y < x + 0.005 && x - y < NOISE, "{name}: {x} {y}");
            }
            assert!((a_moments.percentiles.p95 - b_moments.percentiles.p95).abs() < 2.0 * NOISE, "{name}");
            assert!(b.statistics.coverage > a.statistics.coverage - 0.08, "{name}");
            let coverage = b.statistics.coverage;
            let [a, b] = [a, b].map(|part| part.verdict.as_ref().unwrap().outcome);
            // Triangles across the edges of the narrow lip decide nothing, so that the mesh may not tell.
            assert!(a == b || (a == Outcome::Undecided && name == "lip"), "{name}: {a:?} {b:?}");
            // Of the floor, which few views see, too little is measured for a verdict.
            let enough = coverage >= VerdictOptions::default().min_coverage;
            assert_eq!(b, if enough { Outcome::Conforms } else { Outcome::Undecided }, "{name}");
        }
        let (a, b) = (by_rays.points.as_ref().unwrap(), by_cylinders.points.as_ref().unwrap());
        assert!((a.overall.moments.signed.mean - b.overall.moments.signed.mean).abs() < 0.005);
        // The scanner's noise lies along its rays, which meet the surface at an angle. The spread of a part's points
        // about the surface is what of it lies along the normals.
        let along_normals = b.parts[0].statistics.moments.signed.sd;
        assert!((by_cylinders.noise / along_normals - 1.0).abs() < 0.15, "{} {along_normals}", by_cylinders.noise);
        let unmatched = by_cylinders.unmatched.unwrap();
        assert!(unmatched.share < 0.01, "{unmatched:?}");
    }
}

/// A ball of 8 mm, on which points are 0.8 mm apart: a plane through the heights themselves would be off by 0.1 mm.
#[test]
fn curved_surface_has_no_bias_and_distances_have_the_uncertainty_that_they_say() {
    let program = program("model ball { param r: length = 8mm\npart shell = sphere(r) }");
    let noise = Normal::new(0.0, NOISE).unwrap();
    for (offset, seed) in [(0.0, 1), (0.2, 2), (-0.2, 3)] {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut mesh = TriangleMesh::default();
        for _ in 0..1250 {
            let direction = DVec3::from([0; 3].map(|_| Normal::new(0.0, 1.0).unwrap().sample(&mut random))).normalize();
            mesh.positions.push((direction * (8.0 + offset + noise.sample(&mut random))).into());
            mesh.normals.push(direction.into());
        }
        let scan = from_mesh(mesh, "ball").unwrap();
        let found = measured(&program, &[8.0], Motion::IDENTITY, &scan, &options());
        let (deviations, overall) = (&found.deviations, &found.report.overall);
        // 1250 points of 0.05 mm: 0.0014 mm.
        assert!((overall.weighted.signed.mean - offset).abs() < 0.006, "{offset}: {:?}", overall.weighted);
        assert!(overall.coverage > 0.98, "{}", overall.coverage);
        let errors: Vec<f64> = (0..deviations.texels.len())
            .filter(|i| !deviations.signed(*i).is_nan())
            .map(|i| (f64::from(deviations.signed(i)) - offset) / f64::from(deviations.uncertainty[i]))
            .collect();
        let sd = (errors.iter().map(|z| z * z).sum::<f64>() / errors.len() as f64).sqrt();
        println!("{offset}: z {sd}, {:?}", found.report.cylinder);
        assert!((sd - 1.0).abs() < 0.15, "z-scores have a standard deviation of {sd}");
    }
}

/// A plate with a bump, and with a hole of 6 mm; points are 0.5 mm apart by chance.
fn plate(height: impl Fn(f64, f64) -> f64, is_hole: impl Fn(f64, f64) -> bool, noise: f64) -> Scan {
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let error = Normal::new(0.0, noise).unwrap();
    let mut mesh = TriangleMesh::default();
    while mesh.positions.len() < 6400 {
        let [x, y] = [(); 2].map(|()| random.random_range(0.0..40.0));
        if !is_hole(x, y) {
            mesh.positions.push([x, y, height(x, y) + error.sample(&mut random)]);
            mesh.normals.push([0.0, 0.0, 1.0]);
        }
    }
    from_mesh(mesh, "plate").unwrap()
}

fn on_plate(scan: &Scan, distance: DistanceKind) -> Measurement {
    let program = program("model plate { param a: length = 40mm\npart p = |u, v| (u * a, v * a, 0mm) }");
    measured(&program, &[40.0], Motion::IDENTITY, scan, &MeasureOptions { distance, ..options() })
}

#[test]
fn a_bump_is_measured_where_it_is_and_a_hole_has_no_data() {
    let bump = |x: f64, y: f64| 0.5 * (-((x - 10.0).powi(2) + (y - 10.0).powi(2)) / 50.0).exp();
    let hole = |x: f64, y: f64| (x - 30.0).hypot(y - 30.0) < 3.0;
    for kind in [DistanceKind::Normal, DistanceKind::AveragedNormal, DistanceKind::Closest] {
        let found = on_plate(&plate(bump, hole, 0.02), kind);
        let deviations = &found.deviations;
        let (mut errors, mut count, mut in_hole, mut lost) = (0.0, 0.0, 0, 0);
        for i in 0..deviations.texels.len() {
            let ([x, y, _], signed) = (deviations.texels.position[i], f64::from(deviations.signed(i)));
            match (signed.is_nan(), hole(x, y)) {
                // Where its rim is ragged by the points' spacing it is not the circle.
                (false, true) => in_hole += usize::from((x - 30.0).hypot(y - 30.0) < 2.3),
                (true, false) => lost += usize::from((1.0..39.0).contains(&x) && (1.0..39.0).contains(&y)),
                (false, false) => {
                    errors += signed - bump(x, y);
                    count += 1.0;
                }
                _ => {}
            }
        }
        assert!(f64::abs(errors / count) < 0.002, "{kind:?}: {}", errors / count);
        assert_eq!(in_hole, 0, "{kind:?}");
        assert!(f64::from(lost as u32) < 0.02 * count, "{kind:?}: {lost} of {count}");
        let peak = found.report.overall.weighted.signed.max;
        // The disc of 1.1 mm takes 0.01 mm of the bump's top, the noise of 0.006 mm adds to the largest of many.
        assert!((peak - 0.5).abs() < 0.03, "{kind:?}: {peak}");
    }
}

#[test]
fn points_that_lie_on_no_sheet_are_no_distance_and_two_sheets_are_told_apart() {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let error = Normal::new(0.0, 0.02).unwrap();
    let mut samples: Vec<Sample> = (0..15)
        .map(|k| {
            let (s, c) = f64::from(k).sin_cos();
            let at = DVec2::new(c, s) * f64::sqrt(f64::from(k) / 15.0);
            Sample { at, height: 0.3 + 0.1 * at.x + error.sample(&mut random), point: 0 }
        })
        .collect();
    let found = plane_at_axis(&samples, 0.02, &|_| ()).unwrap();
    assert!((found.height - 0.3).abs() < 4.0 * found.uncertainty && found.uncertainty < 0.01, "{found:?}");
    assert!((found.slope - 0.1).abs() < 0.03, "{found:?}");
    samples.push(Sample { at: DVec2::ZERO, height: 1.0, point: 0 });
    let again = plane_at_axis(&samples, 0.02, &|_| ()).unwrap();
    assert_eq!((again.height, again.points), (found.height, 15), "an outlier at the axis");
    assert!(plane_at_axis(&samples[..5], 0.02, &|_| ()).is_none(), "too few");
    // On one side only: at the axis they say less than a point there would.
    samples.iter_mut().for_each(|s| s.at = DVec2::new(0.8 + 0.1 * s.at.x, s.at.y));
    assert!(plane_at_axis(&samples, 0.02, &|_| ()).is_none());
    // A sheet of clutter 1.2 mm above the plate, and one 1.4 mm below it.
    let mut scan = plate(|_, _| 0.0, |_, _| false, 0.02);
    for (from, by) in [(0, 1.2), (2, -1.4)] {
        scan.mesh.positions.iter_mut().skip(from).step_by(5).for_each(|p| p[2] += by);
    }
    let found = on_plate(&scan, DistanceKind::Normal);
    let moments = &found.report.overall.weighted;
    // Two fifths of the points are clutter: in one place of thirty it is nearer, and is taken for the surface.
    assert!(moments.signed.median.abs() < 0.002 && moments.percentiles.p95 < 0.04, "{moments:?}");
}

#[test]
fn a_cloud_that_is_turned_inside_out_is_turned_back_and_lines_of_sight_show_empty_space() {
    let program = program(
        "model plate { param a: length = 40mm\npart p = |u, v| (u * a, v * a, 0mm)\n\
        part shelf = |u, v| (5mm + u * 5mm, 5mm + v * 5mm, 20mm) }",
    );
    let mut scan = plate(|_, _| 0.0, |_, _| false, 0.02);
    scan.mesh.normals.iter_mut().for_each(|n| *n = n.map(|c| -c));
    let found = measured(&program, &[40.0], Motion::IDENTITY, &scan, &options());
    assert!(found.report.warnings.iter().any(|w| w.contains("turned as a whole")), "{:?}", found.report.warnings);
    assert!(found.report.overall.weighted.signed.mean.abs() < 0.002);
    assert_eq!(found.report.overall.contradicted_area, 0.0);
    // A scanner above saw the plate past the shelf, which is not there; beside the plate it saw nothing.
    scan.attributes.stations.places = vec![Station::at([10.0, 10.0, 300.0])];
    scan.attributes.stations.of_points = vec![0; scan.mesh.positions.len()];
    let found = measured(&program, &[40.0], Motion::IDENTITY, &scan, &options());
    let areas: Vec<f64> = found.report.parts.iter().map(|part| part.statistics.contradicted_area).collect();
    assert!(areas[0] == 0.0 && (areas[1] / 25.0 - 1.0).abs() < 0.05, "{areas:?}");
}

#[test]
fn clouds_have_no_edges_of_holes_and_what_the_model_lacks_is_said_in_points() {
    let mut scan = plate(|_, _| 0.0, |_, _| false, 0.02);
    scan.mesh.positions.iter_mut().filter(|p| p[0] > 30.0).for_each(|p| p[2] += 10.0);
    let found = on_plate(&scan, DistanceKind::Normal);
    let unmatched = found.report.unmatched.as_ref().unwrap();
    let count = scan.mesh.positions.iter().filter(|p| p[0] > 30.0).count();
    assert_eq!((unmatched.points, unmatched.triangles, found.unmatched.positions.len()), (count, 0, count));
    assert!((unmatched.area / 400.0 - 1.0).abs() < 0.1 && (unmatched.share - 0.25).abs() < 0.02, "{unmatched:?}");
    assert!(unmatched.largest[0].points > count - 5, "{unmatched:?}");
    let program = vessel();
    let reference = Reference::Model { model: &program, x: &[20.0], motion: Motion::IDENTITY };
    let refused = measure(reference, &scan, None, &MeasureOptions { fill_holes: Some(1.0), ..options() }, &Silent);
    assert!(matches!(refused, Err(MeasureError::HolesOfCloud { .. })));
}
