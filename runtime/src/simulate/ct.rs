//! Computed tomography: the whole surface, also what no ray reaches, with a point a voxel.

use super::error::SimulationError;
use super::holes::Holes;
use super::noise::{Noise, Place};
use super::scanner::Scanner;
use super::scene::{Scene, Surface};
use super::subdivide::{Pieces, subdivide};
use super::truth::{Gathered, VirtualScan};
use super::{DROPOUT_STREAM, Object};
use crate::mesh::{TriangleMesh, renumber_used, retain_marked};
use crate::progress::Progress;
use foldhash::fast::RandomState;
use glam::DVec3;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::collections::HashMap;

/// The most points: before these are made, there are some ten times as many triangles.
const MOST: usize = 4_000_000;
/// Edge of a voxel, in spacings: a plane meets 3/2 voxels a squared edge on average over its directions.
const VOXEL: f64 = 1.224_744_871_391_589;
/// Longest edge of the pieces whose corners are gathered in voxels, in spacings.
const FINENESS: f64 = 0.6;
/// How far along the surface a vertex may be off the foot of its place on the triangles, in spacings: across the
/// surface it is exact in any case.
const ALONG: f64 = 1e-3;

/// The surface of the object and of what is around it, `mesh`.
pub(super) fn scan(
    object: &Object<'_>,
    mesh: &TriangleMesh,
    scene: &Scene<'_>,
    scanner: &Scanner,
    progress: &dyn Progress,
) -> Result<VirtualScan, SimulationError> {
    require_no_rays(scanner)?;
    let spacing = scanner.spacing;
    if mesh.area() / spacing.powi(2) > MOST as f64 {
        return Err(SimulationError::TooManyPoints { limit: MOST });
    }
    progress.report("scanning", 0.0, "the surface");
    let fine = subdivide(mesh, FINENESS * spacing, 15 * MOST).ok_or(SimulationError::TooManyPoints { limit: MOST })?;
    if progress.cancelled() {
        return Err(SimulationError::Cancelled);
    }
    progress.report("scanning", 0.5, "the surface");
    let (mut coarse, mut from) = clustered(&fine, VOXEL * spacing);
    let holes = Holes::on(object.mesh, scanner);
    let kept: Vec<bool> = coarse.triangles.iter().map(|t| !is_in(&holes, &coarse, *t)).collect();
    retain_marked(&mut coarse.triangles, &kept);
    let used = renumber_used(&mut coarse.triangles, coarse.positions.len());
    retain_marked(&mut coarse.positions, &used);
    retain_marked(&mut from, &used);
    if coarse.triangles.is_empty() {
        return Err(if scanner.holes > 0 {
            SimulationError::NothingLeft { radius: scanner.hole_radius }
        } else {
            SimulationError::NoSurface
        });
    }
    let places = coarse.positions.iter().map(|p| DVec3::from_array(*p));
    let mut points: Vec<(DVec3, u32)> = places.zip(from.iter().copied()).collect();
    scene.onto_surface(&mut points, ALONG * spacing)?;
    coarse.positions = points.iter().map(|(p, _)| p.to_array()).collect();
    let surfaces: Vec<Surface> = from.iter().map(|from| scene.surface(*from)).collect();
    Ok(measured(coarse, &surfaces, scanner))
}

/// Computed tomography has no rays from a place, and so nothing that depends on them.
fn require_no_rays(scanner: &Scanner) -> Result<(), SimulationError> {
    let properties = [
        (scanner.noise_range > 0.0, "noise that grows with the range"),
        (scanner.noise_angle, "noise that depends on the angle"),
        (scanner.beam > 0.0, "beam"),
    ];
    match properties.into_iter().find(|(is_asked_for, _)| *is_asked_for) {
        Some((_, property)) => Err(SimulationError::NoSuchProperty {
            kind: scanner.kind,
            property,
            instead: "it measures no ranges; take another kind, or leave it out",
        }),
        None => Ok(()),
    }
}

fn is_in(holes: &Holes, mesh: &TriangleMesh, triangle: [u32; 3]) -> bool {
    let [a, b, c] = mesh.corners(triangle);
    mesh.triangle_normal(triangle).is_some_and(|normal| holes.contain((a + b + c) / 3.0, normal))
}

