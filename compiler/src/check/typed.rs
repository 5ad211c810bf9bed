//! The typed tree: a model whose every name, type and call is resolved. It has no generics, no modules, no labels,
//! no defaults and no ranges that the compiler does not know the meaning of.
//!
//! Representation, for whoever lowers it: a value is a flat list of scalars. `Real` is one real; `Int` and `Bool` are
//! one int or bool *also where the value is known*; `Text` is nothing; `Range` is two ints; tuples, arrays and records
//! are their components in order; a closure is its captures in order (see [`Model::closures`]).
//!
//! Everything is pure, so an expression may be evaluated once, never, or twice.

pub use super::types::{ClosureId, Dimension, Type};
use crate::parameters::Quantity;
use crate::source::Span;

/// A local: a parameter, a capture, or a name bound by `let`. Unique in the whole model; index into [`Model::locals`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LocalId(pub u32);

/// Index of a function instance in [`Model::functions`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FunctionId(pub u32);

/// A checked model.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Its name.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Every local of the model and of all functions.
    pub locals: Vec<Local>,
    /// Layouts of function values.
    pub closures: Vec<Closure>,
    /// Function instances; a function stands after those that it calls, but for recursion.
    pub functions: Vec<Function>,
    /// The free parameters, in order.
    pub params: Vec<Param>,
    /// The inputs with the values that they have in this compilation (already constants in the tree).
    pub inputs: Vec<Input>,
    /// `let` and `require` of the model's body, in order. All parameters are bound before the first.
    pub body: Vec<Statement>,
    /// The named surfaces, in order.
    pub parts: Vec<Part>,
}

/// A local.
#[derive(Clone, Debug, PartialEq)]
pub struct Local {
    /// As written; for people.
    pub name: String,
    /// Its type.
    pub ty: Type,
    /// Where it is bound.
    pub span: Span,
}

/// The layout of a function value.
#[derive(Clone, Debug, PartialEq)]
pub struct Closure {
    /// For people: `bezier`, `|t|`, `outer'`.
    pub name: String,
    /// What it carries, in order.
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
    /// Whether it may call itself at run time, directly or through others.
    pub recursive: bool,
    /// Its derivative, where the author gave one.
    pub by_hand: Option<ByHand>,
    /// Where it is defined.
    pub span: Span,
}

/// A derivative by hand: a function of the captures and parameters of the one that it belongs to and, after them, of
/// the tangents of some parameters; what it gives is the tangent of the result.
#[derive(Clone, Debug)]
pub struct ByHand {
    /// The function.
    pub function: FunctionId,
    /// For each tangent the index of its parameter, ascending. The type of a tangent is that of its parameter with every
    /// int made a real; the tangent of an int is zero.
    pub params: Vec<usize>,
}

/// A free parameter.
#[derive(Clone, Debug)]
pub struct Param {
    /// Its name.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Real, length or angle.
    pub quantity: Quantity,
    /// Its value, bound from outside.
    pub local: LocalId,
    /// Lower bound; may use earlier parameters and `let`s of the body before it.
    pub lower: Option<Expr>,
    /// Upper bound likewise.
    pub upper: Option<Expr>,
    /// The default, in millimetres or radians.
    pub default: f64,
    /// The bounds where every parameter has its default; infinite where there is none.
    pub bounds: (f64, f64),
    /// Where it is declared.
    pub span: Span,
}

/// An input and its value in this compilation.
#[derive(Clone, Debug)]
pub struct Input {
    /// Its name.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// What it measures.
    pub quantity: Quantity,
    /// Its value; 0 or 1 for a bool.
    pub value: f64,
    /// Its bounds; infinite where there is none.
    pub bounds: (f64, f64),
    /// Where it is declared.
    pub span: Span,
}

/// A named surface.
#[derive(Clone, Debug)]
pub struct Part {
    /// `body`, `hole[2]`, `leg.shaft`.
    pub name: String,
    /// The name without an index: `hole`.
    pub group: String,
    /// Its doc comment.
    pub doc: String,
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
    /// Where it is declared.
    pub span: Span,
}

/// A statement.
#[derive(Clone, Debug)]
pub enum Statement {
    /// Binds a local.
    Let(LocalId, Expr),
    /// Evaluation fails with the message where the condition, a bool, does not hold.
    Require {
        /// What must hold.
        condition: Expr,
        /// What is said where it does not.
        message: String,
        /// Where it is written.
        span: Span,
    },
}

