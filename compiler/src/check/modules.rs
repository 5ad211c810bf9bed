//! Files: the main one, those that it uses, and the modules of the standard library whose names occur.

use super::free;
use super::stdlib::{self, MODULES};
use crate::diagnostic::{Diagnostic, Edit};
use crate::source::{FileId, Loader, Sources, Span};
use crate::suggest::nearest;
use crate::syntax::ast::{File, FunctionDecl, Ident, Item, ItemKind, Let, Model, Pattern, UsePath};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// How many files a script may use, directly or not.
const FILE_LIMIT: usize = 256;

/// A file that was read, and for each of its `use`s (by item index) the file that it names.
#[derive(Default)]
pub(super) struct Loaded {
    pub(super) name: String,
    pub(super) std: bool,
    /// Shared with other compilations where it is the library's.
    pub(super) ast: Arc<File>,
    pub(super) uses: Vec<(usize, Option<usize>)>,
    /// Of a text entered into a session: what stands in the scope of the session's model.
    pub(super) inner: Vec<Item>,
    /// Of such a text: the names of those before it.
    pub(super) seen: Arc<Seen>,
    /// Of such a text: its own names mean what they meant before it.
    pub(super) earlier: bool,
}

/// Names that the texts of a session have brought, with the files that define them.
#[derive(Clone, Debug, Default)]
pub(super) struct Seen {
    pub(super) names: HashMap<String, usize>,
    /// Modules used whole.
    pub(super) whole: HashMap<String, usize>,
}

/// A file's names.
#[derive(Debug, Default)]
pub(super) struct Module<'a> {
    /// As shown to people.
    pub(super) name: &'a str,
    /// Whether it is of the standard library.
    pub(super) std: bool,
    /// The file's text as a tree.
    pub(super) items: &'a [Item],
    /// What it defines.
    pub(super) definitions: HashMap<&'a str, Definition<'a>>,
    /// Names in the parentheses of `use`: the module and the name there (the same).
    pub(super) imports: HashMap<&'a str, usize>,
    /// Modules used whole, by the last part of their name.
    pub(super) whole: HashMap<&'a str, usize>,
    /// Names that a `use` should have brought, whose module could not be had, or that a statement which could not be read
    /// may declare.
    pub(super) broken: HashSet<&'a str>,
    /// Its statements in the scope of a session's model.
    pub(super) inner: &'a [Item],
    /// What was entered into a session before it.
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
    /// Where its name stands.
    pub(super) fn span(self) -> Span {
        match self {
            Definition::Function(decl) => decl.name.span,
            Definition::Let(decl) => pattern_span(&decl.pattern),
            Definition::Model(model) => model.name.span,
        }
    }
}

/// Where a pattern stands.
pub(super) fn pattern_span(pattern: &Pattern) -> Span {
    match pattern {
        Pattern::Name(ident) => ident.span,
        Pattern::Tuple(_, span) => *span,
    }
}

/// Reads the main file and all that it needs. Module 0 is the main file.
pub(super) fn load(sources: &mut Sources, loader: &dyn Loader, main: FileId) -> (Vec<Loaded>, Vec<Diagnostic>) {
    let (name, text) = match sources.get(main) {
        Some(file) => (file.name.clone(), file.text.clone()),
        None => (String::new(), String::new()),
    };
    let mut files = Files::default();
    let mut reader = Reader { sources, loader, files: &mut files, diagnostics: Vec::new() };
    reader.parse(main, name.clone(), &text, false);
    reader.follow_from(0);
    let diagnostics = reader.diagnostics;
    (files.loaded, diagnostics)
}

/// Reads what a text entered into a session needs, and adds both; with the text's index.
pub(super) fn load_entered(
    files: &mut Files,
    sources: &mut Sources,
    loader: &dyn Loader,
    entered: Loaded,
) -> (usize, Vec<Diagnostic>) {
    let id = files.loaded.len();
    files.loaded.push(entered);
    let mut reader = Reader { sources, loader, files, diagnostics: Vec::new() };
    reader.follow_from(id);
    (id, reader.diagnostics)
}

/// The files that were read.
#[derive(Default)]
pub(super) struct Files {
    pub(super) loaded: Vec<Loaded>,
    /// Index of a file by its name.
    pub(super) ids: HashMap<String, usize>,
}

struct Reader<'s> {
    sources: &'s mut Sources,
    loader: &'s dyn Loader,
    files: &'s mut Files,
    diagnostics: Vec<Diagnostic>,
}

