//! The angle between plane parts, and its derivatives.

use super::{Taken, largest_triangle, motions, triangles_of};
use crate::model::{Instance, Model, Tessellation};
use glam::DVec3;

/// The largest sine of the angle between a part's normals for which it is plane.
const PLANE: f64 = 1e-6;
/// The least sine of an angle that has derivatives: where faces are parallel it has a corner.
const PARALLEL: f64 = 1e-9;

/// A plane part.
struct Face {
    /// The unit normal, outwards.
    normal: DVec3,
    /// Its derivative by every parameter.
    slopes: Vec<DVec3>,
}

/// The angle between the outward normals of two parts, and its derivatives by every parameter, or why there are none.
///
/// # Errors
/// A sentence on why it has no value: nothing is left of a part, or it is not plane.
pub(super) fn between(
    model: &dyn Model,
    instance: &dyn Instance,
    fine: &Tessellation,
    parts: [&[usize]; 2],
) -> Result<Taken, String> {
    let [a, b] = parts.map(|part| face(model, instance, fine, part));
    let (a, b) = (a?, b?);
    let (cosine, across) = (a.normal.dot(b.normal), a.normal.cross(b.normal));
    let sine = across.length();
    let slopes =
        || a.slopes.iter().zip(&b.slopes).map(|(by_a, by_b)| -(by_a.dot(b.normal) + by_b.dot(a.normal)) / sine);
    let slopes = if sine > PARALLEL {
        Ok(slopes().collect())
    } else {
        Err("its parts are parallel, where the angle has a corner".to_owned())
    };
    Ok((sine.atan2(cosine), slopes))
}

/// The face that one part is.
fn face(model: &dyn Model, instance: &dyn Instance, fine: &Tessellation, part: &[usize]) -> Result<Face, String> {
    let name = |patch: &usize| model.parts()[*patch].name.clone();
    let &[patch] = part else {
        let names: Vec<String> = part.iter().take(2).map(name).collect();
        return Err(format!("an angle is between two parts, but {} are several on one side", names.join(", ")));
    };
    let Some(corners) = largest_triangle(fine, patch) else {
        return Err(format!("nothing is left of '{}'", name(&patch)));
    };
    let normal_of = |i: u32| DVec3::from_array(fine.mesh.normals[i as usize]);
    let normal = normal_of(corners[0]);
    if triangles_of(fine, patch).iter().flatten().any(|i| normal_of(*i).cross(normal).length() > PLANE) {
        return Err(format!("'{}' is not plane", name(&patch)));
    }
    let active = &model.parts()[patch].active;
    let moved = |corner: usize| {
        let origin = &fine.origins[corners[corner] as usize];
        motions(instance, patch, active.len(), [origin.u, origin.v]).map_err(|error| error.message)
    };
    let (p, q, r) = (moved(0)?, moved(1)?, moved(2)?);
    let [at_p, at_q, at_r] = fine.mesh.corners(corners);
    let (first, second) = (at_q - at_p, at_r - at_p);
    let length = first.cross(second).length();
    let sign = first.cross(second).dot(normal).signum();
    let slope = |k: usize| {
        let turned = sign / length * ((q[k] - p[k]).cross(second) + first.cross(r[k] - p[k]));
        turned - normal * turned.dot(normal)
    };
    let mut slopes = vec![DVec3::ZERO; model.parameters().len()];
    active.iter().enumerate().for_each(|(k, parameter)| slopes[*parameter as usize] = slope(k));
    Ok(Face { normal, slopes })
}
