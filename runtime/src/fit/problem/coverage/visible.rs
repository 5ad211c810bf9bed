//! Places spread evenly over what could be seen of a model: those inside of walls, where a handle ends, are left out.

use crate::bvh::Bvh;
use crate::fit::sampling::{cell_centres, halton};
use crate::fit::tuning::{
    CHORD, COVERAGE_PLACES, GRAZING_VIEW, PLACE_SAMPLES, PLACE_SEGMENTS, PLACES_EACH_WAY, VIEW_DIRECTIONS, VIEW_OFFSET,
};
use crate::model::{EvaluationError, Fineness, Instance, Model, Partials, Tessellation};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Places of one patch, by u and v, with the area that each stands for. Square millimetres.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Places {
    pub(crate) patch: usize,
    pub(crate) u: Vec<f64>,
    pub(crate) v: Vec<f64>,
    pub(crate) area: Vec<f64>,
}

/// Places on every patch that can be evaluated. `radius` is the scale of lengths.
///
/// # Errors
/// The model cannot be tessellated.
pub(crate) fn places(model: &dyn Model, instance: &dyn Instance, radius: f64) -> Result<Vec<Places>, EvaluationError> {
    let fineness = Fineness { chord: CHORD * radius, edge: f64::INFINITY, max_segments: PLACE_SEGMENTS };
    let surface = Tessellation::on_grids(model, instance, fineness)?;
    let bvh = Bvh::build(&surface.mesh).map_err(EvaluationError::new)?;
    let gauges: Vec<Option<Gauge>> = (0..model.parts().len()).map(|patch| Gauge::of(instance, patch)).collect();
    let total: f64 = gauges.iter().flatten().map(|g| g.area).sum();
    let spacing = (total / COVERAGE_PLACES).sqrt();
    let of_patch = |(patch, gauge): (usize, &Option<Gauge>)| {
        let gauge = gauge.as_ref()?;
        let sides = gauge.sides.map(|side| ((side / spacing).ceil() as usize).clamp(1, PLACES_EACH_WAY));
        Some(visible(&bvh, patch, grid(instance, patch, sides)?, VIEW_OFFSET * radius))
    };
    let by_patch: Vec<Option<Places>> = gauges.par_iter().enumerate().map(of_patch).collect();
    Ok(by_patch.into_iter().flatten().filter(|p| !p.u.is_empty()).collect())
}

/// The size of a patch.
struct Gauge {
    /// Mean lengths along u and v. Millimetres.
    sides: [f64; 2],
    area: f64,
}

impl Gauge {
    fn of(instance: &dyn Instance, patch: usize) -> Option<Self> {
        let [u, v] = cell_centres([PLACE_SAMPLES; 2]);
        let mut partials = vec![Partials::default(); u.len()];
        instance.partials(patch, &u, &v, &mut partials).ok()?;
        let mean = |of: &dyn Fn(&Partials) -> f64| partials.iter().map(of).sum::<f64>() / partials.len() as f64;
        let [du, dv] = [mean(&|p| DVec3::from_array(p.du).length()), mean(&|p| DVec3::from_array(p.dv).length())];
        let area = mean(&|p| across(p).length());
        (du.is_finite() && dv.is_finite() && area.is_finite()).then_some(Self { sides: [du, dv], area })
    }
}

fn across(p: &Partials) -> DVec3 {
    DVec3::from_array(p.du).cross(DVec3::from_array(p.dv))
}

/// The middles of a grid's cells, with their surfaces.
type Cells = ([Vec<f64>; 2], Vec<Partials>);

fn grid(instance: &dyn Instance, patch: usize, cells: [usize; 2]) -> Option<Cells> {
    let [u, v] = cell_centres(cells);
    let mut partials = vec![Partials::default(); u.len()];
    instance.partials(patch, &u, &v, &mut partials).ok()?;
    Some(([u, v], partials))
}

/// The cells that are visible from outside.
fn visible(bvh: &Bvh, patch: usize, ([u, v], partials): Cells, above: f64) -> Places {
    let mut places = Places { patch, ..Places::default() };
    let count = partials.len() as f64;
    for ((u, v), p) in u.iter().zip(&v).zip(&partials) {
        let normal = across(p);
        let area = normal.length() / count;
        let normal = normal.normalize_or_zero();
        let from = DVec3::from_array(p.point) + normal * above;
        let seen = |k: usize| {
            let direction = sphere(k);
            direction.dot(normal) > GRAZING_VIEW && bvh.nearest_hit(from, direction, f64::INFINITY).is_none()
        };
        if area > 0.0 && (0..VIEW_DIRECTIONS).any(seen) {
            places.u.push(*u);
            places.v.push(*v);
            places.area.push(area);
        }
    }
    places
}

/// Direction k of an even set.
fn sphere(k: usize) -> DVec3 {
    let (z, angle) = (2.0 * halton(k + 1, 0) - 1.0, TAU * halton(k + 1, 1));
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * angle.cos(), r * angle.sin(), z)
}
