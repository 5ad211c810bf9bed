//! Pictures of the scan and of the model from all sides, with names, scale bars and a key.

use super::glyphs::{LEGIBLE, draw};
use super::picture::legend::{self, Theme};
use super::picture::{self, Picture};
use super::render::{self, Layer, Paint, TexelColours, View};
use super::scale::Scale;
use super::surfels;
use crate::mesh::TriangleMesh;
use crate::variance::Measurement;

/// The file of all views.
pub const VIEWS: &str = "views.png";

/// The file of scan, nominal shape and deviations side by side.
pub const OVERVIEW: &str = "overview.png";

/// Colour of the scan in pictures: clay.
const SCAN_COLOUR: [u8; 3] = [198, 190, 178];

/// Colour of the nominal shape in pictures: a pale steel.
const NOMINAL_COLOUR: [u8; 3] = [178, 188, 202];

/// Colour of the triangles of the scan that the model does not explain: magenta.
const UNMATCHED_COLOUR: [u8; 3] = [196, 60, 160];

/// The sides from which pictures are drawn, but for the one that is cut open, which is the last.
const SIDES: [(&str, View); 6] = [
    ("From the front", View::FRONT),
    ("From the right", View::RIGHT),
    ("From the back", View::BACK),
    ("From the left", View::LEFT),
    ("From above", View::TOP),
    ("From below", View::BELOW),
];

/// What the views show, in the order in which they are drawn.
pub const CAPTIONS: [&str; 7] = [SIDES[0].0, SIDES[1].0, SIDES[2].0, SIDES[3].0, SIDES[4].0, SIDES[5].0, "Cut open"];

/// The most points of a cloud that are drawn, each as a triangle: a picture has fewer pixels.
pub(crate) const MOST_SURFELS: usize = 200_000;

/// Side of one view in pixels.
const SIZE: usize = 440;

/// Pictures of a sheet side by side: seven views and their key are two rows.
const COLUMNS: usize = 4;

/// The views of a measurement, each in the order of [`CAPTIONS`].
#[derive(Clone, Debug)]
pub struct Views {
    /// The scan, with the triangles that the model does not explain in a colour of their own.
    pub scan: Vec<Picture>,
    /// The model in the colours of its deviations.
    pub model: Vec<Picture>,
    /// The model in the scan's colours, from the front and from the back; empty where it has none.
    pub colours: Vec<Picture>,
    /// All of them, with keys.
    pub sheet: Picture,
    /// Scan, nominal shape and deviations side by side, above a legend.
    pub overview: Picture,
}

