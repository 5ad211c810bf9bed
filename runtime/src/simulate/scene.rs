//! The object that is scanned: the surface that a ray meets, and the view that sees a place best.

use super::exact::{ExactSurface, SurfaceHit, TriangleHit};
use super::view::View;
use crate::bvh::{Bvh, BvhError};
use crate::mesh::TriangleMesh;
use glam::DVec3;

/// A mesh made ready for rays.
pub(super) struct Scene<'a> {
    bvh: Bvh,
    exact: Option<ExactSurface<'a>>,
    /// Unit normals of the triangles; zero for those without area, which no ray hits.
    normals: Vec<DVec3>,
    /// Distance from the surface at which shadow rays start: a triangle's centroid lies below a curved one. mm.
    lift: f64,
}

impl<'a> Scene<'a> {
    pub(super) fn new(mesh: &TriangleMesh, exact: Option<ExactSurface<'a>>, spacing: f64) -> Result<Self, BvhError> {
        let bvh = Bvh::build(mesh)?;
        let normal = |&triangle| mesh.triangle_normal(triangle).unwrap_or_default();
        let lift = 4.0 * f64::from(bvh.tolerance()) + 0.1 * spacing;
        Ok(Self { normals: mesh.triangles.iter().map(normal).collect(), bvh, exact, lift })
    }

    /// Where rays of unit directions meet the surface, with the unit normals there, turned towards the eye.
    pub(super) fn cast(&self, eye: DVec3, directions: &[DVec3]) -> Vec<Option<SurfaceHit>> {
        let hit = |direction: &DVec3| {
            let hit = self.bvh.nearest_hit(eye, *direction, f64::INFINITY)?;
            Some(TriangleHit { direction: *direction, t: hit.t, triangle: hit.triangle })
        };
        let hits: Vec<Option<TriangleHit>> = directions.iter().map(hit).collect();
        let of_triangle = |hit: &TriangleHit| SurfaceHit {
            point: eye + hit.t * hit.direction,
            normal: self.normals[hit.triangle as usize],
        };
        let met: Vec<TriangleHit> = hits.iter().flatten().copied().collect();
        let exact = match &self.exact {
            Some(exact) => exact.meet(eye, &met),
            None => met.iter().map(|hit| Some(of_triangle(hit))).collect(),
        };
        let mut exact = exact.into_iter();
        let turned = |(hit, direction): (Option<TriangleHit>, &DVec3)| {
            hit?;
            let SurfaceHit { point, normal } = exact.next()??;
            Some(SurfaceHit { point, normal: if normal.dot(*direction) > 0.0 { -normal } else { normal } })
        };
        hits.into_iter().zip(directions).map(turned).collect()
    }

    /// The view that sees `point` under the smallest angle to `normal`, if any sees it under less than the limit:
    /// its number and the angle's cosine.
    pub(super) fn best_view(
        &self,
        views: &[View],
        point: DVec3,
        normal: DVec3,
        least_cosine: f64,
    ) -> Option<(usize, f64)> {
        let cosine = |view: &View| normal.dot((view.eye - point).normalize());
        let mut candidates: Vec<(usize, f64)> =
            views.iter().map(cosine).enumerate().filter(|candidate| candidate.1 >= least_cosine).collect();
        candidates.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        candidates.into_iter().find(|&(view, _)| self.sees(views[view].eye, point + self.lift * normal))
    }

    fn sees(&self, eye: DVec3, point: DVec3) -> bool {
        self.bvh.nearest_hit(point, eye - point, 1.0).is_none()
    }
}
