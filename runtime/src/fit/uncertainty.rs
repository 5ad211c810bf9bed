//! How well the scan determines the coordinates: the sandwich estimator of their covariance (Huber 1967; with blocks as in
//! cluster-robust estimators), and what it does not determine at all.

use super::blocks::{Blocks, Key};
use super::influence::Rows;
use super::objective::Objective;
use super::proposals::halton;
use super::space::Estimate;
use foldhash::fast::FixedState;
use glam::DVec3;
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use std::collections::HashMap;

/// The covariance of the scaled local coordinates.
#[derive(Clone, Debug)]
pub(crate) struct Uncertainty {
    /// Zero in the rows and columns of coordinates that are held or not determined.
    pub(crate) covariance: DMatrix<f64>,
    /// The covariance if residuals were independent of each other and all alike: s^2 (sum w J J^T)^-1.
    pub(crate) naive: DMatrix<f64>,
    /// Directions (of unit length) that no point has a say in.
    pub(crate) undetermined: Vec<DVector<f64>>,
    /// By coordinate, whether it is determined.
    pub(crate) known: Vec<bool>,
    /// As many independent points would say as much.
    pub(crate) effective_points: f64,
    /// Blocks of dependent residuals, if there are any.
    pub(crate) blocks: Option<Blocks>,
}

/// Eigenvalues of the scaled matrix below this are rounding.
const SINGULAR: f64 = 1e-10;
/// Grids over which block sums are averaged: together they act like a triangular kernel (Bartlett's).
const SHIFTS: usize = 4;

/// Sums over all points.
struct Sums {
    /// Sum of psi'' J J^T.
    bread: DMatrix<f64>,
    /// Sum of weight J J^T.
    weighted: DMatrix<f64>,
    /// Sum of (weight d)^2 J J^T.
    filling: DMatrix<f64>,
    places: Vec<(DVec3, u32)>,
    pulls: Vec<f64>,
    /// Sum of weights, and of weight times squared distance.
    weight: f64,
    weighted_d2: f64,
}

/// The uncertainty at an optimum. `held` coordinates (fixed at a bound) count as known. None where the model does not exist or
/// no point has a foot.
pub(crate) fn assess(objective: &Objective, at: &Estimate, held: &[bool]) -> Option<Uncertainty> {
    let dim = objective.space.dim();
    let sums = collect(objective, at)?;
    let n = sums.pulls.len();
    if n <= dim {
        return None;
    }
    let inverse = Inverse::of(&sums.bread, &sums.weighted, held)?;
    let blocks = Blocks::find(&sums.places, &sums.pulls, objective.points.gyration());
    let filling = match blocks {
        Some(blocks) => between_blocks(objective, at, blocks)?,
        None => sums.filling.clone(),
    };
    let free = (n - dim) as f64;
    let covariance = &inverse.matrix * filling * &inverse.matrix * (n as f64 / free);
    let weight: f64 = sums.weight;
    let naive = &inverse.weighted * (sums.weighted_d2 / (weight - dim as f64).max(1.0));
    let effective_points = n as f64 / blocks.map_or(1.0, |b| b.inflation);
    let Inverse { undetermined, known, .. } = inverse;
    Some(Uncertainty { covariance, naive, undetermined, known, effective_points, blocks })
}

fn collect(objective: &Objective, at: &Estimate) -> Option<Sums> {
    let dim = objective.space.dim();
    let mut sums = Sums::none(dim);
    let of_chunk = |rows: Rows| {
        let mut sums = Sums::none(dim);
        for (point, row) in rows.points.iter().zip(rows.jacobian.chunks_exact(dim.max(1))) {
            let pull = point.weight * point.distance;
            for (b, rb) in row.iter().enumerate() {
                for (a, ra) in row.iter().enumerate().skip(b) {
                    let product = ra * rb;
                    sums.bread[(a, b)] += point.curvature * product;
                    sums.weighted[(a, b)] += point.weight * product;
                    sums.filling[(a, b)] += pull * pull * product;
                }
            }
            sums.places.push((objective.points.position[point.index as usize], point.patch));
            sums.pulls.push(pull);
            sums.weight += point.weight;
            sums.weighted_d2 += pull * point.distance;
        }
        sums
    };
    objective.for_rows(at, of_chunk, |chunk| {
        sums.bread += chunk.bread;
        sums.weighted += chunk.weighted;
        sums.filling += chunk.filling;
        sums.places.extend(chunk.places);
        sums.pulls.extend(chunk.pulls);
        sums.weight += chunk.weight;
        sums.weighted_d2 += chunk.weighted_d2;
    })?;
    for matrix in [&mut sums.bread, &mut sums.weighted, &mut sums.filling] {
        matrix.fill_upper_triangle_with_lower_triangle();
    }
    Some(sums)
}

impl Sums {
    fn none(dim: usize) -> Self {
        let zero = || DMatrix::zeros(dim, dim);
        let (places, pulls) = (Vec::new(), Vec::new());
        Self { bread: zero(), weighted: zero(), filling: zero(), places, pulls, weight: 0.0, weighted_d2: 0.0 }
    }
}

