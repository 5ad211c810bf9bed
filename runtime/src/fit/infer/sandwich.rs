//! How well the scan determines the coordinates: the sandwich estimator of their covariance (Huber 1967; with blocks as in
//! cluster-robust estimators), and what it does not determine at all.

use super::blocks::Blocks;
use super::meat::{self, add_square_at};
use super::switches;
use crate::fit::problem::objective::Objective;
use crate::fit::problem::parameterization::Estimate;
use crate::fit::problem::rows::{AllRows, Rows};
use crate::fit::problem::sums::add_square;
use glam::DVec3;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

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
/// How often the covariance is computed with the switches that it suggests.
const ROUNDS: usize = 3;

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
        Some(blocks) => meat::between_blocks(objective, &all, blocks, &leverage),
        None => meat::of_points(&all, &leverage),
    };
    if let Some(ends) = information {
        filling += ends.filling;
    }
    let filling = chain.tr_mul(&(filling * &chain));
    let sandwich = |inverse: &Inverse| &inverse.matrix * &filling * &inverse.matrix;
    let mut covariance = sandwich(&inverse);
    // The covariance says over which region switches count, and switches how large it is.
    let switches = switches::find(objective, at, held).unwrap_or_default();
    for _ in 0..ROUNDS {
        inverse = Inverse::of(&switches::smoothed(&sums.bread, &switches, &covariance), &sums.weighted, held)?;
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
