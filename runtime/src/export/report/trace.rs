//! The convergence of the fit as inline SVG.

use super::tables::number;
use crate::fit::FitResult;
use std::fmt::Write;

/// Size of the drawing and its margins.
const WIDTH: f64 = 520.0;
const HEIGHT: f64 = 200.0;
const LEFT: f64 = 56.0;

/// The mean loss by the number of evaluations, on a logarithmic scale; the scale of the loss changes between stages, so
/// that the line has steps. Nothing if too few steps are known.
pub(super) fn trace(fit: &FitResult, out: &mut String) {
    let points: Vec<(f64, f64)> = fit
        .trace
        .iter()
        .filter(|p| p.objective > 0.0 && p.objective.is_finite())
        .map(|p| (p.evaluations as f64, p.objective.log10()))
        .collect();
    let Some(last) = points.last().filter(|_| points.len() > 2) else { return };
    let end = last.0.max(1.0);
    let (low, high) = points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p.1), h.max(p.1)));
    let span = (high - low).max(1e-3);
    let x = |evaluations: f64| LEFT + evaluations / end * (WIDTH - LEFT - 12.0);
    let y = |value: f64| 12.0 + (high - value) / span * (HEIGHT - 52.0);
    let line: String = points.iter().map(|(e, v)| format!("{:.1},{:.1} ", x(*e), y(*v))).collect();
    let _ = writeln!(
        out,
        "<h3>Convergence</h3>\n<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"Mean loss by evaluations\">\n\
         <line class=\"axis\" x1=\"{LEFT}\" x2=\"{LEFT}\" y1=\"12\" y2=\"{0}\"/>\n\
         <line class=\"axis\" x1=\"{LEFT}\" x2=\"{1}\" y1=\"{0}\" y2=\"{0}\"/>\n\
         <polyline class=\"line\" points=\"{line}\"/>",
        HEIGHT - 40.0,
        WIDTH - 12.0
    );
    for value in [low, high] {
        let (left, at, text) = (LEFT - 6.0, y(value) + 4.0, number(10f64.powf(value)));
        let _ = writeln!(out, "<text x=\"{left}\" y=\"{at:.1}\" text-anchor=\"end\">{text}</text>");
    }
    for evaluations in [0.0, end] {
        let anchor = if evaluations > 0.0 { "end" } else { "start" };
        let (at, below) = (x(evaluations), HEIGHT - 22.0);
        let _ = writeln!(out, "<text x=\"{at:.1}\" y=\"{below}\" text-anchor=\"{anchor}\">{evaluations}</text>");
    }
    let (middle, below) = ((LEFT + WIDTH) / 2.0, HEIGHT - 4.0);
    let _ = writeln!(
        out,
        "<text x=\"{middle}\" y=\"{below}\" text-anchor=\"middle\">evaluations of the objective; upwards: mean loss, logarithmic</text>\n</svg>"
    );
}
