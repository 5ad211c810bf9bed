//! What the scene says of itself: the colour scale with its figures, a scale bar, and the names of the parts.

use super::frame::Frame;
use super::numbers::{list, list_of, number, quoted};
use super::parts::Part;
use super::viewpoints::TOWARD;
use crate::export::colormap::NO_DATA;
use crate::export::escape::escape;
use crate::export::picture::{self, legend};
use crate::export::round_up;
use crate::export::scale::Scale;
use crate::mesh::TriangleMesh;
use crate::variance::Deviations;
use glam::DVec3;
use std::fmt::Write;

/// Steps of the legend's bar.
const STEPS: usize = 48;

/// The most parts that are named: those with the most triangles.
const MOST_NAMES: usize = 24;

/// Distance of a part's middle from the model's, in halves of its diagonal, from which on the part lies aside.
const ASIDE: f64 = 0.3;

/// Height of the letters of a name, the distance of its middle from the part, and the length of the line to it, in
/// halves of the model's diagonal.
const NAME: f64 = 0.065;
const NAME_DISTANCE: f64 = 0.25;
const LINE: f64 = 0.2;

/// The most letters of a name.
const MOST_LETTERS: usize = 24;

/// The light, at the viewer: what faces it has the colour of its material, so that colours agree with the legend, and
/// what does not is never darker than two fifths of it.
const LIGHT: &str = "<DirectionalLight direction='0 0 -1' intensity='0.6' ambientIntensity='0.4' global='true'/>";

/// Directions that are tried for a name.
const TRIES: usize = 12;

/// Sizes of the legend, seen from a distance of 1: half the height of the view is 0.31.
const BAR: [f64; 2] = [0.018, 0.36];
const LEGEND_RIGHT: f64 = 0.29;
const LETTERS: f64 = 0.019;

/// Ink of texts and lines.
const INK: &str = "0.12 0.14 0.17";

/// An appearance of one colour, whatever the light. Lines have no other.
pub(super) fn flat(colour: &str) -> String {
    format!("<Appearance><Material diffuseColor='0 0 0' emissiveColor='{colour}'/></Appearance>")
}

