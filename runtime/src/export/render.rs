//! Views of meshes: a z-buffer rasteriser without a GPU, for the pictures of the report.

use super::colormap::{NO_DATA, diverging};
use super::picture::Picture;
use crate::mesh::TriangleMesh;
use crate::model::Motion;
use crate::variance::{Deviations, signed_distances};

/// Samples a pixel along either side.
const SUPERSAMPLING: usize = 2;

/// Behind everything.
const BACKGROUND: [u8; 3] = [252, 252, 252];

/// What a mesh is painted with.
#[derive(Clone, Debug)]
pub enum Paint {
    /// One colour.
    Plain([u8; 3]),
    /// A colour a texel, looked up at the mesh's texture coordinates.
    Texture(Texture),
}

/// Colours by texel.
#[derive(Clone, Debug)]
pub struct Texture {
    width: usize,
    height: usize,
    /// `None` where no chart is.
    colours: Vec<Option<[u8; 3]>>,
}

impl Texture {
    /// The colours of signed deviations on a scale that ends at `end` millimetres.
    #[must_use]
    pub fn of_deviations(deviations: &Deviations, end: f64) -> Texture {
        let (width, height) = (deviations.texels.width as usize, deviations.texels.height as usize);
        let distances = signed_distances(deviations);
        let mut colours = vec![None; width * height];
        for &index in &deviations.texels.index {
            colours[index as usize] = Some(diverging(f64::from(distances[index as usize]) / end));
        }
        Texture { width, height, colours }
    }

    /// The colour at texture coordinates; beside a chart that of the nearest covered texel up to two away.
    fn at(&self, [s, t]: [f64; 2]) -> [u8; 3] {
        let x = (s * self.width as f64).floor() as i64;
        let y = ((1.0 - t) * self.height as f64).floor() as i64;
        let texel = |x: i64, y: i64| {
            let inside = x >= 0 && y >= 0 && x < self.width as i64 && y < self.height as i64;
            inside.then(|| self.colours[y as usize * self.width + x as usize]).flatten()
        };
        (0..=2i64)
            .flat_map(|r| (-r..=r).flat_map(move |dy| (-r..=r).map(move |dx| (dx, dy))))
            .find_map(|(dx, dy)| texel(x + dx, y + dy))
            .unwrap_or(NO_DATA)
    }
}

/// Where one looks from, in the model's own position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Angle around z from the x axis. Radians.
    pub azimuth: f64,
    /// Angle above the x-y plane. Radians.
    pub elevation: f64,
}

/// The standard views: from the front and above, from the back and above, from the side, into it from above.
pub const VIEWS: [View; 4] = [
    View { azimuth: -1.05, elevation: 0.45 },
    View { azimuth: 2.09, elevation: 0.45 },
    View { azimuth: -1.5708, elevation: 0.0 },
    View { azimuth: -1.05, elevation: 1.15 },
];

/// Draws meshes from a view, without perspective, fitted to the frame. `pose` says where the model's own position
/// is in the meshes' coordinates, so that up is up also for a scan that lies on its side.
#[must_use]
pub fn render(meshes: &[(&TriangleMesh, &Paint)], pose: &Motion, view: View, width: usize, height: usize) -> Picture {
    let frame = Frame::new(meshes, pose, view, width * SUPERSAMPLING, height * SUPERSAMPLING);
    let mut canvas = Canvas::new(width * SUPERSAMPLING, height * SUPERSAMPLING);
    for (mesh, paint) in meshes {
        for triangle in &mesh.triangles {
            canvas.draw(&frame, mesh, paint, *triangle);
        }
    }
    canvas.shrink(width, height)
}

/// Sets pictures of one size side by side, `columns` a row.
#[must_use]
pub fn sheet(pictures: &[Picture], columns: usize) -> Picture {
    let (width, height) = pictures.first().map_or((1, 1), |p| (p.width, p.height));
    let columns = columns.max(1);
    let rows = pictures.len().div_ceil(columns).max(1);
    let mut sheet = Picture::new(width * columns, height * rows, BACKGROUND);
    for (i, picture) in pictures.iter().enumerate() {
        let (left, top) = (i % columns * width, i / columns * height);
        for y in 0..picture.height.min(height) {
            let from = &picture.pixels[y * picture.width..][..picture.width.min(width)];
            let start = (top + y) * sheet.width + left;
            sheet.pixels[start..start + from.len()].copy_from_slice(from);
        }
    }
    sheet
}

