//! Rigid motions of a model.

use super::{Tessellation, Texels};
use serde::{Deserialize, Serialize};

/// A rigid motion p -> rotation p + translation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Row-major rotation matrix.
    pub rotation: [[f64; 3]; 3],
    /// Millimetres.
    pub translation: [f64; 3],
}

impl Motion {
    /// The motion that moves nothing.
    pub const IDENTITY: Motion =
        Motion { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation: [0.0; 3] };

    /// Where a point goes.
    #[must_use]
    pub fn point(&self, p: [f64; 3]) -> [f64; 3] {
        let q = self.direction(p);
        [q[0] + self.translation[0], q[1] + self.translation[1], q[2] + self.translation[2]]
    }

    /// Where a direction goes.
    #[must_use]
    pub fn direction(&self, d: [f64; 3]) -> [f64; 3] {
        self.rotation.map(|row| super::vector::dot(row, d))
    }

    /// Moves a tessellation: positions and normals.
    pub fn move_tessellation(&self, tessellation: &mut Tessellation) {
        for p in &mut tessellation.mesh.positions {
            *p = self.point(*p);
        }
        for n in &mut tessellation.mesh.normals {
            *n = self.direction(*n);
        }
    }

    /// Moves texels: positions and normals.
    pub fn move_texels(&self, texels: &mut Texels) {
        for p in &mut texels.position {
            *p = self.point(*p);
        }
        for n in &mut texels.normal {
            *n = self.direction(n.map(f64::from)).map(|c| c as f32);
        }
    }
}
