//! Control charts of single values.

use super::excess::excess;
use serde::{Deserialize, Serialize};

/// The expected range of two values of a normal distribution, in standard deviations (ISO 7870-2:2013, d2 for n = 2).
/// It is 2 / sqrt(pi).
const D2: f64 = std::f64::consts::FRAC_2_SQRT_PI;

/// The upper limit of the moving range of two values, in mean ranges (ISO 7870-2:2013, D4 for n = 2).
const D4: f64 = 3.266_532;

/// Standard deviations between the centre and a limit.
const REACH: f64 = 3.0;

/// Values on one side of the centre in a row that are no chance (Nelson, *The Shewhart control chart*, Journal of
/// Quality Technology 16, 1984, test 2).
const RUN: usize = 9;

/// With fewer values the limits themselves are loose: their standard error is above a seventh of their distance from
/// the centre (0.91 / sqrt(n), Cryer and Ryan 1990).
const FEW: usize = 20;

/// A chart of individuals and moving ranges (ISO 7870-2).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IndividualsChart {
    /// The mean.
    pub centre: f64,
    /// Standard deviation within short spans: the mean moving range over d2.
    pub sigma: f64,
    /// The control limits of single values.
    pub limits: [f64; 2],
    /// The mean moving range.
    pub mean_range: f64,
    /// The upper control limit of moving ranges.
    pub range_limit: f64,
    /// Places that a process without special causes would hardly show.
    pub signals: Vec<Signal>,
    /// Whether there are so few values that the limits are loose.
    pub few: bool,
}

/// A place in the chart.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Signal {
    /// The place among the values, from 0.
    pub at: usize,
    /// Which test it does not pass.
    pub reason: String,
}

impl IndividualsChart {
    /// The chart of values in the order in which they came about, with their standard deviations of measurement where
    /// these are known; none of fewer than two. The limits are those of a usual measurement: a poorer one is a signal
    /// only beyond what it adds to them.
    #[must_use]
    pub fn of(values: &[f64], sds: &[Option<f64>]) -> Option<Self> {
        if values.len() < 2 {
            return None;
        }
        let centre = values.iter().sum::<f64>() / values.len() as f64;
        let ranges: Vec<f64> = values.windows(2).map(|two| (two[1] - two[0]).abs()).collect();
        let mean_range = ranges.iter().sum::<f64>() / ranges.len() as f64;
        let sigma = mean_range / D2;
        let limits = [centre - REACH * sigma, centre + REACH * sigma];
        let range_limit = D4 * mean_range;
        let mut signals = Vec::new();
        let excess = excess(sds);
        for (at, value) in values.iter().enumerate() {
            if (value - centre).abs() > REACH * (sigma * sigma + excess(at)).sqrt() {
                signals.push(Signal { at, reason: "beyond a control limit".to_owned() });
            }
        }
        let wider = |i: usize| (1.0 + 0.5 * (excess(i) + excess(i + 1)) / (sigma * sigma)).sqrt();
        for (i, _) in ranges.iter().enumerate().filter(|(i, range)| **range > range_limit * wider(*i)) {
            let reason = "the step from the one before is beyond the limit of moving ranges".to_owned();
            signals.push(Signal { at: i + 1, reason });
        }
        signals.extend(runs(values, centre));
        signals.sort_by_key(|signal| signal.at);
        Some(Self { centre, sigma, limits, mean_range, range_limit, signals, few: values.len() < FEW })
    }
}

/// The ends of runs on one side of the centre.
fn runs(values: &[f64], centre: f64) -> Vec<Signal> {
    let mut signals = Vec::new();
    let (mut length, mut side) = (0, 0.0);
    for (at, value) in values.iter().enumerate() {
        let here = if *value == centre { 0.0 } else { (value - centre).signum() };
        length = if here != 0.0 && here == side { length + 1 } else { usize::from(here != 0.0) };
        side = here;
        if length == RUN {
            signals.push(Signal { at, reason: format!("the {RUN}th in a row on one side of the mean") });
        }
    }
    signals
}
