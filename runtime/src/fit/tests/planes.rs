//! Models of planes: turned by a right angle, with their lengths exchanged, they are nearly themselves.

use super::both_ways::{scanned, scanner};
use super::shapes::program;
use crate::fit::{FitOptions, fit};
use crate::progress::Silent;
use crate::simulate::Scanner;
use glam::DVec3;

/// Options that begin at some values.
fn begun_at(values: &[(&str, f64)]) -> FitOptions {
    FitOptions {
        start: values.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect(),
        ..FitOptions::default()
    }
}

/// A nut with a knob on its side: it fits after every sixth of a turn, but for the knob.
#[test]
fn a_pose_that_fits_but_for_a_detail_is_left_for_the_one_that_fits() {
    let nut = program(
        "model nut {
          param r: length in 10mm..40mm = 20mm
          param lobe: length in 0mm..6mm = 3mm
          param height: length in 8mm..40mm = 18mm
          param knob: length in 0mm..8mm = 3mm
          param along: length in 4mm..14mm = 9mm
          fn out(a: angle, z: length) {
            let near = exp(-((a - 30deg) / 20deg) ^ 2 - ((z - along) / 4mm) ^ 2)
            polar(r + lobe * cos(6 * a) + knob * near, a, z)
          }
          part side = |u, v| out((u - 0.5) * 1turn, v * height)
          part top = |u, v| { let p = out((u - 0.5) * 1turn, height)
            (p.x * v, p.y * v, height) }
          part bottom = |u, v| { let p = out((0.5 - u) * 1turn, 0mm)
            (p.x * v, p.y * v, 0mm) }
        }",
    );
    let truth = [20.0, 3.0, 18.0, 3.0, 9.0];
    let scan = scanned(&nut, &truth, &Scanner { random_pose: false, ..scanner(1.2, 0.1, 5) }, |_| true);
    for sixths in 1..6 {
        let turn = (f64::from(sixths) * 60.0).to_radians();
        let mut turned = scan.clone();
        let rotation = glam::DMat3::from_rotation_z(turn);
        for p in &mut turned.mesh.positions {
            *p = (rotation * DVec3::from_array(*p)).to_array();
        }
        for n in &mut turned.mesh.normals {
            *n = (rotation * DVec3::from_array(*n)).to_array();
        }
        // From values and a pose that are right but for the turn no search goes on.
        let options = begun_at(&[("r", 20.0), ("lobe", 3.0), ("height", 18.0), ("knob", 1.0), ("along", 8.0)]);
        let result = fit(&nut, &turned, &options, &Silent).unwrap();
        for (p, truth) in result.parameters.iter().zip(&truth) {
            let sd = p.sd.unwrap_or_else(|| panic!("{sixths}: {p:?}"));
            assert!((p.value - truth).abs() < 4.0 * sd, "{sixths}: {p:?} for {truth} {:?}", result.warnings);
        }
    }
}

/// An angle bracket: turned over, each leg takes the other one's length, and only the holes tell them apart.
#[test]
fn an_angle_bracket_is_not_fitted_with_its_legs_exchanged() {
    let bracket = program(
        "fn plate(w, h, x, y, r) = |u, v| {
          let a = u * 1turn
          let (c, s) = (cos(a), sin(a))
          let dx = if c > 0 { (w - x) / max(c, 1e-9) } else { x / max(-c, 1e-9) }
          let dy = if s > 0 { (h - y) / max(s, 1e-9) } else { y / max(-s, 1e-9) }
          let d = mix(min(dx, dy), r, v)
          (x + d * c, y + d * s)
        }
        model bracket {
          param a: length in 30mm..90mm = 70mm
          param b: length in 30mm..90mm = 50mm
          param w: length in 15mm..60mm = 30mm
          param t: length in 3mm..9mm = 5mm
          param hole_a: length in 2mm..7mm = 5mm
          param hole_b: length in 2mm..7mm = 4mm
          param at_a: real in 0.5..0.75 = 0.65
          param at_b: real in 0.5..0.75 = 0.6
          part foot = {
            under: |u, v| { let p = plate(a, w, a * at_a, w / 2, hole_a)(u, v)
              (p.x, w - p.y, 0mm) },
            over: |u, v| { let p = plate(a - t, w, a * at_a - t, w / 2, hole_a)(u, v)
              (p.x + t, p.y, t) },
            bore: |u, v| (a * at_a + hole_a * cos(u * 1turn), w / 2 - hole_a * sin(u * 1turn), t * v),
            tip: |u, v| (a, w * u, t * v),
            left: |u, v| (a * u, 0mm, t * v),
            right: |u, v| (a * v, w, t * u),
          }
          part back = {
            behind: |u, v| { let p = plate(b, w, b * at_b, w * 0.55, hole_b)(u, v)
              (0mm, p.y, p.x) },
            before: |u, v| { let p = plate(b - t, w, b * at_b - t, w * 0.45, hole_b)(u, v)
              (t, w - p.y, p.x + t) },
            bore: |u, v| (t * v, w * 0.55 + hole_b * sin(u * 1turn), b * at_b + hole_b * cos(u * 1turn)),
            tip: |u, v| (t * u, w * v, b),
            left: |u, v| (t * u, 0mm, t + (b - t) * v),
            right: |u, v| (t * v, w, t + (b - t) * u),
          }
        }",
    );
    let truth = [46.0, 62.0, 21.0, 5.0, 3.4, 2.6, 0.65, 0.6];
    for seed in 5..8 {
        let scan = scanned(&bracket, &truth, &Scanner { random_pose: false, ..scanner(1.4, 0.4, seed) }, |_| true);
        let options = begun_at(&[("a", 62.0), ("b", 46.0), ("w", 21.0)]);
        let result = fit(&bracket, &scan, &options, &Silent).unwrap();
        for (p, truth) in result.parameters.iter().zip(&truth) {
            let sd = p.sd.unwrap_or_else(|| panic!("{seed}: {p:?}"));
            // Between the legs the difference is 16 mm: what holds both is no answer.
            assert!((p.value - truth).abs() < 4.0 * sd && sd < 1.0, "{seed}: {p:?} for {truth} {:?}", result.warnings);
        }
    }
}

