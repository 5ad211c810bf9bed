//! Pieces of the borders of patches, and whether two of them are the same curve in space.

use super::intervals::{Axes, Interval};
use crate::model::{EvaluationError, Instance, Partials};
use glam::DVec3;

/// Places at which a piece is sampled, its ends included.
pub(super) const SAMPLES: usize = 33;
/// Places at which two pieces are compared: they miss what differs over less than a hundredth of both.
const COMPARED: usize = 251;
/// Steps of Gauss and Newton to the nearest point of a curve.
const STEPS: usize = 12;

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
    pub(super) fn all(axes: &Axes) -> Vec<Side> {
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

/// A piece of the border of a patch: an interval of a side, or a part of it between the ends of other borders.
#[derive(Clone, Debug)]
pub(in crate::model) struct Piece {
    pub(in crate::model) patch: usize,
    pub(in crate::model) side: Side,
    pub(in crate::model) interval: usize,
    /// The part of the interval, in its steps.
    pub(super) span: Interval,
    /// Clusters of its first and its last point.
    pub(in crate::model) ends: [u32; 2],
    /// The piece whose points it has, and whether it runs the other way; itself where it is the first of its curve.
    pub(in crate::model) leader: usize,
    pub(in crate::model) reversed: bool,
    /// Whether all of it is one point.
    pub(in crate::model) is_point: bool,
    pub(super) samples: Vec<DVec3>,
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
    pub(in crate::model) fn length(&self, instance: &dyn Instance) -> Result<f64, EvaluationError> {
        const FEWEST: usize = 1 << 10;
        const MOST: usize = 1 << 17;
        let mut chords = FEWEST;
        let mut last = 0.0;
        loop {
            let points = self.points(instance, (0..=chords).map(|k| k as f64 / chords as f64))?;
            let length = points.windows(2).map(|w| w[0].distance(w[1])).sum::<f64>();
            // A quarter of the error is left at half the chord (Richardson).
            let better = length + (length - last) / 3.0;
            if (length - last).abs() <= 1e-7 * length || chords >= MOST {
                return Ok(if last > 0.0 { better } else { length });
            }
            (chords, last) = (2 * chords, length);
        }
    }

    /// Whether it is of the same side.
    pub(in crate::model) fn is_on_side_of(&self, other: &Piece) -> bool {
        self.patch == other.patch && self.side == other.side
    }

    /// Whether it is of the same interval.
    pub(super) fn is_beside(&self, other: &Piece) -> bool {
        self.is_on_side_of(other) && self.interval == other.interval
    }

    pub(super) fn longest_chord(&self) -> f64 {
        self.samples.windows(2).map(|w| w[0].distance(w[1])).fold(0.0, f64::max)
    }

    /// Whether another piece is the same curve, and then whether it runs the other way.
    pub(super) fn runs_along(
        &self,
        other: &Piece,
        instance: &dyn Instance,
        tolerance: f64,
    ) -> Result<Option<bool>, EvaluationError> {
        let fractions = (0..COMPARED).map(|k| (k as f64 + jitter(k)) / COMPARED as f64);
        let targets = other.points(instance, fractions.clone())?;
        let differ = |p: (&DVec3, &DVec3)| p.0.distance(*p.1) > tolerance;
        // Most that are the same have the same speed.
        let own = self.points(instance, fractions.clone())?;
        if !targets.iter().zip(&own).any(differ) {
            return Ok(Some(false));
        }
        let own = self.points(instance, fractions.map(|f| 1.0 - f))?;
        if !targets.iter().zip(&own).any(differ) {
            return Ok(Some(true));
        }
        // Most that differ do so at once.
        let some: Vec<DVec3> = targets.iter().copied().step_by(COMPARED / 8).collect();
        for targets in [some, targets] {
            let places = self.nearest(instance, &targets)?;
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

    /// Takes its samples.
    pub(super) fn sample(&mut self, instance: &dyn Instance) -> Result<(), EvaluationError> {
        self.samples = self.points(instance, (0..SAMPLES).map(|k| k as f64 / (SAMPLES - 1) as f64))?;
        Ok(())
    }

    /// The points at fractions of its length.
    pub(super) fn points(
        &self,
        instance: &dyn Instance,
        fractions: impl Iterator<Item = f64>,
    ) -> Result<Vec<DVec3>, EvaluationError> {
        let (u, v): (Vec<f64>, Vec<f64>) = fractions.map(|f| self.side.uv(self.span.fraction(f))).unzip();
        let mut points = vec![[0.0; 3]; u.len()];
        instance.points(self.patch, &u, &v, &mut points)?;
        Ok(points.into_iter().map(DVec3::from_array).collect())
    }

    /// For every target the parameter of the nearest point of the piece, and its distance.
    pub(super) fn nearest(
        &self,
        instance: &dyn Instance,
        targets: &[DVec3],
    ) -> Result<Vec<(f64, f64)>, EvaluationError> {
        let guess = |target: &DVec3| {
            let distance = |k: &usize| self.samples[*k].distance_squared(*target);
            let k = (0..SAMPLES).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
            self.span.fraction(k as f64 / (SAMPLES - 1) as f64)
        };
        let guesses: Vec<f64> = targets.iter().map(guess).collect();
        // Beside the seam of a closed curve both ends are near, and only one of them leads there.
        let (start, end) = (self.span.start(), self.span.end());
        let at_end: Vec<usize> = (0..guesses.len()).filter(|i| guesses[*i] == start || guesses[*i] == end).collect();
        let others = at_end.iter().map(|i| if guesses[*i] == start { end } else { start }).collect();
        let again: Vec<DVec3> = at_end.iter().map(|i| targets[*i]).collect();
        let mut found = self.project(instance, targets, guesses)?;
        for (i, other) in at_end.into_iter().zip(self.project(instance, &again, others)?) {
            if other.1 < found[i].1 {
                found[i] = other;
            }
        }
        Ok(found)
    }

    /// The parameters of the points of the piece nearest to some targets, from guesses, and their distances.
    pub(in crate::model) fn project(
        &self,
        instance: &dyn Instance,
        targets: &[DVec3],
        mut at: Vec<f64>,
    ) -> Result<Vec<(f64, f64)>, EvaluationError> {
        // Not its ends: derivatives there may be those of the other side of a corner.
        let margin = 1e-10 * (self.span.end() - self.span.start());
        let inside = |t: f64| t.clamp(self.span.start() + margin, self.span.end() - margin);
        at.iter_mut().for_each(|t| *t = inside(*t));
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
                    at[i] = inside(at[i] + step);
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

/// Numbers in 0..1 for every k that lie evenly in the square, and do not fall in with the periods of a model: the
/// additive recurrence of Roberts.
pub(super) fn scattered(k: f64, start: [f64; 2]) -> [f64; 2] {
    const STEPS: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];
    [0, 1].map(|i| (start[i] + k * STEPS[i]).fract())
}
