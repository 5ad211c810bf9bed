//! The names of files: what each defines, and what its `use`s bring.

use super::files::Loaded;
use super::fonts::Fonts;
use super::stdlib::{self, MODULES};
use crate::diagnostic::{Code, Diagnostic};
use crate::source::Span;
use crate::suggest::nearest;
use crate::syntax::ast::{FunctionDecl, Ident, Item, ItemKind, Let, Model, UsePath};
use std::collections::{HashMap, HashSet};

/// Names that the texts of a session have brought, with the files that define them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Seen {
    pub(crate) names: HashMap<String, usize>,
    /// Modules used whole.
    pub(crate) whole: HashMap<String, usize>,
}

/// A file's names.
#[derive(Debug, Default)]
pub(crate) struct Module<'a> {
    /// As shown to people.
    pub(super) name: &'a str,
    /// Whether it is of the standard library.
    pub(super) std: bool,
    /// The file's text as a tree.
    pub(super) items: &'a [Item],
    /// Its definitions by name.
    pub(super) definitions: HashMap<&'a str, Definition<'a>>,
    /// Names in the parentheses of `use`: the module and the name there (the same).
    pub(super) imports: HashMap<&'a str, usize>,
    /// Modules used whole, by the last part of their name.
    pub(super) whole: HashMap<&'a str, usize>,
    /// Names that a `use` should have brought, whose module could not be had, or that a statement which could not be
    /// read may declare.
    pub(super) broken: HashSet<&'a str>,
    /// The fonts that it names, or why they cannot be read.
    pub(super) fonts: Option<&'a Fonts>,
    /// Its statements in the scope of a session's model.
    pub(super) inner: &'a [Item],
    /// The names that were entered into a session before it.
    pub(super) seen: Option<&'a Seen>,
    /// Whether those names go before its own.
    pub(super) earlier: bool,
}

impl<'a> Module<'a> {
    /// The file that brings a name which is not defined here.
    pub(super) fn import(&self, name: &str) -> Option<usize> {
        self.imports.get(name).or_else(|| self.seen?.names.get(name)).copied()
    }

    /// The module that is used whole under a name.
    pub(super) fn whole(&self, name: &str) -> Option<usize> {
        self.whole.get(name).or_else(|| self.seen?.whole.get(name)).copied()
    }

    /// All names that a `use`, or an earlier text of a session, brings.
    pub(super) fn imported(&self) -> impl Iterator<Item = &'a str> {
        let seen = self.seen.into_iter().flat_map(|s| s.names.keys().map(String::as_str));
        self.imports.keys().copied().chain(seen)
    }
}

impl<'a> Module<'a> {
    /// The names that other files can use.
    pub(super) fn public_names(&self) -> impl Iterator<Item = &'a str> {
        self.definitions.keys().copied().filter(|name| !is_private(name))
    }
}

