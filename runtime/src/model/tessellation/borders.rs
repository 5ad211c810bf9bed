//! The borders of patches, and which of them are the same curve in space.

use super::intervals::{Axes, Interval, split};
use crate::mesh::Bounds;
use crate::model::{EvaluationError, Instance, Partials};
use glam::DVec3;
use std::collections::HashMap;

/// Borders that are nearer than this fraction of the model's diagonal are the same: parts of one curve that a script
/// computes in several ways differ by rounding, some 1e-15 of their coordinates.
const COINCIDENT: f64 = 1e-8;
/// Places at which a piece is sampled, its ends included.
const SAMPLES: usize = 33;
/// Steps of Gauss and Newton to the nearest point of a curve.
const STEPS: usize = 12;
/// Rounds in which pieces that end beside others are divided there.
const ROUNDS: usize = 6;
/// Most intervals of an axis that such divisions may lead to.
const MOST_INTERVALS: usize = 4096;

/// A side of a patch: where v is 0, u is 1, v is 1 or u is 0.
pub(in crate::model) const SIDES: [Side; 4] =
    [Side { along: 0, at: 0.0 }, Side { along: 1, at: 1.0 }, Side { along: 0, at: 1.0 }, Side { along: 1, at: 0.0 }];

/// A side of a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::model) struct Side {
    /// The parameter that runs along it: 0 for u, 1 for v.
    pub(in crate::model) along: usize,
    /// The value of the other one.
    at: f64,
}

impl Side {
    /// (u, v) at a value of the parameter along it.
    pub(in crate::model) fn uv(self, t: f64) -> (f64, f64) {
        if self.along == 0 { (t, self.at) } else { (self.at, t) }
    }

    /// Whether it has a point of the patch.
    pub(in crate::model) fn has(self, u: f64, v: f64) -> bool {
        self.at == if self.along == 0 { v } else { u }
    }

    /// In words.
    pub(in crate::model) fn name(self) -> &'static str {
        match (self.along == 0, self.at == 0.0) {
            (true, true) => "v = 0",
            (true, false) => "v = 1",
            (false, true) => "u = 0",
            (false, false) => "u = 1",
        }
    }
}

/// A piece of the border of a patch: an interval of a side.
#[derive(Clone, Debug)]
pub(in crate::model) struct Piece {
    pub(in crate::model) patch: usize,
    pub(in crate::model) side: Side,
    pub(in crate::model) interval: usize,
    /// Clusters of its first and its last point.
    pub(in crate::model) ends: [u32; 2],
    /// The piece whose points it has, and whether it runs the other way; itself where it is the first of its curve.
    pub(in crate::model) leader: usize,
    pub(in crate::model) reversed: bool,
    /// Whether all of it is one point.
    pub(in crate::model) is_point: bool,
    samples: Vec<DVec3>,
}

/// The borders of all patches.
#[derive(Clone, Debug, Default)]
pub(in crate::model) struct Borders {
    pub(in crate::model) pieces: Vec<Piece>,
    /// A point of every cluster of ends.
    pub(in crate::model) ends: Vec<DVec3>,
    /// Distance below which points are the same. Millimetres.
    pub(in crate::model) tolerance: f64,
}

