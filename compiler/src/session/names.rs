//! Names in scope, for completion and help.

use super::Session;
use super::items::{defined, in_scope};
use crate::check::builtins::{self, Builtin};
use crate::check::entered::Step;
use crate::check::signature::declared;
use crate::check::stdlib;
use crate::check::typed::Type;
use crate::source::{FileId, Loader};
use crate::syntax::ast::{FnParam, Item, ItemKind};
use crate::syntax::{self, type_text};
use std::collections::BTreeMap;

/// The kind of thing that a name stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A free parameter of the current model.
    Parameter,
    /// An input of the current model.
    Input,
    /// A `let`.
    Value,
    /// A function.
    Function,
    /// A model.
    Model,
    /// A part of the current model.
    Part,
    /// A module that is used whole.
    Module,
    /// Built in, or of the standard library, which is known everywhere.
    Library,
}

/// A name with its description.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Known {
    /// The name.
    pub name: String,
    /// The kind of thing that it stands for.
    pub kind: Kind,
    /// How it is declared: `fn mix(a, b, t)`, `param r: length`.
    pub declaration: String,
    /// The doc comment.
    pub doc: String,
    /// Labels of its arguments.
    pub labels: Vec<String>,
    /// The module that it comes from: `std.math`; empty for what was entered or built in.
    pub module: String,
}

impl Session {
    /// All names that can be used, with what they stand for, sorted.
    #[must_use]
    pub fn names(&self) -> BTreeMap<String, Kind> {
        let library = stdlib::MODULES.iter().flat_map(|(_, text)| stdlib::names(text)).chain(builtins::names());
        let mut names: BTreeMap<String, Kind> = library.map(|name| (name.to_owned(), Kind::Library)).collect();
        let in_scope = &self.scope.names;
        names.extend(in_scope.seen.whole.keys().map(|name| (name.clone(), Kind::Module)));
        let current = in_scope.current.iter().flat_map(|current| &current.names);
        for name in in_scope.seen.names.keys().chain(current) {
            names.insert(name.clone(), self.item(name).map_or(Kind::Value, kind));
        }
        names
    }

    /// The description of a name (`mix`, `std.math.mix`): its declaration, doc comment and arguments' labels.
    #[must_use]
    pub fn known(&self, name: &str) -> Option<Known> {
        if let Some(item) = self.item(name) {
            let file = self.scope.names.seen.names.get(name).and_then(|file| self.scope.files.loaded.get(*file));
            let module = file.map(|f| f.name.as_str()).filter(|m| m.starts_with("std."));
            return Some(describe(name, item, module.unwrap_or("")));
        }
        if let Some(builtin) = Builtin::named(name) {
            let labels: Vec<String> = builtin.parameters().iter().map(|l| (*l).to_owned()).collect();
            return Some(Known {
                name: name.to_owned(),
                kind: Kind::Library,
                declaration: format!("fn {name}({})", labels.join(", ")),
                doc: "Built in.".to_owned(),
                labels,
                module: String::new(),
            });
        }
        let (module, member) = name.rsplit_once('.').map_or((None, name), |(m, n)| (Some(m), n));
        let modules = stdlib::MODULES.iter();
        let (module, text) = modules
            .filter(|(m, _)| module.is_none_or(|given| *m == given || m.rsplit('.').next() == Some(given)))
            .find(|(_, text)| stdlib::names(text).any(|n| n == member))?;
        let (file, _) = syntax::parse(FileId::default(), text);
        let item = file.items.iter().find(|i| i.defines(member))?;
        Some(describe(member, item, module))
    }

    /// The modules of the standard library: `std.math`.
    #[must_use]
    pub fn modules(&self) -> Vec<String> {
        stdlib::MODULES.iter().map(|(name, _)| (*name).to_owned()).collect()
    }

