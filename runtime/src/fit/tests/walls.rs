//! Walls of the model that would pass through each other.

use super::shapes::program;
use crate::fit::monitor::Monitor;
use crate::fit::problem::Problem;
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::Order;
use crate::fit::problem::separation::Separation;
use crate::fit::problem::walls::Walls;
use crate::fit::refine::apart::passed;
use crate::fit::refine::schedule::Solution;
use crate::fit::refine::solve::solve;
use crate::fit::{FitOptions, fit};
use crate::model::{Fineness, Model, Tessellation};
use crate::progress::Silent;
use crate::scan::{Scan, from_mesh};
use gml_compiler::program::Program;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// A vessel whose inside is a cone that ends at a radius of `bottom`, 2 mm above the foot: beyond 30 mm it comes out.
const VESSEL: &str = "use std.surface (disc, flip, revolve)
    use std.curve (line)
    use std.frame (translate)
    model vessel {
      param radius: length in 20mm..40mm = 30mm
      param bottom: length in 10mm..40mm = 27mm
      part outside = revolve(line((radius, 0mm), (radius, 60mm)))
      part rim = revolve(line((radius, 60mm), (radius - 3mm, 60mm)))
      part inside = revolve(line((radius - 3mm, 60mm), (bottom, 2mm)))
      part floor = disc(bottom).translate((0mm, 0mm, 2mm))
      part foot = flip(disc(radius))
    }";

fn vessel() -> Program {
    program(VESSEL)
}

/// All of the surface, whatever hides it.
fn scan(bottom: f64) -> Scan {
    let program = vessel();
    let instance = Model::instantiate(&program, &[30.0, bottom]).unwrap();
    let fineness = Fineness { chord: 0.05, edge: 2.0, ..Fineness::default() };
    from_mesh(Tessellation::new(&program, &*instance, fineness).unwrap().mesh, "vessel").unwrap()
}

#[test]
fn walls_are_held_apart_that_would_pass_through_each_other() {
    let options = FitOptions { no_pose: true, ..FitOptions::default() };
    let result = fit(&vessel(), &scan(31.0), &options, &Silent).unwrap();
    let [radius, bottom] = [0, 1].map(|i| result.parameters[i].value);
    assert!((radius - 30.0).abs() < 0.2, "{radius}");
    // A thousandth of the diagonal is 0.1 mm.
    assert!(bottom > radius - 0.2 && bottom < radius + 0.1, "{bottom} and {radius}");
    assert_eq!(result.passed_through, Vec::new());
    let warning = result.warnings.iter().find(|w| w.contains("held apart")).expect("it is said");
    assert!(warning.contains("`inside`") && warning.contains("`outside`"), "{warning}");
    assert!(result.converged, "{:?}", result.warnings);
    let fitted = fit(&vessel(), &scan(28.0), &options, &Silent).unwrap();
    assert!((fitted.parameters[1].value - 28.0).abs() < 0.01);
    assert!(!fitted.warnings.iter().any(|w| w.contains("apart")), "{:?}", fitted.warnings);
}

/// The border says that the truth is not beyond it, and nothing of where before it. The inside was scanned in its upper
/// third only, so that its lower end is not so certain.
#[test]
fn walls_that_are_held_apart_are_not_more_certain_for_it() {
    let sd = |bottom: f64| {
        let program = vessel();
        let instance = Model::instantiate(&program, &[30.0, bottom]).unwrap();
        let fineness = Fineness { chord: 0.05, edge: 2.0, ..Fineness::default() };
        let mut mesh = Tessellation::new(&program, &*instance, fineness).unwrap().mesh;
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for p in &mut mesh.positions {
            p.iter_mut().for_each(|x| *x += random.random_range(-0.3..0.3));
        }
        let shown = mesh.groups.iter().flat_map(|group| {
            let triangles = &mesh.triangles[group.start..group.end];
            let is_shown = |t: &&[u32; 3]| {
                mesh.corners(**t).iter().all(|p| match group.name.as_str() {
                    "inside" => p.z > 40.0,
                    "floor" => p.truncate().length() < 20.0,
                    _ => true,
                })
            };
            triangles.iter().filter(is_shown).copied().collect::<Vec<_>>()
        });
        let scan = from_mesh(mesh.submesh(shown), "vessel").unwrap();
        let options = FitOptions { no_pose: true, ..FitOptions::default() };
        let result = fit(&program, &scan, &options, &Silent).unwrap();
        let held = result.warnings.iter().any(|w| w.contains("held apart"));
        (held, result.parameters[1].sd.expect("it is determined"))
    };
    let ((free_held, free), (held, at_border)) = (sd(28.0), sd(31.0));
    assert!(!free_held && held);
    assert!(at_border > 0.7 * free, "{at_border} and {free}");
}

