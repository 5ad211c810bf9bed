//! A section as a drawing: the outlines of model and scan in the plane of the view that is cut open, with whiskers as
//! long as the deviations, or longer.

use super::{BINS, INK, LEGEND, colour, file, legend};
use crate::export::bins::Bins;
use crate::export::escape::escape;
use crate::export::lookup::TexelsByPlace;
use crate::export::render::{self, Cut};
use crate::export::round_down;
use crate::export::scale::Scale;
use crate::export::section::{Segment, segments};
use crate::mesh::TriangleMesh;
use crate::variance::Measurement;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;
use std::fmt::Write;

/// The largest size of the drawing of the outlines, and the free rim about the model's.
const SIZE: DVec2 = DVec2::new(860.0, 620.0);
const RIM: f64 = 50.0;

/// The room for the scale bar and for what is said below the outlines.
const WORDS: f64 = 84.0;

/// The length of a whisker at the end of the scale is at most this.
const WHISKER: f64 = 28.0;

/// The distance between whiskers along the outline.
const SPACING: f64 = 5.0;

/// A section through a measurement.
#[derive(Clone, Copy, Debug)]
pub struct SectionDrawing<'a> {
    /// What is compared with what.
    pub title: &'a str,
    /// The deviations, and the model's surface.
    pub measurement: &'a Measurement,
    /// The scan.
    pub scan: &'a TriangleMesh,
    /// The rotation from the model's own frame, in which z points up, to the scan's: a matrix, row by row.
    pub turned: [[f64; 3]; 3],
    /// The colour scale.
    pub scale: &'a Scale,
}

/// From the plane, in millimetres, to the drawing.
struct Sheet {
    through: DVec3,
    right: DVec3,
    up: DVec3,
    /// The middle of the model's outline in the plane.
    middle: DVec2,
    /// Units a millimetre.
    fit: f64,
    /// Size of the drawing of the outlines.
    size: DVec2,
}

impl Sheet {
    fn flat(&self, direction: DVec3) -> DVec2 {
        DVec2::new(direction.dot(self.right), -direction.dot(self.up))
    }

    fn place(&self, point: DVec3) -> DVec2 {
        self.size / 2.0 + self.fit * (self.flat(point - self.through) - self.middle)
    }
}

impl SectionDrawing<'_> {
    /// The drawing as an SVG file.
    pub(in crate::export) fn file(&self) -> String {
        let mesh = &self.measurement.tessellation.mesh;
        let view = render::cut_open(mesh, &self.turned);
        let Cut { normal, through } = view.cut.unwrap_or(Cut { normal: view.toward, through: None });
        let through = through.unwrap_or_else(|| mesh.bounds().centre());
        let up = view.up.reject_from_normalized(normal).normalize_or(normal.any_orthonormal_vector());
        let outline = segments(mesh, through, normal);
        let sheet = sheet(&outline, through, up.cross(normal), up);
        let factor = round_down((WHISKER / (self.scale.end * sheet.fit)).max(1.0));
        let mut content = String::new();
        let scanned = segments(self.scan, through, normal);
        path(scanned.iter().map(|s| s.ends), &sheet, "#b09a78", 0.8, &mut content);
        self.whiskers(&outline, &sheet, factor, &mut content);
        path(outline.iter().map(|s| s.ends), &sheet, "#1d2127", 1.2, &mut content);
        self.words(&sheet, [through, normal], factor, &mut content);
        let deviations = &self.measurement.deviations;
        let bins = Bins::of_deviations(deviations, self.scale, BINS, None);
        let top = sheet.size.y + WORDS;
        let _ = writeln!(content, "<g transform=\"translate(0 {top})\">\n{}</g>", legend(&bins, self.scale));
        file(&format!("{}: section", self.title), &content, [sheet.size.x, top + LEGEND[1]])
    }

    /// Lines along the normals from the model's outline, those of a colour together.
    fn whiskers(&self, outline: &[Segment], sheet: &Sheet, factor: f64, out: &mut String) {
        let Measurement { tessellation, deviations, .. } = self.measurement;
        let (mesh, texels) = (&tessellation.mesh, TexelsByPlace::new(deviations));
        let part = |triangle: usize| mesh.groups.partition_point(|group| group.end <= triangle) as u32;
        let mut lines: BTreeMap<[u8; 3], String> = BTreeMap::new();
        let mut since = SPACING / 2.0;
        for segment in outline {
            let [a, b] = segment.ends.map(|end| sheet.place(end));
            let length = a.distance(b);
            let mut at = SPACING - since;
            while at <= length {
                let share = at / length.max(1e-9);
                at += SPACING;
                let place = segment.ends[0].lerp(segment.ends[1], share);
                let Some(coordinates) = texture_coordinates(mesh, segment, share) else { continue };
                let texel = texels.nearest(coordinates, part(segment.triangle), place.to_array());
                let Some(i) = texel.filter(|i| !deviations.signed(*i).is_nan()) else { continue };
                let deviation = f64::from(deviations.signed(i));
                let normal = DVec3::from_array(deviations.texels.normal[i].map(f64::from));
                let from = sheet.place(place);
                let to = from + sheet.fit * factor * deviation * sheet.flat(normal);
                let line = lines.entry(self.scale.colour(deviation)).or_default();
                let _ = write!(line, "M{:.1} {:.1}L{:.1} {:.1}", from.x, from.y, to.x, to.y);
            }
            since = (since + length) % SPACING;
        }
        for (shade, line) in lines {
            // What is nearly white could not be seen on paper.
            let stroke = if shade.iter().all(|c| *c > 200) { "#a9aeb6".to_owned() } else { colour(shade) };
            let _ = writeln!(out, "<path fill=\"none\" stroke=\"{stroke}\" stroke-width=\"1.6\" d=\"{line}\"/>");
        }
    }

    /// The scale bar, and what is seen.
    fn words(&self, sheet: &Sheet, [through, normal]: [DVec3; 2], factor: f64, out: &mut String) {
        let length = round_down(sheet.size.x / 4.0 / sheet.fit);
        let (end, y) = (20.0 + length * sheet.fit, sheet.size.y - 8.0);
        let _ = writeln!(out, "<path fill=\"none\" stroke=\"{INK}\" stroke-width=\"2\" d=\"M20 {y}H{end:.1}\"/>");
        let _ = writeln!(out, "<text x=\"{:.1}\" y=\"{:.1}\">{length} mm</text>", end + 8.0, y + 4.0);
        let list = |v: DVec3, digits: usize| v.to_array().map(|c| format!("{:.digits$}", c + 0.0)).join(", ");
        let times = if factor > 1.0 { format!("{factor} times as long") } else { "to scale".to_owned() };
        let lines = [
            format!("Dark: model. Brown: scan, to scale. Whiskers: deviations along the normals, drawn {times}."),
            "Where there is no whisker, nothing was measured.".to_owned(),
            format!(
                "Plane through ({}) mm with the normal ({}) in the scan's frame.",
                list(through, 2),
                list(normal, 4)
            ),
        ];
        for (k, text) in lines.iter().enumerate() {
            let y = sheet.size.y + 18.0 + 16.0 * k as f64;
            let _ = writeln!(out, "<text x=\"20\" y=\"{y}\">{}</text>", escape(text));
        }
    }
}

