//! Deviations for people: tables, and the verdicts on parts with tolerances.

use crate::error::CommandError;
use crate::{dimensions, table};
use gml_runtime::export::measurement::UNMATCHED;
use gml_runtime::variance::{
    Agreement, DatumRelations, LimitsBasis, Outcome, PartStatistics, PointDistances, PointStatistics, Relation,
    Statistics, Tolerance, UnmatchedSummary, VarianceReport, Verdict, WithoutNoise,
};

/// The tables and sentences of a report.
pub(crate) fn summary(report: &VarianceReport) -> String {
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
    };
    let mut rows = vec![row("all", &report.overall)];
    rows.extend(report.parts_with_surface().map(|p| row(&p.name, &p.statistics)));
    let headings =
        ["part", "area mm2", "coverage", "mean mm", "sd mm", "signed mean mm", "rms mm", "95 % mm", "max mm"];
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
    if let Some(cylinder) = &report.cylinder {
        out.push_str(&format!("{}\n", cylinder.sentence(table::number)));
    }
    if let Some(sag) = report.sag_sentence(table::number) {
        out.push_str(&format!("{sag}\n"));
    }
    out.push_str(&agreement(report));
    out.push_str(&report.points.as_ref().map_or_else(String::new, |points| at_points(report, points)));
    out.push_str(&verdicts(report));
    out.push_str(&dimensions::verdicts(report));
    if let Some(overall) = &report.verdict {
        out.push_str(&format!("decision rule {}\n", overall.decision));
    }
    out.push_str(&dimensions::by_points(report));
    out.push_str(&explained(&report.parts));
    out.push_str(&forms(&report.parts));
    out.push_str(&report.datum.as_ref().map_or_else(String::new, relations));
    if let Some(holes) = &report.holes {
        out.push_str(&format!(
            "closed {} hole{} of the scan up to {} mm across ({} mm2, in filled.ply), left {} rims open; {} mm2 of the model look at closed holes\n",
            holes.filled,
            if holes.filled == 1 { "" } else { "s" },
            table::number(holes.size),
            table::number(holes.area),
            holes.open,
            table::number(report.overall.filled_area)
        ));
    }
    let buried = by_part(report, |s| s.buried_area);
    if !buried.is_empty() {
        out.push_str(&format!("inside of the model's own material, and no part of these areas: {buried}\n"));
    }
    let contradicted = by_part(report, |s| s.contradicted_area);
    if !contradicted.is_empty() {
        out.push_str(&format!("without data, and where the scan shows empty space: {contradicted}\n"));
    }
    let ambiguous = by_part(report, |s| s.ambiguous_area);
    if !ambiguous.is_empty() {
        out.push_str(&format!("without data, since what the rays meet belongs elsewhere: {ambiguous}\n"));
    }
    if report.spikes > 0 {
        out.push_str(&format!(
            "spikes of the scan, single vertices far from all neighbours, to which no distance is taken: {}\n",
            report.spikes
        ));
    }
    if let Some(unmatched) = &report.unmatched {
        out.push_str(&left_over(unmatched, report.max_distance));
    }
    for w in &report.warnings {
        out.push_str(&format!("warning: {w}\n"));
    }
    out
}

/// A table of the areas within the limits, over and under them, and the sentence on all of them; with the widths of
/// texels, below which nothing shows.
fn agreement(report: &VarianceReport) -> String {
    let row = |name: &str, s: &Statistics| {
        let Agreement { limits, within, over, under } = s.agreement?;
        let limits = limits.map_or_else(String::new, |l| {
            let by = if l.basis == LimitsBasis::Tolerance { "tolerance" } else { "noise" };
            format!("{} to {} ({by})", table::number(l.lower), table::number(l.upper))
        });
        let shares = [within, over, under].map(|p| (table::number(p.area), format!("{:.1} %", 100.0 * p.share)));
        let measured = s.measured_area > 0.0;
        let shares = shares.into_iter().flat_map(|(area, share)| [area, if measured { share } else { "-".into() }]);
        Some([name.to_owned(), limits].into_iter().chain(shares).collect())
    };
    let mut rows: Vec<Vec<String>> = row("all", &report.overall).into_iter().collect();
    rows.extend(report.parts_with_surface().filter_map(|part| row(&part.name, &part.statistics)));
    let headings = ["part", "limits mm", "within mm2", "", "over mm2", "", "under mm2", ""];
    let sentence = report.agreement_sentence(table::number).map_or_else(String::new, |said| format!("{said}\n"));
    format!("\n{}{sentence}{}", table::render(&headings, &rows), texels(report))
}

