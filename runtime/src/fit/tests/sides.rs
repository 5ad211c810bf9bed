//! Surfaces that are scanned from both sides, from one, and without sides.

use super::cup::scan_of;
use super::shapes::{Simple, program, simple};
use crate::fit::{FitOptions, FitResult, fit};
use crate::progress::Silent;
use crate::scan::Scan;
use gml_compiler::program::Program;

/// A tube, 60 mm long, open at both ends.
fn tube() -> Program {
    program(
        "use std.surface (revolve, flip)
        model tube {
          param r: length in 20mm..40mm = 30mm
          param wall: length in 0.1mm..10mm = 3mm
          part outside = revolve(|t| (r, 60mm * t))
          part inside = flip(revolve(|t| (r - wall, 60mm * t)))
          part top = revolve(|t| (mix(r, r - wall, t), 60mm))
          part bottom = revolve(|t| (mix(r - wall, r, t), 0mm))
        }",
    )
}

fn says(result: &FitResult, words: &str) -> bool {
    result.warnings.iter().any(|warning| warning.contains(words))
}

fn fitted(model: &Program, scan: &Scan) -> FitResult {
    fit(model, scan, &FitOptions { no_pose: true, ..FitOptions::default() }, &Silent).unwrap()
}

#[test]
fn points_of_both_faces_belong_to_a_sheet_without_thickness() {
    let sheet = simple(Simple::Cylinder, &[30.0, 60.0]);
    let mut scan = scan_of(&sheet, &[33.0, 55.0], 0.1, 1500, 1);
    let other = scan_of(&sheet, &[33.0, 55.0], 0.1, 1500, 2);
    scan.mesh.positions.extend(other.mesh.positions);
    scan.mesh.normals.extend(other.mesh.normals.iter().map(|n| n.map(|c| -c)));
    let options = FitOptions { no_pose: true, ..FitOptions::default() };
    let result = fit(&sheet, &scan, &options, &Silent).unwrap();
    assert!(result.inliers > 0.98, "{result:?}");
    assert!(says(&result, "shows both faces of `all` in the same place"), "{:?}", result.warnings);
    let r = &result.parameters[0];
    // Noise over the root of 3,000 points.
    assert!((r.value - 33.0).abs() < 4.0 * 0.0019 && (r.sd.unwrap() / 0.0019 - 1.0).abs() < 0.3, "{r:?}");
}

#[test]
fn the_faces_of_a_thin_wall_are_no_sheet() {
    let scan = scan_of(&tube(), &[31.0, 0.4], 0.15, 4000, 3);
    let result = fitted(&tube(), &scan);
    assert!(!says(&result, "both faces"), "{:?}", result.warnings);
    let wall = &result.parameters[1];
    assert!((wall.value - 0.4).abs() < 4.0 * wall.sd.unwrap() && wall.sd.unwrap() < 0.02, "{wall:?}");
}

/// Points of a base that is seen are nearer to the hidden floor than the noise is large. They face the other way, and
/// have a home.
#[test]
fn a_hidden_face_takes_no_points_of_the_one_behind_it() {
    let plate = program(
        "use std.surface (flip, plane)
        model plate {
          param side: length in 40mm..80mm = 60mm
          param t: length in 1mm..5mm = 1mm
          part base = flip(plane(side, side))
          part floor = plane(side, side).translate((0mm, 0mm, t))
        }",
    );
    let mut scan = scan_of(&plate, &[62.0, 2.5], 0.5, 4000, 4);
    let below: Vec<bool> = scan.mesh.normals.iter().map(|n| n[2] < 0.0).collect();
    let mut kept = below.iter();
    scan.mesh.positions.retain(|_| *kept.next().unwrap());
    scan.mesh.normals.retain(|n| n[2] < 0.0);
    let result = fitted(&plate, &scan);
    assert!(!says(&result, "faces the inner one"), "{:?}", result.warnings);
    assert_eq!(result.parameters[1].sd, None, "{:?}", result.parameters[1]);
}

#[test]
fn a_cloud_does_not_tell_the_faces_of_a_wall_as_thin_as_noise() {
    let cloud = |wall: f64| {
        let mut scan = scan_of(&tube(), &[31.0, wall], 0.4, 4000, 5);
        scan.mesh.normals.clear();
        scan.oriented = false;
        fitted(&tube(), &scan)
    };
    let (thin, thick) = (cloud(0.9), cloud(4.0));
    let warning = thin.warnings.iter().find(|w| w.contains("does not tell which way")).expect("it is said");
    assert!(warning.contains("`outside`, `inside` face") && warning.contains("`r`, `wall` may be off"), "{warning}");
    assert!(!says(&thick, "does not tell which way"), "{:?}", thick.warnings);
    let wall = &thick.parameters[1];
    assert!((wall.value - 4.0).abs() < 4.0 * wall.sd.unwrap(), "{wall:?}");
}

/// Noise brings a fifth of the points of either face nearer to the other one.
#[test]
fn the_faces_of_a_wall_as_thin_as_noise_are_no_sheet() {
    let scan = scan_of(&tube(), &[31.0, 0.85], 0.5, 4000, 6);
    let result = fitted(&tube(), &scan);
    assert!(!says(&result, "both faces"), "{:?}", result.warnings);
    let wall = &result.parameters[1];
    assert!((wall.value - 0.85).abs() < 4.0 * wall.sd.unwrap() && wall.sd.unwrap() < 0.05, "{wall:?}");
}
