//! The triangles of a mesh on the texels of its texture.

use super::Texels;
use crate::mesh::TriangleMesh;
use glam::{DVec2, DVec3};

/// Coordinates of textures are written with some six digits.
const ROUNDING: f64 = 1e-3;

/// The triangles that cover the texels of a texture.
pub(super) struct Raster {
    size: u32,
    /// The triangle that covers a texel, with the barycentric coordinates of the texel's centre; one entry a texel.
    cells: Vec<Option<(u32, [f64; 3])>>,
    /// The area of every triangle on the texture, in texels.
    texel_area: Vec<f64>,
    /// The corners of every triangle on the texture, in columns to the right and rows downwards.
    corners: Vec<[[f64; 2]; 3]>,
    /// Triangles that met a texel covered by a triangle with which they share no vertex.
    pub(super) overlapping: Vec<u32>,
}

impl Raster {
    pub(super) fn new(mesh: &TriangleMesh, texcoords: &[[f64; 2]], size: u32) -> Raster {
        let side = f64::from(size);
        let mut raster = Raster {
            size,
            cells: vec![None; size as usize * size as usize],
            texel_area: Vec::with_capacity(mesh.triangles.len()),
            corners: Vec::with_capacity(mesh.triangles.len()),
            overlapping: Vec::new(),
        };
        for (t, corners) in mesh.triangles.iter().enumerate() {
            // Columns to the right and rows downwards, so that a texel's centre is at half-integers.
            let p = corners.map(|i| {
                let [s, t] = texcoords[i as usize];
                [s * side, (1.0 - t) * side]
            });
            raster.add(mesh, t as u32, p);
        }
        raster
    }

    fn add(&mut self, mesh: &TriangleMesh, t: u32, p: [[f64; 2]; 3]) {
        let doubled = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
        self.texel_area.push(0.5 * doubled.abs());
        self.corners.push(p);
        if doubled == 0.0 || !doubled.is_finite() {
            return;
        }
        // Centres of texels between two coordinates, clamped to the texture.
        let cells = |least: f64, greatest: f64| {
            let first = (least - 0.5).ceil().max(0.0) as u32;
            let last = (greatest - 0.5).floor().min(f64::from(self.size) - 1.0);
            first..if last < 0.0 { first } else { last as u32 + 1 }
        };
        let [(left, right), (top, bottom)] = [0, 1].map(|k| extremes(p.map(|q| q[k])));
        let mut overlaps = false;
        for y in cells(top, bottom) {
            // A triangle may be a needle across the whole texture: one column more on either side is rounding.
            let (first, last) = span(&p, f64::from(y) + 0.5);
            for x in cells((first - 1.0).max(left), (last + 1.0).min(right)) {
                let c = [f64::from(x) + 0.5, f64::from(y) + 0.5];
                let weight = |a: [f64; 2], b: [f64; 2]| {
                    ((a[0] - c[0]) * (b[1] - c[1]) - (b[0] - c[0]) * (a[1] - c[1])) / doubled
                };
                let w = [weight(p[1], p[2]), weight(p[2], p[0]), weight(p[0], p[1])];
                if w.iter().any(|w| *w < 0.0) {
                    continue;
                }
                let (other, _) = *self.cells[(y * self.size + x) as usize].get_or_insert((t, w));
                overlaps |= other != t && !share_vertex(mesh, other, t);
            }
        }
        if overlaps {
            self.overlapping.push(t);
        }
    }

