//! A model as scalar functions: the result of the lowering.

use crate::ir::{FunctionId, Module, ParameterFunction};
use crate::source::Span;

/// The functions of a model's parameters (all Real, millimetres and radians, in order).
///
/// Calls are not inlined yet, and `'` is still [`Op::Tangent`](crate::ir::Op::Tangent).
#[derive(Clone, Debug, Default)]
pub struct LoweredModel {
    /// All functions below, and those that they call.
    pub module: Module,
    /// The patches, in the order of the typed model's parts.
    pub parts: Vec<LoweredPart>,
    /// The measures, in the order of the typed model's.
    pub measures: Vec<LoweredMeasure>,
    /// `(params..) -> (lower, upper) of each parameter in order`; infinite constants where there is no bound.
    pub bounds: FunctionId,
    /// The conditions on the parameters, in order; they are checked before the parts are evaluated.
    pub requires: Vec<Requirement>,
}

/// A part.
#[derive(Clone, Debug)]
pub struct LoweredPart {
    /// `(some parameters.., u, v) -> (x, y, z)`.
    pub surface: ParameterFunction,
    /// `(params..) -> length`, where the part has a tolerance of its own.
    pub tolerance: Option<FunctionId>,
}

/// A measure.
#[derive(Clone, Debug)]
pub struct LoweredMeasure {
    /// `(params.., figures..) -> value`.
    pub value: FunctionId,
    /// The indices of the figures of parts that it takes, ascending.
    pub figures: Vec<u32>,
    /// `(params..) -> (lower, upper)`: what is allowed about the nominal value, where it has a tolerance.
    pub limits: Option<FunctionId>,
}

/// A condition of the model's body.
#[derive(Clone, Debug)]
pub struct Requirement {
    /// `(some parameters..) -> Bool`.
    pub condition: ParameterFunction,
    /// The message where it does not hold.
    pub message: String,
    /// Its place in the source.
    pub span: Span,
}
