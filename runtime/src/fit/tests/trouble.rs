//! Scans that do not show what the model is, or not all of it, or much else.

use super::cup::scan_of;
use super::shapes::{Simple, simple};
use crate::fit::{FitOptions, FitResult, fit};
use crate::progress::Silent;
use crate::scan::Scan;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn fitted(shape: Simple, start: &[f64], scan: &Scan) -> FitResult {
    fit(&simple(shape, start), scan, &FitOptions::default(), &Silent).unwrap()
}

/// Keeps the points for which `keep` holds.
fn part(scan: &mut Scan, keep: impl Fn(&[f64; 3]) -> bool) {
    let kept: Vec<bool> = scan.mesh.positions.iter().map(keep).collect();
    let mut flags = kept.iter();
    scan.mesh.positions.retain(|_| *flags.next().unwrap());
    let mut flags = kept.iter();
    scan.mesh.normals.retain(|_| *flags.next().unwrap());
}

#[test]
fn a_part_of_the_surface_is_enough() {
    let mut scan = scan_of(&simple(Simple::Torus, &[47.0, 9.0]), &[47.0, 9.0], 0.05, 6000, 3);
    let all = scan.mesh.positions.len();
    part(&mut scan, |p| p[1].atan2(p[0]).abs() < 0.3 * std::f64::consts::PI);
    assert!(scan.mesh.positions.len() * 10 < all * 4);
    let result = fitted(Simple::Torus, &[40.0, 12.0], &scan);
    for (p, truth) in result.parameters.iter().zip([47.0, 9.0]) {
        assert!((p.value - truth).abs() < 0.05, "{} = {}, not {truth}", p.name, p.value);
    }
}

#[test]
fn half_clutter_is_looked_through() {
    let mut scan = scan_of(&simple(Simple::Torus, &[47.0, 9.0]), &[47.0, 9.0], 0.05, 3000, 4);
    let mut random = ChaCha8Rng::seed_from_u64(4);
    for _ in 0..scan.mesh.positions.len() {
        let mut at = || random.random_range(-90.0..90.0);
        scan.mesh.positions.push([at(), at(), at()]);
    }
    // Of points from nowhere no normal is known.
    scan.mesh.normals.clear();
    scan.oriented = false;
    let right = |r: &FitResult| r.parameters.iter().zip([47.0, 9.0]).all(|(p, t)| (p.value - t).abs() < 0.05);
    let anywhere = fitted(Simple::Torus, &[40.0, 12.0], &scan);
    assert!(right(&anywhere), "{anywhere:?}");
    let options = FitOptions { no_pose: true, ..FitOptions::default() };
    let near = fit(&simple(Simple::Torus, &[44.0, 10.0]), &scan, &options, &Silent).unwrap();
    assert!(right(&near), "{near:?}");
}

#[test]
fn a_wrong_object_is_said_to_be_wrong() {
    let torus = scan_of(&simple(Simple::Torus, &[47.0, 20.0]), &[47.0, 20.0], 0.05, 3000, 5);
    for (shape, start) in [(Simple::Sphere, vec![40.0]), (Simple::Cylinder, vec![30.0, 80.0])] {
        let result = fitted(shape, &start, &torus);
        let said =
            result.warnings.iter().any(|w| w.contains("does not explain") || w.contains("no model of this family"));
        assert!(said, "{shape:?}: {result:?}");
    }
}
