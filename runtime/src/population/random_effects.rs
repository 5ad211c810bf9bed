//! Mean and spread of a quantity over objects, each of which was measured with an uncertainty of its own.

use super::capability::COVERAGE;
use crate::spread::mean_and_sd;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal, StudentsT};

/// Values that agree better than in one of so many populations say that their standard deviations are too large.
const IMPROBABLE: f64 = 0.01;

/// Objects are taken for different where equal ones would have such values in fewer of so many populations.
pub const DIFFERENT: f64 = 0.01;

/// Halvings of an interval: more than a double has digits.
const HALVINGS: usize = 200;

/// Doublings of a variance until it is too large.
const DOUBLINGS: usize = 200;

/// y_i = mean + b_i + e_i with b_i of variance tau^2, which is that between objects, and e_i of the known variance of
/// measurement i. tau^2 by restricted maximum likelihood, its interval by the Q profile (Viechtbauer, *Confidence
/// intervals for the amount of heterogeneity in meta-analysis*, Statistics in Medicine 26, 2007); the interval of the
/// mean by Hartung and Knapp (Statistics in Medicine 20, 2001), with a standard error of no less than that of the
/// weights.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RandomEffects {
    /// The number of objects.
    pub count: usize,
    /// The mean over objects.
    pub mean: f64,
    /// The standard error of the mean.
    pub standard_error: f64,
    /// What the errors of all scans may have in common, as far as it is more than the noise of single points: the mean
    /// over any number of them has it. 0 where that is not known.
    pub shared: f64,
    /// The confidence limits of the mean at 95 %, `shared` included.
    pub mean_interval: [f64; 2],
    /// Standard deviation between objects, without that of measurement.
    pub between: f64,
    /// Its confidence limits at 95 %.
    pub between_interval: [f64; 2],
    /// Root mean square of the standard deviations of measurement.
    pub measurement: f64,
    /// Sum of the squared differences from the weighted mean, in variances of measurement (Cochran's Q).
    pub q: f64,
    /// The probability of such a Q, or a larger one, if all objects were equal.
    pub p_equal: f64,
    /// Whether the values differ by less than their standard deviations allow: these hold an error that all objects
    /// share, as where the model lacks a shape that all of them have. Then `between` may be too small.
    pub overstated: bool,
}

impl RandomEffects {
    /// The estimate from values with standard deviations; none of fewer than two, or if one has none.
    #[must_use]
    pub fn of(measured: &[(f64, f64)]) -> Option<Self> {
        let is_known = |(value, sd): &(f64, f64)| value.is_finite() && sd.is_finite() && *sd > 0.0;
        if measured.len() < 2 || !measured.iter().all(is_known) {
            return None;
        }
        let problem = Problem { measured };
        let degrees = (measured.len() - 1) as f64;
        let variance = problem.restricted_likelihood();
        let (mean, weight) = problem.mean(variance);
        // Values that agree by chance do not make the mean better known than their standard deviations say.
        let spread = (problem.q(variance) / degrees).max(1.0);
        let standard_error = (spread / weight).sqrt();
        let tail = (1.0 - COVERAGE) / 2.0;
        let t = StudentsT::new(0.0, 1.0, degrees).ok()?.inverse_cdf(1.0 - tail);
        let chi = ChiSquared::new(degrees).ok()?;
        let (q, [low, high]) = (problem.q(0.0), [1.0 - tail, tail].map(|p| problem.profile(chi.inverse_cdf(p))));
        // Values that agree that well say nothing against any spread between objects which they have themselves.
        let high = if high > 0.0 { high } else { largest(measured).powi(2) };
        let measurement = (measured.iter().map(|(_, sd)| sd * sd).sum::<f64>() / measured.len() as f64).sqrt();
        Some(Self {
            count: measured.len(),
            mean,
            standard_error,
            shared: 0.0,
            mean_interval: [mean - t * standard_error, mean + t * standard_error],
            between: variance.sqrt(),
            between_interval: [low.sqrt(), high.sqrt()],
            measurement,
            q,
            p_equal: chi.sf(q),
            overstated: chi.cdf(q) < IMPROBABLE,
        })
    }
}

