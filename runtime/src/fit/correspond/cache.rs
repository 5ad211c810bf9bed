//! What is remembered of the scan's points from one evaluation of an objective to the next: where their feet were, and how
//! far the model may move until another part of it can be nearer. Close to an optimum hardly any point needs a search.

use super::facets::Facets;
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::points::Points;
use glam::DVec3;
use std::sync::{Mutex, MutexGuard};

/// The feet of an objective's points.
#[derive(Debug)]
pub(crate) struct FootCache(Mutex<CacheState>);

/// What `FootCache` holds, for one evaluation.
#[derive(Debug)]
pub(crate) struct CacheState {
    /// The facets' corners at the last evaluation, in the scan's frame. Millimetres.
    corners: Vec<DVec3>,
    /// The sum, over all evaluations, of the farthest way that any corner went. Millimetres.
    travelled: f64,
    /// How much farther than its nearest facet a point's search looks for others. Millimetres.
    reach: f64,
    points: Vec<CachedFoot>,
}

/// What is known of a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CachedFoot {
    /// The patch that it belongs to, `NOWHERE` if none is within the cut-off.
    pub(crate) patch: u32,
    pub(crate) uv: [f64; 2],
    /// This holds until the model has travelled so far.
    pub(crate) until: f64,
}

/// How much farther than its nearest facet a point's search looks: so many sigma, which is enough for the last steps of a fit, and
/// where points are dense so many times as far as the next one in the list is, which is enough for all steps that are left to all
/// points when some of them have been fitted. Where they are sparse, that would be too far, in the scan's radii: too many facets are
/// within reach.
const SIGMAS: f64 = 0.15;
const NEIGHBOURS: f64 = 2.0;
const WIDEST: f64 = 0.06;

/// The patch of points that are too far from all.
pub(crate) const NOWHERE: u32 = u32::MAX;

impl CachedFoot {
    const NOTHING: Self = Self { patch: NOWHERE, uv: [0.0; 2], until: f64::NEG_INFINITY };
}

/// The memory of some of the points.
pub(crate) struct CacheSlice<'m> {
    pub(crate) known: &'m mut [CachedFoot],
    pub(crate) travelled: f64,
    pub(crate) reach: f64,
}

impl FootCache {
    /// Nothing is known yet of these points.
    pub(crate) fn new(points: &Points, sigma: f64) -> Self {
        let near = NEIGHBOURS * points.spacing();
        let reach = (SIGMAS * sigma).max(if near < WIDEST * points.gyration() { near } else { 0.0 });
        Self(Mutex::new(CacheState {
            corners: Vec::new(),
            travelled: 0.0,
            reach,
            points: vec![CachedFoot::NOTHING; points.len()],
        }))
    }

    /// The memory once the model has moved to where it is now; None while another evaluation has it, which then does
    /// without.
    pub(crate) fn follow(&self, facets: &Facets, motion: &Isometry) -> Option<MutexGuard<'_, CacheState>> {
        let mut state = self.0.try_lock().ok()?;
        let corners: Vec<DVec3> = facets.vertices().map(|p| motion.apply(p)).collect();
        let farthest = if corners.len() == state.corners.len() {
            corners.iter().zip(&state.corners).map(|(a, b)| distance(*a, *b)).fold(0.0, f64::max)
        } else {
            f64::INFINITY
        };
        state.corners = corners;
        state.travelled += farthest;
        if !state.travelled.is_finite() {
            state.travelled = 0.0;
            state.points.fill(CachedFoot::NOTHING);
        }
        Some(state)
    }
}

/// How far a corner went: corners of patches that do not exist stay where they are, but come from and go to nowhere.
fn distance(a: DVec3, b: DVec3) -> f64 {
    match (a.is_finite(), b.is_finite()) {
        (true, true) => a.distance(b),
        (false, false) => 0.0,
        _ => f64::INFINITY,
    }
}

impl CacheState {
    /// The memory of `size` points each, in order.
    pub(crate) fn parts(&mut self, size: usize) -> Vec<CacheSlice<'_>> {
        let Self { travelled, reach, points, .. } = self;
        points.chunks_mut(size).map(|known| CacheSlice { known, travelled: *travelled, reach: *reach }).collect()
    }
}
