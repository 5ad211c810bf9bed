//! The result of a variance analysis: the content of variance.json.

use super::agreement::{Agreement, Limits, PointAgreement, described};
use super::moments::null_as_nan;
use super::sag;
use super::statistics::PartTexels;
use super::texel_widths::TexelSizes;
use super::{
    ColourSummary, Conformance, CylinderSummary, DatumRelations, Detection, Deviations, DimensionVerdict, Explanation,
    FormDeviation, HoleSummary, Matching, OverallVerdict, Peak, PointDistances, PointMeasure, Sag, Statistics,
    Tolerance, UnmatchedSummary, Verdict,
};
use crate::model::{SensitivityMap, Texels};
use crate::record::Record;
use crate::scan::ScanSource;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Meaning of a signed distance's sign.
pub const SIGN_CONVENTION: &str = "positive: the scan lies outside the model, along its outward normal";

/// The result of a variance analysis. The fields of `overall` stand at the top level in JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VarianceReport {
    /// Meaning of a signed distance's sign.
    pub sign_convention: String,
    /// Unit of all lengths; areas are in its square.
    pub unit: String,
    /// The points to which distances are measured: along the model's `normal`, along its `averaged-normal`, or to the
    /// `closest` point of the scan.
    pub distance: String,
    /// Which places of the scan count: those that are the texel's own as seen from the scan, too (`mutual`), or `all`.
    #[serde(default = "all")]
    pub matching: String,
    /// Single vertices of the scan far from all of their neighbours, to which no distance is taken with `mutual`.
    #[serde(default)]
    pub spikes: usize,
    /// Width of the band beside an edge in which averaged normals turn. Millimetres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub averaging_width: Option<f64>,
    /// The cylinders about the normals whose points have the distances, if the scan is a cloud: no rays were cast then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cylinder: Option<CylinderSummary>,
    /// How the colours of colour.png were made, if the scan has colours or intensities.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colour: Option<ColourSummary>,
    /// Length of the rays. Millimetres.
    pub max_distance: f64,
    /// Standard deviation of the noise of the scan's points along the surface's normals. Millimetres.
    #[serde(default)]
    pub noise: f64,
    /// The device that cast the rays: `cpu`, or `gpu: ` and the adapter's name.
    pub device: String,
    /// Width and height of the texture.
    pub resolution: [u32; 2],
    /// Mean width of a texel on the surface: the root of the area over the number of texels. Millimetres. What texels
    /// have is in `texel_widths`.
    #[serde(default, deserialize_with = "null_as_nan")]
    pub texel: f64,
    /// Share of the texture that lies on the surface.
    #[serde(default)]
    pub texture_used: f64,
    /// The scan.
    pub scan: ScanSource,
    /// Statistics of all parts together.
    #[serde(flatten)]
    pub overall: Statistics,
    /// The verdict on all parts and measures that have a tolerance, if any has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<OverallVerdict>,
    /// The verdicts on the measures of the fitted model that have a tolerance, in the script's order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub measures: Vec<DimensionVerdict>,
    /// The measures of the script that name parts, by the measured points of these, in the script's order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub point_measures: Vec<PointMeasure>,
    /// How the other parts lie to the one that is the datum, if one was named.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub datum: Option<DatumRelations>,
    /// The distances of the scan's points from the exact surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<PointDistances>,
    /// Statistics of each part, in the model's order.
    pub parts: Vec<PartStatistics>,
    /// Parts of one name with different indices (`hole[0]`, `hole[1]`, ...) taken together, in the model's order.
    pub groups: Vec<PartStatistics>,
    /// Where deviations are largest, largest first: ten places at most, apart from each other.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub peaks: Vec<Peak>,
    /// The holes of the scan that were closed, if that was requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub holes: Option<HoleSummary>,
    /// The surface's movement along its normal per unit of each parameter, if it was requested.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sensitivities: Vec<SensitivityRange>,
    /// The part of the scan that the model does not explain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unmatched: Option<UnmatchedSummary>,
    /// Durations of the stages.
    pub seconds: VarianceSeconds,
    /// Sentences for the user.
    pub warnings: Vec<String>,
    /// What the measurement was made with; filled in by the command.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub provenance: Option<Record>,
}

/// Statistics of one part or of one group of parts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartStatistics {
    /// Its name.
    pub name: String,
    /// Its statistics; their fields stand beside the name in JSON.
    #[serde(flatten)]
    pub statistics: Statistics,
    /// How its deviations follow from its parameters, if the surface has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub explained: Option<Explanation>,
    /// The level above which its deviations are more than noise and the fit's uncertainty.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detection: Option<Detection>,
    /// Whether it conforms to its tolerance, if it has one; groups have no verdict of their own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// Its deviation of form, if its surface has a form.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub form: Option<FormDeviation>,
    /// How far the scan's triangles lie off it between their corners, if the scan has triangles; not of groups.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sag: Option<Sag>,
}

