//! Measures that parts show by their measured points: diameters, distances and angles of the surfaces of least squares.

use super::datum::{Datum, Kind};
use super::linear::MOST;
use super::{FEWEST, Recognised, zone};
use crate::bvh::Bvh;
use crate::mesh::TriangleMesh;
use crate::model::Model;
use crate::robust::{MAD_TO_SD, median};
use crate::variance::Deviations;
use crate::variance::moments::null_as_nan;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, PI};

/// Points are left out that lie farther than so many robust standard deviations from the surface of least squares.
const OUTLYING: f64 = 4.0;

/// Distances below this are rounding. Millimetres.
const ROUNDING: f64 = 1e-9;

/// Texels that are looked at for the scan's points: of a texture of 1024 x 1024 every fourth, where a point of the scan
/// has some sixteen.
const LOOKED_AT: usize = 250_000;

/// Texels of each part from which its surface in the model is found.
const EXACT_SAMPLES: usize = 500;

/// A measure is the figure of a part if both agree to this, relative to the larger of the value and 1 mm or 1 rad.
const SAME: f64 = 1e-5;

/// Cosine of the angle between directions that count as parallel in the model: 0.01 degrees.
const PARALLEL: f64 = 1.0 - 1.5e-8;

/// A measure of the script, by the measured points of the parts that it names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointMeasure {
    /// The name of the measure.
    pub name: String,
    /// `mm` or `rad`.
    pub unit: String,
    /// The parts.
    pub parts: Vec<String>,
    /// What it is of their surfaces: `diameter`, `radius`, `distance`, `opening angle` or `angle`; absent where it is
    /// none of these.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub figure: Option<String>,
    /// Its value in the model from which the distances were measured. NaN where it cannot be computed.
    #[serde(deserialize_with = "null_as_nan")]
    pub model: f64,
    /// Its value by the surfaces of least squares of the measured points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// Standard uncertainty by the scatter of the points, taken as independent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<f64>,
    /// Why there is no value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// The measures that name parts, by the points of the scan that belong to these, at the parameters x of the model.
/// `shapes` are the forms of the parts, `bvh` the hierarchy over the scan.
pub(in crate::variance) fn point_measures(
    model: &dyn Model,
    x: &[f64],
    deviations: &Deviations,
    shapes: &[Option<Recognised>],
    mesh: &TriangleMesh,
    bvh: &Bvh,
) -> Vec<PointMeasure> {
    if model.measures().iter().all(|m| m.parts.is_empty()) {
        return Vec::new();
    }
    let points = points_of_parts(deviations, shapes.len(), mesh, bvh);
    let exact = deviations.texels.samples_of_parts(EXACT_SAMPLES);
    let names: Vec<&str> = model.parts().iter().map(|p| p.name.as_str()).collect();
    let associated = |name: &String| -> Result<Associated, String> {
        let part = names.iter().position(|n| n == name).ok_or_else(|| format!("there is no part `{name}`"))?;
        let shape = shapes.get(part).and_then(Option::as_ref).and_then(Recognised::datum);
        let datum = shape.ok_or_else(|| format!("`{name}` is no plane, sphere, cylinder or cone"))?;
        let position = |i: &usize| DVec3::from(deviations.texels.position[*i]);
        let exact: Vec<DVec3> = exact[part].iter().map(position).collect();
        Associated::new(&points[part], &exact, datum).ok_or_else(|| format!("too little of `{name}` was measured"))
    };
    let declared = model.measures().iter().enumerate().filter(|(_, m)| !m.parts.is_empty());
    let measured = declared.map(|(k, m)| {
        let value = model.measure(k, x).map_err(|e| e.message);
        let parts: Result<Vec<Associated>, String> = m.parts.iter().map(associated).collect();
        let found = value.clone().and_then(|value| figure(&parts?, &m.unit, value));
        PointMeasure {
            name: m.name.clone(),
            unit: m.unit.clone(),
            parts: m.parts.clone(),
            figure: found.as_ref().ok().map(|f| f.name.to_owned()),
            model: value.unwrap_or(f64::NAN),
            value: found.as_ref().ok().map(|f| f.measured),
            uncertainty: found.as_ref().ok().map(|f| f.variance.max(0.0).sqrt()),
            reason: found.err(),
        }
    });
    measured.collect()
}

