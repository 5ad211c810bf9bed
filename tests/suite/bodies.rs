//! Bodies of models: what encloses nothing, what touches, and what lies in something else.

use crate::support::gmlc;
use crate::support::solid::{checked, closed_triangles, measure};
use std::f64::consts::PI;
use std::fs;
use tempfile::tempdir;

#[test]
fn a_model_of_which_nothing_is_left_is_not_closed() {
    let folder = tempdir().expect("a folder");
    // Of the balls the triangles would be without number if they were as small as what is left.
    let far = "box() & {q: ball(radius: 2mm).translate((100mm, 0mm, 0mm))}";
    for body in ["box() - {q: box()}", "ball() - {q: ball()}", far] {
        fs::write(folder.path().join("nothing.gml"), format!("model m {{ part b = {body} }}\n")).expect("written");
        let check = gmlc(folder.path(), &["check", "nothing.gml"]);
        assert!(check.contains("nothing is left of the model") && !check.contains("closed:"), "{check}");
    }
}

#[test]
fn bodies_that_enclose_nothing_are_not_closed() {
    let folder = tempdir().expect("a folder");
    for (body, said) in [
        ("part b = capped_cylinder(radius: 5mm, height: 0mm)", "enclose nothing"),
        ("part b = box().scale(0)", "enclose nothing"),
        ("part b = union([])", "the model has no parts"),
    ] {
        let script = format!("use std.solid (box, capped_cylinder, union)\nmodel m {{ {body} }}\n");
        fs::write(folder.path().join("flat.gml"), script).expect("written");
        let check = gmlc(folder.path(), &["check", "flat.gml"]);
        assert!(check.contains(said) && !check.contains("closed:"), "{check}");
        let check = gmlc(folder.path(), &["check", "flat.gml", "--json"]);
        assert!(check.contains("\"closed\": false"), "{check}");
    }
    // A sheet of a micrometre is none of them.
    assert_eq!(checked("model m { part b = box(width: 1m, depth: 1m, height: 0.001mm) }\n", &[])["closed"], true);
}

/// The hollow of a hollow box has inner edges, whose roundings `shell` does not make: it stays open, and what lies in
/// it is a cavity and not inside out.
#[test]
fn a_cavity_in_what_is_open_is_not_inside_out() {
    let script = "use std.offset (shell)
model m { part b = shell(shell(box(width: 60mm, depth: 50mm, height: 40mm), 8mm), 2mm) }\n";
    let check = checked(script, &[]);
    let diagnostics = check["diagnostics"].as_array().expect("a list");
    assert_eq!((&check["closed"], diagnostics.len()), (&false.into(), 0), "{diagnostics:?}");
}

/// Two boxes that stand side by side as parts of their own: the faces in which they touch meet along all of their
/// borders, and are no flat body.
#[test]
fn parts_that_touch_are_closed_and_parts_in_each_other_are_said() {
    let folder = tempdir().expect("a folder");
    let second = |x: &str| format!("part a = box()\n  part b = box().translate(({x}, 0mm, 0mm))");
    let on_each_other = "part a = capped_cylinder(radius: 5mm, height: 10mm)
  part b = capped_cylinder(radius: 5mm, height: 10mm).translate((0mm, 0mm, 10mm))";
    // A peg in a hole that fits, and a ball in the material of another one.
    let peg = "part a = box() - {hole: capped_cylinder(radius: 4mm)}\n  part b = capped_cylinder(radius: 4mm)";
    let inclusion = "part a = ball(radius: 20mm)\n  part b = ball(radius: 5mm)";
    // A corner in another box: less than a thousandth of the surface, at a place of its own.
    let corner = |reach: &str| {
        let cube = "box(width: 20mm, depth: 20mm, height: 20mm)";
        format!("part a = {cube}\n  part b = {cube}.translate((20mm - {reach}, 20mm - {reach}, 20mm - {reach}))")
    };
    // Surfaces that coincide have triangles of their own, which pass through each other by a chord.
    let socket = "part a = box(height: 30mm) - {socket: ball(radius: 6mm).translate((0mm, 0mm, 30mm))}
  part b = ball(radius: 6mm).translate((0mm, 0mm, 30mm))";
    // Turned, what is in one plane is so but for rounding.
    let turned = second("20mm").replace('\n', ".rotate(30deg, (1, 2, 3))\n") + ".rotate(30deg, (1, 2, 3))";
    let cases = [
        (second("20mm"), false),
        (turned, false),
        (second("25mm"), false),
        (second("18mm"), true),
        (on_each_other.to_owned(), false),
        (peg.to_owned(), false),
        (inclusion.to_owned(), true),
        (corner("0mm"), false),
        (corner("0.1mm"), true),
        (corner("1mm"), true),
        (socket.to_owned(), false),
    ];
    for (body, lie_in_each_other) in cases {
        let script = format!("model m {{\n  {body}\n}}\n");
        fs::write(folder.path().join("m.gml"), &script).expect("written");
        let line = gmlc(folder.path(), &["check", "m.gml"]);
        assert!(line.contains("closed: the borders of all parts meet"), "{script}{line}");
        assert!(!line.contains("inside out") && !line.contains("flat"), "{script}{line}");
        assert_eq!(line.contains("bodies lie in each other"), lie_in_each_other, "{script}{line}");
        let check = checked(&script, &[]);
        assert_eq!(
            (check["closed"] == true, check["overlap"].is_array()),
            (true, lie_in_each_other),
            "{script}{check}"
        );
    }
}

