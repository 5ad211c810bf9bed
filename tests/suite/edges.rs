//! Fillets and chamfers of edges that are named: closed, of the right volume, and errors where there can be none.

use crate::support::solid::{checked, measure, must_be_closed};
use crate::support::{fails, gmlc};
use std::f64::consts::PI;
use std::fs;
use tempfile::tempdir;

/// The area that a fillet of radius 1 takes off a right angle, or fills.
const CORNER: f64 = 1.0 - PI / 4.0;

/// The distance of that area's centroid from either wall.
fn middle() -> f64 {
    (10.0 - 3.0 * PI) / (12.0 - 3.0 * PI)
}

/// A model of a body, with its volume where that is asked for.
fn model(lets: &str, body: &str, with_volume: bool) -> String {
    let volume = if with_volume { "  measure v = volume(body)\n" } else { "" };
    format!("model m {{\n  param r: length in 0.1mm..20mm = 2mm\n{volume}  {lets}\n  part body = {body}\n}}\n")
}

const BOX: &str = "let b = box(width: 40mm, depth: 20mm, height: 10mm)";

#[test]
fn straight_edges_lose_or_gain_their_section_times_their_length() {
    let angle = "let b = box(width: 40mm, depth: 30mm, height: 10mm) + {
    post: box(width: 20mm, depth: 30mm, height: 30mm).translate((-10mm, 0mm, 0mm)),
  }";
    let cases = [
        (BOX, "b.fillet(top, right, r)", -20.0, 8000.0),
        (BOX, "fillet(b, b.front, left, radius: r).fillet(back, right, r)", -20.0, 8000.0),
        (angle, "b.fillet(top, post.right, r)", 30.0, 24_000.0),
    ];
    for (lets, body, length, whole) in cases {
        let check = checked(&model(lets, body, true), &[]);
        assert_eq!(check["closed"], true, "{body}: {}", check["open_borders"]);
        let (volume, truth) = (measure(&check, 0), whole + CORNER * 4.0 * length);
        assert!((volume - truth).abs() < 0.01, "{body}: {volume} for {truth}");
        let slope = check["measures"][0]["derivatives"]["r"].as_f64().expect("a derivative");
        let expected = CORNER * 4.0 * length;
        assert!((slope / expected - 1.0).abs() < 1e-3, "{body}: {slope} for {expected}");
    }
}

/// By Pappus, to the strip where the surfaces touch.
#[test]
fn the_rim_of_a_hole_loses_a_part_of_a_torus() {
    let lets =
        "let b = box(width: 40mm, depth: 30mm, height: 10mm) - {hole: capped_cylinder(radius: 8mm, height: 10mm)}";
    let check = checked(&model(lets, "b.fillet(top, hole.wall, r)", true), &[]);
    assert_eq!(check["closed"], true, "{}", check["open_borders"]);
    let lost = 12_000.0 - PI * 640.0 - measure(&check, 0);
    let truth = 2.0 * PI * (8.0 + 2.0 * middle()) * CORNER * 4.0;
    assert!((lost / truth - 1.0).abs() < 2e-3, "{lost} for {truth}");
}

