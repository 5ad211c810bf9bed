//! The scan as the fit sees it: points and normals, and deterministic subsamples that cover it evenly.

use super::weights::Weights;
use crate::fit::tuning::{
    CLEAN_CLOUD, EMPTY_CELL, MOST_SAMPLE_CELLS, OUTLIER_PASSES, OUTLIER_POINTS, SAMPLE_AIM, SAMPLE_COARSER,
    SAMPLE_ENOUGH, SAMPLE_ROUNDS, SAMPLE_SPARSE, SPACING_POINTS, SURFACE_SHARE, WALK_CELLS,
};
use crate::mesh::{Bounds, TriangleMesh};
use crate::morton::morton;
use crate::robust::median;
use crate::scan::{Neighbours, Scan, outliers};
use foldhash::fast::FixedState;
use glam::{DMat3, DVec3, U64Vec3};
use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;

/// Points of a scan. Millimetres.
#[derive(Clone, Debug, Default)]
pub(crate) struct Points {
    pub(crate) position: Vec<DVec3>,
    /// Unit normals, as many as positions, or none.
    pub(crate) normal: Vec<DVec3>,
    /// Normals of the surface about each point, with less noise than its own, likewise.
    pub(crate) around: Vec<DVec3>,
    /// Prior weights, by which points count, as many as positions; none where all count alike. Of all points of a scan
    /// the mean is 1.
    prior: Vec<f64>,
    /// The index of each of them in the scan.
    pub(crate) index: Vec<u32>,
    /// Many outliers, which are sparse, are among them: a sample even in space would consist of these.
    cluttered: bool,
}

impl Points {
    /// All points of a scan, in the order of a walk through cells of space, so that neighbours in the list are
    /// neighbours in space (the search of nearest facets then finds its boxes in the cache).
    pub(crate) fn of(scan: &Scan, weights: Weights) -> Self {
        let position: Vec<DVec3> = scan.mesh.positions.iter().map(|p| DVec3::from_array(*p)).collect();
        let normal: Vec<DVec3> = if scan.mesh.normals.len() == position.len() {
            scan.mesh.normals.iter().map(|n| DVec3::from_array(*n)).collect()
        } else {
            Vec::new()
        };
        let all = Self {
            around: averaged(&scan.mesh, &normal),
            normal,
            prior: weights.of(&scan.mesh, scan.noise),
            index: (0..position.len() as u32).collect(),
            position,
            cluttered: false,
        };
        let bounds = all.bounds();
        let cell = bounds.size().max_element().max(f64::MIN_POSITIVE) / WALK_CELLS;
        let mut order: Vec<(u64, u32)> = all
            .position
            .iter()
            .enumerate()
            .map(|(i, p)| (morton(((*p - bounds.low) / cell).as_u64vec3()), i as u32))
            .collect();
        order.sort_unstable();
        all.pick(order.iter().map(|(_, i)| *i as usize))
    }

    /// Places that all count alike, in their order, without normals.
    pub(crate) fn at(position: Vec<DVec3>) -> Self {
        Self { index: (0..position.len() as u32).collect(), position, ..Self::default() }
    }