/// How wide the texels are, and where they are the widest.
fn texels(report: &VarianceReport) -> String {
    let Some(all) = report.overall.texel_widths else { return String::new() };
    let widest = report.parts.iter().filter_map(|part| Some((&part.name, part.statistics.texel_widths?.max)));
    let widest = widest.max_by(|a, b| a.1.total_cmp(&b.1)).map_or_else(String::new, |(name, _)| format!(" ({name})"));
    let [mean, p5, p95, max, side] = [report.texel, all.p5, all.p95, all.max, all.longest_side].map(table::number);
    format!(
        "texels are {mean} mm wide on the average, {p5} to {p95} mm on nine tenths of the surface, {max} mm at most{widest}; \
         no side is longer than {side} mm\n"
    )
}

/// A table of the distances of the scan's points from the surface, and the numbers of those that have none.
fn at_points(report: &VarianceReport, points: &PointDistances) -> String {
    let row = |name: &str, s: &PointStatistics| {
        let m = &s.moments;
        let place = s.largest.as_ref().map_or_else(String::new, |l| {
            let [x, y, z] = l.place.map(table::coordinate);
            format!("({x}, {y}, {z})")
        });
        let largest = s.largest.as_ref().map_or(f64::NAN, |l| l.distance);
        let figures = [m.signed.mean, m.signed.sd, m.rms, m.signed.median, m.percentiles.p95, largest];
        let cells = figures.map(table::number);
        [name.to_owned(), s.measured.to_string()].into_iter().chain(cells).chain([place]).collect()
    };
    let mut rows: Vec<Vec<String>> = vec![row("all", &points.overall)];
    let there = points.parts.iter().zip(&report.parts).filter(|(_, part)| part.statistics.is_of_something());
    rows.extend(there.map(|(part, _)| row(&part.name, &part.statistics)));
    let headings =
        ["part", "points", "signed mean mm", "sd mm", "rms mm", "median mm", "95 % mm", "largest mm", "at mm"];
    format!(
        "\n{}the scan's points from the exact surface: {:.1} % of {} have a distance, {} are farther than {} mm, {} only \
         beside surface that faces another way\n",
        table::render(&headings, &rows),
        100.0 * points.share,
        points.points,
        points.beyond,
        table::number(report.max_distance),
        points.facing_away,
    )
}

/// The number of pieces, or of parameters, that the summary lists.
const LISTED: usize = 3;

/// An area of the model, with its first parts that have it; nothing if none has.
fn by_part(report: &VarianceReport, area: impl Fn(&Statistics) -> f64) -> String {
    let parts = report.parts.iter().map(|part| (&part.name, area(&part.statistics))).filter(|(_, area)| *area > 0.0);
    let mut parts: Vec<String> = parts.map(|(name, area)| format!("{name} {}", table::number(area))).collect();
    if parts.is_empty() {
        return String::new();
    }
    if parts.len() > LISTED {
        parts.splice(LISTED.., ["...".to_owned()]);
    }
    format!("{} mm2 ({})", table::number(area(&report.overall)), parts.join(", "))
}

