//! The object that is scanned: the surface that a ray meets, and the view that sees a place best.

use super::beam;
use super::exact::{ExactSurface, SurfaceHit, TriangleHit};
use super::surroundings::Surroundings;
use super::view::View;
use crate::bvh::{Bvh, BvhError};
use crate::mesh::{Bounds, TriangleMesh};
use crate::model::EvaluationError;
use glam::DVec3;

/// What a point belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Surface {
    Object,
    Table,
    Clutter,
}

/// The echo of a ray from the triangles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Echo {
    /// In lengths of the ray's direction.
    pub(super) range: f64,
    pub(super) intensity: f64,
}

/// A mesh made ready for rays.
pub(super) struct Scene<'a> {
    bvh: Bvh,
    /// The number of the object's triangles, and of these and the table's.
    ends: [usize; 2],
    /// Height of the table's plane: no scanner is below it.
    floor: Option<f64>,
    bounds: Bounds,
    exact: Option<ExactSurface<'a>>,
    /// Unit normals of the triangles; zero for those without area, which no ray hits.
    normals: Vec<DVec3>,
    /// Distance from the surface at which shadow rays start: a triangle's centroid lies below a curved one. mm.
    lift: f64,
}

impl<'a> Scene<'a> {
    /// The surface of the object, `mesh`, with what is around it.
    pub(super) fn new(
        mesh: &TriangleMesh,
        around: Option<&Surroundings>,
        exact: Option<ExactSurface<'a>>,
        spacing: f64,
    ) -> Result<Self, BvhError> {
        let (ends, floor) = around.map_or(([mesh.triangles.len(); 2], None), |around| (around.ends, around.floor));
        let mesh = around.map_or(mesh, |around| &around.mesh);
        let bvh = Bvh::build(mesh)?;
        let normal = |&triangle| mesh.triangle_normal(triangle).unwrap_or_default();
        let bounds = mesh.triangles.iter().flat_map(|t| mesh.corners(*t)).collect();
        let lift = 4.0 * f64::from(bvh.tolerance()) + 0.1 * spacing;
        Ok(Self { normals: mesh.triangles.iter().map(normal).collect(), bvh, ends, floor, bounds, exact, lift })
    }

    /// Whether a scanner may stand there: not below the table.
    pub(super) fn has_room_at(&self, eye: DVec3) -> bool {
        self.floor.is_none_or(|floor| eye.z > floor)
    }

    /// What a triangle belongs to.
    pub(super) fn surface(&self, triangle: u32) -> Surface {
        match triangle as usize {
            i if i < self.ends[0] => Surface::Object,
            i if i < self.ends[1] => Surface::Table,
            _ => Surface::Clutter,
        }
    }

    /// Height of the table's plane.
    pub(super) fn floor(&self) -> Option<f64> {
        self.floor
    }

    /// The box around everything.
    pub(super) fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Whether a ray meets the object before anything else.
    pub(super) fn meets_object(&self, from: DVec3, direction: DVec3) -> bool {
        let hit = self.bvh.nearest_hit(from, direction, f64::INFINITY);
        hit.is_some_and(|hit| self.surface(hit.triangle) == Surface::Object)
    }

    /// The echo of a ray of unit direction from the triangles.
    pub(super) fn echo(&self, from: DVec3, direction: DVec3) -> Option<Echo> {
        let hit = self.bvh.nearest_hit(from, direction, f64::INFINITY)?;
        let cosine = self.normals[hit.triangle as usize].dot(direction).abs();
        Some(Echo { range: hit.t, intensity: beam::intensity(self.surface(hit.triangle), cosine) })
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
            surface: self.surface(hit.triangle),
        };
        let is_exact = |hit: &TriangleHit| self.exact.is_some() && self.surface(hit.triangle) == Surface::Object;
        let met: Vec<TriangleHit> = hits.iter().flatten().filter(|hit| is_exact(hit)).copied().collect();
        let mut exact = self.exact.as_ref().map(|exact| exact.meet(eye, &met)).unwrap_or_default().into_iter();
        let turned = |(hit, direction): (Option<TriangleHit>, &DVec3)| {
            let hit = hit?;
            let met = if is_exact(&hit) { exact.next()?? } else { of_triangle(&hit) };
            let normal = if met.normal.dot(*direction) > 0.0 { -met.normal } else { met.normal };
            Some(SurfaceHit { normal, ..met })
        };
        hits.into_iter().zip(directions).map(turned).collect()
    }

    /// Moves points of the object's triangles, whose numbers come with them, onto the exact surface where that is
    /// known. Those of what is around the object, and of an object that is a mesh, stay where they are. The tolerance,
    /// in millimetres, is that along the surface.
    ///
    /// # Errors
    /// The model cannot be evaluated.
    pub(super) fn onto_surface(&self, points: &mut [(DVec3, u32)], tolerance: f64) -> Result<(), EvaluationError> {
        let Some(exact) = &self.exact else { return Ok(()) };
        let is_object = |point: &(DVec3, u32)| self.surface(point.1) == Surface::Object;
        let own: Vec<(DVec3, u32)> = points.iter().copied().filter(is_object).collect();
        let projected = exact.project(&own, tolerance)?;
        for (point, exact) in points.iter_mut().filter(|point| is_object(point)).zip(projected) {
            point.0 = exact;
        }
        Ok(())
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
        candidates.retain(|candidate| self.has_room_at(views[candidate.0].eye));
        candidates.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        candidates.into_iter().find(|&(view, _)| self.sees(views[view].eye, point + self.lift * normal))
    }

    fn sees(&self, eye: DVec3, point: DVec3) -> bool {
        self.bvh.nearest_hit(point, eye - point, 1.0).is_none()
    }
}
