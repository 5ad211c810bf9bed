//! What fits say of their own uncertainty, against many fits of simulated scans.

use super::cup::scan_of;
use super::number::Number;
use super::shapes::{Formula, Handmade, Simple, program, simple};
use crate::fit::{FitError, FitOptions, FitResult, LossKind, WithoutSd, fit};
use crate::mesh::TriangleMesh;
use crate::progress::Silent;
use crate::progress::tests::Until;
use crate::repeats::{ratio_of_spreads, repeats};
use crate::scan::Scan;
use glam::DVec3;
use gml_compiler::program::Quantity;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::Distribution;

/// Options that keep the model where it is, so that a fit takes no longer than it must.
fn still() -> FitOptions {
    FitOptions { no_pose: true, ..FitOptions::default() }
}

fn fitted(scan: &Scan, options: &FitOptions) -> FitResult {
    fit(&simple(Simple::Sphere, &[38.0]), scan, options, &Silent).unwrap()
}

/// Mean and standard deviation.
fn spread(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64;
    (mean, square.sqrt())
}

/// A cone of which the script bounds the taper too narrowly: the radius that goes with it is elsewhere, and known well.
#[test]
fn what_a_wrong_bound_moves_is_named() {
    let cone = |taper: f64, most: f64| {
        program(&format!(
            "use std.surface (cone)
            model tapered {{
              param r: length in 10mm..40mm = 20mm
              param taper: length in 0mm..{most}mm = {taper}mm
              part wall = cone(r, r - taper, 30mm)
            }}"
        ))
    };
    let scan = scan_of(&cone(3.0, 5.0), &[20.0, 3.0], 0.05, 2000, 4);
    let named = |most: f64| {
        let result = fit(&cone(0.5, most), &scan, &still(), &Silent).unwrap();
        let r = &result.parameters[0];
        let off = (r.value - 20.0).abs() / r.sd.unwrap();
        (off, result.warnings.iter().any(|w| w.contains("`r` would be") && w.contains("`taper` could leave")))
    };
    let (off, is_named) = named(5.0);
    assert!(off < 4.0 && !is_named, "{off}");
    let (off, is_named) = named(1.0);
    assert!(off > 4.0 && is_named, "{off}");
}

/// Flutes that noise makes deeper, up to their bound: it takes the radius along, of which the bias at the bound knows
/// nothing.
#[test]
fn what_noise_moves_together_with_a_value_at_a_bound_is_named() {
    let fluted = program(
        "model fluted {
          param r: length in 10mm..40mm = 20mm
          param depth: length in 0mm..1.5mm = 1mm
          part wall = |u, v| {
            let a = u * 1turn
            polar(r - depth * abs(sin(12 * a)), a, v * 30mm)
          }
        }",
    );
    let normal = rand_distr::Normal::new(0.0_f64, 0.8).unwrap();
    for seed in 0..6 {
        let mut scan = scan_of(&fluted, &[20.0, 1.2], 0.0, 6000, seed);
        let mut random = ChaCha8Rng::seed_from_u64(100 + seed);
        scan.mesh.positions.iter_mut().for_each(|p| *p = p.map(|c| c + normal.sample(&mut random)));
        scan.noise = 0.8;
        let result = fit(&fluted, &scan, &still(), &Silent).unwrap();
        let r = &result.parameters[0];
        let off = (r.value - 20.0).abs() / r.sd.unwrap();
        let is_named = result.warnings.iter().any(|w| w.contains("`r` would be") && w.contains("`depth` could leave"));
        assert!(off > 4.0 && is_named, "{off} {:?}", result.warnings);
    }
}

