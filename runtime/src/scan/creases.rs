//! Normals at sharp edges of a reference mesh: a box of eight vertices has one normal at each of its corners, 55
//! degrees off all of its faces, and distances along such normals are those of no face.

use super::connected::Connected;
use super::raw::RawMesh;
use crate::disjoint_sets::DisjointSets;
use crate::mesh::{TriangleMesh, angle_at};
use glam::DVec3;
use rayon::prelude::*;

/// Cosine of the largest angle between two triangles of one smooth surface, 30 degrees: tessellations of round things
/// turn by less, chamfers by more.
const SMOOTH: f64 = 0.866;
/// Cosine of the largest angle between a triangle and the normal that its file has at a corner, 20 degrees: a prism of
/// twelve sides that stands for a cylinder has 15.
const OWN: f64 = 0.94;

/// A triangle about a vertex.
struct Sector {
    triangle: u32,
    /// Which of its corners the vertex is.
    corner: usize,
    normal: DVec3,
    /// Of the corner. Radians.
    angle: f64,
    /// The smooth surface to which it belongs: the number of its first sector.
    group: u32,
}

/// Gives corners at sharp edges the normal of the smooth surface on their side. Vertices have unit normals, which are
/// the file's if it has any (`given`): these stay where they fit the triangle.
pub(super) fn split_at_creases(mut raw: RawMesh, given: bool) -> RawMesh {
    let mesh = TriangleMesh {
        positions: std::mem::take(&mut raw.positions),
        triangles: std::mem::take(&mut raw.triangles),
        ..TriangleMesh::default()
    };
    let own = |triangle: u32, corner: usize| {
        let vertex = mesh.triangles[triangle as usize][corner] as usize;
        DVec3::from(raw.corner_normals.get(triangle as usize).map_or(raw.normals[vertex], |of| of[corner]))
    };
    let connected = Connected::new(&mesh);
    let at_vertex = |vertex: usize| {
        let sectors = sectors(vertex, &mesh, &connected);
        let mut changed = Vec::new();
        for sector in &sectors {
            let own = own(sector.triangle, sector.corner);
            let along = own.dot(sector.normal);
            let fits = if given { along.abs() >= OWN } else { sectors.iter().all(|other| other.group == sector.group) };
            let of_group = sectors.iter().filter(|other| other.group == sector.group);
            let sum: DVec3 = of_group.map(|other| other.angle * other.normal).sum();
            if !fits && let Some(mean) = sum.try_normalize() {
                let normal = if given && along < 0.0 { -mean } else { mean };
                changed.push((sector.triangle as usize, sector.corner, normal.to_array()));
            }
        }
        changed
    };
    let changed: Vec<_> = (0..mesh.positions.len()).into_par_iter().flat_map_iter(at_vertex).collect();
    if !changed.is_empty() && raw.corner_normals.is_empty() {
        raw.corner_normals = mesh.triangles.iter().map(|t| t.map(|v| raw.normals[v as usize])).collect();
    }
    for (triangle, corner, normal) in changed {
        raw.corner_normals[triangle][corner] = normal;
    }
    RawMesh { positions: mesh.positions, triangles: mesh.triangles, ..raw }
}

/// The triangles at a vertex that have an area.
fn sectors(vertex: usize, mesh: &TriangleMesh, connected: &Connected) -> Vec<Sector> {
    let sector = |t: &u32| {
        let triangle = mesh.triangles[*t as usize];
        let normal = mesh.triangle_normal(triangle)?;
        let corner = triangle.iter().position(|v| *v as usize == vertex)?;
        Some(Sector { triangle: *t, corner, normal, angle: angle_at(&mesh.corners(triangle), corner), group: 0 })
    };
    let mut sectors: Vec<Sector> = connected.triangles_at(vertex).iter().filter_map(sector).collect();
    join(&mut sectors, mesh);
    sectors
}

