//! Searches over many values of an input.

use super::number::Number;
use super::shapes::{Formula, Handmade};
use super::vessel::{even, meshed, vessel};
use crate::fit::infer::compare::{Rival, compare};
use crate::fit::monitor::Monitor;
use crate::fit::problem::Problem;
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::loss::Loss;
use crate::fit::register::group::least_turn;
use crate::fit::{FitOptions, InputValues, fit, search};
use crate::progress::Silent;
use crate::scan::Scan;
use glam::DVec3;
use gml_compiler::program::Quantity;
use std::f64::consts::TAU;

/// A cup with a bottom, whose wall goes in and out so many times: radius, height, depth.
struct Wavy(i64);

impl Formula for Wavy {
    fn surface<T: Number>(&self, patch: usize, x: &[T], u: T, v: T) -> [T; 3] {
        let c = T::constant;
        let radius = x[0] + x[2] * (u * c(TAU * self.0 as f64)).cos();
        let turn = u * c(TAU);
        match patch {
            0 => [radius * turn.cos(), radius * turn.sin(), x[1] * v],
            _ => [radius * v * turn.cos(), radius * v * turn.sin(), c(0.0)],
        }
    }
}

fn wavy(waves: i64, [radius, height, depth]: [f64; 3]) -> Handmade<Wavy> {
    let rows = [("radius", 10.0, 60.0, radius), ("height", 10.0, 80.0, height), ("depth", 0.0, 6.0, depth)];
    let rows = rows.map(|(name, low, high, default)| (name, Quantity::Length, low, high, default));
    Handmade::new(Wavy(waves), &rows, &[("wall", &[0, 1, 2]), ("bottom", &[0, 2])])
}

/// A scan of seven waves, turned and shifted.
fn scanned() -> Scan {
    let lines = [[even(90), even(9)], [even(90), even(4)]];
    let mut scan = meshed(&wavy(7, [26.0, 42.0, 2.5]), &lines, 0.1, 5);
    let rotation = glam::DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 1.1);
    let turned = |p: &mut [f64; 3], shift: DVec3| *p = (rotation * DVec3::from_array(*p) + shift).to_array();
    scan.mesh.positions.iter_mut().for_each(|p| turned(p, DVec3::new(30.0, -10.0, 5.0)));
    scan.mesh.normals.iter_mut().for_each(|n| turned(n, DVec3::ZERO));
    scan
}

const START: [f64; 3] = [30.0, 35.0, 1.0];

#[test]
fn a_race_ends_as_whole_fits_would() {
    let scan = scanned();
    let values: Vec<InputValues> = (5..=9).map(|n| InputValues::from([("waves".to_owned(), n)])).collect();
    let prepare = |inputs: &InputValues| Ok((wavy(inputs["waves"], START), FitOptions::default()));
    let raced = search(values, &scan, prepare, &Silent).unwrap();

    let models: Vec<Handmade<Wavy>> = (5..=9).map(|n| wavy(n, START)).collect();
    let fits: Vec<_> = models.iter().map(|model| fit(model, &scan, &FitOptions::default(), &Silent).unwrap()).collect();
    let rivals: Vec<Rival> = models.iter().zip(&fits).map(|(model, fit)| Rival { model, fit }).collect();
    let bic = compare(&rivals, &scan).unwrap().bic;
    let mut order: Vec<usize> = (0..bic.len()).collect();
    order.sort_by(|a, b| bic[*a].total_cmp(&bic[*b]));

    let found = raced.fit.search.unwrap();
    let waves: Vec<i64> = found.candidates.iter().map(|c| c.inputs["waves"]).collect();
    assert_eq!((waves.len(), waves[0]), (5, 7), "{found:?}");
    assert_eq!(waves[0], 5 + order[0] as i64);
    // Of wrong numbers that are about equally wrong another one may be the runner-up.
    let margin = bic[order[1]] - bic[order[0]];
    assert!((found.margin.unwrap() / margin - 1.0).abs() < 0.1, "{:?} {margin} {waves:?}", found.margin);
    assert_eq!(raced.fit.parameters, fits[order[0]].parameters);
    // The winner, the runner-up and the pilot, which may be one of them.
    let whole = found.candidates.iter().filter(|c| !c.quick).count();
    assert!((2..=4).contains(&whole) && !found.candidates[0].quick && !found.candidates[1].quick, "{found:?}");
}

#[test]
fn a_body_of_revolution_is_turned_about_its_axis() {
    let object = vessel(8.0, 3.0);
    let scan = meshed(&object, &[[even(40), even(16)], [even(30), even(8)], [even(30), even(8)]], 0.0, 1);
    let (options, monitor) = (FitOptions::default(), Monitor::default());
    let problem = Problem::new(&object, &scan, &options, &monitor).unwrap();
    let level = problem.start_level().unwrap();
    let at = level.space.estimate(&problem.start.x, Isometry::IDENTITY);
    let objective = level.objective(&problem.thin, Loss::welsch(0.1 * problem.radius));
    let axis = least_turn(&objective, &at).unwrap();
    let motion = axis.rotated(&at.motion, 0.3, level.space.centre);
    let p = DVec3::new(20.0, 5.0, 60.0);
    let q = motion.apply(p);
    // About z, either way.
    let angle = (q.y.atan2(q.x) - p.y.atan2(p.x)).abs();
    assert!((angle - 0.3).abs() < 1e-3 && (q.z - p.z).abs() < 0.05, "{q} {angle}");
    assert!((q.truncate().length() - p.truncate().length()).abs() < 0.05, "{q}");
}
