//! Finds parameters without influence on any part, or with one that has no derivative.

use super::super::{EvaluationError, Instance, Order, Program, Sites};
use super::ranges::{positions, setting};
use crate::diagnostic::{Code, Diagnostic};

/// Settings at which a parameter is moved: half of them with the others at their defaults, half with all of them moved.
const SETTINGS: usize = 96;
/// Fewer settings than these, where requirements reject the others, say nothing of a parameter that has derivatives.
const FEWEST: usize = 16;
/// Rows and columns of the points of a part that are compared.
const GRID: usize = 4;
/// Distance of points, as a share of their distance from the origin, that rounding does not explain.
const ROUNDING: f64 = 1e-12;
/// A small movement of a parameter, as a share of one that was found to move a part.
const SMALL: f64 = 1e-6;

pub(super) fn probe(program: &Program) -> Vec<Diagnostic> {
    if program.parts().is_empty() {
        return Vec::new();
    }
    let steep = with_derivatives(program).unwrap_or_default();
    let suspects = (0..program.parameters.len()).filter(|i| !steep.contains(i));
    suspects.filter_map(|i| finding(program, i)).collect()
}

/// The parameters by which some part has a derivative other than zero at the defaults.
fn with_derivatives(program: &Program) -> Result<Vec<usize>, EvaluationError> {
    let instance = program.instantiate(&program.defaults())?;
    let (u, v) = points(0);
    let mut steep = Vec::new();
    for (k, part) in program.patches.iter().enumerate() {
        let n = part.active.len();
        let mut jacobian = vec![0.0; 3 * n * u.len()];
        instance.evaluate(k, Sites::Scattered(&u, &v), Order::Jacobian, &mut jacobian)?;
        let moved = |a: &usize| jacobian.chunks(3 * n).any(|j| j[3 * a..3 * a + 3].iter().any(|d| *d != 0.0));
        steep.extend((0..n).filter(moved).map(|a| part.active[a] as usize));
    }
    Ok(steep)
}

/// Points (u, v) of a part; others for every k.
fn points(k: usize) -> (Vec<f64>, Vec<f64>) {
    let shift = positions(2, k);
    let place = |cell: usize, shift: f64| (cell as f64 + shift) / GRID as f64;
    (0..GRID * GRID).map(|c| (place(c % GRID, shift[0]), place(c / GRID, shift[1]))).unzip()
}

/// The effect of moving a parameter.
enum Effect {
    /// No part changed at so many settings.
    None(usize),
    /// A part is locally constant but not the same everywhere.
    Decides,
    /// A part changes with it.
    Moves(usize),
}

fn finding(program: &Program, i: usize) -> Option<Diagnostic> {
    let name = &program.parameters[i].name;
    let users: Vec<usize> = (0..program.parts().len()).filter(|p| program.influences(*p).any(|j| i == j)).collect();
    let active = program.patches.iter().any(|p| p.active.contains(&(i as u32)));
    let warning = |message: String, hint| {
        Some(Diagnostic::new(Code::NoInfluence, program.parameters[i].span, message).hint(hint))
    };
    let zero = "every derivative with respect to it is zero";
    let usual = "a fit cannot find its value; use it in a part, or make it an input";
    if users.is_empty() {
        return warning(format!("no part depends on the parameter '{name}'"), usual);
    }
    match (effect(program, i, &users), active) {
        (Effect::None(tried), false) => {
            let message =
                format!("the parameter '{name}' changed no part at {tried} settings that were tried, and {zero}");
            warning(message, usual)
        }
        (Effect::None(tried), true) if tried >= FEWEST => warning(
            format!("the parameter '{name}' changed no part at {tried} settings that were tried"),
            "a fit cannot find its value; let its bounds reach where it takes part, or make it an input",
        ),
        (Effect::Decides, false) => warning(format!("the parameter '{name}' only decides: {zero}"), usual),
        (Effect::Moves(part), false) => {
            let part = &program.patches[part].name;
            warning(
                format!("the parameter '{name}' moves the part '{part}', but {zero}, as after `stop`"),
                "a fit cannot find its value; use it without `stop`, or make it an input",
            )
        }
        (_, true) => None,
    }
}

/// Moves a parameter, and compares the points of the parts that use it.
fn effect(program: &Program, i: usize, users: &[usize]) -> Effect {
    let n = program.parameters.len();
    let mut tried = 0;
    for k in 0..SETTINGS {
        let all = positions(n, k);
        let at = |position: f64| {
            let mut at: Vec<Option<f64>> = all.iter().map(|p| (k >= SETTINGS / 2).then_some(*p)).collect();
            at[i] = Some(position);
            setting(program, &at).ok()
        };
        let (Some(x), Some(other)) = (at(all[i]), at(positions(n, k + 1)[i])) else { continue };
        // Nothing else is moved, also where the bounds of others follow this parameter.
        let mut y = x.clone();
        y[i] = other[i];
        let sites = points(k);
        let Some(part) = moved(program, users, &sites, &x, &y) else { continue };
        tried += 1;
        if let Some(part) = part {
            let mut near = x.clone();
            near[i] += SMALL * (y[i] - x[i]);
            let everywhere = moved(program, &[part], &sites, &x, &near).flatten().is_some();
            return if everywhere { Effect::Moves(part) } else { Effect::Decides };
        }
    }
    Effect::None(tried)
}

/// The first part that differs between two settings; `None` where one of them cannot be evaluated.
fn moved(
    program: &Program,
    parts: &[usize],
    (u, v): &(Vec<f64>, Vec<f64>),
    x: &[f64],
    y: &[f64],
) -> Option<Option<usize>> {
    let (one, other) = (program.instantiate(x).ok()?, program.instantiate(y).ok()?);
    for part in parts {
        let at = |instance: &Instance| {
            let mut out = vec![0.0; 3 * u.len()];
            instance.evaluate(*part, Sites::Scattered(u, v), Order::Points, &mut out).ok()?;
            Some(out)
        };
        let (a, b) = (at(&one)?, at(&other)?);
        let scale = 1.0 + a.iter().fold(0.0f64, |most, c| most.max(c.abs()));
        if a.iter().zip(&b).any(|(a, b)| (a - b).abs() > ROUNDING * scale) {
            return Some(Some(*part));
        }
    }
    Some(None)
}
