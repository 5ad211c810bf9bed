//! The characteristics of two surfaces: vectors that are zero where a part lies as the datum asks for, and the width of
//! the zone that they take. A width grows with its vectors: twice the vectors have twice the width.

use super::super::datum::{Datum, Kind};
use glam::DVec3;
use std::f64::consts::TAU;

/// Sine of the largest angle by which what is parallel or at right angles in the model may be off: 10 degrees. Other
/// angles are none of the four characteristics.
const OFF: f64 = 0.174;

/// Directions in which the extent of a plane is known: a disc of 20 mm radius is 0.02 mm larger.
const DIRECTIONS: usize = 64;

/// A characteristic of a part with respect to a datum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Characteristic {
    pub(super) name: &'static str,
    kind: Sought,
}

/// What the datum asks of a part.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sought {
    /// Its axis or its centre lies on the datum's.
    Same,
    /// Its axis or normal has the direction of the datum's.
    Aligned,
    /// Its axis or normal is at right angles to the datum's.
    Crossed,
}

/// How far a part reaches: along its axis, or from a point of its plane.
#[derive(Clone, Debug)]
pub(super) enum Extent {
    /// The ends of an axis, from the datum's origin. Millimetres.
    Axis([f64; 2]),
    /// A point without an extent: the centre of a sphere.
    Point,
    /// The outermost points of a plane from its middle, and the middle.
    Plane(Vec<DVec3>, DVec3),
}

/// The width of a zone, and what makes it as wide.
#[derive(Clone, Copy, Debug)]
pub(super) struct Size {
    pub(super) width: f64,
    /// The number of the vector, or of the point of a plane.
    worst: usize,
}

impl Extent {
    /// Of a surface with these points.
    pub(super) fn of(surface: &Datum, points: impl Iterator<Item = DVec3>) -> Self {
        let (origin, axis) = (surface.origin, surface.axis);
        match surface.kind {
            Kind::Sphere => Self::Point,
            Kind::Cylinder | Kind::Cone => {
                let heights = points.map(|p| (p - origin).dot(axis));
                let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
                Self::Axis([low, high])
            }
            Kind::Plane => {
                let inside: Vec<DVec3> = points.map(|p| (p - origin).reject_from_normalized(axis)).collect();
                let (x, y) = axis.any_orthonormal_pair();
                let outermost = |k: usize| {
                    let (sin, cos) = (TAU * k as f64 / DIRECTIONS as f64).sin_cos();
                    let towards = cos * x + sin * y;
                    let far = |p: &DVec3| p.dot(towards);
                    inside.iter().copied().max_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or_default()
                };
                let outermost: Vec<DVec3> = (0..DIRECTIONS).map(outermost).collect();
                let middle = outermost.iter().sum::<DVec3>() / DIRECTIONS as f64;
                Self::Plane(outermost.into_iter().map(|p| p - middle).collect(), origin + middle)
            }
        }
    }
}

/// The distance of a point from an axis, as a vector, or from a centre.
fn away(point: DVec3, from: &Datum) -> DVec3 {
    match from.kind {
        Kind::Sphere => point - from.origin,
        _ => (point - from.origin).reject_from_normalized(from.axis),
    }
}

impl Characteristic {
    /// Those that a part of the model has with respect to a datum of the model. Axes and centres that are farther from
    /// each other than the smaller radius are not meant to be the same.
    pub(super) fn between(datum: &Datum, part: &Datum, extent: &Extent) -> Vec<Self> {
        let mut all = Vec::new();
        let planes = [datum, part].into_iter().filter(|d| d.kind == Kind::Plane).count();
        let points = [datum, part].into_iter().filter(|d| d.kind == Kind::Sphere).count();
        let (sine, cosine) = (datum.axis.cross(part.axis).length(), datum.axis.dot(part.axis).abs());
        let of = |name, kind| Self { name, kind };
        if planes == 0 && (points > 0 || sine < OFF) {
            let same = of(if points > 0 { "concentricity" } else { "coaxiality" }, Sought::Same);
            let vectors = same.vectors(datum, part, extent);
            let middle = vectors.iter().sum::<DVec3>() / vectors.len() as f64;
            if middle.length() < datum.size.min(part.size) {
                all.push(same);
            }
        }
        // A plane has the direction of its normal, at right angles to itself.
        let [parallel, square] = ["parallelism", "perpendicularity"];
        let [aligned, crossed] = if planes == 1 { [square, parallel] } else { [parallel, square] };
        if points == 0 && sine < OFF {
            all.push(of(aligned, Sought::Aligned));
        } else if points == 0 && cosine < OFF {
            all.push(of(crossed, Sought::Crossed));
        }
        all
    }

    /// The vectors that are zero where the part lies as the datum asks for.
    pub(super) fn vectors(&self, datum: &Datum, part: &Datum, extent: &Extent) -> Vec<DVec3> {
        match (self.kind, extent) {
            (Sought::Same, Extent::Axis(_)) if datum.kind == Kind::Sphere => vec![away(datum.origin, part)],
            (Sought::Same, Extent::Axis(ends)) => {
                ends.iter().map(|end| away(part.origin + *end * part.axis, datum)).collect()
            }
            (Sought::Same, _) => vec![away(part.origin, datum)],
            (Sought::Aligned, Extent::Axis([low, high])) => {
                vec![((*high - *low) * part.axis).reject_from_normalized(datum.axis)]
            }
            (Sought::Crossed, Extent::Axis([low, high])) => {
                vec![((*high - *low) * part.axis).project_onto_normalized(datum.axis)]
            }
            // By so much the plane rises towards the direction across the zone.
            (Sought::Aligned, _) => vec![datum.axis.reject_from_normalized(part.axis)],
            (Sought::Crossed, _) => {
                let across = part.axis.reject_from_normalized(datum.axis).normalize_or_zero();
                vec![across.reject_from_normalized(part.axis)]
            }
        }
    }

    /// Where a part is the farthest from where the datum asks for it.
    pub(super) fn place(&self, size: Size, datum: &Datum, part: &Datum, extent: &Extent) -> DVec3 {
        match extent {
            // The only place of the axis that counts is beside the centre.
            Extent::Axis(_) if datum.kind == Kind::Sphere => {
                part.origin + (datum.origin - part.origin).project_onto_normalized(part.axis)
            }
            Extent::Axis(ends) if self.kind == Sought::Same => part.origin + ends[size.worst] * part.axis,
            // A direction that is off is so at both ends.
            Extent::Axis([_, high]) => part.origin + *high * part.axis,
            Extent::Point => part.origin,
            Extent::Plane(outermost, middle) => *middle + outermost[size.worst],
        }
    }

    /// The width of the zone that the vectors take: twice the largest distance from the datum, the length over which an
    /// axis leaves its direction, or the height of a plane across its zone.
    pub(super) fn size(&self, vectors: &[DVec3], extent: &Extent) -> Size {
        if let (Sought::Aligned | Sought::Crossed, Extent::Plane(outermost, _)) = (self.kind, extent) {
            let heights = || outermost.iter().map(|p| vectors.iter().map(|v| v.dot(*p)).sum::<f64>());
            let worst = largest(heights().map(f64::abs));
            let (low, high) = heights().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
            return Size { width: high - low, worst };
        }
        let factor = if self.kind == Sought::Same { 2.0 } else { 1.0 };
        let worst = largest(vectors.iter().map(|v| v.length()));
        Size { width: factor * vectors.get(worst).map_or(0.0, |v| v.length()), worst }
    }
}

/// The number of the largest value.
fn largest(values: impl Iterator<Item = f64>) -> usize {
    values.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(number, _)| number)
}
