//! Areas, volumes and centroids with their derivatives against closed formulas.

use super::measured;
use gml_compiler::program::{Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use std::f64::consts::PI;

fn program(body: &str) -> Program {
    let text = format!("use std.solid\nuse std.surface (annulus, cylinder)\nmodel m {{\n{body}\n}}\n");
    let script = SourceFile { name: "m.gml".to_owned(), text: text.clone() };
    compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}\n{text}")).program
}

/// Every measure has the value and the derivatives that are expected, to a part of the value.
fn agrees(body: &str, x: &[f64], expected: &[(f64, &[f64])], to: f64) {
    let program = program(body);
    for (measure, (measured, (value, slopes))) in
        program.measures().iter().zip(measured(&program, x).into_iter().zip(expected))
    {
        let name = &measure.name;
        let measured = measured.unwrap_or_else(|e| panic!("{name}: {}", e.message));
        assert!((measured.value - value).abs() <= to * value.abs(), "{name}: {} is not {value}", measured.value);
        let gradient = measured.gradient.unwrap_or_else(|e| panic!("{name}: {}", e.message));
        let largest = slopes.iter().fold(value.abs() / 10.0, |most, slope| most.max(slope.abs()));
        for (got, slope) in gradient.iter().zip(*slopes) {
            assert!((got - slope).abs() <= to * largest, "{name}: the gradient {gradient:?} is not {slopes:?}");
        }
    }
}

#[test]
fn of_whole_patches() {
    let body = "param r: length in 5mm..50mm = 20mm
        param bore: length in 2mm..r = 12mm
        param h: length in 5mm..100mm = 30mm
        measure all = volume()
        measure skin = area(outside)
        measure faces = area(top) + area(bottom)
        measure height = centroid().z
        measure density = volume() / (area(outside) * 1mm)
        part outside = cylinder(r, h)
        part inside = cylinder(bore, h).flip()
        part top = annulus(bore, r).translate((0mm, 0mm, h))
        part bottom = annulus(bore, r).flip()";
    let (r, b, h) = (21.0_f64, 11.0_f64, 33.0_f64);
    let volume = PI * (r * r - b * b) * h;
    let skin = 2.0 * PI * r * h;
    let faces = 2.0 * PI * (r * r - b * b);
    let by = |value: f64, slopes: [f64; 3]| (value, slopes);
    let density = (r * r - b * b) / (2.0 * r);
    let expected = [
        by(volume, [2.0 * PI * r * h, -2.0 * PI * b * h, volume / h]),
        by(skin, [skin / r, 0.0, skin / h]),
        by(faces, [4.0 * PI * r, -4.0 * PI * b, 0.0]),
        by(h / 2.0, [0.0, 0.0, 0.5]),
        by(density, [0.5 + b * b / (2.0 * r * r), -b / r, 0.0]),
    ];
    let expected: Vec<(f64, &[f64])> = expected.iter().map(|(value, slopes)| (*value, &slopes[..])).collect();
    agrees(body, &[r, b, h], &expected, 1e-8);
}

#[test]
fn of_a_plate_with_a_hole() {
    let body = "param w: length in 20mm..90mm = 60mm
        param r: length in 1mm..9mm = 5mm
        param h: length in 1mm..20mm = 8mm
        param at: length in -20mm..20mm = 10mm
        measure all = volume(plate)
        measure top = area(plate.top)
        measure bore = area(plate.hole.wall)
        measure middle = centroid(plate).x
        part plate = box(width: w, depth: 40mm, height: h)
            - {hole: capped_cylinder(radius: r, height: h).translate((at, 3mm, 0mm))}";
    let (w, r, h, at) = (62.0_f64, 6.0_f64, 9.0_f64, 11.0_f64);
    let face = 40.0 * w - PI * r * r;
    let (hole, bore) = (PI * r * r, 2.0 * PI * r * h);
    let middle = -hole * at / face;
    let expected: [(f64, &[f64]); 4] = [
        (face * h, &[40.0 * h, -bore, face, 0.0]),
        (face, &[40.0, -2.0 * PI * r, 0.0, 0.0]),
        (bore, &[0.0, 2.0 * PI * h, 2.0 * PI * r, 0.0]),
        (
            middle,
            &[
                -40.0 * middle / face,
                -2.0 * PI * r * at / face - hole * at * 2.0 * PI * r / (face * face),
                0.0,
                -hole / face,
            ],
        ),
    ];
    agrees(body, &[w, r, h, at], &expected, 2e-5);
}