/// A sphere whose radius varies smoothly from place to place by `bumps`, beside white noise.
fn bumpy(bumps: f64, noise: f64, seed: u64) -> Scan {
    let mut scan = scan_of(&simple(Simple::Sphere, &[37.0]), &[37.0], noise, 1500, seed);
    let mut random = ChaCha8Rng::seed_from_u64(1000 + seed);
    let centres: Vec<(DVec3, f64)> = (0..300)
        .map(|_| {
            let p = DVec3::from_array([(); 3].map(|()| random.random_range(-1.0..1.0)));
            (p.normalize_or(DVec3::X), random.random_range(-1.0..1.0))
        })
        .collect();
    for p in &mut scan.mesh.positions {
        let at = DVec3::from_array(*p);
        let n = at.normalize();
        // Hills of some 4 mm.
        let hill: f64 = centres.iter().map(|(c, height)| height * (-(n.distance(*c) / 0.1).powi(2)).exp()).sum();
        *p = (at + n * (bumps * hill)).to_array();
    }
    scan
}

#[test]
fn standard_deviations_are_those_of_repeated_scans() {
    for (bumps, noise) in [(0.0, 0.05), (0.1, 0.02)] {
        let count = repeats(16, 60);
        let runs: Vec<FitResult> = (0..count).map(|seed| fitted(&bumpy(bumps, noise, seed), &still())).collect();
        let values: Vec<f64> = runs.iter().map(|r| r.parameters[0].value).collect();
        let stated: Vec<f64> = runs.iter().map(|r| r.parameters[0].sd.unwrap()).collect();
        let (found, (stated, _)) = (spread(&values).1, spread(&stated));
        // Block sums are less certain: by some 15 %.
        let ratio = stated / found;
        let ratios = if bumps > 0.0 { [ratio / 1.15, ratio * 1.15] } else { [ratio; 2] };
        assert!(
            ratios.iter().any(|ratio| ratio_of_spreads(count).contains(ratio)),
            "{bumps}: stated {stated}, found {found}"
        );
        let points = runs[0].scan.points.max(1500) as f64;
        let effective = runs[0].covariance.as_ref().unwrap().effective_points;
        // What independent residuals would give is far too small where they are not.
        assert_eq!(effective < 0.4 * points, bumps > 0.0, "{bumps}: {effective} of {points}");
    }
}

#[test]
fn a_held_value_is_contradicted_where_it_is_wrong() {
    let truth = [36.0, 60.0];
    let scan = scan_of(&simple(Simple::Cylinder, &truth), &truth, 0.05, 2000, 4);
    let test = |held: f64| {
        let options = FitOptions { start: [("a".to_owned(), held)].into(), fixed: vec!["a".to_owned()], ..still() };
        let result = fit(&simple(Simple::Cylinder, &[30.0, 58.0]), &scan, &options, &Silent).unwrap();
        assert_eq!(result.parameters[0].value, held);
        assert_eq!(result.parameters[0].without_sd, Some(WithoutSd::Fixed));
        result.tests[0].clone()
    };
    let (right, wrong) = (test(36.0), test(36.02));
    assert!(right.p > 0.001 && right.degrees == 1, "{right:?}");
    // Twenty standard errors of 0.05 / sqrt(2000).
    assert!(wrong.p < 1e-10 && (wrong.free[0] - 36.0).abs() < 0.01, "{wrong:?}");
}

#[test]
fn tied_parameters_stay_equal_and_others_cannot_be_tied() {
    let truth = [47.0, 47.0];
    let scan = scan_of(&simple(Simple::Cylinder, &truth), &truth, 0.05, 2000, 5);
    let model = simple(Simple::Cylinder, &[40.0, 60.0]);
    let tie = |names: [&str; 2]| FitOptions { equal: vec![names.map(str::to_owned).into()], ..still() };
    let result = fit(&model, &scan, &tie(["a", "b"]), &Silent).unwrap();
    let [a, b] = [0, 1].map(|i| &result.parameters[i]);
    assert!(a.value == b.value && (a.value - 47.0).abs() < 0.02 && a.sd == b.sd, "{result:?}");
    assert!(matches!(fit(&model, &scan, &tie(["a", "a"]), &Silent), Err(FitError::Equal(..))));
    assert!(matches!(fit(&model, &scan, &tie(["a", "c"]), &Silent), Err(FitError::UnknownParameter { .. })));
}

