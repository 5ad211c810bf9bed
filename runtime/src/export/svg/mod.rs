//! Drawings as SVG: in report.html, and as files for documents. They are XML without scripts and without references to
//! anything outside.

mod chart;
mod section;

pub(super) use chart::{HISTOGRAM, LEGEND, histogram, legend};
pub use section::SectionDrawing;

use super::bins::Bins;
use super::escape::escape;
use super::picture;
use super::scale::Scale;
use crate::variance::Deviations;

/// The colour of lines and letters.
const INK: &str = "#5b626c";

/// The number of bins of a histogram: even, so that zero lies between two of them.
pub(super) const BINS: usize = 60;

/// The rules of files of their own; within a page those of the page hold.
const STYLE: &str = "text { fill: #3c3e42; font: 12px sans-serif } .axis { stroke: #dde1e6 }";

/// The height of a heading.
const HEADING: f64 = 30.0;

/// A colour as CSS and SVG write it.
fn colour([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// A figure with its sign, which is a minus and no hyphen.
fn signed(x: f64) -> String {
    picture::number(x).replace('-', "\u{2212}")
}

/// A file with a heading above `content`, which is so many units wide and high.
fn file(heading: &str, content: &str, [width, height]: [f64; 2]) -> String {
    let (heading, whole) = (escape(heading), height + HEADING);
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {whole}\" width=\"{width}\" height=\"{whole}\" role=\"img\">\n\
         <title>{heading}</title>\n<style>{STYLE}</style>\n\
         <rect width=\"{width}\" height=\"{whole}\" fill=\"#ffffff\"/>\n\
         <text x=\"12\" y=\"20\" style=\"font-size: 14px\">{heading}</text>\n\
         <g transform=\"translate(0 {HEADING})\">\n{content}</g>\n</svg>\n"
    )
}

/// A file with the colour scale and the histogram along it. `title` names model and scan.
pub(super) fn legend_file(title: &str, deviations: &Deviations, scale: &Scale) -> String {
    let bins = Bins::of_deviations(deviations, scale, BINS, None);
    file(&format!("{title}: scale of the deviations"), &legend(&bins, scale), LEGEND)
}

/// A file with the distribution of the deviations over the measured area.
pub(super) fn histogram_file(title: &str, deviations: &Deviations, scale: &Scale) -> String {
    let bins = Bins::of_deviations(deviations, scale, BINS, None);
    let [width, height] = HISTOGRAM;
    let (mut content, words) = match bins.total > 0.0 {
        true => {
            let ([below, above], end) = (bins.beyond(), signed(scale.end));
            let beyond =
                format!("beyond \u{b1}{} mm: {below:.2} % below, {above:.2} % above", end.trim_start_matches('+'));
            (histogram(&bins.shares(), scale), format!("signed distance in mm (+: the scan lies outside); {beyond}"))
        }
        false => (String::new(), "nothing was measured".to_owned()),
    };
    let (x, y) = (width / 2.0, height + 14.0);
    content.push_str(&format!("<text x=\"{x}\" y=\"{y}\" text-anchor=\"middle\">{}</text>\n", escape(&words)));
    file(&format!("{title}: share of the measured area"), &content, [width, height + 24.0])
}
