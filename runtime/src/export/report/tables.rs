//! The report's tables.

use crate::export::escape::escape;
use crate::fit::{FitResult, FittedParameter};
use crate::variance::{Statistics, UnmatchedSummary, VarianceReport};
use gml_compiler::program::Quantity;
use std::fmt::Write;

/// A figure with as many digits as say something; a dash where there is none.
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
fn precise(x: f64) -> String {
    if x.abs() >= 1e6 || (x != 0.0 && x.abs() < 1e-3) || !x.is_finite() {
        return number(x);
    }
    minus(&format!("{x:.5}"))
}

/// A round figure, such as an axis has, without trailing zeros.
pub(super) fn short(x: f64) -> String {
    let text = format!("{x:.4}");
    if x == 0.0 || (1e-3..1e6).contains(&x.abs()) {
        return minus(text.trim_end_matches('0').trim_end_matches('.'));
    }
    number(x)
}

fn minus(text: &str) -> String {
    text.replace('-', "&minus;")
}

/// The section about the fit.
pub(super) fn fit(fit: &FitResult) -> String {
    let mut out = String::from(
        "<section>\n<h2>Fit</h2>\n<div class=\"columns\">\n<div>\n<h3>Parameters</h3>\n<div class=\"scroll\"><table>\n\
         <thead><tr><th>Parameter</th><th>Value</th><th>SD</th><th>Unit</th><th></th></tr></thead>\n<tbody>\n",
    );
    for p in &fit.parameters {
        parameter(p, &mut out);
    }
    out.push_str("</tbody></table></div>\n</div>\n<div>\n");
    quality(fit, &mut out);
    if let Some(p) = &fit.pose {
        pose(p, &mut out);
    }
    out.push_str("</div>\n</div>\n</section>\n");
    out
}

/// Angles are shown in degrees.
fn parameter(p: &FittedParameter, out: &mut String) {
    let (factor, unit) =
        if p.quantity == Quantity::Angle { (1f64.to_degrees(), "&deg;".to_owned()) } else { (1.0, escape(&p.unit)) };
    let sd = p.sd.map_or_else(String::new, |sd| number(sd * factor));
    let mark = match (p.fixed, p.at_bound) {
        (true, _) => "held fixed",
        (false, true) => "<span class=\"mark\">at its bound</span>",
        (false, false) => "",
    };
    let (name, value) = (escape(&p.name), precise(p.value * factor));
    let _ = writeln!(
        out,
        "<tr><td>{name}</td><td>{value}</td><td>{sd}</td><td class=\"text\">{unit}</td><td class=\"text\">{mark}</td></tr>"
    );
}

fn pose(pose: &crate::model::Motion, out: &mut String) {
    out.push_str(
        "<h3>Pose</h3>\n<p class=\"convention\">Scan point = rotation &times; model point + translation (mm).</p>\n\
         <div class=\"scroll\"><table>\n<thead><tr><th>Rotation</th><th></th><th></th><th>Translation</th></tr></thead>\n<tbody>\n",
    );
    for (row, t) in pose.rotation.iter().zip(&pose.translation) {
        let [a, b, c] = row.map(|v| minus(&format!("{v:.6}")));
        let _ = writeln!(out, "<tr><td>{a}</td><td>{b}</td><td>{c}</td><td>{}</td></tr>", precise(*t));
    }
    out.push_str("</tbody></table></div>\n");
}

fn quality(fit: &FitResult, out: &mut String) {
    let seconds: f64 = fit.seconds.values().sum();
    let rows = [
        ("Objective (mean of &psi;)", number(fit.objective)),
        ("Scale &sigma; of &psi;", format!("{} mm", number(fit.sigma))),
        ("Noise of the scan", format!("{} mm", number(fit.noise))),
        ("Inliers", format!("{:.2} %", 100.0 * fit.inliers)),
        ("Root mean square distance of the inliers", format!("{} mm", number(fit.rms))),
        ("Iterations", fit.iterations.to_string()),
        ("Evaluations", fit.evaluations.to_string()),
        ("Converged", if fit.converged { "yes".to_owned() } else { "<span class=\"mark\">no</span>".to_owned() }),
        ("Time", format!("{seconds:.2} s")),
    ];
    out.push_str("<h3>Quality</h3>\n<div class=\"scroll\"><table>\n<tbody>\n");
    for (name, value) in rows {
        let _ = writeln!(out, "<tr><td>{name}</td><td>{value}</td></tr>");
    }
    out.push_str("</tbody></table></div>\n");
}

