//! What a session has been told so far: texts entered one after another, each of which sees the names of those before
//! it, and a current model whose parameters, values and parts are in scope.
//!
//! An entered text becomes a file of its own, so that its items may stand in any order, and what was entered earlier
//! keeps the meaning that it had. Items and expressions that name something of the current model's body are checked
//! as if they stood at its end.

mod items;
mod known;

pub use known::{Kind, Known};

use super::context::Checker;
use super::free;
use super::modules::{self, Files, Loaded, Module, Seen};
use super::typed::{self, Expr, ExprKind, LocalId, Statement, Type};
use super::types::ClosureId;
use super::{CheckOptions, InputValue, activity, finish};
use crate::diagnostic::{Diagnostic, Severity};
use crate::source::{FileId, Loader, SourceFile, Sources, Span};
use crate::syntax::ast::{Item, ItemKind, Let, Pattern};
use crate::syntax::{self, Entry};
use items::{brought, defined, line_of, names_of_model};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

/// Everything that is in scope.
#[derive(Default)]
pub(crate) struct Scope {
    files: Files,
    names: Names,
}

/// The names, apart from the files that define them.
#[derive(Clone, Default)]
pub(crate) struct Names {
    seen: Arc<Seen>,
    current: Option<Current>,
}

/// The model whose body is in scope.
#[derive(Clone)]
struct Current {
    file: usize,
    item: usize,
    /// Names of its body, and those entered later that depend on them.
    names: HashSet<String>,
    steps: Vec<Step>,
}

/// What has happened in the model's scope since, in order.
#[derive(Clone)]
enum Step {
    /// A statement of a file's `inner`.
    Inner(usize, usize),
    /// A name means something else from here on: before that statement of that file.
    Hide(String, usize, usize),
}

impl Step {
    /// Whether it comes before a statement of a file's `inner`.
    fn is_before(&self, place: (usize, usize)) -> bool {
        match self {
            Step::Inner(file, index) => (*file, *index) < place,
            Step::Hide(_, file, index) => (*file, *index) <= place,
        }
    }
}

/// A state to go back to.
pub(crate) struct Mark {
    files: usize,
    names: Names,
}

/// What one line of an entered text is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Line {
    Value,
    Let(String),
    Function(String),
    Derivative(String),
    Use(String),
    Model(String),
}

/// A line that was entered, and where what it says is to be found.
#[derive(Clone)]
struct Entered {
    line: Line,
    span: Span,
    file: usize,
    /// Whether it is a statement of the file's `inner`, else an item; and which.
    inner: bool,
    index: usize,
    /// How many statements of the file's `inner` come before it.
    at: usize,
}

/// Lines of a text that are checked together: only the first may be a model.
pub(crate) struct Segment {
    /// The texts as files.
    files: Vec<usize>,
    lines: Vec<Entered>,
    /// Whether there is a new model.
    pub(crate) model: bool,
}

impl Segment {
    /// Whether it is one expression and nothing else.
    pub(crate) fn is_one_value(&self) -> bool {
        matches!(&self.lines[..], [Entered { line: Line::Value, .. }])
    }
}

/// Values that a segment asks for, as `let`s of a model's body.
pub(crate) struct Checked {
    pub(crate) model: typed::Model,
    pub(crate) answers: Vec<Answer>,
    pub(crate) warnings: Vec<Diagnostic>,
}

/// What a line says.
pub(crate) struct Answer {
    pub(crate) line: Line,
    pub(crate) span: Span,
    pub(crate) value: Option<Asked>,
}

/// A value that is asked for.
pub(crate) struct Asked {
    pub(crate) local: LocalId,
    pub(crate) ty: Type,
    /// The type in words, with an article.
    pub(crate) words: String,
    /// A constant text.
    pub(crate) text: Option<String>,
    /// Function values in it.
    pub(crate) functions: HashMap<ClosureId, String>,
}

impl Scope {
    pub(crate) fn mark(&self) -> Mark {
        Mark { files: self.files.loaded.len(), names: self.names.clone() }
    }

    /// Forgets all since the mark.
    pub(crate) fn restore(&mut self, mark: Mark) {
        self.files.loaded.truncate(mark.files);
        self.files.ids.retain(|_, id| *id < mark.files);
        self.names = mark.names;
    }

    /// Forgets the texts since the mark, which have brought no names.
    pub(crate) fn forget_expressions(&mut self, mark: &Mark) {
        let needed = |s: &Step, i: usize| matches!(s, Step::Inner(file, _) if *file == i);
        for i in mark.files..self.files.loaded.len() {
            let used = self.names.current.as_ref().is_some_and(|c| c.steps.iter().any(|s| needed(s, i)));
            let file = &mut self.files.loaded[i];
            if file.ast.items.is_empty() && !used {
                file.inner = Vec::new();
            }
        }
    }

