//! Built-in functions: only those that cannot be written in the language.

use super::constants::constant;
use super::context::{Checker, error, int};
use super::convert::{exponent_error, square_root};
use super::edges::Blend;
use super::operators::{binary, common, unary};
use super::typed::{Binary, Expr, ExprKind, Type, Unary};
use super::types::Dimension;
use crate::diagnostic::{Code, Diagnostic};
use crate::source::Span;

/// A built-in function.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Builtin {
    /// Bare number to bare number.
    Plain(Unary),
    /// Angle to bare number.
    OfAngle(Unary),
    /// Bare number to angle.
    ToAngle(Unary),
    Sqrt,
    Abs,
    Sign,
    Atan2,
    Min,
    Max,
    /// Bare number to whole number.
    Rounded(Unary),
    Real,
    Stop,
    Len,
    Fold,
    Loop,
    Sum,
    Each,
    EachSolid,
    Arity,
    Keep,
    Solid,
    Inside,
    Sides,
    /// Of edges that are named.
    Blend(Blend),
    SvgPath,
    Glyphs,
    /// Of finished parts, in measures.
    OfParts(OfParts),
}

/// The figures of parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum OfParts {
    Area,
    Volume,
    Centroid,
    LeastDistance,
    FaceAngle,
}

impl OfParts {
    /// Whether it is between parts and others.
    pub(super) fn is_between(self) -> bool {
        matches!(self, OfParts::LeastDistance | OfParts::FaceAngle)
    }
}

/// Name, function, names of its parameters.
const TABLE: &[(&str, Builtin, &[&str])] = &[
    ("sqrt", Builtin::Sqrt, &["x"]),
    ("exp", Builtin::Plain(Unary::Exp), &["x"]),
    ("ln", Builtin::Plain(Unary::Ln), &["x"]),
    ("sin", Builtin::OfAngle(Unary::Sin), &["angle"]),
    ("cos", Builtin::OfAngle(Unary::Cos), &["angle"]),
    ("tan", Builtin::OfAngle(Unary::Tan), &["angle"]),
    ("asin", Builtin::ToAngle(Unary::Asin), &["x"]),
    ("acos", Builtin::ToAngle(Unary::Acos), &["x"]),
    ("atan", Builtin::ToAngle(Unary::Atan), &["x"]),
    ("atan2", Builtin::Atan2, &["y", "x"]),
    ("sinh", Builtin::Plain(Unary::Sinh), &["x"]),
    ("cosh", Builtin::Plain(Unary::Cosh), &["x"]),
    ("tanh", Builtin::Plain(Unary::Tanh), &["x"]),
    ("abs", Builtin::Abs, &["x"]),
    ("sign", Builtin::Sign, &["x"]),
    ("min", Builtin::Min, &["a", "b"]),
    ("max", Builtin::Max, &["a", "b"]),
    ("floor", Builtin::Rounded(Unary::Floor), &["x"]),
    ("ceil", Builtin::Rounded(Unary::Ceil), &["x"]),
    ("round", Builtin::Rounded(Unary::Round), &["x"]),
    ("int", Builtin::Rounded(Unary::ToInt), &["x"]),
    ("real", Builtin::Real, &["x"]),
    ("stop", Builtin::Stop, &["x"]),
    ("len", Builtin::Len, &["xs"]),
    ("fold", Builtin::Fold, &["init", "xs", "f"]),
    ("loop", Builtin::Loop, &["init", "count", "f"]),
    ("sum", Builtin::Sum, &["xs"]),
    ("each", Builtin::Each, &["shape", "f"]),
    ("each_solid", Builtin::EachSolid, &["shape", "f", "of_inside"]),
    ("keep", Builtin::Keep, &["point", "where"]),
    ("solid", Builtin::Solid, &["surfaces", "inside", "sides"]),
    ("inside", Builtin::Inside, &["solid"]),
    ("sides", Builtin::Sides, &["solid"]),
    ("fillet", Builtin::Blend(Blend::Fillet), &["body", "first", "second", "radius"]),
    ("chamfer", Builtin::Blend(Blend::Chamfer), &["body", "first", "second", "size"]),
    ("arity", Builtin::Arity, &["f"]),
    ("svg_path", Builtin::SvgPath, &["path", "tolerance"]),
    ("glyphs", Builtin::Glyphs, &["text", "font"]),
    ("area", Builtin::OfParts(OfParts::Area), &["part"]),
    ("volume", Builtin::OfParts(OfParts::Volume), &["part"]),
    ("centroid", Builtin::OfParts(OfParts::Centroid), &["part"]),
    ("least_distance", Builtin::OfParts(OfParts::LeastDistance), &["part", "other"]),
    ("face_angle", Builtin::OfParts(OfParts::FaceAngle), &["part", "other"]),
];

