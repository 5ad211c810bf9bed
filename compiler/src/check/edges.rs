//! `fillet(body, first, second, radius)`: the edge of two surfaces of a body, which are named within it. The library
//! (`std.fillet`) makes the fillet; here the names become surfaces.

use super::builtins::Builtin;
use super::context::{Callee, Checker, error};
use super::expressions::element;
use super::paths::{Step, text_of};
use super::solids::{is_hidden, is_solid};
use super::typed::{Expr, Type};
use crate::diagnostic::{Code, Diagnostic};
use crate::source::Span;
use crate::suggest::nearest;
use crate::syntax::ast::{self, Arg};
use std::sync::Arc;

/// The function, and the field of a body that holds its fillets in the order in which they were made.
pub(super) const FILLETS: &str = "fillet";

/// The module of the library that makes them.
pub(super) const MODULE: &str = "std.fillet";

/// How a call is written.
const HOW: &str = "write body.fillet(top, hole.wall, 1mm)";

/// The name that an expression is.
pub(super) fn name_of(e: &ast::Expr) -> Option<&str> {
    match &e.kind {
        ast::ExprKind::Name(name) => Some(name),
        _ => None,
    }
}

impl<'a> Checker<'a> {
    /// Whether a function is `fillet`.
    pub(super) fn is_fillet(&self, f: &Expr) -> bool {
        matches!(f.ty, Type::Closure(id) if matches!(self.closure(id).callee, Callee::Builtin(Builtin::Fillet)))
    }

    /// `fillet(body, first, second, radius)`.
    pub(super) fn fillet_of(&mut self, args: &'a [Arg], span: Span) -> Expr {
        let Some((body, rest)) = args.split_first() else { return self.fillet_of_values(span) };
        let named = name_of(&body.value);
        let body = self.expr(&body.value);
        self.fillet(body, named, rest, span)
    }

    /// A call by which the names of the surfaces are not seen.
    pub(super) fn fillet_of_values(&mut self, span: Span) -> Expr {
        let message = "'fillet' rounds the edge of two surfaces that are named in its call";
        self.fail(Diagnostic::new(Code::Arguments, span, message).hint(HOW))
    }

    /// `body.fillet(first, second, radius)`; the body may have a name.
    pub(super) fn fillet(&mut self, body: Expr, named: Option<&str>, args: &'a [Arg], span: Span) -> Expr {
        if body.ty.is_error() {
            return error(span);
        }
        if !is_solid(&body.ty) {
            let message = format!("'fillet' rounds an edge of a solid, but this is {}", self.describe(&body.ty));
            return self.fail(Diagnostic::new(Code::TypeMismatch, body.span, message));
        }
        let labels = ["first", "second", "radius"];
        let fits = args.len() == 3
            && args.iter().zip(labels).all(|(arg, label)| arg.label.as_ref().is_none_or(|l| l.text == label));
        if !fits {
            let message = "'fillet' is given two surfaces of the body and a radius";
            return self.fail(Diagnostic::new(Code::Arguments, span, message).hint(HOW));
        }
        let mut statements = Vec::new();
        let whole = self.keep(body, &mut statements);
        let first = self.surface_of(&whole, named, &args[0].value);
        let second = self.surface_of(&whole, named, &args[1].value);
        let (Some((first, a)), Some((second, b))) = (first, second) else { return error(span) };
        if first == second {
            let message = format!("an edge is between two surfaces, but both of these are '{}'", text_of(&first));
            return self.fail(Diagnostic::new(Code::Arguments, args[1].value.span, message));
        }
        let radius = self.expr(&args[2].value);
        if radius.ty.is_error() {
            return error(span);
        }
        let given = vec![whole.clone(), element(a.clone(), 0), element(a, 2), element(b.clone(), 0), element(b, 2)];
        let given = given.into_iter().chain([radius]).collect();
        let rounded = self.call_of(MODULE, "_rounded", given, span);
        if rounded.ty.is_error() {
            return error(span);
        }
        let rounded = self.keep(rounded, &mut statements);
        let solid = self.with_fillet(&whole, &rounded, span);
        super::bindings::wrap(statements, solid, span)
    }