/// A top-level definition.
#[derive(Clone, Copy, Debug)]
pub(super) enum Definition<'a> {
    Function(&'a FunctionDecl),
    /// The binding, and the way to the name in its pattern.
    Let(&'a Let),
    Model(&'a Model),
}

impl<'a> Definition<'a> {
    /// The place of its name.
    pub(super) fn span(self) -> Span {
        match self {
            Definition::Function(decl) => decl.name.span,
            Definition::Let(decl) => decl.pattern.span(),
            Definition::Model(model) => model.name.span,
        }
    }
}

/// The names of every file.
pub(crate) fn index(loaded: &[Loaded]) -> (Vec<Module<'_>>, Vec<Diagnostic>) {
    let mut diagnostics = Vec::new();
    let mut modules: Vec<Module<'_>> = loaded
        .iter()
        .map(|file| {
            let mut module = Module {
                name: &file.name,
                std: file.std,
                items: &file.ast.items,
                inner: &file.inner,
                fonts: Some(&file.fonts),
                seen: Some(&file.seen),
                earlier: file.earlier,
                ..Module::default()
            };
            module.broken = file.ast.unread.iter().map(String::as_str).collect();
            for item in module.items {
                define(&mut module, item, &mut diagnostics);
            }
            module
        })
        .collect();
    for (id, file) in loaded.iter().enumerate() {
        for (item, target) in &file.uses {
            let ItemKind::Use(u) = &file.ast.items[*item].kind else { continue };
            for name in u.names.iter().flatten() {
                match target {
                    // A file that uses itself is a circle, which was reported.
                    Some(target) if *target == id => {}
                    Some(target) => {
                        diagnostics.extend(unknown_import(name, &modules[*target]));
                        diagnostics.extend(colliding_import(name, *target, &modules[id]));
                        modules[id].imports.insert(&name.text, *target);
                    }
                    None => _ = modules[id].broken.insert(&name.text),
                }
            }
            if u.names.is_none()
                && let Some(name) = whole_name(&u.path)
            {
                match target {
                    Some(target) => _ = modules[id].whole.insert(name, *target),
                    None => _ = modules[id].broken.insert(name),
                }
            }
        }
    }
    (modules, diagnostics)
}

/// The name of a module that is used whole: the last part of its own, or of its file's without the ending.
pub(crate) fn whole_name(path: &UsePath) -> Option<&str> {
    match path {
        UsePath::Module(parts) => parts.last().map(|last| last.text.as_str()),
        UsePath::File(path, _) => {
            let file = path.rsplit(['/', '\\']).next()?;
            Some(file.strip_suffix(".gml").unwrap_or(file))
        }
    }
}

/// Whether a name is for its own file only.
pub(super) fn is_private(name: &str) -> bool {
    name.starts_with('_')
}

/// The error for the use of a private name from another file.
pub(super) fn private_name(name: &str, definition: Definition<'_>, span: Span) -> Diagnostic {
    Diagnostic::new(Code::PrivateName, span, format!("'{name}' is private to the file that defines it"))
        .related(definition.span(), "defined here")
        .hint("a name that begins with '_' cannot be used from another file")
}

/// A name that stands for something else in the file already.
fn colliding_import(name: &Ident, target: usize, module: &Module<'_>) -> Option<Diagnostic> {
    if let Some(own) = module.definitions.get(name.text.as_str()) {
        let message = format!("'{}' is imported from another file and also defined here", name.text);
        return Some(Diagnostic::new(Code::DuplicateName, name.span, message).related(own.span(), "defined here"));
    }
    module.imports.get(name.text.as_str()).filter(|before| **before != target)?;
    let message = format!("'{}' is imported from two files", name.text);
    let error = Diagnostic::new(Code::DuplicateName, name.span, message);
    Some(error.hint("import one of them as a whole, by `use` without names in parentheses, and write MODULE.NAME"))
}

fn unknown_import(name: &Ident, module: &Module<'_>) -> Option<Diagnostic> {
    if module.broken.contains(name.text.as_str()) {
        return None;
    }
    if let Some(definition) = module.definitions.get(name.text.as_str()) {
        return is_private(&name.text).then(|| private_name(&name.text, *definition, name.span));
    }
    let error =
        Diagnostic::new(Code::UnknownName, name.span, format!("{} has no '{}'", quoted(module.name), name.text));
    if module.std
        && let Some(home) = stdlib::module_of(&name.text)
    {
        let home = MODULES[home].0;
        return Some(error.hint(format!("'{0}' is in {home}: add `use {home} ({0})`", name.text)));
    }
    Some(match nearest(&name.text, module.public_names()) {
        Some(near) => error.did_you_mean(name.span, near),
        None => error,
    })
}

fn quoted(name: &str) -> String {
    format!("'{name}'")
}

fn define<'a>(module: &mut Module<'a>, item: &'a Item, diagnostics: &mut Vec<Diagnostic>) {
    let mut add = |name: &'a Ident, definition: Definition<'a>| {
        if let Some(before) = module.definitions.get(name.text.as_str()) {
            diagnostics.push(
                Diagnostic::new(Code::DuplicateName, name.span, format!("'{}' is defined twice", name.text))
                    .related(before.span(), "first defined here"),
            );
        } else if name.text != "_" {
            module.definitions.insert(&name.text, definition);
        }
    };
    match &item.kind {
        ItemKind::Function(decl) => add(&decl.name, Definition::Function(decl)),
        ItemKind::Model(model) => add(&model.name, Definition::Model(model)),
        ItemKind::Let(decl) => decl.pattern.names().into_iter().for_each(|name| add(name, Definition::Let(decl))),
        // Derivatives are paired with their functions later.
        ItemKind::Derivative(_) | ItemKind::Use(_) | ItemKind::Error => {}
        ItemKind::Param(_) | ItemKind::Input(_) | ItemKind::Part(_) | ItemKind::Measure(_) | ItemKind::Require(_) => {
            diagnostics.push(
                Diagnostic::new(Code::Misplaced, item.span, "this belongs in a model")
                    .hint("write it between the braces of `model name { ... }`"),
            )
        }
        ItemKind::For(_) | ItemKind::If(_) => {
            diagnostics.push(Diagnostic::new(Code::Misplaced, item.span, "a statement like this belongs in a model"));
        }
    }
}