/// A text with its middle, or its beginning, at the origin.
fn text(lines: &[&str], size: f64, middle: bool, out: &mut String) {
    let justify = if middle { r#""MIDDLE" "MIDDLE""# } else { r#""BEGIN" "MIDDLE""# };
    let string = escape(&lines.iter().map(|line| quoted(line)).collect::<Vec<_>>().join(" "));
    let (size, ink) = (number(size, 6), flat(INK));
    let _ = write!(
        out,
        "<Shape>{ink}<Text string='{string}'>\
         <FontStyle family='\"SANS\"' size='{size}' justify='{justify}'/></Text></Shape>"
    );
}

/// The legend, which stays in the view whatever the viewpoint: a sensor of the viewer's place and direction moves it.
pub(super) fn legend(deviations: &Deviations, scale: &Scale, frame: &Frame, out: &mut String) {
    let far = 1e4 * frame.radius;
    let size = list_of([far; 3], 0);
    let _ = writeln!(out, "    <ProximitySensor DEF='Viewer' size='{size}'/>");
    // Nearer than the model, farther than the nearest that is drawn.
    let near = list_of([0.2 * frame.radius; 3], 9);
    let _ = writeln!(out, "    <Transform DEF='Follow'>\n      {LIGHT}\n      <Transform scale='{near}'>");
    let _ = writeln!(out, "      <Transform translation='{LEGEND_RIGHT} 0 -1'>");
    bar(scale, out);
    let [width, height] = BAR;
    for tick in labelled(scale) {
        let (x, y) = (number(width + 0.008, 6), number(tick / scale.end * height / 2.0, 6));
        let _ = write!(out, "      <Transform translation='{x} {y} 0'>");
        text(&[&picture::number(tick)], LETTERS, false, out);
        out.push_str("</Transform>\n");
    }
    let below = -height / 2.0 - 0.03;
    let words: [(&[&str], f64); 3] = [
        (&["scan outside", "mm"], height / 2.0 + 0.04),
        (&["scan inside"], below),
        (&["striped: no data"], below - 0.03),
    ];
    classes(deviations, below - 0.06, out);
    for (words, y) in words {
        let y = number(y, 6);
        let _ = write!(out, "      <Transform translation='0 {y} 0'>");
        text(words, LETTERS, true, out);
        out.push_str("</Transform>\n");
    }
    out.push_str("      </Transform>\n      </Transform>\n    </Transform>\n");
    for (event, field) in [("position_changed", "set_translation"), ("orientation_changed", "set_rotation")] {
        let _ = writeln!(out, "    <ROUTE fromNode='Viewer' fromField='{event}' toNode='Follow' toField='{field}'/>");
    }
}

/// The colours of texels without a distance, and what they mean.
fn classes(deviations: &Deviations, top: f64, out: &mut String) {
    let classes = legend::classes(deviations);
    for (k, (colour, name)) in classes.iter().filter(|(colour, _)| *colour != NO_DATA).enumerate() {
        let y = top - 0.026 * k as f64;
        let (place, beside) = (list_of([-0.055, y, 0.0], 5), list_of([-0.04, y, 0.0], 5));
        let appearance = flat(&colour.map(|c| number(f64::from(c) / 255.0, 3)).join(" "));
        let _ = write!(
            out,
            "      <Transform translation='{place}'><Shape>{appearance}<Box size='0.014 0.014 0.001'/></Shape></Transform>\n      <Transform translation='{beside}'>"
        );
        text(&[name], LETTERS, false, out);
        out.push_str("</Transform>\n");
    }
}

/// The ticks of a scale that have room for a label: the main ones go first.
fn labelled(scale: &Scale) -> Vec<f64> {
    let mut ticks = scale.ticks();
    ticks.sort_by_key(|tick| !scale.is_main(*tick));
    let room = 1.3 * LETTERS / BAR[1] * 2.0 * scale.end;
    let mut kept: Vec<f64> = Vec::new();
    for tick in ticks {
        if kept.iter().all(|other| (other - tick).abs() >= room) {
            kept.push(tick);
        }
    }
    kept
}

/// The bar of the legend: colours without light.
fn bar(scale: &Scale, out: &mut String) {
    let [width, height] = BAR;
    out.push_str("      <Shape><Appearance/><IndexedTriangleSet solid='false' colorPerVertex='true' index='");
    let quad = |k: usize| [[4 * k, 4 * k + 1, 4 * k + 3], [4 * k, 4 * k + 3, 4 * k + 2]];
    list((0..STEPS).flat_map(quad).map(|t| t.map(|v| v.to_string())), out);
    out.push_str("'><Coordinate point='");
    let corner = |k: usize| {
        let y = |k: usize| (k as f64 / STEPS as f64 - 0.5) * height;
        [[-width / 2.0, y(k)], [width / 2.0, y(k)], [-width / 2.0, y(k + 1)], [width / 2.0, y(k + 1)]]
    };
    list((0..STEPS).flat_map(corner).map(|[x, y]| [number(x, 5), number(y, 5), "0".to_owned()]), out);
    out.push_str("'/><Color color='");
    let colour = |k: usize| scale.colour(scale.end * (2.0 * (k as f64 + 0.5) / STEPS as f64 - 1.0));
    let share = |c: u8| number(f64::from(c) / 255.0, 3);
    list((0..STEPS).flat_map(|k| [colour(k); 4]).map(|c| c.map(share)), out);
    out.push_str("'/></IndexedTriangleSet></Shape>\n");
    // The middle of the scale is as bright as the background.
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)];
    let corners = corners.map(|(x, y)| list_of([x * width / 2.0, y * height / 2.0, 0.0], 5)).join(",");
    let ink = flat(INK);
    let _ = writeln!(
        out,
        "      <Shape>{ink}\
         <LineSet vertexCount='5'><Coordinate point='{corners}'/></LineSet></Shape>"
    );
}

/// A bar of a round length below the model, which turns to the viewer.
pub(super) fn scale_bar(frame: &Frame, out: &mut String) {
    // A quarter to half of the model's diagonal.
    let length = round_up(0.25 * frame.radius);
    let (half, thick, ink) = (length / 2.0, 0.012 * frame.radius, flat(INK));
    let low = frame.shown.low.y - 0.16 * frame.radius;
    let place = list_of([0.0, low, 0.0], frame.decimals);
    let size = list_of([length, thick, thick], frame.decimals + 2);
    let below = list_of([0.0, -0.09 * frame.radius, 0.0], frame.decimals);
    let _ = write!(
        out,
        "    <Transform translation='{place}'><Billboard axisOfRotation='0 0 0'>\
         <Shape>{ink}<Box size='{size}'/></Shape>"
    );
    for end in [-half, half] {
        let end = list_of([end, 0.0, 0.0], frame.decimals + 2);
        let tick = list_of([thick, 4.0 * thick, thick], frame.decimals + 2);
        let _ = write!(out, "<Transform translation='{end}'><Shape>{ink}<Box size='{tick}'/></Shape></Transform>");
    }
    let _ = write!(out, "<Transform translation='{below}'>");
    text(&[&format!("{} mm", number(length, 12))], 0.09 * frame.radius, true, out);
    out.push_str("</Transform></Billboard></Transform>\n");
}

