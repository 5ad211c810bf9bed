//! The page of many inspections.

use super::chart::{figure, run_chart, spread, with_interval};
use super::maps::{self, MapDocuments};
use super::{PARQUET, PopulationDocuments, SCANS, TABLE};
use crate::export::escape::escape;
use crate::export::folder::REPORT;
use crate::export::views::OVERVIEW;
use crate::population::{Capability, DIFFERENT, Index, Outcome, Quantities, Row, Series, Signal, Summary};
use crate::robust::median;
use std::fmt::Write;
use std::path::Path;

/// The most scans that the page lists, each with a picture; the tables have all.
const MOST_LISTED: usize = 2000;

/// The most values that the list of outlying ones has.
const MOST_OUTLYING: usize = 100;

/// The most correlations that the page lists.
const MOST_CORRELATIONS: usize = 30;

/// The page. Nothing in it is executed; all text is escaped; pictures and reports are files beside it.
pub(super) fn page(documents: &PopulationDocuments<'_>, maps: Option<&MapDocuments<'_>>, folder: &Path) -> String {
    let summary = documents.summary;
    let title = format!("{}: {} scans", summary.model, summary.scans);
    let name = |row: usize| documents.rows.get(row).map_or_else(String::new, |row| row.name.clone());
    let sections = [
        facts(summary, documents.origin),
        warnings(summary),
        outlying(summary, documents.rows, folder),
        map_section(maps, documents.rows),
        variation(summary),
        quantities(summary, &name),
        capabilities(summary),
        correlations(summary),
        parts(summary, &name),
        scans(documents.rows, folder),
    ];
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src * data:; style-src 'unsafe-inline'\">\n\
         <meta name=\"generator\" content=\"gmlc\">\n<title>{0}</title>\n<style>\n{1}{2}</style>\n</head>\n<body>\n\
         <header>\n<h1>{0}</h1>\n</header>\n<main>\n{3}</main>\n</body>\n</html>\n",
        escape(&title),
        include_str!("../report/style.css"),
        include_str!("style.css"),
        sections.concat()
    )
}

/// A section, or nothing where there is no content.
fn section(heading: &str, content: &str) -> String {
    if content.is_empty() { String::new() } else { format!("<section>\n<h2>{heading}</h2>\n{content}</section>\n") }
}

/// A table; the first cell of a row is its heading. Cells are HTML.
fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let head: String = head.iter().map(|cell| format!("<th scope=\"col\">{cell}</th>")).collect();
    let row = |cells: &Vec<String>| {
        let (first, rest) = cells.split_first().map_or(("", &[][..]), |(first, rest)| (first.as_str(), rest));
        let rest: String = rest.iter().map(|cell| format!("<td>{cell}</td>")).collect();
        format!("<tr><th scope=\"row\">{first}</th>{rest}</tr>\n")
    };
    let body: String = rows.iter().map(row).collect();
    format!("<div class=\"scroll\"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody></table></div>\n")
}

fn facts(summary: &Summary, origin: &str) -> String {
    let mut tiles = vec![
        (summary.scans.to_string(), "scans".to_owned()),
        (summary.inspected.to_string(), "fitted and measured".to_owned()),
        (summary.sound.to_string(), "fits that can be relied on".to_owned()),
    ];
    tiles.extend(summary.verdicts.iter().map(|(verdict, count)| (count.to_string(), escape(verdict))));
    let tiles: String = tiles
        .iter()
        .map(|(figure, what)| format!("<div class=\"tile\"><b>{figure}</b><span>{what}</span></div>\n"))
        .collect();
    format!(
        "<section>\n<div class=\"tiles\">\n{tiles}</div>\n<p class=\"convention\">{} All rows: <a href=\"{TABLE}\">{TABLE}</a>, \
         <a href=\"{PARQUET}\">{PARQUET}</a>. Intervals are of 95 %.</p>\n</section>\n",
        escape(origin)
    )
}

fn warnings(summary: &Summary) -> String {
    if summary.warnings.is_empty() {
        return String::new();
    }
    let items: String = summary.warnings.iter().map(|w| format!("<li>{}</li>\n", escape(w))).collect();
    format!("<section class=\"warnings\" role=\"note\"><b>Warnings</b><ul>\n{items}</ul></section>\n")
}

/// The factor to the unit that people read, and its name: angles in degrees.
fn unit(series: &Series) -> (f64, String) {
    match series.unit.as_str() {
        "rad" => (1f64.to_degrees(), "deg".to_owned()),
        unit => (1.0, unit.to_owned()),
    }
}

