//! The colour scale with its histogram, and the distribution of deviations.

use super::{INK, colour, signed};
use crate::export::bins::Bins;
use crate::export::escape::escape;
use crate::export::round_up;
use crate::export::scale::{BANDS, Scale};
use std::fmt::Write;

/// Size of a histogram.
pub(in crate::export) const HISTOGRAM: [f64; 2] = [860.0, 220.0];

/// Size of a legend.
pub(in crate::export) const LEGEND: [f64; 2] = [860.0, 122.0];

/// Margins.
const LEFT: f64 = 50.0;
const RIGHT: f64 = 40.0;

/// Steps of a continuous scale.
const STEPS: usize = 64;

/// The content of a histogram: shares of an area by signed distance, from one end of the scale to the other.
pub(in crate::export) fn histogram(shares: &[f64], scale: &Scale) -> String {
    let most = shares.iter().copied().fold(0.0, f64::max).max(1e-12);
    let step = round_up(most / 4.0);
    let top = (most / step).ceil().max(1.0) * step;
    let [whole, height] = HISTOGRAM;
    let (base, width) = (height - 34.0, whole - LEFT - RIGHT);
    let y = |share: f64| base - share / top * (base - 12.0);
    let mut out = String::new();
    for i in 0..=(top / step).round() as usize {
        let (share, right) = (i as f64 * step, whole - RIGHT);
        let line = y(share);
        let _ = writeln!(out, "<line class=\"axis\" x1=\"{LEFT}\" x2=\"{right}\" y1=\"{line:.1}\" y2=\"{line:.1}\"/>");
        let percent = 100.0 * share;
        let digits = if step < 0.01 { 1 } else { 0 };
        let (x, line) = (LEFT - 6.0, line + 4.0);
        let _ = writeln!(out, "<text x=\"{x}\" y=\"{line:.1}\" text-anchor=\"end\">{percent:.digits$} %</text>");
    }
    let bar = width / shares.len() as f64;
    for (i, share) in shares.iter().enumerate().filter(|(_, s)| **s > 0.0) {
        let middle = 2.0 * (i as f64 + 0.5) / shares.len() as f64 - 1.0;
        let (x, top) = (LEFT + bar * i as f64, y(*share));
        let _ = writeln!(
            out,
            "<rect x=\"{x:.2}\" y=\"{top:.2}\" width=\"{:.2}\" height=\"{:.2}\" fill=\"{}\" stroke=\"#8a9099\" \
             stroke-width=\"0.5\"/>",
            bar - 1.0,
            base - top,
            colour(scale.colour(middle * scale.end))
        );
    }
    ticks(scale, [LEFT, width], base, &mut out);
    out
}

/// The content of a legend: the colour scale with its figures, and the histogram of the measured area along it.
pub(in crate::export) fn legend(bins: &Bins, scale: &Scale) -> String {
    let [whole, height] = LEGEND;
    let (width, bar) = (whole - 2.0 * LEFT, height - 40.0);
    let mut out = String::new();
    let most = bins.areas.iter().copied().fold(0.0, f64::max);
    let wide = width / bins.areas.len().max(1) as f64;
    for (i, area) in bins.areas.iter().enumerate().filter(|(_, area)| **area > 0.0) {
        let (x, high) = (LEFT + wide * i as f64, 56.0 * area / most);
        let _ = writeln!(
            out,
            "<rect x=\"{x:.2}\" y=\"{:.2}\" width=\"{:.2}\" height=\"{high:.2}\" fill=\"#8a9099\"/>",
            bar - high,
            wide - 1.0
        );
    }
    for [from, to] in bands(scale) {
        let [x, end] = [from, to].map(|d| LEFT + width * (d / scale.end + 1.0) / 2.0);
        let fill = colour(scale.colour((from + to) / 2.0));
        // A little wider, so that no gap is seen between neighbours.
        let wide = (end - x + 0.3).min(LEFT + width - x);
        let _ = writeln!(out, "<rect x=\"{x:.2}\" y=\"{bar}\" width=\"{wide:.2}\" height=\"14\" fill=\"{fill}\"/>");
    }
    let _ = writeln!(
        out,
        "<rect x=\"{LEFT}\" y=\"{bar}\" width=\"{width}\" height=\"14\" fill=\"none\" stroke=\"#8a9099\" stroke-width=\"0.5\"/>"
    );
    ticks(scale, [LEFT, width], bar + 14.0, &mut out);
    let _ = writeln!(out, "<text x=\"{LEFT}\" y=\"13\">&#8722; scan inside the model</text>");
    let right = LEFT + width;
    let _ = writeln!(out, "<text x=\"{right}\" y=\"13\" text-anchor=\"end\">scan outside the model +</text>");
    let middle = LEFT + width / 2.0;
    let _ = writeln!(out, "<text x=\"{middle}\" y=\"13\" text-anchor=\"middle\">mm; bars: measured area</text>");
    out
}

/// Where the colours of the scale change, each with the next: deviations in millimetres.
fn bands(scale: &Scale) -> Vec<[f64; 2]> {
    let borders: Vec<f64> = match scale.tolerance {
        None => (0..=STEPS).map(|i| scale.end * (2.0 * i as f64 / STEPS as f64 - 1.0)).collect(),
        Some(t) => {
            let step = scale.step_beyond(&t);
            let below = (0..BANDS).rev().map(|k| t.lower - f64::from(k) * step);
            let above = (0..BANDS).map(|k| t.upper + f64::from(k) * step);
            [-scale.end].into_iter().chain(below).chain(above).chain([scale.end]).collect()
        }
    };
    borders.windows(2).map(|pair| [pair[0], pair[1]]).collect()
}

/// Figures below a scale whose lower edge is at `y`, from `left` on; those without room are left out.
fn ticks(scale: &Scale, [left, width]: [f64; 2], y: f64, out: &mut String) {
    let all = scale.ticks();
    let (main, other): (Vec<f64>, Vec<f64>) = all.into_iter().partition(|tick| scale.is_main(*tick));
    let mut taken: Vec<f64> = Vec::new();
    for tick in main.into_iter().chain(other) {
        let x = left + width * (tick / scale.end + 1.0) / 2.0;
        let _ = writeln!(out, "<line stroke=\"{INK}\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{y}\" y2=\"{}\"/>", y + 4.0);
        // Letters of 12 units: seven of them are about 50 wide.
        if taken.iter().all(|other| (x - other).abs() > 50.0) {
            let (text, below) = (escape(&signed(tick)), y + 18.0);
            let _ = writeln!(out, "<text x=\"{x:.1}\" y=\"{below}\" text-anchor=\"middle\">{text}</text>");
            taken.push(x);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{BANDS, Scale, bands};
    use crate::variance::Tolerance;

    #[test]
    fn bands_cover_the_scale() {
        let scale = Scale { end: 0.9, tolerance: Some(Tolerance { lower: -0.1, upper: 0.3 }) };
        let found = bands(&scale);
        assert_eq!(found.len(), 2 * BANDS as usize + 1);
        assert!(found[0][0] == -0.9 && found[8][1] == 0.9 && found[4] == [-0.1, 0.3]);
        for [from, to] in found {
            let inside = |share: f64| scale.colour(from + share * (to - from));
            assert_eq!(inside(0.01), inside(0.99), "{from} to {to}");
        }
    }
}
