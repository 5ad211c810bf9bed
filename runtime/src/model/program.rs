//! Compiled scripts as models.

use super::surface::{Instance, Model};
use gml_compiler::program::{
    self, BoundDerivative, EvaluationError, Measure, Order, Parameter, Part, PartFigure, Program, Sites,
};

impl Model for Program {
    fn name(&self) -> &str {
        Program::name(self)
    }

    fn parameters(&self) -> &[Parameter] {
        Program::parameters(self)
    }

    fn parts(&self) -> &[Part] {
        Program::parts(self)
    }

    fn keep(&self, part: usize) -> Option<usize> {
        Program::keep(self, part)
    }

    fn keep_active(&self, part: usize) -> &[u32] {
        Program::keep_active(self, part)
    }

    fn bounds(&self, x: &[f64]) -> Vec<(f64, f64)> {
        Program::bounds(self, x)
    }

    fn bounds_jacobian(&self, x: &[f64]) -> Vec<BoundDerivative> {
        Program::bounds_jacobian(self, x)
    }

    fn tolerances(&self, x: &[f64]) -> Result<Vec<Option<f64>>, EvaluationError> {
        Program::tolerances(self, x)
    }

    fn measures(&self) -> &[Measure] {
        Program::measures(self)
    }

    fn figures(&self) -> &[PartFigure] {
        Program::figures(self)
    }

    fn figures_of(&self, measure: usize) -> &[u32] {
        Program::figures_of(self, measure)
    }

    fn measure(&self, measure: usize, x: &[f64], figures: &[f64]) -> Result<f64, EvaluationError> {
        Program::measure(self, measure, x, figures)
    }

    fn measure_gradient(&self, measure: usize, x: &[f64], figures: &[f64]) -> Result<Vec<f64>, EvaluationError> {
        Program::measure_gradient(self, measure, x, figures)
    }

    fn wrong_measure(&self, measure: usize, x: &[f64], said: &str) -> EvaluationError {
        Program::wrong_measure(self, measure, x, said)
    }

    fn measure_limits(&self, measure: usize, x: &[f64]) -> Result<Option<[f64; 2]>, EvaluationError> {
        Program::measure_limits(self, measure, x)
    }

    fn instantiate<'a>(&'a self, x: &[f64]) -> Result<Box<dyn Instance + 'a>, EvaluationError> {
        Ok(Box::new(Program::instantiate(self, x)?))
    }
}

impl Instance for program::Instance<'_> {
    fn evaluate(
        &self,
        patch: usize,
        sites: Sites<'_>,
        order: Order<'_>,
        out: &mut [f64],
    ) -> Result<(), EvaluationError> {
        program::Instance::evaluate(self, patch, sites, order, out)
    }
}