#[test]
fn of_a_ball_with_a_bore() {
    let body = "param r: length in 5mm..30mm = 10mm
        param bore: length in 1mm..4mm = 3mm
        measure material = volume(ring)
        measure zone = area(ring.wall)
        measure wall = area(ring.hole)
        part ring = ball(radius: r)
            - {hole: capped_cylinder(radius: bore, height: 80mm).translate((0mm, 0mm, -40mm))}";
    let (r, b) = (11.0_f64, 3.5_f64);
    let half = (r * r - b * b).sqrt();
    let expected: [(f64, &[f64]); 3] = [
        (4.0 / 3.0 * PI * half.powi(3), &[4.0 * PI * half * r, -4.0 * PI * half * b]),
        (4.0 * PI * r * half, &[4.0 * PI * (half + r * r / half), -4.0 * PI * r * b / half]),
        (4.0 * PI * b * half, &[4.0 * PI * b * r / half, 4.0 * PI * (half - b * b / half)]),
    ];
    agrees(body, &[r, b], &expected, 2e-5);
}

#[test]
fn of_edges_that_the_other_solid_makes() {
    // The drill is longer than the plate, the pocket has its own bottom.
    let body = "param r: length in 1mm..9mm = 7mm
        param h: length in 12mm..30mm = 20mm
        measure wall = area(plate.drill.wall)
        measure all = area(plate)
        measure side = area(plate.pocket.left)
        measure top = area(plate.top)
        part plate = box(width: 40mm, depth: 40mm, height: h)
            - {
              drill: capped_cylinder(radius: r, height: 60mm).translate((0mm, 0mm, -20mm)),
              pocket: box(width: r, depth: 7mm, height: 60mm).translate((14mm, 14mm, 8mm)),
            }";
    let (r, h) = (6.0_f64, 21.0_f64);
    let all = 2.0 * (1600.0 - PI * r * r) + 160.0 * h + 2.0 * PI * r * h + 2.0 * (r + 7.0) * (h - 8.0);
    let expected: [(f64, &[f64]); 4] = [
        (2.0 * PI * r * h, &[2.0 * PI * h, 2.0 * PI * r]),
        (all, &[2.0 * PI * h - 4.0 * PI * r + 2.0 * (h - 8.0), 174.0 + 2.0 * r + 2.0 * PI * r]),
        (7.0 * (h - 8.0), &[0.0, 7.0]),
        (1600.0 - PI * r * r - 7.0 * r, &[-2.0 * PI * r - 7.0, 0.0]),
    ];
    agrees(body, &[r, h], &expected, 2e-5);
}

#[test]
fn where_discs_coincide() {
    // Both discs are there around their poles, where the function of one is level; a block takes what is beyond a line
    // off, along which edges may turn far about the pole.
    let body = "param q: length in 1mm..9mm = 5mm
        measure first = area(p.base)
        part p = capped_cylinder(radius: 5mm, height: 20mm)
            + {block: box(width: 20mm, depth: 20mm, height: 4mm).translate((10.3mm, 0mm, -2mm))}
            + {other: capped_cylinder(radius: 7.5mm, height: 10mm).translate((q, 0mm, 0mm))}";
    let first = PI * 25.0 - (25.0 * 0.06_f64.acos() - 0.3 * 24.91_f64.sqrt());
    agrees(body, &[4.0], &[(first, &[0.0])], 2e-5);
}

