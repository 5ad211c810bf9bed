//! Curves by length, frames along curves, arcs.

use super::geometry::*;
use crate::common::Random;
use std::f64::consts::{PI, TAU};

#[test]
fn arcs_through_three_points() {
    let mut random = Random(6);
    for _ in 0..6 {
        let p = random_points(&mut random, 3);
        let t: Vec<f64> = (0..=400).map(|k| f64::from(k) / 400.0).collect();
        let text = format!("arc_through({}, {}, {})", written(&p[..1]), written(&p[1..2]), written(&p[2..]));
        let found = curve(&text.replace(['[', ']'], ""), &t);
        close(found[0][0], p[0], 1e-9);
        close(found[400][0], p[2], 1e-9);
        let nearest = found.iter().map(|f| norm(sub(f[0], p[1]))).fold(f64::INFINITY, f64::min);
        let step = norm(found[0][1]) / 400.0;
        assert!(nearest < step, "passes {p:?} at a distance of {nearest}");
        // The arc has constant curvature and lies in one plane.
        let axis = unit(cross(sub(p[1], p[0]), sub(p[2], p[0])));
        for f in &found {
            assert!(dot(axis, sub(f[0], p[0])).abs() < 1e-8, "in the plane");
            assert!((norm(f[1]) / norm(found[0][1]) - 1.0).abs() < 1e-9, "at constant speed");
        }
    }
}

#[test]
fn curves_by_length_have_constant_speed() {
    let t: Vec<f64> = (0..=1000).map(|k| f64::from(k) / 1000.0).collect();
    // Each with the largest relative difference between its speed and the mean.
    for (text, tolerance) in [
        ("ellipse(20mm, 10mm)", 3e-8),
        ("bezier([(0mm, 0mm), (0mm, 20mm), (30mm, 20mm), (30mm, 0mm)])", 1e-12),
        ("helix(10mm, 4mm, 2, top: 20mm)", 1e-12),
        ("|t: real| (10mm * t ^ 2 + 10mm * t, 0mm, 5mm * t)", 1e-12),
    ] {
        let length: f64 = {
            let nodes = gauss(60);
            let speeds = curve(text, &nodes.iter().map(|(x, _)| *x).collect::<Vec<f64>>());
            nodes.iter().zip(speeds).map(|((_, w), s)| w * norm(s[1])).sum()
        };
        let found = curve(&format!("by_length({text})"), &t);
        let worst = found.iter().map(|f| (norm(f[1]) / length - 1.0).abs()).fold(0.0, f64::max);
        assert!(worst < tolerance, "the speed of {text} is off by {worst:e}");
        let ends = curve(text, &[0.0, 1.0]);
        close(found[0][0], ends[0][0], 1e-12);
        close(found[1000][0], ends[1][0], 1e-12);
    }
}

/// Pieces of profiles begin where the one before ends, in its direction; arcs among them have one curvature.
#[test]
fn pieces_go_on_where_others_end() {
    let before = "line((1mm, 2mm), (4mm, 6mm))";
    let [u, end] = [[0.6, 0.8], [4.0, 6.0]];
    // Ends that lie at these angles from the direction: the arc to them turns by twice as much.
    let ahead = [0.0, 1e-6, 0.004, 0.009_999, 0.010_001, 0.3, -0.3, 1.5, -2.9].map(|angle: f64| {
        let (sin, cos) = angle.sin_cos();
        let to = [end[0] + 5.0 * (u[0] * cos - u[1] * sin), end[1] + 5.0 * (u[0] * sin + u[1] * cos)];
        let piece = format!("arc_to({before}, ({}mm, {}mm))", to[0], to[1]);
        (piece, Some(2.0 * angle.sin() / 5.0), Some(to))
    });
    let turned = [40.0, -90.0, 300.0]
        .map(|angle: f64| (format!("arc_on({before}, 3mm, {angle}deg)"), Some(angle.signum() / 3.0), None));
    let others = [
        (format!("line_on({before}, 3mm)"), Some(0.0), Some([5.8, 8.4])),
        (format!("spline_to({before}, (1mm, 9mm), (-1, 1), 0.8)"), None, Some([1.0, 9.0])),
    ];
    let t: Vec<f64> = (0..=20).map(|k| f64::from(k) / 20.0).collect();
    for (text, bend, to) in ahead.into_iter().chain(turned).chain(others) {
        let found = curve(&format!("|t: real| lift(({text})(t))"), &t);
        close(found[0][0], [end[0], end[1], 0.0], 1e-12);
        close(unit(found[0][1]), [u[0], u[1], 0.0], 1e-9);
        if let Some([x, y]) = to {
            close(found[20][0], [x, y, 0.0], 1e-12);
        }
        let Some(bend) = bend else { continue };
        let speed = norm(found[0][1]);
        for (f, t) in found.iter().zip(&t) {
            assert!((norm(f[1]) / speed - 1.0).abs() < 1e-9, "{text}: at constant speed");
            let (sin, cos) = (bend * speed * t).sin_cos();
            close(unit(f[1]), [u[0] * cos - u[1] * sin, u[0] * sin + u[1] * cos, 0.0], 1e-9);
        }
    }
}

