//! One object in several scans.

use super::cup::{SYNTHETIC, scan_of};
use super::shapes::{cup, program};
use crate::fit::problem::isometry::Isometry;
use crate::fit::{EarlierFit, FitError, FitOptions, FitResult, FittedScan, SeveralFit, WithoutSd, fit, fit_several};
use crate::model::Model;
use crate::progress::Silent;
use crate::scan::{Scan, ScanSource};
use glam::{DQuat, DVec3};

/// What of a scan of a model at `x` faces `direction` (in the model's frame, unit) by more than `least` of a cosine, in
/// a frame of its own that `motion` takes it to.
fn view(model: &dyn Model, x: &[f64], direction: DVec3, least: f64, motion: (DQuat, DVec3), seed: u64) -> Scan {
    let mut scan = scan_of(model, x, 0.05, 6000, seed);
    let faces: Vec<bool> = scan.mesh.normals.iter().map(|n| DVec3::from(*n).dot(direction) > least).collect();
    scan = Scan { noise: 0.05, ..scan.part(&faces) };
    let (rotation, shift) = motion;
    for p in &mut scan.mesh.positions {
        *p = (rotation * DVec3::from(*p) + shift).to_array();
    }
    for n in &mut scan.mesh.normals {
        *n = (rotation * DVec3::from(*n)).to_array();
    }
    Scan {
        source: ScanSource { path: format!("view {seed}"), points: scan.mesh.positions.len(), ..scan.source },
        ..scan
    }
}

fn motions() -> [(DQuat, DVec3); 3] {
    [
        (DQuat::from_scaled_axis(DVec3::new(0.3, -1.0, 2.0)), DVec3::new(30.0, -80.0, 12.0)),
        (DQuat::from_scaled_axis(DVec3::new(-2.0, 0.4, 0.9)), DVec3::new(-200.0, 5.0, 60.0)),
        (DQuat::from_scaled_axis(DVec3::new(0.1, 2.6, -0.7)), DVec3::new(7.0, 90.0, -40.0)),
    ]
}

fn fitted(model: &dyn Model, scans: &[Scan]) -> SeveralFit {
    fit_several(model, scans, &FitOptions::default(), &Silent).unwrap()
}

/// The largest distance between places of the model as a fit puts them into a scan and as they are there.
fn off(model: &dyn Model, fit: &FitResult, scan: &FittedScan, x: &[f64], (rotation, shift): (DQuat, DVec3)) -> f64 {
    let points = |x: &[f64]| -> Vec<[f64; 3]> {
        let instance = model.instantiate(x).unwrap();
        let mut out = vec![[0.0; 3]; 16];
        let u: Vec<f64> = (0..16).map(|i| f64::from(i % 4) / 4.0).collect();
        let v: Vec<f64> = (0..16).map(|i| f64::from(i / 4) / 4.0).collect();
        instance.points(0, &u, &v, &mut out).unwrap();
        out
    };
    let values: Vec<f64> = fit.parameters.iter().map(|p| p.value).collect();
    let there = points(x).into_iter().map(|p| rotation * DVec3::from(p) + shift);
    points(&values).into_iter().zip(there).map(|(p, q)| DVec3::from(scan.pose.point(p)).distance(q)).fold(0.0, f64::max)
}

/// A wedge, of which no single view shows two opposite faces.
const WEDGE: &str = "
model wedge {
  param length: length in 20mm..200mm = 80mm
  param width: length in 20mm..200mm = 60mm
  param height: length in 10mm..100mm = 30mm
  param slope: length in 0mm..40mm = 10mm
  part bottom = |u, v| (length * v, width * u, 0mm)
  part top = |u, v| (length * u, width * v, height + slope * u * u)
  part front = |u, v| (length * u, 0mm, v * (height + slope * u * u))
  part back = |u, v| (length * (1 - u), width, v * (height + slope * (1 - u) * (1 - u)))
  part left = |u, v| (0mm, width * (1 - u), v * height)
  part right = |u, v| (length, width * u, v * (height + slope))
}";

/// The shape of the cup, in the pose of the script's start.
fn upright() -> Vec<f64> {
    let mut x = SYNTHETIC.to_vec();
    x[..6].fill(0.0);
    x
}

#[test]
fn two_sides_of_a_cup_that_do_not_overlap_make_one() {
    let (model, x) = (cup(), upright());
    let [first, second, _] = motions();
    // The handle lies in the plane of x and z; each view has one side of it.
    let scans = [view(&model, &x, DVec3::Y, 0.1, first, 1), view(&model, &x, DVec3::NEG_Y, 0.1, second, 2)];
    let SeveralFit { fit, scan } = fitted(&model, &scans);
    for (p, truth) in fit.parameters.iter().zip(&x).skip(6) {
        if let Some(sd) = p.sd {
            assert!((p.value - truth).abs() < 4.0 * sd, "{} = {} +- {sd}, not {truth}", p.name, p.value);
        }
    }
    assert!(fit.parameters[6..].iter().all(|p| p.sd.is_some()), "{:?}", fit.parameters);
    assert!(fit.parameters[..6].iter().all(|p| p.without_sd == Some(WithoutSd::InPose)));
    for (scan, motion) in fit.scans.iter().zip([first, second]) {
        let off = off(&model, &fit, scan, &x, motion);
        assert!(off < 0.15 && scan.inliers > 0.98 && scan.pose_covariance.is_some(), "{off}: {scan:?}");
        assert!(scan.agreement.as_ref().is_some_and(|test| test.agrees && test.p > 1e-3), "{:?}", scan.agreement);
    }
    assert!(fit.converged && fit.pose == Some(fit.scans[0].pose), "{:?}", fit.warnings);
    assert_eq!(scan.mesh.positions.len(), scans[0].mesh.positions.len() + scans[1].mesh.positions.len());
}

