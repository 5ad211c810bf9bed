//! The scope of a session: texts entered one after another, each of which sees the names of those before
//! it, and a current model whose parameters, values and parts are in scope.
//!
//! An entered text becomes a file of its own, so that its items may stand in any order, and what was entered earlier
//! keeps the meaning that it had. Items and expressions that name something of the current model's body are checked
//! as if they stood at its end.

use super::Options;
use super::items::{brought, defined, in_scope, line_of};
use crate::check::entered::{Entered, Line, ModelScope, Request, Segment, Step};
use crate::check::files::{self, Files, Loaded};
use crate::check::free;
use crate::check::modules::{self, Seen};
use crate::diagnostic::{Diagnostic, Severity};
use crate::program::constants;
use crate::source::{FileId, Loader, SourceFile, Sources};
use crate::syntax::ast::{Item, ItemKind, Let, Pattern};
use crate::syntax::{self, Entry};
use std::collections::HashSet;
use std::sync::Arc;

/// Everything that is in scope.
#[derive(Default)]
pub(super) struct Scope {
    pub(super) files: Files,
    pub(super) names: Names,
}

/// The names, apart from the files that define them.
#[derive(Clone, Default)]
pub(super) struct Names {
    pub(super) seen: Arc<Seen>,
    pub(super) current: Option<Current>,
}

/// The model whose body is in scope.
#[derive(Clone)]
pub(super) struct Current {
    pub(super) file: usize,
    pub(super) item: usize,
    /// Names of its body, and those entered later that depend on them.
    pub(super) names: HashSet<String>,
    pub(super) steps: Vec<Step>,
}

/// A state to go back to.
pub(super) struct Mark {
    files: usize,
    names: Names,
}

impl Scope {
    pub(super) fn mark(&self) -> Mark {
        Mark { files: self.files.loaded.len(), names: self.names.clone() }
    }

    /// Forgets all since the mark.
    pub(super) fn restore(&mut self, mark: Mark) {
        self.files.loaded.truncate(mark.files);
        self.files.ids.retain(|_, id| *id < mark.files);
        self.names = mark.names;
    }

    /// Adds the files that a text uses, and as many of its entries as can be checked together.
    ///
    /// # Errors
    /// The errors of the files.
    pub(super) fn add(
        &mut self,
        (sources, loader): (&mut Sources, &dyn Loader),
        file: FileId,
        entries: &mut std::iter::Peekable<std::vec::IntoIter<Entry>>,
    ) -> Result<Segment, Vec<Diagnostic>> {
        let name = sources.get(file).map_or_else(String::new, |f| f.name.clone());
        let mut segment = Segment { files: vec![self.files.loaded.len()], lines: Vec::new(), model: false };
        let mut group = Group::new(&name, &self.names, self.files.loaded.len());
        let mut diagnostics = Vec::new();
        let mut scoped = false;
        while let Some(entry) = entries.peek() {
            if scoped && matches!(entry, Entry::Item(Item { kind: ItemKind::Model(_), .. })) {
                break;
            }
            let names_itself = names_itself(entry);
            if (group.defines(entry) || names_itself) && !self.is_inner(entry) {
                diagnostics.extend(self.close(std::mem::take(&mut group), sources, loader));
                group = Group::new(&name, &self.names, self.files.loaded.len());
                // `let a = a + 1` means the earlier a, and has to stand alone for it.
                group.loaded.earlier = names_itself;
                segment.files.push(group.index);
            } else if group.loaded.earlier {
                diagnostics.extend(self.close(std::mem::take(&mut group), sources, loader));
                group = Group::new(&name, &self.names, self.files.loaded.len());
                segment.files.push(group.index);
            }
            let Some(entry) = entries.next() else { break };
            segment.model |= matches!(&entry, Entry::Item(Item { kind: ItemKind::Model(_), .. }));
            scoped |= self.is_inner(&entry);
            segment.lines.extend(self.take(entry, &mut group));
        }
        diagnostics.extend(self.close(group, sources, loader));
        if diagnostics.iter().any(|d| d.severity == Severity::Error) { Err(diagnostics) } else { Ok(segment) }
    }

    /// Adds a script; its last model becomes the current one.
    ///
    /// # Errors
    /// The errors of the files.
    pub(super) fn add_script(
        &mut self,
        sources: &mut Sources,
        loader: &dyn Loader,
        script: SourceFile,
    ) -> Result<Segment, Vec<Diagnostic>> {
        let file = sources.add(script.name.clone(), script.text.clone());
        let (ast, mut diagnostics) = syntax::parse(file, &script.text);
        let first = self.files.loaded.len();
        let mut segment = Segment { files: vec![first], lines: Vec::new(), model: false };
        let mut group = Group::new(&script.name, &Names::default(), first);
        for item in ast.items {
            let entered = self.take_item(item, &mut group);
            let model = entered.filter(|e| matches!(e.line, Line::Model(_)));
            segment.model |= model.is_some();
            segment.lines.extend(model);
        }
        diagnostics.extend(self.close(group, sources, loader));
        if diagnostics.iter().any(|d| d.severity == Severity::Error) { Err(diagnostics) } else { Ok(segment) }
    }

