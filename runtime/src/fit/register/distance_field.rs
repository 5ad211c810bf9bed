//! A distance field of the model at fixed parameters: distances on a grid of voxels, so that hundreds of orientations
//! can be tried for the price of one exact evaluation.

use crate::fit::correspond::facets::Facets;
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::loss::{Loss, PointLoss};
use crate::fit::problem::points::Points;
use crate::fit::tuning::{ALIGNMENT_STEPS, FIELD_DAMPING, FIELD_GAIN, FIELD_MARGIN, VOXELS};
use crate::mesh::Bounds;
use glam::DVec3;
use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;

/// Distances at the corners of cubic voxels around the model.
pub(crate) struct DistanceField {
    low: DVec3,
    /// Edge of a voxel. Millimetres.
    cell: f64,
    count: [usize; 3],
    distance: Vec<f32>,
}

impl DistanceField {
    /// The field of some facets, and a margin about their box for a scan of radius `radius`; farther out it is
    /// continued along straight lines. None where there are no facets.
    pub(crate) fn new(facets: &Facets, radius: f64) -> Option<Self> {
        let Bounds { low, high } = facets.bounds()?;
        let margin = FIELD_MARGIN * radius;
        let (low, high) = (low - margin, high + margin);
        let cell = (high - low).max_element() / VOXELS;
        let count = ((high - low) / cell).ceil().to_array().map(|n| n as usize + 1);
        let rows: Vec<Vec<f32>> = (0..count[1] * count[2])
            .into_par_iter()
            .map(|row| {
                let (y, z) = (row % count[1], row / count[1]);
                // A voxel's distance is at most its neighbour's and an edge.
                let mut limit = f64::INFINITY;
                let of_voxel = |x: usize| {
                    let q = low + cell * DVec3::new(x as f64, y as f64, z as f64);
                    let distance = facets.distance(q, limit);
                    limit = 1.001 * (distance + cell);
                    distance as f32
                };
                (0..count[0]).map(of_voxel).collect()
            })
            .collect();
        let distance = rows.concat();
        Some(Self { low, cell, count, distance })
    }

    /// The distance at q and its gradient, by trilinear interpolation.
    fn at(&self, q: DVec3) -> (f64, DVec3) {
        let top = DVec3::from_array(self.count.map(|n| (n - 1) as f64 - 1e-9));
        let scaled = (q - self.low) / self.cell;
        let inside = scaled.clamp(DVec3::ZERO, top);
        let corner = inside.floor();
        let f = inside - corner;
        let [x, y, z] = corner.to_array().map(|c| c as usize);
        let [nx, ny, _] = self.count;
        let base = (z * ny + y) * nx + x;
        let d = |dx: usize, dy: usize, dz: usize| f64::from(self.distance[base + (dz * ny + dy) * nx + dx]);
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let (x00, x10) = (mix(d(0, 0, 0), d(1, 0, 0), f.x), mix(d(0, 1, 0), d(1, 1, 0), f.x));
        let (x01, x11) = (mix(d(0, 0, 1), d(1, 0, 1), f.x), mix(d(0, 1, 1), d(1, 1, 1), f.x));
        let (y0, y1) = (mix(x00, x10, f.y), mix(x01, x11, f.y));
        let slope = |dy: usize, dz: usize| d(1, dy, dz) - d(0, dy, dz);
        let gradient = DVec3::new(
            mix(mix(slope(0, 0), slope(1, 0), f.y), mix(slope(0, 1), slope(1, 1), f.y), f.z),
            mix(x10 - x00, x11 - x01, f.z),
            y1 - y0,
        ) / self.cell;
        let beyond = (scaled - inside) * self.cell;
        let off = beyond.length();
        let gradient = if off > 0.0 { beyond / off } else { gradient };
        (mix(y0, y1, f.z) + off, gradient)
    }

    /// Aligns the model with the points by Gauss-Newton steps over rigid motions, from `motion`; returns the motion and
    /// the mean loss there. Local motions turn about `centre`.
    pub(crate) fn align(&self, points: &Points, loss: Loss, motion: Isometry, centre: DVec3) -> (Isometry, f64) {
        let mut at = motion;
        let (mut value, mut step) = self.step(points, loss, &at, centre);
        for _ in 0..ALIGNMENT_STEPS {
            let Some(by) = step else { break };
            let next = at.after_local(DVec3::new(by[0], by[1], by[2]), DVec3::new(by[3], by[4], by[5]), centre);
            let (there, after) = self.step(points, loss, &next, centre);
            if there >= value {
                break;
            }
            let converged = value - there < FIELD_GAIN * value;
            (at, value, step) = (next, there, after);
            if converged {
                break;
            }
        }
        (at, value)
    }

    /// The mean loss and the Gauss-Newton step.
    fn step(&self, points: &Points, loss: Loss, at: &Isometry, centre: DVec3) -> (f64, Option<Vector6<f64>>) {
        let inverse = at.rotation.inverse();
        let (mut sum, mut normal, mut gradient) = (0.0, Matrix6::zeros(), Vector6::zeros());
        for (i, p) in points.position.iter().enumerate() {
            let q = inverse * (*p - at.translation);
            let (d, slope) = self.at(q);
            let PointLoss { value, weight, .. } = loss.at(d * d).times(points.prior(i));
            sum += value;
            // Moving the model by (a, w) moves the point by -(a + w x (q - c)) in the model's frame.
            let turn = (q - centre).cross(slope);
            let row = -Vector6::new(slope.x, slope.y, slope.z, turn.x, turn.y, turn.z);
            gradient += row * (weight * d);
            normal += row * row.transpose() * weight;
        }
        for k in 0..6 {
            normal[(k, k)] = normal[(k, k)] * FIELD_DAMPING + f64::MIN_POSITIVE;
        }
        (sum / points.weight(), normal.cholesky().map(|factor| -factor.solve(&gradient)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::correspond::layout::Layout;
    use crate::fit::tests::shapes::{Simple, simple};
    use crate::model::Model;

    #[test]
    fn the_field_of_a_sphere_is_its_distance() {
        let model = simple(Simple::Sphere, &[40.0]);
        let instance = model.instantiate(&[40.0]).unwrap();
        let layout = Layout::new(&model, &*instance, 0.1, 80.0);
        let field = DistanceField::new(&layout.facets(&*instance), 20.0).unwrap();
        for q in [DVec3::new(24.0, 6.0, -15.0), DVec3::new(1.0, 60.0, 2.0), DVec3::new(-90.0, 80.0, 200.0)] {
            let (d, slope) = field.at(q);
            // Voxels of 4.5 mm: away from the surface, where the distance has its kink, the error of interpolation
            // stays below one.
            assert!((d - (q.length() - 40.0).abs()).abs() < 0.1 * d + 1.0, "{q} {d}");
            let outward = slope.dot(q.normalize()) * (q.length() - 40.0).signum();
            assert!(outward > 0.9, "{q} {slope}");
        }
    }
}
