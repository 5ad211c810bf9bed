//! The report's tables.

use super::measures::by_points;
use super::relations::relations;
use super::spread::{detection, percentiles, sensitivities};
use crate::export::escape::escape;
use crate::variance::{
    Characteristic, Explanation, FormDeviation, Outcome, ParameterEffect, PartStatistics, Piece, PointDistances,
    PointStatistics, Statistics, UnmatchedSummary, VarianceReport, Verdict, WithoutNoise,
};
use std::fmt::Write;

/// A figure with its significant digits; a dash where it is not finite.
pub(super) fn number(x: f64) -> String {
    if !x.is_finite() {
        return "&ndash;".to_owned();
    }
    let text = match x.abs() {
        a if a >= 1e6 || (a > 0.0 && a < 5e-5) => format!("{x:.2e}"),
        a if a >= 1000.0 => format!("{x:.1}"),
        a if a >= 100.0 => format!("{x:.2}"),
        a if a >= 0.1 || a == 0.0 => format!("{x:.3}"),
        _ => format!("{x:.4}"),
    };
    minus(&text)
}

/// A value that may be used further, with more digits.
pub(super) fn precise(x: f64) -> String {
    if x.abs() >= 1e6 || (x != 0.0 && x.abs() < 1e-3) || !x.is_finite() {
        return number(x);
    }
    minus(&format!("{x:.5}"))
}

/// A round figure, such as those of an axis, without trailing zeros.
pub(super) fn short(x: f64) -> String {
    let text = format!("{x:.4}");
    if x == 0.0 || (1e-3..1e6).contains(&x.abs()) {
        return minus(text.trim_end_matches('0').trim_end_matches('.'));
    }
    number(x)
}

pub(super) fn minus(text: &str) -> String {
    text.replace('-', "&minus;")
}

/// Appends a table with a caption; `head` is its element `thead`. The first cell of each row is its heading.
pub(super) fn table(caption: &str, head: &str, rows: impl Iterator<Item = String>, out: &mut String) {
    let head = head.replace("<th>", "<th scope=\"col\">").replace("<th colspan", "<th scope=\"colgroup\" colspan");
    let heading = |row: &str| row.replacen("<td>", "<th scope=\"row\">", 1).replacen("</td>", "</th>", 1);
    let rows: String = rows.collect();
    let mut body = String::new();
    for (i, row) in rows.split("<tr").enumerate() {
        body.push_str(&if i == 0 { row.to_owned() } else { format!("<tr{}", heading(row)) });
    }
    let _ = write!(
        out,
        "<div class=\"scroll\" tabindex=\"0\"><table>\n<caption>{caption}</caption>\n{head}<tbody>\n{body}</tbody></table></div>\n"
    );
}

/// A figure as [`number`] has it, for a sentence that is escaped later.
fn plain(x: f64) -> String {
    number(x).replace("&minus;", "\u{2212}").replace("&ndash;", "\u{2013}")
}

/// A sentence as HTML, with a capital letter.
fn capitalised(sentence: &str) -> String {
    let mut said = sentence.to_owned();
    said[..1].make_ascii_uppercase();
    escape(&said)
}

/// A row of cells whose content is HTML.
pub(super) fn row_of(cells: &[String]) -> String {
    let cells: String = cells.iter().map(|cell| format!("<td>{cell}</td>")).collect();
    format!("<tr>{cells}</tr>\n")
}

