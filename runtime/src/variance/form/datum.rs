//! A surface of some form in some place, and how points lie to it.

use super::chebyshev::{MOST, Row};
use glam::DVec3;

/// A plane, a sphere, a cylinder or a cone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Datum {
    kind: Kind,
    /// A point of the plane or of the axis; the centre.
    origin: DVec3,
    /// The normal, or the axis; of a sphere any direction.
    axis: DVec3,
    /// Half the angle of a cone, the radius growing along the axis; else zero.
    angle: f64,
    /// The radius; of a cone the distance of the origin from its sides; of a plane nothing.
    size: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
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

    /// A cone, or a cylinder, whose angle is zero. `radius` is at the origin.
    pub(super) fn about(origin: DVec3, axis: DVec3, angle: f64, radius: f64, cone: bool) -> Datum {
        let kind = if cone { Kind::Cone } else { Kind::Cylinder };
        Datum { kind, origin, axis, angle, size: radius * angle.cos() }
    }

    /// How many unknowns it has.
    pub(super) fn unknowns(&self) -> usize {
        match self.kind {
            Kind::Plane => 3,
            Kind::Sphere => 4,
            Kind::Cylinder => 5,
            Kind::Cone => 6,
        }
    }

    /// How far outside of the surface a point is (`value`), and how much that lessens with each unknown: the size, two shifts, two
    /// tilts, the angle. Exact at zero, linear about it. Millimetres.
    pub(super) fn row(&self, point: DVec3) -> Row {
        let (x, y) = self.axis.any_orthonormal_pair();
        let q = point - self.origin;
        let (x, y, z) = (q.dot(x), q.dot(y), q.dot(self.axis));
        let mut row = Row::default();
        match self.kind {
            Kind::Plane => {
                row.value = z;
                row.factors[..3].copy_from_slice(&[1.0, x, y]);
            }
            Kind::Sphere => {
                let far = q.length();
                row.value = far - self.size;
                let along = 1.0 / far.max(f64::MIN_POSITIVE);
                row.factors[..4].copy_from_slice(&[1.0, x * along, y * along, z * along]);
            }
            Kind::Cylinder | Kind::Cone => {
                let far = x.hypot(y);
                let (sin, cos) = self.angle.sin_cos();
                let along = 1.0 / far.max(f64::MIN_POSITIVE);
                let (x, y) = (x * along, y * along);
                // Along the side, from the point nearest to the origin: the arm of tilts and of the angle.
                let arm = z * cos + far * sin;
                row.value = far * cos - z * sin - self.size;
                row.factors = [1.0, cos * x, cos * y, arm * x, arm * y, arm];
                if self.kind == Kind::Cylinder {
                    row.factors[5] = 0.0;
                }
            }
        }
        row
    }

    /// Changed by the unknowns.
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
