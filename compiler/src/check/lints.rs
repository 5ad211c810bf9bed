//! Warnings that names alone tell: what is defined and never used, and what hides a function of the library.

use super::builtins;
use super::stdlib;
use super::walk::{Binder, Scope, Walk};
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::syntax::ast::{Ident, Item, ItemKind};

/// The warnings for a file without errors.
pub(super) fn lints(items: &[Item]) -> Vec<Diagnostic> {
    let mut walk = Walk(Names::default());
    // Names of the file's top are known throughout, and other files may use what it defines.
    for item in items {
        match &item.kind {
            ItemKind::Use(u) => u.names.iter().flatten().for_each(|name| walk.0.declare(name, Some(Definition::Use))),
            ItemKind::Function(decl) => walk.0.declare(&decl.name, None),
            ItemKind::Let(decl) => walk.bind(&decl.pattern, Binder::Other),
            ItemKind::Model(model) => walk.0.declare(&model.name, None),
            _ => {}
        }
    }
    for item in items {
        match &item.kind {
            ItemKind::Function(decl) => walk.function(&decl.params, &decl.body),
            ItemKind::Let(decl) => walk.expr(&decl.value),
            _ => walk.items(std::slice::from_ref(item), None),
        }
    }
    walk.0.truncate(0);
    walk.0.warnings.extend(items.iter().filter_map(hides_the_library));
    walk.0.warnings
}

/// A definition that is there to be used.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Definition {
    LetOrFunction,
    Input,
    Use,
}

struct Name<'a> {
    ident: &'a Ident,
    /// None for what need not be used: parameters of functions, whose number is their caller's affair, the names of a
    /// tuple, which are often there for the others' sake, parts, names for other files, and the model's parameters, of
    /// which the checker speaks.
    definition: Option<Definition>,
    used: bool,
}

#[derive(Default)]
struct Names<'a> {
    scope: Vec<Name<'a>>,
    warnings: Vec<Diagnostic>,
}

impl<'a> Names<'a> {
    fn declare(&mut self, ident: &'a Ident, definition: Option<Definition>) {
        self.scope.push(Name { ident, definition, used: ident.text.starts_with('_') });
    }
}

impl<'a> Scope<'a> for Names<'a> {
    fn used(&mut self, text: &'a str) {
        if let Some(name) = self.scope.iter_mut().rev().find(|n| n.ident.text == text) {
            name.used = true;
        }
    }

    fn bind(&mut self, name: &'a Ident, binder: Binder) {
        self.declare(
            name,
            match binder {
                Binder::Let | Binder::Function => Some(Definition::LetOrFunction),
                Binder::Input => Some(Definition::Input),
                Binder::Other => None,
            },
        );
    }

    fn len(&self) -> usize {
        self.scope.len()
    }

    fn truncate(&mut self, len: usize) {
        for name in self.scope.split_off(len).into_iter().filter(|n| !n.used) {
            let Some(definition) = name.definition else { continue };
            let (text, span) = (&name.ident.text, name.ident.span);
            let message = match definition {
                Definition::LetOrFunction => format!("'{text}' is not used"),
                Definition::Input => format!("the input '{text}' is not used"),
                Definition::Use => format!("'{text}' is imported but not used"),
            };
            let warning = Diagnostic::new(Code::UnusedName, span, message);
            self.warnings.push(if definition == Definition::Use {
                warning.hint("remove it")
            } else {
                warning.suggest(format!("if this is intended, rename it to '_{text}'"), [Edit::before(span, "_")])
            });
        }
    }
}

/// A function of the file's own in the place of one of the library, which is known without `use`.
fn hides_the_library(item: &Item) -> Option<Diagnostic> {
    let ItemKind::Function(decl) = &item.kind else { return None };
    let name = &decl.name.text;
    let home = match stdlib::module_of(name) {
        Some(module) => stdlib::MODULES[module].0.to_owned(),
        None => builtins::names().find(|n| n == name).map(|_| "the language".to_owned())?,
    };
    let message = format!("this hides the function '{name}' of {home}");
    Some(Diagnostic::new(Code::HiddenFunction, decl.name.span, message).hint("give it another name"))
}
