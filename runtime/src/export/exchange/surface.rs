//! The surface from which was measured, with what was measured at its vertices.

use crate::export::colormap::{NO_DATA, texel_colour};
use crate::variance::{Class, Deviations, Measurement};
use glam::DVec3;
use std::collections::HashMap;
use std::ops::Range;

/// The distance in texels within which the texel of a vertex is searched: vertices lie on the rims of charts, texels
/// inside of them, and beyond are gutters of two texels.
const REACH: isize = 2;

/// Triangles whose vertices belong to one part each, with the deviations there. Arrays of vertices are of one length.
pub(super) struct MeasuredSurface {
    /// Places in the scan's frame. Millimetres.
    pub(super) positions: Vec<[f64; 3]>,
    /// Unit normals, outward.
    pub(super) normals: Vec<[f64; 3]>,
    /// Numbers of the parts.
    pub(super) part: Vec<u32>,
    /// Signed distances to the scan in millimetres; NaN where there is none.
    pub(super) distance: Vec<f32>,
    /// Classes of the vertices.
    pub(super) class: Vec<Class>,
    /// Levels of detection of the parts, in millimetres; NaN where there is none.
    pub(super) detection: Vec<f32>,
    /// Colours of the deviations in sRGB.
    pub(super) colours: Vec<[u8; 3]>,
    /// Vertices, each below the number of positions; counter-clockwise from outside.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The vertices and the triangles of every part, in the order of the parts.
    pub(super) parts: Vec<PartOfSurface>,
    /// Deviation at which the colour scale ends. Millimetres.
    pub(super) colour_range: f64,
}

/// What belongs to a part.
pub(super) struct PartOfSurface {
    pub(super) vertices: Range<usize>,
    pub(super) triangles: Range<usize>,
}

impl MeasuredSurface {
    /// Gives every vertex what the nearest texel of its part has.
    pub(super) fn new(measurement: &Measurement, colour_range: f64) -> Self {
        let Measurement { tessellation, deviations, report, .. } = measurement;
        let mesh = &tessellation.mesh;
        let texels = TexelsByPlace::new(deviations);
        let mut surface = Self::empty(colour_range);
        for (part, group) in mesh.groups.iter().enumerate() {
            let (vertices, triangles) = (surface.positions.len(), surface.triangles.len());
            let level = report.parts.get(part).and_then(|p| p.detection).map_or(f32::NAN, |d| d.level as f32);
            // Parts of a reference mesh may share vertices.
            let mut number: HashMap<u32, u32> = HashMap::new();
            for triangle in mesh.triangles.get(group.start..group.end).unwrap_or_default() {
                let triangle = triangle.map(|vertex| {
                    *number.entry(vertex).or_insert_with(|| {
                        let i = vertex as usize;
                        let position = mesh.positions[i];
                        let texel = mesh.texcoords.get(i).and_then(|at| texels.nearest(*at, part as u32, position));
                        surface.push(part as u32, position, mesh.normals.get(i).copied(), level);
                        surface.measure(deviations, texel);
                        surface.positions.len() as u32 - 1
                    })
                });
                if triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0] {
                    surface.triangles.push(triangle);
                }
            }
            surface.parts.push(PartOfSurface {
                vertices: vertices..surface.positions.len(),
                triangles: triangles..surface.triangles.len(),
            });
        }
        surface
    }

    fn empty(colour_range: f64) -> Self {
        Self {
            positions: Vec::new(),
            normals: Vec::new(),
            part: Vec::new(),
            distance: Vec::new(),
            class: Vec::new(),
            detection: Vec::new(),
            colours: Vec::new(),
            triangles: Vec::new(),
            parts: Vec::new(),
            colour_range,
        }
    }

    fn push(&mut self, part: u32, position: [f64; 3], normal: Option<[f64; 3]>, level: f32) {
        // Formats ask for unit vectors where there are normals.
        let unit = normal.and_then(|n| DVec3::from_array(n).try_normalize()).unwrap_or(DVec3::Z);
        self.positions.push(position);
        self.normals.push(unit.to_array());
        self.part.push(part);
        self.detection.push(level);
    }

    fn measure(&mut self, deviations: &Deviations, texel: Option<usize>) {
        let distance = texel.map_or(f32::NAN, |i| deviations.signed(i));
        let colour = |i| texel_colour(deviations, i, f64::from(distance), self.colour_range);
        self.colours.push(texel.map_or(NO_DATA, colour));
        self.class.push(texel.map_or(Class::NoData, |i| deviations.class(i)));
        self.distance.push(distance);
    }
}

/// The texels by their places on the texture.
struct TexelsByPlace<'a> {
    deviations: &'a Deviations,
    /// The texel at every place, row by row from the top.
    at: Vec<Option<u32>>,
}

impl<'a> TexelsByPlace<'a> {
    fn new(deviations: &'a Deviations) -> Self {
        let texels = &deviations.texels;
        let mut at = vec![None; texels.width as usize * texels.height as usize];
        for (i, place) in texels.index.iter().enumerate() {
            if let Some(slot) = at.get_mut(*place as usize) {
                *slot = Some(i as u32);
            }
        }
        Self { deviations, at }
    }

    /// Of the texels of a part about a place of the texture (s to the right, t upwards) the one that is the nearest in
    /// space, so that one of another chart beside it does not count.
    fn nearest(&self, [s, t]: [f64; 2], part: u32, position: [f64; 3]) -> Option<usize> {
        let texels = &self.deviations.texels;
        let (width, height) = (texels.width as isize, texels.height as isize);
        let (column, row) = ((s * width as f64) as isize, ((1.0 - t) * height as f64) as isize);
        let position = DVec3::from_array(position);
        let mut nearest: Option<(f64, usize)> = None;
        for y in (row - REACH).max(0)..(row + REACH + 1).min(height) {
            for x in (column - REACH).max(0)..(column + REACH + 1).min(width) {
                let Some(i) = self.at[(y * width + x) as usize].map(|i| i as usize) else { continue };
                let apart = DVec3::from_array(texels.position[i]).distance_squared(position);
                if texels.part[i] == part && nearest.is_none_or(|(least, _)| apart < least) {
                    nearest = Some((apart, i));
                }
            }
        }
        nearest.map(|(_, i)| i)
    }
}
