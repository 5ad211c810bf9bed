//! `gmlc check`.

use crate::cli::{CheckArgs, Format, ScriptArgs};
use crate::error::{CommandError, ScriptErrors};
use crate::{findings, script, table};
use gml_compiler::check::lints;
use gml_compiler::diagnostic::{Code, Diagnostic, Severity};
use gml_compiler::program::{Parameter, Program, Quantity};
use gml_compiler::source::{FileId, Sources, Span};
use gml_compiler::syntax;
use serde_json::{Value, json};

pub(crate) fn run(args: &CheckArgs) -> Result<(), CommandError> {
    match (&args.explain, &args.model) {
        (Some(code), _) => explain(code),
        (None, Some(model)) => {
            let (inputs, limits) = (args.inputs.clone(), args.limits.clone());
            check(&ScriptArgs { model: model.clone(), inputs, limits }, args.format)
        }
        (None, None) => Err(CommandError::usage("a script is needed")),
    }
}

fn check(script: &ScriptArgs, format: Format) -> Result<(), CommandError> {
    let mut checked = match script::compile_quietly(script) {
        Ok(c) => Checked { program: Some(c.program), diagnostics: c.warnings, sources: c.sources },
        Err(CommandError::Script(e)) => library(*e),
        Err(e) => return Err(e),
    };
    if !checked.diagnostics.iter().any(|d| d.severity == Severity::Error) {
        checked.look_closer();
    }
    let failed = checked.diagnostics.iter().any(|d| d.severity == Severity::Error);
    match format {
        Format::Json => println!("{:#}", document(&checked, !failed)),
        Format::Text if failed => {
            let Checked { diagnostics, sources, .. } = checked;
            return Err(CommandError::Script(Box::new(ScriptErrors { diagnostics, sources })));
        }
        Format::Text => {
            crate::diagnostics::print(&checked.diagnostics, &checked.sources);
            print!(
                "{}",
                checked.program.as_ref().map_or_else(|| "no model: a file for others to use\n".to_owned(), tables)
            );
        }
    }
    if failed { Err(CommandError::Failed("the script has errors".into())) } else { Ok(()) }
}

/// What came of a script.
struct Checked {
    /// Nothing where there are errors, and for a file without a model.
    program: Option<Program>,
    diagnostics: Vec<Diagnostic>,
    sources: Sources,
}

impl Checked {
    /// Warnings that cost more than other commands want to wait for.
    fn look_closer(&mut self) {
        let main = FileId::default();
        if let Some(file) = self.sources.get(main) {
            self.diagnostics.extend(lints(&syntax::parse(main, &file.text).0));
        }
        if let Some(program) = &self.program {
            let said: Vec<Span> = self.diagnostics.iter().map(|d| d.span).collect();
            self.diagnostics.extend(program.probe().into_iter().filter(|d| !said.contains(&d.span)));
        }
        self.diagnostics.sort_by_key(|d| (d.span.file, d.span.start));
    }
}

/// A file of functions for others to use is in order, although there is nothing to evaluate.
fn library(errors: ScriptErrors) -> Checked {
    let ScriptErrors { mut diagnostics, sources } = errors;
    let main = FileId::default();
    let tree = sources.get(main).map(|file| syntax::parse(main, &file.text).0);
    if tree.is_some_and(|tree| !tree.items.is_empty()) {
        diagnostics.retain(|d| d.code != Code::NoModel);
    }
    Checked { program: None, diagnostics, sources }
}

/// The table of parameters, inputs and parts.
fn tables(program: &Program) -> String {
    let mut out = format!("model {}\n", program.name());
    let rows: Vec<Vec<String>> = program
        .parameters()
        .iter()
        .map(|p| {
            vec![
                p.name.clone(),
                shown(p.default, p.quantity),
                shown(p.lower, p.quantity),
                shown(p.upper, p.quantity),
                unit(p).into(),
                summary(&p.doc),
            ]
        })
        .collect();
    if !rows.is_empty() {
        out.push('\n');
        out.push_str(&table::render(&["parameter", "default", "from", "to", "unit", ""], &rows));
    }
    if !program.inputs().is_empty() {
        let rows: Vec<Vec<String>> = program
            .inputs()
            .iter()
            .map(|i| vec![i.name.clone(), shown_input(i.value, i.quantity), summary(&i.doc)])
            .collect();
        out.push('\n');
        out.push_str(&table::render(&["input", "value", ""], &rows));
    }
    let rows: Vec<Vec<String>> = program
        .parts()
        .iter()
        .map(|p| {
            let names: Vec<&str> = p.active.iter().map(|&i| program.parameters()[i as usize].name.as_str()).collect();
            vec![p.name.clone(), names.join(" ")]
        })
        .collect();
    out.push('\n');
    out.push_str(&table::render(&["part", "depends on"], &rows));
    out
}

/// Angles in degrees, as people think of them; the JSON has radians.
pub(crate) fn shown(x: f64, quantity: Quantity) -> String {
    if !x.is_finite() {
        return String::new();
    }
    let x = if quantity == Quantity::Angle { x.to_degrees() } else { x };
    // Six significant decimals, without the noise of a unit's conversion.
    let rounded = (x * 1e6).round() / 1e6;
    format!("{rounded}")
}

fn shown_input(x: f64, quantity: Quantity) -> String {
    if quantity == Quantity::Bool { (x != 0.0).to_string() } else { shown(x, quantity) }
}

pub(crate) fn unit(p: &Parameter) -> &'static str {
    if p.quantity == Quantity::Angle { "deg" } else { p.quantity.unit() }
}

/// First sentence of a doc comment.
pub(crate) fn summary(doc: &str) -> String {
    doc.lines().next().unwrap_or("").trim().to_owned()
}

fn document(checked: &Checked, ok: bool) -> Value {
    let found = findings::array(&checked.diagnostics, &checked.sources);
    match &checked.program {
        None => json!({ "ok": ok, "diagnostics": found }),
        Some(p) => json!({
            "ok": ok, "model": p.name(), "parameters": p.parameters(), "inputs": p.inputs(), "parts": p.parts(),
            "diagnostics": found,
        }),
    }
}

/// `--explain CODE`: prints the explanation of a code.
fn explain(text: &str) -> Result<(), CommandError> {
    let Some(code) = Code::named(text) else {
        let codes: Vec<&str> = Code::ALL.iter().map(|code| code.text()).collect();
        return Err(CommandError::Usage(format!("there is no code '{text}'; the codes are {}", codes.join(", "))));
    };
    println!("{}", code.explanation().trim_end());
    Ok(())
}
