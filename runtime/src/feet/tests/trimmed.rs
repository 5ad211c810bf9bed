//! Distances from trimmed parts: against closed formulas, and against those from a fine mesh.

use super::{compiled, places, with_target};
use crate::bvh::Bvh;
use crate::feet::signed::{MeshSurface, Place, Target};
use crate::model::{Fineness, Model, Motion, Tessellation};
use glam::{DVec2, DVec3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Random points of a cube about the origin.
fn points(count: usize, half: f64) -> Vec<DVec3> {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut at = || rng.random_range(-half..half);
    (0..count).map(|_| DVec3::new(at(), at(), at())).collect()
}

fn compare(text: &str, points: &[DVec3], truth: impl Fn(DVec3) -> f64) {
    with_target(&compiled(text), Motion::IDENTITY, |target, _| {
        for (p, foot) in points.iter().zip(target.feet(&places(points), 1000.0)) {
            let (found, truth) = (foot.expect("it is near").distance, truth(*p));
            // Where surfaces cross, the second one ends a millionth of a millimetre from the first.
            assert!((found - truth).abs() < 3e-6, "{text} at {p}: {found}, not {truth}");
        }
    });
}

/// The signed distance from a rectangle.
fn from_rectangle(p: DVec2, low: DVec2, high: DVec2) -> f64 {
    let off = (low - p).max(p - high);
    off.max(DVec2::ZERO).length() + off.max_element().min(0.0)
}

/// Compares distances from a ring of 6 mm height, in a cube of a half side, with those from its profile.
fn compare_ring(outer: f64, inner: f64, half: f64) {
    let text = format!(
        "use std.solid (capped_cylinder)\nmodel m {{ part p = capped_cylinder(radius: {outer}mm, height: 6mm)
        - {{hole: capped_cylinder(radius: {inner}mm, height: 6mm)}} }}"
    );
    compare(&text, &points(4000, half), |p| {
        from_rectangle(DVec2::new(p.x.hypot(p.y), p.z), DVec2::new(inner, 0.0), DVec2::new(outer, 6.0))
    });
}

#[test]
fn distances_from_a_washer_are_those_of_its_profile() {
    compare_ring(20.0, 5.0, 24.0);
}

#[test]
fn a_thin_rim_between_the_lines_of_the_facets_is_found() {
    compare_ring(40.0, 39.6, 42.0);
}

#[test]
fn distances_from_two_balls_in_one_are_exact_to_their_common_circle() {
    let text = "use std.solid (ball)\nuse std.frame (translate)\nmodel m { part p = ball(radius: 10mm)
        + {other: ball(radius: 10mm).translate((12mm, 0mm, 0mm))} }";
    // The circle in which they meet has a radius of 8 mm about (6, 0, 0).
    compare(text, &points(4000, 20.0), |p| {
        let (a, b) = (p.length() - 10.0, p.distance(DVec3::X * 12.0) - 10.0);
        let circle = (p.y.hypot(p.z) - 8.0).hypot(p.x - 6.0);
        // Inside, the nearest point of either ball may not be there.
        let there = |centre: f64, sign: f64| {
            let along = p - DVec3::X * centre;
            let foot = along * (10.0 / along.length());
            sign * (foot.x + centre - 6.0) <= 0.0
        };
        match (a < 0.0 || b < 0.0, there(0.0, 1.0), there(12.0, -1.0)) {
            (false, true, _) if a <= b => a,
            (false, _, true) => b,
            (false, ..) => circle,
            (true, first, second) => {
                let first = if first { a.abs() } else { circle };
                let second = if second { b.abs() } else { circle };
                -first.min(second)
            }
        }
    });
}

/// Solids with edges of all kinds.
const SOLIDS: [&str; 5] = [
    "box(width: 30mm, depth: 20mm, height: 8mm) - {hole: capped_cylinder(radius: 3mm, height: 8mm)
        .translate((4mm, 2mm, 0mm))}",
    "box(width: 30mm, depth: 20mm, height: 8mm) - {slot: box(width: 10mm, depth: 30mm, height: 4mm)
        .translate((0mm, 0mm, 4mm))}",
    "capped_cylinder(radius: 8mm, height: 30mm) + {branch: capped_cylinder(radius: 5mm, height: 20mm)
        .rotate(90deg, (0, 1, 0)).translate((0mm, 0mm, 15mm))}",
    "ball(radius: 10mm) & box(width: 14mm, depth: 14mm, height: 30mm).translate((0mm, 0mm, -15mm))",
    "frustum(bottom: 12mm, top: 5mm, height: 20mm) - {cut: half_space(at: (0mm, 0mm, 12mm), normal: (0.5, 0, -1))}",
];