/// An expression.
#[derive(Clone, Debug)]
pub struct Expr {
    /// What it computes.
    pub kind: ExprKind,
    /// Its type.
    pub ty: Type,
    /// Where it comes from.
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
    /// One operand.
    Unary(Unary, Box<Expr>),
    /// Two operands.
    Binary(Binary, Box<Expr>, Box<Expr>),
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
    /// The partial derivative of a call's result in argument `wrt`, which is a real. Every scalar of the function's result
    /// is a real; the expression's type has the same shape.
    Derivative {
        /// The function and where.
        call: Call,
        /// Which argument.
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

    /// The call that it makes or derives.
    pub fn call_mut(&mut self) -> Option<&mut Call> {
        match &mut self.kind {
            ExprKind::Call(call) | ExprKind::Derivative { call, .. } => Some(call),
            _ => None,
        }
    }

    /// Visits the expressions directly within it, in the order of evaluation.
    pub fn for_each_child<'e>(&'e self, f: &mut dyn FnMut(&'e Expr)) {
        match &self.kind {
            ExprKind::Real(_) | ExprKind::Int(_) | ExprKind::Bool(_) | ExprKind::Text(_) | ExprKind::Local(_) => {}
            ExprKind::Convert(a) | ExprKind::Unary(_, a) | ExprKind::Element(a, _) => f(a),
            ExprKind::Binary(_, a, b) | ExprKind::Index(a, b) => {
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

    /// Visits the expressions directly within it, in the order of evaluation.
    pub fn for_each_child_mut(&mut self, f: &mut dyn FnMut(&mut Expr)) {
        match &mut self.kind {
            ExprKind::Real(_) | ExprKind::Int(_) | ExprKind::Bool(_) | ExprKind::Text(_) | ExprKind::Local(_) => {}
            ExprKind::Convert(a) | ExprKind::Unary(_, a) | ExprKind::Element(a, _) => f(a),
            ExprKind::Binary(_, a, b) | ExprKind::Index(a, b) => {
                f(a);
                f(b);
            }
            ExprKind::If(c, a, b) => {
                f(c);
                f(a);
                f(b);
            }
            ExprKind::Aggregate(items) => items.iter_mut().for_each(f),
            ExprKind::Block(statements, value) => {
                statements.iter_mut().for_each(|s| f(s.expr_mut()));
                f(value);
            }
            ExprKind::Call(call) | ExprKind::Derivative { call, .. } => {
                call.closure.iter_mut().for_each(|e| f(e));
                call.args.iter_mut().for_each(f);
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

    /// The value that is bound, or the condition.
    pub fn expr_mut(&mut self) -> &mut Expr {
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
    }

    /// Visits the outermost expressions: bounds, statements, parts. Functions are not among them.
    pub fn for_each_root_mut(&mut self, f: &mut dyn FnMut(&mut Expr)) {
        for param in &mut self.params {
            param.lower.iter_mut().chain(&mut param.upper).for_each(&mut *f);
        }
        self.body.iter_mut().for_each(|s| f(s.expr_mut()));
        for part in &mut self.parts {
            part.tolerance.iter_mut().for_each(&mut *f);
            f(&mut part.shape);
            f(&mut part.point);
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
    /// As many as the function has parameters, of exactly their types (but for known values of ints and bools).
    pub args: Vec<Expr>,
}

/// Operations of one operand. Of a tuple (also nested), `Neg` and `Stop` apply to every component.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "they are their names")]
pub enum Unary {
    /// Real or Int.
    Neg,
    /// Real or Int.
    Abs,
    /// Real; -1, 0 or 1.
    Sign,
    Sqrt,
    Exp,
    Ln,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    /// Real to Int: the next whole number below, saturating.
    Floor,
    /// Real to Int: the next whole number above.
    Ceil,
    /// Real to Int: half away from zero.
    Round,
    /// Real to Int: towards zero.
    Truncate,
    /// Real: the same value without a derivative.
    Stop,
    /// Bool.
    Not,
}

/// Operations of two operands. Both are Real, or both Int; or, for `Add` and `Sub`, both are tuples of the same shape
/// (elementwise); or, for `Mul`, one is a tuple and the other a Real, for `Div` the first is a tuple (each component with the Real). Tuples
/// contain only reals here. `And` and `Or` are written as `If`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "they are their names")]
pub enum Binary {
    Add,
    Sub,
    Mul,
    /// Real only.
    Div,
    /// With the divisor's sign; an int divisor of zero is a failure.
    Rem,
    /// Real base; the exponent is a Real, or an Int whose value is known.
    Pow,
    /// Real only.
    Atan2,
    Min,
    Max,
    Eq,
    Ne,
    Lt,
    Le,
    Gt,
    Ge,
}
