//! The borders of patches, and which of them are the same curve in space.

use super::intervals::{Axes, Interval};
use super::piece::{Piece, SAMPLES, Side};
use crate::mesh::Bounds;
use crate::model::{EvaluationError, Instance};
use glam::DVec3;
use std::collections::HashMap;

/// Borders that are nearer than this fraction of the model's diagonal are the same: parts of one curve that a script
/// computes in several ways differ by rounding, some 1e-15 of their coordinates.
const COINCIDENT: f64 = 1e-8;
/// Rounds in which pieces that end beside others are divided there.
const ROUNDS: usize = 6;

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
    /// Finds the borders that are the same curve. They are divided where a border of another patch ends beside them.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub(in crate::model) fn find(instance: &dyn Instance, axes: &[Axes]) -> Result<Self, EvaluationError> {
        let mut borders = Self::of_intervals(instance, axes)?;
        borders.cluster();
        for _ in 0..ROUNDS {
            let cuts = borders.cuts(instance)?;
            if cuts.is_empty() {
                break;
            }
            borders.cut(instance, cuts)?;
            borders.cluster();
        }
        borders.match_pieces(instance)?;
        Ok(borders)
    }

    fn of_intervals(instance: &dyn Instance, all: &[Axes]) -> Result<Self, EvaluationError> {
        let mut borders = Self::default();
        for (patch, axes) in all.iter().enumerate() {
            for side in Side::all(axes) {
                for interval in 0..axes[side.along].len() {
                    let leader = borders.pieces.len();
                    let (ends, reversed, is_point) = ([0; 2], false, false);
                    let (samples, span) = (Vec::new(), axes[side.along][interval].clone());
                    let mut piece = Piece { patch, side, interval, span, ends, leader, reversed, is_point, samples };
                    piece.sample(instance)?;
                    borders.pieces.push(piece);
                }
            }
        }
        let bounds: Bounds = borders.pieces.iter().flat_map(|p| &p.samples).copied().collect();
        borders.tolerance = COINCIDENT * bounds.diagonal();
        Ok(borders)
    }

    /// Gives ends that coincide one number.
    fn cluster(&mut self) {
        self.ends.clear();
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

    /// The places inside of pieces at which another one ends: piece and parameter.
    fn cuts(&self, instance: &dyn Instance) -> Result<Vec<(usize, f64)>, EvaluationError> {
        let mut by_x: Vec<usize> = (0..self.ends.len()).collect();
        by_x.sort_unstable_by(|a, b| self.ends[*a].x.total_cmp(&self.ends[*b].x));
        let mut cuts = Vec::new();
        for (i, piece) in self.pieces.iter().enumerate().filter(|(_, piece)| !piece.is_point) {
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
            let size = piece.span.end() - piece.span.start();
            for (t, distance) in piece.nearest(instance, &targets)? {
                let inside = t > piece.span.start() + 1e-9 * size && t < piece.span.end() - 1e-9 * size;
                if inside && distance <= self.tolerance {
                    cuts.push((i, t));
                }
            }
        }
        Ok(cuts)
    }

    /// Divides pieces at parameters inside of them.
    fn cut(&mut self, instance: &dyn Instance, mut cuts: Vec<(usize, f64)>) -> Result<(), EvaluationError> {
        cuts.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut cuts = cuts.into_iter().peekable();
        let mut pieces = Vec::with_capacity(self.pieces.len());
        for (i, piece) in std::mem::take(&mut self.pieces).into_iter().enumerate() {
            let size = piece.span.end() - piece.span.start();
            let mut ends = vec![piece.span.start()];
            while let Some((_, t)) = cuts.next_if(|cut| cut.0 == i) {
                if t - ends[ends.len() - 1] > 1e-9 * size {
                    ends.push(t);
                }
            }
            ends.push(piece.span.end());
            for span in ends.windows(2) {
                let mut part = Piece { span: piece.span.part(span[0], span[1]), leader: pieces.len(), ..piece.clone() };
                if ends.len() > 2 {
                    part.sample(instance)?;
                }
                pieces.push(part);
            }
        }
        self.pieces = pieces;
        Ok(())
    }

    /// Finds for every piece the first one that is the same curve.
    fn match_pieces(&mut self, instance: &dyn Instance) -> Result<(), EvaluationError> {
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
                if let Some(reversed) = self.pieces[*leader].runs_along(piece, instance, self.tolerance)? {
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
        for of_side in self.pieces.chunk_by(|a, b| a.is_on_side_of(b)) {
            if of_side.iter().all(|piece| piece.is_point) {
                poles[of_side[0].patch].push(of_side[0].side);
            }
        }
        poles
    }

    /// Gives intervals enough segments that triangles are left of them: three around where a patch closes, and two
    /// from a pole on.
    pub(in crate::model) fn keep_open(&mut self, axes: &mut [Axes]) {
        for of_side in self.pieces.chunk_by(|a, b| a.is_on_side_of(b)) {
            let (first, last) = (&of_side[0], &of_side[of_side.len() - 1]);
            if !of_side.iter().all(|piece| piece.is_point) && first.ends[0] == last.ends[1] {
                at_least(&mut axes[first.patch][first.side.along], 3);
            }
        }
        for (i, piece) in self.pieces.iter().enumerate() {
            let axes = &mut axes[piece.patch];
            // The other side, of which this is the seam.
            let seam = piece.leader != i && self.pieces[piece.leader].patch == piece.patch;
            if seam && self.pieces[piece.leader].side.along == piece.side.along {
                at_least(&mut axes[1 - piece.side.along], 3);
            }
            if piece.is_point {
                at_least(&mut axes[1 - piece.side.along], 2);
            }
        }
        for piece in &mut self.pieces {
            let whole = &axes[piece.patch][piece.side.along][piece.interval];
            piece.span = whole.part(piece.span.start(), piece.span.end());
        }
    }

    /// For every piece that of its curve which is divided most.
    pub(in crate::model) fn finest(&self) -> Vec<usize> {
        let own = |i: usize| self.pieces[i].span.segments();
        let mut finest: Vec<usize> = (0..self.pieces.len()).collect();
        for (i, piece) in self.pieces.iter().enumerate() {
            if own(i) > own(finest[piece.leader]) {
                finest[piece.leader] = i;
            }
        }
        self.pieces.iter().enumerate().map(|(i, piece)| if piece.is_point { i } else { finest[piece.leader] }).collect()
    }
}

/// Gives an axis so many segments at least.
fn at_least(axis: &mut [Interval], segments: usize) {
    let all: usize = axis.iter().map(Interval::segments).sum();
    if all < segments {
        let own = axis[0].segments();
        axis[0].divide(own + segments - all);
    }
}
