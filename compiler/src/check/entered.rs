//! The checker's interface for sessions: the values that entered texts ask for, in the scope of the session's model,
//! and their errors. The session decides which texts are in scope.

use super::constants::Evaluate;
use super::context::Checker;
use super::files::Loaded;
use super::modules::{self, Module};
use super::typed::{self, Expr, ExprKind, LocalId, Statement, Type};
use super::types::ClosureId;
use super::{CheckOptions, InputValue, activity, finish, tells_of_errors};
use crate::diagnostic::Diagnostic;
use crate::source::Span;
use crate::syntax::ast::{Item, ItemKind, Pattern};
use std::collections::{BTreeMap, HashMap, HashSet};

/// A session's request for a check: the files that were entered, loaded and used, and the check's options.
#[derive(Clone, Copy)]
pub(crate) struct Request<'r> {
    pub(crate) files: &'r [Loaded],
    /// The model in whose scope expressions stand.
    pub(crate) current: Option<ModelScope<'r>>,
    /// Values of inputs; those that the model does not have are ignored.
    pub(crate) inputs: &'r BTreeMap<String, InputValue>,
    pub(crate) options: &'r CheckOptions,
    pub(crate) evaluate: Evaluate,
}

/// A session's model: an item of a file, and what was entered into its scope later.
#[derive(Clone, Copy)]
pub(crate) struct ModelScope<'r> {
    pub(crate) file: usize,
    pub(crate) item: usize,
    pub(crate) steps: &'r [Step],
}

/// A change of the model's scope since the model was entered.
#[derive(Clone)]
pub(crate) enum Step {
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

/// The kind of an entered line, with what is said of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Line {
    /// An expression.
    Value,
    /// A `let`: its names, as in `a` or `a, b`.
    Let(String),
    /// A function's first line, without defaults: `fn f(x: real) -> length`.
    Function(String),
    /// A custom derivative: of which function.
    Derivative(String),
    /// A `use`: what was brought: `std.curve (bezier)`.
    Use(String),
    /// A model, which is the current one now: its name.
    Model(String),
}

/// A line that was entered, and where its item stands.
#[derive(Clone)]
pub(crate) struct Entered {
    pub(crate) line: Line,
    pub(crate) span: Span,
    pub(crate) file: usize,
    /// Whether it is a statement of the file's `inner`, else an item; and which.
    pub(crate) inner: bool,
    pub(crate) index: usize,
    /// The number of statements of the file's `inner` before it.
    pub(crate) at: usize,
}

/// Lines of a text that are checked together: only the first may be a model.
pub(crate) struct Segment {
    /// The texts as files.
    pub(crate) files: Vec<usize>,
    pub(crate) lines: Vec<Entered>,
    /// Whether there is a new model.
    pub(crate) model: bool,
}

/// The values that a segment asks for, as `let`s of a model's body.
pub(crate) struct Checked {
    pub(crate) model: typed::Model,
    /// For each line its value, if it has one.
    pub(crate) values: Vec<Option<Asked>>,
    pub(crate) warnings: Vec<Diagnostic>,
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
    pub(crate) span: Span,
}

