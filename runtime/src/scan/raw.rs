//! The geometry of a file as it stands there, in the file's unit: the output of the readers.

use super::attributes::Attributes;
use super::crop::Sides;
use super::error::ScanFault;
use super::polygon::{Budget, Triangulation, is_tangled, triangulate};
use super::rounded::{Frame, Rounded};
use crate::mesh::{Group, TriangleMesh};
use foldhash::fast::RandomState;
use glam::{DAffine3, DVec3};
use std::collections::HashMap;

/// The largest coordinate that is believed, in millimetres: a thousand kilometres. Squares and products of such lengths
/// stay finite.
const FARTHEST: f64 = 1e12;
/// A polygon of no more corners does no harm, whatever its vertices.
const MANY: u32 = 32;

/// Neither NaN nor infinite nor absurdly large.
pub(super) fn is_usable(coordinate: f64) -> bool {
    coordinate.abs() <= FARTHEST
}

/// A file's geometry. Every index is valid; everything else may be as bad as the file.
#[derive(Clone, Debug, Default)]
pub(super) struct RawMesh {
    pub(super) positions: Vec<[f64; 3]>,
    /// No two positions are equal, and none become so when they are scaled: they are numbers of single precision.
    pub(super) distinct: bool,
    /// None, or as many as positions.
    pub(super) normals: Vec<[f64; 3]>,
    /// None, or as many as positions.
    pub(super) texcoords: Vec<[f64; 2]>,
    /// None, or as many as triangles: normals of their corners (of formats that have them there).
    pub(super) corner_normals: Vec<[[f64; 3]; 3]>,
    /// None, or as many as triangles.
    pub(super) corner_texcoords: Vec<[[f64; 2]; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// None, or they cover all triangles.
    pub(super) groups: Vec<Group>,
    /// The faces of more than three corners, each of which is a fan of triangles so far.
    pub(super) polygons: Vec<Polygon>,
    /// As many as positions, or none.
    pub(super) attributes: Attributes,
    /// The unit that the file states, in millimetres.
    pub(super) unit: Option<f64>,
    /// The file does not state it: it is that which files of the format have.
    pub(super) is_usual_unit: bool,
    /// What the sides of a box cut through, if one was cut out.
    pub(super) sides: Option<Box<Sides>>,
    /// Names of the fields of its points that are not read.
    pub(super) ignored: Vec<String>,
    /// Sentences about what of the file is left out, or looks as if it was lost before.
    pub(super) warnings: Vec<String>,
}

/// A face of more than three corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polygon {
    /// The first triangle of its fan.
    pub(super) start: usize,
    /// Number of its corners: there are two fewer triangles.
    pub(super) corners: u32,
    /// Its place in the file: the line, or the row of its element, counted from 1.
    pub(super) place: u32,
}

/// Something odd that a file may have many times.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Odd<T> {
    /// The first.
    pub(super) first: T,
    /// The number of all.
    pub(super) count: usize,
}

impl<T> Odd<T> {
    /// Counts one more.
    pub(super) fn add(all: &mut Option<Self>, first: impl FnOnce() -> T) {
        all.get_or_insert_with(|| Self { first: first(), count: 0 }).count += 1;
    }

    /// A remark on the others for the end of a clause about the first; empty if there are none.
    pub(super) fn others(&self) -> String {
        if self.count > 1 { format!(" ({} more like it)", self.count - 1) } else { String::new() }
    }
}

impl RawMesh {
    /// The place and the corners of a polygon that goes round in itself, if there is one.
    pub(super) fn tangled_polygon(&self) -> Option<(u32, u32)> {
        let is_tangled = |polygon: &&Polygon| {
            let Polygon { start, corners, .. } = **polygon;
            corners > MANY && is_tangled(corners_of_fan(&self.triangles[start..start + corners as usize - 2]))
        };
        self.polygons.iter().find(is_tangled).map(|polygon| (polygon.place, polygon.corners))
    }

    /// Takes down that the positions which have come last were moved: their coordinates were rounded before.
    pub(super) fn placed_by(&mut self, transform: DAffine3) {
        let Rounded { frames, of_points } = &mut self.attributes.rounded;
        let frame = Frame::moved_by(transform);
        if frames.last() != Some(&frame) {
            frames.push(frame);
        }
        // A file of more nodes than that has few points in each.
        of_points.resize(self.positions.len(), u16::try_from(frames.len() - 1).unwrap_or(u16::MAX));
    }

    /// Scales to millimetres and checks that every position is usable.
    pub(super) fn into_millimetres(mut self, unit: f64) -> Result<Self, ScanFault> {
        for (i, position) in self.positions.iter_mut().enumerate() {
            *position = position.map(|c| c * unit);
            if !position.iter().all(|&c| is_usable(c)) {
                return Err(ScanFault::NonFinite { vertex: i + 1, at: *position });
            }
        }
        for station in &mut self.attributes.stations.places {
            station.place = station.place.map(|c| c * unit);
        }
        Ok(self)
    }