impl RandomEffects {
    /// The same with a further error that scans may share: a standard deviation.
    #[must_use]
    pub fn with_shared(self, shared: f64) -> Self {
        let [low, high] = self.mean_interval;
        let reach = Normal::standard().inverse_cdf(0.5 + COVERAGE / 2.0) * shared;
        let half = (0.5 * (high - low)).hypot(reach);
        let shared = self.shared.hypot(shared);
        Self { shared, mean_interval: [self.mean - half, self.mean + half], ..self }
    }

    /// The same where the standard deviations hold an error that all objects share and nothing tells it from their own:
    /// the spread between objects is then at most that of the values.
    #[must_use]
    pub fn bounded(self, measured: &[(f64, f64)]) -> Self {
        Self { between: f64::NAN, between_interval: [0.0, largest(measured)], ..self }
    }

    /// Whether the values show that objects differ.
    #[must_use]
    pub fn shows_difference(&self) -> bool {
        self.between.is_finite() && self.p_equal < DIFFERENT
    }
}

/// The upper confidence limit of the spread of the values, measurement included.
fn largest(measured: &[(f64, f64)]) -> f64 {
    let values: Vec<f64> = measured.iter().map(|(value, _)| *value).collect();
    let (_, sd) = mean_and_sd(&values);
    let degrees = (values.len() - 1) as f64;
    let lowest = ChiSquared::new(degrees).map_or(f64::NAN, |chi| chi.inverse_cdf((1.0 - COVERAGE) / 2.0));
    sd * (degrees / lowest).sqrt()
}

struct Problem<'a> {
    measured: &'a [(f64, f64)],
}

impl Problem<'_> {
    fn weights(&self, variance: f64) -> impl Iterator<Item = (f64, f64)> {
        self.measured.iter().map(move |(y, sd)| (*y, 1.0 / (sd * sd + variance)))
    }

    /// The weighted mean, and the sum of the weights.
    fn mean(&self, variance: f64) -> (f64, f64) {
        let (sum, weight) = self.weights(variance).fold((0.0, 0.0), |(s, w), (y, wy)| (s + wy * y, w + wy));
        (sum / weight, weight)
    }

    /// Cochran's Q with that variance between objects: it falls as the variance grows.
    fn q(&self, variance: f64) -> f64 {
        let (mean, _) = self.mean(variance);
        self.weights(variance).map(|(y, w)| w * (y - mean).powi(2)).sum()
    }

    /// The variance at which Q has a value; 0 where it is below it everywhere.
    fn profile(&self, goal: f64) -> f64 {
        root(|variance| self.q(variance) - goal, self.scale())
    }

    /// The derivative of the restricted log-likelihood by the variance, twice:
    /// sum w^2 (y - mean)^2 - sum w + sum w^2 / sum w.
    fn slope(&self, variance: f64) -> f64 {
        let (mean, weight) = self.mean(variance);
        let square: f64 = self.weights(variance).map(|(_, w)| w * w).sum();
        self.weights(variance).map(|(y, w)| (w * (y - mean)).powi(2)).sum::<f64>() - weight + square / weight
    }

    fn restricted_likelihood(&self) -> f64 {
        root(|variance| self.slope(variance), self.scale())
    }

    /// A variance that is small beside those that are sought.
    fn scale(&self) -> f64 {
        1e-3 * self.measured.iter().map(|(_, sd)| sd * sd).fold(f64::INFINITY, f64::min)
    }
}

/// The root of a function that is positive up to there, 0 if it is nowhere; `step` is where the search begins.
fn root(f: impl Fn(f64) -> f64, step: f64) -> f64 {
    if !(f(0.0) > 0.0) {
        return 0.0;
    }
    let Some(mut high) = (0..DOUBLINGS).map(|k| step * 2f64.powi(k as i32)).find(|x| !(f(*x) > 0.0)) else {
        return f64::INFINITY;
    };
    let mut low = 0.0;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if f(middle) > 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}
