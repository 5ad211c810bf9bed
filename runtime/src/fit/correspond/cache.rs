//! A cache of foot points between evaluations of an objective: where the feet were, and how far the model may move
//! until another part of it can be nearer. Close to an optimum hardly any point needs a search.

use glam::DVec3;
use std::sync::{Mutex, MutexGuard};

/// The feet of an objective's points.
#[derive(Debug)]
pub(crate) struct FootCache(Mutex<CacheState>);

/// The content of a `FootCache`, held by one evaluation at a time.
#[derive(Debug)]
pub(crate) struct CacheState {
    /// The facets' vertices at the last evaluation, in the scan's frame. Millimetres.
    vertices: Vec<DVec3>,
    /// Sum over all evaluations of the longest displacement of any vertex. Millimetres.
    travelled: f64,
    /// See `Query::reach`. Millimetres.
    reach: f64,
    points: Vec<CachedFoot>,
}

/// A point's foot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CachedFoot {
    /// The patch on which it lies, `NOWHERE` if none is within the cut-off.
    pub(crate) patch: u32,
    pub(crate) uv: [f64; 2],
    /// The patch is the nearest one until the model has travelled so far. Millimetres.
    pub(crate) until: f64,
}

/// The patch of points that are too far from all patches.
pub(crate) const NOWHERE: u32 = u32::MAX;

impl CachedFoot {
    const NOTHING: Self = Self { patch: NOWHERE, uv: [0.0; 2], until: f64::NEG_INFINITY };
}

/// The cached feet of a chunk of points.
pub(crate) struct CacheSlice<'m> {
    pub(crate) known: &'m mut [CachedFoot],
    pub(crate) travelled: f64,
    pub(crate) reach: f64,
}

impl FootCache {
    /// An empty cache for a number of points, whose searches have a reach (see `Query::reach`; millimetres).
    pub(crate) fn new(points: usize, reach: f64) -> Self {
        let (vertices, points) = (Vec::new(), vec![CachedFoot::NOTHING; points]);
        Self(Mutex::new(CacheState { vertices, travelled: 0.0, reach, points }))
    }

    /// The cache after the model has moved to where it is now, with the facets' vertices in the scan's frame; None
    /// while another evaluation holds it, so that this one does without.
    pub(crate) fn follow(&self, vertices: Vec<DVec3>) -> Option<MutexGuard<'_, CacheState>> {
        let mut state = self.0.try_lock().ok()?;
        let farthest = if vertices.len() == state.vertices.len() {
            vertices.iter().zip(&state.vertices).map(|(a, b)| displacement(*a, *b)).fold(0.0, f64::max)
        } else {
            f64::INFINITY
        };
        state.vertices = vertices;
        state.travelled += farthest;
        if !state.travelled.is_finite() {
            state.travelled = 0.0;
            state.points.fill(CachedFoot::NOTHING);
        }
        Some(state)
    }
}

/// The displacement of a vertex: none between two places that do not exist, and an infinite one to or from such a
/// place.
fn displacement(a: DVec3, b: DVec3) -> f64 {
    match (a.is_finite(), b.is_finite()) {
        (true, true) => a.distance(b),
        (false, false) => 0.0,
        _ => f64::INFINITY,
    }
}

impl CacheState {
    /// The feet in slices of `size` points, in order.
    pub(crate) fn slices(&mut self, size: usize) -> Vec<CacheSlice<'_>> {
        let Self { travelled, reach, points, .. } = self;
        points.chunks_mut(size).map(|known| CacheSlice { known, travelled: *travelled, reach: *reach }).collect()
    }
}
