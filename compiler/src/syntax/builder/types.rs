//! Types.

use super::{Builder, Deep, TypeAtom, split_all};
use crate::diagnostic::{Code, Diagnostic};
use crate::syntax::ast::{Ident, TypeExpr, TypeKind};

impl Builder<'_> {
    pub(in crate::syntax) fn plain_type(&mut self, l: u32, kind: TypeKind, r: u32) -> TypeAtom {
        TypeAtom::Plain(Deep::flat(TypeExpr { span: self.span(l, r), kind }))
    }

    pub(in crate::syntax) fn power_type(
        &mut self,
        l: u32,
        base: Ident,
        negative: bool,
        number: u32,
        r: u32,
    ) -> TypeAtom {
        let base = TypeExpr { span: base.span, kind: TypeKind::Name(base.text) };
        let exponent = match self.slice(number, r).parse::<i32>() {
            Ok(n) => n,
            Err(_) => {
                let message = "the exponent of a dimension must be a whole number";
                self.report(Diagnostic::new(Code::BadNumber, self.span(number, r), message));
                return self.plain_type(l, TypeKind::Error, r);
            }
        };
        let exponent = if negative { -exponent } else { exponent };
        let span = self.span(l, r);
        TypeAtom::Plain(self.ty(span, TypeKind::Power(Box::new(base), exponent), 1))
    }

    pub(in crate::syntax) fn array_type(&mut self, l: u32, element: Deep<TypeExpr>, r: u32) -> TypeAtom {
        let span = self.span(l, r);
        TypeAtom::Plain(self.ty(span, TypeKind::Array(Box::new(element.node)), element.depth))
    }

    pub(in crate::syntax) fn paren_type(&mut self, l: u32, types: Vec<Deep<TypeExpr>>, r: u32) -> TypeAtom {
        let (types, depth) = split_all(types);
        TypeAtom::Paren(types, self.span(l, r), depth)
    }

    pub(in crate::syntax) fn atom_type(&mut self, atom: TypeAtom) -> Deep<TypeExpr> {
        match atom {
            TypeAtom::Plain(ty) => ty,
            TypeAtom::Paren(mut types, span, depth) => {
                let kind = match types.pop() {
                    Some(only) if types.is_empty() => only.kind,
                    Some(last) => {
                        types.push(last);
                        TypeKind::Tuple(types)
                    }
                    None => {
                        self.report(Diagnostic::new(Code::EmptyTuple, span, "expected a type inside the parentheses"));
                        TypeKind::Error
                    }
                };
                self.ty(span, kind, depth)
            }
        }
    }

    pub(in crate::syntax) fn function_type(
        &mut self,
        l: u32,
        from: TypeAtom,
        to: Deep<TypeExpr>,
        r: u32,
    ) -> Deep<TypeExpr> {
        let (args, depth) = match from {
            TypeAtom::Plain(ty) => (vec![ty.node], ty.depth),
            TypeAtom::Paren(types, _, depth) => (types, depth),
        };
        let span = self.span(l, r);
        self.ty(span, TypeKind::Function(args, Box::new(to.node)), depth.max(to.depth))
    }
}
