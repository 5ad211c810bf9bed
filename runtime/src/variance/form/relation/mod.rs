//! How parts lie to one of them, the datum: coaxiality, concentricity, parallelism and perpendicularity (ISO 1101) of
//! the surfaces of least squares of the measured points.

mod characteristic;
mod correction;
#[cfg(test)]
mod tests;

use super::associated::Associated;
use super::datum::Datum;
use super::members::Members;
use super::{Shape, WithoutNoise, revolved};
use characteristic::{Characteristic, Extent};
use correction::Noise;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// The datum, and how the other parts lie to it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DatumRelations {
    /// The part that is the datum.
    pub part: String,
    /// Its form.
    pub shape: Shape,
    /// A point of the datum: of its axis or plane, or the centre of a sphere, in the scan's coordinates. Millimetres.
    pub at: [f64; 3],
    /// The direction of its axis, or the normal of a plane; none of a sphere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f64; 3]>,
    /// The characteristics of the other parts, in the model's order.
    pub relations: Vec<Relation>,
    /// The parts that have a form but too few points, in the model's order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unmeasured: Vec<String>,
}

/// How a part lies to the datum.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Relation {
    /// The part.
    pub part: String,
    /// `coaxiality`, `concentricity`, `parallelism` or `perpendicularity`.
    pub characteristic: String,
    /// The width that the model itself has. Millimetres.
    pub model: f64,
    /// The width or diameter of the zone. Millimetres.
    pub value: f64,
    /// That without what noise adds.
    #[serde(flatten)]
    pub without_noise: WithoutNoise,
    /// The place of the part that is the farthest from where the datum asks for it: an end of its axis, its centre, or
    /// a point of its plane, in the scan's coordinates. Millimetres.
    pub place: [f64; 3],
}

/// Why a part cannot be a datum: a sentence, if it cannot. `shapes` are the forms of the parts.
pub(in crate::variance) fn unfit(name: &str, names: &[String], has_form: impl Fn(usize) -> bool) -> Option<String> {
    match names.iter().position(|n| n == name) {
        Some(part) if has_form(part) => None,
        Some(_) => Some(format!("`{name}` is no plane, sphere, cylinder, cone or other surface of revolution")),
        None => Some(unknown(name, names)),
    }
}

/// Names that are listed where one is not known.
const LISTED: usize = 10;

fn unknown(name: &str, names: &[String]) -> String {
    if let Some(nearest) = gml_compiler::suggest::nearest(name, names.iter().map(String::as_str)) {
        return format!("there is no part `{name}`; `{nearest}` is similar");
    }
    let listed: Vec<String> = names.iter().take(LISTED).map(|n| format!("`{n}`")).collect();
    let more = if names.len() > LISTED { ", ..." } else { "" };
    format!("there is no part `{name}`; the parts are {}{more}", listed.join(", "))
}

/// How the other parts lie to the part of a name; none where too little of that was measured.
pub(in crate::variance) fn relations(members: &Members<'_>, name: &str) -> Option<DatumRelations> {
    let names = members.names();
    let number = names.iter().position(|n| n == name)?;
    let datum = surface(members, number)?;
    let (mut relations, mut unmeasured) = (Vec::new(), Vec::new());
    for part in (0..names.len()).filter(|part| *part != number && members.shape(*part).is_some()) {
        match surface(members, part) {
            Some(surface) => {
                let points: Vec<DVec3> = members.reach(part).collect();
                relations.extend(of_part((part, &names[part]), &datum, &surface, &points));
            }
            None => unmeasured.push(names[part].clone()),
        }
    }
    let Datum { origin, axis, .. } = datum.measured;
    let shape = members.shape(number)?.shape;
    let direction = (shape != Shape::Sphere).then_some(axis.into());
    Some(DatumRelations { part: name.to_owned(), shape, at: origin.into(), direction, relations, unmeasured })
}

/// The surface of least squares of a part's points.
fn surface(members: &Members<'_>, part: usize) -> Option<Associated> {
    match members.datum(part) {
        Some(datum) => Associated::new(&members.points(part), &members.exact(part), datum),
        None => revolved::associated(members.of(part), members.shape(part)?.axis?),
    }
}

/// The characteristics of a part, of a number and a name, whose surface in the model has these points.
fn of_part((number, name): (usize, &str), datum: &Associated, part: &Associated, points: &[DVec3]) -> Vec<Relation> {
    let extent = |of: &Datum| Extent::of(of, points.iter().copied());
    let there = extent(&part.model);
    let here = match there {
        // The rim of a leaning cylinder reaches farther along its axis than the axis does.
        Extent::Axis(ends) => {
            let at = |end: f64| part.model.origin + end * part.model.axis;
            Extent::of(&part.measured, ends.map(at).into_iter())
        }
        _ => extent(&part.measured),
    };
    let noise = Noise::new([datum, part], number as u64);
    let relation = |characteristic: Characteristic| {
        let vectors = characteristic.vectors(&datum.measured, &part.measured, &here);
        let found = characteristic.size(&vectors, &here);
        let errors = noise.errors(|datum, part| characteristic.vectors(datum, part, &here));
        let size = |vectors: &[DVec3]| characteristic.size(vectors, &here).width;
        let in_model = characteristic.vectors(&datum.model, &part.model, &there);
        Relation {
            part: name.to_owned(),
            characteristic: characteristic.name.to_owned(),
            model: characteristic.size(&in_model, &there).width,
            value: found.width,
            without_noise: correction::corrected(&vectors, &errors, size),
            place: characteristic.place(found, &datum.measured, &part.measured, &here).into(),
        }
    };
    Characteristic::between(&datum.model, &part.model, &there).into_iter().map(relation).collect()
}
