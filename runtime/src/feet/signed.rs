//! Signed distances of points from a surface: from the exact one of a model, or from the triangles of a mesh.

use super::facets::{Facets, Facing};
use super::foot::Foot;
use super::layout::Layout;
use super::nearest::Query;
use super::tree::triangle_closest;
use crate::bvh::Bvh;
use crate::mesh::TriangleMesh;
use crate::model::{Instance, Model, Motion, Partials, unit_normals};
use glam::DVec3;
use rayon::prelude::*;

/// Chord error of the facets in which feet are searched, and the tolerance of feet: as fractions of the model's
/// diagonal. Feet lie on the exact surface; coarser facets only make more patches candidates.
const CHORD: f64 = 5e-4;
const TOLERANCE: f64 = 1e-9;

/// Two feet are one place, as on an edge that two patches share, if their distances differ by so little: as a fraction
/// of the diagonal. Borders that coincide do so to about 1e-9 of it.
const SAME: f64 = 1e-7;

/// Rounding of the cosine between a point's normal and the surface's.
const GRAZING: f64 = 1e-6;

/// Cosine of the angle with the normal from which on a point lies over its foot. Feet within a patch are found to about
/// 1e-7 of their distance.
const OVER: f64 = 1.0 - 1e-6;

/// Points that one thread looks at in turn.
const CHUNK: usize = 1024;

/// A point whose distance is wanted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// Millimetres.
    pub(crate) point: DVec3,
    /// Unit normal: surface that makes a right angle with it or more is another side of the body and does not count.
    /// None where any does.
    pub(crate) normal: Option<DVec3>,
}

/// The nearest place of a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SignedFoot {
    /// Index of the part.
    pub(crate) part: u32,
    /// Millimetres.
    pub(crate) point: DVec3,
    /// Outward unit normal of the surface there; zero where it has none.
    pub(crate) normal: DVec3,
    /// Millimetres; positive where the point whose foot this is lies outside, zero below the tolerance of feet.
    pub(crate) distance: f64,
}

/// A surface from which distances are measured.
pub(crate) enum Target<'a> {
    /// The exact surface of a model.
    Model(ExactSurface<'a>),
    /// The triangles of a mesh.
    Mesh(MeshSurface<'a>),
}

impl Target<'_> {
    /// The feet of points on the surface; none for those that have none within `reach` millimetres.
    pub(crate) fn feet(&self, places: &[Place], reach: f64) -> Vec<Option<SignedFoot>> {
        let of_chunk = |chunk: &[Place]| match self {
            Self::Model(surface) => surface.feet(chunk, reach),
            Self::Mesh(surface) => chunk.iter().map(|place| surface.foot(place, reach)).collect(),
        };
        places.par_chunks(CHUNK).flat_map_iter(of_chunk).collect()
    }
}

/// The facets in which feet on a model's surface are searched; `size` is the diagonal of its bounding box. Millimetres.
pub(crate) fn layout_for(model: &dyn Model, instance: &dyn Instance, size: f64) -> Layout {
    Layout::new(model, instance, (CHORD * size).max(f64::MIN_POSITIVE), size.max(f64::MIN_POSITIVE))
}

/// The exact surface of a model, moved.
pub(crate) struct ExactSurface<'a> {
    pub(crate) instance: &'a dyn Instance,
    pub(crate) layout: &'a Layout,
    facets: Facets<'a>,
    motion: Motion,
    back: Motion,
    /// Per patch 1 where dS/du x dS/dv points outwards, -1 where it points inwards.
    signs: Vec<i8>,
    size: f64,
}

impl<'a> ExactSurface<'a> {
    /// `inverted` are the parts whose outer side is the other one than written; the rest is as in [`layout_for`].
    pub(crate) fn new(
        instance: &'a dyn Instance,
        layout: &'a Layout,
        inverted: &[bool],
        motion: Motion,
        size: f64,
    ) -> Self {
        let signs = inverted.iter().map(|inverted| if *inverted { -1 } else { 1 }).collect();
        let facets = layout.facets(instance);
        Self { instance, layout, facets, motion, back: motion.inverse(), signs, size }
    }

