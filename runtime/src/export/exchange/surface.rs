//! The surface from which was measured, with what was measured at its vertices.

use crate::export::colormap::{NO_DATA, texel_colour};
use crate::export::lookup::TexelsByPlace;
use crate::export::scale::Scale;
use crate::variance::{Class, Deviations, Measurement};
use glam::DVec3;
use std::collections::HashMap;
use std::ops::Range;

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
    /// The scale of the colours.
    pub(super) scale: Scale,
}

/// What belongs to a part.
pub(super) struct PartOfSurface {
    pub(super) vertices: Range<usize>,
    pub(super) triangles: Range<usize>,
}

impl MeasuredSurface {
    /// Gives every vertex what the nearest texel of its part has.
    pub(super) fn new(measurement: &Measurement, scale: &Scale) -> Self {
        let Measurement { tessellation, deviations, report, .. } = measurement;
        let mesh = &tessellation.mesh;
        let texels = TexelsByPlace::new(deviations);
        let mut surface = Self::empty(*scale);
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

    fn empty(scale: Scale) -> Self {
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
            scale,
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
        let colour = |i| texel_colour(deviations, i, f64::from(distance), &self.scale);
        self.colours.push(texel.map_or(NO_DATA, colour));
        self.class.push(texel.map_or(Class::NoData, |i| deviations.class(i)));
        self.distance.push(distance);
    }
}
