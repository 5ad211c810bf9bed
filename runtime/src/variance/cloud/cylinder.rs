//! The distance at a texel, of the points in a cylinder about its normal.

use super::{Cloud, SAME_FACE};
use crate::model::Texels;
use crate::robust::{MAD_TO_SD, median};
use crate::variance::{Deviations, DistanceKind};
use glam::{DVec2, DVec3};
use nalgebra::{Cholesky, Matrix3, Vector3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Radius of a cylinder in spacings of the points: 15 are in it, and 7 at a border. With weights that fall to nothing
/// at its rim the noise of a distance is 0.3 of that of a point.
const RADIUS: f64 = 2.2;

/// The fewest points that have a distance: a plane takes three of them, and as many say how far they scatter.
pub(super) const FEWEST: usize = 6;

/// Nothing was measured where the nearest point is farther aside than so many spacings: of points spread by chance one
/// place in 3,000 is.
const GAP: f64 = 1.6;

/// Points all about a place leave no gap of half a turn between their directions.
const ALL_ABOUT: f64 = PI;

/// Cosine of the largest angle of surface that shows that a place at an edge was scanned on all sides.
const NOT_OPPOSITE: f64 = -0.5;

/// Heights that are farther apart than so many standard deviations of the noise, and so many spacings, belong to two
/// sheets, one above the other.
const APART_NOISE: f64 = 6.0;
const APART_SPACING: f64 = 1.5;

/// Points that are so many robust standard deviations from the plane are left out, in so many rounds at most.
const OUTLYING: f64 = 4.0;
const ROUNDS: usize = 3;

/// The noise of all points counts as much as so many of a cylinder's own where these say how far they scatter: of six
/// points alone the scatter is known to a third only.
const PRIOR: f64 = 4.0;

/// What a distance stands on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found<T> {
    /// Signed height of the scan over the model, perpendicular to it. Millimetres.
    pub(super) height: f64,
    /// Its standard uncertainty by the scatter of the points. Millimetres.
    pub(super) uncertainty: f64,
    /// Tangent of the angle between the scan and the model.
    pub(super) slope: f64,
    /// The number of points.
    pub(super) points: usize,
    /// What is made of them.
    pub(super) tint: T,
}

/// The sheets nearest to a texel, outside and inside of the model, and the radius of the cylinder. Millimetres.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sheets<T> {
    pub(super) outward: Option<Found<T>>,
    pub(super) inward: Option<Found<T>>,
    pub(super) radius: f64,
}

impl<T: Copy> Sheets<T> {
    /// The nearer of the two.
    fn nearest(&self) -> Option<Found<T>> {
        [self.outward, self.inward].into_iter().flatten().min_by(|a, b| a.height.abs().total_cmp(&b.height.abs()))
    }
}

/// A point in a cylinder.
#[derive(Clone, Copy, Debug)]
pub(in crate::variance) struct Sample {
    /// Where it is across the normal, in units of the cylinder's radius.
    pub(super) at: DVec2,
    /// Millimetres.
    pub(super) height: f64,
    /// Index of the scan's point.
    pub(in crate::variance) point: u32,
}

impl Sample {
    /// Its weight in the plane through all points: from 1 at the axis to 0 at the rim.
    pub(in crate::variance) fn weight(&self) -> f64 {
        (1.0 - self.at.length_squared()).max(0.0)
    }
}

/// What was found in the cylinders of all texels.
pub(in crate::variance) struct Cylinders<T> {
    pub(in crate::variance) deviations: Deviations,
    /// Radii, and numbers of points, of the cylinders that have a distance. Millimetres.
    pub(in crate::variance) radii: Vec<f64>,
    pub(in crate::variance) points: Vec<f64>,
    /// By texel, what was made of the points that its distance is from; the default where it has none.
    pub(in crate::variance) tints: Vec<T>,
}

impl<T> Cylinders<T> {
    /// The distances, and apart from them what was made of the points.
    pub(in crate::variance) fn without_tints(self) -> (Cylinders<()>, Vec<T>) {
        let Self { deviations, radii, points, tints } = self;
        (Cylinders { deviations, radii, points, tints: Vec::new() }, tints)
    }
}