    fn feet(&self, places: &[Place], reach: f64) -> Vec<Option<SignedFoot>> {
        let places: Vec<Place> = places
            .iter()
            .map(|p| Place {
                point: self.back.point(p.point.into()).into(),
                normal: p.normal.map(|n| self.back.direction(n.into()).into()),
            })
            .collect();
        let mut feet = self.nearest(&places, &vec![None; places.len()], reach);
        // At a pole facets without area face any way.
        let again: Vec<usize> =
            (0..feet.len()).filter(|i| feet[*i].is_some_and(|foot| !is_facing(foot.normal, &places[*i]))).collect();
        let (at, except): (Vec<Place>, Vec<Option<u32>>) =
            again.iter().map(|i| (places[*i], feet[*i].map(|foot| foot.part))).unzip();
        for (i, other) in again.into_iter().zip(self.nearest(&at, &except, reach)) {
            feet[i] = other.filter(|foot| is_facing(foot.normal, &places[i]));
        }
        for (foot, place) in feet.iter_mut().zip(&places) {
            if let Some(foot) = foot.as_mut().filter(|foot| is_unsure(foot, place)) {
                let normals = self.normals_at(foot.point);
                foot.distance = foot.distance.abs() * side(place.point - foot.point, normals);
            }
        }
        let moved = |foot: SignedFoot| SignedFoot {
            point: self.motion.point(foot.point.into()).into(),
            normal: self.motion.direction(foot.normal.into()).into(),
            ..foot
        };
        feet.into_iter().map(|foot| foot.map(moved)).collect()
    }

    /// The feet in the model's frame, each on none of the patch that is excepted.
    fn nearest(&self, places: &[Place], except: &[Option<u32>], reach: f64) -> Vec<Option<SignedFoot>> {
        let mut candidates: Vec<(u32, usize, [f64; 2])> = Vec::new();
        for (i, (place, except)) in places.iter().zip(except).enumerate() {
            let facing = place.normal.map(|normal| Facing { normal, signs: &self.signs });
            // Facets lie off the surface, on either side of it.
            let query = Query { facing, except: *except, ..Query::new(place.point, reach + self.layout.rivalry()) };
            let found = self.facets.nearest_of_patches(query, self.layout.rivalry() + SAME * self.size);
            candidates.extend(found.into_iter().map(|n| (n.patch, i, n.uv)));
        }
        candidates.sort_by_key(|(patch, i, _)| (*patch, *i));
        let mut feet: Vec<Vec<(u32, Foot)>> = vec![Vec::new(); places.len()];
        for run in candidates.chunk_by(|a, b| a.0 == b.0) {
            let patch = run[0].0;
            let (q, uv): (Vec<DVec3>, Vec<[f64; 2]>) = run.iter().map(|(_, i, uv)| (places[*i].point, *uv)).unzip();
            // A patch that cannot be evaluated has no feet.
            let found =
                self.facets.grid(patch as usize).feet(self.instance, patch as usize, &q, &uv, TOLERANCE * self.size);
            for ((_, i, _), foot) in run.iter().zip(found.unwrap_or_default()) {
                feet[*i].push((patch, foot));
            }
        }
        feet.iter().zip(places).map(|(feet, place)| self.choose(feet, place, reach)).collect()
    }

    /// The nearest of the feet on several patches: of those that face as the point does, if there are any.
    fn choose(&self, feet: &[(u32, Foot)], place: &Place, reach: f64) -> Option<SignedFoot> {
        let q = place.point;
        let mut feet: Vec<(u32, Foot, DVec3)> =
            feet.iter().map(|(part, foot)| (*part, *foot, self.normal(*part, foot))).collect();
        if feet.iter().any(|(.., normal)| is_facing(*normal, place)) {
            feet.retain(|(.., normal)| is_facing(*normal, place));
        }
        let (part, foot, normal) = *feet.iter().min_by(|a, b| a.1.d2.total_cmp(&b.1.d2))?;
        let distance = foot.d2.sqrt();
        // Written so that NaN ends here.
        if !(distance <= reach) {
            return None;
        }
        let same = feet.iter().filter(|(_, other, _)| other.d2.sqrt() <= distance + SAME * self.size);
        let sign = side(q - foot.point, same.map(|(.., normal)| *normal));
        let distance = if distance > 2.0 * TOLERANCE * self.size { sign * distance } else { 0.0 };
        Some(SignedFoot { part, point: foot.point, normal, distance })
    }

    /// The outward normals of all patches that meet at a place of the surface, whichever way they face.
    fn normals_at(&self, place: DVec3) -> impl Iterator<Item = DVec3> {
        let query = Query::new(place, self.layout.rivalry() + SAME * self.size);
        let near = self.facets.nearest_of_patches(query, self.layout.rivalry() + SAME * self.size);
        near.into_iter().filter_map(move |n| {
            let patch = n.patch as usize;
            let feet =
                self.facets.grid(patch).feet(self.instance, patch, &[place], &[n.uv], TOLERANCE * self.size).ok()?;
            let foot = feet.first().filter(|foot| foot.d2.sqrt() <= SAME * self.size)?;
            Some(self.normal(n.patch, foot))
        })
    }

