//! Written types: what they ask of a value.

use super::context::Checker;
use super::typed::{Expr, ExprKind, Type};
use super::types::{ClosureId, Dimension, Exponent};
use crate::diagnostic::{Code, Diagnostic, Edit, Suggestion};
use crate::source::Span;
use crate::suggest::nearest;
use crate::syntax::ast::{TypeExpr, TypeKind};

/// What a written type asks for. It says nothing of array lengths, nor which function is meant.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Wanted {
    /// Anything (also after an error).
    Any,
    Real(Dimension),
    Int,
    Bool,
    Tuple(Vec<Wanted>),
    Array(Box<Wanted>),
    Function(Vec<Wanted>, Box<Wanted>),
    /// Two or three lengths.
    Point,
}

/// The names of types, for suggestions.
const NAMES: [&str; 13] = [
    "real", "int", "bool", "length", "area", "volume", "angle", "vec2", "vec3", "point2", "point3", "curve", "surface",
];

impl Wanted {
    fn vector(n: usize, dimension: Dimension) -> Wanted {
        Wanted::Tuple(vec![Wanted::Real(dimension); n])
    }

    fn named(name: &str) -> Option<Wanted> {
        let real = Wanted::Real(Dimension::NONE);
        let power = |n| Exponent::new(n, 1).map(|e| Wanted::Real(Dimension::of_length(e)));
        Some(match name {
            "real" => real,
            "int" => Wanted::Int,
            "bool" => Wanted::Bool,
            "length" => Wanted::Real(Dimension::LENGTH),
            "area" => power(2)?,
            "volume" => power(3)?,
            "angle" => Wanted::Real(Dimension::ANGLE),
            "vec2" => Wanted::vector(2, Dimension::NONE),
            "vec3" => Wanted::vector(3, Dimension::NONE),
            "point2" => Wanted::vector(2, Dimension::LENGTH),
            "point3" => Wanted::vector(3, Dimension::LENGTH),
            "curve" => Wanted::Function(vec![real], Box::new(Wanted::Point)),
            "surface" => Wanted::Function(vec![real.clone(), real], Box::new(Wanted::vector(3, Dimension::LENGTH))),
            _ => return None,
        })
    }

    /// The one type that satisfies it, where there is one.
    pub(super) fn exact(&self) -> Option<Type> {
        Some(match self {
            Wanted::Real(d) => Type::Real(*d),
            Wanted::Int => Type::INT,
            Wanted::Bool => Type::BOOL,
            Wanted::Tuple(parts) => Type::tuple(parts.iter().map(Wanted::exact).collect::<Option<_>>()?),
            _ => return None,
        })
    }

    /// In the user's words, with an article.
    pub(super) fn describe(&self) -> String {
        match self {
            Wanted::Any => "anything".to_owned(),
            Wanted::Real(d) => d.to_string(),
            Wanted::Int => "a whole number".to_owned(),
            Wanted::Bool => "a truth value".to_owned(),
            Wanted::Point => "a point".to_owned(),
            Wanted::Tuple(parts) => match (parts.len(), parts.first()) {
                (3, Some(Wanted::Real(Dimension::LENGTH))) if parts.iter().all(|p| *p == parts[0]) => {
                    "a point in space".to_owned()
                }
                (2, Some(Wanted::Real(Dimension::LENGTH))) if parts[0] == parts[1] => "a point in the plane".to_owned(),
                (n, Some(Wanted::Real(Dimension::NONE))) if parts.iter().all(|p| *p == parts[0]) => {
                    format!("a vector of {n} bare numbers")
                }
                (n, _) => format!("a tuple of {n}"),
            },
            Wanted::Array(_) => "an array".to_owned(),
            Wanted::Function(params, _) => match params.len() {
                1 => "a function of one argument".to_owned(),
                n => format!("a function of {n} arguments"),
            },
        }
    }
}