/// The sensitivities n . dS/dx of one parameter over the parts that depend on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensitivityRange {
    /// Name of the parameter.
    pub parameter: String,
    /// Unit of the figures: `mm/mm`, `mm/rad`, or `mm` if the parameter has none.
    pub unit: String,
    /// The least: how far outwards the surface moves per unit of the parameter.
    pub min: f64,
    /// The greatest.
    pub max: f64,
    /// Root mean square, weighted by area.
    pub rms: f64,
    /// The file with the map.
    pub picture: String,
}

impl SensitivityRange {
    /// The range of a map, whose values are of the texels `indices`; all zero if nothing depends on the parameter.
    #[must_use]
    pub fn new(map: &SensitivityMap, indices: &[u32], texels: &Texels) -> Self {
        let (mut min, mut max, mut squares, mut total) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0);
        for (value, i) in map.values.iter().zip(indices).filter(|(value, _)| value.is_finite()) {
            let (value, area) = (f64::from(*value), f64::from(texels.area[*i as usize]).max(0.0));
            (min, max) = (min.min(value), max.max(value));
            (squares, total) = (squares + area * value * value, total + area);
        }
        let finite = |x: f64| if x.is_finite() { x } else { 0.0 };
        let unit = map.quantity.unit();
        Self {
            parameter: map.parameter.clone(),
            unit: if unit.is_empty() { "mm".to_owned() } else { format!("mm/{unit}") },
            min: finite(min),
            max: finite(max),
            rms: if total > 0.0 { (squares / total).sqrt() } else { 0.0 },
            picture: format!("sensitivity-{}.png", map.parameter),
        }
    }
}

/// Durations of the stages in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct VarianceSeconds {
    /// Positions and normals of the texels.
    pub texels: f64,
    /// The hierarchy over the scan.
    pub build: f64,
    /// Casting the rays; `trace` in JSON.
    #[serde(rename = "trace")]
    pub cast: f64,
    /// Telling which places of the scan belong to other places of the model.
    #[serde(default)]
    pub matching: f64,
    /// Statistics.
    pub statistics: f64,
    /// The distances of the scan's points.
    #[serde(default)]
    pub points: f64,
    /// Finding what the model does not explain.
    #[serde(default)]
    pub unmatched: f64,
}

impl VarianceReport {
    /// Computes all statistics. `device` is as in [`Cast`](super::Cast). `tolerances` are those of the parts, in their
    /// order; the overall statistics and those of a group take together the parts that have one. Parts without one
    /// agree by the scan's noise. The caller measures `seconds`.
    #[must_use]
    pub fn new(deviations: &Deviations, scan: &ScanSource, device: &str, tolerances: &[Option<Tolerance>]) -> Self {
        let names = &deviations.texels.part_names;
        let texels = PartTexels::by_part(deviations);
        let (range, precision) = (deviations.max_distance, deviations.precision);
        let members = groups(names);
        let part_statistics = |name: &str, statistics| {
            let name = name.to_owned();
            PartStatistics { name, statistics, explained: None, detection: None, verdict: None, form: None, sag: None }
        };
        let part = |(k, name): (usize, &String)| {
            part_statistics(name, texels[k].statistics(range, tolerances.get(k).copied().flatten(), precision))
        };
        let group = |(name, members): &(String, Vec<usize>)| {
            let texels = PartTexels::merge(members.iter().map(|m| &texels[*m]));
            part_statistics(name, texels.statistics(range, None, precision))
        };
        let (mut overall, (mut parts, mut groups)): (_, (Vec<PartStatistics>, Vec<PartStatistics>)) = rayon::join(
            || PartTexels::merge(texels.iter()).statistics(range, None, precision),
            || (names.par_iter().enumerate().map(part).collect(), members.par_iter().map(group).collect()),
        );
        let limits = |part: usize| Limits::new(tolerances.get(part).copied().flatten(), deviations.noise);
        let agreements: Vec<Agreement> =
            texels.iter().enumerate().map(|(part, texels)| texels.agreement(limits(part), precision)).collect();
        let sizes = TexelSizes::by_part(deviations);
        let complete = |statistics: &mut Statistics, members: &[usize]| {
            statistics.agreement = Agreement::together(members.iter().map(|part| &agreements[*part]));
            statistics.texel_widths = match members {
                [part] => sizes[*part].widths(),
                _ => TexelSizes::merge(members.iter().map(|part| &sizes[*part])).widths(),
            };
        };
        complete(&mut overall, &(0..parts.len()).collect::<Vec<_>>());
        parts.iter_mut().enumerate().for_each(|(k, part)| complete(&mut part.statistics, &[k]));
        groups.iter_mut().zip(&members).for_each(|(group, (_, members))| complete(&mut group.statistics, members));
        let conformance = |part: usize| parts[part].statistics.tolerance.as_ref();
        overall.tolerance = Conformance::together((0..parts.len()).filter_map(conformance));
        for (group, (_, members)) in groups.iter_mut().zip(&members) {
            group.statistics.tolerance = Conformance::together(members.iter().copied().filter_map(conformance));
        }
        Self {
            sign_convention: SIGN_CONVENTION.to_owned(),
            unit: "mm".to_owned(),
            distance: "normal".to_owned(),
            matching: all(),
            spikes: 0,
            averaging_width: None,
            cylinder: None,
            colour: None,
            max_distance: range,
            noise: deviations.noise,
            device: device.to_owned(),
            resolution: [deviations.texels.width, deviations.texels.height],
            texel: (overall.area / overall.texels as f64).sqrt(),
            texture_used: (overall.texels + overall.buried_texels) as f64
                / (f64::from(deviations.texels.width) * f64::from(deviations.texels.height)).max(1.0),
            scan: scan.clone(),
            overall,
            verdict: None,
            measures: Vec::new(),
            point_measures: Vec::new(),
            datum: None,
            points: None,
            parts,
            groups,
            holes: None,
            peaks: Vec::new(),
            sensitivities: Vec::new(),
            unmatched: None,
            seconds: VarianceSeconds::default(),
            warnings: Vec::new(),
            provenance: None,
        }
    }
}