/// A part's surface of least squares.
struct Associated {
    /// That of the measured points, and the same of the model's own.
    measured: Datum,
    model: Datum,
    /// The middle of the points, measured and in the model.
    centres: [DVec3; 2],
    /// Covariance of the unknowns of `measured`.
    covariance: DMatrix<f64>,
}

impl Associated {
    /// From points of the scan and of the model's own surface.
    fn new(points: &[DVec3], exact: &[DVec3], datum: Datum) -> Option<Self> {
        if points.len() < FEWEST {
            return None;
        }
        let first = zone::least_squares(points, datum, zone::FITTED).placed();
        let mut sizes: Vec<f64> = points.iter().map(|p| first.height(*p).abs()).collect();
        let most = (OUTLYING * MAD_TO_SD * median(&mut sizes)?).max(ROUNDING);
        let kept: Vec<DVec3> = points.iter().copied().filter(|p| first.height(*p).abs() <= most).collect();
        let measured = zone::least_squares(&kept, datum, usize::MAX);
        let covariance = covariance(&kept, &measured)?;
        let model = zone::least_squares(exact, datum, zone::FITTED);
        let centre = |points: &[DVec3]| points.iter().sum::<DVec3>() / points.len() as f64;
        Some(Self { measured, model, centres: [centre(&kept), centre(exact)], covariance })
    }

    fn variance(&self, slopes: &[f64]) -> f64 {
        let g = DVector::from_iterator(self.covariance.nrows(), slopes.iter().copied());
        (g.transpose() * &self.covariance * g)[(0, 0)]
    }

    /// The derivatives of the surface's height at a point.
    fn height_slopes(&self, point: DVec3) -> [f64; MOST] {
        self.measured.placed().row(point).factors
    }

    /// The derivatives of the place of a sphere's centre, or of an axis at the height of a point, along a direction.
    fn place_slopes(&self, point: DVec3, direction: DVec3) -> [f64; MOST] {
        let (x, y) = self.measured.axis.any_orthonormal_pair();
        let (right, up) = (direction.dot(x), direction.dot(y));
        if self.measured.kind == Kind::Sphere {
            return [0.0, right, up, direction.dot(self.measured.axis), 0.0, 0.0];
        }
        let height = (point - self.measured.origin).dot(self.measured.axis);
        [0.0, right, up, height * right, height * up, 0.0]
    }

    /// The derivatives of the normal of a plane, or of an axis, along a direction at right angles to it.
    fn direction_slopes(&self, direction: DVec3) -> [f64; MOST] {
        let (x, y) = self.measured.axis.any_orthonormal_pair();
        let (right, up) = (direction.dot(x), direction.dot(y));
        match self.measured.kind {
            Kind::Plane => [0.0, -right, -up, 0.0, 0.0, 0.0],
            _ => [0.0, 0.0, 0.0, right, up, 0.0],
        }
    }
}

/// The covariance of the unknowns of least squares, with the variance of the points about the surface.
fn covariance(kept: &[DVec3], datum: &Datum) -> Option<DMatrix<f64>> {
    let (count, placed) = (datum.unknowns(), datum.placed());
    let mut normal = DMatrix::<f64>::zeros(count, count);
    let mut squares = 0.0;
    for point in kept {
        let row = placed.row(*point);
        let factors = DVector::from_row_slice(&row.factors[..count]);
        normal.ger(1.0, &factors, &factors, 1.0);
        squares += row.value * row.value;
    }
    let degrees = kept.len().checked_sub(count).filter(|n| *n > 0)?;
    Some(normal.try_inverse()? * (squares / degrees as f64))
}

