//! How often and how fast fits succeed, and whether what they say of themselves is true. `GMLC_TEST_DATA=... cargo
//! bench --bench fit -- [WHAT [COUNT [FIRST]]]`, where WHAT is one of
//!
//! - `success` (also without any word): the cup from COUNT random starts of three kinds (see `cup`; `near`, `nothing`
//!   or `defaults` behind the counts chooses some);
//! - `examples [SEEDS [NAME]]`: every example, or one, against virtual scans of it (needs no data);
//! - `far [CUPS]`: simulated cups whose shape is far from the script's defaults (needs no data);
//! - `scans`: the four real scans of the data;
//! - `truths [SCANS [FIRST]] [NAME]`: every example, or one, against virtual scans of random shapes of it, from the
//!   script's defaults (needs no data);
//! - `coverage [SCANS]`: how often the 95 % intervals of the cup's parameters hold the truth, for white noise and for
//!   noise whose neighbours depend on each other (needs no data).

mod case;
mod coverage;
mod cup;
mod examples;
mod far;
mod matrix;
mod scans;
mod truths;

use gml_compiler::check::InputValue;
use gml_compiler::program::{Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use gml_runtime::fit::FitResult;
use std::collections::BTreeMap;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let numbers: Vec<usize> = words.iter().filter_map(|w| w.parse().ok()).collect();
    let count = |default: usize| numbers.first().copied().unwrap_or(default);
    let data = std::env::var("GMLC_TEST_DATA");
    let names: Vec<String> = words.iter().filter(|w| w.parse::<usize>().is_err()).cloned().collect();
    match names.first().map(String::as_str) {
        None | Some("success") => match data {
            Ok(data) => {
                let first = numbers.get(1).copied().unwrap_or(0);
                cup::run(&data, count(20), first, names.get(1..).unwrap_or_default());
            }
            Err(_) => println!("skipped: GMLC_TEST_DATA is not set"),
        },
        Some("scans") => match data {
            Ok(data) => scans::run(&data),
            Err(_) => println!("skipped: GMLC_TEST_DATA is not set"),
        },
        Some("examples") => examples::run(count(5), words.get(1..).unwrap_or_default()),
        Some("far") => far::run(count(12)),
        Some("truths") => {
            let first = numbers.get(1).copied().unwrap_or(0);
            truths::run(first..first + count(300), names.get(1).map(String::as_str));
        }
        Some("coverage") => coverage::run(count(200)),
        Some(other) => println!("{other}: expected success, examples, far, scans, truths or coverage"),
    }
}

/// A script of the repository.
fn program(path: &str, inputs: BTreeMap<String, InputValue>) -> Program {
    let path = format!("{}/{path}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let script = SourceFile { name: path, text };
    compile(script, &NoFiles, &Options { inputs, ..Options::default() }).unwrap_or_else(|e| panic!("{e}")).program
}

fn seconds(result: &FitResult) -> f64 {
    result.seconds.values().sum()
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
