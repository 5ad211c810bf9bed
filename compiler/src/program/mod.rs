//! A compiled script, as everything outside the compiler knows it.
//!
//! [`compile`] runs all stages. A [`Program`] then answers for any parameters x: their bounds, and an [`Instance`], whose
//! patches of surface are evaluated in batches, with derivatives.
//!
//! What the parts have in common is computed once for each x: the *prelude* takes the parameters to *captures*, and a
//! part's *body* takes captures, u and v to a point. The prelude is differentiated forward, sparsely; bodies whichever
//! way is cheaper (`derivatives`; what not everybody needs when it is first asked for: `on_demand`). All of it is machine code (`kernels`); where that meets a failure or a value
//! that is not finite, the interpreter goes the same way again to find the place in the source (`failure`).

mod bounds;
mod compile;
mod constants;
mod derivatives;
mod failure;
mod grids;
mod instance;
mod jacobians;
mod kernels;
mod limits;
mod on_demand;
mod on_grid;
mod probe;
#[cfg(test)]
mod tests;
mod text;
mod tolerances;

pub use bounds::BoundDerivative;
pub use compile::{Compilation, Failed, Options, Stage, compile, compile_observed};
pub use constants::check;
pub use failure::EvaluationError;
pub use instance::Instance;
pub use limits::{LIMITS, Limit, LimitError};
pub use on_grid::JacobianEntry;
pub use text::EmitStage;

pub use crate::parameters::{Input, Parameter, Part, Quantity};

pub(crate) use compile::{build_model, derivative_error};
pub(crate) use constants::constants;
pub(crate) use failure::shown as shown_parameter;

use crate::check::typed;
use crate::ir::interpret;
use crate::jit::Limits;
use crate::source::Sources;
use derivatives::ModelFunctions;
use grids::Grids;
use kernels::Kernels;
use on_demand::{Derivative, OnDemand};

/// A compiled script: a model as machine code, with its derivatives. Freed when dropped; may be used by several
/// threads at once.
pub struct Program {
    name: String,
    doc: String,
    parameters: Vec<Parameter>,
    inputs: Vec<Input>,
    parts: Vec<Part>,
    sources: Sources,
    typed: typed::Model,
    functions: ModelFunctions,
    kernels: Kernels,
    derived: OnDemand,
    grids: Grids,
    limits: Limits,
}

impl Program {
    /// The model's name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The model's doc comment.
    #[must_use]
    pub fn doc(&self) -> &str {
        &self.doc
    }

    /// The free parameters, in order.
    #[must_use]
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// The inputs with the values that it was compiled with.
    #[must_use]
    pub fn inputs(&self) -> &[Input] {
        &self.inputs
    }

    /// The patches of surface, in order.
    #[must_use]
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// The defaults of all parameters.
    #[must_use]
    pub fn defaults(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.default).collect()
    }

    /// Makes the derivatives that are otherwise made when they are first asked for: partials, second partials, pullbacks.
    ///
    /// # Errors
    /// If one is too large.
    pub fn prepare(&self) -> Result<(), EvaluationError> {
        for derivative in Derivative::ALL {
            self.derived.get(&self.functions, derivative).map_err(|e| self.not_made(derivative, e))?;
        }
        Ok(())
    }

    /// The model at x.
    ///
    /// # Errors
    /// If a `require` does not hold, a limit is met, or something cannot be computed.
    ///
    /// # Panics
    /// If x does not have a value for every parameter.
    pub fn instantiate(&self, x: &[f64]) -> Result<Instance<'_>, EvaluationError> {
        Instance::new(self, x)
    }

    /// Limits for a replay by the interpreter, which counts every operation as a step.
    fn replay_limits(&self) -> interpret::Limits {
        interpret::Limits { depth: self.limits.depth as usize, ..interpret::Limits::default() }
    }
}
