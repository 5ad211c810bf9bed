//! Compiled scripts as models.

use super::surface::{EvaluationError, Instance, Model, Partials, SecondPartials};
use gml_compiler::program::{self, BoundDerivative, Parameter, Part, Program};

impl From<program::EvaluationError> for EvaluationError {
    fn from(error: program::EvaluationError) -> EvaluationError {
        EvaluationError { message: error.message }
    }
}

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

    fn bounds(&self, x: &[f64]) -> Vec<(f64, f64)> {
        Program::bounds(self, x)
    }

    fn bounds_jacobian(&self, x: &[f64]) -> Vec<BoundDerivative> {
        Program::bounds_jacobian(self, x)
    }

    fn tolerances(&self, x: &[f64]) -> Result<Vec<Option<f64>>, EvaluationError> {
        Ok(Program::tolerances(self, x)?)
    }

    fn instantiate<'a>(&'a self, x: &[f64]) -> Result<Box<dyn Instance + 'a>, EvaluationError> {
        Ok(Box::new(Program::instantiate(self, x)?))
    }
}

impl Instance for program::Instance<'_> {
    fn points(&self, patch: usize, u: &[f64], v: &[f64], out: &mut [[f64; 3]]) -> Result<(), EvaluationError> {
        Ok(program::Instance::points(self, patch, u, v, out.as_flattened_mut())?)
    }

    fn partials(&self, patch: usize, u: &[f64], v: &[f64], out: &mut [Partials]) -> Result<(), EvaluationError> {
        Ok(program::Instance::partials(self, patch, u, v, bytemuck::cast_slice_mut(out))?)
    }

    fn points_grid(&self, patch: usize, u: &[f64], v: &[f64], out: &mut [[f64; 3]]) -> Result<(), EvaluationError> {
        Ok(program::Instance::points_grid(self, patch, u, v, out.as_flattened_mut())?)
    }

    fn partials_grid(&self, patch: usize, u: &[f64], v: &[f64], out: &mut [Partials]) -> Result<(), EvaluationError> {
        Ok(program::Instance::partials_grid(self, patch, u, v, bytemuck::cast_slice_mut(out))?)
    }

    fn second_partials(
        &self,
        patch: usize,
        u: &[f64],
        v: &[f64],
        out: &mut [SecondPartials],
    ) -> Result<(), EvaluationError> {
        Ok(program::Instance::second_partials(self, patch, u, v, bytemuck::cast_slice_mut(out))?)
    }

    fn jacobian(&self, patch: usize, u: &[f64], v: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        Ok(program::Instance::jacobian(self, patch, u, v, out)?)
    }

    fn pullback(
        &self,
        patch: usize,
        u: &[f64],
        v: &[f64],
        w: &[[f64; 3]],
        gradient: &mut [f64],
    ) -> Result<(), EvaluationError> {
        Ok(program::Instance::pullback(self, patch, u, v, w, gradient)?)
    }
}
