use super::shapes::cup;
use crate::fit::{FitOptions, FitResult, fit};
use crate::mesh::TriangleMesh;
use crate::model::{Model, Partials};
use crate::progress::Silent;
use crate::scan::{Scan, ScanSource};
use glam::{DQuat, DVec3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::Distribution;

pub(crate) fn load(path: &str) -> Scan {
    let bytes = std::fs::read(path).unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8_lossy(&bytes[..end]).to_string();
    let count = |what: &str| -> usize {
        header.lines().find_map(|l| l.strip_prefix(&format!("element {what} "))).unwrap().trim().parse().unwrap()
    };
    let (n, m) = (count("vertex"), count("face"));
    let f = |at: usize| f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
    let i = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let positions: Vec<[f64; 3]> = (0..n).map(|k| std::array::from_fn(|c| f(end + 12 * k + 4 * c))).collect();
    let faces = end + 12 * n;
    let triangles: Vec<[u32; 3]> = (0..m).map(|k| std::array::from_fn(|c| i(faces + 13 * k + 1 + 4 * c))).collect();
    let mut normals = vec![glam::DVec3::ZERO; n];
    for t in &triangles {
        let [a, b, c] = t.map(|v| glam::DVec3::from_array(positions[v as usize]));
        for v in t {
            normals[*v as usize] += (b - a).cross(c - a);
        }
    }
    let normals = normals.iter().map(|n| n.normalize_or_zero().to_array()).collect();
    known(TriangleMesh { positions, normals, triangles, ..TriangleMesh::default() }, 0.3)
}

/// Rz(gamma) Ry(beta) Rx(alpha).
fn rotation(angles: &[f64]) -> DQuat {
    DQuat::from_rotation_z(angles[2]) * DQuat::from_rotation_y(angles[1]) * DQuat::from_rotation_x(angles[0])
}

/// Checks a fit of the cup against the truth: x, y, z, alpha, beta, gamma, shape, r, h, and six of the handle.
pub(crate) fn check(result: &FitResult, truth: &[f64]) {
    let values: Vec<f64> = result.parameters.iter().map(|p| p.value).collect();
    let turn = rotation(&values[3..6]).angle_between(rotation(&truth[3..6])).to_degrees();
    assert!(turn < 0.15, "rotation off by {turn} degrees");
    for (i, (value, truth)) in values.iter().zip(truth).enumerate() {
        let allowed = match i {
            0..3 | 7..9 => 0.15,
            6 => 0.02,
            9.. => 0.03,
            _ => continue,
        };
        let name = &result.parameters[i].name;
        assert!((value - truth).abs() < allowed, "{name} = {value}, not {truth}");
    }
    assert!(result.converged, "{:?}", result.warnings);
}

/// A cup that is far from the defaults in every way.
pub(crate) const SYNTHETIC: [f64; 15] =
    [30.0, -12.0, 55.0, 2.2, 0.7, -1.9, 3.0, 44.0, 80.0, 0.97, 1.8, 0.9, 1.75, 0.25, 0.84];

/// A scan of that cup.
pub(crate) fn synthetic(noise: f64, count: usize, seed: u64) -> Scan {
    scan_of(&cup(), &SYNTHETIC, noise, count, seed)
}

/// About `count` points spread evenly over a model's surface, with noise along the normal, which points out of a
/// surface whose du x dv does.
pub(crate) fn scan_of(model: &dyn Model, x: &[f64], noise: f64, count: usize, seed: u64) -> Scan {
    let instance = model.instantiate(x).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut mesh = TriangleMesh::default();
    // Points uniform in (u, v) are kept with a probability proportional to the area that they stand for.
    let draws: Vec<(usize, f64, f64, f64)> =
        (0..40 * count).map(|i| (i % model.parts().len(), rng.random(), rng.random(), rng.random())).collect();
    let partials: Vec<Partials> = draws
        .iter()
        .map(|(patch, u, v, _)| {
            let mut out = [Partials::default()];
            instance.partials(*patch, &[*u], &[*v], &mut out).unwrap();
            out[0]
        })
        .collect();
    let cross = |p: &Partials| DVec3::from_array(p.du).cross(DVec3::from_array(p.dv));
    let total: f64 = partials.iter().map(|p| cross(p).length()).sum();
    let normal = rand_distr::Normal::new(0.0, noise).unwrap();
    for (p, (patch, u, v, chance)) in partials.iter().zip(&draws) {
        let there = instance.is_there(model.keep(*patch), &[*u], &[*v]).unwrap()[0];
        if there && chance * total < cross(p).length() * count as f64 {
            let n = cross(p).normalize();
            mesh.positions.push((DVec3::from_array(p.point) + n * normal.sample(&mut rng)).to_array());
            mesh.normals.push(n.to_array());
        }
    }
    known(mesh, noise)
}

/// A scan of some points whose normals and whose noise, in millimetres, are known.
pub(super) fn known(mesh: TriangleMesh, noise: f64) -> Scan {
    Scan {
        mesh,
        attributes: Default::default(),
        oriented: true,
        source: ScanSource::default(),
        noise,
        warnings: Vec::new(),
    }
}

#[test]
fn the_cup_is_found_without_a_pose_or_a_start() {
    let Ok(data) = std::env::var("GMLC_TEST_DATA") else {
        println!("skipped: GMLC_TEST_DATA is not set");
        return;
    };
    let scan = load(&format!("{data}/cup/cup_scan.ply"));
    let text = std::fs::read_to_string(format!("{data}/cup/cup_truth.json")).unwrap();
    let truth: serde_json::Value = serde_json::from_str(&text).unwrap();
    let truth: Vec<f64> = truth["x_true"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    let result = fit(&cup(), &scan, &FitOptions::default(), &Silent).unwrap();
    check(&result, &truth);
    assert!(result.inliers > 0.98 && result.sigma < 3.0, "{result:?}");
    // The scanned cup has eight sides, the model is round.
    let [warning] = &result.warnings[..] else { panic!("{:?}", result.warnings) };
    assert!(warning.starts_with("the model does not have the scan's shape: of the 0.6"), "{warning}");
}
