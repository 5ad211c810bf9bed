//! Deviations of form: how flat, how round, how cylindrical a part is, wherever and however large it is.
//!
//! Which form a part has is seen from its exact surface ([`recognise`]). The measured points, each as far from its texel as the scan was
//! found to be, are then held against the form in the place and of the size that suits them best: the least squares one, and the
//! one that makes the zone as narrow as it can be (minimum zone, ISO 1101; Chebyshev's approximation).

mod chebyshev;
mod datum;
mod roundness;
mod shape;
#[cfg(test)]
mod tests;
mod zone;

pub use shape::{Recognised, Shape, recognise};

use super::Deviations;
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Fewer points than this say nothing about a form.
const FEWEST: usize = 50;

/// How far a part is from its form.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FormDeviation {
    /// Which form its surface has.
    pub shape: Shape,
    /// Its zone; none for general surfaces of revolution, which have only sections.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zone: Option<Zone>,
    /// Of surfaces about an axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roundness: Option<Roundness>,
}

/// Between which surfaces of one form the measured points lie.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Zone {
    /// What its width is called: flatness, cylindricity, conicity or sphericity.
    pub characteristic: String,
    /// Its width about the surface of least squares. Millimetres.
    pub least_squares: f64,
    /// Its width where it is narrowest. Millimetres.
    pub minimum_zone: f64,
    /// How many points these are of.
    pub points: usize,
    /// How many were left out as outlying: more than four robust standard deviations from the surface of least squares.
    pub outlying: usize,
    /// Both widths with those. Millimetres.
    pub with_outlying: [f64; 2],
}

/// How round a part's sections at right angles to its axis are; the worst of them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Roundness {
    /// Width of the ring about the circle of least squares, perpendicular to the surface (on a cylinder that is in the section's plane). Millimetres.
    pub least_squares: f64,
    /// Width of the narrowest ring, likewise. Millimetres.
    pub minimum_zone: f64,
    /// Both measured in the plane of that section (ISO 12181-1). Millimetres.
    pub in_plane: [f64; 2],
    /// Where the worst section is: a point of the axis, in the scan's coordinates. Millimetres.
    pub at: [f64; 3],
    /// How many sections had points all around.
    pub sections: usize,
    /// Median over the sections of the narrowest rings. Millimetres.
    pub median: f64,
}

/// The deviation of form of every part that has a form and enough points; `shapes` are the parts'.
#[must_use]
pub fn form_deviations(deviations: &Deviations, shapes: &[Option<Recognised>]) -> Vec<Option<FormDeviation>> {
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); shapes.len()];
    for (i, part) in deviations.texels.part.iter().enumerate() {
        let part = *part as usize;
        if shapes.get(part).is_some_and(Option::is_some) && !deviations.signed(i).is_nan() {
            members[part].push(i);
        }
    }
    let of_part = |(shape, members): (&Option<Recognised>, Vec<usize>)| {
        let shape = shape.as_ref()?;
        if members.len() < FEWEST {
            return None;
        }
        let points: Vec<DVec3> = members.iter().map(|i| measured(deviations, *i)).collect();
        let zone = shape.datum().and_then(|datum| zone::of(&points, datum, shape.shape));
        let roundness = shape.axis.and_then(|axis| roundness::of(deviations, &members, axis));
        Some(FormDeviation { shape: shape.shape, zone, roundness })
    };
    shapes.par_iter().zip(members).map(of_part).collect()
}

/// Where the scan was found from texel i.
fn measured(deviations: &Deviations, i: usize) -> DVec3 {
    let normal = DVec3::from(deviations.texels.normal[i].map(f64::from));
    DVec3::from(deviations.texels.position[i]) + f64::from(deviations.along(i)) * normal
}
