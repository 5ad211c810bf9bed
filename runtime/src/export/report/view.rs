//! The input of the interactive view besides mesh, texels and points: figures, parts, labels and controls.

use super::surface::{CLASSES, drawn, drawn_of, step};
use super::{Report, cloud, number};
use crate::export::colormap::diverging;
use crate::export::escape::escape;
use crate::export::picture::names;
use crate::export::scale::BANDS;
use crate::model::ChartMap;
use crate::variance::{Peak, Tolerance};
use serde_json::{Value, json};
use std::fmt::Write;

/// The page's script, in the order in which its files need each other.
pub(super) const SCRIPT: [&str; 6] = [
    include_str!("view/data.js"),
    include_str!("view/camera.js"),
    include_str!("view/draw.js"),
    include_str!("view/section.js"),
    include_str!("view/labels.js"),
    include_str!("view/view.js"),
];

/// Samples of the colour scale between which the page interpolates: its anchors are among them.
const SCALE_SAMPLES: usize = 17;

/// Dots of letters along a row of the map, of which seven are as high as a letter.
const MAP_DOTS: usize = 264;

/// The share of a part's mean square deviation from which on a parameter is said to explain it.
const LEAST_SHARE: f64 = 0.05;

/// Figures for the view as JSON that can stand in a page: nothing in it ends its element.
pub(super) fn scene(report: &Report<'_>) -> String {
    let mesh = &report.tessellation.mesh;
    let (texels, bounds, scan) = (&report.deviations.texels, mesh.bounds(), report.scan.bounds());
    let scale = |i: usize| diverging(2.0 * i as f64 / (SCALE_SAMPLES - 1) as f64 - 1.0);
    let tolerance = tolerance(report).map(|t| [t.lower, t.upper]);
    // The map is shown about half as wide as the page, where a dot of the letters is as wide as these texels.
    let named = names::names(texels, (texels.width as usize / MAP_DOTS).max(1));
    let names: Vec<Value> = named
        .iter()
        .map(|name| json!({ "text": name.text, "at": name.at, "extent": name.extent, "upwards": name.is_upwards }))
        .collect();
    in_page(&json!({
        "vertices": mesh.positions.len(),
        "triangles": drawn(mesh).count(),
        "width": texels.width,
        "height": texels.height,
        "centre": bounds.centre().to_array(),
        "halfSize": (bounds.size() / 2.0).to_array(),
        "step": step(report),
        "colourRange": report.scale.end,
        "tolerance": tolerance,
        "neutral": report.scale.tolerance.map(|t| [t.lower, t.upper]),
        "steps": BANDS,
        "names": names,
        "scale": (0..SCALE_SAMPLES).map(scale).collect::<Vec<_>>(),
        "classes": CLASSES,
        "frame": report.turned,
        "scan": {
            "points": cloud::count(report.scan),
            "middle": (scan.centre() - bounds.centre()).to_array(),
            "halfSize": (scan.size() / 2.0).to_array(),
        },
        "parts": facts(report),
    }))
}

/// JSON within an element of a page.
fn in_page(value: &Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

/// Of every part: its triangles among those that are drawn, how u and v follow from the texture coordinates, its level
/// of detection, what its deviations follow from, and where it is declared.
fn facts(report: &Report<'_>) -> Vec<Value> {
    let mesh = &report.tessellation.mesh;
    let maps: Vec<Option<ChartMap>> = report.tessellation.chart_maps();
    let mut end = 0;
    let mut part = |k: usize| {
        let group = &mesh.groups[k];
        let start = end;
        let triangles = mesh.triangles.get(group.start..group.end).unwrap_or_default();
        end += drawn_of(mesh, triangles).count();
        let statistics = report.variance.parts.get(k);
        json!({
            "name": group.name,
            "start": start,
            "end": end,
            "uv": maps.get(k).copied().flatten(),
            "level": statistics.and_then(|p| p.detection).map(|d| d.level),
            "explained": explained(report, k),
            "declared": report.scripts.declared.get(k),
        })
    };
    (0..mesh.groups.len()).map(&mut part).collect()
}

/// What a change of each parameter alone would explain of a part's deviations, in words.
fn explained(report: &Report<'_>, part: usize) -> Option<String> {
    let explanation = report.variance.parts.get(part)?.explained.as_ref()?;
    let effects = explanation.parameters.iter().filter(|p| p.share >= LEAST_SHARE && p.change.is_finite()).take(3);
    let effects: Vec<String> = effects
        .map(|p| {
            // Angles are read in degrees.
            let (change, unit) = if p.unit == "rad" { (p.change.to_degrees(), "deg") } else { (p.change, &*p.unit) };
            let gap = if unit.is_empty() { "" } else { " " };
            format!("{} {change:+.3}{gap}{unit} would explain {:.0} %", p.name, 100.0 * p.share)
        })
        .collect();
    (!effects.is_empty()).then(|| format!("of the part's deviations {}", effects.join(", ")))
}

/// The labels that the page begins with: where deviations are largest. `step` is that of the deviations in the page.
pub(super) fn labels(report: &Report<'_>, step: f64) -> String {
    let bounds = report.tessellation.mesh.bounds();
    let (centre, size) = (bounds.centre(), bounds.size());
    let share = |place: [f64; 3], k: usize| if size[k] > 0.0 { 0.5 + (place[k] - centre[k]) / size[k] } else { 0.5 };
    let label = |peak: &Peak| {
        let part = report.deviations.texels.part_names.iter().position(|name| *name == peak.part)?;
        let place = [0, 1, 2].map(|k| share(peak.place, k));
        Some(json!({
            "place": place,
            "part": part,
            "column": peak.texel[0],
            "row": peak.texel[1],
            "steps": (peak.distance / step).round(),
            "distance": peak.distance,
            "kind": 1,
        }))
    };
    in_page(&report.variance.peaks.iter().filter_map(label).collect())
}

/// A box for each part that shows and hides it.
pub(super) fn parts(report: &Report<'_>) -> String {
    let mut out = String::new();
    for group in &report.tessellation.mesh.groups {
        let _ = writeln!(out, "<label><input type=\"checkbox\" checked> {}</label>", escape(&group.name));
    }
    out
}

/// The tolerance that all parts which have one share.
fn tolerance(report: &Report<'_>) -> Option<Tolerance> {
    report.variance.overall.tolerance?.tolerance
}

/// A box that gives what is within the tolerance the colour of zero; nothing where there is none.
pub(super) fn tolerance_control(report: &Report<'_>) -> String {
    tolerance(report).map_or_else(String::new, |t| {
        let (lower, upper) = (number(t.lower), number(t.upper));
        let checked = report.scale.tolerance.map_or("", |_| " checked");
        format!("<label><input type=\"checkbox\" id=\"neutral\"{checked}> Neutral from {lower} to {upper} mm</label>\n")
    })
}