impl Checker<'_> {
    /// What a written type asks for.
    pub(super) fn wanted(&mut self, ty: &TypeExpr) -> Wanted {
        match &ty.kind {
            TypeKind::Error => Wanted::Any,
            TypeKind::Name(name) => match Wanted::named(name) {
                Some(wanted) => wanted,
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
                    // What is suggested is most likely meant: the rest is judged by it.
                    let meant = error.suggestions.first().and_then(|s| s.edits.first());
                    let meant = meant.and_then(|edit| Wanted::named(&edit.replacement));
                    self.report(error);
                    meant.unwrap_or(Wanted::Any)
                }
            },
            TypeKind::Power(base, n) => match self.wanted(base) {
                Wanted::Any => Wanted::Any,
                Wanted::Real(d) if !d.angle => {
                    match Exponent::new(i64::from(*n), 1).and_then(|exponent| d.power(exponent)) {
                        Some(power) => Wanted::Real(power),
                        None => {
                            self.report(Diagnostic::new(Code::ExponentRange, ty.span, "this exponent is too large"));
                            Wanted::Any
                        }
                    }
                }
                other => {
                    let message = format!("only a length has powers, but this is {}", other.describe());
                    self.report(Diagnostic::new(Code::InvalidType, ty.span, message));
                    Wanted::Any
                }
            },
            TypeKind::Tuple(parts) => Wanted::Tuple(parts.iter().map(|p| self.wanted(p)).collect()),
            TypeKind::Array(element) => Wanted::Array(Box::new(self.wanted(element))),
            TypeKind::Function(params, result) => {
                let params = params.iter().map(|p| self.wanted(p)).collect();
                Wanted::Function(params, Box::new(self.wanted(result)))
            }
        }
    }

    /// The value as the written type wants it, or an error that calls it `what`.
    pub(super) fn fit(&mut self, expr: Expr, wanted: &Wanted, what: &str) -> Expr {
        if expr.ty.is_error() {
            return expr;
        }
        match self.fits(&expr.ty, wanted, expr.span) {
            Some(ty) if ty.is_error() => super::context::error(expr.span),
            Some(ty) => self.convert(expr, &ty),
            None => {
                let message = format!("{what} must be {}, but this is {}", wanted.describe(), self.describe(&expr.ty));
                let error = Diagnostic::new(mismatch_code(&expr.ty, wanted), expr.span, message);
                let suggestion = self
                    .unit_hint(&expr, wanted)
                    .or_else(|| self.call_meant(&expr))
                    .or_else(|| curve_meant(&expr, wanted));
                self.fail(error.suggestion(suggestion))
            }
        }
    }

    /// A function without arguments, or a model, that stands where a value is wanted was most likely meant to be called.
    pub(super) fn call_meant(&self, expr: &Expr) -> Option<Suggestion> {
        let Type::Closure(id) = expr.ty else { return None };
        let named = matches!(&expr.kind, ExprKind::Aggregate(captures) if captures.is_empty());
        let called = Suggestion { message: "call it".to_owned(), edits: vec![Edit::after(expr.span, "()")] };
        (named && self.arity(id) == 0).then_some(called)
    }

    /// The type that a value of type `from` takes on where `wanted` is asked for.
    pub(super) fn fits(&mut self, from: &Type, wanted: &Wanted, span: Span) -> Option<Type> {
        match (wanted, from) {
            (Wanted::Any, _) | (Wanted::Int, Type::Int(_)) | (Wanted::Bool, Type::Bool(_)) | (_, Type::Error) => {
                Some(from.clone())
            }
            (Wanted::Real(want), Type::Real(have)) => {
                (want == have || (want.is_none() && have.angle)).then_some(Type::Real(*want))
            }
            (Wanted::Real(want), Type::Int(_)) => want.is_none().then_some(Type::REAL),
            (Wanted::Tuple(parts), Type::Tuple(types)) if parts.len() == types.len() => {
                let types: Option<Vec<Type>> = parts.iter().zip(&**types).map(|(w, t)| self.fits(t, w, span)).collect();
                Some(Type::tuple(types?))
            }
            (Wanted::Point, Type::Tuple(types)) if types.len() == 2 || types.len() == 3 => {
                self.fits(from, &Wanted::vector(types.len(), Dimension::LENGTH), span)
            }
            (Wanted::Array(element), Type::Array(ty, n)) => Some(Type::Array(self.fits(ty, element, span)?.into(), *n)),
            // An array of functions that differ.
            (Wanted::Array(element), Type::Tuple(types)) if matches!(**element, Wanted::Function(..)) => {
                let types: Option<Vec<Type>> = types.iter().map(|t| self.fits(t, element, span)).collect();
                Some(Type::tuple(types?))
            }
            (Wanted::Function(params, result), Type::Closure(id)) if self.accepts(*id, params.len()) => {
                Some(if self.is_of_function_type(*id, params, result, span) { from.clone() } else { Type::Error })
            }
            _ => None,
        }
    }

    /// Where the written type says exactly what a function is given, what it gives back must be as written. Else that is
    /// reported here.
    fn is_of_function_type(&mut self, id: ClosureId, params: &[Wanted], result: &Wanted, span: Span) -> bool {
        let Some(args) = params.iter().map(Wanted::exact).collect::<Option<Vec<Type>>>() else { return true };
        let args = args.into_iter().map(Some).collect();
        let Some((_, ty)) = self.instantiate(id, args, span) else { return false };
        if self.fits(&ty, result, span).is_some() {
            return true;
        }
        let message = format!("this function must give {}, but it gives {}", result.describe(), self.describe(&ty));
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

fn mismatch_code(have: &Type, wanted: &Wanted) -> Code {
    match (have, wanted) {
        (Type::Real(_) | Type::Int(_), Wanted::Real(_)) => Code::DimensionMismatch,
        _ => Code::TypeMismatch,
    }
}

/// Points where a curve is wanted.
fn curve_meant(expr: &Expr, wanted: &Wanted) -> Option<Suggestion> {
    let (Wanted::Function(params, _), Type::Array(element, _)) = (wanted, &expr.ty) else { return None };
    let edits = vec![Edit::before(expr.span, "polyline("), Edit::after(expr.span, ")")];
    let message = "make a curve of the points: polyline(points), or bezier(points)".to_owned();
    (params.len() == 1 && matches!(**element, Type::Tuple(_))).then_some(Suggestion { message, edits })
}
