//! `gmlc check`.

use crate::cli::CheckArgs;
use crate::closedness::{self, Meeting};
use crate::error::CommandError;
use crate::provenance::Provenance;
use crate::saved::SavedFit;
use crate::{dimensions, findings, script, table};
use gml_compiler::check::lints;
use gml_compiler::diagnostic::{Code, Diagnostic, Severity};
use gml_compiler::program::{Compilation, Failed, Input, Parameter, Program, Quantity};
use gml_compiler::source::{FileId, Sources, Span};
use gml_compiler::{number, syntax};
use gml_runtime::figures::{MeasureValue, measured};
use gml_runtime::fit::FitResult;
use gml_runtime::model::{Closedness, EvaluationError, OpenBorder};
use serde_json::{Value, json};
use std::path::Path;

pub(crate) fn run(args: &CheckArgs) -> Result<(), CommandError> {
    match (&args.explain, &args.model) {
        (Some(code), _) => explain(code),
        (None, Some(model)) => check(model, args),
        (None, None) => Err(CommandError::usage("a script is required")),
    }
}

fn check(script: &Path, args: &CheckArgs) -> Result<(), CommandError> {
    let mut checked = compiled(script, args)?;
    if !checked.diagnostics.iter().any(|d| d.severity == Severity::Error) {
        checked.add_slow_warnings();
    }
    let failed = checked.diagnostics.iter().any(|d| d.severity == Severity::Error);
    match args.result.is_json() {
        true => println!("{:#}", document(&checked, !failed)),
        false if failed => {
            let Checked { diagnostics, sources, .. } = checked;
            return Err(CommandError::from(Failed { diagnostics, sources }));
        }
        false => {
            crate::diagnostics::print(&checked.diagnostics, &checked.sources);
            let Some(program) = &checked.program else {
                println!("no model: a module for other scripts");
                return Ok(());
            };
            print!("{}", checked.tables(program));
            if let Some(closedness) = &checked.closedness {
                print!("\n{}", closedness::line(program, closedness, checked.overlap));
            }
        }
    }
    if failed { Err(CommandError::Failed("the script has errors".into())) } else { Ok(()) }
}

/// Compiles a script, with the inputs of a fit where there is one.
fn compiled(script: &Path, args: &CheckArgs) -> Result<Checked, CommandError> {
    let CheckArgs { compile, values, .. } = args;
    let given = values.params.is_some() || !values.values.is_empty();
    let fit = values.params.as_deref().map(SavedFit::read).transpose()?;
    let with_inputs = fit.as_ref().map(|fit| fit.with_inputs(compile, &[])).transpose()?;
    let compilation = match script::compile_quietly(script, with_inputs.as_ref().unwrap_or(compile)) {
        Ok(compilation) => compilation,
        Err(error) => match fit.iter().fold(error, |error, fit| fit.explain(error)) {
            CommandError::Script(failed) => {
                let checked = library(*failed);
                let errors = checked.diagnostics.iter().any(|d| d.severity == Severity::Error);
                if given && !errors {
                    return Err(CommandError::usage("--params and -p require a script with a model"));
                }
                return Ok(checked);
            }
            error => return Err(error),
        },
    };
    let Compilation { program, warnings, sources } = compilation;
    let provenance = Provenance::of(script, &program);
    if let Some(fit) = &fit {
        fit.require_model(&program, &provenance, compile)?;
        if let Some(doubt) = fit.doubt() {
            eprintln!("warning: {doubt}");
        }
    }
    let x = script::values_for(&program, fit.as_ref(), values)?;
    let fit = fit
        .filter(|fit| values.values.is_empty() && !fit.is_truth())
        .map(|fit| fit.into_measured(&program, &provenance));
    Ok(Checked {
        program: Some(program),
        values: x,
        given,
        measured: Vec::new(),
        fit,
        diagnostics: warnings,
        sources,
        closedness: None,
        overlap: None,
    })
}

