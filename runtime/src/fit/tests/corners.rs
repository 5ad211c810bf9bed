//! Facets, foot points and fits of surfaces with corners, from compiled scripts.

use super::cup::scan_of;
use super::shapes;
use crate::fit::correspond::layout::Layout;
use crate::fit::correspond::nearest::Query;
use crate::fit::{FitOptions, fit};
use crate::model::{Instance, Model};
use crate::progress::Silent;
use glam::{DVec2, DVec3};
use gml_compiler::program::Program;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn program(model: &str) -> Program {
    shapes::program(&format!(
        "use std.polyline (polyline, rectangle, regular_polygon)\nuse std.surface (revolve)\n\
         use std.sweep (extrude, prism)\nuse std.vector (polar2)\nmodel m {{\n{model}\n}}"
    ))
}

fn points(instance: &dyn Instance, patch: usize, count: usize, rng: &mut ChaCha8Rng) -> Vec<DVec3> {
    let (u, v): (Vec<f64>, Vec<f64>) =
        (0..count).map(|_| (rng.random_range(0.0..1.0), rng.random_range(0.0..1.0))).unzip();
    let mut points = vec![[0.0; 3]; count];
    instance.points(patch, &u, &v, &mut points).unwrap();
    points.into_iter().map(DVec3::from_array).collect()
}

/// The largest distance of a model's surface from facets that are to be so near, and what they say of themselves.
fn off(model: &str, tolerance: f64) -> (f64, f64) {
    let program = program(model);
    let instance = Model::instantiate(&program, &[]).unwrap();
    let layout = Layout::new(&program, &*instance, tolerance, 100.0);
    let facets = layout.facets(&*instance);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let all = (0..program.parts().len()).flat_map(|patch| points(&*instance, patch, 20_000, &mut rng));
    (all.map(|p| facets.distance(p, 100.0)).fold(0.0, f64::max), layout.sagitta)
}

#[test]
fn facets_do_not_cut_corners() {
    let shaft = "[(5mm, 0mm), (5mm, 10mm), (8mm, 10mm), (8mm, 25mm), (6mm, 25mm), (6mm, 40mm)]";
    let teeth = "for i in 0..60 { polar2(10mm + (i % 3) * 1mm, i * 6deg) }";
    let flat = [
        "part a = prism(rectangle(40mm, 20mm), 5mm)".to_owned(),
        "part a = prism(regular_polygon(5, 20mm), 5mm)".to_owned(),
        format!("part a = prism(polyline({teeth}, closed: true), 5mm)"),
        "part a = |u: real, v: real| (u * 40mm, v * 10mm, floor(6.5 * u) * 3mm)".to_owned(),
    ];
    for model in flat {
        let (distance, sagitta) = off(&model, 0.05);
        assert!(distance < 1e-9 && sagitta < 1e-9, "{model}: {distance}, {sagitta}");
    }
    let curved = [
        format!("part a = revolve(polyline({shaft}))"),
        "part a = prism(rectangle(40mm, 20mm, radius: 2mm), 5mm)".to_owned(),
        "part a = |u: real, v: real| (u * 40mm, v * 10mm, abs(sin(u * 500deg)) * 5mm)".to_owned(),
    ];
    for model in curved {
        let (distance, sagitta) = off(&model, 0.05);
        // Beyond second order a tenth of it.
        assert!(distance < 1.1 * sagitta && distance < 0.055, "{model}: {distance}, {sagitta}");
    }
}

/// The distance from the wall of a prism of a height over a rectangle about the origin.
fn from_wall(half: DVec2, height: f64, q: DVec3) -> f64 {
    let beyond = q.truncate().abs() - half;
    let flat = if beyond.max_element() > 0.0 { beyond.max(DVec2::ZERO).length() } else { -beyond.max_element() };
    flat.hypot((-q.z).max(q.z - height).max(0.0))
}

#[test]
fn feet_around_corners_are_exact() {
    let program = program("part a = extrude(rectangle(40mm, 20mm), 5mm)");
    let instance = Model::instantiate(&program, &[]).unwrap();
    let layout = Layout::new(&program, &*instance, 0.01, 50.0);
    let facets = layout.facets(&*instance);
    let half = DVec2::new(20.0, 10.0);
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    for size in [1e-3, 0.1, 1.0, 5.0] {
        for k in 0..5000 {
            let at = |rng: &mut ChaCha8Rng| rng.random_range(-1.0..1.0) * size;
            let corner = DVec2::new(if k & 1 == 0 { 20.0 } else { -20.0 }, if k & 2 == 0 { 10.0 } else { -10.0 });
            let q = DVec3::new(corner.x + at(&mut rng), corner.y + at(&mut rng), 2.5 + 4.0 * at(&mut rng));
            let near = facets.nearest(Query::new(q, 50.0)).unwrap();
            let expected = from_wall(half, 5.0, q);
            let beyond = (q.truncate().abs() - half).max_element() > 0.0;
            // From outside the walk goes around the corner, too; 0.02 is 2.4 mm.
            for aside in if beyond { &[0.0, 1e-7, 1e-4, -1e-4, 0.02, -0.02][..] } else { &[0.0] } {
                let uv = [near.uv[0] + aside, near.uv[1]];
                let foot = layout.grid(0).feet(&*instance, 0, &[q], &[uv], 1e-7).unwrap()[0];
                let d = foot.d2.sqrt();
                assert!((d - expected).abs() < 1e-9, "{q} from {aside} aside: {d}, not {expected}");
            }
        }
    }
}

#[test]
fn prisms_over_polygons_are_found() {
    for n in [3, 5, 8] {
        let model = program(&format!(
            "param radius: length in 10mm..40mm = 18mm\nparam height: length in 5mm..60mm = 25mm\n\
             part a = prism(regular_polygon({n}, radius), height)"
        ));
        let truth = [21.0, 30.0];
        let scan = scan_of(&model, &truth, 0.05, 6000, 4);
        let result = fit(&model, &scan, &FitOptions::default(), &Silent).unwrap();
        for (p, truth) in result.parameters.iter().zip(truth) {
            let sd = p.sd.unwrap();
            assert!((p.value - truth).abs() < 4.0 * sd && sd < 0.01, "{n}: {} = {} with sd {sd}", p.name, p.value);
        }
        assert!(result.inliers > 0.95, "{n}: {}", result.inliers);
    }
}
