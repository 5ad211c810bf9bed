//! Scripts from files: compiling, values of parameters.

use crate::cli::{CompileArgs, ValueArgs};
use crate::error::CommandError;
use crate::files::{self, FileLoader};
use crate::provenance::Provenance;
use crate::saved::SavedFit;
use crate::values;
use crate::verbosity;
use gml_compiler::program::{self, Compilation, Options, Program};
use gml_compiler::source::SourceFile;
use gml_runtime::fit::FitResult;
use gml_runtime::model::Motion;
use gml_runtime::workers::workers;
use std::path::Path;

/// Compiles a script and prints its warnings to standard error.
pub(crate) fn compile(script: &Path, args: &CompileArgs) -> Result<Program, CommandError> {
    let compilation = compile_quietly(script, args)?;
    crate::diagnostics::print(&compilation.warnings, &compilation.sources);
    Ok(compilation.program)
}

/// The compiler's options with workers on all processors.
pub(crate) fn compile_options() -> Options {
    Options { workers: workers(), ..Options::default() }
}

/// Compiles a script and returns the warnings with it.
pub(crate) fn compile_quietly(script: &Path, args: &CompileArgs) -> Result<Compilation, CommandError> {
    let shown = script.display();
    if let Some(format @ ("ply" | "obj" | "stl")) = script.extension().and_then(|e| e.to_str()) {
        return Err(CommandError::Failed(format!(
            "{shown}: is a mesh or a scan (.{format}); the script (.gml) comes first"
        )));
    }
    let file = SourceFile { name: script.display().to_string(), text: files::read_script(script)? };
    let options = options(args)?;
    let loader = FileLoader::of(script, &args.allowed)?;
    verbosity::timed("compiling", || program::compile(file, &loader, &options)).map_err(CommandError::from)
}

/// The compiler's options of a command line.
pub(crate) fn options(args: &CompileArgs) -> Result<Options, CommandError> {
    let mut options = Options { inputs: args.inputs.iter().cloned().collect(), ..compile_options() };
    for (name, value) in &args.limits {
        options.set_limit(name, *value).map_err(|e| CommandError::Usage(format!("--limit: {e}")))?;
    }
    Ok(options)
}

/// Compiles a script with the inputs of a fit, if there is one, but for those that are `searched`.
pub(crate) fn compile_for(
    script: &Path,
    args: &CompileArgs,
    fit: Option<&SavedFit>,
    searched: &[&str],
) -> Result<Program, CommandError> {
    let Some(fit) = fit else { return compile(script, args) };
    let program = compile(script, &fit.with_inputs(args, searched)?).map_err(|e| fit.explain(e))?;
    fit.require_model(&program, &Provenance::of(script, &program), args)?;
    Ok(program)
}

/// A program with values of its parameters.
pub(crate) struct Valued {
    pub(crate) program: Program,
    pub(crate) x: Vec<f64>,
    /// The pose that a fit added.
    pub(crate) motion: Motion,
    /// The fit, if there is one and all values are its own; with the measures of the program.
    pub(crate) fit: Option<FitResult>,
    /// The file that the values began from.
    pub(crate) saved: Option<SavedFit>,
}

/// Compiles a script, with parameters from defaults, a fit and `-p` options; the fit's inputs are the script's.
pub(crate) fn compile_valued(script: &Path, compile: &CompileArgs, args: &ValueArgs) -> Result<Valued, CommandError> {
    let fit = args.params.as_deref().map(SavedFit::read).transpose()?;
    let program = compile_for(script, compile, fit.as_ref(), &[])?;
    let provenance = Provenance::of(script, &program);
    let x = values_for(&program, fit.as_ref(), args)?;
    let motion = fit.as_ref().and_then(SavedFit::pose).unwrap_or(Motion::IDENTITY);
    let saved = fit;
    let fit = saved.clone().filter(|saved| args.values.is_empty() && !saved.is_truth());
    let fit = fit.map(|fit| fit.into_measured(&program, &provenance));
    Ok(Valued { program, x, motion, fit, saved })
}

impl Valued {
    /// Warns where the values are those of a fit that did not end well.
    pub(crate) fn warn_of_doubt(&self) {
        if let Some(doubt) = self.saved.as_ref().and_then(SavedFit::doubt) {
            eprintln!("warning: {doubt}");
        }
    }
}

/// Values of a program's parameters: its defaults, or those of a fit, and those of `-p`.
pub(crate) fn values_for(
    program: &Program,
    fit: Option<&SavedFit>,
    args: &ValueArgs,
) -> Result<Vec<f64>, CommandError> {
    let known = program.parameters();
    let mut x = fit.map_or_else(|| program.defaults(), |fit| fit.values_of(program));
    for (name, value) in &args.values {
        let (i, value) = values::parameter_value("-p", name, value, program)?;
        x[i] = value;
    }
    for (parameter, (value, bounds)) in known.iter().zip(x.iter().zip(program.bounds(&x))) {
        let is_given = args.values.iter().any(|(name, _)| name.trim() == parameter.name);
        let place = fit.filter(|_| !is_given).map_or_else(String::new, |fit| format!("{}: ", fit.path().display()));
        parameter.within(*value, bounds).map_err(|what| CommandError::Failed(format!("{place}{what}")))?;
    }
    Ok(x)
}
