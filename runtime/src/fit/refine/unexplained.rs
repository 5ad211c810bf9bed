//! The pieces of the scan's surface that a solution does not explain, with the parts of the model that are next to
//! them: something that the script does not have, or these parts are wrong.

use super::schedule::Solution;
use crate::disjoint_sets::DisjointSets;
use crate::fit::correspond::nearest::Query;
use crate::fit::problem::objective::Placed;
use crate::fit::tuning::{
    BESIDE_SAMPLES, BESIDE_SHARE, CLUSTER_NEIGHBOURS, CLUSTER_REACH, LEAST_PIECE, UNEXPLAINED_NEIGHBOURS,
};
use crate::robust::median;
use crate::scan::{Neighbours, Scan};
use glam::DVec3;

/// A connected piece of the scan's surface that lies away from the model.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    /// Its share of the scan's area; of a cloud, of the points.
    pub(crate) share: f64,
    /// Its area; None in a cloud. Square millimetres.
    pub(crate) area: Option<f64>,
    /// Its middle, in the scan's frame. Millimetres.
    pub(crate) place: DVec3,
    /// By patch of the model, whether it is next to the piece.
    pub(crate) beside: Vec<bool>,
}

/// By vertex of the scan, whether it is an inlier. None where the model does not exist.
pub(crate) fn inliers(solution: &Solution) -> Option<Vec<bool>> {
    let Solution { level, estimate, .. } = solution;
    let problem = level.problem;
    // The solution's cache is that of the points that were fitted, which need not be all of them yet.
    let objective = solution.objective(&problem.points);
    let placed = objective.place(estimate).ok()?;
    let mut near = vec![false; problem.scan.mesh.positions.len()];
    for (point, _) in solution.inlier_feet(&objective, &placed) {
        near[problem.points.index[point] as usize] = true;
    }
    Some(near)
}

/// The pieces that are not explained, largest first, by the marks of all inliers among the scan's vertices. None where
/// the model does not exist.
pub(crate) fn pieces(solution: &Solution, inliers: &[bool]) -> Option<Vec<Piece>> {
    let problem = solution.level.problem;
    let scan = problem.scan;
    let clusters = if scan.mesh.triangles.is_empty() { of_cloud(scan, inliers) } else { of_mesh(scan, inliers) };
    let Clusters { mut sets, weight, total } = clusters;
    let roots: Vec<Option<u32>> =
        (0..weight.len() as u32).map(|i| (weight[i as usize] > 0.0).then(|| sets.root(i))).collect();
    let mut sums = vec![0.0; weight.len()];
    for (root, weight) in roots.iter().zip(&weight) {
        if let Some(root) = root {
            sums[*root as usize] += weight;
        }
    }
    let mut largest: Vec<u32> = (0..sums.len() as u32).filter(|i| sums[*i as usize] > LEAST_PIECE * total).collect();
    largest.sort_by(|a, b| sums[*b as usize].total_cmp(&sums[*a as usize]).then(a.cmp(b)));
    let is_mesh = !scan.mesh.triangles.is_empty();
    if largest.is_empty() {
        return Some(Vec::new());
    }
    let objective = solution.objective(&problem.points);
    let placed = objective.place(&solution.estimate).ok()?;
    let piece = |root: u32| {
        let members: Vec<usize> = (0..roots.len()).filter(|i| roots[*i] == Some(root)).collect();
        let points: Vec<DVec3> = members.iter().map(|i| DVec3::from(scan.mesh.positions[*i])).collect();
        let sum = sums[root as usize];
        let weighted = members.iter().zip(&points).map(|(i, p)| weight[*i] * *p).sum::<DVec3>();
        Piece {
            share: sum / total,
            area: is_mesh.then_some(sum),
            place: weighted / sum,
            beside: beside(solution, &placed, &points),
        }
    };
    Some(largest.into_iter().map(piece).collect())
}

/// Sets of vertices that belong together, with the area that each stands for (of a cloud 1), zero of all that are
/// explained or stand alone, and the scan's.
struct Clusters {
    sets: DisjointSets,
    weight: Vec<f64>,
    total: f64,
}

/// Triangles of which no vertex is explained belong together where they share one.
fn of_mesh(scan: &Scan, inliers: &[bool]) -> Clusters {
    let mut sets = DisjointSets::new(inliers.len());
    let mut weight = vec![0.0; inliers.len()];
    let mut total = 0.0;
    for triangle in &scan.mesh.triangles {
        let area = scan.mesh.triangle_area(*triangle);
        total += area;
        if triangle.iter().any(|i| inliers[*i as usize]) {
            continue;
        }
        let [a, b, c] = *triangle;
        sets.join(a, b);
        sets.join(b, c);
        triangle.iter().for_each(|i| weight[*i as usize] += area / 3.0);
    }
    Clusters { sets, weight, total }
}

/// Points belong together that are neighbours, as near to each other as those of surfaces, and most of whose neighbours
/// are not explained either: noise throws single points away from a surface that is explained.
fn of_cloud(scan: &Scan, inliers: &[bool]) -> Clusters {
    let positions = &scan.mesh.positions;
    let tree = Neighbours::new(positions);
    let distance = |i: usize, j: u32| DVec3::from(positions[i]).distance(positions[j as usize].into());
    let farthest = |i: usize, near: &[u32]| near.last().map_or(0.0, |j| distance(i, *j));
    let around = |i: usize| tree.nearest(positions[i], CLUSTER_NEIGHBOURS + 1);
    let step = positions.len().div_ceil(BESIDE_SAMPLES).max(1);
    let mut reaches: Vec<f64> = (0..positions.len()).step_by(step).map(|i| farthest(i, &around(i))).collect();
    let reach = CLUSTER_REACH * median(&mut reaches).unwrap_or(0.0);
    let mut sets = DisjointSets::new(inliers.len());
    let mut weight = vec![0.0; inliers.len()];
    for i in (0..positions.len()).filter(|i| !inliers[*i]) {
        let near = around(i);
        let unexplained: Vec<u32> = near.iter().copied().filter(|j| !inliers[*j as usize]).collect();
        if unexplained.len() < UNEXPLAINED_NEIGHBOURS || farthest(i, &near) > reach {
            continue;
        }
        weight[i] = 1.0;
        unexplained.into_iter().for_each(|j| sets.join(i as u32, j));
    }
    Clusters { sets, weight, total: positions.len() as f64 }
}

/// By patch of the placed model, whether it is the nearest one to a share of some points of the scan.
fn beside(solution: &Solution, placed: &Placed, points: &[DVec3]) -> Vec<bool> {
    let Solution { level, estimate, .. } = solution;
    let mut counts = vec![0; level.problem.model.parts().len()];
    let step = points.len().div_ceil(BESIDE_SAMPLES).max(1);
    let samples = points.iter().step_by(step);
    let least = BESIDE_SHARE * samples.len() as f64;
    for point in samples {
        let q = estimate.motion.rotation.inverse() * (*point - estimate.motion.translation);
        if let Some(nearest) = placed.facets.nearest(Query::new(q, f64::INFINITY)) {
            counts[nearest.patch as usize] += 1;
        }
    }
    counts.into_iter().map(|count| f64::from(count) > least).collect()
}