#[test]
fn equal_parameters_have_values_within_the_bounds_of_both() {
    let truth = [47.0, 47.0];
    let scan = scan_of(&simple(Simple::Cylinder, &truth), &truth, 0.05, 2000, 5);
    let tie = FitOptions { equal: vec![vec!["a".to_owned(), "b".to_owned()]], ..still() };
    let fitted = |bounds: [(f64, f64); 2], start: &[(&str, f64)]| {
        let mut model = simple(Simple::Cylinder, &[40.0, 60.0]);
        (0..2).for_each(|i| model.set_bounds(i, bounds[i].0, bounds[i].1));
        let start = start.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        fit(&model, &scan, &FitOptions { start, ..tie.clone() }, &Silent)
    };
    let result = fitted([(1.0, 48.0), (46.0, 99.0)], &[]).unwrap();
    assert!((result.parameters[0].value - 47.0).abs() < 0.02, "{result:?}");
    let error = fitted([(1.0, 44.0), (46.0, 99.0)], &[]).unwrap_err();
    assert!(matches!(error, FitError::NoCommonValue { .. }), "{error}");
    assert!(error.to_string().ends_with(": `a` 1 mm to 44 mm, `b` 46 mm to 99 mm"), "{error}");
}

#[test]
fn a_start_that_prevents_a_common_value_is_named() {
    let scan = scan_of(&simple(Simple::Cylinder, &[47.0, 47.0]), &[47.0, 47.0], 0.05, 2000, 5);
    let rows = ["a", "b", "c"].map(|name| (name, Quantity::Length, if name == "b" { 40.0 } else { 1.0 }, 99.0, 45.0));
    let mut model = Handmade::new(Simple::Cylinder, &rows, &[("all", &[0, 1])]);
    // `a` is at most `c`.
    model.below.push((0, 2));
    let tie = FitOptions { equal: vec![vec!["a".to_owned(), "b".to_owned()]], ..still() };
    let from = |start: &[(&str, f64)], fixed: &[&str]| {
        let start = start.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        let fixed = fixed.iter().map(|name| (*name).to_owned()).collect();
        fit(&model, &scan, &FitOptions { start, fixed, ..tie.clone() }, &Silent)
    };
    assert!(from(&[], &[]).is_ok());
    let error = from(&[("a", 20.0), ("c", 30.0)], &[]).unwrap_err().to_string();
    assert!(error.contains("where `c` = 30 mm") && error.contains("the given start values prevent it"), "{error}");
    let error = from(&[("a", 20.0), ("c", 30.0)], &["c"]).unwrap_err().to_string();
    assert!(error.contains("`c` = 30 mm (fixed)") && !error.contains("prevent it"), "{error}");
}

/// A sphere whose radius is the sum of two parameters.
struct Sum;

impl Formula for Sum {
    fn surface<T: Number>(&self, _: usize, x: &[T], u: T, v: T) -> [T; 3] {
        Simple::Sphere.surface(0, &[x[0] + x[1]], u, v)
    }
}

#[test]
fn a_combination_that_the_scan_does_not_determine_is_named() {
    let scan = scan_of(&simple(Simple::Sphere, &[37.0]), &[37.0], 0.05, 1000, 6);
    let rows = [("a", Quantity::Length, 1.0, 99.0, 20.0), ("b", Quantity::Length, 1.0, 99.0, 18.0)];
    let model = Handmade::new(Sum, &rows, &[("all", &[0, 1])]);
    let result = fit(&model, &scan, &still(), &Silent).unwrap();
    assert!((result.parameters[0].value + result.parameters[1].value - 37.0).abs() < 0.01, "{result:?}");
    let reason = Some(WithoutSd::NotDetermined);
    assert!(result.parameters.iter().all(|p| p.sd.is_none() && p.without_sd == reason), "{result:?}");
    let named = result.warnings.iter().any(|w| w.contains("combination") && w.contains("`a`") && w.contains("`b`"));
    assert!(named, "{:?}", result.warnings);
}

