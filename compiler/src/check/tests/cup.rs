//! LANGUAGE.md's cup against its formulas.

use super::support::{defaults, diagnosed, model, normal, part, point};
use std::collections::HashMap;

const CUP: &str = include_str!("../../../../examples/cup/cup.gml");

/// The cup's formulas written out: rotation matrix entries from the text of the issue, curves from Bernstein
/// polynomials.
struct Truth {
    p: HashMap<String, f64>,
}

impl Truth {
    fn pose(&self, q: [f64; 3]) -> [f64; 3] {
        let p = &self.p;
        let turn = |q: [f64; 3], axis: usize, angle: f64| {
            let (s, c) = angle.sin_cos();
            let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut out = q;
            out[i] = c * q[i] - s * q[j];
            out[j] = s * q[i] + c * q[j];
            out
        };
        let q = turn(turn(turn(q, 0, p["alpha"]), 1, p["beta"]), 2, p["gamma"]);
        [q[0] + p["x"], q[1] + p["y"], q[2] + p["z"]]
    }

    fn outer(&self, t: f64) -> f64 {
        t.powf(3.0 + self.p["shape"])
    }

    fn inner(&self, t: f64) -> f64 {
        0.04 + (t + 0.1).powf(2.0 + self.p["shape"])
    }

    fn rim(&self) -> f64 {
        0.96f64.powf(1.0 / (2.0 + self.p["shape"])) - 0.1
    }

    fn revolved(&self, radius: f64, height: f64, u: f64) -> [f64; 3] {
        let (s, c) = (u * std::f64::consts::TAU).sin_cos();
        self.pose([radius * c, radius * s, height])
    }

    /// The handle's centre line in its half plane, and its tangent.
    fn handle(&self, t: f64) -> ([f64; 2], [f64; 2]) {
        let (p, r, h) = (&self.p, self.p["r"], self.p["h"]);
        let points = [
            [r * p["h1"], h * self.outer(p["h1"])],
            [r * p["h2a"], h * p["h2b"]],
            [r * p["h3a"], h * p["h3b"]],
            [r * p["h4"], h * self.outer(p["h4"])],
        ];
        let s = 1.0 - t;
        let weights = [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t];
        let slopes = [-3.0 * s * s, 3.0 * s * s - 6.0 * s * t, 6.0 * s * t - 3.0 * t * t, 3.0 * t * t];
        let mut value = [0.0; 2];
        let mut slope = [0.0; 2];
        for (i, q) in points.iter().enumerate() {
            for k in 0..2 {
                value[k] += weights[i] * q[k];
                slope[k] += slopes[i] * q[k];
            }
        }
        (value, slope)
    }
}

fn assert_near(a: [f64; 3], b: [f64; 3], tolerance: f64) {
    let far = (0..3).any(|k| (a[k] - b[k]).abs() > tolerance);
    assert!(!far, "{a:?} is not {b:?}");
}

fn posed() -> HashMap<String, f64> {
    let mut p = defaults(&model(CUP));
    for (name, value) in [("x", 28.8), ("y", -9.0), ("z", -40.3), ("alpha", 2.7), ("beta", -0.15), ("gamma", -0.5)] {
        p.insert(name.to_owned(), value);
    }
    p
}

#[test]
fn the_cup_has_its_parameters_and_parts_and_no_complaints() {
    assert_eq!(diagnosed(CUP), "");
    let model = model(CUP);
    let names: Vec<&str> = model.params.iter().map(|p| p.declared.name.as_str()).collect();
    let wanted = ["x", "y", "z", "alpha", "beta", "gamma", "shape", "r", "h", "h1", "h2a", "h2b", "h3a", "h3b", "h4"];
    assert_eq!(names, wanted);
    let parts: Vec<&str> = model.parts.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(parts, ["outside", "inside", "lip", "handle"]);
    let seventh = &model.params[7].declared;
    assert_eq!((seventh.lower, seventh.upper), (15.0, 80.0));
    assert_eq!(seventh.default, 40.0);
    // The calls lead to functions of the model.
    for function in model.functions.values() {
        let mut open = vec![&function.body];
        while let Some(e) = open.pop() {
            assert!(e.call().is_none_or(|call| model.functions.contains_key(&call.function)));
            e.for_each_child(&mut |child| open.push(child));
        }
    }
}

