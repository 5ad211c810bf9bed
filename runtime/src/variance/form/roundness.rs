//! Sections at right angles to an axis.

use super::chebyshev::{self, Row};
use super::{FEWEST, Roundness};
use crate::robust::{MAD_TO_SD, median, median_and_deviation};
use crate::variance::Deviations;
use glam::DVec3;
use std::f64::consts::TAU;

/// Sections along the axis.
const SECTIONS: usize = 24;

/// Sectors of a section, of which nearly all must hold points.
const SECTORS: usize = 36;
const SECTORS_NEEDED: usize = 33;

/// Normals must have at least this much of their length away from the axis: a disc has no sections.
const STEEP: f64 = 0.3;

/// Deviations further from a section's circle than so many robust standard deviations are outlying.
const OUTLYING: f64 = 4.0;

/// ... and within the whole part, the shift of whose axis they contain besides.
const OUTLYING_IN_PART: f64 = 8.0;

/// A point of a section: the angle around the axis, and how far outside of the model's circle.
type Polar = (f64, f64);

/// Of texels with a distance, about an axis: a point and a unit direction.
pub(super) fn of(deviations: &Deviations, members: &[usize], (origin, axis): (DVec3, DVec3)) -> Option<Roundness> {
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
    for &i in members.iter().filter(|i| usual.contains(&f64::from(deviations.signed(**i)))) {
        let across = (DVec3::from(texels.position[i]) - origin).reject_from_normalized(axis);
        let normal = DVec3::from(texels.normal[i].map(f64::from));
        let Some(outward) = across.try_normalize().map(|o| normal.dot(o)).filter(|o| o.abs() >= STEEP) else {
            continue;
        };
        let place = ((height(i) - low) / (high - low) * SECTIONS as f64) as usize;
        let deviation = f64::from(deviations.signed(i)) / outward;
        sections[place.min(SECTIONS - 1)].push((across.dot(y).atan2(across.dot(x)), deviation));
    }
    let found: Vec<(usize, [f64; 2])> =
        sections.iter().enumerate().filter_map(|(k, section)| Some((k, rings(section)?))).collect();
    let (worst, [least_squares, minimum_zone]) = *found.iter().max_by(|a, b| a.1[1].total_cmp(&b.1[1]))?;
    let at = origin + axis * (low + (worst as f64 + 0.5) / SECTIONS as f64 * (high - low));
    let mut narrowest: Vec<f64> = found.iter().map(|(_, widths)| widths[1]).collect();
    let median = median(&mut narrowest)?;
    Some(Roundness { least_squares, minimum_zone, at: at.into(), sections: found.len(), median })
}

/// Deviations that are not outlying within the part.
fn usual(deviations: &Deviations, members: &[usize]) -> Option<std::ops::RangeInclusive<f64>> {
    let mut distances: Vec<f64> = members.iter().map(|i| f64::from(deviations.signed(*i))).collect();
    let (middle, spread) = median_and_deviation(&mut distances)?;
    let reach = OUTLYING_IN_PART * MAD_TO_SD * spread;
    Some(middle - reach..=middle + reach)
}

/// The widths of the rings about the circle of least squares and about the best circle; none where the section has not points all
/// around. A circle that is shifted a little has the deviation a + b cos t + c sin t (a limacon: exact but for the square of the shift over
/// twice the radius).
fn rings(section: &[Polar]) -> Option<[f64; 2]> {
    let mut seen = [false; SECTORS];
    for (angle, _) in section {
        seen[(((angle / TAU).rem_euclid(1.0)) * SECTORS as f64) as usize % SECTORS] = true;
    }
    if section.len() < FEWEST || seen.iter().filter(|s| **s).count() < SECTORS_NEEDED {
        return None;
    }
    let row = |(angle, deviation): &Polar| {
        let (sin, cos) = angle.sin_cos();
        Row { factors: [1.0, cos, sin, 0.0, 0.0, 0.0], value: *deviation }
    };
    let all: Vec<Row> = section.iter().map(row).collect();
    let mut kept = all.clone();
    for _ in 0..3 {
        let circle = least_squares(&kept)?;
        let mut errors: Vec<f64> = all.iter().map(|r| r.error(&circle).abs()).collect();
        let limit = OUTLYING * MAD_TO_SD * median(&mut errors)?;
        kept = all.iter().filter(|r| r.error(&circle).abs() <= limit).copied().collect();
        // Where half of a section is something else there is no saying what is round.
        if 2 * kept.len() < all.len() {
            return None;
        }
    }
    let circle = least_squares(&kept)?;
    let best = chebyshev::solve(&kept, 3);
    let widths = [width(&kept, &circle), width(&kept, &[best[0], best[1], best[2]])];
    Some([widths[0], widths[0].min(widths[1])])
}

fn least_squares(rows: &[Row]) -> Option<[f64; 3]> {
    let (mut normal, mut right) = (glam::DMat3::ZERO, DVec3::ZERO);
    for row in rows {
        let f = DVec3::new(row.factors[0], row.factors[1], row.factors[2]);
        normal += glam::DMat3::from_cols(f * f.x, f * f.y, f * f.z);
        right += f * row.value;
    }
    let found = (normal.determinant() > 0.0).then(|| normal.inverse() * right)?;
    found.is_finite().then(|| found.to_array())
}

fn width(rows: &[Row], circle: &[f64; 3]) -> f64 {
    let errors = rows.iter().map(|r| r.error(circle));
    let (low, high) = errors.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), e| (l.min(e), h.max(e)));
    high - low
}
