//! `--search NAME=LOW..HIGH`: which values of discrete inputs are fitted, and a summary of the comparison.

use crate::cli::CompileArgs;
use crate::error::CommandError;
use crate::table;
use crate::values::Range;
use gml_compiler::check::InputValue;
use gml_compiler::program::{Program, Quantity};
use gml_compiler::suggest::nearest;
use gml_runtime::fit::{Evidence, InputValues, Search};

/// The largest number of fits of one search.
const MOST_FITS: usize = 1000;

/// Every combination of the requested values. `program` is the script compiled with its defaults.
pub(crate) fn combinations(
    program: &Program,
    args: &CompileArgs,
    searched: &[Range],
) -> Result<Vec<InputValues>, CommandError> {
    let mut combinations = vec![InputValues::new()];
    for Range { name, low, high } in searched {
        let usage = |why: &str| CommandError::Usage(format!("--search {name}={low}..{high}: {why}"));
        let Some(input) = program.inputs().iter().find(|i| i.name == *name) else {
            return Err(usage(&no_input(name, program)));
        };
        if input.quantity != Quantity::Int {
            return Err(usage("the input is not a whole number"));
        }
        if args.inputs.iter().any(|(other, _)| other == name) {
            return Err(usage("the input is also set with --input"));
        }
        if combinations.iter().any(|inputs| inputs.contains_key(name)) {
            return Err(usage("the input is searched twice"));
        }
        if low > high {
            return Err(usage(&format!("the range is reversed: did you mean {high}..{low}?")));
        }
        if (*low as f64) < input.lower || (*high as f64) > input.upper {
            return Err(usage(&format!("the input goes from {} to {}", input.lower, input.upper)));
        }
        let count = (i128::from(*high) - i128::from(*low) + 1) as usize;
        if count.saturating_mul(combinations.len()) > MOST_FITS {
            return Err(usage(&format!("more than {MOST_FITS} combinations")));
        }
        let with = |inputs: &InputValues, value| {
            let mut inputs = inputs.clone();
            inputs.insert(name.clone(), value);
            inputs
        };
        combinations = combinations.iter().flat_map(|inputs| (*low..=*high).map(move |v| with(inputs, v))).collect();
    }
    Ok(combinations)
}

/// What a name is that is no input's: that of a parameter, or nearly one of an input.
fn no_input(name: &str, program: &Program) -> String {
    let names: Vec<&str> = program.inputs().iter().map(|i| i.name.as_str()).collect();
    if program.parameters().iter().any(|p| p.name == name) {
        return format!("`{name}` is a parameter, which every fit finds; inputs are searched");
    }
    if names.is_empty() {
        return "the model has no inputs".to_owned();
    }
    match nearest(name, names.iter().copied()) {
        Some(near) => format!("the model has no input of that name; did you mean `{near}`?"),
        None => format!("the model has no input of that name; it has {}", names.join(", ")),
    }
}

/// The arguments with some more inputs.
pub(crate) fn with_inputs(args: &CompileArgs, inputs: &InputValues) -> CompileArgs {
    let mut args = args.clone();
    args.inputs.extend(inputs.iter().map(|(name, value)| (name.clone(), InputValue::Int(*value))));
    args
}

/// A table of the candidates, and a sentence on the winner.
pub(crate) fn summary(search: &Search) -> String {
    let rows: Vec<Vec<String>> = search
        .candidates
        .iter()
        .map(|c| {
            let shown = |x: Option<f64>| x.map(table::number).unwrap_or_default();
            let remark =
                c.failed.clone().unwrap_or_else(|| if c.quick { "given up".to_owned() } else { String::new() });
            vec![named(&c.inputs), shown(c.bic), shown(c.objective), remark]
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
