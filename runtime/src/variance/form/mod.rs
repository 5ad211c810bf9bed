//! Deviations of form: flatness, roundness, cylindricity and so on, independent of position and size.
//!
//! The form of a part is recognised from its exact surface ([`recognise`]). The measured points (texels displaced by
//! their distances) are then compared with the form in the position and size that suit them best: by least squares, and
//! by the narrowest zone (minimum zone, ISO 1101; Chebyshev approximation).

mod datum;
mod linear;
mod roundness;
mod shape;
#[cfg(test)]
mod tests;
mod zone;

pub use shape::Shape;
pub(super) use shape::{Recognised, recognise};

use super::Deviations;
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// The smallest number of points for a form.
const FEWEST: usize = 50;

/// The deviation of a part from its form.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FormDeviation {
    /// The form of its surface.
    pub shape: Shape,
    /// Its zone; none for general surfaces of revolution, which only have sections.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zone: Option<Zone>,
    /// The roundness of surfaces about an axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roundness: Option<Roundness>,
}

/// The zone between two surfaces of one form that contains the measured points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Zone {
    /// Name of its width: flatness, cylindricity, conicity or sphericity.
    pub characteristic: String,
    /// Its width about the surface of least squares. Millimetres.
    pub least_squares: f64,
    /// Width of the narrowest zone. Millimetres.
    pub minimum_zone: f64,
    /// Number of points.
    pub points: usize,
    /// Number of outliers that are left out: more than four robust standard deviations from the surface of least
    /// squares.
    pub outlying: usize,
    /// Both widths with the outliers. Millimetres.
    pub with_outlying: [f64; 2],
}

/// Roundness of the sections at right angles to a part's axis: the worst of them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Roundness {
    /// Width of the ring about the circle of least squares, perpendicular to the surface (on a cylinder, in the
    /// section's plane). Millimetres.
    pub least_squares: f64,
    /// Width of the narrowest ring, perpendicular to the surface. Millimetres.
    pub minimum_zone: f64,
    /// Both widths in the plane of that section (ISO 12181-1). Millimetres.
    pub in_plane: [f64; 2],
    /// Position of the worst section: a point of the axis, in the scan's coordinates. Millimetres.
    pub at: [f64; 3],
    /// Number of sections with points all around.
    pub sections: usize,
    /// Median over the sections of the narrowest ring's width. Millimetres.
    pub median: f64,
}

/// The deviations of form of the parts that have a form and enough points. `shapes` are the parts' forms.
#[must_use]
pub(in crate::variance) fn form_deviations(
    deviations: &Deviations,
    shapes: &[Option<Recognised>],
) -> Vec<Option<FormDeviation>> {
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
        let zone = shape.datum().and_then(|datum| zone::zone(&points, datum, shape.shape, deviations.precision));
        let roundness = shape.axis.and_then(|axis| roundness::roundness(deviations, &members, axis));
        Some(FormDeviation { shape: shape.shape, zone, roundness })
    };
    shapes.par_iter().zip(members).map(of_part).collect()
}

/// The point of the scan that the ray of texel i meets.
fn measured(deviations: &Deviations, i: usize) -> DVec3 {
    let normal = DVec3::from(deviations.texels.normal[i].map(f64::from));
    DVec3::from(deviations.texels.position[i]) + f64::from(deviations.along(i)) * normal
}
