//! Outliers of a cloud: points that lie on no surface, such as dust, spray, mixed pixels at edges and clutter.
//!
//! Statistical outlier removal (Rusu et al., 'Towards 3D point cloud based object maps for household environments',
//! 2008) judges by the distances of neighbours alone; here a point must also have neighbours that lie in no plane, so
//! that sparsely scanned surfaces stay.

use super::neighbours::Neighbours;
use super::normals::variation;
use glam::DVec3;
use rayon::prelude::*;

/// The number of neighbours by which a point is judged.
const NEIGHBOURS: usize = 9;
/// The share of the points that have at least the density of the cloud's surfaces: clutter may be most of a scan.
const DENSEST: f64 = 0.2;
/// An outlier's neighbours are farther away than those of the densest points by more than this factor, ...
const SPARSE: f64 = 2.0;
/// ... and more than this share of their variance is across their plane. Of nine points spread over a ball a share
/// below it is rare (1 %), as is one above it of points on a surface.
const THICK: f64 = 0.025;
/// Or fewer than so many of its neighbours have it near them: within so many times the distance of their own farthest
/// one. The neighbours of a point in the middle of nowhere lie in a plane as well, that of the nearest face.
const FEWEST_MUTUAL: usize = 3;
const MUTUAL: f64 = 1.5;

/// Whether points of a cloud, given by their indices, are outliers.
pub(crate) fn outliers(tree: &Neighbours, positions: &[[f64; 3]], indices: &[u32]) -> Vec<bool> {
    let around: Vec<(f64, f64)> = indices.par_iter().map(|i| surroundings(tree, positions, *i)).collect();
    let mut reaches: Vec<f64> = around.iter().map(|a| a.0).collect();
    if reaches.is_empty() {
        return Vec::new();
    }
    let rank = (DENSEST * reaches.len() as f64) as usize;
    let dense = *reaches.select_nth_unstable_by(rank, f64::total_cmp).1;
    let is_outlier = |(index, (reach, thickness)): (&u32, &(f64, f64))| {
        *reach > SPARSE * dense && (*thickness > THICK || is_isolated(tree, positions, *index))
    };
    indices.par_iter().zip(&around).map(is_outlier).collect()
}

/// Whether hardly any of a point's neighbours have it near them.
fn is_isolated(tree: &Neighbours, positions: &[[f64; 3]], index: u32) -> bool {
    let distance = |a: u32, b: u32| DVec3::from(positions[a as usize]).distance(DVec3::from(positions[b as usize]));
    let has_near = |other: &u32| {
        let last = tree.nearest(positions[*other as usize], NEIGHBOURS + 1).last().copied();
        last.is_some_and(|last| distance(*other, index) <= MUTUAL * distance(*other, last))
    };
    let near = tree.nearest(positions[index as usize], NEIGHBOURS + 1);
    near.iter().filter(|other| **other != index).filter(|other| has_near(other)).count() < FEWEST_MUTUAL
}

/// The distance of a point's farthest neighbour in millimetres, and the share of the neighbours' variance across their
/// plane.
fn surroundings(tree: &Neighbours, positions: &[[f64; 3]], index: u32) -> (f64, f64) {
    let at = positions[index as usize];
    let near: Vec<DVec3> =
        tree.nearest(at, NEIGHBOURS + 1).iter().map(|i| DVec3::from_array(positions[*i as usize])).collect();
    let reach = near.last().map_or(0.0, |last| last.distance(DVec3::from_array(at)));
    (reach, variation(&near).map_or(0.0, |axes| axes.eigenvalues.min().max(0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn clutter_is_told_from_dense_and_sparse_surfaces() {
        let mut random = ChaCha8Rng::seed_from_u64(8);
        let mut ball = |radius: f64| loop {
            let p: [f64; 3] = std::array::from_fn(|_| random.random_range(-1.0..1.0));
            let length = p.iter().map(|c| c * c).sum::<f64>().sqrt();
            if length > 0.1 && length < 1.0 {
                return (p.map(|c| c * radius / length), p.map(|c| 2.0 * c * radius));
            }
        };
        // Points on a sphere of radius 40, dense above and with a fifth of that density below; as many in the ball
        // around it.
        let sphere: Vec<[f64; 3]> = (0..6000)
            .map(|_| ball(40.0).0)
            .enumerate()
            .filter(|(i, p)| p[2] > 0.0 || i % 5 == 0)
            .map(|x| x.1)
            .collect();
        let clutter: Vec<[f64; 3]> = (0..sphere.len()).map(|_| ball(40.0).1).collect();
        let all = [sphere.clone(), clutter].concat();
        let indices: Vec<u32> = (0..all.len() as u32).collect();
        let found = outliers(&Neighbours::new(&all), &all, &indices);
        let share = |outliers: &[bool]| outliers.iter().filter(|o| **o).count() as f64 / outliers.len() as f64;
        let (on, off) = found.split_at(sphere.len());
        assert!(share(on) < 0.1 && share(off) > 0.85, "{} of the sphere, {} of the clutter", share(on), share(off));
        let found = outliers(&Neighbours::new(&sphere), &sphere, &indices[..sphere.len()]);
        assert!(share(&found) < 0.01, "{} of a clean sphere", share(&found));
    }

    #[test]
    fn points_far_away_are_outliers_though_their_neighbours_lie_in_a_plane() {
        let mut random = ChaCha8Rng::seed_from_u64(9);
        let mut plane: Vec<[f64; 3]> =
            (0..4000).map(|_| [random.random_range(0.0..50.0), random.random_range(0.0..50.0), 0.0]).collect();
        // A part of the plane in which points are a tenth as dense stays, up to its border and its corners.
        plane.extend((0..400).map(|_| [random.random_range(50.0..100.0), random.random_range(0.0..50.0), 0.0]));
        let far = [[25.0, 25.0, 100.0], [-200.0, 25.0, 9.0], [20.0, 300.0, -50.0], [90.0, 10.0, -400.0]];
        let all = [plane.clone(), far.to_vec()].concat();
        let indices: Vec<u32> = (0..all.len() as u32).collect();
        let found = outliers(&Neighbours::new(&all), &all, &indices);
        let (on, off) = found.split_at(plane.len());
        assert!(off.iter().all(|outlier| *outlier), "{off:?}");
        assert!(on.iter().filter(|outlier| **outlier).count() < 5, "{on:?}");
    }
}
