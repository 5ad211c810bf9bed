//! The syntax tree: the text as written, with spans. Names and types are not resolved.

pub use super::tolerance::{Limit, Sign, Tolerance};
use crate::operators::Compare;
use crate::source::Span;

/// A name as written.
#[derive(Clone, Debug, PartialEq)]
pub struct Ident {
    /// The text.
    pub text: String,
    /// Its place.
    pub span: Span,
}

/// A whole file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct File {
    /// Top-level items in the order in which they are written.
    pub items: Vec<Item>,
    /// Names that unreadable statements most likely declare: uses of them are not reported as unknown.
    pub unread: Vec<String>,
}

/// A top-level item, or an item of a model's body.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// Text of the `///` lines before it, without the slashes, lines joined by `\n`.
    pub doc: String,
    /// From its first keyword to its end, without the doc comment.
    pub span: Span,
    /// Its kind, with the parts.
    pub kind: ItemKind,
    /// Levels of the tree from here down.
    pub(crate) depth: u32,
}

impl Item {
    /// An item that could not be parsed.
    pub(super) fn error(span: Span) -> Self {
        Self { doc: String::new(), span, kind: ItemKind::Error, depth: 1 }
    }

    /// The names that it defines.
    pub(crate) fn names(&self) -> Vec<&Ident> {
        match &self.kind {
            ItemKind::Function(decl) => vec![&decl.name],
            ItemKind::Model(decl) => vec![&decl.name],
            ItemKind::Param(decl) | ItemKind::Input(decl) => vec![&decl.name],
            ItemKind::Part(decl) => vec![&decl.name],
            ItemKind::Measure(decl) => vec![&decl.name],
            ItemKind::Let(decl) => decl.pattern.names(),
            _ => Vec::new(),
        }
    }

    /// Whether it defines a name.
    pub(crate) fn defines(&self, name: &str) -> bool {
        self.names().iter().any(|n| n.text == name)
    }
}

/// The kinds of item. The top level has `use`, `fn`, `deriv`, `let` and `model`; a model has all but `use` and `model`.
#[derive(Clone, Debug, PartialEq)]
pub enum ItemKind {
    /// `use std.curve (bezier, line)`, `use std.curve`, `use "other.gml" (name)`.
    Use(Use),
    /// `fn f(x: real, n = 3) -> real = expr` or with a block body.
    Function(FunctionDecl),
    /// `deriv f(x; dx) { ... }`.
    Derivative(DerivativeDecl),
    /// `let pattern: type = expr`.
    Let(Let),
    /// `model name { ... }`.
    Model(Model),
    /// `param name: type in lo..hi = default`.
    Param(ParamDecl),
    /// `input name: type in lo..hi = default`.
    Input(ParamDecl),
    /// `part name = shape`, with an optional `tolerance expr` after the name.
    Part(PartDecl),
    /// `measure name = value`, with an optional `of parts` and `tolerance limits` after the name.
    Measure(MeasureDecl),
    /// `require condition, "message"`.
    Require(Require),
    /// `for pattern in iterable { items }` in a model's body.
    For(ForItems),
    /// `if condition { items } else { items }` in a model's body.
    If(IfItems),
    /// An item that could not be parsed; a diagnostic says why.
    Error,
}

/// A `use`: a module, or names of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Use {
    /// The module.
    pub path: UsePath,
    /// The names in parentheses; `None` where the whole module is meant.
    pub names: Option<Vec<Ident>>,
}

/// A module of the standard library by its dotted name, or a file by its path.
#[derive(Clone, Debug, PartialEq)]
pub enum UsePath {
    /// `std.curve`: the parts.
    Module(Vec<Ident>),
    /// `"column.gml"`.
    File(String, Span),
}

/// A function.
#[derive(Clone, Debug, PartialEq)]
pub struct FunctionDecl {
    /// Its name.
    pub name: Ident,
    /// Its parameters.
    pub params: Vec<FnParam>,
    /// The annotated result type.
    pub result: Option<TypeExpr>,
    /// The body; a block for `{ ... }`.
    pub body: Expr,
}

