//! `gmlc check`.

use crate::cli::{CheckArgs, Format};
use crate::error::CommandError;
use crate::{script, table};
use gml_compiler::diagnostic::Diagnostic;
use gml_compiler::program::{Parameter, Program, Quantity};
use gml_compiler::source::Sources;
use serde_json::{Value, json};

pub(crate) fn run(args: &CheckArgs) -> Result<(), CommandError> {
    let compiled = script::compile_quietly(&args.script);
    match args.format {
        Format::Text => {
            let compilation = compiled?;
            crate::diagnostics::print(&compilation.warnings, &compilation.sources);
            print!("{}", tables(&compilation.program));
            Ok(())
        }
        Format::Json => {
            let (document, result) = match compiled {
                Ok(c) => (document(Some(&c.program), &c.warnings, &c.sources), Ok(())),
                Err(CommandError::Script(e)) => {
                    let document = document(None, &e.diagnostics, &e.sources);
                    (document, Err(CommandError::Failed("the script has errors".into())))
                }
                Err(e) => return Err(e),
            };
            println!("{document:#}");
            result
        }
    }
}

/// The table of parameters, inputs and parts.
fn tables(program: &Program) -> String {
    let mut out = format!("model {}\n\n", program.name());
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
    out.push_str(&table::render(&["parameter", "default", "from", "to", "unit", ""], &rows));
    if !program.inputs().is_empty() {
        let rows: Vec<Vec<String>> = program
            .inputs()
            .iter()
            .map(|i| vec![i.name.clone(), shown(i.value, i.quantity), summary(&i.doc)])
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
fn shown(x: f64, quantity: Quantity) -> String {
    if !x.is_finite() {
        return String::new();
    }
    let x = if quantity == Quantity::Angle { x.to_degrees() } else { x };
    // Six significant decimals, without the noise of a unit's conversion.
    let rounded = (x * 1e6).round() / 1e6;
    format!("{rounded}")
}

fn unit(p: &Parameter) -> &'static str {
    if p.quantity == Quantity::Angle { "deg" } else { p.quantity.unit() }
}

/// First sentence of a doc comment.
fn summary(doc: &str) -> String {
    doc.lines().next().unwrap_or("").trim().to_owned()
}

fn document(program: Option<&Program>, diagnostics: &[Diagnostic], sources: &Sources) -> Value {
    let found: Vec<Value> = diagnostics
        .iter()
        .map(|d| {
            let (line, column) = sources.line_column(d.span);
            let file = sources.get(d.span.file).map_or("", |f| f.name.as_str());
            json!({
                "severity": d.severity, "code": d.code, "message": d.message, "label": d.label, "hint": d.hint,
                "file": file, "line": line, "column": column, "start": d.span.start, "end": d.span.end,
            })
        })
        .collect();
    match program {
        None => json!({ "ok": false, "diagnostics": found }),
        Some(p) => json!({
            "ok": true, "model": p.name(), "parameters": p.parameters(), "inputs": p.inputs(), "parts": p.parts(),
            "diagnostics": found,
        }),
    }
}