/// The k-th direction in the scene in which a name may lie: by the golden angle about the axis from the front's left
/// on, so that the next one is far from all before.
fn direction(k: usize) -> DVec3 {
    let (sin, cos) = (2.4 * k as f64 - 0.9).sin_cos();
    DVec3::new(sin, 0.35 - 0.1 * (k % 4) as f64, cos)
}

/// The place of a name in the picture of the first viewpoints: its middle, rightwards and upwards, and half its width
/// and height. Millimetres.
struct Label {
    middle: [f64; 2],
    half: [f64; 2],
}

impl Label {
    fn overlaps(&self, other: &Label) -> bool {
        (0..2).all(|k| (self.middle[k] - other.middle[k]).abs() < self.half[k] + other.half[k])
    }
}

/// Names of the parts, each outside of the part with a line to a place of it, in directions in which they do not hide
/// each other as seen from the first viewpoints. A part for which there is none has no name.
pub(super) fn names(parts: &[Part], mesh: &TriangleMesh, frame: &Frame, out: &mut String) {
    let mut largest: Vec<&Part> = parts.iter().collect();
    largest.sort_by_key(|part| std::cmp::Reverse(part.triangles.len()));
    let (size, ink) = (NAME * frame.radius, flat(INK));
    let mut placed: Vec<Label> = Vec::new();
    for (k, part) in largest.into_iter().take(MOST_NAMES).enumerate() {
        let name = shortened(&part.name);
        let place = |toward: DVec3| {
            let (at, end) = callout(part, mesh, toward, frame)?;
            let seen = frame.upright * end(NAME_DISTANCE);
            let right = DVec3::Y.cross(TOWARD).normalize();
            // A letter is half as wide as it is high, on the average.
            let half = [0.27 * size * name.chars().count() as f64, 0.6 * size];
            let label = Label { middle: [seen.dot(right), seen.dot(TOWARD.cross(right))], half };
            let is_free = placed.iter().all(|other| !label.overlaps(other));
            is_free.then(|| (label, at, end(LINE), end(NAME_DISTANCE)))
        };
        let directions = aside(part, mesh, frame).into_iter().chain((k..k + TRIES).map(direction));
        let Some((label, at, line_end, middle)) = directions.into_iter().find_map(place) else { continue };
        placed.push(label);
        let [from, to, beyond] = [at, line_end, middle].map(|p| list_of(p.to_array(), frame.decimals));
        let _ = write!(
            out,
            "            <Shape>{ink}\
             <LineSet vertexCount='2'><Coordinate point='{from},{to}'/></LineSet></Shape>\n            \
             <Transform translation='{beyond}'><Billboard axisOfRotation='0 0 0'>"
        );
        text(&[&name], size, true, out);
        out.push_str("</Billboard></Transform>\n");
    }
}

/// A name that leaves room for others: its beginning and its end, if it is long.
fn shortened(name: &str) -> String {
    let letters: Vec<char> = name.chars().collect();
    if letters.len() <= MOST_LETTERS {
        return name.to_owned();
    }
    let half = MOST_LETTERS / 2 - 1;
    let (begin, end) = (&letters[..half], &letters[letters.len() - half..]);
    begin.iter().chain(&['\u{2026}']).chain(end).collect()
}

/// The direction in the scene in which a part lies aside of the model's axis, if it does.
fn aside(part: &Part, mesh: &TriangleMesh, frame: &Frame) -> Option<DVec3> {
    let sum: DVec3 = part.vertices.iter().map(|v| frame.local(mesh.positions[*v as usize])).sum();
    let middle = frame.upright * sum / part.vertices.len().max(1) as f64;
    let aside = DVec3::new(middle.x, 0.0, middle.z);
    (aside.length() > ASIDE * frame.radius).then(|| aside.normalize())
}

/// The place of a part that is farthest in a direction of the scene, and what lies farther in that direction, by shares
/// of the model's radius, in the file's coordinates.
fn callout(part: &Part, mesh: &TriangleMesh, toward: DVec3, frame: &Frame) -> Option<(DVec3, impl Fn(f64) -> DVec3)> {
    let toward = (frame.upright.transpose() * toward).normalize_or(DVec3::Z);
    let along = |v: &&u32| frame.local(mesh.positions[**v as usize]).dot(toward);
    let vertex = part.vertices.iter().max_by(|a, b| along(a).total_cmp(&along(b)))?;
    let at = frame.local(mesh.positions[*vertex as usize]);
    let radius = frame.radius;
    Some((at, move |share: f64| at + share * radius * toward))
}
