//! How well the scan determines the coordinates: the sandwich estimator of their covariance (Huber 1967; with blocks as
//! in cluster-robust estimators), and what it does not determine at all.

use super::blocks::Blocks;
use super::meat;
use super::sums::{score, squares};
use super::switches;
use super::without_bounds::WithoutBounds;
use crate::eigen;
use crate::fit::problem::objective::Objective;
use crate::fit::problem::parameterization::Estimate;
use crate::fit::problem::points::effective;
use crate::fit::problem::rows::{AllRows, RowPoint, Rows};
use crate::fit::result::WithoutSd;
use crate::fit::tuning::{BORDER, BY_ENDS, DETERMINED, HARDLY_ANY_POINTS, SHOWN_SHARE, SWITCH_ROUNDS};
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

/// The covariance of the scaled local coordinates.
#[derive(Clone, Debug)]
pub(crate) struct Uncertainty {
    /// Zero in the rows and columns of coordinates that are held or not determined.
    pub(crate) covariance: DMatrix<f64>,
    /// The bias by noise where it was estimated, which the covariance then holds; zero likewise.
    pub(crate) bias: DVector<f64>,
    /// The inverse of the bread, which is the Hessian of the sum of losses times sigma^2 / 2, with the term that holds
    /// walls apart; zero likewise.
    pub(crate) inverse: DMatrix<f64>,
    /// The covariance if residuals were independent of each other and all alike: s^2 A (sum w w0 J J^T) A with
    /// A = (sum w J J^T)^-1, where w0 is a point's prior weight and w that times the loss's weight.
    pub(crate) naive: DMatrix<f64>,
    /// Directions (of unit length) in which no distance changes.
    pub(crate) undetermined: Vec<DVector<f64>>,
    /// By coordinate, why it has no standard deviation; None of one that has.
    pub(crate) without: Vec<Option<WithoutSd>>,
    /// The number of independent points that would say as much.
    pub(crate) effective_points: f64,
    /// Blocks of dependent residuals, if there are any.
    pub(crate) blocks: Option<Blocks>,
    /// The uncertainty without the bounds at which coordinates are held; None where none is held.
    pub(crate) without_bounds: Option<WithoutBounds>,
}

/// Eigenvalues of the scaled matrix, and diagonal elements relative to the largest, below which there is only rounding.
const SINGULAR: f64 = 1e-10;
const NO_INFLUENCE: f64 = 1e-12;