/// A parameter of a function or lambda.
#[derive(Clone, Debug, PartialEq)]
pub struct FnParam {
    /// Its name, which is also its label; a tuple pattern only in lambdas and `let`.
    pub pattern: Pattern,
    /// The annotated type.
    pub ty: Option<TypeExpr>,
    /// The default.
    pub default: Option<Expr>,
}

/// The left side of a binding.
#[derive(Clone, Debug, PartialEq)]
pub enum Pattern {
    /// One name; `_` binds nothing.
    Name(Ident),
    /// `(a, b)`.
    Tuple(Vec<Pattern>, Span),
}

impl Pattern {
    /// Its place.
    pub(crate) fn span(&self) -> Span {
        match self {
            Pattern::Name(name) => name.span,
            Pattern::Tuple(_, span) => *span,
        }
    }

    /// The name, where it is one name.
    pub(crate) fn name(&self) -> Option<&Ident> {
        match self {
            Pattern::Name(name) => Some(name),
            Pattern::Tuple(..) => None,
        }
    }

    /// All of its names, in order.
    pub(crate) fn names(&self) -> Vec<&Ident> {
        match self {
            Pattern::Name(name) => vec![name],
            Pattern::Tuple(patterns, _) => patterns.iter().flat_map(Pattern::names).collect(),
        }
    }
}

/// A custom derivative: `deriv norm(v; dv) { ... }`.
#[derive(Clone, Debug, PartialEq)]
pub struct DerivativeDecl {
    /// The function that it belongs to.
    pub function: Ident,
    /// Names of the function's arguments.
    pub params: Vec<Ident>,
    /// Names of their tangents.
    pub tangents: Vec<Ident>,
    /// The tangent of the result.
    pub body: Expr,
}

/// A binding.
#[derive(Clone, Debug, PartialEq)]
pub struct Let {
    /// The names.
    pub pattern: Pattern,
    /// The annotated type.
    pub ty: Option<TypeExpr>,
    /// The value.
    pub value: Expr,
}

/// A model.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Its name.
    pub name: Ident,
    /// Its body.
    pub items: Vec<Item>,
}

/// A `param` or `input`.
#[derive(Clone, Debug, PartialEq)]
pub struct ParamDecl {
    /// Its name.
    pub name: Ident,
    /// Its type.
    pub ty: TypeExpr,
    /// Its bounds.
    pub bounds: Option<(Expr, Expr)>,
    /// Its default.
    pub default: Option<Expr>,
}

/// A `part`.
#[derive(Clone, Debug, PartialEq)]
pub struct PartDecl {
    /// Its name.
    pub name: Ident,
    /// Its tolerance.
    pub tolerance: Option<Expr>,
    /// Its shape.
    pub shape: Expr,
}

/// A `measure`.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasureDecl {
    /// Its name.
    pub name: Ident,
    /// The parts whose measured points show it, too.
    pub parts: Vec<PartPath>,
    /// Its tolerance.
    pub tolerance: Option<Tolerance>,
    /// The value that is measured.
    pub value: Expr,
}

/// The name of a part, with fields and indices: `bore`, `shell.wall`, `hole[2]`.
#[derive(Clone, Debug, PartialEq)]
pub struct PartPath {
    /// The first name.
    pub name: Ident,
    /// All of it, without white space.
    pub text: String,
    /// Its place.
    pub span: Span,
}

/// A `require`.
#[derive(Clone, Debug, PartialEq)]
pub struct Require {
    /// The condition that must hold.
    pub condition: Expr,
    /// The message for the case that it does not hold.
    pub message: Option<String>,
}

/// `for` over items of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct ForItems {
    /// Bound to each element.
    pub pattern: Pattern,
    /// A range or an array.
    pub iterable: Expr,
    /// The repeated items.
    pub items: Vec<Item>,
}

/// `if` over items of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct IfItems {
    /// Known at compile time (it depends on inputs only).
    pub condition: Expr,
    /// The items if it holds.
    pub then: Vec<Item>,
    /// The items if it does not.
    pub otherwise: Vec<Item>,
}

/// A type annotation.
#[derive(Clone, Debug, PartialEq)]
pub struct TypeExpr {
    /// Its place.
    pub span: Span,
    /// Its kind, with the parts.
    pub kind: TypeKind,
    /// Levels of the tree from here down.
    pub(crate) depth: u32,
}