/// Statistics of all parts, of each and of groups of them.
pub(super) fn statistics(variance: &VarianceReport) -> String {
    let mut out = String::new();
    let parts = variance.parts_with_surface().map(|part| row(&part.name, &part.statistics, ""));
    let groups = variance.groups.iter().map(|g| row(&format!("{} (all)", g.name), &g.statistics, "total"));
    let all = std::iter::once(row("All", &variance.overall, "total"));
    let head = "<thead>\
        <tr><td></td><td></td><td></td><th colspan=\"6\">unsigned, mm</th><th colspan=\"4\">signed, mm</th></tr>\
        <tr><th>Part</th><th>Area, mm&sup2;</th><th>Coverage</th><th>Mean</th><th>SD</th><th>RMS</th><th>Median</th>\
        <th>95 %</th><th>Max</th><th>Mean</th><th>SD</th><th>Min</th><th>Max</th></tr></thead>\n";
    table("Deviations by part, weighted by area", head, all.chain(parts).chain(groups), &mut out);
    if let Some(cylinder) = &variance.cylinder {
        let _ = writeln!(out, "<p class=\"convention\">{}.</p>", capitalised(&cylinder.sentence(plain)));
    }
    if let Some(sag) = variance.sag_sentence(plain) {
        let _ = writeln!(out, "<p class=\"convention\">{}.</p>", capitalised(&sag));
    }
    percentiles(variance, &mut out);
    detection(variance, &mut out);
    conformance(variance, &mut out);
    if let Some(distances) = &variance.points {
        points(variance, distances, &mut out);
    }
    by_points(variance, &mut out);
    explained(variance, &mut out);
    forms(variance, &mut out);
    if let Some(datum) = &variance.datum {
        relations(datum, &mut out);
    }
    if let Some(holes) = &variance.holes {
        let _ = writeln!(
            out,
            "<p class=\"convention\">Holes of the scan up to {} mm across were closed: {}, with {} mm&sup2;; {} edges around larger holes, \
             sheets and pieces were left open. {} mm&sup2; of the model look at closed holes: not measured, olive in the textures.</p>",
            short(holes.size),
            holes.filled,
            number(holes.area),
            holes.open,
            number(variance.overall.filled_area),
        );
    }
    if let Some(buried) = by_part(variance, |s| s.buried_area) {
        let _ = writeln!(
            out,
            "<p class=\"convention\">Inside of the model's own material, where nothing can be measured, and no part of these \
             areas: {buried}, dark grey in the textures.</p>",
        );
    }
    if let Some(contradicted) = by_part(variance, |s| s.contradicted_area) {
        let _ = writeln!(
            out,
            "<p class=\"convention\">Without data, and where the scan shows empty space: {contradicted}, amber in the pictures.</p>",
        );
    }
    if let Some(ambiguous) = by_part(variance, |s| s.ambiguous_area) {
        let _ = writeln!(
            out,
            "<p class=\"convention\">Without data, since what the rays meet belongs to another place of the model or to a \
             spike of the scan: {ambiguous}, green in the pictures.</p>",
        );
    }
    if variance.spikes > 0 {
        let _ = writeln!(
            out,
            "<p class=\"convention\">Spikes of the scan, single vertices far from all of their neighbours, to which no \
             distance is taken: {}.</p>",
            variance.spikes,
        );
    }
    if let Some(unmatched) = &variance.unmatched {
        left_over(unmatched, variance.max_distance, &mut out);
    }
    out
}

/// An area of the model, with the parts that have it. None if none has.
fn by_part(variance: &VarianceReport, area: impl Fn(&Statistics) -> f64) -> Option<String> {
    let parts = variance.parts.iter().map(|part| (&part.name, area(&part.statistics))).filter(|(_, area)| *area > 0.0);
    let parts: Vec<String> = parts.map(|(name, area)| format!("{} of {}", number(area), escape(name))).collect();
    (!parts.is_empty()).then(|| format!("{} mm&sup2; ({})", number(area(&variance.overall)), parts.join(", ")))
}

fn row(name: &str, s: &Statistics, class: &str) -> String {
    let (w, signed) = (&s.weighted, &s.weighted.signed);
    let figures =
        [w.mean, w.sd, w.rms, w.median, w.percentiles.p95, w.max, signed.mean, signed.sd, signed.min, signed.max];
    let cells: String = figures.iter().map(|figure| format!("<td>{}</td>", number(*figure))).collect();
    let (name, area, coverage) = (escape(name), number(s.area), 100.0 * s.coverage);
    format!("<tr class=\"{class}\"><td>{name}</td><td>{area}</td><td>{coverage:.1} %</td>{cells}</tr>\n")
}

