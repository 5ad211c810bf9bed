//! The outcome of one scan: a row of the table.

use crate::fit::{FitResult, FittedMeasure, FittedParameter};
use crate::variance::{PartStatistics, Statistics, VarianceReport, null_as_nan};
use serde::{Deserialize, Serialize};

/// The version of rows and tables: it changes where a column changes its name or its meaning, or vanishes.
pub const SCHEMA: u32 = 1;

/// The outcome of one scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// [`SCHEMA`] of the program that made it.
    pub schema: u32,
    /// The scan's file as it was given.
    pub scan: String,
    /// The scan's name in the results: that of its folder.
    pub name: String,
    /// SHA-256 of the scan's file, in hexadecimal; empty where it could not be read.
    pub scan_sha256: String,
    /// SHA-256 of what the outcome follows from: scan, script, settings and program.
    pub key: String,
    /// The program and its version.
    pub tool: String,
    /// When the work on this scan began, in UTC (ISO 8601).
    pub time: String,
    /// Seconds that the work took, by the clock.
    pub seconds: f64,
    /// What came out.
    pub outcome: Outcome,
}

/// What came out of a scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "status", rename_all = "lowercase")]
pub enum Outcome {
    /// It was fitted and measured, well or not.
    Inspected(Box<Inspected>),
    /// There is no result.
    Failed {
        /// A sentence that says why.
        reason: String,
    },
    /// The file is that of another row: what is measured once counts once.
    Copy {
        /// The other one's path.
        of: String,
    },
}

/// Figures of a fit and of its deviations.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Inspected {
    /// The script's inputs and their values, as they are written on the command line.
    pub inputs: Vec<String>,
    /// SHA-256 of the script, in hexadecimal.
    pub script_sha256: String,
    /// Points of the scan after cleaning.
    pub points: usize,
    /// Standard deviation of the scan's noise. Millimetres.
    #[serde(deserialize_with = "null_as_nan")]
    pub noise: f64,
    /// Scale of the loss. Millimetres.
    #[serde(deserialize_with = "null_as_nan")]
    pub sigma: f64,
    /// Fraction of the points near the model.
    #[serde(deserialize_with = "null_as_nan")]
    pub inliers: f64,
    /// Root mean square distance of these. Millimetres.
    #[serde(deserialize_with = "null_as_nan")]
    pub rms: f64,
    /// Whether the fit converged.
    pub converged: bool,
    /// Why the fit cannot be relied on; none if it can.
    pub shortcoming: Option<String>,
    /// The verdict on all tolerances: `conforms`, `does not conform` or `undecided`; none without tolerances.
    pub verdict: Option<String>,
    /// The script's parameters, in its order.
    pub parameters: Vec<Measured>,
    /// The script's measures, in its order.
    pub measures: Vec<Measured>,
    /// The covariance of the parameters that have a standard deviation: their names, and the matrix by rows in their
    /// units.
    pub covariance: (Vec<String>, Vec<Vec<f64>>),
    /// Deviations of all parts together.
    pub surface: PartRow,
    /// Deviations of each part, in the model's order.
    pub parts: Vec<PartRow>,
    /// Sentences on what is not to be relied on, of the fit and of the measurement.
    pub warnings: Vec<String>,
}

/// A parameter or a measure.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Its name.
    pub name: String,
    /// `mm`, `rad`, a power of `mm`, or empty.
    pub unit: String,
    /// Its value; none where it cannot be computed.
    pub value: Option<f64>,
    /// Standard deviation of the value by this scan; none where it has none.
    pub sd: Option<f64>,
    /// Standard deviation by the noise of single points alone: without errors that all scans of one model share, such
    /// as that of a shape which the model does not have.
    pub noise_sd: Option<f64>,
    /// Why it has none.
    pub without_sd: Option<String>,
    /// Whether the user held it.
    pub fixed: bool,
    /// Whether it ended at one of its bounds.
    pub at_bound: bool,
    /// The nominal value of a measure.
    pub nominal: Option<f64>,
    /// The deviations from it that are allowed, least and greatest, of a measure with a tolerance.
    pub tolerance: Option<[f64; 2]>,
    /// The verdict on a measure with a tolerance.
    pub verdict: Option<String>,
}

/// Deviations of a part.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PartRow {
    /// The part's name; empty of all together.
    pub name: String,
    /// Area. Square millimetres.
    #[serde(deserialize_with = "null_as_nan")]
    pub area: f64,
    /// Share of the area that was measured.
    #[serde(deserialize_with = "null_as_nan")]
    pub coverage: f64,
    /// Mean of the signed distances, weighted by area; positive where the scan lies outside. Millimetres.
    pub mean: Option<f64>,
    /// Root mean square distance. Millimetres.
    pub rms: Option<f64>,
    /// The 95th percentile of the unsigned distances. Millimetres.
    pub p95: Option<f64>,
    /// The largest unsigned distance. Millimetres.
    pub max: Option<f64>,
    /// Share of the measured area within the tolerance, or within three times the noise where there is none.
    pub within: Option<f64>,
    /// The verdict on the part's tolerance, if it has one.
    pub verdict: Option<String>,
}

