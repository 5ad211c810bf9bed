//! The model's parts as meshes.

use super::frame::Frame;
use super::numbers::{list, number};
use crate::mesh::{Group, TriangleMesh};
use std::collections::HashMap;
use std::fmt::Write;

/// Decimals of normals, and of texture coordinates: a hundredth of a texel of 1,024.
const NORMAL_DECIMALS: usize = 3;
const TEXTURE_DECIMALS: usize = 5;

/// A part's triangles with vertices of their own.
pub(super) struct Part {
    pub(super) name: String,
    /// The vertices of the mesh that it has.
    pub(super) vertices: Vec<u32>,
    /// Its triangles, as indices into `vertices`.
    pub(super) triangles: Vec<[u32; 3]>,
}

/// The parts that have triangles; the whole where the mesh has no groups.
pub(super) fn parts(mesh: &TriangleMesh) -> Vec<Part> {
    let whole = [Group { name: "model".to_owned(), start: 0, end: mesh.triangles.len() }];
    let groups = if mesh.groups.is_empty() { &whole[..] } else { &mesh.groups };
    groups.iter().filter(|g| g.start < g.end).map(|g| Part::of(g, mesh)).collect()
}

impl Part {
    fn of(group: &Group, mesh: &TriangleMesh) -> Part {
        let mut vertices = Vec::new();
        let mut renumbered = HashMap::new();
        let triangles = mesh.triangles[group.start..group.end]
            .iter()
            .map(|t| {
                t.map(|v| {
                    *renumbered.entry(v).or_insert_with(|| {
                        vertices.push(v);
                        vertices.len() as u32 - 1
                    })
                })
            })
            .collect();
        Part { name: group.name.clone(), vertices, triangles }
    }

    /// Its geometry, which other shapes refer to by its number.
    pub(super) fn write(&self, i: usize, mesh: &TriangleMesh, frame: &Frame, out: &mut String) {
        let _ = write!(out, "              <IndexedTriangleSet DEF='Mesh{i}' solid='false' index='");
        list(self.triangles.iter().map(|t| t.map(|v| v.to_string())), out);
        out.push_str("'>\n                <Coordinate point='");
        let point = |v: &u32| frame.local(mesh.positions[*v as usize]).to_array();
        list(self.vertices.iter().map(|v| point(v).map(|c| number(c, frame.decimals))), out);
        out.push_str("'/>\n                <Normal vector='");
        list(self.vertices.iter().map(|&v| mesh.normals[v as usize].map(|c| number(c, NORMAL_DECIMALS))), out);
        out.push_str("'/>\n                <TextureCoordinate point='");
        list(self.vertices.iter().map(|&v| mesh.texcoords[v as usize].map(|c| number(c, TEXTURE_DECIMALS))), out);
        out.push_str("'/>\n              </IndexedTriangleSet>\n");
    }
}
