//! Breaks of compiled surfaces.

use super::{Break, BreakKind, Breaks, Patch, Trail};
use crate::model::surface::{Instance, Model, Partials};
use gml_compiler::program::{Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};

/// A script of one part, `text` its expression.
fn program(uses: &str, params: &str, text: &str) -> Program {
    let text = format!("{uses}\nmodel m {{\n {params}\n part p = {text}\n}}");
    let script = SourceFile { name: "test.gml".to_owned(), text: text.clone() };
    compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}\n{text}")).program
}

const USES: &str = "use std.surface (revolve, cylinder, sphere, torus, tube, disc, superellipsoid)
use std.sweep (extrude, prism, fill, sweep, loft)
use std.polyline (polyline, rectangle, regular_polygon, rounded_polyline)
use std.curve (line, arc, circle, join, bezier)
use std.spline (bspline, bspline_knots, catmull_rom, natural_spline)
use std.math (clamp, step)
use std.frame (translate, rotate)";

fn breaks_at(x: &[f64], params: &str, text: &str) -> Breaks {
    let program = program(USES, params, text);
    let instance = Model::instantiate(&program, x).unwrap_or_else(|e| panic!("{e}"));
    let breaks = Breaks::of_patch(&*instance, 0).unwrap_or_else(|e| panic!("{e}"));
    for b in breaks.u.iter().chain(&breaks.v) {
        // Adjacent doubles, or a piece of no length between.
        assert!(0.0 < b.before && b.before < b.after && b.after < 1.0 && b.after - b.before < 1e-9, "{b:?}");
    }
    assert_sound(&*instance, &breaks);
    breaks
}

fn breaks(text: &str) -> Breaks {
    breaks_at(&[], "", text)
}

/// Derivatives at either end of a break are those a little further away.
fn assert_sound(instance: &dyn Instance, breaks: &Breaks) {
    let partials = |u: f64, v: f64| {
        let mut p = [Partials::default()];
        instance.partials(0, &[u], &[v], &mut p).unwrap_or_else(|e| panic!("{e}"));
        p[0]
    };
    let mut pairs = Vec::new();
    for w in [0.21, 0.47, 0.83] {
        for (end, aside) in breaks.u.iter().flat_map(|b| [(b.before, -1e-9), (b.after, 1e-9)]) {
            pairs.push((partials(end, w), partials(end + aside, w)));
        }
        for (end, aside) in breaks.v.iter().flat_map(|b| [(b.before, -1e-9), (b.after, 1e-9)]) {
            pairs.push((partials(w, end), partials(w, end + aside)));
        }
    }
    for (a, b) in pairs {
        let near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|c| (a[c] - b[c]).abs() < 1e-4 * (1.0 + a[c].abs()));
        assert!(near(a.point, b.point) && near(a.du, b.du) && near(a.dv, b.dv), "{a:?} {b:?}");
    }
}

/// The breaks lie at these values (to some rounding errors of 1) and are all of one kind.
fn assert_breaks(found: &[Break], expected: &[f64], kind: BreakKind) {
    let places: Vec<f64> = found.iter().map(|b| b.after).collect();
    let near = places.len() == expected.len() && places.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-13);
    assert!(near, "{found:?} instead of {expected:?}");
    assert!(found.iter().all(|b| b.kind == kind), "{found:?} are not all of kind {kind:?}");
}

fn assert_smooth(text: &str) {
    assert_eq!(breaks(text), Breaks::default(), "{text}");
}

use BreakKind::{Bend, Corner, Step};

#[test]
fn smooth_surfaces_have_none() {
    assert_smooth("sphere(5mm)");
    assert_smooth("cylinder(5mm, 9mm)");
    assert_smooth("torus(20mm, 5mm)");
    assert_smooth("tube(bezier([(0mm, 0mm), (0mm, 9mm), (9mm, 9mm), (9mm, 0mm)]), radius: 1mm)");
    assert_smooth("sweep(line((0mm, 0mm, 0mm), (9mm, 3mm, 4mm)), circle(2mm))");
    assert_smooth("revolve(natural_spline([(5mm, 0mm), (7mm, 4mm), (3mm, 8mm), (5mm, 12mm)]))");
    assert_smooth("revolve(bspline([(5mm, 0mm), (7mm, 4mm), (3mm, 8mm), (5mm, 12mm), (6mm, 15mm)]))");
    // Decisions without a trace: a branch cut whose jump of a turn vanishes in the cosine, a minimum of equals.
    assert_smooth("|u, v| { let a = atan2(sin(u * 1turn), cos(u * 1turn)); (cos(a) * 5mm, sin(a) * 5mm, v * 9mm) }");
    assert_smooth("|u, v| (min(u * 5mm, u * 8mm), v * 9mm, 0mm)");
    assert_smooth("|u, v| (u * 5mm, v * 9mm, abs(u - 0.4) ^ 4 * 1mm)");
}

