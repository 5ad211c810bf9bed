//! The report's section on the fit.

use super::inference::inference;
use super::measures::measures;
use super::rounding::{pair, unit_of};
use super::tables::{minus, number, precise, row_of, short, table};
use super::trace::trace;
use crate::export::escape::escape;
use crate::fit::{FitResult, FittedParameter, PoseCovariance, WithoutSd};
use crate::model::Motion;
use crate::variance::VarianceReport;
use std::fmt::Write;

/// The section about the fit, with the verdicts on measures.
pub(super) fn fit(fit: &FitResult, variance: &VarianceReport) -> String {
    let mut out = String::from("<section>\n<h2>Fit</h2>\n<h3>Parameters</h3>\n");
    let head = "<thead><tr><th>Parameter</th><th>Value</th><th>SD</th><th>Unit</th><th>From</th><th>To</th><th>Bias</th>\
        <th>Remark</th></tr></thead>\n";
    let caption = "Fitted parameters, with standard deviations, bounds, and the bias by noise, which the standard deviation holds";
    table(caption, head, fit.parameters.iter().map(parameter), &mut out);
    if !fit.inputs.is_empty() {
        let inputs: Vec<String> = fit.inputs.iter().map(|input| escape(&input.to_string())).collect();
        let _ = writeln!(out, "<p>Inputs: {}</p>", inputs.join(", "));
    }
    for group in &fit.equal {
        let names: Vec<String> = group.iter().map(|name| escape(name)).collect();
        let _ = writeln!(out, "<p>Held equal: {}</p>", names.join(", "));
    }
    measures(&fit.measures, variance, &mut out);
    out.push_str("<div class=\"columns\">\n<div>\n");
    quality(fit, &mut out);
    out.push_str("</div>\n<div>\n");
    if let Some(p) = &fit.pose {
        pose(p, &mut out);
    }
    if let Some(covariance) = &fit.pose_covariance {
        pose_deviations(covariance, &mut out);
    }
    trace(fit, &mut out);
    out.push_str("</div>\n</div>\n");
    inference(fit, &mut out);
    out.push_str("</section>\n");
    out
}

/// Angles are shown in degrees.
fn parameter(p: &FittedParameter) -> String {
    let (factor, unit) = unit_of(p);
    let mark = match p.without_sd {
        Some(WithoutSd::Fixed) => "held fixed".to_owned(),
        Some(reason) => format!("<span class=\"mark\">{}</span>", reason.text()),
        None => String::new(),
    };
    let [value, sd] = pair(p.value * factor, p.sd.map(|sd| sd * factor));
    let value = if p.sd.is_none() { precise(p.value * factor) } else { value };
    let [lower, upper] = [p.lower, p.upper].map(|bound| bound.map_or("&ndash;".to_owned(), |b| short(b * factor)));
    let bias = p.bias.map_or_else(String::new, |bias| number(bias * factor));
    format!(
        "<tr><td>{}</td><td>{value}</td><td>{sd}</td><td class=\"text\">{unit}</td><td>{lower}</td><td>{upper}</td><td>{bias}</td>\
         <td class=\"text\">{mark}</td></tr>\n",
        escape(&p.name)
    )
}

fn pose(pose: &Motion, out: &mut String) {
    out.push_str(
        "<h3>Pose</h3>\n<p class=\"convention\">Scan point = rotation &times; model point + translation (mm).</p>\n",
    );
    let row = |((axis, row), t): ((&str, &[f64; 3]), &f64)| {
        let [a, b, c] = row.map(|v| minus(&format!("{v:.6}")));
        row_of(&[axis.to_owned(), a, b, c, precise(*t)])
    };
    let head = "<thead><tr><th>Axis</th><th colspan=\"3\">Rotation</th><th>Translation, mm</th></tr></thead>\n";
    table("The pose", head, ["x", "y", "z"].into_iter().zip(&pose.rotation).zip(&pose.translation).map(row), out);
}

/// The standard deviations of the pose, and the motions along which it is held.
fn pose_deviations(covariance: &PoseCovariance, out: &mut String) {
    let (shift, turn) = covariance.deviations();
    let [x, y, z] = covariance.centre.map(|c| minus(&format!("{c:.1}")));
    let caption = format!(
        "Standard deviations of the pose, along and about the axes of the scan; turns are about ({x}, {y}, {z}) mm"
    );
    let row = |((axis, shift), turn): ((&str, f64), f64)| {
        row_of(&[axis.to_owned(), format!("{} mm", number(shift)), format!("{}&deg;", number(turn.to_degrees()))])
    };
    let head = "<thead><tr><th>Axis</th><th>SD of the shift</th><th>SD of the turn</th></tr></thead>\n";
    table(&caption, head, ["x", "y", "z"].into_iter().zip(shift).zip(turn).map(row), out);
    for symmetry in &covariance.symmetries {
        let why = if symmetry.moves.is_empty() { "a symmetry" } else { "not determined" };
        let _ = writeln!(out, "<p>Held, {why}: {}.</p>", minus(&escape(&symmetry.text)));
    }
}

fn quality(fit: &FitResult, out: &mut String) {
    let seconds: f64 = fit.seconds.values().sum();
    let mut rows = vec![
        ("Objective (mean loss)", number(fit.objective)),
        ("Scale &sigma; of the loss", format!("{} mm", number(fit.sigma))),
        ("Noise of the scan", format!("{} mm", number(fit.noise))),
        ("Inliers, points within", format!("{} mm", number(fit.inlier_distance()))),
        ("Their share of the scan", format!("{:.2} %", 100.0 * fit.inliers)),
        ("Root mean square distance of the inliers", format!("{} mm", number(fit.rms))),
        ("Iterations", fit.iterations.to_string()),
        ("Evaluations", fit.evaluations.to_string()),
        ("Converged", if fit.converged { "yes".to_owned() } else { "<span class=\"mark\">no</span>".to_owned() }),
        ("Time", format!("{seconds:.2} s")),
    ];
    if let Some(coverage) = &fit.coverage {
        rows.push(("Of the model's visible surface scanned", format!("{:.1} %", 100.0 * coverage.share)));
    }
    out.push_str("<h3>Quality</h3>\n");
    table("How well the model fits", "", rows.into_iter().map(|(name, value)| row_of(&[name.to_owned(), value])), out);
}
