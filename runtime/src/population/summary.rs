//! What the rows of a table say together.

use super::capability::{Capability, Limits};
use super::chart::IndividualsChart;
use super::correlation::Correlation;
use super::outlying::{Outlying, outlying};
use super::random_effects::RandomEffects;
use super::row::{Inspected, Measured, PartRow, Row, SCHEMA};
use super::variation::{Movements, Variation};
use gml_compiler::number::plain;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// Correlations between all pairs of more quantities would be a table that nobody reads.
const MOST_CORRELATED: usize = 40;

/// Quantities that correlate by more are the same but for a factor.
const SAME: f64 = 1.0 - 1e-9;

/// What a series is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Quantities {
    /// A parameter of the script.
    Parameter,
    /// A measure of the script.
    Measure,
    /// A figure of the deviations of a part.
    Part,
}

/// One quantity over the objects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Its name; of a part's figure `wall: mean`.
    pub name: String,
    /// What it is.
    pub of: Quantities,
    /// `mm`, `rad`, a power of `mm`, or empty.
    pub unit: String,
    /// The places of the objects that have a value, among the rows.
    pub rows: Vec<usize>,
    /// Their values.
    pub values: Vec<f64>,
    /// The standard deviations of measurement, where they are known.
    pub sds: Vec<Option<f64>>,
    /// Whether `sds` are those of the noise of single points alone, since those of the fits hold an error that all
    /// objects share.
    pub by_noise: bool,
    /// The nominal value, of a measure.
    pub nominal: Option<f64>,
    /// The least and the greatest value that are allowed, of a measure with a tolerance.
    pub limits: Option<Limits>,
    /// The run chart.
    pub chart: Option<IndividualsChart>,
    /// Mean and spread without the uncertainty of measurement; none where that is not known of all.
    pub effects: Option<RandomEffects>,
    /// Indices of capability, where there is a tolerance.
    pub capability: Option<Capability>,
    /// What to mind.
    pub notes: Vec<String>,
}

/// What the rows say together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// [`SCHEMA`].
    pub schema: u32,
    /// The model's name.
    pub model: String,
    /// The number of scans.
    pub scans: usize,
    /// Those that were fitted and measured.
    pub inspected: usize,
    /// Those of these whose fit can be relied on: only they are in the series.
    pub sound: usize,
    /// Numbers of verdicts, by name.
    pub verdicts: Vec<(String, usize)>,
    /// Every quantity over the objects.
    pub series: Vec<Series>,
    /// Correlations between parameters and measures, the strongest first.
    pub correlations: Vec<Correlation>,
    /// Which parameters make the objects differ; none where that cannot be said.
    pub variation: Option<Variation>,
    /// Values that differ from those of the other objects.
    pub outlying: Vec<Outlying>,
    /// Parameters that place the object and say nothing of its shape.
    pub placing: Vec<String>,
    /// What to mind.
    pub warnings: Vec<String>,
}