#[test]
fn curved_sweeps_have_no_corners_at_their_stations() {
    for (path, up) in [
        ("|t| (10mm * cos(t * 180deg), 0mm, 10mm * sin(t * 180deg))", "(0, 1, 0)"),
        ("|t| (10mm * cos(t * 2turn), 10mm * sin(t * 2turn), 30mm * t)", "(0, 0, 1)"),
        (
            "|t| { let (a, b) = (2turn * t, 3turn * t)
              (20mm + 5mm * cos(b)) * (cos(a), sin(a), 0) + (0mm, 0mm, 8mm * sin(b)) }",
            "(0, 0, 1)",
        ),
    ] {
        let found = breaks(&format!("sweep({path}, rectangle(4mm, 2mm), up: {up})"));
        assert_breaks(&found.u, &[1.0 / 12.0, 5.0 / 12.0, 7.0 / 12.0, 11.0 / 12.0], Corner);
        assert_eq!((found.v.len(), found.oblique), (0, false), "{found:?}");
    }
}

#[test]
fn polygons_have_corners() {
    // Counterclockwise from the middle of the right side of 20: in proportion to the length.
    let rectangle = breaks("prism(rectangle(40mm, 20mm), 5mm).wall");
    assert_breaks(&rectangle.u, &[1.0 / 12.0, 5.0 / 12.0, 7.0 / 12.0, 11.0 / 12.0], Corner);
    assert_eq!((rectangle.v.len(), rectangle.oblique), (0, false));
    // Rounded, but with next to no radius.
    let sharp = breaks("prism(rectangle(40mm, 20mm, radius: 1e-8mm), 5mm).wall");
    let near = sharp.u.iter().zip(&rectangle.u).all(|(a, b)| (a.after - b.after).abs() < 1e-9 && a.kind == Corner);
    assert!(sharp.u.len() == 4 && near, "{sharp:?}");
    let top = breaks("prism(rectangle(40mm, 20mm), 5mm).top");
    assert_breaks(&top.u, &[1.0 / 12.0, 5.0 / 12.0, 7.0 / 12.0, 11.0 / 12.0], Corner);
    for n in [3, 5, 6, 7] {
        let polygon = breaks(&format!("extrude(regular_polygon({n}, 10mm), 5mm)"));
        let corners: Vec<f64> = (1..n).map(|i| f64::from(i) / f64::from(n)).collect();
        assert_breaks(&polygon.u, &corners, Corner);
        assert_eq!((polygon.v.len(), polygon.oblique), (0, false));
    }
    let open = breaks("extrude(polyline([(0mm, 0mm), (4mm, 0mm), (4mm, 2mm), (0mm, 3mm)]), 5mm)");
    assert_breaks(&open.u, &[1.0 / 3.0, 2.0 / 3.0], Corner);
    // On one line, but faster.
    let straight = breaks("extrude(polyline([(0mm, 0mm), (4mm, 0mm), (5mm, 0mm)]), 5mm)");
    assert_breaks(&straight.u, &[0.5], Bend);
    // On one line at the same speed.
    assert_smooth("extrude(polyline([(0mm, 0mm), (4mm, 0mm), (8mm, 0mm)]), 5mm)");
    let bar = breaks("sweep(line((0mm, 0mm, 0mm), (0mm, 0mm, 9mm)), rectangle(4mm, 2mm))");
    assert_breaks(&bar.u, &[1.0 / 12.0, 5.0 / 12.0, 7.0 / 12.0, 11.0 / 12.0], Corner);
    assert_eq!(bar.v, []);
}

