//! From range images to one layer of triangles: every place of the surface is kept from the view that sees it best.

use super::instrument::Sample;
use super::scene::Scene;
use super::view::{RangeImage, View};
use crate::mesh::{renumber_used, retain_marked};
use glam::DVec3;
use rayon::prelude::*;

/// A triangle whose normal differs by more than this from those at all its corners spans a step of the surface rather
/// than a part of it: cosine of 55 degrees, more than the 45 degrees of a chamfer over a square edge.
const STEP_COSINE: f64 = 0.574;

/// Triangles of measured points, and where they truly lie.
#[derive(Default)]
pub(super) struct Layer {
    pub(super) samples: Vec<Sample>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// By sample, the number of its view.
    pub(super) views: Vec<u16>,
}

impl Layer {
    /// Adds the triangles of view number `number`. They are judged by the true points, as the best scanner's software
    /// would judge them, so that noise and outliers stay in the mesh.
    pub(super) fn add(
        &mut self,
        image: &RangeImage,
        number: usize,
        views: &[View],
        scene: &Scene<'_>,
        least_cosine: f64,
    ) {
        let height = image.samples.len() / image.width.max(1);
        let kept: Vec<Vec<[usize; 3]>> = (1..height)
            .into_par_iter()
            .map(|row| {
                let cells = (1..image.width).flat_map(|column| cell(image, row * image.width + column));
                cells.filter(|&corners| keep(corners, image, number, views, scene, least_cosine)).collect()
            })
            .collect();
        let mut place = vec![u32::MAX; image.samples.len()];
        for corners in kept.into_iter().flatten() {
            let triangle = corners.map(|corner| {
                if let (u32::MAX, Some(sample)) = (place[corner], image.samples[corner]) {
                    place[corner] = self.samples.len() as u32;
                    self.samples.push(sample);
                    self.views.push(number as u16);
                }
                place[corner]
            });
            self.triangles.push(triangle);
        }
    }

    /// Drops triangles, and the samples that no triangle uses any more.
    pub(super) fn retain(&mut self, keep: impl FnMut(&[u32; 3]) -> bool) {
        self.triangles.retain(keep);
        let used = renumber_used(&mut self.triangles, self.samples.len());
        retain_marked(&mut self.samples, &used);
        retain_marked(&mut self.views, &used);
    }

    /// Centroid and unit normal of a triangle's true points.
    pub(super) fn place(&self, triangle: &[u32; 3]) -> (DVec3, DVec3) {
        let [a, b, c] = triangle.map(|i| self.samples[i as usize].point);
        ((a + b + c) / 3.0, (b - a).cross(c - a).normalize_or_zero())
    }
}

/// The triangles of the cell whose last corner is `last`: two along the shorter diagonal, one where a corner is
/// missing.
fn cell(image: &RangeImage, last: usize) -> impl Iterator<Item = [usize; 3]> + use<> {
    let (a, b, c, d) = (last - image.width - 1, last - image.width, last - 1, last);
    let point = |i: usize| image.samples[i].map(|sample| sample.point);
    let triangles = match (point(a), point(b), point(c), point(d)) {
        (Some(p), Some(q), Some(r), Some(s)) if p.distance(s) <= q.distance(r) => [Some([a, b, d]), Some([a, d, c])],
        (Some(_), Some(_), Some(_), Some(_)) => [Some([a, b, c]), Some([b, d, c])],
        (None, Some(_), Some(_), Some(_)) => [Some([b, d, c]), None],
        (Some(_), None, Some(_), Some(_)) => [Some([a, d, c]), None],
        (Some(_), Some(_), None, Some(_)) => [Some([a, b, d]), None],
        (Some(_), Some(_), Some(_), None) => [Some([a, b, c]), None],
        _ => [None, None],
    };
    triangles.into_iter().flatten()
}

fn keep(
    corners: [usize; 3],
    image: &RangeImage,
    number: usize,
    views: &[View],
    scene: &Scene<'_>,
    least_cosine: f64,
) -> bool {
    let [Some(a), Some(b), Some(c)] = corners.map(|corner| image.samples[corner]) else { return false };
    let centroid = (a.point + b.point + c.point) / 3.0;
    let to_eye = (views[number].eye - centroid).normalize();
    let Some(normal) = (b.point - a.point).cross(c.point - a.point).try_normalize() else { return false };
    let grazes = normal.dot(to_eye) < least_cosine;
    let spans_a_step = [a, b, c].iter().all(|sample| sample.normal.dot(normal) < STEP_COSINE);
    if grazes || spans_a_step {
        return false;
    }
    // The true normals, not the triangle's: along a silhouette those of views side by side would disagree more.
    let facing = (a.normal + b.normal + c.normal).try_normalize().unwrap_or(normal);
    scene.best_view(views, centroid, facing, f64::NEG_INFINITY).is_some_and(|(best, _)| best == number)
}