/// The value of a built-in constant.
pub(super) fn constant_named(name: &str, span: Span) -> Option<Expr> {
    let value = match name {
        "pi" => std::f64::consts::PI,
        "tau" => std::f64::consts::TAU,
        _ => return None,
    };
    Some(Expr { kind: ExprKind::Real(value), ty: Type::ANGLE, span })
}

/// All names that are built in.
pub(crate) fn names() -> impl Iterator<Item = &'static str> {
    TABLE.iter().map(|(name, ..)| *name).chain(["pi", "tau"])
}

impl Builtin {
    pub(crate) fn named(name: &str) -> Option<Builtin> {
        TABLE.iter().find(|(n, ..)| *n == name).map(|(_, builtin, _)| *builtin)
    }

    /// Its name.
    pub(super) fn name(self) -> &'static str {
        self.entry().0
    }

    fn entry(self) -> (&'static str, &'static [&'static str]) {
        TABLE.iter().find(|(_, b, _)| *b == self).map_or(("", &[]), |(name, _, params)| (*name, *params))
    }

    pub(crate) fn parameters(self) -> &'static [&'static str] {
        self.entry().1
    }

    /// The number of its arguments that must be given.
    pub(super) fn required(self) -> usize {
        match self {
            Builtin::SvgPath => 1,
            Builtin::Solid => 2,
            _ => self.parameters().len(),
        }
    }

    /// Whether it takes one argument or more.
    pub(super) fn variadic(self) -> bool {
        matches!(self, Builtin::Min | Builtin::Max)
    }
}

impl<'a> Checker<'a> {
    /// A built-in function of values, which are as many as it wants.
    pub(super) fn builtin(&mut self, builtin: Builtin, args: Vec<Expr>, span: Span) -> Expr {
        if args.iter().any(|a| a.ty.is_error()) || !self.use_fuel(1, span) {
            return error(span);
        }
        let mut args = args.into_iter();
        let Some(first) = args.next() else { return error(span) };
        match (builtin, args.next(), args.next()) {
            (Builtin::Min | Builtin::Max, second, third) => {
                let rest = second.into_iter().chain(third).chain(args);
                self.extreme(builtin, first, rest.collect(), span)
            }
            (Builtin::Fold, Some(xs), Some(f)) => self.fold(first, xs, f, span),
            (Builtin::Loop, Some(count), Some(f)) => self.fold_count(first, count, f, span),
            (Builtin::Each, Some(f), None) => self.each(first, f, span),
            (Builtin::EachSolid, Some(f), Some(of_inside)) => self.each_solid(first, f, of_inside, span),
            (Builtin::Keep, Some(value), None) => self.keep_point(first, value, span),
            (Builtin::Solid, Some(inside), sides) => self.make_solid(first, inside, sides, span),
            (Builtin::Blend(blend), ..) => self.blend_of_values(blend, span),
            (Builtin::SvgPath, tolerance, None) => self.svg_path(first, tolerance, span),
            (Builtin::Glyphs, Some(font), None) => self.glyphs(&first, &font, span),
            (Builtin::Atan2, Some(x), None) => self.atan2(first, x, span),
            (Builtin::OfParts(_), ..) => self.outside_of_measures(builtin.name(), span),
            (_, None, None) => self.builtin_of_one(builtin, first, span),
            _ => error(span),
        }
    }