impl Borders {
    /// Finds the borders that are the same curve. Intervals are divided where a border of another patch ends beside
    /// them.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub(in crate::model) fn find(instance: &dyn Instance, axes: &mut [Axes]) -> Result<Self, EvaluationError> {
        for _ in 0..ROUNDS {
            let mut borders = Self::of_intervals(instance, axes)?;
            let cuts = borders.cuts(instance, axes)?;
            if cuts.is_empty() {
                borders.match_pieces(instance, axes)?;
                return Ok(borders);
            }
            cut(axes, cuts);
        }
        let mut borders = Self::of_intervals(instance, axes)?;
        borders.match_pieces(instance, axes)?;
        Ok(borders)
    }

    fn of_intervals(instance: &dyn Instance, axes: &[Axes]) -> Result<Self, EvaluationError> {
        let mut borders = Self::default();
        for (patch, axes) in axes.iter().enumerate() {
            for side in SIDES {
                for (interval, stretch) in axes[side.along].iter().enumerate() {
                    let at = |k: usize| stretch.fraction(k as f64 / (SAMPLES - 1) as f64);
                    let (u, v): (Vec<f64>, Vec<f64>) = (0..SAMPLES).map(|k| side.uv(at(k))).unzip();
                    let mut points = vec![[0.0; 3]; SAMPLES];
                    instance.points(patch, &u, &v, &mut points)?;
                    let samples = points.into_iter().map(DVec3::from_array).collect();
                    let leader = borders.pieces.len();
                    let (ends, reversed, is_point) = ([0; 2], false, false);
                    borders.pieces.push(Piece { patch, side, interval, ends, leader, reversed, is_point, samples });
                }
            }
        }
        let all: Bounds = borders.pieces.iter().flat_map(|p| &p.samples).copied().collect();
        borders.tolerance = COINCIDENT * all.diagonal();
        borders.cluster();
        Ok(borders)
    }

    /// Gives ends that coincide one number.
    fn cluster(&mut self) {
        let cell = (4.0 * self.tolerance).max(f64::MIN_POSITIVE);
        let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        for i in 0..self.pieces.len() {
            for end in 0..2 {
                let piece = &self.pieces[i];
                let point = piece.samples[if end == 0 { 0 } else { SAMPLES - 1 }];
                let key = (point / cell).floor().to_array().map(|c| c as i64);
                let near = (0..27)
                    .filter_map(|k| cells.get(&[key[0] + k % 3 - 1, key[1] + k / 3 % 3 - 1, key[2] + k / 9 - 1]));
                let known = near.flatten().find(|c| self.ends[**c as usize].distance(point) <= self.tolerance);
                let cluster = known.copied().unwrap_or(self.ends.len() as u32);
                if cluster as usize == self.ends.len() {
                    self.ends.push(point);
                    cells.entry(key).or_default().push(cluster);
                }
                self.pieces[i].ends[end] = cluster;
            }
            let tolerance = self.tolerance;
            let piece = &mut self.pieces[i];
            piece.is_point = piece.samples.iter().all(|p| p.distance(piece.samples[0]) <= tolerance);
        }
    }

    /// The places inside of intervals at which a piece of another border ends: patch, axis, interval and parameter.
    fn cuts(&self, instance: &dyn Instance, axes: &[Axes]) -> Result<Vec<(usize, usize, usize, f64)>, EvaluationError> {
        let mut by_x: Vec<usize> = (0..self.ends.len()).collect();
        by_x.sort_unstable_by(|a, b| self.ends[*a].x.total_cmp(&self.ends[*b].x));
        let mut cuts = Vec::new();
        for piece in self.pieces.iter().filter(|piece| !piece.is_point) {
            let bounds: Bounds = piece.samples.iter().copied().collect();
            // Between samples a curve leaves their box by less than its chords are long.
            let margin = DVec3::splat(self.tolerance + 0.5 * piece.longest_chord());
            let (low, high) = (bounds.low - margin, bounds.high + margin);
            let first = by_x.partition_point(|c| self.ends[*c].x < low.x);
            let near: Vec<usize> = by_x[first..]
                .iter()
                .copied()
                .take_while(|c| self.ends[*c].x <= high.x)
                .filter(|c| !piece.ends.contains(&(*c as u32)))
                .filter(|c| self.ends[*c].cmpge(low).all() && self.ends[*c].cmple(high).all())
                .collect();
            if near.is_empty() {
                continue;
            }
            let targets: Vec<DVec3> = near.iter().map(|c| self.ends[*c]).collect();
            let interval = axes[piece.patch][piece.side.along][piece.interval];
            let size = interval.end - interval.start;
            for (t, distance) in piece.nearest(instance, axes, &targets)? {
                let inside = t > interval.start + 1e-9 * size && t < interval.end - 1e-9 * size;
                if inside && distance <= self.tolerance {
                    cuts.push((piece.patch, piece.side.along, piece.interval, t));
                }
            }
        }
        Ok(cuts)
    }

    /// Finds for every piece the first one that is the same curve.
    fn match_pieces(&mut self, instance: &dyn Instance, axes: &[Axes]) -> Result<(), EvaluationError> {
        let mut leaders: HashMap<[u32; 2], Vec<usize>> = HashMap::new();
        for i in 0..self.pieces.len() {
            let piece = &self.pieces[i];
            if piece.is_point {
                continue;
            }
            let [a, b] = piece.ends;
            let leaders = leaders.entry([a.min(b), a.max(b)]).or_default();
            let mut found = None;
            for leader in leaders.iter() {
                if let Some(reversed) = self.pieces[*leader].runs_along(piece, instance, axes, self.tolerance)? {
                    found = Some((*leader, reversed));
                    break;
                }
            }
            match found {
                Some((leader, reversed)) => (self.pieces[i].leader, self.pieces[i].reversed) = (leader, reversed),
                None => leaders.push(i),
            }
        }
        Ok(())
    }

    /// The pieces of every curve, points left out.
    pub(in crate::model) fn curves(&self) -> impl Iterator<Item = Vec<usize>> {
        let mut of_leader: Vec<Vec<usize>> = vec![Vec::new(); self.pieces.len()];
        for (i, piece) in self.pieces.iter().enumerate().filter(|(_, piece)| !piece.is_point) {
            of_leader[piece.leader].push(i);
        }
        of_leader.into_iter().filter(|curve| !curve.is_empty())
    }

    /// The model's diagonal. Millimetres.
    pub(in crate::model) fn diagonal(&self) -> f64 {
        self.tolerance / COINCIDENT
    }

    /// By patch the sides all of whose pieces are points.
    pub(in crate::model) fn poles(&self, patches: usize) -> Vec<Vec<Side>> {
        let mut poles = vec![Vec::new(); patches];
        for of_side in self.pieces.chunk_by(|a, b| a.patch == b.patch && a.side == b.side) {
            if of_side.iter().all(|piece| piece.is_point) {
                poles[of_side[0].patch].push(of_side[0].side);
            }
        }
        poles
    }

    /// Gives intervals enough segments that triangles are left of them: three around where a patch closes, and two
    /// from a pole on.
    pub(in crate::model) fn keep_open(&self, axes: &mut [Axes]) {
        for (i, piece) in self.pieces.iter().enumerate() {
            let axes = &mut axes[piece.patch];
            if !piece.is_point && piece.ends[0] == piece.ends[1] {
                at_least(&mut axes[piece.side.along], 3);
            }
            // The other side, of which this is the seam.
            let seam = piece.leader != i && self.pieces[piece.leader].patch == piece.patch;
            if seam && self.pieces[piece.leader].side.along == piece.side.along {
                at_least(&mut axes[1 - piece.side.along], 3);
            }
            if piece.is_point {
                at_least(&mut axes[1 - piece.side.along], 2);
            }
        }
    }

    /// The segments of every piece: the most of those that its curve has as part of any patch.
    pub(in crate::model) fn segments(&self, axes: &[Axes]) -> Vec<u32> {
        let own = |piece: &Piece| axes[piece.patch][piece.side.along][piece.interval].segments;
        let mut most = vec![1; self.pieces.len()];
        for piece in &self.pieces {
            most[piece.leader] = most[piece.leader].max(own(piece));
        }
        self.pieces.iter().map(|piece| if piece.is_point { own(piece) } else { most[piece.leader] }).collect()
    }
}

