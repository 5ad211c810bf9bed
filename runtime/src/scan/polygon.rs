//! Polygons as triangles.

use foldhash::fast::RandomState;
use glam::{DVec2, DVec3};
use std::collections::HashSet;

/// Polygons of more corners are not cut into ears, which takes quadratic time.
const LONGEST: usize = 10_000;

/// The number of corners that are tried per corner of the polygon before the search for ears is given up.
const TRIES: usize = 32;

/// The number of pairs of edges, and of ears and corners, that are looked at in a whole file: some two seconds. A file
/// of 1 MB has room for fifty polygons of the most corners, each of which may take as long.
const PAIRS: u64 = 1_000_000_000;

/// A polygon whose corners lie on each of its vertices more often than this on average has no inside. At most two meet
/// in a vertex of an outline, and two more where a bridge to a hole begins.
const REPEATED: usize = 4;

/// The work that is left for the polygons of a file, in pairs.
pub(super) struct Budget(u64);

impl Default for Budget {
    fn default() -> Self {
        Self(PAIRS)
    }
}

impl Budget {
    /// Takes so many pairs; none if they are not left.
    fn take(&mut self, pairs: usize) -> Option<()> {
        self.0 = self.0.checked_sub(pairs as u64)?;
        Some(())
    }
}

/// Whether a polygon with these vertices, by number, goes round in itself.
pub(super) fn is_tangled(vertices: impl Iterator<Item = u32>) -> bool {
    let (mut corners, mut different) = (0, HashSet::<u32, RandomState>::default());
    for vertex in vertices {
        corners += 1;
        different.insert(vertex);
    }
    corners > REPEATED * different.len()
}

/// Shares of a polygon's area that are smaller are rounding.
const ROUNDING: f64 = 1e-12;

/// How a polygon becomes triangles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Triangulation {
    /// The fan about its first corner does not overlap itself: that of a convex polygon, and of one without area.
    Fan,
    /// The fan leaves the polygon; these triangles, as positions in the polygon, do not.
    Ears(Vec<[usize; 3]>),
    /// It crosses itself, or it has too many corners, or no work is left for it.
    Impossible,
}

/// Splits a polygon of `corners` corners into a fan of triangles around its first; yields positions in the polygon.
pub(super) fn fan(corners: usize) -> impl Iterator<Item = [usize; 3]> {
    (2..corners).map(|c| [0, c - 1, c])
}

/// Decides how a polygon, which need not be quite plane, becomes triangles.
pub(super) fn triangulate(points: &[DVec3], budget: &mut Budget) -> Triangulation {
    let doubled = |[a, b, c]: [usize; 3]| (points[b] - points[a]).cross(points[c] - points[a]);
    // Newell's normal, about a corner.
    let normal: DVec3 = fan(points.len()).map(doubled).sum();
    let all: f64 = fan(points.len()).map(|t| doubled(t).length()).sum();
    let squared = normal.length_squared();
    if all == 0.0 || fan(points.len()).all(|t| doubled(t).dot(normal) >= -ROUNDING * squared) && squared > 0.0 {
        return Triangulation::Fan;
    }
    let Some(normal) = normal.try_normalize().filter(|_| squared.sqrt() > ROUNDING * all && points.len() <= LONGEST)
    else {
        return Triangulation::Impossible;
    };
    let x = normal.any_orthonormal_vector();
    let y = normal.cross(x);
    let flat: Vec<DVec2> = points.iter().map(|p| *p - points[0]).map(|p| DVec2::new(p.dot(x), p.dot(y))).collect();
    let simple = budget.take(points.len() * points.len() / 2).filter(|()| !crosses_itself(&flat));
    let ears = simple.and_then(|()| Ears::new(&flat, ROUNDING * all).clip(budget));
    ears.map_or(Triangulation::Impossible, Triangulation::Ears)
}

/// Twice the signed area of a triangle: positive if it turns counter-clockwise.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Whether two edges cross in a point within both. Edges that only touch, as on the bridge between an outline and a
/// hole, do not.
fn crosses_itself(points: &[DVec2]) -> bool {
    let count = points.len();
    let edge = |i: usize| (points[i], points[(i + 1) % count]);
    let opposite = |a: f64, b: f64| a > 0.0 && b < 0.0 || a < 0.0 && b > 0.0;
    (0..count).any(|i| {
        let (a, b) = edge(i);
        (i + 2..count).any(|j| {
            let (c, d) = edge(j);
            opposite(turn(a, b, c), turn(a, b, d)) && opposite(turn(c, d, a), turn(c, d, b))
        })
    })
}

