//! A model as scalar functions: what the lowering hands to everything after it.

use super::{FunctionId, Module};
use crate::program::{Input, Parameter};
use crate::source::Span;

/// A model as functions of its parameters' values (all Real, millimetres and radians, in order).
///
/// Calls are not inlined yet, and `'` is still [`Op::Tangent`](super::Op::Tangent).
#[derive(Clone, Debug, Default)]
pub struct LoweredModel {
    /// Its name.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// All functions below, and those that they call.
    pub module: Module,
    /// The free parameters, in order.
    pub params: Vec<Parameter>,
    /// The inputs with the values that they were compiled with (constants in the functions).
    pub inputs: Vec<Input>,
    /// The patches, in order.
    pub parts: Vec<LoweredPart>,
    /// `(params..) -> (lower, upper) of each parameter in order`; infinite constants where there is no bound.
    pub bounds: FunctionId,
    /// What must hold of the parameters, in order; to be tried before the parts are evaluated.
    pub requires: Vec<LoweredRequire>,
}

/// A part.
#[derive(Clone, Debug)]
pub struct LoweredPart {
    /// `body`, `hole[2]`, `leg.shaft`.
    pub name: String,
    /// The name without an index: `hole`.
    pub group: String,
    /// Its doc comment.
    pub doc: String,
    /// `(the parameters that it uses.., u, v) -> (x, y, z)`. (If every part took all of them, large models would take time
    /// with the square of their size.)
    pub surface: FunctionId,
    /// Which parameters `surface` takes, ascending.
    pub params: Vec<u32>,
    /// `(params..) -> length`, where the part has a tolerance of its own.
    pub tolerance: Option<FunctionId>,
    /// Where it is declared.
    pub span: Span,
}

impl LoweredRequire {
    /// The arguments of `function` at the model's parameters x.
    #[must_use]
    pub fn arguments<T: Copy>(&self, x: &[T]) -> Vec<T> {
        self.params.iter().map(|i| x[*i as usize]).collect()
    }
}

impl LoweredPart {
    /// The arguments of `surface` at the model's parameters x.
    #[must_use]
    pub fn arguments<T: Copy>(&self, x: &[T], uv: [T; 2]) -> Vec<T> {
        self.params.iter().map(|i| x[*i as usize]).chain(uv).collect()
    }
}

/// A condition of the model's body.
#[derive(Clone, Debug)]
pub struct LoweredRequire {
    /// `(the parameters that it uses..) -> Bool`.
    pub function: FunctionId,
    /// Which parameters `function` takes, ascending.
    pub params: Vec<u32>,
    /// What is said where it does not hold.
    pub message: String,
    /// Where it is written.
    pub span: Span,
}
