//! Written types: the types that they expect of values.

use super::context::Checker;
use super::describe::vector_words;
use super::typed::{Expr, ExprKind, Type};
use super::types::{ClosureId, Dimension, Exponent};
use crate::diagnostic::{Code, Diagnostic, Edit, Suggestion};
use crate::parameters::Quantity;
use crate::source::Span;
use crate::suggest::nearest;
use crate::syntax::ast::{TypeExpr, TypeKind};

/// The type that a written type expects of a value. It leaves array lengths open, and which function is meant.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Expected {
    /// Anything (also after an error).
    Any,
    Real(Dimension),
    Int,
    Bool,
    Tuple(Vec<Expected>),
    Array(Box<Expected>),
    Function(Vec<Expected>, Box<Expected>),
    /// Two or three lengths.
    Point,
}

/// The names of types, for suggestions.
const NAMES: [&str; 13] = [
    "real", "int", "bool", "length", "area", "volume", "angle", "vec2", "vec3", "point2", "point3", "curve", "surface",
];

impl Expected {
    fn vector(n: usize, dimension: Dimension) -> Expected {
        Expected::Tuple(vec![Expected::Real(dimension); n])
    }

    fn named(name: &str) -> Option<Expected> {
        let real = Expected::Real(Dimension::NONE);
        let power = |n| Exponent::new(n, 1).map(|e| Expected::Real(Dimension::of_length(e)));
        Some(match name {
            "real" => real,
            "int" => Expected::Int,
            "bool" => Expected::Bool,
            "length" => Expected::Real(Dimension::LENGTH),
            "area" => power(2)?,
            "volume" => power(3)?,
            "angle" => Expected::Real(Dimension::ANGLE),
            "vec2" => Expected::vector(2, Dimension::NONE),
            "vec3" => Expected::vector(3, Dimension::NONE),
            "point2" => Expected::vector(2, Dimension::LENGTH),
            "point3" => Expected::vector(3, Dimension::LENGTH),
            "curve" => Expected::Function(vec![real], Box::new(Expected::Point)),
            "surface" => Expected::Function(vec![real.clone(), real], Box::new(Expected::vector(3, Dimension::LENGTH))),
            _ => return None,
        })
    }

    /// The quantity of a parameter or input of this type, where it can be one.
    pub(super) fn quantity(&self) -> Option<Quantity> {
        Some(match self {
            Expected::Int => Quantity::Int,
            Expected::Bool => Quantity::Bool,
            Expected::Real(Dimension::NONE) => Quantity::Real,
            Expected::Real(Dimension::LENGTH) => Quantity::Length,
            Expected::Real(Dimension::ANGLE) => Quantity::Angle,
            _ => return None,
        })
    }

    /// The one type that satisfies it, where there is one.
    pub(super) fn exact(&self) -> Option<Type> {
        Some(match self {
            Expected::Real(d) => Type::Real(*d),
            Expected::Int => Type::INT,
            Expected::Bool => Type::BOOL,
            Expected::Tuple(parts) => Type::tuple(parts.iter().map(Expected::exact).collect::<Option<_>>()?),
            _ => return None,
        })
    }

    /// In the user's words, with an article.
    pub(super) fn describe(&self) -> String {
        match self {
            Expected::Any => "anything".to_owned(),
            Expected::Real(d) => d.to_string(),
            Expected::Int => "a whole number".to_owned(),
            Expected::Bool => "a truth value".to_owned(),
            Expected::Point => "a point".to_owned(),
            Expected::Tuple(parts) => {
                let types: Option<Vec<Type>> = parts.iter().map(Expected::exact).collect();
                types.and_then(|types| vector_words(&types)).unwrap_or_else(|| format!("a tuple of {}", parts.len()))
            }
            Expected::Array(_) => "an array".to_owned(),
            Expected::Function(params, _) => match params.len() {
                1 => "a function of one argument".to_owned(),
                n => format!("a function of {n} arguments"),
            },
        }
    }
}