/// Each with its value and the largest relative error.
#[test]
fn lengths_and_areas_of_curves_with_corners() {
    let triangle = "polyline([(0mm, 0mm), (4mm, 0mm), (4mm, 3mm)], closed: true)";
    let stairs = "polyline([(0mm, 0mm), (10mm, 0mm), (10mm, 2mm), (3mm, 2mm), (3mm, 3mm), (9mm, 3mm), (9mm, 10mm),
        (0mm, 10mm)], closed: true)";
    let polygon = |n: f64| 0.5 * n * 100.0 * (TAU / n).sin();
    let rounded = 800.0 - (4.0 - PI) * 25.0;
    let areas = [
        ("rectangle(40mm, 20mm)", 800.0, 1e-12),
        ("rectangle(40mm, 0.1mm)", 4.0, 1e-12),
        ("reversed(rectangle(40mm, 20mm))", -800.0, 1e-12),
        ("rectangle(40mm, 20mm, radius: 5mm)", rounded, 1e-8),
        (
            "rounded_polyline([(0mm, 0mm), (9mm, 0mm), (9mm, 9mm), (0mm, 9mm)], radii: [1mm, 2mm, 0mm, 3mm], closed: true)",
            81.0 - (1.0 - PI / 4.0) * 14.0,
            1e-8,
        ),
        (triangle, 6.0, 1e-12),
        (stairs, 20.0 + 3.0 + 63.0, 1e-12),
        ("regular_polygon(5, 10mm)", polygon(5.0), 1e-12),
        ("regular_polygon(40, 10mm)", polygon(40.0), 1e-12),
        ("regular_polygon(100, 10mm)", polygon(100.0), 1e-5),
        ("ellipse(40mm, 1mm)", 40.0 * PI, 1e-12),
    ];
    let lengths = [
        ("rectangle(40mm, 20mm)", 120.0, 1e-12),
        (triangle, 12.0, 1e-12),
        (stairs, 52.0, 1e-12),
        ("regular_polygon(7, 10mm)", 140.0 * (PI / 7.0).sin(), 1e-12),
        ("join([line((0mm, 0mm), (30mm, 0mm)), arc((30mm, 4mm), 4mm, -90deg, 0deg)])", 30.0 + 2.0 * PI, 1e-9),
        // The arc is hardly faster than the line, and turns in its part of the curve.
        (
            "join([line((0mm, 0mm), (6mm, 0mm)), arc((6mm, 4mm), 4mm, -90deg, 0deg), line((10mm, 4mm), (10mm, 90mm))])",
            92.0 + 2.0 * PI,
            1e-9,
        ),
        ("ellipse(2mm, 1mm)", 9.688448220547675, 1e-12),
        ("ellipse(10mm, 1mm)", 40.63974180100896, 1e-9),
    ];
    let areas = areas.map(|(text, value, tolerance)| (format!("enclosed_area({text}) / 1mm"), value, tolerance));
    let lengths = lengths.map(|(text, value, tolerance)| (format!("arc_length({text})"), value, tolerance));
    for (text, value, tolerance) in areas.into_iter().chain(lengths) {
        let found = curve(&format!("|t: real| ({text} + 0mm * t, 0mm)"), &[0.5])[0][0][0];
        assert!((found / value - 1.0).abs() < tolerance, "{text} is {found} instead of {value}");
    }
}

