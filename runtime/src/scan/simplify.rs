//! Fewer triangles: the vertices in a cube that face the same way become one of them (Rossignac and Borrel,
//! 'Multi-resolution 3D approximations for rendering complex scenes', 1993).
//!
//! What is left are points of the scan, no means, so that its noise stays what it is; the sides of a thin wall face
//! different ways and stay apart. Edges of the object are rounded by up to the cubes' size.

use super::attributes::Attributes;
use super::thinned::mixed;
use crate::mesh::{TriangleMesh, renumber_used, retain_marked};
use foldhash::fast::RandomState;
use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// The first cubes are a little smaller than those that leave the right number of triangles on a plane, where some two
/// triangles belong to a vertex; then they grow by this factor until few enough are left.
const GROWTH: f64 = 1.15;
const BEGIN: f64 = 0.8;

/// Simplifies a mesh to at most `most` triangles, or to the few that the whole mesh in one cube has; of a cloud so many
/// points are kept, each as likely as any other. Returns the number of triangles, or points, that are gone.
pub(super) fn simplify(mesh: &mut TriangleMesh, attributes: &mut Attributes, most: usize) -> usize {
    if mesh.triangles.is_empty() {
        return draw(mesh, attributes, most);
    }
    let before = mesh.triangles.len();
    if before <= most {
        return 0;
    }
    let (area, size) = (mesh.area(), mesh.bounds().diagonal());
    let mut edge = BEGIN * (2.0 * area / most.max(1) as f64).sqrt();
    let mut fewest = Vec::new();
    loop {
        let triangles = merged(mesh, &clusters(mesh, edge));
        // A mesh of which nothing would be left stays as it was before.
        if triangles.is_empty() {
            break;
        }
        fewest = triangles;
        // Once a cube holds all, larger ones change nothing: what faces six ways keeps up to eight triangles.
        if fewest.len() <= most || edge > 2.0 * size {
            break;
        }
        edge *= GROWTH;
    }
    if fewest.is_empty() {
        return 0;
    }
    mesh.triangles = fewest;
    let used = renumber_used(&mut mesh.triangles, mesh.positions.len());
    retain_marked(&mut mesh.positions, &used);
    retain_marked(&mut mesh.normals, &used);
    attributes.retain_marked(&used);
    before - mesh.triangles.len()
}

fn draw(mesh: &mut TriangleMesh, attributes: &mut Attributes, most: usize) -> usize {
    let count = mesh.positions.len();
    if count <= most {
        return 0;
    }
    let mut order: Vec<(u64, usize)> = (0..count).map(|i| (mixed(i as u64), i)).collect();
    order.select_nth_unstable(most);
    let mut kept = vec![false; count];
    order[..most].iter().for_each(|(_, i)| kept[*i] = true);
    retain_marked(&mut mesh.positions, &kept);
    retain_marked(&mut mesh.normals, &kept);
    attributes.retain_marked(&kept);
    count - most
}

/// For every vertex the one that stands for it: of those in its cube that face mainly along the same axis to the same
/// side, the nearest to the cube's middle across that axis. Along it, where the noise is, nothing is preferred.
fn clusters(mesh: &TriangleMesh, edge: f64) -> Vec<u32> {
    let origin = mesh.bounds().low;
    let key = |i: usize| {
        let place = (DVec3::from(mesh.positions[i]) - origin) / edge;
        let normal = DVec3::from(mesh.normals[i]);
        let axis = normal.abs().max_position();
        (place.floor().as_ivec3().to_array(), 2 * axis as u8 + u8::from(normal[axis] < 0.0))
    };
    let off_middle = |i: usize, side: u8| {
        let mut off = ((DVec3::from(mesh.positions[i]) - origin) / edge).fract() - 0.5;
        off[usize::from(side / 2)] = 0.0;
        off.length_squared()
    };
    let keys: Vec<([i32; 3], u8)> = (0..mesh.positions.len()).map(key).collect();
    let mut chosen: HashMap<([i32; 3], u8), (f64, u32), RandomState> = HashMap::default();
    for (i, key) in keys.iter().enumerate() {
        let candidate = (off_middle(i, key.1), i as u32);
        chosen
            .entry(*key)
            .and_modify(|best| {
                if candidate.0 < best.0 {
                    *best = candidate;
                }
            })
            .or_insert(candidate);
    }
    keys.iter().map(|key| chosen[key].1).collect()
}

