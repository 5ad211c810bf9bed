//! Derivatives of every surface, and of surfaces of every curve, against central differences.

use super::geometry::*;
use crate::common::{Random, deviation, scale};
use gml_compiler::program::{Order, Sites};

/// Surfaces over parameters: lengths a and b, a bare number n, an angle w.
const SURFACES: &str = "
  param a: length in 5mm..20mm = 10mm
  param b: length in 1mm..4mm = 3mm
  param n: real in 1.6..4 = 2.5
  param w: angle in 20deg..80deg = 50deg
  let path = bezier([(0mm, 0mm, 0mm), (a, 0mm, b), (a, 2 * a, 0mm), (0mm, 2 * a, 3 * b)])
  let profile = [(a, 0mm), (2 * a, b), (a + b, 3 * b), (b, 5 * b), (b, 6 * b)]
  let rows = for j in 0..4 { for i in 0..5 { (i * a, j * b, a * sin(w * (i + j))) } }
  let ring = |r, z| |t: real| polar(r, t * 1turn, z)
";

/// Their parts: name and expression.
const PARTS: [(&str, &str); 61] = [
    ("plane", "plane(a, b)"),
    ("disc", "disc(a)"),
    ("annulus", "annulus(b, a)"),
    ("cylinder", "cylinder(a, b)"),
    ("cone", "cone(a, b, a + b)"),
    ("sphere", "sphere(a)"),
    ("zone", "sphere_zone(a, w / 2, w, around: (0deg, w))"),
    ("ellipsoid", "ellipsoid(a, b, a + b)"),
    ("torus", "torus(a, b)"),
    ("paraboloid", "paraboloid(a, b)"),
    ("helicoid", "helicoid(b, a, b, n)"),
    ("superellipsoid", "superellipsoid(a, b, a + b, n, n + 0.5)"),
    ("supertoroid", "supertoroid(a, b, 2 * b, n, n + 0.5)"),
    ("partial", "revolve(line((a, 0mm), (b, a)), w, 2 * w)"),
    ("trimmed", "trim(torus(a, b), (0.1, 0.4), (n / 8, 1))"),
    ("offset_surface", "offset(torus(a, b), 0.1 * a)"),
    ("thick", "thicken(cylinder(a, 2 * a), b).outer"),
    ("tube", "tube(path, radius: b, up: (0, 0, 1))"),
    ("changing_tube", "tube(path, radii: (b, |v| b + a * v), up: (0, 0, 1))"),
    ("extruded", "extrude(superellipse(a, b, n), a, twist: w, taper: 0.5)"),
    ("prism_top", "prism(rectangle(a, 3 * b, b / 4), a).top"),
    ("ruled", "ruled(path, path.translate((0mm, 0mm, a)))"),
    ("loft", "loft([ring(a, 0mm), ring(b, a), ring(a + b, 2 * a), ring(b, 3 * a)])"),
    ("sweep", "sweep(path, circle(b))"),
    ("section", "sweep(path, |u, v| ellipse(b, b + b * v)(u), twist: w)"),
    ("bar_start", "bar(path, rectangle(b, b)).start"),
    ("coil", "coil(a, b, n, 0.2 * b)"),
    ("bilinear", "bilinear((0mm, 0mm, 0mm), (a, 0mm, b), (b, a, 0mm), (a, a, a))"),
    (
        "coons",
        "coons(line((0mm, 0mm, 0mm), (a, 0mm, b)), line((0mm, a, 0mm), (a, a, b)),
            arc_through((0mm, 0mm, 0mm), (b, a / 2, b), (0mm, a, 0mm)), line((a, 0mm, b), (a, a, b)))",
    ),
    ("bezier_patch", "bezier_patch(rows)"),
    ("bspline_patch", "bspline_patch(rows)"),
    ("closed_patch", "bspline_patch(rows, degree: 2, closed_u: true)"),
    ("through_grid", "through_grid(rows)"),
    ("bspline", "revolve(bspline(profile))"),
    ("knots", "revolve(bspline_knots(profile, [0, 0, 0, n / 10, n / 8, 1, 1, 1]))"),
    ("nurbs", "revolve(nurbs(profile, [1, n, 2, 1, n], [0, 0, 0, 0.3, 0.5, 1, 1, 1]))"),
    ("rational", "revolve(rational_bezier(profile, [1, n, 2, 1, n]))"),
    ("catmull_rom", "revolve(catmull_rom(profile))"),
    ("centripetal", "revolve(centripetal(profile))"),
    ("natural", "revolve(natural_spline(profile))"),
    (
        "closed_sweep",
        "sweep(|t| polar(a + b * cos(3turn * t), 2turn * t, b * sin(3turn * t)), circle(b / 4), closed: true)",
    ),
    ("hermite", "revolve(hermite((a, 0mm), (b, b), (b, a), (a, b)))"),
    ("by_length", "revolve(by_length(bezier(profile)))"),
    ("tube_by_length", "tube(by_length(path), radius: b, up: (0, 0, 1))"),
    (
        "measured",
        "plane(enclosed_area(rectangle(a, b + 0.3 * a)) / 10mm, arc_length(polyline(profile, closed: true), 0.1, 0.9))",
    ),
    ("measured_pieces", "plane(arc_length(join([line((a, 0mm), (2 * a, 0mm)), arc((2 * a, b), b, -90deg, w)])), b)"),
    ("fillets", "revolve(rounded_polyline(profile, b / 8))"),
    ("fillets_of_their_own", "revolve(rounded_polyline(profile, radii: [0mm, b / 8, b / 20, 0.3 * b / n, b]))"),
    ("onward", "revolve(arc_on(line((a, 0mm), (2 * a, b)), b, w))"),
    ("towards", "revolve(arc_to(line((a, 0mm), (2 * a, b)), (n * a, 3 * b)))"),
    ("rounded_corner", "revolve(rounded_corner((0mm, 0mm), (a, 0mm), (a + b, a), b / 4).round)"),
    ("flank", "extrude(gear_tooth(20, b, shift: n / 16).left, a)"),
    ("root_of_a_tooth", "extrude(gear_tooth(20, b, shift: n / 16).left_root, a)"),
    (
        "mitred",
        "mitred_sweep([(0mm, 0mm, 0mm), (2 * a, 0mm, 0mm), (3 * a, a, b), (3 * a, 3 * a, 0mm)], circle(b / 4))[1]",
    ),
    ("joined", "revolve(join([line((a, 0mm), (2 * a, 0mm)), arc((2 * a, b), b, -90deg, w)]))"),
    ("offset_curve", "extrude(offset(ellipse(a, 4 * b), b), a)"),
    ("offset_at_poles", "offset(sphere(a), b / 4)"),
    ("offset_at_poles_of_u", "offset(flip(|u, v| sphere(a)(v, u)), b / 4)"),
    ("spiral", "extrude(segment(spiral(b, a, n), 0.1, 0.9), a)"),
    ("posed", "look_at((a, b, 0mm), (0mm, a, a))(torus(a, b)).rotate(w, (n, 1, 2))"),
    ("mirrored", "torus(a, b).translate((a, b, a)).mirror((n, 1, 2), (b, 0mm, a))"),
];

