//! Solids of SVG paths and of letters by the built command: they close, have the right volumes with their derivatives,
//! and what is wrong with a font is said.

use crate::support::solid::{checked_in, measure, must_be_closed};
use crate::support::{fails, gmlc, json};
use std::fs;
use std::path::Path;
use tempfile::{TempDir, tempdir};

/// A folder with a font.
fn with_font() -> TempDir {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("sans.ttf"), dejavu::sans::regular()).expect("written");
    folder
}

/// The derivative of a measure.
fn slope(check: &serde_json::Value, k: usize, parameter: &str) -> f64 {
    check["measures"][k]["derivatives"][parameter].as_f64().expect("a derivative")
}

fn mesh_is_closed(folder: &Path) {
    gmlc(folder, &["mesh", "model.gml", "-o", "model.stl"]);
    must_be_closed(&folder.join("model.stl"));
}

#[test]
fn an_svg_path_is_engraved_and_embossed() {
    let script = "model plate {
  param size: real in 0.5..3 = 1.5
  param depth: length in 0.5mm..3mm = 1mm
  measure engraved = volume(low)
  measure embossed_one = volume(high)
  let frame = svg_path(\"M -8 6 H 8 V -6 H -8 Z M -5 -3 H 5 V 3 H -5 Z M 0 -9 L -3 -5 H 3 Z\")
  let plate = box(width: 60mm, depth: 40mm, height: 4mm)
  part low = plate - {cut: embossed(frame, height: depth, scale: size).translate((2mm, 1mm, 4mm - depth))}
  part high = (plate + {sign: embossed(frame, height: depth, scale: size).translate((2mm, 1mm, 4mm))})
    .translate((0mm, 90mm, 0mm))
}
";
    let folder = tempdir().expect("a folder");
    // The frame without its hole, and what of the triangle is beyond it: up to y = 6, where it is 4.5 wide.
    let area = 16.0 * 12.0 - 10.0 * 6.0 + 0.5 * 4.5 * 3.0;
    for (size, depth) in [(1.5, 1.0), (0.9, 2.5)] {
        let check = checked_in(folder.path(), script, &[format!("size={size}"), format!("depth={depth}mm")]);
        assert_eq!(check["closed"], true, "{check}");
        for (k, sign) in [(0, -1.0), (1, 1.0)] {
            let shape = area * size * size * depth;
            let close = |found: f64, truth: f64| assert!((found / truth - 1.0).abs() < 2e-5, "{found} for {truth}");
            close(measure(&check, k), 60.0 * 40.0 * 4.0 + sign * shape);
            close(slope(&check, k, "size"), sign * 2.0 * shape / size);
            close(slope(&check, k, "depth"), sign * shape / depth);
        }
    }
    mesh_is_closed(folder.path());
}

#[test]
fn letters_are_solids_of_their_size() {
    let script = "model name {
  param size: length in 5mm..40mm = 12mm
  param depth: length in 0.5mm..5mm = 1.5mm
  measure letters = volume(name)
  part name = lettering(glyphs(\"IO\", \"sans.ttf\"), size: size, depth: depth)
}
";
    let folder = with_font();
    let check = checked_in(folder.path(), script, &[]);
    assert_eq!(check["closed"], true, "{check}");
    // The areas of both letters in the tables of the font, in its units; chords take off the tolerance at most.
    let area = (301_586.0 + 785_709.583) / 2048.0_f64.powi(2);
    let (volume, truth) = (measure(&check, 0), area * 144.0 * 1.5);
    assert!((volume / truth - 1.0).abs() < 0.01, "{volume} for {truth}");
    let by_size = slope(&check, 0, "size");
    assert!((by_size / (2.0 * volume / 12.0) - 1.0).abs() < 1e-5, "{by_size}");
    mesh_is_closed(folder.path());
}

#[test]
fn letters_are_engraved_along_a_circle() {
    let script = "model dial {
  param size: length in 4mm..9mm = 7mm
  measure material = volume(dial)
  let word = bent_around(glyphs(\"To\", \"sans.ttf\"), radius: 20mm * (1mm / size), from: 0.6mm)
  part dial = capped_cylinder(radius: 32mm, height: 3mm)
    - {word: lettering(word, size: size, depth: 1mm).translate((0mm, 0mm, 2mm))}
}
";
    let folder = with_font();
    let check = checked_in(folder.path(), script, &[]);
    assert_eq!(check["closed"], true, "{check}");
    let whole = std::f64::consts::PI * 32.0 * 32.0 * 3.0;
    let removed = whole - measure(&check, 0);
    // T and o in the tables of the font; on the circle they are wider the higher they reach.
    let flat = (483_279.0 + 538_210.25) / 2048.0_f64.powi(2) * 49.0;
    assert!(removed > 1.05 * flat && removed < 1.3 * flat, "{removed} for {flat}");
}

#[test]
fn the_record_of_a_measurement_names_the_font() {
    let folder = with_font();
    let script = "model name { param h: length in 1mm..9mm = 4mm
  part i = lettering(glyphs(\"I\", \"sans.ttf\"), size: 30mm, depth: h) }\n";
    fs::write(folder.path().join("model.gml"), script).expect("written");
    gmlc(folder.path(), &["scan", "model.gml", "-o", "scan.ply", "--spacing", "1mm"]);
    gmlc(folder.path(), &["inspect", "model.gml", "scan.ply", "-o", "out", "--resolution", "64"]);
    let record = json(&folder.path().join("out/variance.json"));
    assert!(record.to_string().contains("sans.ttf"), "{record}");
    assert!(fails(folder.path(), &["mesh", "model.gml", "-o", "sans.ttf"], 2).contains("sans.ttf"));
}

#[test]
fn what_is_wrong_with_a_font_is_said() {
    let folder = with_font();
    let outside = with_font();
    fs::create_dir(folder.path().join("models")).expect("made");
    let path = folder.path().join("models/model.gml");
    let elsewhere = outside.path().join("sans.ttf");
    let said = |call: &str, allowed: &[&str]| {
        fs::write(&path, format!("model m {{ part p = embossed({call}, height: 1mm) }}\n")).expect("written");
        fails(folder.path(), &[&["check", "models/model.gml"][..], allowed].concat(), 1)
    };
    assert!(
        said("glyphs(\"a\u{4e2d}\", \"../sans.ttf\")", &["--allow-path", "."])
            .contains("no letter for '\u{4e2d}' (U+4E2D)")
    );
    assert!(said("glyphs(\"a\", \"../sans.ttf\")", &[]).contains("is outside of the script's folder"));
    assert!(
        said(&format!("glyphs(\"a\", \"{}\")", elsewhere.display()), &[]).contains("is outside of the script's folder")
    );
    assert!(said("glyphs(\"a\", \".\")", &[]).contains("is a folder, not a font"));
    assert!(said("glyphs(\"a\", \"sans.ttf\")", &[]).contains("there is no such file"));
    fs::write(folder.path().join("models/broken.ttf"), &dejavu::sans::regular()[..5000]).expect("written");
    let broken = said("glyphs(\"a\", \"broken.ttf\")", &[]);
    assert!(broken.contains("model.gml:1") && broken.contains("font"), "{broken}");
}
