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
        ("rectangle(40mm, 20mm, radius: 5mm)", rounded, 1e-5),
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
