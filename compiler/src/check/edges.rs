//! `fillet(body, first, second, radius)` and `chamfer(body, first, second, size)`: the edge of two surfaces of a body,
//! which are named within it. The library (`std.fillet`) makes the new surfaces; here the names become surfaces.

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

/// The module of the library that makes them.
pub(super) const MODULE: &str = "std.fillet";

/// The surface between two others in the place of their edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Blend {
    Fillet,
    Chamfer,
}

/// The words of a blend.
struct Words {
    /// The function, and the field of a body that holds what it made, in the order in which it was made.
    name: &'static str,
    /// The library's function.
    function: &'static str,
    /// The name of its last argument.
    size: &'static str,
    /// In messages, between its name and the edge.
    verb: &'static str,
}

impl Blend {
    /// The blend of a function of that name.
    pub(super) fn named(name: &str) -> Option<Blend> {
        [Blend::Fillet, Blend::Chamfer].into_iter().find(|blend| blend.name() == name)
    }

    fn words(self) -> Words {
        match self {
            Blend::Fillet => Words { name: "fillet", function: "_rounded", size: "radius", verb: "rounds" },
            Blend::Chamfer => Words { name: "chamfer", function: "_chamfered", size: "size", verb: "cuts" },
        }
    }

    fn name(self) -> &'static str {
        self.words().name
    }

    /// How a call is written.
    fn how(self) -> String {
        format!("write body.{}(top, hole.wall, 1mm)", self.name())
    }
}

/// The name that an expression is.
pub(super) fn name_of(e: &ast::Expr) -> Option<&str> {
    match &e.kind {
        ast::ExprKind::Name(name) => Some(name),
        _ => None,
    }
}

impl<'a> Checker<'a> {
    /// The blend whose function an expression is.
    pub(super) fn blend_of(&self, f: &Expr) -> Option<Blend> {
        let Type::Closure(id) = f.ty else { return None };
        match self.closure(id).callee {
            Callee::Builtin(Builtin::Blend(blend)) => Some(blend),
            _ => None,
        }
    }

    /// `fillet(body, first, second, radius)`.
    pub(super) fn blend_in_call(&mut self, blend: Blend, args: &'a [Arg], span: Span) -> Expr {
        let Some((body, rest)) = args.split_first() else { return self.blend_of_values(blend, span) };
        let named = name_of(&body.value);
        let body = self.expr(&body.value);
        self.blend(blend, body, named, rest, span)
    }

    /// A call by which the names of the surfaces are not seen.
    pub(super) fn blend_of_values(&mut self, blend: Blend, span: Span) -> Expr {
        let message =
            format!("'{}' {} the edge of two surfaces that are named in its call", blend.name(), blend.words().verb);
        self.fail(Diagnostic::new(Code::Arguments, span, message).hint(blend.how()))
    }

