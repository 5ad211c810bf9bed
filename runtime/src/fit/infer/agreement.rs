//! Whether a scan shows the same shape as the other scans: Wald's test of the difference between two fits, one of that
//! scan alone and one of the others. Each fit has a covariance of its own, by its own residuals: those of one shape in
//! all scans hold the very difference that is in question.

use super::joint::JointUncertainty;
use super::rounding;
use super::sandwich::Uncertainty;
use super::significance::chi_squared_tail;
use crate::eigen;
use crate::fit::refine::schedule::Solution;
use crate::fit::result::{Agreement, ShapeDifference};
use crate::fit::tuning::{DIFFERENT, UNCERTAIN};
use nalgebra::{DMatrix, DVector};

/// Eigenvalues of the covariance of a difference, in units of its standard deviations, below which there is only
/// rounding.
const SINGULAR: f64 = 1e-9;

/// The shape of some scans, by a fit of them.
pub(crate) struct Shape {
    /// By parameter of the script.
    x: Vec<f64>,
    /// dx by the coordinates of the uncertainty.
    slope: DMatrix<f64>,
    uncertainty: Uncertainty,
}

impl Shape {
    /// The shape of scans that have the solutions `of`. None where its standard deviations are not known.
    pub(crate) fn of(of: &[Solution], uncertainty: Option<JointUncertainty>) -> Option<Self> {
        let first = &of[0];
        let uncertainty = uncertainty.filter(JointUncertainty::is_held)?.of_scans.swap_remove(0);
        // Rounded coordinates put whole faces off, in one scan by another amount than in the next.
        let uncertainty = if of.len() == 1 { rounding::include(first, uncertainty) } else { uncertainty };
        // Beyond a part of the object's size a shape is not linear in its parameters.
        let uncertainty = uncertainty.within(UNCERTAIN * first.level.problem.radius);
        let x = first.level.space.x(&first.estimate.z)?;
        Some(Self { x, slope: first.level.space.chain(&first.estimate), uncertainty })
    }

    /// Whether parameter i has a standard deviation.
    fn determines(&self, i: usize) -> bool {
        let row = self.slope.row(i);
        row.amax() > 0.0 && self.uncertainty.without(row.iter()).is_none()
    }

    fn covariance(&self, a: usize, b: usize) -> f64 {
        (self.slope.row(a) * &self.uncertainty.covariance * self.slope.row(b).transpose())[(0, 0)]
    }

    /// Numbers of which the covariance is made up: of blocks of dependent residuals, or of points.
    fn samples(&self) -> f64 {
        self.uncertainty.blocks.map_or(self.uncertainty.effective_points, |blocks| blocks.count as f64)
    }
}

/// Compares the shape of one scan with that of the others, over those of the parameters `free` (indices) that both
/// determine; `names` has those of all. The scans agree if the probability is not below `least`. None where there is
/// nothing to compare.
pub(crate) fn compare(own: &Shape, others: &Shape, free: &[usize], names: &[String], least: f64) -> Option<Agreement> {
    let both: Vec<usize> = free.iter().copied().filter(|i| own.determines(*i) && others.determines(*i)).collect();
    let covariance = DMatrix::from_fn(both.len(), both.len(), |a, b| {
        own.covariance(both[a], both[b]) + others.covariance(both[a], both[b])
    });
    let deviation = |k: usize| covariance[(k, k)].max(0.0).sqrt();
    if both.is_empty() || (0..both.len()).any(|k| !(deviation(k) > 0.0)) {
        return None;
    }
    let off = DVector::from_fn(both.len(), |k, _| (own.x[both[k]] - others.x[both[k]]) / deviation(k));
    let scaled = DMatrix::from_fn(both.len(), both.len(), |a, b| covariance[(a, b)] / (deviation(a) * deviation(b)));
    let eigen = eigen::symmetric(scaled);
    let known = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()).filter(|(value, _)| **value > SINGULAR);
    let terms: Vec<f64> = known.map(|(value, direction)| direction.dot(&off).powi(2) / value).collect();
    let (statistic, degrees) = (terms.iter().sum(), terms.len());
    let p = hotelling_tail(statistic, degrees, own.samples().min(others.samples()));
    let difference = |k: &usize| {
        let i = both[*k];
        ShapeDifference {
            name: names[i].clone(),
            value: own.x[i],
            sd: own.covariance(i, i).max(0.0).sqrt(),
            others: others.x[i],
            others_sd: others.covariance(i, i).max(0.0).sqrt(),
        }
    };
    let mut order: Vec<usize> = (0..both.len()).filter(|k| off[*k].abs() > DIFFERENT).collect();
    order.sort_by(|a, b| off[*b].abs().total_cmp(&off[*a].abs()));
    let agrees = !(p < least);
    Some(Agreement { statistic, degrees, p, agrees, differences: order.iter().map(difference).collect() })
}

/// The probability that Hotelling's T^2 exceeds `x`, in `degrees` dimensions by a covariance that `samples` numbers
/// tell: Bartlett's approximation (Mardia, Kent and Bibby 1979, sect. 3.7) by chi-squared, its limit for many samples.
fn hotelling_tail(x: f64, degrees: usize, samples: f64) -> f64 {
    let half = 0.5 * degrees as f64;
    if !(samples > 2.0 * half) {
        return 1.0;
    }
    chi_squared_tail((samples - half) * (x / samples).ln_1p(), degrees)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_are_those_of_f() {
        // T^2 = p n / (n - p + 1) F(p, n - p + 1): tables of F at 0.05 and 0.01.
        for (p, n, f, q) in [(1, 40.0, 4.085, 0.05), (5, 44.0, 3.514, 0.01), (10, 69.0, 2.632, 0.01)] {
            let degrees = f64::from(p);
            let x = degrees * n / (n - degrees + 1.0) * f;
            let tail = hotelling_tail(x, p as usize, n);
            assert!((tail / q - 1.0).abs() < 0.15, "{p} {n}: {tail}");
        }
        assert!((hotelling_tail(9.0, 3, 1e9) - chi_squared_tail(9.0, 3)).abs() < 1e-6);
        assert_eq!(hotelling_tail(1e9, 10, 8.0), 1.0);
    }
}
