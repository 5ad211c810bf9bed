//! Gradients of the whole objective against central differences.

use super::cup::synthetic;
use super::shapes::{Simple, beginning_at, cup, simple};
use crate::fit::FitOptions;
use crate::fit::monitor::Monitor;
use crate::fit::problem::Problem;
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::{Objective, Order};
use glam::{DQuat, DVec3};
use gml_compiler::program::{Options, compile};
use gml_compiler::source::{NoFiles, SourceFile};

/// Compares all of an objective's gradient at a place, and the two ways of computing it with each other.
fn compare(objective: &Objective, x: &[f64], motion: Isometry) {
    compare_to(objective, x, motion, 1e-5);
}

/// The same, to a part of the largest derivative.
fn compare_to(objective: &Objective, x: &[f64], motion: Isometry, to: f64) {
    let at = objective.space.estimate(x, motion);
    let gradient = objective.evaluate(&at, Order::Gradient).unwrap();
    let normal = objective.evaluate(&at, Order::Normal).unwrap();
    assert!((gradient.value - normal.value).abs() < 1e-15);
    let largest = gradient.gradient.amax();
    assert!((&gradient.gradient - &normal.gradient).amax() < 1e-9 * largest);
    for k in 0..objective.space.dim() {
        let value = |h: f64| {
            let mut y = vec![0.0; objective.space.dim()];
            y[k] = h;
            objective.evaluate(&objective.space.retract(&at, &y), Order::Value).unwrap().value
        };
        // A switch of the nearest facet between the two ends shows as noise; the best of a sweep avoids it.
        let error = [3e-3, 1e-3, 3e-4, 1e-4]
            .map(|h| ((value(h) - value(-h)) / (2.0 * h) - gradient.gradient[k]).abs())
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        assert!(error < to * largest, "coordinate {k}: off by {error:e} of {largest:e}");
    }
}

/// Compares the gradient of a model at x, where facets are made, and a fiftieth beside it, to a scan of the model at
/// other values, for losses of two widths.
fn compare_with_a_scan(text: &str, x: &[f64], of_scan: &[f64], sigmas: [f64; 2], to: f64) {
    let script = SourceFile { name: "m.gml".to_owned(), text: text.to_owned() };
    let model = compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program;
    let scan = super::cup::scan_of(&model, of_scan, 0.2, 4000, 5);
    let options = FitOptions { no_pose: true, ..beginning_at(&model, x) };
    let monitor = Monitor::default();
    let problem = Problem::new(&model, &scan, &options, &monitor).unwrap();
    let level = problem.start_level().unwrap();
    for sigma in sigmas {
        let objective = Objective { tolerance: 1e-8, ..level.objective(&problem.points, Loss::welsch(sigma)) };
        // Not the same shape, larger: breaks move.
        let beside: Vec<f64> = x.iter().zip([1.02, 0.98].into_iter().cycle()).map(|(x, scale)| scale * x).collect();
        for x in [x, &beside] {
            compare_to(&objective, x, Isometry::IDENTITY, to);
        }
    }
}

#[test]
fn the_gradient_of_the_objective_agrees_with_differences() {
    let model = cup();
    let scan = synthetic(0.3, 4000, 3);
    let x = [1.0, -2.0, 3.0, 0.1, -0.2, 0.3, 2.5, 41.0, 88.0, 0.96, 1.9, 0.95, 1.8, 0.2, 0.8];
    let motion = Isometry {
        rotation: DQuat::from_scaled_axis(DVec3::new(0.1, -0.3, 0.2)),
        translation: DVec3::new(3.0, 1.0, 2.0),
    };
    for (no_pose, motion) in [(true, Isometry::IDENTITY), (false, motion)] {
        let options = FitOptions { no_pose, ..beginning_at(&model, &x) };
        let monitor = Monitor::default();
        let problem = Problem::new(&model, &scan, &options, &monitor).unwrap();
        let level = problem.start_level().unwrap();
        for sigma in [20.0, 3.0] {
            let objective = Objective { tolerance: 1e-8, ..level.objective(&problem.points, Loss::welsch(sigma)) };
            compare(&objective, &x, motion);
        }
    }
}