#[test]
fn where_an_edge_goes_through_a_pole() {
    let body = "param q: length in 1mm..9mm = 5mm
        measure second = area(p.other.base)
        part p = capped_cylinder(radius: 5mm, height: 20mm)
            + {other: capped_cylinder(radius: 7.5mm, height: 10mm).translate((q, 0mm, 0mm))}";
    let (r, s) = (5.0_f64, 7.5_f64);
    let truth = |q: f64| {
        let height = ((r + s - q) * (q + r - s) * (q - r + s) * (q + r + s)).sqrt();
        let common = r * r * ((q * q + r * r - s * s) / (2.0 * q * r)).acos()
            + s * s * ((q * q + s * s - r * r) / (2.0 * q * s)).acos()
            - 0.5 * height;
        // It moves by the width of what they have in common.
        (PI * s * s - common, height / q)
    };
    let (area, slope) = truth(8.0);
    agrees(body, &[8.0], &[(area, &[slope])], 1e-4);
    // Right through the pole the area is right; its derivative lacks a hundredth there.
    let (area, slope) = truth(5.0);
    agrees(body, &[5.0], &[(area, &[slope])], 2e-2);
    let program = program(body);
    let measured = measured(&program, &[5.0]).swap_remove(0).expect("a value").value;
    assert!((measured / area - 1.0).abs() < 1e-4, "{measured} for {area}");
}

#[test]
fn of_corners_that_run_obliquely() {
    // A screw thread: whose corners are helices. By its symmetry the middle is the middle of its length.
    let body = "param d: length in 8mm..12mm = 10mm
        measure middle = centroid().z
        part rod = threaded_rod(d, 1.5mm, 21mm)";
    agrees(body, &[10.0], &[(10.5, &[0.0])], 2e-6);
}

#[test]
fn of_trimmed_patches_with_poles() {
    // The ball's lower pole and the disc of the cylinder's upper end are there.
    let body = "param r: length in 5mm..9mm = 8mm
        measure all = volume(pin)
        measure cap = area(pin.wall)
        measure end = area(pin.rod.top)
        part pin = ball(radius: 10mm) + {rod: capped_cylinder(radius: r, height: 30mm)}";
    let r = 7.0_f64;
    let h = (100.0 - r * r).sqrt();
    // The part of the ball above a plane in h, and the cylinder from there on.
    let above = PI * (10.0 - h).powi(2) * (20.0 + h) / 3.0;
    let ball = 4000.0 / 3.0 * PI;
    let by_h = -PI * (100.0 - h * h);
    let (volume, slope) = (ball - above + PI * r * r * (30.0 - h), 2.0 * PI * r * (30.0 - h));
    let slope = slope + (-by_h - PI * r * r) * (-r / h);
    let cap = 20.0 * PI * (10.0 + h);
    let expected: [(f64, &[f64]); 3] =
        [(volume, &[slope]), (cap, &[-20.0 * PI * r / h]), (PI * r * r, &[2.0 * PI * r])];
    agrees(body, &[r], &expected, 2e-5);
}

#[test]
fn of_two_balls_in_common() {
    let body = "param d: length in 2mm..18mm = 12mm
        measure common = volume(lens)
        measure middle = centroid(lens).x
        part lens = ball(radius: 10mm) & {other: ball(radius: 10mm).translate((d, 0mm, 0mm))}";
    let d = 11.0_f64;
    let volume = PI * (40.0 + d) * (20.0 - d).powi(2) / 12.0;
    let slope = PI / 12.0 * ((20.0 - d).powi(2) - 2.0 * (40.0 + d) * (20.0 - d));
    agrees(body, &[d], &[(volume, &[slope]), (d / 2.0, &[0.5])], 2e-5);
}

