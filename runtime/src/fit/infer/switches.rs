//! Correspondence switches: points that are about as near to one patch as to another. Every point belongs to the
//! nearest surface, so that the objective is a minimum of functions, with a kink where a point changes sides: there the
//! gradient jumps down. The mean Hessian over the region in which the truth may lie is smaller by that than the one at
//! the optimum, which no point's own curvature shows, and standard deviations are larger. Where a small part meets a
//! large one a few such points matter as much as all others.

use super::sums::score;
use crate::eigen::{self, Eigen};
use crate::fit::problem::objective::{Chunk, Correspondence, Objective, Placed};
use crate::fit::problem::parameterization::Estimate;
use crate::fit::tuning::{SWITCH_CAP, SWITCH_REACH};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// A point with another patch within reach.
pub(crate) struct Switch {
    /// By how much more the other patch would count: sigma^2 / 2 times the difference of the losses. Square
    /// millimetres.
    difference: f64,
    /// Its derivative by the scaled local coordinates.
    slope: DVector<f64>,
}

/// The contribution of a point to the objective, and its derivative by the columns of its row.
struct Contribution {
    /// Index among the objective's points.
    point: usize,
    /// sigma^2 / 2 times the loss.
    loss: f64,
    columns: Vec<usize>,
    slopes: Vec<f64>,
}

/// All points that have another patch nearly as near; `held` coordinates do not vary. None where the model does not
/// exist.
pub(crate) fn find(objective: &Objective, at: &Estimate, held: &[bool]) -> Option<Vec<Switch>> {
    let placed = objective.place(at).ok()?;
    let mut cache = objective.follow(&placed)?;
    let mut chain = objective.space.chain(at);
    for (k, held) in held.iter().enumerate() {
        if *held {
            chain.column_mut(k).fill(0.0);
        }
    }
    let reach = SWITCH_REACH * objective.loss.sigma;
    let chunks = objective.chunks(Some(&mut cache)).into_par_iter();
    let switches: Vec<Vec<Switch>> =
        chunks.map(|mut chunk| of_chunk(objective, &placed, &mut chunk, reach, &chain)).collect();
    Some(switches.into_iter().flatten().collect())
}

fn of_chunk(
    objective: &Objective,
    placed: &Placed,
    chunk: &mut Chunk,
    reach: f64,
    chain: &DMatrix<f64>,
) -> Vec<Switch> {
    let mut nearest = objective.correspondences(placed, chunk);
    // Points of which the cache knows that no other facet is within reach (their slack is half of it) have no switch.
    if let Some(cache) = &chunk.cache {
        nearest.retain(|f| cache.known[f.index - chunk.range.start].until - cache.travelled < 0.49 * reach);
    }
    let (mut both, mut others) = (Vec::new(), Vec::new());
    for matched in objective.with_feet(placed, &nearest) {
        for (point, foot) in matched.points.iter().zip(&matched.feet) {
            if let Some(other) = objective.elsewhere(placed, point, foot.d2.sqrt() + reach) {
                both.push(Correspondence { uv: foot.uv, ..*point });
                others.push(other);
            }
        }
    }
    others.sort_by_key(|f| f.patch);
    let mut at_nearest = contributions(objective, placed, &both);
    at_nearest.sort_by_key(|contribution| contribution.point);
    let of_other = |other: Contribution| {
        let nearest = &at_nearest[at_nearest.binary_search_by_key(&other.point, |nearest| nearest.point).ok()?];
        let mut by_x = DVector::zeros(chain.nrows());
        for (contribution, sign) in [(&other, 1.0), (nearest, -1.0)] {
            for (i, slope) in contribution.columns.iter().zip(&contribution.slopes) {
                by_x[*i] += sign * slope;
            }
        }
        Some(Switch { difference: other.loss - nearest.loss, slope: chain.tr_mul(&by_x) })
    };
    contributions(objective, placed, &others).into_iter().filter_map(of_other).collect()
}

