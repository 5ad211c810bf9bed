//! Long-running commands: meshes, fits, inspections, timing.

use super::commands::no_model;
use super::state::Repl;
use crate::cli::{
    self, CompileArgs, FitControls, InspectArgs, MeshArgs, MoreScansArgs, ReportArgs, ResultArgs, ScanArgs, ScriptArgs,
    VarianceControls,
};
use crate::error::CommandError;
use crate::progress::TerminalProgress;
use crate::provenance::Provenance;
use crate::saved::SavedFit;
use crate::script::compile_options;
use crate::subject::Subject;
use crate::{fit as fitting, inspect as inspecting, measure, mesh as meshing, outputs, record};
use clap::{CommandFactory, Parser};
use gml_compiler::program::{Limits, Program};
use gml_runtime::model::Motion;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// How long `:time` repeats each of its two measurements.
const REPEATED_FOR: Duration = Duration::from_millis(200);

/// The arguments of `gmlc mesh`.
#[derive(Debug, Parser)]
#[command(name = ":mesh", no_binary_name = true)]
struct MeshLine {
    #[command(flatten)]
    args: MeshArgs,
}

#[derive(Debug, Parser)]
#[command(name = ":fit", no_binary_name = true)]
struct FitLine {
    #[command(flatten)]
    scan: ScanArgs,
    #[command(flatten)]
    controls: FitControls,
    /// Go on from a result of `gmlc fit`: from its parameters and its pose, not from the values that were set; -p
    /// overrides parameters
    #[arg(long, value_name = "FIT.json")]
    params: Option<PathBuf>,
    /// Where to write the result
    #[arg(short, long, value_name = "FIT.json")]
    output: Option<PathBuf>,
}

#[derive(Debug, Parser)]
#[command(name = ":inspect", no_binary_name = true)]
struct InspectLine {
    #[command(flatten)]
    scan: ScanArgs,
    /// Folder for the results
    #[arg(value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    fit: FitControls,
    /// Go on from a result of `gmlc fit`: from its parameters and its pose, not from the values that were set; -p
    /// overrides parameters
    #[arg(long, value_name = "FIT.json")]
    params: Option<PathBuf>,
    #[command(flatten)]
    variance: VarianceControls,
}

/// The help of a command's options, if it has any.
pub(crate) fn options_of(command: &str) -> Option<String> {
    let help = match command {
        "fit" => FitLine::command().render_help(),
        "inspect" => InspectLine::command().render_help(),
        _ => return None,
    };
    Some(help.to_string().trim_end().to_owned())
}

/// `:mesh FILE`.
pub(crate) fn mesh(repl: &mut Repl, rest: &str) -> Result<(), CommandError> {
    if repl.session.borrow().model().is_none() {
        return Err(no_model());
    }
    // Options of `gmlc mesh` may follow the file's name.
    let mut words = words(rest)?;
    if words.is_empty() {
        return Err(CommandError::usage("an argument is missing, as in :mesh cup.obj"));
    }
    let model = script(repl).display().to_string();
    words.splice(0..0, [model, "-o".to_owned()]);
    let line: MeshLine = parsed(words)?;
    let MeshArgs { script: ScriptArgs { compile, .. }, values, .. } = &line.args;
    if values.params.is_some() || !(values.values.is_empty() && compile.inputs.is_empty() && compile.limits.is_empty())
    {
        let message = "--params, -p, --input and --limit have no meaning here: the model has the values that were set";
        return Err(CommandError::usage(message));
    }
    let (program, x) = program(repl)?;
    meshing::write_model(&line.args, &program, &x, &Motion::IDENTITY)
}

