//! Cutting out a box.

use super::raw::RawMesh;
use crate::mesh::{Bounds, renumber_used, retain_marked};
use glam::DVec3;

/// Leaves out what of a mesh does not lie in a box of millimetres: triangles with a corner outside, and vertices that
/// none uses then. `unit` is that of the mesh in millimetres. Returns the number of vertices that are gone; clouds are
/// cut while they are read.
pub(super) fn crop(raw: &mut RawMesh, bounds: Bounds, unit: f64) -> u64 {
    if raw.triangles.is_empty() {
        return 0;
    }
    let is_inside = |p: &[f64; 3]| {
        let at = DVec3::from(*p) * unit;
        at.cmpge(bounds.low).all() && at.cmple(bounds.high).all()
    };
    let inside: Vec<bool> = raw.positions.iter().map(is_inside).collect();
    let kept: Vec<bool> = raw.triangles.iter().map(|t| t.iter().all(|v| inside[*v as usize])).collect();
    let counts = |end: usize| kept[..end].iter().filter(|kept| **kept).count();
    for group in &mut raw.groups {
        (group.start, group.end) = (counts(group.start), counts(group.end));
    }
    raw.groups.retain(|group| group.start < group.end);
    retain_marked(&mut raw.triangles, &kept);
    retain_marked(&mut raw.corner_normals, &kept);
    retain_marked(&mut raw.corner_texcoords, &kept);
    let used = renumber_used(&mut raw.triangles, raw.positions.len());
    let before = raw.positions.len();
    retain_marked(&mut raw.positions, &used);
    retain_marked(&mut raw.normals, &used);
    retain_marked(&mut raw.texcoords, &used);
    raw.attributes.retain_marked(&used);
    (before - raw.positions.len()) as u64
}