impl Views {
    /// Draws a scan and the model. `turned` is the rotation from the model's own frame, in which z points up, to the
    /// scan's: a matrix, row by row.
    #[must_use]
    pub fn new(measurement: &Measurement, scan: &TriangleMesh, turned: &[[f64; 3]; 3], scale: &Scale) -> Self {
        let Measurement { tessellation, deviations, unmatched, .. } = measurement;
        let unmatched = &*surfels::shown(unmatched, MOST_SURFELS);
        let colours = TexelColours::new(deviations, scale);
        let coloured = Layer { mesh: &tessellation.mesh, paint: Paint::Texels(&colours), opacity: 1.0 };
        let nominal = Layer { paint: Paint::Plain(NOMINAL_COLOUR), ..coloured };
        let clay = Layer { mesh: scan, paint: Paint::Plain(SCAN_COLOUR), opacity: 1.0 };
        let unmatched = Layer { mesh: unmatched, paint: Paint::Plain(UNMATCHED_COLOUR), opacity: 1.0 };
        let sides = SIDES.iter().map(|(_, view)| view.of_turned(turned));
        let views: Vec<View> = sides.chain([render::cut_open(&tessellation.mesh, turned)]).collect();
        let rows: [&[Layer<'_>]; 3] = [&[clay, unmatched], &[coloured], &[coloured, Layer { opacity: 0.5, ..clay }]];
        let (mut pictures, pixels) = render::pictures(&rows, &views, SIZE);
        for (i, picture) in pictures.iter_mut().enumerate() {
            render::name(picture, CAPTIONS[i % CAPTIONS.len()]);
            render::bar(picture, pixels);
        }
        let reach = picture::number(measurement.report.max_distance).replace('+', "");
        let keys = [
            key(
                "Scan",
                &[
                    (SCAN_COLOUR, "scan"),
                    (UNMATCHED_COLOUR, &format!("farther than {reach} mm,")),
                    (PAPER, "or facing away"),
                ],
            ),
            deviation_key(measurement, scale),
            key("Scan over deviations", &[(PAPER, "The scan is half"), (PAPER, "transparent.")]),
        ];
        let of_row = |(row, key): (&[Picture], Picture)| row.iter().cloned().chain([key]).collect::<Vec<_>>();
        let cells: Vec<Picture> = pictures.chunks(CAPTIONS.len()).zip(keys).flat_map(of_row).collect();
        let sheet = Picture::sheet(&cells, COLUMNS);
        pictures.truncate(2 * CAPTIONS.len());
        let model = pictures.split_off(CAPTIONS.len());
        let layers: [&[Layer<'_>]; 3] = [&[clay, unmatched], &[nominal], &[coloured]];
        let overview = overview(&layers, &views[0], measurement, scale);
        let colours = in_scan_colours(measurement, COLOURED.map(|k| &views[k]));
        Self { scan: pictures, model, colours, sheet, overview }
    }
}

/// The views in the scan's colours, by numbers of [`CAPTIONS`].
pub const COLOURED: [usize; 2] = [0, 2];

/// The model in the scan's colours, if it has any.
fn in_scan_colours(measurement: &Measurement, views: [&View; 2]) -> Vec<Picture> {
    let Measurement { tessellation, deviations, scan_colours: Some(colours), .. } = measurement else {
        return Vec::new();
    };
    let colours = TexelColours::of_scan(deviations, colours);
    let layer = Layer { mesh: &tessellation.mesh, paint: Paint::Texels(&colours), opacity: 1.0 };
    let (mut pictures, pixels) = render::pictures(&[&[layer]], &views.map(|view| *view), SIZE);
    for (picture, k) in pictures.iter_mut().zip(COLOURED) {
        render::name(picture, CAPTIONS[k]);
        render::bar(picture, pixels);
    }
    pictures
}

/// The colour behind keys, in which a swatch is not seen.
const PAPER: [u8; 3] = Theme::LIGHT.paper;

/// Scan, nominal shape and deviations side by side as seen from `view`, above a legend.
fn overview(layers: &[&[Layer<'_>]; 3], view: &View, measurement: &Measurement, scale: &Scale) -> Picture {
    let (mut pictures, pixels) = render::pictures(layers, &[*view], SIZE);
    for (picture, name) in pictures.iter_mut().zip(["Scan", "Nominal", "Deviations"]) {
        render::name(picture, name);
    }
    if let Some(first) = pictures.first_mut() {
        render::bar(first, pixels);
    }
    let row = Picture::sheet(&pictures, layers.len());
    let legend = legend::of_deviations(&measurement.deviations, scale, [row.width, LEGIBLE + 1], &Theme::LIGHT);
    let mut overview = Picture::new(row.width, row.height + legend.height, PAPER);
    overview.put(&row, 0, 0);
    overview.put(&legend, 0, row.height);
    overview
}

/// A cell of the sheet with a heading and lines, each behind a swatch.
fn key(heading: &str, lines: &[([u8; 3], &str)]) -> Picture {
    let (mut cell, ink) = (Picture::new(SIZE, SIZE, PAPER), Theme::LIGHT.ink);
    render::name(&mut cell, heading);
    for (i, (colour, text)) in lines.iter().enumerate() {
        let y = 60 + 30 * i;
        cell.fill(10, y, 14, 14, *colour);
        draw(&mut cell, 34, y, LEGIBLE, ink, text);
    }
    cell
}

fn deviation_key(measurement: &Measurement, scale: &Scale) -> Picture {
    let mut cell = key("Deviations", &[]);
    let legend = legend::of_deviations(&measurement.deviations, scale, [SIZE, LEGIBLE], &Theme::LIGHT);
    cell.put(&legend, 0, 60);
    cell
}