/// The distances of the scan's points from the surface.
fn points(variance: &VarianceReport, points: &PointDistances, out: &mut String) {
    let _ = writeln!(
        out,
        "<h3>At the scan's points</h3>\n<p class=\"convention\">Signed distances of the points from the exact surface, every \
         point counted alike: {:.1} % of {} have one, {} are farther than {} mm, and {} only beside surface that faces another \
         way.</p>",
        100.0 * points.share,
        points.points,
        points.beyond,
        number(variance.max_distance),
        points.facing_away,
    );
    let row = |name: &str, s: &PointStatistics| {
        let m = &s.moments;
        let figures =
            [m.signed.mean, m.signed.sd, m.rms, m.signed.median, m.percentiles.p95, m.signed.min, m.signed.max];
        let figures: String = figures.iter().map(|figure| format!("<td>{}</td>", number(*figure))).collect();
        let place = s.largest.as_ref().map_or_else(String::new, |l| l.place.map(number).join(", "));
        format!("<tr><td>{}</td><td>{}</td>{figures}<td class=\"text\">{place}</td></tr>\n", escape(name), s.measured)
    };
    let head = "<thead><tr><th>Part</th><th>Points</th><th>Mean</th><th>SD</th><th>RMS</th><th>Median</th>\
        <th>95 %, unsigned</th><th>Least</th><th>Greatest</th><th>Largest at, mm</th></tr></thead>\n";
    let there = points.parts.iter().zip(&variance.parts).filter(|(_, part)| part.statistics.is_of_something());
    let parts = there.map(|(part, _)| row(&part.name, &part.statistics));
    table("Deviations of the scan's points, mm", head, std::iter::once(row("All", &points.overall)).chain(parts), out);
}

/// The verdicts on parts with tolerances, if there are any.
fn conformance(variance: &VarianceReport, out: &mut String) {
    let (Some(_), Some(overall)) = (&variance.overall.tolerance, &variance.verdict) else { return };
    let _ = writeln!(
        out,
        "<h3>Tolerance</h3>\n<p class=\"convention\">Each part is divided into footprints of equal area; its value is the median \
         deviation on the worst of them. Again is what a second measurement would show on average where one looks the worst. \
         The uncertainty is standard (noise on the footprint, fit, scanner). Decision rule: {}; a part conforms only if {} % of \
         it were measured. All together: <b>{}</b>.</p>",
        escape(&overall.decision),
        short(100.0 * overall.min_coverage),
        overall.outcome.text(),
    );
    let rows = variance.parts.iter().filter_map(|part| Some(verdict(part, part.verdict.as_ref()?)));
    let head = "<thead><tr><th>Part</th><th>From, mm</th><th>To, mm</th><th>Value, mm</th><th>Again, mm</th><th>Uncertainty, mm</th>\
        <th>Probability</th><th>Verdict</th></tr></thead>\n";
    table("Verdicts on parts", head, rows, out);
}

fn verdict(part: &PartStatistics, verdict: &Verdict) -> String {
    let conformance = part.statistics.tolerance.as_ref();
    let limits = conformance.and_then(|c| c.tolerance).map_or_else(Default::default, |t| [t.lower, t.upper].map(short));
    let figures = [verdict.value, verdict.again, verdict.uncertainty].map(number);
    let probability = [verdict.probability, verdict.highest_probability].map(number);
    let probability = if probability[0] == probability[1] { probability[0].clone() } else { probability.join(" to ") };
    let mut cells = vec![escape(&part.name)];
    cells.extend(limits.into_iter().chain(figures).chain([probability]));
    let cells: String = cells.iter().map(|cell| format!("<td>{cell}</td>")).collect();
    let text = std::iter::once(verdict.outcome.text().to_owned()).chain(verdict.reasons.iter().map(|r| escape(r)));
    let text = text.collect::<Vec<_>>().join(": ");
    let marked =
        if verdict.outcome == Outcome::Conforms { text } else { format!("<span class=\"mark\">{text}</span>") };
    format!("<tr>{cells}<td class=\"text\">{marked}</td></tr>\n")
}

/// The shares of the deviations that changes of parameters would explain.
fn explained(variance: &VarianceReport, out: &mut String) {
    let mut rows = variance.parts.iter().filter_map(|p| Some((&p.name, p.explained.as_ref()?))).peekable();
    if rows.peek().is_none() {
        return;
    }
    out.push_str(
        "<h3>Explained deviations</h3>\n<p class=\"convention\">The share of each part's mean square deviation that vanishes if its \
         parameters change, or if it moves as a whole; what remains of both is its form. Changes are those of one parameter alone.</p>\n",
    );
    let head = "<thead><tr><th>Part</th><th>RMS, mm</th><th>Parameters</th><th>Position</th><th>Form, mm</th>\
        <th colspan=\"6\">Parameters with the largest shares</th></tr></thead>\n";
    let parameter = |p: &ParameterEffect| {
        let (change, unit) =
            if p.unit == "rad" { (p.change.to_degrees(), "&deg;") } else { (p.change, p.unit.as_str()) };
        let change = if change > 0.0 { format!("+{}", number(change)) } else { number(change) };
        format!("<td class=\"text\">{} {change} {unit}</td><td>{:.1} %</td>", escape(&p.name), 100.0 * p.share)
    };
    let row = |(name, e): (&String, &Explanation)| {
        let (all, position) = (100.0 * e.all_parameters, 100.0 * e.position);
        let (name, rms, form) = (escape(name), number(e.rms), number(e.form));
        let parameters: String = e.parameters.iter().take(3).map(parameter).collect();
        format!(
            "<tr><td>{name}</td><td>{rms}</td><td>{all:.1} %</td><td>{position:.1} %</td><td>{form}</td>{parameters}</tr>\n"
        )
    };
    table("Shares of the deviations that changes explain", head, rows.map(row), out);
    sensitivities(variance, out);
}