#[test]
fn walls_that_stood_apart_are_looked_at_again_where_the_solution_has_moved() {
    let (program, scan, monitor) = (vessel(), scan(28.0), Monitor::default());
    let options = FitOptions { no_pose: true, ..FitOptions::default() };
    let problem = Problem::new(&program, &scan, &options, &monitor).unwrap();
    let solution = solve(&problem).unwrap();
    assert!(solution.apart_at.is_some() && passed(&solution).is_none());
    let estimate = solution.level.space.estimate(&[30.0, 31.0], Isometry::IDENTITY);
    assert!(passed(&Solution { estimate, ..solution }).is_some());
}

#[test]
fn what_has_passed_is_named_with_its_place() {
    let program = vessel();
    let instance = Model::instantiate(&program, &[30.0, 31.0]).unwrap();
    let passed = Walls::of(&program, &*instance).unwrap().passed(&program, &*instance, &Isometry::IDENTITY);
    let inside = passed.iter().find(|p| p.part == "inside").expect("the inside has come out");
    assert_eq!(inside.through, ["outside"]);
    // From z = 16.5 down to 2; places are a millimetre or two apart.
    let cone = std::f64::consts::PI * (30.0 + 31.0) * 1.0_f64.hypot(14.5);
    assert!((inside.area / cone - 1.0).abs() < 0.15, "{} of {cone}", inside.area);
    assert!((inside.depth - 1.0).abs() < 0.1, "{}", inside.depth);
    let [x, y, z] = inside.place;
    assert!((x.hypot(y) - 31.0).abs() < 0.1 && (2.0..4.0).contains(&z), "{:?}", inside.place);
}

#[test]
fn the_terms_gradient_agrees_with_differences() {
    let (program, scan, options, monitor) = (vessel(), scan(31.0), FitOptions::default(), Monitor::default());
    let problem = Problem::new(&program, &scan, &options, &monitor).unwrap();
    let level = problem.start_level().unwrap();
    let at = level.space.estimate(&[30.0, 31.0], Isometry::IDENTITY);
    let instance = Model::instantiate(&program, &[30.0, 31.0]).unwrap();
    let term = Separation { walls: Arc::new(Walls::of(&program, &*instance).unwrap()), sigma: 1.0 };
    let objective = level.objective(&problem.points, Loss::welsch(1.0));
    let evaluate = |y: &[f64], order| {
        let at = level.space.retract(&at, y);
        let placed = objective.place(&at).unwrap();
        term.evaluate(&objective, &*placed.instance, &at, order).unwrap()
    };
    let gradient = evaluate(&vec![0.0; level.space.dim()], Order::Normal).gradient;
    for k in 0..level.space.dim() {
        let value = |h: f64| {
            let mut y = vec![0.0; level.space.dim()];
            y[k] = h;
            evaluate(&y, Order::Value).value
        };
        // Places that come to be passed, or no longer are, make kinks.
        let difference = (value(0.02) - value(-0.02)) / 0.04;
        assert!((difference - gradient[k]).abs() < 0.05 * gradient.amax(), "{k}: {difference}, not {}", gradient[k]);
    }
}
