//! Files: the main one, those that it uses, and the modules of the standard library whose names occur.

use super::fonts::{self, Fonts};
use super::free;
use super::modules::Seen;
use super::stdlib::{self, MODULES};
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::source::{FileId, Loader, Sources, Span};
use crate::suggest::nearest;
use crate::syntax::ast::{File, Ident, Item, ItemKind, UsePath};
use std::collections::HashMap;
use std::sync::Arc;

/// Maximal number of files that a script uses, directly or not.
const FILE_LIMIT: usize = 256;

/// A file that was read, and for each of its `use`s (by item index) the file that it names.
#[derive(Default)]
pub(crate) struct Loaded {
    pub(crate) name: String,
    pub(crate) std: bool,
    /// Shared with other compilations where it is the library's.
    pub(crate) ast: Arc<File>,
    pub(crate) uses: Vec<(usize, Option<usize>)>,
    /// The fonts that it names, or why they cannot be read.
    pub(crate) fonts: Fonts,
    /// In a text entered into a session: the statements in the scope of the session's model.
    pub(crate) inner: Vec<Item>,
    /// In such a text: the names of the texts before it.
    pub(crate) seen: Arc<Seen>,
    /// In such a text: whether its own names keep their earlier meaning within it.
    pub(crate) earlier: bool,
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
pub(crate) fn load_entered(
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
pub(crate) struct Files {
    pub(crate) loaded: Vec<Loaded>,
    /// Index of a file by its name.
    pub(crate) ids: HashMap<String, usize>,
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
        // There are few files: the recursion is not deep.
        self.report_cycles(first, &mut Vec::new(), &mut vec![false; self.files.loaded.len()]);
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
            let mut modules: Vec<usize> = names.filter_map(stdlib::needed_by).collect();
            modules.sort_unstable();
            modules.dedup();
            modules
        };
        for index in std {
            self.std_module(index);
        }
        self.read_fonts(id);
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

    /// Reads the fonts that a file names.
    fn read_fonts(&mut self, id: usize) {
        let file = &self.files.loaded[id];
        let named = [&file.ast.items, &file.inner].into_iter().flat_map(|items| fonts::named_in(items));
        let named: Vec<String> = named.map(str::to_owned).collect();
        for path in named {
            let read = self.loader.load_font(&path, &self.files.loaded[id].name).map(|font| {
                let bytes = font.bytes.clone();
                self.sources.add_font(font);
                bytes
            });
            self.files.loaded[id].fonts.insert(path, read);
        }
    }

    fn use_module(&mut self, parts: &[Ident]) -> Option<usize> {
        let (first, last) = (parts.first()?, parts.last()?);
        let span = first.span.to(last.span);
        let name = parts.iter().map(|p| p.text.as_str()).collect::<Vec<_>>().join(".");
        if let Some(index) = MODULES.iter().position(|(n, _)| *n == name) {
            return Some(self.std_module(index));
        }
        let mut error = Diagnostic::new(Code::UnknownModule, span, format!("there is no module '{name}'"));
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
            self.diagnostics.push(Diagnostic::new(
                Code::TooManyFiles,
                span,
                format!("the script uses more than {FILE_LIMIT} files"),
            ));
            return None;
        }
        if path.trim().is_empty() {
            let error = Diagnostic::new(Code::FileNotFound, span, "this 'use' names no file");
            self.diagnostics.push(error.hint("write the name of a script: use \"column.gml\" (column)"));
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
            // The errors of the text were reported.
            Err(_)
                if self
                    .diagnostics
                    .iter()
                    .any(|d| d.span.file == span.file && d.span.start > span.start && d.span.end <= span.end) =>
            {
                None
            }
            Err(reason) => {
                let error = Diagnostic::new(Code::FileNotFound, span, reason);
                let whole = format!("{path}.gml");
                self.diagnostics.push(match self.loader.load(&whole, &self.files.loaded[from].name) {
                    Ok(_) => error
                        .suggest(format!("did you mean \"{whole}\"?"), [Edit::replace(span, format!("\"{whole}\""))]),
                    Err(_) => error,
                });
                None
            }
        }
    }

    /// One error for every `use` that closes a cycle of files: depth first, with the files on the path.
    fn report_cycles(&mut self, file: usize, path: &mut Vec<usize>, done: &mut Vec<bool>) {
        path.push(file);
        for (item, target) in self.files.loaded[file].uses.clone() {
            let Some(target) = target else { continue };
            if self.files.loaded[file].std || self.files.loaded[target].std || done[target] {
                continue;
            }
            let Some(start) = path.iter().position(|f| *f == target) else {
                self.report_cycles(target, path, done);
                continue;
            };
            let name = |f: &usize| self.files.loaded[*f].name.as_str();
            let span = self.files.loaded[file].ast.items[item].span;
            let error = if target == file {
                Diagnostic::new(Code::UseCycle, span, format!("'{}' uses itself", name(&file)))
                    .suggest("remove the 'use': a file knows all of its own names", [Edit::remove(span)])
            } else {
                let names: Vec<&str> = path[start..].iter().chain([&target]).map(name).collect();
                let message = format!("files use each other in a circle: {}", names.join(" -> "));
                Diagnostic::new(Code::UseCycle, span, message).hint("move what both need into a file that uses neither")
            };
            self.diagnostics.push(error);
        }
        path.pop();
        done[file] = true;
    }
}
