//! Points of a cloud that lie on no surface: dust, spray, mixed pixels at edges, clutter.

use super::neighbours::Neighbours;
use super::normals::variation;
use glam::DVec3;
use rayon::prelude::*;

/// Neighbours that are looked at.
const NEIGHBOURS: usize = 9;
/// The density of the cloud's surfaces is what this share of the points have at least: clutter may be most of a scan.
const DENSEST: f64 = 0.2;
/// A stray's neighbours are so many times as far away as those of the densest points,
const SPARSE: f64 = 2.0;
/// and vary across their plane by more than this share of their variance. Of nine points spread over a ball a share below it
/// is rare (1 %), as is one above it of points on a surface.
const THICK: f64 = 0.025;

/// Of some points of a cloud, by index, whether they are strays: sparse, and with neighbours that lie in no plane.
pub(crate) fn strays(tree: &Neighbours, positions: &[[f64; 3]], which: &[u32]) -> Vec<bool> {
    let around: Vec<(f64, f64)> = which.par_iter().map(|i| surroundings(tree, positions, *i)).collect();
    let mut reaches: Vec<f64> = around.iter().map(|a| a.0).collect();
    if reaches.is_empty() {
        return Vec::new();
    }
    let rank = (DENSEST * reaches.len() as f64) as usize;
    let dense = *reaches.select_nth_unstable_by(rank, f64::total_cmp).1;
    around.iter().map(|(reach, thickness)| *reach > SPARSE * dense && *thickness > THICK).collect()
}

/// How far a point's neighbours are, in millimetres, and the share of their variance that is across their plane.
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
    fn clutter_is_told_from_surfaces_dense_and_sparse() {
        let mut random = ChaCha8Rng::seed_from_u64(8);
        let mut ball = |radius: f64| loop {
            let p: [f64; 3] = std::array::from_fn(|_| random.random_range(-1.0..1.0));
            let length = p.iter().map(|c| c * c).sum::<f64>().sqrt();
            if length > 0.1 && length < 1.0 {
                return (p.map(|c| c * radius / length), p.map(|c| 2.0 * c * radius));
            }
        };
        // Points on a sphere of radius 40, dense above and with a fifth of that density below; as many in the ball around it.
        let sphere: Vec<[f64; 3]> = (0..6000)
            .map(|_| ball(40.0).0)
            .enumerate()
            .filter(|(i, p)| p[2] > 0.0 || i % 5 == 0)
            .map(|x| x.1)
            .collect();
        let clutter: Vec<[f64; 3]> = (0..sphere.len()).map(|_| ball(40.0).1).collect();
        let all = [sphere.clone(), clutter].concat();
        let which: Vec<u32> = (0..all.len() as u32).collect();
        let found = strays(&Neighbours::new(&all), &all, &which);
        let share = |of: &[bool]| of.iter().filter(|s| **s).count() as f64 / of.len() as f64;
        let (on, off) = found.split_at(sphere.len());
        assert!(share(on) < 0.1 && share(off) > 0.85, "{} of the sphere, {} of the clutter", share(on), share(off));
        let found = strays(&Neighbours::new(&sphere), &sphere, &which[..sphere.len()]);
        assert!(share(&found) < 0.01, "{} of a clean sphere", share(&found));
    }
}