/// A checked script.
struct Checked {
    /// None if there are errors, or if the file has no model.
    program: Option<Program>,
    /// Values of the parameters: the defaults, unless others are `given`.
    values: Vec<f64>,
    given: bool,
    /// The measures at these values.
    measured: Vec<Result<MeasureValue, EvaluationError>>,
    /// The fit, if all values are its own.
    fit: Option<FitResult>,
    diagnostics: Vec<Diagnostic>,
    sources: Sources,
    /// How the parts meet at these values; none where they cannot be evaluated.
    closedness: Option<Closedness>,
    /// A place at which closed bodies lie in each other. Millimetres.
    overlap: Option<[f64; 3]>,
}

/// An error for a model that cannot be meshed at its defaults, or at the values that were `given`.
fn not_evaluated(error: &EvaluationError, given: bool) -> Diagnostic {
    let values = if given { "these values" } else { "its defaults" };
    let message = format!("the model cannot be evaluated at {values}: {}", error.sentence);
    Diagnostic::new(Code::Evaluation, error.span.unwrap_or_default(), message).label(error.circumstances.clone())
}

impl Checked {
    /// Adds warnings that take longer than other commands should wait for.
    fn add_slow_warnings(&mut self) {
        let main = FileId::default();
        if let Some(file) = self.sources.get(main) {
            self.diagnostics.extend(lints(&syntax::parse(main, &file.text).0));
            self.diagnostics.extend(syntax::look_alikes(main, &file.text));
        }
        if let Some(program) = &self.program {
            let reported: Vec<Span> = self.diagnostics.iter().map(|d| d.span).collect();
            self.diagnostics.extend(program.probe().into_iter().filter(|d| !reported.contains(&d.span)));
            let found = closedness::of(program, &self.values).map_err(|error| program.placed(error, &self.values));
            self.closedness = match found {
                Err(error) => {
                    // Unless the probe, which knows the defaults only, has found it, at other places.
                    if self.given || !self.diagnostics.iter().any(|d| d.code == Code::Evaluation) {
                        self.diagnostics.push(not_evaluated(&error, self.given));
                    }
                    None
                }
                Ok(Meeting { closedness, passages, overlap }) => {
                    self.diagnostics.extend(passages.iter().map(|p| closedness::passage_warning(program, p)));
                    self.overlap = overlap;
                    Some(closedness)
                }
            };
            self.diagnostics.extend(self.closedness.iter().flat_map(|c| closedness::warnings(program, c)));
        }
        self.add_measures();
        self.diagnostics.sort_by_key(|d| (d.span.file, d.span.start));
    }

    /// Adds an error for each measure that cannot be computed at these values.
    fn add_measures(&mut self) {
        let Some(program) = &self.program else { return };
        self.measured = measured(program, &self.values);
        for (measure, measured) in program.measures().iter().zip(&self.measured) {
            if let Err(error) = measured {
                self.diagnostics.push(Diagnostic::new(Code::Evaluation, measure.span, error.sentence.clone()));
            }
        }
    }

    /// The tables of parameters, inputs and parts.
    fn tables(&self, program: &Program) -> String {
        let parameters = program.parameters();
        let mut out = format!("model {}\n", program.name());
        if !parameters.is_empty() {
            let heading = if self.given { "value" } else { "default" };
            out.push_str(&parameter_table(heading, parameters, &self.values, &program.bounds(&self.values)));
        }
        out.push_str(&input_table(program.inputs()));
        out.push_str(&match &self.fit {
            Some(fit) if !fit.measures.is_empty() => format!("\n{}", dimensions::fitted(&fit.measures)),
            _ => dimensions::declared(
                if self.given { "value" } else { "nominal" },
                program,
                &self.values,
                &self.measured,
            ),
        });
        let rows: Vec<Vec<String>> = program
            .parts()
            .iter()
            .map(|p| {
                let names: Vec<&str> = p.active.iter().map(|&i| parameters[i as usize].name.as_str()).collect();
                vec![p.name.clone(), names.join(" ")]
            })
            .collect();
        out.push('\n');
        out.push_str(&table::render(&["part", "depends on"], &rows));
        out
    }
}

