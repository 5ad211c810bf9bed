//! `--search NAME=LOW..HIGH`: fits every value of discrete inputs and takes the best.

use crate::cli::{FitControls, ScriptArgs};
use crate::error::CommandError;
use crate::progress::TerminalProgress;
use crate::{fit, script, table};
use gml_compiler::program::{Program, Quantity};
use gml_runtime::fit::{self as fits, FitResult, Rival, Search, SearchCandidate};
use gml_runtime::progress::Progress;
use gml_runtime::scan::Scan;
use std::collections::BTreeMap;

/// Fits that a search may take.
const MOST: usize = 1000;
/// The best so many are fitted again, from the shapes of one another: a fit that went astray does not decide.
const FINALISTS: usize = 3;
/// That is left out where the winner has the margin and explains this fraction of the points.
const CONVINCING: f64 = 0.95;
/// Differences of BIC (Kass and Raftery 1995): below the first hardly worth a mention, beyond the second strong.
const MARGINS: (f64, f64) = (2.0, 10.0);

/// The winner's program and fit.
pub(crate) struct Winner {
    pub(crate) program: Program,
    pub(crate) fit: FitResult,
}

/// Values of the inputs that are searched.
type Inputs = BTreeMap<String, i64>;

/// A candidate that could be fitted.
struct Fitted {
    inputs: Inputs,
    program: Program,
    fit: FitResult,
}

/// Fits every combination of values. `known` is the script compiled with its defaults.
pub(crate) fn run(
    known: &Program,
    args: &ScriptArgs,
    searched: &[String],
    controls: &FitControls,
    scan: &Scan,
    progress: &TerminalProgress,
) -> Result<Winner, CommandError> {
    let all = combinations(known, args, searched)?;
    let mut fitted: Vec<Fitted> = Vec::new();
    let mut failed: Vec<SearchCandidate> = Vec::new();
    for inputs in all {
        match candidate(args, &inputs, controls, scan, progress) {
            Ok((program, fit)) => fitted.push(Fitted { inputs, program, fit }),
            Err(CommandError::Usage(why)) => return Err(CommandError::Usage(why)),
            Err(error) => {
                failed.push(SearchCandidate { inputs, failed: Some(reason(&error)), ..SearchCandidate::default() });
            }
        }
        if progress.cancelled() {
            break;
        }
    }
    if fitted.is_empty() {
        let why = failed.into_iter().next().and_then(|f| f.failed).unwrap_or_default();
        return Err(CommandError::Failed(format!("--search: none of the values could be fitted: {why}")));
    }
    let mut search = rank(&mut fitted, scan)?;
    let convincing = fitted[0].fit.inliers > CONVINCING && search.margin.is_some_and(|m| m > MARGINS.1);
    if !convincing {
        finals(&mut fitted, args, controls, scan, progress)?;
        search = rank(&mut fitted, scan)?;
    }
    let best = fitted.swap_remove(0);
    let search = Search { candidates: search.candidates.into_iter().chain(failed).collect(), ..search };
    Ok(Winner { program: best.program, fit: FitResult { search: Some(search), ..best.fit } })
}

/// What `search` found, in words.
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
            match margin {
                m if m < MARGINS.0 => "which decides nothing",
                m if m < MARGINS.1 => "which is some evidence",
                _ => "which is strong evidence",
            }
        ),
        _ => format!("{} is the only one that could be fitted\n", named(&winner.inputs)),
    });
    out
}

fn named(inputs: &Inputs) -> String {
    inputs.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join(" ")
}

/// Every combination of the values that are asked for.
fn combinations(known: &Program, args: &ScriptArgs, searched: &[String]) -> Result<Vec<Inputs>, CommandError> {
    let mut all = vec![Inputs::new()];
    for given in searched {
        let usage = |why: String| CommandError::usage(format!("--search {given}: {why}"));
        let (name, range) = given.split_once('=').ok_or_else(|| usage("expected NAME=LOW..HIGH".into()))?;
        let name = name.trim();
        let Some(input) = known.inputs().iter().find(|i| i.name == name) else {
            let names: Vec<&str> = known.inputs().iter().map(|i| i.name.as_str()).collect();
            return Err(usage(match names.is_empty() {
                true => "the model has no inputs".into(),
                false => format!("the model has no input of that name; it has {}", names.join(", ")),
            }));
        };
        if input.quantity != Quantity::Int {
            return Err(usage(format!("`{name}` is no whole number")));
        }
        if args.inputs.iter().any(|i| i.split('=').next().is_some_and(|n| n.trim() == name)) {
            return Err(usage("is also set with --input".into()));
        }
        if all.iter().any(|inputs| inputs.contains_key(name)) {
            return Err(usage("is searched twice".into()));
        }
        let ends = range
            .split_once("..")
            .and_then(|(low, high)| Some((low.trim().parse::<i64>().ok()?, high.trim().parse::<i64>().ok()?)));
        let (low, high) = ends.ok_or_else(|| usage("expected two whole numbers, such as 3..16".into()))?;
        if (low as f64) < input.lower || (high as f64) > input.upper || low > high {
            return Err(usage(format!("`{name}` goes from {} to {}", input.lower, input.upper)));
        }
        let count = (high as i128 - low as i128 + 1) as usize;
        if count.saturating_mul(all.len()) > MOST {
            return Err(usage(format!("more than {MOST} combinations")));
        }
        all = all
            .iter()
            .flat_map(|inputs| {
                (low..=high).map(|value| {
                    let mut inputs = inputs.clone();
                    inputs.insert(name.to_owned(), value);
                    inputs
                })
            })
            .collect();
    }
    Ok(all)
}