/// From coordinates to the canvas: x to the right, y down, z towards the viewer.
struct Frame {
    axes: [[f64; 3]; 3],
    centre: [f64; 2],
    scale: f64,
    middle: [f64; 2],
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Frame {
    fn new(meshes: &[(&TriangleMesh, &Paint)], pose: &Motion, view: View, width: usize, height: usize) -> Frame {
        let (sa, ca) = view.azimuth.sin_cos();
        let (se, ce) = view.elevation.sin_cos();
        let axes = [[-sa, ca, 0.0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]].map(|a| pose.direction(a));
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for p in meshes.iter().flat_map(|(m, _)| &m.positions) {
            for k in 0..2 {
                low[k] = low[k].min(dot(axes[k], *p));
                high[k] = high[k].max(dot(axes[k], *p));
            }
        }
        let extent = |k: usize| (high[k] - low[k]).max(1e-9);
        // A margin of 4 % on every side.
        let scale = (0.92 * width as f64 / extent(0)).min(0.92 * height as f64 / extent(1));
        Frame {
            axes,
            centre: [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])],
            scale: if scale.is_finite() { scale } else { 1.0 },
            middle: [0.5 * width as f64, 0.5 * height as f64],
        }
    }

    fn project(&self, p: [f64; 3]) -> [f64; 3] {
        let x = (dot(self.axes[0], p) - self.centre[0]) * self.scale + self.middle[0];
        let y = self.middle[1] - (dot(self.axes[1], p) - self.centre[1]) * self.scale;
        [x, y, dot(self.axes[2], p)]
    }

    /// Brightness of a surface with this normal: light over the viewer's left shoulder, both sides lit.
    fn shade(&self, normal: [f64; 3]) -> f64 {
        let n = self.axes.map(|a| dot(a, normal));
        let size = dot(n, n).sqrt();
        if size.is_nan() || size <= 0.0 {
            return 0.7;
        }
        let side = if n[2] < 0.0 { -1.0 / size } else { 1.0 / size };
        let light = [-0.35, 0.45, 0.82];
        0.42 + 0.58 * (dot(n, light) * side).max(0.0)
    }
}

struct Canvas {
    width: usize,
    height: usize,
    depth: Vec<f64>,
    colour: Vec<[u8; 3]>,
}

impl Canvas {
    fn new(width: usize, height: usize) -> Canvas {
        let count = width * height;
        Canvas { width, height, depth: vec![f64::NEG_INFINITY; count], colour: vec![BACKGROUND; count] }
    }

    fn draw(&mut self, frame: &Frame, mesh: &TriangleMesh, paint: &Paint, triangle: [u32; 3]) {
        let corners = triangle.map(|i| mesh.positions[i as usize]);
        let p = corners.map(|c| frame.project(c));
        let doubled = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
        if doubled == 0.0 || !doubled.is_finite() {
            return;
        }
        let shades = match mesh.normals.is_empty() {
            true => [frame.shade(facet_normal(corners)); 3],
            false => triangle.map(|i| frame.shade(mesh.normals[i as usize])),
        };
        let range = |k: usize, size: usize| {
            let least = p.iter().map(|q| q[k]).fold(f64::INFINITY, f64::min);
            let most = p.iter().map(|q| q[k]).fold(f64::NEG_INFINITY, f64::max);
            (least - 0.5).ceil().max(0.0) as usize..((most + 0.5).floor().max(0.0) as usize).min(size)
        };
        let columns = range(0, self.width);
        for y in range(1, self.height) {
            for x in columns.clone() {
                let c = [x as f64 + 0.5, y as f64 + 0.5];
                let weight = |a: [f64; 3], b: [f64; 3]| {
                    ((a[0] - c[0]) * (b[1] - c[1]) - (b[0] - c[0]) * (a[1] - c[1])) / doubled
                };
                let w = [weight(p[1], p[2]), weight(p[2], p[0]), weight(p[0], p[1])];
                let depth = w[0] * p[0][2] + w[1] * p[1][2] + w[2] * p[2][2];
                let at = y * self.width + x;
                if w.iter().all(|w| *w >= 0.0) && depth > self.depth[at] {
                    self.depth[at] = depth;
                    let shade = w[0] * shades[0] + w[1] * shades[1] + w[2] * shades[2];
                    self.colour[at] = colour(mesh, paint, triangle, w).map(|c| (f64::from(c) * shade) as u8);
                }
            }
        }
    }