/// A chamfer takes a triangle along a straight edge, and by Pappus a ring of one from the rim of a hole.
#[test]
fn chamfers_have_their_volumes() {
    let hole =
        "let b = box(width: 40mm, depth: 30mm, height: 10mm) - {hole: capped_cylinder(radius: 8mm, height: 10mm)}";
    let slant = "let b = box(width: 40mm, depth: 20mm, height: 10mm) & {
    slope: half_space(at: (0mm, 0mm, 8mm), normal: (0.75, 0, 1), size: 90mm),
  }";
    // The slope goes down from the top at x = -8/3 mm to the base at 32/3 mm.
    let whole = 20.0 * (10.0 * (20.0 - 8.0 / 3.0) + 10.0 * 40.0 / 3.0 / 2.0);
    // Between the slope and the base is an edge of the angle whose tangent is 0.75.
    let section = 2.0 * 2.0 / 2.0 * 0.6;
    let cases = [
        (BOX, "b.chamfer(top, right, r)", 8000.0 - 2.0 * 20.0, -2.0 * 20.0),
        // A ring of section r^2 / 2 whose middle is at 8 + r / 3 from the axis, twice.
        (
            hole,
            "b.chamfer([top, base], hole.wall, r)",
            12_000.0 - PI * 640.0 - 8.0 * PI * (8.0 + 2.0 / 3.0),
            -72.0 * PI,
        ),
        (slant, "b.chamfer(slope.cut, base, r)", whole - 20.0 * section, -20.0 * section),
    ];
    for (lets, body, volume, slope) in cases {
        let check = checked(&model(lets, body, true), &[]);
        assert_eq!(check["closed"], true, "{body}: {}", check["open_borders"]);
        let found = measure(&check, 0);
        assert!((found - volume).abs() < 0.01, "{body}: {found} for {volume}");
        let found = check["measures"][0]["derivatives"]["r"].as_f64().expect("a derivative");
        assert!((found / slope - 1.0).abs() < 1e-3, "{body}: {found} for {slope}");
    }
}

/// A face that ends in a sharp angle with another one: what is just beside one is behind the other.
#[test]
fn a_chamfer_that_runs_out_at_a_sharp_edge_is_closed() {
    let wedge = "let b = extruded([(0mm, 0mm), (30mm, 0mm), (0mm, 10mm)], 20mm)";
    let check = checked(&model(wedge, "b.chamfer(top, side[0], r)", true), &[]);
    assert_eq!(check["closed"], true, "{}", check["open_borders"]);
    // The section's triangle of legs r along 30 mm, less what the slanting wall cuts off: 3 (1 - y / 10) is left of
    // it at y.
    let truth = 3000.0 - (30.0 * 2.0 * 2.0 / 2.0 - 3.0 * 2.0_f64.powi(3) / 6.0);
    let volume = measure(&check, 0);
    assert!((volume - truth).abs() < 0.01, "{volume} for {truth}");
}

/// The other wall of a groove ends before the plane that closes its fillet: nothing of that is behind the wall.
#[test]
fn the_ends_of_fillets_are_between_their_walls() {
    let groove = "let b = box(width: 40mm, depth: 30mm, height: 10mm) - {
    g: box(width: 60mm, depth: 10mm, height: 10mm).rotate(30deg, (1, 0, 0)).translate((0mm, 0mm, 5mm)),
  }";
    let check = checked(&model(groove, "b.chamfer(g.base, [g.front, g.back], r)", false), &[]);
    assert_eq!(check["closed"], true, "{}", check["open_borders"]);
}

/// Fillets of several edges meet in mitres: at a depth q below the top, each side is farther in by r - sqrt(r^2 - (r -
/// q)^2).
#[test]
fn all_edges_of_a_face_are_rounded_at_once() {
    let check = checked(&model(BOX, "b.fillet(top, [front, back, left, right], r)", true), &[]);
    assert_eq!(check["closed"], true, "{}", check["open_borders"]);
    let truth = 8000.0 - 120.0 * 4.0 * CORNER + 32.0 * (5.0 / 3.0 - PI / 2.0);
    let volume = measure(&check, 0);
    assert!((volume - truth).abs() < 0.01, "{volume} for {truth}");
}

