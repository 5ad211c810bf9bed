//! Derivatives where surfaces of two solids lie in one another: what is gained as one of them moves one way is not lost
//! as it moves the other way, so that a volume, an area or a centroid has another derivative on either side.
//!
//! `std.solid` tells such surfaces apart by asking a millionth of a millimetre beside them. So the function of where a
//! surface is there is level at that value over the stretch where it lies in another one, and its derivative by a
//! parameter is how fast both leave each other.

use super::{Taken, patches_of};
use crate::model::{EvaluationError, Instance, Model, Partials};
use crate::sampling::halton;
use glam::DVec3;
use gml_compiler::program::{Figure, PartFigure};
use rayon::prelude::*;

/// Places of each trimmed patch that are looked at: a stretch of a hundredth of it has two of them.
const PLACES: usize = 256;
/// How far beside a surface another one is asked for. Millimetres.
const BESIDE: f64 = 1e-6;
/// By how much the function may differ from it where surfaces coincide, as a part of it, and how much it may change by
/// a millimetre: beside an edge it changes by as much, where surfaces are tangent by some thousandths.
const AS_BESIDE: f64 = 0.01;
const LEVEL: f64 = 1e-5;
/// From which speed on, by a unit of the parameter, two surfaces leave each other: far above rounding. Millimetres.
const LEAVING: f64 = 1e-6;

/// Takes away the derivatives of areas, volumes and centroids that are not the same on both sides.
///
/// # Errors
/// The surface cannot be evaluated.
pub(super) fn check_sides(
    model: &dyn Model,
    instance: &dyn Instance,
    figures: &[PartFigure],
    taken: &mut [Result<Taken, String>],
) -> Result<(), EvaluationError> {
    let is_integral =
        |figure: &PartFigure| matches!(figure.figure, Figure::Area | Figure::Volume | Figure::Centroid(_));
    let patches = patches_of(figures.iter().filter(|figure| is_integral(figure)));
    let leaving = |patch: &usize| Ok(leaving(model, instance, *patch)?.map(|parameter| (*patch, parameter)));
    let leaving: Result<Vec<_>, EvaluationError> = patches.par_iter().map(leaving).collect();
    let leaving: Vec<(usize, usize)> = leaving?.into_iter().flatten().collect();
    for (figure, taken) in figures.iter().zip(taken).filter(|(figure, _)| is_integral(figure)) {
        let (Ok((_, slopes)), Some((patch, parameter))) =
            (taken, leaving.iter().find(|(patch, _)| figure.parts.contains(patch)))
        else {
            continue;
        };
        let (part, parameter) = (&model.parts()[*patch].name, &model.parameters()[*parameter].name);
        *slopes = Err(format!(
            "that by '{parameter}' is another one on either side, as '{part}' lies in another surface, which it leaves \
             when '{parameter}' changes"
        ));
    }
    Ok(())
}

/// A parameter with which a trimmed patch leaves a surface that it lies in.
fn leaving(model: &dyn Model, instance: &dyn Instance, patch: usize) -> Result<Option<usize>, EvaluationError> {
    let (Some(keep), active) = (model.keep(patch), model.keep_active(patch)) else { return Ok(None) };
    if active.is_empty() {
        return Ok(None);
    }
    let at = |dimension: usize| (1..=PLACES).map(|k| halton(k, dimension)).collect::<Vec<f64>>();
    let (u, v) = (at(0), at(1));
    let partials = |patch: usize| -> Result<Vec<Partials>, EvaluationError> {
        let mut partials = vec![Partials::default(); PLACES];
        instance.partials(patch, &u, &v, &mut partials)?;
        Ok(partials)
    };
    let (surface, there) = (partials(patch)?, partials(keep)?);
    let is_level = |slope: [f64; 3], way: [f64; 3]| slope[0].abs() <= LEVEL * DVec3::from(way).length();
    let lies_in_another = |k: &usize| {
        let (s, f) = (&surface[*k], &there[*k]);
        (f.point[0].abs() - BESIDE).abs() <= AS_BESIDE * BESIDE && is_level(f.du, s.du) && is_level(f.dv, s.dv)
    };
    let places: Vec<usize> = (0..PLACES).filter(lies_in_another).collect();
    let (u, v): (Vec<f64>, Vec<f64>) = places.iter().map(|k| (u[*k], v[*k])).unzip();
    let mut speeds = vec![0.0; places.len() * active.len() * 3];
    instance.jacobian(keep, &u, &v, &mut speeds)?;
    // One alone may be on the line along which a surface is tangent.
    let leaves = |a: &usize| {
        let leaving = speeds.chunks_exact(active.len() * 3).filter(|of_place| of_place[3 * a].abs() > LEAVING);
        leaving.count() > 1
    };
    Ok((0..active.len()).find(leaves).map(|a| active[a] as usize))
}
