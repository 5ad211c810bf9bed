//! Ranges that are empty for some values of other parameters, and bounds that no setting can reach.

use super::super::Program;
use super::shown;
use crate::check::typed::{Expr, ExprKind, Unary};
use crate::diagnostic::{Code, Diagnostic};
use crate::source::Span;

/// Settings that are tried.
const SETTINGS: usize = 64;
/// Steps into which a range is divided to find how much of it can be used.
const STEPS: usize = 32;
/// A `require` that involves more parameters is left out: its combinations would be too many.
const MOST_INVOLVED: usize = 6;

pub(super) fn probe(program: &Program) -> Vec<Diagnostic> {
    let mut found = empty_ranges(program);
    if found.is_empty() && !program.functions.requires.is_empty() {
        found.extend((0..program.parameters.len()).flat_map(|i| unreachable_bounds(program, i)));
    }
    found
}

/// The position of setting `k` in the range of every parameter, from 0 to 1: points that fill space evenly (the
/// additive recurrence of Roberts, whose steps are powers of the root of t^(d+1) = t + 1).
pub(super) fn positions(n: usize, k: usize) -> Vec<f64> {
    let mut root = 2f64;
    for _ in 0..32 {
        root = (1.0 + root).powf(1.0 / (n as f64 + 1.0));
    }
    (0..n).map(|i| (0.5 + k as f64 * root.powi(-(i as i32 + 1))).fract()).collect()
}

/// The setting at these positions (`None` for a default), where bounds may depend on preceding parameters. Fails with
/// the index of the first parameter whose range is empty and the values so far.
pub(super) fn setting(program: &Program, positions: &[Option<f64>]) -> Result<Vec<f64>, (usize, Vec<f64>)> {
    let mut x = program.defaults();
    for (i, position) in positions.iter().enumerate() {
        let (low, high) = program.range(&x, i);
        if low > high {
            return Err((i, x));
        }
        x[i] = match position {
            Some(position) => low + (high - low) * position,
            None => x[i].clamp(low, high),
        };
    }
    Ok(x)
}

fn empty_ranges(program: &Program) -> Vec<Diagnostic> {
    let mut found: Vec<Diagnostic> = Vec::new();
    let mut seen = Vec::new();
    for k in 0..SETTINGS {
        let positions: Vec<Option<f64>> = positions(program.parameters.len(), k).into_iter().map(Some).collect();
        let Err((i, x)) = setting(program, &positions) else { continue };
        if seen.contains(&i) {
            continue;
        }
        seen.push(i);
        let p = &program.parameters[i];
        let (low, high) = program.range(&x, i);
        let others: Vec<String> = program.parameters[..i]
            .iter()
            .zip(&x)
            .enumerate()
            .filter(|(j, _)| program.bounds_depend(i, *j))
            .map(|(_, (other, value))| format!("{} = {}", other.name, shown(other, *value)))
            .collect();
        let message = format!(
            "the bounds of '{}' leave no value where {}: they are {} and {}",
            p.name,
            others.join(", "),
            shown(p, low),
            shown(p, high)
        );
        found.push(
            Diagnostic::new(Code::EmptyRange, bounds_span(program, i).unwrap_or(p.span), message).hint(
                "bound the other parameter so that something is left, or write max(...) or min(...) in the bound",
            ),
        );
    }
    found
}

fn bounds_span(program: &Program, i: usize) -> Option<Span> {
    let param = &program.typed.params[i];
    Some(param.lower.as_ref()?.span.to(param.upper.as_ref()?.span))
}

/// Ends of a parameter's range at which one `require` fails wherever the other parameters are. Only bounds that are
/// numbers: one that follows other parameters is there to be loose.
fn unreachable_bounds(program: &Program, i: usize) -> Vec<Diagnostic> {
    let typed = &program.typed.params[i];
    let ends = [(typed.upper.as_ref(), 1.0, "above"), (typed.lower.as_ref(), 0.0, "below")];
    let mut found = Vec::new();
    for (bound, end, side) in ends {
        let Some(bound) = bound.filter(|b| is_number(b)) else { continue };
        for require in 0..program.functions.requires.len() {
            let used = program.used_params(&program.functions.requires[require]);
            if used.contains(&(i as u32)) && used.len() <= MOST_INVOLVED {
                let others: Vec<usize> = used.iter().map(|j| *j as usize).filter(|j| *j != i).collect();
                let accepted = |position: f64| is_accepted(program, require, i, position, &others);
                if let Some(position) = last_accepted(end, accepted) {
                    found.push(unreachable(program, i, require, bound.span, side, position));
                    break;
                }
            }
        }
    }
    found
}

fn is_number(bound: &Expr) -> bool {
    match &bound.kind {
        ExprKind::Real(_) => true,
        ExprKind::Unary(Unary::Neg, e) => is_number(e),
        _ => false,
    }
}

/// Whether a requirement holds for parameter `i` at a position of its range, for some values of the others: all
/// combinations of their bounds and defaults, where a condition that is monotonic in each has its extremes, and points
/// between.
fn is_accepted(program: &Program, require: usize, i: usize, position: f64, others: &[usize]) -> bool {
    let n = program.parameters.len();
    let corners = 3usize.pow(others.len() as u32);
    let corner = |k: usize| {
        let mut positions = vec![None; n];
        for (digit, j) in others.iter().enumerate() {
            positions[*j] = [None, Some(0.0), Some(1.0)][k / 3usize.pow(digit as u32) % 3];
        }
        positions
    };
    let inner = |k: usize| positions(n, k).into_iter().map(Some).collect::<Vec<_>>();
    (0..corners).map(corner).chain((0..SETTINGS).map(inner)).any(|mut positions| {
        positions[i] = Some(position);
        setting(program, &positions).is_ok_and(|x| program.holds(require, &x))
    })
}

/// The position nearest to an end of the range that is accepted; none if the end or a position next to it is, or no
/// position.
fn last_accepted(end: f64, accepted: impl Fn(f64) -> bool) -> Option<f64> {
    if accepted(end) {
        return None;
    }
    let step = |s: usize| (end - s as f64 / STEPS as f64).abs();
    let mut inside = (1..=STEPS).map(step).find(|s| accepted(*s))?;
    let mut outside = inside + (end - inside).signum() / STEPS as f64;
    for _ in 0..12 {
        let middle = 0.5 * (inside + outside);
        *if accepted(middle) { &mut inside } else { &mut outside } = middle;
    }
    ((end - inside).abs() > 1.0 / STEPS as f64).then_some(inside)
}

fn unreachable(program: &Program, i: usize, require: usize, bound: Span, side: &str, position: f64) -> Diagnostic {
    let p = &program.parameters[i];
    let (low, high) = program.range(&program.defaults(), i);
    let limit = rounded(program, i, low + (high - low) * position);
    let message =
        format!("values of '{}' {side} about {limit} are never accepted, whatever the other parameters are", p.name);
    Diagnostic::new(Code::UnreachableBound, bound, message)
        .label("this bound is never reached")
        .related(program.functions.requires[require].span, "this rejects them")
}

/// A value of a parameter to what was found by trying: three digits.
fn rounded(program: &Program, i: usize, value: f64) -> String {
    let digits = 10f64.powi(2 - value.abs().max(1e-6).log10().floor() as i32);
    shown(&program.parameters[i], (value * digits).round() / digits)
}
