//! Scans whose coordinates are rounded in the file, more coarsely than they are noisy.

use crate::support::{fails, gmlc, json};
use std::fmt::Write;
use std::path::Path;
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

/// Points of a block whose sides are `SIDES`, which is beside it in the folder.
fn block(folder: &Path, seed: &str) -> Vec<[f64; 3]> {
    std::fs::write(folder.join("block.gml"), BLOCK).expect("written");
    let sides: Vec<String> = SIDES.iter().map(|(name, side)| format!("{name}={side}mm")).collect();
    let with_sides = sides.iter().flat_map(|side| ["-p", side]).collect::<Vec<&str>>();
    let scan = ["scan", "block.gml", "--noise", "0.05mm", "--no-pose", "--cloud", "--spacing", "1mm"];
    gmlc(folder, &[&scan[..], &["--seed", seed, "-o", "block.xyz"], &with_sides].concat());
    let points = std::fs::read_to_string(folder.join("block.xyz")).expect("read");
    let row = |line: &str| {
        let numbers: Vec<f64> = line.split(' ').filter_map(|word| word.parse().ok()).collect();
        numbers.first_chunk().copied()
    };
    points.lines().filter_map(row).collect()
}

/// The vertices of a mesh made from voxels are on these along faces only.
#[test]
fn a_tomogram_that_is_not_turned_is_not_rounded() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    std::fs::write(folder.join("block.gml"), BLOCK).expect("written");
    let scan = ["scan", "block.gml", "--scanner", "ct", "--noise", "0.01mm", "--spacing", "2mm", "--no-pose"];
    gmlc(folder, &[&scan[..], &["--seed", "3", "-o", "ct.ply"]].concat());
    gmlc(folder, &["fit", "block.gml", "ct.ply", "-o", "fit.json"]);
    let fit = json(&folder.join("fit.json"));
    assert!(!fit["warnings"].to_string().contains("are rounded"), "{}", fit["warnings"]);
    let sd = fit["parameters"][0]["sd"].as_f64().expect("a number");
    assert!(sd < 0.01, "{sd}");
}

/// All points of a face lie off by the same, so that the residuals say nothing of it.
#[test]
fn rounded_coordinates_are_known_to_be_rounded() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    let points = block(folder, "1");
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

/// A pose that the reader applies turns the steps: along the axes of the scan none are left.
#[test]
fn coordinates_that_were_rounded_before_a_pose_moved_them_are_known_to_be_rounded() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    let points = block(folder, "1");
    // A turn of 30 degrees about x after one of 40 about z.
    let ((a, b), (c, d)) = (40_f64.to_radians().sin_cos(), 30_f64.to_radians().sin_cos());
    let rows = [[b, a * d, a * c], [-a, b * d, b * c], [0.0, -c, d]];
    let [x, y, z] = rows.map(|row| row.map(|e| format!("{e:.9}")).join(" "));
    let pose = format!("0.3 0.2 -0.4\n{x}\n{y}\n{z}\n{x} 0\n{y} 0\n{z} 0\n0.3 0.2 -0.4 1\n");
    for (step, is_coarse) in [(0.5, true), (0.01, false)] {
        let mut text = format!("1\n{}\n{pose}", points.len());
        for p in &points {
            // Before the scanner, and no face where a multiple of the step is.
            let [x, y, z] = p.map(|c| ((c + 300.13) / step).round() * step * 1e-3);
            let _ = writeln!(text, "{x:.5} {y:.5} {z:.5} 0.5");
        }
        std::fs::write(folder.join("rounded.ptx"), text).expect("written");
        gmlc(folder, &["fit", "block.gml", "rounded.ptx", "-o", "fit.json"]);
        let fit = json(&folder.join("fit.json"));
        let warned = fit["warnings"].to_string().contains("are rounded to steps of");
        assert_eq!(warned, is_coarse, "{step}: {}", fit["warnings"]);
        // The object is seen from all sides.
        assert!(fit["warnings"].to_string().contains("the scanner cannot have stood at (300, 200, -400) mm"));
        for (parameter, (name, side)) in fit["parameters"].as_array().expect("a list").iter().zip(SIDES) {
            let [value, sd] = ["value", "sd"].map(|key| parameter[key].as_f64().expect("a number"));
            assert!((value - side).abs() < 4.0 * sd, "{name} = {value} +- {sd} with steps of {step}");
            assert_eq!(sd > 0.2 * step.max(0.1), is_coarse, "{name} +- {sd} with steps of {step}");
        }
    }
}

/// What stands for nothing, or is cut through, is said before anything is made of it.
#[test]
fn points_far_away_and_faces_that_a_crop_cuts_are_said() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    let mut text = String::new();
    for (i, [x, y, z]) in block(folder, "1").into_iter().enumerate() {
        let z = if i % 80 == 0 { -9999.0 } else { z };
        let _ = writeln!(text, "{x:.5} {y:.5} {z:.5}");
    }
    std::fs::write(folder.join("marks.xyz"), text).expect("written");
    gmlc(folder, &["fit", "block.gml", "marks.xyz", "-o", "fit.json"]);
    let fit = json(&folder.join("fit.json"));
    let said = fit["warnings"].to_string();
    assert!(said.contains("(their z is -9999, which stands for") && !said.contains("times larger"), "{said}");
    assert!(fit["scan"]["cleaning"]["far"].as_u64().is_some_and(|far| far > 50), "{}", fit["scan"]);
    for (parameter, (name, side)) in fit["parameters"].as_array().expect("a list").iter().zip(SIDES) {
        let [value, sd] = ["value", "sd"].map(|key| parameter[key].as_f64().expect("a number"));
        assert!((value - side).abs() < 4.0 * sd, "{name} = {value} +- {sd}");
    }
    for (crop, is_cut) in [("..,..,0mm..", true), ("..,..,-2mm..", false), ("..,..,20mm..", false)] {
        let said = gmlc(folder, &["info", "block.xyz", "--crop", crop]);
        assert_eq!(said.contains("the lower end of z of --crop"), is_cut, "{crop}: {said}");
    }
}

/// What rounding does to a scan is no difference of the object.
#[test]
fn a_rounded_scan_and_a_fine_one_agree_on_the_shape() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    let mut text = String::new();
    for p in block(folder, "2") {
        let [x, y, z] = p.map(|c| ((c + 0.13) * 4.0).round() / 4.0);
        let _ = writeln!(text, "{x:.2} {y:.2} {z:.2}");
    }
    std::fs::write(folder.join("rounded.xyz"), text).expect("written");
    block(folder, "1");
    gmlc(folder, &["fit", "block.gml", "block.xyz", "rounded.xyz", "-o", "fit.json"]);
    let fit = json(&folder.join("fit.json"));
    assert!(fit["scans"][1]["agreement"]["agrees"].as_bool().is_some_and(|agrees| agrees), "{}", fit["warnings"]);
}
