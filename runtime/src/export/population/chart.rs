//! The run chart of a quantity.

use crate::export::escape::escape;
use crate::export::report::rounding::decimals;
use crate::population::Series;
use std::fmt::Write;

/// Size of a chart.
const SIZE: [f64; 2] = [860.0, 190.0];

/// Margins.
const LEFT: f64 = 74.0;
const RIGHT: f64 = 60.0;
const TOP: f64 = 10.0;
const BOTTOM: f64 = 26.0;

/// Height of a label. The chart's units.
const LETTERS: f64 = 12.0;

/// Radius of a mark at a value that is a signal. The chart's units.
const RING: f64 = 5.0;

/// Values in their order with two standard deviations of measurement either way as bars, the mean, the control limits
/// and the limits of the tolerance; what is a signal has a ring. `scale` takes figures to the unit that people read.
pub(super) fn run_chart(series: &Series, names: &dyn Fn(usize) -> String, scale: f64) -> String {
    let [width, height] = SIZE;
    let Some([low, high]) = range(series) else { return String::new() };
    let count = series.values.len();
    let x = |k: usize| LEFT + (width - LEFT - RIGHT) * (k as f64 + 0.5) / count as f64;
    let y = |value: f64| TOP + (height - TOP - BOTTOM) * (high - value) / (high - low);
    let mut out = format!(
        "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"Run chart of {}\">\n",
        escape(&series.name)
    );
    let mut labelled: Vec<f64> = Vec::new();
    for (value, class, label) in lines(series) {
        let (line, right) = (y(value), width - RIGHT);
        let _ =
            writeln!(out, "<line class=\"{class}\" x1=\"{LEFT}\" x2=\"{right}\" y1=\"{line:.1}\" y2=\"{line:.1}\"/>");
        // Of labels that would cover each other the first stays.
        if labelled.iter().all(|other| (other - line).abs() > LETTERS) {
            labelled.push(line);
            let (left, text) = (right + 5.0, line + 4.0);
            let _ = writeln!(out, "<text x=\"{left}\" y=\"{text:.1}\">{label}</text>");
        }
    }
    for value in [low, high] {
        let (text, end) = (y(value) + 4.0, LEFT - 8.0);
        let _ = writeln!(out, "<text x=\"{end}\" y=\"{text:.1}\" text-anchor=\"end\">{}</text>", figure(value * scale));
    }
    let mut bars = String::new();
    for (k, (value, sd)) in series.values.iter().zip(&series.sds).enumerate() {
        if let Some(sd) = sd {
            let _ = write!(bars, "M{:.1} {:.1}V{:.1}", x(k), y(value - 2.0 * sd), y(value + 2.0 * sd));
        }
    }
    let mut dots = String::new();
    for (k, value) in series.values.iter().enumerate() {
        let _ = write!(dots, "M{:.1} {:.1}h0", x(k), y(*value));
    }
    let _ = writeln!(out, "<path class=\"bar\" d=\"{bars}\"/>\n<path class=\"dot\" d=\"{dots}\"/>");
    for signal in series.chart.iter().flat_map(|chart| &chart.signals) {
        let (name, reason) = (escape(&names(series.rows[signal.at])), escape(&signal.reason));
        let (cx, cy) = (x(signal.at), y(series.values[signal.at]));
        let _ = writeln!(
            out,
            "<circle class=\"ring\" cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"{RING}\"><title>{name}: {reason}</title></circle>"
        );
    }
    let (below, middle) = (height - 6.0, LEFT + (width - LEFT - RIGHT) / 2.0);
    let _ = writeln!(
        out,
        "<text x=\"{middle}\" y=\"{below}\" text-anchor=\"middle\">scans in their order, 1 to {count}</text>"
    );
    out.push_str("</svg>\n");
    out
}

/// The lines across a chart: their values, classes and labels.
fn lines(series: &Series) -> Vec<(f64, &'static str, &'static str)> {
    let mut lines = Vec::new();
    if let Some(limits) = series.limits {
        lines.push((limits.lower, "allowed", "allowed"));
        lines.push((limits.upper, "allowed", "allowed"));
    }
    if let Some(chart) = &series.chart {
        lines.push((chart.centre, "mean", "mean"));
        lines.push((chart.limits[0], "limit", "limit"));
        lines.push((chart.limits[1], "limit", "limit"));
    }
    lines
}

/// The values that the chart shows, least and greatest; none where there is nothing to show.
fn range(series: &Series) -> Option<[f64; 2]> {
    let values = series.values.iter().zip(&series.sds).flat_map(|(value, sd)| {
        let reach = 2.0 * sd.unwrap_or(0.0);
        [value - reach, value + reach]
    });
    let lines = lines(series);
    let all = values.chain(lines.iter().map(|(value, ..)| *value)).filter(|value| value.is_finite());
    let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    let room = 0.04 * (high - low);
    match high - low {
        span if span > 0.0 => Some([low - room, high + room]),
        // One value, or equal ones.
        _ if low.is_finite() => Some([low - low.abs().max(1.0) * 1e-3, low + low.abs().max(1.0) * 1e-3]),
        _ => None,
    }
}

/// A figure and its interval of 95 %, with the decimals that these leave.
pub(super) fn with_interval(x: f64, [low, high]: [f64; 2]) -> [String; 2] {
    // Half of it is two standard deviations.
    let shown = |x: f64| match decimals(0.25 * (high - low)) {
        Some(decimals) if x.is_finite() => format!("{x:.decimals$}"),
        _ => figure(x),
    };
    [shown(x), format!("{} to {}", shown(low), shown(high))]
}

/// A value of which no uncertainty is known, with six significant digits.
pub(super) fn figure(x: f64) -> String {
    significant(x, 6)
}

/// A standard deviation, or another size of deviations, with three: of a thousand objects it is known to 2 %.
pub(super) fn spread(x: f64) -> String {
    significant(x, 3)
}

fn significant(x: f64, digits: i32) -> String {
    if !x.is_finite() {
        return "-".to_owned();
    }
    let digits = if x == 0.0 { 0 } else { (digits - 1 - x.abs().log10().floor() as i32).clamp(0, 9) };
    format!("{x:.*}", digits as usize)
}
