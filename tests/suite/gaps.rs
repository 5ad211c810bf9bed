//! Gaps that are narrower than the triangles by which a model is looked at.

use crate::support::gmlc_in;
use crate::support::solid::{checked, must_be_closed};
use std::fs;
use tempfile::tempdir;

/// Two holes that are said not to touch, and overlap by a tenth of a millimetre: `check` takes triangles of 0.06 mm,
/// which close the slit between both walls. Beside each other they leave a wall.
#[test]
fn holes_that_overlap_by_less_than_a_chord_are_open() {
    let plate = |apart: f64| {
        format!(
            "use std.solid (box, capped_cylinder, separate)\nmodel plate {{
  let bolt = capped_cylinder(radius: 3mm, height: 5mm)
  let holes = for k in 0..2 {{ bolt.translate((k * {apart}mm, 0mm, 0mm)) }}
  part plate = box(width: 50mm, depth: 30mm, height: 5mm) - {{hole: separate(holes)}}\n}}\n"
        )
    };
    for (apart, is_closed) in [(5.9, false), (5.97, false), (6.1, true)] {
        let check = checked(&plate(apart), &[]);
        assert_eq!(check["closed"], is_closed, "{apart}: {check}");
    }
}

const ANGLE: &str = "use std.solid (box)\nmodel angle {
  param r: length = 2mm
  let plate = box(width: 40mm, depth: 30mm, height: 8mm)
  let body = plate + {wall: box(width: 40mm, depth: 6mm, height: 30mm).translate((0mm, 12mm, 0mm))}
  part b = body.fillet(top, wall.front, r)
  measure area = area(b)
  measure front = area(b.wall.front)
}
";

/// The fillet's function is level on the border of the wall, which is the border of the body: its mesh had gaps of a
/// quarter of a millimetre and folds at some chords.
#[test]
fn the_mesh_of_a_filleted_angle_is_closed_at_every_chord() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("angle.gml"), ANGLE).expect("written");
    for chord in ["0.1mm", "0.02mm", "0.0058mm", "0.005mm"] {
        let output = gmlc_in(folder.path(), &["mesh", "angle.gml", "-o", "angle.stl", "--chord", chord]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && !said.contains("warning"), "{chord}: {said}");
        must_be_closed(&folder.path().join("angle.stl"));
    }
}

/// The derivatives of its areas, which end where the function is level, are those of the exact body: of the wall that
/// of the fillet's height, but for the strip that is told apart by a millionth of a millimetre.
#[test]
fn areas_that_end_at_a_border_have_their_derivatives() {
    let check = checked(ANGLE, &[]);
    let slope = |k: usize| check["measures"][k]["derivatives"]["r"].as_f64().unwrap_or(f64::NAN);
    // A millimetre of radius takes two strips of 40 mm and gives a quarter of a circle; at both ends it adds what is
    // between circle and corner.
    let (width, r) = (40.0, 2.0);
    let quarter = std::f64::consts::FRAC_PI_2;
    let truth = width * (quarter - 2.0) + 2.0 * 2.0 * r * (1.0 - quarter / 2.0);
    assert!((slope(0) - truth).abs() < 1e-3 * truth.abs(), "{} {truth}: {}", slope(0), check["measures"]);
    assert!((slope(1) + width).abs() < 1e-3 * width, "{}", slope(1));
}
