//! Pictures of surfaces without a graphics card: an orthographic rasteriser with a depth buffer, two lights and
//! supersampling.

mod axis;
mod canvas;
mod paint;
#[cfg(test)]
mod tests;
mod view;

pub use axis::cut_open;
pub use paint::{Paint, TexelColours};
pub use view::{Cut, View};

use super::glyphs::{GLYPH_HEIGHT, LEGIBLE, draw, text_width};
use super::picture::Picture;
use super::round_down;
use super::section;
use crate::mesh::TriangleMesh;
use canvas::Canvas;
use rayon::prelude::*;
use view::Camera;

/// The colour behind the surfaces.
const BACKGROUND: [u8; 3] = [250, 250, 251];

/// The colour of letters on it.
const INK: [u8; 3] = [60, 62, 66];

/// The width of the outline where surfaces are cut open, in pixels.
const OUTLINE: f32 = 1.5;

/// The number of samples along each side of a pixel.
const SAMPLES: usize = 2;

/// A surface in a picture.
#[derive(Clone, Copy, Debug)]
pub struct Layer<'a> {
    /// The surface; triangles with vertices that do not exist or are not finite are left out.
    pub mesh: &'a TriangleMesh,
    /// Its colours.
    pub paint: Paint<'a>,
    /// From 0, which hides nothing, to 1, which hides everything behind.
    pub opacity: f32,
}

/// Draws the layers as seen from `view`, fitted to the picture.
#[must_use]
pub fn render(layers: &[Layer<'_>], view: &View, width: usize, height: usize) -> Picture {
    draw_layers(layers, &Camera::fit(layers, view, width * SAMPLES, height * SAMPLES), width, height)
}

/// Every row of layers as seen from every view, in square pictures of `side` pixels, and their scale in pixels a
/// millimetre. All have one scale, and those of one view one centre, so that sizes and places can be compared.
#[must_use]
pub fn pictures(rows: &[&[Layer<'_>]], views: &[View], side: usize) -> (Vec<Picture>, f64) {
    let fit = |view: &View| Camera::fit(rows.iter().copied().flatten(), view, side * SAMPLES, side * SAMPLES);
    let mut cameras: Vec<Camera> = views.iter().map(fit).collect();
    let scale = cameras.iter().map(|camera| camera.scale).fold(f64::INFINITY, f64::min);
    cameras.iter_mut().for_each(|camera| camera.scale = scale);
    let drawn: Vec<(&[Layer<'_>], &Camera)> =
        rows.iter().flat_map(|layers| cameras.iter().map(move |camera| (*layers, camera))).collect();
    let drawn = drawn.into_par_iter().map(|(layers, camera)| draw_layers(layers, camera, side, side));
    (drawn.collect(), scale / SAMPLES as f64)
}

/// Draws a scale bar of 1, 2 or 5 times a power of ten millimetres into the lower left corner, at most a third of the
/// picture long. `scale` is in pixels a millimetre.
pub fn bar(picture: &mut Picture, scale: f64) {
    let longest = picture.width as f64 / 3.0 / scale;
    if !(longest > 0.0 && longest.is_finite()) {
        return;
    }
    let length = round_down(longest);
    let (unit, left) = (letters(picture), GLYPH_HEIGHT);
    let top = picture.height.saturating_sub((GLYPH_HEIGHT + 8) * unit);
    let pixels = ((length * scale).round() as usize).max(1);
    picture.fill(left, top, pixels, 2 * unit, INK);
    draw(picture, left, top + 4 * unit, unit, INK, &format!("{length} mm"));
}

/// Writes a name into the upper left corner, before a paler ground, since surfaces may reach as far.
pub fn name(picture: &mut Picture, text: &str) {
    let unit = letters(picture);
    let (left, rim) = (GLYPH_HEIGHT, 2 * unit);
    picture.fill(
        left - rim.min(left),
        left - rim.min(left),
        text_width(text, unit) + rim,
        7 * unit + 2 * rim,
        BACKGROUND,
    );
    draw(picture, left, left, unit, INK, text);
}

/// Pixels a dot of the letters in a picture: they are legible where it is shown at half its size.
fn letters(picture: &Picture) -> usize {
    (picture.height.min(picture.width) / 140).max(LEGIBLE)
}

fn draw_layers(layers: &[Layer<'_>], camera: &Camera, width: usize, height: usize) -> Picture {
    let drawn: Vec<(Canvas, f32)> = layers
        .iter()
        .map(|layer| {
            let mut canvas = Canvas::new(width * SAMPLES, height * SAMPLES);
            canvas.draw(layer, camera);
            outline(&mut canvas, layer, camera);
            (canvas, layer.opacity.clamp(0.0, 1.0))
        })
        .collect();
    let mut picture = Picture::new(width, height, BACKGROUND);
    let samples = (SAMPLES * SAMPLES) as f32;
    for (i, pixel) in picture.pixels.iter_mut().enumerate() {
        let (x, y) = (i % width * SAMPLES, i / width * SAMPLES);
        let mut sum = [0.0f32; 3];
        for k in 0..SAMPLES * SAMPLES {
            let sample = (y + k / SAMPLES) * width * SAMPLES + x + k % SAMPLES;
            let colour = composite(&drawn, sample);
            for c in 0..3 {
                sum[c] += colour[c];
            }
        }
        *pixel = sum.map(|c| (c / samples).round() as u8);
    }
    picture
}

/// Draws where the plane of a cut meets a surface: the profile.
fn outline(canvas: &mut Canvas, layer: &Layer<'_>, camera: &Camera) {
    if let Some((through, normal)) = camera.cut().filter(|_| camera.limit().is_some()) {
        for segment in section::segments(layer.mesh, through, normal) {
            canvas.line(segment.ends.map(|end| camera.project(end)), OUTLINE * SAMPLES as f32, INK);
        }
    }
}

/// The colour of a sample: layers from the farthest to the nearest over the background. Of equally near ones the later
/// is in front.
fn composite(drawn: &[(Canvas, f32)], sample: usize) -> [f32; 3] {
    let mut colour = BACKGROUND.map(f32::from);
    // Depths with the numbers of their layers. Few layers: looking for the next one is cheaper than sorting.
    let mut last: Option<(f32, usize)> = None;
    loop {
        let mut next: Option<(f32, usize)> = None;
        for (i, (canvas, _)) in drawn.iter().enumerate() {
            let here = (canvas.depth[sample], i);
            let is_left = here.0 > f32::NEG_INFINITY && last.is_none_or(|last| here > last);
            if is_left && next.is_none_or(|next| here < next) {
                next = Some(here);
            }
        }
        let Some((_, i)) = next else { return colour };
        let (canvas, opacity) = &drawn[i];
        for (c, over) in colour.iter_mut().zip(canvas.colour[sample]) {
            *c += opacity * (f32::from(over) - *c);
        }
        last = next;
    }
}