    fn builtin_of_one(&mut self, builtin: Builtin, x: Expr, span: Span) -> Expr {
        match builtin {
            Builtin::Plain(op) => self.of_bare(builtin, op, x, Type::REAL, span),
            Builtin::ToAngle(op) => self.of_bare(builtin, op, x, Type::ANGLE, span),
            Builtin::OfAngle(op) => self.of_angle(builtin, op, x, span),
            Builtin::Rounded(op) => self.rounded(builtin, op, x, span),
            Builtin::Sum => self.sum_of(x, span),
            Builtin::Len => self.len(&x, span),
            Builtin::Inside => self.inside_of(x, span),
            Builtin::Sides => self.sides_of(x, span),
            Builtin::Stop => self.stop(x, span),
            Builtin::Arity => {
                let n = if let Type::Closure(id) = x.ty { self.arity(id) } else { 0 };
                int(n as i64, span)
            }
            Builtin::Abs => match x.ty {
                Type::Int(Some(k)) if k != i64::MIN => int(k.abs(), span),
                Type::Int(_) => unary(Unary::Abs, x, Type::INT, span),
                _ => self.keeping(builtin, Unary::Abs, x, span, Some),
            },
            Builtin::Sign => self.keeping(builtin, Unary::Sign, x, span, |_| Some(Dimension::NONE)),
            Builtin::Sqrt => self.keeping(builtin, Unary::Sqrt, x, span, square_root),
            Builtin::Real => self.keeping_value(builtin, x, span),
            _ => error(span),
        }
    }

    fn argument(&mut self, builtin: Builtin, x: Expr) -> Option<(Expr, Dimension)> {
        let what = format!("'{}'", builtin.entry().0);
        self.number(x, &what)
    }

    fn keeping_value(&mut self, builtin: Builtin, x: Expr, span: Span) -> Expr {
        match self.argument(builtin, x) {
            Some((x, d)) => Expr { ty: Type::Real(d), span, ..x },
            None => error(span),
        }
    }

    /// A function whose result's dimension follows from the argument's.
    fn keeping(
        &mut self,
        builtin: Builtin,
        op: Unary,
        x: Expr,
        span: Span,
        dimension: fn(Dimension) -> Option<Dimension>,
    ) -> Expr {
        let Some((x, d)) = self.argument(builtin, x) else { return error(span) };
        match dimension(d) {
            Some(d) => unary(op, x, Type::Real(d), span),
            None => self.fail(exponent_error(span)),
        }
    }

    /// The argument as a bare number, or an error.
    fn bare(&mut self, builtin: Builtin, x: Expr) -> Option<Expr> {
        let (x, d) = self.argument(builtin, x)?;
        if d.is_none() || d.angle {
            return Some(x);
        }
        let message = format!("'{}' expects a bare number, but this is {d}", builtin.entry().0);
        let diagnostic = Diagnostic::new(Code::DimensionMismatch, x.span, message);
        let length = d == Dimension::LENGTH;
        self.report(if length {
            diagnostic.suggest("divide it by a length, such as 1mm", super::convert::followed_by(&x, " / 1mm"))
        } else {
            diagnostic.hint("divide by one of the same kind, such as x / 1mm")
        });
        None
    }

    fn of_bare(&mut self, builtin: Builtin, op: Unary, x: Expr, ty: Type, span: Span) -> Expr {
        match self.bare(builtin, x) {
            Some(x) => unary(op, x, ty, span),
            None => error(span),
        }
    }

    fn of_angle(&mut self, builtin: Builtin, op: Unary, x: Expr, span: Span) -> Expr {
        let Some((x, d)) = self.argument(builtin, x) else { return error(span) };
        if d.angle {
            return unary(op, x, Type::REAL, span);
        }
        let message = format!("'{}' expects an angle, but this is {d}", builtin.entry().0);
        let diagnostic = Diagnostic::new(Code::DimensionMismatch, x.span, message);
        let suggestion = if d.is_none() { self.unit_advice(&x, Dimension::ANGLE) } else { None };
        self.fail(diagnostic.suggestion(suggestion))
    }

    fn rounded(&mut self, builtin: Builtin, op: Unary, x: Expr, span: Span) -> Expr {
        if matches!(x.ty, Type::Int(_)) {
            return x;
        }
        let Some(x) = self.bare(builtin, x) else { return error(span) };
        // A value that is not a number is left to the evaluation.
        if let Some(value) = constant(&x).filter(|x| !x.is_nan()) {
            let value = match op {
                Unary::Floor => value.floor(),
                Unary::Ceil => value.ceil(),
                Unary::Round => value.round(),
                _ => value.trunc(),
            };
            // As a real number, the largest whole number is rounded up to one that is none.
            let exists = value >= i64::MIN as f64 && value < i64::MAX as f64;
            return if exists { int(value as i64, span) } else { self.overflow(span) };
        }
        unary(op, x, Type::INT, span)
    }

