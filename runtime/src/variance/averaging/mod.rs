//! Normals that are averaged where patches meet.
//!
//! If patches are displaced along their own normals, they separate at an edge where the scan lies outside, and
//! intersect where it lies inside (\[VA\], conclusion). Here patches that meet have one normal at their common edge,
//! which turns to their own within a band beside it, so that the displaced surface is closed.

mod crease;
mod segments;

use crate::bvh::{Bvh, BvhError};
use crate::mesh::{TriangleMesh, angle_at};
use crate::model::{Tessellation, Texels};
use glam::DVec3;
use rayon::prelude::*;
use segments::Segments;
use std::collections::HashMap;

/// Points of patches coincide up to this fraction of the model's diagonal: chords of a tessellated edge leave it by
/// less.
const COINCIDENT: f64 = 5e-4;

/// Default width of the band beside an edge, as a fraction of the model's diagonal.
pub(in crate::variance) const DEFAULT_WIDTH: f64 = 0.02;

/// Largest width of the band beside an edge, as a fraction of the model's diagonal.
pub(in crate::variance) const MAX_WIDTH: f64 = 0.1;

/// If the sum of the normals of patches that meet is shorter (two sides of a sheet), they have no average.
const CANCELLED: f64 = 1e-3;

/// Replaces the normals of texels and of vertices (which documents displace) by averaged ones. `displayed` is another
/// tessellation of the same model.
///
/// For a model: where an edge of a patch lies on another patch, or on another edge of its own, both have the mean of
/// their normals, weighted by the angles of the patches there; within `width` millimetres beside it normals turn
/// linearly to their own. For a reference mesh, which has no patches: normals of coincident vertices are averaged,
/// weighted by the triangles' angles, and interpolated over the triangles; `width` is not used.
///
/// Returns the cosine of the angle by which each texel's normal was turned
/// ([`Deviations::cosine`](super::Deviations::cosine)).
///
/// # Errors
/// As [`Bvh::build`] over the model's surface.
pub(in crate::variance) fn average_normals(
    texels: &mut Texels,
    tessellation: &mut Tessellation,
    displayed: Option<&mut Tessellation>,
    width: f64,
) -> Result<Vec<f32>, BvhError> {
    let before = texels.normal.clone();
    turn_normals(texels, tessellation, displayed, width)?;
    let cosine = |(before, after): (&[f32; 3], &[f32; 3])| {
        let [before, after] = [before, after].map(|n| DVec3::from(n.map(f64::from)));
        // A normal that was not turned has exactly 1.
        if before == after { 1.0 } else { before.dot(after) as f32 }
    };
    Ok(before.par_iter().zip(&texels.normal).map(cosine).collect())
}

fn turn_normals(
    texels: &mut Texels,
    tessellation: &mut Tessellation,
    displayed: Option<&mut Tessellation>,
    width: f64,
) -> Result<(), BvhError> {
    let bvh = Bvh::build(&tessellation.mesh)?;
    let tolerance = COINCIDENT * tessellation.mesh.bounds().diagonal();
    if tessellation.origins.len() != tessellation.mesh.positions.len() {
        average_vertices(&mut tessellation.mesh);
        interpolate(texels, &tessellation.mesh, &bvh, tolerance);
        return Ok(());
    }
    let creases = crease::find(tessellation, &bvh, tolerance);
    let segments: Vec<Segments> =
        creases.into_par_iter().map(|of_patch| Segments::new(of_patch, width, 1e-3 * tolerance)).collect();
    let averaged = |patch: u32, position: [f64; 3], normal: DVec3| {
        let correction = segments.get(patch as usize)?.correction(DVec3::from(position))?;
        (normal + correction).try_normalize()
    };
    let texel = |(normal, (position, part)): (&mut [f32; 3], (&[f64; 3], &u32))| {
        if let Some(n) = averaged(*part, *position, DVec3::from(normal.map(f64::from))) {
            *normal = n.as_vec3().to_array();
        }
    };
    texels.normal.par_iter_mut().zip(texels.position.par_iter().zip(&texels.part)).for_each(texel);
    for Tessellation { mesh, origins, .. } in std::iter::once(tessellation).chain(displayed) {
        for ((normal, position), origin) in mesh.normals.iter_mut().zip(&mesh.positions).zip(origins) {
            if let Some(n) = averaged(origin.patch, *position, DVec3::from(*normal)) {
                *normal = n.to_array();
            }
        }
    }
    Ok(())
}

/// Gives coincident vertices one normal: the mean of the adjacent triangles', weighted by their angles.
fn average_vertices(mesh: &mut TriangleMesh) {
    let key = |p: [f64; 3]| p.map(|x| (x + 0.0).to_bits());
    let mut sums: HashMap<[u64; 3], DVec3> = HashMap::new();
    for triangle in &mesh.triangles {
        let Some(normal) = mesh.triangle_normal(*triangle) else { continue };
        let corners = mesh.corners(*triangle);
        for k in 0..3 {
            let angle = angle_at(&corners, k);
            if angle.is_finite() {
                *sums.entry(key(corners[k].to_array())).or_default() += angle * normal;
            }
        }
    }
    for (normal, position) in mesh.normals.iter_mut().zip(&mesh.positions) {
        let sum = sums.get(&key(*position)).copied().unwrap_or_default();
        if sum.length() > CANCELLED {
            *normal = sum.normalize().to_array();
        }
    }
}

/// Gives every texel the mesh's normal, interpolated over the triangle on which it lies.
fn interpolate(texels: &mut Texels, mesh: &TriangleMesh, bvh: &Bvh, tolerance: f64) {
    let texel = |(normal, position): (&mut [f32; 3], &[f64; 3])| {
        let facing = DVec3::from(normal.map(f64::from));
        let Some(closest) = bvh.closest_point_facing((*position).into(), tolerance, facing, 0.0) else { return };
        let corners = mesh.triangles[closest.triangle as usize].map(|i| DVec3::from(mesh.normals[i as usize]));
        let sum: DVec3 = corners.iter().zip(closest.weights).map(|(n, w)| *n * w).sum();
        if let Some(n) = sum.try_normalize() {
            *normal = n.as_vec3().to_array();
        }
    };
    texels.normal.par_iter_mut().zip(&texels.position).for_each(texel);
}

#[cfg(test)]
mod tests;
