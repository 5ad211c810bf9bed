//! The typed tree: a model whose every name, type and call is resolved. It has no generics, no modules, no labels,
//! no defaults and no ranges that the compiler does not know the meaning of.
//!
//! Representation: a value is a flat list of scalars. `Real` is one real; `Int` and `Bool` are one int or bool *also
//! where the value is known*; `Text` is nothing; `Range` is two ints; tuples, arrays and records are their components
//! in order; a closure is its captures in order (see [`Model::closures`]).
//!
//! Everything is pure, so an expression may be evaluated once, never, or twice.

pub use super::types::{ClosureId, Dimension, Type};
pub use crate::operators::{Binary, Compare, Unary};
use crate::parameters::{Input, Parameter, PartFigure};
use crate::source::Span;
use std::collections::{BTreeMap, HashSet};
use std::hash::BuildHasher;

/// A local: a parameter, a capture, or a name bound by `let`. Unique in the whole model; index into [`Model::locals`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LocalId(pub u32);

/// A function instance of [`Model::functions`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FunctionId(pub u32);

/// A checked model.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Its name.
    pub name: String,
    /// Every local of the model and of all functions.
    pub locals: Vec<Local>,
    /// Layouts of function values.
    pub closures: Vec<Closure>,
    /// The function instances that it uses.
    pub functions: BTreeMap<FunctionId, Function>,
    /// The free parameters, in order.
    pub params: Vec<Param>,
    /// The inputs with the values that they have in this compilation (already constants in the tree).
    pub inputs: Vec<Input>,
    /// `let` and `require` of the model's body, in order. All parameters are bound before the first.
    pub body: Vec<Statement>,
    /// The named surfaces, in order.
    pub parts: Vec<Part>,
    /// The measures, in order.
    pub measures: Vec<Measure>,
    /// The figures of parts that they use.
    pub figures: Vec<TakenFigure>,
}

/// A local.
#[derive(Clone, Debug, PartialEq)]
pub struct Local {
    /// As written; for people.
    pub name: String,
    /// Its type.
    pub ty: Type,
    /// The place of its binding.
    pub span: Span,
}

/// The layout of a function value.
#[derive(Clone, Debug, PartialEq)]
pub struct Closure {
    /// For people: `bezier`, `|t|`, `outer'`.
    pub name: String,
    /// The captured values, in order.
    pub captures: Vec<(String, Type)>,
}

/// A function for certain argument types.
#[derive(Clone, Debug)]
pub struct Function {
    /// For people.
    pub name: String,
    /// Locals bound from the closure that is called, in the order of its captures; empty for named functions.
    pub captures: Vec<LocalId>,
    /// Locals bound from the arguments.
    pub params: Vec<LocalId>,
    /// The body; its type is the result's.
    pub body: Expr,
    /// Its derivative, where the author gave one.
    pub custom_derivative: Option<CustomDerivative>,
    /// The place of its definition.
    pub span: Span,
}

/// A custom derivative: a function of the captures and parameters of the one that it belongs to and, after them, of
/// the tangents of some parameters; what it gives is the tangent of the result.
#[derive(Clone, Debug)]
pub struct CustomDerivative {
    /// The function.
    pub function: FunctionId,
    /// For each tangent the index of its parameter, ascending. The type of a tangent is that of its parameter with
    /// every int made a real; the tangent of an int is zero.
    pub params: Vec<usize>,
}

/// A free parameter.
#[derive(Clone, Debug)]
pub struct Param {
    /// Name, quantity, default, and the bounds where every parameter has its default.
    pub declared: Parameter,
    /// Its value, bound from outside.
    pub local: LocalId,
    /// Lower bound; may use earlier parameters and `let`s of the body before it.
    pub lower: Option<Expr>,
    /// Upper bound likewise.
    pub upper: Option<Expr>,
}

/// A named surface.
#[derive(Clone, Debug)]
pub struct Part {
    /// `body`, `hole[2]`, `leg.shaft`.
    pub name: String,
    /// The name without an index: `hole`.
    pub group: String,
    /// The tolerance, a length, where one is given.
    pub tolerance: Option<Expr>,
    /// The surface as a function value: what it captured is the model's prelude.
    pub shape: Expr,
    /// Bound to `shape` in `point`.
    pub local: LocalId,
    /// Bound to the first surface parameter, a bare real in 0..1.
    pub u: LocalId,
    /// Bound to the second.
    pub v: LocalId,
    /// The point at (u, v): three lengths. Uses no locals but `local`, `u` and `v`.
    pub point: Expr,
    /// The place of its declaration.
    pub span: Span,
}

