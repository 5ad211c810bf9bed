//! The names that items define and bring.

use crate::check::entered::Line;
use crate::check::signature;
use crate::syntax::ast::{Item, ItemKind};
use crate::syntax::use_text;

/// The names that an item defines.
pub(super) fn defined(item: &Item) -> impl Iterator<Item = String> {
    item.names().into_iter().map(|name| name.text.clone())
}

/// The names that a `use` brings.
pub(super) fn brought(item: &Item) -> Vec<String> {
    match &item.kind {
        ItemKind::Use(u) => u.names.iter().flatten().map(|n| n.text.clone()).collect(),
        _ => Vec::new(),
    }
}

/// The items of a model's body whose names are in scope at its end; of loops and conditions the parts.
pub(super) fn in_scope(items: &[Item]) -> Vec<&Item> {
    fn collect<'i>(items: &'i [Item], nested: bool, out: &mut Vec<&'i Item>) {
        for item in items {
            match &item.kind {
                ItemKind::For(decl) => collect(&decl.items, true, out),
                ItemKind::If(decl) => [&decl.then, &decl.otherwise].iter().for_each(|items| collect(items, true, out)),
                ItemKind::Part(_) => out.push(item),
                _ if !nested => out.push(item),
                _ => {}
            }
        }
    }
    let mut all = Vec::new();
    collect(items, false, &mut all);
    all
}

/// The kind of a line; `None` for a line with errors, which were reported.
pub(super) fn line_of(item: &Item) -> Option<Line> {
    Some(match &item.kind {
        ItemKind::Use(u) => Line::Use(use_text(u)),
        ItemKind::Function(decl) => Line::Function(signature::declared(decl)),
        ItemKind::Derivative(decl) => Line::Derivative(decl.function.text.clone()),
        ItemKind::Let(_) => Line::Let(defined(item).collect::<Vec<_>>().join(", ")),
        ItemKind::Model(model) => Line::Model(model.name.text.clone()),
        _ => return None,
    })
}