/// Distances from texels to a cloud, along their normals, or to the nearest points of the planes through the cylinders'
/// points. `cosine` has the cosines of the angles by which averaged normals turned; `noise` is the standard deviation
/// of the points along the normals, in millimetres. `tint` makes something of the points of a distance.
pub(in crate::variance) fn cylinders<T: Copy + Default + Send + Sync>(
    texels: Texels,
    cloud: &Cloud<'_>,
    kind: DistanceKind,
    cosine: Vec<f32>,
    [max_distance, noise]: [f64; 2],
    tint: &(impl Fn(&[Sample]) -> T + Sync),
) -> Cylinders<T> {
    let of_texel = |i: usize| {
        let turned = f64::from(cosine.get(i).copied().unwrap_or(1.0));
        let normal = DVec3::from(texels.normal[i].map(f64::from)).try_normalize();
        let place = DVec3::from(texels.position[i]);
        let sheets =
            normal.filter(|_| place.is_finite()).map(|normal| cloud.sheets(place, normal, [turned, noise], tint));
        (sheets.unwrap_or_default(), turned)
    };
    let sheets: Vec<(Sheets<T>, f64)> = (0..texels.len()).into_par_iter().map(of_texel).collect();
    let distance = |found: Option<Found<T>>, turned: f64| {
        let Some(Found { height, slope, .. }) = found else { return f32::NAN };
        let distance = match kind {
            DistanceKind::Normal => height.abs(),
            DistanceKind::AveragedNormal => height.abs() / turned,
            DistanceKind::Closest => height.abs() / slope.hypot(1.0),
        };
        if distance <= max_distance { distance as f32 } else { f32::NAN }
    };
    let outward: Vec<f32> = sheets.iter().map(|(sheets, turned)| distance(sheets.outward, *turned)).collect();
    let inward: Vec<f32> = sheets.iter().map(|(sheets, turned)| distance(sheets.inward, *turned)).collect();
    let nearest: Vec<Option<Found<T>>> = sheets.iter().map(|(sheets, _)| sheets.nearest()).collect();
    let uncertainty: Vec<f32> = nearest.iter().map(|f| f.map_or(f32::NAN, |f| f.uncertainty as f32)).collect();
    let radii = sheets.iter().zip(&nearest).filter(|(_, found)| found.is_some()).map(|((s, _), _)| s.radius).collect();
    let points = nearest.iter().flatten().map(|found| found.points as f64).collect();
    let tints = nearest.iter().map(|found| found.map_or_else(T::default, |found| found.tint)).collect();
    let precision = max_distance * f64::from(f32::EPSILON);
    let deviations =
        Deviations { uncertainty, cosine, precision, ..Deviations::new(texels, max_distance, outward, inward) };
    Cylinders { deviations, radii, points, tints }
}

impl Cloud<'_> {
    /// What of the cloud is over and under a place with an outward normal. `turned` is the cosine of the angle between
    /// this and the surface's own. Millimetres.
    fn sheets<T: Copy + Default>(
        &self,
        place: DVec3,
        normal: DVec3,
        [turned, noise]: [f64; 2],
        tint: &impl Fn(&[Sample]) -> T,
    ) -> Sheets<T> {
        // Cosine of the sum of the two angles.
        let limit = match turned < 1.0 {
            true => SAME_FACE * turned - ((1.0 - SAME_FACE * SAME_FACE) * (1.0 - turned * turned)).max(0.0).sqrt(),
            false => SAME_FACE,
        };
        let Some(spacing) = self.spacing(place, normal, limit) else { return Sheets::default() };
        let radius = RADIUS * spacing;
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let (mut samples, mut directions): (Vec<Sample>, Vec<f64>) = (Vec::new(), Vec::new());
        self.tree.within(place.into(), radius, &mut |k| {
            let k = k as usize;
            let along = self.feet.normals[k].dot(normal);
            let offset = DVec3::from(self.feet.places[k]) - place;
            let at = DVec2::new(offset.dot(tangent), offset.dot(bitangent)) / radius;
            if along > NOT_OPPOSITE {
                directions.push(at.y.atan2(at.x));
            }
            if along >= limit {
                samples.push(Sample { at, height: self.feet.heights[k], point: self.feet.points[k] });
            }
        });
        if samples.len() < FEWEST || largest_gap(&mut directions) >= ALL_ABOUT {
            return Sheets { radius, ..Sheets::default() };
        }
        samples.sort_by(|a, b| a.height.total_cmp(&b.height));
        let apart = (APART_NOISE * noise).max(APART_SPACING * spacing);
        let mut sheets = Sheets { radius, ..Sheets::default() };
        for sheet in samples.chunk_by(|a, b| b.height - a.height <= apart) {
            let nearest = sheet.iter().map(|s| s.at.length()).fold(f64::INFINITY, f64::min);
            let Some(found) = plane_at_axis(sheet, noise, tint).filter(|_| nearest * radius <= GAP * spacing) else {
                continue;
            };
            match found.height >= 0.0 {
                true if sheets.outward.is_none() => sheets.outward = Some(found),
                // Sheets come from below.
                false => sheets.inward = Some(found),
                true => {}
            }
        }
        sheets.outward.iter_mut().chain(&mut sheets.inward).for_each(|found| found.slope /= radius);
        sheets
    }
}

