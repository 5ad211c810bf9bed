//! From text to a program.

use super::{Program, check, pipeline};
use crate::check::{CheckOptions, InputValue, typed};
use crate::diagnostic::{Code, Diagnostic, Severity};
use crate::ir::SizeLimits;
use crate::jit::Limits;
use crate::source::{Loader, SourceFile, Sources, Span};
use crate::workers::Workers;
use std::collections::BTreeMap;
use thiserror::Error;

/// Options of a compilation.
#[derive(Clone, Debug)]
pub struct Options {
    /// Values of inputs by name; the others have their defaults.
    pub inputs: BTreeMap<String, InputValue>,
    /// The model of the file, and the limits of the checker.
    pub check: CheckOptions,
    /// The limits of every evaluation.
    pub limits: Limits,
    /// The threads, if any, for work that can be done at once.
    pub workers: Workers,
    /// Most operations of all functions together, and of each derivative.
    pub operations: usize,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            inputs: BTreeMap::new(),
            check: CheckOptions::default(),
            limits: Limits::default(),
            workers: Workers::default(),
            operations: SizeLimits::default().nodes,
        }
    }
}

/// The result of compiling a script without errors.
pub struct Compilation {
    /// The program.
    pub program: Program,
    /// Warnings.
    pub warnings: Vec<Diagnostic>,
    /// The files that the spans are in.
    pub sources: Sources,
}

/// The result of compiling a script with errors.
#[derive(Clone, Debug, Error)]
#[error("{}", summary(.diagnostics, .sources))]
pub struct Failed {
    /// Errors, and warnings among them; one error at least.
    pub diagnostics: Vec<Diagnostic>,
    /// The files that the spans are in.
    pub sources: Sources,
}

/// A stage of [`compile`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Text to typed tree: parsing, names, types, instantiation.
    Check,
    /// Typed tree to scalar functions.
    Lower,
    /// Scalar functions to prelude and bodies with their Jacobians.
    Differentiate,
    /// Machine code for points and Jacobians. (The other derivatives are made when they are first asked for.)
    MachineCode,
}

/// Compiles a script: its last model, or the one that the options name.
///
/// # Errors
/// All errors of the script, and its warnings, in the order of its text.
pub fn compile(script: SourceFile, loader: &dyn Loader, options: &Options) -> Result<Compilation, Failed> {
    compile_observed(script, loader, options, &mut |_| {})
}

/// As [`compile`], and says when each stage is done, for those who measure them (the compiler itself reads no clock).
///
/// # Errors
/// As [`compile`].
pub fn compile_observed(
    script: SourceFile,
    loader: &dyn Loader,
    options: &Options,
    done: &mut dyn FnMut(Stage),
) -> Result<Compilation, Failed> {
    let mut sources = Sources::default();
    let main = sources.add(script.name, script.text);
    let (model, mut diagnostics) = check(&mut sources, loader, main, &options.inputs, &options.check);
    done(Stage::Check);
    let Some(model) = model else {
        if !diagnostics.iter().any(|d| d.severity == Severity::Error) {
            let whole = Span { file: main, start: 0, end: 0 };
            diagnostics.push(
                Diagnostic::new(Code::NoModel, whole, "the file has no model")
                    .hint("a model begins with `model NAME {`; a file of functions is for other files to `use`"),
            );
        }
        return Err(Failed { diagnostics, sources });
    };
    match build_observed(model, &sources, options, done) {
        Ok(program) => Ok(Compilation { program, warnings: diagnostics, sources }),
        Err(e) => {
            diagnostics.push(e);
            Err(Failed { diagnostics, sources })
        }
    }
}

/// The stages after the check of a model, with what is wrong for the user.
pub(crate) fn build_model(model: typed::Model, sources: &Sources, options: &Options) -> Result<Program, Diagnostic> {
    build_observed(model, sources, options, &mut |_| {})
}

fn build_observed(
    model: typed::Model,
    sources: &Sources,
    options: &Options,
    done: &mut dyn FnMut(Stage),
) -> Result<Program, Diagnostic> {
    let span = model.parts.first().map_or(Span::default(), |p| p.span);
    pipeline::build(model, sources, options, done).map_err(|e| e.diagnostic(span))
}

/// The first error, with its place, for callers that show nothing else.
fn summary(diagnostics: &[Diagnostic], sources: &Sources) -> String {
    let Some(first) = diagnostics.iter().find(|d| d.severity == Severity::Error) else {
        return "the script cannot be compiled".to_owned();
    };
    format!("{}: {}", sources.place(first.span).unwrap_or_default(), first.message)
}