impl Checker<'_> {
    /// The expectation of a written type.
    pub(super) fn expected(&mut self, ty: &TypeExpr) -> Expected {
        match &ty.kind {
            TypeKind::Error => Expected::Any,
            TypeKind::Name(name) => match Expected::named(name) {
                Some(expected) => expected,
                None => {
                    let message = format!("there is no type '{name}'");
                    let error = Diagnostic::new(Code::UnknownType, ty.span, message);
                    let error = match (nearest(name, NAMES), name.as_str()) {
                        (_, "float" | "double" | "number" | "f64") => {
                            error.suggest("a bare number is 'real'", [Edit::replace(ty.span, "real")])
                        }
                        (_, "mm" | "cm" | "m" | "in") => {
                            error.suggest("the type of such values is 'length'", [Edit::replace(ty.span, "length")])
                        }
                        (_, "deg" | "rad" | "turn" | "degrees") => {
                            error.suggest("the type of such values is 'angle'", [Edit::replace(ty.span, "angle")])
                        }
                        (_, "string" | "str" | "text") => error.hint("texts are for messages and file names only"),
                        (Some(near), _) => error.did_you_mean(ty.span, near),
                        (None, _) => error.hint(format!("the types are {}", NAMES.join(", "))),
                    };
                    // The suggested type is most likely meant: values are checked against it.
                    let meant = error.suggestions.first().and_then(|s| s.edits.first());
                    let meant = meant.and_then(|edit| Expected::named(&edit.replacement));
                    self.report(error);
                    meant.unwrap_or(Expected::Any)
                }
            },
            TypeKind::Power(base, n) => match self.expected(base) {
                Expected::Any => Expected::Any,
                Expected::Real(d) if !d.angle => {
                    match Exponent::new(i64::from(*n), 1).and_then(|exponent| d.power(exponent)) {
                        Some(power) => Expected::Real(power),
                        None => {
                            self.report(Diagnostic::new(Code::ExponentRange, ty.span, "this exponent is too large"));
                            Expected::Any
                        }
                    }
                }
                other => {
                    let message = format!("only a length has powers, but this is {}", other.describe());
                    self.report(Diagnostic::new(Code::InvalidType, ty.span, message));
                    Expected::Any
                }
            },
            TypeKind::Tuple(parts) => Expected::Tuple(parts.iter().map(|p| self.expected(p)).collect()),
            TypeKind::Array(element) => Expected::Array(Box::new(self.expected(element))),
            TypeKind::Function(params, result) => {
                let params = params.iter().map(|p| self.expected(p)).collect();
                Expected::Function(params, Box::new(self.expected(result)))
            }
        }
    }

    /// [`Checker::coerce`] to a written type, where there is one.
    pub(super) fn coerce_written(&mut self, expr: Expr, ty: Option<&TypeExpr>, what: &str) -> Expr {
        let Some(ty) = ty else { return expr };
        let expected = self.expected(ty);
        self.coerce(expr, &expected, what)
    }

    /// The value converted to the expected type, or an error that calls it `what`.
    pub(super) fn coerce(&mut self, expr: Expr, expected: &Expected, what: &str) -> Expr {
        if expr.ty.is_error() {
            return expr;
        }
        match self.coercion(&expr.ty, expected, expr.span) {
            Some(ty) if ty.is_error() => super::context::error(expr.span),
            Some(ty) => self.convert(expr, &ty),
            None => {
                let message =
                    format!("{what} must be {}, but this is {}", expected.describe(), self.describe(&expr.ty));
                let error = Diagnostic::new(mismatch_code(&expr.ty, expected), expr.span, message);
                let suggestion = self
                    .unit_hint(&expr, expected)
                    .or_else(|| self.call_meant(&expr))
                    .or_else(|| curve_meant(&expr, expected));
                self.fail(error.suggestion(suggestion))
            }
        }
    }

    /// A function without arguments, or a model, that stands in the place of a value was most likely meant to be
    /// called.
    pub(super) fn call_meant(&self, expr: &Expr) -> Option<Suggestion> {
        let Type::Closure(id) = expr.ty else { return None };
        let named = matches!(&expr.kind, ExprKind::Aggregate(captures) if captures.is_empty());
        let called = Suggestion { message: "call it".to_owned(), edits: vec![Edit::after(expr.span, "()")] };
        (named && self.arity(id) == 0).then_some(called)
    }

    /// The type to which a value of type `from` is converted where `expected` stands.
    pub(super) fn coercion(&mut self, from: &Type, expected: &Expected, span: Span) -> Option<Type> {
        match (expected, from) {
            (Expected::Any, _) | (Expected::Int, Type::Int(_)) | (Expected::Bool, Type::Bool(_)) | (_, Type::Error) => {
                Some(from.clone())
            }
            (Expected::Real(want), Type::Real(have)) => {
                (want == have || (want.is_none() && have.angle)).then_some(Type::Real(*want))
            }
            (Expected::Real(want), Type::Int(_)) => want.is_none().then_some(Type::REAL),
            (Expected::Tuple(parts), Type::Tuple(types)) if parts.len() == types.len() => {
                let types: Option<Vec<Type>> =
                    parts.iter().zip(&**types).map(|(w, t)| self.coercion(t, w, span)).collect();
                Some(Type::tuple(types?))
            }
            (Expected::Point, Type::Tuple(types)) if types.len() == 2 || types.len() == 3 => {
                self.coercion(from, &Expected::vector(types.len(), Dimension::LENGTH), span)
            }
            (Expected::Array(element), Type::Array(ty, n)) => {
                Some(Type::Array(self.coercion(ty, element, span)?.into(), *n))
            }
            // An array of functions that differ.
            (Expected::Array(element), Type::Tuple(types)) if matches!(**element, Expected::Function(..)) => {
                let types: Option<Vec<Type>> = types.iter().map(|t| self.coercion(t, element, span)).collect();
                Some(Type::tuple(types?))
            }
            (Expected::Function(params, result), Type::Closure(id)) if self.accepts(*id, params.len()) => {
                Some(if self.is_of_function_type(*id, params, result, span) { from.clone() } else { Type::Error })
            }
            _ => None,
        }
    }

    /// Whether a function returns what the written type says, where that gives the types of all arguments exactly. If
    /// not, that is reported.
    fn is_of_function_type(&mut self, id: ClosureId, params: &[Expected], result: &Expected, span: Span) -> bool {
        let Some(args) = params.iter().map(Expected::exact).collect::<Option<Vec<Type>>>() else { return true };
        let args = args.into_iter().map(Some).collect();
        let Some((_, ty)) = self.instantiate(id, args, span) else { return false };
        if self.coercion(&ty, result, span).is_some() {
            return true;
        }
        let message = format!("this function must return {}, but it returns {}", result.describe(), self.describe(&ty));
        let mut error = Diagnostic::new(Code::WrongResult, span, message);
        if let Type::Tuple(parts) = &ty
            && parts.iter().any(|t| matches!(t, Type::Int(_) | Type::Real(Dimension::NONE)))
        {
            error = error.hint("coordinates are lengths: write 0mm for 0, and multiply bare numbers by 1mm");
        } else if matches!(ty, Type::Real(_) | Type::Int(_)) {
            error = error.hint("a point is written (x, y) or (x, y, z), in lengths");
        }
        self.report(error);
        false
    }
}

fn mismatch_code(have: &Type, expected: &Expected) -> Code {
    match (have, expected) {
        (Type::Real(_) | Type::Int(_), Expected::Real(_)) => Code::DimensionMismatch,
        _ => Code::TypeMismatch,
    }
}

/// The suggestion for points in the place of a curve.
fn curve_meant(expr: &Expr, expected: &Expected) -> Option<Suggestion> {
    let (Expected::Function(params, _), Type::Array(element, _)) = (expected, &expr.ty) else { return None };
    let edits = vec![Edit::before(expr.span, "polyline("), Edit::after(expr.span, ")")];
    let message = "make a curve of the points: polyline(points), or bezier(points)".to_owned();
    (params.len() == 1 && matches!(**element, Type::Tuple(_))).then_some(Suggestion { message, edits })
}
