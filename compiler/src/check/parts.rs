//! Named surfaces: what `part` names, taken apart down to single surfaces with full names.

use super::annotations::Expected;
use super::context::{Checker, error};
use super::expressions::element;
use super::model::Entry;
use super::solids::is_hidden;
use super::typed::{Expr, Part, Type};
use super::types::Dimension;
use crate::diagnostic::{Code, Diagnostic};
use crate::source::Span;
use std::collections::HashMap;

/// A surface's name, with and without indices.
#[derive(Clone)]
struct Name {
    full: String,
    group: String,
}

impl Name {
    fn index(&self, i: usize) -> Name {
        Name { full: format!("{}[{i}]", self.full), group: self.group.clone() }
    }

    fn field(&self, name: &str) -> Name {
        Name { full: format!("{}.{name}", self.full), group: format!("{}.{name}", self.group) }
    }
}

impl<'a> Checker<'a> {
    /// The parts of a model. Those of a loop are numbered.
    pub(super) fn parts(&mut self, entries: &[Entry<'a>]) -> Vec<Part> {
        let mut parts = Vec::new();
        let mut counts: HashMap<&str, usize> = HashMap::new();
        for entry in entries {
            let text = &entry.decl.name.text;
            let mut name = Name { full: text.clone(), group: text.clone() };
            if entry.grouped {
                let count = counts.entry(text).or_default();
                name = name.index(*count);
                *count += 1;
            }
            self.shapes(entry, &name, entry.shape.clone(), &mut parts);
        }
        parts
    }

    /// One surface, or those in an array, tuple or record.
    fn shapes(&mut self, entry: &Entry<'a>, name: &Name, shape: Expr, parts: &mut Vec<Part>) {
        if !self.use_fuel(1, entry.span) {
            return;
        }
        match shape.ty.clone() {
            Type::Error => {}
            Type::Closure(id) if self.accepts(id, 2) => {
                let most = self.options.parts;
                if parts.len() == most {
                    let message = format!("the model has more than {most} parts");
                    let hint = "the limit can be raised: --limit parts=N";
                    self.report(Diagnostic::new(Code::TooLarge, entry.span, message).hint(hint));
                }
                // One more than there may be says that there are too many, once.
                if parts.len() <= most
                    && let Some(part) = self.surface(entry, name, shape)
                {
                    parts.push(part);
                }
            }
            Type::Record(fields) => {
                for (i, (field, _)) in fields.iter().enumerate().filter(|(_, (field, _))| !is_hidden(field)) {
                    self.shapes(entry, &name.field(field), element(shape.clone(), i), parts);
                }
            }
            Type::Array(_, n) => {
                for i in 0..n {
                    self.shapes(entry, &name.index(i), element(shape.clone(), i), parts);
                }
            }
            Type::Tuple(types) if types.iter().any(Type::has_function) => {
                for i in 0..types.len() {
                    self.shapes(entry, &name.index(i), element(shape.clone(), i), parts);
                }
            }
            other => {
                let message =
                    format!("a part must be a surface (a function of u and v), but this is {}", self.describe(&other));
                let diagnostic = Diagnostic::new(Code::NotASurface, shape.span, message);
                let curve = matches!(other, Type::Closure(id) if self.accepts(id, 1));
                self.report(if curve {
                    diagnostic.hint("make a surface of the curve: revolve(curve), or tube(curve, radius: 5mm)")
                } else {
                    let suggestion = self.call_meant(&shape);
                    diagnostic.suggestion(suggestion)
                });
            }
        }
    }

    fn surface(&mut self, entry: &Entry<'a>, name: &Name, shape: Expr) -> Option<Part> {
        let span: Span = shape.span;
        let local = self.local(&name.full, shape.ty.clone(), span);
        let (u, v) = (self.local("u", Type::REAL, span), self.local("v", Type::REAL, span));
        let values = vec![self.read(u, span), self.read(v, span)];
        let value = self.read(local, span);
        let point = self.call_with(value, values, span);
        let point = self.surface_point(point, &name.full);
        if point.ty.is_error() {
            return None;
        }
        Some(Part {
            name: name.full.clone(),
            group: name.group.clone(),
            tolerance: entry.tolerance.clone(),
            shape,
            local,
            u,
            v,
            point,
            span: entry.span,
        })
    }

    /// A part's surface must return points in space.
    fn surface_point(&mut self, point: Expr, name: &str) -> Expr {
        let message =
            format!("the surface '{name}' must return points in space, but it returns {}", self.describe(&point.ty));
        let hint = match &point.ty {
            Type::Tuple(types) if types.len() == 2 => {
                "a surface needs three coordinates; a profile in the plane can be turned: revolve(profile)"
            }
            Type::Tuple(_) => "coordinates are lengths: write 0mm for 0, and multiply bare numbers by 1mm",
            _ => "a point is written (x, y, z)",
        };
        let expected = Expected::Tuple(vec![Expected::Real(Dimension::LENGTH); 3]);
        match self.coercion(&point.ty, &expected, point.span) {
            Some(ty) => self.convert(point, &ty),
            None if point.ty.is_error() => error(point.span),
            None => self.fail(Diagnostic::new(Code::NotASurface, point.span, message).hint(hint)),
        }
    }
}

/// Whether the name of a part begins with a path that several parts have: `plate.hole[0]` and `plate.hole`.
pub(super) fn is_under(name: &str, path: &str) -> bool {
    name.strip_prefix(path).is_some_and(|rest| rest.starts_with(['.', '[']))
}