/// Where a peg fills a hole four surfaces meet in one circle: the edges of each part close it.
#[test]
fn parts_that_touch_are_closed_by_their_own_surfaces() {
    let script = "model m {
  part a = box() - {hole: capped_cylinder(radius: 4mm)}
  part b = capped_cylinder(radius: 4mm)
  measure with_hole = volume(a)
  measure peg = volume(b)
}
";
    let (check, peg) = (checked(script, &[]), PI * 16.0 * 20.0);
    for (k, expected) in [8000.0 - peg, peg].into_iter().enumerate() {
        assert!((measure(&check, k) - expected).abs() < 1e-5 * expected, "{} for {expected}", measure(&check, k));
    }
}

/// The flanks of a bolt and its nut coincide over a large part of their surface: their triangles pass through each
/// other by their chords, however fine these are. Two balls that coincide face the same way and are no such contact.
#[test]
fn a_bolt_that_fills_its_nut_does_not_lie_in_it() {
    let bolt = "threaded_rod(10mm, 1.5mm, 11mm).translate((0mm, 0mm, -1.5mm))";
    let script = format!(
        "use std.thread (threaded_rod)\nmodel m {{
  part nut = box(width: 18mm, depth: 18mm, height: 8mm) - {{thread: {bolt}}}
  part bolt = {bolt}
}}
"
    );
    let check = checked(&script, &[]);
    assert!(check["closed"] == true && check["overlap"].is_null(), "{check}");
    let balls = "model m {
  part a = ball(radius: 6mm)
  part b = ball(radius: 6mm).rotate(30deg, (1, 2, 3))
}
";
    assert!(checked(balls, &[])["overlap"].is_array());
}

/// Where a key fills its groove four surfaces meet in each edge of the walls that both have, and at a slant not to the
/// last bit: each part is closed by its own surfaces.
#[test]
fn a_key_and_its_groove_are_closed_each_by_itself() {
    let folder = tempdir().expect("a folder");
    for (wider, beyond, height) in [(4, 11, 5), (2, 11, 5), (1, 11, 5), (2, 15, 5), (0, 11, 6)] {
        let corners = format!("[(-w, 0mm), (w, 0mm), (w + {wider}mm, {beyond}mm), (-w - {wider}mm, {beyond}mm)]");
        let script = format!(
            "model m {{
  param w: length = 4mm
  let body = box(width: 20mm, depth: 20mm, height: 5mm)
  let key = extruded({corners}, {height}mm)
  part a = body - {{d: key}}
  part b = key & {{o: body}}
  measure of_a = volume(a)
  measure of_b = volume(b)
}}
"
        );
        let check = checked(&script, &[]);
        let reach = 10.0 * f64::from(wider) / f64::from(beyond);
        let key = 5.0 * 10.0 * (8.0 + reach);
        for (k, expected) in [2000.0 - key, key].into_iter().enumerate() {
            assert!((measure(&check, k) - expected).abs() < 1e-5 * expected, "{script}{check}");
        }
        assert!(check["closed"] == true && check["diagnostics"].as_array().is_some_and(Vec::is_empty), "{check}");
        fs::write(folder.path().join("m.gml"), &script).expect("written");
        gmlc(folder.path(), &["mesh", "m.gml", "-o", "m.stl"]);
        // All walls are plane.
        assert!(closed_triangles(&folder.path().join("m.stl")) > 70, "{script}");
    }
}

/// A hole that ends in the plane in which two solids were joined has a bottom there: inside is on both sides of it.
#[test]
fn holes_end_where_two_solids_meet() {
    let plate = "box(width: 40mm, depth: 40mm, height: 10mm) + {post: box(width: 20mm, depth: 20mm, height: 15mm)
      .translate((0mm, 0mm, 10mm))}";
    let bore = "capped_cylinder(radius: 4mm, height: 10mm).translate((X, 1mm, 0mm))";
    let material = 22000.0 - 160.0 * PI;
    let whole = 2.0 * 1600.0 + 1600.0 + 4.0 * 300.0 + 80.0 * PI;
    // Under the post, half under it, and beside it, where the hole goes through.
    for (x, bottom) in [("2mm", true), ("10mm", false), ("15mm", false)] {
        for joined in [plate.to_owned(), format!("union([{}])", plate.replace(" + {post: ", ", ").replace('}', ""))] {
            let bore = bore.replace('X', x);
            let script = format!(
                "model m {{\n  measure v = volume(b)\n  measure s = area(b)\n  part b = {joined} - {{bore: {bore}}}\n}}\n"
            );
            let check = checked(&script, &[]);
            assert_eq!(check["closed"], true, "{script}");
            assert!((measure(&check, 0) - material).abs() < 1e-6 * material, "{script}: {}", measure(&check, 0));
            if bottom {
                assert!((measure(&check, 1) - whole).abs() < 1e-6 * whole, "{script}: {}", measure(&check, 1));
            }
        }
    }
    // The same as what both have in common.
    let script = "model m { measure v = volume(b)
      part b = union([box(width: 40mm, depth: 40mm, height: 10mm), box(width: 20mm, depth: 20mm, height: 15mm)
        .translate((0mm, 0mm, 10mm))]) & {core: capped_cylinder(radius: 4mm, height: 10mm).translate((2mm, 1mm, 0mm))}
    }\n";
    let check = checked(script, &[]);
    assert_eq!(check["closed"], true);
    assert!((measure(&check, 0) - 160.0 * PI).abs() < 1e-3);
}