#[test]
fn what_has_no_volume_says_so() {
    let said = |body: &str| {
        let program = program(body);
        let measured = measured(&program, &program.defaults()).swap_remove(0);
        measured.map(|m| m.value).expect_err("no volume").message
    };
    let open = said("param h: length = 9mm\nmeasure v = volume()\npart wall = cylinder(5mm, h)");
    assert!(open.contains("its parts enclose no volume: wall is open"), "{open}");
    let some = said("param h: length = 9mm\nmeasure v = volume(tin.wall)\npart tin = capped_cylinder(height: h)");
    assert!(some.contains("its parts enclose no volume: tin.wall is open"), "{some}");
    let inwards = said("param h: length = 9mm\nmeasure v = volume()\npart tin = capped_cylinder(height: h).flip()");
    assert!(inwards.contains("faces inwards"), "{inwards}");
    let twice = said(
        "param h: length = 9mm\nmeasure v = volume()\npart a = box(height: h)\n\
         part b = box().translate((7mm, 6mm, 5mm))",
    );
    assert!(twice.contains("its parts overlap"), "{twice}");
    let nothing = said(
        "param h: length = 9mm\nmeasure v = volume()\n\
         part a = box(height: h) & {other: box().translate((99mm, 0mm, 0mm))}",
    );
    assert!(nothing.contains("nothing is left of its parts"), "{nothing}");
}

#[test]
fn distances_between_walls() {
    let body = "param d: length in 4mm..12mm = 8mm
        param apart: length in 14mm..40mm = 20mm
        param width: length in 50mm..90mm = 60mm
        measure web = least_distance(plate.hole[0].wall, plate.hole[1].wall)
        measure rim = least_distance(plate.hole, plate.right)
        measure double = 2 * least_distance(plate.left, plate.right)
        let bolt = capped_cylinder(radius: d / 2, height: 6mm)
        part plate = box(width: width, depth: 40mm, height: 6mm)
          - {hole: for i in 0..2 { bolt.translate(((i - 0.5) * apart, 0mm, 0mm)) }}";
    let (d, apart, width) = (7.3, 21.7, 63.0);
    let expected: [(f64, &[f64]); 3] = [
        (apart - d, &[-1.0, 1.0, 0.0]),
        (0.5 * (width - apart - d), &[-0.5, -0.5, 0.5]),
        (2.0 * width, &[0.0, 0.0, 2.0]),
    ];
    agrees(body, &[d, apart, width], &expected, 1e-8);
}

/// A corner within a wall, whose place in u changes with the parameters: the motion of neither side is that of the
/// corner. Faces that end in such corners, whose vertices are on the other side.
#[test]
fn distances_to_corners_within_a_surface() {
    let body = "param w: length in 10mm..40mm = 20mm
        param d: length in 5mm..20mm = 10mm
        measure to_corner = least_distance(post, probe)
        measure across = least_distance(posts[0], posts[1])
        part post = prism(rectangle(w, d), 10mm)
        part probe = sphere(2mm).translate((16mm, 9mm, 5mm))
        let posts = for i in 0..2 { prism(rectangle(w, d), 10mm).translate((90mm * (i + 1), 0mm, 0mm)) }
        part posts = posts";
    let (w, d) = (21.0_f64, 11.0_f64);
    let (x, y) = (16.0 - w / 2.0, 9.0 - d / 2.0);
    let from = x.hypot(y);
    let expected: [(f64, &[f64]); 2] = [(from - 2.0, &[-x / from / 2.0, -y / from / 2.0]), (90.0 - w, &[-1.0, 0.0])];
    agrees(body, &[w, d], &expected, 1e-6);
}

/// A hole beside a wall, whose nearest places lie along a line, far from the origin: coordinates are rounded there.
#[test]
fn distances_along_lines_are_known_wherever_they_are() {
    for at in ["0mm", "100m", "-30m"] {
        for (r, x) in [(5.5, 10.0), (9.99, 13.007), (9.3, 11.3)] {
            let body = format!(
                "param r: length in 1mm..15mm = 5mm
                measure web = least_distance(plate.hole.wall, plate.right)
                part plate = (box(width: 74mm, depth: 52mm, height: 11mm) - {{hole: capped_cylinder(radius: r, height: 11mm)
                    .translate(({x}mm, 5mm, 0mm))}}).rotate(31deg, (1, 1, 4)).translate(({at}, -0.7 * {at}, 3mm))"
            );
            agrees(&body, &[r], &[(37.0 - x - r, &[-1.0])], 1e-6);
        }
    }
}

