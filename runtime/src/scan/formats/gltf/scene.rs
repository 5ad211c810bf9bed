//! The nodes of the default scene, and the primitives of their meshes.

use super::accessor::Numbers;
use super::buffers::{Buffers, of};
use super::document::{Document, INSTANCING, Primitive, extension};
use super::malformed;
use crate::mesh::Group;
use crate::scan::colour;
use crate::scan::error::ScanFault;
use crate::scan::raw::RawMesh;
use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Nodes may share a mesh: there are at most so many vertices and corners of triangles in all, and so many more for
/// each byte of the file.
const MODEST: usize = 1 << 20;
const OF_A_BYTE: usize = 4;

/// The ways in which vertices are connected.
const POINTS: u32 = 0;
const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

/// Reads the scene of a file of `size` bytes.
pub(super) fn read<'d>(document: &'d Document, buffers: &mut Buffers<'d>, size: usize) -> Result<RawMesh, ScanFault> {
    let numbers = Numbers { document, buffers, size };
    // Vertices are numbered with 32 bits.
    let left = OF_A_BYTE.saturating_mul(size).saturating_add(MODEST).min(u32::MAX as usize);
    let mut reader = Reader {
        numbers,
        document,
        raw: RawMesh::default(),
        normals: false,
        colours: false,
        textured: 0,
        bare: 0,
        left,
        lines: 0,
        skinned: 0,
        morphed: 0,
    };
    reader.walk()?;
    reader.finish()
}

struct Reader<'d, 'b> {
    numbers: Numbers<'d, 'b>,
    document: &'d Document,
    raw: RawMesh,
    /// Some primitives have normals; colours; texture coordinates, and some have none.
    normals: bool,
    colours: bool,
    textured: usize,
    bare: usize,
    /// Vertices and corners that may still come.
    left: usize,
    /// Primitives of lines; meshes with skins; with targets.
    lines: usize,
    skinned: usize,
    morphed: usize,
}

