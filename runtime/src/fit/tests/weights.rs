//! Points that count by the area that they stand for: one object in several meshes.

use super::cup::synthetic;
use super::shapes::{Simple, simple};
use super::vessel::{Lines, denser, even, meshed, vessel};
use crate::fit::monitor::Monitor;
use crate::fit::problem::Problem;
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::{Evaluation, Objective, Order};
use crate::fit::problem::points::Points;
use crate::fit::{FitOptions, FitResult, Weights, fit};
use crate::progress::Silent;
use crate::repeats::{ratio_of_spreads, repeats};
use crate::scan::Scan;

/// Meshes of about the same resolution everywhere; with long thin triangles and few vertices on the flat parts; and
/// with a lower half that is much finer than the rest.
fn meshes() -> [[Lines; 3]; 3] {
    [
        [[even(80), even(32)], [even(60), even(13)], [even(60), even(13)]],
        [[even(120), even(12)], [even(24), even(5)], [even(24), even(5)]],
        [[even(80), denser(60)], [even(60), denser(40)], [even(60), even(13)]],
    ]
}

fn options(weights: Weights) -> FitOptions {
    let fixed = ["dome", "bulge"].map(str::to_owned).into();
    FitOptions { no_pose: true, fixed, weights, ..FitOptions::default() }
}

fn fitted(scan: &Scan, options: &FitOptions) -> FitResult {
    fit(&vessel(0.0, 0.0), scan, options, &Silent).unwrap()
}

/// The radius or the height with its standard deviation.
fn value(result: &FitResult, i: usize) -> (f64, f64) {
    (result.parameters[i].value, result.parameters[i].sd.unwrap())
}

#[test]
fn one_object_has_one_fit_however_it_is_meshed() {
    let object = vessel(0.6, 0.5);
    let by = |weights| meshes().map(|lines| fitted(&meshed(&object, &lines, 0.02, 1), &options(weights)));
    let largest = |results: &[FitResult; 3], i: usize| {
        let (first, sd) = value(&results[0], i);
        results[1..].iter().map(|r| (value(r, i).0 - first).abs() / sd).fold(0.0, f64::max)
    };
    let [area, points] = [Weights::Area, Weights::Points].map(by);
    for i in 0..2 {
        assert!(largest(&area, i) < 1.0, "{i}: {}", largest(&area, i));
    }
    // By their number, the points of the finer parts decide how the misfit is shared.
    for i in 0..2 {
        let (by_area, by_number) = (largest(&area, i), largest(&points, i));
        assert!(by_number > 2.0 * by_area, "{i}: {by_number} {by_area}");
    }
    assert!(area.iter().all(|r| r.weights == Weights::Area && r.inliers > 0.9));
}

#[test]
fn a_table_of_two_triangles_does_not_outweigh_the_object() {
    let scan = meshed(&vessel(0.0, 0.0), &meshes()[0], 0.05, 2);
    let mut with_table = scan.clone();
    let mesh = &mut with_table.mesh;
    let first = mesh.positions.len() as u32;
    // Four times the area of the object.
    for [x, y] in [[-200.0, -200.0], [200.0, -200.0], [200.0, 200.0], [-200.0, 200.0]] {
        mesh.positions.push([x, y, -30.0]);
        mesh.normals.push([0.0, 0.0, 1.0]);
    }
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    let [alone, beside] = [scan, with_table].map(|scan| fitted(&scan, &options(Weights::Area)));
    // Each of the four corners counts for 1 / sqrt(4317) of the scan.
    assert!(alone.inliers > 0.98 && (0.92..0.95).contains(&beside.inliers), "{} {}", alone.inliers, beside.inliers);
    for i in 0..2 {
        let ((a, sd), (b, _)) = (value(&alone, i), value(&beside, i));
        assert!((a - b).abs() < 0.5 * sd, "{i}: {a} {b} {sd}");
    }
}

#[test]
fn standard_deviations_allow_for_unequal_weights() {
    let count = repeats(40, 200);
    let truth = [47.0, 12.0];
    let object = simple(Simple::Torus, &truth);
    let lines = [[denser(30), even(12)]];
    let still = FitOptions { no_pose: true, ..FitOptions::default() };
    let fitted = |seed| fit(&object, &meshed(&object, &lines, 0.05, seed), &still, &Silent).unwrap();
    let runs: Vec<FitResult> = (0..count).map(fitted).collect();
    for i in 0..2 {
        let values: Vec<f64> = runs.iter().map(|r| value(r, i).0).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let found = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64).sqrt();
        let of_runs = |sd: &dyn Fn(&FitResult) -> f64| {
            (runs.iter().map(|r| sd(r).powi(2)).sum::<f64>() / runs.len() as f64).sqrt()
        };
        let (stated, naive) = (of_runs(&|r| value(r, i).1), of_runs(&|r| r.covariance.as_ref().unwrap().naive[i]));
        // Four of its own standard deviations.
        assert!((mean - truth[i]).abs() < 4.0 / (count as f64).sqrt() * found, "{i}: {mean}");
        assert!(ratio_of_spreads(count).contains(&(stated / found)), "{i}: stated {stated}, found {found}");
        assert!(ratio_of_spreads(count).contains(&(naive / found)), "{i}: naive {naive}, found {found}");
    }
    // Kish's number for these areas.
    let expected = Points::of(&meshed(&object, &lines, 0.0, 0), Weights::Area).effective();
    let effective = runs[0].covariance.as_ref().unwrap().effective_points;
    assert!(expected < 0.7 * 403.0 && (effective / expected - 1.0).abs() < 0.05, "{effective} {expected}");
}