    /// The triangles by the mesh's own texture coordinates; says why not if these do not give every triangle a place of
    /// its own.
    pub(super) fn of_own_texture(mesh: &TriangleMesh, size: u32) -> Result<Raster, String> {
        if let Some(i) = mesh.texcoords.iter().position(|c| c.iter().any(|x| !(0.0..=1.0).contains(x))) {
            return Err(format!("those of vertex {i} lie outside of [0, 1]"));
        }
        let area = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|i| DVec2::from(mesh.texcoords[i as usize]));
            0.5 * (b - a).perp_dot(c - a).abs()
        };
        // Drawn, very many triangles on each other would take very long to tell the same.
        let covered: f64 = mesh.triangles.iter().map(area).sum();
        if covered > 1.0 + ROUNDING {
            return Err(format!("triangles overlap: together they have {covered:.1} times the texture's area"));
        }
        let raster = Raster::new(mesh, &mesh.texcoords, size);
        if !raster.overlapping.is_empty() {
            return Err(format!("{} triangles overlap others on the texture", raster.overlapping.len()));
        }
        let flat = (0..mesh.triangles.len())
            .filter(|&t| raster.texel_area[t] <= 0.0 && mesh.triangle_area(mesh.triangles[t]) > 0.0)
            .count();
        if flat > 0 { Err(format!("{flat} triangles have no area on the texture")) } else { Ok(raster) }
    }

    pub(super) fn texels(&self, mesh: &TriangleMesh) -> Texels {
        let mut part_of = vec![0; mesh.triangles.len()];
        for (k, g) in mesh.groups.iter().enumerate() {
            part_of[g.start..g.end].fill(k as u32);
        }
        let part_names = mesh.groups.iter().map(|g| g.name.clone()).collect();
        let mut texels = Texels { width: self.size, height: self.size, part_names, ..Texels::default() };
        for (index, cell) in self.cells.iter().enumerate() {
            let Some((t, w)) = *cell else { continue };
            let corners = mesh.triangles[t as usize];
            let Some(facet_normal) = mesh.triangle_normal(corners) else { continue };
            let mix = |values: &[[f64; 3]]| -> DVec3 {
                corners.iter().zip(w).map(|(corner, weight)| weight * DVec3::from_array(values[*corner as usize])).sum()
            };
            let mixed = if mesh.normals.is_empty() { facet_normal } else { mix(&mesh.normals) };
            let normal = if mixed.length() > 1e-6 { mixed.normalize() } else { facet_normal };
            texels.index.push(index as u32);
            texels.part.push(part_of[t as usize]);
            texels.position.push(mix(&mesh.positions).to_array());
            texels.normal.push(normal.as_vec3().to_array());
            texels.area.push((mesh.triangle_area(corners) / self.texel_area[t as usize]) as f32);
            texels.side.push(longer_side(mesh.corners(corners), self.corners[t as usize]) as f32);
        }
        texels
    }
}

fn extremes<const N: usize>(values: [f64; N]) -> (f64, f64) {
    let empty = (f64::INFINITY, f64::NEG_INFINITY);
    values.into_iter().fold(empty, |(least, greatest), x| (least.min(x), greatest.max(x)))
}

/// Where a line of constant second coordinate enters and leaves a triangle; infinite where it meets none of its edges.
fn span(p: &[[f64; 2]; 3], y: f64) -> (f64, f64) {
    let crossings = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| {
        let (a, b) = (p[a], p[b]);
        let (low, high) = (a[1].min(b[1]), a[1].max(b[1]));
        if !(low..=high).contains(&y) {
            return (f64::INFINITY, f64::NEG_INFINITY);
        }
        if low == high {
            return extremes([a[0], b[0]]);
        }
        let x = a[0] + (b[0] - a[0]) * ((y - a[1]) / (b[1] - a[1]));
        (x, x)
    });
    (extremes(crossings.map(|c| c.0)).0, extremes(crossings.map(|c| c.1)).1)
}

/// The longer side of a texel on a triangle, whose corners on the texture are `places`. Millimetres.
fn longer_side([a, b, c]: [DVec3; 3], places: [[f64; 2]; 3]) -> f64 {
    let [first, second] = [1, 2].map(|k| [0, 1].map(|axis| places[k][axis] - places[0][axis]));
    let doubled = first[0] * second[1] - second[0] * first[1];
    let right = ((b - a) * second[1] - (c - a) * first[1]) / doubled;
    let down = ((c - a) * first[0] - (b - a) * second[0]) / doubled;
    right.length().max(down.length())
}

fn share_vertex(mesh: &TriangleMesh, a: u32, b: u32) -> bool {
    let positions = |t: u32| mesh.triangles[t as usize].map(|i| mesh.positions[i as usize]);
    let second = positions(b);
    positions(a).iter().any(|p| second.contains(p))
}
