//! From text to a program: all stages.

use super::derivatives::ModelFunctions;
use super::grids::Grids;
use super::kernels::Kernels;
use super::on_demand::OnDemand;
use super::{Part, Program, check};
use crate::check::{CheckOptions, InputValue, typed};
use crate::diagnostic::{Code, Diagnostic, Severity};
use crate::diff::DiffError;
use crate::ir::inline::{InlineError, SizeLimits};
use crate::ir::lower;
use crate::jit::{JitError, Limits};
use crate::source::{Loader, SourceFile, Sources, Span};
use crate::workers::Workers;
use std::collections::BTreeMap;
use thiserror::Error;

/// How to compile.
#[derive(Clone, Debug)]
pub struct Options {
    /// Values of inputs by name; the others have their defaults.
    pub inputs: BTreeMap<String, InputValue>,
    /// Which model of the file, and the limits of the checker.
    pub check: CheckOptions,
    /// The limits of every evaluation.
    pub limits: Limits,
    /// Who does what can be done at once.
    pub workers: Workers,
    /// How many operations each function may have that is compiled, and its derivatives.
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

/// What comes out of a script without errors.
pub struct Compilation {
    /// The program.
    pub program: Program,
    /// Warnings.
    pub warnings: Vec<Diagnostic>,
    /// The files that the spans are in.
    pub sources: Sources,
}

/// What comes out of a script with errors.
#[derive(Clone, Debug, Error)]
#[error("{}", summary(.diagnostics, .sources))]
pub struct Failed {
    /// Errors, and warnings among them; one error at least.
    pub diagnostics: Vec<Diagnostic>,
    /// The files that the spans are in.
    pub sources: Sources,
}

/// Why a checked model cannot be compiled.
#[derive(Clone, Debug, Error)]
pub(super) enum BuildError {
    #[error(transparent)]
    Inline(#[from] InlineError),
    #[error(transparent)]
    Diff(#[from] DiffError),
    #[error(transparent)]
    Jit(#[from] JitError),
}

impl BuildError {
    fn diagnostic(&self, model: Span) -> Diagnostic {
        match self {
            BuildError::Inline(e) => size_error(e),
            BuildError::Diff(e) => derivative_error(e),
            BuildError::Jit(e) => Diagnostic::new(Code::MachineCode, model, e.to_string()),
        }
    }
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
/// What is wrong with the script, in the order of its text.
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
    build(model, sources, options, done).map_err(|e| match e {
        NotBuilt::Lower(e) => e.diagnostic(),
        NotBuilt::Build(e) => e.diagnostic(span),
    })
}

/// Why a derivative cannot be had, for the user.
pub(crate) fn derivative_error(e: &DiffError) -> Diagnostic {
    match e {
        DiffError::Size(e) => size_error(e),
        e => Diagnostic::new(Code::Derivative, e.span(), e.to_string()),
    }
}

fn size_error(e: &InlineError) -> Diagnostic {
    let error = Diagnostic::new(Code::TooLarge, e.span(), e.to_string());
    match e {
        InlineError::TooLarge { .. } => error.hint("the limit can be raised: --limit operations=N"),
        InlineError::TooDeep { .. } => error,
    }
}

enum NotBuilt {
    Lower(lower::TooLarge),
    Build(BuildError),
}

/// The stages after the check.
fn build(
    typed: typed::Model,
    sources: &Sources,
    options: &Options,
    done: &mut dyn FnMut(Stage),
) -> Result<Program, NotBuilt> {
    let limits = SizeLimits { nodes: options.operations, ..SizeLimits::default() };
    let mut lowered = lower::lower_within(&typed, limits).map_err(NotBuilt::Lower)?;
    done(Stage::Lower);
    let functions = ModelFunctions::new(&mut lowered, options.workers).map_err(NotBuilt::Build)?;
    done(Stage::Differentiate);
    let kernels = Kernels::new(&functions, options.workers).map_err(|e| NotBuilt::Build(e.into()))?;
    done(Stage::MachineCode);
    let parts = lowered.parts.iter().zip(&functions.parts).map(|(part, functions)| Part {
        name: part.name.clone(),
        group: part.group.clone(),
        active: functions.jacobian.active.clone(),
    });
    Ok(Program {
        name: lowered.name.clone(),
        doc: lowered.doc.clone(),
        parameters: lowered.params.clone(),
        inputs: lowered.inputs.clone(),
        parts: parts.collect(),
        sources: sources.clone(),
        typed,
        functions,
        kernels,
        derived: OnDemand::new(options.workers),
        grids: Grids::default(),
        limits: options.limits,
    })
}

/// The first error, with its place, for callers that show nothing else.
fn summary(diagnostics: &[Diagnostic], sources: &Sources) -> String {
    let Some(first) = diagnostics.iter().find(|d| d.severity == Severity::Error) else {
        return "the script cannot be compiled".to_owned();
    };
    let (line, column) = sources.line_column(first.span);
    let file = sources.get(first.span.file).map_or("", |f| f.name.as_str());
    format!("{file}:{line}:{column}: {}", first.message)
}
