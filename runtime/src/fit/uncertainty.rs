//! How well the scan determines the coordinates: the sandwich estimator of their covariance (Huber 1967; with blocks as in
//! cluster-robust estimators), and what it does not determine at all.

use super::blocks::{Blocks, Key};
use super::kinks;
use super::objective::Objective;
use super::proposals::halton;
use super::rows::{AllRows, RowPoint, Rows};
use super::space::Estimate;
use super::sums::{add_scaled, add_square};
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
/// How often the covariance is computed with the kinks that it suggests.
const ROUNDS: usize = 3;
/// Grids over which block sums are averaged: together they act like a triangular kernel (Bartlett's).
const SHIFTS: usize = 4;

/// Sums over points; matrices by the parameters, shift and turn first, by scaled local coordinates in the end.
struct Sums {
    /// Sum of psi'' J J^T.
    bread: DMatrix<f64>,
    /// Sum of weight J J^T.
    weighted: DMatrix<f64>,
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
    let all = AllRows::new(objective, at)?;
    let mut sums = collect(objective, at, &all);
    let n = sums.pulls.len();
    if n <= dim {
        return None;
    }
    let information = objective.coverage.as_ref().and_then(|c| c.information(objective, at));
    let chain = objective.space.chain(at);
    if let Some(ends) = &information {
        sums.bread += chain.tr_mul(&(&ends.bread * &chain));
        sums.weighted += chain.tr_mul(&(&ends.weighted * &chain));
    }
    let blocks = Blocks::find(&sums.places, &sums.pulls, objective.points.gyration());
    let mut inverse = Inverse::of(&sums.bread, &sums.weighted, held)?;
    let leverage = &chain * &inverse.weighted * chain.transpose();
    let mut filling = match blocks {
        Some(blocks) => between_blocks(objective, &all, blocks, &leverage),
        None => of_points(objective, &all, &leverage),
    };
    if let Some(ends) = information {
        filling += ends.filling;
    }
    let filling = chain.tr_mul(&(filling * &chain));
    let sandwich = |inverse: &Inverse| &inverse.matrix * &filling * &inverse.matrix;
    let mut covariance = sandwich(&inverse);
    // The covariance says over which region kinks count, and kinks how large it is.
    let kinks = kinks::find(objective, at, held).unwrap_or_default();
    for _ in 0..ROUNDS {
        inverse = Inverse::of(&kinks::smoothed(&sums.bread, &kinks, &covariance), &sums.weighted, held)?;
        covariance = sandwich(&inverse);
    }
    let weight: f64 = sums.weight;
    let naive = &inverse.weighted * (sums.weighted_d2 / (weight - dim as f64).max(1.0));
    let effective_points = n as f64 / blocks.map_or(1.0, |b| b.inflation);
    let Inverse { undetermined, known, .. } = inverse;
    Some(Uncertainty { covariance, naive, undetermined, known, effective_points, blocks })
}

fn collect(objective: &Objective, at: &Estimate, all: &AllRows) -> Sums {
    let total = objective.space.model.parameters().len() + 6;
    let mut sums = Sums::none(total);
    let add = |sums: &mut Sums, rows: &Rows| {
        let count = rows.columns.len();
        let mut squares = [(); 2].map(|()| vec![0.0; count * count]);
        for (point, row) in rows.iter() {
            let pull = point.weight * point.distance;
            for (square, factor) in squares.iter_mut().zip([point.curvature, point.weight]) {
                add_square(square, factor, row);
            }
            sums.places.push((objective.points.position[point.index as usize], rows.patch));
            sums.pulls.push(pull);
            sums.weight += point.weight;
            sums.weighted_d2 += pull * point.distance;
        }
        for (matrix, square) in [&mut sums.bread, &mut sums.weighted].into_iter().zip(&squares) {
            add_square_at(matrix, rows, square);
        }
    };
    let none = || Sums::none(total);
    all.fold(none, add, |chunk| {
        sums.bread += chunk.bread;
        sums.weighted += chunk.weighted;
        sums.places.extend(chunk.places);
        sums.pulls.extend(chunk.pulls);
        sums.weight += chunk.weight;
        sums.weighted_d2 += chunk.weighted_d2;
    });
    let chain = objective.space.chain(at);
    for matrix in [&mut sums.bread, &mut sums.weighted] {
        matrix.fill_upper_triangle_with_lower_triangle();
        *matrix = chain.tr_mul(&(&*matrix * &chain));
    }
    sums
}

impl Sums {
    fn none(count: usize) -> Self {
        let zero = || DMatrix::zeros(count, count);
        let (places, pulls) = (Vec::new(), Vec::new());
        Self { bread: zero(), weighted: zero(), places, pulls, weight: 0.0, weighted_d2: 0.0 }
    }
}

