//! What people read of deviations: tables, and which part is out of tolerance.

use crate::error::CommandError;
use crate::measure::UNMATCHED;
use crate::table;
use gml_runtime::variance::{PartStatistics, Statistics, Tolerance, UnmatchedSummary, VarianceReport, Zone};

/// The table that people read.
pub(crate) fn summary(report: &VarianceReport) -> String {
    let toleranced = report.overall.tolerance.is_some();
    let row = |name: &str, s: &Statistics| {
        let m = &s.weighted;
        vec![
            name.to_owned(),
            table::number(s.area),
            format!("{:.1} %", s.coverage * 100.0),
            table::number(m.mean),
            table::number(m.sd),
            table::number(m.signed.mean),
            table::number(m.rms),
            table::number(m.percentiles.p95),
            table::number(m.max),
        ]
        .into_iter()
        .chain(toleranced.then(|| s.tolerance.map_or("-".to_owned(), |c| format!("{:.2} %", 100.0 * c.share))))
        .collect()
    };
    let mut rows = vec![row("all", &report.overall)];
    rows.extend(report.parts.iter().map(|p| row(&p.name, &p.statistics)));
    let headings = ["part", "area mm2", "coverage", "mean", "sd", "signed mean", "rms", "95 %", "max"];
    let headings = if toleranced { [&headings[..], &["in tolerance"]].concat() } else { headings.to_vec() };
    let mut out = table::render(&headings, &rows);
    out.push_str(&format!(
        "distances in mm{}, at most {}; {}; found by {}\n",
        match report.distance.as_str() {
            "closest" => " to the closest point",
            "averaged-normal" => " along averaged normals",
            _ => "",
        },
        table::number(report.max_distance),
        report.sign_convention,
        report.device
    ));
    out.push_str(&explained(&report.parts));
    out.push_str(&forms(&report.parts));
    if let Some(holes) = &report.holes {
        out.push_str(&format!(
            "closed {} holes of the scan up to {} mm across ({} mm2, in filled.ply), left {} open edges; {} mm2 of the model look at closed holes\n",
            holes.filled,
            table::number(holes.size),
            table::number(holes.area),
            holes.open,
            table::number(report.overall.filled_area)
        ));
    }
    if let Some(unmatched) = &report.unmatched {
        out.push_str(&left_over(unmatched));
    }
    for w in &report.warnings {
        out.push_str(&format!("warning: {w}\n"));
    }
    out
}

/// How many pieces are named in the summary.
const NAMED: usize = 3;

/// A sentence about what of the scan the model does not explain, and a line for each of the largest pieces.
fn left_over(unmatched: &UnmatchedSummary) -> String {
    if unmatched.triangles == 0 {
        return "the model explains all of the scan\n".to_owned();
    }
    let (s, rest) = if unmatched.pieces == 1 { ("", "") } else { ("s", "; the largest:") };
    let mut out = format!(
        "not explained by the model: {} mm2 of the scan ({:.2} %) in {} piece{s}, in {UNMATCHED}{rest}\n",
        table::number(unmatched.area),
        100.0 * unmatched.share,
        unmatched.pieces,
    );
    for piece in unmatched.largest.iter().take(NAMED) {
        let [x, y, z] = piece.center.map(table::number);
        out.push_str(&format!("  {} mm2 around ({x}, {y}, {z})\n", table::number(piece.area)));
    }
    out
}

/// Shares below this are not worth a word.
const WORTH_A_WORD: f64 = 0.05;

/// For each part the parameters whose change would explain the most of its deviations, and what remains.
fn explained(parts: &[PartStatistics]) -> String {
    let mut rows = Vec::new();
    for (part, found) in parts.iter().filter_map(|p| Some((p, p.explained.as_ref()?))) {
        let worth = found.parameters.iter().filter(|p| p.share >= WORTH_A_WORD).take(NAMED);
        let effects: Vec<String> = worth
            .map(|p| {
                let (change, unit) =
                    if p.unit == "rad" { (p.change.to_degrees(), "deg") } else { (p.change, p.unit.as_str()) };
                format!("{} {}{}{unit} {:.0} %", p.name, sign(change), table::number(change.abs()), 100.0 * p.share)
            })
            .collect();
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        let effects = if effects.is_empty() { "-".to_owned() } else { effects.join(", ") };
        let [parameters, position] = [found.all_parameters, found.position].map(percent);
        let significant = part.detection.map_or_else(String::new, |d| percent(d.significant));
        let (rms, form) = (table::number(found.rms), table::number(found.form));
        rows.push(vec![part.name.clone(), significant, rms, parameters, position, form, effects]);
    }
    if rows.is_empty() {
        return String::new();
    }
    let headings = [
        "part",
        "significant",
        "rms",
        "parameters",
        "position",
        "form",
        "what a change of one parameter would explain",
    ];
    format!("\n{}", table::render(&headings, &rows))
}

/// How flat, round or cylindrical the parts are that have such a form.
fn forms(parts: &[PartStatistics]) -> String {
    let mut rows = Vec::new();
    for (part, form) in parts.iter().filter_map(|p| Some((p, p.form.as_ref()?))) {
        let zone = |f: &dyn Fn(&Zone) -> String| form.zone.as_ref().map_or("-".to_owned(), f);
        rows.push(vec![
            part.name.clone(),
            zone(&|z| z.characteristic.clone()),
            zone(&|z| table::number(z.least_squares)),
            zone(&|z| table::number(z.minimum_zone)),
            zone(&|z| format!("{:.2} %", 100.0 * z.outlying as f64 / (z.outlying + z.points).max(1) as f64)),
            form.roundness.map_or("-".to_owned(), |r| table::number(r.minimum_zone)),
        ]);
    }
    if rows.is_empty() {
        return String::new();
    }
    format!("\n{}", table::render(&["part", "form", "least squares", "minimum zone", "left out", "roundness"], &rows))
}

fn sign(x: f64) -> &'static str {
    if x < 0.0 { "-" } else { "+" }
}

/// An error where deviations exceed the tolerance: which part, on how much of its measured area, and how far.
pub(crate) fn judge(report: &VarianceReport) -> Result<(), CommandError> {
    let line = |part: &PartStatistics| {
        let conformance = part.statistics.tolerance.filter(|c| !c.within)?;
        let extremes = &part.statistics.per_texel.signed;
        let Tolerance { lower, upper } = conformance.tolerance?;
        let [least, greatest, lower, upper] = [extremes.min, extremes.max, lower, upper].map(table::number);
        Some(format!(
            "{}: {:.2} % of its measured area; {least} to {greatest} mm, where {lower} to {upper} mm are allowed",
            part.name,
            100.0 * (1.0 - conformance.share)
        ))
    };
    let lines: Vec<String> = report.parts.iter().filter_map(line).collect();
    if lines.is_empty() { Ok(()) } else { Err(CommandError::OutOfTolerance(lines)) }
}