    /// The points without outliers; of a large cloud only some of them. The points of a mesh all lie on surfaces.
    pub(crate) fn on_surfaces(&self, scan: &Scan) -> Cow<'_, Self> {
        if !scan.mesh.triangles.is_empty() {
            return Cow::Borrowed(self);
        }
        let all = self.every(OUTLIER_POINTS);
        let mut inliers = all.clone();
        for _ in 0..OUTLIER_PASSES {
            let positions: Vec<[f64; 3]> = inliers.position.iter().map(|p| p.to_array()).collect();
            let indices: Vec<u32> = (0..inliers.len() as u32).collect();
            let outliers = outliers(&Neighbours::new(&positions), &positions, &indices);
            inliers = inliers.pick((0..inliers.len()).filter(|i| !outliers[*i]));
        }
        inliers.cluttered = (inliers.len() as f64) < CLEAN_CLOUD * all.len() as f64;
        Cow::Owned(inliers)
    }

    /// The points at some indices.
    pub(crate) fn pick(&self, indices: impl Iterator<Item = usize> + Clone) -> Self {
        Self {
            position: indices.clone().map(|i| self.position[i]).collect(),
            index: indices.clone().map(|i| self.index[i]).collect(),
            normal: of_points(&self.normal, indices.clone()),
            around: of_points(&self.around, indices.clone()),
            prior: of_points(&self.prior, indices),
            cluttered: self.cluttered,
        }
    }

    /// The number of points.
    pub(crate) fn len(&self) -> usize {
        self.position.len()
    }

    /// The prior weight of a point.
    pub(crate) fn prior(&self, i: usize) -> f64 {
        self.prior.get(i).copied().unwrap_or(1.0)
    }

    /// The sum of the prior weights of some points.
    pub(crate) fn weight_of(&self, range: Range<usize>) -> f64 {
        self.prior.get(range.clone()).map_or(range.len() as f64, |prior| prior.iter().sum())
    }

    /// The sum of all prior weights, by which sums over the points become means. 1 where there are no points.
    pub(crate) fn weight(&self) -> f64 {
        if self.len() == 0 { 1.0 } else { self.weight_of(0..self.len()) }
    }

    /// The same with other prior weights.
    #[cfg(test)]
    pub(crate) fn with_priors(self, prior: Vec<f64>) -> Self {
        Self { prior, ..self }
    }

    /// The number of points that would determine a mean as well if all counted alike.
    pub(crate) fn effective(&self) -> f64 {
        effective((0..self.len()).map(|i| self.prior(i)))
    }

    /// The mean of the points.
    pub(crate) fn mean(&self) -> DVec3 {
        let sum = self.position.iter().enumerate().fold(DVec3::ZERO, |sum, (i, p)| sum + self.prior(i) * *p);
        sum / self.weight()
    }

    /// The median distance from a point to the next one in the list. Millimetres.
    pub(crate) fn spacing(&self) -> f64 {
        let step = (self.len() / SPACING_POINTS).max(1);
        let apart = |i: usize| self.position[i].distance(self.position[i + 1]);
        median(&mut (0..self.len().saturating_sub(1)).step_by(step).map(apart).collect::<Vec<f64>>()).unwrap_or(0.0)
    }

    /// The box around all points.
    fn bounds(&self) -> Bounds {
        self.position.iter().copied().collect()
    }

    /// The radius of gyration: the root mean square distance from the mean.
    pub(crate) fn gyration(&self) -> f64 {
        let mean = self.mean();
        let square = |(i, p): (usize, &DVec3)| self.prior(i) * p.distance_squared(mean);
        (self.position.iter().enumerate().map(square).sum::<f64>() / self.weight()).sqrt()
    }

    /// About `count` points, one per cell of a cubic grid, the one nearest to the cell's centre: even in space,
    /// whatever the scan's density, except for a cluttered cloud, which is sampled by density. Cells with hardly any
    /// points, by their prior weights, are left out: in a dense scan every outlier has a cell of its own, and a
    /// thousandth of the points would be a fifth of the sample. All points of the sample count alike: with the weights
    /// of their cells, in which one point speaks for all surfaces that pass through, searches went astray (0037). All
    /// points, with their weights, where there are not more.
    pub(crate) fn sample(&self, count: usize) -> Self {
        if self.len() <= count {
            return self.clone();
        }
        if self.cluttered {
            return self.every(count);
        }
        let bounds = self.bounds();
        let extent = bounds.size().max_element();
        // The cells that a surface fills grow like the square of their number along an edge.
        let (mut coarse, mut fine) = (1.0_f64, MOST_SAMPLE_CELLS);
        let mut cells = (count as f64).sqrt().clamp(coarse, fine);
        let mut chosen = Vec::new();
        for _ in 0..SAMPLE_ROUNDS {
            let picked = self.one_a_cell(bounds.low, extent / cells);
            // Where most points have a cell of their own, their number does not say how large cells fill.
            let sparse = picked.len() as f64 > SAMPLE_SPARSE * self.len() as f64;
            let ratio = if sparse { SAMPLE_COARSER } else { count as f64 / picked.len() as f64 };
            if picked.len() > count {
                fine = cells;
            } else {
                coarse = cells;
                chosen = picked;
                if ratio < SAMPLE_ENOUGH {
                    break;
                }
            }
            let next = cells * (SAMPLE_AIM * ratio).sqrt();
            cells = if next > coarse && next < fine { next } else { (coarse * fine).sqrt() };
        }
        if chosen.is_empty() {
            return self.every(count);
        }
        chosen.sort_unstable();
        self.pick(chosen.into_iter()).alike()
    }

    /// The same points, all of which count alike.
    pub(crate) fn alike(mut self) -> Self {
        self.prior.fill(1.0);
        self
    }

    /// About `count` points, each as likely as any other: dense where the scan is. All points where there are not more.
    pub(crate) fn every(&self, count: usize) -> Self {
        let step = self.len().div_ceil(count.max(1)).max(1);
        if step == 1 { self.clone() } else { self.pick((0..self.len()).step_by(step)) }
    }

    /// About `count` points, each as likely as any other, that together count as much as all of these do.
    pub(crate) fn standing_for_all(&self, count: usize) -> Self {
        let mut few = self.every(count);
        let factor = self.weight() / few.weight();
        few.prior = (0..few.len()).map(|i| factor * few.prior(i)).collect();
        few
    }

    /// These points and others of the same scan.
    pub(crate) fn and(mut self, others: &Self) -> Self {
        self.position.extend(&others.position);
        self.normal.extend(&others.normal);
        self.around.extend(&others.around);
        self.prior.extend(&others.prior);
        self.index.extend(&others.index);
        self
    }

    fn one_a_cell(&self, low: DVec3, cell: f64) -> Vec<usize> {
        let mut cells: Vec<Cell> = Vec::new();
        let mut slots: HashMap<U64Vec3, usize, FixedState> = HashMap::default();
        // Neighbours in the list are neighbours in space: most of them share their cell.
        let mut last = (U64Vec3::MAX, 0);
        let scale = 1.0 / cell;
        for (i, p) in self.position.iter().enumerate() {
            let scaled = (*p - low) * scale;
            let place = scaled.as_u64vec3();
            let off = (scaled - place.as_dvec3() - 0.5).length_squared();
            if place != last.0 {
                let next = cells.len();
                last = (place, *slots.entry(place).or_insert(next));
                if last.1 == next {
                    cells.push(Cell { off, index: i, prior: 0.0 });
                }
            }
            let best = &mut cells[last.1];
            best.prior += self.prior(i);
            if off < best.off {
                (best.off, best.index) = (off, i);
            }
        }
        let least = EMPTY_CELL * typical(cells.iter().map(|c| c.prior).collect());
        cells.into_iter().filter(|c| c.prior >= least).map(|c| c.index).collect()
    }
}

