//! Evaluating texts that are entered one after another: definitions, models, expressions.
//!
//! A [`Session`] goes the way of every script: what is entered is parsed, checked, lowered and differentiated, and the
//! interpreter of the IR runs it. A name keeps the meaning that it had where it was used, as in other interactive
//! languages: defining it anew concerns what is entered later. The last model entered or loaded is the current one: its
//! parameters, with the values that [`Session::set`] gave them, its `let`s, functions and parts are in scope of
//! expressions, and what is defined in terms of them follows the parameters. After an error a session is as before.

mod display;
mod emit;
mod evaluate;
mod gradient;
mod items;
mod model;
mod names;
mod scope;
#[cfg(test)]
mod tests;
mod value;

pub use emit::Native;
pub use gradient::{Gradient, Slope};
pub use model::CurrentModel;
pub use names::{Kind, Known};
pub use value::{Data, Value};

pub use crate::check::entered::Line;

use crate::check::entered::{Asked, Checked, Segment};
use crate::check::{CheckOptions, InputValue};
use crate::diagnostic::{Code, Diagnostic, Severity};
pub use crate::ir::interpret::Limits;
use crate::program::Failed;
use crate::source::{FileId, Loader, SourceFile, Sources, Span};
use crate::syntax::{self, Entry};
use scope::Scope;
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

/// A session: the texts entered so far.
pub struct Session {
    options: Options,
    sources: Sources,
    scope: Scope,
    model: Option<CurrentModel>,
    warnings: Vec<Diagnostic>,
    /// The texts and scripts to enter again when files have changed.
    log: Vec<Logged>,
    /// The number of texts so far, those with errors among them: a number in a message means one text only.
    texts: usize,
}

/// An entry of the session's log.
#[derive(Clone)]
enum Logged {
    /// With its number.
    Text(usize, String),
    Script(String),
}

/// A state of a session to go back to, but for its warnings.
struct Snapshot {
    scope: scope::Mark,
    files: usize,
    model: Option<CurrentModel>,
}

/// The answer to an entered line.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The kind of line.
    pub line: Line,
    /// Its place.
    pub span: Span,
    /// The value of an expression, or what a `let` binds.
    pub value: Option<Value>,
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
    /// Its errors, or the failure of its evaluation; the session is then as before.
    pub fn enter(&mut self, text: &str, loader: &dyn Loader) -> Result<Vec<Answer>, Failed> {
        let answers = self.attempt(|s| {
            let file = s.add_text(text);
            let mut entries = s.parse(file, text)?;
            let mut answers = Vec::new();
            while entries.peek().is_some() {
                let segment = s.scope.add((&mut s.sources, loader), file, &mut entries)?;
                answers.extend(s.finish(&segment)?);
            }
            Ok(answers)
        })?;
        if answers.iter().any(|a| a.line != Line::Value) {
            self.log.push(Logged::Text(self.texts, text.to_owned()));
        }
        Ok(answers)
    }

    /// Loads a script: its names are in scope as if they had been entered, and its last model is the current one.
    ///
    /// # Errors
    /// Its errors; the session is then as before.
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
    /// Entered definitions that are no longer valid are left out; [`Session::warnings`] says which.
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
                Logged::Text(number, text) => {
                    fresh.texts = number - 1;
                    let Err(failed) = fresh.enter(text, loader) else { continue };
                    // The text stays quotable: its errors become warnings about what was left out.
                    fresh.texts = number - 1;
                    let file = fresh.add_text(text);
                    for error in failed.diagnostics.into_iter().filter(|d| d.severity == Severity::Error) {
                        let quotes = failed.sources.get(error.span.file).is_some_and(|f| f.text == *text);
                        let span = Span { file, ..if quotes { error.span } else { Span::default() } };
                        let message = format!("left out, because it is no longer valid: {}", error.message);
                        let warning = Diagnostic::new(error.code, span, message);
                        warnings.push(Diagnostic { severity: Severity::Warning, ..warning });
                    }
                }
            }
        }
        if let (Some(old), Some(new)) = (&self.model, &mut fresh.model) {
            new.keep_values(old, &fresh.options);
        }
        (fresh.warnings, fresh.texts) = (warnings, self.texts);
        *self = fresh;
        Ok(())
    }

    /// The warnings about what was last entered, loaded or set.
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
    /// Its errors.
    pub fn type_of(&mut self, text: &str, loader: &dyn Loader) -> Result<(String, String), Failed> {
        self.with_expression(text, loader, |_, _, asked| Ok((asked.words.clone(), evaluate::written(asked))))
    }

    /// Does something with a checked expression and forgets it, as no later message quotes it.
    fn with_expression<T>(
        &mut self,
        text: &str,
        loader: &dyn Loader,
        f: impl FnOnce(&Session, &Checked, &Asked) -> Result<T, Vec<Diagnostic>>,
    ) -> Result<T, Failed> {
        let (before, warnings, texts) = (self.snapshot(), self.warnings.clone(), self.texts);
        let result = self.attempt(|s| {
            let file = s.add_text(text);
            let mut entries = s.parse(file, text)?;
            let whole = Span { file, start: 0, end: text.len() as u32 };
            let Some(Entry::Expression(_)) = entries.peek() else {
                return Err(vec![Diagnostic::new(Code::NoValue, whole, "an expression is expected here")]);
            };
            let segment = s.scope.add((&mut s.sources, loader), file, &mut entries)?;
            let checked = s.scope.request(&s.options).values(&segment)?;
            match &checked.values[..] {
                [Some(asked)] if entries.peek().is_none() => f(s, &checked, asked),
                _ => Err(vec![Diagnostic::new(Code::NoValue, whole, "exactly one expression is expected here")]),
            }
        });
        self.restore(before);
        self.warnings = warnings;
        if result.is_ok() {
            // No message has its number.
            self.texts = texts;
        }
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
        if segment.model
            && let Some((model, warnings)) = self.scope.request(&self.options).model()?
        {
            self.warnings.extend(warnings);
            self.model = Some(CurrentModel::new(model)?);
        }
        let mut checked = self.scope.request(&self.options).values(segment)?;
        self.warnings.append(&mut checked.warnings);
        let mut values = evaluate::values(self, &checked)?.into_iter();
        let answers = segment.lines.iter().zip(&checked.values).map(|(entered, asked)| Answer {
            line: entered.line.clone(),
            span: entered.span,
            value: asked.as_ref().and_then(|_| values.next()),
        });
        Ok(answers.collect())
    }

    /// Does something, or nothing at all where it fails.
    fn attempt<T>(&mut self, f: impl FnOnce(&mut Session) -> Result<T, Vec<Diagnostic>>) -> Result<T, Failed> {
        let (before, warnings) = (self.snapshot(), std::mem::take(&mut self.warnings));
        f(self).map_err(|diagnostics| {
            let sources = self.sources.clone();
            self.restore(before);
            self.warnings = warnings;
            Failed { diagnostics, sources }
        })
    }

    fn snapshot(&self) -> Snapshot {
        Snapshot { scope: self.scope.mark(), files: self.sources.len(), model: self.model.clone() }
    }

    fn restore(&mut self, Snapshot { scope, files, model }: Snapshot) {
        self.scope.restore(scope);
        self.sources.truncate(files);
        self.model = model;
    }
}
