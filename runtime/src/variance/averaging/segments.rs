//! Pieces of edges with what is to be added to normals beside them.

use glam::DVec3;
use std::collections::HashMap;

/// A piece of an edge on a patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    /// Millimetres.
    pub(super) ends: [DVec3; 2],
    /// What is to be added to the patch's unit normal at each end; linear between.
    pub(super) corrections: [DVec3; 2],
}

/// Those of one patch, to be found by place.
pub(super) struct Segments {
    all: Vec<Segment>,
    /// Which of them are within `width` of a cubic cell of that side.
    cells: HashMap<[i64; 3], Vec<u32>>,
    width: f64,
    /// What is no further from a segment is on it.
    touching: f64,
}

impl Segments {
    /// Corrections fade to nothing at a distance of `width`.
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

    /// What is to be added to the normal at a point; none far from all segments. Of several segments the mean, weighted by the
    /// inverse squares of their distances (Shepard 1968) and, so that none begins to count all at once, by how far within
    /// the band the point is; the whole falls linearly with the distance of the nearest.
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
    /// How far away the segment's nearest point is, and the correction there.
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