    /// Whether an entry stands in the model's scope.
    fn is_inner(&self, entry: &Entry) -> bool {
        let item = match entry {
            Entry::Expression(_) => return true,
            Entry::Item(item) => item,
        };
        let takes = matches!(item.kind, ItemKind::Let(_) | ItemKind::Function(_) | ItemKind::Derivative(_));
        let Some(current) = self.names.current.as_ref().filter(|_| takes) else { return false };
        free::of_items(std::slice::from_ref(item)).iter().any(|name| current.names.contains(*name))
    }

    fn take(&mut self, entry: Entry, group: &mut Group) -> Option<Entered> {
        let inner = self.is_inner(&entry);
        let (line, item) = match entry {
            Entry::Item(item) if !inner => return self.take_item(item, group),
            Entry::Item(item) => (line_of(&item)?, item),
            Entry::Expression(value) => {
                let (span, depth) = (value.span, value.depth + 1);
                let decl = Let { pattern: Pattern::Tuple(Vec::new(), span), ty: None, value };
                (Line::Value, Item { doc: String::new(), span, kind: ItemKind::Let(decl), depth })
            }
        };
        let (span, index) = (item.span, group.loaded.inner.len());
        if let Some(current) = &mut self.names.current {
            current.names.extend(defined(&item));
            if line != Line::Value {
                current.steps.push(Step::Inner(group.index, index));
            }
        }
        group.loaded.inner.push(item);
        Some(Entered { line, span, file: group.index, inner: true, index, at: index })
    }

    /// An item of the file itself.
    fn take_item(&mut self, item: Item, group: &mut Group) -> Option<Entered> {
        let line = line_of(&item);
        let names: Vec<String> = defined(&item).collect();
        let index = group.loaded.ast.items.len();
        match &item.kind {
            ItemKind::Model(model) => {
                let names = in_scope(&model.items).into_iter().flat_map(defined).collect();
                self.names.current = Some(Current { file: group.index, item: index, names, steps: Vec::new() });
            }
            _ => {
                let brought = brought(&item);
                if let Some(current) = &mut self.names.current {
                    for name in names.iter().chain(&brought) {
                        if current.names.remove(name) {
                            current.steps.push(Step::Hide(name.clone(), group.index, group.loaded.inner.len()));
                        }
                    }
                }
            }
        }
        group.names.extend(names);
        let span = item.span;
        Arc::make_mut(&mut group.loaded.ast).items.push(item);
        Some(Entered { line: line?, span, file: group.index, inner: false, index, at: group.loaded.inner.len() })
    }

    /// Reads what a group of entries uses, and puts its names in scope.
    fn close(&mut self, group: Group, sources: &mut Sources, loader: &dyn Loader) -> Vec<Diagnostic> {
        let (id, mut diagnostics) = files::load_entered(&mut self.files, sources, loader, group.loaded);
        let file = &self.files.loaded[id];
        if !file.ast.items.is_empty() {
            let seen = Arc::make_mut(&mut self.names.seen);
            for (item, target) in &file.uses {
                let (ItemKind::Use(u), Some(target)) = (&file.ast.items[*item].kind, target) else { continue };
                seen.names.extend(u.names.iter().flatten().map(|name| (name.text.clone(), *target)));
                if let (None, Some(name)) = (&u.names, modules::whole_name(&u.path)) {
                    seen.whole.insert(name.to_owned(), *target);
                }
            }
            seen.names.extend(file.ast.items.iter().flat_map(defined).map(|name| (name, id)));
        }
        let (_, more) = modules::index(&self.files.loaded[..]);
        diagnostics.extend(more);
        diagnostics
    }

    /// The request for a check in this scope.
    pub(super) fn request<'r>(&'r self, options: &'r Options) -> Request<'r> {
        let current = self.names.current.as_ref();
        Request {
            files: &self.files.loaded,
            current: current.map(|c| ModelScope { file: c.file, item: c.item, steps: &c.steps }),
            inputs: &options.inputs,
            options: &options.check,
            evaluate: constants,
        }
    }
}

/// Entries that become one file.
#[derive(Default)]
struct Group {
    loaded: Loaded,
    index: usize,
    names: HashSet<String>,
}

impl Group {
    fn new(name: &str, names: &Names, index: usize) -> Group {
        let loaded = Loaded { name: name.to_owned(), seen: names.seen.clone(), ..Loaded::default() };
        Group { loaded, index, names: HashSet::new() }
    }

    /// Whether an entry gives a new meaning to a name of the group.
    fn defines(&self, entry: &Entry) -> bool {
        matches!(entry, Entry::Item(item) if defined(item).chain(brought(item)).any(|n| self.names.contains(&n)))
    }
}

/// A `let` in whose value its own name occurs.
fn names_itself(entry: &Entry) -> bool {
    let Entry::Item(Item { kind: ItemKind::Let(decl), .. }) = entry else { return false };
    let names = decl.pattern.names();
    free::of_lambda(&[], &decl.value).iter().any(|free| names.iter().any(|name| name.text == *free))
}
