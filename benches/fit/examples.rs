//! Every example against virtual scans of it: those of its README's `gmlc scan` command, with other seeds for noise,
//! losses and pose. A fit counts where every parameter is found to a tenth of how far it had to go from its default,
//! or, where the scan does not say it that well, to three standard deviations of less than a tenth each.

use crate::{median, program, seconds};
use gml_compiler::check::InputValue;
use gml_compiler::program::Program;
use gml_runtime::fit::{FitOptions, fit};
use gml_runtime::model::{Fineness, Model, Tessellation};
use gml_runtime::progress::Silent;
use gml_runtime::scan::{self, Scan};
use gml_runtime::simulate::{Scanner, scan as simulate};
use std::collections::BTreeMap;

const EXAMPLES: [&str; 9] = ["amphora", "bowl", "can", "column", "elbow", "flange", "mug", "planter", "tree"];
const ALLOWED: f64 = 0.1;

/// Prints the table for all examples, or those that `words` name.
pub(crate) fn run(seeds: usize, words: &[String]) {
    for name in EXAMPLES {
        if EXAMPLES.iter().any(|e| words.iter().any(|w| w == e)) && !words.iter().any(|w| w == name) {
            continue;
        }
        let (mut found, mut times) = (0, Vec::new());
        let case = Case::read(name);
        for seed in 1..=seeds as u64 {
            let scan = case.scan(name, seed);
            let result = fit(&case.program, &scan, &FitOptions::default(), &Silent).unwrap_or_else(|e| panic!("{e}"));
            times.push(seconds(&result));
            let off: Vec<String> = result
                .parameters
                .iter()
                .zip(case.program.parameters().iter().zip(&case.truth))
                .filter(|(p, (known, truth))| {
                    let allowed = ALLOWED * (*truth - known.default).abs();
                    let sd = p.sd.filter(|sd| *sd < allowed).unwrap_or(0.0);
                    !((p.value - **truth).abs() < allowed.max(3.0 * sd))
                })
                .map(|(p, (_, truth))| format!("{} {:.3} for {truth:.3}", p.name, p.value))
                .collect();
            if off.is_empty() {
                found += 1;
            } else {
                println!(
                    "  {name} {seed}: inliers {:.3}, sigma {:.3}, {}",
                    result.inliers,
                    result.sigma,
                    off.join(", ")
                );
            }
        }
        println!("{name:9} {found:3} of {seeds:3}   median {:.2} s", median(&mut times));
    }
}

/// A scan that a README makes.
struct Case {
    program: Program,
    truth: Vec<f64>,
    scanner: Scanner,
}

impl Case {
    fn read(name: &str) -> Self {
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

    fn scan(&self, name: &str, seed: u64) -> Scan {
        let instance = Model::instantiate(&self.program, &self.truth).unwrap_or_else(|e| panic!("{e}"));
        let fineness = Fineness { chord: (0.02 * self.scanner.spacing).min(0.02), ..Fineness::default() };
        let tessellation = Tessellation::new(&self.program, &*instance, fineness).unwrap_or_else(|e| panic!("{e}"));
        let scanner = Scanner { seed, ..self.scanner.clone() };
        let made = simulate(&tessellation.mesh, &scanner, &Silent).unwrap_or_else(|e| panic!("{e}"));
        scan::from_mesh(made.mesh, name).unwrap_or_else(|e| panic!("{e}"))
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