    fn shrink(&self, width: usize, height: usize) -> Picture {
        let mut picture = Picture::new(width, height, BACKGROUND);
        let samples = (SUPERSAMPLING * SUPERSAMPLING) as u32;
        for (i, pixel) in picture.pixels.iter_mut().enumerate() {
            let mut sum = [0u32; 3];
            for j in 0..SUPERSAMPLING * SUPERSAMPLING {
                let x = i % width * SUPERSAMPLING + j % SUPERSAMPLING;
                let y = i / width * SUPERSAMPLING + j / SUPERSAMPLING;
                for (s, c) in sum.iter_mut().zip(self.colour[y * self.width + x]) {
                    *s += u32::from(c);
                }
            }
            *pixel = sum.map(|s| (s / samples) as u8);
        }
        picture
    }
}

fn facet_normal([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let [p, q, r] = [a, b, c].map(glam::DVec3::from);
    (q - p).cross(r - p).to_array()
}

fn colour(mesh: &TriangleMesh, paint: &Paint, triangle: [u32; 3], w: [f64; 3]) -> [u8; 3] {
    match paint {
        Paint::Plain(colour) => *colour,
        Paint::Texture(texture) => {
            let coordinate = |k: usize| {
                triangle.iter().zip(w).map(|(i, w)| mesh.texcoords.get(*i as usize).map_or(0.0, |t| t[k]) * w).sum()
            };
            texture.at([coordinate(0), coordinate(1)])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(z: f64, half: f64) -> TriangleMesh {
        TriangleMesh {
            positions: vec![[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..TriangleMesh::default()
        }
    }

    const FROM_ABOVE: View = View { azimuth: -std::f64::consts::FRAC_PI_2, elevation: std::f64::consts::FRAC_PI_2 };

    #[test]
    fn what_is_nearer_hides_what_is_behind() {
        let (low, high) = (square(0.0, 10.0), square(1.0, 5.0));
        let (red, blue) = (Paint::Plain([200, 0, 0]), Paint::Plain([0, 0, 200]));
        for meshes in [[(&low, &red), (&high, &blue)], [(&high, &blue), (&low, &red)]] {
            let picture = render(&meshes, &Motion::IDENTITY, FROM_ABOVE, 100, 100);
            let at = |x: usize, y: usize| picture.pixels[y * 100 + x];
            assert!(at(50, 50)[2] > 50 && at(50, 50)[0] == 0, "the nearer square is in the middle");
            assert!(at(12, 50)[0] > 50 && at(12, 50)[2] == 0, "the farther one around it");
            assert_eq!(at(1, 50), BACKGROUND);
        }
    }

    #[test]
    fn a_square_covers_its_area() {
        let mesh = square(0.0, 10.0);
        let picture = render(&[(&mesh, &Paint::Plain([0, 0, 0]))], &Motion::IDENTITY, FROM_ABOVE, 200, 100);
        let covered = picture.pixels.iter().filter(|p| **p != BACKGROUND).count() as f64;
        // 92 % of the height squared; up to a pixel more on every side.
        assert!((covered / 92.0f64.powi(2) - 1.0).abs() < 0.03, "{covered}");
    }

    #[test]
    fn texels_beside_a_chart_take_their_neighbours_colour() {
        let mut colours = vec![None; 64];
        colours[3 * 8 + 3] = Some([1, 2, 3]);
        let texture = Texture { width: 8, height: 8, colours };
        let centre = |x: usize, y: usize| [(x as f64 + 0.5) / 8.0, 1.0 - (y as f64 + 0.5) / 8.0];
        assert_eq!(texture.at(centre(3, 3)), [1, 2, 3]);
        assert_eq!(texture.at(centre(5, 4)), [1, 2, 3]);
        assert_eq!(texture.at(centre(6, 3)), NO_DATA);
    }
}
