//! report.html: the results for people, in one file that needs nothing else and loads nothing.

mod agreement;
mod cloud;
mod fitted;
mod histogram;
mod inference;
mod measures;
mod origin;
mod pack;
mod relations;
pub(in crate::export) mod rounding;
mod scanned;
mod spread;
mod summary;
mod surface;
mod tables;
#[cfg(test)]
mod tests;
mod trace;
mod view;

pub(crate) use summary::file_name;

use super::escape::escape;
use super::number;
use super::scale::Scale;
use super::x3d::shaders;
use crate::fit::FitResult;
use crate::mesh::TriangleMesh;
use crate::model::Tessellation;
use crate::record::Record;
use crate::variance::{Deviations, VarianceReport};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write;

/// What the report knows of the model's scripts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Scripts {
    /// Names and texts, the model's own first.
    pub texts: Vec<(String, String)>,
    /// Where each part is declared (`cup.gml:12`), in the model's order; empty where that is not known.
    pub declared: Vec<String>,
}

/// The content of the report.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// Its title.
    pub title: &'a str,
    /// What it was made with, if that is known.
    pub record: Option<&'a Record>,
    /// The scripts.
    pub scripts: &'a Scripts,
    /// The scan, some of whose points the view shows.
    pub scan: &'a TriangleMesh,
    /// The fit; none where the model was given as it is.
    pub fit: Option<&'a FitResult>,
    /// The statistics.
    pub variance: &'a VarianceReport,
    /// The deviations themselves, for the histogram.
    pub deviations: &'a Deviations,
    /// The surface from which was measured, with normals and texture coordinates.
    pub tessellation: &'a Tessellation,
    /// The rotation of the model from its author's coordinates, with z upwards, into the scan's: a matrix, row by row.
    /// The view shows the model upright.
    pub turned: [[f64; 3]; 3],
    /// The probability of conformance in colours as a PNG file, if a part has a tolerance.
    pub conformance_png: Option<&'a [u8]>,
    /// The scan's colours at the texels as a PNG file in the frame of the texture, if it has any.
    pub colour_png: Option<&'a [u8]>,
    /// The uncertainty of the distances in colours as a PNG file, if the scan is a cloud.
    pub uncertainty_png: Option<&'a [u8]>,
    /// The colour scale.
    pub scale: &'a Scale,
    /// The picture that stands beside the verdict.
    pub picture: Option<Figure<'a>>,
    /// Further pictures, in rows with a heading.
    pub pictures: &'a [(&'a str, &'a [Figure<'a>])],
}

/// A PNG file and its caption.
#[derive(Clone, Copy, Debug)]
pub struct Figure<'a> {
    /// What is seen.
    pub caption: &'a str,
    /// The file.
    pub png: &'a [u8],
}