/// The lengths of a block may be exchanged, which is no other shape: they have the intervals of one shape, and the
/// order of the start.
#[test]
fn a_block_by_other_names_is_the_same_block() {
    let block = program(
        "model block {
          param a: length in 20mm..80mm = 40mm
          param b: length in 20mm..80mm = 41mm
          param c: length in 20mm..80mm = 42mm
          part body = {
            top: |u, v| (a * u, b * v, c),
            bottom: |u, v| (a * v, b * u, 0mm),
            left: |u, v| (0mm, b * v, c * u),
            right: |u, v| (a, b * u, c * v),
            front: |u, v| (a * u, 0mm, c * v),
            back: |u, v| (a * v, b, c * u),
          }
        }",
    );
    for truth in [[38.0, 44.0, 47.0], [60.0, 30.0, 61.0]] {
        let scan = scanned(&block, &truth, &scanner(1.0, 0.2, 3), |_| true);
        let result = fit(&block, &scan, &FitOptions::default(), &Silent).unwrap();
        let mut sorted = truth;
        sorted.sort_by(f64::total_cmp);
        for (p, truth) in result.parameters.iter().zip(&sorted) {
            let sd = p.sd.unwrap();
            // Some thousand points of a face with noise of 0.2 mm.
            assert!((p.value - truth).abs() < 4.0 * sd && sd < 0.03, "{p:?} for {truth} {:?}", result.warnings);
        }
        assert!(result.alternatives.is_empty() && result.warnings.is_empty(), "{:?}", result.warnings);
    }
}

/// Half of a block whose bore was cut away: which of its lengths are the two that are left, nothing tells. A value that
/// has an interval has it by all names.
#[test]
fn lengths_of_half_a_block_have_no_names() {
    let drilled = program(
        "model drilled {
          param l: length in 20mm..90mm = 50mm
          param w: length in 20mm..90mm = 45mm
          param h: length in 20mm..90mm = 30mm
          param x: length in 5mm..60mm = 20mm
          param y: length in 5mm..60mm = 20mm
          param r: length in 3mm..15mm = 6mm
          require x + r < l, \"the bore is inside of the block\"
          require y + r < w, \"the bore is inside of the block\"
          let edge = |u: real| {
            let a = u * 1turn
            let (c, s) = (cos(a), sin(a))
            let dx = if c > 0 { (l - x) / max(c, 1e-9) } else { x / max(-c, 1e-9) }
            let dy = if s > 0 { (w - y) / max(s, 1e-9) } else { y / max(-s, 1e-9) }
            (c, s, min(dx, dy))
          }
          let ring = |u: real, v: real| {
            let e = edge(u)
            let d = mix(e.z, r, v)
            (x + d * e.x, y + d * e.y)
          }
          part top = |u, v| { let p = ring(u, v)
            (p.x, p.y, h) }
          part bottom = |u, v| { let p = ring(u, 1 - v)
            (p.x, p.y, 0mm) }
          part bore = |u, v| (x + r * cos(u * 1turn), y - r * sin(u * 1turn), h * v)
          part left = |u, v| (0mm, w * v, h * u)
          part right = |u, v| (l, w * u, h * v)
          part front = |u, v| (l * u, 0mm, h * v)
          part back = |u, v| (l * v, w, h * u)
        }",
    );
    for truth in [[69.0, 70.0, 52.0, 10.0, 44.0, 3.8], [43.0, 33.0, 61.0, 14.0, 14.0, 3.2]] {
        let kept = |p: DVec3| p.x > 0.5 * truth[0];
        let scan = scanned(&drilled, &truth, &Scanner { random_pose: false, ..scanner(1.3, 0.1, 5) }, kept);
        let result = fit(&drilled, &scan, &FitOptions::default(), &Silent).unwrap();
        assert!(!result.alternatives.is_empty(), "{:?}", result.parameters);
        for (p, truth) in result.parameters.iter().zip(&truth) {
            let is_held = |sd: f64| (p.value - truth).abs() < 4.0 * sd;
            assert!(p.sd.is_none_or(is_held), "{p:?} for {truth} {:?}", result.warnings);
        }
    }
}
