//! Measures that parts show by their measured points: diameters, distances and angles of the surfaces of least squares.

use super::associated::Associated;
use super::datum::{Datum, Kind};
use super::members::Members;
use crate::figures::measured;
use crate::model::Model;
use crate::variance::moments::null_as_nan;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI};

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
pub(in crate::variance) fn point_measures(model: &dyn Model, x: &[f64], members: &Members<'_>) -> Vec<PointMeasure> {
    let names: Vec<&str> = model.parts().iter().map(|p| p.name.as_str()).collect();
    let associated = |name: &String| -> Result<Associated, String> {
        let part = names.iter().position(|n| n == name).ok_or_else(|| format!("there is no part `{name}`"))?;
        let datum = members.datum(part).ok_or_else(|| format!("`{name}` is no plane, sphere, cylinder or cone"))?;
        Associated::new(&members.points(part), &members.exact(part), datum)
            .ok_or_else(|| format!("too little of `{name}` was measured"))
    };
    if model.measures().iter().all(|m| m.parts.is_empty()) {
        return Vec::new();
    }
    let declared = model.measures().iter().zip(measured(model, x)).filter(|(m, _)| !m.parts.is_empty());
    let measured = declared.map(|(m, measured)| {
        let value = measured.map(|measured| measured.value).map_err(|e| e.message);
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