    fn len(&mut self, x: &Expr, span: Span) -> Expr {
        match &x.ty {
            Type::Array(_, n) => int(*n as i64, span),
            Type::Tuple(types) => int(types.len() as i64, span),
            Type::Range(Some(a), Some(b)) if b <= a => int(0, span),
            Type::Range(Some(a), Some(b)) => match b.checked_sub(*a) {
                Some(n) => int(n, span),
                None => self.overflow(span),
            },
            other => {
                let message = format!("'len' expects an array, but this is {}", self.describe(other));
                self.fail(Diagnostic::new(Code::TypeMismatch, x.span, message))
            }
        }
    }

    fn stop(&mut self, x: Expr, span: Span) -> Expr {
        let plain = matches!(x.ty, Type::Real(_) | Type::Int(_) | Type::Tuple(_));
        match x.ty.all_real().filter(|_| plain) {
            _ if matches!(x.ty, Type::Int(_)) => x,
            Some(real) => {
                let x = self.convert(x, &real);
                unary(Unary::Stop, x, real, span)
            }
            None => {
                let message = format!("'stop' expects a number or a vector, but this is {}", self.describe(&x.ty));
                self.fail(Diagnostic::new(Code::TypeMismatch, x.span, message))
            }
        }
    }

    fn atan2(&mut self, y: Expr, x: Expr, span: Span) -> Expr {
        let (Some((y, dy)), Some((x, dx))) = (self.argument(Builtin::Atan2, y), self.argument(Builtin::Atan2, x))
        else {
            return error(span);
        };
        if common(dy, dx).is_some() {
            return binary(Binary::Atan2, y, x, Type::ANGLE, span);
        }
        let message = format!("'atan2' expects two numbers of one kind, but these are {dy} and {dx}");
        let diagnostic = Diagnostic::new(Code::DimensionMismatch, span, message);
        let suggestion = if dx.is_none() { self.unit_advice(&x, dy) } else { self.unit_advice(&y, dx) };
        self.fail(diagnostic.suggestion(suggestion))
    }

    /// The least or greatest of some values, or of the elements of one array.
    fn extreme(&mut self, builtin: Builtin, first: Expr, rest: Vec<Expr>, span: Span) -> Expr {
        let mut statements = Vec::new();
        let items = if rest.is_empty() {
            self.items(builtin.entry().0, first, &mut statements)
        } else {
            Some(std::iter::once(first).chain(rest).collect())
        };
        let Some(items) = items else { return error(span) };
        let mut items = items.into_iter();
        let Some(first) = items.next() else {
            let message = "an empty array has no smallest or largest element";
            return self.fail(Diagnostic::new(Code::Arguments, span, message));
        };
        let choose = |checker: &mut Self, a, b| checker.extreme_of_two(builtin, a, b, span);
        match self.accumulate(first, items, &mut statements, choose) {
            Some(value) => super::bindings::wrap(statements, value, span),
            None => error(span),
        }
    }

    fn extreme_of_two(&mut self, builtin: Builtin, a: Expr, b: Expr, span: Span) -> Expr {
        let op = if builtin == Builtin::Min { Binary::Min } else { Binary::Max };
        if let (Type::Int(x), Type::Int(y)) = (&a.ty, &b.ty) {
            return match (x, y) {
                (Some(x), Some(y)) => int(if op == Binary::Min { *x.min(y) } else { *x.max(y) }, span),
                _ => binary(op, a, b, Type::INT, span),
            };
        }
        let (Some((a, da)), Some((b, db))) = (self.argument(builtin, a), self.argument(builtin, b)) else {
            return error(span);
        };
        match common(da, db) {
            Some(d) => binary(op, a, b, Type::Real(d), span),
            None => {
                let message =
                    format!("'{}' expects numbers of one kind, but these are {da} and {db}", builtin.entry().0);
                let diagnostic = Diagnostic::new(Code::DimensionMismatch, span, message);
                let suggestion = if db.is_none() { self.unit_advice(&b, da) } else { self.unit_advice(&a, db) };
                self.fail(diagnostic.suggestion(suggestion))
            }
        }
    }
}