#[test]
fn the_bootstrap_agrees_with_the_sandwich_for_unequal_weights() {
    let lines = [[even(24), denser(12)], [even(12), denser(5)], [even(8), even(2)]];
    // Noise along the normals has no bias; that of noise in all directions is not to be part of the comparison.
    let scan = Scan { noise: 0.0, ..meshed(&vessel(0.0, 0.0), &lines, 0.05, 5) };
    let result = fitted(&scan, &FitOptions { bootstrap: 200, ..options(Weights::Area) });
    for (i, drawn) in result.bootstrap.as_ref().unwrap().parameters.iter().enumerate() {
        let ratio = drawn.sd / value(&result, i).1;
        assert!((0.8..1.25).contains(&ratio), "{}: {ratio}", drawn.name);
    }
}

/// The objective's sums over some points of a scan of the vessel.
fn evaluated(of: impl Fn(&Points) -> Points) -> Evaluation {
    let scan = meshed(&vessel(0.6, 0.5), &meshes()[1], 0.05, 3);
    let (model, options, monitor) = (vessel(0.0, 0.0), FitOptions::default(), Monitor::default());
    let problem = Problem::new(&model, &scan, &options, &monitor).unwrap();
    let level = problem.start_level().unwrap();
    let points = of(&problem.points);
    let objective = Objective { tolerance: 1e-9, curved: true, ..level.objective(&points, Loss::welsch(0.7)) };
    let at = level.space.estimate(&[40.2, 100.3, 0.1, 0.0], Isometry::IDENTITY);
    objective.evaluate(&at, Order::Normal).unwrap()
}

#[test]
fn a_weight_counts_as_often_as_its_point_would() {
    let times = |i: usize| i % 4;
    let weighted = evaluated(|points| {
        let priors = (0..points.len()).map(|i| times(i) as f64).collect();
        points.clone().with_priors(priors)
    });
    let repeated = evaluated(|points| {
        let alike = points.clone().with_priors(Vec::new());
        alike.pick((0..points.len()).flat_map(|i| std::iter::repeat_n(i, times(i))))
    });
    assert!((weighted.value - repeated.value).abs() < 1e-13 * repeated.value);
    assert!((&weighted.gradient - &repeated.gradient).amax() < 1e-12 * repeated.gradient.amax());
    assert!((&weighted.normal - &repeated.normal).amax() < 1e-12 * repeated.normal.amax());
    for (w, r) in weighted.patches.iter().zip(&repeated.patches) {
        assert!((w.inliers - r.inliers).abs() < 1e-9 && (w.d2 - r.d2).abs() < 1e-11 * r.d2, "{w:?} {r:?}");
    }
}

#[test]
fn few_points_stand_for_all() {
    let prior: Vec<f64> = (0..1000).map(|i| 0.5 + f64::from(i % 7)).collect();
    let all = Points::of(&synthetic(0.3, 1000, 12), Weights::Points);
    for all in [all.clone(), all.with_priors(prior)] {
        let few = all.standing_for_all(90);
        assert!(few.len() > 70 && few.len() <= 90, "{}", few.len());
        assert!((few.weight() / all.weight() - 1.0).abs() < 1e-12, "{} {}", few.weight(), all.weight());
        let in_all = |i: usize| all.index.iter().position(|j| *j == few.index[i]).unwrap();
        let share = |i: usize| few.prior(i) / all.prior(in_all(i));
        assert!((1..few.len()).all(|i| (share(i) / share(0) - 1.0).abs() < 1e-12));
        let both = few.clone().and(&all.standing_for_all(30));
        assert!((both.weight() / all.weight() - 2.0).abs() < 1e-12, "{}", both.weight());
    }
}

#[test]
fn weights_of_one_change_no_bit() {
    let [none, one] = [false, true]
        .map(|one| evaluated(|points| points.clone().with_priors(vec![1.0; if one { points.len() } else { 0 }])));
    assert_eq!((none.value, &none.gradient, &none.normal), (one.value, &one.gradient, &one.normal));
    assert_eq!(none.patches, one.patches);
}
