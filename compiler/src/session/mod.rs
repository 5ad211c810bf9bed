//! Evaluating texts that are entered one after another: definitions, models, expressions.
//!
//! A [`Session`] goes the way of every script: what is entered is parsed, checked, lowered and differentiated, and the
//! interpreter of the IR runs it. A name keeps the meaning that it had where it was used, as in other interactive
//! languages: defining it anew concerns what is entered later. The last model entered or loaded is the current
//! one: its parameters, with the values that [`Session::set`] gave them, its `let`s, functions and parts are in scope of
//! expressions, and what is defined in terms of them follows the parameters. After an error a session is as before.

mod display;
mod emit;
mod evaluate;
mod gradient;
mod model;
mod names;
#[cfg(test)]
mod tests;
mod value;

pub use emit::Native;
pub use gradient::{Gradient, Slope};
pub use model::CurrentModel;
pub use value::{Data, Value};

use crate::check::scope::{self, Checked, Line, Scope, Segment};
use crate::check::{CheckOptions, InputValue};
pub use crate::check::{Kind, Known};
use crate::diagnostic::{Code, Diagnostic, Severity};
pub use crate::ir::interpret::Limits;
use crate::program::Failed;
use crate::source::{FileId, Loader, SourceFile, Sources, Span};
use crate::syntax::{self, Entry};
use model::Loaded;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// How a session evaluates.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The limits of the checker.
    pub check: CheckOptions,
    /// The limits of every evaluation.
    pub limits: Limits,
    /// Values of the current model's inputs by name; the others have their defaults.
    pub inputs: BTreeMap<String, InputValue>,
    /// Set from elsewhere to end whatever is running with an error. It stays set until its owner clears it.
    pub interrupt: Arc<AtomicBool>,
}

/// What has been entered so far.
pub struct Session {
    options: Options,
    sources: Sources,
    scope: Scope,
    model: Option<Loaded>,
    warnings: Vec<Diagnostic>,
    /// What to enter again where files have changed.
    log: Vec<Logged>,
    texts: usize,
}

/// What made the session what it is.
#[derive(Clone)]
enum Logged {
    Text(String),
    Script(String),
}

/// What an entered line says.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// The value of an expression.
    Value(Value),
    /// A `let`: its names, and its value.
    Let {
        /// As in `a` or `a, b`.
        names: String,
        /// What they were bound to.
        value: Value,
    },
    /// A function: `fn f(x: real) -> length`.
    Function {
        /// Its first line, without defaults.
        signature: String,
        /// The item.
        span: Span,
    },
    /// A derivative by hand.
    Derivative {
        /// Of which function.
        function: String,
        /// The item.
        span: Span,
    },
    /// A `use`.
    Use {
        /// What was brought: `std.curve (bezier)`.
        what: String,
        /// The item.
        span: Span,
    },
    /// A model, which is the current one now.
    Model {
        /// Its name.
        name: String,
        /// The item.
        span: Span,
    },
}

impl Answer {
    /// Where the line stands that it answers.
    #[must_use]
    pub fn span(&self) -> Span {
        match self {
            Answer::Value(value) | Answer::Let { value, .. } => value.span,
            Answer::Function { span, .. }
            | Answer::Derivative { span, .. }
            | Answer::Use { span, .. }
            | Answer::Model { span, .. } => *span,
        }
    }

    /// The value of an expression or `let`.
    #[must_use]
    pub fn value(&self) -> Option<&Value> {
        match self {
            Answer::Value(value) | Answer::Let { value, .. } => Some(value),
            _ => None,
        }
    }
}

impl Session {
    /// A session in which only the standard library is known.
    #[must_use]
    pub fn new(mut options: Options) -> Session {
        options.check.interrupt = Some(options.interrupt.clone());
        Session {
            options,
            sources: Sources::default(),
            scope: Scope::default(),
            model: None,
            warnings: Vec::new(),
            log: Vec::new(),
            texts: 0,
        }
    }

