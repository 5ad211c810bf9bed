//! Fits that must not stop where they begin.

use super::cup::scan_of;
use super::number::Number;
use super::shapes::{Formula, Handmade};
use crate::fit::{FitOptions, fit};
use crate::progress::Silent;
use gml_compiler::program::Quantity;
use std::f64::consts::TAU;

/// A sphere with ten flutes: nothing depends on their depth at u = 0.1, 0.3, ...
struct Fluted;

impl Formula for Fluted {
    fn surface<T: Number>(&self, _: usize, x: &[T], u: T, v: T) -> [T; 3] {
        let c = T::constant;
        let (turn, latitude) = (u * c(TAU), (v - c(0.5)) * c(TAU / 2.0));
        let wave = (turn * c(5.0)).sin();
        let radius = (x[0] - x[1] * wave * wave) * latitude.cos();
        [radius * turn.cos(), radius * turn.sin(), x[0] * latitude.sin()]
    }
}

#[test]
fn flutes_that_keep_step_with_a_grid_of_samples_are_fitted() {
    let model = |radius: f64, depth: f64| {
        let rows = [("r", Quantity::Length, 1.0, 99.0, radius), ("depth", Quantity::Length, 0.0, 9.0, depth)];
        Handmade::new(Fluted, &rows, &[("all", &[0, 1])])
    };
    let scan = scan_of(&model(37.0, 4.0), &[37.0, 4.0], 0.05, 4000, 8);
    let options = FitOptions { no_pose: true, ..FitOptions::default() };
    let result = fit(&model(40.0, 1.0), &scan, &options, &Silent).unwrap();
    for (p, truth) in result.parameters.iter().zip([37.0, 4.0]) {
        assert!((p.value - truth).abs() < 0.02 && p.sd.is_some_and(|sd| sd < 0.01), "{p:?}");
    }
    assert!(result.converged && result.warnings.is_empty(), "{:?}", result.warnings);
}