/// Sum over blocks of (sum of pulls J) (sum of pulls J)^T, the mean over some positions of the grid.
fn between_blocks(objective: &Objective, at: &Estimate, blocks: Blocks) -> Option<DMatrix<f64>> {
    let dim = objective.space.dim();
    let shifts: Vec<DVec3> = (1..=SHIFTS).map(|i| DVec3::new(halton(i, 0), halton(i, 1), halton(i, 2))).collect();
    let mut index: Vec<HashMap<Key, usize, FixedState>> = vec![HashMap::default(); SHIFTS];
    let mut sums: Vec<Vec<f64>> = vec![Vec::new(); SHIFTS];
    objective.for_rows(
        at,
        |rows| rows,
        |rows: Rows| {
            for (point, row) in rows.points.iter().zip(rows.jacobian.chunks_exact(dim.max(1))) {
                let pull = point.weight * point.distance;
                let place = objective.points.position[point.index as usize];
                for ((shift, index), sums) in shifts.iter().zip(&mut index).zip(&mut sums) {
                    let next = index.len();
                    let slot = *index.entry(Blocks::key(blocks.edge, *shift, point.patch, place)).or_insert(next);
                    if slot == next {
                        sums.resize((next + 1) * dim, 0.0);
                    }
                    for (sum, r) in sums[slot * dim..].iter_mut().zip(row) {
                        *sum += pull * r;
                    }
                }
            }
        },
    )?;
    let mut filling = DMatrix::zeros(dim, dim);
    for sums in &sums {
        let count = (sums.len() / dim.max(1)) as f64;
        let scale = blocks.correction * count / (count - 1.0).max(1.0) / SHIFTS as f64;
        for sum in sums.chunks_exact(dim.max(1)) {
            let sum = DVector::from_column_slice(sum);
            filling.ger(scale, &sum, &sum, 1.0);
        }
    }
    Some(filling)
}

/// The inverse of the sandwich's outer slices over what is determined.
struct Inverse {
    matrix: DMatrix<f64>,
    /// That of the weights' matrix.
    weighted: DMatrix<f64>,
    undetermined: Vec<DVector<f64>>,
    known: Vec<bool>,
}

impl Inverse {
    fn of(bread: &DMatrix<f64>, weighted: &DMatrix<f64>, held: &[bool]) -> Option<Self> {
        let dim = bread.nrows();
        let largest = weighted.diagonal().amax();
        if !(largest > 0.0 && largest.is_finite()) {
            return None;
        }
        let is_held = |k: usize| held.get(k).copied().unwrap_or(false);
        let mut known: Vec<bool> = (0..dim).map(|k| !is_held(k) && weighted[(k, k)] > 1e-12 * largest).collect();
        let kept: Vec<usize> = (0..dim).filter(|k| known[*k]).collect();
        if kept.is_empty() {
            return None;
        }
        let unit = DVector::from_iterator(kept.len(), kept.iter().map(|k| weighted[(*k, *k)].sqrt()));
        let scaled = |m: &DMatrix<f64>| {
            DMatrix::from_fn(kept.len(), kept.len(), |a, b| m[(kept[a], kept[b])] / (unit[a] * unit[b]))
        };
        let flat = SymmetricEigen::new(scaled(weighted));
        let mut undetermined = Vec::new();
        let mut sound = Vec::new();
        for (value, vector) in flat.eigenvalues.iter().zip(flat.eigenvectors.column_iter()) {
            if *value > SINGULAR {
                sound.push(vector.into_owned());
                continue;
            }
            let mut direction = DVector::zeros(dim);
            for (a, k) in kept.iter().enumerate() {
                direction[*k] = vector[a] / unit[a];
            }
            direction /= direction.norm().max(f64::MIN_POSITIVE);
            for (k, known) in known.iter_mut().enumerate() {
                *known &= direction[k].abs() < 1e-3;
            }
            undetermined.push(direction);
        }
        if sound.is_empty() {
            return None;
        }
        // Within what is determined: psi'' where that is convex, as at an optimum it should be, else the weights.
        let basis = DMatrix::from_columns(&sound);
        let within = |m: &DMatrix<f64>| basis.transpose() * scaled(m) * &basis;
        let inner = within(bread).cholesky().or_else(|| within(weighted).cholesky())?.inverse();
        let whole = |inner: DMatrix<f64>| {
            let small = &basis * inner * basis.transpose();
            let mut matrix = DMatrix::zeros(dim, dim);
            for (a, i) in kept.iter().enumerate() {
                for (b, j) in kept.iter().enumerate() {
                    matrix[(*i, *j)] = small[(a, b)] / (unit[a] * unit[b]);
                }
            }
            matrix
        };
        let weighted = whole(within(weighted).cholesky()?.inverse());
        Some(Self { matrix: whole(inner), weighted, undetermined, known })
    }
}
