//! Scans that are far denser in one place than in another, and points that are off to one side only.

use crate::support::{fails, gmlc, json, parameter};
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;
use tempfile::tempdir;

const TUBE: &str = "use std.surface (cylinder)
model tube {
  param r: length in 5mm..100mm = 25mm
  param h: length in 20mm..200mm = 70mm
  part wall tolerance 0.05mm = cylinder(r, h)
}
";

/// Numbers that are evenly spread over 0..1, always the same (Knuth's linear congruential generator).
struct Random(u64);

impl Random {
    fn even(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Nearly normal, of unit variance.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.even()).sum::<f64>() - 6.0
    }
}

/// Points of a tube between two heights; `radius` is that of each.
fn tube(text: &mut String, count: usize, heights: [f64; 2], random: &mut Random, radius: impl Fn(&mut Random) -> f64) {
    for _ in 0..count {
        let (sin, cos) = (TAU * random.even()).sin_cos();
        let (z, r) = (heights[0] + (heights[1] - heights[0]) * random.even(), radius(random));
        writeln!(text, "{:.5} {:.5} {z:.5}", r * cos, r * sin).expect("a string");
    }
}

/// The warnings of a fit to a scan.
fn warnings(folder: &Path, scan: &str) -> String {
    gmlc(folder, &["fit", "tube.gml", scan, "--unit", "mm", "-o", "fit.json"]);
    json(&folder.join("fit.json"))["warnings"].to_string()
}

/// A hundredth of the points stand for half of the surface, which is off by 0.2 mm.
#[test]
fn a_sparse_half_counts_in_what_is_said_of_the_shape() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    std::fs::write(folder.join("tube.gml"), TUBE).expect("written");
    for (name, upper) in [("right.xyz", 30.0), ("step.xyz", 30.2)] {
        let (mut text, mut random) = (String::new(), Random(7));
        tube(&mut text, 60_000, [0.0, 40.0], &mut random, |random| 30.0 + 0.05 * random.normal());
        tube(&mut text, 600, [40.0, 80.0], &mut random, |random| upper + 0.05 * random.normal());
        std::fs::write(folder.join(name), text).expect("written");
    }
    let said = "the model does not have the scan's shape";
    assert!(!warnings(folder, "right.xyz").contains(said));
    assert!(warnings(folder, "step.xyz").contains(said));
    // No footprint of the sparse half has many points, but all of them are off.
    let inspect = ["inspect", "tube.gml", "step.xyz", "--unit", "mm", "--resolution", "128", "-o", "out"];
    let text = fails(folder, &inspect, 3);
    assert!(text.contains("does not conform: wall"), "{text}");
}

/// Dust lies on a surface, never below it: three points in ten are off by 0.3 mm on the average, as far as they count.
#[test]
fn a_tail_on_one_side_is_said() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    std::fs::write(folder.join("tube.gml"), TUBE).expect("written");
    let off = |dust: f64| {
        let (mut text, mut random) = (String::new(), Random(5));
        tube(&mut text, 20_000, [0.0, 80.0], &mut random, |random| {
            let above = if random.even() < dust { -0.3 * (1.0 - random.even()).ln() } else { 0.0 };
            30.0 + 0.03 * random.normal() + above
        });
        std::fs::write(folder.join("dust.xyz"), text).expect("written");
        let warnings = warnings(folder, "dust.xyz");
        (warnings, parameter(&json(&folder.join("fit.json")), "r") - 30.0)
    };
    let (clean, _) = off(0.0);
    assert!(!clean.contains("a tail on one side"), "{clean}");
    let (dusty, off) = off(0.3);
    // What is said to lie beside the surface is by how much it is wrong.
    let said = dusty.split("up to ").nth(1).and_then(|rest| rest.split(' ').next()?.parse::<f64>().ok());
    assert!(off > 0.02 && said.is_some_and(|said| (said - off).abs() < 0.005), "{off}: {dusty}");
}