impl Request<'_> {
    /// Checks the current model in full.
    ///
    /// # Errors
    /// Its errors. Warnings come with the model.
    pub(crate) fn model(&self) -> Result<Option<(typed::Model, Vec<Diagnostic>)>, Vec<Diagnostic>> {
        let Some(current) = self.current else { return Ok(None) };
        let (modules, _) = modules::index(self.files);
        let mut checker = Checker::new(&modules, self.options, self.evaluate);
        checker.env.module = current.file;
        let item = &modules[current.file].items[current.item];
        let ItemKind::Model(decl) = &item.kind else { return Ok(None) };
        let model = checker.main_model(decl, &self.inputs_of_model(&decl.items));
        let failed = checker.has_errors();
        let mut diagnostics = sorted(checker.into_diagnostics());
        if failed {
            diagnostics.retain(tells_of_errors);
            return Err(diagnostics);
        }
        Ok(Some((model, diagnostics)))
    }

    /// The given values for which a model has an input: the others may have been meant for another model.
    fn inputs_of_model(&self, items: &[Item]) -> BTreeMap<String, InputValue> {
        let has = |name: &str| items.iter().any(|i| matches!(&i.kind, ItemKind::Input(decl) if decl.name.text == name));
        self.inputs.iter().filter(|(name, _)| has(name)).map(|(name, value)| (name.clone(), *value)).collect()
    }

    /// Checks a segment, and what its values are made of.
    ///
    /// # Errors
    /// Its errors.
    pub(crate) fn values(&self, segment: &Segment) -> Result<Checked, Vec<Diagnostic>> {
        let (modules, _) = modules::index(self.files);
        let mut checker = Checker::new(&modules, self.options, self.evaluate);
        let mut model = typed::Model::default();
        if let Some(current) = &self.current {
            checker.env.module = current.file;
            if let ItemKind::Model(decl) = &modules[current.file].items[current.item].kind {
                let body = checker.scope_of_model(decl, &self.inputs_of_model(&decl.items));
                (model.params, model.inputs, model.body) = (body.params, body.inputs, body.statements);
            }
        }
        let locals = self.statements(segment, &mut checker, &modules, &mut model.body);
        let outer = std::mem::take(&mut checker.env.names);
        segment.files.iter().for_each(|file| checker.check_annotated(*file));
        checker.env.names = outer;
        if checker.has_errors() {
            return Err(sorted(checker.into_diagnostics()));
        }
        let lines = segment.lines.iter().zip(&locals);
        let values = lines.map(|(entered, local)| Some(checker.asked((*local)?, entered.span))).collect();
        let mut locals: HashSet<LocalId> = locals.into_iter().flatten().collect();
        let needed = typed::needed_lets(typed::lets(&model.body), &mut locals);
        model.body = needed.into_iter().map(|(local, e)| Statement::Let(local, e.clone())).collect();
        for param in &mut model.params {
            (param.lower, param.upper) = (None, None);
        }
        finish::finish(&checker, &mut model);
        Ok(Checked { model, values, warnings: sorted(checker.into_diagnostics()) })
    }

    /// Goes through what stands in the model's scope, and binds the values that are asked for.
    fn statements<'a>(
        &self,
        segment: &Segment,
        checker: &mut Checker<'a>,
        modules: &'a [Module<'a>],
        body: &mut Vec<Statement>,
    ) -> Vec<Option<LocalId>> {
        let steps = self.current.map_or(&[][..], |c| c.steps);
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

    /// The places at which values of a segment lose their derivatives by the free parameters.
    pub(crate) fn lost_derivatives(&self, checked: &Checked) -> Vec<Diagnostic> {
        let (modules, _) = modules::index(self.files);
        let mut checker = Checker::new(&modules, self.options, self.evaluate);
        activity::check(&mut checker, &checked.model);
        checker.into_diagnostics()
    }
}

impl<'a> Checker<'a> {
    /// The value that a pattern was bound to, by a file or in the scope of the model.
    fn named(&mut self, pattern: &'a Pattern, file: Option<usize>) -> Expr {
        match pattern {
            // A value that is bound to `_` cannot be read.
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

    fn asked(&mut self, local: LocalId, span: Span) -> Asked {
        let ty = self.locals[local.0 as usize].ty.clone();
        let words = self.describe(&ty);
        let mut ids = Vec::new();
        ty.any(&mut |ty| {
            ids.extend(if let Type::Closure(id) = ty { Some(*id) } else { None });
            false
        });
        let functions = ids.into_iter().map(|id| (id, self.signature(id))).collect();
        let text = if let Type::Text(Some(text)) = &ty { Some(text.to_string()) } else { None };
        Asked { local, ty, words, text, functions, span }
    }
}

fn sorted(mut diagnostics: Vec<Diagnostic>) -> Vec<Diagnostic> {
    diagnostics.sort_by_key(|d| (d.span.file, d.span.start));
    diagnostics
}