/// The uncertainty at an optimum, where the objective has a gradient. `held` coordinates (fixed at a bound) count as
/// determined. None where the model does not exist or no point has a foot.
pub(crate) fn assess(
    objective: &Objective,
    at: &Estimate,
    gradient: &DVector<f64>,
    held: &[bool],
) -> Option<Uncertainty> {
    let dim = objective.space.dim();
    let information = Information::of(objective, at)?;
    let Information { chain, bread, weighted, alike, within, blocks, .. } = &information;
    let local = |matrix: &DMatrix<f64>| chain.tr_mul(&(matrix * chain));
    let (mut bread, mut weighted) = (bread.clone(), weighted.clone());
    let (mut alike, mut within, blocks) = (alike.clone(), within.clone(), *blocks);
    if information.points() <= dim {
        return None;
    }
    let coverage = objective.coverage.as_ref().and_then(|c| c.information(objective, at));
    if let Some(coverage) = &coverage {
        bread += local(&coverage.bread);
        weighted += local(&coverage.weighted);
        alike += local(&coverage.weighted);
        within += local(&coverage.weighted);
    }
    let mut inverse = Inverse::of(&bread, &weighted, held)?;
    let mut meat = information.meat(objective, &inverse.weighted);
    if let Some(coverage) = &coverage {
        meat += local(&coverage.meat);
    }
    let sandwich = |inverse: &Inverse| &inverse.matrix * &meat * &inverse.matrix;
    let mut covariance = sandwich(&inverse);
    // The covariance says over which region switches count, and switches how large it is.
    let switches = switches::find(objective, at, held).unwrap_or_default();
    for _ in 0..SWITCH_ROUNDS {
        inverse = Inverse::of(&switches::smoothed(&bread, &switches, &covariance), &weighted, held)?;
        covariance = sandwich(&inverse);
    }
    if let Some(coverage) = coverage {
        // The border of a scan lies anywhere up to a spacing inside of the surface's, at all places alike.
        let response = &inverse.matrix * chain.tr_mul(&coverage.pull) * (BORDER * objective.points.spacing());
        covariance += &response * response.transpose();
    }
    let at_ends = by_ends(&weighted, &within, held);
    let naive = &inverse.weighted * &alike * &inverse.weighted * information.variance(dim);
    at_least(&mut covariance, &naive);
    let released = held.contains(&true).then(|| Inverse::of(&bread, &weighted, &[])).flatten();
    let without_bounds = released.map(|released| {
        let sum = 0.5 * objective.loss.sigma.powi(2) * objective.points.weight();
        let moved = (gradient.len() == dim).then(|| -(&released.matrix * gradient) * sum);
        let ends_alone = by_ends(&weighted, &within, &[]);
        WithoutBounds {
            covariance: &released.matrix * &meat * &released.matrix,
            determined: released.determined,
            by_ends: (0..dim).map(|k| ends_alone[k] && !at_ends[k]).collect(),
            step: moved.unwrap_or_else(|| DVector::zeros(dim)),
            bias: DVector::zeros(dim),
            inverse: released.matrix,
        }
    });
    let effective_points = information.effective_points();
    let Inverse { matrix, undetermined, determined, .. } = inverse;
    // The border at which walls are held apart is no information on where before it the truth lies, so the covariance
    // knows nothing of it; where the optimum is, it does say.
    let inverse = match &objective.separation {
        Some(separation) => {
            // In units of the bread: the Hessian of the sum of losses times sigma^2 / 2.
            let unit = 0.5 * objective.loss.sigma.powi(2) * objective.points.weight();
            let walls = separation.hessian(objective, at)? * unit;
            Inverse::of(&(bread + &walls), &(weighted.clone() + walls), held)?.matrix
        }
        None => matrix,
    };
    let reason = |k: usize| match (determined[k], is_held(held, k)) {
        (true, _) => at_ends[k].then_some(WithoutSd::ScanEnds),
        (false, true) => Some(WithoutSd::AtBound),
        (false, false) => Some(WithoutSd::NotDetermined),
    };
    let without = (0..dim).map(reason).collect();
    Some(Uncertainty {
        covariance,
        bias: DVector::zeros(dim),
        inverse,
        naive,
        undetermined,
        without,
        effective_points,
        blocks,
        without_bounds,
    })
}

/// What the points near the model say of the scaled local coordinates.
pub(crate) struct Information<'o> {
    all: AllRows<'o>,
    chain: DMatrix<f64>,
    /// Sums of curvature J J^T, of weight J J^T, of that times the prior weight, and of weight J J^T without points
    /// that only say where the model ends.
    pub(crate) bread: DMatrix<f64>,
    pub(crate) weighted: DMatrix<f64>,
    pub(crate) alike: DMatrix<f64>,
    pub(crate) within: DMatrix<f64>,
    residuals: Residuals,
    /// Blocks of dependent residuals, if there are any.
    pub(crate) blocks: Option<Blocks>,
}

impl<'o> Information<'o> {
    /// None where the model does not exist.
    pub(crate) fn of(objective: &'o Objective<'o>, at: &Estimate) -> Option<Self> {
        let all = AllRows::new(objective, at)?;
        let chain = objective.space.chain(at);
        let shown = shown_patches(&all, objective.space.model.parts().len());
        let factors = |rows: &Rows| {
            let of_point = |point: &RowPoint| {
                let within = if shown[rows.patch as usize] && !point.at_end { point.weight } else { 0.0 };
                [point.curvature, point.weight, point.prior * point.weight, within]
            };
            rows.points.iter().map(of_point).collect()
        };
        let [bread, weighted, alike, within] =
            squares(&all, chain.nrows(), factors).map(|matrix| chain.tr_mul(&(matrix * &chain)));
        let residuals = Residuals::of(objective, &all);
        let blocks = Blocks::find(&residuals.positions, &residuals.scores, objective.points.gyration());
        Some(Self { all, chain, bread, weighted, alike, within, residuals, blocks })
    }

