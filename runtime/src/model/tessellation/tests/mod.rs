//! Tests of tessellations.

mod adversary;
mod chords;
mod trimmed;

use super::*;
use crate::model::Closedness;
use gml_compiler::program::{Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use std::collections::HashMap;
use std::f64::consts::PI;

fn program(body: &str) -> Program {
    let text = format!("model m {{ {body} }}");
    let script = SourceFile { name: "m.gml".to_owned(), text: text.clone() };
    compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}\n{text}")).program
}

fn instance(program: &Program) -> Box<dyn Instance + '_> {
    let defaults: Vec<f64> = program.parameters().iter().map(|p| p.default).collect();
    Model::instantiate(program, &defaults).expect("it exists")
}

fn tessellate(program: &Program, chord: f64) -> Tessellation {
    let fineness = Fineness { chord, ..Fineness::default() };
    Tessellation::new(program, &*instance(program), fineness).expect("it can be evaluated")
}

/// Directed edges between positions that no triangle has the other way around.
fn open_edges(mesh: &TriangleMesh) -> usize {
    let number = mesh.position_numbers();
    let mut count: HashMap<(u32, u32), i32> = HashMap::new();
    for t in &mesh.triangles {
        for k in 0..3 {
            let (a, b) = (number[t[k] as usize], number[t[(k + 1) % 3] as usize]);
            *count.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    count.values().filter(|n| **n != 0).count()
}

fn volume(mesh: &TriangleMesh) -> f64 {
    let tetrahedron = |t: &[u32; 3]| {
        let [a, b, c] = mesh.corners(*t);
        a.dot(b.cross(c)) / 6.0
    };
    mesh.triangles.iter().map(tetrahedron).sum()
}

/// Solids of the library with their volumes, in cubic millimetres; `None` where there is no short formula.
const SOLIDS: [(&str, Option<f64>); 22] = [
    ("part p = box()", Some(8000.0)),
    ("part p = rounded_box()", None),
    ("part p = capped_cylinder()", Some(2000.0 * PI)),
    ("part p = frustum()", Some(PI * 20.0 / 3.0 * (100.0 + 50.0 + 25.0))),
    ("part p = pipe()", Some(50.0 * 36.0 * PI)),
    ("part p = elbow()", Some(36.0 * PI * 25.0 * PI)),
    ("part p = capsule()", Some(PI * 25.0 * 10.0 + 4.0 / 3.0 * PI * 125.0)),
    ("part p = hollow_sphere()", Some(4.0 / 3.0 * PI * (1000.0 - 512.0))),
    ("part p = sphere(10mm)", Some(4.0 / 3.0 * PI * 1000.0)),
    ("part p = torus(20mm, 5mm)", Some(2.0 * PI * PI * 20.0 * 25.0)),
    ("part p = prism(circle(10mm), 5mm)", Some(500.0 * PI)),
    ("part p = prism(rectangle(40mm, 20mm), 5mm)", Some(4000.0)),
    ("part p = prism(rectangle(40mm, 20mm, radius: 3mm), 5mm)", Some(5.0 * (800.0 - 36.0 + 9.0 * PI))),
    ("part p = prism(regular_polygon(3, 20mm), 5mm)", Some(2_598.076_211_353_316)),
    ("part p = prism(regular_polygon(5, 20mm), 5mm)", Some(4_755.282_581_475_768)),
    ("part p = prism(regular_polygon(7, 20mm), 5mm, twist: 30deg)", None),
    ("part p = bar(line((0mm, 0mm, 0mm), (0mm, 0mm, 9mm)), rectangle(4mm, 2mm))", Some(72.0)),
    ("part p = bar(|t| polar(30mm, t * 180deg, 10mm * t), regular_polygon(6, 4mm))", None),
    ("part p = thicken(cylinder(20mm, 10mm), 2mm)", None),
    ("part p = thicken(plane(20mm, 10mm), 2mm)", Some(400.0)),
    // A T-joint: the borders of the halves end in the middle of the whole.
    (
        "part a = plane(20mm, 20mm).translate((0mm, 0mm, 10mm))
         part b = plane(10mm, 20mm).translate((-5mm, 0mm, 0mm)).flip()
         part c = plane(10mm, 20mm).translate((5mm, 0mm, 0mm)).flip()
         part wall = extrude(rectangle(20mm, 20mm), 10mm)",
        Some(4000.0),
    ),
    // Seams that do not meet, and a border that runs with another speed.
    (
        "part wall = cylinder(10mm, 20mm).rotate(37deg)
         part top = disc(10mm).translate((0mm, 0mm, 20mm))
         part base = |u: real, v: real| {
           let a = 1turn * u * u
           (10mm * v * cos(a), 10mm * v * sin(a), 0mm)
         }",
        None,
    ),
];

#[test]
fn solids_are_closed_and_have_their_volume() {
    for (body, truth) in SOLIDS {
        let program = program(body);
        for chord in [0.1, 0.02] {
            let tessellation = tessellate(&program, chord);
            let mesh = &tessellation.mesh;
            assert_eq!(open_edges(mesh), 0, "{body} at {chord}");
            assert!(tessellation.chord <= chord, "{body} at {chord}: {}", tessellation.chord);
            let found = volume(mesh);
            assert!(found > 0.0, "{body}");
            if let Some(truth) = truth {
                // All of the surface off by the chord.
                let bound = mesh.area() * chord + 1e-9 * truth;
                assert!((found - truth).abs() <= bound, "{body} at {chord}: {found} for {truth}");
                let flat = ["box()", "rectangle(40mm, 20mm),", "(3, 20mm)", "(5, 20mm),", "plane"];
                let flat = flat.iter().any(|f| body.contains(f)) && !body.contains("rounded");
                assert!(!flat || (found - truth).abs() < 1e-9 * truth, "{body}: {found} for {truth}");
            }
        }
    }
}

#[test]
fn a_crease_across_u_and_v_has_two_normals() {
    let program = program("part p = |u: real, v: real| (u * 100mm, v * 50mm, abs(u - v * v) * 20mm)");
    let tessellation = tessellate(&program, 0.02);
    let mesh = &tessellation.mesh;
    for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
        // Nothing between the two sides.
        let slope = n[0] / n[2];
        assert!((slope.abs() - 0.2).abs() < 1e-3, "{p:?} {n:?}");
    }
    let on_crease = |p: &[f64; 3]| p[2] < 1e-6 && p[0] > 1.0 && p[0] < 99.0;
    let number = mesh.position_numbers();
    let crease: Vec<u32> = mesh.positions.iter().zip(&number).filter(|(p, _)| on_crease(p)).map(|(_, n)| *n).collect();
    let mut places = crease.clone();
    places.sort_unstable();
    places.dedup();
    assert!(places.len() > 5 && crease.len() == 2 * places.len(), "{} {}", places.len(), crease.len());
}

#[test]
fn what_stands_still_has_no_triangles() {
    for (body, triangles) in [
        ("part p = |u: real, v: real| (clamp(2 * u, 0, 1) * 20mm, 0mm, 10mm * v)", 2),
        ("part p = extrude(polyline([(0mm, 0mm), (10mm, 0mm), (10mm, 0mm), (20mm, 5mm)]), 10mm)", 4),
        ("part p = extrude(polyline([(0mm, 0mm), (0mm, 0mm), (10mm, 0mm), (20mm, 5mm)]), 10mm)", 4),
    ] {
        let tessellation = tessellate(&program(body), 0.02);
        assert_eq!(tessellation.mesh.triangles.len(), triangles, "{body}");
        assert!(tessellation.chord < 1e-9, "{body}: {}", tessellation.chord);
    }
    // The rim at the pole is a line.
    let program = program("part p = thicken(sphere_zone(20mm, 0deg, 90deg), 2mm, around: true)");
    let mesh = tessellate(&program, 0.1).mesh;
    assert!(mesh.groups.iter().any(|group| group.start == group.end), "{:?}", mesh.groups);
    assert_eq!(open_edges(&mesh), 0);
    assert!(mesh.triangles.iter().all(|t| mesh.triangle_area(*t) > 1e-9));
}

/// Lids whose rim leaves that of the wall everywhere but at regular places, or nearly nowhere.
#[test]
fn borders_that_differ_stay_apart() {
    let differing = (1..=10).map(|k| format!("10mm + 1mm * sin({} * 1turn * u)", 1 << k));
    for rim in differing.chain(["10mm - 3mm * exp(-(((u - 0.411) / 0.005) ^ 2))".to_owned()]) {
        let body = format!(
            "part wall = cylinder(10mm, 20mm)
             part lid = |u: real, v: real| polar((1 - v) * ({rim}), u * 1turn, 20mm)"
        );
        let program = program(&body);
        let closedness = Closedness::of(&program, &*instance(&program)).expect("it can be evaluated");
        assert_eq!(closedness.open.len(), 3, "{rim}: {:?}", closedness.open);
        if rim.contains("sin(16 *") || rim.contains("exp") {
            let triangles = tessellate(&program, 0.05).mesh.triangles.len();
            assert!(triangles < 5_000, "{rim}: {triangles}");
        }
    }
}

/// A step of a wall is two borders; a ledge between them closes it.
#[test]
fn steps_are_borders() {
    let step = "part wall = revolve(|t| (if t < 0.5 { 10mm } else { 12mm }, 20mm * t))
        part top = disc(12mm).translate((0mm, 0mm, 20mm))
        part base = flip(disc(10mm))";
    let ledge = "part ledge = annulus(10mm, 12mm).flip().translate((0mm, 0mm, 10mm))";
    for (body, open) in [(step.to_owned(), 2), (format!("{step}\n{ledge}"), 0)] {
        let program = program(&body);
        let closedness = Closedness::of(&program, &*instance(&program)).expect("it can be evaluated");
        let sides: Vec<(&str, f64)> = closedness.open.iter().map(|o| (o.side.as_str(), o.length)).collect();
        assert_eq!(sides.len(), open, "{sides:?}");
        for ((side, length), radius) in sides.into_iter().zip([10.0, 12.0]) {
            assert_eq!(side, "v = 0.5");
            assert!((length - 2.0 * PI * radius).abs() < 1e-6, "{length}");
        }
        let mesh = tessellate(&program, 0.02).mesh;
        assert_eq!(open_edges(&mesh) == 0, open == 0, "{body}");
    }
}

/// Correct bodies are not warned about, turned ones are, wherever they are; a cavity is no turned body.
#[test]
fn turned_bodies_are_named() {
    for (body, turned) in [
        ("part a = prism(superellipse(20mm, 10mm, 60), 5mm)", vec![]),
        ("part a = superellipsoid(5mm, 5mm, 5mm, 60, 60)", vec![]),
        ("part a = supertoroid(20mm, 5mm, 5mm, 2, 50)", vec![]),
        ("part a = sphere(10mm)\npart b = flip(sphere(5mm))", vec![]),
        ("part a = sphere(10mm)\npart b = flip(sphere(5mm)).translate((80mm, 0mm, 0mm))", vec![1]),
        ("part a = sphere(10mm)\npart b = sphere(5mm).scale(x: -1).translate((80mm, 0mm, 0mm))", vec![1]),
        ("part a = flip(sphere(10mm))", vec![0]),
        ("part a = hollow_sphere()", vec![]),
    ] {
        let program = program(body);
        let closedness = Closedness::of(&program, &*instance(&program)).expect("it can be evaluated");
        assert_eq!(closedness.inside_out, turned, "{body}: {:?}", closedness.open);
        assert_eq!(closedness.inverted, turned, "{body}");
    }
}

/// A crease ends on a border that the neighbour runs along with another speed, and the other way.
#[test]
fn borders_with_the_end_of_a_crease_close() {
    for (crease, speed) in [
        ("0.3 * u + 1.25 * v * v - 0.95", "1 - q * q"),
        ("0.3 * u + 1.25 * v * v - 0.95", "1 - q ^ 3"),
        ("0.3 * u + sin(v * 1rad) - 0.6", "cos(q * 90deg)"),
        ("0.3 * u + v - 0.6", "1 - q"),
    ] {
        let body = format!(
            "let f = |u: real, v: real| 10mm + 5mm * abs({crease})
             part top = |u: real, v: real| (40mm * u, 10mm * v, f(u, v))
             part base = |u: real, v: real| (40mm * u, 10mm * (1 - v), 0mm)
             part front = |q: real, v: real| (40mm * q, 0mm, v * f(q, 0.0))
             part back = |q: real, v: real| (40mm * (1 - q), 10mm, v * f(1 - q, 1.0))
             part right = |q: real, v: real| (40mm, 10mm * q, v * f(1.0, q))
             part left = |q: real, v: real| {{ let s = {speed}; (0mm, 10mm * s, v * f(0.0, s)) }}"
        );
        let program = program(&body);
        let closedness = Closedness::of(&program, &*instance(&program)).expect("it can be evaluated");
        assert_eq!((closedness.open, closedness.inside_out), (vec![], vec![]), "{crease}, {speed}");
        assert_eq!(open_edges(&tessellate(&program, 0.02).mesh), 0, "{crease}, {speed}");
    }
}

/// Seams that must be met through many parts, borders that end at another height on each wall, steps that overlap from
/// a common end, and seams a little beside each other.
#[test]
fn borders_that_meet_in_parts_close() {
    let block = "let hh = |u: real, v: real| mix(mix(8mm, 12mm, u), mix(8mm, 12mm, u), v)
        let at = |u: real, v: real| (u * 40mm, v * 30mm, hh(u, v))
        let lo = |u: real, v: real| (u * 40mm, v * 30mm, 0mm)
        let md = |u: real| (u * 40mm, 0mm, 5mm)
        part top = |u: real, v: real| at(u, v)
        part base = flip(|u: real, v: real| lo(u, v))
        part f1 = ruled(|t: real| lo(t, 0.0), |t: real| md(t))
        part f2 = ruled(|t: real| md(t), |t: real| at(t, 0.0))
        part r = ruled(|t: real| lo(1.0, t), |t: real| at(1.0, t))
        part b = ruled(|t: real| lo(1.0 - t, 1.0), |t: real| at(1.0 - t, 1.0))
        part l = ruled(|t: real| lo(0.0, 1.0 - t), |t: real| at(0.0, 1.0 - t))";
    let stairs = "let z = |u: real| 2mm * min(4.0, floor(5 * u)) + 4mm
        part top = |u: real, v: real| (50mm * u, 20mm * v, z(u))
        for i in 1..5 { part riser = |u: real, v: real| (10mm * i, 20mm * (1 - u), z(i / 5 - 0.1) + 2mm * v) }
        part base = |u: real, v: real| (50mm * u, 20mm * (1 - v), 0mm)
        part f = |u: real, v: real| (50mm * u, 0mm, z(u) * v)
        part k = |u: real, v: real| (50mm * (1 - u), 20mm, z(1 - u) * v)
        part l = |u: real, v: real| (0mm, 20mm * (1 - u), 4mm * v)
        part r = |u: real, v: real| (50mm, 20mm * u, 12mm * v)";
    let drums = "part b = flip(disc(5mm))
        part w = cylinder(5mm, 8mm).linear_pattern(10, (0mm, 0mm, 8mm))
        part t = disc(5mm).rotate(20deg).translate((0mm, 0mm, 80mm))";
    let seam = "part w = cone(0mm, 7mm, 5mm)
        part t = revolve(line((7mm, 5mm), (0mm, 9mm)), 2deg, 362deg)";
    for (body, truth, most) in
        [(block, 12_000.0, 20), (stairs, 8_000.0, 80), (drums, 2_000.0 * PI, 2_000), (seam, 49.0 * PI * 9.0 / 3.0, 500)]
    {
        let program = program(body);
        let closedness = Closedness::of(&program, &*instance(&program)).expect("it can be evaluated");
        assert_eq!((closedness.open, closedness.inside_out), (vec![], vec![]), "{body}");
        let mesh = tessellate(&program, 0.02).mesh;
        assert_eq!(open_edges(&mesh), 0, "{body}");
        assert!((volume(&mesh) - truth).abs() < 0.02 * mesh.area(), "{body}: {}", volume(&mesh));
        assert!(mesh.triangles.len() <= most, "{body}: {}", mesh.triangles.len());
    }
}
