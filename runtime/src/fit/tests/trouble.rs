//! Scans that do not show what the model is, or not all of it, or much else.

use super::cup::{SYNTHETIC, check, scan_of, synthetic};
use super::shapes::{Simple, cup, simple};
use crate::fit::attempt::attempt;
use crate::fit::problem::points::Points;
use crate::fit::scene::Scene;
use crate::fit::{FitOptions, FitResult, Weights, WithoutSd, fit};
use crate::mesh::TriangleMesh;
use crate::progress::Silent;
use crate::scan::{Scan, from_mesh};
use glam::{DQuat, DVec3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::Distribution;

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
        let said = result
            .warnings
            .iter()
            .any(|w| w.contains("another object") || w.contains("does not have the scan's shape"));
        assert!(said, "{shape:?}: {result:?}");
    }
}

#[test]
fn a_shape_that_is_its_own_mirror_image_is_not_called_one_where_the_search_had_missed_it() {
    let torus = simple(Simple::Torus, &[40.0, 12.0]);
    let scan = scan_of(&torus, &[47.0, 9.0], 0.05, 3000, 3);
    let options = FitOptions::default();
    let scene = Scene { model: &torus, scan: &scan, options: &options, progress: &Silent };
    let mut missed = attempt(&torus, &scan, &options, &Silent).unwrap();
    // As if it had come to another place.
    missed.result.inliers = 0.7;
    missed.result.parameters[0].value = 60.0;
    let result = scene.explain(missed);
    assert!(result.inliers > 0.98 && (result.parameters[0].value - 47.0).abs() < 0.05, "{result:?}");
    assert!(result.warnings.is_empty(), "{:?}", result.warnings);
}

#[test]
fn a_handle_that_was_not_scanned_is_not_known() {
    let mut scan = synthetic(0.1, 8000, 5);
    let shown = fit(&cup(), &scan, &FitOptions::default(), &Silent).unwrap();
    check(&shown, &SYNTHETIC);
    assert!(shown.warnings.is_empty() && shown.parameters[9].sd.is_some(), "{:?}", shown.warnings);
    // What lies on neither side of the wall, on the lip nor at the bottom is the handle.
    let [alpha, beta, gamma] = [3, 4, 5].map(|i| SYNTHETIC[i]);
    let turn = DQuat::from_rotation_z(gamma) * DQuat::from_rotation_y(beta) * DQuat::from_rotation_x(alpha);
    let base = DVec3::from_slice(&SYNTHETIC[..3]);
    let [shape, r, h] = [6, 7, 8].map(|i| SYNTHETIC[i]);
    let on_the_body = |p: &[f64; 3]| {
        let q = turn.inverse() * (DVec3::from_array(*p) - base);
        let (radius, height) = (q.truncate().length(), q.z / h);
        let outside = r * height.powf(1.0 / (3.0 + shape));
        let inside = r * ((height - 0.04).powf(1.0 / (2.0 + shape)) - 0.1);
        (radius - outside).abs() < 0.5 || (radius - inside).abs() < 0.5 || q.z > h - 0.5 || q.z < 8.0
    };
    let keep: Vec<bool> = scan.mesh.positions.iter().map(on_the_body).collect();
    for list in [&mut scan.mesh.positions, &mut scan.mesh.normals] {
        let mut kept = keep.iter();
        list.retain(|_| *kept.next().unwrap());
    }
    let hidden = fit(&cup(), &scan, &FitOptions::default(), &Silent).unwrap();
    let said =
        hidden.warnings.iter().any(|w| w.contains("does not show `handle`") || w.contains("belongs to `handle`"));
    assert!(said, "{:?}", hidden.warnings);
    let [radius, handle] = [7, 10].map(|i| &hidden.parameters[i]);
    assert!((radius.value - SYNTHETIC[7]).abs() < 0.15 && radius.sd.is_some(), "{radius:?}");
    assert!(handle.sd.is_none() && handle.without_sd == Some(WithoutSd::NotScanned), "{handle:?}");
}

#[test]
fn a_scan_in_another_unit_is_asked_about() {
    let mut scan = scan_of(&simple(Simple::Torus, &[47.0, 9.0]), &[47.0, 9.0], 0.05, 2000, 6);
    let asked = |scan: &Scan| {
        let result = fitted(Simple::Torus, &[40.0, 12.0], scan);
        result.warnings.iter().any(|w| w.contains("times smaller than the model") && w.contains("likely m (--unit m)"))
    };
    assert!(!asked(&scan));
    scan.mesh.positions.iter_mut().for_each(|p| *p = p.map(|c| c / 1000.0));
    scan.noise /= 1000.0;
    assert!(asked(&scan));
}