/// A value of the model's body that is reported.
#[derive(Clone, Debug)]
pub struct Measure {
    /// `rim_diameter`, `pitch[2]`.
    pub name: String,
    /// The name without an index: `pitch`.
    pub group: String,
    /// Its doc comment.
    pub doc: String,
    /// The names of the parts whose measured points show it.
    pub parts: Vec<String>,
    /// The dimension of its value.
    pub dimension: Dimension,
    /// The value, a real; uses parameters and `let`s of the body.
    pub value: Expr,
    /// The lower and the upper limit of what is allowed about the nominal value, of the same dimension.
    pub limits: Option<[Expr; 2]>,
    /// The place of its declaration.
    pub span: Span,
}

/// A figure of parts, which measures use.
#[derive(Clone, Debug)]
pub struct TakenFigure {
    /// The figure.
    pub declared: PartFigure,
    /// Its value, a real, bound from outside; only the values of measures use it.
    pub local: LocalId,
}

/// A statement.
#[derive(Clone, Debug)]
pub enum Statement {
    /// Binds a local.
    Let(LocalId, Expr),
    /// Evaluation fails with the message where the condition, a bool, does not hold.
    Require {
        /// The condition that must hold.
        condition: Expr,
        /// The message where it does not hold.
        message: String,
        /// The place of the statement.
        span: Span,
    },
}

/// An expression.
#[derive(Clone, Debug)]
pub struct Expr {
    /// The computation.
    pub kind: ExprKind,
    /// Its type.
    pub ty: Type,
    /// The place in the source.
    pub span: Span,
}

/// The kinds of expression.
#[derive(Clone, Debug)]
pub enum ExprKind {
    /// A constant in millimetres or radians.
    Real(f64),
    /// A constant. (Every int known while compiling has become one.)
    Int(i64),
    /// A constant.
    Bool(bool),
    /// A constant text, without representation.
    Text(String),
    /// A local.
    Local(LocalId),
    /// The same value in the expression's type, which has the same shape: ints become reals where the type has a real.
    Convert(Box<Expr>),
    /// One operand, a real where the operation does not say otherwise; of an int also `Neg` and `Abs`. Of a tuple (also
    /// nested), `Neg` and `Stop` apply to every component. `Floor`, `Ceil` and `Round` give an int; `ToReal` is written
    /// as `Convert`.
    Unary(Unary, Box<Expr>),
    /// Two operands. Both are reals, or both ints (not for `Div` and `Atan2`); the exponent of `Pow` may be a known
    /// int. For `Add` and `Sub` both may be tuples of one shape (elementwise); for `Mul` one may be a tuple and the
    /// other a real, for `Div` the first (each component with the real). Tuples contain only reals here. `And` and `Or`
    /// are written as `If`.
    Binary(Binary, Box<Expr>, Box<Expr>),
    /// A comparison of two reals or two ints.
    Compare(Compare, Box<Expr>, Box<Expr>),
    /// `if`; both sides have the expression's type.
    If(Box<Expr>, Box<Expr>, Box<Expr>),
    /// Makes a tuple, array, record, range or closure of its components.
    Aggregate(Vec<Expr>),
    /// Component k of a tuple, array, record or range.
    Element(Box<Expr>, usize),
    /// Element of an array at an int that is not known while compiling; outside of the array is a failure.
    Index(Box<Expr>, Box<Expr>),
    /// Statements, then the value.
    Block(Vec<Statement>, Box<Expr>),
    /// Calls a function.
    Call(Call),
    /// The partial derivative of a call's result in argument `wrt`, which is a real. Every scalar of the function's
    /// result is a real; the expression's type has the same shape.
    Derivative {
        /// The function and where.
        call: Call,
        /// The index of the argument.
        wrt: usize,
    },
    /// `accumulator = init; for index in from..to { accumulator = body }`; the value is the last accumulator.
    Fold {
        /// First index; an int.
        from: Box<Expr>,
        /// One past the last; an int. No turns where it is not greater than `from`.
        to: Box<Expr>,
        /// First value; of the expression's type, as `body`.
        init: Box<Expr>,
        /// The int bound in `body`.
        index: LocalId,
        /// The accumulator bound in `body`.
        accumulator: LocalId,
        /// The next value of the accumulator.
        body: Box<Expr>,
    },
}

