//! `--search NAME=LOW..HIGH`: which values of discrete inputs are fitted, and a summary of the comparison.

use crate::cli::ScriptArgs;
use crate::error::CommandError;
use crate::table;
use gml_compiler::program::{Program, Quantity};
use gml_runtime::fit::{Evidence, InputValues, Search};

/// The largest number of fits of one search.
const MOST_FITS: usize = 1000;

/// Every combination of the requested values. `program` is the script compiled with its defaults.
pub(crate) fn combinations(
    program: &Program,
    args: &ScriptArgs,
    searched: &[String],
) -> Result<Vec<InputValues>, CommandError> {
    let mut combinations = vec![InputValues::new()];
    for given in searched {
        let usage = |why: String| CommandError::usage(format!("--search {given}: {why}"));
        let (name, range) = given.split_once('=').ok_or_else(|| usage("expected NAME=LOW..HIGH".into()))?;
        let name = name.trim();
        let Some(input) = program.inputs().iter().find(|i| i.name == name) else {
            let names: Vec<&str> = program.inputs().iter().map(|i| i.name.as_str()).collect();
            return Err(usage(match names.is_empty() {
                true => "the model has no inputs".into(),
                false => format!("the model has no input of that name; it has {}", names.join(", ")),
            }));
        };
        if input.quantity != Quantity::Int {
            return Err(usage(format!("`{name}` is not a whole number")));
        }
        if args.inputs.iter().any(|i| i.split('=').next().is_some_and(|n| n.trim() == name)) {
            return Err(usage(format!("`{name}` is also set with --input")));
        }
        if combinations.iter().any(|inputs| inputs.contains_key(name)) {
            return Err(usage(format!("`{name}` is searched twice")));
        }
        let ends = range
            .split_once("..")
            .and_then(|(low, high)| Some((low.trim().parse::<i64>().ok()?, high.trim().parse::<i64>().ok()?)));
        let (low, high) = ends.ok_or_else(|| usage("expected two whole numbers, such as 3..16".into()))?;
        if (low as f64) < input.lower || (high as f64) > input.upper || low > high {
            return Err(usage(format!("`{name}` goes from {} to {}", input.lower, input.upper)));
        }
        let count = (high as i128 - low as i128 + 1) as usize;
        if count.saturating_mul(combinations.len()) > MOST_FITS {
            return Err(usage(format!("more than {MOST_FITS} combinations")));
        }
        let with = |inputs: &InputValues, value| {
            let mut inputs = inputs.clone();
            inputs.insert(name.to_owned(), value);
            inputs
        };
        combinations = combinations.iter().flat_map(|inputs| (low..=high).map(move |v| with(inputs, v))).collect();
    }
    Ok(combinations)
}

/// The script with some more inputs.
pub(crate) fn with_inputs(args: &ScriptArgs, inputs: &InputValues) -> ScriptArgs {
    let mut args = args.clone();
    args.inputs.extend(inputs.iter().map(|(name, value)| format!("{name}={value}")));
    args
}

/// A table of the candidates, and a sentence on the winner.
pub(crate) fn summary(search: &Search) -> String {
    let rows: Vec<Vec<String>> = search
        .candidates
        .iter()
        .map(|c| {
            let shown = |x: Option<f64>| x.map(table::number).unwrap_or_default();
            vec![named(&c.inputs), shown(c.bic), shown(c.objective), c.failed.clone().unwrap_or_default()]
        })
        .collect();
    let mut out = table::render(&["inputs", "BIC", "objective", ""], &rows);
    let mut ranked = search.candidates.iter().filter(|c| c.bic.is_some());
    let (Some(winner), runner_up) = (ranked.next(), ranked.next()) else { return out };
    out.push_str(&match (runner_up, search.margin) {
        (Some(second), Some(margin)) => format!(
            "{} wins, {} is next: its BIC is larger by {}, {}\n",
            named(&winner.inputs),
            named(&second.inputs),
            table::number(margin),
            match Evidence::of_margin(margin) {
                Evidence::None => "which decides nothing",
                Evidence::Some => "which is some evidence",
                Evidence::Strong => "which is strong evidence",
            }
        ),
        _ => format!("{} is the only one that could be fitted\n", named(&winner.inputs)),
    });
    out
}

fn named(inputs: &InputValues) -> String {
    inputs.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join(" ")
}