/// The kinds of type annotation.
#[derive(Clone, Debug, PartialEq)]
pub enum TypeKind {
    /// `real`, `length`, `point3`, `surface`, ...
    Name(String),
    /// `length ^ 2`.
    Power(Box<TypeExpr>, i32),
    /// `(real, real)`.
    Tuple(Vec<TypeExpr>),
    /// `[point3]`.
    Array(Box<TypeExpr>),
    /// `real -> point3`, `(real, real) -> point3`.
    Function(Vec<TypeExpr>, Box<TypeExpr>),
    /// Could not be parsed.
    Error,
}

/// An expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Expr {
    /// Its place.
    pub span: Span,
    /// Its kind, with the parts.
    pub kind: ExprKind,
    /// Levels of the tree from here down.
    pub(crate) depth: u32,
}

impl Expr {
    /// An expression that could not be parsed.
    pub(super) fn error(span: Span) -> Self {
        Self { span, kind: ExprKind::Error, depth: 1 }
    }
}

/// A unit written after a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Unit {
    /// Millimetre, the unit of length inside.
    Mm,
    /// Centimetre.
    Cm,
    /// Metre.
    M,
    /// Inch.
    In,
    /// Degree.
    Deg,
    /// Radian, the unit of angle inside.
    Rad,
    /// Full turn.
    Turn,
}

/// The kinds of expression.
#[derive(Clone, Debug, PartialEq)]
pub enum ExprKind {
    /// `3`: an integer without a unit.
    Int(i64),
    /// `0.5`, `3mm`, `1e-3m`: the number as written (not scaled by its unit).
    Real(f64, Option<Unit>),
    /// `true`, `false`.
    Bool(bool),
    /// `"text"`.
    Text(String),
    /// A name.
    Name(String),
    /// `(a, b)`; never of one element.
    Tuple(Vec<Expr>),
    /// `[a, b]`.
    Array(Vec<Expr>),
    /// `{a: 1, b: 2}`: a record. At least one field.
    Record(Vec<(Ident, Expr)>),
    /// `-a`, `not a`.
    Unary(UnaryOp, Box<Expr>),
    /// `a + b`, ...
    Binary(BinaryOp, Box<Expr>, Box<Expr>),
    /// `a..b`: from a up to but without b.
    Range(Box<Expr>, Box<Expr>),
    /// `f(a, label: b)`.
    Call(Box<Expr>, Vec<Arg>),
    /// `a.f(b)`.
    Method(Box<Expr>, Ident, Vec<Arg>),
    /// `a.x`.
    Field(Box<Expr>, Ident),
    /// `a[i]`.
    Index(Box<Expr>, Box<Expr>),
    /// `c'` (one prime a node; `c''` nests) and `s'u` (the partial derivative in the argument named u).
    Prime(Box<Expr>, Option<Ident>),
    /// `|t, (a, b)| body`.
    Lambda(Vec<FnParam>, Box<Expr>),
    /// `if c { a } else { b }`; `else if` nests. Without `else` it is an error that the checker reports.
    If(Box<Expr>, Box<Expr>, Option<Box<Expr>>),
    /// `for i in 0..n { body }`: a comprehension.
    For(Pattern, Box<Expr>, Box<Expr>),
    /// `{ let a = 1; a + 2 }`: items that may be `let`, `fn`, `deriv` and `require`, and the last expression.
    Block(Vec<Item>, Option<Box<Expr>>),
    /// Could not be parsed; a diagnostic says why.
    Error,
}

/// An argument of a call.
#[derive(Clone, Debug, PartialEq)]
pub struct Arg {
    /// Its label.
    pub label: Option<Ident>,
    /// Its value.
    pub value: Expr,
}

/// Prefix operators.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum UnaryOp {
    /// `-`
    Neg,
    /// `not`
    Not,
}

/// Infix operators but for `..`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "they are their names")]
pub enum BinaryOp {
    Add,
    Sub,
    Mul,
    Div,
    Rem,
    Pow,
    /// `&`: what two solids have in common.
    Common,
    Compare(Compare),
    And,
    Or,
}
