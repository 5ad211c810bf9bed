//! Trimmed parts: where they are there, and that their points and derivatives are those of the whole surface.

use super::program;
use crate::program::{Order, Program, Sites};

const DISC: &str = "|u: real, v: real| { let p = plane(40mm, 40mm)(u, v)\n keep(p, norm(p) - r) }";

/// The value by which a part is kept, at a place.
fn keep(program: &Program, part: usize, x: &[f64], uv: [f64; 2]) -> f64 {
    let patch = program.keep(part).expect("it is trimmed");
    let mut point = [0.0; 3];
    let instance = program.instantiate(x).expect("it exists");
    instance.evaluate(patch, Sites::Scattered(&[uv[0]], &[uv[1]]), Order::Points, &mut point).expect("it has a value");
    assert_eq!(point[1..], [0.0; 2]);
    point[0]
}

fn model(part: &str) -> Program {
    program(&format!("model m {{\n param r: length in 1mm..30mm = 10mm\n {part}\n}}"))
}

#[test]
fn whatever_is_made_of_a_trimmed_surface_is_trimmed_there() {
    let (x, places) = ([9.0], [[0.1, 0.2], [0.5, 0.55], [0.9, 0.3]]);
    let norm = |[u, v]: [f64; 2]| 40.0 * (u - 0.5).hypot(v - 0.5);
    for (part, truth) in [
        (format!("part p = {DISC}"), &(|uv| norm(uv) - 9.0) as &dyn Fn([f64; 2]) -> f64),
        // Moved, turned inside out, and by another's parameters.
        (format!("part p = ({DISC}).translate((1mm, 2mm, 3mm)).rotate(20deg, (1, 1, 0)).scale(2)"), &|uv| norm(uv) - 9.0),
        (format!("part p = flip({DISC})"), &|[u, v]| norm([u, 1.0 - v]) - 9.0),
        (format!("let s = {DISC}\n part p = |u, v| s(v, u / 2)"), &|[u, v]| norm([v, u / 2.0]) - 9.0),
        // Twice: the least counts.
        (format!("let s = {DISC}\n part p = |u, v| keep(s(u, v), u * 8mm - 3mm)"), &|[u, v]| {
            (norm([u, v]) - 9.0).min(8.0 * u - 3.0)
        }),
        // In a branch, on one side only; in a loop; in a function that is called.
        (format!("let s = {DISC}\n part p = |u, v| if u < r / 18mm {{ s(u, v) }} else {{ plane(40mm, 40mm)(u, v) }}"),
            &|[u, v]| if u < 0.5 { norm([u, v]) - 9.0 } else { 1e6 }),
        ("part p = |u: real, v: real| loop(plane(40mm, 40mm)(u, v), 40, |p, i| keep(p * 1.01, norm(p) - r + i * 0.1mm))"
            .to_owned(), &|uv| norm(uv) - 9.0),
        // The derivative of a trimmed surface is not trimmed.
        (format!("let s = {DISC}\n part p = |u, v| s'u(u, v) * 0.5 + s(u, v)"), &|uv| norm(uv) - 9.0),
    ] {
        let program = model(&part);
        for uv in places {
            let (found, truth) = (keep(&program, 0, &x, uv), truth(uv));
            assert!((found - truth).abs() < 1e-12, "{part}: {found} for {truth} at {uv:?}");
        }
    }
}

#[test]
fn points_and_derivatives_are_those_of_the_whole_surface() {
    let [trimmed, whole] =
        [model(&format!("part p = ({DISC}).scale(r / 1mm)")), model("part p = plane(40mm, 40mm).scale(r / 1mm)")];
    assert_eq!((whole.keep(0), trimmed.parts().len()), (None, 1));
    assert_eq!(trimmed.parts(), whole.parts());
    for order in [Order::Points, Order::Partials, Order::Jacobian] {
        let values = [&trimmed, &whole].map(|program| {
            let mut out = vec![0.0; order.width(&program.parts()[0])];
            let instance = program.instantiate(&[7.0]).expect("it exists");
            instance.evaluate(0, Sites::Scattered(&[0.3], &[0.8]), order, &mut out).expect("it has values");
            out
        });
        assert_eq!(values[0], values[1], "{order:?}");
    }
}

#[test]
fn where_a_part_is_there_has_a_derivative_by_the_parameters() {
    let program = model("part p = box(width: 3 * r) - {hole: capped_cylinder(radius: r / 2)}");
    let top = program.keep(0).expect("it is trimmed");
    let instance = program.instantiate(&[8.0]).expect("it exists");
    let mut jacobian = [0.0; 3];
    let (u, v) = (0.9, 0.7);
    instance.evaluate(top, Sites::Scattered(&[u], &[v]), Order::Jacobian, &mut jacobian).expect("it has values");
    let h = 1e-5;
    let difference = (keep(&program, 0, &[8.0 + h], [u, v]) - keep(&program, 0, &[8.0 - h], [u, v])) / (2.0 * h);
    assert!((jacobian[0] - difference).abs() < 1e-8 && jacobian[0].abs() > 0.1, "{jacobian:?} for {difference}");
}