/// The corner of a cube that stands out of a plate, askew: the face is cut by three edges, each of which ends on both
/// others.
#[test]
fn of_edges_that_meet_in_corners_within_a_face() {
    let body = "param h: length in 1mm..5mm = 2mm
        measure lid = area(body.top)
        measure tip = area(body.cube)
        measure all = area(body)
        measure material = volume(body)
        let cube = box(width: 10mm, depth: 10mm, height: 10mm).translate((-5mm, -5mm, -10mm)).rotate(50deg, (1, -1, 0))
        part body = box(width: 40mm, depth: 40mm, height: 30mm) + {cube: cube.translate((3mm, 2mm, 30mm + h))}";
    let h = 2.5_f64;
    // How steep the edges are.
    let angle = 50_f64.to_radians();
    let (a, b) = (angle.sin() / 2.0_f64.sqrt(), angle.cos());
    let (section, faces) = (h * h / (2.0 * a * a * b), h * h / 2.0 * (1.0 / (a * a) + 2.0 / (a * b)));
    let sides = 2.0 * 1600.0 + 4.0 * 1200.0;
    let expected: [(f64, &[f64]); 4] = [
        (1600.0 - section, &[-2.0 * section / h]),
        (faces, &[2.0 * faces / h]),
        (sides + faces - section, &[2.0 * (faces - section) / h]),
        (48000.0 + h * section / 3.0, &[section]),
    ];
    agrees(body, &[h], &expected, 1e-6);
}

/// The nearest place is on the edge that a hole makes, which moves with its radius.
#[test]
fn distances_to_the_edge_of_a_hole() {
    let body = "param r: length in 4mm..12mm = 8mm
        param x: length in 0.5mm..3mm = 2mm
        param z: length in 5mm..20mm = 9mm
        measure to_edge = least_distance(plate.top, probe.wall)
        part plate = box(width: 60mm, depth: 40mm, height: 6mm)
          - {hole: capped_cylinder(radius: r, height: 6mm)}
        part probe = ball(radius: 2mm).translate((x, 0mm, 6mm + z))";
    let (r, x, z) = (8.5_f64, 1.25_f64, 9.75_f64);
    let from = (r - x).hypot(z);
    let expected: [(f64, &[f64]); 1] = [(from - 2.0, &[(r - x) / from, -(r - x) / from, z / from])];
    agrees(body, &[r, x, z], &expected, 1e-7);
}

/// Two edges across each other, and two balls, whose nearest places are no vertices of triangles.
#[test]
fn distances_between_edges_and_between_balls() {
    let body = "param side: length in 4mm..12mm = 8mm
        param z: length in 15mm..40mm = 20mm
        param r: length in 2mm..6mm = 5mm
        measure edges = least_distance(below, above)
        measure balls = least_distance(first, second)
        let bar = box(width: 30mm, depth: side, height: side).translate((0mm, 0mm, -side / 2)).rotate(45deg, (1, 0, 0))
        part below = bar
        part above = bar.rotate(90deg).translate((1mm, 2mm, z))
        part first = ball(radius: r).translate((0mm, 60mm, 0mm))
        part second = ball(radius: 3mm).translate((z, 60mm + z, z))";
    let (side, z, r) = (7.0, 23.0, 4.5);
    let sqrt = f64::sqrt;
    let expected: [(f64, &[f64]); 2] =
        [(z - side * sqrt(2.0), &[-sqrt(2.0), 1.0, 0.0]), (z * sqrt(3.0) - r - 3.0, &[0.0, sqrt(3.0), -1.0])];
    agrees(body, &[side, z, r], &expected, 1e-8);
}

