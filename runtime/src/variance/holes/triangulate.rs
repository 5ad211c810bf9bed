//! Triangles that close a loop of points.

use glam::DVec3;

/// Loops of more points are first split along a short chord: the best triangulation takes cubic time.
const MOST: usize = 96;

/// Triangles, as indices of points, that close a loop: the triangulation without new vertices of the least area
/// (Barequet and Sharir, 'Filling gaps in the boundary of a polyhedron', 1995), or if several are equal, as for a plane
/// loop, the one with short edges. The triangles have the orientation of the loop.
pub(super) fn fill(points: &[DVec3]) -> Vec<[u32; 3]> {
    let mut triangles = Vec::with_capacity(points.len().saturating_sub(2));
    let mut open: Vec<Vec<u32>> = vec![(0..points.len() as u32).collect()];
    while let Some(part) = open.pop() {
        if part.len() > MOST {
            let (i, j) = chord(points, &part);
            open.push(part[j..].iter().chain(&part[..=i]).copied().collect());
            open.push(part[i..=j].to_vec());
        } else if part.len() >= 3 {
            least_area(points, &part, &mut triangles);
        }
    }
    triangles
}

/// The shortest chord that leaves at least a quarter of the points on either side.
fn chord(points: &[DVec3], part: &[u32]) -> (usize, usize) {
    let (count, quarter) = (part.len(), part.len() / 4);
    let at = |i: usize| points[part[i] as usize];
    let mut best = (0, count / 2, f64::INFINITY);
    for i in 0..count {
        for j in i + quarter..count.min(i + count - quarter + 1) {
            let length = at(i).distance_squared(at(j));
            if length < best.2 {
                best = (i, j, length);
            }
        }
    }
    (best.0, best.1)
}

/// Dynamic programming over chords: the filling from i to j is a triangle on that chord and the fillings of its two
/// other sides.
fn least_area(points: &[DVec3], part: &[u32], triangles: &mut Vec<[u32; 3]>) {
    let count = part.len();
    let at = |i: usize| points[part[i] as usize];
    let cost = |i: usize, k: usize, j: usize| {
        let (a, b, c) = (at(i), at(k), at(j));
        let edges = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
        // The edges decide if areas are equal, as for a plane loop.
        (b - a).cross(c - a).length() + 1e-3 * edges
    };
    let mut least = vec![0.0; count * count];
    let mut middle = vec![0u32; count * count];
    for span in 2..count {
        for i in 0..count - span {
            let j = i + span;
            let mut best = (f64::INFINITY, i + 1);
            for k in i + 1..j {
                let total = least[i * count + k] + least[k * count + j] + cost(i, k, j);
                if total < best.0 {
                    best = (total, k);
                }
            }
            (least[i * count + j], middle[i * count + j]) = (best.0, best.1 as u32);
        }
    }
    let mut open = vec![(0, count - 1)];
    while let Some((i, j)) = open.pop() {
        if j - i >= 2 {
            let k = middle[i * count + j] as usize;
            triangles.push([part[i], part[k], part[j]]);
            open.extend([(i, k), (k, j)]);
        }
    }
}
