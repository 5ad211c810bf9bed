//! Findings that need the model to run: that it cannot be evaluated at its defaults, that parameters do nothing, that
//! some of their values can never be used, and that its surfaces jump or have kinks as a parameter passes a branch.
//!
//! All of it samples: it finds what shows at some tens of settings, and proves nothing.

mod influence;
mod jumps;
mod ranges;

use super::{EvaluationError, Order, Parameter, Program, Quantity, Sites};
use crate::diagnostic::{Code, Diagnostic};
use crate::number::plain;

impl Program {
    /// Runs the model at some settings of its parameters. Returns an error where it cannot be evaluated at its
    /// defaults, and warnings of what is most likely not meant.
    #[must_use]
    pub fn probe(&self) -> Vec<Diagnostic> {
        if let Err(error) = self.evaluate_at_defaults() {
            return vec![self.not_evaluated(&self.placed(error, &self.defaults()))];
        }
        let mut found = influence::probe(self);
        found.extend(ranges::probe(self));
        found.extend(jumps::probe(self));
        found.sort_by_key(|d| (d.span.file, d.span.start));
        found
    }

    /// Points, partials and the Jacobian of every part on a coarse grid; at the borders points only: a pole is not a
    /// mistake.
    fn evaluate_at_defaults(&self) -> Result<(), EvaluationError> {
        let defaults = self.defaults();
        let instance = self.instantiate(&defaults)?;
        self.tolerances(&defaults)?;
        let grid =
            |steps: [f64; 5]| -> (Vec<f64>, Vec<f64>) { steps.iter().flat_map(|u| steps.map(|v| (*u, v))).unzip() };
        let (u, v) = grid([0.02, 0.27, 0.5, 0.73, 0.98]);
        let with_borders = grid([0.0, 0.27, 0.5, 0.73, 1.0]);
        for (k, part) in self.patches.iter().enumerate() {
            let mut out = vec![0.0; u.len() * 9.max(3 * part.active.len())];
            instance.evaluate(k, Sites::Scattered(&u, &v), Order::Points, &mut out[..3 * u.len()])?;
            instance.evaluate(k, Sites::Scattered(&u, &v), Order::Partials, &mut out[..9 * u.len()])?;
            instance.evaluate(
                k,
                Sites::Scattered(&u, &v),
                Order::Jacobian,
                &mut out[..3 * part.active.len() * u.len()],
            )?;
            let sites = Sites::Scattered(&with_borders.0, &with_borders.1);
            instance.evaluate(k, sites, Order::Points, &mut out[..3 * u.len()])?;
        }
        Ok(())
    }

    fn not_evaluated(&self, error: &EvaluationError) -> Diagnostic {
        let span = error.span.or_else(|| self.typed.parts.first().map(|p| p.span)).unwrap_or_default();
        let message = format!("the model cannot be evaluated at its defaults: {}", error.sentence);
        let diagnostic = Diagnostic::new(Code::Evaluation, span, message).label(error.circumstances.clone());
        match error.related {
            Some((place, what)) => diagnostic.related(place, what),
            None => diagnostic,
        }
    }

    /// The parameters that a part's surface uses, also those that only decide.
    fn influences(&self, part: usize) -> impl Iterator<Item = usize> {
        let surface = &self.functions.parts[part].surface;
        let used = self.functions.module.function(surface.function).used_params();
        surface.params.iter().zip(used).filter(|(_, used)| *used).map(|(i, _)| *i as usize)
    }

    /// The range of every parameter that is looked at: its bounds at x, where there are none a range about its default.
    fn range(&self, x: &[f64], i: usize) -> (f64, f64) {
        let (low, high) = self.bounds(x)[i];
        let p = &self.parameters[i];
        let about = match p.quantity {
            Quantity::Angle => std::f64::consts::PI,
            _ => p.default.abs().max(1.0),
        };
        (if low.is_finite() { low } else { p.default - about }, if high.is_finite() { high } else { p.default + about })
    }
}

/// A value with its unit and as many digits as a person wants to read.
fn shown(parameter: &Parameter, value: f64) -> String {
    let (value, unit) = parameter.quantity.written(value);
    let digits = 4 - value.abs().max(1e-3).log10().floor() as i32;
    let scale = 10f64.powi(digits.clamp(0, 6));
    format!("{}{unit}", plain((value * scale).round() / scale + 0.0))
}
