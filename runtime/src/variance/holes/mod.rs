//! Closes small holes of a scan, so that no ray passes through them.

mod triangulate;

use crate::mesh::{Bounds, TriangleMesh};
use crate::rims::{self, Rim};
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Rims of more vertices than this are left open: comparing all pairs of them would take too long.
const LONGEST: usize = 20_000;

/// The closed holes of a scan.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::variance) struct FilledHoles {
    /// The triangles that close the holes, with the vertices that they use; oriented like the scan around them.
    pub(in crate::variance) mesh: TriangleMesh,
    /// Figures of the holes.
    pub(in crate::variance) summary: HoleSummary,
}

/// Figures of the holes of a scan.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HoleSummary {
    /// The largest size of a hole that was closed. Millimetres.
    pub size: f64,
    /// Number of holes that were closed.
    pub filled: usize,
    /// Area of the triangles that close them. Square millimetres.
    pub area: f64,
    /// Number of rims that were left open: larger holes (or rims of more than 20,000 vertices), and the outer
    /// boundaries of sheets and of pieces.
    pub open: usize,
}

impl FilledHoles {
    /// Closes every hole of a scan that is at most `size` millimetres across (the largest distance between two vertices
    /// of its rim). The outer boundary of a piece is not a hole, however small: its filling would face away from the
    /// scan around it.
    #[must_use]
    pub(in crate::variance) fn new(scan: &TriangleMesh, size: f64) -> FilledHoles {
        let rims = rims::find(scan);
        let closed: Vec<Option<Vec<[u32; 3]>>> = rims.par_iter().map(|rim| close(scan, rim, size)).collect();
        let mut mesh = scan.submesh(closed.iter().flatten().flatten().copied());
        mesh.normals.clear();
        let filled = closed.iter().flatten().count();
        let summary = HoleSummary { size, filled, area: mesh.area(), open: closed.len() - filled };
        FilledHoles { mesh, summary }
    }
}

/// Triangles that close a rim; none if it is too large or not a hole.
fn close(scan: &TriangleMesh, rim: &Rim, size: f64) -> Option<Vec<[u32; 3]>> {
    let points: Vec<DVec3> = rim.vertices.iter().map(|v| DVec3::from(scan.positions[*v as usize])).collect();
    if !is_within(&points, size) {
        return None;
    }
    let triangles: Vec<[u32; 3]> = triangulate::fill(&points);
    // Compares, along the rim, the normals of the filling with those of the scan on the other side.
    let mut agreement = 0.0;
    for t in &triangles {
        let across =
            (points[t[1] as usize] - points[t[0] as usize]).cross(points[t[2] as usize] - points[t[0] as usize]);
        for k in 0..3 {
            let (a, b) = (t[k] as usize, t[(k + 1) % 3] as usize);
            if b == (a + 1) % points.len() {
                let normal = scan.triangle_normal(scan.triangles[rim.triangles[a] as usize]).unwrap_or_default();
                let along = points[a].distance(points[b]);
                agreement += along * across.normalize_or_zero().dot(normal);
            }
        }
    }
    (agreement > 0.0).then(|| triangles.into_iter().map(|t| t.map(|i| rim.vertices[i as usize])).collect())
}

/// Whether all points are within `size` of each other.
fn is_within(points: &[DVec3], size: f64) -> bool {
    if points.len() > LONGEST {
        return false;
    }
    let bounds: Bounds = points.iter().copied().collect();
    // The diagonal of the box is at most sqrt(3) times the largest distance: this bounds what the loops below cost.
    if bounds.size().max_element() > size {
        return false;
    }
    let limit = size * size;
    bounds.diagonal() <= size
        || points.iter().enumerate().all(|(i, a)| points[..i].iter().all(|b| a.distance_squared(*b) <= limit))
}

#[cfg(test)]
mod tests;
