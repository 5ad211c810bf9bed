//! The distribution of the deviations and the colour scale as inline SVG.

use super::tables::short;
use crate::export::bins::Bins;
use crate::export::escape::escape;
use crate::export::scale::Scale;
use crate::export::svg::{self, BINS};
use crate::variance::Deviations;
use std::fmt::Write;

/// Parts whose histograms are seen at once.
const UNFOLDED: usize = 12;

/// Area by signed distance, from one end of the colour scale to the other.
pub(super) fn histogram(deviations: &Deviations, scale: &Scale) -> String {
    let bins = Bins::of_deviations(deviations, scale, BINS, None);
    if bins.total <= 0.0 {
        return "<p>The scan has no data within reach of the model.</p>".to_owned();
    }
    let mut out = drawing(&bins.shares(), scale, "all parts");
    let beyond = beyond(&bins, scale);
    let _ = writeln!(
        out,
        "<p class=\"convention\">Share of the measured area by signed distance (mm). Beyond the ends of the scale: {beyond}.</p>"
    );
    out
}

/// The same of every part, if there are several.
pub(super) fn of_parts(deviations: &Deviations, scale: &Scale) -> String {
    let names = &deviations.texels.part_names;
    let figure = |(part, name): (usize, &String)| {
        let bins = Bins::of_deviations(deviations, scale, BINS, Some(part));
        let name = escape(name);
        (bins.total > 0.0).then(|| {
            // Half as many bars where the drawing is half as wide.
            let shares: Vec<f64> = bins.shares().chunks(2).map(|pair| pair.iter().sum()).collect();
            let (drawing, beyond) = (drawing(&shares, scale, &name), beyond(&bins, scale));
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

/// The shares beyond the scale in words.
fn beyond(bins: &Bins, scale: &Scale) -> String {
    let ([below, above], end) = (bins.beyond(), short(scale.end));
    format!("{below:.2} % below &minus;{end}, {above:.2} % above {end}")
}

fn drawing(shares: &[f64], scale: &Scale, of: &str) -> String {
    let label = format!("Histogram of the signed distances of {of}");
    element(&svg::histogram(shares, scale), svg::HISTOGRAM, &label)
}

/// The colour scale with its figures, and the histogram of all parts along it.
pub(super) fn legend(deviations: &Deviations, scale: &Scale) -> String {
    let bins = Bins::of_deviations(deviations, scale, BINS, None);
    element(&svg::legend(&bins, scale), svg::LEGEND, "Colour scale")
}

/// An element of the page. `label` is escaped.
fn element(content: &str, [width, height]: [f64; 2], label: &str) -> String {
    format!("<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{label}\">\n{content}</svg>\n")
}