#[test]
fn fillets_of_all_kinds_of_edges_are_closed() {
    let slot = "let b = box(width: 40mm, depth: 30mm, height: 20mm) - {
    slot: box(width: 20mm, depth: 30mm, height: 10mm).translate((10mm, 0mm, 10mm)),
  }";
    let ring = "let b = box(width: 60mm, depth: 60mm, height: 10mm) + {
    ring: solid_torus(bend: 18mm, radius: 5mm).translate((0mm, 0mm, 11mm)),
  }";
    let boss = "let b = box(width: 40mm, depth: 30mm, height: 10mm) + {
    post: capped_cylinder(radius: 8mm, height: 30mm).rotate(90deg, (0, 0, 1)),
  }";
    let drilled = "let drill = capped_cylinder(radius: 4mm, height: 40mm).translate((0mm, 0mm, -20mm))
  let b = capped_cylinder(radius: 10mm, height: 40mm) - {
    hole: drill.rotate(90deg, (0, 1, 0)).translate((0mm, 0mm, 20mm)),
  }";
    let slanted = "let b = box(width: 40mm, depth: 20mm, height: 10mm) & {
    slope: half_space(at: (0mm, 0mm, 8mm), normal: (0.3, 0, 1), size: 60mm),
  }";
    let rib = "let b = box(width: 60mm, depth: 30mm, height: 10mm) + {
    bar: box(width: 20mm, depth: 90mm, height: 10mm).translate((0mm, 50mm, 0mm)),
  }";
    let cases = [
        (BOX, "b.fillet(top, right, r).fillet(top, front, r)"),
        (boss, "b.fillet(top, post.wall, r).fillet(post.top, post.wall, r)"),
        (drilled, "b.fillet(wall, hole.wall, r)"),
        (slanted, "b.fillet(slope.cut, front, r).translate((1mm, 2mm, 3mm)).mirror()"),
        (rib, "b.fillet(bar.top, bar.right, r)"),
        (slot, "b.fillet(slot.base, slot.left, r)"),
        (ring, "b.fillet(top, ring.wall, r)"),
    ];
    for (lets, body) in cases {
        let check = checked(&model(lets, body, false), &[]);
        assert_eq!(check["closed"], true, "{body}: {}", check["open_borders"]);
    }
}

/// A slant cuts the top off: beyond the edge of both the fillet runs on over the top until it leaves it in a point, and
/// its line of contact crosses the edge of slant and top, where three edges run into each other.
#[test]
fn fillets_that_run_out_over_another_face_are_closed() {
    for (slope, r) in [(0.2, 1.3), (0.45, 2.2), (0.7, 3.0), (1.2, 3.0)] {
        let lets = format!(
            "let b = box(width: 40mm, depth: 20mm, height: 10mm) & {{
    slope: half_space(at: (0mm, 0mm, 8mm), normal: ({slope}, 0, 1), size: 60mm),
  }}"
        );
        let check = checked(&model(&lets, "b.fillet(slope.cut, front, r)", false), &[format!("r={r}mm")]);
        assert_eq!(check["closed"], true, "{slope}, {r}: {}", check["open_borders"]);
    }
}

/// Walls of cones, balls, outlines and profiles, and of arrays.
#[test]
fn solids_of_the_library_have_sides() {
    let plate = "let b = box(width: 60mm, depth: 20mm, height: 8mm) - {
    h: for i in 0..2 { capped_cylinder(radius: 4mm, height: 8mm).translate((i * 18mm, 0mm, 0mm)) },
  }";
    let cases = [
        ("let b = frustum(bottom: 10mm, top: 6mm, height: 12mm)", "b.fillet(lid, wall, r)"),
        ("let b = revolved([(0mm, 0mm), (6mm, 4mm), (6mm, 9mm), (0mm, 9mm)])", "b.fillet(wall[1], wall[2], r)"),
        ("let b = pipe(outer: 12mm, inner: 6mm, height: 20mm)", "b.fillet(rim, outside, r).fillet(rim, inside, r)"),
        ("let b = elbow(bend: 30mm, outer: 10mm, inner: 6mm)", "b.fillet(start, outside, r)"),
        ("let b = ball(radius: 10mm) & {c: half_space(at: (0mm, 0mm, 4mm))}", "b.fillet(c.cut, wall, r)"),
        (plate, "b.fillet(top, h[1].wall, r)"),
    ];
    for (lets, body) in cases {
        let check = checked(&model(lets, body, false), &["r=1.5mm".to_owned()]);
        assert_eq!(check["closed"], true, "{body}: {}", check["open_borders"]);
    }
}

