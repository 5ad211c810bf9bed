//! Verdicts: whether parts conform to their tolerances, by what was measured and how well (ISO 14253-1, JCGM 106).

mod decided;
mod extreme;
mod footprints;
mod map;
mod measures;
mod rule;
mod strip;
#[cfg(test)]
pub(super) mod tests;

pub use measures::{Dimension, DimensionVerdict};
pub use rule::{DecisionRule, Outcome};

use super::detection::surface_variances;
use super::form::FormDeviation;
use super::moments::null_as_nan;
use super::report::PartStatistics;
use super::scanned::Scanned;
use super::{Deviations, ParameterCovariance, Statistics, Tolerance, VarianceReport};
use crate::model::Sensitivities;
use decided::Decided;
use extreme::Extreme;
use footprints::{Footprint, footprints};
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use strip::Strip;

/// A footprint takes at least this share of its part's area: what refused matches leave over are wrong distances on up
/// to 0.003 % of the area (decision 0046), which are not to be the half of a footprint on the densest scans either.
const SHARE: f64 = 0.001;

/// A footprint has so many points of the scan, if that is not less than `SHARE` and not more than `LARGEST_SHARE` of
/// its part's area: the median of so few has a fifth of the noise of one.
const POINTS: f64 = 25.0;

/// A footprint takes at most this share of its part's area, so that a dent of a hundredth of a part is seen whose even
/// surroundings were reduced to a few large triangles.
const LARGEST_SHARE: f64 = 0.01;

/// A part is not rejected for a footprint of fewer points of the scan, unless the user has chosen its size, if
/// footprints of so many are within its tolerance: a single outlier spoils the triangles around it, whose area is that
/// of three points, and so a quarter of such a footprint, which its median does not notice.
const FEWEST_POINTS: f64 = 12.0;

/// How many times as large as others such a footprint may become: beyond that it is no place any more.
const WIDEST: f64 = 100.0;

/// Where the user has chosen footprints so wide that a part has fewer, they are no places of it any more.
const FEWEST_FOOTPRINTS: usize = 4;

/// A footprint has at least so many texels.
const TEXELS: f64 = 16.0;

/// Texels of a footprint whose triangles say how far the scan's points are apart.
const SAMPLES: usize = 9;

/// How verdicts are found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct VerdictOptions {
    /// What follows from a value and its uncertainty.
    pub rule: DecisionRule,
    /// The least measured share of a part's area with which it can conform, from 0 to 1.
    pub min_coverage: f64,
    /// Standard uncertainty of the scanner that all points of a footprint share, so that no mean is free of it.
    /// Millimetres.
    pub device_uncertainty: f64,
    /// Edge of a square with the area of a footprint, in millimetres; by default that of 25 points of the scan, and
    /// from a thousandth to a hundredth of each part's area.
    pub footprint: Option<f64>,
}

impl Default for VerdictOptions {
    fn default() -> Self {
        Self { rule: DecisionRule::default(), min_coverage: 0.8, device_uncertainty: 0.0, footprint: None }
    }
}

