//! A comparison for people.

use super::operand::Named;
use crate::table;
use gml_runtime::compare::{
    Body, Comparison, Contribution, Difference, DifferenceStatistics, NoVolume, ParameterDifference,
};
use gml_runtime::variance::LargestDistance;

/// Parameters and parts that a line lists.
const LISTED: usize = 3;

/// Smaller movements, as shares of the distances, are not listed.
const LEAST_SHARE: f64 = 0.05;

/// Distances below this are rounding: of coordinates of a metre in double precision they have 1e-13 mm. Millimetres.
const ROUNDING: f64 = 1e-9;

/// The tables and sentences of a comparison.
pub(super) fn summary(operands: &[Named<'_>; 2], comparison: &Comparison) -> String {
    let mut out = String::new();
    for (name, operand) in ["A", "B"].iter().zip(operands) {
        let model = operand.model.map_or_else(String::new, |model| format!(" (model {model})"));
        let scan = operand.scan.map_or_else(String::new, |scan| format!(", fitted to {scan}"));
        out.push_str(&format!("{name}: {} {}{model}{scan}\n", operand.kind, operand.path));
    }
    out.push_str(&format!("\n{}", bodies(&comparison.a, &comparison.b)));
    out.push_str(&format!("\n{}", distances("A", &comparison.a_to_b)));
    out.push_str(&format!("\n{}", distances("B", &comparison.b_to_a)));
    let [a, b] = comparison.spacing.map(table::number);
    out.push_str(&format!(
        "distances in mm to the nearest place that faces the same way, at most {}; {}; samples are {a} and {b} mm apart\n",
        table::number(comparison.max_distance),
        comparison.sign_convention,
    ));
    out.push_str(&format!("Hausdorff distance {} mm: ", table::number(comparison.hausdorff)));
    let [a, b] = [&comparison.a_to_b.hausdorff, &comparison.b_to_a.hausdorff].map(farthest);
    out.push_str(&format!("from A to B {a}, from B to A {b}\n"));
    out.push_str(&parameters(comparison, operands.iter().any(|operand| operand.scan.is_some())));
    out.push_str(&explained(comparison));
    for warning in &comparison.warnings {
        out.push_str(&format!("warning: {warning}\n"));
    }
    out
}

fn farthest(largest: &LargestDistance) -> String {
    format!("{} on {} {}", table::number(largest.distance), largest.part, place(&largest.place))
}

/// A length in millimetres without what is only rounding.
fn length(value: f64) -> String {
    table::number(if value.abs() < ROUNDING { 0.0 } else { value })
}

fn place(place: &[f64; 3]) -> String {
    let [x, y, z] = place.map(length);
    format!("({x}, {y}, {z})")
}

fn bodies(a: &Body, b: &Body) -> String {
    let row = |name: &str, body: &Body| {
        let volume = body.volume.map_or_else(
            || body.without_volume.map_or("", NoVolume::text).to_owned(),
            |volume| table::number(volume / 1000.0),
        );
        let size = [0, 1, 2].map(|k| table::number(body.high[k] - body.low[k])).join(" x ");
        vec![name.to_owned(), size, table::number(body.area), volume]
    };
    let mut rows = vec![row("A", a), row("B", b)];
    let relative = |a: f64, b: f64| format!("{:+.4} %", 100.0 * (b / a - 1.0));
    if let (Some(first), Some(second)) = (a.volume, b.volume) {
        rows.push(vec!["B / A - 1".to_owned(), String::new(), relative(a.area, b.area), relative(first, second)]);
    }
    table::render(&["", "size mm", "area mm2", "volume cm3"], &rows)
}

/// The distances from the surface that is called so.
fn distances(name: &str, difference: &Difference) -> String {
    let row = |name: &str, s: &DifferenceStatistics| {
        let (area, m, largest) = (s.area, &s.moments, s.largest.as_ref());
        let share = if area > 0.0 { format!("{:.1} %", 100.0 * s.matched_area / area) } else { "-".to_owned() };
        let figures = [m.signed.mean, m.signed.sd, m.rms, m.percentiles.p95];
        let mut cells = vec![name.to_owned(), table::number(area), share];
        cells.extend(figures.map(length));
        cells.push(length(largest.map_or(f64::NAN, |l| l.distance)));
        cells.push(largest.map_or_else(String::new, |l| place(&l.place)));
        cells
    };
    let mut rows = vec![row("all", &difference.overall)];
    rows.extend(difference.parts.iter().map(|part| row(&part.name, &part.statistics)));
    let other = if name == "A" { "B" } else { "A" };
    let heading = format!("from {name} to {other}");
    let headings =
        [&*heading, "area mm2", "matched", "signed mean mm", "sd mm", "rms mm", "95 % mm", "largest mm", "at mm"];
    table::render(&headings, &rows)
}

/// The parameters of both, with the test of all of them; why one has no standard deviation only if something was
/// fitted.
fn parameters(comparison: &Comparison, is_fitted: bool) -> String {
    let mut out = String::new();
    let row = |p: &ParameterDifference| {
        let sd = p.sd.map(|sd| p.quantity.written(sd).0);
        let shown = |value: f64| table::rounded(p.quantity.written(value).0, sd);
        let verdict = match (p.significant, &p.without_sd) {
            (Some(true), _) => "differs".to_owned(),
            (Some(false), _) => "alike".to_owned(),
            (None, Some(reason)) if is_fitted => format!("no sd: {reason}"),
            (None, _) => String::new(),
        };
        let mut cells = vec![p.name.clone(), p.quantity.written(0.0).1.to_owned()];
        cells.extend([p.a, p.b, p.difference].map(shown));
        cells.push(p.sd.map_or_else(String::new, shown));
        cells.extend([p.z.map_or_else(String::new, |z| format!("{z:.2}")), probability(p.p), verdict]);
        cells
    };
    if !comparison.parameters.is_empty() {
        let headings = ["parameter", "unit", "A", "B", "B - A", "sd", "z", "p", ""];
        let rows: Vec<Vec<String>> = comparison.parameters.iter().map(row).collect();
        out.push_str(&format!("\n{}", table::render(&headings, &rows)));
    }
    if let Some(test) = &comparison.together {
        out.push_str(&format!(
            "all {} with standard deviations together: chi-squared {:.2}, p {}\n",
            test.degrees,
            test.statistic,
            probability(Some(test.p))
        ));
    }
    for (name, only) in [("A", &comparison.only_a), ("B", &comparison.only_b)] {
        if !only.is_empty() {
            out.push_str(&format!("only {name} has {}\n", only.join(", ")));
        }
    }
    out
}

fn probability(p: Option<f64>) -> String {
    p.map_or_else(String::new, |p| match p {
        p if p < 1e-300 => "< 1e-300".to_owned(),
        p if p < 5e-4 => format!("{p:.1e}"),
        p => format!("{p:.3}"),
    })
}

/// What the differences of the parameters explain.
fn explained(comparison: &Comparison) -> String {
    let Some(all) = &comparison.explained else { return String::new() };
    let effects = |parameters: &[Contribution], rms: f64| {
        let known = parameters.iter().filter_map(|p| Some((p, p.share?)));
        let known = known.filter(|(p, share)| share.abs() > LEAST_SHARE || p.movement > LEAST_SHARE * rms);
        let mut listed: Vec<String> = known
            .take(LISTED)
            .map(|(p, share)| {
                format!("{} {:.1} % (moves it by {} mm)", p.name, 100.0 * share, table::number(p.movement))
            })
            .collect();
        let bent = parameters.iter().filter(|p| p.share.is_none() && p.movement > LEAST_SHARE * rms);
        listed.extend(bent.map(|p| format!("{} is not linear", p.name)));
        listed.join(", ")
    };
    let percent = |share: Option<f64>| share.map_or_else(|| "-".to_owned(), |share| format!("{:.1} %", 100.0 * share));
    let row = |name: &str, rms: f64, remaining: f64, share: Option<f64>, parameters: &[Contribution]| {
        vec![name.to_owned(), table::number(rms), percent(share), table::number(remaining), effects(parameters, rms)]
    };
    let mut rows = vec![row("all", all.rms, all.remaining, Some(all.share), &all.parameters)];
    rows.extend(all.parts.iter().map(|p| row(&p.name, p.rms, p.remaining, p.share, &p.parameters)));
    let headings = ["part of A", "rms mm", "explained", "remaining mm", "by the difference of"];
    format!("\n{}", table::render(&headings, &rows))
}
