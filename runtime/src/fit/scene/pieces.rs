//! The pieces of a scene that may be the object: clusters of dense points, without a plane on which they stand.

use crate::disjoint_sets::DisjointSets;
use crate::fit::tuning::{
    CLUSTER_DENSEST, CLUSTER_NEIGHBOURS, CLUSTER_REACH, PIECE_POINTS, PIECE_SHARE, PIECES, SCENE_POINTS, SUPPORT_SHARE,
};
use crate::scan::{Neighbours, Scan};
use glam::DVec3;
use rayon::prelude::*;

/// The vertices of every piece as marks, largest piece first; none where the scan is one piece.
pub(super) fn of(scan: &Scan) -> Vec<Vec<bool>> {
    let count = scan.mesh.positions.len();
    let support = super::remainder::plane(scan, &vec![true; count]).filter(|on| share(on) > SUPPORT_SHARE);
    let rest: Vec<usize> = (0..count).filter(|i| !support.as_ref().is_some_and(|on| on[*i])).collect();
    let step = rest.len().div_ceil(SCENE_POINTS).max(1);
    let sample: Vec<[f64; 3]> = rest.iter().step_by(step).map(|i| scan.mesh.positions[*i]).collect();
    let clusters = Clusters::of(&sample);
    let mut pieces: Vec<Vec<bool>> = clusters.largest.iter().map(|_| vec![false; count]).collect();
    let tree = Neighbours::new(&sample);
    let piece_of: Vec<Option<usize>> =
        rest.par_iter().map(|i| clusters.piece_at(&tree, &sample, scan.mesh.positions[*i])).collect();
    for (i, piece) in rest.iter().zip(piece_of) {
        if let Some(piece) = piece {
            pieces[piece][*i] = true;
        }
    }
    let worth = |piece: &Vec<bool>| {
        let points = piece.iter().filter(|k| **k).count();
        points >= PIECE_POINTS && share(piece) < 1.0 - PIECE_SHARE
    };
    pieces.retain(worth);
    pieces
}

/// The vertices around which there are much fewer others than on the densest surfaces.
pub(super) fn isolated(scan: &Scan) -> Vec<bool> {
    let positions = &scan.mesh.positions;
    let step = positions.len().div_ceil(SCENE_POINTS).max(1);
    let sample: Vec<[f64; 3]> = positions.iter().step_by(step).copied().collect();
    let clusters = Clusters::of(&sample);
    let tree = Neighbours::new(&sample);
    positions.par_iter().map(|at| clusters.at(&tree, &sample, *at).is_none()).collect()
}

/// The share of the vertices that are marked.
fn share(marks: &[bool]) -> f64 {
    marks.iter().filter(|mark| **mark).count() as f64 / marks.len().max(1) as f64
}

/// Clusters by density (DBSCAN; Ester, Kriegel, Sander and Xu 1996).
struct Clusters {
    /// Of every point, the cluster; points in sparse places have none.
    label: Vec<Option<u32>>,
    /// How far neighbours in a cluster are from each other at most. Millimetres.
    reach: f64,
    /// The labels of the largest clusters.
    largest: Vec<u32>,
}

impl Clusters {
    /// The density is that of the densest part of the points.
    fn of(points: &[[f64; 3]]) -> Self {
        let tree = Neighbours::new(points);
        let near: Vec<Vec<u32>> = points.par_iter().map(|p| tree.nearest(*p, CLUSTER_NEIGHBOURS + 1)).collect();
        let distance = |i: usize, j: u32| DVec3::from(points[i]).distance(points[j as usize].into());
        let farthest: Vec<f64> =
            near.iter().enumerate().map(|(i, n)| n.last().map_or(0.0, |j| distance(i, *j))).collect();
        let mut sorted = farthest.clone();
        sorted.sort_by(f64::total_cmp);
        let reach =
            CLUSTER_REACH * sorted.get((CLUSTER_DENSEST * sorted.len() as f64) as usize).copied().unwrap_or(0.0);
        let is_dense = |i: usize| farthest[i] <= reach;
        let mut sets = DisjointSets::new(points.len());
        for i in (0..points.len()).filter(|i| is_dense(*i)) {
            for j in near[i].iter().filter(|j| is_dense(**j as usize)) {
                sets.join(i as u32, *j);
            }
        }
        let label: Vec<Option<u32>> = (0..points.len()).map(|i| is_dense(i).then(|| sets.root(i as u32))).collect();
        let mut sizes = vec![0_usize; points.len()];
        label.iter().flatten().for_each(|l| sizes[*l as usize] += 1);
        let mut largest: Vec<u32> = (0..points.len() as u32).filter(|l| sizes[*l as usize] > 0).collect();
        largest.sort_by_key(|l| (std::cmp::Reverse(sizes[*l as usize]), *l));
        let least = PIECE_SHARE * points.len() as f64;
        largest.retain(|l| sizes[*l as usize] as f64 > least);
        largest.truncate(PIECES);
        Self { label, reach, largest }
    }

    /// Which of the largest clusters a place belongs to.
    fn piece_at(&self, tree: &Neighbours, points: &[[f64; 3]], at: [f64; 3]) -> Option<usize> {
        let label = self.at(tree, points, at)?;
        self.largest.iter().position(|l| *l == label)
    }

    /// The cluster of a place: that of the nearest point, if that is near.
    fn at(&self, tree: &Neighbours, points: &[[f64; 3]], at: [f64; 3]) -> Option<u32> {
        let nearest = *tree.nearest(at, 1).first()? as usize;
        let is_near = DVec3::from(points[nearest]).distance(at.into()) <= self.reach;
        self.label[nearest].filter(|_| is_near)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_grids_in_dust_are_two_clusters() {
        let grid = |x: f64| (0..400).map(move |i| [x + f64::from(i % 20), f64::from(i / 20), 0.0]);
        let dust = (0..40).map(|i| [f64::from(i % 5) * 11.0, f64::from(i / 5) * 9.0, 15.0]);
        let points: Vec<[f64; 3]> = grid(0.0).chain(grid(40.0)).chain(dust).collect();
        let clusters = Clusters::of(&points);
        assert_eq!(clusters.largest.len(), 2);
        let tree = Neighbours::new(&points);
        let at = |p: [f64; 3]| clusters.piece_at(&tree, &points, p);
        assert!(at([3.2, 4.1, 0.1]).is_some() && at([3.2, 4.1, 0.1]) != at([45.0, 4.0, 0.0]));
        assert_eq!(at([22.0, 18.0, 15.0]), None);
    }
}