/// A sentence about the part of the scan that is farther from the model than distances reach (millimetres), and a line
/// for each of the largest pieces.
fn left_over(unmatched: &UnmatchedSummary, max_distance: f64) -> String {
    if unmatched.is_empty() {
        return format!(
            "farther than {} mm from the model, or facing another way: nothing of the scan\n",
            table::number(max_distance)
        );
    }
    let (s, rest) = if unmatched.pieces == 1 { ("", "") } else { ("s", "; the largest:") };
    let mut out = format!(
        "farther than {} mm from the model, or facing another way: {} mm2 of the scan ({:.2} %) in {} piece{s}, in {UNMATCHED}{rest}\n",
        table::number(max_distance),
        table::number(unmatched.area),
        100.0 * unmatched.share,
        unmatched.pieces,
    );
    for piece in unmatched.largest.iter().take(LISTED) {
        let [x, y, z] = piece.centre.map(table::coordinate);
        out.push_str(&format!("  {} mm2 around ({x}, {y}, {z})\n", table::number(piece.area)));
    }
    out
}

/// Smaller shares are not listed.
const LEAST_SHARE: f64 = 0.05;

/// For each part the parameters whose change would explain the most of its deviations, and the deviation of form.
fn explained(parts: &[PartStatistics]) -> String {
    let mut rows = Vec::new();
    for (part, explained) in parts.iter().filter_map(|p| Some((p, p.explained.as_ref()?))) {
        let listed = explained.parameters.iter().filter(|p| p.share >= LEAST_SHARE).take(LISTED);
        let effects: Vec<String> = listed
            .map(|p| {
                let (change, unit) =
                    if p.unit == "rad" { (p.change.to_degrees(), "deg") } else { (p.change, p.unit.as_str()) };
                format!("{} {}{}{unit} {:.0} %", p.name, sign(change), table::number(change.abs()), 100.0 * p.share)
            })
            .collect();
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        let effects = if effects.is_empty() { "-".to_owned() } else { effects.join(", ") };
        let [parameters, position] = [explained.all_parameters, explained.position].map(percent);
        let [level, significant] =
            part.detection.map_or_else(Default::default, |d| [table::number(d.level), percent(d.significant)]);
        let (rms, form) = (table::number(explained.rms), table::number(explained.form));
        rows.push(vec![part.name.clone(), level, significant, rms, parameters, position, form, effects]);
    }
    if rows.is_empty() {
        return String::new();
    }
    let headings = [
        "part",
        "level mm",
        "beyond it",
        "rms mm",
        "parameters",
        "position",
        "form mm",
        "what a change of one parameter would explain",
    ];
    format!("\n{}", table::render(&headings, &rows))
}

/// Deviations of form of the parts that are planes, spheres, cylinders, cones or surfaces of revolution.
fn forms(parts: &[PartStatistics]) -> String {
    let mut rows = Vec::new();
    for (part, form) in parts.iter().filter_map(|p| Some((p, p.form.as_ref()?))) {
        rows.extend(form.characteristics().map(|c| {
            let WithoutNoise { noise_alone, corrected, uncertainty } = c.without_noise;
            vec![
                part.name.clone(),
                c.name.to_owned(),
                table::number(c.minimum_zone),
                table::number(noise_alone),
                format!(
                    "{}{} +- {}",
                    if c.lower_limit { ">= " } else { "" },
                    table::number(corrected),
                    table::number(uncertainty)
                ),
                table::number(form.cutoff),
                format!("{:.2} %", 100.0 * form.left_out()),
            ]
        }));
    }
    if rows.is_empty() {
        return String::new();
    }
    let headings = ["part", "form", "minimum zone mm", "noise alone mm", "without noise mm", "cut-off mm", "left out"];
    format!("\n{}", table::render(&headings, &rows))
}