/// Whether a part conforms to its tolerance. The part is divided into footprints of equal area; the verdict is that on
/// the worst of them, where half of the area deviates by more than `value`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// The verdict.
    pub outcome: Outcome,
    /// Signed deviation of the worst footprint: the median over its area. Millimetres; NaN if nothing was measured.
    #[serde(deserialize_with = "null_as_nan")]
    pub value: f64,
    /// What a second measurement would show, on average, of the place that one with such noise calls the worst. Nearer
    /// to the tolerance's middle than `value` where many places are equally bad. Millimetres.
    #[serde(deserialize_with = "null_as_nan")]
    pub again: f64,
    /// The limit that `value` is held against. Millimetres.
    pub limit: f64,
    /// Standard uncertainty of `value`: the root of the sum of the squares of the next three. Millimetres.
    #[serde(deserialize_with = "null_as_nan")]
    pub uncertainty: f64,
    /// The part of the scan's noise, averaged over the footprint, and of the coarse rounding of its coordinates, which
    /// is not. Millimetres.
    #[serde(deserialize_with = "null_as_nan")]
    pub noise: f64,
    /// The part of the fit: standard deviation of the surface along its normal there. Millimetres.
    #[serde(deserialize_with = "null_as_nan")]
    pub fit: f64,
    /// The part of the scanner, as stated. Millimetres.
    pub device: f64,
    /// The probability of conformance by `value` and its like at the other limit: at least this.
    #[serde(deserialize_with = "null_as_nan")]
    pub probability: f64,
    /// The probability of conformance by `again`: at most this.
    #[serde(deserialize_with = "null_as_nan")]
    pub highest_probability: f64,
    /// Area of the worst footprint. Square millimetres.
    pub footprint: f64,
    /// The number of the scan's points on it.
    pub points: f64,
    /// The number of footprints.
    pub footprints: usize,
    /// The middle of the worst footprint, in the scan's coordinates. Millimetres.
    pub place: [f64; 3],
    /// Why the measurement does not tell, beyond `value` and `uncertainty`. Sentences without a full stop.
    pub reasons: Vec<String>,
}

/// The verdict on all parts and measures with a tolerance, and how it was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OverallVerdict {
    /// The worst of all outcomes: `does not conform` before `undecided`.
    pub outcome: Outcome,
    /// The decision rule.
    pub decision: String,
    /// The least measured share of a part's area with which it can conform.
    pub min_coverage: f64,
    /// Standard uncertainty of the scanner. Millimetres.
    pub device_uncertainty: f64,
}

/// What verdicts are made from.
pub(super) struct Grounds<'a> {
    pub(super) deviations: &'a Deviations,
    pub(super) scanned: Scanned<'a>,
    pub(super) fit: Option<(&'a Sensitivities, ParameterCovariance<'a>)>,
    pub(super) options: VerdictOptions,
}