#[test]
fn angles_between_faces() {
    let body = "param rise: length in 4mm..12mm = 8mm
        param run: length in 15mm..40mm = 20mm
        param turn: angle in 5deg..80deg = 30deg
        measure wedge = face_angle(ramp.side[1], ramp.side[0])
        measure turned = face_angle(ramp.top, lid.top)
        part ramp = extruded([(0mm, 0mm), (run, 0mm), (0mm, rise)], 10mm)
        part lid = box(width: 10mm, depth: 10mm, height: 10mm).rotate(turn, (1, 0, 0)).translate((0mm, 0mm, 50mm))";
    let (rise, run, turn) = (7.0_f64, 23.0_f64, 0.6);
    let square = rise * rise + run * run;
    let expected: [(f64, &[f64]); 2] =
        [(std::f64::consts::PI - rise.atan2(run), &[-run / square, rise / square, 0.0]), (turn, &[0.0, 0.0, 1.0])];
    agrees(body, &[rise, run, turn], &expected, 1e-8);
}

#[test]
fn what_has_no_distance_or_angle_says_so() {
    let wrong = |measure: &str, parts: &str| {
        let program = program(&format!("param a: length in 1mm..30mm = 5mm\nmeasure m = {measure}\n{parts}"));
        let measured = measured(&program, &program.defaults()).swap_remove(0);
        match measured {
            Err(error) => error.message,
            Ok(measured) => measured.gradient.expect_err("no gradient").message,
        }
    };
    let boxes = "part first = box(width: a)\npart second = box(width: a).translate((30mm, 0mm, 0mm))";
    let crossed = "part first = box(width: a)\npart second = ball(radius: a)";
    for (measure, parts, why) in [
        ("least_distance(first, second)", crossed, "meet near"),
        ("least_distance(first.top, first.right)", boxes, "meet near"),
        (
            "least_distance(first, second)",
            "part first = box()\npart second = ball(radius: 3mm).translate((13mm, 0mm, 9.3mm))",
            "touch near",
        ),
        (
            "least_distance(first.top, gone)",
            "part first = box(height: a)\npart gone = box() - {all: box()}",
            "nothing is left",
        ),
        ("face_angle(second.wall, first.top)", crossed, "'second.wall' is not plane"),
        ("face_angle(first, second.top)", boxes, "several on one side"),
        ("face_angle(first.top, second.base)", boxes, "parallel"),
    ] {
        let said = wrong(measure, parts);
        assert!(said.contains(why), "{measure}: {said}");
    }
    // Of two places that are as near one moves with `a`, and the other does not.
    let sides = "part post = box(width: 4mm)
        part rail = {left: box(width: 4mm).translate((-10mm, 0mm, 0mm)), right: box(width: 4mm).translate((a + 5mm, 0mm, 0mm))}";
    assert!(wrong("least_distance(post, rail)", sides).contains("several places are as near"));
}

/// Of what nothing is left no finer mesh is asked.
#[test]
fn what_is_gone_has_no_volume() {
    let program = program("measure m = volume()\npart b = box() - {all: box()}");
    let why = measured(&program, &[]).swap_remove(0).expect_err("no volume").message;
    assert!(why.contains("nothing is left of its parts"), "{why}");
}

/// Corners of a thread's flanks move within its surface with the pitch, which the formula of areas does not know.
#[test]
fn derivatives_of_areas_that_are_not_known_say_so() {
    let body = "param p: length in 1mm..2mm = 1.5mm
        measure m = area(rod.wall)
        part rod = threaded_rod(10mm, p, 30mm)";
    let program = program(body);
    let measured = measured(&program, &program.defaults()).swap_remove(0).expect("a value");
    let why = measured.gradient.expect_err("no gradient").message;
    assert!(why.contains("corners move within the surface of an area"), "{why}");
}

