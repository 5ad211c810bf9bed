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
const SAME: f64 = 0.05;
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
    let areas = || -> Result<Vec<f64>, EvaluationError> {
        let moved: Vec<f64> = x.iter().zip(&direction).map(|(x, step)| x + step).collect();
        let instance = model.instantiate(&moved)?;
        let patches = patches_of(doubtful.iter().map(|k| &figures[*k]));
        let rules = rules(model, &*instance, &patches, || fine(model, &*instance))?;
        let sums = patches.iter().zip(&rules).map(|(patch, rule)| rule.sums(&*instance, *patch, DVec3::ZERO));
        let sums = sums.collect::<Result<Vec<Sums>, _>>()?;
        let of_figure = |k: &usize| {
            let of_parts = patches.iter().zip(&sums).filter(|(patch, _)| figures[*k].parts.contains(patch));
            of_parts.map(|(_, sums)| sums.area).sum()
        };
        Ok(doubtful.iter().map(of_figure).collect())
    };
    // Beside a bound, or a condition of the model, there may be nothing to compare with.
    let Ok(moved) = areas() else { return Ok(()) };
    for (k, moved) in doubtful.into_iter().zip(moved) {
        let Ok((value, slopes)) = &mut taken[k] else { continue };
        let Ok(gradient) = &*slopes else { continue };
        let expected = moved - *value;
        let by_gradient: f64 = gradient.iter().zip(&direction).map(|(slope, step)| slope * step).sum();
        if (by_gradient - expected).abs() > SAME * expected.abs() + ROUNDING * *value {
            *slopes = Err("corners move within the surface of an area, or surfaces touch along its edge".to_owned());
        }
    }
    Ok(())
}

/// The step along a parameter: no two are alike, and signs differ.
fn along(i: u32, quantity: Quantity, size: f64) -> f64 {
    let golden = (f64::from(i) * 0.618_033_988_749_895).fract();
    let unit = if quantity == Quantity::Length { size } else { 1.0 };
    STEP * unit * (0.5 + 0.5 * golden) * if i.is_multiple_of(2) { 1.0 } else { -1.0 }
}