    /// Enters a text: items and expressions, one after another. Items of one text may name each other in any order.
    ///
    /// # Errors
    /// What is wrong with it, or what failed while evaluating it; the session is then as before.
    pub fn enter(&mut self, text: &str, loader: &dyn Loader) -> Result<Vec<Answer>, Failed> {
        let answers = self.attempt(|s| {
            let file = s.add_text(text);
            let mut entries = s.parse(file, text)?;
            let mut answers = Vec::new();
            while entries.peek().is_some() {
                let mark = s.scope.mark();
                let segment = s.scope.add((&mut s.sources, loader), file, &mut entries)?;
                answers.extend(s.finish(&segment)?);
                s.scope.forget_expressions(&mark);
            }
            Ok(answers)
        })?;
        if answers.iter().any(|a| !matches!(a, Answer::Value(_))) {
            self.log.push(Logged::Text(text.to_owned()));
        }
        Ok(answers)
    }

    /// Loads a script: its names are in scope as if they had been entered, and its last model is the current one.
    ///
    /// # Errors
    /// What is wrong with it; the session is then as before.
    pub fn load(&mut self, script: SourceFile, loader: &dyn Loader) -> Result<Vec<Answer>, Failed> {
        let name = script.name.clone();
        let answers = self.attempt(|s| {
            let segment = s.scope.add_script(&mut s.sources, loader, script)?;
            s.finish(&segment)
        })?;
        self.log.push(Logged::Script(name));
        Ok(answers)
    }

    /// Reads all files again and enters again what was entered. Parameters keep their values where they still exist and
    /// the values are within their bounds.
    /// What of the entered definitions does not go together with the files any more is left out, and said in
    /// [`Session::warnings`].
    ///
    /// # Errors
    /// If a script that was loaded is wrong; the session is then as before.
    pub fn reload(&mut self, loader: &dyn Loader) -> Result<(), Failed> {
        let mut fresh = Session::new(self.options.clone());
        let mut warnings = Vec::new();
        for logged in &self.log {
            match logged {
                Logged::Script(name) => {
                    let script = loader.load(name, "").map_err(|reason| {
                        let error = Diagnostic::new(Code::FileNotFound, Span::default(), reason);
                        Failed { diagnostics: vec![error], sources: Sources::default() }
                    })?;
                    fresh.load(script, loader)?;
                    warnings.extend(std::mem::take(&mut fresh.warnings));
                }
                Logged::Text(text) => {
                    let Err(failed) = fresh.enter(text, loader) else { continue };
                    // The text stays quotable: its errors become warnings about what was left out.
                    let file = fresh.add_text(text);
                    for error in failed.diagnostics.into_iter().filter(|d| d.severity == Severity::Error) {
                        let quotes = failed.sources.get(error.span.file).is_some_and(|f| f.text == *text);
                        let span = Span { file, ..if quotes { error.span } else { Span::default() } };
                        let message = format!("left out, as it does not hold any more: {}", error.message);
                        let warning = Diagnostic::new(error.code, span, message);
                        warnings.push(Diagnostic { severity: Severity::Warning, ..warning });
                    }
                }
            }
        }
        if let (Some(old), Some(new)) = (&self.model, &mut fresh.model) {
            new.keep_values(old, &fresh.options);
        }
        fresh.warnings = warnings;
        *self = fresh;
        Ok(())
    }

    /// What was found beside errors when something was last entered, loaded or set.
    #[must_use]
    pub fn warnings(&self) -> &[Diagnostic] {
        &self.warnings
    }

    /// The files that the spans of answers and warnings are in.
    #[must_use]
    pub fn sources(&self) -> &Sources {
        &self.sources
    }

    /// The names of the files that were read through a loader or loaded as scripts.
    #[must_use]
    pub fn files(&self) -> Vec<String> {
        let files = self.sources.iter().map(|(_, f)| f.name.clone());
        files.filter(|name| !name.starts_with("std.") && !name.starts_with("input ")).collect()
    }