/// Finds the groups of the sectors of a vertex: those that hang together by edges that are not sharp.
fn join(sectors: &mut [Sector], mesh: &TriangleMesh) {
    let other_ends = |(i, sector): (usize, &Sector)| {
        let triangle = mesh.triangles[sector.triangle as usize];
        [1, 2].map(|k| (triangle[(sector.corner + k) % 3], i))
    };
    let mut edges: Vec<(u32, usize)> = sectors.iter().enumerate().flat_map(other_ends).collect();
    edges.sort_unstable();
    let mut groups = DisjointSets::new(sectors.len());
    for pair in edges.windows(2) {
        let [(end, a), (other, b)] = [pair[0], pair[1]];
        if end == other && sectors[a].normal.dot(sectors[b].normal) >= SMOOTH {
            groups.join(a as u32, b as u32);
        }
    }
    sectors.iter_mut().enumerate().for_each(|(i, sector)| sector.group = groups.root(i as u32));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A prism of `sides` sides about the z axis with lids, each vertex once.
    fn prism(sides: u32) -> RawMesh {
        let rim = |k: u32, z: f64| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(sides)).sin_cos();
            [10.0 * cos, 10.0 * sin, z]
        };
        let mut positions: Vec<[f64; 3]> =
            (0..2 * sides).map(|i| rim(i % sides, f64::from(i / sides) * 20.0)).collect();
        positions.extend([[0.0, 0.0, 0.0], [0.0, 0.0, 20.0]]);
        let (low, high) = (2 * sides, 2 * sides + 1);
        let side = |k: u32| {
            let next = (k + 1) % sides;
            [[k, next, sides + next], [k, sides + next, sides + k], [low, next, k], [high, sides + k, sides + next]]
        };
        RawMesh { positions, triangles: (0..sides).flat_map(side).collect(), ..RawMesh::default() }
    }

    fn smooth(raw: &RawMesh) -> Vec<[f64; 3]> {
        let (positions, triangles) = (raw.positions.clone(), raw.triangles.clone());
        TriangleMesh { positions, triangles, ..TriangleMesh::default() }.vertex_normals()
    }

    /// The largest angle between a corner's normal and its triangle's, in degrees.
    fn largest_angle(mesh: &TriangleMesh) -> f64 {
        let angle = |t: &[u32; 3]| {
            let normal = mesh.triangle_normal(*t).unwrap();
            t.iter().map(|v| DVec3::from(mesh.normals[*v as usize]).angle_between(normal)).fold(0.0, f64::max)
        };
        mesh.triangles.iter().map(angle).fold(0.0, f64::max).to_degrees()
    }

    #[test]
    fn sharp_edges_part_their_faces_and_others_do_not() {
        // A prism of four sides, a box, and one of 24, a cylinder whose sides turn by 15 degrees.
        for (sides, vertices, most) in [(4, 4 * 6 + 2, 1e-5), (24, 24 * 4 + 2, 7.51)] {
            for given in [false, true] {
                let raw = prism(sides);
                let normals = smooth(&raw);
                let mesh = split_at_creases(RawMesh { normals, ..raw }, given).split_corners().0;
                assert_eq!(mesh.positions.len(), vertices, "{sides} {given}");
                assert!(largest_angle(&mesh) < most, "{sides} {given}: {}", largest_angle(&mesh));
            }
        }
    }

    #[test]
    fn normals_of_a_file_stay_where_they_fit_and_keep_their_side() {
        let raw = prism(24);
        // Inside out: the file's normals say so, whatever the order of corners.
        let normals: Vec<[f64; 3]> = smooth(&raw).iter().map(|n| n.map(|c| -c)).collect();
        let mesh = split_at_creases(RawMesh { normals, ..raw }, true).split_corners().0;
        let inward = |t: &[u32; 3]| {
            let normal = mesh.triangle_normal(*t).unwrap();
            t.iter().all(|v| DVec3::from(mesh.normals[*v as usize]).dot(normal) < -0.99)
        };
        assert!(mesh.triangles.iter().all(inward));
    }

    #[test]
    fn a_smooth_mesh_is_left_alone() {
        let raw = RawMesh {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.1], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..RawMesh::default()
        };
        let normals = smooth(&raw);
        let split = split_at_creases(RawMesh { normals, ..raw }, false);
        assert!(split.corner_normals.is_empty() && split.positions.len() == 4);
    }
}