#[test]
fn the_mesh_of_an_angle_with_a_fillet_is_closed() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("m.gml"), model(BOX, "b.fillet(top, right, r)", false)).expect("written");
    gmlc(folder.path(), &["mesh", "m.gml", "-o", "m.stl"]);
    must_be_closed(&folder.path().join("m.stl"));
}

#[test]
fn what_cannot_be_rounded_says_why() {
    let folder = tempdir().expect("a folder");
    let holes = "let b = box() - {hole: for i in 0..2 { capped_cylinder(radius: 2mm).translate((i * 9mm, 0mm, 0mm)) }}";
    let balls = "let b = ball(radius: 10mm) + {c: ball(radius: 7mm).translate((12mm, 0mm, 0mm))}";
    let wide = "let b = box().scale(x: 2)";
    let cap = "let b = ball(radius: 10mm) & {c: half_space(at: (0mm, 0mm, 5mm))}";
    let drilled = "let drill = capped_cylinder(radius: 4mm, height: 40mm).translate((0mm, 0mm, -20mm))
  let b = capped_cylinder(radius: 10mm, height: 40mm) - {
    hole: drill.rotate(90deg, (0, 1, 0)).translate((0mm, 0mm, 20mm)),
  }";
    let own = "let b = solid({wall: sphere(9mm), other: sphere(9mm)}, |p| norm(p) - 9mm)";
    let cases = [
        (BOX, "b.fillet(top, rihgt, r)", "did you mean 'right'?"),
        (BOX, "b.fillet(top, top, r)", "both of these are 'top'"),
        (BOX, "b.fillet(top, base, r)", "do not meet in an edge"),
        (BOX, "b.fillet(top, right, 0mm)", "the radius of a fillet is positive"),
        (BOX, "b.fillet(top, right, 15mm)", "make it smaller"),
        (BOX, "b.fillet(top, r)", "two surfaces of the body and a radius"),
        (holes, "b.fillet(top, hole, r)", "'hole' is several surfaces"),
        (holes, "b.fillet(top, hole[2].wall, r)", "no surface 'hole[2]'"),
        (own, "b.fillet(wall, other, r)", "goes on beyond its borders"),
        (balls, "b.fillet(wall, c.wall, r)", "no parameter of either surface runs all along"),
        (wide, "b.fillet(top, right, r)", "tells no distances"),
        (BOX, "b.fillet([top, rihgt], front, r)", "did you mean 'right'?"),
        (BOX, "b.fillet([top, front], [front, right], r)", "both of these are 'front'"),
        (BOX, "b.chamfer(top, right)", "two surfaces of the body and a size"),
        (BOX, "b.chamfer(top, right, -1mm)", "the size of a chamfer is positive"),
        (drilled, "b.chamfer(wall, hole.wall, r)", "not the same all along"),
        (cap, "b.chamfer(wall, c.cut, r)", "bent across this edge"),
        (BOX, "b.fillet(top, [front, front], r)", "the edge of 'top' and 'front' is named twice"),
        (BOX, "b.fillet([top, front], [right, top], r)", "both of these are 'top'"),
        (BOX, "b.fillet(top, front, 6mm).fillet(base, front, 6mm)", "within their borders: make it smaller"),
        (BOX, "b.fillet([top, base], front, 6mm)", "so near to each other that nothing of a surface is left"),
        (BOX, "b.fillet(top, front, r).chamfer(fillet[0].round, top, r)", "are left as they are"),
        (BOX, "b.fillet(top, front, r).fillet(top, front, r)", "or not any more"),
    ];
    for (lets, body, said) in cases {
        fs::write(folder.path().join("m.gml"), model(lets, body, false)).expect("written");
        let errors = fails(folder.path(), &["check", "m.gml"], 1);
        assert!(errors.contains(said) && errors.contains("m.gml:"), "{body}: {errors}");
    }
}