#[test]
fn the_gradient_of_weighted_points_agrees_with_differences() {
    let model = simple(Simple::Torus, &[40.0, 12.0]);
    let scan = super::cup::scan_of(&simple(Simple::Torus, &[43.0, 14.0]), &[43.0, 14.0], 0.1, 2000, 2);
    let (options, monitor) = (FitOptions::default(), Monitor::default());
    let problem = Problem::new(&model, &scan, &options, &monitor).unwrap();
    let level = problem.start_level().unwrap();
    let priors = (0..problem.points.len()).map(|i| 0.1 + (i % 7) as f64).collect();
    let points = problem.points.clone().with_priors(priors);
    let objective = Objective { tolerance: 1e-8, ..level.objective(&points, Loss::welsch(6.0)) };
    compare(&objective, &[40.0, 12.0], Isometry::IDENTITY);
}

#[test]
fn the_gradient_of_a_trimmed_model_agrees_with_differences() {
    // The scan is of another bolt at another place, so that many points are nearest to the edges of the hole and of the
    // boss; between them lie edges of planes, cylinders and spheres.
    let text = "use std.solid (ball, box, capped_cylinder)\nuse std.frame (translate)\nmodel m {
        param w: length in 20mm..60mm = 40mm\nparam d: length in 2mm..12mm = 6mm\nparam x: length in -9mm..9mm = 0mm
        param r: length in 4mm..12mm = 8mm
        part p = box(width: w, depth: 30mm, height: 6mm)
          - {hole: capped_cylinder(radius: d / 2, height: 6mm).translate((x, 2mm, 0mm))}
          + {boss: ball(radius: r).translate((w / 2, 0mm, 3mm))} }";
    compare_with_a_scan(text, &[40.0, 6.0, 0.0, 8.0], &[41.0, 9.0, 1.5, 7.0], [8.0, 1.5], 1e-5);
}

/// The scan is of a larger prism, so that many points are nearest to corners within the wall, whose places in u change
/// with the parameters.
#[test]
fn the_gradient_at_corners_within_a_surface_agrees_with_differences() {
    let text = "model m {
        param w: length in 20mm..60mm = 40mm\nparam d: length in 10mm..40mm = 20mm\nparam h: length in 5mm..30mm = 15mm
        part p = prism(rectangle(w, d), h).wall }";
    compare_with_a_scan(text, &[40.0, 20.0, 15.0], &[44.0, 25.0, 17.0], [8.0, 3.0], 1e-6);
}

#[test]
fn the_gradient_pulled_back_to_another_estimate_agrees_with_differences() {
    let model = cup();
    let scan = synthetic(0.3, 3000, 4);
    let x: Vec<f64> = crate::model::Model::parameters(&model).iter().map(|p| p.default).collect();
    let (options, monitor) = (FitOptions::default(), Monitor::default());
    let problem = Problem::new(&model, &scan, &options, &monitor).unwrap();
    let level = problem.start_level().unwrap();
    let objective = Objective { tolerance: 1e-8, ..level.objective(&problem.points, Loss::welsch(15.0)) };
    let from = level.space.estimate(&x, Isometry::IDENTITY);
    // Far along the coordinates, where the exponential map is no longer the identity.
    let y: Vec<f64> =
        (0..15).map(|k| if k < 9 { f64::from(k % 4) - 1.5 } else { f64::from(k % 4) * 8.0 - 10.0 }).collect();
    let mut gradient = objective.evaluate(&objective.space.retract(&from, &y), Order::Gradient).unwrap().gradient;
    objective.space.pull_to(&y, &mut gradient);
    for k in 0..15 {
        let value = |h: f64| {
            let mut y = y.clone();
            y[k] += h;
            objective.evaluate(&objective.space.retract(&from, &y), Order::Value).unwrap().value
        };
        let error = [3e-3, 1e-3, 3e-4]
            .map(|h| ((value(h) - value(-h)) / (2.0 * h) - gradient[k]).abs())
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        assert!(error < 1e-5 * gradient.amax(), "coordinate {k}: off by {error:e} of {:e}", gradient.amax());
    }
}

#[test]
fn bounds_that_depend_on_other_parameters_are_part_of_the_gradient() {
    let mut model = simple(Simple::Torus, &[40.0, 12.0]);
    // The tube's radius ends at the circle's.
    model.below.push((1, 0));
    let scan = super::cup::scan_of(&simple(Simple::Torus, &[43.0, 14.0]), &[43.0, 14.0], 0.1, 2000, 1);
    let x = [40.0, 12.0];
    let (options, monitor) = (FitOptions::default(), Monitor::default());
    let problem = Problem::new(&model, &scan, &options, &monitor).unwrap();
    let level = problem.start_level().unwrap();
    let objective = Objective { tolerance: 1e-8, ..level.objective(&problem.points, Loss::welsch(6.0)) };
    compare(&objective, &x, Isometry::IDENTITY);
}