/// Deviations of form.
fn forms(variance: &VarianceReport, out: &mut String) {
    let mut rows = variance.parts.iter().filter_map(|p| Some((&p.name, p.form.as_ref()?))).peekable();
    if rows.peek().is_none() {
        return;
    }
    out.push_str(
        "<h3>Form</h3>\n<p class=\"convention\">Between which surfaces of a part's form the measured points lie, wherever that fits best, \
         behind a Gaussian filter: about the surface of least squares, and at the narrowest. Noise widens a zone; beside it stands what noise \
         alone would give, and the width without what it adds, with its standard uncertainty. Outliers (points beyond four robust standard \
         deviations from the filtered surface about them) are left out. Roundness is that of the worst section, straightness that of the worst \
         line along the axis.</p>\n",
    );
    let head = "<thead><tr><th>Part</th><th>Characteristic</th><th>Least squares, mm</th><th>Minimum zone, mm</th><th>Noise alone, mm</th>\
        <th>Without noise, mm</th><th>Cut-off, mm</th><th>Left out</th></tr></thead>\n";
    let of_part = |(name, form): (&String, &FormDeviation)| {
        let (name, cutoff, left_out) = (escape(name), number(form.cutoff), 100.0 * form.left_out());
        let row = |c: Characteristic<'_>| {
            let [least_squares, minimum] = [c.least_squares, c.minimum_zone].map(number);
            let WithoutNoise { noise_alone, corrected, uncertainty } = c.without_noise;
            let limit = if c.lower_limit { "≥ " } else { "" };
            let [alone, corrected, uncertainty] = [noise_alone, corrected, uncertainty].map(number);
            format!(
                "<tr><td>{name}</td><td class=\"text\">{}</td><td>{least_squares}</td><td>{minimum}</td><td>{alone}</td>\
                 <td>{limit}{corrected} ± {uncertainty}</td><td>{cutoff}</td><td>{left_out:.2} %</td></tr>\n",
                escape(c.name)
            )
        };
        form.characteristics().map(row).collect::<String>()
    };
    table("Deviations of form", head, rows.map(of_part), out);
}

/// The part of the scan that is farther from the model than distances reach (millimetres).
fn left_over(unmatched: &UnmatchedSummary, max_distance: f64, out: &mut String) {
    let _ = writeln!(out, "<h3>Farther from the model than {} mm</h3>", number(max_distance));
    if unmatched.is_empty() {
        let _ = writeln!(
            out,
            "<p class=\"convention\">Distances reach as far. Nothing of the scan is farther away, or faces another way only.</p>"
        );
        return;
    }
    let _ = writeln!(
        out,
        "<p class=\"convention\">{} mm&sup2; of the scan ({:.2} %), in {} pieces: too far from the model, or facing another way. \
         They are in unmatched.ply. The largest:</p>",
        number(unmatched.area),
        100.0 * unmatched.share,
        unmatched.pieces
    );
    let head = "<thead><tr><th>Piece</th><th>Area, mm&sup2;</th><th>Triangles or points</th>\
        <th colspan=\"3\">Centre, mm</th><th colspan=\"3\">Size, mm</th></tr></thead>\n";
    let row = |(k, piece): (usize, &Piece)| {
        let size = piece.high.iter().zip(piece.low).map(|(high, low)| high - low);
        let mut cells = vec![k.to_string(), number(piece.area), (piece.triangles + piece.points).to_string()];
        cells.extend(piece.centre.into_iter().chain(size).map(number));
        row_of(&cells)
    };
    table("The largest pieces", head, unmatched.largest.iter().enumerate().map(row), out);
}
