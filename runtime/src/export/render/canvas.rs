//! Triangles to samples.

use super::Layer;
use super::paint::Paint;
use super::view::{Camera, Limit};
use crate::export::colormap::{NO_DATA, stripes};
use glam::DVec3;
use std::ops::Range;

/// Two lights from the upper left and from the right, as right, up, towards the eye, with strengths; the rest is
/// ambient.
const LIGHTS: [([f32; 3], f32); 2] = [([-0.37, 0.56, 0.74], 0.5), ([0.62, 0.1, 0.78], 0.25)];
const AMBIENT: f32 = 0.42;

/// The share of light that back-facing surfaces return.
const BACK: f32 = 0.8;

/// The period of the stripes of what has no data, in samples.
const STRIPES: usize = 16;

/// Nearest depths and their colours.
pub(super) struct Canvas {
    width: usize,
    height: usize,
    /// Minus infinity where there is nothing.
    pub(super) depth: Vec<f32>,
    pub(super) colour: Vec<[u8; 3]>,
}

/// A triangle's corner on the canvas.
#[derive(Clone, Copy)]
struct Corner {
    /// Column, row, depth.
    at: [f32; 3],
    normal: [f32; 3],
    texcoord: [f32; 2],
    colour: [f32; 3],
}

impl Canvas {
    pub(super) fn new(width: usize, height: usize) -> Canvas {
        Canvas { width, height, depth: vec![f32::NEG_INFINITY; width * height], colour: vec![[0; 3]; width * height] }
    }

    /// Draws a layer's triangles, but for those with corners that do not exist or are not finite.
    pub(super) fn draw(&mut self, layer: &Layer<'_>, camera: &Camera) {
        let limit = camera.limit();
        for triangle in &layer.mesh.triangles {
            if let Some(corners) = corners(layer, camera, *triangle) {
                self.triangle(&corners, layer.paint, limit);
            }
        }
    }

    /// Draws a line of so many samples in width, in front of all else.
    pub(super) fn line(&mut self, [from, to]: [[f32; 3]; 2], width: f32, colour: [u8; 3]) {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let steps = dx.hypot(dy).ceil().max(1.0);
        if !steps.is_finite() || steps > (4 * (self.width + self.height)) as f32 {
            return;
        }
        for step in 0..=steps as usize {
            let share = step as f32 / steps;
            let (x, y) = (from[0] + share * dx, from[1] + share * dy);
            let [columns, rows] = [(x, self.width), (y, self.height)].map(|(middle, size)| {
                let edge = |at: f32| (at.round().max(0.0) as usize).min(size);
                edge(middle - width / 2.0)..edge(middle + width / 2.0)
            });
            for row in rows.map(|row| row * self.width) {
                self.depth[row + columns.start..row + columns.end].fill(f32::INFINITY);
                self.colour[row + columns.start..row + columns.end].fill(colour);
            }
        }
    }

    /// Samples lie at the middles of unit squares; one on an edge may belong to both neighbours, which the depth
    /// comparison settles in favour of the first.
    fn triangle(&mut self, corners: &[Corner; 3], paint: Paint<'_>, limit: Option<Limit>) {
        let [a, b, c] = corners.each_ref().map(|c| c.at);
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let range = |k: usize, size: usize| {
            let low = (a[k].min(b[k]).min(c[k]) - 0.5).ceil().max(0.0);
            let high = (a[k].max(b[k]).max(c[k]) - 0.5).floor();
            let end = if high < 0.0 { 0 } else { (high as usize + 1).min(size) };
            low as usize..end
        };
        let columns = range(0, self.width);
        for y in range(1, self.height) {
            let py = y as f32 + 0.5;
            for x in within(&[a, b, c], py, columns.clone()) {
                let px = x as f32 + 0.5;
                let side =
                    |p: [f32; 3], q: [f32; 3]| ((q[0] - p[0]) * (py - p[1]) - (px - p[0]) * (q[1] - p[1])) / area;
                let w = [side(b, c), side(c, a), side(a, b)];
                if w.iter().any(|w| *w < 0.0) {
                    continue;
                }
                let depth = w[0] * a[2] + w[1] * b[2] + w[2] * c[2];
                let sample = y * self.width + x;
                let is_kept = limit.is_none_or(|limit| depth <= limit.depth(px, py));
                if depth > self.depth[sample] && is_kept {
                    self.depth[sample] = depth;
                    self.colour[sample] = shade(corners, w, paint, [x, y]);
                }
            }
        }
    }
}

