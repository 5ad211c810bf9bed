//! Lower bounds of the distances from a point to four facets at a time, in single precision. They rule out nearly all
//! facets before distances in double precision are computed.

use super::facets::Facing;
use glam::{DVec3, Vec3, Vec4};
use std::ops::Sub;

/// Facets a block.
pub(crate) const WIDTH: usize = 4;
/// Sines of corners below which a triangle is too narrow for single precision, and below which it is no wider than a
/// line.
const NARROW: f32 = 1e-2;
const LINE: f32 = 1e-5;
/// Single precision, rounded in and out, is off by less than this part of the model's size.
const PRECISION: f64 = 1e-5;
/// Cosines in single precision are off by less, of triangles that are not too narrow.
const ANGULAR: f32 = 1e-3;
/// (d - e)^2 is not less than (1 - k) d^2 - e^2 / k: squared distances are taken so much smaller for the error e.
const PART: f32 = 1e-2;

/// Four vectors, coordinate by coordinate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes {
    pub(super) x: Vec4,
    pub(super) y: Vec4,
    pub(super) z: Vec4,
}

/// Two triangles each, (a, b, c) and (a, c, d). All in millimetres about the tree's origin.
#[derive(Clone, Debug)]
pub(super) struct Block {
    a: Lanes,
    ab: Lanes,
    ac: Lanes,
    ad: Lanes,
    first: Plane,
    second: Plane,
    /// 1 / |edge|^2 of ab, bc, ac, cd, ad; 0 for an edge without length.
    inverse: [Vec4; 5],
    /// `1 - PART`, or 0 for facets whose bounds are not reliable.
    trust: Vec4,
    /// Margin that is subtracted from every squared distance. Square millimetres.
    less: f32,
    patches: [u32; WIDTH],
}

/// A point as blocks take it.
#[derive(Clone, Copy)]
pub(crate) struct Asked<'a> {
    pub(super) place: Lanes,
    facing: Option<(Lanes, Facing<'a>)>,
    /// Facets whose cosine (see `Facing`) is below this do not count.
    across: f32,
}

impl<'a> Asked<'a> {
    /// The point `place`, about the tree's origin, for facets whose cosine with the point's normal is not below
    /// `across`.
    pub(super) fn new(place: Vec3, facing: Option<Facing<'a>>, across: f64) -> Self {
        let facing = facing.map(|f| (Lanes::splat(f.normal.as_vec3()), f));
        Self { place: Lanes::splat(place), facing, across: across as f32 - ANGULAR }
    }
}

/// The interior of a triangle with the edges e and f at its first corner.
#[derive(Clone, Debug)]
struct Plane {
    /// Unit normal.
    normal: Lanes,
    /// e^2, e f, f^2 and the determinant of these, which is negative for a triangle without interior.
    ee: Vec4,
    ef: Vec4,
    ff: Vec4,
    area: Vec4,
}

impl Lanes {
    pub(super) fn splat(v: Vec3) -> Self {
        Self { x: Vec4::splat(v.x), y: Vec4::splat(v.y), z: Vec4::splat(v.z) }
    }

    fn of(v: [Vec3; WIDTH]) -> Self {
        Self {
            x: Vec4::from_array(v.map(|v| v.x)),
            y: Vec4::from_array(v.map(|v| v.y)),
            z: Vec4::from_array(v.map(|v| v.z)),
        }
    }

    fn dot(self, other: Self) -> Vec4 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    fn times(self, factor: Vec4) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }
}

impl Sub for Lanes {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl Block {
    /// Up to four facets by their corners and patches; `size` (millimetres) is that of the whole model. Missing facets,
    /// and those that are not finite, are infinitely far from everything.
    pub(super) fn new(corners: &[[DVec3; 4]], patches: [u32; WIDTH], origin: DVec3, size: f64) -> Self {
        let corner = |k: usize| {
            Lanes::of([0, 1, 2, 3].map(|lane| {
                let there = corners.get(lane).filter(|c| c.iter().all(|c| c.is_finite()));
                there.map_or(Vec3::NAN, |c| (c[k] - origin).as_vec3())
            }))
        };
        let a = corner(0);
        let [ab, ac, ad] = [corner(1) - a, corner(2) - a, corner(3) - a];
        let ((first, sound), (second, other)) = (Plane::new(ab, ac), Plane::new(ac, ad));
        let inverse = [ab, ac - ab, ac, ad - ac, ad].map(|edge| {
            let square = edge.dot(edge);
            Vec4::select(square.cmpgt(Vec4::ZERO), square.recip(), Vec4::ZERO)
        });
        let trust = Vec4::select(sound & other, Vec4::splat(1.0 - PART), Vec4::ZERO);
        let error = PRECISION * size;
        Self { a, ab, ac, ad, first, second, inverse, trust, less: (error * error / f64::from(PART)) as f32, patches }
    }