impl Summary {
    /// The summary of rows of one model. `placing` names the parameters that move the whole object; `movements` are
    /// those of the model, if they are known.
    #[must_use]
    pub fn of(model: &str, rows: &[Row], placing: &[String], movements: Option<&Movements>) -> Self {
        let sound: Vec<(usize, &Inspected)> =
            rows.iter().enumerate().filter_map(|(i, row)| Some((i, row.sound()?))).collect();
        let is_shape = |name: &str| !placing.iter().any(|other| other == name);
        let mut series = Vec::new();
        if let Some((_, first)) = sound.first() {
            let parameters = first.parameters.iter().filter(|p| is_shape(&p.name) && !p.fixed);
            series.extend(parameters.map(|p| measured(&sound, Quantities::Parameter, p, |i| &i.parameters)));
            series.extend(first.measures.iter().map(|m| measured(&sound, Quantities::Measure, m, |i| &i.measures)));
            series.extend(first.parts.iter().flat_map(|part| of_part(&sound, &part.name)));
        }
        series.retain(|s| !s.values.is_empty());
        let (variation, between) = varied(&sound, &series, movements).unzip();
        let mut correlations = correlated(&series, &sound);
        if let Some((names, between)) = &between {
            correlations.iter_mut().for_each(|c| c.between = between_of(c, names, between));
        }
        let far = |s: &Series| {
            let places = s.rows.iter().zip(&s.values).zip(s.measurement(rows));
            outlying(&s.name, &places.map(|((row, value), sd)| (*row, *value, sd)).collect::<Vec<_>>(), series.len())
        };
        let mut outlying: Vec<Outlying> = series.iter().flat_map(far).collect();
        outlying.sort_by(|a, b| b.score.abs().total_cmp(&a.score.abs()));
        let inspected = rows.iter().filter(|row| row.inspected().is_some()).count();
        Self {
            schema: SCHEMA,
            model: model.to_owned(),
            scans: rows.len(),
            inspected,
            sound: sound.len(),
            verdicts: verdicts(rows),
            warnings: warnings(rows, inspected, sound.len()),
            series,
            correlations,
            variation,
            outlying,
            placing: placing.to_vec(),
        }
    }

    /// The same with the uncertainty of the scanner, which all scans share, in the intervals of the means of lengths.
    /// Millimetres.
    #[must_use]
    pub fn with_device_uncertainty(mut self, device: f64) -> Self {
        for effects in self.series.iter_mut().filter(|s| s.unit == "mm").filter_map(|s| s.effects.as_mut()) {
            *effects = effects.with_shared(device);
        }
        if self.series.iter().any(|s| s.capability.is_some()) {
            self.warnings.push(format!(
                "the uncertainty of the scanner, {} mm, is in the intervals of means; indices of capability are without it",
                plain(device)
            ));
        }
        self
    }

    /// The series of parameters, of measures, or of parts.
    pub fn of_kind(&self, of: Quantities) -> impl Iterator<Item = &Series> {
        self.series.iter().filter(move |series| series.of == of)
    }
}

/// The series of a parameter or a measure.
fn measured(
    sound: &[(usize, &Inspected)],
    of: Quantities,
    first: &Measured,
    all: impl Fn(&Inspected) -> &Vec<Measured>,
) -> Series {
    let find = |inspected| all(inspected).iter().find(|m| m.name == first.name);
    let found: Vec<(usize, &Measured)> = sound.iter().filter_map(|(row, i)| Some((*row, find(i)?))).collect();
    let mut notes = Vec::new();
    // A value at a bound is that of the bound.
    let at_bound = found.iter().filter(|(_, m)| m.at_bound).count();
    let mut with: Vec<(usize, &Measured, f64)> =
        found.iter().filter(|(_, m)| !m.at_bound).filter_map(|(row, m)| Some((*row, *m, m.value?))).collect();
    with.retain(|(_, _, value)| value.is_finite());
    if at_bound > 0 {
        notes.push(format!("{at_bound} of {} ended at a bound and are left out", found.len()));
    }
    let undetermined = with.iter().filter(|(_, m, _)| m.sd.is_none()).count();
    if undetermined > 0 {
        notes.push(format!("{undetermined} of {} have no standard deviation and are left out", found.len()));
        with.retain(|(_, m, _)| m.sd.is_some());
    }
    let tolerance = first.nominal.zip(first.tolerance);
    let same = found.iter().all(|(_, m)| m.nominal.zip(m.tolerance) == tolerance);
    if !same {
        notes.push("the tolerance is not the same of all: there are no indices of capability".to_owned());
    }
    let limits = tolerance.filter(|_| same).map(|(n, [lower, upper])| Limits { lower: n + lower, upper: n + upper });
    let (name, unit, nominal) = (first.name.clone(), first.unit.clone(), first.nominal.filter(|_| same));
    let series = Series {
        name,
        of,
        unit,
        rows: with.iter().map(|(row, ..)| *row).collect(),
        values: with.iter().map(|(.., value)| *value).collect(),
        sds: with.iter().map(|(_, m, _)| m.sd).collect(),
        by_noise: false,
        nominal,
        limits,
        chart: None,
        effects: None,
        capability: None,
        notes,
    };
    let noise: Option<Vec<f64>> = with.iter().map(|(_, m, _)| m.noise_sd).collect();
    series.evaluated(noise.as_deref())
}