#[test]
fn derivatives_of_every_surface() {
    let parts: String = PARTS.iter().map(|(name, text)| format!("part p_{name} = {text}\n")).collect();
    let program = model(&format!("{SURFACES}{parts}"));
    let mut random = Random(7);
    // Points in the middle, and at the edges and corners of the square.
    let inside: Vec<(f64, f64)> = (0..4).map(|_| (random.between(0.05, 0.95), random.between(0.05, 0.95))).collect();
    let rim = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (0.5, 0.0), (0.5, 1.0), (0.0, 0.5), (1.0, 0.5)];
    let (u, v): (Vec<f64>, Vec<f64>) = inside.iter().chain(&rim).copied().unzip();
    for _ in 0..2 {
        let x = random.parameters(&program);
        let instance = program.instantiate(&x).unwrap();
        for (k, part) in program.parts().iter().enumerate() {
            let flat = |u: &[f64], v: &[f64]| points(&instance, k, u, v).into_flattened();
            let slopes = partials(&instance, k, &u, &v);
            assert!(slopes.as_flattened().as_flattened().iter().all(|d| d.is_finite()), "{}", part.name);
            let n = inside.len();
            let by = |axis: usize| slopes[..n].iter().flat_map(|s| s[axis]).collect::<Vec<f64>>();
            let moved = |a: &[f64], h: f64| a[..n].iter().map(|a| a + h).collect::<Vec<f64>>();
            let du = deviation(&by(1), 0.05, |h| Some(flat(&moved(&u, h), &v[..n])));
            let dv = deviation(&by(2), 0.05, |h| Some(flat(&u[..n], &moved(&v, h))));
            assert!(du < 1e-6 && dv < 1e-6, "partials of {}: {du:e} {dv:e} at {x:?}", part.name);

            let mut second = vec![0.0; 18 * n];
            instance.evaluate(k, Sites::Scattered(&u[..n], &v[..n]), Order::SecondPartials, &mut second).unwrap();

            let w: Vec<Point> = u.iter().map(|_| [0; 3].map(|_| random.between(-1.0, 1.0))).collect();
            let mut gradient = vec![0.0; x.len()];
            instance.evaluate(k, Sites::Scattered(&u, &v), Order::Pullback(&w), &mut gradient).unwrap();
            let active = part.active.len();
            let mut jacobian = vec![0.0; 3 * active * u.len()];
            instance.evaluate(k, Sites::Scattered(&u, &v), Order::Jacobian, &mut jacobian).unwrap();
            for (a, param) in part.active.iter().enumerate() {
                let param = *param as usize;
                let column: Vec<usize> =
                    (0..u.len()).flat_map(|i| (0..3).map(move |c| (i * active + a) * 3 + c)).collect();
                let derivative: Vec<f64> = column.iter().map(|i| jacobian[*i]).collect();
                let error = deviation(&derivative, scale(&program, param, &x), |h| {
                    let mut x = x.clone();
                    x[param] += h;
                    let instance = program.instantiate(&x).ok()?;
                    Some(points(&instance, k, &u, &v).into_flattened())
                });
                let name = &program.parameters()[param].name;
                assert!(error < 1e-6, "d {} / d {name}: {error:e} at {x:?}", part.name);
                // The pullback computes the same sum in another order, by other formulas.
                let product: f64 = derivative.iter().zip(w.as_flattened()).map(|(d, w)| d * w).sum();
                let error = (gradient[param] - product).abs();
                assert!(
                    error <= 1e-9 * product.abs().max(1.0),
                    "pullback of {} to {name}: {error:e} at {x:?}",
                    part.name
                );
            }
        }
    }
}

#[test]
fn an_offset_follows_the_limit_of_the_normal_at_a_pole() {
    let program = model(&format!("{SURFACES}part p = offset(sphere(a), b)\npart q = sphere(a + b)\n"));
    let instance = program.instantiate(&program.defaults()).unwrap();
    let (u, v) = ([0.0, 0.3, 0.7, 1.0], [0.0, 0.0, 1.0, 1.0]);
    let (p, q) = (partials(&instance, 0, &u, &v), partials(&instance, 1, &u, &v));
    for (p, q) in p.as_flattened().as_flattened().iter().zip(q.as_flattened().as_flattened()) {
        // The derivative's rounding is that of the step inside: 1e-16 / 1e-7.
        assert!((p - q).abs() < 1e-6, "{p} and {q}");
    }
}