/// Ear clipping (Meisters, 'Polygons have ears', 1975): a ring of corners from which triangles are cut off.
struct Ears<'a> {
    points: &'a [DVec2],
    next: Vec<usize>,
    previous: Vec<usize>,
    /// Doubled areas up to this are none.
    rounding: f64,
}

impl<'a> Ears<'a> {
    fn new(points: &'a [DVec2], rounding: f64) -> Self {
        let count = points.len();
        let next = (0..count).map(|i| (i + 1) % count).collect();
        let previous = (0..count).map(|i| (i + count - 1) % count).collect();
        Self { points, next, previous, rounding }
    }

    /// The triangles; none if no ear is found, which a polygon always has that does not cross itself, or the work runs
    /// out.
    fn clip(mut self, budget: &mut Budget) -> Option<Vec<[usize; 3]>> {
        let count = self.points.len();
        let (mut triangles, mut at, mut left) = (Vec::with_capacity(count - 2), 0, count);
        let (mut tried, mut tries) = (0, TRIES * count);
        while left > 3 {
            budget.take(left)?;
            // After a whole round without an ear only corners without area may be left, as on a bridge.
            if if tried < left { self.is_ear(at) } else { self.is_flat(at) } {
                let (a, c) = (self.previous[at], self.next[at]);
                triangles.push([a, at, c]);
                (self.next[a], self.previous[c]) = (c, a);
                (left, tried, at) = (left - 1, 0, a);
            } else {
                (tried, tries, at) = (tried + 1, tries.checked_sub(1)?, self.next[at]);
                if tried > 2 * left {
                    return None;
                }
            }
        }
        let last = [self.previous[at], at, self.next[at]];
        triangles.push(last);
        (self.doubled(last) >= -self.rounding).then_some(triangles)
    }

    fn doubled(&self, [a, b, c]: [usize; 3]) -> f64 {
        turn(self.points[a], self.points[b], self.points[c])
    }

    fn is_flat(&self, corner: usize) -> bool {
        self.doubled([self.previous[corner], corner, self.next[corner]]).abs() <= self.rounding
    }

