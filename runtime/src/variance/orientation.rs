//! The orientation of the parts' normals, decided by the scan.

use crate::bvh::Bvh;
use crate::mesh::TriangleMesh;
use crate::model::Texels;

/// Sampled texels per part.
const SAMPLES: usize = 2000;

/// Turns the normals of parts that point into the material; returns the names of these parts.
///
/// A script may parametrise a surface so that its normals point into the material, and a mesh from elsewhere may be
/// wound the wrong way round. Signs of deviations would then be wrong and every triangle of the scan would seem to face
/// away. For a sample of every part's texels the closest point of the scan (at most `max_distance` away) is found; a
/// part is turned if most of the scan's normals there are opposite to its own. Only the nearer half of the sample
/// votes, so that neither the other side of a wall nor gross deviations decide. The model's `mesh` has one group per
/// part, in the order of the texels' parts; its triangles and normals are turned likewise.
pub(in crate::variance) fn agree_with_scan(
    texels: &mut Texels,
    mesh: &mut TriangleMesh,
    scan: &TriangleMesh,
    bvh: &Bvh,
    max_distance: f64,
) -> Vec<String> {
    let samples = texels.samples_of_parts(SAMPLES);
    let turned: Vec<bool> =
        samples.iter().map(|sample| points_inwards(texels, sample, scan, bvh, max_distance)).collect();
    for (i, &part) in texels.part.iter().enumerate() {
        if turned[part as usize] {
            texels.normal[i] = texels.normal[i].map(|c| -c);
        }
    }
    turn_groups(mesh, &turned);
    texels.part_names.iter().zip(&turned).filter(|(_, t)| **t).map(|(n, _)| n.clone()).collect()
}

fn points_inwards(texels: &Texels, sample: &[usize], scan: &TriangleMesh, bvh: &Bvh, max_distance: f64) -> bool {
    let mut votes: Vec<(f64, f64)> = sample
        .iter()
        .filter_map(|&i| {
            let closest = bvh.closest_point(texels.position[i].into(), max_distance)?;
            let normal = scan.triangle_normal(*scan.triangles.get(closest.triangle as usize)?)?;
            let cosine: f64 = (0..3).map(|k| normal[k] * f64::from(texels.normal[i][k])).sum();
            // Edges, and whatever stands across the surface, do not vote.
            (cosine.abs() > 0.5).then_some((closest.distance, cosine.signum()))
        })
        .collect();
    votes.sort_by(|a, b| a.0.total_cmp(&b.0));
    votes.truncate(votes.len().div_ceil(2));
    votes.iter().map(|v| v.1).sum::<f64>() < 0.0
}

/// Turns the triangles and normals of some groups. Groups do not share vertices.
fn turn_groups(mesh: &mut TriangleMesh, turned: &[bool]) {
    let mut vertices = vec![false; mesh.positions.len()];
    for (group, _) in mesh.groups.iter().zip(turned).filter(|(_, t)| **t) {
        for triangle in &mut mesh.triangles[group.start..group.end] {
            triangle.swap(1, 2);
            for &v in triangle.iter() {
                vertices[v as usize] = true;
            }
        }
    }
    for (normal, _) in mesh.normals.iter_mut().zip(vertices).filter(|(_, v)| *v) {
        *normal = normal.map(|c| -c);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::ReferenceSurface;

    /// A closed box, wound outwards or inwards.
    fn box_mesh(size: f64, outwards: bool) -> TriangleMesh {
        let positions = (0..8).map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 1 { size } else { -size })).collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let wind = |t: [u32; 3]| if outwards { t } else { [t[0], t[2], t[1]] };
        let triangles = quads.iter().flat_map(|q| [wind([q[0], q[1], q[2]]), wind([q[0], q[2], q[3]])]).collect();
        TriangleMesh { positions, triangles, ..TriangleMesh::default() }
    }

    #[test]
    fn a_reference_wound_inwards_is_turned_and_one_wound_outwards_is_not() {
        let scan = box_mesh(10.5, true);
        let bvh = Bvh::build(&scan).expect("a box");
        for outwards in [true, false] {
            let mut surface = ReferenceSurface::new(&box_mesh(10.0, outwards), 64).expect("a box");
            let turned = agree_with_scan(&mut surface.texels, &mut surface.tessellation.mesh, &scan, &bvh, 5.0);
            assert_eq!(turned.is_empty(), outwards);
            for (p, n) in surface.texels.position.iter().zip(&surface.texels.normal) {
                assert!((0..3).map(|k| p[k] * f64::from(n[k])).sum::<f64>() > 0.0);
            }
            let mesh = &surface.tessellation.mesh;
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|i| glam::DVec3::from(mesh.positions[i as usize]));
                assert!((b - a).cross(c - a).dot(a) > 0.0);
            }
        }
    }
}