/// The figure of a part that holds the noise of the scan: the 95th percentile of the unsigned distances. Single stray
/// points move it little, and a root mean square by many times its spread between objects.
const P95: &str = "p95";
/// That percentile of noise alone, in its standard deviations: the 97.5th of a normal distribution.
const P95_OF_NOISE: f64 = 1.959_964;

/// A figure of a part.
type Figure = fn(&PartRow) -> Option<f64>;

/// The series of the mean deviation of a part, and of the 95th percentile of its unsigned deviations.
fn of_part(sound: &[(usize, &Inspected)], name: &str) -> [Series; 2] {
    let figures: [(&str, Figure); 2] = [("mean", |part| part.mean), (P95, |part| part.p95)];
    figures.map(|(figure, value)| {
        let of = |i: &Inspected| i.parts.iter().find(|part| part.name == name).and_then(value);
        let with: Vec<(usize, f64)> = sound.iter().filter_map(|(row, i)| Some((*row, of(i)?))).collect();
        let missing = sound.len() - with.len();
        let notes = (missing > 0).then(|| format!("{missing} of {} were not measured there", sound.len()));
        let series = Series {
            name: format!("{name}: {figure}"),
            of: Quantities::Part,
            unit: "mm".to_owned(),
            rows: with.iter().map(|(row, _)| *row).collect(),
            values: with.iter().map(|(_, value)| *value).collect(),
            sds: vec![None; with.len()],
            by_noise: false,
            nominal: None,
            limits: None,
            chart: None,
            effects: None,
            capability: None,
            notes: notes.into_iter().collect(),
        };
        series.evaluated(None)
    })
}

impl Series {
    /// With what its values say. `noise` has the standard deviations by the noise of single points alone.
    fn evaluated(mut self, noise: Option<&[f64]>) -> Self {
        self.chart = IndividualsChart::of(&self.values, &self.sds);
        let with_sd: Option<Vec<(f64, f64)>> =
            self.values.iter().zip(&self.sds).map(|(value, sd)| Some((*value, (*sd)?))).collect();
        self.effects = with_sd.as_deref().and_then(RandomEffects::of);
        if let (Some(effects), Some(measured)) = (self.effects.filter(|e| e.overstated), &with_sd) {
            self.without_shared_errors(effects, measured, noise);
        }
        if let (Some(effects), Some(measured), Some(noise)) = (&mut self.effects, &with_sd, noise) {
            *effects = effects.with_shared(shared(measured, noise));
        }
        let measurement = self.effects.map_or(0.0, |effects| effects.measurement);
        if let (Some(limits), Some(chart)) = (self.limits, &self.chart) {
            self.capability = Capability::of(&self.values, limits, chart, measurement);
        }
        self
    }
}

impl Series {
    /// Whether the values show that objects differ in this.
    fn differs(&self) -> bool {
        self.effects.is_some_and(|effects| effects.shows_difference())
    }

    /// What a measurement may add to each value. Percentiles of unsigned deviations hold the noise of the scan, up to
    /// all of it.
    fn measurement(&self, rows: &[Row]) -> Vec<Option<f64>> {
        let is_unsigned = self.of == Quantities::Part && self.name.ends_with(P95);
        let of = |((row, value), sd): ((&usize, &f64), &Option<f64>)| {
            let noise = rows.get(*row).and_then(Row::inspected).map(|i| P95_OF_NOISE * i.noise);
            let noise = noise.filter(|noise| is_unsigned && noise.is_finite());
            noise.map(|noise| value - (value * value - noise * noise).max(0.0).sqrt()).or(*sd)
        };
        self.rows.iter().zip(&self.values).zip(&self.sds).map(of).collect()
    }