impl Piece {
    /// Whether the first piece of its curve runs, where this one lies, with this one's patch on the left, seen from
    /// outside.
    pub(in crate::model) fn is_counterclockwise(&self) -> bool {
        let side = (self.side.along == 0) == (self.side.at == 0.0);
        side != self.reversed
    }

    /// Its length, by its samples. Millimetres.
    pub(in crate::model) fn length(&self) -> f64 {
        self.samples.windows(2).map(|w| w[0].distance(w[1])).sum()
    }

    fn longest_chord(&self) -> f64 {
        self.samples.windows(2).map(|w| w[0].distance(w[1])).fold(0.0, f64::max)
    }

    /// Whether another piece is the same curve, and then whether it runs the other way.
    fn runs_along(
        &self,
        other: &Piece,
        instance: &dyn Instance,
        axes: &[Axes],
        tolerance: f64,
    ) -> Result<Option<bool>, EvaluationError> {
        let targets: Vec<DVec3> = (1..8).map(|k| other.samples[k * (SAMPLES - 1) / 8]).collect();
        let places = self.nearest(instance, axes, &targets)?;
        if places.iter().any(|(_, distance)| *distance > tolerance) {
            return Ok(None);
        }
        let rises = places.windows(2).filter(|w| w[1].0 > w[0].0).count();
        Ok((rises == 0 || rises + 1 == places.len()).then_some(rises == 0))
    }

