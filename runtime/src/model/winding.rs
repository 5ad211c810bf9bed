//! The generalized winding number of triangles (Jacobson, Kavan and Sorkine-Hornung 2013), by dipoles where they are
//! far off (Barill, Dickson, Schmidt, Levin and Jacobson 2018).

use crate::mesh::Bounds;
use crate::morton::morton;
use glam::DVec3;
use std::f64::consts::PI;
use std::ops::Range;

/// A node stands for its triangles at places farther off than so many times its radius: the number is then good to
/// some hundredths, where a quarter would be a wrong answer.
const FAR: f64 = 2.0;

/// The most triangles of a leaf.
const LEAF: usize = 4;

/// Cells along the longest side of the box around the triangles, which are ordered by them.
const CELLS: f64 = 1_048_576.0;

/// Triangles in a hierarchy.
#[derive(Clone, Debug, Default)]
pub(crate) struct Winding {
    triangles: Vec<[DVec3; 3]>,
    /// In depth-first order.
    nodes: Vec<Node>,
}

#[derive(Clone, Debug)]
struct Node {
    /// The middle of the area.
    centre: DVec3,
    /// The sum of areas times normals.
    moment: DVec3,
    /// The squared distance from the centre beyond which the moment stands for the triangles.
    far: f64,
    /// The node that follows this one and all those below it.
    next: usize,
    /// The triangles of a leaf; empty of an inner node.
    leaf: Range<usize>,
}

impl Winding {
    /// The hierarchy over some triangles, counter-clockwise from outside.
    pub(crate) fn new(triangles: Vec<[DVec3; 3]>) -> Self {
        let middle = |t: &[DVec3; 3]| (t[0] + t[1] + t[2]) / 3.0;
        let bounds: Bounds = triangles.iter().map(middle).collect();
        let cell = (bounds.size().max_element() / CELLS).max(f64::MIN_POSITIVE);
        let key = |t: &[DVec3; 3]| morton(((middle(t) - bounds.low) / cell).as_u64vec3());
        let mut order: Vec<(u64, u32)> = triangles.iter().map(key).zip(0..).collect();
        order.sort_unstable();
        let triangles: Vec<[DVec3; 3]> = order.iter().map(|(_, i)| triangles[*i as usize]).collect();
        let mut nodes = Vec::with_capacity(triangles.len());
        if !triangles.is_empty() {
            build(&triangles, &order, 0, &mut nodes);
        }
        Self { triangles, nodes }
    }

    /// The winding number at a place: 1 within what the triangles enclose and 0 outside of it, where they are closed;
    /// where they are open, the part of the directions in which they are left from inside, less the one in which they
    /// are entered.
    pub(crate) fn at(&self, place: DVec3) -> f64 {
        let mut angle = 0.0;
        let mut k = 0;
        while let Some(node) = self.nodes.get(k) {
            let to = node.centre - place;
            let square = to.length_squared();
            if square > node.far {
                angle += node.moment.dot(to) / (square * square.sqrt());
                k = node.next;
            } else if node.leaf.is_empty() {
                k += 1;
            } else {
                let near = self.triangles[node.leaf.clone()].iter();
                angle += near.map(|t| solid_angle(t.map(|p| p - place))).sum::<f64>();
                k = node.next;
            }
        }
        angle / (4.0 * PI)
    }
}

/// The sums over a node's triangles, and their bounds.
struct Sums {
    /// Of areas times normals.
    moment: DVec3,
    /// Of areas times middles.
    weighted: DVec3,
    area: f64,
    bounds: Bounds,
}

/// Adds the nodes over `triangles`, which lie along a curve by the keys in `order`; the first has the number `first`.
fn build(triangles: &[[DVec3; 3]], order: &[(u64, u32)], first: usize, nodes: &mut Vec<Node>) -> Sums {
    let node = nodes.len();
    nodes.push(Node { centre: DVec3::ZERO, moment: DVec3::ZERO, far: 0.0, next: 0, leaf: 0..0 });
    let sums = if triangles.len() <= LEAF {
        nodes[node].leaf = first..first + triangles.len();
        Sums::of(triangles)
    } else {
        // Where the first of the bits in which the keys differ changes.
        let bit = (order[0].0 ^ order[order.len() - 1].0).checked_ilog2();
        let half = bit.map_or(order.len() / 2, |bit| order.partition_point(|(key, _)| key >> bit & 1 == 0));
        let low = build(&triangles[..half], &order[..half], first, nodes);
        let high = build(&triangles[half..], &order[half..], first + half, nodes);
        low.with(&high)
    };
    let next = nodes.len();
    let of_node = &mut nodes[node];
    of_node.centre = if sums.area > 0.0 { sums.weighted / sums.area } else { sums.bounds.centre() };
    let farthest = (sums.bounds.high - of_node.centre).max(of_node.centre - sums.bounds.low);
    of_node.far = FAR * FAR * farthest.length_squared();
    (of_node.moment, of_node.next) = (sums.moment, next);
    sums
}