/// The scan's points by part: those that are the nearest corner of a triangle that texels of one part see, and none of
/// another. Between points distances are interpolated, along chords of what is curved; the points themselves are not.
fn points_of_parts(deviations: &Deviations, parts: usize, mesh: &TriangleMesh, bvh: &Bvh) -> Vec<Vec<DVec3>> {
    const SEVERAL: u32 = u32::MAX;
    let texels = &deviations.texels;
    let step = texels.len().div_ceil(LOOKED_AT).max(1);
    let seen = |i: usize| {
        let along = f64::from(deviations.along(i));
        let met = DVec3::from(texels.position[i]) + along * DVec3::from(texels.normal[i].map(f64::from));
        let triangle = mesh.triangles.get(bvh.closest_point(met, deviations.max_distance)?.triangle as usize)?;
        let far = |vertex: &u32| DVec3::from(mesh.positions[*vertex as usize]).distance_squared(met);
        let nearest = triangle.iter().min_by(|a, b| far(a).total_cmp(&far(b)))?;
        Some((*nearest, texels.part[i]))
    };
    let indices: Vec<usize> = (0..texels.len()).step_by(step).filter(|i| !deviations.signed(*i).is_nan()).collect();
    let seen: Vec<(u32, u32)> = indices.into_par_iter().filter_map(seen).collect();
    let mut owners: HashMap<u32, u32> = HashMap::new();
    for (vertex, part) in seen {
        let owner = owners.entry(vertex).or_insert(part);
        if *owner != part {
            *owner = SEVERAL;
        }
    }
    let mut owned: Vec<(u32, u32)> = owners.into_iter().filter(|(_, part)| *part != SEVERAL).collect();
    // The order of sums must not be that of a hash.
    owned.sort_unstable();
    let mut points = vec![Vec::new(); parts];
    for (vertex, part) in owned {
        if let Some(points) = points.get_mut(part as usize) {
            points.push(DVec3::from(mesh.positions[vertex as usize]));
        }
    }
    points
}

/// A figure of parts.
struct Figure {
    name: &'static str,
    model: f64,
    measured: f64,
    variance: f64,
}

/// The figure of the parts' surfaces in this unit that the measure is, by its value in the model.
fn figure(parts: &[Associated], unit: &str, value: f64) -> Result<Figure, String> {
    let candidates = match (parts, unit) {
        ([part], "mm") => sizes(part),
        ([part], "rad") => opening_angles(part),
        ([a, b], "mm") => distances(a, b),
        ([a, b], "rad") => angles(a, b),
        _ => Vec::new(),
    };
    let Some(first) = candidates.first() else {
        return Err("parts of this form have no figure of this kind".to_owned());
    };
    let wrong = format!("the {} in the model is another: {}", first.name, shown(first.model, unit));
    let same = |figure: &Figure| (figure.model - value).abs() <= SAME * value.abs().max(1.0);
    candidates.into_iter().find(same).ok_or(wrong)
}

/// A value with its unit, angles in degrees.
fn shown(value: f64, unit: &str) -> String {
    if unit == "rad" { format!("{:.4} deg", value.to_degrees()) } else { format!("{value:.4} {unit}") }
}

fn sizes(part: &Associated) -> Vec<Figure> {
    if !matches!(part.measured.kind, Kind::Sphere | Kind::Cylinder) {
        return Vec::new();
    }
    let of = |name: &'static str, factor: f64| Figure {
        name,
        model: factor * part.model.size,
        measured: factor * part.measured.size,
        variance: factor * factor * part.covariance[(0, 0)],
    };
    vec![of("diameter", 2.0), of("radius", 1.0)]
}

fn opening_angles(part: &Associated) -> Vec<Figure> {
    if part.measured.kind != Kind::Cone {
        return Vec::new();
    }
    let of = |name: &'static str, factor: f64| Figure {
        name,
        model: factor * part.model.angle.abs(),
        measured: factor * part.measured.angle.abs(),
        variance: factor * factor * part.covariance[(5, 5)],
    };
    vec![of("opening angle", 2.0), of("half the opening angle", 1.0)]
}