#[test]
fn distances_are_those_from_a_fine_mesh_of_what_is_there() {
    for solid in SOLIDS {
        let text = format!(
            "use std.solid (ball, box, capped_cylinder, frustum, half_space)\nuse std.frame (rotate, translate)
             model m {{ part p = {solid} }}"
        );
        let program = compiled(&text);
        let instance = Model::instantiate(&program, &[]).expect("it exists");
        let fineness = Fineness { chord: 0.002, ..Fineness::default() };
        let mesh = Tessellation::new(&program, &*instance, fineness).expect("it is finite").mesh;
        let bvh = Bvh::build(&mesh).expect("a mesh");
        let from_mesh = Target::Mesh(MeshSurface::new(&mesh, &bvh));
        let points = points(3000, 22.0);
        let truth = from_mesh.feet(&places(&points), 100.0);
        with_target(&program, Motion::IDENTITY, |target, _| {
            for ((p, foot), truth) in points.iter().zip(target.feet(&places(&points), 100.0)).zip(truth) {
                let (found, truth) = (foot.expect("it is near"), truth.expect("it is near"));
                // Edges of the mesh leave the curve by its chord, on either side of both surfaces.
                let off = (found.distance - truth.distance).abs();
                assert!(off < 0.008, "{solid} at {p}: {found:?}, not {truth:?}");
            }
        });
    }
}

#[test]
fn what_is_cut_away_has_no_feet() {
    let text = "use std.solid (box, capped_cylinder)\nmodel m { part p = box(width: 40mm, depth: 40mm, height: 4mm)
        - {hole: capped_cylinder(radius: 15mm, height: 4mm)} }";
    with_target(&compiled(text), Motion::IDENTITY, |target, _| {
        let above = [Place { point: DVec3::new(0.0, 0.0, 5.0), normal: Some(DVec3::Z) }];
        assert!(target.feet(&above, 14.0)[0].is_none());
        let foot = target.feet(&above, 20.0)[0].expect("the edge of the hole");
        assert!((foot.distance - 15f64.hypot(1.0)).abs() < 1e-6, "{foot:?}");
    });
}

/// A twisted loft from which a slanted box is cut: in the acute corner between both on the top the facets' edge was
/// 0.15 mm off, and the foot of a place there on another face.
#[test]
fn places_in_acute_corners_are_their_own_feet() {
    let program = compiled(
        "model m {
          let low = [(8mm, -8mm), (8mm, 8mm), (-8mm, 8mm), (-8mm, -8mm)]
          let high = [(10.93mm, -2.93mm), (2.93mm, 10.93mm), (-10.93mm, 2.93mm), (-2.93mm, -10.93mm)]
          let cut = box(width: 9mm, depth: 30mm, height: 9mm).rotate(25deg, (0.3, 1, 0.2))
          part b = lofted(low, high, 20mm) - {cut: cut.translate((3mm, 0mm, 10mm))}
        }",
    );
    let top = Model::parts(&program).iter().position(|part| part.name == "b.top").expect("a top");
    let keep = Model::keep(&program, top).expect("it is trimmed");
    with_target(&program, Motion::IDENTITY, |target, instance| {
        let at: Vec<f64> = (0..=1000).map(|k| f64::from(k) / 1000.0).collect();
        let (mut points, mut keeps) = (vec![[0.0; 3]; at.len() * at.len()], vec![[0.0; 3]; at.len() * at.len()]);
        instance.points_grid(top, &at, &at, &mut points).expect("it is finite");
        instance.points_grid(keep, &at, &at, &mut keeps).expect("it is finite");
        let corner = DVec3::new(4.7, 7.6, 20.0);
        let there = points.iter().zip(&keeps).filter(|(_, keep)| keep[0] > 1e-4).map(|(point, _)| DVec3::from(*point));
        let places: Vec<Place> = there
            .filter(|point| point.distance(corner) < 1.0)
            .map(|point| Place { point, normal: Some(DVec3::Z) })
            .collect();
        assert!(places.len() > 500, "{}", places.len());
        for (place, foot) in places.iter().zip(target.feet(&places, 2.0)) {
            let distance = foot.expect("a foot").distance;
            assert!(distance.abs() < 1e-6, "{distance} at {}", place.point);
        }
    });
}
