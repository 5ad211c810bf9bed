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
/// Places at which two pieces are compared: they miss what differs over less than a hundredth of both.
const COMPARED: usize = 251;
/// Steps of Gauss and Newton to the nearest point of a curve.
const STEPS: usize = 12;
/// Rounds in which pieces that end beside others are divided there.
const ROUNDS: usize = 6;
/// Most intervals of an axis that such divisions may lead to.
const MOST_INTERVALS: usize = 4096;

/// A side of a patch: where u or v begins or ends, or where the surface jumps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::model) struct Side {
    /// The parameter that runs along it: 0 for u, 1 for v.
    pub(in crate::model) along: usize,
    /// The value of the other one.
    pub(in crate::model) at: f64,
    /// Whether the patch is where that is larger.
    low: bool,
}

impl Side {
    /// All sides of a patch.
    fn all(axes: &Axes) -> Vec<Side> {
        let low = |along: usize, i: &Interval| Side { along, at: i.start(), low: true };
        let high = |along: usize, i: &Interval| Side { along, at: i.end(), low: false };
        let [u, v] = axes;
        let last = |axis: &[Interval]| axis.len() - 1;
        let mut sides = vec![low(0, &v[0]), high(1, &u[last(u)]), high(0, &v[last(v)]), low(1, &u[0])];
        for (along, axis) in [(1, u), (0, v)] {
            let steps = axis.windows(2).filter(|pair| pair[1].after_step);
            sides.extend(steps.flat_map(|pair| [high(along, &pair[0]), low(along, &pair[1])]));
        }
        sides
    }

    /// (u, v) at a value of the parameter along it.
    pub(in crate::model) fn uv(self, t: f64) -> (f64, f64) {
        if self.along == 0 { (t, self.at) } else { (self.at, t) }
    }

    /// Whether it has a point of the patch.
    pub(in crate::model) fn has(self, u: f64, v: f64) -> bool {
        self.at == if self.along == 0 { v } else { u }
    }