/// One vertex for those in a voxel that face alike: the one that is nearest to their mean, so that it lies on the
/// triangles. Moving vertices onto each other leaves a closed surface closed. With each vertex comes the number of a
/// triangle on which it lies.
fn clustered(fine: &Pieces, voxel: f64) -> (TriangleMesh, Vec<u32>) {
    let mesh = &fine.mesh;
    let low = mesh.bounds().low;
    let normals = mesh.vertex_normals();
    let of_vertex = widest(fine);
    let mut clusters: HashMap<([i64; 3], u8), u32, RandomState> = HashMap::default();
    let mut sums: Vec<(DVec3, DVec3, f64)> = Vec::new();
    let mut number = Vec::with_capacity(mesh.positions.len());
    for ((p, normal), of) in mesh.positions.iter().zip(&normals).zip(&of_vertex) {
        if of.is_none() {
            number.push(u32::MAX);
            continue;
        }
        let (p, normal) = (DVec3::from_array(*p), DVec3::from_array(*normal));
        let cell = ((p - low) / voxel).floor().to_array().map(|c| c as i64);
        // The sides of a wall thinner than a voxel stay apart; of more than three directions the last one takes all.
        let mut slot = 0;
        let cluster = loop {
            let next = sums.len() as u32;
            let cluster = *clusters.entry((cell, slot)).or_insert(next);
            if cluster == next {
                sums.push((DVec3::ZERO, normal, 0.0));
            }
            if slot == 3 || sums[cluster as usize].1.dot(normal) >= 0.0 {
                break cluster;
            }
            slot += 1;
        };
        let sum = &mut sums[cluster as usize];
        sum.0 += p;
        sum.2 += 1.0;
        number.push(cluster);
    }
    let mut nearest = vec![(f64::INFINITY, 0_u32, 0_u32); sums.len()];
    for (vertex, (cluster, of)) in number.iter().zip(&of_vertex).enumerate() {
        let Some(of) = of else { continue };
        let (sum, _, count) = sums[*cluster as usize];
        let distance = DVec3::from_array(mesh.positions[vertex]).distance(sum / count);
        if distance < nearest[*cluster as usize].0 {
            nearest[*cluster as usize] = (distance, vertex as u32, *of);
        }
    }
    let positions = nearest.iter().map(|(_, vertex, _)| mesh.positions[*vertex as usize]).collect();
    let from = nearest.iter().map(|(.., of)| *of).collect();
    let numbered = mesh.triangles.iter().map(|t| t.map(|v| number[v as usize]));
    let triangles = without_folds(numbered.filter(|t| t.iter().all(|v| *v != u32::MAX)));
    (TriangleMesh { positions, triangles, ..TriangleMesh::default() }, from)
}

/// By vertex of the pieces, the triangle whose piece about it has the largest area: in slivers no place is well
/// defined. None where no piece has an area.
fn widest(fine: &Pieces) -> Vec<Option<u32>> {
    let mut widest = vec![(0.0, None); fine.mesh.positions.len()];
    for (triangle, from) in fine.mesh.triangles.iter().zip(&fine.from) {
        let area = fine.mesh.triangle_area(*triangle);
        for v in triangle {
            if area > widest[*v as usize].0 {
                widest[*v as usize] = (area, Some(*from));
            }
        }
    }
    widest.into_iter().map(|(_, from)| from).collect()
}

/// Triangles with three corners; two that lie back to back are none.
fn without_folds(triangles: impl Iterator<Item = [u32; 3]>) -> Vec<[u32; 3]> {
    let whole = triangles.filter(|[a, b, c]| a != b && b != c && c != a);
    let mut sorted: Vec<([u32; 3], bool, [u32; 3])> = whole
        .map(|t| {
            let least = (0..3).min_by_key(|k| t[*k]).unwrap_or(0);
            let around = [t[least], t[(least + 1) % 3], t[(least + 2) % 3]];
            let is_forward = around[1] < around[2];
            let key = if is_forward { around } else { [around[0], around[2], around[1]] };
            (key, is_forward, around)
        })
        .collect();
    sorted.par_sort_unstable();
    let mut kept = Vec::with_capacity(sorted.len());
    for run in sorted.chunk_by(|a, b| a.0 == b.0) {
        let back = run.iter().filter(|t| !t.1).count();
        let forward = run.len() - back;
        // Sorted: those that go backwards come first.
        let rest = if back > forward { &run[..back - forward] } else { &run[back..run.len() - back] };
        kept.extend(rest.iter().map(|t| t.2));
    }
    kept
}

/// Adds the noise along the normals.
fn measured(mesh: TriangleMesh, surfaces: &[Surface], scanner: &Scanner) -> VirtualScan {
    let noise = Noise::new(scanner);
    let normals = mesh.vertex_normals();
    let mut random = scanner.random(DROPOUT_STREAM);
    let white: Vec<f64> = normals.iter().map(|_| StandardNormal.sample(&mut random)).collect();
    let moved = |((p, normal), white): ((&[f64; 3], &[f64; 3]), &f64)| {
        let (point, normal) = (DVec3::from_array(*p), DVec3::from_array(*normal));
        let place = Place { point, range: 0.0, cosine: 1.0, station: 0 };
        (point + noise.error(place, *white) * normal).to_array()
    };
    let positions = mesh.positions.par_iter().zip(&normals).zip(&white).map(moved).collect();
    let mut gathered = Gathered { positions, ..Gathered::default() };
    surfaces.iter().for_each(|surface| *gathered.surfaces.of(*surface) += 1);
    gathered.triangles = if scanner.cloud { Vec::new() } else { mesh.triangles };
    gathered.finish(scanner, scanner.spacing, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_back_to_back_vanish_in_pairs() {
        let kept = without_folds([[0, 1, 2], [2, 1, 0], [3, 4, 5], [5, 5, 1], [4, 3, 5], [5, 4, 3]].into_iter());
        assert_eq!(kept, [[3, 5, 4]]);
    }
}