    /// The covariance of the gradient of the sum of losses times sigma^2 / 2. `inverse` is that of all squares' sum, by
    /// which the leverages are found.
    pub(crate) fn meat(&self, objective: &Objective, inverse: &DMatrix<f64>) -> DMatrix<f64> {
        let Self { all, chain, .. } = self;
        let of_squares = chain * inverse * chain.transpose();
        let meat = match self.blocks {
            Some(blocks) => meat::of_blocks(objective, all, blocks, &of_squares),
            None => meat::of_points(all, &of_squares),
        };
        chain.tr_mul(&(meat * chain))
    }

    /// The variance of the residuals, of which the fit has absorbed `degrees`. Square millimetres.
    pub(crate) fn variance(&self, degrees: usize) -> f64 {
        self.residuals.weighted_d2 / (self.residuals.weight - degrees as f64).max(1.0)
    }

    /// The number of points that have a foot.
    pub(crate) fn points(&self) -> usize {
        self.residuals.scores.len()
    }

    /// The number of independent points that would say as much.
    pub(crate) fn effective_points(&self) -> f64 {
        effective(self.residuals.priors.iter().copied()) / self.blocks.map_or(1.0, |b| b.inflation)
    }
}

impl Uncertainty {
    /// Newton's step against the gradient of a mean loss; `sum` is sigma^2 / 2 times the weight of the points (the
    /// objective is the mean of losses, the bread is of their sum times sigma^2 / 2).
    pub(crate) fn newton_step(&self, gradient: &DVector<f64>, sum: f64) -> DVector<f64> {
        -(&self.inverse * gradient) * sum
    }

    /// The same without coordinates whose standard deviation moves the surface farther than the scan is large, by its
    /// radius (millimetres): no linear theory reaches so far, and the scan does not determine them.
    pub(crate) fn within(mut self, radius: f64) -> Self {
        for k in 0..self.without.len() {
            if !(self.covariance[(k, k)] < radius * radius) {
                self.leave_open(k);
            }
        }
        self
    }

    /// Takes the standard deviation of coordinate k, if it has one, since the scan does not determine it.
    pub(crate) fn leave_open(&mut self, k: usize) {
        self.without[k].get_or_insert(WithoutSd::NotDetermined);
    }

    /// Whether coordinate k has a standard deviation.
    pub(crate) fn determines(&self, k: usize) -> bool {
        self.without[k].is_none()
    }

    /// Whether a coordinate is so certain, or where it is, only because others are held at their bounds.
    pub(crate) fn bounds_decide(&self, k: usize) -> bool {
        let decide = |without: &WithoutBounds| without.decides(k, self.covariance[(k, k)]);
        self.determines(k) && self.without_bounds.as_ref().is_some_and(decide)
    }

    /// Why a variable has no standard deviation that depends on coordinates by `slope`; None of one that has.
    pub(crate) fn without<'s>(&self, slope: impl Iterator<Item = &'s f64>) -> Option<WithoutSd> {
        slope.zip(&self.without).filter(|(slope, _)| **slope != 0.0).find_map(|(_, without)| *without)
    }
}

/// Raises the variances of a covariance that are below those of another one, and keeps its correlations. Where only a
/// point or two determine a coordinate, the fit goes through them, and their residuals say nothing of the noise.
pub(super) fn at_least(covariance: &mut DMatrix<f64>, least: &DMatrix<f64>) {
    let factor = |k: usize| {
        let (variance, least) = (covariance[(k, k)], least[(k, k)]);
        if variance > 0.0 && least > variance { (least / variance).sqrt() } else { 1.0 }
    };
    let factors: Vec<f64> = (0..covariance.nrows()).map(factor).collect();
    for (i, a) in factors.iter().enumerate() {
        for (j, b) in factors.iter().enumerate() {
            covariance[(i, j)] *= a * b;
        }
    }
}

