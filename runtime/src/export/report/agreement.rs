//! How much of the surface and of the scan agrees, and how fine the texels are that show it.

use super::tables::{minus, number, short, table};
use crate::export::escape::escape;
use crate::variance::{Agreement, LimitsBasis, NOISE_FACTOR, Statistics, TexelWidths, VarianceReport};
use std::fmt::Write;

/// The sentence on all parts, and a table of them, before the distances. Nothing where nothing was measured.
pub(super) fn agreement(variance: &VarianceReport) -> String {
    let Some(sentence) = variance.agreement_sentence(short) else { return String::new() };
    let mut out = format!("<h3>Agreement</h3>\n<p>{sentence}.</p>\n");
    let head = "<thead><tr><th>Part</th><th>From, mm</th><th>To, mm</th><th>Limits by</th><th colspan=\"2\">Within, mm&sup2;</th>\
        <th colspan=\"2\">Over, mm&sup2;</th><th colspan=\"2\">Under, mm&sup2;</th></tr></thead>\n";
    table(
        "Areas by part, with their shares of the part's measured area",
        head,
        rows(variance, agreement_row).into_iter(),
        &mut out,
    );
    out.push_str("<h3>Distances</h3>\n");
    out
}

/// A row of a table for all parts, for each and for groups of them.
fn rows(variance: &VarianceReport, row: fn(&str, &Statistics, &str) -> Option<String>) -> Vec<String> {
    let all = row("All", &variance.overall, "total");
    let parts = variance.parts_with_surface().filter_map(|part| row(&part.name, &part.statistics, ""));
    let groups = variance.groups.iter().filter_map(|g| row(&format!("{} (all)", g.name), &g.statistics, "total"));
    all.into_iter().chain(parts).chain(groups).collect()
}

fn agreement_row(name: &str, s: &Statistics, class: &str) -> Option<String> {
    let Agreement { limits, within, over, under } = s.agreement?;
    let limits = limits.map_or_else(Default::default, |l| {
        let by = match l.basis {
            LimitsBasis::Tolerance => "tolerance".to_owned(),
            LimitsBasis::Noise => format!("{NOISE_FACTOR} &times; noise"),
        };
        [short(l.lower), short(l.upper), by]
    });
    let [lower, upper, by] = limits;
    let mut out = format!(
        "<tr class=\"{class}\"><td>{}</td><td>{lower}</td><td>{upper}</td><td class=\"text\">{by}</td>",
        escape(name)
    );
    for portion in [within, over, under] {
        let share = if s.measured_area > 0.0 { format!("{:.1} %", 100.0 * portion.share) } else { minus("-") };
        let _ = write!(out, "<td>{}</td><td>{share}</td>", number(portion.area));
    }
    out.push_str("</tr>\n");
    Some(out)
}

/// A table of the widths of texels. Nothing if there are none.
pub(super) fn texels(variance: &VarianceReport) -> String {
    let rows = rows(variance, texel_row);
    if rows.is_empty() {
        return String::new();
    }
    let mut out = format!(
        "<p class=\"convention\">A texel is {} mm wide on the average: the root of the area that it stands for. Widths by area: \
         on 5 % of the surface texels are narrower than the first figure, on half of it wider than the second. Detail that is \
         narrower than a texel may be missed.</p>\n",
        number(variance.texel)
    );
    let head = "<thead><tr><th>Part</th><th>Texels</th><th>5 %, mm</th><th>Median, mm</th><th>95 %, mm</th>\
        <th>Widest, mm</th><th>Longest side, mm</th></tr></thead>\n";
    table("Widths of texels by part", head, rows.into_iter(), &mut out);
    out
}

fn texel_row(name: &str, s: &Statistics, class: &str) -> Option<String> {
    let TexelWidths { p5, median, p95, max, longest_side } = s.texel_widths?;
    let widths: String =
        [p5, median, p95, max, longest_side].iter().map(|w| format!("<td>{}</td>", number(*w))).collect();
    Some(format!("<tr class=\"{class}\"><td>{}</td><td>{}</td>{widths}</tr>\n", escape(name), s.texels))
}