fn outlying(summary: &Summary, rows: &[Row], folder: &Path) -> String {
    let row = |o: &crate::population::Outlying| {
        let series = summary.series.iter().find(|s| s.name == o.quantity);
        let (factor, unit) = series.map_or((1.0, String::new()), unit);
        let quantity = escape(&o.quantity);
        vec![
            rows.get(o.row).map_or_else(String::new, |row| linked(row, folder)),
            quantity,
            format!("{} {unit}", figure(o.value * factor)),
            format!("{} {unit}", figure(o.median * factor)),
            format!("{:.1}", o.score),
        ]
    };
    let rows: Vec<Vec<String>> = summary.outlying.iter().take(MOST_OUTLYING).map(row).collect();
    if rows.is_empty() {
        return String::new();
    }
    let more = summary.outlying.len() - rows.len();
    let more = if more > 0 {
        format!("<p class=\"convention\">{more} more are in summary.json.</p>\n")
    } else {
        String::new()
    };
    let head = ["Scan", "Quantity", "Value", "Median of all", "Robust standard deviations"];
    section("Outlying parts", &(table(&head, &rows) + &more))
}

fn map_section(maps: Option<&MapDocuments<'_>>, rows: &[Row]) -> String {
    let Some(maps) = maps else { return String::new() };
    let of_part =
        |(name, [mean, rms, sd]): &(String, [f64; 3])| vec![escape(name), spread(*mean), spread(*rms), spread(*sd)];
    let parts: Vec<Vec<String>> = maps.parts.iter().filter(|(_, [mean, ..])| mean.is_finite()).map(of_part).collect();
    let objects = maps.objects;
    let mut noises: Vec<f64> = rows.iter().filter_map(|row| Some(row.sound()?.noise)).filter(|n| *n > 0.0).collect();
    let noise = median(&mut noises);
    let content = format!(
        "<p class=\"convention\">The deviations of {objects} objects at the same places of the surface. What all of them share, \
         as the trace of a worn tool does, is in the mean; what differs from one to the next is in the standard deviation, and \
         so is the noise of each scan{}. On {:.1} % of the surface the mean is clearly not zero (Student's t of the objects at \
         that place; by chance alone it would be {:.1} %).</p>\n\
         <p class=\"convention\">The sag of the scans' flat triangles between their points is not in these figures, but \
         where a triangle bridges an edge.</p>\n\
         <figure><img alt=\"The surface in the colours of the mean deviation\" src=\"{}\"><figcaption>Mean deviation; the \
         colours end at &plusmn;{} mm, red where material is in excess.</figcaption></figure>\n\
         <div class=\"textures\">\n\
         <figure><img alt=\"Mean deviation on the texture\" src=\"{}\"><figcaption>Mean deviation on the texture \
         (<a href=\"{}\">{}</a>)</figcaption></figure>\n\
         <figure><img alt=\"Standard deviation of the deviations on the texture\" src=\"{}\"><figcaption>Standard deviation \
         of all objects, noise of the scans included (<a href=\"{}\">{}</a>)</figcaption></figure>\n</div>\n{}",
        noise.map_or_else(String::new, |noise| format!(" (of single points {} mm)", spread(noise))),
        100.0 * maps.clear,
        100.0 * crate::population::BY_CHANCE,
        maps::VIEWS,
        figure(maps.end()),
        maps::MEAN[0],
        maps::MEAN[1],
        maps::MEAN[1],
        maps::SD[0],
        maps::SD[1],
        maps::SD[1],
        table(&["Part", "Mean of the map, mm", "Root mean square of the map, mm", "SD with noise, mm"], &parts)
    );
    section("Deviations that the objects share", &content)
}

fn variation(summary: &Summary) -> String {
    let Some(variation) = &summary.variation else { return String::new() };
    let row = |c: &crate::population::Contribution| {
        let series = summary.series.iter().find(|s| s.name == c.name);
        let (factor, unit) = series.map_or((1.0, String::new()), unit);
        vec![
            escape(&c.name),
            format!("{} {unit}", spread(c.between * factor)),
            spread(c.movement),
            format!("{:.1} %", 100.0 * c.share),
            format!("{} {unit}", spread(c.principal * factor)),
        ]
    };
    let rows: Vec<Vec<String>> = variation.contributions.iter().map(row).collect();
    let first = variation.contributions.first().map_or_else(String::new, |c| escape(&c.name));
    let content = format!(
        "<p class=\"convention\">Most of what differs between {} objects is by <b>{first}</b>. The surface moves by {} mm (root \
         mean square, along its normal) as the parameters vary together, without the uncertainty of measurement; {:.0} % of its \
         square is along one direction, the last column. Parameters are here only if the scans show that objects differ in \
         them (p below {DIFFERENT}).</p>\n{}",
        variation.count,
        spread(variation.movement),
        100.0 * variation.principal_share,
        table(
            &["Parameter", "SD between objects", "Movement of the surface, mm", "Share", "Along the main direction"],
            &rows
        )
    );
    section("Which parameters vary", &content)
}