#[test]
fn a_parameter_that_moves_nothing_says_so() {
    let scan = scan_of(&simple(Simple::Sphere, &[37.0]), &[37.0], 0.05, 1000, 6);
    let rows = [("a", Quantity::Length, 1.0, 99.0, 35.0), ("idle", Quantity::Length, 1.0, 99.0, 18.0)];
    let model = Handmade::new(Simple::Sphere, &rows, &[("all", &[0, 1])]);
    let result = fit(&model, &scan, &still(), &Silent).unwrap();
    let reasons: Vec<Option<WithoutSd>> = result.parameters.iter().map(|p| p.without_sd).collect();
    assert_eq!(reasons, [None, Some(WithoutSd::NoInfluence)]);
    let json = serde_json::to_value(&result.parameters).unwrap();
    assert_eq!((json[0].get("without_sd"), &json[1]["without_sd"]), (None, &"no influence".into()));
}

#[test]
fn reasons_are_written_as_they_are_shown() {
    use WithoutSd::{AtBound, Fixed, InPose, Interrupted, NoInfluence, NotConverged, NotDetermined, NotScanned};
    for reason in [Fixed, AtBound, NoInfluence, InPose, NotScanned, NotDetermined, NotConverged, Interrupted] {
        assert_eq!(serde_json::to_value(reason).unwrap(), reason.text());
    }
}

#[test]
fn bounded_losses_ignore_what_squares_do_not() {
    let mut scan = scan_of(&simple(Simple::Sphere, &[37.0]), &[37.0], 0.05, 1500, 7);
    for p in scan.mesh.positions.iter_mut().step_by(20) {
        *p = (DVec3::from_array(*p) * 1.1).to_array();
    }
    let off = |loss| (fitted(&scan, &FitOptions { loss, ..still() }).parameters[0].value - 37.0).abs();
    for loss in [LossKind::Welsch, LossKind::Tukey] {
        assert!(off(loss) < 0.01, "{loss:?}: {}", off(loss));
    }
    // One point in twenty is 3.7 mm off: 0.185 mm on average.
    assert!((off(LossKind::Squared) - 0.185).abs() < 0.02, "{}", off(LossKind::Squared));
    let huber = off(LossKind::Huber);
    assert!(huber > 0.002 && huber < 0.05, "{huber}");
}

#[test]
fn an_interrupted_fit_has_the_best_so_far() {
    let scan = scan_of(&simple(Simple::Torus, &[47.0, 9.0]), &[47.0, 9.0], 0.05, 3000, 9);
    let model = simple(Simple::Torus, &[40.0, 12.0]);
    let result = fit(&model, &scan, &FitOptions::default(), &Until::asked(16)).unwrap();
    assert!(result.interrupted && !result.converged && result.parameters.len() == 2, "{result:?}");
    assert!(result.warnings.iter().any(|w| w.contains("interrupted")), "{result:?}");
    assert!(result.parameters.iter().all(|p| p.without_sd == Some(WithoutSd::Interrupted)), "{result:?}");
    let whole = fit(&model, &scan, &FitOptions::default(), &Silent).unwrap();
    assert!(!whole.interrupted && !whole.trace.is_empty());
    assert!(whole.trace.windows(2).all(|pair| pair[0].evaluations <= pair[1].evaluations));
}

#[test]
fn a_scan_without_points_is_refused() {
    let scan = Scan { mesh: TriangleMesh::default(), ..bumpy(0.0, 0.1, 1) };
    let model = simple(Simple::Sphere, &[38.0]);
    assert!(matches!(fit(&model, &scan, &still(), &Silent), Err(FitError::EmptyScan { .. })));
}