    /// The values differ by less than the standard deviations of the fits allow: the spread is estimated with those of
    /// the noise alone, if these are not too large as well, or else is only bounded.
    fn without_shared_errors(&mut self, effects: RandomEffects, measured: &[(f64, f64)], noise: Option<&[f64]>) {
        let by_noise: Option<Vec<(f64, f64)>> =
            noise.map(|noise| self.values.iter().copied().zip(noise.iter().copied()).collect());
        let alone = by_noise.as_deref().and_then(RandomEffects::of).filter(|e| !e.overstated);
        let found = "the values differ by less than the standard deviations of their fits, which hold an error that all \
                     scans share";
        match alone {
            Some(alone) => {
                self.sds = noise.iter().flat_map(|noise| noise.iter().map(|sd| Some(*sd))).collect();
                self.by_noise = true;
                self.effects = Some(RandomEffects { overstated: true, ..alone });
                let shared = effects.measurement;
                self.notes.push(format!(
                    "{found}: the spread is told from the noise of single points alone, and the mean may be off by the error \
                     that they share, some {shared:.2e}"
                ));
            }
            None => {
                self.effects = Some(effects.bounded(measured));
                self.notes.push(format!(
                    "{found}: the spread between objects cannot be told from it, and is at most that of the values"
                ));
            }
        }
    }
}

/// What the standard deviations of fits have beyond the noise of single points, root mean square.
fn shared(measured: &[(f64, f64)], noise: &[f64]) -> f64 {
    let excess: f64 = measured.iter().zip(noise).map(|((_, sd), noise)| (sd * sd - noise * noise).max(0.0)).sum();
    (excess / measured.len() as f64).sqrt()
}

/// Correlations of parameters and measures.
fn correlated(series: &[Series], sound: &[(usize, &Inspected)]) -> Vec<Correlation> {
    let series: Vec<&Series> = series.iter().filter(|s| s.of != Quantities::Part).take(MOST_CORRELATED).collect();
    let mut found = Vec::new();
    for (i, a) in series.iter().enumerate() {
        for b in &series[i + 1..] {
            let of_b = |row: &usize| b.rows.iter().position(|other| other == row).map(|k| b.values[k]);
            let pairs = a.rows.iter().zip(&a.values).filter_map(|(row, value)| Some((*value, of_b(row)?)));
            let correlation = Correlation::of([&a.name, &b.name], &pairs.collect::<Vec<_>>());
            // A measure may be a parameter, or twice one.
            let Some(mut correlation) = correlation.filter(|c| c.r.abs() < SAME) else { continue };
            let both_parameters = a.of == Quantities::Parameter && b.of == Quantities::Parameter;
            correlation.of_errors = both_parameters.then(|| of_errors(&a.name, &b.name, sound)).flatten();
            found.push(correlation);
        }
    }
    found.sort_by(|a, b| b.r.abs().total_cmp(&a.r.abs()));
    found
}