    /// For every target the parameter of the nearest point of the piece, and its distance.
    fn nearest(
        &self,
        instance: &dyn Instance,
        axes: &[Axes],
        targets: &[DVec3],
    ) -> Result<Vec<(f64, f64)>, EvaluationError> {
        let interval = axes[self.patch][self.side.along][self.interval];
        let guess = |target: &DVec3| {
            let distance = |k: &usize| self.samples[*k].distance_squared(*target);
            let k = (0..SAMPLES).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
            interval.fraction(k as f64 / (SAMPLES - 1) as f64)
        };
        let guesses: Vec<f64> = targets.iter().map(guess).collect();
        self.project(instance, axes, targets, guesses)
    }

    /// The parameters of the points of the piece nearest to some targets, from guesses, and their distances.
    pub(in crate::model) fn project(
        &self,
        instance: &dyn Instance,
        axes: &[Axes],
        targets: &[DVec3],
        mut at: Vec<f64>,
    ) -> Result<Vec<(f64, f64)>, EvaluationError> {
        let interval = axes[self.patch][self.side.along][self.interval];
        let mut best: Vec<(f64, f64)> = at.iter().map(|t| (*t, f64::INFINITY)).collect();
        let mut partials = vec![Partials::default(); at.len()];
        for _ in 0..STEPS {
            let (u, v): (Vec<f64>, Vec<f64>) = at.iter().map(|t| self.side.uv(*t)).unzip();
            if instance.partials(self.patch, &u, &v, &mut partials).is_err() {
                break;
            }
            let mut moved = false;
            for (i, p) in partials.iter().enumerate() {
                let gap = targets[i] - DVec3::from_array(p.point);
                let along = DVec3::from_array(if self.side.along == 0 { p.du } else { p.dv });
                if gap.length() < best[i].1 {
                    best[i] = (at[i], gap.length());
                    moved = true;
                }
                let step = gap.dot(along) / along.length_squared();
                if step.is_finite() {
                    at[i] = (at[i] + step).clamp(interval.start, interval.end);
                }
            }
            if !moved {
                break;
            }
        }
        Ok(best)
    }
}

/// Gives an axis so many segments at least.
fn at_least(axis: &mut [Interval], segments: u32) {
    let all: u32 = axis.iter().map(|i| i.segments).sum();
    if all < segments {
        axis[0].segments += segments - all;
    }
}

/// Divides intervals at parameters inside of them.
fn cut(axes: &mut [Axes], mut cuts: Vec<(usize, usize, usize, f64)>) {
    // From behind, so that the intervals before keep their places.
    cuts.sort_by(|a, b| (b.0, b.1, b.2).cmp(&(a.0, a.1, a.2)).then(b.3.total_cmp(&a.3)));
    let mut last = None;
    for (patch, along, interval, t) in cuts {
        let axis = &mut axes[patch][along];
        let whole = axis[interval];
        let near = |s: f64| (s - t).abs() <= 1e-9 * (whole.end - whole.start);
        let again = last.is_some_and(|(place, s)| place == (patch, along, interval) && near(s));
        if !again && !near(whole.end) && axis.len() < MOST_INTERVALS {
            split(axis, interval, t);
        }
        last = Some(((patch, along, interval), t));
    }
}
