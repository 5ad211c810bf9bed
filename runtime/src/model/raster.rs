//! The triangles of a mesh on the texels of its texture.

use super::Texels;
use crate::mesh::TriangleMesh;
use glam::DVec3;

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
        // Centres of texels between the least and the greatest coordinate, clamped to the texture.
        let cells = |k: usize| {
            let least = p.iter().map(|q| q[k]).fold(f64::INFINITY, f64::min);
            let greatest = p.iter().map(|q| q[k]).fold(f64::NEG_INFINITY, f64::max);
            let first = (least - 0.5).ceil().max(0.0) as u32;
            let last = (greatest - 0.5).floor().min(f64::from(self.size) - 1.0);
            first..if last < 0.0 { first } else { last as u32 + 1 }
        };
        let (columns, rows) = (cells(0), cells(1));
        let mut overlaps = false;
        for y in rows {
            for x in columns.clone() {
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

    /// Checks that the mesh's own texture coordinates give every triangle a place of its own; else says why not.
    pub(super) fn usable(&self, mesh: &TriangleMesh) -> Result<(), String> {
        if let Some(i) = mesh.texcoords.iter().position(|c| c.iter().any(|x| !(0.0..=1.0).contains(x))) {
            return Err(format!("those of vertex {i} lie outside of [0, 1]"));
        }
        if !self.overlapping.is_empty() {
            return Err(format!("{} triangles overlap others on the texture", self.overlapping.len()));
        }
        let flat = (0..mesh.triangles.len())
            .filter(|&t| self.texel_area[t] <= 0.0 && mesh.triangle_area(mesh.triangles[t]) > 0.0)
            .count();
        if flat > 0 { Err(format!("{flat} triangles have no area on the texture")) } else { Ok(()) }
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
