//! A compiled script, as everything outside the compiler knows it.
//!
//! [`compile`] runs all stages. A [`Program`] then answers for any parameters x: their bounds, and an [`Instance`],
//! whose patches of surface are evaluated in batches, with derivatives.
//!
//! Values that depend on x alone are computed once for each x: the *prelude* takes the parameters to *captures*, and a
//! part's *body* takes captures, u and v to a point. The prelude is differentiated forward, sparsely; bodies whichever
//! way is cheaper. `pipeline` has all stages on one page; what not everybody needs is made when it is first asked for
//! (`evaluators`). All of it is machine code; where that meets a failure or a value that is not finite, the interpreter
//! goes the same way again to find the place in the source (`failure`).

mod bounds;
mod compile;
mod constants;
mod evaluators;
mod failure;
mod functions;
mod instance;
mod jacobians;
mod limits;
mod measures;
mod pipeline;
mod probe;
mod sites;
#[cfg(test)]
mod tests;
mod text;
mod tolerances;

pub use bounds::BoundDerivative;
pub use compile::{Compilation, Failed, Options, Stage, compile, compile_observed};
pub use constants::check;
pub use failure::EvaluationError;
pub use instance::Instance;
pub use limits::LimitError;
pub use sites::{Order, Sites};
pub use text::EmitStage;

pub use crate::jit::{Limits, Trap};
pub use crate::parameters::{Figure, Input, Measure, Parameter, Part, PartFigure, Quantity};

pub(crate) use compile::build_model;
pub(crate) use constants::constants;

use crate::check::typed;
use crate::ir::interpret;
use crate::jit::Code;
use crate::source::{Sources, Span};
use evaluators::Evaluators;
use functions::ModelFunctions;
use std::sync::Arc;

/// A compiled script: a model as machine code, with its derivatives. Freed when dropped; may be used by several
/// threads at once.
pub struct Program {
    parameters: Vec<Parameter>,
    /// The parts, and behind them the functions of where the trimmed ones are there.
    patches: Vec<Part>,
    measures: Vec<Measure>,
    /// The figures of parts that the measures use.
    figures: Vec<PartFigure>,
    sources: Sources,
    typed: typed::Model,
    functions: ModelFunctions,
    /// The code of [`ModelFunctions::routines`].
    routines: Arc<Code>,
    evaluators: Evaluators,
    limits: Limits,
}

impl Program {
    /// The model's name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.typed.name
    }

    /// The free parameters, in order.
    #[must_use]
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// The inputs with the values that it was compiled with.
    #[must_use]
    pub fn inputs(&self) -> &[Input] {
        &self.typed.inputs
    }

    /// The files that it was compiled from.
    #[must_use]
    pub fn sources(&self) -> &Sources {
        &self.sources
    }

    /// The patches of surface, in order.
    #[must_use]
    pub fn parts(&self) -> &[Part] {
        &self.patches[..self.typed.parts.len()]
    }

    /// The patch behind the parts whose first coordinate says where a part is there, if it is trimmed: it is there
    /// where that is positive. The other coordinates are 0.
    #[must_use]
    pub fn keep(&self, part: usize) -> Option<usize> {
        let trim = self.functions.trimmed.binary_search(&part).ok()?;
        Some(self.typed.parts.len() + trim)
    }

    /// The parameters that the function of where a part is there depends on, ascending; none if it is not trimmed.
    #[must_use]
    pub fn keep_active(&self, part: usize) -> &[u32] {
        self.keep(part).map_or(&[], |keep| &self.patches[keep].active)
    }

    /// The defaults of all parameters.
    #[must_use]
    pub fn defaults(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.default).collect()
    }

    /// Makes what is otherwise made when it is first asked for: partials, second partials, pullbacks, decisions.
    ///
    /// # Errors
    /// If one is too large.
    pub fn prepare(&self) -> Result<(), EvaluationError> {
        for order in Order::ALL {
            self.evaluators.get(&self.functions, false, order).map_err(|e| self.not_made(false, order, e))?;
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

    /// Where a part stands in its script; also that of which a patch behind them says where it is there.
    ///
    /// # Panics
    /// If there is no such patch.
    #[must_use]
    pub fn part_span(&self, part: usize) -> Span {
        let part = part.checked_sub(self.typed.parts.len()).map_or(part, |trim| self.functions.trimmed[trim]);
        self.typed.parts[part].span
    }

    /// Limits for a replay by the interpreter, which counts every operation as a step.
    fn replay_limits(&self) -> interpret::Limits {
        interpret::Limits { depth: self.limits.depth as usize, ..interpret::Limits::default() }
    }
}
