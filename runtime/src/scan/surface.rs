//! A surface through the points of a cloud: localised Delaunay triangulation (Gopi, Krishnan and Silva, 'Surface
//! reconstruction based on lower dimensional localized Delaunay triangulation', 2000).
//!
//! Every point sees its neighbours in its tangent plane, and makes the triangles that it would have in their Delaunay
//! triangulation. A triangle is taken if its corners agree on it: first those that all three make, then those that two
//! make, and what one makes where it closes a gap between others. No directed edge is taken twice, so that the surface
//! neither branches nor folds. No edge is longer than the spacing of the points allows: a hole stays one.
//!
//! It moves no point and adds none. Where the noise is as large as the spacing the triangles zigzag as the points do;
//! at edges sharper than the points can follow, and where their spacing changes abruptly, gaps are left.

use super::attributes::Attributes;
use super::neighbours::Neighbours;
use super::spacing::spacings;
use crate::mesh::{TriangleMesh, renumber_used, retain_marked};
use foldhash::fast::RandomState;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::collections::{BinaryHeap, HashSet};

/// Neighbours that a point looks at: among so many of points spread by chance are all with which it has triangles.
const NEIGHBOURS: usize = 24;

/// Cosine of the largest angle between the normals of neighbours. The two sides of a thin wall have opposite ones.
const ALIKE: f64 = 0.5;

/// Tangent of the largest angle between the tangent plane and the way to a neighbour: what is steeper is another sheet.
const STEEPEST: f64 = 1.0;

/// The longest edge of a triangle, in spacings of the points at its corners: of points spread by chance one edge in
/// 1,000 is longer.
const LONGEST: f64 = 3.0;

/// Weight of a point, as part of the square of the spacing, at most: points on one circle, such as those of a grid, may
/// be divided either way. With weights, which differ from point to point and are the same for all that look at one, all
/// decide alike (a regular triangulation in place of Delaunay's).
const EVENNESS: f64 = 1e-4;

/// Sine of the smallest angle of a triangle at the point that makes it.
const LEAST_SINE: f64 = 1e-6;

/// Makes triangles of a cloud and leaves out the points that are in none; returns by point whether it is in one.
/// `sided` says whether the normals' signs are known; otherwise those of neighbours are made to agree first.
pub(super) fn triangulate(mesh: &mut TriangleMesh, attributes: &mut Attributes, sided: bool) -> Vec<bool> {
    let tree = Neighbours::new(&mesh.positions);
    if !sided {
        agree(&mesh.positions, &mut mesh.normals, &tree);
    }
    let normals: Vec<DVec3> = mesh.normals.iter().map(|n| DVec3::from(*n)).collect();
    let spacing = spacings(&mesh.positions, &tree, |i, j| normals[i].dot(normals[j]) >= ALIKE);
    let cloud = Points { positions: &mesh.positions, normals: &normals, spacing: &spacing };
    let stars: Vec<Vec<[u32; 3]>> = (0..mesh.positions.len())
        .into_par_iter()
        .map(|i| cloud.star(i, &tree.nearest(mesh.positions[i], NEIGHBOURS + 1)))
        .collect();
    mesh.triangles = agreed(stars);
    let used = renumber_used(&mut mesh.triangles, mesh.positions.len());
    retain_marked(&mut mesh.positions, &used);
    retain_marked(&mut mesh.normals, &used);
    attributes.retain_marked(&used);
    used
}

struct Points<'a> {
    positions: &'a [[f64; 3]],
    normals: &'a [DVec3],
    spacing: &'a [f64],
}