/// A file without a model is valid if it has functions for other scripts.
fn library(errors: Failed) -> Checked {
    let Failed { mut diagnostics, sources } = errors;
    let main = FileId::default();
    let tree = sources.get(main).map(|file| syntax::parse(main, &file.text).0);
    if tree.is_some_and(|tree| !tree.items.is_empty()) {
        diagnostics.retain(|d| d.code != Code::NoModel);
    }
    Checked {
        program: None,
        values: Vec::new(),
        given: false,
        measured: Vec::new(),
        fit: None,
        diagnostics,
        sources,
        closedness: None,
        overlap: None,
    }
}

/// A table of parameters with their values, which `heading` names, and bounds.
pub(crate) fn parameter_table(
    heading: &str,
    parameters: &[Parameter],
    values: &[f64],
    bounds: &[(f64, f64)],
) -> String {
    let row = |((p, value), (low, high)): ((&Parameter, &f64), &(f64, f64))| {
        let [value, low, high] = [*value, *low, *high].map(|x| shown(x, p.quantity));
        vec![p.name.clone(), value, low, high, p.quantity.written(0.0).1.into(), first_line(&p.doc)]
    };
    let rows: Vec<Vec<String>> = parameters.iter().zip(values).zip(bounds).map(row).collect();
    format!("\n{}", table::render(&["parameter", heading, "from", "to", "unit", ""], &rows))
}

/// A table of inputs; nothing if there are none.
pub(crate) fn input_table(inputs: &[Input]) -> String {
    if inputs.is_empty() {
        return String::new();
    }
    let row = |i: &Input| {
        let value =
            if i.quantity == Quantity::Bool { (i.value != 0.0).to_string() } else { shown(i.value, i.quantity) };
        vec![i.name.clone(), value, first_line(&i.doc)]
    };
    let rows: Vec<Vec<String>> = inputs.iter().map(row).collect();
    format!("\n{}", table::render(&["input", "value", ""], &rows))
}

/// A value for people: angles in degrees (the JSON has radians), nothing for an infinite bound.
fn shown(x: f64, quantity: Quantity) -> String {
    if !x.is_finite() {
        return String::new();
    }
    // Six decimals, without the rounding errors of a unit's conversion.
    let x = quantity.written(x).0;
    number::plain(if x.abs() < 1e9 { (x * 1e6).round() / 1e6 } else { x })
}

fn first_line(doc: &str) -> String {
    doc.lines().next().unwrap_or("").trim().to_owned()
}

fn document(checked: &Checked, ok: bool) -> Value {
    let diagnostics = findings::array(&checked.diagnostics, &checked.sources);
    match &checked.program {
        None => json!({ "ok": ok, "diagnostics": diagnostics }),
        Some(p) => {
            let open = |open: &OpenBorder| {
                json!({
                    "part": p.parts()[open.patch].name, "side": open.side, "length": open.length, "at": open.at,
                    "beside": open.beside.map(|other| &p.parts()[other].name), "touches": open.touches,
                })
            };
            let open = checked.closedness.as_ref().map(|c| c.open.iter().map(open).collect::<Vec<_>>());
            json!({
                "ok": ok, "model": p.name(), "parameters": p.parameters(), "values": checked.values, "inputs": p.inputs(), "parts": p.parts(),
                "measures": dimensions::document(p, &checked.values, &checked.measured),
                "closed": checked.closedness.as_ref().map(Closedness::is_closed), "open_borders": open,
                "overlap": checked.overlap,
                "diagnostics": diagnostics,
            })
        }
    }
}

/// `--explain CODE`: prints the explanation of a code.
fn explain(text: &str) -> Result<(), CommandError> {
    let Some(code) = Code::named(text) else {
        let codes: Vec<&str> = Code::ALL.iter().map(|code| code.text()).collect();
        return Err(CommandError::Usage(match gml_compiler::suggest::nearest(text, codes.iter().copied()) {
            Some(near) => format!("there is no code '{text}'; did you mean '{near}'?"),
            None => format!(
                "there is no code '{text}': codes are what messages have in brackets, as in error[{}]; the page of diagnostics \
                 lists all",
                Code::UnknownName.text()
            ),
        }));
    };
    println!("{}", code.explanation().trim_end());
    Ok(())
}