    /// In words.
    pub(in crate::model) fn name(self) -> String {
        let across = if self.along == 0 { "v" } else { "u" };
        // Six digits, without the zeros at their end.
        format!("{across} = {}", (self.at * 1e6).round() / 1e6)
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

    fn of_intervals(instance: &dyn Instance, all: &[Axes]) -> Result<Self, EvaluationError> {
        let sample = |k: usize| k as f64 / (SAMPLES - 1) as f64;
        let mut borders = Self::default();
        for (patch, axes) in all.iter().enumerate() {
            for side in Side::all(axes) {
                for interval in 0..axes[side.along].len() {
                    let leader = borders.pieces.len();
                    let (ends, reversed, is_point) = ([0; 2], false, false);
                    let samples = Vec::new();
                    let mut piece = Piece { patch, side, interval, ends, leader, reversed, is_point, samples };
                    piece.samples = piece.points(instance, all, (0..SAMPLES).map(sample))?;
                    borders.pieces.push(piece);
                }
            }
        }
        let bounds: Bounds = borders.pieces.iter().flat_map(|p| &p.samples).copied().collect();
        borders.tolerance = COINCIDENT * bounds.diagonal();
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
            let interval = &axes[piece.patch][piece.side.along][piece.interval];
            let size = interval.end() - interval.start();
            for (t, distance) in piece.nearest(instance, axes, &targets)? {
                let inside = t > interval.start() + 1e-9 * size && t < interval.end() - 1e-9 * size;
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

    /// Makes some pieces curves of their own. Those that one of them leads follow the first of them.
    pub(in crate::model) fn part(&mut self, pieces: &[usize]) {
        for i in pieces {
            let followers: Vec<usize> =
                (0..self.pieces.len()).filter(|k| self.pieces[*k].leader == *i && k != i).collect();
            let turned = followers.first().is_some_and(|first| self.pieces[*first].reversed);
            for follower in &followers {
                self.pieces[*follower].leader = followers[0];
                self.pieces[*follower].reversed ^= turned;
            }
            (self.pieces[*i].leader, self.pieces[*i].reversed) = (*i, false);
        }
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

    /// For every piece that of its curve which is divided most.
    pub(in crate::model) fn finest(&self, axes: &[Axes]) -> Vec<usize> {
        let own = |i: usize| axes[self.pieces[i].patch][self.pieces[i].side.along][self.pieces[i].interval].segments();
        let mut finest: Vec<usize> = (0..self.pieces.len()).collect();
        for (i, piece) in self.pieces.iter().enumerate() {
            if own(i) > own(finest[piece.leader]) {
                finest[piece.leader] = i;
            }
        }
        self.pieces.iter().enumerate().map(|(i, piece)| if piece.is_point { i } else { finest[piece.leader] }).collect()
    }
}

impl Piece {
    /// Whether the first piece of its curve runs, where this one lies, with this one's patch on the left, seen from
    /// outside.
    pub(in crate::model) fn is_counterclockwise(&self) -> bool {
        let side = (self.side.along == 0) == self.side.low;
        side != self.reversed
    }

    /// Its length, by chords that are halved until that changes nothing. Millimetres.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub(in crate::model) fn length(&self, instance: &dyn Instance, axes: &[Axes]) -> Result<f64, EvaluationError> {
        const FEWEST: usize = 1 << 10;
        const MOST: usize = 1 << 17;
        let mut chords = FEWEST;
        let mut last = 0.0;
        loop {
            let points = self.points(instance, axes, (0..=chords).map(|k| k as f64 / chords as f64))?;
            let length = points.windows(2).map(|w| w[0].distance(w[1])).sum::<f64>();
            // A quarter of the error is left at half the chord (Richardson).
            let better = length + (length - last) / 3.0;
            if (length - last).abs() <= 1e-7 * length || chords >= MOST {
                return Ok(if last > 0.0 { better } else { length });
            }
            (chords, last) = (2 * chords, length);
        }
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
        let fractions = (0..COMPARED).map(|k| (k as f64 + jitter(k)) / COMPARED as f64);
        let targets = other.points(instance, axes, fractions.clone())?;
        let differ = |p: (&DVec3, &DVec3)| p.0.distance(*p.1) > tolerance;
        // Most that are the same have the same speed.
        let own = self.points(instance, axes, fractions.clone())?;
        if !targets.iter().zip(&own).any(differ) {
            return Ok(Some(false));
        }
        let own = self.points(instance, axes, fractions.map(|f| 1.0 - f))?;
        if !targets.iter().zip(&own).any(differ) {
            return Ok(Some(true));
        }
        // Most that differ do so at once.
        let some: Vec<DVec3> = targets.iter().copied().step_by(COMPARED / 8).collect();
        for targets in [some, targets] {
            let places = self.nearest(instance, axes, &targets)?;
            if places.iter().any(|(_, distance)| *distance > tolerance) {
                return Ok(None);
            }
            let rises = places.windows(2).filter(|w| w[1].0 > w[0].0).count();
            if rises > 0 && rises + 1 < places.len() {
                return Ok(None);
            }
            if places.len() == COMPARED {
                return Ok(Some(rises == 0));
            }
        }
        Ok(None)
    }

    /// The points at fractions of its length.
    fn points(
        &self,
        instance: &dyn Instance,
        axes: &[Axes],
        fractions: impl Iterator<Item = f64>,
    ) -> Result<Vec<DVec3>, EvaluationError> {
        let interval = &axes[self.patch][self.side.along][self.interval];
        let (u, v): (Vec<f64>, Vec<f64>) = fractions.map(|f| self.side.uv(interval.fraction(f))).unzip();
        let mut points = vec![[0.0; 3]; u.len()];
        instance.points(self.patch, &u, &v, &mut points)?;
        Ok(points.into_iter().map(DVec3::from_array).collect())
    }

    /// For every target the parameter of the nearest point of the piece, and its distance.
    pub(super) fn nearest(
        &self,
        instance: &dyn Instance,
        axes: &[Axes],
        targets: &[DVec3],
    ) -> Result<Vec<(f64, f64)>, EvaluationError> {
        let interval = &axes[self.patch][self.side.along][self.interval];
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
        let interval = &axes[self.patch][self.side.along][self.interval];
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
                    at[i] = (at[i] + step).clamp(interval.start(), interval.end());
                }
            }
            if !moved {
                break;
            }
        }
        Ok(best)
    }
}

/// Where in its share of an interval a place is, so that places do not fall in with the periods of a model.
pub(super) fn jitter(k: usize) -> f64 {
    0.1 + 0.8 * (k as f64 * 0.618_033_988_749_895).fract()
}

/// Gives an axis so many segments at least.
fn at_least(axis: &mut [Interval], segments: usize) {
    let all: usize = axis.iter().map(Interval::segments).sum();
    if all < segments {
        let own = axis[0].segments();
        axis[0].divide(own + segments - all);
    }
}

/// Divides intervals at parameters inside of them.
fn cut(axes: &mut [Axes], mut cuts: Vec<(usize, usize, usize, f64)>) {
    // From behind, so that the intervals before keep their places.
    cuts.sort_by(|a, b| (b.0, b.1, b.2).cmp(&(a.0, a.1, a.2)).then(b.3.total_cmp(&a.3)));
    let mut last = None;
    for (patch, along, interval, t) in cuts {
        let axis = &mut axes[patch][along];
        let (start, end) = (axis[interval].start(), axis[interval].end());
        let near = |s: f64| (s - t).abs() <= 1e-9 * (end - start);
        let again = last.is_some_and(|(place, s)| place == (patch, along, interval) && near(s));
        if !again && !near(end) && axis.len() < MOST_INTERVALS {
            split(axis, interval, t);
        }
        last = Some(((patch, along, interval), t));
    }
}