#[test]
fn rounded_corners_bend() {
    let found = breaks("extrude(rectangle(40mm, 20mm, radius: 5mm), 5mm)");
    // Straight lines of 5, 30, 10, 30, 5 with arcs of 5 pi / 2 between them.
    let (arc, mut at) = (2.5 * std::f64::consts::PI, 0.0);
    let whole = 80.0 + 4.0 * arc;
    let mut expected = Vec::new();
    for straight in [5.0, 30.0, 10.0, 30.0] {
        at += straight;
        expected.push(at / whole);
        at += arc;
        expected.push(at / whole);
    }
    assert_breaks(&found.u, &expected, Bend);
    assert_eq!((found.v.len(), found.oblique), (0, false));
}

#[test]
fn profiles_have_breaks_in_v() {
    let shaft = breaks("revolve(polyline([(5mm, 0mm), (5mm, 10mm), (8mm, 10mm), (8mm, 20mm), (4mm, 20mm)]))");
    assert_breaks(&shaft.v, &[0.25, 0.5, 0.75], Corner);
    assert_eq!((shaft.u.len(), shaft.oblique), (0, false));
    let joined = breaks("revolve(join([line((5mm, 0mm), (5mm, 4mm)), arc((5mm, 9mm), 5mm, -90deg, 0deg)]))");
    assert_breaks(&joined.v, &[0.5], Corner);
    let smoothly = breaks("revolve(join([line((10mm, 0mm), (10mm, 9mm)), arc((5mm, 9mm), 5mm, 0deg, 90deg)]))");
    assert_breaks(&smoothly.v, &[0.5], Bend);
    let apart = breaks("revolve(join([line((5mm, 0mm), (5mm, 4mm)), line((6mm, 4mm), (6mm, 9mm))], [1, 2]))");
    assert_breaks(&apart.v, &[1.0 / 3.0], Step);
}

#[test]
fn knots_of_splines() {
    let points = "[(5mm, 0mm), (7mm, 4mm), (3mm, 8mm), (5mm, 12mm), (6mm, 15mm), (9mm, 15mm)]";
    let quadratic = breaks(&format!("revolve(bspline({points}, degree: 2))"));
    assert_breaks(&quadratic.v, &[0.25, 0.5, 0.75], Bend);
    // A knot of multiplicity 2 in a quadratic one is a corner; a simple one a bend.
    let multiple = breaks(&format!("revolve(bspline_knots({points}, [0, 0, 0, 0.25, 0.5, 0.5, 1, 1, 1]))"));
    assert_breaks(&multiple.v[..1], &[0.25], Bend);
    assert_breaks(&multiple.v[1..], &[0.5], Corner);
    let through = breaks(&format!("revolve(catmull_rom({points}))"));
    assert_breaks(&through.v, &[0.2, 0.4, 0.6, 0.8], Bend);
}

#[test]
fn operations_of_the_language() {
    let ridges = breaks("|u, v| (u * 50mm, v * 9mm, abs(sin(20 * pi * u)) * 1mm)");
    let expected: Vec<f64> = (1..20).map(|k| f64::from(k) / 20.0).collect();
    assert_breaks(&ridges.u, &expected, Corner);
    let roof = breaks("|u, v| (u * 50mm, v * 9mm, min(u, 0.8 - u) * 20mm)");
    assert_breaks(&roof.u, &[0.4], Corner);
    let valley = breaks("|u, v| (u * 50mm, v * 9mm, max(0.3, v) * 20mm)");
    assert_breaks(&valley.v, &[0.3], Corner);
    let stairs = breaks("|u, v| (u * 50mm, v * 9mm, floor(u * 5) * 2mm)");
    assert_breaks(&stairs.u, &[0.2, 0.4, 0.6, 0.8], Step);
    let saw = breaks("|u, v| (u * 50mm, v * 9mm, (u % 0.3) * 2mm)");
    assert_breaks(&saw.u, &[0.3, 0.6, 0.9], Step);
    let counted = breaks(
        "|u, v| { let n = floor(v * 4)
          (u * 9mm, v * 9mm, 1mm * sum(for i in 0..6 { if i < n { v } else { 0.9 } })) }",
    );
    assert_breaks(&counted.v, &[0.25, 0.5, 0.75], Step);
    let cut = breaks("|u, v| (u * 50mm, v * 9mm, atan2(sin(u * 1turn), cos(u * 1turn)) / 1rad * 1mm)");
    assert_breaks(&cut.u, &[0.5], Step);
    let rounded = breaks("|u, v| (u * 50mm, v * 9mm, round(3 * u) * (v - 0.5) * 2mm)");
    assert_breaks(&rounded.u, &[1.0 / 6.0, 0.5, 5.0 / 6.0], Step);
    let clamped = breaks("|u, v| (u * 50mm, v * 9mm, clamp(v, 0.2, 0.7) * 20mm)");
    assert_breaks(&clamped.v, &[0.2, 0.7], Corner);
    let egg_box = breaks("|u, v| (u * 50mm, v * 50mm, abs(sin(u * 1turn) * sin(v * 1.5turn)) * 9mm)");
    assert_breaks(&egg_box.u, &[0.5], Corner);
    assert_breaks(&egg_box.v, &[1.0 / 3.0, 2.0 / 3.0], Corner);
    assert!(!egg_box.oblique);
}