/// The sheet on which an outline fills the drawing but for a rim.
fn sheet(outline: &[Segment], through: DVec3, right: DVec3, up: DVec3) -> Sheet {
    let mut sheet = Sheet { through, right, up, middle: DVec2::ZERO, fit: 1.0, size: SIZE };
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for end in outline.iter().flat_map(|segment| segment.ends) {
        let place = sheet.flat(end - through);
        (low, high) = (low.min(place), high.max(place));
    }
    if low.x <= high.x {
        let room = (SIZE - 2.0 * RIM) / (high - low).max(DVec2::splat(1e-9));
        (sheet.middle, sheet.fit) = ((low + high) / 2.0, room.min_element());
        sheet.size.y = (sheet.fit * (high.y - low.y) + 2.0 * RIM).ceil();
    }
    sheet
}

/// Line segments as one path, but for what lies beyond the drawing.
fn path(lines: impl Iterator<Item = [DVec3; 2]>, sheet: &Sheet, stroke: &str, width: f64, out: &mut String) {
    let mut data = String::new();
    let mut last = DVec2::NAN;
    let is_seen = |p: DVec2| p.cmpge(DVec2::ZERO).all() && p.cmple(sheet.size).all();
    for ends in lines {
        let [a, b] = ends.map(|end| sheet.place(end));
        if !is_seen(a) || !is_seen(b) {
            continue;
        }
        if a.distance(last) > 0.05 || last.is_nan() {
            let _ = write!(data, "M{:.1} {:.1}", a.x, a.y);
        }
        let _ = write!(data, "L{:.1} {:.1}", b.x, b.y);
        last = b;
    }
    let _ = writeln!(out, "<path fill=\"none\" stroke=\"{stroke}\" stroke-width=\"{width}\" d=\"{data}\"/>");
}

/// The texture coordinates at a share of a segment's length.
fn texture_coordinates(mesh: &TriangleMesh, segment: &Segment, share: f64) -> Option<[f64; 2]> {
    let triangle = mesh.triangles[segment.triangle];
    let corner = |k: usize| mesh.texcoords.get(triangle[k] as usize).map(|c| DVec2::from_array(*c));
    let end = |([a, b], along): ([usize; 2], f64)| Some(corner(a)?.lerp(corner(b)?, along));
    let [from, to] = segment.between.map(end);
    Some(from?.lerp(to?, share).to_array())
}