fn interval([low, high]: [f64; 2], factor: f64) -> String {
    format!("{} to {}", figure(low * factor), figure(high * factor))
}

fn quantities(summary: &Summary, name: &dyn Fn(usize) -> String) -> String {
    let series: Vec<&Series> = summary.series.iter().filter(|s| s.of != Quantities::Part).collect();
    let row = |s: &&Series| {
        let (factor, unit) = unit(s);
        let cells = s.effects.map_or_else(
            || {
                vec![
                    s.chart.as_ref().map_or_else(|| "-".to_owned(), |c| figure(c.centre * factor)),
                    "-".into(),
                    "-".into(),
                    "-".into(),
                    "-".into(),
                    "-".into(),
                ]
            },
            |e| {
                let [mean, of_mean] = with_interval(e.mean * factor, e.mean_interval.map(|x| x * factor));
                let [between, of_between] = with_interval(e.between * factor, e.between_interval.map(|x| x * factor));
                vec![
                    mean,
                    of_mean,
                    between,
                    of_between,
                    spread(e.measurement * factor),
                    if e.p_equal < 1e-6 { "below 1e-6".to_owned() } else { format!("{:.2e}", e.p_equal) },
                ]
            },
        );
        let heading = if unit.is_empty() { escape(&s.name) } else { format!("{} ({unit})", escape(&s.name)) };
        [vec![heading, s.values.len().to_string()], cells].concat()
    };
    let rows: Vec<Vec<String>> = series.iter().map(row).collect();
    if rows.is_empty() {
        return String::new();
    }
    let head = [
        "Quantity",
        "Scans",
        "Mean",
        "its interval",
        "SD between objects",
        "its interval",
        "SD of measurement",
        "p if all were equal",
    ];
    let charts: String = series.iter().map(|s| chart(s, name)).collect();
    let hint = "<p class=\"convention\">The standard deviation between objects is without that of measurement (random effects, \
                restricted maximum likelihood). The interval of the mean holds what the errors of all fits may have in common, \
                which is not averaged out: what they have beyond the noise of single points, and the scanner's uncertainty where it is \
                given. In the charts bars are two standard deviations of measurement, limits three \
                standard deviations by moving ranges, and rings what a process without special causes hardly shows.</p>\n";
    section("Parameters and measures", &(table(&head, &rows) + hint + &charts))
}

/// A heading, the chart, and what to mind.
fn chart(series: &Series, name: &dyn Fn(usize) -> String) -> String {
    let (factor, unit) = unit(series);
    let unit = if unit.is_empty() { String::new() } else { format!(", {unit}") };
    let mut notes: Vec<String> = series.notes.clone();
    if let Some(chart) = series.chart.as_ref() {
        if chart.few {
            notes.push(format!("the control limits are of only {} values", series.values.len()));
        }
        let signals = chart.signals.len();
        if signals > 0 {
            let said = |s: &Signal| format!("{} ({})", name(series.rows[s.at]), s.reason);
            let names: Vec<String> = chart.signals.iter().take(5).map(said).collect();
            let more = if signals > 5 { format!(", and {} more", signals - 5) } else { String::new() };
            notes.push(format!("not in control: {}{more}", names.join(", ")));
        }
    }
    let notes: String = notes.iter().map(|note| format!("<p class=\"convention\">{}</p>\n", escape(note))).collect();
    format!("<h3>{}{unit}</h3>\n{}{notes}", escape(&series.name), run_chart(series, name, factor))
}

fn capabilities(summary: &Summary) -> String {
    let of = |s: &Series| {
        let capability = s.capability.as_ref()?;
        let (factor, unit) = unit(s);
        Some(capability_row(s, capability, factor, &unit))
    };
    let rows: Vec<Vec<String>> = summary.series.iter().filter_map(of).collect();
    if rows.is_empty() {
        return String::new();
    }
    let notes: String = summary
        .series
        .iter()
        .filter_map(|s| Some((s, s.capability.as_ref()?)))
        .flat_map(|(s, c)| c.notes.iter().map(|note| format!("<li>{}: {}</li>\n", escape(&s.name), escape(note))))
        .collect();
    let notes = if notes.is_empty() { String::new() } else { format!("<ul class=\"convention\">\n{notes}</ul>\n") };
    let head = ["Measure", "Allowed", "Scans", "Beyond", "Cp", "Cpk", "Pp", "Ppk", "p if normal"];
    section("Capability", &(table(&head, &rows) + &notes))
}