impl VarianceReport {
    /// The parts of which something is there: of a trimmed one nothing may be left, as of the end of a hole.
    pub fn parts_with_surface(&self) -> impl Iterator<Item = &PartStatistics> {
        self.parts.iter().filter(|part| part.statistics.is_of_something())
    }

    /// The limits by which the parts agree with the scan, in words; `number` writes a figure.
    #[must_use]
    pub fn limits(&self, number: impl Fn(f64) -> String) -> String {
        described(self.parts.iter().filter_map(|part| part.statistics.agreement?.limits), number)
    }

    /// How far the scan's triangles lie off the surface between their corners, where that is not small beside the
    /// deviations: a sentence without its full stop. `number` writes a figure.
    #[must_use]
    pub fn sag_sentence(&self, number: impl Fn(f64) -> String) -> Option<String> {
        sag::sentence(&self.parts, number)
    }

    /// How much of the surface and of the scan's points agree, by which limits: a sentence without its full stop; none
    /// where nothing was measured.
    #[must_use]
    pub fn agreement_sentence(&self, number: impl Fn(f64) -> String) -> Option<String> {
        let agreement = self.overall.agreement.filter(|_| self.overall.measured_area > 0.0)?;
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        let [within, over, under] = [agreement.within, agreement.over, agreement.under].map(|p| percent(p.share));
        let mut said = format!(
            "{within} of the measured surface is within {} of the scan, {over} over (the scan lies outside: too much material), {under} under (the scan lies inside: too little)",
            self.limits(number)
        );
        if let Some(points) = self.points.as_ref().filter(|points| points.points > 0) {
            let PointAgreement { within, over, under } = points.overall.agreement;
            let without = points.points - points.overall.measured;
            let [within, over, under, without] =
                [within, over, under, without].map(|n| percent(n as f64 / points.points as f64));
            said.push_str(&format!(
                "; of the scan's points {within} are within, {over} over, {under} under, and {without} have no distance"
            ));
        }
        Some(said)
    }
}

/// The matching of the paper, and of files that do not name one.
fn all() -> String {
    Matching::All.name().to_owned()
}

/// Names without their indices, with the parts that have them, in the order of each group's first part; only names with
/// an index.
fn groups(names: &[String]) -> Vec<(String, Vec<usize>)> {
    let mut members: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (i, name) in names.iter().enumerate().filter(|(_, name)| name.contains('[')) {
        members.entry(without_indices(name)).or_default().push(i);
    }
    let mut groups: Vec<_> = members.into_iter().collect();
    groups.sort_by_key(|(_, parts)| parts[0]);
    groups
}

/// A part's name without its numbers in loops: `leg[2].hole[0]` is `leg.hole`.
#[must_use]
pub fn without_indices(name: &str) -> String {
    let mut depth = 0u32;
    let mut plain = String::new();
    for c in name.chars() {
        match c {
            '[' => depth += 1,
            ']' => depth = depth.saturating_sub(1),
            c if depth == 0 => plain.push(c),
            _ => {}
        }
    }
    plain
}