    /// Replaces the fans of concave polygons, whose triangles leave the polygon, by triangles that do not. Those that
    /// cross themselves stay fans.
    pub(super) fn split_concave_polygons(&mut self) -> Option<Odd<u32>> {
        let mut crossing = None;
        let mut budget = Budget::default();
        let mut points = Vec::new();
        for Polygon { start, corners, place } in std::mem::take(&mut self.polygons) {
            let triangles = start..start + corners as usize - 2;
            points.clear();
            let vertices = corners_of_fan(&self.triangles[triangles.clone()]);
            points.extend(vertices.map(|vertex| DVec3::from(self.positions[vertex as usize])));
            match triangulate(&points, &mut budget) {
                Triangulation::Fan => {}
                Triangulation::Impossible => Odd::add(&mut crossing, || place),
                Triangulation::Ears(ears) => {
                    rearrange(&mut self.triangles[triangles.clone()], &ears);
                    if !self.corner_normals.is_empty() {
                        rearrange(&mut self.corner_normals[triangles.clone()], &ears);
                    }
                    if !self.corner_texcoords.is_empty() {
                        rearrange(&mut self.corner_texcoords[triangles], &ears);
                    }
                }
            }
        }
        crossing
    }

    /// Normals of unit length; none in the file, or one that is zero or not finite, is replaced by the vertex's of
    /// `computed`.
    pub(super) fn with_usable_normals(mut self, computed: &[[f64; 3]]) -> Self {
        let unit = |normal: [f64; 3], vertex: usize| match DVec3::from(normal).try_normalize() {
            Some(unit) => unit.into(),
            None => computed[vertex],
        };
        for (triangle, normals) in self.triangles.iter().zip(&mut self.corner_normals) {
            *normals = std::array::from_fn(|c| unit(normals[c], triangle[c] as usize));
        }
        if self.normals.is_empty() {
            self.normals = computed.to_vec();
        }
        self.normals = self.normals.iter().enumerate().map(|(i, &normal)| unit(normal, i)).collect();
        self
    }

    /// One vertex for every different combination of position, texture coordinate and normal at a corner, and what
    /// belongs to it. Vertices that no triangle uses are left out where corners have normals or texture coordinates.
    pub(super) fn split_corners(self) -> (TriangleMesh, Attributes) {
        if self.corner_normals.is_empty() && self.corner_texcoords.is_empty() {
            let Self { positions, normals, texcoords, triangles, groups, attributes, .. } = self;
            return (TriangleMesh { positions, normals, texcoords, triangles, groups }, attributes);
        }
        let mut sources = Vec::new();
        let mut mesh = TriangleMesh { groups: self.groups, ..TriangleMesh::default() };
        let mut seen: HashMap<(u32, [u64; 5]), u32, RandomState> = HashMap::default();
        for (t, triangle) in self.triangles.iter().enumerate() {
            let corners: [u32; 3] = std::array::from_fn(|c| {
                let vertex = triangle[c];
                let normal = at_corner(&self.corner_normals, &self.normals, t, c, vertex);
                let texcoord = at_corner(&self.corner_texcoords, &self.texcoords, t, c, vertex);
                let [nx, ny, nz] = normal.unwrap_or_default().map(f64::to_bits);
                let [s, v] = texcoord.unwrap_or_default().map(f64::to_bits);
                *seen.entry((vertex, [nx, ny, nz, s, v])).or_insert_with(|| {
                    sources.push(vertex);
                    mesh.positions.push(self.positions[vertex as usize]);
                    mesh.normals.extend(normal);
                    mesh.texcoords.extend(texcoord);
                    u32::try_from(mesh.positions.len() - 1).unwrap_or(u32::MAX)
                })
            });
            mesh.triangles.push(corners);
        }
        let attributes = self.attributes.of_points(&sources);
        (mesh, attributes)
    }
}

/// The corners of a polygon from its fan.
fn corners_of_fan<T: Copy>(fan: &[[T; 3]]) -> impl Iterator<Item = T> + '_ {
    let first = fan.iter().take(1).flat_map(|t| [t[0], t[1]]);
    first.chain(fan.iter().map(|t| t[2]))
}

/// Replaces a fan by other triangles of the same polygon.
fn rearrange<T: Copy>(fan: &mut [[T; 3]], triangles: &[[usize; 3]]) {
    let corners: Vec<T> = corners_of_fan(fan).collect();
    for (triangle, places) in fan.iter_mut().zip(triangles) {
        *triangle = places.map(|place| corners[place]);
    }
}

fn at_corner<const N: usize>(
    corners: &[[[f64; N]; 3]],
    vertices: &[[f64; N]],
    triangle: usize,
    corner: usize,
    vertex: u32,
) -> Option<[f64; N]> {
    corners.get(triangle).map(|c| c[corner]).or_else(|| vertices.get(vertex as usize).copied())
}
