//! Solids made of others: their meshes are closed, and their volumes those of the formulas.

use super::*;

/// Scripts with the volumes of what they make (cubic millimetres).
fn solids() -> Vec<(&'static str, f64)> {
    let lens = |r: f64, d: f64| PI * (4.0 * r + d) * (2.0 * r - d).powi(2) / 12.0;
    let ball = 4.0 / 3.0 * PI * 1000.0;
    // What is left of the box below 12 mm: both bores less what they have in common, an elliptic integral.
    let below = 25.0 * PI - 25.0 * 0.4_f64.acos() + 2.0 * 21.0_f64.sqrt();
    let crossed = 4800.0 - 108.0 * PI - 20.0 * below + 191.233_831_528_65;
    // Of a bar of 4 mm, what is in the bore that it crosses.
    let in_bore = 4.0 * (4.0 * 12.0_f64.sqrt() + 16.0 / 3.0 * PI);
    let common = 18.0 * (5.0_f64 / 6.0).acos() - 2.5 * 11.0_f64.sqrt();
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
        // Moved and mirrored afterwards, and cut again.
        (
            "let drilled = box() - {hole: capped_cylinder(radius: 3mm, height: 20mm)}
          part p = drilled.rotate(30deg, (1, 2, 3)).translate((5mm, 6mm, 7mm)).mirror((0, 1, 0))",
            8000.0 - PI * 180.0,
        ),
        (
            "let drilled = box() - {hole: capped_cylinder(radius: 3mm, height: 20mm)}
          part p = drilled - {cross: capped_cylinder(radius: 5mm, height: 40mm)
            .translate((0mm, 0mm, -20mm)).rotate(90deg, (1, 0, 0)).translate((0mm, 0mm, 10mm))}
            & {half: half_space(at: (0mm, 0mm, 12mm))}",
            crossed,
        ),
        // Without another.
        (
            "part p = box() - {bore: capped_cylinder(radius: 4mm, height: 25mm)
            + {bar: box(width: 4mm, depth: 30mm, height: 4mm).translate((0mm, 0mm, 8mm))}}",
            8000.0 - 320.0 * PI - 320.0 + in_bore,
        ),
        // A small hole in triangles that are large, whose edge just meets one of theirs.
        (
            "part p = box(width: 200mm, depth: 200mm, height: 6mm)
            - {hole: capped_cylinder(radius: 0.5mm, height: 6mm).translate((37mm, 11mm, 0mm))}",
            240_000.0 - 1.5 * PI,
        ),
        // Rods that overlap, from the base of a plate on.
        (
            "part p = box(width: 60mm, depth: 10mm, height: 3mm) + {rod: for i in 0..5 {
            capped_cylinder(radius: 3mm, height: 10mm).translate(((i - 2) * 5mm, 0mm, 0mm)) }}",
            1800.0 + 7.0 * (45.0 * PI - 4.0 * common),
        ),
        // On an outline that is not convex, with a blind hole.
        (
            "part p = extruded([(0mm, 0mm), (40mm, 0mm), (40mm, 12mm), (14mm, 12mm), (14mm, 30mm), (0mm, 24mm)], 8mm)
            - {hole: capped_cylinder(radius: 3mm, height: 4mm).translate((7mm, 7mm, 4mm))}",
            8.0 * (480.0 + 14.0 * 15.0) - 36.0 * PI,
        ),
        // A body of revolution with a hollow that is flush with it.
        (
            "part p = revolved([(0mm, 0mm), (30mm, 0mm), (30mm, 40mm), (12mm, 60mm), (12mm, 70mm), (0mm, 70mm)])
            - {hollow: revolved([(0mm, 3mm), (27mm, 3mm), (27mm, 40mm), (9mm, 60mm), (9mm, 70mm), (0mm, 70mm)])}",
            PI * (36000.0 - 27.0 * 27.0 * 37.0 + cone(30.0, 12.0, 20.0) - cone(27.0, 9.0, 20.0) + 630.0),
        ),
        // A boss with a fillet at its foot, and a rounded edge.
        (
            "part p = box(width: 50mm, depth: 50mm, height: 10mm) + {boss: capped_cylinder(radius: 8mm, height: 25mm)}
            + {fillet: cove_ring(8mm, 3mm).translate((0mm, 0mm, 10mm))}
            - {round: cove(3mm, 50mm).rotate(90deg, (0, 1, 0)).translate((-25mm, -25mm, 10mm))}",
            25000.0 + 960.0 * PI + fillet(8.0, 3.0) - 50.0 * corner(3.0),
        ),
        // A hole with a chamfer, and a boss with one.
        (
            "part p = box(width: 40mm, depth: 40mm, height: 10mm) - {hole: capped_cylinder(radius: 6mm, height: 10mm)}
            - {sink: bevel_ring(6mm, 2mm).mirror((0, 0, 1)).translate((0mm, 0mm, 10mm))}",
            16000.0 - 360.0 * PI - 2.0 * PI * (6.0 + 2.0 / 3.0) * 2.0,
        ),
        (
            "part p = capped_cylinder(radius: 9mm, height: 12mm)
            - {chamfer: bevel_ring(9mm, 2mm, inward: true).mirror((0, 0, 1)).translate((0mm, 0mm, 12mm))}
            - {edge: bevel(1mm, 30mm).translate((-15mm, -15mm, -9mm))}",
            972.0 * PI - 2.0 * PI * (9.0 - 2.0 / 3.0) * 2.0,
        ),
    ]
}