    /// The names that may follow a value, or the name of a module, and a dot.
    pub fn fields(&mut self, text: &str, loader: &dyn Loader) -> Vec<String> {
        let members = self.members(text);
        if !members.is_empty() {
            return members;
        }
        let texts = self.texts;
        let fields = self.with_expression(text, loader, |_, _, asked| {
            Ok(match &asked.ty {
                Type::Record(fields) => {
                    fields.iter().map(|(name, _)| name.to_string()).filter(|name| !name.is_empty()).collect()
                }
                Type::Tuple(parts) if parts.len() <= 3 => {
                    ["x", "y", "z"].iter().take(parts.len()).map(|n| (*n).to_owned()).collect()
                }
                _ => Vec::new(),
            })
        });
        // What is asked for completion has no number.
        self.texts = texts;
        fields.unwrap_or_default()
    }

    /// The names that a module of the library defines, or one that is used whole.
    fn members(&self, module: &str) -> Vec<String> {
        if let Some((_, text)) = stdlib::MODULES.iter().find(|(m, _)| *m == module) {
            return stdlib::names(text).map(str::to_owned).collect();
        }
        let file = self.scope.names.seen.whole.get(module).and_then(|id| self.scope.files.loaded.get(*id));
        file.map(|f| f.ast.items.iter().flat_map(defined).collect()).unwrap_or_default()
    }

    /// The item that defines a name in scope.
    fn item(&self, name: &str) -> Option<&Item> {
        let (files, names) = (&self.scope.files.loaded, &self.scope.names);
        let defines = |item: &&Item| item.defines(name);
        if let Some(current) = names.current.as_ref().filter(|c| c.names.contains(name)) {
            let mut inner = current.steps.iter().rev().filter_map(|step| match step {
                Step::Inner(file, index) => files.get(*file)?.inner.get(*index),
                Step::Hide(..) => None,
            });
            let model = match &files.get(current.file)?.ast.items.get(current.item)?.kind {
                ItemKind::Model(model) => &model.items[..],
                _ => &[],
            };
            return inner.find(defines).or_else(|| in_scope(model).into_iter().find(defines));
        }
        files.get(*names.seen.names.get(name)?)?.ast.items.iter().find(defines)
    }
}

fn kind(item: &Item) -> Kind {
    match &item.kind {
        ItemKind::Function(_) => Kind::Function,
        ItemKind::Model(_) => Kind::Model,
        ItemKind::Param(_) => Kind::Parameter,
        ItemKind::Input(_) => Kind::Input,
        ItemKind::Part(_) => Kind::Part,
        _ => Kind::Value,
    }
}

fn describe(name: &str, item: &Item, module: &str) -> Known {
    let labels_of = |params: &[FnParam]| -> Vec<String> {
        params.iter().filter_map(|p| Some(p.pattern.name()?.text.clone())).collect()
    };
    let (declaration, labels) = match &item.kind {
        ItemKind::Function(decl) => (declared(decl), labels_of(&decl.params)),
        ItemKind::Param(decl) => (format!("param {name}: {}", type_text(&decl.ty)), Vec::new()),
        ItemKind::Input(decl) => (format!("input {name}: {}", type_text(&decl.ty)), Vec::new()),
        ItemKind::Part(_) => (format!("part {name}"), vec!["u".to_owned(), "v".to_owned()]),
        ItemKind::Measure(_) => (format!("measure {name}"), Vec::new()),
        ItemKind::Model(model) => {
            let names = model.items.iter().filter_map(|item| match &item.kind {
                ItemKind::Param(decl) | ItemKind::Input(decl) => Some(decl.name.text.clone()),
                _ => None,
            });
            (format!("model {name}"), names.collect())
        }
        ItemKind::Let(decl) => (
            format!("let {name}{}", decl.ty.as_ref().map(|ty| format!(": {}", type_text(ty))).unwrap_or_default()),
            Vec::new(),
        ),
        _ => (name.to_owned(), Vec::new()),
    };
    Known {
        name: name.to_owned(),
        kind: kind(item),
        declaration,
        doc: item.doc.clone(),
        labels,
        module: module.to_owned(),
    }
}
