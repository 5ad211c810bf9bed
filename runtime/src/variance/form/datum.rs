//! Datums: surfaces of a form in a position, and the distances of points to them.

use super::linear::{MOST, Row};
use glam::DVec3;

/// A plane, a sphere, a cylinder or a cone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Datum {
    pub(super) kind: Kind,
    /// A point of the plane or of the axis; the centre of a sphere.
    pub(super) origin: DVec3,
    /// The normal of a plane, or the axis; any direction for a sphere.
    pub(super) axis: DVec3,
    /// Half the opening angle of a cone whose radius grows along the axis; zero for the others.
    pub(super) angle: f64,
    /// The radius; the distance of the origin from the side of a cone; zero for a plane.
    pub(super) size: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Plane,
    Sphere,
    Cylinder,
    Cone,
}

impl Datum {
    pub(super) fn plane(origin: DVec3, axis: DVec3) -> Datum {
        Datum { kind: Kind::Plane, origin, axis, angle: 0.0, size: 0.0 }
    }

    pub(super) fn sphere(origin: DVec3, size: f64) -> Datum {
        Datum { kind: Kind::Sphere, origin, axis: DVec3::Z, angle: 0.0, size }
    }

    /// A cone, or a cylinder (`angle` is zero). `radius` is at the origin.
    pub(super) fn about(origin: DVec3, axis: DVec3, angle: f64, radius: f64, cone: bool) -> Datum {
        let kind = if cone { Kind::Cone } else { Kind::Cylinder };
        Datum { kind, origin, axis, angle, size: radius * angle.cos() }
    }

    /// Number of unknowns.
    pub(super) fn unknowns(&self) -> usize {
        match self.kind {
            Kind::Plane => 3,
            Kind::Sphere => 4,
            Kind::Cylinder => 5,
            Kind::Cone => 6,
        }
    }

    /// The datum with everything that its distances need.
    pub(super) fn placed(&self) -> Placed {
        let (x, y) = self.axis.any_orthonormal_pair();
        let (sin, cos) = self.angle.sin_cos();
        Placed { datum: *self, x, y, sin, cos }
    }

    /// The datum changed by the unknowns.
    pub(super) fn moved(&self, by: &[f64; MOST]) -> Datum {
        let (x, y) = self.axis.any_orthonormal_pair();
        let shifted = |right: f64, up: f64| self.origin + right * x + up * y;
        let tilted = |right: f64, up: f64| (self.axis + right * x + up * y).normalize();
        match self.kind {
            // A plane that rises by these slopes along x and y.
            Kind::Plane => Datum { origin: self.origin + by[0] * self.axis, axis: tilted(-by[1], -by[2]), ..*self },
            Kind::Sphere => {
                Datum { origin: shifted(by[1], by[2]) + by[3] * self.axis, size: self.size + by[0], ..*self }
            }
            Kind::Cylinder | Kind::Cone => Datum {
                origin: shifted(by[1], by[2]),
                axis: tilted(by[3], by[4]),
                angle: self.angle + by[5],
                size: self.size + by[0],
                ..*self
            },
        }
    }
}

/// A datum with everything that depends on it only.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    datum: Datum,
    /// Two directions at right angles to the axis and to each other.
    x: DVec3,
    y: DVec3,
    /// Sine and cosine of the angle.
    sin: f64,
    cos: f64,
}

impl Placed {
    /// Signed distance of a point from the surface, positive outside. Millimetres.
    #[inline]
    pub(super) fn height(&self, point: DVec3) -> f64 {
        let q = point - self.datum.origin;
        let z = q.dot(self.datum.axis);
        match self.datum.kind {
            Kind::Plane => z,
            Kind::Sphere => q.length() - self.datum.size,
            Kind::Cylinder | Kind::Cone => {
                let (x, y) = (q.dot(self.x), q.dot(self.y));
                (x * x + y * y).sqrt() * self.cos - z * self.sin - self.datum.size
            }
        }
    }

    /// The unit normal of the surface towards a point outside. Any direction at the middle of an axis or a sphere.
    pub(super) fn normal(&self, point: DVec3) -> DVec3 {
        let q = point - self.datum.origin;
        match self.datum.kind {
            Kind::Plane => self.datum.axis,
            Kind::Sphere => q.normalize_or(DVec3::Z),
            Kind::Cylinder | Kind::Cone => {
                let away = q.reject_from_normalized(self.datum.axis).normalize_or(self.x);
                self.cos * away - self.sin * self.datum.axis
            }
        }
    }

    /// The linearised equation of a point: its distance (`value`), and by how much each unknown decreases it (the size,
    /// two shifts, two tilts, the angle).
    pub(super) fn row(&self, point: DVec3) -> Row {
        let q = point - self.datum.origin;
        let (x, y, z) = (q.dot(self.x), q.dot(self.y), q.dot(self.datum.axis));
        let mut row = Row { value: self.height(point), ..Row::default() };
        match self.datum.kind {
            Kind::Plane => row.factors[..3].copy_from_slice(&[1.0, x, y]),
            Kind::Sphere => {
                let along = 1.0 / q.length().max(f64::MIN_POSITIVE);
                row.factors[..4].copy_from_slice(&[1.0, x * along, y * along, z * along]);
            }
            Kind::Cylinder | Kind::Cone => {
                let far = (x * x + y * y).sqrt();
                let along = 1.0 / far.max(f64::MIN_POSITIVE);
                let (x, y) = (x * along, y * along);
                // The lever arm of tilts and of the angle: along the side, from the point nearest to the origin.
                let arm = z * self.cos + far * self.sin;
                row.factors = [1.0, self.cos * x, self.cos * y, arm * x, arm * y, arm];
                if self.datum.kind == Kind::Cylinder {
                    row.factors[5] = 0.0;
                }
            }
        }
        row
    }
}
