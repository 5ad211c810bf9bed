//! Roundness of sections at right angles to an axis.
//!
//! The deviation of a point is its distance perpendicular to the surface: ISO 1101 requires the direction to be stated
//! for surfaces that are neither cylinders nor spheres, and the scan's noise does not grow on a surface that is steep
//! to its axis. In the plane of the section, as ISO 12181-1 defines its profile, the same deviations are longer by one
//! over the cosine of the angle between normal and plane; both are computed.

use super::linear::{self, MOST, Row};
use super::{FEWEST, Roundness};
use crate::robust::{MAD_TO_SD, median, median_and_deviation};
use crate::variance::Deviations;
use glam::DVec3;
use std::f64::consts::TAU;

/// Sections along the axis.
const SECTIONS: usize = 24;

/// Sectors of a section, nearly all of which must contain points.
const SECTORS: usize = 36;
const SECTORS_NEEDED: usize = 33;

/// The least component of a unit normal away from the axis: a disc has no sections.
const STEEP: f64 = 0.3;

/// Outliers are this many robust standard deviations away from a section's circle.
const OUTLYING: f64 = 4.0;

/// ... and this many within the whole part, whose deviations contain the shift of its axis besides.
const OUTLYING_IN_PART: f64 = 8.0;

/// Cosine of the largest angle by which an averaged normal counts as the surface's own.
const UNTURNED: f32 = 0.9999;

/// A point of a section.
#[derive(Clone, Copy)]
struct Polar {
    /// The angle around the axis.
    angle: f64,
    /// Signed distance perpendicular to the model's surface. Millimetres.
    deviation: f64,
    /// The component of the model's normal away from the axis.
    outward: f64,
}

impl Polar {
    /// The equation perpendicular to the surface. A slightly shifted circle has the deviation a + b cos t + c sin t (a
    /// limacon: exact but for the square of the shift over twice the radius); b and c count with the normal's
    /// component.
    fn across(&self) -> Row {
        let (sin, cos) = self.angle.sin_cos();
        Row { factors: [1.0, self.outward * cos, self.outward * sin, 0.0, 0.0, 0.0], value: self.deviation }
    }

    /// The equation in the plane of the section.
    fn in_plane(&self) -> Row {
        let (sin, cos) = self.angle.sin_cos();
        Row { factors: [1.0, cos, sin, 0.0, 0.0, 0.0], value: self.deviation / self.outward }
    }
}

/// The roundness of texels with a distance, about an axis (a point and a unit direction).
pub(super) fn roundness(
    deviations: &Deviations,
    members: &[usize],
    (origin, axis): (DVec3, DVec3),
) -> Option<Roundness> {
    let texels = &deviations.texels;
    let height = |i: usize| (DVec3::from(texels.position[i]) - origin).dot(axis);
    let (low, high) = members.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), i| {
        let z = height(*i);
        (l.min(z), h.max(z))
    });
    if !(high > low) {
        return None;
    }
    let usual = usual(deviations, members)?;
    let (x, y) = axis.any_orthonormal_pair();
    let mut sections: Vec<Vec<Polar>> = vec![Vec::new(); SECTIONS];
    // Averaged normals are not the surface's.
    let unturned = |i: usize| deviations.cosine.get(i).is_none_or(|c| *c >= UNTURNED);
    let usual = |i: usize| usual.contains(&f64::from(deviations.signed(i)));
    for &i in members.iter().filter(|i| unturned(**i) && usual(**i)) {
        let across = (DVec3::from(texels.position[i]) - origin).reject_from_normalized(axis);
        let normal = DVec3::from(texels.normal[i].map(f64::from));
        let Some(outward) = across.try_normalize().map(|o| normal.dot(o)).filter(|o| o.abs() >= STEEP) else {
            continue;
        };
        let place = ((height(i) - low) / (high - low) * SECTIONS as f64) as usize;
        let (angle, deviation) = (across.dot(y).atan2(across.dot(x)), f64::from(deviations.signed(i)));
        sections[place.min(SECTIONS - 1)].push(Polar { angle, deviation, outward });
    }
    let rings: Vec<(usize, Rings)> = sections
        .iter()
        .enumerate()
        .filter_map(|(k, section)| Some((k, Rings::new(section, deviations.precision)?)))
        .collect();
    let (place, worst) = rings.iter().max_by(|a, b| a.1.across[1].total_cmp(&b.1.across[1]))?;
    let at = origin + axis * (low + (*place as f64 + 0.5) / SECTIONS as f64 * (high - low));
    let mut narrowest: Vec<f64> = rings.iter().map(|(_, rings)| rings.across[1]).collect();
    let median = median(&mut narrowest)?;
    let [least_squares, minimum_zone] = worst.across;
    Some(Roundness {
        least_squares,
        minimum_zone,
        in_plane: worst.in_plane,
        at: at.into(),
        sections: rings.len(),
        median,
    })
}

/// The range of deviations that are not outliers within the part.
fn usual(deviations: &Deviations, members: &[usize]) -> Option<std::ops::RangeInclusive<f64>> {
    let mut distances: Vec<f64> = members.iter().map(|i| f64::from(deviations.signed(*i))).collect();
    let (middle, spread) = median_and_deviation(&mut distances)?;
    let reach = (OUTLYING_IN_PART * MAD_TO_SD * spread).max(deviations.precision);
    Some(middle - reach..=middle + reach)
}

/// Widths of rings about the circle of least squares and about the best circle.
struct Rings {
    across: [f64; 2],
    in_plane: [f64; 2],
}

impl Rings {
    /// The rings of a section; none if it does not have points all around. Deviations up to `precision` are rounding.
    fn new(section: &[Polar], precision: f64) -> Option<Self> {
        let mut seen = [false; SECTORS];
        for point in section {
            seen[(((point.angle / TAU).rem_euclid(1.0)) * SECTORS as f64) as usize % SECTORS] = true;
        }
        if section.len() < FEWEST || seen.iter().filter(|s| **s).count() < SECTORS_NEEDED {
            return None;
        }
        let mut inliers = section.to_vec();
        for _ in 0..3 {
            let circle = linear::least_squares(inliers.iter().map(Polar::across), 3)?.0;
            let error = |point: &Polar| point.across().error(&circle).abs();
            let spread = median(&mut section.iter().map(error).collect::<Vec<f64>>())?;
            let limit = (OUTLYING * MAD_TO_SD * spread).max(precision);
            inliers = section.iter().filter(|point| error(point) <= limit).copied().collect();
            // If half of a section are outliers, it has no circle.
            if 2 * inliers.len() < section.len() {
                return None;
            }
        }
        let widths = |row: fn(&Polar) -> Row| {
            let rows: Vec<Row> = inliers.iter().map(row).collect();
            let least_squares = width(&rows, &linear::least_squares(rows.iter().copied(), 3)?.0);
            Some([least_squares, least_squares.min(width(&rows, &linear::chebyshev(&rows, 3)))])
        };
        Some(Self { across: widths(Polar::across)?, in_plane: widths(Polar::in_plane)? })
    }
}

/// The width of the ring about a circle that contains all rows.
fn width(rows: &[Row], circle: &[f64; MOST]) -> f64 {
    let errors = rows.iter().map(|r| r.error(circle));
    let (low, high) = errors.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), e| (l.min(e), h.max(e)));
    high - low
}
