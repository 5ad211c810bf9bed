//! Casting rays in native code.

use super::trace::{Distances, Rays};
use rayon::prelude::*;

/// Texels a task.
const CHUNK: usize = 1024;

/// Casts all rays, on rayon's threads.
pub(super) fn trace(rays: &Rays) -> Distances {
    let mut outward = vec![f32::NAN; rays.len()];
    let mut inward = vec![f32::NAN; rays.len()];
    let chunks = outward.par_chunks_mut(CHUNK).zip(inward.par_chunks_mut(CHUNK)).enumerate();
    chunks.for_each(|(chunk, (outward, inward))| {
        for (i, (outward, inward)) in outward.iter_mut().zip(inward).enumerate() {
            if let Some((origin, normal)) = rays.get(chunk * CHUNK + i) {
                let distance = |direction, facing| {
                    let ray = rays.scan.local_ray(origin, direction, facing);
                    let hit = rays.scan.cast(&ray, -rays.tolerance, rays.max_distance);
                    hit.map_or(f32::NAN, |hit| hit.t.max(0.0))
                };
                *outward = distance(normal, rays.facing);
                *inward = distance(-normal, -rays.facing);
            }
        }
    });
    Distances { outward, inward }
}
