//! The place and the size of the model.

use crate::mesh::{Bounds, TriangleMesh};
use glam::{DMat3, DVec3};
use std::f64::consts::FRAC_PI_2;

/// From the scan's coordinates to the scene's, whose origin is the model's centre, because viewers use single
/// precision, and whose y points upwards.
pub(super) struct Frame {
    /// Centre of the model's bounding box in the scan's coordinates. Coordinates are written relative to it.
    pub(super) centre: DVec3,
    /// Size of that box: of one without thickness a hundredth of its diagonal, since shaders divide by it.
    pub(super) size: DVec3,
    /// The rotation from the scan's axes to the scene's.
    pub(super) upright: DMat3,
    /// The model's bounding box in the scene.
    pub(super) shown: Bounds,
    /// Half the diagonal of the bounding box. Millimetres.
    pub(super) radius: f64,
    /// Decimals of coordinates: five digits of the radius, and a hundredth of a millimetre at least, a quarter of by
    /// how much triangles of a model of the size of a hand may leave the surface.
    pub(super) decimals: usize,
}

impl Frame {
    pub(super) fn of(mesh: &TriangleMesh, turned: &[[f64; 3]; 3]) -> Self {
        let bounds = mesh.bounds();
        let (centre, radius) = (bounds.centre(), bounds.diagonal() / 2.0);
        let radius = if radius > 0.0 { radius } else { 1.0 };
        let decimals = (3.0 - radius.log10().floor()).clamp(2.0, 12.0) as usize;
        // The rows are taken for columns: the transpose, which turns back.
        let upright = DMat3::from_rotation_x(-FRAC_PI_2) * DMat3::from_cols_array_2d(turned);
        let place = |p: &[f64; 3]| upright * (DVec3::from_array(*p) - centre);
        let shown = mesh.positions.iter().map(place).collect();
        Self { centre, size: bounds.size().max(DVec3::splat(0.02 * radius)), upright, shown, radius, decimals }
    }

    /// A point of the scan as it is written in the file.
    pub(super) fn local(&self, p: [f64; 3]) -> DVec3 {
        DVec3::from_array(p) - self.centre
    }
}