    /// `body.fillet(first, second, radius)`; the body may have a name.
    pub(super) fn blend(&mut self, blend: Blend, body: Expr, named: Option<&str>, args: &'a [Arg], span: Span) -> Expr {
        if body.ty.is_error() {
            return error(span);
        }
        if !is_solid(&body.ty) {
            let (name, verb) = (blend.name(), blend.words().verb);
            let message = format!("'{name}' {verb} an edge of a solid, but this is {}", self.describe(&body.ty));
            return self.fail(Diagnostic::new(Code::TypeMismatch, body.span, message));
        }
        let labels = ["first", "second", blend.words().size];
        let fits = args.len() == 3
            && args.iter().zip(labels).all(|(arg, label)| arg.label.as_ref().is_none_or(|l| l.text == label));
        if !fits {
            let message = format!("'{}' is given two surfaces of the body and a {}", blend.name(), blend.words().size);
            return self.fail(Diagnostic::new(Code::Arguments, span, message).hint(blend.how()));
        }
        let mut statements = Vec::new();
        let whole = self.keep(body, &mut statements);
        let [first, second] = [0, 1].map(|i| self.surfaces_of(blend, &whole, named, &args[i].value));
        let (Some(first), Some(second)) = (first, second) else { return error(span) };
        let mut edges = Vec::new();
        for (a, of_a) in &first {
            for (b, of_b) in &second {
                if edges.iter().any(|(one, other, _)| [*one, *other] == [a, b] || [*one, *other] == [b, a]) {
                    let message = format!("the edge of '{}' and '{}' is named twice", text_of(a), text_of(b));
                    return self.fail(Diagnostic::new(Code::Arguments, span, message));
                }
                if a == b {
                    let message = format!("an edge is between two surfaces, but both of these are '{}'", text_of(a));
                    return self.fail(Diagnostic::new(Code::Arguments, args[1].value.span, message));
                }
                let sides = [of_a, of_b].into_iter().flat_map(|side| [0, 2].map(|i| element(side.clone(), i)));
                edges.push((a, b, self.make_tuple(sides.collect(), span)));
            }
        }
        let size = self.expr(&args[2].value);
        if size.ty.is_error() {
            return error(span);
        }
        let edges = self.make_tuple(edges.into_iter().map(|(_, _, sides)| sides).collect(), span);
        let blended = self.call_of(MODULE, blend.words().function, vec![whole.clone(), edges, size], span);
        if blended.ty.is_error() {
            return error(span);
        }
        let blended = self.keep(blended, &mut statements);
        let solid = self.with_blends(blend, &whole, &blended, span);
        super::bindings::wrap(statements, solid, span)
    }

    /// The sides of the surface that a path names, or of those of an array of paths.
    fn surfaces_of(
        &mut self,
        blend: Blend,
        body: &Expr,
        named: Option<&str>,
        paths: &'a ast::Expr,
    ) -> Option<Vec<(Vec<Step>, Expr)>> {
        match &paths.kind {
            ast::ExprKind::Array(paths) if !paths.is_empty() => {
                paths.iter().map(|path| self.surface_of(blend, body, named, path)).collect()
            }
            _ => Some(vec![self.surface_of(blend, body, named, paths)?]),
        }
    }

    /// The body with what is left of its surfaces, and its new fillets or chamfers.
    fn with_blends(&mut self, blend: Blend, body: &Expr, blended: &Expr, span: Span) -> Expr {
        let [inside, left, new] = [0, 2, 3].map(|i| element(blended.clone(), i));
        let Type::Record(fields) = &left.ty else { return error(span) };
        let mut surfaces: Vec<(Arc<str>, Expr)> = Vec::new();
        let mut blends = Vec::new();
        for (i, (name, ty)) in fields.iter().enumerate() {
            let surface = element(left.clone(), i);
            match ty {
                Type::Tuple(types) if &**name == blend.name() => {
                    blends.extend((0..types.len()).map(|k| element(surface.clone(), k)));
                }
                _ if &**name == blend.name() => {
                    let message = format!("a surface of this body is called '{name}', as the new ones would be");
                    let error = Diagnostic::new(Code::DuplicateName, span, message);
                    return self.fail(error.hint("give it another name: body + {round: ...}"));
                }
                _ => surfaces.push((name.clone(), surface)),
            }
        }
        blends.extend((0..new.ty.count()).map(|k| element(new.clone(), k)));
        surfaces.push((blend.name().into(), self.make_tuple(blends, span)));
        self.solid_of(inside, element(body.clone(), 1), surfaces, span)
    }

    /// The side of the surface of a body that a path names, with its steps.
    fn surface_of(
        &mut self,
        blend: Blend,
        body: &Expr,
        named: Option<&str>,
        path: &'a ast::Expr,
    ) -> Option<(Vec<Step>, Expr)> {
        let Some(mut steps) = self.steps_of(path) else {
            let message = "an edge is given by the names of two surfaces of the body";
            self.report(Diagnostic::new(Code::Arguments, path.span, message).hint(blend.how()));
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
            self.report(match (steps.first(), blend) {
                (Some(Step::Field(name)), _) if Blend::named(name).is_some() => {
                    error.hint("the edges of fillets and chamfers are left as they are")
                }
                (_, Blend::Fillet) => error.hint("'rolling_fillet' of std.fillet may round this edge"),
                (_, Blend::Chamfer) => error,
            });
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
            _ => format!("'{group}' is a surface"),
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
