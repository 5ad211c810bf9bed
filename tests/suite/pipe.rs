//! Pipes of a scanned pump room, cut out by boxes, beside a fit of a cylinder that shares nothing with gmlc's.

use crate::support::{gmlc, json, parameter, test_data};
use nalgebra::{SMatrix, SVector, Vector3};
use tempfile::{TempDir, tempdir};

const PIPE: &str = "use std.surface (cylinder)
model pipe {
  param radius: length in 20mm..300mm = 60mm
  param height: length in 0.5m..1.5m = 1m
  part wall = cylinder(radius, height)
}
";

/// Boxes around two vertical pipes of pump.e57, a metre of their heights, and where their axes are about. Millimetres.
const PIPES: [(&str, [f64; 2]); 2] = [
    ("--crop=-1195mm..-995mm,-2045mm..-1845mm,0mm..1000mm", [-1095.0, -1945.0]),
    ("--crop=485mm..685mm,-3345mm..-3145mm,0mm..1000mm", [585.0, -3245.0]),
];

/// The radius of a nearly vertical cylinder by iteratively reweighted Gauss-Newton steps of Tukey's biweight, with its
/// standard deviation for independent points. Millimetres.
fn cylinder(points: &[Vector3<f64>], axis: [f64; 2]) -> (f64, f64) {
    let middle = points.iter().map(|p| p.z).sum::<f64>() / points.len() as f64;
    // The axis at the middle height, its slopes, and the radius.
    let mut x = SVector::<f64, 5>::from([axis[0], axis[1], 0.0, 0.0, 80.0]);
    let mut sd = f64::INFINITY;
    for _ in 0..100 {
        let along = Vector3::new(x[2], x[3], 1.0).normalize();
        let across = |p: &Vector3<f64>| {
            let off = p - Vector3::new(x[0], x[1], middle);
            let t = off.dot(&along);
            (t, off - along * t)
        };
        let mut residuals: Vec<f64> = points.iter().map(|p| (across(p).1.norm() - x[4]).abs()).collect();
        residuals.sort_by(f64::total_cmp);
        let scale = 1.4826 * residuals[residuals.len() / 2];
        let (mut normal, mut pull) = (SMatrix::<f64, 5, 5>::zeros(), SVector::<f64, 5>::zeros());
        for p in points {
            let (t, e) = across(p);
            let (residual, u) = (e.norm() - x[4], e.normalize());
            let weight = (1.0 - (residual / (4.685 * scale)).powi(2)).max(0.0).powi(2);
            let row = SVector::<f64, 5>::from([-u.x, -u.y, -t * u.x, -t * u.y, -1.0]);
            normal += weight * row * row.transpose();
            pull += weight * residual * row;
        }
        let inverse = normal.try_inverse().expect("points all around");
        let step = -(inverse * pull);
        x += step;
        sd = scale * inverse[(4, 4)].sqrt();
        if step.amax() < 1e-9 {
            break;
        }
    }
    (x[4], sd)
}

/// A folder with pipe.gml, and the scan's path; none without the test data.
fn pump_room() -> Option<(TempDir, String)> {
    let scan = test_data()?.join("clouds/pump.e57");
    let folder = tempdir().expect("a folder");
    std::fs::write(folder.path().join("pipe.gml"), PIPE).expect("written");
    Some((folder, scan.to_str().expect("a path").to_owned()))
}

#[test]
fn pipes_of_a_pump_room_have_the_radius_of_an_independent_fit() {
    let Some((folder, scan)) = pump_room() else { return };
    let (folder, scan) = (folder.path(), scan.as_str());
    for (crop, axis) in PIPES {
        gmlc(folder, &["fit", "pipe.gml", scan, crop, "-o", "fit.json"]);
        let fit = json(&folder.join("fit.json"));
        let of = |p: &&serde_json::Value| p["name"] == "radius";
        let sd = fit["parameters"].as_array().and_then(|all| all.iter().find(of)?["sd"].as_f64());
        let (radius, sd) = (parameter(&fit, "radius"), sd.expect("half of a pipe says its radius"));
        gmlc(folder, &["convert", scan, crop, "-o", "pipe.xyz"]);
        let table = std::fs::read_to_string(folder.join("pipe.xyz")).expect("read");
        let point = |line: &str| {
            let numbers: Vec<f64> = line.split_whitespace().map_while(|word| word.parse().ok()).collect();
            // The file is in metres.
            Some(Vector3::from(*numbers.first_chunk::<3>()?) * 1000.0)
        };
        let points: Vec<Vector3<f64>> = table.lines().filter_map(point).collect();
        let (expected, alone) = cylinder(&points, axis);
        // 88.10 +- 3 to 6 beside 88.01 +- 0.08, and 87.42 +- 0.32 beside 87.31 +- 0.16. The independent fit takes
        // points for independent; gmlc sees that residuals of neighbours are alike, and that the pipes are no
        // cylinders. The lowest fifth of the first one has a radius of 103 mm where the others have 87.4 to 88.2: for
        // gmlc that is a wave.
        let apart = (radius - expected).abs();
        assert!(
            apart < 0.3 && apart < sd && sd > alone && sd < 8.0,
            "{crop}: {radius} +- {sd}, not {expected} +- {alone}"
        );
    }
}

/// How large standard deviations are must not hang on which points a fit samples: that there are waves in the residuals
/// of the first pipe is a close decision, which took them from 0.28 to 4.1 mm from one seed to the next.
#[test]
fn standard_deviations_do_not_hang_on_the_sample() {
    let Some((folder, scan)) = pump_room() else { return };
    let (folder, scan) = (folder.path(), scan.as_str());
    let of_seed = |seed: &str| {
        gmlc(folder, &["fit", "pipe.gml", scan, PIPES[0].0, "--seed", seed, "-o", "fit.json"]);
        let fit = json(&folder.join("fit.json"));
        fit["parameters"][0]["sd"].as_f64().expect("half of a pipe says its radius")
    };
    let sds = ["1", "2", "3", "4"].map(of_seed);
    let (least, most) = sds.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), sd| (low.min(*sd), high.max(*sd)));
    // 2.8 to 5.6.
    assert!(most < 2.5 * least, "{sds:?}");
}