impl Reader<'_> {
    fn parse(&mut self, file: FileId, name: String, text: &str, std: bool) -> usize {
        let (ast, diagnostics) = crate::syntax::parse(file, text);
        self.diagnostics.extend(diagnostics);
        self.add(Loaded { name, std, ast: Arc::new(ast), ..Loaded::default() })
    }

    fn add(&mut self, loaded: Loaded) -> usize {
        let id = self.files.loaded.len();
        self.files.ids.insert(loaded.name.clone(), id);
        self.files.loaded.push(loaded);
        id
    }

    /// Reads what the files from `first` on use, directly or not.
    fn follow_from(&mut self, first: usize) {
        let mut next = first;
        while next < self.files.loaded.len() {
            self.follow(next);
            next += 1;
        }
        self.report_cycles(first);
    }

    fn std_module(&mut self, index: usize) -> usize {
        let (name, text) = MODULES[index];
        if let Some(id) = self.files.ids.get(name) {
            return *id;
        }
        let (ast, diagnostics) = stdlib::parsed(index);
        self.sources.add_library(index, name, text);
        self.diagnostics.extend_from_slice(diagnostics);
        self.add(Loaded { name: name.to_owned(), std: true, ast: ast.clone(), ..Loaded::default() })
    }

    /// Reads what a file uses, and the modules of the library whose names occur in it.
    fn follow(&mut self, id: usize) {
        let std: Vec<usize> = {
            let file = &self.files.loaded[id];
            let names = [&file.ast.items, &file.inner].into_iter().flat_map(|items| free::of_items(items));
            let mut modules: Vec<usize> = names.filter_map(stdlib::module_of).collect();
            modules.sort_unstable();
            modules.dedup();
            modules
        };
        for index in std {
            self.std_module(index);
        }
        let uses: Vec<(usize, UsePath)> = self.files.loaded[id]
            .ast
            .items
            .iter()
            .enumerate()
            .filter_map(|(i, item)| match &item.kind {
                ItemKind::Use(u) => Some((i, u.path.clone())),
                _ => None,
            })
            .collect();
        for (item, path) in uses {
            let target = match &path {
                UsePath::Module(parts) => self.use_module(parts),
                UsePath::File(path, span) => self.use_file(id, path, *span),
            };
            self.files.loaded[id].uses.push((item, target));
        }
    }

    fn use_module(&mut self, parts: &[Ident]) -> Option<usize> {
        let (first, last) = (parts.first()?, parts.last()?);
        let span = first.span.to(last.span);
        let name = parts.iter().map(|p| p.text.as_str()).collect::<Vec<_>>().join(".");
        if let Some(index) = MODULES.iter().position(|(n, _)| *n == name) {
            return Some(self.std_module(index));
        }
        let mut error = Diagnostic::error("unknown-module", span, format!("there is no module '{name}'"));
        let list = MODULES.iter().map(|(n, _)| *n);
        let full = format!("std.{name}");
        error = match list.clone().find(|module| *module == full).or_else(|| nearest(&name, list.clone())) {
            Some(near) => error.did_you_mean(span, near),
            None if last.text == "gml" => {
                error.suggest("a file is named in quotes", [Edit::before(span, "\""), Edit::after(span, "\"")])
            }
            None if first.text != "std" => error.hint("a file is named in quotes: use \"column.gml\" (column)"),
            None => error.hint(format!("the modules are {}", list.collect::<Vec<_>>().join(", "))),
        };
        self.diagnostics.push(error);
        None
    }

    fn use_file(&mut self, from: usize, path: &str, span: Span) -> Option<usize> {
        if self.files.loaded.len() >= FILE_LIMIT {
            self.diagnostics.push(Diagnostic::error(
                "too-many-files",
                span,
                format!("the script uses more than {FILE_LIMIT} files"),
            ));
            return None;
        }
        match self.loader.load(path, &self.files.loaded[from].name) {
            Ok(file) => {
                if let Some(id) = self.files.ids.get(&file.name) {
                    return Some(*id);
                }
                let id = self.sources.add(file.name.clone(), file.text.clone());
                Some(self.parse(id, file.name, &file.text, false))
            }
            // What is wrong with the text was said.
            Err(_)
                if self
                    .diagnostics
                    .iter()
                    .any(|d| d.span.file == span.file && d.span.start > span.start && d.span.end <= span.end) =>
            {
                None
            }
            Err(reason) => {
                self.diagnostics.push(Diagnostic::error("file-not-found", span, reason));
                None
            }
        }
    }

    /// One error for every `use` that closes a circle of files.
    fn report_cycles(&mut self, first: usize) {
        // Depth first, without recursion: (file, next use); a file on the path is grey.
        let mut done = vec![false; self.files.loaded.len()];
        let mut grey = vec![false; self.files.loaded.len()];
        let mut path = vec![(first, 0)];
        grey[first] = true;
        while let Some((file, next)) = path.pop() {
            let Some((item, target)) = self.files.loaded[file].uses.get(next).copied() else {
                grey[file] = false;
                done[file] = true;
                continue;
            };
            path.push((file, next + 1));
            let Some(target) = target else { continue };
            if self.files.loaded[file].std || self.files.loaded[target].std || done[target] {
                continue;
            }
            if grey[target] {
                let start = path.iter().position(|(f, _)| *f == target).unwrap_or(0);
                let mut names: Vec<&str> =
                    path[start..].iter().map(|(f, _)| self.files.loaded[*f].name.as_str()).collect();
                names.push(&self.files.loaded[target].name);
                let message = format!("files use each other in a circle: {}", names.join(" -> "));
                let span = self.files.loaded[file].ast.items[item].span;
                self.diagnostics.push(
                    Diagnostic::error("use-cycle", span, message)
                        .hint("move what both need into a file that uses neither"),
                );
                continue;
            }
            grey[target] = true;
            path.push((target, 0));
        }
    }
}