/// By patch, whether the scan shows it: more than hardly any points lie near it, and not nearly all of them at its
/// ends. Of the points of two walls that end where the scan does, noise turns the normals of a few towards the face
/// between.
fn shown_patches(all: &AllRows, patches: usize) -> Vec<bool> {
    let mut points = vec![[0.0; 2]; patches];
    let count = |counts: &mut Vec<[f64; 2]>, rows: &Rows| {
        let [near, within] = &mut counts[rows.patch as usize];
        for point in rows.points.iter().filter(|point| point.weight > 0.5 * point.prior) {
            *near += 1.0;
            *within += f64::from(u8::from(!point.at_end));
        }
    };
    all.fold(
        || vec![[0.0; 2]; patches],
        count,
        |counts| {
            for ([near, within], [n, w]) in points.iter_mut().zip(counts) {
                *near += n;
                *within += w;
            }
        },
    );
    points.into_iter().map(|[near, within]| near >= HARDLY_ANY_POINTS && within >= SHOWN_SHARE * near).collect()
}

/// By coordinate, whether hardly anything but the ends of the scan determines it: points at an end of the model, or
/// the few that a part took which was not scanned. They say that the model reaches so far, not that the object does not
/// reach farther. `weighted` is the information of all points, `within` that of the others.
/// Coordinates that are not determined take part: with one of them an end may slide along the surface.
pub(super) fn by_ends(weighted: &DMatrix<f64>, within: &DMatrix<f64>, held: &[bool]) -> Vec<bool> {
    let least = NO_INFLUENCE * weighted.diagonal().amax();
    let varies = |k: &usize| !is_held(held, *k) && weighted[(*k, *k)] > least;
    let varied: Vec<usize> = (0..weighted.nrows()).filter(varies).collect();
    let variances = |of: &DMatrix<f64>| {
        let ridge = DMatrix::identity(varied.len(), varied.len()) * SINGULAR;
        Some((scaled(of, weighted, &varied) + ridge).cholesky()?.inverse().diagonal())
    };
    let mut by_ends = vec![false; weighted.nrows()];
    if let (Some(all), Some(within)) = (variances(weighted), variances(within)) {
        for (a, k) in varied.iter().enumerate() {
            by_ends[*k] = within[a] > BY_ENDS.powi(2) * all[a];
        }
    }
    by_ends
}

/// The rows and columns of a matrix that belong to some coordinates, in units of the square roots of another one's
/// diagonal.
fn scaled(matrix: &DMatrix<f64>, units: &DMatrix<f64>, varied: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(varied.len(), varied.len(), |a, b| {
        let (i, j) = (varied[a], varied[b]);
        matrix[(i, j)] / (units[(i, i)].sqrt() * units[(j, j)].sqrt())
    })
}

/// Whether a coordinate is fixed at a bound: `held` has no entries for the motion.
pub(super) fn is_held(held: &[bool], k: usize) -> bool {
    held.get(k).copied().unwrap_or(false)
}

/// The residuals of all points.
#[derive(Default)]
struct Residuals {
    /// Position and patch.
    positions: Vec<(DVec3, u32)>,
    scores: Vec<f64>,
    priors: Vec<f64>,
    /// Sum of weights, and of weight times squared distance.
    weight: f64,
    weighted_d2: f64,
}

