//! Segments of edges, with corrections of the normals beside them.

use glam::DVec3;
use std::collections::HashMap;

/// A segment of an edge of a patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    /// Its ends. Millimetres.
    pub(super) ends: [DVec3; 2],
    /// Corrections that are added to the patch's unit normal at each end; linear between.
    pub(super) corrections: [DVec3; 2],
}

/// The segments of one patch in a grid of cubic cells.
pub(super) struct Segments {
    all: Vec<Segment>,
    /// The segments within `width` of each cell, whose side is `width`.
    cells: HashMap<[i64; 3], Vec<u32>>,
    width: f64,
    /// A point at this distance is on a segment.
    touching: f64,
}

impl Segments {
    /// Corrections decrease to zero at a distance of `width`.
    pub(super) fn new(all: Vec<Segment>, width: f64, touching: f64) -> Segments {
        let mut segments = Segments { all, cells: HashMap::new(), width, touching };
        for (i, segment) in segments.all.iter().enumerate() {
            let [a, b] = segment.ends;
            let low = cell(a.min(b) - width, width);
            let high = cell(a.max(b) + width, width);
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        segments.cells.entry([x, y, z]).or_default().push(i as u32);
                    }
                }
            }
        }
        segments
    }

    /// The correction of the normal at a point; none far from all segments. The corrections of several segments are
    /// averaged with the inverse squares of their distances as weights (Shepard 1968), times a factor that decreases to
    /// zero at the end of the band, so that the average is continuous; the result decreases linearly with the distance
    /// of the nearest.
    pub(super) fn correction(&self, point: DVec3) -> Option<DVec3> {
        let near = self.cells.get(&cell(point, self.width))?;
        let (mut sum, mut weights, mut least) = (DVec3::ZERO, 0.0, f64::INFINITY);
        for &i in near {
            let (distance, correction) = self.all[i as usize].nearest(point);
            if distance <= self.touching {
                return Some(correction);
            }
            if distance < self.width {
                let weight = (1.0 - distance / self.width) / (distance * distance);
                sum += weight * correction;
                weights += weight;
                least = least.min(distance);
            }
        }
        (weights > 0.0).then(|| sum / weights * (1.0 - least / self.width))
    }
}

impl Segment {
    /// The distance of the segment's nearest point, and the correction there.
    fn nearest(&self, point: DVec3) -> (f64, DVec3) {
        let [a, b] = self.ends;
        let along = b - a;
        let square = along.length_squared();
        let t = if square > 0.0 { ((point - a).dot(along) / square).clamp(0.0, 1.0) } else { 0.0 };
        (point.distance(a + t * along), self.corrections[0].lerp(self.corrections[1], t))
    }
}

fn cell(point: DVec3, width: f64) -> [i64; 3] {
    (point / width).floor().to_array().map(|c| c.clamp(-1e15, 1e15) as i64)
}