    /// Lower bounds of the squared distances from a point to the facets; infinite for facets that face away.
    pub(super) fn lower_bounds(&self, asked: &Asked) -> Vec4 {
        let lower = self.distances(asked.place);
        let Some((normal, facing)) = asked.facing else { return lower };
        let sign =
            Vec4::from_array(self.patches.map(|p| f32::from(facing.signs.get(p as usize).copied().unwrap_or(0))));
        let away = |plane: &Plane| (plane.normal.dot(normal) * sign).cmplt(Vec4::splat(asked.across));
        let unwanted = away(&self.first) & away(&self.second) & self.trust.cmpgt(Vec4::ZERO);
        Vec4::select(unwanted, Vec4::INFINITY, lower)
    }

    fn distances(&self, q: Lanes) -> Vec4 {
        let Self { a, ab, ac, ad, inverse, .. } = self;
        let ap = q - *a;
        let (bp, cp) = (ap - *ab, ap - *ac);
        let along = [ap.dot(*ab), ap.dot(*ac), ap.dot(*ad)];
        let segment = |from: Lanes, edge: Lanes, along: Vec4, inverse: Vec4| {
            let off = from - edge.times((along * inverse).clamp(Vec4::ZERO, Vec4::ONE));
            off.dot(off)
        };
        let (bc, cd) = (*ac - *ab, *ad - *ac);
        let outer = segment(ap, *ab, along[0], inverse[0])
            .min(segment(bp, bc, bp.dot(bc), inverse[1]))
            .min(segment(cp, cd, cp.dot(cd), inverse[3]))
            .min(segment(ap, *ad, along[2], inverse[4]));
        let diagonal = segment(ap, *ac, along[1], inverse[2]);
        let nearest =
            self.second.nearer(ap, along[1], along[2], self.first.nearer(ap, along[0], along[1], outer.min(diagonal)));
        let lower = nearest * self.trust - Vec4::splat(self.less);
        Vec4::select(nearest.cmpge(Vec4::ZERO), lower, Vec4::INFINITY)
    }
}

impl Plane {
    /// The triangle, and the lanes in which it is reliable.
    fn new(e: Lanes, f: Lanes) -> (Self, glam::BVec4A) {
        let (ee, ef, ff, normal) = (e.dot(e), e.dot(f), f.dot(f), e.cross(f));
        let square = normal.dot(normal);
        let sine2 = |sine: f32| ee * ff * (sine * sine);
        let line = square.cmple(sine2(LINE));
        let sound = line | square.cmpge(sine2(NARROW));
        let length = Vec4::select(line, Vec4::ONE, square).sqrt();
        let area = Vec4::select(line, Vec4::NEG_ONE, ee * ff - ef * ef);
        (Self { normal: normal.times(length.recip()), ee, ef, ff, area }, sound)
    }

    /// The squared distance from the plane where the point is above the triangle, else `other`.
    fn nearer(&self, ap: Lanes, e: Vec4, f: Vec4, other: Vec4) -> Vec4 {
        let (v, w) = (self.ff * e - self.ef * f, self.ee * f - self.ef * e);
        let height = self.normal.dot(ap);
        let above = v.cmpge(Vec4::ZERO) & w.cmpge(Vec4::ZERO) & (v + w).cmple(self.area);
        Vec4::select(above, (height * height).min(other), other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::correspond::tree::triangle_closest;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn bounds_are_below_the_distance_and_close_to_it() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut point = |size: f64| DVec3::from_array([(); 3].map(|()| rng.random_range(-size..size)));
        let mut loose = 0;
        for round in 0..4000 {
            let middle = point(50.0);
            // Some are folded, some have a side without length, some are narrow.
            let corners: Vec<[DVec3; 4]> = (0..WIDTH)
                .map(|lane| {
                    let mut c = [(); 4].map(|()| middle + point(3.0));
                    match (round + lane) % 5 {
                        0 => c[1] = c[0],
                        1 => c[2] = c[1] + 1e-3 * (c[2] - c[1]),
                        2 => c[3] = c[0] + (c[2] - c[0]) * 0.3,
                        _ => {}
                    }
                    c
                })
                .collect();
            let q = middle + point([0.5, 5.0, 100.0][round % 3]);
            let asked = Asked::new(q.as_vec3(), None, 0.0);
            let lower = Block::new(&corners, [0; WIDTH], DVec3::ZERO, 100.0).lower_bounds(&asked).to_array();
            for (c, lower) in corners.iter().zip(lower) {
                let d2 = triangle_closest(q, c[0], c[1], c[2]).1.min(triangle_closest(q, c[0], c[2], c[3]).1);
                assert!(f64::from(lower) <= d2, "{lower} {d2} {c:?} {q}");
                loose += usize::from(f64::from(lower) < 0.98 * d2 - 0.01);
            }
        }
        assert!(loose < 4000 * WIDTH / 4, "{loose}");
    }

    #[test]
    fn what_is_not_there_is_infinitely_far() {
        let corner = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        let mut broken = corner;
        broken[2].y = f64::NAN;
        let lower = Block::new(&[corner, broken], [0; WIDTH], DVec3::ZERO, 1.0)
            .lower_bounds(&Asked::new(Vec3::Z, None, 0.0))
            .to_array();
        assert!(lower[0] < 1.0 && lower[0] > 0.98);
        assert_eq!(lower[1..], [f32::INFINITY; 3]);
    }
}