impl Sums {
    fn of(triangles: &[[DVec3; 3]]) -> Self {
        let (mut moment, mut weighted, mut area) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for [a, b, c] in triangles {
            let normal = 0.5 * (*b - *a).cross(*c - *a);
            moment += normal;
            weighted += normal.length() * (*a + *b + *c) / 3.0;
            area += normal.length();
        }
        Self { moment, weighted, area, bounds: triangles.iter().flatten().copied().collect() }
    }

    fn with(&self, other: &Self) -> Self {
        Self {
            moment: self.moment + other.moment,
            weighted: self.weighted + other.weighted,
            area: self.area + other.area,
            bounds: Bounds {
                low: self.bounds.low.min(other.bounds.low),
                high: self.bounds.high.max(other.bounds.high),
            },
        }
    }
}

/// The solid angle under which a triangle is seen from the origin, negative where that is outside of it (van Oosterom
/// and Strackee 1983).
pub(super) fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    let lengths = [a, b, c].map(DVec3::length);
    let [of_a, of_b, of_c] = lengths;
    let product: f64 = lengths.iter().product();
    2.0 * a.dot(b.cross(c)).atan2(product + a.dot(b) * of_c + b.dot(c) * of_a + c.dot(a) * of_b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// A sphere of radius 1 about the origin, or the part of it below a plane z.
    fn sphere(top: f64, n: usize) -> Winding {
        let at = |i: usize, j: usize| {
            let (a, z) = (TAU * i as f64 / n as f64, -1.0 + (top + 1.0) * (j as f64 / n as f64));
            let r = (1.0 - z * z).max(0.0).sqrt();
            DVec3::new(r * a.cos(), r * a.sin(), z)
        };
        let cell = |k: usize| {
            let (i, j) = (k / n, k % n);
            let [a, b, c, d] = [at(i, j), at((i + 1) % n, j), at((i + 1) % n, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        };
        Winding::new((0..n * n).flat_map(cell).collect())
    }

    #[test]
    fn a_closed_surface_has_one_inside_and_nothing_outside() {
        let ball = sphere(1.0, 100);
        for k in 0..200 {
            let direction = DVec3::new((k as f64).sin(), (2.3 * k as f64).cos(), (0.7 * k as f64).sin()).normalize();
            for (distance, number) in [(0.0, 1.0), (0.5, 1.0), (0.99, 1.0), (1.01, 0.0), (3.0, 0.0)] {
                let found = ball.at(distance * direction);
                assert!((found - number).abs() < 0.04, "{direction} {distance}: {found}");
            }
        }
    }

    #[test]
    fn an_open_surface_has_the_part_of_the_directions_in_which_it_is_met() {
        // From the centre a cap of height h is seen under the solid angle 2 pi h.
        for (top, number) in [(0.0, 0.5), (0.5, 0.75), (-0.5, 0.25)] {
            let found = sphere(top, 100).at(DVec3::ZERO);
            assert!((found - number).abs() < 0.03, "{top}: {found}");
        }
    }

    #[test]
    fn dipoles_agree_with_the_sum_over_all_triangles() {
        let bowl = sphere(0.3, 60);
        for k in 0..100 {
            let k = f64::from(k);
            let place = DVec3::new(1.3 * k.sin(), 1.3 * (1.7 * k).cos(), 1.2 * (0.3 * k).sin());
            let exact = bowl.triangles.iter().map(|t| solid_angle(t.map(|p| p - place))).sum::<f64>() / (4.0 * PI);
            let found = bowl.at(place);
            assert!((found - exact).abs() < 0.04, "{place}: {found}, not {exact}");
        }
    }
}
