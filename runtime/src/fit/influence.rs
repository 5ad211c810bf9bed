//! What every single point says about the coordinates: residuals with the rows of the Jacobian, for the uncertainties.

use super::distance::{Foot, refine};
use super::memory::Part;
use super::objective::{CHUNK, Objective, Placed, remember};
use super::space::Estimate;
use glam::DVec3;
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::ops::Range;

/// Points that have a foot, in the order of the objective's points.
#[derive(Default)]
pub(crate) struct Rows {
    pub(crate) points: Vec<RowPoint>,
    /// d(signed distance)/d(scaled local coordinate), as many for each point as there are coordinates.
    pub(crate) jacobian: Vec<f64>,
}

/// A point with its foot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowPoint {
    /// Which of the objective's points.
    pub(crate) index: u32,
    pub(crate) patch: u32,
    /// From the model's surface to the point, positive on the side of dS/du x dS/dv. Millimetres.
    pub(crate) distance: f64,
    /// See `Loss`.
    pub(crate) weight: f64,
    /// See `Loss`.
    pub(crate) curvature: f64,
}

/// Chunks that are computed at a time: memory does not grow with the scan.
const AT_ONCE: usize = 64;

impl Objective<'_> {
    /// Makes something of the rows of every chunk of points, on all threads, and hands it to `each` in the points' order. None
    /// where the model does not exist.
    pub(crate) fn for_rows<T: Send>(
        &self,
        at: &Estimate,
        make: impl Fn(Rows) -> T + Sync,
        mut each: impl FnMut(T),
    ) -> Option<()> {
        let placed = self.place(at).ok()?;
        let chain = self.space.chain(at);
        let count = self.points.len();
        let chunks: Vec<Range<usize>> =
            (0..count).step_by(CHUNK).map(|start| start..(start + CHUNK).min(count)).collect();
        let mut memory = self.memory.as_ref().and_then(|m| m.follow(&placed.facets, &at.motion));
        let mut parts: Vec<Option<Part>> = match &mut memory {
            Some(memory) => memory.parts(CHUNK).into_iter().map(Some).collect(),
            None => chunks.iter().map(|_| None).collect(),
        };
        for (some, parts) in chunks.chunks(AT_ONCE).zip(parts.chunks_mut(AT_ONCE)) {
            let made: Vec<T> = some
                .par_iter()
                .zip(parts)
                .map(|(range, part)| make(self.rows(&placed, at, range.clone(), part.as_mut(), &chain)))
                .collect();
            made.into_iter().for_each(&mut each);
        }
        Some(())
    }

    fn rows(
        &self,
        placed: &Placed,
        at: &Estimate,
        range: Range<usize>,
        mut memory: Option<&mut Part>,
        chain: &DMatrix<f64>,
    ) -> Rows {
        let mut rows = Rows::default();
        let start = range.start;
        let found = self.search(placed, &at.motion, range, memory.as_deref_mut());
        for these in found.chunk_by(|a, b| a.patch == b.patch) {
            let patch = these[0].patch as usize;
            let (q, uv): (Vec<DVec3>, Vec<[f64; 2]>) = these.iter().map(|f| (f.q, f.uv)).unzip();
            let instance = &*placed.instance;
            let closed = self.layout.closed(patch);
            let Ok(feet) = refine(instance, patch, closed, &q, &uv, self.tolerance) else { continue };
            remember(memory.as_deref_mut(), start, these, &feet);
            let active = &self.space.model.parts()[patch].active;
            let (u, v): (Vec<f64>, Vec<f64>) = feet.iter().map(|f| (f.uv[0], f.uv[1])).unzip();
            let mut jacobian = vec![0.0; feet.len() * active.len() * 3];
            if instance.jacobian(patch, &u, &v, &mut jacobian).is_err() {
                continue;
            }
            for (i, (foot, found)) in feet.iter().zip(these).enumerate() {
                let (away, distance) = self.away(foot, found.q);
                let slopes = &jacobian[i * active.len() * 3..(i + 1) * active.len() * 3];
                rows.push(found.index, patch, distance, self, foot.d2);
                self.push_row(away, foot, active, slopes, chain, &mut rows.jacobian);
            }
        }
        rows
    }

    /// The unit direction from the foot to the point, turned to the normal's side, and the signed distance.
    fn away(&self, foot: &Foot, q: DVec3) -> (DVec3, f64) {
        let normal = foot.normal.normalize_or_zero();
        let d = foot.d2.sqrt();
        let along = (q - foot.point).dot(normal);
        if d > 1e-6 * self.loss.sigma {
            let sign = if along < 0.0 { -1.0 } else { 1.0 };
            ((q - foot.point) * (sign / d), sign * d)
        } else {
            (normal, along)
        }
    }

    fn push_row(
        &self,
        away: DVec3,
        foot: &Foot,
        active: &[u32],
        slopes: &[f64],
        chain: &DMatrix<f64>,
        out: &mut Vec<f64>,
    ) {
        let n = self.space.model.parameters().len();
        let start = out.len();
        out.resize(start + self.space.dim(), 0.0);
        let turn = (foot.point - self.space.centre).cross(away);
        let by_parameter =
            active.iter().zip(slopes.chunks_exact(3)).map(|(a, s)| (*a as usize, away.dot(DVec3::from_slice(s))));
        let by_motion = away.to_array().into_iter().chain(turn.to_array()).enumerate().map(|(k, s)| (n + k, s));
        for (row, slope) in by_parameter.chain(by_motion) {
            for (k, out) in out[start..].iter_mut().enumerate() {
                // The surface moving outwards brings it nearer to a point outside.
                *out -= slope * chain[(row, k)];
            }
        }
    }
}

impl Rows {
    fn push(&mut self, index: usize, patch: usize, distance: f64, objective: &Objective, d2: f64) {
        let (weight, curvature) = (objective.loss.weight(d2), objective.loss.curvature(d2));
        self.points.push(RowPoint { index: index as u32, patch: patch as u32, distance, weight, curvature });
    }
}
