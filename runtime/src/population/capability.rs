//! Indices of capability: how much room a tolerance leaves to a process.

use super::chart::IndividualsChart;
use super::normality::Normality;
use crate::spread::mean_and_sd;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

/// Coverage of all intervals.
pub(super) const COVERAGE: f64 = 0.95;

/// Below this probability values are called not normal.
const IMPROBABLE: f64 = 0.05;

/// Degrees of freedom per value of the standard deviation from moving ranges: its variance is 0.826 sigma^2 / n (Cryer
/// and Ryan, *The estimation of sigma for an X chart*, Journal of Quality Technology 22, 1990), that of a sample
/// standard deviation sigma^2 / (2 degrees).
const DEGREES_OF_RANGES: f64 = 1.0 / (2.0 * 0.8264);

/// The values that a tolerance allows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// The least.
    pub lower: f64,
    /// The greatest.
    pub upper: f64,
}

/// An index with its confidence limits at 95 %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Index {
    /// Its value.
    pub value: f64,
    /// The confidence limits.
    pub interval: [f64; 2],
}

/// Indices of capability and performance (ISO 22514-2): the width of the tolerance over six standard deviations, and
/// the distance of the mean from the nearer limit over three; Cp and Cpk with the standard deviation within short
/// spans, Pp and Ppk with that of all values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Capability {
    /// The values that are allowed.
    pub limits: Limits,
    /// The number of values.
    pub count: usize,
    /// Standard deviation of all values, that of measurement included.
    pub sd: f64,
    /// None where neighbours do not differ.
    pub cp: Option<Index>,
    /// None where neighbours do not differ.
    pub cpk: Option<Index>,
    /// The potential performance.
    pub pp: Index,
    /// The performance.
    pub ppk: Index,
    /// Values beyond the limits.
    pub beyond: usize,
    /// The test for a normal distribution, on which what the indices say of parts per million rests.
    pub normality: Option<Normality>,
    /// What to mind when reading the indices.
    pub notes: Vec<String>,
}

impl Capability {
    /// The indices of values; none of fewer than two, or where all are equal. `measurement_sd` is the standard
    /// deviation that measurement adds to the values.
    #[must_use]
    pub fn of(values: &[f64], limits: Limits, chart: &IndividualsChart, measurement_sd: f64) -> Option<Self> {
        let (mean, sd) = mean_and_sd(values);
        let n = values.len() as f64;
        let is_order = limits.lower < limits.upper;
        if values.len() < 2 || !(sd > 0.0) || !is_order {
            return None;
        }
        let potential = |sd: f64| (limits.upper - limits.lower) / (6.0 * sd);
        let actual = |sd: f64| (limits.upper - mean).min(mean - limits.lower) / (3.0 * sd);
        let within = (chart.sigma > 0.0).then_some((chart.sigma, DEGREES_OF_RANGES * n));
        let normality = Normality::of(values);
        let mut notes = Vec::new();
        if let Some(Normality { p, .. }) = normality.filter(|test| test.p < IMPROBABLE) {
            notes.push(format!(
                "the values are not normal (p = {p:.3}): the indices do not tell shares beyond the limits"
            ));
        }
        if !chart.signals.is_empty() {
            notes.push("the process is not in control: Cp and Cpk are of a process that is not there".to_owned());
        }
        let share = (measurement_sd / sd).powi(2).min(1.0);
        if share > 0.1 {
            let percent = 100.0 * share;
            notes.push(format!("{percent:.0} % of the variance is that of measurement: the parts vary less"));
        }
        Some(Self {
            limits,
            count: values.len(),
            sd,
            cp: within.map(|(sigma, degrees)| of_width(potential(sigma), degrees)),
            cpk: within.map(|(sigma, degrees)| of_distance(actual(sigma), n, degrees)),
            pp: of_width(potential(sd), n - 1.0),
            ppk: of_distance(actual(sd), n, n - 1.0),
            beyond: values.iter().filter(|v| !(limits.lower..=limits.upper).contains(*v)).count(),
            normality,
            notes,
        })
    }
}

/// An index that is inversely proportional to a standard deviation of so many degrees of freedom: by chi-squared.
fn of_width(value: f64, degrees: f64) -> Index {
    let Ok(distribution) = ChiSquared::new(degrees) else { return Index { value, interval: [f64::NAN; 2] } };
    let tail = (1.0 - COVERAGE) / 2.0;
    let limit = |p: f64| value * (distribution.inverse_cdf(p) / degrees).sqrt();
    Index { value, interval: [limit(tail), limit(1.0 - tail)] }
}

/// An index of the distance to a limit: Bissell, *How reliable is your capability index?*, Applied Statistics 39, 1990.
fn of_distance(value: f64, count: f64, degrees: f64) -> Index {
    let z = Normal::standard().inverse_cdf(0.5 + COVERAGE / 2.0);
    let reach = z * (1.0 / (9.0 * count) + value * value / (2.0 * degrees)).sqrt();
    Index { value, interval: [value - reach, value + reach] }
}