#[test]
fn three_scans_from_the_poses_of_an_earlier_fit() {
    let (model, x) = (cup(), upright());
    let directions = [DVec3::new(0.0, 0.9, 0.44), DVec3::new(0.0, -0.9, 0.44), DVec3::new(0.6, 0.0, -0.8)];
    let at = |k: usize, x: &[f64]| view(&model, x, directions[k].normalize(), 0.1, motions()[k], 10 + k as u64);
    let scans: Vec<Scan> = (0..3).map(|k| at(k, &x)).collect();
    let options = from_poses(&model, &x, 3);
    let SeveralFit { fit, .. } = fit_several(&model, &scans, &options, &Silent).unwrap();
    for (p, truth) in fit.parameters.iter().zip(&x).skip(6) {
        let sd = p.sd.unwrap_or(f64::INFINITY);
        assert!((p.value - truth).abs() < 4.0 * sd, "{} = {} +- {sd}, not {truth}", p.name, p.value);
    }
    for (scan, motion) in fit.scans.iter().zip(motions()) {
        assert!(off(&model, &fit, scan, &x, motion) < 0.2, "{scan:?}");
    }
    assert!(!fit.warnings.iter().any(|w| w.contains("another object")), "{:?}", fit.warnings);
}

/// The options of a fit from the poses of an earlier one of the same scans: the search is tested elsewhere.
fn from_poses(model: &dyn Model, x: &[f64], scans: usize) -> FitOptions {
    let values = model.parameters().iter().zip(x).map(|(p, x)| (p.name.clone(), *x)).collect();
    let pose =
        |(rotation, translation): &(DQuat, DVec3)| Isometry { rotation: *rotation, translation: *translation }.into();
    let scans = motions()[..scans].iter().map(pose).collect();
    FitOptions { earlier: Some(EarlierFit { values, scans, ..EarlierFit::default() }), ..FitOptions::default() }
}

#[test]
fn a_scan_of_another_object_is_named_with_what_differs() {
    let (model, x) = (cup(), upright());
    let r = model.parameters().iter().position(|p| p.name == "r").unwrap();
    let mut other = x.clone();
    other[r] += 0.3;
    let [first, second, _] = motions();
    let a = view(&model, &x, DVec3::Y, 0.1, first, 21);
    let options = from_poses(&model, &x, 2);
    for (x, same) in [(&x, true), (&other, false)] {
        let scans = [a.clone(), view(&model, x, DVec3::NEG_Y, 0.1, second, 22)];
        let SeveralFit { fit, .. } = fit_several(&model, &scans, &options, &Silent).unwrap();
        let [_, scan] = &fit.scans[..] else { panic!("two scans") };
        let test = scan.agreement.as_ref().unwrap();
        assert_eq!((test.agrees, fit.shortcoming().is_none()), (same, same), "{test:?}");
        let named = fit.warnings.iter().any(|w| w.starts_with("view 22 does not agree") && w.contains("`r` is "));
        assert_eq!(named, !same, "{:?}", fit.warnings);
        if !same {
            let named = test.differences.iter().find(|difference| difference.name == "r").unwrap();
            assert!((named.value - named.others - 0.3).abs() < 4.0 * named.sd.hypot(named.others_sd), "{named:?}");
        }
    }
}

#[test]
fn what_no_two_scans_hold_together_is_said() {
    // From opposite corners each view has three faces, which determine a pose each, and no length.
    let model = program(WEDGE);
    let x: Vec<f64> = vec![90.0, 55.0, 35.0, 0.0];
    let corner = DVec3::new(1.0, 1.0, 1.0).normalize();
    let [first, second, _] = motions();
    let scans = [view(&model, &x, corner, 0.2, first, 3), view(&model, &x, -corner, 0.2, second, 4)];
    let options =
        FitOptions { fixed: vec!["slope".into()], start: [("slope".into(), 0.0)].into(), ..FitOptions::default() };
    let SeveralFit { fit, .. } = fit_several(&model, &scans, &options, &Silent).unwrap();
    assert!(fit.parameters.iter().all(|p| p.sd.is_none()), "{:?}", fit.parameters);
    assert!(fit.warnings.iter().any(|w| w.contains("whether the scans contradict")), "{:?}", fit.warnings);
}

#[test]
fn one_scan_is_fitted_as_before_and_some_options_are_refused() {
    let (model, x) = (cup(), upright());
    let scan = scan_of(&model, &x, 0.1, 3000, 8);
    let options = FitOptions {
        start: model.parameters().iter().zip(&x).map(|(p, x)| (p.name.clone(), *x)).collect(),
        ..FitOptions::default()
    };
    let mut alone = fit(&model, &scan, &options, &Silent).unwrap();
    let mut one = fit_several(&model, std::slice::from_ref(&scan), &options, &Silent).unwrap().fit;
    alone.seconds.clear();
    one.seconds.clear();
    assert_eq!(alone, one);
    assert!(one.scans.is_empty());
    let two = [scan.clone(), scan];
    for options in [
        FitOptions { no_pose: true, ..FitOptions::default() },
        FitOptions { coverage: true, ..FitOptions::default() },
        FitOptions { bootstrap: 3, ..FitOptions::default() },
    ] {
        let error = fit_several(&model, &two, &options, &Silent).unwrap_err();
        assert!(
            matches!(error, FitError::Several(_)) && error.to_string().starts_with("with several scans "),
            "{error}"
        );
    }
}
