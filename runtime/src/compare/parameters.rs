//! The parameters of two states, one by one and together.

use crate::fit::chi_squared_tail;
use gml_compiler::program::Quantity;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Differences whose probability by chance is below this are significant.
const SIGNIFICANT: f64 = 0.05;

/// Differences below this share of the values are rounding.
const ROUNDING: f64 = 1e-12;

/// The value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Stated {
    /// Its name.
    pub name: String,
    /// Its quantity: a length, an angle or a number.
    pub quantity: Quantity,
    /// Its value: millimetres, radians or a bare number.
    pub value: f64,
    /// Its standard deviation, or the reason why it has none; none where it was not fitted: it is what was given.
    pub sd: Option<Result<f64, String>>,
}

/// The covariance of some parameters.
#[derive(Clone, Copy, Debug)]
pub struct StatedCovariance<'a> {
    /// Their names.
    pub parameters: &'a [String],
    /// The matrix by rows, in the parameters' units.
    pub matrix: &'a [Vec<f64>],
}

/// The parameters of a model in one state.
#[derive(Clone, Copy, Debug)]
pub struct States<'a> {
    /// All of them, in the model's order.
    pub parameters: &'a [Stated],
    /// The covariance of those that have standard deviations.
    pub covariance: Option<StatedCovariance<'a>>,
    /// The hash of the scan to which it was fitted, or whatever tells scans apart; none where it was not fitted.
    pub scan: Option<&'a str>,
}

impl States<'_> {
    /// Whether a parameter was not fitted.
    fn is_exact(&self, name: &str) -> bool {
        self.parameters.iter().any(|p| p.name == name && p.sd.is_none())
    }

    /// The row of a parameter in the covariance.
    fn row(&self, name: &str) -> Option<usize> {
        self.covariance?.parameters.iter().position(|p| p == name)
    }

    /// The covariance of two parameters: 0 where they were not fitted.
    fn covariance(&self, first: &str, second: &str) -> f64 {
        let (Some(covariance), Some(i), Some(j)) = (self.covariance, self.row(first), self.row(second)) else {
            return 0.0;
        };
        covariance.matrix.get(i).and_then(|row| row.get(j)).copied().unwrap_or(f64::NAN)
    }
}

/// A parameter that both states have.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterDifference {
    /// Its name.
    pub name: String,
    /// Unit of all figures: `mm`, `rad` or empty.
    pub unit: String,
    /// Its quantity: a length, an angle or a number.
    pub quantity: Quantity,
    /// Its value in A.
    pub a: f64,
    /// Its value in B.
    pub b: f64,
    /// B - A.
    pub difference: f64,
    /// Standard deviation of the difference: the root of the sum of the squares of those of A and B.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sd: Option<f64>,
    /// The difference divided by it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z: Option<f64>,
    /// The probability of such a difference, either way, or a larger one if the true values are equal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p: Option<f64>,
    /// Whether that is below 5 %.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub significant: Option<bool>,
    /// Why there is no standard deviation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub without_sd: Option<String>,
}

/// The test of all differences together, by the sum of both covariances.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointTest {
    /// Names of the parameters.
    pub parameters: Vec<String>,
    /// d^T C^-1 d.
    pub statistic: f64,
    /// Degrees of freedom.
    pub degrees: usize,
    /// The probability of such a statistic or a larger one if all true values are equal.
    pub p: f64,
}

/// The comparison of two states.
#[derive(Clone, Debug, Default)]
pub(super) struct Parameters {
    pub(super) differences: Vec<ParameterDifference>,
    pub(super) only_a: Vec<String>,
    pub(super) only_b: Vec<String>,
    pub(super) together: Option<JointTest>,
    pub(super) warnings: Vec<String>,
}

