//! What of the scan itself the report shows: its colours, and how certain distances to a cloud are.

use super::Report;
use super::tables::number;
use crate::export::escape::escape;
use crate::variance::{ColourSource, ColourSummary, Stretch};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// What the colours are called, and how they came about.
fn described(summary: &ColourSummary) -> (&'static str, String) {
    match (summary.source, &summary.stretch) {
        (ColourSource::Intensities, Some(Stretch { percentiles: [low, high], black, white })) => (
            "Scan's intensity",
            format!(
                "Intensities of the scan at the texels: {} and less is black, {} and more is white (percentiles {low} and {high} of \
                 the texels)",
                number(*black),
                number(*white)
            ),
        ),
        (ColourSource::Intensities, None) => ("Scan's intensity", "Intensities of the scan at the texels".to_owned()),
        (ColourSource::Colours, _) => ("Scan's colour", "Colours of the scan at the texels".to_owned()),
    }
}

/// The choice of the view that shows them; nothing where there are none.
pub(super) fn control(report: &Report<'_>) -> String {
    let Some(summary) = report.variance.colour.as_ref().filter(|_| report.colour_png.is_some()) else {
        return String::new();
    };
    format!("<label><input type=\"checkbox\" id=\"scan-coloured\"> {}</label>\n", escape(described(summary).0))
}

/// The texture of the colours, which the view takes its colours from.
pub(super) fn colours(report: &Report<'_>) -> String {
    let Some((summary, png)) = report.variance.colour.as_ref().zip(report.colour_png) else { return String::new() };
    let (name, caption) = described(summary);
    let data = STANDARD.encode(png);
    format!(
        "<figure><img id=\"scan-colours\" alt=\"{}\" src=\"data:image/png;base64,{data}\"><figcaption>{}; striped where there is no \
         data.</figcaption></figure>\n",
        escape(name),
        caption
    )
}

/// The map of the uncertainty.
pub(super) fn uncertainty(png: &[u8]) -> String {
    format!(
        "<figure><img alt=\"Uncertainty of the distances\" src=\"data:image/png;base64,{}\"><figcaption>Standard uncertainty of the \
         distance at each texel by the scatter of the points in its cylinder, without what all points share, such as an error of \
         registration; striped where there is no data.</figcaption></figure>\n",
        STANDARD.encode(png)
    )
}