    /// Whether the triangle of a corner and its neighbours has an area and none of the other corners in it.
    fn is_ear(&self, corner: usize) -> bool {
        let triangle = [self.previous[corner], corner, self.next[corner]];
        if self.doubled(triangle) <= self.rounding {
            return false;
        }
        let [a, b, c] = triangle.map(|i| self.points[i]);
        let mut other = self.next[triangle[2]];
        while other != triangle[0] {
            let p = self.points[other];
            // Where a bridge to a hole begins, corners lie on each other.
            let apart = p != a && p != b && p != c;
            if apart && turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0 {
                return false;
            }
            other = self.next[other];
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::f64::consts::TAU;

    /// Points of a tilted plane far from the origin.
    fn tilted(points: &[[f64; 2]]) -> Vec<DVec3> {
        let normal = DVec3::new(0.3, -0.5, 0.8).normalize();
        let x = normal.any_orthonormal_vector();
        let y = normal.cross(x);
        points.iter().map(|p| DVec3::new(300.0, -700.0, 50.0) + p[0] * x + p[1] * y).collect()
    }

    fn area(points: &[[f64; 2]]) -> f64 {
        let p = |i: usize| DVec2::from(points[i % points.len()]);
        (0..points.len()).map(|i| p(i).perp_dot(p(i + 1))).sum::<f64>() / 2.0
    }

    /// The triangles' areas add up to the polygon's, which they do only if none overlaps another or lies outside.
    fn check_triangles(points: &[[f64; 2]]) {
        for turned in [false, true] {
            let mut points = points.to_vec();
            if turned {
                points.reverse();
            }
            let corners = tilted(&points);
            let triangles = match triangulate(&corners, &mut Budget::default()) {
                Triangulation::Ears(triangles) => triangles,
                // From another corner a fan may do.
                Triangulation::Fan => fan(points.len()).collect(),
                Triangulation::Impossible => panic!("no triangles of {points:?}"),
            };
            assert_eq!(triangles.len(), points.len() - 2);
            let normal: DVec3 =
                fan(points.len()).map(|[a, b, c]| (corners[b] - corners[a]).cross(corners[c] - corners[a])).sum();
            let doubled = |[a, b, c]: &[usize; 3]| (corners[*b] - corners[*a]).cross(corners[*c] - corners[*a]);
            let total: f64 = triangles.iter().map(|t| doubled(t).length() / 2.0).sum();
            assert!((total - area(&points).abs()).abs() < 1e-9 * total, "{total}, not {}", area(&points));
            assert!(triangles.iter().all(|t| doubled(t).dot(normal) >= -1e-9 * normal.length_squared()));
        }
    }

    #[test]
    fn convex_polygons_stay_fans() {
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        let with_a_point_on_an_edge = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        let circle: Vec<[f64; 2]> = (0..50).map(|k| (TAU * f64::from(k) / 50.0).sin_cos().into()).collect();
        for polygon in [&square[..], &with_a_point_on_an_edge, &circle] {
            assert_eq!(triangulate(&tilted(polygon), &mut Budget::default()), Triangulation::Fan);
        }
        // A warped one, and one without area.
        let warped = [[0.0, 0.0, 0.3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.3], [0.0, 1.0, 0.0]].map(DVec3::from);
        assert_eq!(triangulate(&warped, &mut Budget::default()), Triangulation::Fan);
        let flat = [DVec3::X, 2.0 * DVec3::X, 4.0 * DVec3::X, 3.0 * DVec3::X];
        assert_eq!(triangulate(&flat, &mut Budget::default()), Triangulation::Fan);
    }

    #[test]
    fn concave_polygons_become_ears() {
        let u =
            [[0.0, 20.0], [0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [15.0, 20.0], [15.0, 5.0], [5.0, 5.0], [5.0, 20.0]];
        assert!(matches!(triangulate(&tilted(&u), &mut Budget::default()), Triangulation::Ears(_)));
        check_triangles(&u);
        // A dart, from whose first corner the fan leaves it; points on edges; a square hole with a bridge to it.
        check_triangles(&[[-1.0, -1.0], [0.0, 0.5], [1.0, -1.0], [0.0, 2.0]]);
        check_triangles(
            &[[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 4.0], [2.0, 3.0], [2.0, 2.0], [0.0, 2.0]]
                .map(|[x, y]| [y, x]),
        );
        let (outer, hole) =
            ([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0]], [[3.0, 3.0], [3.0, 6.0], [6.0, 6.0], [6.0, 3.0]]);
        check_triangles(&[&outer[..], &outer[..1], &hole, &hole[..1]].concat());
        // Stars, combs and spirals.
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for corners in [5, 12, 60, 500] {
            let ray = |k: u32| {
                let (sin, cos) = (TAU * f64::from(k) / f64::from(corners)).sin_cos();
                let radius = rng.random_range(1.0..9.0);
                [radius * cos, radius * sin]
            };
            check_triangles(&(0..corners).map(ray).collect::<Vec<_>>());
            let tooth = |k: u32| [f64::from(k), if k.is_multiple_of(2) { 1.0 } else { 40.0 }];
            let comb: Vec<[f64; 2]> =
                (0..corners).map(tooth).chain([[f64::from(corners), -3.0], [0.0, -3.0]]).collect();
            check_triangles(&comb);
            let arm = |k: u32, width: f64| {
                let (sin, cos) = (0.3 * f64::from(k)).sin_cos();
                let radius = 5.0 + f64::from(k) + width;
                [radius * cos, radius * sin]
            };
            check_triangles(
                &(0..corners).map(|k| arm(k, 0.0)).chain((0..corners).rev().map(|k| arm(k, 4.0))).collect::<Vec<_>>(),
            );
        }
    }

    #[test]
    fn polygons_that_cross_themselves_are_named() {
        let bow = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]];
        let uneven_bow = [[0.0, 0.0], [2.0, 3.0], [2.0, 0.0], [0.0, 2.0]];
        let pentagram: Vec<[f64; 2]> = (0..5).map(|k| (TAU * 0.4 * f64::from(k)).sin_cos().into()).collect();
        for polygon in [&bow[..], &uneven_bow, &pentagram] {
            assert_eq!(triangulate(&tilted(polygon), &mut Budget::default()), Triangulation::Impossible);
        }
    }

    #[test]
    fn no_more_is_done_than_the_budget_allows() {
        let comb: Vec<[f64; 2]> =
            (0..400).map(|k| [f64::from(k), f64::from(k % 2) * 40.0]).chain([[400.0, -3.0], [0.0, -3.0]]).collect();
        let mut budget = Budget(10_000_000);
        let mut split = || matches!(triangulate(&tilted(&comb), &mut budget), Triangulation::Ears(_));
        assert!(split());
        assert!((0..1000).any(|_| !split()) && !split());
    }
}