/// The prior weight of a typical cell of a surface: the median, unless that is a cell of outliers, which in a dense
/// scan have most of the cells and hardly any of the points. Then it is the median of the cells that together hold
/// nearly all points.
fn typical(mut priors: Vec<f64>) -> f64 {
    priors.sort_unstable_by(|a, b| b.total_cmp(a));
    let enough = SURFACE_SHARE * priors.iter().sum::<f64>();
    let mut sum = 0.0;
    let is_needed = |prior: &&f64| {
        sum += **prior;
        sum <= enough
    };
    let full = priors.iter().take_while(is_needed).count();
    let of_surface = priors.get(full / 2).copied().unwrap_or(0.0);
    let of_all = median(&mut priors).unwrap_or(0.0);
    if of_all < EMPTY_CELL * of_surface { of_surface } else { of_all }
}

/// A cell of space in which there are points.
struct Cell {
    /// The squared distance of the point that is nearest to the middle, in cells, and which it is.
    off: f64,
    index: usize,
    /// The sum of the prior weights of its points.
    prior: f64,
}

/// Normals averaged over each vertex's neighbours and over theirs: over some twelve vertices, so that the noise of
/// one's own (35 degrees where that of the points is 0.4 spacings) becomes a third. Those of a cloud are of
/// neighbourhoods as they are.
fn averaged(mesh: &TriangleMesh, normals: &[DVec3]) -> Vec<DVec3> {
    let mut averaged = normals.to_vec();
    if normals.is_empty() {
        return averaged;
    }
    for _ in 0..2 {
        let mut sums = averaged.clone();
        for triangle in &mesh.triangles {
            let sum: DVec3 = triangle.iter().map(|i| averaged[*i as usize]).sum();
            triangle.iter().for_each(|i| sums[*i as usize] += sum);
        }
        averaged = sums.into_iter().map(DVec3::normalize_or_zero).collect();
    }
    averaged
}

/// Values of the points at some indices, where points have any.
fn of_points<T: Copy>(values: &[T], indices: impl Iterator<Item = usize>) -> Vec<T> {
    if values.is_empty() { Vec::new() } else { indices.map(|i| values[i]).collect() }
}

/// The effective sample size of weights, (sum w)^2 / sum w^2 (Kish 1965): the variance of a weighted mean of
/// independent values of equal variance is that variance over it. Zero where there are none.
pub(crate) fn effective(weights: impl Iterator<Item = f64>) -> f64 {
    let (sum, squares) = weights.fold((0.0, 0.0), |(sum, squares), w| (sum + w, squares + w * w));
    if squares > 0.0 { sum * sum / squares } else { 0.0 }
}

/// The mean of points.
pub(crate) fn mean(points: &[DVec3]) -> DVec3 {
    points.iter().sum::<DVec3>() / points.len().max(1) as f64
}

/// The mean and the covariance of points.
pub(crate) fn moments(points: &[DVec3]) -> (DVec3, DMat3) {
    let count = points.len().max(1) as f64;
    let mean = mean(points);
    let square = |p: &DVec3| {
        let d = *p - mean;
        DMat3::from_cols(d * d.x, d * d.y, d * d.z)
    };
    (mean, points.iter().map(square).fold(DMat3::ZERO, |sum, s| sum + s) * (1.0 / count))
}

/// The radius of gyration of points: their root mean square distance from the mean.
pub(crate) fn gyration(points: &[DVec3]) -> f64 {
    let mean = mean(points);
    let sum: f64 = points.iter().map(|p| p.distance_squared(mean)).sum();
    (sum / points.len().max(1) as f64).sqrt()
}