impl Residuals {
    fn of(objective: &Objective, all: &AllRows) -> Self {
        let add = |sums: &mut Self, rows: &Rows| {
            for point in &rows.points {
                let score = score(point);
                sums.positions.push((objective.points.position[point.index as usize], rows.patch));
                sums.scores.push(score);
                sums.priors.push(point.prior);
                sums.weight += point.weight;
                sums.weighted_d2 += score * point.distance;
            }
        };
        let mut sums = Self::default();
        all.fold(Self::default, add, |chunk| {
            sums.positions.extend(chunk.positions);
            sums.scores.extend(chunk.scores);
            sums.priors.extend(chunk.priors);
            sums.weight += chunk.weight;
            sums.weighted_d2 += chunk.weighted_d2;
        });
        sums
    }
}

/// The inverse of the sandwich's bread over what is determined.
pub(super) struct Inverse {
    pub(super) matrix: DMatrix<f64>,
    /// That of the sum of weight J J^T.
    pub(super) weighted: DMatrix<f64>,
    pub(super) undetermined: Vec<DVector<f64>>,
    pub(super) determined: Vec<bool>,
}

impl Inverse {
    pub(super) fn of(bread: &DMatrix<f64>, weighted: &DMatrix<f64>, held: &[bool]) -> Option<Self> {
        let dim = bread.nrows();
        let largest = weighted.diagonal().amax();
        if !(largest > 0.0 && largest.is_finite()) {
            return None;
        }
        let mut determined: Vec<bool> =
            (0..dim).map(|k| !is_held(held, k) && weighted[(k, k)] > NO_INFLUENCE * largest).collect();
        let varied: Vec<usize> = (0..dim).filter(|k| determined[*k]).collect();
        if varied.is_empty() {
            return None;
        }
        let unit = DVector::from_iterator(varied.len(), varied.iter().map(|k| weighted[(*k, *k)].sqrt()));
        let scaled = |m: &DMatrix<f64>| scaled(m, weighted, &varied);
        let flat = eigen::symmetric(scaled(weighted));
        let mut undetermined = Vec::new();
        let mut sound = Vec::new();
        for (value, vector) in flat.eigenvalues.iter().zip(flat.eigenvectors.column_iter()) {
            if *value > SINGULAR {
                sound.push(vector.into_owned());
                continue;
            }
            let mut direction = DVector::zeros(dim);
            for (a, k) in varied.iter().enumerate() {
                direction[*k] = vector[a] / unit[a];
            }
            direction /= direction.norm().max(f64::MIN_POSITIVE);
            for (k, determined) in determined.iter_mut().enumerate() {
                *determined &= direction[k].abs() < DETERMINED;
            }
            undetermined.push(direction);
        }
        if sound.is_empty() {
            return None;
        }
        // The curvatures are taken where their sum is positive definite within the determined directions, as it should
        // be at an optimum, else the weights.
        let basis = DMatrix::from_columns(&sound);
        let within = |m: &DMatrix<f64>| basis.transpose() * scaled(m) * &basis;
        let inner = within(bread).cholesky().or_else(|| within(weighted).cholesky())?.inverse();
        let whole = |inner: DMatrix<f64>| {
            let small = &basis * inner * basis.transpose();
            let mut matrix = DMatrix::zeros(dim, dim);
            for (a, i) in varied.iter().enumerate() {
                for (b, j) in varied.iter().enumerate() {
                    matrix[(*i, *j)] = small[(a, b)] / (unit[a] * unit[b]);
                }
            }
            matrix
        };
        let weighted = whole(within(weighted).cholesky()?.inverse());
        Some(Self { matrix: whole(inner), weighted, undetermined, determined })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variances_are_raised_and_correlations_stay() {
        let mut covariance = DMatrix::from_row_slice(3, 3, &[1e-4, 8e-3, 0.0, 8e-3, 4.0, 0.0, 0.0, 0.0, 0.0]);
        at_least(&mut covariance, &DMatrix::from_diagonal(&DVector::from_row_slice(&[1e-2, 1.0, 1.0])));
        // One that has none keeps none.
        let raised = DMatrix::from_row_slice(3, 3, &[1e-2, 8e-2, 0.0, 8e-2, 4.0, 0.0, 0.0, 0.0, 0.0]);
        assert!((covariance - raised).amax() < 1e-15);
    }
}