/// The triangles whose corners are three different vertices, each once, without those that lost their area.
fn merged(mesh: &TriangleMesh, representative: &[u32]) -> Vec<[u32; 3]> {
    let mut seen: HashSet<[u32; 3], RandomState> = HashSet::default();
    let is_new = |t: &[u32; 3]| {
        let mut key = *t;
        key.sort_unstable();
        key[0] != key[1] && key[1] != key[2] && mesh.triangle_normal(*t).is_some() && seen.insert(key)
    };
    mesh.triangles.iter().map(|t| t.map(|v| representative[v as usize])).filter(is_new).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall of 100 x 100 mm, `thickness` mm thick, a vertex a millimetre, without its rim.
    fn wall(thickness: f64) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        for (z, up) in [(0.0, false), (thickness, true)] {
            let first = mesh.positions.len() as u32;
            for i in 0..101 * 101 {
                mesh.positions.push([f64::from(i % 101), f64::from(i / 101), z]);
                mesh.normals.push([0.0, 0.0, if up { 1.0 } else { -1.0 }]);
            }
            for i in (0..100 * 101).filter(|i| i % 101 < 100).map(|i| first + i) {
                let quad = [[i, i + 1, i + 102], [i, i + 102, i + 101]];
                mesh.triangles.extend(quad.map(|[a, b, c]| if up { [a, b, c] } else { [a, c, b] }));
            }
        }
        mesh
    }

    #[test]
    fn a_thin_wall_keeps_both_sides_and_its_area() {
        let mut mesh = wall(0.5);
        let all = mesh.positions.clone();
        let gone = simplify(&mut mesh, &mut Attributes::default(), 2000);
        assert_eq!(gone + mesh.triangles.len(), 40_000);
        assert!((1000..=2000).contains(&mesh.triangles.len()), "{}", mesh.triangles.len());
        // Real vertices; and no triangle joins the sides.
        assert!(mesh.positions.iter().all(|p| all.contains(p)));
        let z = |v: u32| mesh.positions[v as usize][2];
        assert!(mesh.triangles.iter().all(|t| z(t[0]) == z(t[1]) && z(t[1]) == z(t[2])));
        // Only a border of up to a cube is lost.
        assert!((0.8..=1.0).contains(&(mesh.area() / 20_000.0)), "{}", mesh.area());
        // None is folded over.
        let turned = mesh.triangles.iter().filter(|t| mesh.triangle_normal(**t).unwrap().z * (z(t[0]) - 0.25) < 0.0);
        assert_eq!(turned.count(), 0);
    }

    #[test]
    fn fewer_triangles_than_can_be_is_no_endless_work() {
        let mut octahedron = TriangleMesh {
            positions: [-1.0, 1.0].into_iter().flat_map(|s| [[s, 0.0, 0.0], [0.0, s, 0.0], [0.0, 0.0, s]]).collect(),
            triangles: vec![[3, 4, 5], [4, 0, 5], [0, 1, 5], [1, 3, 5], [4, 3, 2], [0, 4, 2], [1, 0, 2], [3, 1, 2]],
            ..TriangleMesh::default()
        };
        octahedron.normals = octahedron.vertex_normals();
        for most in (1..8).rev() {
            simplify(&mut octahedron, &mut Attributes::default(), most);
            assert!((1..=8).contains(&octahedron.triangles.len()), "{most}");
        }
    }

    #[test]
    fn a_cloud_keeps_as_many_points_as_are_asked_for() {
        let mut cloud = TriangleMesh { triangles: Vec::new(), ..wall(1.0) };
        let mut attributes = Attributes { intensities: vec![1.0; cloud.positions.len()], ..Attributes::default() };
        let gone = simplify(&mut cloud, &mut attributes, 500);
        assert_eq!(
            (gone, cloud.positions.len(), cloud.normals.len(), attributes.intensities.len()),
            (19_902, 500, 500, 500)
        );
        assert_eq!(simplify(&mut cloud, &mut attributes, 500), 0);
    }
}