impl Grounds<'_> {
    /// Adds verdicts to the parts that have a tolerance. Returns for every texel the probability that the surface there
    /// is within its part's tolerance, NaN where nothing was measured or there is no tolerance; none if no part has
    /// one.
    pub(super) fn assess(&self, report: &mut VarianceReport) -> Option<Vec<f32>> {
        let texels = &self.deviations.texels;
        let mut measured: Vec<Vec<u32>> = vec![Vec::new(); report.parts.len()];
        for (i, part) in texels.part.iter().enumerate() {
            if texels.area[i] > 0.0 && !self.deviations.signed(i).is_nan() && !self.deviations.is_bridged(i) {
                measured[*part as usize].push(i as u32);
            }
        }
        let toleranced = |(part, texels): (usize, Vec<u32>)| {
            let PartStatistics { statistics, form, .. } = &report.parts[part];
            let tolerance = statistics.tolerance?.tolerance?;
            let of_part = || self.of_part(part, texels, tolerance, (statistics, form.as_ref()));
            // Where nothing is there, nothing can be out of tolerance.
            statistics.is_of_something().then(|| (part, of_part()))
        };
        let assessed: Vec<(usize, Assessed)> = measured.into_par_iter().enumerate().filter_map(toleranced).collect();
        let mut map = vec![f32::NAN; texels.len()];
        for (part, Assessed { verdict, tolerance, footprints, common }) in assessed {
            map::fill(&mut map, self.deviations, tolerance, self.deviations.noise, &footprints, &common);
            report.parts[part].verdict = Some(verdict);
        }
        let outcome = Outcome::together(report.parts.iter().filter_map(|p| Some(p.verdict.as_ref()?.outcome)))?;
        let VerdictOptions { rule, min_coverage, device_uncertainty, .. } = self.options;
        report.warnings.extend(self.too_wide(report));
        report.verdict = Some(OverallVerdict { outcome, decision: rule.name(), min_coverage, device_uncertainty });
        Some(map)
    }

    fn of_part(
        &self,
        part: usize,
        texels: Vec<u32>,
        tolerance: Tolerance,
        (statistics, form): (&Statistics, Option<&FormDeviation>),
    ) -> Assessed {
        let FootprintArea { wanted, area } = self.footprint_area(&texels);
        let Some(mut assessed) = self.by_footprints(part, texels, tolerance, area) else {
            return self.unmeasured(tolerance, statistics);
        };
        let points = assessed.verdict.points;
        let is_chosen = self.options.footprint.is_some();
        let outcome = assessed.verdict.outcome;
        if !is_chosen && outcome != Outcome::Conforms && points < FEWEST_POINTS {
            // By the density where it was decided: elsewhere the scan may be a hundred times denser.
            let wide = area * FEWEST_POINTS / points.max(FEWEST_POINTS / WIDEST);
            let wider = self.by_footprints(part, assessed.texels(), tolerance, wide);
            if let Some(wider) = wider.filter(|wider| wider.verdict.outcome == Outcome::DoesNotConform) {
                return wider;
            }
            if outcome == Outcome::DoesNotConform {
                assessed.verdict.doubt(format!(
                    "what decides has {points:.2} points of the scan, and is within the tolerance with its neighbours"
                ));
            }
        }
        if assessed.verdict.outcome == Outcome::Conforms {
            self.unseen(statistics, area).into_iter().for_each(|reason| assessed.verdict.doubt(reason));
            let finer =
                (area > wanted).then(|| self.by_footprints(part, assessed.texels(), tolerance, wanted)).flatten();
            if finer.is_some_and(|finer| finer.verdict.outcome != Outcome::Conforms) {
                assessed.verdict.doubt(format!(
                    "it is within the tolerance by footprints of {TEXELS} texels, {area:.2} mm2, and not by those of {wanted:.2} mm2: --resolution or --texel makes texels smaller"
                ));
            }
        }
        if assessed.verdict.outcome == Outcome::Conforms && !is_chosen {
            let reason =
                form.and_then(|form| wider(form, tolerance, area)).or_else(|| self.strip(&assessed, tolerance, area));
            reason.into_iter().for_each(|reason| assessed.verdict.doubt(reason));
        }
        assessed
    }

    /// The verdict by footprints of about `area` square millimetres. None where nothing was measured.
    fn by_footprints(&self, part: usize, texels: Vec<u32>, tolerance: Tolerance, area: f64) -> Option<Assessed> {
        let footprints = footprints(self.deviations, texels, area);
        let points: Vec<f64> = footprints.par_iter().map(|f| f.area * self.density(&f.texels, SAMPLES)).collect();
        // Between points distances are interpolated, so that a median is as exact as the mean of the points.
        let Deviations { noise, rounding, .. } = self.deviations;
        let noise: Vec<f64> = points.iter().map(|n| (noise / n.max(1.0).sqrt()).hypot(*rounding)).collect();
        let fit = self.fit_deviations(part, &footprints);
        let device = self.options.device_uncertainty;
        let common: Vec<f64> = fit.iter().map(|fit| fit.hypot(device)).collect();
        let sd: Vec<f64> = noise.iter().zip(&common).map(|(noise, common)| noise.hypot(*common)).collect();
        // The ends of a tolerance are meant as they are written: rounding does not exceed them.
        let precision = self.deviations.precision;
        let limits = Tolerance { lower: tolerance.lower - precision, upper: tolerance.upper + precision };
        let values: Vec<f64> = footprints.iter().map(|f| f.median).collect();
        let decided = Decided::new(self.options.rule, limits, &values, &noise, &sd)?;
        let Extreme { place: k, value, again } = decided.worst;
        let verdict = Verdict {
            outcome: decided.outcome,
            value,
            again,
            limit: [tolerance.lower, tolerance.upper][decided.side],
            uncertainty: sd[k],
            noise: noise[k],
            fit: fit[k],
            device,
            probability: decided.probabilities[0],
            highest_probability: decided.probabilities[1],
            footprint: footprints[k].area,
            points: points[k],
            footprints: footprints.len(),
            place: footprints[k].centre.to_array(),
            reasons: Vec::new(),
        };
        Some(Assessed { verdict, tolerance, footprints, common })
    }

    /// A sentence on a piece of a part beyond its limits that is as large as a footprint, and of none the half.
    fn strip(&self, assessed: &Assessed, tolerance: Tolerance, footprint: f64) -> Option<String> {
        let texels = assessed.texels();
        let spacing = 1.0 / self.density(&texels, SAMPLES * SAMPLES).sqrt();
        let noise = self.deviations.noise.hypot(self.deviations.rounding);
        let strip = strip::largest(self.deviations, &texels, tolerance, (noise, spacing))?;
        let Strip { area, deviation, middle } = strip;
        (area >= footprint).then(|| {
            let [x, y, z] = middle.to_array();
            format!(
                "{area:.1} mm2 about ({x:.1}, {y:.1}, {z:.1}) mm are off by {deviation:.3} mm, a strip that is narrower than footprints of {footprint:.1} mm2: a smaller --footprint judges it"
            )
        })
    }

    /// A warning of parts that footprints of the chosen size average as a whole.
    fn too_wide(&self, report: &VarianceReport) -> Option<String> {
        self.options.footprint?;
        let few = |part: &&PartStatistics| part.verdict.as_ref().is_some_and(|v| v.footprints < FEWEST_FOOTPRINTS);
        let names: Vec<&str> = report.parts.iter().filter(few).map(|part| part.name.as_str()).collect();
        (!names.is_empty()).then(|| {
            format!(
                "--footprint is so wide that {} has fewer than {FEWEST_FOOTPRINTS} of them: what deviates on less is averaged away",
                names.join(", ")
            )
        })
    }

    /// The area of footprints of a part.
    fn footprint_area(&self, texels: &[u32]) -> FootprintArea {
        if let Some(edge) = self.options.footprint {
            return FootprintArea { wanted: edge * edge, area: edge * edge };
        }
        let area: f64 = texels.iter().map(|i| f64::from(self.deviations.texels.area[*i as usize])).sum();
        let of_points = POINTS / self.density(texels, SAMPLES * SAMPLES);
        let wanted = of_points.clamp(SHARE * area, LARGEST_SHARE * area);
        FootprintArea { wanted, area: wanted.max(TEXELS * area / texels.len().max(1) as f64) }
    }

    /// Points of the scan per square millimetre, from the median area that one stands for at a sample of texels.
    fn density(&self, texels: &[u32], most: usize) -> f64 {
        let step = texels.len().div_ceil(most).max(1);
        let area = |i: &u32| self.scanned.area_of_point(self.deviations, *i as usize);
        let mut areas: Vec<f64> = texels.iter().step_by(step).filter_map(area).collect();
        areas.sort_by(f64::total_cmp);
        areas.get(areas.len() / 2).map_or(0.0, |area| 1.0 / area.max(f64::MIN_POSITIVE))
    }

    /// Standard deviation of the fitted surface along its normal at each footprint: that at the nearest place for which
    /// it is known. Millimetres.
    fn fit_deviations(&self, part: usize, footprints: &[Footprint]) -> Vec<f64> {
        let texels = &self.deviations.texels;
        let Some((sensitivities, covariance)) = self.fit else { return vec![0.0; footprints.len()] };
        let variances = surface_variances(sensitivities, covariance, texels, part);
        let places: &[usize] = sensitivities.parts.get(part).map_or(&[], |p| &p.texels);
        let nearest = |footprint: &Footprint| {
            let distance = |i: &usize| footprint.centre.distance_squared(DVec3::from(texels.position[*i]));
            let known = places.iter().zip(&variances).map(|(i, variance)| (distance(i), variance.sqrt()));
            known.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |(_, sd)| sd)
        };
        footprints.par_iter().map(nearest).collect()
    }

    /// Why a part does not conform by what was measured of it alone. `footprint` is the area of one. Square
    /// millimetres.
    fn unseen(&self, statistics: &Statistics, footprint: f64) -> Vec<String> {
        let mut reasons = Vec::new();
        if statistics.coverage < self.options.min_coverage {
            let [measured, required] = [statistics.coverage, self.options.min_coverage].map(|share| 100.0 * share);
            reasons
                .push(format!("only {measured:.1} % of it was measured, {required} % are required (--min-coverage)"));
        }
        if statistics.contradicted_area > footprint {
            reasons.push(format!("the scan shows empty space on {:.1} mm2 of it", statistics.contradicted_area));
        }
        reasons
    }

    /// The verdict on a part without footprints.
    fn unmeasured(&self, tolerance: Tolerance, statistics: &Statistics) -> Assessed {
        let reason = match statistics.coverage > 0.0 {
            true => "what was measured of it are triangles across edges alone",
            false => "nothing of it was measured",
        };
        let verdict = Verdict {
            outcome: Outcome::Undecided,
            value: f64::NAN,
            again: f64::NAN,
            limit: tolerance.upper,
            uncertainty: f64::NAN,
            noise: f64::NAN,
            fit: f64::NAN,
            device: self.options.device_uncertainty,
            probability: f64::NAN,
            highest_probability: f64::NAN,
            footprint: 0.0,
            points: 0.0,
            footprints: 0,
            place: [0.0; 3],
            reasons: vec![reason.to_owned()],
        };
        Assessed { verdict, tolerance, footprints: Vec::new(), common: Vec::new() }
    }
}

