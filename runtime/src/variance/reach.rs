//! Changes of parameters that a model can make: within the bounds, and as far as the surface moves by its derivatives.
//! Beyond that, what a change would explain of the deviations is a figure about no model.

use super::explained::ParameterEffect;
use crate::model::{Instance, Model, Partials};
use glam::DVec3;

/// Places of a patch each way at which its movement is compared with its derivatives.
const SAMPLES: usize = 16;
/// The surface moves by its derivatives where the root mean square of the difference, along the normal, is at most this
/// part of the movement: a proposal that is off by more than a third is none.
const LINEAR: f64 = 1.0 / 3.0;
/// Relative error of a value that is written and read, or follows from others.
const ROUNDING: f64 = 1e-9;

/// A model about the parameters at which it was measured.
pub(crate) struct Reach<'a> {
    pub(crate) model: &'a dyn Model,
    pub(crate) instance: Box<dyn Instance + 'a>,
    pub(crate) x: Vec<f64>,
}

impl Reach<'_> {
    /// Whether the model exists with a parameter changed, and a patch then is about where its derivatives say.
    pub(crate) fn contains(&self, patch: usize, effect: &ParameterEffect) -> bool {
        let Some(parameter) = self.model.parameters().iter().position(|p| p.name == effect.name) else { return false };
        let mut x = self.x.clone();
        x[parameter] += effect.change;
        // A value at a bound that follows from another one may be beyond it by rounding.
        let within = |(value, (low, high)): (&f64, (f64, f64))| {
            let rounding = ROUNDING * value.abs();
            (low - rounding..=high + rounding).contains(value)
        };
        x.iter().zip(self.model.bounds(&x)).all(within) && self.is_linear(patch, parameter, &x).unwrap_or(false)
    }

    /// Whether the surface at `x`, where one parameter differs, is about where the derivatives by it say. None where it
    /// does not exist.
    pub(crate) fn is_linear(&self, patch: usize, parameter: usize, x: &[f64]) -> Option<bool> {
        let at = |k: usize| (k as f64 + 0.5) / SAMPLES as f64;
        let (u, v): (Vec<f64>, Vec<f64>) = (0..SAMPLES * SAMPLES).map(|k| (at(k % SAMPLES), at(k / SAMPLES))).unzip();
        let changed = self.model.instantiate(x).ok()?;
        let mut points = vec![[0.0; 3]; u.len()];
        changed.points(patch, &u, &v, &mut points).ok()?;
        let mut partials = vec![Partials::default(); u.len()];
        self.instance.partials(patch, &u, &v, &mut partials).ok()?;
        let active = &self.model.parts()[patch].active;
        let column = active.iter().position(|i| *i as usize == parameter)?;
        let mut jacobian = vec![0.0; 3 * active.len() * u.len()];
        self.instance.jacobian(patch, &u, &v, &mut jacobian).ok()?;
        let change = x[parameter] - self.x[parameter];
        let (mut moved, mut beside, mut rounding) = (0.0, 0.0, 0.0);
        for ((there, here), derivatives) in points.iter().zip(&partials).zip(jacobian.chunks_exact(3 * active.len())) {
            let normal = DVec3::from(here.du).cross(DVec3::from(here.dv));
            let area = normal.length();
            let along = |step: DVec3| step.dot(normal.normalize_or_zero());
            let derivative = DVec3::from_slice(&derivatives[3 * column..]);
            let predicted = along(change * derivative);
            let actual = along(DVec3::from(*there) - DVec3::from(here.point));
            moved += area * predicted.powi(2);
            rounding += area * (ROUNDING * DVec3::from(here.point).length()).powi(2);
            beside += area * (actual - predicted).powi(2);
        }
        Some(beside <= LINEAR.powi(2) * moved + rounding)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gml_compiler::program::{Options, compile};
    use gml_compiler::source::{NoFiles, SourceFile};

    #[test]
    fn changes_stay_within_the_bounds_and_where_the_surface_is_linear() {
        let text = "use std.surface (cylinder)
            use std.frame (rotate)
            model can {
              param r: length in 5mm..25mm = 20mm
              param lean: angle = 0deg
              param s: real in 0..100 = 1
              part side = cylinder(r, 50mm).rotate(lean, (1, 0, 0))
              part cap = plane(s ^ 3 * 1mm, 10mm).rotate(90deg, (0, 1, 0)).translate((s ^ 3 * 1mm, 0mm, 0mm))
            }";
        let script = SourceFile { name: "can.gml".to_owned(), text: text.to_owned() };
        let program = compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program;
        let x = vec![20.0, 0.0, 1.0];
        let reach = Reach { model: &program, instance: Model::instantiate(&program, &x).expect("it exists"), x };
        let contains = |patch: usize, name: &str, change: f64| {
            let effect = ParameterEffect { name: name.to_owned(), change, unit: String::new(), share: 0.5 };
            reach.contains(patch, &effect)
        };
        assert!(contains(0, "r", 4.9) && !contains(0, "r", 5.1) && contains(0, "r", -14.0));
        // A point at the height z moves by z sin(a), and R (1 - cos(a)) beside it.
        assert!(contains(0, "lean", 0.1) && !contains(0, "lean", 1.53));
        // (1 + t)^3 - 1 is a third more than 3 t from t = 0.303 on.
        assert!(contains(1, "s", 0.29) && !contains(1, "s", 0.32));
        // It does not move a patch.
        assert!(!contains(0, "s", 0.1) && !contains(0, "nobody", 0.1));
    }
}
