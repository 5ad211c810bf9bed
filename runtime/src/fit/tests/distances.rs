//! Distances against closed formulas.

use super::cup::{SYNTHETIC, synthetic};
use super::shapes::{Simple, beginning_at, cup, simple};
use crate::fit::correspond::layout::Layout;
use crate::fit::correspond::nearest::Query;
use crate::fit::monitor::Monitor;
use crate::fit::problem::Problem;
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::{Objective, Order, foot_cache};
use crate::model::Model;
use glam::{DVec2, DVec3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SIZE: f64 = 100.0;

/// The distance from q to a shape of size 100.
fn truth(shape: Simple, x: &[f64], q: DVec3) -> f64 {
    let radial = DVec2::new(q.x, q.y).length();
    let segment = |a: DVec2, b: DVec2| {
        let p = DVec2::new(radial, q.z);
        let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        p.distance(a + (b - a) * t)
    };
    match shape {
        Simple::Sphere => (q.length() - x[0]).abs(),
        Simple::Cylinder => segment(DVec2::new(x[0], 0.0), DVec2::new(x[0], x[1])),
        Simple::Plane => {
            let out = |a: f64| (a.abs() - x[0] / 2.0).max(0.0);
            DVec3::new(out(q.x), out(q.y), q.z).length()
        }
        Simple::Cone => segment(DVec2::new(x[0], 0.0), DVec2::new(0.0, x[1])),
        Simple::Torus => (DVec2::new(radial - x[0], q.z).length() - x[1]).abs(),
    }
}

#[test]
fn distances_are_those_of_the_exact_surface_whatever_the_facets() {
    let cases: [(Simple, &[f64]); 5] = [
        (Simple::Sphere, &[50.0]),
        (Simple::Cylinder, &[30.0, 100.0]),
        (Simple::Plane, &[100.0]),
        (Simple::Cone, &[40.0, 100.0]),
        (Simple::Torus, &[40.0, 12.0]),
    ];
    for (shape, x) in cases {
        let model = simple(shape, x);
        let instance = model.instantiate(x).unwrap();
        for tolerance in [5.0, 0.5, 0.05] {
            let layout = Layout::new(&model, &*instance, tolerance, SIZE);
            let facets = layout.facets(&*instance);
            let mut rng = ChaCha8Rng::seed_from_u64(5);
            for _ in 0..2000 {
                // Near enough that the facets' own error (of `tolerance`) cannot choose the wrong side.
                let at = |rng: &mut ChaCha8Rng| rng.random_range(0.0..1.0);
                let (u, v) = (at(&mut rng), at(&mut rng));
                let mut p = [[0.0; 3]];
                instance.points(0, &[u], &[v], &mut p).unwrap();
                let off = DVec3::new(at(&mut rng) - 0.5, at(&mut rng) - 0.5, at(&mut rng) - 0.5) * 8.0;
                let q = DVec3::from_array(p[0]) + off;
                let near = facets.nearest(Query::new(q, 50.0)).unwrap();
                let foot = layout.grid(0).feet(&*instance, 0, &[q], &[near.uv], 1e-7).unwrap()[0];
                let (d, expected) = (foot.d2.sqrt(), truth(shape, x, q));
                assert!((d - expected).abs() < 1e-9 * SIZE, "{shape:?} {tolerance} at {q}: {d}, not {expected}");
            }
        }
    }
}

#[test]
fn searches_that_are_left_out_change_nothing() {
    let model = cup();
    let scan = synthetic(0.3, 4000, 12);
    let x = SYNTHETIC;
    let (options, monitor) = (beginning_at(&model, &x), Monitor::default());
    let problem = Problem::new(&model, &scan, &options, &monitor).unwrap();
    let level = problem.start_level().unwrap();
    let points = &problem.points;
    let signs = [1; 4];
    let objective = |cache| Objective {
        tolerance: 1e-8,
        cache: Some(cache),
        signs: Some(&signs),
        ..level.objective(points, Loss::welsch(2.0))
    };
    let (cache, empty) = (foot_cache(points, 2.0), || foot_cache(points, 2.0));
    let mut at = level.space.estimate(&x, Isometry::IDENTITY);
    // Steps as at the end of a fit, then some that are too long for anything to be known.
    for step in [0.0, 0.05, -0.03, 0.002, 0.001, 1.0, -2.0, 0.01] {
        let y: Vec<f64> = (0..15).map(|k| step * (f64::from(k % 5) - 2.0) / 2.0).collect();
        at = level.space.retract(&at, &y);
        let known = objective(cache.clone()).evaluate(&at, Order::Gradient).unwrap();
        let fresh = objective(empty()).evaluate(&at, Order::Gradient).unwrap();
        // Feet are exact to 1e-8 mm; where one differs, a point's loss of up to 1 does, over 4000.
        assert!((known.value - fresh.value).abs() < 1e-7, "{step}: {} {}", known.value, fresh.value);
        assert!((&known.gradient - &fresh.gradient).amax() < 1e-6, "{step}");
        let feet = |cache| {
            let objective = objective(cache);
            objective.feet(&objective.place(&at).unwrap())
        };
        let (known, fresh) = (feet(cache.clone()), feet(empty()));
        assert_eq!(known.len(), fresh.len());
        for ((i, known), (j, fresh)) in known.iter().zip(&fresh) {
            assert!(i == j && (known.d2.sqrt() - fresh.d2.sqrt()).abs() < 1e-6, "{step}: {i} {j} {known:?} {fresh:?}");
        }
    }
}
