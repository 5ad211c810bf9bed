//! Figures of a model's parts, and the values of the measures that take them: areas, volumes and centroids, least
//! distances and angles, all with their derivatives by the parameters.

mod angle;
mod checked;
mod coincident;
mod distance;
mod edges;
mod enclosure;
mod integrals;
mod places;
mod reach;
mod rule;

#[cfg(test)]
mod tests;

pub(crate) use enclosure::simply_enclosed;
pub use enclosure::{NoVolume, Overlap, overlap};
pub(crate) use integrals::{Sums, over_patches};

use crate::mesh::{Group, TriangleMesh};
use crate::model::{CHORD_OF_THIN, Closedness, EvaluationError, Instance, Model, Tessellation};
use glam::DVec3;
use gml_compiler::program::{Figure, PartFigure, Quantity};
use integrals::{fine, gradient, rules};
use rayon::prelude::*;
use reach::reaching;
use rule::Rule;
use std::collections::HashMap;

/// The value of a measure.
#[derive(Clone, Debug)]
pub struct MeasureValue {
    /// In the measure's unit; millimetres and radians.
    pub value: f64,
    /// The derivative by every parameter, or why there is none.
    pub gradient: Result<Vec<f64>, EvaluationError>,
}

/// The least derivative that is told from none: as a part of the value, or of the size of the model for coordinates, by
/// a millimetre as a part of the model's diagonal, or by one of any other unit. The sums over trimmed parts are exact
/// to some 1e-7 of it.
const LEAST_SLOPE: f64 = 1e-7;

/// How long all borders without a neighbour may be, as a part of the model's diagonal: the integrals are of the exact
/// patches, and where surfaces touch, or several edges meet, narrow gaps may be left in the triangles.
const WIDEST_GAPS: f64 = 5e-3;

/// More triangles than these are not made finer to decide whether thin walls enclose something: it would take many
/// seconds.
const MOST_FOR_THIN: usize = 100_000;

/// A figure of parts, and its derivative by every parameter, or why there is none.
type Taken = (f64, Result<Vec<f64>, String>);

/// All measures of a model at x, or why one cannot be computed. Those of figures of parts take a tessellation.
#[must_use]
pub fn measured(model: &dyn Model, x: &[f64]) -> Vec<Result<MeasureValue, EvaluationError>> {
    let figures: Vec<Result<Taken, String>> = match model.figures() {
        [] => Vec::new(),
        figures => match of_parts(model, x, figures) {
            Ok(taken) => taken,
            Err(error) => vec![Err(error.message); figures.len()],
        },
    };
    let measured = |k: usize| {
        let taken = model.figures_of(k).iter().map(|i| figures[*i as usize].as_ref());
        let taken = taken
            .collect::<Result<Vec<_>, _>>()
            .map_err(|why| model.wrong_measure(k, x, &format!("cannot be computed: {why}")))?;
        let values: Vec<f64> = taken.iter().map(|(value, _)| *value).collect();
        let value = model.measure(k, x, &values)?;
        let gradient = model.measure_gradient(k, x, &values).and_then(|mut gradient| {
            let by_figures = gradient.split_off(x.len());
            for (slope, (_, derivatives)) in by_figures.iter().zip(&taken).filter(|(slope, _)| **slope != 0.0) {
                let has_none = |why: &String| model.wrong_measure(k, x, &format!("has no derivatives here: {why}"));
                let derivatives = derivatives.as_ref().map_err(has_none)?;
                gradient.iter_mut().zip(derivatives).for_each(|(sum, derivative)| *sum += slope * derivative);
            }
            Ok(gradient)
        });
        Ok(MeasureValue { value, gradient })
    };
    (0..model.measures().len()).map(measured).collect()
}

