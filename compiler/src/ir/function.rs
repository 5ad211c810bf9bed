//! The intermediate representation: pure scalar functions in SSA form with structured control flow.
//!
//! A function is a list of nodes in which operands come before their uses. Nodes have no side effects, so a node may be
//! merged with an equal one, moved or dropped. Branches and loops are nodes that name *functions* for their bodies: the
//! values that a body uses from outside are arguments, like those of the blocks in SSA with block arguments, and every
//! pass is written for functions only. The lowering has split points, arrays, tuples and closures into scalars.

use super::size::SizeLimits;
use crate::operators::{Binary, Compare, Unary};
use crate::source::Span;
use std::collections::BTreeMap;

/// A value: the index of the node that computes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Value(pub u32);

impl Value {
    /// Stands for the image of a node that a pass leaves out; no node of a finished function uses it.
    pub const NONE: Value = Value(u32::MAX);
}

/// Index of a function in its [`Module`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FunctionId(pub u32);

/// Index of a failure in its [`Module`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FailureId(pub u32);

/// The type of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Type {
    /// IEEE double.
    Real,
    /// Signed 64-bit integer; arithmetic wraps (the lowering guards what must not).
    Int,
    /// Truth value.
    Bool,
    /// Several values; only [`Op::Project`] may use them.
    Multi,
}

/// A program's functions and failures.
#[derive(Clone, Debug, Default)]
pub struct Module {
    /// A function names only functions of its module; recursion goes through [`Op::Call`] alone.
    pub functions: Vec<Function>,
    /// The failures that [`Op::Guard`] may report.
    pub failures: Vec<Failure>,
    /// Functions whose derivative is given and not that of their operations. They are never inlined: their operations
    /// would be differentiated.
    pub custom_derivatives: BTreeMap<FunctionId, CustomDerivative>,
    /// Bounds on its growth by inlining and differentiation.
    pub limits: SizeLimits,
}

/// A derivative that a script gives for a function f(p..) -> r..: a function `(p.., tangents..) -> dr..`, linear in the
/// tangents. All results are Real. (The custom JVP rule of other systems; the VJP is its transpose.)
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CustomDerivative {
    /// The function.
    pub function: FunctionId,
    /// For each tangent the parameter of f to which it belongs; `None` for a tangent that is always zero.
    pub tangents: Vec<Option<u32>>,
}

/// The report of a guard that fails.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// The place in the source.
    pub span: Span,
    /// A sentence in the user's words, without a full stop.
    pub message: String,
}

/// A function.
#[derive(Clone, Debug, Default)]
pub struct Function {
    /// For people; need not be unique.
    pub name: String,
    /// Names of the parameters. Node i is `Op::Param(i)` for every parameter i.
    pub params: Vec<Parameter>,
    /// The nodes; an operand's index is lower than its user's.
    pub nodes: Vec<Node>,
    /// The values that it returns.
    pub results: Vec<Value>,
    /// Names of the results, for people; as many as results.
    pub result_names: Vec<String>,
}

/// A function of some of the model's parameters, all Real, and then of other arguments. (If every function took all
/// of them, the time for a model would grow with the square of its size.)
#[derive(Clone, Debug)]
pub struct ParameterFunction {
    /// The function.
    pub function: FunctionId,
    /// The indices of the model's parameters that it takes, ascending.
    pub params: Vec<u32>,
}

impl ParameterFunction {
    /// Its arguments at the model's parameters x.
    #[must_use]
    pub fn arguments<T: Copy>(&self, x: &[T], others: &[T]) -> Vec<T> {
        self.params.iter().map(|i| x[*i as usize]).chain(others.iter().copied()).collect()
    }
}

/// A parameter of a function.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// For people.
    pub name: String,
    /// Never `Multi`.
    pub ty: Type,
}

/// A node.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// The operation that computes it.
    pub op: Op,
    /// The type of its value.
    pub ty: Type,
    /// The place in the source that it comes from; merged nodes keep the first one.
    pub span: Span,
}

/// An operation. Reals are compared by their bits, so that equal operations can be found by hashing.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Op {
    /// The function's parameter of that index.
    Param(u32),
    /// A constant, as `f64::to_bits`.
    Real(u64),
    /// A constant.
    Int(i64),
    /// A constant.
    Bool(bool),
    /// One operand.
    Unary(Unary, Value),
    /// Two operands.
    Binary(Binary, Value, Value),
    /// Real to a constant integer power, by multiplication; 0^0 = 1.
    PowInt(Value, i32),
    /// Two operands of type Real or Int; the result is Bool.
    Compare(Compare, Value, Value),
    /// `if condition { a } else { b }` where computing both is harmless.
    Select(Value, Value, Value),
    /// Runs one of two functions on the same arguments; they return the same types.
    If {
        /// Decides which one runs.
        condition: Value,
        /// Runs where the condition holds.
        then: FunctionId,
        /// Runs where the condition does not hold.
        otherwise: FunctionId,
        /// The arguments of either.
        args: Vec<Value>,
    },
    /// `carried = init; for i in 0..count { carried = body(i, carried.., invariant..) }`; none where count <= 0.
    Loop {
        /// The number of iterations; Int.
        count: Value,
        /// `(i: Int, carried.., invariant..) -> carried..`
        body: FunctionId,
        /// The first values of what is carried.
        init: Vec<Value>,
        /// Arguments that are the same in every iteration.
        invariant: Vec<Value>,
    },
    /// Runs a function.
    Call {
        /// The callee.
        function: FunctionId,
        /// Its arguments.
        args: Vec<Value>,
    },
    /// The directional derivative of a function: its results' tangents for the given tangents of some of its (Real)
    /// parameters, at `args`. All of its results are Real: one for each result of the function, 0 for those that are
    /// not. From the `'` of the language; `diff` replaces it before anything is run.
    Tangent {
        /// The function that is differentiated.
        function: FunctionId,
        /// The point at which it is differentiated.
        args: Vec<Value>,
        /// Parameter indices, ascending, with the tangent of each; the others' are zero.
        seeds: Vec<(u32, Value)>,
    },
    /// Result k of an `If`, `Loop`, `Call` or `Tangent`.
    Project(Value, u32),
    /// The value, where the condition holds; else the evaluation ends with the failure.
    Guard {
        /// The value that is returned.
        value: Value,
        /// The condition that must hold.
        condition: Value,
        /// The failure that is reported otherwise.
        failure: FailureId,
    },
}
