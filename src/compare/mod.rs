//! `gmlc compare`.

mod operand;
mod shown;

use crate::cli::CompareArgs;
use crate::error::CommandError;
use crate::outputs;
use crate::progress::TerminalProgress;
use gml_runtime::compare::{self, CompareError, CompareOptions, Comparison};
use operand::{Given, Operand};
use serde::Serialize;

/// The file that `-o` writes.
#[derive(Serialize)]
struct ComparisonFile<'a> {
    /// What A and B are.
    operands: [operand::Named<'a>; 2],
    #[serde(flatten)]
    comparison: &'a Comparison,
}

pub(crate) fn run(args: &CompareArgs) -> Result<(), CommandError> {
    let given = |path, parameters, inputs, unit, side| Given { path, parameters, inputs, unit, side };
    let given = [
        given(&args.a, &args.param_a, &args.input_a, args.unit_a, "a"),
        given(&args.b, &args.param_b, &args.input_b, args.unit_b, "b"),
    ];
    // Errors in the command line are reported before any work is done.
    for given in &given {
        given.check(args)?;
    }
    if let Some(output) = &args.output {
        outputs::require_apart(output, outputs::inputs([&args.a, &args.b], args.script.as_ref()))?;
    }
    let [a, b] = given.map(|given| Operand::read(&given, args));
    let [a, b] = [a?, b?];
    if let Some(output) = &args.output {
        a.require_apart(output).and(b.require_apart(output))?;
    }
    // Two models are compared where their scripts put them, since poses are those of scans.
    let posed = a.is_mesh() || b.is_mesh();
    let mut options = CompareOptions::default();
    options.resolution = args.resolution;
    options.max_distance = args.max_distance;
    options.align = args.align;
    let progress = TerminalProgress::new();
    let comparison = compare::compare(&a.side(posed), &b.side(posed), &options, &progress);
    progress.finish();
    let mut comparison = comparison.map_err(|error| match error {
        CompareError::NotAligned(_) => CommandError::usage(error),
        error => CommandError::failed(error),
    })?;
    comparison.warnings.splice(0..0, a.warnings("A").chain(b.warnings("B")).chain(operand::differences(&a, &b)));
    let file = ComparisonFile { operands: [a.named(), b.named()], comparison: &comparison };
    if let Some(path) = &args.output {
        outputs::write_json(path, &file)?;
    }
    // What is on standard output already is a result for programs.
    match (args.output.as_deref().is_some_and(outputs::is_stream), args.result.is_json()) {
        (true, _) => Ok(()),
        (_, true) => outputs::print_json(&file),
        _ => {
            print!("{}", shown::summary(&file.operands, &comparison));
            Ok(())
        }
    }
}
