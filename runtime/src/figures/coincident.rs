//! Derivatives where surfaces of two solids lie in one another: what is gained as one of them moves one way is not lost
//! as it moves the other way, so that a volume, an area or a centroid has another derivative on either side.
//!
//! `std.solid` tells such surfaces apart by asking a millionth of a millimetre beside them. So the function of where a
//! surface is there is level at that value over the stretch where it lies in another one, and its derivative by a
//! parameter is how fast both leave each other. Nothing is gained or lost if the surface is there all the same: the
//! bottom of a hole that ends where two solids are joined.

use super::places::{keeps_at, partials_at};
use super::{Integrated, Taken};
use crate::model::{EvaluationError, Instance, Model};
use crate::sampling::halton;
use glam::{DVec2, DVec3};
use gml_compiler::program::PartFigure;
use rayon::prelude::*;

/// Places of each trimmed patch that are looked at: a stretch of a hundredth of it has two of them.
const PLACES: usize = 256;
/// The distance beside a surface at which `std.solid` asks for another one. Millimetres.
const BESIDE: f64 = 1e-6;
/// The part of that distance by which the function may differ from it where surfaces coincide.
const AS_BESIDE: f64 = 0.01;
/// The most that the function may change there by a millimetre: beside an edge it changes by one, beside the line along
/// which surfaces are tangent by some thousandths.
const LEVEL: f64 = 1e-5;
/// The speed, by a unit of the parameter, from which on two surfaces leave each other: far above rounding. Millimetres.
const LEAVING: f64 = 1e-6;
/// How far a surface is moved from another one that it lies in, to see whether it is there on either side. Millimetres:
/// a thousand times the distance at which `std.solid` asks.
const APART: f64 = 1e-3;

/// Takes away the derivatives of areas, volumes and centroids that are not the same on both sides.
///
/// # Errors
/// The surface cannot be evaluated.
pub(super) fn check_sides(
    model: &dyn Model,
    (x, instance): (&[f64], &dyn Instance),
    figures: &[PartFigure],
    integrated: &Integrated,
    taken: &mut [Result<Taken, String>],
) -> Result<(), EvaluationError> {
    let leaving = |patch: &usize| Ok(leaving(model, (x, instance), *patch)?.map(|parameter| (*patch, parameter)));
    let leaving: Result<Vec<_>, EvaluationError> = integrated.patches.par_iter().map(leaving).collect();
    let leaving: Vec<(usize, usize)> = leaving?.into_iter().flatten().collect();
    for (figure, taken) in figures.iter().zip(taken).filter(|(figure, _)| figure.others.is_empty()) {
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
fn leaving(
    model: &dyn Model,
    (x, instance): (&[f64], &dyn Instance),
    patch: usize,
) -> Result<Option<usize>, EvaluationError> {
    let (Some(keep), active) = (model.keep(patch), model.keep_active(patch)) else { return Ok(None) };
    if active.is_empty() {
        return Ok(None);
    }
    let places: Vec<DVec2> = (1..=PLACES).map(|k| DVec2::new(halton(k, 0), halton(k, 1))).collect();
    let (surface, there) = (partials_at(instance, patch, &places)?, partials_at(instance, keep, &places)?);
    let is_level = |slope: [f64; 3], way: [f64; 3]| slope[0].abs() <= LEVEL * DVec3::from(way).length();
    let lies_in_another = |k: &usize| {
        let (s, f) = (&surface[*k], &there[*k]);
        (f.point[0].abs() - BESIDE).abs() <= AS_BESIDE * BESIDE && is_level(f.du, s.du) && is_level(f.dv, s.dv)
    };
    let lying = (0..PLACES).filter(lies_in_another).map(|k| (places[k], there[k].point[0] > 0.0));
    let lying: Vec<(DVec2, bool)> = lying.collect();
    let (u, v): (Vec<f64>, Vec<f64>) = lying.iter().map(|(at, _)| (at.x, at.y)).unzip();
    let mut speeds = vec![0.0; lying.len() * active.len() * 3];
    instance.jacobian(keep, &u, &v, &mut speeds)?;
    for (a, parameter) in active.iter().enumerate() {
        let speed = |k: &usize| speeds[(k * active.len() + a) * 3].abs();
        let some: Vec<usize> = (0..lying.len()).filter(|k| speed(k) > LEAVING).collect();
        let step = APART / some.iter().map(speed).fold(LEAVING, f64::max);
        let some: Vec<(DVec2, bool)> = some.into_iter().map(|k| lying[k]).collect();
        let changes = |step: f64| {
            let mut moved = x.to_vec();
            moved[*parameter as usize] += step;
            // One alone may be on the line along which a surface is tangent. Beyond a bound, or a condition of the
            // model, nothing is.
            model.instantiate(&moved).is_ok_and(|moved| changed(&*moved, keep, &some) > 1)
        };
        if some.len() > 1 && (changes(step) || changes(-step)) {
            return Ok(Some(*parameter as usize));
        }
    }
    Ok(None)
}

/// At how many places it is not as it was whether a surface is there. Where it cannot be evaluated it is not.
fn changed(instance: &dyn Instance, keep: usize, was: &[(DVec2, bool)]) -> usize {
    let places: Vec<DVec2> = was.iter().map(|(at, _)| *at).collect();
    let now = keeps_at(instance, keep, &places).unwrap_or_else(|_| vec![f64::NEG_INFINITY; was.len()]);
    now.iter().zip(was).filter(|(now, (_, was))| (**now > 0.0) != *was).count()
}
