//! The objects of a build in their places.

use super::malformed;
use super::model::{Object, Objects, Placed};
use super::part;
use crate::mesh::Group;
use crate::scan::error::ScanFault;
use crate::scan::raw::RawMesh;
use glam::DAffine3;

/// Components may repeat an object: there are at most so many vertices and triangles in all, and one more for each
/// byte of the models' XML.
const MODEST: usize = 1 << 20;
/// The most objects that are placed, and the deepest that they are nested.
const MOST: usize = 1 << 20;
const DEEPEST: usize = 64;

pub(super) struct Assembly<'a> {
    objects: &'a Objects,
    raw: RawMesh,
    left: usize,
    placed: usize,
}

impl<'a> Assembly<'a> {
    /// For the objects of models of so many bytes.
    pub(super) fn new(objects: &'a Objects, bytes: usize) -> Self {
        // Vertices are numbered with 32 bits.
        let left = bytes.saturating_add(MODEST).min(u32::MAX as usize);
        Self { objects, raw: RawMesh::default(), left, placed: 0 }
    }

    /// Adds an item of the build as a group.
    pub(super) fn place(&mut self, item: &Placed) -> Result<(), ScanFault> {
        let start = self.raw.triangles.len();
        // With their depths.
        let mut open = vec![(item.clone(), 0)];
        while let Some((placed, depth)) = open.pop() {
            let Placed { key, transform } = placed;
            let place = || format!("{}, object {}", part(&key.0), key.1);
            let Some(object) = self.objects.get(&key) else {
                return Err(malformed(place(), "it is placed, and there is no such object; export it again"));
            };
            if depth > DEEPEST {
                let message = format!("components are nested more than {DEEPEST} times, or it is a part of itself");
                return Err(malformed(place(), message));
            }
            let size = object.positions.len() + object.triangles.len();
            self.placed += 1;
            self.left = self.left.checked_sub(size).filter(|_| self.placed <= MOST).ok_or_else(|| {
                malformed(
                    place(),
                    "components repeat objects so often that it is more than is read; export a part of it",
                )
            })?;
            self.add(object, transform);
            let component = |c: &Placed| (Placed { key: c.key.clone(), transform: transform * c.transform }, depth + 1);
            open.extend(object.components.iter().rev().map(component));
            if open.len() > MOST {
                return Err(malformed(place(), "it has more components than are read; export a part of it"));
            }
        }
        let end = self.raw.triangles.len();
        if start < end {
            let name = self.objects.get(&item.key).map(|object| object.name.as_str()).unwrap_or_default();
            let name = if name.is_empty() { format!("object {}", item.key.1) } else { name.to_owned() };
            self.raw.groups.push(Group { name, start, end });
        }
        Ok(())
    }

    fn add(&mut self, object: &Object, transform: DAffine3) {
        let first = self.raw.positions.len() as u32;
        let placed = object.positions.iter().map(|p| transform.transform_point3((*p).into()).to_array());
        self.raw.positions.extend(placed);
        self.raw.placed_by(transform);
        // A mirror image has its other side out.
        let flipped = transform.matrix3.determinant() < 0.0;
        let triangle = |[a, b, c]: [u32; 3]| if flipped { [a, c, b] } else { [a, b, c] }.map(|v| first + v);
        self.raw.triangles.extend(object.triangles.iter().map(|t| triangle(*t)));
    }

    pub(super) fn finish(self) -> RawMesh {
        let mut raw = self.raw;
        if raw.groups.len() == 1 {
            raw.groups.clear();
        }
        raw
    }
}
