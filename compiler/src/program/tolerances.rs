//! The tolerances that a script gives its parts.

use super::Program;
use super::failure::{EvaluationError, Place};
use crate::ir::interpret;

impl Program {
    /// The tolerance of each part at x in millimetres, where the script gives one. (They are few and needed once: the
    /// interpreter computes them.)
    ///
    /// # Errors
    /// If one cannot be computed, or is negative.
    ///
    /// # Panics
    /// If x does not have a value for every parameter.
    pub fn tolerances(&self, x: &[f64]) -> Result<Vec<Option<f64>>, EvaluationError> {
        assert_eq!(x.len(), self.parameters.len(), "a value for every parameter");
        let tolerance = |(patch, function): (usize, &Option<_>)| {
            let Some(function) = function else { return Ok(None) };
            let module = &self.functions.module;
            let span = self.typed.parts[patch].tolerance.as_ref().map(|t| t.span);
            let wrong = |message: String| self.error(span, &message, &Place::of_part(x, patch, None), Some(&[]));
            let value = interpret::run_real(module, *function, x, self.replay_limits());
            match value.as_deref() {
                Ok([value]) if *value >= 0.0 && value.is_finite() => Ok(Some(*value)),
                Ok([value, ..]) if value.is_nan() => Err(wrong("the tolerance is not a number".to_owned())),
                Ok([value, ..]) if *value > 0.0 => Err(wrong("the tolerance is not finite".to_owned())),
                Ok([value, ..]) => Err(wrong(format!("a tolerance must not be negative, but this is {value} mm"))),
                Ok([]) => Ok(None),
                Err(e) => Err(wrong(format!("the tolerance cannot be computed: {e}"))),
            }
        };
        self.functions.tolerances.iter().enumerate().map(tolerance).collect()
    }
}