/// `:fit SCAN`.
pub(crate) fn fit(repl: &mut Repl, rest: &str) -> Result<(), CommandError> {
    let line: FitLine = parsed(words(rest)?)?;
    let (subject, controls) = subject(repl, line.controls, line.params.as_deref())?;
    for output in line.output.iter().chain(&controls.trace) {
        let inputs = outputs::inputs([&line.scan.scan], line.params.as_ref()).chain(repl.params.as_deref());
        outputs::require_apart(output, inputs)?;
        outputs::require_apart_from_scripts(output, &subject.program)?;
    }
    outputs::require_two(line.output.as_ref(), controls.trace.as_ref())?;
    let options = subject.options(&controls, &subject.program)?;
    let scan = fitting::read_scan(&line.scan)?;
    let progress = TerminalProgress::new();
    let fitted = fitting::run_fit(&subject.program, &subject.provenance, &scan, &options, &progress);
    progress.finish();
    let mut fitted = fitted?;
    fitted.warnings.extend(scan.warnings);
    let mut record = record::of_line(&format!(":fit {rest}"), &FitLine::command(), words(rest)?);
    record::add_inputs(&mut record, std::slice::from_ref(&scan.source), &subject.program, line.params.as_deref());
    fitted.provenance = Some(record);
    fitting::write_trace(controls.trace.as_deref(), &fitted)?;
    fitting::unless_interrupted(&fitted)?;
    if let Some(path) = &line.output {
        outputs::write_json(path, &fitted)?;
    }
    print!("{}", fitting::summary(&fitted));
    let values: Vec<f64> = fitted.parameters.iter().map(|p| p.value).collect();
    repl.session.borrow_mut().set_all(&values)?;
    println!("the parameters are set to these values");
    fitting::judge(&fitted)
}

/// `:inspect SCAN DIR`.
pub(crate) fn inspect(repl: &mut Repl, rest: &str) -> Result<(), CommandError> {
    let line: InspectLine = parsed(words(rest)?)?;
    let record = record::of_line(&format!(":inspect {rest}"), &InspectLine::command(), words(rest)?);
    let (subject, fit) = subject(repl, line.fit, line.params.as_deref())?;
    let args = InspectArgs {
        script: subject.script.clone(),
        scan: line.scan,
        more: MoreScansArgs::default(),
        fit,
        params: None,
        no_fit: false,
        search: Vec::new(),
        variance: line.variance,
        report: ReportArgs::default(),
        output: line.output,
        result: ResultArgs::default(),
    };
    if let (Some(trace), Some(params)) = (&args.fit.trace, &repl.params) {
        outputs::require_apart(trace, [params.as_path()])?;
    }
    let options = measure::options(&args.variance)?;
    let progress = TerminalProgress::new();
    let result = inspecting::inspect(&subject, &args, &options, record, &progress);
    progress.finish();
    result
}

/// `:time EXPR`.
pub(crate) fn time(repl: &mut Repl, text: &str) -> Result<(), CommandError> {
    let interrupt = repl.interrupt.clone();
    let mut session = repl.session.borrow_mut();
    let native = session.native(text, Limits::default(), &repl.loader)?;
    let compile = fastest(1, || session.native(text, Limits::default(), &repl.loader).is_ok())
        .ok_or_else(CommandError::interrupted)?;
    let stopped = |e| CommandError::Failed(format!("the evaluation was stopped: {e:?}"));
    native.run().map_err(stopped)?;
    // Short runs are timed in batches, which hides the cost of the clock.
    let run = fastest(1000, || !interrupt.load(Ordering::Relaxed) && native.run().is_ok());
    let run = run.ok_or_else(CommandError::interrupted)?;
    println!("compiled in {}, runs in {}", shown(compile), shown(run));
    Ok(())
}

/// The shortest time of one run, in seconds; none if a run fails. Batches have at most `largest_batch` runs.
fn fastest(largest_batch: u32, mut run: impl FnMut() -> bool) -> Option<f64> {
    let begun = Instant::now();
    let mut best = f64::INFINITY;
    let mut batch = 1;
    while begun.elapsed() < REPEATED_FOR {
        let started = Instant::now();
        for _ in 0..batch {
            if !run() {
                return None;
            }
        }
        let elapsed = started.elapsed();
        best = best.min(elapsed.as_secs_f64() / f64::from(batch));
        if elapsed < Duration::from_micros(100) {
            batch = (batch * 2).min(largest_batch);
        }
    }
    Some(best)
}