/// A sentence on a part whose form takes more room than its tolerance leaves, wherever it lies: what deviates is of no
/// footprint the half.
fn wider(form: &FormDeviation, tolerance: Tolerance, footprint: f64) -> Option<String> {
    let zone = form.zone.as_ref()?;
    let room = tolerance.upper - tolerance.lower;
    zone.without_noise.is_clearly_above(room).then(|| {
        format!(
            "its {} of {:.3} mm is more than the {room:.3} mm of its tolerance: what deviates is narrower than half a footprint of {footprint:.1} mm2, and a smaller --footprint judges it",
            zone.characteristic, zone.without_noise.corrected
        )
    })
}

/// The area of a part's footprints. Square millimetres.
struct FootprintArea {
    /// As it should be.
    wanted: f64,
    /// As it is by a texture of which footprints have enough texels.
    area: f64,
}

/// The verdict on a part, and what the map needs of it.
struct Assessed {
    verdict: Verdict,
    tolerance: Tolerance,
    footprints: Vec<Footprint>,
    /// By footprint, the standard uncertainty that all of its texels share. Millimetres.
    common: Vec<f64>,
}

impl Assessed {
    /// The measured texels, in their order.
    fn texels(&self) -> Vec<u32> {
        let mut texels: Vec<u32> = self.footprints.iter().flat_map(|f| &f.texels).copied().collect();
        texels.sort_unstable();
        texels
    }
}

impl Verdict {
    /// Makes the verdict undecided, for a reason.
    pub(super) fn doubt(&mut self, reason: String) {
        self.outcome = Outcome::Undecided;
        self.reasons.push(reason);
    }
}

impl VarianceReport {
    /// Makes all verdicts undecided, for a reason.
    pub fn doubt_verdicts(&mut self, reason: &str) {
        let Some(overall) = &mut self.verdict else { return };
        overall.outcome = Outcome::Undecided;
        self.parts.iter_mut().filter_map(|p| p.verdict.as_mut()).for_each(|v| v.doubt(reason.to_owned()));
        self.measures.iter_mut().for_each(|m| m.doubt(reason.to_owned()));
    }
}
