//! The names that items define and bring.

use crate::check::entered::Line;
use crate::check::signature;
use crate::syntax::ast::{self, Item, ItemKind, Pattern};
use std::collections::HashSet;

/// The names that an item defines.
pub(super) fn defined(item: &Item) -> Vec<String> {
    let mut names = Vec::new();
    match &item.kind {
        ItemKind::Function(decl) => names.push(decl.name.text.clone()),
        ItemKind::Model(model) => names.push(model.name.text.clone()),
        ItemKind::Let(decl) => pattern_names(&decl.pattern, &mut names),
        _ => {}
    }
    names
}

/// The names that a `use` brings.
pub(super) fn brought(item: &Item) -> Vec<String> {
    match &item.kind {
        ItemKind::Use(u) => u.names.iter().flatten().map(|n| n.text.clone()).collect(),
        _ => Vec::new(),
    }
}

/// The names in a pattern.
pub(super) fn pattern_names(pattern: &Pattern, out: &mut Vec<String>) {
    match pattern {
        Pattern::Name(name) => out.push(name.text.clone()),
        Pattern::Tuple(parts, _) => parts.iter().for_each(|p| pattern_names(p, out)),
    }
}

/// The names of a model's body that are in scope at its end.
pub(super) fn names_of_model(items: &[Item]) -> HashSet<String> {
    let mut names = HashSet::new();
    for item in items {
        names.extend(defined(item));
        match &item.kind {
            ItemKind::Param(decl) | ItemKind::Input(decl) => _ = names.insert(decl.name.text.clone()),
            ItemKind::Part(decl) => _ = names.insert(decl.name.text.clone()),
            ItemKind::For(decl) => names.extend(parts_of(&decl.items)),
            ItemKind::If(decl) => names.extend(parts_of(&decl.then).into_iter().chain(parts_of(&decl.otherwise))),
            _ => {}
        }
    }
    names
}

/// Parts in loops and conditions, which are in scope after them.
fn parts_of(items: &[Item]) -> Vec<String> {
    let mut names = Vec::new();
    for item in items {
        match &item.kind {
            ItemKind::Part(decl) => names.push(decl.name.text.clone()),
            ItemKind::For(decl) => names.extend(parts_of(&decl.items)),
            ItemKind::If(decl) => {
                names.extend(parts_of(&decl.then));
                names.extend(parts_of(&decl.otherwise));
            }
            _ => {}
        }
    }
    names
}

/// The kind of a line; `None` for a line with errors, which were reported.
pub(super) fn line_of(item: &Item) -> Option<Line> {
    Some(match &item.kind {
        ItemKind::Use(u) => Line::Use(use_text(u)),
        ItemKind::Function(decl) => Line::Function(signature::declared(decl)),
        ItemKind::Derivative(decl) => Line::Derivative(decl.function.text.clone()),
        ItemKind::Let(decl) => Line::Let(if let Pattern::Name(name) = &decl.pattern {
            name.text.clone()
        } else {
            defined(item).join(", ")
        }),
        ItemKind::Model(model) => Line::Model(model.name.text.clone()),
        _ => return None,
    })
}

fn use_text(u: &ast::Use) -> String {
    let path = match &u.path {
        ast::UsePath::Module(parts) => parts.iter().map(|p| p.text.as_str()).collect::<Vec<_>>().join("."),
        ast::UsePath::File(path, _) => format!("\"{path}\""),
    };
    match &u.names {
        Some(names) => format!("{path} ({})", names.iter().map(|n| n.text.as_str()).collect::<Vec<_>>().join(", ")),
        None => path,
    }
}
