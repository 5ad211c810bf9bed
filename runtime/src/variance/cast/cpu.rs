//! Ray casting in native code.

use super::{Distances, Rays};
use crate::bvh::{BothWays, HitCriteria, Line, PACKET};
use rayon::prelude::*;
use std::ops::Range;

/// Side of the squares of texels whose rays are cast as one packet, since they run close to each other.
const TILE: usize = 4;

/// Casts all rays on rayon's threads.
pub(super) fn cast(rays: &Rays) -> Distances {
    let mut outward = vec![f32::NAN; rays.len()];
    let mut inward = vec![f32::NAN; rays.len()];
    let (mut rest_outward, mut rest_inward) = (&mut outward[..], &mut inward[..]);
    let mut tasks = Vec::new();
    for texels in bands(&rays.texels.index, rays.texels.width as usize) {
        let (band_outward, band_inward);
        (band_outward, rest_outward) = rest_outward.split_at_mut(texels.len());
        (band_inward, rest_inward) = rest_inward.split_at_mut(texels.len());
        tasks.push((texels, band_outward, band_inward));
    }
    tasks.into_par_iter().for_each(|(texels, outward, inward)| cast_band(rays, texels, outward, inward));
    Distances { outward, inward }
}

/// The texels in every `TILE` rows of the texture, given their ascending indices in it.
fn bands(index: &[u32], width: usize) -> Vec<Range<usize>> {
    let mut bands = Vec::new();
    let mut start = 0;
    while start < index.len() {
        let band = index[start] as usize / (TILE * width.max(1));
        let end = start + index[start..].partition_point(|&i| i as usize / (TILE * width.max(1)) == band);
        bands.push(start..end);
        start = end;
    }
    bands
}

/// Casts the rays of `TILE` rows, tile by tile.
fn cast_band(rays: &Rays, texels: Range<usize>, outward: &mut [f32], inward: &mut [f32]) {
    let width = (rays.texels.width as usize).max(1);
    let index = &rays.texels.index[texels.clone()];
    let first_row = index.first().map_or(0, |&i| i as usize / (TILE * width) * TILE);
    let column = |r: usize, i: usize| index[i] as usize - (first_row + r) * width;
    // The texels of each row that are still to be cast.
    let mut rows: [Range<usize>; TILE] = std::array::from_fn(|r| {
        let before = |row: usize| index.partition_point(|&i| (i as usize) < row * width);
        before(first_row + r)..before(first_row + r + 1)
    });
    let criteria =
        HitCriteria { reach: rays.max_distance, tolerance: rays.tolerance, facing: rays.facing, cosine: rays.cosine };
    loop {
        let remaining = rows.iter().enumerate().filter(|(_, row)| row.start < row.end);
        let next = remaining.map(|(r, row)| column(r, row.start)).min();
        let Some(end) = next.map(|column| (column / TILE + 1) * TILE) else { return };
        let mut members = [0; PACKET];
        let mut lines = [Line::default(); PACKET];
        let mut count = 0;
        for (r, row) in rows.iter_mut().enumerate() {
            while row.start < row.end && column(r, row.start) < end && count < PACKET {
                if let Some((origin, direction)) = rays.get(texels.start + row.start) {
                    (members[count], lines[count]) = (row.start, Line { origin, direction });
                    count += 1;
                }
                row.start += 1;
            }
        }
        let mut hits = [BothWays::NOTHING; PACKET];
        rays.scan.cast_both_ways(&lines[..count], criteria, &mut hits);
        let or_none = |t: f32| if t.is_finite() { t } else { f32::NAN };
        for (&i, hit) in members[..count].iter().zip(hits) {
            (outward[i], inward[i]) = (or_none(hit.ahead), or_none(hit.behind));
        }
    }
}