/// Compares parameters by their names. Those of A that move the model as a whole (`of_whole`, empty if none does) are
/// not held against their standard deviations.
pub(super) fn compare(a: &States<'_>, b: &States<'_>, of_whole: &[bool]) -> Parameters {
    let same = |x: &Stated, y: &Stated| x.name == y.name && x.quantity == y.quantity;
    let lacking = |of: &States<'_>, other: &States<'_>| -> Vec<String> {
        let lacks = |p: &&Stated| !other.parameters.iter().any(|q| same(p, q));
        of.parameters.iter().filter(lacks).map(|p| p.name.clone()).collect()
    };
    let both = a.parameters.iter().enumerate();
    let both = both.filter_map(|(k, p)| Some((k, p, b.parameters.iter().find(|q| same(p, q))?)));
    let is_pose = |k: usize| of_whole.get(k).copied().unwrap_or(false);
    let differences: Vec<ParameterDifference> = both.map(|(k, p, q)| difference(p, q, is_pose(k))).collect();
    let together = together(a, b, &differences);
    let mut warnings = Vec::new();
    if a.scan.is_some() && a.scan == b.scan && differences.iter().any(|d| d.sd.is_some()) {
        warnings.push(
            "both were fitted to the same scan, so that they share its errors: the standard deviations of the \
             differences are those of independent scans, and too large"
                .to_owned(),
        );
    }
    Parameters { differences, only_a: lacking(a, b), only_b: lacking(b, a), together, warnings }
}

fn difference(a: &Stated, b: &Stated, is_pose: bool) -> ParameterDifference {
    // Values that come from one number by other ways differ by rounding.
    let exact = b.value - a.value;
    let difference = if exact.abs() <= ROUNDING * a.value.abs().max(b.value.abs()) { 0.0 } else { exact };
    let variance = match (&a.sd, &b.sd) {
        _ if is_pose => Err("part of the pose, which the alignment takes back".to_owned()),
        (None, None) => Err("neither was fitted".to_owned()),
        (Some(Err(why)), Some(Err(other))) if why == other => Err(format!("A and B: {why}")),
        (Some(Err(why)), Some(Err(other))) => Err(format!("A: {why}; B: {other}")),
        (Some(Err(why)), _) => Err(format!("A: {why}")),
        (_, Some(Err(why))) => Err(format!("B: {why}")),
        (x, y) => Ok([x, y].into_iter().flatten().flatten().map(|sd| sd * sd).sum::<f64>()),
    };
    let sd = variance.as_ref().ok().map(|variance| variance.sqrt());
    let z = sd.filter(|sd| *sd > 0.0).map(|sd| difference / sd);
    let p = z.map(|z| chi_squared_tail(z * z, 1));
    ParameterDifference {
        name: a.name.clone(),
        unit: a.quantity.unit().to_owned(),
        quantity: a.quantity,
        a: a.value,
        b: b.value,
        difference,
        sd,
        z,
        p,
        significant: p.map(|p| p < SIGNIFICANT),
        without_sd: variance.err(),
    }
}

/// The test of the parameters that have standard deviations; none of fewer than two, or where they are not determined
/// together.
fn together(a: &States<'_>, b: &States<'_>, differences: &[ParameterDifference]) -> Option<JointTest> {
    let usable = |d: &&ParameterDifference| {
        let known = |states: &States<'_>| states.is_exact(&d.name) || states.row(&d.name).is_some();
        d.sd.is_some_and(|sd| sd > 0.0) && known(a) && known(b)
    };
    let tested: Vec<&ParameterDifference> = differences.iter().filter(usable).collect();
    if tested.len() < 2 {
        return None;
    }
    let count = tested.len();
    // Units differ by many orders of magnitude: columns are those of correlations.
    let scale: Vec<f64> = tested.iter().map(|d| d.sd.unwrap_or(1.0)).collect();
    let matrix = DMatrix::from_fn(count, count, |i, j| {
        let (first, second) = (&tested[i].name, &tested[j].name);
        (a.covariance(first, second) + b.covariance(first, second)) / (scale[i] * scale[j])
    });
    let off = DVector::from_iterator(count, tested.iter().zip(&scale).map(|(d, scale)| d.difference / scale));
    let statistic = off.dot(&matrix.cholesky()?.solve(&off));
    let p = chi_squared_tail(statistic, count);
    let parameters = tested.iter().map(|d| d.name.clone()).collect();
    statistic.is_finite().then_some(JointTest { parameters, statistic, degrees: count, p })
}
