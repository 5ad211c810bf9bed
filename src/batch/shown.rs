//! The summary of a batch as text.

use crate::table;
use gml_runtime::population::{Capability, Quantities, Row, Series, Summary};

/// The most failures and outlying values that are listed.
const MOST_LISTED: usize = 20;

/// Counts, a table of the quantities, what is outlying, and what has no result.
pub(super) fn summary(summary: &Summary, rows: &[Row]) -> String {
    let mut out = format!("{}: {} scans, {} fitted and measured", summary.model, summary.scans, summary.inspected);
    summary.verdicts.iter().for_each(|(verdict, count)| out.push_str(&format!(", {count} {verdict}")));
    out.push_str("\n\n");
    let quantities: Vec<&Series> = summary.series.iter().filter(|s| s.of != Quantities::Part).collect();
    if !quantities.is_empty() {
        let head = ["quantity", "unit", "scans", "mean", "+-", "sd between", "95 %", "sd of measurement", "Ppk"];
        let rows = quantities.iter().map(|s| quantity(s));
        out.push_str(&table::render(&head, &rows.collect::<Vec<_>>()));
        out.push('\n');
    }
    if let Some(variation) = &summary.variation
        && let Some(first) = variation.contributions.first()
    {
        out.push_str(&format!(
            "most of what differs is by {}: it moves the surface by {} mm (rms), all parameters that differ by {} mm\n",
            first.name,
            table::number(first.movement),
            table::number(variation.movement)
        ));
    }
    let named = |row: usize| rows.get(row).map_or("", |row| row.name.as_str());
    for outlying in summary.outlying.iter().take(MOST_LISTED) {
        let series = summary.series.iter().find(|series| series.name == outlying.quantity);
        let (factor, unit) = series.map_or((1.0, ""), shown_unit);
        let shown = |x: f64| format!("{} {unit}", table::number(x * factor)).trim_end().to_owned();
        out.push_str(&format!(
            "outlying: {}, {} {} where the median is {} ({:+.1} robust standard deviations)\n",
            named(outlying.row),
            outlying.quantity,
            shown(outlying.value),
            shown(outlying.median),
            outlying.score
        ));
    }
    more(&mut out, summary.outlying.len());
    let failures: Vec<(&Row, &str)> = rows.iter().filter_map(|row| Some((row, row.failure()?))).collect();
    for (row, reason) in failures.iter().take(MOST_LISTED) {
        out.push_str(&format!("no result: {}: {reason}\n", row.scan));
    }
    more(&mut out, failures.len());
    summary.warnings.iter().for_each(|warning| out.push_str(&format!("warning: {warning}\n")));
    out
}

fn more(out: &mut String, count: usize) {
    if count > MOST_LISTED {
        out.push_str(&format!("and {} more, in the table\n", count - MOST_LISTED));
    }
}

/// The unit in which a quantity is shown, and the factor to it: angles are in degrees.
fn shown_unit(series: &Series) -> (f64, &str) {
    if series.unit == "rad" { (1f64.to_degrees(), "deg") } else { (1.0, series.unit.as_str()) }
}

/// The row of a quantity.
fn quantity(series: &Series) -> Vec<String> {
    let (factor, unit) = shown_unit(series);
    let shown = |x: f64| table::number(x * factor);
    let mut cells = vec![series.name.clone(), unit.to_owned(), series.values.len().to_string()];
    match &series.effects {
        Some(effects) => {
            let [low, high] = effects.between_interval;
            // Intervals are of two standard deviations on both sides.
            let of_mean = 0.5 * (effects.mean_interval[1] - effects.mean_interval[0]);
            let by = |x: f64, half: f64| table::rounded(x * factor, Some(0.5 * half * factor));
            let between = |x: f64| by(x, 0.5 * (high - low));
            cells.push(by(effects.mean, of_mean));
            cells.push(by(of_mean, of_mean));
            cells.push(between(effects.between));
            cells.push(format!("{} to {}", between(low), between(high)));
            cells.push(shown(effects.measurement));
        }
        None => {
            cells.push(series.chart.as_ref().map_or_else(|| "-".to_owned(), |chart| shown(chart.centre)));
            cells.extend(std::iter::repeat_n("-".to_owned(), 4));
        }
    }
    let ppk = |c: &Capability| format!("{:.2}", c.ppk.value);
    cells.push(series.capability.as_ref().map_or_else(|| "-".to_owned(), ppk));
    cells
}