/// The report as HTML. Nothing in it is executed or loaded but its own script; all text is escaped.
#[must_use]
pub fn write(report: &Report<'_>) -> String {
    let step = surface::step(report);
    let way = match report.variance.distance.as_str() {
        "averaged-normal" => "along normals that are averaged where patches meet",
        "closest" => "to its closest point",
        _ => "along the normal",
    };
    let filled = report.variance.holes.as_ref().map_or("", |_| ", olive where a hole of it was closed");
    let insertions: [(&str, String); 34] = [
        ("title", escape(report.title)),
        ("style", include_str!("style.css").to_owned()),
        ("facts", summary::facts(report)),
        ("warnings", warnings(report)),
        ("verdict", summary::verdict(report)),
        ("legend", histogram::legend(report.deviations, report.scale)),
        ("pictures", pictures(report)),
        ("fit", report.fit.map_or_else(String::new, |fit| fitted::fit(fit, report.variance))),
        ("max_distance", tables::short(report.variance.max_distance)),
        ("convention", escape(&report.variance.sign_convention)),
        ("agreement", agreement::agreement(report.variance)),
        ("texels", agreement::texels(report.variance)),
        ("way", way.to_owned()),
        ("filled", filled.to_owned()),
        ("statistics", tables::statistics(report.variance)),
        ("histogram", histogram::histogram(report.deviations, report.scale)),
        ("histograms", histogram::of_parts(report.deviations, report.scale)),
        ("running", running(report)),
        ("step", tables::number(step)),
        ("range", number(report.scale.end)),
        ("conformance", report.conformance_png.map_or_else(String::new, conformance)),
        ("colour", scanned::colours(report)),
        ("uncertainty", report.uncertainty_png.map_or_else(String::new, scanned::uncertainty)),
        ("scan_colours", scanned::control(report)),
        ("texel_data", surface::texels(report.deviations, step)),
        ("provenance", origin::origin(report)),
        ("mesh", surface::mesh(&report.tessellation.mesh)),
        ("cloud", cloud::points(report.scan)),
        ("scene", view::scene(report)),
        ("labels", view::labels(report, step)),
        ("parts", view::parts(report)),
        ("tolerance", view::tolerance_control(report)),
        ("bands", report.scale.tolerance.map_or("", |_| " checked").to_owned()),
        ("viewer", view::SCRIPT.concat()),
    ];
    let shaders = [
        ("surface_vertex", shaders::complete(include_str!("view/view.vert"))),
        ("surface_fragment", shaders::complete(include_str!("view/view.frag"))),
        ("points_vertex", include_str!("view/points.vert").to_owned()),
        ("points_fragment", include_str!("view/points.frag").to_owned()),
    ];
    fill(include_str!("page.html"), insertions.iter().chain(&shaders))
}

/// Puts texts in the places of `{{name}}`, in one pass, so that braces in a text stay what they are.
fn fill<'a>(page: &str, insertions: impl Iterator<Item = &'a (&'a str, String)> + Clone) -> String {
    let mut out = String::new();
    let mut rest = page;
    while let Some((before, after)) = rest.split_once("{{") {
        out.push_str(before);
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        if let Some((_, text)) = insertions.clone().find(|(n, _)| *n == name) {
            out.push_str(text);
        }
        rest = after;
    }
    out.push_str(rest);
    out
}

fn warnings(report: &Report<'_>) -> String {
    let of_scan = |w: &&String| !report.variance.warnings.contains(w);
    let of_fit = report.fit.iter().flat_map(|f| &f.warnings).filter(of_scan);
    let all: Vec<&String> = of_fit.chain(&report.variance.warnings).collect();
    if all.is_empty() {
        return String::new();
    }
    let items: String = all.iter().map(|w| format!("<li>{}</li>\n", escape(w))).collect();
    format!("<section class=\"warnings\" role=\"note\"><b>Warnings</b><ul>\n{items}</ul></section>\n")
}

fn pictures(report: &Report<'_>) -> String {
    if report.pictures.is_empty() {
        return String::new();
    }
    let mut out = String::from("<section>\n<h2>Pictures</h2>\n");
    for (heading, row) in report.pictures {
        let figures: String = row.iter().map(|one| figure(one, heading)).collect();
        let _ = writeln!(out, "<h3>{}</h3>\n<div class=\"pictures\">\n{figures}</div>", escape(heading));
    }
    out.push_str("</section>\n");
    out
}

fn figure(Figure { caption, png }: &Figure<'_>, of: &str) -> String {
    let (caption, of, data) = (escape(caption), escape(of), STANDARD.encode(png));
    format!(
        "<figure><img alt=\"{of}: {caption}\" src=\"data:image/png;base64,{data}\"><figcaption>{caption}</figcaption></figure>\n"
    )
}

/// The map of the probability of conformance.
fn conformance(png: &[u8]) -> String {
    format!(
        "<figure><img alt=\"Probability of conformance\" src=\"data:image/png;base64,{}\"><figcaption>Probability that the \
         surface at each texel is within its tolerance, by its own distance; striped where nothing was measured or there is \
         no tolerance.</figcaption></figure>\n",
        STANDARD.encode(png)
    )
}

/// The title as a string of CSS, for the head of printed pages.
fn running(report: &Report<'_>) -> String {
    let plain = |c: char| c.is_alphanumeric() || " .,_-()+".contains(c);
    let title: String = report.title.chars().map(|c| if plain(c) { c } else { '_' }).take(120).collect();
    format!("\"{title}\"")
}