fn capability_row(series: &Series, capability: &Capability, factor: f64, unit: &str) -> Vec<String> {
    let index = |index: &Index| format!("{:.2} ({:.2} to {:.2})", index.value, index.interval[0], index.interval[1]);
    let some = |i: &Option<Index>| i.as_ref().map_or_else(|| "-".to_owned(), index);
    vec![
        escape(&series.name),
        format!("{} {unit}", interval([capability.limits.lower, capability.limits.upper], factor)),
        capability.count.to_string(),
        capability.beyond.to_string(),
        some(&capability.cp),
        some(&capability.cpk),
        index(&capability.pp),
        index(&capability.ppk),
        capability.normality.map_or_else(|| "-".to_owned(), |test| format!("{:.3}", test.p)),
    ]
}

fn correlations(summary: &Summary) -> String {
    let known = |r: Option<f64>| r.map_or_else(|| "-".to_owned(), |r| format!("{r:+.2}"));
    let row = |c: &crate::population::Correlation| {
        vec![
            format!("{}, {}", escape(&c.names[0]), escape(&c.names[1])),
            format!("{:+.2}", c.r),
            format!("{:+.2} to {:+.2}", c.interval[0], c.interval[1]),
            known(c.of_errors),
            known(c.between),
            c.count.to_string(),
        ]
    };
    let clear = summary.correlations.iter().filter(|c| c.is_clear());
    let rows: Vec<Vec<String>> = clear.clone().take(MOST_CORRELATIONS).map(row).collect();
    if rows.is_empty() {
        return String::new();
    }
    let pairs = summary.correlations.len();
    let content = format!(
        "<p class=\"convention\">Of {pairs} pairs {} have an interval without zero; by chance alone about {:.0} would. Where \
         values vary by little more than their errors, they correlate as the errors do. Between objects r is given where \
         these differ in both (p below {DIFFERENT}). Of quantities that are the same but for a factor, one is here.</p>\n{}",
        clear.count(),
        0.05 * pairs as f64,
        table(&["Pair", "r", "its interval", "r of the errors", "r between objects", "Scans"], &rows)
    );
    section("Correlations", &content)
}

fn parts(summary: &Summary, name: &dyn Fn(usize) -> String) -> String {
    let charts: String = summary.of_kind(Quantities::Part).map(|s| chart(s, name)).collect();
    if charts.is_empty() {
        return String::new();
    }
    section("Deviations by part", &format!("<details><summary>Run charts</summary>\n{charts}</details>\n"))
}

/// The name of a scan, with a link to its report if it has one.
fn linked(row: &Row, folder: &Path) -> String {
    let name = escape(&row.name);
    if has(row, REPORT, folder) { format!("<a href=\"{SCANS}/{0}/{REPORT}\">{name}</a>", address(&name)) } else { name }
}

/// Whether a scan has a file among its results.
fn has(row: &Row, file: &str, folder: &Path) -> bool {
    folder.join(SCANS).join(&row.name).join(file).is_file()
}

/// A name in an address.
fn address(name: &str) -> String {
    name.replace('%', "%25").replace('#', "%23").replace('?', "%3F").replace(' ', "%20")
}

fn scans(rows: &[Row], folder: &Path) -> String {
    let failed = |row: &Row| row.failure().is_some();
    let card = |row: &Row| {
        let picture = if has(row, OVERVIEW, folder) {
            let name = address(&escape(&row.name));
            format!("<img loading=\"lazy\" alt=\"\" src=\"{SCANS}/{name}/{OVERVIEW}\">")
        } else {
            String::new()
        };
        let name = linked(row, folder);
        let said = match &row.outcome {
            Outcome::Failed { reason } => format!("<span class=\"failure\">{}</span>", escape(reason)),
            Outcome::Copy { of } => format!("the same file as {}", escape(of)),
            Outcome::Inspected(inspected) => {
                let verdict = inspected.verdict.as_deref().map(escape).unwrap_or_default();
                let doubt = inspected.shortcoming.as_deref();
                let doubt = doubt.map(|d| format!("<span class=\"failure\">{}</span>", escape(d))).unwrap_or_default();
                let warnings = match inspected.warnings.len() {
                    0 => String::new(),
                    1 => "1 warning".to_owned(),
                    n => format!("{n} warnings"),
                };
                [verdict, doubt, warnings].into_iter().filter(|s| !s.is_empty()).collect::<Vec<_>>().join("; ")
            }
        };
        format!("<figure class=\"card\">{picture}<figcaption>{name}<br>{said}</figcaption></figure>\n")
    };
    // What has no result comes first: nobody looks for it.
    let ordered = rows.iter().filter(|row| failed(row)).chain(rows.iter().filter(|row| !failed(row)));
    let cards: String = ordered.take(MOST_LISTED).map(card).collect();
    let more = rows.len().saturating_sub(MOST_LISTED);
    let mut content = format!("<div class=\"cards\">\n{cards}</div>\n");
    if more > 0 {
        let _ = writeln!(content, "<p class=\"convention\">{more} more scans are in the tables.</p>");
    }
    section("Scans", &content)
}