/// The contributions of points at the patches that they are given to.
fn contributions(objective: &Objective, placed: &Placed, points: &[Correspondence]) -> Vec<Contribution> {
    let half = 0.5 * objective.loss.sigma * objective.loss.sigma;
    let mut all = Vec::with_capacity(points.len());
    for matched in objective.with_feet(placed, points) {
        let Some(rows) = objective.rows(&*placed.instance, &matched) else { continue };
        all.extend(rows.iter().zip(&matched.losses).map(|((point, row), loss)| Contribution {
            point: point.index as usize,
            loss: half * loss.value,
            columns: rows.columns.clone(),
            slopes: row.iter().map(|r| score(point) * r).collect(),
        }));
    }
    all
}

/// The mean Hessian over estimates that are distributed as `covariance` says: `bread`, the one without switches, less
/// the sum of N(difference; 0, slope^T C slope) slope slope^T over the switches, as min(f, g) has the second derivative
/// -delta(g - f) (g' - f')^2 beside its branches'.
pub(crate) fn smoothed(bread: &DMatrix<f64>, switches: &[Switch], covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let dim = bread.nrows();
    let mut reduction = DMatrix::zeros(dim, dim);
    for Switch { difference, slope } in switches {
        let variance = slope.dot(&(covariance * slope));
        if variance > 0.0 {
            let density = (-0.5 * difference * difference / variance).exp() / (std::f64::consts::TAU * variance).sqrt();
            reduction.ger(density, slope, slope, 1.0);
        }
    }
    // Compared with what is there, direction by direction.
    let ridge = DMatrix::identity(dim, dim) * (1e-12 * bread.diagonal().amax());
    let Some(factor) = (bread + ridge).cholesky() else { return bread.clone() };
    let l = factor.l();
    let Some(half) = l.solve_lower_triangular(&reduction) else { return bread.clone() };
    let Some(relative) = l.solve_lower_triangular(&half.transpose()) else { return bread.clone() };
    let mut eigen = eigen::symmetric(0.5 * (&relative + relative.transpose()));
    eigen.eigenvalues.apply(|e| *e = 1.0 - e.clamp(0.0, SWITCH_CAP));
    let Eigen { eigenvalues, eigenvectors } = eigen;
    let basis = &l * eigenvectors;
    &basis * DMatrix::from_diagonal(&eigenvalues) * basis.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_minimum_of_two_parabolas_is_as_flat_as_it_is_between_them() {
        // f = sum over i of min(x^2 / 2, (x - t_i)^2 / 2), t_i evenly spread over +-2 with a density of 100: the second
        // derivative of the mean over N(0, v) is 400 less the sum of N(t^2 / 2; 0, v t^2) t^2.
        let v: f64 = 0.01;
        let shifts: Vec<f64> = (0..400).map(|i| (f64::from(i) + 0.5) / 100.0 - 2.0).collect();
        let switches: Vec<Switch> =
            shifts.iter().map(|t| Switch { difference: 0.5 * t * t, slope: DVector::from_element(1, -t) }).collect();
        let smooth = smoothed(&DMatrix::from_element(1, 1, 400.0), &switches, &DMatrix::from_element(1, 1, v))[(0, 0)];
        // By differences of the mean's derivative, over a fine grid of the normal distribution.
        let mean_slope = |at: f64| {
            let grid = (-4000..=4000).map(|k| f64::from(k) / 1000.0);
            let (mut sum, mut weight) = (0.0, 0.0);
            for z in grid {
                let (x, w) = (at + z * v.sqrt(), (-0.5 * z * z).exp());
                let slope = |t: &f64| if x.abs() <= (x - t).abs() { x } else { x - t };
                sum += w * shifts.iter().map(slope).sum::<f64>();
                weight += w;
            }
            sum / weight
        };
        let expected = (mean_slope(0.05) - mean_slope(-0.05)) / 0.1;
        assert!((smooth - expected).abs() < 0.02 * 400.0 && smooth < 399.0, "{smooth} {expected}");
    }
}
