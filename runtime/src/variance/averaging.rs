//! Rays along normals that are averaged where patches meet.
//!
//! Along their own normals two patches part at an edge where the scan lies outside, and run through each other where it lies
//! inside ([VA], conclusion). Here patches that meet take one normal at their common edge, and turn back to their own within a
//! band beside it, so that the displaced surface is closed.

mod crease;
mod segments;

use crate::bvh::{Bvh, BvhError};
use crate::mesh::TriangleMesh;
use crate::model::{Tessellation, Texels};
use glam::DVec3;
use rayon::prelude::*;
use segments::Segments;
use std::collections::HashMap;

/// Points of patches coincide up to this share of the model's size: chords of a tessellated edge leave it by less.
const COINCIDENT: f64 = 5e-4;

/// How wide the band beside an edge is where nothing else is said: this share of the model's size.
pub const DEFAULT_WIDTH: f64 = 0.02;

/// The widest band: this share of the model's size.
pub const MAX_WIDTH: f64 = 0.1;

/// Where the normals of patches that meet nearly cancel each other (two sides of a sheet), there is none between them.
const CANCELLED: f64 = 1e-3;

/// Replaces the normals of texels and of vertices (which documents displace) by averaged ones.
///
/// Of a model: where an edge of a patch lies on another patch, or on another edge of its own, they take the mean of their
/// normals, weighted by the angles of the patches there; within `width` beside it normals turn linearly from that to their own.
/// Of a mesh from elsewhere, which has no patches: normals of vertices at one place are averaged, weighted by the triangles' angles, and
/// interpolated over the triangles; `width` plays no role.
///
/// Gives the cosine of the angle by which each texel's normal was turned ([`Deviations::cosine`](super::Deviations)).
///
/// # Errors
/// As [`Bvh::build`], of the model's surface.
pub fn average_normals(texels: &mut Texels, tessellation: &mut Tessellation, width: f64) -> Result<Vec<f32>, BvhError> {
    let own = texels.normal.clone();
    turn_normals(texels, tessellation, width)?;
    let cosine = |(own, turned): (&[f32; 3], &[f32; 3])| {
        let [own, turned] = [own, turned].map(|n| DVec3::from(n.map(f64::from)));
        // What was not turned looks along its own normal, to the last bit.
        if own == turned { 1.0 } else { own.dot(turned) as f32 }
    };
    Ok(own.par_iter().zip(&texels.normal).map(cosine).collect())
}

fn turn_normals(texels: &mut Texels, tessellation: &mut Tessellation, width: f64) -> Result<(), BvhError> {
    let bvh = Bvh::build(&tessellation.mesh)?;
    let tolerance = COINCIDENT * diagonal(&tessellation.mesh);
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
    let Tessellation { mesh, origins } = tessellation;
    for ((normal, position), origin) in mesh.normals.iter_mut().zip(&mesh.positions).zip(origins) {
        if let Some(n) = averaged(origin.patch, *position, DVec3::from(*normal)) {
            *normal = n.to_array();
        }
    }
    Ok(())
}

/// Gives vertices at one place one normal: the mean of the triangles' around it, weighted by their angles.
fn average_vertices(mesh: &mut TriangleMesh) {
    let key = |p: [f64; 3]| p.map(|x| (x + 0.0).to_bits());
    let mut sums: HashMap<[u64; 3], DVec3> = HashMap::new();
    for triangle in &mesh.triangles {
        let Some(normal) = mesh.triangle_normal(*triangle) else { continue };
        let corners = triangle.map(|i| DVec3::from(mesh.positions[i as usize]));
        for k in 0..3 {
            let angle = (corners[(k + 1) % 3] - corners[k]).angle_between(corners[(k + 2) % 3] - corners[k]);
            if angle.is_finite() {
                *sums.entry(key(corners[k].to_array())).or_default() += angle * DVec3::from(normal);
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

/// Gives every texel the mesh's normals, interpolated over the triangle on which it lies.
fn interpolate(texels: &mut Texels, mesh: &TriangleMesh, bvh: &Bvh, tolerance: f64) {
    let texel = |(normal, position): (&mut [f32; 3], &[f64; 3])| {
        let own = normal.map(f64::from);
        let Some(found) = bvh.closest_point_facing(*position, tolerance, own) else { return };
        let corners = mesh.triangles[found.triangle as usize].map(|i| DVec3::from(mesh.normals[i as usize]));
        let sum: DVec3 = corners.iter().zip(found.weights).map(|(n, w)| *n * w).sum();
        if let Some(n) = sum.try_normalize() {
            *normal = n.as_vec3().to_array();
        }
    };
    texels.normal.par_iter_mut().zip(&texels.position).for_each(texel);
}

/// Diagonal of the box around a mesh.
fn diagonal(mesh: &TriangleMesh) -> f64 {
    mesh.bounds().map_or(0.0, |(low, high)| DVec3::from(low).distance(DVec3::from(high)))
}

#[cfg(test)]
mod tests;
