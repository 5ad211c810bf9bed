//! Evaluations at places of a patch.

use crate::model::{EvaluationError, Instance, Partials};
use glam::DVec2;

pub(super) fn apart(places: &[DVec2]) -> (Vec<f64>, Vec<f64>) {
    places.iter().map(|at| (at.x, at.y)).unzip()
}

pub(super) fn partials_at(
    instance: &dyn Instance,
    patch: usize,
    places: &[DVec2],
) -> Result<Vec<Partials>, EvaluationError> {
    let (u, v) = apart(places);
    let mut partials = vec![Partials::default(); places.len()];
    instance.partials(patch, &u, &v, &mut partials)?;
    Ok(partials)
}

pub(super) fn keeps_at(instance: &dyn Instance, keep: usize, places: &[DVec2]) -> Result<Vec<f64>, EvaluationError> {
    let (u, v) = apart(places);
    instance.keeps(keep, &u, &v)
}