/// A corner that is rounded by what touches both of its walls: a strip along the line where it does is missing, which
/// is 3e-3 of the derivative.
#[test]
fn of_a_face_whose_corner_is_rounded() {
    let body = "param f: length in 1mm..5mm = 3mm
        measure m = area(b.top)
        part b = box(width: 40mm, depth: 30mm, height: 10mm)
          - {r: cove(f, 10mm).rotate(180deg).translate((20mm, 15mm, 0mm))}";
    let lost = 1.0 - PI / 4.0;
    agrees(body, &[3.0], &[(1200.0 - 9.0 * lost, &[-6.0 * lost])], 5e-5);
}

/// A drill that ends flush with a plate: as it grows nothing changes, and as it shrinks a skin is left. By one
/// parameter for both there is a derivative; by two there is none, nor of what touches a face and is moved.
#[test]
fn where_surfaces_lie_in_each_other_derivatives_have_two_sides() {
    let plate = |drill: &str| {
        format!(
            "param t: length = 5mm
            param d: length = 5mm
            measure material = volume(plate)
            measure height = centroid(plate).z
            part plate = box(width: 20mm, depth: 20mm, height: t) - {{hole: capped_cylinder(radius: 3mm, height: {drill})}}"
        )
    };
    let area = 400.0 - 9.0 * PI;
    agrees(&plate("t"), &[5.0, 5.0], &[(5.0 * area, &[area, 0.0]), (2.5, &[0.5, 0.0])], 1e-5);
    // Deeper than the plate it is as well.
    agrees(&plate("d + 1mm"), &[5.0, 5.0], &[(5.0 * area, &[area, 0.0])], 1e-5);
    // The side of the plate is tangent to the hole: what breaks through is of a higher order.
    let tangent = "param r: length = 5mm
        measure material = volume(plate)
        part plate = box(width: 20mm, depth: 20mm, height: 10mm)
          - {hole: capped_cylinder(radius: r, height: 10mm).translate((5mm, 0mm, 0mm))}";
    agrees(tangent, &[5.0], &[(4000.0 - 250.0 * PI, &[-100.0 * PI])], 1e-3);
    // A bore from below that ends where plate and post are joined is there on either side.
    let blind = "param h: length = 10mm
        param d: length = 10mm
        measure material = volume(b)
        measure skin = area(b)
        part b = box(width: 40mm, depth: 40mm, height: h)
          + {post: box(width: 20mm, depth: 20mm, height: 15mm).translate((0mm, 0mm, h))}
          - {bore: capped_cylinder(radius: 4mm, height: d).translate((2mm, 1mm, 0mm))}";
    let (material, skin) = (22000.0 - 160.0 * PI, 6000.0 + 80.0 * PI);
    let by = [[1600.0, -16.0 * PI], [160.0, 8.0 * PI]];
    agrees(blind, &[10.0, 10.0], &[(material, &by[0]), (skin, &by[1])], 1e-5);
    let blocks = "param t: length = 5mm
        param d: length = 5mm
        measure all = volume(blocks)
        measure skin = area(blocks.top)
        part blocks = box(width: 20mm, depth: 20mm, height: t)
          + {second: box(width: 10mm, depth: 10mm, height: t).translate((10mm + d, 0mm, 0mm))}";
    for (body, by) in [(plate("d"), ["'t'", "'t'"]), (blocks.to_owned(), ["'d'", ""])] {
        let program = program(&body);
        let values = |d: f64| -> Vec<_> {
            measured(&program, &[5.0, d]).into_iter().map(|measured| measured.expect("a value")).collect()
        };
        let [shorter, here, longer] = [4.9, 5.0, 5.1].map(|d| values(d)[0].value);
        assert!((longer - here - (here - shorter)).abs() > 1.0, "{shorter}, {here}, {longer}");
        for (measured, by) in values(5.0).into_iter().zip(by) {
            match measured.gradient {
                Ok(gradient) => assert!(by.is_empty(), "{gradient:?}"),
                Err(error) => assert!(
                    !by.is_empty() && error.message.contains(&format!("that by {by} is another one on either side")),
                    "{}",
                    error.message
                ),
            }
        }
    }
}
