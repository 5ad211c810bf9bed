//! An example's model, and virtual scans of it.

use crate::program;
use gml_compiler::check::InputValue;
use gml_compiler::program::Program;
use gml_runtime::model::{Fineness, Model, Motion, Tessellation};
use gml_runtime::progress::Silent;
use gml_runtime::scan::{self, Scan};
use gml_runtime::simulate::{ExactSurface, Scanner, scan_exact};
use std::collections::BTreeMap;

/// The scan that an example's README makes.
pub(crate) struct Case {
    pub(crate) program: Program,
    pub(crate) truth: Vec<f64>,
    pub(crate) scanner: Scanner,
}

impl Case {
    pub(crate) fn read(name: &str) -> Self {
        let path = format!("{}/examples/{name}/README.md", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
        let text = text.replace("\\\n", " ");
        let line = text.lines().find(|l| l.starts_with("gmlc scan")).unwrap_or_else(|| panic!("{path}: no scan"));
        let words: Vec<&str> = line.split_whitespace().collect();
        let after = |option: &'static str| words.windows(2).filter(move |w| w[0] == option).map(|w| w[1]);
        let pair = |w: &str| w.split_once('=').map(|(n, v)| (n.to_owned(), v.to_owned())).expect("NAME=VALUE");
        let inputs = after("--input").map(pair).map(|(n, v)| (n, InputValue::Int(v.parse().expect("a number"))));
        let program = program(&format!("examples/{name}/{name}.gml"), inputs.collect());
        let values: BTreeMap<String, f64> = after("-p").map(pair).map(|(n, v)| (n, number(&v))).collect();
        let truth = program.parameters().iter().map(|p| values.get(&p.name).copied().unwrap_or(p.default)).collect();
        let default = Scanner::default();
        let scanner = Scanner {
            spacing: after("--spacing").next().map_or(default.spacing, number),
            noise: after("--noise").next().map_or(default.noise, number),
            ..default
        };
        Self { program, truth, scanner }
    }

    /// A virtual scan of its model with some values. None where the model does not exist with them.
    pub(crate) fn scan(&self, values: &[f64], scanner: &Scanner) -> Option<Scan> {
        let instance = Model::instantiate(&self.program, values).ok()?;
        let fineness = Fineness { chord: 0.02 * scanner.spacing, ..Fineness::default() };
        let tessellation = Tessellation::new(&self.program, &*instance, fineness).ok()?;
        let surface = ExactSurface { tessellation: &tessellation, instance: &*instance, motion: Motion::IDENTITY };
        let made = scan_exact(surface, scanner, &Silent).ok()?;
        Some(scan::from_mesh(made.mesh, "virtual").unwrap_or_else(|e| panic!("{e}")))
    }
}

/// `42mm`, `2.7m`, `30deg`, `0.5` in millimetres and radians.
fn number(text: &str) -> f64 {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let size = match &text[digits.len()..] {
        "" | "mm" => 1.0,
        "cm" => 10.0,
        "m" => 1000.0,
        "deg" => std::f64::consts::PI / 180.0,
        unit => panic!("{unit}"),
    };
    digits.parse::<f64>().expect("a number") * size
}
