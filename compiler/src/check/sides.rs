//! Sides: how the surfaces of a solid go on beyond their borders.

use super::context::Checker;
use super::expressions::element;
use super::solids::{Operand, components, is_solid};
use super::typed::{Expr, Type};
use crate::diagnostic::{Code, Diagnostic};
use crate::source::Span;
use std::sync::Arc;

/// The name of a solid's second field: the sides of its surfaces, under their names. A side is a solid with the surface
/// as it was made, untrimmed, and the distance from the surface as it goes on beyond its borders. A surface of which
/// nothing says that has none, or an empty record.
pub(super) const SIDES: &str = " ";

impl<'a> Checker<'a> {
    /// The sides that are given for some of a solid's surfaces, under their names; none where one is wrong.
    pub(super) fn sides_of_surfaces(
        &mut self,
        surfaces: &[(Arc<str>, Expr)],
        given: &Expr,
    ) -> Option<Vec<(Arc<str>, Expr)>> {
        if !matches!(given.ty, Type::Record(_)) {
            self.no_side(given);
            return None;
        }
        let mut sides = Vec::new();
        for (name, side) in components(given) {
            let Some((_, surface)) = surfaces.iter().find(|(of, _)| *of == name) else {
                let message = format!("this is the side of '{name}', but the solid has no such surface");
                self.report(Diagnostic::new(Code::UnknownField, given.span, message));
                return None;
            };
            sides.push((name, self.side_of(surface, side)));
        }
        Some(sides)
    }

    /// The side of a surface by a function of a point, or the sides of several. What is a side already stays so.
    fn side_of(&mut self, surface: &Expr, side: Expr) -> Expr {
        let span = side.span;
        match (&surface.ty, &side.ty) {
            (_, ty) if is_solid(ty) || ty.is_error() => side,
            (Type::Closure(_), Type::Closure(id)) if self.accepts(*id, 1) => {
                let surfaces = vec![("wall".into(), surface.clone())];
                self.joined(Operand { inside: side, sides: Vec::new(), surfaces }, span)
            }
            // Of a surface that has none an empty one.
            (Type::Closure(_), Type::Record(fields)) if fields.is_empty() => side,
            (Type::Record(_), Type::Record(_)) => {
                let of = components(surface);
                let named = components(&side).into_iter().filter_map(|(name, side)| {
                    let surface = &of.iter().find(|(other, _)| *other == name)?.1;
                    Some((name, self.side_of(surface, side)))
                });
                let named: Vec<_> = named.collect();
                self.record_of(&named, span)
            }
            (Type::Array(..) | Type::Tuple(_), Type::Array(..) | Type::Tuple(_)) => {
                if surface.ty.count() != side.ty.count() {
                    let message = "there are not as many sides as surfaces";
                    return self.fail(Diagnostic::new(Code::TypeMismatch, span, message));
                }
                let items = (0..side.ty.count())
                    .map(|i| self.side_of(&element(surface.clone(), i), element(side.clone(), i)))
                    .collect();
                self.array(items, span)
            }
            _ => self.no_side(&side),
        }
    }

    fn no_side(&mut self, e: &Expr) -> Expr {
        let message = format!("this should be the sides of a solid's surfaces, but it is {}", self.describe(&e.ty));
        let error = Diagnostic::new(Code::TypeMismatch, e.span, message);
        self.fail(error.hint("a side is a function that gives the distance of a point: {top: |p| p.z - height}"))
    }

    /// `sides(solid)`: the record of the sides of its surfaces.
    pub(super) fn sides_of(&mut self, solid: Expr, span: Span) -> Expr {
        if is_solid(&solid.ty) {
            return Expr { span, ..element(solid, 1) };
        }
        let message = format!("'sides' expects a solid, but this is {}", self.describe(&solid.ty));
        self.fail(Diagnostic::new(Code::TypeMismatch, solid.span, message))
    }
}
