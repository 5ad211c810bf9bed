//! NIST's Statistical Reference Datasets for nonlinear regression: a script with the model function (parameters b1, b2,
//! ...; the z coordinate of its first part is the response at the predictors u and v) is fitted to a file with
//! certified values.

#![allow(dead_code, reason = "the test and the command use different parts")]

use gml_compiler::program::{Options, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use regression::{Observation, regress};
use std::path::Path;

#[path = "regression.rs"]
mod regression;

/// A data set with its certified values.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Reference {
    pub(crate) names: Vec<String>,
    pub(crate) starts: [Vec<f64>; 2],
    pub(crate) certified: Vec<f64>,
    pub(crate) deviations: Vec<f64>,
    pub(crate) sum_of_squares: f64,
    pub(crate) observations: Vec<Observation>,
}

/// Correct significant digits of a fit: the least of all parameters, of their standard deviations, and of the residual
/// sum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Digits {
    pub(crate) parameters: f64,
    pub(crate) deviations: f64,
    pub(crate) sum_of_squares: f64,
    pub(crate) iterations: usize,
}

/// Fits a script to a data set from both of its starts.
pub(crate) fn compare(script: &Path, data: &Path) -> Result<[Digits; 2], String> {
    let read = |path: &Path| std::fs::read(path).map_err(|e| format!("{}: {e}", path.display()));
    let text = String::from_utf8_lossy(&read(script)?).into_owned();
    let reference = parse(&String::from_utf8_lossy(&read(data)?)).map_err(|e| format!("{}: {e}", data.display()))?;
    let source = SourceFile { name: script.display().to_string(), text };
    let program = compile(source, &NoFiles, &Options::default()).map_err(|e| e.to_string())?.program;
    let names: Vec<&str> = program.parameters().iter().map(|p| p.name.as_str()).collect();
    if names != reference.names {
        return Err(format!("the script has the parameters {names:?}, the data {:?}", reference.names));
    }
    let run = |start: &[f64]| {
        let Some(found) = regress(&program, &reference.observations, start) else { return Digits::default() };
        let least = |values: &[f64], certified: &[f64]| {
            values.iter().zip(certified).map(|(v, c)| digits(*v, *c)).fold(f64::INFINITY, f64::min)
        };
        Digits {
            parameters: least(&found.x, &reference.certified),
            deviations: least(&found.sd, &reference.deviations),
            sum_of_squares: digits(found.sum_of_squares, reference.sum_of_squares),
            iterations: found.iterations,
        }
    };
    Ok([run(&reference.starts[0]), run(&reference.starts[1])])
}

/// Digits that agree: -log10 of the relative difference, at most the eleven that are certified.
pub(crate) fn digits(value: f64, certified: f64) -> f64 {
    let off = ((value - certified) / certified).abs();
    if off.is_nan() { 0.0 } else { (-off.log10()).clamp(0.0, 11.0) }
}

/// Reads a .dat file.
pub(crate) fn parse(text: &str) -> Result<Reference, String> {
    let mut reference = Reference::default();
    let logarithm = text.contains("log[y]");
    let mut lines = text.lines();
    for line in lines.by_ref() {
        if let Some((name, values)) = parameter(line) {
            let [first, second, certified, deviation] = values;
            reference.names.push(name);
            reference.starts[0].push(first);
            reference.starts[1].push(second);
            reference.certified.push(certified);
            reference.deviations.push(deviation);
        } else if let Some(sum) = line.trim().strip_prefix("Residual Sum of Squares:") {
            reference.sum_of_squares = sum.trim().parse().map_err(|_| format!("no number: {sum}"))?;
        } else if line.starts_with("Data:") && line.split_whitespace().nth(1) == Some("y") {
            break;
        }
    }
    for line in lines.filter(|l| !l.trim().is_empty()) {
        let numbers: Result<Vec<f64>, _> = line.split_whitespace().map(str::parse).collect();
        let numbers = numbers.map_err(|_| format!("no row of numbers: {line}"))?;
        let [y, u, rest @ ..] = &numbers[..] else { return Err(format!("no row of numbers: {line}")) };
        let response = if logarithm { y.ln() } else { *y };
        reference.observations.push(Observation { u: *u, v: rest.first().copied().unwrap_or(0.0), response });
    }
    if reference.names.is_empty() || reference.observations.is_empty() {
        return Err("no parameters or no data: is this a NIST StRD file of a nonlinear problem?".into());
    }
    Ok(reference)
}

/// `b1 = start start certified deviation`.
fn parameter(line: &str) -> Option<(String, [f64; 4])> {
    let (name, values) = line.split_once('=')?;
    let name = name.trim();
    let values: Vec<f64> = values.split_whitespace().map(str::parse).collect::<Result<_, _>>().ok()?;
    (name.starts_with('b')).then_some(())?;
    Some((name.to_owned(), values.try_into().ok()?))
}