/// Figures of parts, or why they have no value.
fn of_parts(
    model: &dyn Model,
    x: &[f64],
    figures: &[PartFigure],
) -> Result<Vec<Result<Taken, String>>, EvaluationError> {
    let instance = model.instantiate(x)?;
    let fine = fine(model, &*instance)?;
    let size = fine.mesh.bounds().diagonal();
    let integrated = Integrated::new(model, &*instance, &fine, figures)?;
    // Volume and centroid of the same parts ask the same.
    let mut enclosing: HashMap<&[usize], Result<(), String>> = HashMap::new();
    let taken = figures.iter().map(|PartFigure { figure, parts, others }| {
        if matches!(figure, Figure::Volume | Figure::Centroid(_)) {
            enclosing.entry(parts).or_insert_with(|| encloses(model, &*instance, &fine, parts)).clone()?;
        }
        let (value, slopes) = match figure {
            Figure::Area | Figure::Volume | Figure::Centroid(_) => integrated.value(*figure, parts),
            Figure::Distance => distance::least(model, &*instance, &fine, [parts, others])?,
            Figure::Angle => angle::between(model, &*instance, &fine, [parts, others])?,
        };
        let scale = match figure {
            Figure::Area | Figure::Volume => value.abs(),
            Figure::Centroid(_) | Figure::Distance => size,
            Figure::Angle => 1.0,
        };
        let told = |(slope, quantity): (f64, Quantity)| {
            let unit = if quantity == Quantity::Length { 1.0 / size } else { 1.0 };
            if slope.abs() < LEAST_SLOPE * scale * unit { 0.0 } else { slope }
        };
        let quantities = || model.parameters().iter().map(|parameter| parameter.quantity);
        Ok((value, slopes.map(|slopes| slopes.into_iter().zip(quantities()).map(told).collect())))
    });
    let mut taken: Vec<_> = taken.collect();
    coincident::check_sides(model, (x, &*instance), figures, &integrated, &mut taken)?;
    checked::check_areas(model, x, figures, &integrated, (size, &mut taken))?;
    Ok(taken)
}

/// The integrals over patches that figures take.
struct Integrated {
    /// The patches, ascending.
    patches: Vec<usize>,
    /// Of each whether it was integrated over triangles.
    by_triangles: Vec<bool>,
    /// Of each its integrals and their derivatives by every parameter.
    over: Vec<(Sums, Vec<Sums>)>,
    origin: DVec3,
}

impl Integrated {
    fn new(
        model: &dyn Model,
        instance: &dyn Instance,
        fine: &Tessellation,
        figures: &[PartFigure],
    ) -> Result<Self, EvaluationError> {
        let origin = fine.mesh.bounds().centre();
        let between = |figure: &&PartFigure| !figure.others.is_empty();
        let patches = patches_of(figures.iter().filter(|figure| !between(figure)));
        let rules = rules(model, instance, &patches, || Ok(fine))?;
        let over_patch = |(patch, rule): (&usize, &Rule)| -> Result<(Sums, Vec<Sums>), EvaluationError> {
            Ok((rule.sums(instance, *patch, origin)?, gradient(model, instance, rule, *patch, origin)?))
        };
        let over = patches.par_iter().zip(&rules).map(over_patch).collect::<Result<Vec<_>, _>>()?;
        let by_triangles = rules.iter().map(|rule| rule.is_by_triangles).collect();
        Ok(Self { patches, by_triangles, over, origin })
    }

    fn is_by_triangles(&self, patch: usize) -> bool {
        self.patches.binary_search(&patch).is_ok_and(|k| self.by_triangles[k])
    }

    fn value(&self, figure: Figure, parts: &[usize]) -> Taken {
        let parameters = self.over.first().map_or(0, |(_, slopes)| slopes.len());
        let (mut sums, mut slopes) = (Sums::default(), vec![Sums::default(); parameters]);
        for (_, (of_patch, gradient)) in self.patches.iter().zip(&self.over).filter(|(patch, _)| parts.contains(patch))
        {
            sums += *of_patch;
            slopes.iter_mut().zip(gradient).for_each(|(sum, slope)| *sum += *slope);
        }
        let (value, slopes) = match figure {
            Figure::Area => (sums.area, slopes.iter().map(|slope| slope.area).collect()),
            Figure::Centroid(axis) => {
                let from = sums.moments[axis] / sums.volume;
                let slope = |slope: &Sums| (slope.moments[axis] - from * slope.volume) / sums.volume;
                (self.origin[axis] + from, slopes.iter().map(slope).collect())
            }
            _ => (sums.volume, slopes.iter().map(|slope| slope.volume).collect()),
        };
        (value, Ok(slopes))
    }
}