fn shown(seconds: f64) -> String {
    match seconds {
        s if s < 1e-6 => format!("{:.0} ns", s * 1e9),
        s if s < 1e-3 => format!("{:.2} us", s * 1e6),
        s if s < 1.0 => format!("{:.2} ms", s * 1e3),
        s => format!("{s:.2} s"),
    }
}

/// The current model as a program, and the values of its parameters.
fn program(repl: &Repl) -> Result<(Program, Vec<f64>), CommandError> {
    let session = repl.session.borrow();
    let x = session.model().ok_or_else(no_model)?.values().to_vec();
    Ok((session.compile(&compile_options())?.program, x))
}

/// The name of the script for results; the model's name if it was entered.
fn script(repl: &Repl) -> PathBuf {
    let session = repl.session.borrow();
    let name = session.model_file().or_else(|| session.model().map(|m| m.name().to_owned()));
    PathBuf::from(name.unwrap_or_default())
}

/// What is fitted, and the options of the fit: it starts from the values that were set, or from an earlier fit.
fn subject(repl: &Repl, given: FitControls, params: Option<&Path>) -> Result<(Subject, FitControls), CommandError> {
    let (program, x) = program(repl)?;
    let script = ScriptArgs { model: script(repl), compile: CompileArgs::default() };
    let provenance = Provenance::of_current(&script.model, repl.session.borrow().model_file().is_none(), &repl.loader);
    let saved = params.map(SavedFit::read).transpose()?;
    if let Some(saved) = &saved {
        saved.require_same_inputs(&program)?;
        saved.require_model(&program, &provenance, &script.compile)?;
        saved.name_released(&given);
    }
    let controls = if saved.is_some() { given } else { from_session(given, &program, &x) };
    Ok((Subject { script, program, provenance, saved }, controls))
}

/// The options of a fit that starts from the values that were set, unless its options override them.
fn from_session(mut controls: FitControls, program: &Program, x: &[f64]) -> FitControls {
    let mut values: Vec<(String, String)> = Vec::new();
    let held = |name: &str| controls.fix.iter().any(|f| f.split_once('=').is_some_and(|(n, _)| n.trim() == name));
    for (p, value) in program.parameters().iter().zip(x) {
        if *value != p.default && !held(&p.name) {
            values.push((p.name.clone(), format!("{value}{}", p.quantity.unit())));
        }
    }
    values.append(&mut controls.values);
    FitControls { values, ..controls }
}

/// Parses words like a command line.
fn parsed<L: Parser>(words: Vec<String>) -> Result<L, CommandError> {
    L::try_parse_from(cli::with_negative_values(words.into_iter().map(OsString::from))).map_err(|e| {
        let text = e.render().to_string();
        CommandError::Usage(text.trim_start_matches("error: ").trim_end().to_owned())
    })
}

/// The words of a line; words with spaces are in quotes.
fn words(line: &str) -> Result<Vec<String>, CommandError> {
    let mut words = Vec::new();
    let mut word: Option<String> = None;
    let mut quoted = false;
    for c in line.chars() {
        match c {
            '"' => {
                quoted = !quoted;
                word.get_or_insert_default();
            }
            c if c.is_whitespace() && !quoted => words.extend(word.take()),
            c => word.get_or_insert_default().push(c),
        }
    }
    if quoted {
        return Err(CommandError::usage("a quotation mark is not closed"));
    }
    words.extend(word);
    Ok(words)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_split_at_spaces_outside_of_quotes() {
        assert_eq!(words("a  \"b c\" d\"e\"").ok(), Some(vec!["a".into(), "b c".into(), "de".into()]));
        assert!(words("\"a").is_err());
    }
}
