//! Places spread evenly over what could be seen of a model: those inside of walls, where a handle ends, are left out,
//! and what is trimmed away is not there.

use crate::bvh::Bvh;
use crate::fit::tuning::{
    CHORD, COVERAGE_PLACES, GRAZING_VIEW, PLACE_SAMPLES, PLACE_SEGMENTS, PLACES_EACH_WAY, VIEW_DIRECTIONS, VIEW_OFFSET,
};
use crate::model::{EvaluationError, Fineness, Instance, Model, Partials, Tessellation};
use crate::sampling::{cell_centres, direction};
use glam::DVec3;
use rayon::prelude::*;

/// Places of one patch, by u and v, with the area that each stands for. Square millimetres.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Places {
    pub(crate) patch: usize,
    /// The patch of the function that is positive where this one is there, if it is trimmed.
    pub(crate) keep: Option<usize>,
    pub(crate) u: Vec<f64>,
    pub(crate) v: Vec<f64>,
    pub(crate) area: Vec<f64>,
}

/// Visible places on every patch that can be evaluated. `radius` is the scale of lengths.
///
/// # Errors
/// The model cannot be tessellated.
pub(crate) fn places(model: &dyn Model, instance: &dyn Instance, radius: f64) -> Result<Vec<Places>, EvaluationError> {
    let fineness = Fineness { chord: CHORD * radius, max_segments: PLACE_SEGMENTS, ..Fineness::default() };
    let tessellate = if model.is_trimmed() { Tessellation::new } else { Tessellation::on_grids };
    let surface = tessellate(model, instance, fineness)?;
    let bvh = Bvh::build(&surface.mesh).map_err(EvaluationError::new)?;
    let above = VIEW_OFFSET * radius;
    let visible = |p: &Partials| is_visible(&bvh, DVec3::from_array(p.point), across(p).normalize_or_zero(), above);
    Ok(spread(model, instance, visible))
}

/// Places on every patch that can be evaluated, whether they could be seen or not.
pub(crate) fn all_places(model: &dyn Model, instance: &dyn Instance) -> Vec<Places> {
    spread(model, instance, |_| true)
}

/// Places spread evenly over all patches that can be evaluated, those that are chosen.
fn spread(model: &dyn Model, instance: &dyn Instance, chosen: impl Fn(&Partials) -> bool + Sync) -> Vec<Places> {
    let gauges: Vec<Option<Gauge>> =
        (0..model.parts().len()).map(|patch| Gauge::of(instance, patch, model.keep(patch))).collect();
    let total: f64 = gauges.iter().flatten().map(|g| g.area).sum();
    let spacing = (total / COVERAGE_PLACES).sqrt();
    let of_patch = |(patch, gauge): (usize, &Option<Gauge>)| {
        let gauge = gauge.as_ref()?;
        let sides = gauge.sides.map(|side| ((side / spacing).ceil() as usize).clamp(1, PLACES_EACH_WAY));
        Places::of_cells(instance, (patch, model.keep(patch)), sides, &chosen)
    };
    let by_patch: Vec<Option<Places>> = gauges.par_iter().enumerate().map(of_patch).collect();
    by_patch.into_iter().flatten().filter(|p| !p.u.is_empty()).collect()
}

/// The size of a patch.
struct Gauge {
    /// Mean lengths along u and v. Millimetres.
    sides: [f64; 2],
    area: f64,
}

impl Gauge {
    fn of(instance: &dyn Instance, patch: usize, keep: Option<usize>) -> Option<Self> {
        let [u, v] = cell_centres([PLACE_SAMPLES; 2]);
        let mut partials = vec![Partials::default(); u.len()];
        instance.partials(patch, &u, &v, &mut partials).ok()?;
        let mean = |of: &dyn Fn(&Partials) -> f64| partials.iter().map(of).sum::<f64>() / partials.len() as f64;
        let [du, dv] = [mean(&|p| DVec3::from_array(p.du).length()), mean(&|p| DVec3::from_array(p.dv).length())];
        let there = instance.is_there(keep, &u, &v).ok()?;
        let areas = partials.iter().zip(there).map(|(p, there)| if there { across(p).length() } else { 0.0 });
        let area = areas.sum::<f64>() / partials.len() as f64;
        (du.is_finite() && dv.is_finite() && area.is_finite()).then_some(Self { sides: [du, dv], area })
    }
}

/// The area of what is there of a patch, exact to some percent. Square millimetres. None where it cannot be evaluated.
pub(crate) fn patch_area(model: &dyn Model, instance: &dyn Instance, patch: usize) -> Option<f64> {
    Gauge::of(instance, patch, model.keep(patch)).map(|gauge| gauge.area)
}

/// The normal du x dv, as long as the surface is large by u and v.
pub(crate) fn across(p: &Partials) -> DVec3 {
    DVec3::from_array(p.du).cross(DVec3::from_array(p.dv))
}

impl Places {
    /// The middles of a grid's cells that have an area, some of them. None where the patch cannot be evaluated.
    fn of_cells(
        instance: &dyn Instance,
        (patch, keep): (usize, Option<usize>),
        cells: [usize; 2],
        chosen: impl Fn(&Partials) -> bool,
    ) -> Option<Self> {
        let [u, v] = cell_centres(cells);
        let mut partials = vec![Partials::default(); u.len()];
        instance.partials(patch, &u, &v, &mut partials).ok()?;
        let there = instance.is_there(keep, &u, &v).ok()?;
        let mut places = Self { patch, keep, ..Self::default() };
        let count = partials.len() as f64;
        for (((u, v), p), there) in u.iter().zip(&v).zip(&partials).zip(there) {
            let area = across(p).length() / count;
            if there && area > 0.0 && chosen(p) {
                places.u.push(*u);
                places.v.push(*v);
                places.area.push(area);
            }
        }
        Some(places)
    }
}

/// Whether a place of a surface is visible from outside.
fn is_visible(bvh: &Bvh, point: DVec3, normal: DVec3, above: f64) -> bool {
    let from = point + normal * above;
    (0..VIEW_DIRECTIONS).map(direction).any(|direction| {
        direction.dot(normal) > GRAZING_VIEW && bvh.nearest_hit(from, direction, f64::INFINITY).is_none()
    })
}