#[test]
fn the_cups_points_are_those_of_its_formulas() {
    let model = model(CUP);
    let truth = Truth { p: posed() };
    let (r, h) = (truth.p["r"], truth.p["h"]);
    for i in 0..=6 {
        for j in 0..=6 {
            let (u, v) = (f64::from(i) / 6.0, f64::from(j) / 6.0);
            let at = |name: &str| point(&model, part(&model, name), &truth.p, u, v);
            let (w, rim) = (1.0 - v, truth.rim());
            // Only rounding separates the two ways to compute these.
            assert_near(at("outside"), truth.revolved(r * v, h * truth.outer(v), u), 1e-11);
            assert_near(at("inside"), truth.revolved(r * rim * w, h * truth.inner(rim * w), u), 1e-11);
            assert_near(at("lip"), truth.revolved(r * (1.0 + (rim - 1.0) * v), h, u), 1e-11);
            let (c, t) = truth.handle(v);
            let length = t[0].hypot(t[1]);
            let n = [t[1] / length, -t[0] / length];
            let (s, k) = (u * std::f64::consts::TAU).sin_cos();
            let handle = truth.pose([c[0] + 5.0 * k * n[0], 5.0 * s, c[1] + 5.0 * k * n[1]]);
            // The evaluator has the tangent from differences of step 1e-5 on a curve of 100 mm.
            assert_near(at("handle"), handle, 1e-6);
        }
    }
}

#[test]
fn the_cups_normals_point_away_from_the_material() {
    let model = model(CUP);
    let p = defaults(&model);
    for i in 0..8 {
        let (u, v) = (f64::from(i) / 8.0 + 0.01, 0.6);
        let at = |name: &str| {
            let part = part(&model, name);
            (point(&model, part, &p, u, v), normal(&model, part, &p, u, v))
        };
        let (q, n) = at("outside");
        assert!(q[0] * n[0] + q[1] * n[1] > 0.0 && n[2] < 0.0);
        let (q, n) = at("inside");
        assert!(q[0] * n[0] + q[1] * n[1] < 0.0 && n[2] > 0.0);
        let (_, n) = at("lip");
        assert!(n[2] > 0.999);
        let (q, n) = at("handle");
        let (c, _) = Truth { p: p.clone() }.handle(v);
        let away = [q[0] - c[0], q[1], q[2] - c[1]];
        assert!(away[0] * n[0] + away[1] * n[1] + away[2] * n[2] > 4.99);
    }
}

#[test]
fn the_cup_compiles_as_the_language_page_has_it() {
    let verbatim = CUP
        .replace(
            "pose(flip(revolve(|t| (r * rim * t, h * inner(rim * t)))))",
            "pose(revolve(|t| (r * rim * t, h * inner(rim * t))))",
        )
        .replace("mix(1, rim, t)", "mix(rim, 1, t)")
        .replace("(revolve, tube, flip)", "(revolve, tube)");
    assert_ne!(verbatim, CUP);
    assert_eq!(diagnosed(&verbatim), "");
}

#[test]
fn the_other_examples_are_without_complaints() {
    for (text, params) in [
        (include_str!("../../../../examples/cup/octagonal_cup.gml"), 16),
        (include_str!("../../../../examples/mug/mug.gml"), 16),
    ] {
        assert_eq!(diagnosed(text), "");
        assert_eq!(model(text).params.len(), params);
    }
}

#[test]
fn the_mugs_normals_point_away_from_its_material() {
    let mug = model(include_str!("../../../../examples/mug/mug.gml"));
    let p = defaults(&mug);
    let at = |name: &str, u: f64, v: f64| {
        let part = part(&mug, name);
        (point(&mug, part, &p, u, v), normal(&mug, part, &p, u, v))
    };
    for u in [0.05, 0.3, 0.55, 0.8] {
        let outwards = |(q, n): ([f64; 3], [f64; 3])| (q[0] * n[0] + q[1] * n[1]) / q[0].hypot(q[1]);
        assert!(outwards(at("outside", u, 0.5)) > 0.9);
        assert!(outwards(at("inside", u, 0.5)) < -0.9);
        assert!(at("floor", u, 0.5).1[2] > 0.9);
        assert!(at("base", u, 0.5).1[2] < -0.9);
        let (_, n) = at("corner", u, 0.3);
        assert!(n[2] < -0.3 && outwards(at("corner", u, 0.3)) > 0.3);
        assert!(at("bead", u, 0.7).1[2] > 0.9);
    }
    // The parts meet: corner and wall, wall and bead, bead and inside.
    let near = |a: [f64; 3], b: [f64; 3], d: f64| (0..3).all(|k| (a[k] - b[k]).abs() <= d);
    assert!(near(at("corner", 0.3, 1.0).0, at("outside", 0.3, 0.0).0, 1e-12));
    assert!(near(at("base", 0.3, 1.0).0, at("corner", 0.3, 0.0).0, 1e-12));
    assert!(near(at("bead", 0.3, 1.0).0, at("inside", 0.3, 0.0).0, 1e-12));
    let top = at("bead", 0.3, 0.7).0[2];
    assert!((top - p["height"]).abs() < 1e-9);
}

/// Not a benchmark: a bound that would be broken by work that grows faster than the script.
#[test]
fn the_cup_is_checked_in_no_time() {
    let start = std::time::Instant::now();
    for _ in 0..20 {
        model(CUP);
    }
    let each = start.elapsed().as_secs_f64() / 20.0;
    println!("check: {:.2} ms", each * 1e3);
    assert!(each < 0.1, "{each} s");
}
