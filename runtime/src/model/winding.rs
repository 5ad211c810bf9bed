//! The generalized winding number of triangles (Jacobson, Kavan and Sorkine-Hornung 2013), by dipoles where they are
//! far off (Barill, Dickson, Schmidt, Levin and Jacobson 2018).

use crate::mesh::Bounds;
use glam::DVec3;
use std::f64::consts::PI;
use std::ops::Range;

/// A node stands for its triangles at places farther off than so many times its radius: the number is then good to
/// some hundredths, where a quarter would be a wrong answer.
const FAR: f64 = 2.0;

/// The most triangles of a leaf.
const LEAF: usize = 4;

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
    pub(crate) fn new(mut triangles: Vec<[DVec3; 3]>) -> Self {
        let mut nodes = Vec::with_capacity(triangles.len());
        if !triangles.is_empty() {
            build(&mut triangles, 0, &mut nodes);
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

/// Adds the nodes over `triangles`, of which the first has the number `first`, and sorts them into leaves.
fn build(triangles: &mut [[DVec3; 3]], first: usize, nodes: &mut Vec<Node>) {
    let node = nodes.len();
    nodes.push(Node::of(triangles));
    if triangles.len() <= LEAF {
        nodes[node].leaf = first..first + triangles.len();
    } else {
        let middle = |t: &[DVec3; 3]| (t[0] + t[1] + t[2]) / 3.0;
        let axis = triangles.iter().map(middle).collect::<Bounds>().longest_axis();
        let half = triangles.len() / 2;
        triangles.select_nth_unstable_by(half, |a, b| middle(a)[axis].total_cmp(&middle(b)[axis]));
        let (low, high) = triangles.split_at_mut(half);
        build(low, first, nodes);
        build(high, first + half, nodes);
    }
    nodes[node].next = nodes.len();
}

impl Node {
    /// The node that stands for some triangles, as long as nothing is below it.
    fn of(triangles: &[[DVec3; 3]]) -> Self {
        let (mut moment, mut weighted, mut area) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for [a, b, c] in triangles {
            let normal = 0.5 * (*b - *a).cross(*c - *a);
            moment += normal;
            weighted += normal.length() * (*a + *b + *c) / 3.0;
            area += normal.length();
        }
        let corners = || triangles.iter().flatten();
        let centre = if area > 0.0 { weighted / area } else { corners().copied().collect::<Bounds>().centre() };
        let radius = corners().map(|p| p.distance_squared(centre)).fold(0.0, f64::max);
        Self { centre, moment, far: FAR * FAR * radius, next: 0, leaf: 0..0 }
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
