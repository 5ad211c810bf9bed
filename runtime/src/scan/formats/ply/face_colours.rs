//! Colours of faces, as sculpting and repair programs write them. A scan has colours at its points: each vertex gets
//! the mean of those of its faces.

use super::header::{Element, Scalar};
use super::vertices::{COLOUR, of_type};

/// A property of a face in a binary file: whether it stands behind the list of corners, and its offset in the bytes
/// before or behind that.
type Place = (bool, usize);

/// The colours of an element's faces, and their sums by vertex.
pub(super) struct FaceColours {
    scalar: Scalar,
    /// The properties red, green and blue.
    properties: [usize; 3],
    places: [Place; 3],
    /// The sums of the components at every vertex, and the number of faces.
    sums: Vec<[f32; 4]>,
}

impl FaceColours {
    /// None if the faces have none.
    pub(super) fn of(element: &Element, vertices: usize) -> Option<Self> {
        let is = |names: &[&str], name: &str| names.iter().any(|known| known.eq_ignore_ascii_case(name));
        let find = |names: &[&str]| element.properties.iter().position(|p| p.count.is_none() && is(names, p.name));
        let properties = [find(COLOUR[0])?, find(COLOUR[1])?, find(COLOUR[2])?];
        let scalar = element.properties[properties[0]].scalar;
        let places = properties.map(|at| {
            let before = &element.properties[..at];
            let list = before.iter().rposition(|p| p.count.is_some());
            let offset = before[list.map_or(0, |list| list + 1)..].iter().map(|p| p.scalar.bytes()).sum();
            (list.is_some(), offset)
        });
        let alike = properties.iter().all(|at| element.properties[*at].scalar == scalar);
        alike.then(|| Self { scalar, properties, places, sums: vec![[0.0; 4]; vertices] })
    }

    /// Adds a face by its row, property by property.
    pub(super) fn add(&mut self, row: &[Vec<f64>], corners: &[u32]) {
        let colour = self.properties.map(|at| row[at].first().copied().unwrap_or(0.0));
        self.add_colour(colour, corners.iter().copied());
    }

    /// Adds a face by the bytes before and behind its one list.
    pub(super) fn add_bytes(&mut self, parts: [&[u8]; 2], big_endian: bool, corners: impl Iterator<Item = u32>) {
        let scalar = self.scalar;
        let number = |(behind, offset): Place| scalar.number(&parts[usize::from(behind)][offset..], big_endian);
        self.add_colour(self.places.map(number), corners);
    }

    fn add_colour(&mut self, [r, g, b]: [f64; 3], corners: impl Iterator<Item = u32>) {
        for corner in corners {
            for (sum, value) in self.sums[corner as usize].iter_mut().zip([r, g, b, 1.0]) {
                *sum += value as f32;
            }
        }
    }

    /// The colour of every vertex; black of those in no face.
    pub(super) fn at_vertices(&self) -> Vec<[u8; 3]> {
        let mean = |[r, g, b, faces]: &[f32; 4]| [r, g, b].map(|sum| sum / faces.max(1.0));
        of_type(self.scalar, &self.sums.iter().map(mean).collect::<Vec<_>>())
    }
}