    /// The body with what is left of its surfaces, and one more fillet.
    fn with_fillet(&mut self, body: &Expr, rounded: &Expr, span: Span) -> Expr {
        let [inside, left, new] = [0, 2, 3].map(|i| element(rounded.clone(), i));
        let Type::Record(fields) = &left.ty else { return error(span) };
        let mut surfaces: Vec<(Arc<str>, Expr)> = Vec::new();
        let mut fillets = Vec::new();
        for (i, (name, ty)) in fields.iter().enumerate() {
            let surface = element(left.clone(), i);
            match ty {
                Type::Tuple(types) if &**name == FILLETS => {
                    fillets.extend((0..types.len()).map(|k| element(surface.clone(), k)));
                }
                _ if &**name == FILLETS => {
                    let message = "a surface of this body is called 'fillet', as the new ones would be";
                    let error = Diagnostic::new(Code::DuplicateName, span, message);
                    return self.fail(error.hint("give it another name: body + {round: ...}"));
                }
                _ => surfaces.push((name.clone(), surface)),
            }
        }
        fillets.push(new);
        surfaces.push((FILLETS.into(), self.make_tuple(fillets, span)));
        self.solid_of(inside, element(body.clone(), 1), surfaces, span)
    }

    /// The side of the surface of a body that a path names, with its steps.
    fn surface_of(&mut self, body: &Expr, named: Option<&str>, path: &'a ast::Expr) -> Option<(Vec<Step>, Expr)> {
        let Some(mut steps) = self.steps_of(path) else {
            let message = "an edge is given by the names of two surfaces of the body";
            self.report(Diagnostic::new(Code::Arguments, path.span, message).hint(HOW));
            return None;
        };
        let has = |name: &str| matches!(&body.ty, Type::Record(fields) if fields.iter().any(|(n, _)| &**n == name));
        if let (Some(named), Some(Step::Field(first))) = (named, steps.first())
            && steps.len() > 1
            && first == named
            && !has(named)
        {
            steps.remove(0);
        }
        let (mut ty, mut side) = (body.ty.clone(), Some(element(body.clone(), 1)));
        for (k, step) in steps.iter().enumerate() {
            let index = self.index_of(&ty, &steps[..k], step, path.span)?;
            ty = match &ty {
                Type::Record(fields) => fields[index].1.clone(),
                Type::Tuple(types) => types[index].clone(),
                Type::Array(ty, _) => (**ty).clone(),
                _ => return None,
            };
            side = side.and_then(|side| component(side, step));
        }
        let text = text_of(&steps);
        if !matches!(ty, Type::Closure(_)) {
            let message = format!("'{text}' is several surfaces, but an edge is between two single ones");
            self.report(Diagnostic::new(Code::Arguments, path.span, message).hint(self.within(&ty, &text)));
            return None;
        }
        let Some(side) = side.filter(|side| is_solid(&side.ty)) else {
            let message = format!("nothing says how '{text}' goes on beyond its borders");
            let error = Diagnostic::new(Code::Arguments, path.span, message);
            self.report(error.hint("'rolling_fillet' of std.fillet may round this edge"));
            return None;
        };
        Some((steps, side))
    }

    /// Where a step leads to in a type, or an error.
    fn index_of(&mut self, ty: &Type, before: &[Step], step: &Step, span: Span) -> Option<usize> {
        let found = match (ty, step) {
            (Type::Record(fields), Step::Field(name)) => fields.iter().position(|(n, _)| **n == **name),
            (_, Step::Index(i)) => usize::try_from(*i).ok().filter(|i| *i < ty.count()),
            _ => None,
        };
        if found.is_none() {
            let whole = [before, std::slice::from_ref(step)].concat();
            let error =
                Diagnostic::new(Code::UnknownName, span, format!("the body has no surface '{}'", text_of(&whole)));
            self.report(match (ty, step) {
                (Type::Record(fields), Step::Field(name)) => {
                    let names = fields.iter().map(|(n, _)| &**n).filter(|n| !is_hidden(n));
                    match nearest(name, names) {
                        Some(near) => error.hint(format!("did you mean '{near}'?")),
                        None => error.hint(self.within(ty, &text_of(before))),
                    }
                }
                _ => error.hint(self.within(ty, &text_of(before))),
            });
        }
        found
    }

    /// A hint that names, or counts, the surfaces of a group.
    fn within(&self, ty: &Type, group: &str) -> String {
        match ty {
            Type::Record(fields) => {
                let dot = if group.is_empty() { "" } else { "." };
                let names: Vec<String> =
                    fields.iter().filter(|(n, _)| !is_hidden(n)).map(|(n, _)| format!("{group}{dot}{n}")).collect();
                format!("there are {}", names.join(", "))
            }
            Type::Array(..) | Type::Tuple(_) => format!("it has {}, counted from 0: {group}[0]", ty.count()),
            _ => HOW.to_owned(),
        }
    }
}

/// The component of sides to which a step leads.
fn component(sides: Expr, step: &Step) -> Option<Expr> {
    let index = match (&sides.ty, step) {
        (Type::Record(fields), Step::Field(name)) => fields.iter().position(|(n, _)| **n == **name)?,
        (Type::Array(..) | Type::Tuple(_), Step::Index(i)) => usize::try_from(*i).ok()?,
        _ => return None,
    };
    Some(element(sides, index))
}
