//! A model as scalar functions: the result of the lowering.

use crate::ir::{FunctionId, Module};
use crate::parameters::{Input, Parameter};
use crate::source::Span;

/// A model as functions of its parameters' values (all Real, millimetres and radians, in order).
///
/// Calls are not inlined yet, and `'` is still [`Op::Tangent`](crate::ir::Op::Tangent).
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
    /// The conditions on the parameters, in order; they are checked before the parts are evaluated.
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
    /// `(the parameters that it uses.., u, v) -> (x, y, z)`. (If every part took all of them, the time for a model
    /// would grow with the square of its size.)
    pub surface: FunctionId,
    /// The indices of the parameters that `surface` takes, ascending.
    pub params: Vec<u32>,
    /// `(params..) -> length`, where the part has a tolerance of its own.
    pub tolerance: Option<FunctionId>,
    /// The place of its declaration.
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
    /// The indices of the parameters that `function` takes, ascending.
    pub params: Vec<u32>,
    /// The message where it does not hold.
    pub message: String,
    /// Its place in the source.
    pub span: Span,
}
