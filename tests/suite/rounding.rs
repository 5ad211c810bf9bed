//! Scans whose coordinates are rounded in the file, more coarsely than they are noisy.

use crate::support::{fails, gmlc, json};
use std::fmt::Write;
use tempfile::tempdir;

const BLOCK: &str = "use std.solid (box)
model block {
  param w: length in 10mm..60mm = 28mm
  param d: length in 10mm..60mm = 43mm
  param h: length in 10mm..90mm = 58mm
  part body tolerance 0.2mm = box(width: w, depth: d, height: h)
}
";

const SIDES: [(&str, f64); 3] = [("w", 30.37), ("d", 40.23), ("h", 61.41)];

/// All points of a face lie off by the same, so that the residuals say nothing of it.
#[test]
fn rounded_coordinates_are_known_to_be_rounded() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    std::fs::write(folder.join("block.gml"), BLOCK).expect("written");
    let sides: Vec<String> = SIDES.iter().map(|(name, side)| format!("{name}={side}mm")).collect();
    let with_sides = sides.iter().flat_map(|side| ["-p", side]).collect::<Vec<&str>>();
    let scan =
        ["scan", "block.gml", "--noise", "0.05mm", "--no-pose", "--cloud", "--spacing", "1mm", "-o", "block.xyz"];
    gmlc(folder, &[&scan[..], &with_sides].concat());
    let points = std::fs::read_to_string(folder.join("block.xyz")).expect("read");
    let points: Vec<[f64; 3]> = points
        .lines()
        .filter_map(|line| {
            let numbers: Vec<f64> = line.split(' ').filter_map(|word| word.parse().ok()).collect();
            numbers.first_chunk().copied()
        })
        .collect();
    for (step, is_coarse) in [(1.0, true), (0.25, true), (0.1, true), (0.001, false)] {
        let mut text = String::new();
        for p in &points {
            let [x, y, z] = p.map(|c| (c / step).round() * step);
            let _ = writeln!(text, "{x:.3} {y:.3} {z:.3}");
        }
        std::fs::write(folder.join("rounded.xyz"), text).expect("written");
        gmlc(folder, &["fit", "block.gml", "rounded.xyz", "-o", "fit.json"]);
        let fit = json(&folder.join("fit.json"));
        let warned = fit["warnings"].to_string().contains("are rounded to steps of");
        assert_eq!(warned, is_coarse, "{step}: {}", fit["warnings"]);
        for (parameter, (name, side)) in fit["parameters"].as_array().expect("a list").iter().zip(SIDES) {
            let [value, sd] = ["value", "sd"].map(|key| parameter[key].as_f64().expect("a number"));
            assert!((value - side).abs() < 4.0 * sd, "{name} = {value} +- {sd} with steps of {step}");
            // That of the difference of two even distributions over a step is 0.41 steps.
            assert!(!is_coarse || sd > 0.2 * step, "{name} +- {sd} with steps of {step}");
            // Faces that lie off are waves of the residuals, too, and count a second time.
            assert!(sd < f64::max(0.01, step), "{name} +- {sd} with steps of {step}");
        }
        if step == 1.0 {
            let said = fails(folder, &["inspect", "block.gml", "rounded.xyz", "-o", "out"], 4);
            assert!(said.contains("undecided: body"), "{said}");
        }
    }
}