#[test]
fn a_scan_with_the_other_side_out_gives_the_same_fit_and_a_sentence() {
    let mut scan = scan_of(&simple(Simple::Torus, &[47.0, 9.0]), &[47.0, 9.0], 0.05, 3000, 4);
    let coverage = FitOptions { coverage: true, ..FitOptions::default() };
    let fitted = |scan: &Scan| fit(&simple(Simple::Torus, &[40.0, 12.0]), scan, &coverage, &Silent).unwrap();
    let right = fitted(&scan);
    scan.mesh.normals.iter_mut().for_each(|n| *n = n.map(|c| -c));
    let turned = fitted(&scan);
    let said = |r: &FitResult| r.warnings.iter().filter(|w| w.contains("turned as a whole")).count();
    assert_eq!((said(&right), said(&turned)), (0, 1), "{:?}", turned.warnings);
    for (a, b) in right.parameters.iter().zip(&turned.parameters) {
        let sd = a.sd.unwrap();
        assert!((a.value - b.value).abs() < 0.2 * sd, "{}: {} and {}, sd {sd}", a.name, a.value, b.value);
    }
    let share = |r: &FitResult| r.coverage.as_ref().unwrap().share;
    assert!(share(&turned) > 0.95 && (share(&turned) - share(&right)).abs() < 0.01, "{}", share(&turned));
}

/// A cloud without normals.
fn cloud(positions: Vec<[f64; 3]>) -> Scan {
    let mesh = TriangleMesh { positions, ..TriangleMesh::default() };
    from_mesh(mesh, "cloud").unwrap()
}

#[test]
fn flat_scans_and_few_points_are_named() {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let noise = rand_distr::Normal::new(0.0, 0.05).unwrap();
    let mut cylinder = |count: usize| {
        let point = |_| {
            let (angle, z): (f64, f64) = (random.random_range(0.0..6.3), random.random_range(0.0..60.0));
            [25.0 * angle.cos(), 25.0 * angle.sin(), z]
        };
        (0..count).map(point).collect::<Vec<_>>()
    };
    let (few, enough) = (cylinder(7), cylinder(400));
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut flat = |directions: usize| {
        let mut point = |_| {
            let mut along = |k: usize| {
                let noise = noise.sample(&mut random);
                if k < directions { random.random_range(-40.0..40.0) + noise } else { noise }
            };
            [along(0), along(1), along(2)]
        };
        cloud((0..500).map(&mut point).collect())
    };
    for (scan, sentence) in [
        (flat(1), Some("on a line")),
        (flat(2), Some("in a plane")),
        (cloud(few), Some("7 points for 8 unknowns (2 parameters and the pose)")),
        (cloud(enough), None),
    ] {
        let warnings = fitted(Simple::Cylinder, &[30.0, 50.0], &scan).warnings;
        let named = |w: &String| w.contains("on a line") || w.contains("in a plane") || w.contains("unknowns");
        let found: Vec<&String> = warnings.iter().filter(|w| named(w)).collect();
        match sentence {
            Some(sentence) => assert!(found.len() == 1 && found[0].contains(sentence), "{sentence}: {warnings:?}"),
            None => assert!(found.is_empty(), "{warnings:?}"),
        }
    }
}

#[test]
fn outliers_are_no_part_of_samples_of_dense_scans() {
    let mut random = ChaCha8Rng::seed_from_u64(9);
    for off in [0, 400, 4000] {
        let on = (0..400_000).map(|i| DVec3::new(f64::from(i % 1000) * 0.1, f64::from(i / 1000) * 0.1, 0.0));
        // Those in a cell of the surface, which is some 3 mm wide, are as good as its points.
        let mut away = || DVec3::from(std::array::from_fn(|_| random.random_range(0.0..40.0))) + 5.0 * DVec3::Z;
        let outliers: Vec<DVec3> = (0..off).map(|_| away()).collect();
        let sample = Points::at(on.chain(outliers).collect()).sample(1000);
        let beside = sample.position.iter().filter(|p| p.z > 0.0).count();
        assert!(sample.len() > 500 && 50 * beside <= sample.len(), "{beside} of {} with {off}", sample.len());
    }
}

#[test]
fn a_few_points_too_many_for_a_sample_leave_a_sample() {
    // Cells of a sample have one point each here, whatever their size, until they are three spacings wide.
    let scan = scan_of(&simple(Simple::Sphere, &[50.0]), &[50.0], 0.0, 6000, 12);
    let points = Points::of(&scan, Weights::Points);
    for share in [0.6, 0.9, 0.95, 0.99, 0.999] {
        let count = (share * points.len() as f64) as usize;
        let sample = points.sample(count).len();
        assert!(sample <= count && sample * 10 > count * 7, "{sample} for {count} of {}", points.len());
    }
}