/// How the parts lie to the datum.
fn relations(datum: &DatumRelations) -> String {
    let row = |r: &Relation| {
        let WithoutNoise { noise_alone, corrected, uncertainty } = r.without_noise;
        let [x, y, z] = r.place.map(table::coordinate);
        let mut cells = vec![r.part.clone(), r.characteristic.clone()];
        cells.extend([r.model, r.value, noise_alone].map(table::number));
        cells.extend([
            format!("{} +- {}", table::number(corrected), table::number(uncertainty)),
            format!("({x}, {y}, {z})"),
        ]);
        cells
    };
    let mut out = String::new();
    if !datum.relations.is_empty() {
        let to = format!("to {}", datum.part);
        let headings = ["part", &to, "model mm", "by points mm", "noise alone mm", "without noise mm", "at mm"];
        let rows: Vec<Vec<String>> = datum.relations.iter().map(row).collect();
        out.push_str(&format!("\n{}", table::render(&headings, &rows)));
    }
    if datum.relations.is_empty() && datum.unmeasured.is_empty() {
        out.push_str(&format!("no other part has a form that {} could be the datum of\n", datum.part));
    }
    if !datum.unmeasured.is_empty() {
        out.push_str(&format!(
            "too little was measured for a place to {}: {}\n",
            datum.part,
            datum.unmeasured.join(", ")
        ));
    }
    out
}

fn sign(x: f64) -> &'static str {
    if x < 0.0 { "-" } else { "+" }
}

/// The verdicts on parts with a tolerance.
fn verdicts(report: &VarianceReport) -> String {
    let row = |part: &PartStatistics| {
        let verdict = part.verdict.as_ref()?;
        let Tolerance { lower, upper } = part.statistics.tolerance?.tolerance?;
        let mut cells = vec![part.name.clone(), format!("{} to {}", table::number(lower), table::number(upper))];
        let uncertainty = Some(verdict.uncertainty);
        cells.extend([verdict.value, verdict.again, verdict.uncertainty].map(|x| table::rounded(x, uncertainty)));
        cells.extend([probability(verdict), verdict.outcome.text().to_owned()]);
        Some(cells)
    };
    let rows: Vec<Vec<String>> = report.parts.iter().filter_map(row).collect();
    if rows.is_empty() {
        return String::new();
    }
    let headings = ["part", "allowed mm", "value mm", "again mm", "uncertainty mm", "probability", "verdict"];
    format!(
        "\n{}the value is the median deviation on the worst footprint, again what a second measurement would show there\n",
        table::render(&headings, &rows)
    )
}

/// The probability of conformance: one number, or from the least to the greatest.
fn probability(verdict: &Verdict) -> String {
    if verdict.probability.is_nan() {
        return "-".to_owned();
    }
    let [least, greatest] = [verdict.probability, verdict.highest_probability].map(|p| format!("{p:.3}"));
    if least == greatest { least } else { format!("{least} to {greatest}") }
}

/// An error if a part or a measure does not conform to its tolerance, or if that is undecided: which one, how far, and
/// where.
pub(crate) fn judge(report: &VarianceReport) -> Result<(), CommandError> {
    let line = |part: &PartStatistics| {
        let verdict = part.verdict.as_ref().filter(|v| v.outcome != Outcome::Conforms)?;
        let Tolerance { lower, upper } = part.statistics.tolerance?.tolerance?;
        let [value, uncertainty] =
            [verdict.value, verdict.uncertainty].map(|x| table::rounded(x, Some(verdict.uncertainty)));
        let [lower, upper] = [lower, upper].map(table::number);
        let [x, y, z] = verdict.place.map(table::number);
        let measured = format!(
            "{value} mm (standard uncertainty {uncertainty} mm) on {} mm2 around ({x}, {y}, {z}), allowed are {lower} to {upper} mm",
            table::number(verdict.footprint)
        );
        let measured = (verdict.footprints > 0).then_some(measured);
        let said: Vec<String> = measured.into_iter().chain(verdict.reasons.iter().cloned()).collect();
        Some(format!("{}: {}: {}", verdict.outcome.text(), part.name, said.join("; ")))
    };
    let lines: Vec<String> = report.parts.iter().filter_map(line).chain(dimensions::lines(report)).collect();
    match report.verdict.as_ref().map(|v| v.outcome) {
        Some(Outcome::DoesNotConform) => Err(CommandError::DoesNotConform(lines)),
        Some(Outcome::Undecided) => Err(CommandError::Undecided(lines)),
        Some(Outcome::Conforms) | None => Ok(()),
    }
}
