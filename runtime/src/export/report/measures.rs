//! The report's table of measures.

use super::rounding::pair;
use super::tables::{minus, number, precise, short, table};
use crate::export::escape::escape;
use crate::fit::FittedMeasure;
use crate::variance::{DimensionVerdict, Outcome, PointMeasure, VarianceReport};
use std::fmt::Write;

/// The measures of the fitted model, with the verdicts on those that have a tolerance. Nothing if there are none.
pub(super) fn measures(measures: &[FittedMeasure], variance: &VarianceReport, out: &mut String) {
    if measures.is_empty() {
        return;
    }
    out.push_str(
        "<h3>Measures</h3>\n<p class=\"convention\">Computed of the fitted parameters, with standard deviations by their covariance. \
         The deviation is that from the nominal value, which the script has at its defaults.</p>\n",
    );
    let judged = |m: &FittedMeasure| variance.measures.iter().find(|v| v.name == m.name);
    let rows = measures.iter().map(|m| row(m, judged(m)));
    let head = "<thead><tr><th>Measure</th><th>Value</th><th>SD</th><th>Unit</th><th>Nominal</th><th>Deviation</th>\
        <th>From</th><th>To</th><th>Probability</th><th>Verdict</th></tr></thead>\n";
    table("Measures of the fitted model", head, rows, out);
    if let Some(overall) = variance.verdict.as_ref().filter(|_| !variance.measures.is_empty()) {
        let _ = writeln!(
            out,
            "<p class=\"convention\">Decision rule: {}; scanner: {} mm in lengths. Parts and measures together: <b>{}</b>.</p>",
            escape(&overall.decision),
            number(overall.device_uncertainty),
            overall.outcome.text(),
        );
    }
}

/// Measures by the measured points of parts. Nothing if there are none.
pub(super) fn by_points(variance: &VarianceReport, out: &mut String) {
    if variance.point_measures.is_empty() {
        return;
    }
    out.push_str(
        "<h3>Measures by points</h3>\n<p class=\"convention\">Of the surfaces of least squares of the points of the scan that belong \
         to the parts, whatever the fit; with standard uncertainties by the scatter of the points, taken as independent.</p>\n",
    );
    let row = |m: &PointMeasure| {
        let (factor, unit) =
            if m.unit == "rad" { (1f64.to_degrees(), "&deg;".to_owned()) } else { (1.0, escape(&m.unit)) };
        let shown = |figure: Option<f64>, format: fn(f64) -> String| {
            figure.map_or_else(String::new, |figure| format(factor * figure))
        };
        let cells = [
            escape(&m.name),
            escape(&m.parts.join(", ")),
            escape(m.figure.as_deref().unwrap_or_default()),
            unit,
            precise(factor * m.model),
            shown(m.value, precise),
            shown(m.uncertainty, number),
        ];
        let cells: String = cells.iter().map(|cell| format!("<td>{cell}</td>")).collect();
        format!("<tr>{cells}<td class=\"text\">{}</td></tr>\n", escape(m.reason.as_deref().unwrap_or_default()))
    };
    let head = "<thead><tr><th>Measure</th><th>Of</th><th>Figure</th><th>Unit</th><th>Model</th><th>By points</th>\
        <th>Uncertainty</th><th>Remark</th></tr></thead>\n";
    table("Measures by the measured points of parts", head, variance.point_measures.iter().map(row), out);
}

/// Angles are shown in degrees.
fn row(measure: &FittedMeasure, verdict: Option<&DimensionVerdict>) -> String {
    let shown = |figure: Option<f64>, format: fn(f64) -> String| {
        figure.map_or_else(String::new, |figure| format(measure.written(figure).0))
    };
    let unit = match measure.written(0.0).1 {
        "deg" => "&deg;".to_owned(),
        unit => minus(&escape(unit)),
    };
    let limits = [measure.tolerance.map(|t| t.lower), measure.tolerance.map(|t| t.upper)];
    let [from, to] = limits.map(|limit| shown(limit, short));
    let [value, sd] =
        pair(measure.written(measure.value.unwrap_or(f64::NAN)).0, measure.sd.map(|sd| measure.written(sd).0));
    let cells = [
        escape(&measure.name),
        measure.sd.map_or_else(|| shown(measure.value, precise), |_| value),
        sd,
        unit,
        shown(measure.nominal, precise),
        shown(measure.deviation(), number),
        from,
        to,
        verdict.map_or_else(String::new, |v| number(v.probability)),
    ];
    let cells: String = cells.iter().map(|cell| format!("<td>{cell}</td>")).collect();
    format!("<tr>{cells}<td class=\"text\">{}</td></tr>\n", remark(measure, verdict))
}

/// The verdict with its reasons, or why there is no standard deviation.
fn remark(measure: &FittedMeasure, verdict: Option<&DimensionVerdict>) -> String {
    let marked = |text: &str| format!("<span class=\"mark\">{}</span>", escape(text));
    match (verdict, &measure.without_sd) {
        (Some(verdict), _) if verdict.outcome == Outcome::Conforms => verdict.outcome.text().to_owned(),
        (Some(verdict), _) => {
            let text = std::iter::once(verdict.outcome.text()).chain(verdict.reasons.iter().map(String::as_str));
            marked(&text.collect::<Vec<_>>().join(": "))
        }
        (None, Some(reason)) => marked(reason),
        (None, None) => String::new(),
    }
}
