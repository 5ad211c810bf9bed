//! What a text that was entered asks for: its values in the current model's scope, and what is wrong with them.

use super::super::context::Checker;
use super::super::modules::{self, Module};
use super::super::typed::{self, Expr, ExprKind, LocalId, Statement, Type};
use super::super::types::ClosureId;
use super::super::{CheckOptions, InputValue, activity, finish};
use super::{Line, Scope, Segment, Step, sorted};
use crate::diagnostic::Diagnostic;
use crate::source::Span;
use crate::syntax::ast::{ItemKind, Pattern};
use std::collections::{BTreeMap, HashMap, HashSet};

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