impl<'d> Reader<'d, '_> {
    /// Goes through the nodes of the default scene: a tree, in which no node comes twice.
    fn walk(&mut self) -> Result<(), ScanFault> {
        let document = self.document;
        let mut seen = vec![false; document.nodes.len()];
        let mut open: Vec<(usize, DAffine3)> =
            self.roots()?.into_iter().rev().map(|n| (n, DAffine3::IDENTITY)).collect();
        while let Some((index, parent)) = open.pop() {
            let place = || format!("nodes[{index}]");
            let count = document.nodes.len();
            let node = document.nodes.get(index).ok_or_else(|| malformed(place(), of(count)))?;
            if std::mem::replace(&mut seen[index], true) {
                let message = "it is a child twice, or of itself; nodes form trees: export it again";
                return Err(malformed(place(), message));
            }
            let transform = parent * node.transform();
            if let Some(mesh) = node.mesh {
                self.skinned += usize::from(node.skin.is_some());
                self.add_mesh(mesh, &node.name, transform)?;
            }
            open.extend(node.children.iter().rev().map(|child| (*child, transform)));
        }
        Ok(())
    }

    /// The nodes of the default scene, or of the first; of a file without scenes those that are no children.
    fn roots(&mut self) -> Result<Vec<usize>, ScanFault> {
        let (document, index) = (self.document, self.document.scene.unwrap_or(0));
        let count = document.scenes.len();
        if count > 1 {
            let others = count - 1;
            self.raw.warnings.push(format!("scene {index} is read; {others} others are left out"));
        }
        match document.scenes.get(index) {
            Some(scene) => Ok(scene.nodes.clone()),
            None if count > 0 => Err(malformed(format!("scenes[{index}]"), of(count))),
            None => {
                let mut is_child = vec![false; document.nodes.len()];
                for child in document.nodes.iter().flat_map(|node| &node.children) {
                    is_child.get_mut(*child).into_iter().for_each(|is_child| *is_child = true);
                }
                Ok((0..document.nodes.len()).filter(|node| !is_child[*node]).collect())
            }
        }
    }

    fn add_mesh(&mut self, index: usize, node: &str, transform: DAffine3) -> Result<(), ScanFault> {
        let count = self.document.meshes.len();
        let mesh = self.document.meshes.get(index).ok_or_else(|| malformed(format!("meshes[{index}]"), of(count)))?;
        let start = self.raw.triangles.len();
        // Primitives of different materials often have the same vertices.
        let mut known = BTreeMap::new();
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            self.add_primitive(primitive, &format!("meshes[{index}].primitives[{p}]"), transform, &mut known)?;
        }
        let end = self.raw.triangles.len();
        if start < end {
            let names = [node, &mesh.name].into_iter().find(|name| !name.is_empty());
            let name = names.map_or_else(|| format!("mesh {index}"), str::to_owned);
            self.raw.groups.push(Group { name, start, end });
        }
        Ok(())
    }

    fn add_primitive(
        &mut self,
        primitive: &'d Primitive,
        place: &str,
        transform: DAffine3,
        known: &mut BTreeMap<[Option<usize>; 4], usize>,
    ) -> Result<(), ScanFault> {
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        if ![POINTS, TRIANGLES, STRIP, FAN].contains(&mode) {
            if mode > FAN {
                return Err(malformed(place, format!("its mode is {mode}; there are those from 0 to {FAN}")));
            }
            self.lines += 1;
            return Ok(());
        }
        self.morphed += usize::from(!primitive.targets.is_empty());
        let of = |name: &str| primitive.attributes.get(name).copied();
        let Some(positions) = of("POSITION") else { return Ok(()) };
        if let Some(name) = primitive.extensions.keys().find(|name| name.contains("draco"))
            && self.document.accessors.get(positions).is_some_and(|accessor| accessor.buffer_view.is_none())
        {
            return Err(extension(place, name));
        }
        let count = self.numbers.count(positions)?;
        let key = ["POSITION", "NORMAL", "COLOR_0", "TEXCOORD_0"].map(of);
        let first = match known.get(&key) {
            Some(first) => *first,
            None => {
                let first = self.raw.positions.len();
                self.add_vertices(key, positions, place, transform)?;
                known.insert(key, first);
                first
            }
        };
        if mode == POINTS {
            return Ok(());
        }
        let times = if mode == TRIANGLES { 1 } else { 3 };
        let corners = self.corners(primitive.indices, count, times, place)?;
        if mode == TRIANGLES && !corners.len().is_multiple_of(3) {
            let message = format!("it has {} corners of triangles, which are not three each", corners.len());
            return Err(malformed(place, message));
        }
        let flipped = transform.matrix3.determinant() < 0.0;
        let vertex = |corner: u32| first as u32 + corner;
        let triangles = triangles(mode, &corners).map(|t| if flipped { [t[0], t[2], t[1]] } else { t });
        self.raw.triangles.extend(triangles.map(|t| t.map(vertex)));
        Ok(())
    }

    /// The corners of a primitive of `count` vertices, all valid; each is one of so many triangles.
    fn corners(
        &mut self,
        indices: Option<usize>,
        count: usize,
        times: usize,
        place: &str,
    ) -> Result<Vec<u32>, ScanFault> {
        let corners = indices.map_or(Ok(count), |indices| self.numbers.count(indices))?;
        self.take(corners.saturating_mul(times), place)?;
        let Some(indices) = indices else { return Ok((0..count as u32).collect()) };
        let read = self.numbers.read::<1>(indices, &[1])?;
        let is_wrong = |[index]: &&[f64; 1]| !(*index >= 0.0 && *index < count as f64 && index.fract() == 0.0);
        if let Some([index]) = read.iter().find(is_wrong) {
            let (place, index) = (place.to_owned(), *index as i64);
            return Err(ScanFault::IndexOutOfRange { place, what: "vertex", index, count });
        }
        Ok(read.into_par_iter().map(|[index]| index as u32).collect())
    }

    /// Takes vertices or corners of what may still come.
    fn take(&mut self, count: usize, place: &str) -> Result<(), ScanFault> {
        let message =
            "it has more vertices than a file of this size, or nodes repeat meshes too often; export a part of it";
        self.left = self.left.checked_sub(count).ok_or_else(|| malformed(place, message))?;
        Ok(())
    }

    fn add_vertices(
        &mut self,
        [_, normals, colours, texcoords]: [Option<usize>; 4],
        positions: usize,
        place: &str,
        transform: DAffine3,
    ) -> Result<(), ScanFault> {
        self.take(self.numbers.count(positions)?, place)?;
        let positions = self.numbers.read::<3>(positions, &[3])?;
        let count = positions.len();
        for accessor in [normals, colours, texcoords].into_iter().flatten() {
            let found = self.numbers.count(accessor)?;
            if found != count {
                let message = format!("its attributes have {found} and {count} elements; export it again");
                return Err(malformed(place, message));
            }
        }
        let normals = normals.map(|accessor| self.numbers.read::<3>(accessor, &[3])).transpose()?;
        let colours = colours.map(|accessor| self.numbers.read::<3>(accessor, &[3, 4])).transpose()?;
        let texcoords = texcoords.map(|accessor| self.numbers.read::<2>(accessor, &[2])).transpose()?;
        self.normals |= normals.is_some();
        self.colours |= colours.is_some();
        let counted = if texcoords.is_some() { &mut self.textured } else { &mut self.bare };
        *counted += count;
        let raw = &mut self.raw;
        raw.positions.par_extend(positions.into_par_iter().map(|p| transform.transform_point3(p.into()).to_array()));
        raw.placed_by(transform);
        let turn = normal_matrix(transform.matrix3);
        // A vector of zeros is no normal, white the format's colour of a vertex without one.
        raw.normals.extend(normals.map_or_else(
            || vec![[0.0; 3]; count],
            |normals| normals.into_iter().map(|n| (turn * DVec3::from(n)).to_array()).collect(),
        ));
        raw.attributes.colours.extend(colours.map_or_else(
            || vec![[255; 3]; count],
            |colours| colours.into_iter().map(|c| c.map(colour::of_linear)).collect(),
        ));
        // The format's v points down.
        let upward = |[u, v]: [f64; 2]| [u, 1.0 - v];
        raw.texcoords.extend(texcoords.unwrap_or_else(|| vec![[0.0; 2]; count]).into_iter().map(upward));
        Ok(())
    }

    fn finish(self) -> Result<RawMesh, ScanFault> {
        let mut raw = self.raw;
        if raw.positions.is_empty() {
            return Err(ScanFault::NoVertices);
        }
        if !self.normals {
            raw.normals.clear();
        }
        if !self.colours {
            raw.attributes.colours.clear();
        }
        if self.bare > 0 {
            raw.texcoords.clear();
        }
        if raw.groups.len() == 1 {
            raw.groups.clear();
        }
        let instanced = self.document.extensions_used.iter().any(|name| name == INSTANCING);
        let textured = if self.bare > 0 { self.textured } else { 0 };
        let animations = self.document.animations.len();
        let sentences = [
            (self.lines, "primitives of lines are left out"),
            (self.skinned, "meshes have skins, which are not applied: they are in their pose without a skeleton"),
            (self.morphed, "primitives have morph targets, which are left out"),
            (animations, "animations are left out: everything is where it is at rest"),
            (
                usize::from(instanced),
                "extension for copies of nodes (EXT_mesh_gpu_instancing) is not applied: copies are left out",
            ),
            (textured, "vertices have texture coordinates and others none: they are left out"),
        ];
        for (count, what) in sentences.into_iter().filter(|(count, _)| *count > 0) {
            raw.warnings.push(format!("{count} {what}"));
        }
        Ok(raw)
    }
}

/// The matrix that turns normals as another one turns surfaces, up to a positive factor: that of the cofactors, which
/// there is even where the surface becomes flat.
fn normal_matrix(matrix: DMat3) -> DMat3 {
    let (x, y, z) = (matrix.x_axis, matrix.y_axis, matrix.z_axis);
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    if matrix.determinant() < 0.0 { -cofactors } else { cofactors }
}

/// Triangles of corners: three each, a strip, or a fan. Strips turn by corners that are there twice.
fn triangles(mode: u32, corners: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    let count = if mode == TRIANGLES { corners.len() / 3 } else { corners.len().saturating_sub(2) };
    let triangle = move |i: usize| match mode {
        STRIP => [corners[i], corners[i + 1 + i % 2], corners[i + 2 - i % 2]],
        FAN => [corners[i + 1], corners[i + 2], corners[0]],
        _ => [corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]],
    };
    let is_turn = move |t: &[u32; 3]| mode == STRIP && (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]);
    (0..count).map(triangle).filter(move |t| !is_turn(t))
}
