//! Success over many starts; runs where GMLC_FIT_TRIALS says how many.

use super::cup::load;
use super::shapes::cup;
use crate::fit::problem::isometry::rotations;
use crate::fit::{FitOptions, fit};
use crate::model::Model;
use crate::progress::Silent;
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[test]
fn success_table() {
    let (Ok(data), Ok(trials)) = (std::env::var("GMLC_TEST_DATA"), std::env::var("GMLC_FIT_TRIALS")) else { return };
    let wild = std::env::var("GMLC_FIT_WILD").is_ok();
    let scan = load(&format!("{data}/cup/cup_scan.ply"));
    let truth = [4.0, 40.0, 90.0, 0.98, 1.9, 0.95, 1.8, 0.2, 0.85];
    let trials: usize = trials.parse().unwrap();
    let only: Option<usize> = std::env::var("GMLC_FIT_ONLY").ok().map(|s| s.parse().unwrap());
    let turns = rotations(trials.max(20));
    let mut good = 0;
    let mut seconds = Vec::new();
    for trial in 0..trials {
        if only.is_some_and(|o| o != trial) {
            continue;
        }
        let mut rng = ChaCha8Rng::seed_from_u64(trial as u64);
        let mut scan = scan.clone();
        let shift = DVec3::new(rng.random_range(-300.0..300.0), rng.random_range(-300.0..300.0), 100.0);
        let model = cup();
        let mut options = FitOptions::default();
        if wild {
            for p in &model.parameters()[6..] {
                options.start.insert(p.name.clone(), rng.random_range(p.lower..p.upper));
            }
        }
        for p in scan.mesh.positions.iter_mut() {
            *p = (turns[trial] * DVec3::from_array(*p) + shift).to_array();
        }
        for n in scan.mesh.normals.iter_mut() {
            *n = (turns[trial] * DVec3::from_array(*n)).to_array();
        }
        let before = cpu();
        let result = fit(&model, &scan, &options, &Silent).unwrap();
        let allowed = [0.02, 0.15, 0.15, 0.03, 0.03, 0.03, 0.03, 0.03, 0.03];
        let bad: Vec<String> = result.parameters[6..]
            .iter()
            .zip(truth)
            .zip(allowed)
            .filter(|((p, t), a)| (p.value - t).abs() > *a)
            .map(|((p, t), _)| format!("{} {:.3}/{t}", p.name, p.value))
            .collect();
        let s: f64 = cpu() - before;
        seconds.push(s);
        if bad.is_empty() {
            good += 1;
        }
        println!(
            "{trial}: {} f {:.4} sigma {:.2} in {:.3} ev {} {:.2}s {:?} {}",
            if bad.is_empty() { "ok" } else { "BAD" },
            result.objective,
            result.sigma,
            result.inliers,
            result.evaluations,
            s,
            result.seconds.iter().map(|(k, v)| format!("{k} {v:.2}")).collect::<Vec<_>>(),
            bad.join(", ")
        );
    }
    seconds.sort_by(f64::total_cmp);
    println!("{good} of {trials}, median {:.2} s", seconds[seconds.len() / 2]);
}

/// Seconds of processor time of this process.
fn cpu() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
    (fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap()) / 100.0
}
