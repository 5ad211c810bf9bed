//! The depth of what lies directly below a node, from which the builder computes the node's own.

use super::ast::{Expr, ExprKind, FnParam, Item, ItemKind, Tolerance, TypeExpr, TypeKind};

pub(super) fn below_expr(kind: &ExprKind) -> u32 {
    use ExprKind::*;
    match kind {
        Int(_) | Real(..) | Bool(_) | Text(_) | Name(_) | Error => 0,
        Unary(_, a) | Field(a, _) | Prime(a, _) => a.depth,
        Binary(_, a, b) | Range(a, b) | Index(a, b) | For(_, a, b) => a.depth.max(b.depth),
        Tuple(elements) | Array(elements) => deepest(elements.iter().map(|e| e.depth)),
        Record(fields) => deepest(fields.iter().map(|(_, value)| value.depth)),
        Call(f, args) | Method(f, _, args) => f.depth.max(deepest(args.iter().map(|a| a.value.depth))),
        Lambda(params, body) => params_depth(params).max(body.depth),
        If(condition, then, otherwise) => condition.depth.max(then.depth).max(expr_depth(otherwise.as_deref())),
        Block(items, value) => items_depth(items).max(expr_depth(value.as_deref())),
    }
}

pub(super) fn below_item(kind: &ItemKind) -> u32 {
    match kind {
        ItemKind::Use(_) | ItemKind::Error => 0,
        ItemKind::Function(f) => params_depth(&f.params).max(type_depth(f.result.as_ref())).max(f.body.depth),
        ItemKind::Derivative(d) => d.body.depth,
        ItemKind::Let(l) => type_depth(l.ty.as_ref()).max(l.value.depth),
        ItemKind::Model(m) => items_depth(&m.items),
        ItemKind::Param(p) | ItemKind::Input(p) => {
            let bounds = p.bounds.as_ref().map_or(0, |(low, high)| low.depth.max(high.depth));
            p.ty.depth.max(bounds).max(expr_depth(p.default.as_ref()))
        }
        ItemKind::Part(p) => expr_depth(p.tolerance.as_ref()).max(p.shape.depth),
        ItemKind::Measure(m) => {
            deepest(m.tolerance.iter().flat_map(Tolerance::values).map(|e| e.depth)).max(m.value.depth)
        }
        ItemKind::Require(r) => r.condition.depth,
        ItemKind::For(f) => f.iterable.depth.max(items_depth(&f.items)),
        ItemKind::If(i) => i.condition.depth.max(items_depth(&i.then)).max(items_depth(&i.otherwise)),
    }
}

pub(super) fn below_type(kind: &TypeKind) -> u32 {
    match kind {
        TypeKind::Name(_) | TypeKind::Error => 0,
        TypeKind::Power(base, _) => base.depth,
        TypeKind::Array(element) => element.depth,
        TypeKind::Tuple(types) => deepest(types.iter().map(|t| t.depth)),
        TypeKind::Function(params, result) => deepest(params.iter().map(|t| t.depth)).max(result.depth),
    }
}

fn deepest(depths: impl Iterator<Item = u32>) -> u32 {
    depths.max().unwrap_or(0)
}

fn expr_depth(expr: Option<&Expr>) -> u32 {
    expr.map_or(0, |e| e.depth)
}

fn type_depth(ty: Option<&TypeExpr>) -> u32 {
    ty.map_or(0, |t| t.depth)
}

fn items_depth(items: &[Item]) -> u32 {
    deepest(items.iter().map(|i| i.depth))
}

fn params_depth(params: &[FnParam]) -> u32 {
    deepest(params.iter().map(|p| type_depth(p.ty.as_ref()).max(expr_depth(p.default.as_ref()))))
}