/// Distances of parallel planes, of spheres, and of parallel axes.
fn distances(a: &Associated, b: &Associated) -> Vec<Figure> {
    let parallel = a.model.axis.dot(b.model.axis).abs() >= PARALLEL;
    match (a.measured.kind, b.measured.kind) {
        (Kind::Plane, Kind::Plane) if parallel => vec![of_planes(a, b)],
        (Kind::Sphere, Kind::Sphere) => vec![of_places(a, b, DVec3::ZERO)],
        (Kind::Cylinder | Kind::Cone, Kind::Cylinder | Kind::Cone) if parallel => {
            vec![of_places(a, b, (a.centres[0] + b.centres[0]) / 2.0)]
        }
        _ => Vec::new(),
    }
}

/// The mean of the heights of the middle of each over the other.
fn of_planes(a: &Associated, b: &Associated) -> Figure {
    let between = |a: &Datum, b: &Datum, [of_a, of_b]: [DVec3; 2]| {
        (a.placed().height(of_b).abs() + b.placed().height(of_a).abs()) / 2.0
    };
    let slopes = |part: &Associated| -> Vec<f64> {
        let [here, there] = [a, b].map(|other| part.height_slopes(other.centres[0]));
        here.iter().zip(there).map(|(here, there)| (here + there) / 2.0).take(3).collect()
    };
    Figure {
        name: "distance",
        model: between(&a.model, &b.model, [a.centres[1], b.centres[1]]),
        measured: between(&a.measured, &b.measured, [a.centres[0], b.centres[0]]),
        variance: a.variance(&slopes(a)) + b.variance(&slopes(b)),
    }
}

/// Between centres of spheres, or between axes at the height of a point.
fn of_places(a: &Associated, b: &Associated, point: DVec3) -> Figure {
    let place = |datum: &Datum| match datum.kind {
        Kind::Sphere => datum.origin,
        _ => datum.origin + (point - datum.origin).dot(datum.axis) * datum.axis,
    };
    let between = |a: &Datum, b: &Datum| place(b) - place(a);
    let found = between(&a.measured, &b.measured);
    let direction = found.normalize_or_zero();
    let variance = |part: &Associated| {
        let slopes = part.place_slopes(point, direction);
        part.variance(&slopes[..part.measured.unknowns()])
    };
    Figure {
        name: "distance",
        model: between(&a.model, &b.model).length(),
        measured: found.length(),
        variance: variance(a) + variance(b),
    }
}

/// Angles between planes and axes, with every convention of which side is meant.
fn angles(a: &Associated, b: &Associated) -> Vec<Figure> {
    if [a, b].iter().any(|part| part.measured.kind == Kind::Sphere) {
        return Vec::new();
    }
    let between = |a: &Datum, b: &Datum| a.axis.cross(b.axis).length().atan2(a.axis.dot(b.axis));
    let [model, measured] = [between(&a.model, &b.model), between(&a.measured, &b.measured)];
    let variance = |part: &Associated, other: &Associated| {
        let (own, to) = (part.measured.axis, other.measured.axis);
        let across = (to - own * own.dot(to)).try_normalize().unwrap_or_else(|| own.any_orthonormal_vector());
        let slopes = part.direction_slopes(across);
        part.variance(&slopes[..part.measured.unknowns()])
    };
    let variance = variance(a, b) + variance(b, a);
    let of = |convert: fn(f64) -> f64| Figure {
        name: "angle",
        model: convert(model),
        measured: convert(measured),
        variance,
    };
    vec![of(|angle| angle), of(|angle| PI - angle), of(|angle| FRAC_PI_2 - angle), of(|angle| angle - FRAC_PI_2)]
}

#[cfg(test)]
mod tests;
