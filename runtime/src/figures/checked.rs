//! Derivatives of areas, compared with a difference of their values.
//!
//! Corners that move within a surface, and edges along which surfaces touch, are not in the formula of
//! [`gradient`](super::integrals::gradient). One difference along a direction in which all parameters change finds what
//! is missing of any.

use super::integrals::{Sums, fine, rules};
use super::{Integrated, Taken, patches_of};
use crate::model::{EvaluationError, Model};
use glam::DVec3;
use gml_compiler::program::{Figure, PartFigure, Quantity};

/// The step: of lengths as a part of the model's size, of the others as it is.
const STEP: f64 = 5e-4;
/// By how much a derivative may differ from the difference, and by how much an area from itself by rounding and by the
/// triangles that it is integrated over.
const SAME: f64 = 0.01;
const ROUNDING: f64 = 2e-6;

/// Takes away the derivatives of areas that do not agree with the difference.
///
/// # Errors
/// The surface cannot be evaluated at x.
pub(super) fn check_areas(
    model: &dyn Model,
    x: &[f64],
    figures: &[PartFigure],
    integrated: &Integrated,
    (size, taken): (f64, &mut [Result<Taken, String>]),
) -> Result<(), EvaluationError> {
    let is_doubtful = |figure: &PartFigure| {
        figure.figure == Figure::Area && figure.parts.iter().any(|patch| integrated.is_by_triangles(*patch))
    };
    let doubtful: Vec<usize> = (0..figures.len()).filter(|k| is_doubtful(&figures[*k])).collect();
    if doubtful.is_empty() || x.is_empty() {
        return Ok(());
    }
    let direction: Vec<f64> = (0_u32..).zip(model.parameters()).map(|(i, p)| along(i, p.quantity, size)).collect();
    // Beside a bound, or a condition of the model, there may be nothing to compare with.
    let Ok(ahead) = areas_at(model, x, &direction, 1.0, figures, &doubtful) else { return Ok(()) };
    let by_gradient = |k: usize, taken: &[Result<Taken, String>]| -> Option<(f64, f64)> {
        let (value, slopes) = taken[k].as_ref().ok()?;
        let slopes = slopes.as_ref().ok()?;
        Some((*value, slopes.iter().zip(&direction).map(|(slope, step)| slope * step).sum()))
    };
    let differs =
        |expected: f64, found: f64, value: f64| (found - expected).abs() > SAME * expected.abs() + ROUNDING * value;
    let is_off = |(k, ahead): &(usize, f64)| {
        by_gradient(*k, taken).is_some_and(|(value, found)| differs(ahead - value, found, value))
    };
    let off: Vec<(usize, f64)> = doubtful.into_iter().zip(ahead).filter(is_off).collect();
    if off.is_empty() {
        return Ok(());
    }
    // Areas that are curved in the parameters: half of the difference of both sides has an error of the third order.
    let (off, ahead): (Vec<usize>, Vec<f64>) = off.into_iter().unzip();
    let behind = areas_at(model, x, &direction, -1.0, figures, &off);
    for (i, k) in off.into_iter().enumerate() {
        let Some((value, found)) = by_gradient(k, taken) else { continue };
        let expected = behind.as_ref().map_or(ahead[i] - value, |behind| 0.5 * (ahead[i] - behind[i]));
        if differs(expected, found, value)
            && let Ok((_, slopes)) = &mut taken[k]
        {
            let why = "corners move within the surface of an area, or surfaces touch along its edge";
            *slopes = Err(why.to_owned());
        }
    }
    Ok(())
}

/// The areas of some figures a step away from x.
fn areas_at(
    model: &dyn Model,
    x: &[f64],
    direction: &[f64],
    sign: f64,
    figures: &[PartFigure],
    wanted: &[usize],
) -> Result<Vec<f64>, EvaluationError> {
    let moved: Vec<f64> = x.iter().zip(direction).map(|(x, step)| x + sign * step).collect();
    let instance = model.instantiate(&moved)?;
    let patches = patches_of(wanted.iter().map(|k| &figures[*k]));
    let rules = rules(model, &*instance, &patches, || fine(model, &*instance))?;
    let sums = patches.iter().zip(&rules).map(|(patch, rule)| rule.sums(&*instance, *patch, DVec3::ZERO));
    let sums = sums.collect::<Result<Vec<Sums>, _>>()?;
    let of_figure = |k: &usize| {
        let of_parts = patches.iter().zip(&sums).filter(|(patch, _)| figures[*k].parts.contains(patch));
        of_parts.map(|(_, sums)| sums.area).sum()
    };
    Ok(wanted.iter().map(of_figure).collect())
}

/// The step along a parameter: no two are alike, and signs differ.
fn along(i: u32, quantity: Quantity, size: f64) -> f64 {
    let golden = (f64::from(i) * 0.618_033_988_749_895).fract();
    let unit = if quantity == Quantity::Length { size } else { 1.0 };
    STEP * unit * (0.5 + 0.5 * golden) * if i.is_multiple_of(2) { 1.0 } else { -1.0 }
}
