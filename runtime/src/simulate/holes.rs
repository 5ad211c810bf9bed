//! Holes of clouds: places of the object whose points are missing.

use super::HOLE_STREAM;
use super::scanner::Scanner;
use crate::mesh::TriangleMesh;
use crate::sampling::in_triangle;
use glam::DVec3;
use rand::RngExt;

/// Places of the surface around which points are missing.
#[derive(Default)]
pub(super) struct Holes {
    /// Middles and unit normals.
    places: Vec<(DVec3, DVec3)>,
    radius: f64,
}

impl Holes {
    /// Holes on an object, evenly by area.
    pub(super) fn on(mesh: &TriangleMesh, scanner: &Scanner) -> Self {
        if scanner.holes == 0 {
            return Self::default();
        }
        let mut random = scanner.random(HOLE_STREAM);
        let total = mesh.area();
        let mut at: Vec<f64> = (0..scanner.holes).map(|_| total * random.random::<f64>()).collect();
        at.sort_by(f64::total_cmp);
        let (mut next, mut area) = (at.into_iter().peekable(), 0.0);
        let mut places = Vec::new();
        for &triangle in &mesh.triangles {
            area += mesh.triangle_area(triangle);
            while next.next_if(|at| *at < area).is_some() {
                let [a, b, c] = mesh.corners(triangle);
                let (s, t) = in_triangle(random.random(), random.random());
                let normal = mesh.triangle_normal(triangle).unwrap_or_default();
                places.push((a + s * (b - a) + t * (c - a), normal));
            }
        }
        Self { places, radius: scanner.hole_radius }
    }

    /// Whether a point with this normal is missing: the other side of a thin wall is not.
    pub(super) fn contain(&self, point: DVec3, normal: DVec3) -> bool {
        self.places.iter().any(|(at, up)| at.distance(point) < self.radius && up.dot(normal) > 0.0)
    }
}