#[test]
fn breaks_follow_the_parameters() {
    let text = "|u, v| (u * 50mm, v * 9mm, if v < a { 1mm * v } else { 1mm * a + 3mm * (v - a) })";
    for a in [0.1, 0.25, 0.71234] {
        assert_breaks(&breaks_at(&[a], "param a: real in 0..1 = 0.5", text).v, &[a], Corner);
    }
    // Beyond the surface there is none.
    assert_eq!(breaks_at(&[1.5], "param a: real in 0..2 = 0.5", text), Breaks::default());
}

/// Whatever the parameters, either end of a break is on its own side of it: decisions round as points do.
#[test]
fn ends_are_sound_at_any_parameters() {
    let params = "param a: length = 5mm\n param b: length = 9mm\n param c: length = 2mm";
    let texts = [
        ("extrude(rectangle(a + c, b), c)", 4, 0),
        ("extrude(rectangle(4 * a + 3 * c, 3 * b + 3 * c, radius: c), b)", 8, 0),
        ("extrude(regular_polygon(7, a), b)", 6, 0),
        ("revolve(polyline([(a, c), (a + b, c), (a + b, 2 * b + c), (c, 2 * b + c + a)]))", 0, 2),
        ("revolve(join([line((a, c), (b + a, c)), line((b + a, c), (b + a, a + b + c))], [a / 1mm, b / 1mm]))", 0, 1),
        ("|u, v| (u * 50mm, v * 9mm, abs(u * (a + b + c) - a) + max(v * (b + c), b))", 1, 1),
        ("|u, v| (u * 50mm, v * 9mm, abs(sin((u * a / c + b / 7mm) * 1rad)) * v * c)", 0, 0),
        ("rotate(translate(extrude(regular_polygon(5, a), b), (c, b, a)), a / b * 1rad)", 4, 0),
        ("extrude(rectangle(a, b), c, twist: b / a * 30deg, taper: 0.5)", 4, 0),
    ];
    let mut random = 1_u64;
    let mut next = || {
        random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        1.0 + 9.0 * (random >> 11) as f64 / (1_u64 << 53) as f64
    };
    for (text, of_u, of_v) in texts {
        let program = program(USES, params, text);
        for _ in 0..40 {
            let x = [next(), next(), next()];
            let instance = Model::instantiate(&program, &x).unwrap_or_else(|e| panic!("{e}"));
            let found = Breaks::of_patch(&*instance, 0).unwrap_or_else(|e| panic!("{e}"));
            assert_sound(&*instance, &found);
            assert!(!found.oblique && found.u.len() >= of_u && found.v.len() >= of_v, "{text} at {x:?}: {found:?}");
        }
    }
}

#[test]
fn decisions_within_branches() {
    let text = "|u, v| (u * 50mm, v * 9mm,
      if u < 0.5 { if v < 0.3 { 1mm * exp(v) * u } else { 2mm * exp(-v) * u } } else { exp(u + v) * 1mm })";
    let found = breaks(text);
    assert_breaks(&found.u, &[0.5], Step);
    assert_breaks(&found.v, &[0.3], Step);
    assert!(!found.oblique);
    // In a strip of v which no line of the first ones meets.
    let text = "|u, v| (u * 50mm, v * 9mm,
      if v > 0.61 and v < 0.612 { exp(abs(u - 0.7) * v) * 9mm } else { exp(u * v) * 1mm })";
    let found = breaks(text);
    assert_breaks(&found.u, &[0.7], Corner);
    assert_breaks(&found.v, &[0.61, 0.612], Step);
    // Where a condition of both decides which branch it is, too.
    let text = "|u, v| (u * 50mm, v * 9mm,
      if u + v < 1 { (1 - u - v) ^ 3 * abs(u - 0.3) * 9mm } else { (u + v - 1) ^ 3 * exp(u * v) * 9mm })";
    let found = breaks(text);
    assert_breaks(&found.u, &[0.3], Corner);
    assert!(found.v.is_empty() && !found.oblique, "{found:?}");
}