impl Points<'_> {
    /// The triangles that a point makes with its neighbours, each with its least corner first, the others behind it
    /// counter-clockwise about the normal.
    fn star(&self, i: usize, near: &[u32]) -> Vec<[u32; 3]> {
        let (place, normal) = (DVec3::from(self.positions[i]), self.normals[i]);
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let weight = |j: usize| EVENNESS * self.spacing[j].powi(2) * mixed(j);
        let seen = |j: &u32| {
            let offset = DVec3::from(self.positions[*j as usize]) - place;
            let at = DVec2::new(offset.dot(tangent), offset.dot(bitangent));
            let is_neighbour = *j as usize != i
                && self.normals[*j as usize].dot(normal) >= ALIKE
                && offset.dot(normal).abs() <= STEEPEST * at.length()
                && at.length_squared() > 0.0;
            let power = at.length_squared() + weight(i) - weight(*j as usize);
            (is_neighbour && power > 0.0).then_some((at / power, *j))
        };
        let inverses: Vec<(DVec2, u32)> = near.iter().filter_map(seen).collect();
        let kept = |[a, b]: &[u32; 2]| self.is_short([i as u32, *a, *b]);
        around(inverses).into_iter().filter(kept).map(|[a, b]| least_first([i as u32, a, b])).collect()
    }

    /// Whether no edge of a triangle is too long.
    fn is_short(&self, triangle: [u32; 3]) -> bool {
        let limit = LONGEST * triangle.iter().map(|v| self.spacing[*v as usize]).sum::<f64>() / 3.0;
        let at = |k: usize| DVec3::from(self.positions[triangle[k % 3] as usize]);
        (0..3).all(|k| at(k).distance(at(k + 1)) <= limit)
    }
}

/// A number from 0 to 1 that has nothing to do with those of other indices (the finaliser of SplitMix64; Steele, Lea
/// and Flood 2014): even sequences would be even along the rows of a grid, too.
fn mixed(index: usize) -> f64 {
    let mut x = (index as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// The pairs of points with which the origin has triangles in the Delaunay triangulation, counter-clockwise: the edges
/// of the convex hull of the points' inverses p / |p|^2 and of the origin, but for those at the origin itself.
fn around(mut inverses: Vec<(DVec2, u32)>) -> Vec<[u32; 2]> {
    const ORIGIN: u32 = u32::MAX;
    inverses.push((DVec2::ZERO, ORIGIN));
    let hull = convex_hull(inverses);
    let edges = (0..hull.len()).map(|k| [hull[k], hull[(k + 1) % hull.len()]]);
    // Two points on a line through the origin have no triangle with it.
    let spans = |[a, b]: &[(DVec2, u32); 2]| a.0.perp_dot(b.0) > LEAST_SINE * a.0.length() * b.0.length();
    edges
        .filter(|edge| spans(edge) && edge.iter().all(|corner| corner.1 != ORIGIN))
        .map(|edge| edge.map(|c| c.1))
        .collect()
}

/// The corners of the convex hull of points with their indices, counter-clockwise (Andrew 1979).
fn convex_hull(mut points: Vec<(DVec2, u32)>) -> Vec<(DVec2, u32)> {
    points.sort_by(|a, b| a.0.x.total_cmp(&b.0.x).then(a.0.y.total_cmp(&b.0.y)).then(a.1.cmp(&b.1)));
    let mut hull: Vec<(DVec2, u32)> = Vec::new();
    let chain = |hull: &mut Vec<(DVec2, u32)>, point: (DVec2, u32), first: usize| {
        let turns_right = |hull: &[(DVec2, u32)]| {
            let [a, b] = [hull[hull.len() - 2].0, hull[hull.len() - 1].0];
            (b - a).perp_dot(point.0 - b) <= 0.0
        };
        while hull.len() >= first + 2 && turns_right(hull) {
            hull.pop();
        }
        hull.push(point);
    };
    points.iter().for_each(|point| chain(&mut hull, *point, 0));
    let first = hull.len().saturating_sub(1);
    points.iter().rev().skip(1).for_each(|point| chain(&mut hull, *point, first));
    hull.pop();
    hull
}

fn least_first(triangle: [u32; 3]) -> [u32; 3] {
    let least = (0..3).min_by_key(|k| triangle[*k]).unwrap_or(0);
    [0, 1, 2].map(|k| triangle[(least + k) % 3])
}

/// The triangles on which their corners agree, in the order of their corners.
fn agreed(stars: Vec<Vec<[u32; 3]>>) -> Vec<[u32; 3]> {
    let mut made: Vec<[u32; 3]> = stars.into_iter().flatten().collect();
    made.par_sort_unstable();
    let votes: Vec<([u32; 3], usize)> = made.chunk_by(|a, b| a == b).map(|run| (run[0], run.len())).collect();
    let edges = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]];
    let mut taken: HashSet<[u32; 2], RandomState> = HashSet::default();
    let mut triangles = Vec::new();
    for fewest in [3, 2, 1] {
        for (triangle, _) in votes.iter().filter(|(_, count)| *count == fewest) {
            let edges = edges(*triangle);
            let beside = edges.iter().filter(|[a, b]| taken.contains(&[*b, *a])).count();
            if edges.iter().any(|edge| taken.contains(edge)) || fewest == 1 && beside < 2 {
                continue;
            }
            taken.extend(edges);
            triangles.push(*triangle);
        }
    }
    triangles.sort_unstable();
    triangles
}