    /// Adds the files that a text uses, and as many of its entries as can be checked together.
    ///
    /// # Errors
    /// What is wrong with the files.
    pub(crate) fn add(
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
    /// What is wrong with the files.
    pub(crate) fn add_script(
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
                let span = value.span;
                let decl = Let { pattern: Pattern::Tuple(Vec::new(), span), ty: None, value };
                (Line::Value, Item { doc: String::new(), span, kind: ItemKind::Let(decl) })
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
        let names = defined(&item);
        let index = group.loaded.ast.items.len();
        match &item.kind {
            ItemKind::Model(model) => {
                let names = names_of_model(&model.items);
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
        let (id, mut diagnostics) = modules::load_entered(&mut self.files, sources, loader, group.loaded);
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

    /// Checks the current model in full.
    ///
    /// # Errors
    /// What is wrong with it. Warnings come with the model.
    pub(crate) fn model(
        &self,
        inputs: &BTreeMap<String, InputValue>,
        options: &CheckOptions,
    ) -> Result<Option<(typed::Model, Vec<Diagnostic>)>, Vec<Diagnostic>> {
        let Some(current) = &self.names.current else { return Ok(None) };
        let inputs = &self.inputs_of_model(inputs);
        let (modules, _) = modules::index(&self.files.loaded);
        let mut checker = Checker::new(&modules, options);
        checker.env.module = current.file;
        let item = &modules[current.file].items[current.item];
        let ItemKind::Model(decl) = &item.kind else { return Ok(None) };
        let model = checker.main_model(decl, &item.doc, inputs);
        finished(checker).map(|warnings| Some((model, warnings)))
    }

    /// Those of the values that the current model has an input for: they may have been meant for another one.
    fn inputs_of_model(&self, given: &BTreeMap<String, InputValue>) -> BTreeMap<String, InputValue> {
        let file = self.names.current.as_ref().and_then(|c| Some(&self.files.loaded.get(c.file)?.ast.items[c.item]));
        let Some(Item { kind: ItemKind::Model(model), .. }) = file else { return BTreeMap::new() };
        let has =
            |name: &str| model.items.iter().any(|i| matches!(&i.kind, ItemKind::Input(decl) if decl.name.text == name));
        given.iter().filter(|(name, _)| has(name)).map(|(name, value)| (name.clone(), *value)).collect()
    }

    /// Checks a segment, and what its values are made of.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(crate) fn check(
        &self,
        segment: &Segment,
        inputs: &BTreeMap<String, InputValue>,
        options: &CheckOptions,
    ) -> Result<Checked, Vec<Diagnostic>> {
        let inputs = &self.inputs_of_model(inputs);
        let (modules, _) = modules::index(&self.files.loaded);
        let mut checker = Checker::new(&modules, options);
        let mut model = typed::Model::default();
        if let Some(current) = &self.names.current {
            checker.env.module = current.file;
            if let ItemKind::Model(decl) = &modules[current.file].items[current.item].kind {
                let body = checker.scope_of_model(decl, inputs);
                (model.params, model.inputs, model.body) = (body.params, body.inputs, body.statements);
            }
        }
        let values = self.statements(segment, &mut checker, &modules, &mut model.body);
        let outer = std::mem::take(&mut checker.env.names);
        segment.files.iter().for_each(|file| checker.check_annotated(*file));
        checker.env.names = outer;
        if checker.has_errors() {
            return Err(sorted(checker.into_diagnostics()));
        }
        let answers: Vec<Answer> = segment
            .lines
            .iter()
            .zip(values)
            .map(|(entered, value)| Answer {
                line: entered.line.clone(),
                span: entered.span,
                value: value.map(|local| checker.asked(local, &model.body)),
            })
            .collect();
        keep_needed(&mut model, &answers);
        finish::finish(&checker, &mut model);
        Ok(Checked { model, answers, warnings: sorted(checker.into_diagnostics()) })
    }

    /// Goes through what stands in the model's scope, and binds the values that are asked for.
    fn statements<'a>(
        &self,
        segment: &Segment,
        checker: &mut Checker<'a>,
        modules: &'a [Module<'a>],
        body: &mut Vec<Statement>,
    ) -> Vec<Option<LocalId>> {
        let steps = self.names.current.as_ref().map_or(&[][..], |c| &c.steps);
        // Steps before this segment; then its lines with the steps that they are.
        let mut steps = steps.iter().peekable();
        let mut run = |checker: &mut Checker<'a>, body: &mut Vec<Statement>, place: (usize, usize)| {
            while let Some(step) = steps.next_if(|s| s.is_before(place)) {
                match step {
                    Step::Inner(file, index) => {
                        checker.env.module = *file;
                        checker.statement(&modules[*file].inner[*index], body);
                    }
                    Step::Hide(name, ..) => checker.env.names.retain(|(n, _)| n != name),
                }
            }
        };
        let mut values = Vec::new();
        for entered in &segment.lines {
            run(checker, body, (entered.file, entered.at));
            let file = &modules[entered.file];
            let item = if entered.inner { &file.inner[entered.index] } else { &file.items[entered.index] };
            if entered.inner && entered.line != Line::Value {
                run(checker, body, (entered.file, entered.at + 1));
            }
            let ItemKind::Let(decl) = &item.kind else {
                values.push(None);
                continue;
            };
            checker.env.module = entered.file;
            let value = match entered.line {
                Line::Value => checker.expr(&decl.value),
                _ => checker.named(&decl.pattern, (!entered.inner).then_some(entered.file)),
            };
            let local = checker.local("value", value.ty.clone(), decl.value.span);
            body.push(Statement::Let(local, value));
            values.push(Some(local));
        }
        run(checker, body, (usize::MAX, 0));
        values
    }

