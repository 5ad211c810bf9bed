//! Scripts in, diagnostics as text or points out.

use crate::check::typed::{Model, Part};
use crate::check::{CheckOptions, InputValue};
use crate::diagnostic::{Diagnostic, Severity};
use crate::diff::expand;
use crate::ir::LoweredModel;
use crate::ir::interpret::{Limits, run_real};
use crate::ir::lower::lower;
use crate::program::check;
use crate::source::{NoFiles, Sources};
use std::collections::{BTreeMap, HashMap};
use std::fmt::Write;

/// Checks a script that uses the standard library only.
pub(super) fn check_text(text: &str) -> (Option<Model>, Sources, Vec<Diagnostic>) {
    check_with(text, &BTreeMap::new(), &CheckOptions::default())
}

pub(super) fn check_with(
    text: &str,
    inputs: &BTreeMap<String, InputValue>,
    options: &CheckOptions,
) -> (Option<Model>, Sources, Vec<Diagnostic>) {
    let mut sources = Sources::default();
    let main = sources.add("test.gml", text);
    let (model, diagnostics) = check(&mut sources, &NoFiles, main, inputs, options);
    (model, sources, diagnostics)
}

/// The model of a script that must be without errors.
pub(super) fn model(text: &str) -> Model {
    let (model, sources, diagnostics) = check_text(text);
    match model {
        Some(model) => model,
        None => panic!("{}", rendered(&sources, &diagnostics)),
    }
}

/// Diagnostics as text: position, message, the source underlined, related places, hint.
pub(super) fn rendered(sources: &Sources, diagnostics: &[Diagnostic]) -> String {
    let mut out = String::new();
    for d in diagnostics {
        let name = sources.get(d.span.file).map_or("?", |f| &f.name);
        let (line, column) = sources.line_column(d.span);
        let word = if d.severity == Severity::Error { "error" } else { "warning" };
        let _ = writeln!(out, "{word}[{}] {name}:{line}:{column}: {}", d.code, d.message);
        let _ = writeln!(out, "{}", format!("  > {} {}", one_line(sources.text(d.span)), d.label).trim_end());
        for (span, text) in d.related.iter().chain(&d.call_stack) {
            let name = sources.get(span.file).map_or("?", |f| &f.name);
            let (line, column) = sources.line_column(*span);
            let _ = writeln!(out, "  {name}:{line}:{column}: {text}: {}", one_line(sources.text(*span)));
        }
        if let Some(hint) = &d.hint {
            let _ = writeln!(out, "  hint: {hint}");
        }
    }
    out
}

fn one_line(text: &str) -> String {
    let line = text.lines().next().unwrap_or("");
    if line.len() < text.len() { format!("{line} ...") } else { line.to_owned() }
}

/// The diagnostics of a script, as text.
pub(super) fn diagnosed(text: &str) -> String {
    let (_, sources, diagnostics) = check_text(text);
    rendered(&sources, &diagnostics)
}

/// A model's parameters by name, at their defaults.
pub(super) fn defaults(model: &Model) -> HashMap<String, f64> {
    model.params.iter().map(|p| (p.declared.name.clone(), p.declared.default)).collect()
}

/// A point of a part, by the interpreter.
pub(super) fn point(model: &Model, part: &Part, params: &HashMap<String, f64>, u: f64, v: f64) -> [f64; 3] {
    let LoweredModel { mut module, parts, .. } = lower(model).expect("it is small");
    let index = model.parts.iter().position(|p| p.name == part.name).expect("the part of the model");
    let surface = &parts[index].surface;
    expand(&mut module, &[surface.function]).expect("it has derivatives");
    let x: Vec<f64> = model.params.iter().map(|p| params[&p.declared.name]).collect();
    let point = run_real(&module, surface.function, &surface.arguments(&x, &[u, v]), Limits::default());
    point.expect("a point").try_into().expect("three coordinates")
}

/// The unit normal of a part by central differences.
pub(super) fn normal(model: &Model, part: &Part, params: &HashMap<String, f64>, u: f64, v: f64) -> [f64; 3] {
    let e = 1e-4;
    let at = |u, v| point(model, part, params, u, v);
    let difference = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let du = difference(at(u + e, v), at(u - e, v));
    let dv = difference(at(u, v + e), at(u, v - e));
    let n = [du[1] * dv[2] - du[2] * dv[1], du[2] * dv[0] - du[0] * dv[2], du[0] * dv[1] - du[1] * dv[0]];
    let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
    n.map(|x| x / length)
}

/// The part of a name.
pub(super) fn part<'m>(model: &'m Model, name: &str) -> &'m Part {
    model.parts.iter().find(|p| p.name == name).unwrap_or_else(|| panic!("no part {name}"))
}
