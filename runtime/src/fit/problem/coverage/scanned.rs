//! The distance by which a place of the model lies beyond the scan.

use crate::bvh::{Bvh, BvhError};
use crate::fit::tuning::{SUPPORT_NEAREST, SUPPORT_NEIGHBOURS};
use crate::scan::{Neighbours, Scan};
use glam::DVec3;

/// The scan: the surface of a mesh, or the points of a cloud.
pub(crate) struct Scanned<'a> {
    scan: &'a Scan,
    shape: Shape,
    /// Whether the scan's normals tell the sides of a wall from each other.
    oriented: bool,
    /// Places that lie beyond by less do so by noise. Millimetres.
    slack: f64,
}

enum Shape {
    Surface(Bvh),
    Cloud(Neighbours),
}

/// A place of the model that the scan does not reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Beyond {
    /// The distance beyond the scan, along the model's surface. Millimetres.
    pub(crate) distance: f64,
    /// The unit direction from the scan to the place, in the model's tangent plane.
    pub(crate) direction: DVec3,
    /// The triangle or point of the scan that is nearest.
    pub(crate) element: u32,
}

/// Whether a place of the model was scanned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Place {
    /// The scan passes by it.
    Scanned,
    /// The scan ends at some distance from it.
    Beyond(Beyond),
    /// Nothing of the scan is near.
    Nowhere,
}

/// Nearest places of a mesh are off by less than this, relatively.
const ROUNDING: f64 = 1e-5;

impl<'a> Scanned<'a> {
    /// The scan, of radius `radius` (millimetres); `oriented` says whether its normals tell the sides of a wall from
    /// each other.
    ///
    /// # Errors
    /// A mesh over which no hierarchy can be built.
    pub(crate) fn new(scan: &'a Scan, oriented: bool, radius: f64) -> Result<Self, BvhError> {
        let shape = if scan.mesh.triangles.is_empty() {
            Shape::Cloud(Neighbours::new(&scan.mesh.positions))
        } else {
            Shape::Surface(Bvh::build(&scan.mesh)?)
        };
        Ok(Self { scan, shape, oriented, slack: scan.noise.max(ROUNDING * radius) })
    }

    /// Compares a place of the model, by its position and its unit normal (outward) in the scan's frame, with the scan.
    /// A place that is more than `limit` (millimetres) beyond the scan is nowhere.
    pub(crate) fn place(&self, p: DVec3, normal: DVec3, limit: f64) -> Place {
        let nearest = match &self.shape {
            Shape::Surface(bvh) => self.beside_surface(bvh, p, normal, limit),
            Shape::Cloud(tree) => self.beside_cloud(tree, p, normal),
        };
        match nearest {
            None => Place::Nowhere,
            // Noise makes waves of the surface resemble its end.
            Some(beyond) if !(beyond.distance > self.slack) => Place::Scanned,
            Some(beyond) if beyond.distance > limit => Place::Nowhere,
            Some(beyond) => Place::Beyond(Beyond { distance: beyond.distance - self.slack, ..beyond }),
        }
    }

    /// The distance of a place beyond the nearest one of a mesh, in the model's tangent plane: the component across it
    /// belongs to the other term, as a model beside the scan is not beyond it.
    fn beside_surface(&self, bvh: &Bvh, p: DVec3, normal: DVec3, limit: f64) -> Option<Beyond> {
        let nearest = if self.oriented {
            bvh.closest_point_facing(p, limit + self.slack, normal, 0.0)?
        } else {
            bvh.closest_point(p, limit + self.slack)?
        };
        let along = tangential(p - nearest.point, normal);
        let direction = along.normalize_or_zero();
        Some(Beyond { distance: along.length(), direction, element: nearest.triangle })
    }

    /// The distance of a place beyond the line that supports its neighbours in a cloud: negative where they surround
    /// it. The line is the one across the mean direction from them to the place.
    fn beside_cloud(&self, tree: &Neighbours, p: DVec3, normal: DVec3) -> Option<Beyond> {
        let mesh = &self.scan.mesh;
        let faces = |i: &u32| {
            let other = mesh.normals.get(*i as usize).map(|n| DVec3::from_array(*n));
            !self.oriented || other.is_none_or(|other| other.dot(normal) > 0.0)
        };
        let near = tree.nearest(p.to_array(), SUPPORT_NEAREST).into_iter().filter(faces).take(SUPPORT_NEIGHBOURS);
        let offsets: Vec<(u32, DVec3)> =
            near.map(|i| (i, tangential(p - DVec3::from_array(mesh.positions[i as usize]), normal))).collect();
        let direction = offsets.iter().map(|o| o.1).sum::<DVec3>().normalize_or_zero();
        let along = offsets.iter().map(|(i, off)| (off.dot(direction), *i));
        let (distance, element) = along.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(Beyond { distance, direction, element })
    }
}

fn tangential(off: DVec3, normal: DVec3) -> DVec3 {
    off - normal * off.dot(normal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriangleMesh;
    use crate::scan::ScanSource;

    /// The square from -10 to 10 in the plane z = 0, points 0.5 apart.
    fn square(triangles: bool) -> Scan {
        let n = 41_u32;
        let mut mesh = TriangleMesh::default();
        for j in 0..n {
            for i in 0..n {
                mesh.positions.push([f64::from(i) * 0.5 - 10.0, f64::from(j) * 0.5 - 10.0, 0.0]);
                mesh.normals.push([0.0, 0.0, 1.0]);
                if triangles && i + 1 < n && j + 1 < n {
                    let a = j * n + i;
                    mesh.triangles.push([a, a + 1, a + n + 1]);
                    mesh.triangles.push([a, a + n + 1, a + n]);
                }
            }
        }
        Scan {
            mesh,
            attributes: Default::default(),
            oriented: true,
            source: ScanSource::default(),
            noise: 0.1,
            warnings: Vec::new(),
        }
    }

    #[test]
    fn what_lies_beyond_the_border_is_told_from_what_lies_across() {
        for triangles in [true, false] {
            let scan = square(triangles);
            let scanned = Scanned::new(&scan, true, 8.0).unwrap();
            for across in [0.0, 0.7, -0.7] {
                assert_eq!(scanned.place(DVec3::new(3.3, 9.9, across), DVec3::Z, 5.0), Place::Scanned);
                let Place::Beyond(found) = scanned.place(DVec3::new(3.3, 13.0, across), DVec3::Z, 5.0) else {
                    panic!("{triangles} {across}");
                };
                // A cloud's neighbours are not the same on both sides: its line is not quite along the border.
                assert!((found.distance - 2.9).abs() < if triangles { 1e-6 } else { 0.05 }, "{triangles}: {found:?}");
                assert!(found.direction.y > 0.9 && found.direction.z == 0.0, "{found:?}");
            }
            assert_eq!(scanned.place(DVec3::new(0.0, 30.0, 0.0), DVec3::Z, 5.0), Place::Nowhere);
            // The other side of the wall was not scanned.
            assert_eq!(scanned.place(DVec3::new(3.3, 2.2, -0.2), DVec3::NEG_Z, 5.0), Place::Nowhere);
        }
    }
}