/// Statistics of all parts, of each and of groups of them.
pub(super) fn statistics(variance: &VarianceReport) -> String {
    let mut out = String::from(
        "<div class=\"scroll\"><table>\n<thead>\
         <tr><th></th><th></th><th></th><th colspan=\"6\">unsigned</th><th colspan=\"4\">signed</th></tr>\
         <tr><th>Part</th><th>Area, mm&sup2;</th><th>Coverage</th><th>Mean</th><th>SD</th><th>RMS</th><th>Median</th>\
         <th>95 %</th><th>Max</th><th>Mean</th><th>SD</th><th>Min</th><th>Max</th></tr></thead>\n<tbody>\n",
    );
    row("All", &variance.overall, "total", &mut out);
    for part in &variance.parts {
        row(&part.name, &part.statistics, "", &mut out);
    }
    for group in &variance.groups {
        row(&format!("{} (all)", group.name), &group.statistics, "total", &mut out);
    }
    out.push_str("</tbody></table></div>\n");
    conformance(variance, &mut out);
    explained(variance, &mut out);
    forms(variance, &mut out);
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
    if let Some(unmatched) = &variance.unmatched {
        left_over(unmatched, &mut out);
    }
    out
}

/// How the parts stand to the tolerance, where one was given.
fn conformance(variance: &VarianceReport, out: &mut String) {
    if variance.overall.tolerance.is_none() {
        return;
    }
    out.push_str(
        "<h3>Tolerance</h3>\n<div class=\"scroll\"><table>\n<thead><tr><th>Part</th><th>From</th><th>To</th><th>Within</th>\
         <th>Below, mm&sup2;</th><th>Above, mm&sup2;</th><th></th></tr></thead>\n<tbody>\n",
    );
    let parts = variance.parts.iter().map(|p| (p.name.as_str(), &p.statistics));
    for (name, statistics) in std::iter::once(("All", &variance.overall)).chain(parts) {
        let Some(c) = &statistics.tolerance else { continue };
        let verdict = if c.within { "within" } else { "<span class=\"mark\">out of tolerance</span>" };
        let _ = writeln!(
            out,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{:.2} %</td><td>{}</td><td>{}</td><td class=\"text\">{verdict}</td></tr>",
            escape(name),
            c.tolerance.map_or_else(String::new, |t| short(t.lower)),
            c.tolerance.map_or_else(String::new, |t| short(t.upper)),
            100.0 * c.share,
            number(c.area_below),
            number(c.area_above),
        );
    }
    out.push_str("</tbody></table></div>\n");
}