/// The largest angle between neighbouring directions, which are angles; a whole turn of fewer than two.
fn largest_gap(directions: &mut [f64]) -> f64 {
    directions.sort_by(f64::total_cmp);
    let (Some(first), Some(last)) = (directions.first(), directions.last()) else { return 2.0 * PI };
    directions.windows(2).map(|pair| pair[1] - pair[0]).fold(2.0 * PI + first - last, f64::max)
}

/// The height at the axis of the plane that fits points best, with weights that fall from 1 at the axis to 0 at the
/// rim, outliers left out; its slope is in millimetres a radius. None where points are too few, or on one side so that
/// the height is less certain than that of a single point. `tint` makes something of those that are not left out.
pub(super) fn plane_at_axis<T>(samples: &[Sample], noise: f64, tint: &impl Fn(&[Sample]) -> T) -> Option<Found<T>> {
    let mut kept: Vec<Sample> = samples.to_vec();
    for round in 0.. {
        if kept.len() < FEWEST {
            return None;
        }
        let weights: Vec<f64> = kept.iter().map(Sample::weight).collect();
        let (mut matrix, mut squared, mut right) = (Matrix3::zeros(), Matrix3::zeros(), Vector3::zeros());
        for (sample, w) in kept.iter().zip(&weights) {
            let row = Vector3::new(1.0, sample.at.x, sample.at.y);
            let product = row * row.transpose();
            matrix += *w * product;
            squared += w * w * product;
            right += *w * sample.height * row;
        }
        let inverse = Cholesky::new(matrix)?.inverse();
        let plane = inverse * right;
        let residuals: Vec<f64> =
            kept.iter().map(|s| s.height - plane.dot(&Vector3::new(1.0, s.at.x, s.at.y))).collect();
        let freedom = kept.len() as f64 - 3.0;
        let scale = MAD_TO_SD * median(&mut residuals.iter().map(|r| r.abs()).collect::<Vec<f64>>())?;
        let limit = OUTLYING * (scale * (kept.len() as f64 / freedom).sqrt()).max(0.5 * noise);
        let count = kept.len();
        let mut inliers = residuals.iter().map(|r| r.abs() <= limit);
        kept.retain(|_| inliers.next().unwrap_or(true));
        if kept.len() < count && round < ROUNDS {
            continue;
        }
        // The share of the variance of a point that the height has: the covariance of the plane is that of weighted
        // sums of independent points of equal noise.
        let spread = inverse * squared;
        let leverage = (spread * inverse)[(0, 0)];
        let total: f64 = weights.iter().sum();
        let squares: f64 = weights.iter().zip(&residuals).map(|(w, r)| w * r * r).sum();
        let own = squares / (total - spread.trace()).max(f64::MIN_POSITIVE);
        let variance = (PRIOR * noise * noise + freedom * own) / (PRIOR + freedom);
        let uncertainty = (leverage * variance).sqrt();
        let is_sound = leverage < 1.0 && plane[0].is_finite() && uncertainty.is_finite();
        let slope = plane[1].hypot(plane[2]);
        return is_sound.then(|| Found { height: plane[0], uncertainty, slope, points: count, tint: tint(&kept) });
    }
    None
}
