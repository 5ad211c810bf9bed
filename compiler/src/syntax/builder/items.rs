//! Items.

use super::{Builder, Deep, split_all, split_option};
use crate::syntax::ast::*;

impl Builder<'_> {
    pub(in crate::syntax) fn file(&self, items: Vec<Deep<Item>>) -> File {
        File { items: split_all(items).0, unread: Vec::new() }
    }

    pub(in crate::syntax) fn item(&mut self, doc: Option<String>, l: u32, kind: Deep<ItemKind>, r: u32) -> Deep<Item> {
        let span = self.span(l, r);
        let doc = doc.unwrap_or_default();
        if self.fits(span, kind.depth) {
            Deep { depth: kind.depth + 1, node: Item { doc, span, kind: kind.node } }
        } else {
            Deep::flat(Item { doc, span, kind: ItemKind::Error })
        }
    }

    pub(in crate::syntax) fn bad_item(&mut self, l: u32, r: u32) -> Deep<Item> {
        Deep::flat(Item { doc: String::new(), span: self.span(l, r), kind: ItemKind::Error })
    }

    pub(in crate::syntax) fn function(
        &mut self,
        name: Ident,
        params: Vec<Deep<FnParam>>,
        result: Option<Deep<TypeExpr>>,
        body: Deep<Expr>,
    ) -> Deep<ItemKind> {
        let (params, a) = split_all(params);
        let (result, c) = split_option(result);
        let depth = a.max(c).max(body.depth);
        Deep { node: ItemKind::Function(FunctionDecl { name, params, result, body: body.node }), depth }
    }

    pub(in crate::syntax) fn derivative(
        &mut self,
        function: Ident,
        params: Vec<Ident>,
        tangents: Vec<Ident>,
        body: Deep<Expr>,
    ) -> Deep<ItemKind> {
        body.map(|body| ItemKind::Derivative(DerivativeDecl { function, params, tangents, body }))
    }

    pub(in crate::syntax) fn binding(
        &mut self,
        pattern: Pattern,
        ty: Option<Deep<TypeExpr>>,
        value: Deep<Expr>,
    ) -> Deep<ItemKind> {
        let (ty, a) = split_option(ty);
        let depth = a.max(value.depth);
        Deep { node: ItemKind::Let(Let { pattern, ty, value: value.node }), depth }
    }

    pub(in crate::syntax) fn model(&mut self, name: Ident, items: Vec<Deep<Item>>) -> Deep<ItemKind> {
        let (items, depth) = split_all(items);
        Deep { node: ItemKind::Model(Model { name, items }), depth }
    }

    pub(in crate::syntax) fn part(
        &mut self,
        name: Ident,
        tolerance: Option<Deep<Expr>>,
        shape: Deep<Expr>,
    ) -> Deep<ItemKind> {
        let (tolerance, a) = split_option(tolerance);
        let depth = a.max(shape.depth);
        Deep { node: ItemKind::Part(PartDecl { name, tolerance, shape: shape.node }), depth }
    }

    pub(in crate::syntax) fn param(
        &mut self,
        name: Ident,
        ty: Deep<TypeExpr>,
        bounds: Option<(Deep<Expr>, Deep<Expr>)>,
        default: Option<Deep<Expr>>,
    ) -> Deep<ParamDecl> {
        let (default, a) = split_option(default);
        let (ty, c) = ty.split();
        let (bounds, d) = match bounds {
            Some((lo, hi)) => {
                let depth = lo.depth.max(hi.depth);
                (Some((lo.node, hi.node)), depth)
            }
            None => (None, 0),
        };
        Deep { node: ParamDecl { name, ty, bounds, default }, depth: a.max(c).max(d) }
    }

    pub(in crate::syntax) fn fn_param(
        &mut self,
        pattern: Pattern,
        ty: Option<Deep<TypeExpr>>,
        default: Option<Deep<Expr>>,
    ) -> Deep<FnParam> {
        let (ty, a) = split_option(ty);
        let (default, c) = split_option(default);
        Deep { node: FnParam { pattern, ty, default }, depth: a.max(c) }
    }

    pub(in crate::syntax) fn for_items(
        &mut self,
        l: u32,
        pattern: Pattern,
        iterable: Deep<Expr>,
        items: Vec<Deep<Item>>,
        r: u32,
    ) -> Deep<Item> {
        let (iterable, a) = iterable.split();
        let (items, c) = split_all(items);
        let kind = ItemKind::For(ForItems { pattern, iterable, items });
        self.item(None, l, Deep { node: kind, depth: a.max(c) }, r)
    }

    pub(in crate::syntax) fn if_items(
        &mut self,
        l: u32,
        condition: Deep<Expr>,
        then: Vec<Deep<Item>>,
        otherwise: Option<Vec<Deep<Item>>>,
        r: u32,
    ) -> Deep<Item> {
        let (condition, a) = condition.split();
        let (then, c) = split_all(then);
        let (otherwise, d) = split_all(otherwise.unwrap_or_default());
        let kind = ItemKind::If(IfItems { condition, then, otherwise });
        self.item(None, l, Deep { node: kind, depth: a.max(c).max(d) }, r)
    }
}