    /// The outward unit normal.
    fn normal(&self, part: u32, foot: &Foot) -> DVec3 {
        let written = foot.normal.try_normalize().or_else(|| {
            let (u, v) = ([foot.uv[0]], [foot.uv[1]]);
            let here = [Partials::default()];
            unit_normals(self.instance, part as usize, &u, &v, &here).ok()?[0]
        });
        f64::from(self.signs[part as usize]) * written.unwrap_or_default()
    }
}

/// The triangles of a mesh with a group for every part.
pub(crate) struct MeshSurface<'a> {
    pub(crate) mesh: &'a TriangleMesh,
    pub(crate) bvh: &'a Bvh,
    /// By triangle the index of its part.
    part: Vec<u32>,
}

impl<'a> MeshSurface<'a> {
    /// `bvh` is the hierarchy over the mesh.
    pub(crate) fn new(mesh: &'a TriangleMesh, bvh: &'a Bvh) -> Self {
        let mut part = vec![0; mesh.triangles.len()];
        for (k, group) in mesh.groups.iter().enumerate() {
            part[group.start..group.end].fill(k as u32);
        }
        Self { mesh, bvh, part }
    }

    fn foot(&self, place: &Place, reach: f64) -> Option<SignedFoot> {
        let mut foot = self.nearest(place, reach)?;
        if is_unsure(&foot, place) {
            let mut normals = Vec::new();
            self.bvh.all_within(foot.point, 2.0 * self.rounding(), |near| normals.push(self.normal(near.triangle)));
            foot.distance = foot.distance.abs() * side(place.point - foot.point, normals.into_iter());
        }
        Some(foot)
    }

    /// Distances below this are rounding of single precision. Millimetres.
    fn rounding(&self) -> f64 {
        2.0 * f64::from(self.bvh.tolerance())
    }

    /// A triangle's unit normal; zero where it has none.
    fn normal(&self, triangle: u32) -> DVec3 {
        self.mesh.triangle_normal(self.mesh.triangles[triangle as usize]).unwrap_or_default()
    }

    /// The hierarchy is in single precision: the distances to what it finds are computed in double precision.
    fn nearest(&self, place: &Place, reach: f64) -> Option<SignedFoot> {
        let Place { point, normal } = *place;
        let rounding = self.rounding();
        let nearest = match normal {
            Some(normal) => self.bvh.closest_point_facing(point, reach + rounding, normal, 0.0)?,
            None => self.bvh.closest_point(point, reach + rounding)?,
        };
        let mut near: Vec<(f64, u32, DVec3, DVec3)> = Vec::new();
        let mut add = |triangle: u32| {
            let corners = self.mesh.triangles[triangle as usize];
            let [a, b, c] = self.mesh.corners(corners);
            let (weights, d2) = triangle_closest(point, a, b, c);
            let foot = a * weights[0] + b * weights[1] + c * weights[2];
            near.push((d2.sqrt(), triangle, foot, self.normal(triangle)));
        };
        add(nearest.triangle);
        self.bvh.all_within(point, nearest.distance + rounding, |closest| {
            let faces = |normal: DVec3| self.normal(closest.triangle).dot(normal) > 0.0;
            if closest.triangle != nearest.triangle && normal.is_none_or(faces) {
                add(closest.triangle);
            }
        });
        let (distance, triangle, foot, across) = *near.iter().min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))?;
        if !(distance <= reach) {
            return None;
        }
        let same = near.iter().filter(|other| other.0 <= distance + rounding);
        let sign = side(point - foot, same.map(|(.., across)| *across));
        let is_zero = distance <= 2.0 * TOLERANCE * f64::from(self.bvh.half_extent().length());
        let distance = if is_zero { 0.0 } else { sign * distance };
        Some(SignedFoot { part: self.part[triangle as usize], point: foot, normal: across, distance })
    }
}

/// Whether a point that not all surface counts for lies beside its foot and not over it: at an edge the surface that
/// faces as the point does may not tell on which side the point is.
fn is_unsure(foot: &SignedFoot, place: &Place) -> bool {
    let over = || (place.point - foot.point).dot(foot.normal).abs() > OVER * foot.distance.abs();
    place.normal.is_some() && foot.distance != 0.0 && !over()
}

/// Whether a surface with this normal faces as a point does: by less than a right angle.
fn is_facing(normal: DVec3, place: &Place) -> bool {
    place.normal.is_none_or(|n| n.dot(normal) > GRAZING)
}

/// The side on which a point lies that is so far `off` its foot, by the normals of all surfaces that meet there: that
/// of the one that sees it most directly. At an acute edge another one may see it from behind.
fn side(off: DVec3, normals: impl Iterator<Item = DVec3>) -> f64 {
    let heights = normals.map(|normal| off.dot(normal));
    let most = heights.max_by(|a, b| a.abs().total_cmp(&b.abs()));
    if most.is_some_and(|height| height < 0.0) { -1.0 } else { 1.0 }
}
