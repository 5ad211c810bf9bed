//! The uncertainty of the pose that a fit adds, against many fits of simulated scans.

use super::shapes::program;
use super::vessel::{even, meshed, vessel};
use crate::fit::{EarlierFit, FitOptions, FitResult, fit};
use crate::model::{Fineness, Model, Motion, Tessellation};
use crate::progress::Silent;
use crate::repeats::{ratio_of_spreads, repeats};
use crate::scan::{Scan, from_mesh};
use crate::simulate::{self, Scanner};
use glam::DVec3;

/// A fit that begins at the truth. The lid has many points, the bottom few: where that is, is known badly, and with it
/// the height, but not where the lid is.
fn fitted(seed: u64) -> FitResult {
    let object = vessel(0.0, 0.0);
    let lines = [[even(40), even(16)], [even(30), even(8)], [even(6), even(2)]];
    let fixed = ["dome", "bulge"].map(str::to_owned).into();
    let earlier = Some(EarlierFit { pose: Some(Motion::IDENTITY), ..EarlierFit::default() });
    let options = FitOptions { earlier, fixed, ..FitOptions::default() };
    // Noise along the normals has no bias; that of noise in all directions is not to be part of the comparison.
    let scan = Scan { noise: 0.0, ..meshed(&object, &lines, 0.05, seed) };
    fit(&object, &scan, &options, &Silent).unwrap()
}

#[test]
fn the_pose_and_the_parameters_have_a_joint_covariance() {
    let count = repeats(16, 60);
    let runs: Vec<FitResult> = (0..count).map(fitted).collect();
    let spread = |of: &dyn Fn(&FitResult) -> f64| {
        let values: Vec<f64> = runs.iter().map(of).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64).sqrt()
    };
    // sqrt(s^T C s), where s are the effects of the height, and of the pose at a place, along z.
    let stated = |of_height: f64, place: DVec3| {
        let of_run = |r: &FitResult| {
            let joint = r.pose_covariance.as_ref().unwrap();
            assert_eq!(joint.parameters, ["radius", "height"]);
            let turned = (place - DVec3::from(joint.centre)).cross(DVec3::Z);
            let effects = [0.0, of_height, 0.0, 0.0, 1.0, turned.x, turned.y, turned.z];
            let products = effects.iter().zip(&joint.matrix);
            products.map(|(a, row)| a * effects.iter().zip(row).map(|(b, c)| b * c).sum::<f64>()).sum::<f64>()
        };
        (runs.iter().map(of_run).sum::<f64>() / runs.len() as f64).sqrt()
    };
    let z_of = |r: &FitResult, p: DVec3| {
        let Motion { rotation, translation } = r.pose.unwrap();
        DVec3::from(rotation[2]).dot(p) + translation[2]
    };
    let height = |r: &FitResult| r.parameters[1].value;
    let lid = (spread(&|r| z_of(r, DVec3::Z * height(r))), stated(1.0, DVec3::Z * 100.0));
    let bottom = (spread(&|r| z_of(r, DVec3::ZERO)), stated(0.0, DVec3::ZERO));
    // Beside the axis the tilt counts as well.
    let beside = DVec3::new(0.0, 30.0, 0.0);
    let side = (spread(&|r| z_of(r, beside)), stated(0.0, beside));
    for (name, (found, stated)) in [("lid", lid), ("bottom", bottom), ("side", side)] {
        assert!(ratio_of_spreads(count).contains(&(stated / found)), "{name}: stated {stated}, found {found}");
    }
    // The height alone would make the lid much less certain.
    let alone = runs[0].parameters[1].sd.unwrap();
    assert!(alone > 1.5 * lid.1, "{alone} {}", lid.1);
}

#[test]
fn a_turn_about_the_axis_is_named_and_has_no_variance() {
    let joint = fitted(100).pose_covariance.unwrap();
    let [symmetry] = &joint.symmetries[..] else { panic!("{joint:?}") };
    assert!(symmetry.turn[2].abs() > 0.999 && symmetry.text.starts_with("a turn about"), "{symmetry:?}");
    let along = |i: usize| (0..3).map(|k| joint.matrix[i][5 + k] * symmetry.turn[k]).sum::<f64>();
    let variance: f64 = (0..3).map(|k| symmetry.turn[k] * along(5 + k)).sum();
    // Beside that of a tilt.
    assert!(variance.abs() < 1e-6 * joint.matrix[5][5], "{variance}");
    assert_eq!(joint.matrix.len(), 8);
}

/// A fit of a flask with an ear, or without, to the half of its scan that does not have the ear.
fn half_of_a_flask(ear: &str) -> FitResult {
    let program = program(&format!(
        "use std.surface (cylinder, disc, flip, sphere)
        use std.frame (translate)
        model flask {{
          param r: length in 20mm..60mm = 40mm
          param h: length in 40mm..160mm = 90mm
          part wall = cylinder(r, h)
          part bottom = flip(disc(r))
          part lid = disc(r).translate((0mm, 0mm, h))
          {ear}
        }}"
    ));
    let instance = Model::instantiate(&program, &[40.0, 90.0]).unwrap();
    let real = Tessellation::new(&program, &*instance, Fineness::default()).unwrap().mesh;
    let scanner = Scanner { spacing: 2.0, noise: 0.05, random_pose: false, ..Scanner::default() };
    let mut mesh = simulate::scan(&real, &scanner, &Silent).unwrap().mesh;
    let positions = mesh.positions.clone();
    mesh.triangles.retain(|t| t.iter().all(|corner| positions[*corner as usize][0] < 0.0));
    let scan = from_mesh(mesh, "flask").unwrap();
    let earlier = Some(EarlierFit { pose: Some(Motion::IDENTITY), ..EarlierFit::default() });
    fit(&program, &scan, &FitOptions { earlier, ..FitOptions::default() }, &Silent).unwrap()
}

#[test]
fn a_turn_is_a_symmetry_only_if_it_moves_nothing_of_the_model() {
    let ear = "part ear = sphere(6mm).translate((r + 25mm, 0mm, 0.6 * h))";
    for (ear, moves) in [("", &[][..]), (ear, &["ear".to_owned()][..])] {
        let result = half_of_a_flask(ear);
        let joint = result.pose_covariance.as_ref().unwrap();
        let [symmetry] = &joint.symmetries[..] else { panic!("{joint:?}") };
        // About the flask's axis, which is not in the middle of its half.
        assert!(symmetry.turn[2].abs() > 0.999, "{symmetry:?}");
        let axis = DVec3::from(joint.centre) + DVec3::from(symmetry.turn).cross(DVec3::from(symmetry.shift));
        assert!(axis.x.hypot(axis.y) < 0.05, "{axis} {joint:?}");
        assert_eq!(symmetry.moves, moves, "{symmetry:?}");
        let warned = |text: &str| result.warnings.iter().any(|w| w.contains(text));
        assert_eq!(warned("it moves `ear`"), !moves.is_empty(), "{:?}", result.warnings);
        assert!(moves.is_empty() || !warned("the model is symmetric"), "{:?}", result.warnings);
        let turn = DVec3::from(symmetry.turn);
        let along = |i: usize| (0..3).map(|k| joint.matrix[i][5 + k] * turn[k]).sum::<f64>();
        let variance: f64 = (0..3).map(|k| turn[k] * along(5 + k)).sum();
        assert!(variance.abs() < 1e-3 * joint.matrix[5][5], "{variance} {:?}", joint.matrix);
    }
}
