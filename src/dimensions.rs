//! Measures for people: tables of what a script declares and of what a fit found, and the verdicts on them.

use crate::table;
use gml_compiler::program::{Measure, Program};
use gml_runtime::figures::MeasureValue;
use gml_runtime::fit::FittedMeasure;
use gml_runtime::model::EvaluationError;
use gml_runtime::variance::{DimensionVerdict, Outcome, PointMeasure, VarianceReport};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The measures that have a tolerance, without a verdict because nothing was fitted: a sentence, if there are any.
pub(crate) fn without_fit(program: &Program) -> Option<String> {
    let defaults = program.defaults();
    let toleranced = |(k, m): (usize, &Measure)| {
        matches!(program.measure_limits(k, &defaults), Ok(Some(_))).then(|| format!("`{}`", m.name))
    };
    let names: Vec<String> = program.measures().iter().enumerate().filter_map(toleranced).collect();
    let (tolerances, are) = if names.len() == 1 { ("tolerance", "is") } else { ("tolerances", "are") };
    (!names.is_empty()).then(|| {
        format!(
            "the {tolerances} of {} {are} not judged: the values are not those of a fit (--params FIT.json, without -p)",
            names.join(", ")
        )
    })
}

/// A figure in a unit, as people write it: angles in degrees.
fn written(figure: f64, unit: &str) -> (f64, &str) {
    if unit == "rad" { (figure.to_degrees(), "deg") } else { (figure, unit) }
}

/// A table of the measures at x, under a heading for their values; nothing if there are none.
pub(crate) fn declared(
    heading: &str,
    program: &Program,
    x: &[f64],
    measured: &[Result<MeasureValue, EvaluationError>],
) -> String {
    let row = |((k, m), computed): ((usize, &Measure), &Result<MeasureValue, EvaluationError>)| {
        let shown = |figure: f64| table::number(written(figure, &m.unit).0);
        let value = computed.as_ref().map_or("-".to_owned(), |measured| shown(measured.value));
        let limits = program.measure_limits(k, x).ok().flatten();
        let [from, to] = limits.map_or_else(Default::default, |limits| limits.map(shown));
        let slopes = match computed.as_ref().and_then(|measured| measured.gradient.as_ref()) {
            Ok(gradient) => by_parameter(program, &m.unit, gradient),
            Err(error) => error.sentence.clone(),
        };
        let doc = m.doc.lines().next().unwrap_or_default().trim().to_owned();
        vec![m.name.clone(), value, written(0.0, &m.unit).1.to_owned(), from, to, slopes, doc]
    };
    let measures = program.measures().iter().enumerate().zip(measured);
    let rows: Vec<Vec<String>> = measures.map(row).collect();
    if rows.is_empty() {
        return String::new();
    }
    format!("\n{}", table::render(&["measure", heading, "unit", "from", "to", "derivatives", ""], &rows))
}

/// The derivatives that are not zero: `r 2, h 0.5`. Those of and by angles are in degrees.
fn by_parameter(program: &Program, unit: &str, gradient: &[f64]) -> String {
    let used = program.parameters().iter().zip(gradient).filter(|(_, slope)| **slope != 0.0);
    let shown = used.map(|(p, slope)| {
        let slope = written(*slope, unit).0 / p.quantity.written(1.0).0;
        format!("{} {}", p.name, table::number(slope))
    });
    shown.collect::<Vec<_>>().join(", ")
}

/// The measures at x for `check --format json`.
pub(crate) fn document(program: &Program, x: &[f64], measured: &[Result<MeasureValue, EvaluationError>]) -> Value {
    let measure = |((k, m), computed): ((usize, &Measure), &Result<MeasureValue, EvaluationError>)| {
        let (value, gradient) = match computed {
            Ok(MeasureValue { value, gradient }) => (Ok(*value), gradient.as_ref()),
            Err(error) => (Err(error), Err(error)),
        };
        let limits = program.measure_limits(k, x);
        let errors = [value.err(), gradient.err(), limits.as_ref().err()];
        let error = errors.into_iter().flatten().next().map(|e| e.message.clone());
        let names = program.parameters().iter().map(|p| p.name.as_str());
        let derivatives = gradient
            .ok()
            .map(|gradient| names.zip(gradient).filter(|(_, slope)| **slope != 0.0).collect::<BTreeMap<_, _>>());
        let tolerance = limits.ok().flatten().map(|[lower, upper]| json!({ "lower": lower, "upper": upper }));
        let value = value.ok();
        json!({
            "name": m.name, "doc": m.doc, "parts": m.parts, "unit": m.unit, "value": value, "derivatives": derivatives,
            "tolerance": tolerance, "error": error,
        })
    };
    program.measures().iter().enumerate().zip(measured).map(measure).collect()
}

