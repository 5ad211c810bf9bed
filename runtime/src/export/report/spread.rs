//! How deviations spread by part: percentiles, levels of detection, and the movement of the surface by parameters.

use super::tables::{minus, number, table};
use crate::export::escape::escape;
use crate::variance::{Moments, PartStatistics, Percentiles, SensitivityRange, VarianceReport};

/// Percentiles of all parts and of each.
pub(super) fn percentiles(variance: &VarianceReport, out: &mut String) {
    out.push_str("<h3>Percentiles</h3>\n");
    let head = "<thead><tr><th>Part</th><th>1 %</th><th>5 %</th><th>25 %</th><th>Median</th><th>75 %</th><th>95 %</th><th>99 %</th>\
        <th>MAD</th></tr></thead>\n";
    let row = |name: &str, m: &Moments| {
        let Percentiles { p1, p5, p25, p50, p75, p95, p99 } = m.signed.percentiles;
        let figures = [p1, p5, p25, p50, p75, p95, p99, m.signed.mad].map(|x| format!("<td>{}</td>", number(x)));
        format!("<tr><td>{}</td>{}</tr>\n", escape(name), figures.concat())
    };
    let parts = variance.parts_with_surface().map(|part| row(&part.name, &part.statistics.weighted));
    let all = std::iter::once(row("All", &variance.overall.weighted));
    table("Signed deviations by area, mm; MAD: median absolute deviation from the median", head, all.chain(parts), out);
}

/// What is significant at 95 %.
pub(super) fn detection(variance: &VarianceReport, out: &mut String) {
    let row = |part: &PartStatistics| {
        let d = part.detection.as_ref()?;
        let [noise, model, level] = [d.noise, d.model, d.level].map(number);
        let (name, share) = (escape(&part.name), 100.0 * d.significant);
        Some(format!("<tr><td>{name}</td><td>{noise}</td><td>{model}</td><td>{level}</td><td>{share:.1} %</td></tr>\n"))
    };
    let rows: Vec<String> = variance.parts.iter().filter_map(row).collect();
    if rows.is_empty() {
        return;
    }
    out.push_str("<h3>Significance</h3>\n");
    let head = "<thead><tr><th>Part</th><th>Noise, mm</th><th>Fitted surface, mm</th><th>Level, mm</th><th>Beyond it</th></tr></thead>\n";
    let caption = "Levels of detection at 95 % confidence, by the standard deviations of the scan's points and of the fitted surface";
    table(caption, head, rows.into_iter(), out);
}

/// How far the surface moves by a unit of each parameter, if that was asked for.
pub(super) fn sensitivities(variance: &VarianceReport, out: &mut String) {
    if variance.sensitivities.is_empty() {
        return;
    }
    out.push_str("<h3>Sensitivities</h3>\n");
    let head = "<thead><tr><th>Parameter</th><th>Least</th><th>Greatest</th><th>RMS</th><th>Unit</th><th>Map</th></tr></thead>\n";
    let row = |s: &SensitivityRange| {
        let figures = [s.min, s.max, s.rms].map(|x| format!("<td>{}</td>", number(x))).concat();
        let (name, unit, file) = (escape(&s.parameter), minus(&escape(&s.unit)), escape(&s.picture));
        format!("<tr><td>{name}</td>{figures}<td class=\"text\">{unit}</td><td class=\"text\">{file}</td></tr>\n")
    };
    table(
        "Movement of the surface along its normal by a unit of each parameter",
        head,
        variance.sensitivities.iter().map(row),
        out,
    );
}