/// The script with some inputs.
fn compiled(args: &ScriptArgs, inputs: &Inputs) -> Result<Program, CommandError> {
    let mut args = args.clone();
    args.inputs.extend(inputs.iter().map(|(name, value)| format!("{name}={value}")));
    Ok(script::compile_quietly(&args)?.program)
}

fn candidate(
    args: &ScriptArgs,
    inputs: &Inputs,
    controls: &FitControls,
    scan: &Scan,
    progress: &TerminalProgress,
) -> Result<(Program, FitResult), CommandError> {
    let program = compiled(args, inputs)?;
    let options = fit::options(controls, &program)?;
    progress.report(&named(inputs), f64::NAN, "");
    let fit = fit::run_fit(&program, &args.model, scan, &options, progress)?;
    Ok((program, fit))
}

/// Why a candidate could not be fitted, in a line.
fn reason(error: &CommandError) -> String {
    match error {
        CommandError::Failed(why) | CommandError::Usage(why) => why.clone(),
        CommandError::Script(errors) => errors.diagnostics.first().map(|d| d.message.clone()).unwrap_or_default(),
        CommandError::OutOfTolerance(_) | CommandError::Said => String::new(),
    }
}

/// Sorts candidates by BIC and says what it is.
fn rank(fitted: &mut Vec<Fitted>, scan: &Scan) -> Result<Search, CommandError> {
    let rivals: Vec<Rival> = fitted.iter().map(|f| Rival { model: &f.program, fit: &f.fit }).collect();
    let compared = fits::compare(&rivals, scan).map_err(CommandError::failed)?;
    let mut order: Vec<usize> = (0..fitted.len()).collect();
    order.sort_by(|a, b| compared.bic[*a].total_cmp(&compared.bic[*b]));
    let candidates: Vec<SearchCandidate> = order
        .iter()
        .map(|i| SearchCandidate {
            inputs: fitted[*i].inputs.clone(),
            bic: Some(compared.bic[*i]),
            objective: Some(compared.objective[*i]),
            failed: None,
        })
        .collect();
    let margin = order.get(1).map(|second| compared.bic[*second] - compared.bic[order[0]]);
    let mut slots: Vec<Option<Fitted>> = std::mem::take(fitted).into_iter().map(Some).collect();
    fitted.extend(order.iter().filter_map(|i| slots[*i].take()));
    Ok(Search { candidates, margin, sigma: compared.sigma, effective_points: compared.effective_points })
}

/// Fits the best candidates again, from the shape of the best other one.
fn finals(
    fitted: &mut [Fitted],
    args: &ScriptArgs,
    controls: &FitControls,
    scan: &Scan,
    progress: &TerminalProgress,
) -> Result<(), CommandError> {
    let count = fitted.len().min(FINALISTS);
    for i in 0..count {
        let other = usize::from(i == 0);
        if progress.cancelled() || other >= count {
            break;
        }
        let shape: Vec<(String, f64)> =
            fitted[other].fit.parameters.iter().map(|p| (p.name.clone(), p.value)).collect();
        let mut options = fit::options(controls, &fitted[i].program)?;
        let moving = fits::pose_parameters(&fitted[i].program, scan);
        for (name, value) in shape {
            if !moving.contains(&name) {
                options.start.entry(name).or_insert(value);
            }
        }
        // Where the other's shape does not exist with these inputs there is nothing to try.
        let Ok(again) = fit::run_fit(&fitted[i].program, &args.model, scan, &options, progress) else { continue };
        let rivals = [&fitted[i].fit, &again].map(|fit| Rival { model: &fitted[i].program, fit });
        let compared = fits::compare(&rivals, scan).map_err(CommandError::failed)?;
        if compared.bic[1] < compared.bic[0] {
            fitted[i].fit = again;
        }
    }
    Ok(())
}
