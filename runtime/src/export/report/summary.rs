//! The first screen: what was inspected, the verdict, the figure that decides it, and one picture.

use super::rounding::with_uncertainty;
use super::tables::{minus, number, short};
use super::{Report, figure};
use crate::export::escape::escape;
use crate::variance::{Outcome, VarianceReport};
use std::fmt::Write;

/// Names and texts, those of the user first.
pub(super) fn facts(report: &Report<'_>) -> String {
    let scan = &report.variance.scan;
    let name = file_name(&scan.path);
    let size = format!("{} points, {} triangles, in {}", scan.points, scan.triangles, scan.unit);
    let stated = report.record.iter().flat_map(|record| &record.fields);
    let mut rows: Vec<(&str, String)> = stated.map(|field| (field.name.as_str(), field.value.clone())).collect();
    let script = report.scripts.texts.first().map_or_else(String::new, |(name, _)| format!(" ({name})"));
    if let Some(fit) = report.fit {
        rows.push(("Model", format!("{}{script}", fit.model)));
    }
    rows.push(("Scan", format!("{name} ({size})")));
    if let Some(record) = report.record {
        rows.push(("Inspected", format!("{}, by {}", record.time.replace('T', " ").replace('Z', " UTC"), record.tool)));
    }
    rows.iter().fold(String::new(), |mut out, (term, text)| {
        let _ = writeln!(out, "<dt>{}</dt><dd>{}</dd>", escape(term), escape(text));
        out
    })
}

/// The name of a file, without its folders, whichever system's they are.
pub(crate) fn file_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).find(|name| !name.is_empty()).unwrap_or(path)
}

/// The verdict with the figure that decides it, beside a picture.
pub(super) fn verdict(report: &Report<'_>) -> String {
    let variance = report.variance;
    let doubt = report.fit.and_then(crate::fit::FitResult::shortcoming);
    let outcome = variance.verdict.as_ref().map(|verdict| verdict.outcome);
    let (class, title) = match (&doubt, outcome) {
        (Some(_), _) => ("doubtful", "Undecided: the fit cannot be relied on".to_owned()),
        (_, Some(Outcome::Conforms)) => ("good", "Conforms to all tolerances".to_owned()),
        (_, Some(Outcome::Undecided)) => ("doubtful", "Undecided".to_owned()),
        (_, Some(outcome)) => ("bad", first_upper(outcome.text())),
        (None, None) => ("open", "No verdict: no tolerance was given".to_owned()),
    };
    let mut out = format!("<section class=\"verdict {class}\">\n<div>\n<h2>{title}</h2>\n");
    if let Some(doubt) = doubt {
        let _ = writeln!(out, "<p>{}.</p>", escape(&first_upper(&doubt)));
    }
    out.push_str(&decisive(variance).unwrap_or_else(|| spread(variance)));
    tiles(report, &mut out);
    out.push_str("</div>\n");
    if let Some(picture) = &report.picture {
        let of = "Model in the colours of its deviations";
        out.push_str(&figure(picture, of).replacen("<figcaption>", &format!("<figcaption>{of}. "), 1));
    }
    out.push_str("</section>\n");
    out
}

fn first_upper(text: &str) -> String {
    let mut rest = text.chars();
    rest.next().map_or_else(String::new, |first| first.to_uppercase().chain(rest).collect())
}

/// The deviation that decides: of the parts and measures that have the outcome of all, the one least likely to conform.
fn decisive(variance: &VarianceReport) -> Option<String> {
    let outcome = variance.verdict.as_ref()?.outcome;
    let parts = variance.parts.iter().filter_map(|part| {
        let verdict = part.verdict.as_ref().filter(|v| v.outcome == outcome)?;
        let tolerance = part.statistics.tolerance.as_ref()?.tolerance?;
        let of = format!("largest deviation of part {}", part.name);
        let figures = [verdict.value, verdict.uncertainty, tolerance.lower, tolerance.upper];
        Some((verdict.probability, of, figures, "mm", &verdict.reasons))
    });
    let measures = variance.measures.iter().filter(|m| m.outcome == outcome).map(|measure| {
        let degrees = measure.unit == "rad";
        let factor = if degrees { 1f64.to_degrees() } else { 1.0 };
        let (deviation, tolerance) = (measure.deviation, measure.tolerance);
        let figures = [deviation, measure.uncertainty, tolerance.lower, tolerance.upper].map(|x| factor * x);
        let unit = if degrees { "°" } else { &measure.unit };
        (measure.probability, format!("deviation of measure {}", measure.name), figures, unit, &measure.reasons)
    });
    // What cannot be computed decides before all else.
    let all = parts.chain(measures);
    let (_, of, [value, uncertainty, lower, upper], unit, reasons) =
        all.min_by(|a, b| (!a.0.is_nan()).cmp(&!b.0.is_nan()).then(a.0.total_cmp(&b.0)))?;
    let figure = with_uncertainty(value, Some(uncertainty));
    let reasons: String = reasons.iter().map(|reason| format!("<br>{}", escape(&first_upper(reason)))).collect();
    Some(format!(
        "<p class=\"figure\"><b>{figure} {unit}</b> {}; allowed from {} to {} {unit}{reasons}</p>\n",
        escape(&of),
        short(lower),
        short(upper)
    ))
}

/// Without a tolerance: within which distance 95 % of the surface lies. Its uncertainty is that of the fitted surface.
fn spread(variance: &VarianceReport) -> String {
    let (mut squares, mut area) = (0.0, 0.0);
    for part in &variance.parts {
        if let Some(detection) = part.detection {
            squares += part.statistics.measured_area * detection.model.powi(2);
            area += part.statistics.measured_area;
        }
    }
    let fitted = if area > 0.0 { (squares / area).sqrt() } else { 0.0 };
    let figure = with_uncertainty(variance.overall.weighted.percentiles.p95, Some(fitted));
    let of = if fitted > 0.0 { ", as far as the fitted surface is certain (one standard deviation)" } else { "" };
    format!("<p class=\"figure\"><b>{figure} mm</b> are the most that 95 % of the measured surface deviate{of}</p>\n")
}

/// The figures that most readers look for.
fn tiles(report: &Report<'_>, out: &mut String) {
    let overall = &report.variance.overall;
    let w = &overall.weighted;
    let within = format!("of it within {}", report.variance.limits(number));
    let mut tiles = vec![
        (format!("{} mm", number(w.signed.mean)), "mean signed deviation"),
        (format!("{} mm", number(w.rms)), "root mean square"),
        (format!("{} mm", number(w.max)), "largest deviation"),
        (format!("{:.1} %", 100.0 * overall.coverage), "of the surface measured"),
    ];
    if let Some(agreement) = overall.agreement.filter(|_| overall.measured_area > 0.0) {
        tiles.push((format!("{:.1} %", 100.0 * agreement.within.share), &within));
    }
    tiles.push((format!("{} mm", number(report.variance.noise)), "noise of the scan"));
    out.push_str("<div class=\"tiles\">\n");
    for (figure, text) in tiles {
        let _ = writeln!(out, "<div class=\"tile\"><b>{}</b><span>{text}</span></div>", minus(&figure));
    }
    out.push_str("</div>\n");
}
