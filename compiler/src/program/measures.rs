//! The measures of a model: their values, derivatives and tolerances at x. They are few and needed once: the
//! interpreter computes them.

use super::Program;
use super::failure::{EvaluationError, Place};
use super::functions::positions;
use crate::diff::{self, DiffError};
use crate::ir::{FunctionId, LoweredMeasure, Module, interpret};
use crate::parameters::Measure;

/// The functions of a measure.
pub(super) struct MeasureFunctions {
    /// `(params..) -> value`.
    pub(super) value: FunctionId,
    /// `(params..) -> (value, entries..)`.
    pub(super) jacobian: FunctionId,
    /// The derivative by each parameter among the results; none where it is always zero.
    entries: Vec<Option<usize>>,
    /// `(params..) -> (lower, upper)`.
    pub(super) limits: Option<FunctionId>,
}

impl MeasureFunctions {
    /// Differentiates a measure of `params` parameters, whose functions are inlined and simplified.
    pub(super) fn new(
        module: &mut Module,
        measure: LoweredMeasure,
        params: usize,
    ) -> Result<MeasureFunctions, DiffError> {
        let wrt: Vec<u32> = (0..params as u32).collect();
        let (jacobian, pattern) = diff::jacobian(module, measure.value, &wrt)?;
        let positions = positions(&pattern, 1);
        let entries = wrt.iter().map(|param| positions.get(&(0, *param)).copied()).collect();
        Ok(MeasureFunctions { value: measure.value, jacobian, entries, limits: measure.limits })
    }
}

impl Program {
    /// The measures, in order.
    #[must_use]
    pub fn measures(&self) -> &[Measure] {
        &self.measures
    }

    /// The value of a measure at x. Millimetres and radians.
    ///
    /// # Errors
    /// If it cannot be computed, or is not finite.
    ///
    /// # Panics
    /// If x does not have a value for every parameter, or there is no such measure.
    pub fn measure(&self, measure: usize, x: &[f64]) -> Result<f64, EvaluationError> {
        let results = self.of_measure(measure, self.functions.measures[measure].value, x)?;
        let value = results.first().copied().filter(|value| value.is_finite());
        value.ok_or_else(|| self.wrong_measure(measure, x, "its value is not finite"))
    }

    /// The derivative of a measure by every parameter at x. Millimetres and radians.
    ///
    /// # Errors
    /// If one cannot be computed, or is not finite.
    ///
    /// # Panics
    /// If x does not have a value for every parameter, or there is no such measure.
    pub fn measure_gradient(&self, measure: usize, x: &[f64]) -> Result<Vec<f64>, EvaluationError> {
        let functions = &self.functions.measures[measure];
        let results = self.of_measure(measure, functions.jacobian, x)?;
        let derivative = |entry: &Option<usize>| entry.and_then(|k| results.get(k)).copied().unwrap_or(0.0);
        let gradient: Vec<f64> = functions.entries.iter().map(derivative).collect();
        match gradient.iter().position(|slope| !slope.is_finite()) {
            Some(i) => {
                let what = format!("its derivative by '{}' is not finite", self.parameters[i].name);
                Err(self.wrong_measure(measure, x, &what))
            }
            None => Ok(gradient),
        }
    }

    /// What the tolerance of a measure allows about the value at x, if it has one: the lower and the upper limit.
    /// Millimetres and radians.
    ///
    /// # Errors
    /// If it cannot be computed, or leaves nothing.
    ///
    /// # Panics
    /// If x does not have a value for every parameter, or there is no such measure.
    pub fn measure_limits(&self, measure: usize, x: &[f64]) -> Result<Option<[f64; 2]>, EvaluationError> {
        let Some(function) = self.functions.measures[measure].limits else { return Ok(None) };
        match self.of_measure(measure, function, x)?[..] {
            [lower, upper] if lower <= upper && lower.is_finite() && upper.is_finite() => Ok(Some([lower, upper])),
            _ => Err(self.wrong_measure(measure, x, "its tolerance leaves nothing")),
        }
    }

    fn of_measure(&self, measure: usize, function: FunctionId, x: &[f64]) -> Result<Vec<f64>, EvaluationError> {
        assert_eq!(x.len(), self.parameters.len(), "a value for every parameter");
        let run = interpret::run_real(&self.functions.module, function, x, self.replay_limits());
        run.map_err(|e| self.wrong_measure(measure, x, &e.to_string()))
    }

    fn wrong_measure(&self, measure: usize, x: &[f64], why: &str) -> EvaluationError {
        let Measure { name, span, .. } = &self.measures[measure];
        self.error(Some(*span), &format!("the measure '{name}' cannot be computed: {why}"), &Place::of_model(x), None)
    }
}