/// Turns normals so that those of neighbours agree, from point to point over the flattest ways first (Hoppe et al.
/// 1992). Pieces that do not hang together keep the side of their first point.
fn agree(positions: &[[f64; 3]], normals: &mut [[f64; 3]], tree: &Neighbours) {
    /// Neighbours to which a side is handed on.
    const NEXT: usize = 10;
    let mut done = vec![false; positions.len()];
    // The angle as a whole number, since heaps need an order.
    let flatness = |a: [f64; 3], b: [f64; 3]| (DVec3::from(a).dot(DVec3::from(b)).abs() * 1e9) as u32;
    for first in 0..positions.len() {
        if done[first] {
            continue;
        }
        let mut ways = BinaryHeap::from([(u32::MAX, std::cmp::Reverse(first), first)]);
        while let Some((_, std::cmp::Reverse(point), from)) = ways.pop() {
            if std::mem::replace(&mut done[point], true) {
                continue;
            }
            if DVec3::from(normals[from]).dot(DVec3::from(normals[point])) < 0.0 {
                normals[point] = normals[point].map(|c| -c);
            }
            for next in tree.nearest(positions[point], NEXT + 1) {
                let next = next as usize;
                let offset = DVec3::from(positions[next]) - DVec3::from(positions[point]);
                let height = offset.dot(DVec3::from(normals[point])).abs();
                // Not through a wall.
                if !done[next] && height <= STEEPEST * (offset.length_squared() - height * height).max(0.0).sqrt() {
                    ways.push((flatness(normals[point], normals[next]), std::cmp::Reverse(next), point));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};
    use std::collections::HashMap;

    /// Numbers of the edges of a triangle mesh that one, and that more than two triangles have.
    fn edges_of(mesh: &TriangleMesh) -> [usize; 2] {
        let mut edges: HashMap<[u32; 2], usize> = HashMap::new();
        for t in &mesh.triangles {
            for k in 0..3 {
                let [a, b] = [t[k], t[(k + 1) % 3]];
                *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
            }
        }
        [edges.values().filter(|n| **n == 1).count(), edges.values().filter(|n| **n > 2).count()]
    }

    fn triangulated(positions: Vec<[f64; 3]>, normals: Vec<[f64; 3]>, sided: bool) -> TriangleMesh {
        let mut mesh = TriangleMesh { positions, normals, ..TriangleMesh::default() };
        triangulate(&mut mesh, &mut Attributes::default(), sided);
        mesh
    }

    /// Points on a sphere of radius 10 by chance, with noise.
    fn ball(count: usize, noise: f64) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let normal = Normal::new(0.0, 1.0).unwrap();
        let mut point = || {
            let direction = DVec3::from([0; 3].map(|_| normal.sample(&mut random))).normalize();
            ((direction * (10.0 + noise * normal.sample(&mut random))).to_array(), direction.to_array())
        };
        (0..count).map(|_| point()).unzip()
    }

    #[test]
    fn a_ball_is_covered_by_a_surface_that_does_not_branch() {
        for (noise, sided) in [(0.0, true), (0.05, true), (0.05, false)] {
            let (positions, mut normals) = ball(5000, noise);
            if !sided {
                normals.iter_mut().skip(1).step_by(2).for_each(|n| *n = n.map(|c| -c));
            }
            let mesh = triangulated(positions, normals, sided);
            let [open, branching] = edges_of(&mesh);
            let whole = 400.0 * std::f64::consts::PI;
            println!("{noise} {sided}: {open} open edges of {}, {}", mesh.triangles.len(), mesh.area() / whole);
            assert_eq!(branching, 0);
            // Noise makes triangles lean: with 0.05 mm to 0.5 mm by a tenth, which adds some 2 % to the area.
            assert!((mesh.area() / whole - 1.0).abs() < 0.04, "{noise}: {}", mesh.area() / whole);
            assert!(open < mesh.triangles.len() / 50, "{noise}: {open}");
            let outward = mesh.triangles.iter().filter(|t| {
                let [a, b, c] = mesh.corners(**t);
                (b - a).cross(c - a).dot(a) > 0.0
            });
            let outward = outward.count();
            assert!(outward == mesh.triangles.len() || outward == 0, "{outward} of {}", mesh.triangles.len());
        }
    }

    #[test]
    fn the_sides_of_a_wall_are_not_joined_and_a_hole_stays_one() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let (mut positions, mut normals) = (Vec::new(), Vec::new());
        while positions.len() < 8000 {
            let side = (positions.len() % 2) as f64;
            let [x, y] = [(); 2].map(|()| random.random_range(0.0..30.0));
            if (x - 15.0f64).hypot(y - 15.0) > 4.0 {
                positions.push([x, y, side]);
                normals.push([0.0, 0.0, 2.0 * side - 1.0]);
            }
        }
        for sided in [true, false] {
            let mesh = triangulated(positions.clone(), normals.clone(), sided);
            let heights = |t: &[u32; 3]| t.map(|v| mesh.positions[v as usize][2]);
            assert!(mesh.triangles.iter().map(heights).all(|[a, b, c]| a == b && b == c), "{sided}");
            let in_hole = |t: &&[u32; 3]| {
                let middle = mesh.corners(**t).iter().sum::<DVec3>() / 3.0;
                (middle.x - 15.0).hypot(middle.y - 15.0) < 3.0
            };
            assert_eq!(mesh.triangles.iter().filter(in_hole).count(), 0);
            // Two squares without a disc each; half a spacing is missing at their borders, 0.2 mm of 145 mm each.
            let whole = 2.0 * (900.0 - 16.0 * std::f64::consts::PI);
            assert!((0.92..1.0).contains(&(mesh.area() / whole)), "{sided}: {}", mesh.area() / whole);
        }
    }

    #[test]
    fn regular_grids_have_no_gaps_and_few_points_no_triangles() {
        let positions: Vec<[f64; 3]> = (0..900).map(|k| [f64::from(k % 30), f64::from(k / 30), 0.0]).collect();
        let mesh = triangulated(positions.clone(), vec![[0.0, 0.0, 1.0]; 900], true);
        assert_eq!(mesh.triangles.len(), 2 * 29 * 29);
        for count in [0, 1, 2] {
            let few = triangulated(positions[..count].to_vec(), vec![[0.0, 0.0, 1.0]; count], true);
            assert!(few.triangles.is_empty() && few.positions.is_empty());
        }
        let line = triangulated(positions[..30].to_vec(), vec![[0.0, 0.0, 1.0]; 30], true);
        assert!(line.triangles.is_empty(), "points on a line have no surface");
    }
}