    /// The type of an expression in words, and as it would be written.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn type_of(&mut self, text: &str, loader: &dyn Loader) -> Result<(String, String), Failed> {
        self.with_expression(text, loader, |_, checked| {
            let asked = checked.answers.last().and_then(|a| a.value.as_ref());
            Ok(asked.map_or_else(Default::default, |asked| (asked.words.clone(), evaluate::written(asked))))
        })
    }

    /// Does something with a checked expression, and forgets it: nobody quotes it any more.
    fn with_expression<T>(
        &mut self,
        text: &str,
        loader: &dyn Loader,
        f: impl FnOnce(&Session, &mut Checked) -> Result<T, Vec<Diagnostic>>,
    ) -> Result<T, Failed> {
        let (mark, files, texts) = (self.scope.mark(), self.sources.len(), self.texts);
        let warnings = self.warnings.clone();
        let result = self.attempt(|s| {
            let file = s.add_text(text);
            let mut entries = s.parse(file, text)?;
            let whole = Span { file, start: 0, end: text.len() as u32 };
            let Some(Entry::Expression(_)) = entries.peek() else {
                return Err(vec![Diagnostic::new(Code::NoValue, whole, "an expression is wanted here")]);
            };
            let segment = s.scope.add((&mut s.sources, loader), file, &mut entries)?;
            if entries.peek().is_some() || !segment.is_one_value() {
                return Err(vec![Diagnostic::new(Code::NoValue, whole, "one expression is wanted here")]);
            }
            let mut checked = s.scope.check(&segment, &s.options.inputs, &s.options.check)?;
            f(s, &mut checked)
        });
        self.scope.restore(mark);
        self.sources.truncate(files);
        (self.texts, self.warnings) = (texts, warnings);
        result
    }

    fn add_text(&mut self, text: &str) -> FileId {
        self.texts += 1;
        self.sources.add(format!("input {}", self.texts), text)
    }

    fn parse(
        &mut self,
        file: FileId,
        text: &str,
    ) -> Result<std::iter::Peekable<std::vec::IntoIter<Entry>>, Vec<Diagnostic>> {
        let (entries, diagnostics) = syntax::parse_entries(file, text);
        if diagnostics.iter().any(|d| d.severity == Severity::Error) {
            return Err(diagnostics);
        }
        Ok(entries.into_iter().peekable())
    }

    /// Checks and evaluates what was added.
    fn finish(&mut self, segment: &Segment) -> Result<Vec<Answer>, Vec<Diagnostic>> {
        if segment.model {
            let found = self.scope.model(&self.options.inputs, &self.options.check)?;
            if let Some((model, warnings)) = found {
                self.warnings.extend(warnings);
                self.model = Some(Loaded::new(model)?);
            }
        }
        let mut checked = self.scope.check(segment, &self.options.inputs, &self.options.check)?;
        self.warnings.append(&mut checked.warnings);
        let mut values = evaluate::values(self, &checked)?.into_iter();
        let mut answers = Vec::new();
        for scope::Answer { line, span, value } in checked.answers {
            let value = value.and_then(|_| values.next());
            answers.push(match (line, value) {
                (Line::Value, Some(value)) => Answer::Value(value),
                (Line::Let(names), Some(value)) => Answer::Let { names, value: Value { span, ..value } },
                (Line::Function(signature), _) => Answer::Function { signature, span },
                (Line::Derivative(function), _) => Answer::Derivative { function, span },
                (Line::Use(what), _) => Answer::Use { what, span },
                (Line::Model(name), _) => Answer::Model { name, span },
                (Line::Value | Line::Let(_), None) => continue,
            });
        }
        Ok(answers)
    }

    /// Does something, or nothing at all where it fails.
    fn attempt<T>(&mut self, f: impl FnOnce(&mut Session) -> Result<T, Vec<Diagnostic>>) -> Result<T, Failed> {
        let (mark, files, texts) = (self.scope.mark(), self.sources.len(), self.texts);
        let (model, warnings) = (self.model.clone(), std::mem::take(&mut self.warnings));
        let result = f(self);
        result.map_err(|diagnostics| {
            let sources = self.sources.clone();
            self.scope.restore(mark);
            self.sources.truncate(files);
            (self.texts, self.model, self.warnings) = (texts, model, warnings);
            Failed { diagnostics, sources }
        })
    }
}
