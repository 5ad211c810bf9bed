//! The distribution of the deviations and the colour scale as inline SVG.

use super::css;
use super::tables::short;
use crate::export::escape::escape;
use crate::export::round_up;
use crate::variance::Deviations;
use std::fmt::Write;

/// The number of bins: even, so that zero lies between two of them.
const BINS: usize = 60;

/// Parts whose histograms are seen at once.
const UNFOLDED: usize = 12;

/// Size of the drawing and its margins.
const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 220.0;
const LEFT: f64 = 50.0;
const RIGHT: f64 = 40.0;

/// Area by signed distance, and what of it is beyond the ends of the scale.
#[derive(Clone, Default)]
struct Bins {
    areas: Vec<f64>,
    below: f64,
    above: f64,
    total: f64,
}

/// The bins of the texels of all parts, or of one.
fn bins(deviations: &Deviations, range: f64, part: Option<usize>) -> Bins {
    let mut bins = Bins { areas: vec![0.0; BINS], ..Bins::default() };
    for (i, area) in deviations.texels.area.iter().enumerate() {
        let (d, area) = (f64::from(deviations.signed(i)), f64::from(*area));
        let is_of_another = part.is_some_and(|part| deviations.texels.part[i] as usize != part);
        if is_of_another || d.is_nan() || !area.is_finite() || area <= 0.0 {
            continue;
        }
        bins.total += area;
        match (d / range + 1.0) * 0.5 * BINS as f64 {
            place if place < 0.0 => bins.below += area,
            place if place >= BINS as f64 => bins.above += area,
            place => bins.areas[place as usize] += area,
        }
    }
    bins
}

impl Bins {
    fn shares(&self) -> Vec<f64> {
        self.areas.iter().map(|area| area / self.total).collect()
    }

    fn beyond(&self, range: f64) -> String {
        let [below, above] = [self.below, self.above].map(|area| 100.0 * area / self.total);
        let end = short(range);
        format!("{below:.2} % below &minus;{end}, {above:.2} % above {end}")
    }
}

/// Area by signed distance, from one end of the colour scale to the other.
pub(super) fn histogram(deviations: &Deviations, range: f64) -> String {
    let bins = bins(deviations, range, None);
    if bins.total <= 0.0 {
        return "<p>The scan has no data within reach of the model.</p>".to_owned();
    }
    let mut out = drawing(&bins.shares(), range, "all parts");
    let beyond = bins.beyond(range);
    let _ = writeln!(
        out,
        "<p class=\"convention\">Share of the measured area by signed distance (mm). Beyond the ends of the scale: {beyond}.</p>"
    );
    out
}

/// The same of every part, if there are several.
pub(super) fn of_parts(deviations: &Deviations, range: f64) -> String {
    let names = &deviations.texels.part_names;
    let figure = |(part, name): (usize, &String)| {
        let bins = bins(deviations, range, Some(part));
        let name = escape(name);
        (bins.total > 0.0).then(|| {
            // Half as many bars where the drawing is half as wide.
            let shares: Vec<f64> = bins.shares().chunks(2).map(|pair| pair.iter().sum()).collect();
            let (drawing, beyond) = (drawing(&shares, range, &name), bins.beyond(range));
            format!("<figure>{drawing}<figcaption>{name}: {beyond}</figcaption></figure>\n")
        })
    };
    if names.len() < 2 {
        return String::new();
    }
    let figures: Vec<String> = names.iter().enumerate().filter_map(figure).collect();
    let row = |figures: &[String]| format!("<div class=\"histograms\">\n{}</div>\n", figures.concat());
    let (shown, folded) = figures.split_at(figures.len().min(UNFOLDED));
    let mut out = format!("<h3>Distribution by part</h3>\n{}", row(shown));
    if !folded.is_empty() {
        let _ = writeln!(out, "<details><summary>{} further parts</summary>\n{}</details>", folded.len(), row(folded));
    }
    out
}

fn drawing(shares: &[f64], range: f64, of: &str) -> String {
    let most = shares.iter().copied().fold(0.0, f64::max).max(1e-12);
    let step = round_up(most / 4.0);
    let top = (most / step).ceil().max(1.0) * step;
    let (base, width) = (HEIGHT - 34.0, WIDTH - LEFT - RIGHT);
    let y = |share: f64| base - share / top * (base - 12.0);
    let mut out = format!(
        "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"Histogram of the signed distances of {of}\">\n"
    );
    for i in 0..=(top / step).round() as usize {
        let (share, right) = (i as f64 * step, WIDTH - RIGHT);
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
            css(middle)
        );
    }
    ticks(range, LEFT, width, base + 18.0, &mut out);
    out.push_str("</svg>\n");
    out
}

/// The colour scale with its figures.
pub(super) fn legend(range: f64) -> String {
    const STEPS: usize = 64;
    let width = WIDTH - 2.0 * LEFT;
    let mut out = format!("<svg viewBox=\"0 0 {WIDTH} 62\" role=\"img\" aria-label=\"Colour scale\">\n");
    for i in 0..STEPS {
        let step = width / STEPS as f64;
        let colour = css(2.0 * (i as f64 + 0.5) / STEPS as f64 - 1.0);
        let _ = writeln!(
            out,
            "<rect x=\"{:.2}\" y=\"22\" width=\"{:.2}\" height=\"14\" fill=\"{colour}\"/>",
            LEFT + step * i as f64,
            step + 0.3
        );
    }
    ticks(range, LEFT, width, 52.0, &mut out);
    let _ = writeln!(out, "<text x=\"{LEFT}\" y=\"15\">scan inside the model</text>");
    let right = LEFT + width;
    let _ = writeln!(out, "<text x=\"{right}\" y=\"15\" text-anchor=\"end\">scan outside the model</text>");
    let _ = writeln!(out, "<text x=\"{}\" y=\"15\" text-anchor=\"middle\">mm</text>", LEFT + width / 2.0);
    out.push_str("</svg>");
    out
}

fn ticks(range: f64, left: f64, width: f64, y: f64, out: &mut String) {
    for i in -2..=2 {
        let share = f64::from(i) / 2.0;
        let x = left + width * (share + 1.0) / 2.0;
        let sign = if i > 0 { "+" } else { "" };
        let text = if i == 0 { "0".to_owned() } else { format!("{sign}{}", short(share * range)) };
        let _ = writeln!(out, "<text x=\"{x:.1}\" y=\"{y}\" text-anchor=\"middle\">{text}</text>");
    }
}