#[test]
fn a_sweep_does_not_twist() {
    // The path, its first and its second derivative.
    let path = |t: f64| [60.0 * t, 20.0 * t * t - 5.0 * t, 15.0 * (3.0 * t).sin()];
    let velocity = |t: f64| [60.0, 40.0 * t - 5.0, 45.0 * (3.0 * t).cos()];
    let acceleration = |t: f64| [0.0, 40.0, -135.0 * (3.0 * t).sin()];
    let text = "let path = |t: real| (60mm * t, 20mm * t ^ 2 - 5mm * t, 15mm * sin(3rad * t))
        part p = sweep(path, circle(2mm), up: (0, 1, 0), stations: 32)";
    let program = model(text);
    let v: Vec<f64> = (0..=40).map(|k| f64::from(k) / 40.0).collect();
    let found = points(&defaults(&program), 0, &vec![0.0; v.len()], &v);

    // dr/dt = -(r . T') T (Bishop 1975), by Runge and Kutta's rule.
    let rate = |t: f64, r: Point| {
        let (v, a) = (velocity(t), acceleration(t));
        let along = unit(v);
        let change = scaled(sub(a, scaled(along, dot(a, along))), 1.0 / norm(v));
        scaled(along, -dot(r, change))
    };
    let along = unit(velocity(0.0));
    let up = [0.0, 1.0, 0.0];
    let mut r = unit(sub(up, scaled(along, dot(up, along))));
    let mut worst = 0.0f64;
    let h = 1.0 / 4000.0;
    for k in 0..=4000 {
        let t = f64::from(k) * h;
        if k % 100 == 0 {
            worst = worst.max(norm(sub(found[k as usize / 100], add(path(t), scaled(r, 2.0)))) / 2.0);
        }
        let a = rate(t, r);
        let b = rate(t + h / 2.0, add(r, scaled(a, h / 2.0)));
        let c = rate(t + h / 2.0, add(r, scaled(b, h / 2.0)));
        let d = rate(t + h, add(r, scaled(c, h)));
        let slope = add(add(a, d), scaled(add(b, c), 2.0));
        r = add(r, scaled(slope, h / 6.0));
    }
    assert!(worst < 1e-7, "the frame is off by {worst:e}");
}

/// Involute flanks, and roots that the rounded corner of the rack leaves as it rolls off (Litvin and Fuentes, Gear
/// Geometry and Applied Theory, 2004): found here by rolling it, step by step.
#[test]
fn teeth_of_gears_are_what_a_rack_cuts() {
    let t: Vec<f64> = (0..=4000).map(|k| f64::from(k) / 4000.0).collect();
    for (teeth, module, degrees, shift) in
        [(20, 2.0, 20.0_f64, 0.0), (34, 1.25, 20.0, -0.2), (12, 3.0, 20.0, 0.4), (40, 2.0, 25.0, 0.1)]
    {
        let (z, pressure) = (f64::from(teeth), degrees.to_radians());
        let (r, tan) = (0.5 * z * module, pressure.tan());
        let piece = |name: &str| {
            curve(&format!("gear_tooth({teeth}, {module}mm, {degrees}deg, {shift}, rounding: 0.3).{name}"), &t)
        };
        let names = ["right_root", "right", "tip", "left", "left_root", "gap"];
        let pieces = names.map(piece);
        let flat = |p: Point| [p[0], p[2]];
        for (k, (one, next)) in pieces.iter().zip(pieces.iter().cycle().skip(1)).enumerate() {
            let turn = if k == 5 { TAU / z } else { 0.0 };
            let [x, y] = flat(next[0][0]);
            let begin = [x * turn.cos() - y * turn.sin(), 0.0, x * turn.sin() + y * turn.cos()];
            close(one[4000][0], begin, 1e-9);
            let is_smooth = !matches!(k, 1 | 2);
            if is_smooth && k < 5 {
                close(unit(one[4000][1]), unit(next[0][1]), 1e-9);
            }
        }
        // Normals of a flank touch the base circle.
        for f in &pieces[3] {
            let from_axis = dot(f[0], unit(f[1])).abs();
            assert!((from_axis / (r * pressure.cos()) - 1.0).abs() < 1e-9, "{from_axis}");
        }
        // Half the tooth at the reference circle: interpolated between two of the points.
        let over = pieces[3].iter().position(|f| norm(f[0]) < r).expect("the flank crosses it");
        let [a, b] = [over - 1, over].map(|k| (norm(pieces[3][k][0]), flat(pieces[3][k][0])));
        let angle = |[x, y]: [f64; 2]| y.atan2(x);
        let share = (a.0 - r) / (a.0 - b.0);
        let half = angle(a.1) + share * (angle(b.1) - angle(a.1));
        assert!((half - (0.5 * PI + 2.0 * shift * tan) / z).abs() < 1e-7, "{half}");
        // The corner's circle comes to every point of the root, and never beyond it.
        let rounding = 0.3 * module;
        let depth = module * (1.25 - shift) - rounding;
        let side = module * (PI / 4.0 - 1.25 * tan) - rounding * (0.25 * PI - 0.5 * pressure).tan();
        for f in pieces[4].iter().step_by(200) {
            let [x, y] = flat(f[0]);
            // With the middle of the gap upwards.
            let (sin, cos) = (0.5 * PI - PI / z).sin_cos();
            let [x, y] = [x * cos - y * sin, x * sin + y * cos];
            let distance = |roll: f64| {
                let (sin, cos) = roll.sin_cos();
                (x * cos + y * sin - r * roll - side).hypot(y * cos - x * sin - r + depth)
            };
            let least = (-60_000..60_000).map(|k| distance(f64::from(k) * 1e-5)).fold(f64::INFINITY, f64::min);
            assert!((least / rounding - 1.0).abs() < 1e-6, "{least} and not {rounding}");
        }
    }
}
