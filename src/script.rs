//! Scripts from files: loading, compiling, values of parameters.

use crate::cli::{CompileArgs, ValueArgs};
use crate::error::CommandError;
use crate::provenance::Provenance;
use crate::saved::SavedFit;
use crate::{dimensions, values};
use gml_compiler::program::{self, Compilation, Options, Program};
use gml_compiler::source::{Loader, SourceFile};
use gml_runtime::fit::FitResult;
use gml_runtime::model::Motion;
use gml_runtime::workers::workers;
use std::path::{Component, Path, PathBuf};

/// The largest script in bytes: people write scripts, so that a larger file is probably not one.
pub(crate) const LARGEST_SCRIPT: u64 = 16 << 20;

/// Loads files that scripts `use`, relative to the using script.
#[derive(Debug)]
pub(crate) struct FileLoader;

impl Loader for FileLoader {
    fn load(&self, path: &str, from: &str) -> Result<SourceFile, String> {
        let base = Path::new(from).parent().unwrap_or_else(|| Path::new(""));
        let full = plain(&base.join(path));
        let text = read_text(&full)?;
        Ok(SourceFile { name: full.display().to_string(), text })
    }
}

/// The path without `.` and `..`, if that leads to the same file, so that a file has one name however it is used.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match (part, plain.components().next_back()) {
            (Component::CurDir, _) => {}
            (Component::ParentDir, Some(Component::Normal(_))) => _ = plain.pop(),
            _ => plain.push(part),
        }
    }
    // Behind a symbolic link to a folder, `..` leads elsewhere.
    match (plain.canonicalize(), path.canonicalize()) {
        (Ok(a), Ok(b)) if a == b => plain,
        (Err(_), Err(_)) => plain,
        _ => path.to_owned(),
    }
}

/// Reads the text of a script.
pub(crate) fn read(path: &Path) -> Result<String, CommandError> {
    read_text(path).map_err(CommandError::Failed)
}

fn read_text(path: &Path) -> Result<String, String> {
    let shown = path.display();
    let size = std::fs::metadata(path).map_err(|e| format!("{shown}: {}", reason(&e)))?;
    if size.is_dir() {
        return Err(format!("{shown}: is a folder, not a script"));
    }
    if size.len() > LARGEST_SCRIPT {
        return Err(format!("{shown}: {} bytes is too large for a script (at most {LARGEST_SCRIPT})", size.len()));
    }
    let bytes = std::fs::read(path).map_err(|e| format!("{shown}: {}", reason(&e)))?;
    String::from_utf8(bytes)
        .map_err(|e| format!("{shown}: is not UTF-8 text (at byte {}); is it a script?", e.utf8_error().valid_up_to()))
}

/// The reason of an IO error in words.
pub(crate) fn reason(e: &std::io::Error) -> String {
    match e.kind() {
        std::io::ErrorKind::NotFound => "there is no such file".into(),
        std::io::ErrorKind::PermissionDenied => "permission denied".into(),
        _ => e.to_string(),
    }
}

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
    let file = SourceFile { name: shown.to_string(), text: read(script)? };
    let mut options = Options { inputs: args.inputs.iter().cloned().collect(), ..compile_options() };
    for (name, value) in &args.limits {
        options.set_limit(name, *value).map_err(|e| CommandError::Usage(format!("--limit: {e}")))?;
    }
    program::compile(file, &FileLoader, &options).map_err(CommandError::from)
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
    /// The fit, if all values are its own; with the measures of the program.
    pub(crate) fit: Option<FitResult>,
}

/// Compiles a script, with parameters from defaults, a fit and `-p` options; the fit's inputs are the script's.
pub(crate) fn compile_valued(script: &Path, compile: &CompileArgs, args: &ValueArgs) -> Result<Valued, CommandError> {
    let fit = args.params.as_deref().map(SavedFit::read).transpose()?;
    let program = compile_for(script, compile, fit.as_ref(), &[])?;
    let provenance = Provenance::of(script, &program);
    let x = values_for(&program, fit.as_ref(), args)?;
    let motion = fit.as_ref().and_then(SavedFit::pose).unwrap_or(Motion::IDENTITY);
    let mut fit = fit.filter(|_| args.values.is_empty()).map(SavedFit::into_result);
    if let Some(fit) = &mut fit {
        fit.measures = dimensions::of_saved(&program, fit, &provenance);
    }
    Ok(Valued { program, x, motion, fit })
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
        let (i, value) = values::parameter_value("-p", name, value, known)?;
        x[i] = value;
    }
    for (parameter, (value, bounds)) in known.iter().zip(x.iter().zip(program.bounds(&x))) {
        parameter.within(*value, bounds).map_err(CommandError::Failed)?;
    }
    Ok(x)
}