/// Adds an upper triangle by the columns of some rows to the lower one by everything.
fn add_square_at(matrix: &mut DMatrix<f64>, rows: &Rows, square: &[f64]) {
    let count = rows.columns.len();
    for (a, i) in rows.columns.iter().enumerate() {
        for (b, j) in rows.columns.iter().enumerate().skip(a) {
            matrix[(*j, *i)] += square[a * count + b];
        }
    }
}

/// weight times signed distance of every point, over 1 - h: a point's leverage h = weight J (sum of weight J^T J)^-1 J^T is the
/// part of its residual that the fit has taken in. `leverage` is that inverse. (MacKinnon and White 1985, HC3.)
fn pulls<'r>(rows: &'r Rows, leverage: &DMatrix<f64>) -> impl Iterator<Item = (&'r RowPoint, &'r [f64], f64)> {
    let columns = &rows.columns;
    let inverse = DMatrix::from_fn(columns.len(), columns.len(), |a, b| leverage[(columns[a], columns[b])]);
    rows.iter().map(move |(point, row)| {
        let of_column = |(a, r): (usize, &f64)| r * inverse.column(a).iter().zip(row).map(|(m, r)| m * r).sum::<f64>();
        let h = point.weight * row.iter().enumerate().map(of_column).sum::<f64>();
        (point, row, point.weight * point.distance / (1.0 - h.clamp(0.0, 0.9)))
    })
}

/// Sum of (pull J) (pull J)^T, for residuals that do not depend on each other.
fn of_points(objective: &Objective, all: &AllRows, leverage: &DMatrix<f64>) -> DMatrix<f64> {
    let total = objective.space.model.parameters().len() + 6;
    let none = || DMatrix::zeros(total, total);
    let add = |matrix: &mut DMatrix<f64>, rows: &Rows| {
        let mut square = vec![0.0; rows.columns.len() * rows.columns.len()];
        for (_, row, pull) in pulls(rows, leverage) {
            add_square(&mut square, pull * pull, row);
        }
        add_square_at(matrix, rows, &square);
    };
    let mut filling = none();
    all.fold(none, add, |chunk| filling += chunk);
    filling.fill_upper_triangle_with_lower_triangle();
    filling
}

/// Sums of pulls J by block, in the order in which the blocks were first met.
#[derive(Default)]
struct BlockSums {
    index: HashMap<Key, usize, FixedState>,
    /// The last one that was asked for: neighbours in the list are neighbours in space.
    last: Option<(Key, usize)>,
    keys: Vec<Key>,
    sums: Vec<f64>,
}

impl BlockSums {
    fn of(&mut self, key: Key, width: usize) -> &mut [f64] {
        let slot = match self.last {
            Some((last, slot)) if last == key => slot,
            _ => {
                let next = self.keys.len();
                let slot = *self.index.entry(key).or_insert(next);
                if slot == next {
                    self.keys.push(key);
                    self.sums.resize((next + 1) * width, 0.0);
                }
                self.last = Some((key, slot));
                slot
            }
        };
        &mut self.sums[slot * width..(slot + 1) * width]
    }
}

/// Sum over blocks of (sum of pulls J) (sum of pulls J)^T, the mean over some positions of the grid.
fn between_blocks(objective: &Objective, all: &AllRows, blocks: Blocks, leverage: &DMatrix<f64>) -> DMatrix<f64> {
    let total = objective.space.model.parameters().len() + 6;
    let shifts: Vec<DVec3> = (1..=SHIFTS).map(|i| DVec3::new(halton(i, 0), halton(i, 1), halton(i, 2))).collect();
    let none = || shifts.iter().map(|_| BlockSums::default()).collect::<Vec<BlockSums>>();
    let add = |grids: &mut Vec<BlockSums>, rows: &Rows| {
        for (point, row, pull) in pulls(rows, leverage) {
            let place = objective.points.position[point.index as usize];
            for (shift, grid) in shifts.iter().zip(grids.iter_mut()) {
                let sums = grid.of(Blocks::key(blocks.edge, *shift, rows.patch, place), total);
                for (i, r) in rows.columns.iter().zip(row) {
                    sums[*i] += pull * r;
                }
            }
        }
    };
    let mut grids = none();
    all.fold(none, add, |chunk| {
        for (grid, part) in grids.iter_mut().zip(&chunk) {
            for (key, sums) in part.keys.iter().zip(part.sums.chunks_exact(total)) {
                add_scaled(grid.of(*key, total), 1.0, sums);
            }
        }
    });
    let mut filling = DMatrix::zeros(total, total);
    for grid in &grids {
        let count = grid.keys.len() as f64;
        let scale = blocks.correction * count / (count - 1.0).max(1.0) / SHIFTS as f64;
        for sum in grid.sums.chunks_exact(total) {
            let sum = DVector::from_column_slice(sum);
            filling.ger(scale, &sum, &sum, 1.0);
        }
    }
    filling
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