impl Expr {
    /// The call that it makes or derives.
    #[must_use]
    pub fn call(&self) -> Option<&Call> {
        match &self.kind {
            ExprKind::Call(call) | ExprKind::Derivative { call, .. } => Some(call),
            _ => None,
        }
    }

    /// Visits the expressions directly within it, in the order of evaluation.
    pub fn for_each_child<'e>(&'e self, f: &mut dyn FnMut(&'e Expr)) {
        match &self.kind {
            ExprKind::Real(_) | ExprKind::Int(_) | ExprKind::Bool(_) | ExprKind::Text(_) | ExprKind::Local(_) => {}
            ExprKind::Convert(a) | ExprKind::Unary(_, a) | ExprKind::Element(a, _) => f(a),
            ExprKind::Binary(_, a, b) | ExprKind::Compare(_, a, b) | ExprKind::Index(a, b) => {
                f(a);
                f(b);
            }
            ExprKind::If(c, a, b) => {
                f(c);
                f(a);
                f(b);
            }
            ExprKind::Aggregate(items) => items.iter().for_each(f),
            ExprKind::Block(statements, value) => {
                statements.iter().for_each(|s| f(s.expr()));
                f(value);
            }
            ExprKind::Call(call) | ExprKind::Derivative { call, .. } => {
                call.closure.iter().for_each(|e| f(e));
                call.args.iter().for_each(f);
            }
            ExprKind::Fold { from, to, init, body, .. } => {
                f(from);
                f(to);
                f(init);
                f(body);
            }
        }
    }
}

impl Statement {
    /// The value that is bound, or the condition.
    #[must_use]
    pub fn expr(&self) -> &Expr {
        match self {
            Statement::Let(_, e) | Statement::Require { condition: e, .. } => e,
        }
    }
}

impl Model {
    /// Visits the outermost expressions: bounds, statements, parts. Functions are not among them.
    pub fn for_each_root<'m>(&'m self, f: &mut dyn FnMut(&'m Expr)) {
        for param in &self.params {
            param.lower.iter().chain(&param.upper).for_each(&mut *f);
        }
        self.body.iter().for_each(|s| f(s.expr()));
        for part in &self.parts {
            part.tolerance.iter().for_each(&mut *f);
            f(&part.shape);
            f(&part.point);
        }
        for measure in &self.measures {
            f(&measure.value);
            measure.limits.iter().flatten().for_each(&mut *f);
        }
    }
}

/// A call.
#[derive(Clone, Debug)]
pub struct Call {
    /// The function.
    pub function: FunctionId,
    /// The closure whose captures the function gets; `None` where it has none.
    pub closure: Option<Box<Expr>>,
    /// One for each parameter of the function, of exactly its type (but for known values of ints and bools).
    pub args: Vec<Expr>,
}

/// The `let`s among statements.
#[must_use]
pub fn lets(statements: &[Statement]) -> impl DoubleEndedIterator<Item = (LocalId, &Expr)> {
    statements.iter().filter_map(|statement| match statement {
        Statement::Let(local, value) => Some((*local, value)),
        _ => None,
    })
}

/// Of some `let`s those on which the values of the locals in `needed` depend, in their order. The locals that their
/// values use are added to `needed`.
#[must_use]
pub fn needed_lets<'t, S: BuildHasher>(
    lets: impl DoubleEndedIterator<Item = (LocalId, &'t Expr)>,
    needed: &mut HashSet<LocalId, S>,
) -> Vec<(LocalId, &'t Expr)> {
    let mut kept = Vec::new();
    for (local, value) in lets.rev() {
        if needed.contains(&local) {
            locals_in(value, needed);
            kept.push((local, value));
        }
    }
    kept.reverse();
    kept
}

/// Adds all locals that an expression uses.
pub fn locals_in<S: BuildHasher>(e: &Expr, out: &mut HashSet<LocalId, S>) {
    if let ExprKind::Local(id) = e.kind {
        out.insert(id);
    }
    e.for_each_child(&mut |child| locals_in(child, out));
}