/// Of a frustum, over pi.
fn cone(bottom: f64, top: f64, height: f64) -> f64 {
    height / 3.0 * (bottom * bottom + bottom * top + top * top)
}

/// The area between two lines at right angles and an arc that touches both.
fn corner(radius: f64) -> f64 {
    radius * radius * (1.0 - PI / 4.0)
}

/// The volume of such an area about an axis, at a distance from it: by its centroid (Pappus).
fn fillet(distance: f64, radius: f64) -> f64 {
    let from_corner = (radius.powi(3) / 2.0 - radius.powi(3) * (PI / 4.0 - 1.0 / 3.0)) / corner(radius);
    2.0 * PI * (distance + from_corner) * corner(radius)
}

/// The volume may differ by so much from that of a formula: chords lie up to the fineness beside a surface.
fn deviation(mesh: &TriangleMesh, chord: f64) -> f64 {
    let area = |t: &[u32; 3]| {
        let [a, b, c] = mesh.corners(*t);
        0.5 * (b - a).cross(c - a).length()
    };
    chord * mesh.triangles.iter().map(area).sum::<f64>() + 1e-9
}

#[test]
fn what_solids_are_made_of_closes() {
    for (script, truth) in solids() {
        let program = program(script);
        let mesh = tessellate(&program, 0.01).mesh;
        assert_eq!(open_edges(&mesh), 0, "{script}");
        let (found, triangles) = (volume(&mesh), mesh.triangles.len());
        assert!(
            (found - truth).abs() <= deviation(&mesh, 0.01) && triangles < 100_000,
            "{script}: {found} for {truth}, {triangles} triangles"
        );
        // A chord by a millimetre: next to nothing is left in corners where gaps were closed.
        assert!(folded(&mesh) < 0.01, "{script}: {}", folded(&mesh));
        let closedness = Closedness::of(&program, &*instance(&program)).unwrap();
        assert!(closedness.is_closed() && closedness.inside_out.is_empty(), "{script}: {closedness:?}");
    }
}

#[test]
fn rods_that_touch_along_their_crossing_have_the_volume_of_steinmetz() {
    // Four edges meet in two points, where both rods have one tangent plane: what is there between is not defined.
    let program = program(
        "let rod = capped_cylinder(radius: 10mm, height: 40mm).translate((0mm, 0mm, -20mm))
        part p = rod & {other: rod.rotate(90deg, (1, 0, 0))}",
    );
    let mesh = tessellate(&program, 0.01).mesh;
    assert!((volume(&mesh) - 16.0 / 3.0 * 1000.0).abs() <= deviation(&mesh, 0.01), "{}", volume(&mesh));
}

/// The area of the triangles that face away from the surface's normals at their corners. Square millimetres.
fn folded(mesh: &TriangleMesh) -> f64 {
    let away = |t: &[u32; 3]| {
        let [a, b, c] = mesh.corners(*t);
        let normal: DVec3 = t.iter().map(|i| DVec3::from(mesh.normals[*i as usize])).sum();
        (-0.5 * (b - a).cross(c - a).dot(normal.normalize_or_zero())).max(0.0)
    };
    mesh.triangles.iter().map(away).sum()
}

/// On a plane whose lines of u converge, the middle of an edge in u and v is beside its middle in space: walls of
/// lofted solids had folds of 2 % of their area, which no chord shows.
#[test]
fn walls_whose_lines_converge_have_no_folds() {
    let program = program(
        "let from = [(11mm, -11mm), (11mm, 11mm), (-11mm, 11mm), (-11mm, -11mm)]
        let to = [(7mm, -4mm), (6mm, 7mm), (-7mm, 7mm), (-8mm, -5mm)]
        let drill = capped_cylinder(radius: 3mm, height: 60mm).translate((0mm, 0mm, -30mm)).rotate(90deg, (0, 1, 0))
        part p = lofted(from, to, 19mm) - {drill: drill.translate((0mm, 1mm, 8mm))}",
    );
    for chord in [0.1, 0.02, 0.003] {
        let mesh = tessellate(&program, chord).mesh;
        assert_eq!(open_edges(&mesh), 0);
        assert!(folded(&mesh) < 1e-3, "{} with a chord of {chord}", folded(&mesh));
        let wall = mesh.groups.iter().find(|group| group.name == "p.side[1]").expect("the group");
        let area = |t: &[u32; 3]| {
            let [a, b, c] = mesh.corners(*t);
            0.5 * (b - a).cross(c - a).length()
        };
        let found: f64 = mesh.triangles[wall.start..wall.end].iter().map(area).sum();
        // A trapezoid, 22 and 13 mm wide, whose upper side is 4 mm beside the lower one and 19 mm above it.
        let truth = (22.0 + 13.0) / 2.0 * f64::hypot(4.0, 19.0);
        assert!((found - truth).abs() < 1e-3, "{found} for {truth} with a chord of {chord}");
    }
}
