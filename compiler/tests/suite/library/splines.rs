//! Splines.

use super::geometry::*;
use crate::common::Random;
use gml_compiler::program::{Order, Sites};

#[test]
fn a_bezier_curve_is_a_mean_by_bernstein_polynomials() {
    let mut random = Random(1);
    for degree in 1..=6 {
        let p = random_points(&mut random, degree + 1);
        let t = parameters(&mut random, 8);
        for (found, t) in curve(&format!("bezier({})", written(&p)), &t).iter().zip(&t) {
            let mut binomial = 1.0;
            let mut expected = [0.0; 3];
            for (i, p) in p.iter().enumerate() {
                let weight = binomial * t.powi(i as i32) * (1.0 - t).powi((degree - i) as i32);
                expected = add(expected, scaled(*p, weight));
                binomial *= (degree - i) as f64 / (i + 1) as f64;
            }
            close(found[0], expected, 1e-12);
        }
    }
}

/// The basis function of Cox and de Boor, with the convention 0/0 = 0; the last span includes its end.
fn basis(knots: &[f64], i: usize, degree: usize, x: f64) -> f64 {
    if degree == 0 {
        let last = knots[i + 1] == knots[knots.len() - 1] && x == knots[i + 1] && knots[i] < knots[i + 1];
        return f64::from(u8::from((knots[i] <= x && x < knots[i + 1]) || last));
    }
    let share = |a: f64, b: f64| if b == 0.0 { 0.0 } else { a / b };
    let left = share(x - knots[i], knots[i + degree] - knots[i]);
    let right = share(knots[i + degree + 1] - x, knots[i + degree + 1] - knots[i + 1]);
    left * basis(knots, i, degree - 1, x) + right * basis(knots, i + 1, degree - 1, x)
}

fn spline(knots: &[f64], points: &[Point], degree: usize, x: f64) -> Point {
    (0..points.len()).fold([0.0; 3], |sum, i| add(sum, scaled(points[i], basis(knots, i, degree, x))))
}

#[test]
fn b_splines_are_those_of_cox_and_de_boor() {
    let mut random = Random(2);
    for (degree, n) in [(1, 2), (1, 5), (2, 3), (2, 7), (3, 4), (3, 8), (4, 7)] {
        let p = random_points(&mut random, n);
        let t = parameters(&mut random, 8);
        let spans = n - degree;
        let knots: Vec<f64> = (0..n + degree + 1).map(|k| k.saturating_sub(degree).min(spans) as f64).collect();
        let found = curve(&format!("bspline({}, degree: {degree})", written(&p)), &t);
        for (found, t) in found.iter().zip(&t) {
            close(found[0], spline(&knots, &p, degree, t * spans as f64), 1e-12);
        }

        // Periodic: the points are repeated from the start, and the knots are the whole numbers.
        let around: Vec<Point> = (0..n + degree).map(|i| p[i % n]).collect();
        let knots: Vec<f64> = (0..n + 2 * degree + 1).map(|k| k as f64 - degree as f64).collect();
        let found = curve(&format!("bspline({}, degree: {degree}, closed: true)", written(&p)), &t);
        for (found, t) in found.iter().zip(&t) {
            close(found[0], spline(&knots, &around, degree, t * n as f64), 1e-12);
        }
        close(found[found.len() - 4][0], found[found.len() - 1][0], 1e-12);
    }
}

#[test]
fn b_splines_with_given_knots() {
    let mut random = Random(3);
    for degree in 1..=4 {
        let n = degree + 5;
        let p = random_points(&mut random, n);
        // Clamped at both ends, one knot twice in the middle (where the degree allows it).
        let mut inner = [0.1, 0.4, 0.4, 0.85];
        if degree == 1 {
            inner[2] = 0.6;
        }
        let ends = |x: f64| vec![x; degree + 1];
        let knots: Vec<f64> = [ends(0.0), inner.to_vec(), ends(1.0)].concat();
        let t = parameters(&mut random, 12);
        let found = curve(&format!("bspline_knots({}, {knots:?})", written(&p)), &t);
        for (found, t) in found.iter().zip(&t) {
            close(found[0], spline(&knots, &p, degree, *t), 1e-12);
        }
    }
}

#[test]
fn rational_splines_make_a_circle() {
    // A full circle from nine points (Piegl and Tiller, The NURBS Book, section 7.5).
    let w = 0.5f64.sqrt();
    let corners = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)];
    let p: Vec<Point> = corners.iter().map(|(x, y)| [f64::from(*x), f64::from(*y), 2.0]).collect();
    let text = format!(
        "nurbs({}, [1, {w}, 1, {w}, 1, {w}, 1, {w}, 1], [0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1])",
        written(&p)
    );
    let mut random = Random(4);
    for [p, d] in curve(&text, &parameters(&mut random, 20)) {
        assert!((p[0].hypot(p[1]) - 1.0).abs() < 1e-12 && p[2] == 2.0, "{p:?}");
        assert!(p[0] * d[1] - p[1] * d[0] > 0.0, "counterclockwise at {p:?}");
    }
}

#[test]
fn interpolating_curves_pass_through_their_points_without_corners() {
    let mut random = Random(5);
    let p = random_points(&mut random, 6);
    for name in ["catmull_rom", "centripetal"] {
        for closed in [false, true] {
            let spans = if closed { 6 } else { 5 };
            let gap = |i: usize| norm(sub(p[(i + 1) % 6], p[i % 6])).sqrt();
            let share = |i: usize| if name == "centripetal" { gap(i) } else { 1.0 };
            let total: f64 = (0..spans).map(share).sum();
            let knots: Vec<f64> = (0..=spans).map(|i| (0..i).map(share).sum::<f64>() / total).collect();
            let text = format!("{name}({}, closed: {closed})", written(&p));
            let step = 1e-9;
            let around: Vec<f64> = knots.iter().flat_map(|k| [k - step, k + step]).collect();
            let found = curve(&text, &around);
            for i in 0..=spans {
                close(found[2 * i][0], p[i % 6], 1e-6);
                close(found[2 * i + 1][0], p[i % 6], 1e-6);
            }
            for i in 1..spans {
                close(found[2 * i][1], found[2 * i + 1][1], 1e-5);
            }
            if closed {
                close(found[1][1], found[2 * spans][1], 1e-5);
            }
        }
    }
}

#[test]
fn a_natural_spline_passes_through_its_points_and_its_curvature_does_not_jump() {
    let mut random = Random(8);
    for n in [3, 4, 9] {
        let p = random_points(&mut random, n);
        let program = model(&format!("let c = natural_spline({})\npart p = |u, v| c(u)", written(&p)));
        let instance = defaults(&program);
        let step = 1e-9;
        let knots: Vec<f64> = (0..n).map(|i| i as f64 / (n - 1) as f64).collect();
        let around: Vec<f64> = knots.iter().flat_map(|k| [k - step, k + step]).collect();
        let mut out = vec![0.0; 18 * around.len()];
        instance
            .evaluate(0, Sites::Scattered(&around, &vec![0.5; around.len()]), Order::SecondPartials, &mut out)
            .unwrap();
        let at = |i: usize, k: usize| [out[18 * i + k], out[18 * i + k + 1], out[18 * i + k + 2]];
        for i in 0..n {
            close(at(2 * i, 0), p[i], 1e-6);
            for derivative in [3, 9] {
                close(at(2 * i, derivative), at(2 * i + 1, derivative), 1e-4);
            }
        }
        close(at(0, 9), [0.0; 3], 1e-4);
        close(at(2 * n - 1, 9), [0.0; 3], 1e-4);
    }
}