    /// The free parameters' losses of derivatives in what a segment asks for.
    pub(crate) fn losses(&self, checked: &Checked, options: &CheckOptions) -> Vec<Diagnostic> {
        let (modules, _) = modules::index(&self.files.loaded);
        let mut checker = Checker::new(&modules, options);
        activity::check(&mut checker, &checked.model);
        checker.into_diagnostics()
    }
}

impl<'a> Checker<'a> {
    /// The value that a pattern was bound to, by a file or in the scope of the model.
    fn named(&mut self, pattern: &'a Pattern, file: Option<usize>) -> Expr {
        match pattern {
            // What is bound to `_` cannot be had again.
            Pattern::Name(name) if name.text == "_" => {
                Expr { kind: ExprKind::Aggregate(Vec::new()), ty: Type::tuple(Vec::new()), span: name.span }
            }
            Pattern::Name(name) => match file {
                Some(file) => self.of_file(file, &name.text, name.span),
                None => self.name(&name.text, name.span),
            },
            Pattern::Tuple(parts, span) => {
                let parts = parts.iter().map(|p| self.named(p, file)).collect();
                self.make_tuple(parts, *span)
            }
        }
    }

    fn asked(&mut self, local: LocalId, body: &[Statement]) -> Asked {
        let ty = self.locals[local.0 as usize].ty.clone();
        let words = self.describe(&ty);
        let mut ids = Vec::new();
        closures_in(&ty, &mut ids);
        let functions = ids.into_iter().map(|id| (id, self.signature(id))).collect();
        let text = (ty == Type::Text).then(|| self.text_of(local, body)).flatten();
        Asked { local, ty, words, text, functions }
    }

    /// A text's characters, where they can be followed to where they are written.
    fn text_of(&self, local: LocalId, body: &[Statement]) -> Option<String> {
        let bound = |id: LocalId| {
            body.iter().find_map(|s| match s {
                Statement::Let(l, e) if *l == id => Some(e),
                _ => None,
            })
        };
        let mut e = bound(local)?;
        // Every step goes to something bound earlier; the count only makes that plain.
        for _ in 0..1000 {
            e = match &e.kind {
                ExprKind::Text(text) => return Some(text.clone()),
                ExprKind::Local(id) => bound(*id)?,
                ExprKind::Call(call) if call.args.is_empty() => &self.function(call.function)?.body,
                ExprKind::Block(_, value) => value,
                _ => return None,
            };
        }
        None
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
        matches!(entry, Entry::Item(item) if defined(item).iter().chain(&brought(item)).any(|n| self.names.contains(n)))
    }
}

/// A `let` in whose value its own name occurs.
fn names_itself(entry: &Entry) -> bool {
    let Entry::Item(Item { kind: ItemKind::Let(decl), .. }) = entry else { return false };
    let mut names = Vec::new();
    items::pattern_names(&decl.pattern, &mut names);
    free::of_lambda(&[], &decl.value).iter().any(|free| names.iter().any(|n| n == free))
}

fn closures_in(ty: &Type, out: &mut Vec<ClosureId>) {
    match ty {
        Type::Closure(id) => out.push(*id),
        Type::Tuple(types) => types.iter().for_each(|t| closures_in(t, out)),
        Type::Array(t, _) => closures_in(t, out),
        Type::Record(fields) => fields.iter().for_each(|(_, t)| closures_in(t, out)),
        _ => {}
    }
}

/// Leaves of the body what the answers need.
fn keep_needed(model: &mut typed::Model, answers: &[Answer]) {
    let mut needed: HashSet<LocalId> = answers.iter().filter_map(|a| a.value.as_ref()).map(|v| v.local).collect();
    let mut kept = Vec::new();
    for statement in std::mem::take(&mut model.body).into_iter().rev() {
        if let Statement::Let(local, value) = &statement
            && needed.contains(local)
        {
            locals_in(value, &mut needed);
            kept.push(statement);
        }
    }
    kept.reverse();
    model.body = kept;
    for param in &mut model.params {
        (param.lower, param.upper) = (None, None);
    }
}

fn locals_in(e: &Expr, out: &mut HashSet<LocalId>) {
    if let ExprKind::Local(id) = e.kind {
        out.insert(id);
    }
    e.for_each_child(&mut |child| locals_in(child, out));
}

fn finished(checker: Checker<'_>) -> Result<Vec<Diagnostic>, Vec<Diagnostic>> {
    let failed = checker.has_errors();
    let mut diagnostics = sorted(checker.into_diagnostics());
    if failed {
        diagnostics.retain(|d| d.severity == Severity::Error);
        return Err(diagnostics);
    }
    Ok(diagnostics)
}

fn sorted(mut diagnostics: Vec<Diagnostic>) -> Vec<Diagnostic> {
    diagnostics.sort_by_key(|d| (d.span.file, d.span.start));
    diagnostics
}