/// What changes of parameters would explain.
fn explained(variance: &VarianceReport, out: &mut String) {
    let known: Vec<_> = variance.parts.iter().filter_map(|p| Some((&p.name, p.explained.as_ref()?))).collect();
    if known.is_empty() {
        return;
    }
    out.push_str(
        "<h3>Explained deviations</h3>\n<p class=\"convention\">The share of each part's mean square deviation that vanishes if its \
         parameters change, or if it moves as a whole; what remains of both is its form. Changes are those of one parameter alone.</p>\n\
         <div class=\"scroll\"><table>\n<thead><tr><th>Part</th><th>RMS, mm</th><th>Parameters</th><th>Position</th><th>Form, mm</th>\
         <th colspan=\"6\">Parameters with the largest shares</th></tr></thead>\n<tbody>\n",
    );
    for (name, e) in known {
        let (all, position) = (100.0 * e.all_parameters, 100.0 * e.position);
        let (rms, form) = (number(e.rms), number(e.form));
        let _ = write!(
            out,
            "<tr><td>{}</td><td>{rms}</td><td>{all:.1} %</td><td>{position:.1} %</td><td>{form}</td>",
            escape(name)
        );
        for p in e.parameters.iter().take(3) {
            let (change, unit) =
                if p.unit == "rad" { (p.change.to_degrees(), "&deg;") } else { (p.change, p.unit.as_str()) };
            let change = if change > 0.0 { format!("+{}", number(change)) } else { number(change) };
            let _ = write!(
                out,
                "<td class=\"text\">{} {change} {unit}</td><td>{:.1} %</td>",
                escape(&p.name),
                100.0 * p.share
            );
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody></table></div>\n");
}

/// Deviations of form.
fn forms(variance: &VarianceReport, out: &mut String) {
    let known: Vec<_> = variance.parts.iter().filter_map(|p| Some((&p.name, p.form.as_ref()?))).collect();
    if known.is_empty() {
        return;
    }
    out.push_str(
        "<h3>Form</h3>\n<p class=\"convention\">Between which surfaces of a part's form the measured points lie, wherever that fits best: about \
         the surface of least squares, and at the narrowest. Outlying points (beyond four robust standard deviations) are left out and counted; \
         the scan's noise is included. Roundness is that of the worst of the sections.</p>\n\
         <div class=\"scroll\"><table>\n<thead><tr><th>Part</th><th></th><th>Least squares, mm</th><th>Minimum zone, mm</th>\
         <th>Outlying</th><th>With outlying, mm</th><th>Roundness, mm</th><th>Sections</th></tr></thead>\n<tbody>\n",
    );
    for (name, form) in known {
        let _ = write!(out, "<tr><td>{}</td>", escape(name));
        match &form.zone {
            Some(z) => {
                let share = 100.0 * z.outlying as f64 / (z.outlying + z.points).max(1) as f64;
                let [least_squares, minimum, all] = [z.least_squares, z.minimum_zone, z.with_outlying[1]].map(number);
                let _ = write!(
                    out,
                    "<td class=\"text\">{}</td><td>{least_squares}</td><td>{minimum}</td><td>{share:.2} %</td><td>{all}</td>",
                    escape(&z.characteristic)
                );
            }
            None => out.push_str("<td class=\"text\">surface of revolution</td><td></td><td></td><td></td><td></td>"),
        }
        match form.roundness {
            Some(r) => {
                let _ = writeln!(out, "<td>{}</td><td>{}</td></tr>", number(r.minimum_zone), r.sections);
            }
            None => out.push_str("<td></td><td></td></tr>\n"),
        }
    }
    out.push_str("</tbody></table></div>\n");
}

/// What of the scan the model does not explain.
fn left_over(unmatched: &UnmatchedSummary, out: &mut String) {
    out.push_str("<h3>Not explained by the model</h3>\n");
    if unmatched.triangles == 0 {
        out.push_str("<p class=\"convention\">The model explains all of the scan.</p>\n");
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
    out.push_str(
        "<div class=\"scroll\"><table>\n<thead><tr><th>Piece</th><th>Area, mm&sup2;</th><th>Triangles</th>\
         <th colspan=\"3\">Centre</th><th colspan=\"3\">Size</th></tr></thead>\n<tbody>\n",
    );
    for (k, piece) in unmatched.largest.iter().enumerate() {
        let _ = write!(out, "<tr><td>{k}</td><td>{}</td><td>{}</td>", number(piece.area), piece.triangles);
        let size = piece.high.iter().zip(piece.low).map(|(high, low)| high - low);
        for figure in piece.centre.into_iter().chain(size) {
            let _ = write!(out, "<td>{}</td>", number(figure));
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody></table></div>\n");
}

fn row(name: &str, s: &Statistics, class: &str, out: &mut String) {
    let w = &s.weighted;
    let _ = write!(
        out,
        "<tr class=\"{class}\"><td>{}</td><td>{}</td><td>{:.1} %</td>",
        escape(name),
        number(s.area),
        100.0 * s.coverage
    );
    let signed = &w.signed;
    let figures =
        [w.mean, w.sd, w.rms, w.median, w.percentiles.p95, w.max, signed.mean, signed.sd, signed.min, signed.max];
    for figure in figures {
        let _ = write!(out, "<td>{}</td>", number(figure));
    }
    out.push_str("</tr>\n");
}
