//! The measures of a model: their values, derivatives and tolerances at x. They are few and needed once: the
//! interpreter computes them.

use super::Program;
use super::failure::{EvaluationError, Place};
use super::functions::positions;
use crate::diff::{self, DiffError};
use crate::ir::{FunctionId, LoweredMeasure, Module, interpret};
use crate::parameters::{Measure, PartFigure};

/// The functions of a measure.
pub(super) struct MeasureFunctions {
    /// `(params.., figures..) -> value`.
    pub(super) value: FunctionId,
    /// `(params.., figures..) -> (value, entries..)`.
    pub(super) jacobian: FunctionId,
    /// The indices of the figures of parts that it takes, ascending.
    pub(super) figures: Vec<u32>,
    /// The derivative by each parameter, and then each figure, among the results; none where it is always zero.
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
        let LoweredMeasure { value, figures, limits } = measure;
        let wrt: Vec<u32> = (0..(params + figures.len()) as u32).collect();
        let (jacobian, pattern) = diff::jacobian(module, value, &wrt)?;
        let positions = positions(&pattern, 1);
        let entries = wrt.iter().map(|param| positions.get(&(0, *param)).copied()).collect();
        Ok(MeasureFunctions { value, jacobian, figures, entries, limits })
    }
}

impl Program {
    /// The measures, in order.
    #[must_use]
    pub fn measures(&self) -> &[Measure] {
        &self.measures
    }

    /// The figures of parts that the measures take.
    #[must_use]
    pub fn figures(&self) -> &[PartFigure] {
        &self.figures
    }

    /// The indices of the [`Program::figures`] that a measure takes, ascending.
    ///
    /// # Panics
    /// If there is no such measure.
    #[must_use]
    pub fn figures_of(&self, measure: usize) -> &[u32] {
        &self.functions.measures[measure].figures
    }

    /// The value of a measure at x and at the values of the figures that it takes. Millimetres and radians.
    ///
    /// # Errors
    /// If it cannot be computed, or is not finite.
    ///
    /// # Panics
    /// If x does not have a value for every parameter, there is no such measure, or it takes another number of
    /// figures.
    pub fn measure(&self, measure: usize, x: &[f64], figures: &[f64]) -> Result<f64, EvaluationError> {
        let results = self.of_measure(measure, self.functions.measures[measure].value, [x, figures])?;
        let value = results.first().copied().filter(|value| value.is_finite());
        value.ok_or_else(|| self.wrong_measure(measure, x, "cannot be computed: its value is not finite"))
    }

    /// The derivative of a measure by every parameter, and then by every figure that it takes. Millimetres and
    /// radians.
    ///
    /// # Errors
    /// If one cannot be computed, or is not finite.
    ///
    /// # Panics
    /// As [`Program::measure`].
    pub fn measure_gradient(&self, measure: usize, x: &[f64], figures: &[f64]) -> Result<Vec<f64>, EvaluationError> {
        let functions = &self.functions.measures[measure];
        let results = self.of_measure(measure, functions.jacobian, [x, figures])?;
        let derivative = |entry: &Option<usize>| entry.and_then(|k| results.get(k)).copied().unwrap_or(0.0);
        let gradient: Vec<f64> = functions.entries.iter().map(derivative).collect();
        match gradient.iter().position(|slope| !slope.is_finite()) {
            Some(i) => {
                let by = self.parameters.get(i).map_or("the parts", |p| &p.name);
                Err(self.wrong_measure(measure, x, &format!("has no derivatives here: that by '{by}' is not finite")))
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
        match self.of_measure(measure, function, [x, &[]])?[..] {
            [lower, upper] if lower <= upper && lower.is_finite() && upper.is_finite() => Ok(Some([lower, upper])),
            _ => Err(self.wrong_measure(measure, x, "cannot be judged: its tolerance leaves nothing")),
        }
    }

    fn of_measure(
        &self,
        measure: usize,
        function: FunctionId,
        [x, figures]: [&[f64]; 2],
    ) -> Result<Vec<f64>, EvaluationError> {
        assert_eq!(x.len(), self.parameters.len(), "a value for every parameter");
        let args = [x, figures].concat();
        assert_eq!(args.len(), self.functions.module.function(function).params.len(), "a value for every figure");
        let run = interpret::run_real(&self.functions.module, function, &args, self.replay_limits());
        run.map_err(|e| self.wrong_measure(measure, x, &format!("cannot be computed: {e}")))
    }

    /// The error of a measure at x: what is said of it, such as that it cannot be computed, with the reason.
    ///
    /// # Panics
    /// If there is no such measure.
    #[must_use]
    pub fn wrong_measure(&self, measure: usize, x: &[f64], said: &str) -> EvaluationError {
        let Measure { name, span, .. } = &self.measures[measure];
        self.error(Some(*span), &format!("the measure '{name}' {said}"), &Place::of_model(x), None)
    }
}
