//! Solids made of others: their meshes are closed, and their volumes those of the formulas.

use super::*;

/// Scripts with the volumes of what they make (cubic millimetres).
fn solids() -> Vec<(&'static str, f64)> {
    let lens = |r: f64, d: f64| PI * (4.0 * r + d) * (2.0 * r - d).powi(2) / 12.0;
    let ball = 4.0 / 3.0 * PI * 1000.0;
    let long = "let rod = capped_cylinder(radius: 10mm, height: 40mm).translate((0mm, 0mm, -20mm))";
    vec![
        (
            "part p = ball(radius: 10mm) - {hole: capped_cylinder(radius: 6mm, height: 40mm).translate((0mm, 0mm, -20mm))}",
            PI * 16.0_f64.powi(3) / 6.0,
        ),
        (
            "part p = ball(radius: 10mm) + {other: ball(radius: 10mm).translate((12mm, 0mm, 0mm))}",
            2.0 * ball - lens(10.0, 12.0),
        ),
        ("part p = ball(radius: 10mm) & {other: ball(radius: 10mm).translate((12mm, 0mm, 0mm))}", lens(10.0, 12.0)),
        (
            "part p = ball(radius: 10mm) - {other: ball(radius: 10mm).translate((0mm, 7mm, 9mm))}",
            ball - lens(10.0, 130.0_f64.sqrt()),
        ),
        // Flush at both ends.
        (
            "part p = box(width: 60mm, depth: 40mm, height: 6mm) - {hole: for i in 0..2 {
            capped_cylinder(radius: 4mm, height: 6mm).translate(((i - 0.5) * 30mm, 0mm, 0mm)) }}",
            60.0 * 40.0 * 6.0 - 2.0 * PI * 16.0 * 6.0,
        ),
        // Blind, from one face.
        (
            "part p = box() - {hole: capped_cylinder(radius: 4mm, height: 10mm).translate((0mm, 0mm, 10mm))}",
            8000.0 - PI * 160.0,
        ),
        // Side by side with a common face, and on each other with equal rims.
        ("part p = box() + {other: box().translate((20mm, 0mm, 0mm))}", 16000.0),
        ("part p = box() + {other: box().translate((20mm, 5mm, 4mm))}", 16000.0),
        ("part p = capped_cylinder() + {other: capped_cylinder().translate((0mm, 0mm, 20mm))}", 4000.0 * PI),
        ("part p = box() & {other: box()}", 8000.0),
        ("part p = box() + {other: box()}", 8000.0),
        ("part p = box() & {other: box().translate((8mm, 0mm, 0mm))}", 12.0 * 400.0),
        ("part p = box() - {other: box().translate((8mm, 8mm, 8mm))}", 8000.0 - 12.0_f64.powi(3)),
        // A pipe tee without its bore.
        (
            Box::leak(format!("{long} part p = rod & {{other: rod.rotate(90deg, (1, 0, 0))}}").into_boxed_str()),
            16.0 / 3.0 * 1000.0,
        ),
        // Moved and mirrored afterwards, and cut again.
        (
            "let drilled = box() - {hole: capped_cylinder(radius: 3mm, height: 20mm)}
          part p = drilled.rotate(30deg, (1, 2, 3)).translate((5mm, 6mm, 7mm)).mirror((0, 1, 0))",
            8000.0 - PI * 180.0,
        ),
        (
            "let drilled = box() - {hole: capped_cylinder(radius: 3mm, height: 20mm)}
          part p = drilled - {cross: capped_cylinder(radius: 5mm, height: 40mm)
            .translate((0mm, 0mm, -20mm)).rotate(90deg, (1, 0, 0)).translate((0mm, 0mm, 10mm))} & {half: half_space()}",
            0.0,
        ),
    ]
}

#[test]
fn what_solids_are_made_of_closes() {
    for (script, truth) in solids() {
        let program = program(script);
        let tessellation = tessellate(&program, 0.01);
        let mesh = &tessellation.mesh;
        assert_eq!(open_edges(mesh), 0, "{script}");
        let area: f64 =
            mesh.triangles.iter().map(|t| mesh.corners(*t)).map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum();
        let found = volume(mesh);
        // Chords lie up to 0.01 mm beside a surface, of which the mean is two thirds.
        assert!(
            (found - truth).abs() <= 0.01 * area + 1e-9,
            "{script}: {found} for {truth}, {} triangles",
            mesh.triangles.len()
        );
        let closedness = Closedness::of(&program, &*instance(&program)).unwrap();
        assert!(closedness.is_closed() && closedness.inside_out.is_empty(), "{script}: {closedness:?}");
    }
}
