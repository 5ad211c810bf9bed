//! Recognition of the form of a surface.

use super::datum::Datum;
use crate::eigen;
use crate::model::Texels;
use glam::DVec3;
use nalgebra::{Matrix6, Vector6};
use serde::{Deserialize, Serialize};

/// Sampled texels per part.
const SAMPLES: usize = 500;

/// Tolerance of normals, and of lengths relative to the part's size (root mean square): single precision of the normals
/// is 1e-7.
const EXACT: f64 = 1e-5;

/// A form of surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Shape {
    /// A plane.
    Plane,
    /// A sphere.
    Sphere,
    /// A circular cylinder.
    Cylinder,
    /// A circular cone.
    Cone,
    /// Any other surface of revolution.
    Revolution,
}

/// A form with its position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::variance) struct Recognised {
    /// The form.
    pub(in crate::variance) shape: Shape,
    /// A point and the unit direction of its axis; none for a plane or a sphere.
    pub(in crate::variance) axis: Option<(DVec3, DVec3)>,
    datum: Datum,
}

impl Recognised {
    /// The start of the fit to measured points; none for general surfaces of revolution.
    pub(super) fn datum(&self) -> Option<Datum> {
        (self.shape != Shape::Revolution).then_some(self.datum)
    }

    /// The same form where a surface of it is.
    pub(super) fn at(&self, datum: Datum) -> Self {
        Self { axis: self.axis.map(|_| (datum.origin, datum.axis)), datum, ..*self }
    }
}

/// The form of every part, from positions and exact normals of some of its texels; none if it is not one of [`Shape`].
#[must_use]
pub(in crate::variance) fn recognise(texels: &Texels) -> Vec<Option<Recognised>> {
    texels.samples_of_parts(SAMPLES).iter().map(|sample| of_sample(texels, sample)).collect()
}

/// Positions about their centre, in units of the part's size, and normals.
struct Sample {
    center: DVec3,
    size: f64,
    points: Vec<DVec3>,
    normals: Vec<DVec3>,
}

fn of_sample(texels: &Texels, sample: &[usize]) -> Option<Recognised> {
    let positions: Vec<DVec3> = sample.iter().map(|i| DVec3::from(texels.position[*i])).collect();
    if positions.len() < 20 {
        return None;
    }
    let center = positions.iter().sum::<DVec3>() / positions.len() as f64;
    let size = positions.iter().map(|p| p.distance(center)).fold(0.0, f64::max);
    if !(size > 0.0 && size.is_finite()) {
        return None;
    }
    let points = positions.iter().map(|p| (*p - center) / size).collect();
    let normals = sample.iter().map(|i| DVec3::from(texels.normal[*i].map(f64::from))).collect();
    let sample = Sample { center, size, points, normals };
    sample.plane().or_else(|| sample.sphere()).or_else(|| sample.about_an_axis())
}

impl Sample {
    /// Root mean square over the sample.
    fn rms(&self, f: impl Fn(DVec3, DVec3) -> f64) -> f64 {
        let squares: f64 = self.points.iter().zip(&self.normals).map(|(p, n)| f(*p, *n).powi(2)).sum();
        (squares / self.points.len() as f64).sqrt()
    }

    fn plane(&self) -> Option<Recognised> {
        let mean = self.normals.iter().sum::<DVec3>().try_normalize()?;
        let flat = self.rms(|_, n| n.distance(mean)) < EXACT && self.rms(|p, _| p.dot(mean)) < EXACT;
        let datum = Datum::plane(self.center, mean);
        flat.then_some(Recognised { shape: Shape::Plane, axis: None, datum })
    }

    /// A sphere, if all normals meet in a point.
    fn sphere(&self) -> Option<Recognised> {
        let mut matrix = glam::DMat3::ZERO;
        let mut right = DVec3::ZERO;
        for (p, n) in self.points.iter().zip(&self.normals) {
            let across = glam::DMat3::IDENTITY - glam::DMat3::from_cols(*n * n.x, *n * n.y, *n * n.z);
            matrix += across;
            right += across * *p;
        }
        if matrix.determinant().abs() < 1e-9 * (self.points.len() as f64).powi(3) {
            return None;
        }
        let middle = matrix.inverse() * right;
        let radius = self.rms(|p, _| p.distance(middle));
        let exact = EXACT * radius.max(1.0);
        let round = self.rms(|p, n| (p - middle).cross(n).length()) < exact
            && self.rms(|p, _| p.distance(middle) - radius) < exact;
        let datum = Datum::sphere(self.center + self.size * middle, self.size * radius);
        round.then_some(Recognised { shape: Shape::Sphere, axis: None, datum })
    }

    /// A surface that a rotation moves within itself: with the velocity c' + c x p no point moves along its normal.
    /// These velocities are the kernel of a matrix (Pottmann and Randrup, 'Rotational and helical surface approximation
    /// for reverse engineering', 1998).
    fn about_an_axis(&self) -> Option<Recognised> {
        let mut matrix = Matrix6::zeros();
        for (p, n) in self.points.iter().zip(&self.normals) {
            let m = p.cross(*n);
            let row = Vector6::new(m.x, m.y, m.z, n.x, n.y, n.z);
            matrix += row * row.transpose() / self.points.len() as f64;
        }
        let eigen = eigen::symmetric(matrix);
        let still = |k: &usize| eigen.eigenvalues[*k].max(0.0).sqrt() < EXACT;
        let velocity = |k: usize| {
            let v = eigen.eigenvectors.column(k);
            (DVec3::new(v[0], v[1], v[2]), DVec3::new(v[3], v[4], v[5]))
        };
        // A cylinder may also be shifted along its axis, which is irrelevant here.
        let turning = (0..6).filter(still).map(velocity);
        let count = (0..6).filter(still).count();
        let (turn, shift) = turning.max_by(|a, b| a.0.length().total_cmp(&b.0.length()))?;
        let axis = turn.try_normalize().filter(|_| turn.length() > 1e-3 && count <= 2)?;
        let along = shift.dot(axis);
        if count == 1 && along.abs() > EXACT * 10.0 * turn.length() {
            return None;
        }
        let foot = turn.cross(shift - along * axis) / turn.length_squared();
        self.of_revolution(foot, axis)
    }

    fn of_revolution(&self, foot: DVec3, axis: DVec3) -> Option<Recognised> {
        let radial = |p: DVec3| (p - foot).reject_from_normalized(axis);
        // The sine of the normal's angle to the section's plane, for a normal that points away from the axis.
        let slope = |p: DVec3, n: DVec3| n.dot(axis) * n.dot(radial(p)).signum();
        let slopes: Vec<f64> = self.points.iter().zip(&self.normals).map(|(p, n)| slope(*p, *n)).collect();
        let mean = slopes.iter().sum::<f64>() / slopes.len() as f64;
        let straight = self.rms(|p, n| slope(p, n) - mean) < EXACT;
        let shape = match () {
            () if straight && mean.abs() < EXACT => Shape::Cylinder,
            () if straight => Shape::Cone,
            () => Shape::Revolution,
        };
        let angle = if shape == Shape::Cone { (-mean).clamp(-1.0, 1.0).asin() } else { 0.0 };
        let radius = self.points.iter().map(|p| radial(*p).length()).sum::<f64>() / self.points.len() as f64;
        // From the foot of the sample's centre, which is the origin of the sample.
        let origin = self.center + self.size * (foot - foot.dot(axis) * axis);
        let datum = Datum::about(origin, axis, angle, self.size * radius, shape == Shape::Cone);
        Some(Recognised { shape, axis: Some((origin, axis)), datum })
    }
}
