//! Scraps of a scan: pieces of few triangles, such as are left over in crevices and at the borders of views.

use crate::disjoint_sets::DisjointSets;
use crate::mesh::TriangleMesh;

/// A scrap has at most so many triangles. What stopped rays in crevices of virtual scans of four examples, and faced
/// another way than the surface beside it, were pieces of 1 to 20 triangles.
const TRIANGLES: u32 = 32;

/// By vertex of a scan, whether it is of a scrap. None is where scraps are half of the triangles or more: in a file
/// whose triangles do not share vertices, pieces say nothing.
pub(super) fn scraps(scan: &TriangleMesh) -> Vec<bool> {
    let count = scan.positions.len();
    let mut sets = DisjointSets::new(count);
    for [a, b, c] in &scan.triangles {
        sets.join(*a, *b);
        sets.join(*a, *c);
    }
    let mut triangles = vec![0_u32; count];
    scan.triangles.iter().for_each(|t| triangles[sets.root(t[0]) as usize] += 1);
    let of_scraps: u32 = triangles.iter().filter(|n| **n <= TRIANGLES).sum();
    if 2 * of_scraps as usize >= scan.triangles.len() {
        return vec![false; count];
    }
    (0..count as u32).map(|vertex| triangles[sets.root(vertex) as usize] <= TRIANGLES).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles side by side, of which those in one strip share vertices.
    fn strips(lengths: &[u32]) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        for length in lengths {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend((0..length + 2).map(|k| [f64::from(k), f64::from(k % 2), 0.0]));
            mesh.triangles.extend((first..first + length).map(|k| [k, k + 1, k + 2]));
        }
        mesh
    }

    #[test]
    fn pieces_of_few_triangles_are_scraps() {
        let found = scraps(&strips(&[TRIANGLES + 1, 1, TRIANGLES]));
        let large = TRIANGLES as usize + 3;
        assert_eq!(found.iter().position(|scrap| *scrap), None, "half of the triangles are scraps");
        let found = scraps(&strips(&[TRIANGLES + 1, 1, TRIANGLES - 1]));
        assert!(found[..large].iter().all(|scrap| !scrap) && found[large..].iter().all(|scrap| *scrap), "{found:?}");
    }

    #[test]
    fn triangles_that_share_nothing_are_no_scraps() {
        assert!(scraps(&strips(&[1; 200])).iter().all(|scrap| !scrap));
    }
}