impl Inspected {
    /// The figures of a fit and of the deviations from the fitted model.
    #[must_use]
    pub fn of(fit: &FitResult, report: &VarianceReport) -> Self {
        let mut warnings = fit.warnings.clone();
        warnings.extend(report.warnings.iter().filter(|w| !fit.warnings.contains(w)).cloned());
        let covariance = fit.covariance.as_ref().map(|c| (c.parameters.clone(), c.matrix.clone()));
        Self {
            inputs: fit.inputs.iter().map(ToString::to_string).collect(),
            script_sha256: fit.script_sha256.clone().unwrap_or_default(),
            points: fit.scan.points,
            noise: fit.noise,
            sigma: fit.sigma,
            inliers: fit.inliers,
            rms: fit.rms,
            converged: fit.converged,
            shortcoming: fit.shortcoming(),
            verdict: report.verdict.as_ref().map(|v| v.outcome.text().to_owned()),
            parameters: fit.parameters.iter().map(|p| of_parameter(p, fit)).collect(),
            measures: fit.measures.iter().map(|m| of_measure(m, fit, report)).collect(),
            covariance: covariance.unwrap_or_default(),
            surface: PartRow { verdict: None, ..of_statistics("", &report.overall) },
            parts: report.parts.iter().map(of_part).collect(),
            warnings,
        }
    }

    /// Whether the fit can be relied on.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.shortcoming.is_none()
    }
}

impl Row {
    /// The figures; none of a scan without a result.
    #[must_use]
    pub fn inspected(&self) -> Option<&Inspected> {
        match &self.outcome {
            Outcome::Inspected(inspected) => Some(inspected),
            Outcome::Failed { .. } | Outcome::Copy { .. } => None,
        }
    }

    /// Why there is no result where there should be one.
    #[must_use]
    pub fn failure(&self) -> Option<&str> {
        match &self.outcome {
            Outcome::Failed { reason } => Some(reason),
            _ => None,
        }
    }

    /// The figures of a fit that can be relied on.
    #[must_use]
    pub fn sound(&self) -> Option<&Inspected> {
        self.inspected().filter(|inspected| inspected.is_sound())
    }
}

fn of_parameter(parameter: &FittedParameter, fit: &FitResult) -> Measured {
    let noise_sd = fit.covariance.as_ref().and_then(|covariance| {
        let place = covariance.parameters.iter().position(|name| *name == parameter.name)?;
        covariance.naive.get(place).copied().filter(|sd| *sd > 0.0 && sd.is_finite())
    });
    Measured {
        name: parameter.name.clone(),
        unit: parameter.unit.clone(),
        value: Some(parameter.value),
        sd: parameter.sd,
        noise_sd,
        without_sd: parameter.without_sd.map(|reason| reason.text().to_owned()),
        fixed: parameter.fixed,
        at_bound: parameter.at_bound,
        ..Measured::default()
    }
}

fn of_measure(measure: &FittedMeasure, fit: &FitResult, report: &VarianceReport) -> Measured {
    let verdict = report.measures.iter().find(|verdict| verdict.name == measure.name);
    Measured {
        name: measure.name.clone(),
        unit: measure.unit.clone(),
        value: measure.value,
        sd: measure.sd,
        noise_sd: noise_of_measure(measure, fit),
        without_sd: measure.without_sd.clone(),
        fixed: false,
        at_bound: !measure.at_bound.is_empty(),
        nominal: measure.nominal,
        tolerance: measure.tolerance.map(|t| [t.lower, t.upper]),
        verdict: verdict.map(|v| v.outcome.text().to_owned()),
    }
}

/// The standard deviation of a measure by the noise of single points alone, to first order; none where a parameter that
/// it depends on has none.
fn noise_of_measure(measure: &FittedMeasure, fit: &FitResult) -> Option<f64> {
    let covariance = fit.covariance.as_ref()?;
    let place = |name: &String| covariance.parameters.iter().position(|other| other == name);
    let is_held = |name: &String| fit.parameters.iter().any(|p| p.name == *name && p.fixed);
    let free = measure.derivatives.iter().filter(|(name, _)| !is_held(name));
    let moved = free.map(|(name, slope)| {
        let k = place(name)?;
        Some((k, slope * covariance.naive.get(k)?))
    });
    let moved = moved.collect::<Option<Vec<(usize, f64)>>>()?;
    let with =
        |(i, a): &(usize, f64)| -> f64 { moved.iter().map(|(k, b)| a * b * covariance.correlations[*i][*k]).sum() };
    let variance: f64 = moved.iter().map(with).sum();
    Some(variance.sqrt()).filter(|sd| *sd > 0.0 && sd.is_finite())
}

fn of_part(part: &PartStatistics) -> PartRow {
    let verdict = part.verdict.as_ref().map(|v| v.outcome.text().to_owned());
    PartRow { verdict, ..of_statistics(&part.name, &part.statistics) }
}

fn of_statistics(name: &str, statistics: &Statistics) -> PartRow {
    let moments = &statistics.weighted;
    let is_measured = statistics.measured_texels > 0;
    let figure = |x: f64| Some(x).filter(|x| is_measured && x.is_finite());
    PartRow {
        name: name.to_owned(),
        area: statistics.area,
        coverage: statistics.coverage,
        mean: figure(moments.signed.mean),
        rms: figure(moments.rms),
        p95: figure(moments.percentiles.p95),
        max: figure(moments.max),
        within: statistics.agreement.map(|a| a.within.share).and_then(figure),
        verdict: None,
    }
}