#[test]
fn oblique_edges() {
    let kink = program(USES, "", "|u, v| (u * 50mm, v * 50mm, abs(u - v) * 9mm)");
    let instance = Model::instantiate(&kink, &[]).expect("it exists");
    let found = Breaks::of_patch(&*instance, 0).expect("it is finite");
    assert_eq!(found, Breaks { oblique: true, ..Breaks::default() });
    let patch = Patch { instance: &*instance, patch: 0 };
    let signatures = patch.oblique_signatures(&[0.1, 0.2, 0.3, 0.4], &[0.3, 0.1, 0.1, 0.7]).expect("numbers");
    assert!(signatures[0] == signatures[3] && signatures[1] == signatures[2] && signatures[0] != signatures[1]);
    assert!(breaks("|u, v| (u * 50mm, v * 50mm, if u * u + v * v < 0.6 { 2mm } else { 0mm })").oblique);
    assert!(!breaks("|u, v| (u * 50mm, v * 50mm, abs(u - v) ^ 3 * 9mm)").oblique, "it has no corner");
}

/// Breaks that are followed from other values are those that are found at once; of pieces between them that were less
/// wide than they moved, and of what is as it was, nothing is said.
#[test]
fn breaks_are_followed() {
    let wall = ("param w: length = 40mm\nparam d: length = 20mm", "prism(rectangle(w, d), 15mm).wall");
    // A step, a corner in v, and a bend where an arc begins, whose length depends on both.
    let stairs = (
        "param a: length = 4mm\nparam b: length = 9mm",
        "|u: real, v: real| \
        (20mm * u, if u < a / b { 0mm } else { 5mm }, 3mm * max(v - b / 20mm, 0) + 1mm * v)",
    );
    let rounded = (
        "param a: length = 4mm\nparam b: length = 9mm",
        "extrude(rounded_polyline([(0mm, 0mm), (b, 0mm), (b, 12mm)], a), 5mm)",
    );
    let cases = [
        (wall, [40.0, 20.0], [40.6, 19.1]),
        (wall, [40.0, 20.0], [40.0 + 1e-9, 20.0]),
        (stairs, [4.0, 9.0], [4.3, 8.8]),
        (stairs, [4.0, 9.0], [4.0, 9.0 + 1e-13]),
        (rounded, [4.0, 9.0], [3.9, 9.2]),
    ];
    for ((params, text), from, to) in cases {
        let program = program(USES, params, text);
        let at = |x: &[f64]| Model::instantiate(&program, x).unwrap_or_else(|e| panic!("{e}"));
        let (start, end) = (at(&from), at(&to));
        let [first, expected] = [&start, &end].map(|i| Breaks::of_patch(&**i, 0).unwrap_or_else(|e| panic!("{e}")));
        let trail = Trail::new(&*start, 0, first.clone()).unwrap_or_else(|e| panic!("{e}"));
        let followed = |instance: &dyn Instance| trail.followed(instance, 0).unwrap_or_else(|e| panic!("{e}"));
        assert_ne!(first, expected, "{text}");
        assert_eq!(followed(&*end), Some(expected), "{text} at {to:?}");
        assert_eq!(followed(&*start), None, "{text}");
    }
    // The middle piece is a tenth of the whole wide: where it comes to lie elsewhere, or goes, the breaks remain.
    let text = "|u: real, v: real| \
        (20mm * abs(u - a / 10mm) + 9mm * abs(u - (a + 1mm) / 10mm), 5mm * v, 0mm)";
    let program = program(USES, "param a: length = 1mm", text);
    let at = |a: f64| Model::instantiate(&program, &[a]).unwrap_or_else(|e| panic!("{e}"));
    let of = |a: f64| Breaks::of_patch(&*at(a), 0).unwrap_or_else(|e| panic!("{e}"));
    let trail = Trail::new(&*at(1.0), 0, of(1.0)).unwrap_or_else(|e| panic!("{e}"));
    for (a, expected) in [(1.9, of(1.9)), (5.0, of(1.0)), (20.0, of(1.0))] {
        let followed = trail.followed(&*at(a), 0).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(followed, Some(expected), "{a}");
    }
}