/// The patches of some figures, ascending.
fn patches_of<'f>(figures: impl Iterator<Item = &'f PartFigure>) -> Vec<usize> {
    let mut patches: Vec<usize> = figures.flat_map(|figure| figure.parts.iter().copied()).collect();
    patches.sort_unstable();
    patches.dedup();
    patches
}

/// The triangles of a patch.
fn triangles_of(fine: &Tessellation, patch: usize) -> &[[u32; 3]] {
    let group = &fine.mesh.groups[patch];
    &fine.mesh.triangles[group.start..group.end]
}

/// The largest of them; none where nothing of the patch is left.
fn largest_triangle(fine: &Tessellation, patch: usize) -> Option<[u32; 3]> {
    let area = |triangle: &[u32; 3]| fine.mesh.triangle_area(*triangle);
    triangles_of(fine, patch).iter().copied().max_by(|a, b| area(a).total_cmp(&area(b)))
}

/// How a place of a patch moves by each of its active parameters.
fn motions(instance: &dyn Instance, patch: usize, active: usize, uv: [f64; 2]) -> Result<Vec<DVec3>, EvaluationError> {
    let mut out = vec![0.0; active * 3];
    instance.jacobian(patch, &[uv[0]], &[uv[1]], &mut out)?;
    Ok(out.chunks_exact(3).map(DVec3::from_slice).collect())
}

/// Whether parts enclose a volume, all facing outwards. Triangles of thin walls may pass through each other: finer ones
/// decide.
fn encloses(model: &dyn Model, instance: &dyn Instance, fine: &Tessellation, parts: &[usize]) -> Result<(), String> {
    if parts.iter().all(|patch| triangles_of(fine, *patch).is_empty()) {
        return Err("nothing is left of its parts".to_owned());
    }
    encloses_by(model, fine, parts, None).or_else(|why| {
        if fine.mesh.triangles.len() > MOST_FOR_THIN {
            return Err(why);
        }
        let finer = Tessellation::relative(model, instance, CHORD_OF_THIN).map_err(|error| error.message)?;
        encloses_by(model, &finer, parts, Some(finer.chord)).map_err(|_| why)
    })
}

/// The same by some triangles. With their chord, bodies that touch are not taken for bodies in each other.
fn encloses_by(model: &dyn Model, fine: &Tessellation, parts: &[usize], chord: Option<f64>) -> Result<(), String> {
    let mesh = only(&fine.mesh, parts);
    let closedness = Closedness::of_parts(&mesh).map_err(|error| error.message)?;
    let name = |patch: &usize| model.parts()[*patch].name.clone();
    let length: f64 = closedness.open.iter().map(|open| open.length).sum();
    if let Some(open) = closedness.open.first().filter(|_| length > WIDEST_GAPS * mesh.bounds().diagonal()) {
        return Err(format!("its parts enclose no volume: {} is open ({})", name(&(open.patch)), open.side));
    }
    if let Some(patch) = closedness.inside_out.first() {
        return Err(format!("its parts enclose no volume: {} faces inwards", name(patch)));
    }
    let enclosed = simply_enclosed(&mesh, chord);
    let enclosed = enclosed.and_then(|()| reaching(&mesh).map_or(Ok(()), |_| Err(NoVolume::Overlapping)));
    enclosed.map_err(|why| {
        match why {
            NoVolume::Overlapping => "its parts overlap, so that their volumes do not add up",
            NoVolume::Flat => "its parts have no inside",
            NoVolume::Open => "its parts are not closed",
        }
        .to_owned()
    })
}

/// The triangles of some parts; the groups of the others are empty.
fn only(mesh: &TriangleMesh, parts: &[usize]) -> TriangleMesh {
    let (mut triangles, mut groups) = (Vec::new(), Vec::new());
    for (patch, group) in mesh.groups.iter().enumerate() {
        let start = triangles.len();
        if parts.contains(&patch) {
            triangles.extend_from_slice(&mesh.triangles[group.start..group.end]);
        }
        groups.push(Group { name: group.name.clone(), start, end: triangles.len() });
    }
    TriangleMesh {
        positions: mesh.positions.clone(),
        normals: mesh.normals.clone(),
        triangles,
        groups,
        ..TriangleMesh::default()
    }
}