/// The columns of a row of samples that a triangle may cover, and one more on either side for roundings: of a long
/// triangle across the canvas these are few.
fn within(triangle: &[[f32; 3]; 3], row: f32, columns: Range<usize>) -> Range<usize> {
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for (p, q) in [0, 1, 2].map(|k| (triangle[k], triangle[(k + 1) % 3])) {
        if (p[1] <= row) != (q[1] <= row) {
            let x = p[0] + (row - p[1]) / (q[1] - p[1]) * (q[0] - p[0]);
            (low, high) = (low.min(x), high.max(x));
        }
    }
    // The row of a corner or an edge.
    if !(low <= high) {
        return columns;
    }
    let first = (low - 2.0).max(0.0) as usize;
    let end = (high + 2.0).max(0.0) as usize;
    first.max(columns.start)..end.min(columns.end)
}

fn corners(layer: &Layer<'_>, camera: &Camera, triangle: [u32; 3]) -> Option<[Corner; 3]> {
    let mesh = layer.mesh;
    if triangle.iter().any(|&v| v as usize >= mesh.positions.len()) {
        return None;
    }
    let positions = mesh.corners(triangle);
    if !positions.iter().all(|p| p.is_finite()) {
        return None;
    }
    let face = mesh.triangle_normal(triangle)?;
    let grey = NO_DATA.map(f32::from);
    let corner = |k: usize| {
        let v = triangle[k] as usize;
        Corner {
            at: camera.project(positions[k]),
            normal: camera.turn(mesh.normals.get(v).map_or(face, |n| DVec3::from_array(*n))),
            texcoord: mesh.texcoords.get(v).map_or([0.0; 2], |t| t.map(|c| c as f32)),
            colour: match layer.paint {
                Paint::Plain(colour) => colour.map(f32::from),
                Paint::Vertices(colours) => colours.get(v).map_or(grey, |c| c.map(f32::from)),
                Paint::Texels(_) => grey,
            },
        }
    };
    Some([0, 1, 2].map(corner))
}

/// The lit colour at barycentric coordinates w, of a sample with this column and row.
fn shade(corners: &[Corner; 3], w: [f32; 3], paint: Paint<'_>, [x, y]: [usize; 2]) -> [u8; 3] {
    let mixed = |f: &dyn Fn(&Corner) -> f32| w[0] * f(&corners[0]) + w[1] * f(&corners[1]) + w[2] * f(&corners[2]);
    let base = match paint {
        Paint::Texels(colours) => {
            let (s, t) = (mixed(&|c| c.texcoord[0]), mixed(&|c| c.texcoord[1]));
            colours.at(s, t).unwrap_or_else(|| stripes(x, y, STRIPES)).map(f32::from)
        }
        Paint::Plain(_) | Paint::Vertices(_) => [0, 1, 2].map(|k| mixed(&|c| c.colour[k])),
    };
    let mut normal = [0, 1, 2].map(|k| mixed(&|c| c.normal[k]));
    let length = normal.iter().map(|c| c * c).sum::<f32>().sqrt().max(1e-9);
    let back = normal[2] < 0.0;
    normal = normal.map(|c| c / if back { -length } else { length });
    let mut light = AMBIENT;
    for (direction, strength) in LIGHTS {
        light += strength * (0..3).map(|k| normal[k] * direction[k]).sum::<f32>().max(0.0);
    }
    let light = if back { light * BACK } else { light };
    base.map(|c| (c * light).clamp(0.0, 255.0) as u8)
}