/// A table of the measures of a fit; nothing if there are none.
pub(crate) fn fitted(measures: &[FittedMeasure]) -> String {
    let row = |m: &FittedMeasure| {
        let sd = m.sd.map(|sd| m.written(sd).0);
        let shown = |figure: Option<f64>| figure.map_or_else(String::new, |f| table::rounded(m.written(f).0, sd));
        let [from, to] = [m.tolerance.map(|t| t.lower), m.tolerance.map(|t| t.upper)].map(shown);
        let unit = m.written(0.0).1.to_owned();
        let [value, sd, nominal, deviation] = [m.value, m.sd, m.nominal, m.deviation()].map(shown);
        let why = m.without_sd.clone().unwrap_or_default();
        vec![m.name.clone(), value, sd, unit, nominal, deviation, from, to, why]
    };
    if measures.is_empty() {
        return String::new();
    }
    let headings = ["measure", "value", "sd", "unit", "nominal", "deviation", "from", "to", ""];
    table::render(&headings, &measures.iter().map(row).collect::<Vec<_>>())
}

/// A table of the verdicts on measures; nothing if there are none.
pub(crate) fn verdicts(report: &VarianceReport) -> String {
    let row = |m: &DimensionVerdict| {
        let shown = |figure: f64| table::rounded(m.written(figure).0, Some(m.written(m.uncertainty).0));
        let allowed = format!("{} to {}", shown(m.tolerance.lower), shown(m.tolerance.upper));
        let mut cells = vec![m.name.clone(), m.written(0.0).1.to_owned()];
        cells.extend([m.value, m.nominal, m.deviation].map(shown));
        let probability = if m.probability.is_nan() { "-".to_owned() } else { format!("{:.3}", m.probability) };
        cells.extend([allowed, shown(m.uncertainty), probability, m.outcome.text().to_owned()]);
        cells
    };
    if report.measures.is_empty() {
        return String::new();
    }
    let headings =
        ["measure", "unit", "value", "nominal", "deviation", "allowed", "uncertainty", "probability", "verdict"];
    let rows: Vec<Vec<String>> = report.measures.iter().map(row).collect();
    format!("\n{}", table::render(&headings, &rows))
}

/// A table of measures by the measured points of parts; nothing if there are none.
pub(crate) fn by_points(report: &VarianceReport) -> String {
    let row = |m: &PointMeasure| {
        let sd = m.uncertainty.map(|sd| written(sd, &m.unit).0);
        let shown = |figure: f64| table::rounded(written(figure, &m.unit).0, sd);
        let [value, uncertainty] = [m.value, m.uncertainty].map(|f| f.map_or_else(String::new, shown));
        let figure = m.figure.clone().unwrap_or_default();
        let unit = written(0.0, &m.unit).1.to_owned();
        vec![
            m.name.clone(),
            m.parts.join(", "),
            figure,
            unit,
            shown(m.model),
            value,
            uncertainty,
            m.reason.clone().unwrap_or_default(),
        ]
    };
    if report.point_measures.is_empty() {
        return String::new();
    }
    let headings = ["measure", "of", "figure", "unit", "model", "by points", "uncertainty", ""];
    let rows: Vec<Vec<String>> = report.point_measures.iter().map(row).collect();
    format!("\n{}", table::render(&headings, &rows))
}

/// A line for every measure that does not conform, or that is undecided.
pub(crate) fn lines(report: &VarianceReport) -> impl Iterator<Item = String> {
    let line = |m: &DimensionVerdict| {
        let shown = |figure: f64| table::rounded(m.written(figure).0, Some(m.written(m.uncertainty).0));
        let unit = match m.written(0.0).1 {
            "" => String::new(),
            unit => format!(" {unit}"),
        };
        let [value, nominal, deviation, uncertainty] = [m.value, m.nominal, m.deviation, m.uncertainty].map(shown);
        let [lower, upper] = [m.tolerance.lower, m.tolerance.upper].map(shown);
        let uncertainty = if m.uncertainty.is_finite() {
            format!(" (standard uncertainty {uncertainty}{unit})")
        } else {
            String::new()
        };
        let measured = format!(
            "{value}{unit} is {deviation}{unit} from the nominal {nominal}{unit}{uncertainty}, allowed are {lower} to {upper}{unit}"
        );
        let said: Vec<String> = std::iter::once(measured).chain(m.reasons.iter().cloned()).collect();
        format!("{}: {}: {}", m.outcome.text(), m.name, said.join("; "))
    };
    report.measures.iter().filter(|m| m.outcome != Outcome::Conforms).map(line)
}