/// The names of every file.
pub(super) fn index(loaded: &[Loaded]) -> (Vec<Module<'_>>, Vec<Diagnostic>) {
    let mut diagnostics = Vec::new();
    let mut modules: Vec<Module<'_>> = loaded
        .iter()
        .map(|file| {
            let mut module = Module {
                name: &file.name,
                std: file.std,
                items: &file.ast.items,
                inner: &file.inner,
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
pub(super) fn whole_name(path: &UsePath) -> Option<&str> {
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
    Diagnostic::error("private-name", span, format!("'{name}' is private to the file that defines it"))
        .related(definition.span(), "defined here")
        .hint("a name that begins with '_' cannot be used from another file")
}

/// A name that stands for something else in the file already.
fn colliding_import(name: &Ident, target: usize, module: &Module<'_>) -> Option<Diagnostic> {
    if let Some(own) = module.definitions.get(name.text.as_str()) {
        let message = format!("'{}' is brought from another file, and defined here too", name.text);
        return Some(Diagnostic::error("duplicate-name", name.span, message).related(own.span(), "defined here"));
    }
    module.imports.get(name.text.as_str()).filter(|before| **before != target)?;
    let message = format!("'{}' is brought from two files", name.text);
    let error = Diagnostic::error("duplicate-name", name.span, message);
    Some(error.hint("`use` one of them whole, without names in parentheses, and write its name before a dot"))
}

fn unknown_import(name: &Ident, module: &Module<'_>) -> Option<Diagnostic> {
    if module.broken.contains(name.text.as_str()) {
        return None;
    }
    if let Some(definition) = module.definitions.get(name.text.as_str()) {
        return is_private(&name.text).then(|| private_name(&name.text, *definition, name.span));
    }
    let error = Diagnostic::error("unknown-name", name.span, format!("{} has no '{}'", quoted(module.name), name.text));
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
                Diagnostic::error("duplicate-name", name.span, format!("'{}' is defined twice", name.text))
                    .related(before.span(), "first defined here"),
            );
        } else if name.text != "_" {
            module.definitions.insert(&name.text, definition);
        }
    };
    match &item.kind {
        ItemKind::Function(decl) => add(&decl.name, Definition::Function(decl)),
        ItemKind::Model(model) => add(&model.name, Definition::Model(model)),
        ItemKind::Let(decl) => {
            let mut open = vec![&decl.pattern];
            while let Some(pattern) = open.pop() {
                match pattern {
                    Pattern::Name(name) => add(name, Definition::Let(decl)),
                    Pattern::Tuple(patterns, _) => open.extend(patterns.iter().rev()),
                }
            }
        }
        // Derivatives are paired with their functions later.
        ItemKind::Derivative(_) | ItemKind::Use(_) | ItemKind::Error => {}
        ItemKind::Param(_) | ItemKind::Input(_) | ItemKind::Part(_) | ItemKind::Require(_) => diagnostics.push(
            Diagnostic::error("misplaced", item.span, "this belongs in a model")
                .hint("write it between the braces of `model name { ... }`"),
        ),
        ItemKind::For(_) | ItemKind::If(_) => {
            diagnostics.push(Diagnostic::error("misplaced", item.span, "a statement like this belongs in a model"));
        }
    }
}
