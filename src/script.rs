//! Scripts from files: loading, compiling, values of parameters.

use crate::cli::{LimitArgs, ScriptArgs, ValueArgs};
use crate::error::CommandError;
use crate::values;
use gml_compiler::check::InputValue;
use gml_compiler::program::{self, Compilation, Options, Program};
use gml_compiler::source::{Loader, SourceFile};
use gml_runtime::fit::FitResult;
use gml_runtime::model::Motion;
use gml_runtime::workers::workers;
use std::collections::BTreeMap;
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
pub(crate) fn compile(args: &ScriptArgs) -> Result<Program, CommandError> {
    let compilation = compile_quietly(args)?;
    crate::diagnostics::print(&compilation.warnings, &compilation.sources);
    Ok(compilation.program)
}

/// Values of inputs from `--input` options.
pub(crate) fn inputs(given: &[String]) -> Result<BTreeMap<String, InputValue>, CommandError> {
    let mut inputs = BTreeMap::new();
    for given in given {
        let (name, value) = values::assignment("--input", given)?;
        inputs.insert(name.to_owned(), values::input_value(name, value)?);
    }
    Ok(inputs)
}

/// The compiler's options with workers on all processors.
pub(crate) fn compile_options() -> Options {
    Options { workers: workers(), ..Options::default() }
}

/// Compiles a script and returns the warnings with it.
pub(crate) fn compile_quietly(args: &ScriptArgs) -> Result<Compilation, CommandError> {
    if let Some(format @ ("ply" | "obj" | "stl")) = args.model.extension().and_then(|e| e.to_str()) {
        let shown = args.model.display();
        return Err(CommandError::Failed(format!(
            "{shown}: is a mesh or a scan (.{format}); the script (.gml) comes first"
        )));
    }
    let text = read(&args.model)?;
    let mut options = Options { inputs: inputs(&args.inputs)?, ..compile_options() };
    set_limits(&mut options, &args.limits)?;
    let file = SourceFile { name: args.model.display().to_string(), text };
    program::compile(file, &FileLoader, &options).map_err(CommandError::from)
}

/// Sets limits from `--limit` options.
fn set_limits(options: &mut Options, args: &LimitArgs) -> Result<(), CommandError> {
    for given in &args.limits {
        let (name, value) = values::assignment("--limit", given)?;
        let value = value.parse().map_err(|_| {
            CommandError::usage(format!("--limit {name}: '{value}' is not a whole number such as 100000"))
        })?;
        options.set_limit(name, value).map_err(|e| CommandError::usage(format!("--limit: {e}")))?;
    }
    Ok(())
}

/// The parameters from defaults, a fit and `-p` options, with the pose that the fit added.
pub(crate) fn parameters(program: &Program, args: &ValueArgs) -> Result<(Vec<f64>, Motion), CommandError> {
    let known = program.parameters();
    let mut x: Vec<f64> = known.iter().map(|p| p.default).collect();
    let mut motion = Motion::IDENTITY;
    if let Some(path) = &args.params {
        let fit = read_fit(path)?;
        for p in &fit.parameters {
            let Some(i) = known.iter().position(|k| k.name == p.name) else {
                return Err(CommandError::Failed(format!(
                    "{}: the model has no parameter '{}': was it fitted with another script?",
                    path.display(),
                    p.name
                )));
            };
            x[i] = p.value;
        }
        if let Some(pose) = fit.pose {
            motion = pose;
        }
    }
    for (i, value) in values::parameters(&args.values, known)? {
        x[i] = value;
    }
    for (i, (low, high)) in program.bounds(&x).into_iter().enumerate() {
        // Rounding of a printed value must not put it out of bounds.
        let slack = 1e-9 * (1.0 + x[i].abs());
        if !(x[i] >= low - slack && x[i] <= high + slack) {
            let p = &known[i];
            let unit = p.quantity.unit();
            return Err(CommandError::Failed(format!(
                "parameter {}: {}{unit} is not within its bounds {low}{unit}..{high}{unit}",
                p.name, x[i]
            )));
        }
    }
    Ok((x, motion))
}

fn read_fit(path: &Path) -> Result<FitResult, CommandError> {
    let text = read(path)?;
    serde_json::from_str(&text)
        .map_err(|e| CommandError::Failed(format!("{}: is not a result of `gmlc fit`: {e}", path.display())))
}
