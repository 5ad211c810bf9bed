//! The table of the parts.

use super::csv::{Cell, Table};
use crate::variance::{LimitsBasis, PartStatistics, PointStatistics, VarianceReport};

/// What a row is made from.
struct Row<'a> {
    part: &'a PartStatistics,
    points: Option<&'a PointStatistics>,
}

/// A column: its head, and the cell of a row.
type Column = (&'static str, for<'a> fn(&Row<'a>) -> Cell<'a>);

/// What was measured of the surface.
const SURFACE: [Column; 21] = [
    ("part", |row| Cell::Text(&row.part.name)),
    ("texels", |row| Cell::Count(row.part.statistics.texels)),
    ("area_mm2", |row| Cell::Number(row.part.statistics.area)),
    ("measured_area_mm2", |row| Cell::Number(row.part.statistics.measured_area)),
    ("coverage", |row| Cell::Number(row.part.statistics.coverage)),
    ("filled_area_mm2", |row| Cell::Number(row.part.statistics.filled_area)),
    ("buried_area_mm2", |row| Cell::Number(row.part.statistics.buried_area)),
    ("contradicted_area_mm2", |row| Cell::Number(row.part.statistics.contradicted_area)),
    ("ambiguous_area_mm2", |row| Cell::Number(row.part.statistics.ambiguous_area)),
    ("mean_mm", |row| Cell::Number(row.part.statistics.weighted.mean)),
    ("sd_mm", |row| Cell::Number(row.part.statistics.weighted.sd)),
    ("max_mm", |row| Cell::Number(row.part.statistics.weighted.max)),
    ("rms_mm", |row| Cell::Number(row.part.statistics.weighted.rms)),
    ("median_mm", |row| Cell::Number(row.part.statistics.weighted.median)),
    ("mad_mm", |row| Cell::Number(row.part.statistics.weighted.mad)),
    ("p95_mm", |row| Cell::Number(row.part.statistics.weighted.percentiles.p95)),
    ("signed_mean_mm", |row| Cell::Number(row.part.statistics.weighted.signed.mean)),
    ("signed_sd_mm", |row| Cell::Number(row.part.statistics.weighted.signed.sd)),
    ("signed_min_mm", |row| Cell::Number(row.part.statistics.weighted.signed.min)),
    ("signed_max_mm", |row| Cell::Number(row.part.statistics.weighted.signed.max)),
    ("signed_median_mm", |row| Cell::Number(row.part.statistics.weighted.signed.median)),
];

/// What follows from it.
const JUDGED: [Column; 19] = [
    ("limit_lower_mm", |row| Cell::number(row.limits().map(|l| l.lower))),
    ("limit_upper_mm", |row| Cell::number(row.limits().map(|l| l.upper))),
    ("limits_by", |row| row.limits().map_or(Cell::Empty, |l| Cell::Text(basis(l.basis)))),
    ("within_share", |row| Cell::number(row.part.statistics.agreement.map(|a| a.within.share))),
    ("over_share", |row| Cell::number(row.part.statistics.agreement.map(|a| a.over.share))),
    ("under_share", |row| Cell::number(row.part.statistics.agreement.map(|a| a.under.share))),
    ("detection_mm", |row| Cell::number(row.part.detection.map(|d| d.level))),
    ("significant_share", |row| Cell::number(row.part.detection.map(|d| d.significant))),
    ("verdict", |row| row.part.verdict.as_ref().map_or(Cell::Empty, |v| Cell::Text(v.outcome.text()))),
    ("verdict_value_mm", |row| Cell::number(row.part.verdict.as_ref().map(|v| v.value))),
    ("verdict_limit_mm", |row| Cell::number(row.part.verdict.as_ref().map(|v| v.limit))),
    ("verdict_uncertainty_mm", |row| Cell::number(row.part.verdict.as_ref().map(|v| v.uncertainty))),
    ("verdict_probability", |row| Cell::number(row.part.verdict.as_ref().map(|v| v.probability))),
    ("form", |row| row.zone().map_or(Cell::Empty, |zone| Cell::Text(zone.0))),
    ("form_minimum_zone_mm", |row| Cell::number(row.zone().map(|zone| zone.1))),
    ("points", |row| row.points.map_or(Cell::Empty, |p| Cell::Count(p.measured))),
    ("points_signed_mean_mm", |row| Cell::number(row.points.map(|p| p.moments.signed.mean))),
    ("points_signed_sd_mm", |row| Cell::number(row.points.map(|p| p.moments.signed.sd))),
    ("points_largest_mm", |row| Cell::number(row.points.and_then(|p| p.largest.as_ref()).map(|l| l.distance))),
];

impl<'a> Row<'a> {
    fn limits(&self) -> Option<crate::variance::Limits> {
        self.part.statistics.agreement?.limits
    }

    /// The characteristic and the width of the narrowest zone of form.
    fn zone(&self) -> Option<(&'a str, f64)> {
        let zone = self.part.form.as_ref()?.zone.as_ref()?;
        Some((&zone.characteristic, zone.minimum_zone))
    }
}

fn basis(basis: LimitsBasis) -> &'static str {
    match basis {
        LimitsBasis::Tolerance => "tolerance",
        LimitsBasis::Noise => "noise",
    }
}

/// The table of the parts of a report, in the model's order.
pub(super) fn table(report: &VarianceReport) -> String {
    let columns = || SURFACE.iter().chain(&JUDGED);
    let mut table = Table::new(columns().map(|(head, _)| *head));
    for (number, part) in report.parts.iter().enumerate() {
        let points = report.points.as_ref().and_then(|points| points.parts.get(number)).map(|part| &part.statistics);
        let row = Row { part, points };
        table.row(columns().map(|(_, cell)| cell(&row)));
    }
    table.into_text()
}
