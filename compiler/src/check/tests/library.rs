//! The standard library: orientations, and the functions that no example uses.

use super::support::{diagnosed, model, normal, part, point};
use crate::check::stdlib;
use std::collections::HashMap;

#[test]
fn the_surfaces_normals_point_out_of_the_solid() {
    let script = "model m {
        part ball = sphere(10mm)
        part ring = torus(10mm, 3mm)
        part wall = cylinder(10mm, 20mm)
        part funnel = cone(10mm, 5mm, 20mm)
        part round = tube(circle(10mm), radius: 2mm)
        part bow = tube(arc((0mm, 0mm), 10mm, 0deg, 90deg), radii: (1mm, 2mm))
        part lid = disc(10mm)
        part washer = annulus(5mm, 10mm)
        part sheet = plane(10mm, 20mm)
        part under = flip(disc(10mm))
        part moved = sphere(10mm).translate((100mm, 0mm, 0mm)).rotate(90deg).scale(2)
        part pulled = stretch(sphere(10mm), (1, 2, 3))
    }";
    let model = model(script);
    let none = HashMap::new();
    let grid = || (0..5).flat_map(|i| (0..5).map(move |j| (0.03 + 0.19 * f64::from(i), 0.07 + 0.2 * f64::from(j))));
    let check = |name: &str, away: &dyn Fn([f64; 3]) -> [f64; 3]| {
        for (u, v) in grid() {
            let part = part(&model, name);
            let (q, n) = (point(&model, part, &none, u, v), normal(&model, part, &none, u, v));
            let a = away(q);
            let along = a[0] * n[0] + a[1] * n[1] + a[2] * n[2];
            assert!(along > 0.1, "{name} at ({u}, {v}): point {q:?}, normal {n:?}");
        }
    };
    let ring = |radius: f64| {
        move |q: [f64; 3]| {
            let rho = q[0].hypot(q[1]);
            [q[0] * (1.0 - radius / rho), q[1] * (1.0 - radius / rho), q[2]]
        }
    };
    let upright = |q: [f64; 3]| {
        let rho = q[0].hypot(q[2]);
        [q[0] * (1.0 - 10.0 / rho), q[1], q[2] * (1.0 - 10.0 / rho)]
    };
    check("ball", &|q| q);
    check("pulled", &|q| [q[0], q[1] / 4.0, q[2] / 9.0]);
    check("ring", &ring(10.0));
    check("wall", &|q| [q[0], q[1], 0.0]);
    check("funnel", &|q| [q[0], q[1], 0.0]);
    check("round", &upright);
    check("bow", &upright);
    check("lid", &|_| [0.0, 0.0, 1.0]);
    check("washer", &|_| [0.0, 0.0, 1.0]);
    check("sheet", &|_| [0.0, 0.0, 1.0]);
    check("under", &|_| [0.0, 0.0, -1.0]);
    check("moved", &|q| [q[0], q[1] - 200.0, q[2]]);
}

#[test]
fn every_definition_of_the_library_has_a_doc_comment_and_one_module() {
    let mut seen: HashMap<&str, &str> = HashMap::new();
    for (module, text) in stdlib::MODULES {
        assert_eq!(diagnosed(text), "", "{module}");
        let lines: Vec<&str> = text.lines().collect();
        for (i, line) in lines.iter().enumerate() {
            if line.starts_with("fn ") || line.starts_with("let ") {
                assert!(i > 0 && lines[i - 1].starts_with("/// "), "{module}: {line}");
            }
        }
        for name in stdlib::names(text) {
            assert_eq!(seen.insert(name, module), None, "{name} is defined twice");
        }
    }
}