/// The mean correlation of the errors of two parameters.
fn of_errors(a: &str, b: &str, sound: &[(usize, &Inspected)]) -> Option<f64> {
    let of = |inspected: &Inspected| {
        let (names, matrix) = &inspected.covariance;
        let [i, j] = [a, b].map(|name| names.iter().position(|other| other == name));
        let (i, j) = (i?, j?);
        Some(matrix[i][j] / (matrix[i][i] * matrix[j][j]).sqrt())
    };
    let all: Vec<f64> = sound.iter().filter_map(|(_, inspected)| of(inspected)).filter(|r| r.is_finite()).collect();
    (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
}

fn between_of(correlation: &Correlation, names: &[String], between: &DMatrix<f64>) -> Option<f64> {
    let [i, j] = [0, 1].map(|k| names.iter().position(|name| *name == correlation.names[k]));
    let (i, j) = (i?, j?);
    let r = between[(i, j)] / (between[(i, i)] * between[(j, j)]).sqrt();
    r.is_finite().then(|| r.clamp(-1.0, 1.0))
}

/// The parameters with a covariance between objects.
type Between = (Vec<String>, DMatrix<f64>);

/// How the objects differ, over the parameters that all of them determine and in which they show that they differ.
fn varied(
    sound: &[(usize, &Inspected)],
    series: &[Series],
    movements: Option<&Movements>,
) -> Option<(Variation, Between)> {
    let movements = movements?;
    let determined = |name: &String| sound.iter().all(|(_, i)| i.covariance.0.contains(name));
    let is_told = |s: &&Series| s.of == Quantities::Parameter && s.rows.len() == sound.len() && s.differs();
    let parameters = series.iter().filter(is_told);
    let names: Vec<String> = parameters.map(|s| s.name.clone()).filter(determined).collect();
    let value = |i: &Inspected, name: &String| i.parameters.iter().find(|p| p.name == *name)?.value;
    let values = sound.iter().map(|(_, i)| names.iter().map(|name| value(i, name)).collect::<Option<Vec<f64>>>());
    let values = values.collect::<Option<Vec<Vec<f64>>>>()?;
    let by_noise = |name: &String| series.iter().any(|s| s.name == *name && s.by_noise);
    let errors = |i: &Inspected| {
        let (all, matrix) = &i.covariance;
        let places: Vec<usize> = names.iter().filter_map(|name| all.iter().position(|other| other == name)).collect();
        // What all objects share is no error of one of them.
        let own = |name: &String| {
            let parameter = i.parameters.iter().find(|p| p.name == *name && by_noise(name))?;
            Some(parameter.noise_sd? / parameter.sd?)
        };
        let own: Vec<f64> = names.iter().map(|name| own(name).unwrap_or(1.0)).collect();
        DMatrix::from_fn(places.len(), places.len(), |a, b| own[a] * own[b] * matrix[places[a]][places[b]])
    };
    let errors: Vec<DMatrix<f64>> = sound.iter().map(|(_, i)| errors(i)).collect();
    let (variation, between) = Variation::of(&names, &values, &errors, movements)?;
    Some((variation, (names, between)))
}

/// Numbers of verdicts.
fn verdicts(rows: &[Row]) -> Vec<(String, usize)> {
    let mut found: Vec<(String, usize)> = Vec::new();
    for verdict in rows.iter().filter_map(|row| row.inspected()?.verdict.as_ref()) {
        match found.iter_mut().find(|(name, _)| name == verdict) {
            Some((_, count)) => *count += 1,
            None => found.push((verdict.clone(), 1)),
        }
    }
    found.sort();
    found
}

fn warnings(rows: &[Row], inspected: usize, sound: usize) -> Vec<String> {
    let mut warnings = Vec::new();
    let failed = rows.iter().filter(|row| row.failure().is_some()).count();
    let copies = rows.len() - inspected - failed;
    if copies > 0 {
        warnings.push(format!("{copies} of {} files are copies of others: each object counts once", rows.len()));
    }
    if failed > 0 {
        warnings.push(format!("{failed} of {} scans have no result: the table says why", rows.len()));
    }
    if sound < inspected {
        let doubtful = inspected - sound;
        warnings.push(format!("{doubtful} of {inspected} fits cannot be relied on and are in no statistics"));
    }
    let all: Vec<&Inspected> = rows.iter().filter_map(Row::inspected).collect();
    if all.windows(2).any(|two| two[0].script_sha256 != two[1].script_sha256) {
        warnings.push("the rows are of different scripts".to_owned());
    }
    if all.windows(2).any(|two| two[0].inputs != two[1].inputs) {
        warnings.push("the rows are of models with different inputs".to_owned());
    }
    warnings
}
