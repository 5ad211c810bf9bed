//! Edges of what is there that run along u or v, as those of a slot across a pipe: they become lines of the grid.
//!
//! Where such an edge crosses the cells of a grid, triangles are divided until it is straight in them; and those of
//! cells that are much longer than wide become slivers. A line of the grid along the edge needs no dividing at all.

use super::intervals::{Axes, Interval};
use super::piece::scattered;
use super::stand::sign;
use crate::model::{Bracket, EvaluationError, Instance, narrow};
use glam::DVec3;
use rayon::prelude::*;

/// Lines across an axis on which zeros of the function are sought: an edge that is an eighth as long as the patch is
/// met by two of them.
const PROBES: usize = 16;
/// Where two more are between lines that were found across them, as parts of the distance of these.
const BETWEEN: [f64; 2] = [0.309, 0.674];
/// Steps in which a probe is looked at at first.
const STEPS: usize = 32;
/// How often a step is halved at most in which the function may have a zero although it has one sign at both ends.
const HALVINGS: usize = 5;
/// How much faster than distances the function may change; as in `hidden`.
const STEEPEST: f64 = 1.5;
/// By how much the function may differ at the places of all probes where it is level. Millimetres: far above rounding,
/// far below that by which surfaces that coincide are told apart.
const LEVEL: f64 = 1e-10;
/// The widths to which zeros are narrowed, in parts of the axis: those of all zeros, and rounding for those that
/// several probes share.
const ROUGH: f64 = 3e-8;
const EXACT: f64 = 1e-16;
/// Zeros of several probes are those of one line if they are so near to each other, in parts of the axis: roughly, and
/// when they are exact.
const ROUGHLY: f64 = 1e-6;
const SAME: f64 = 1e-12;
/// Lines that are nearer than this to another one of the grid are not added, in parts of the axis.
const APART: f64 = 1e-7;
/// The most lines that are added along an axis: those that most probes meet. A patch with more has letters on it.
const MOST_LINES: usize = 64;

/// A stretch of a probe, along the axis, with the function's values at its ends and its length in space. Millimetres.
struct Stretch {
    at: f64,
    ends: Bracket,
    length: f64,
}

impl Stretch {
    fn changes_sign(&self) -> bool {
        sign(self.ends.values[0]) * sign(self.ends.values[1]) < 0
    }

    /// Whether zeros may lie in it that the signs at its ends do not show.
    fn may_hide(&self) -> bool {
        self.ends.values[0].abs() + self.ends.values[1].abs() < STEEPEST * self.length
    }
}

/// By patch, the values of u and of v along which edges of what is there run; `keeps` has, by patch, the patch of the
/// function.
///
/// # Errors
/// The surface, or where it is there, cannot be evaluated.
pub(super) fn edges(instance: &dyn Instance, keeps: &[Option<usize>]) -> Result<Vec<[Vec<f64>; 2]>, EvaluationError> {
    let of_patch = |(patch, keep): (usize, &Option<usize>)| -> Result<[Vec<f64>; 2], EvaluationError> {
        let mut lines: [Vec<f64>; 2] = Default::default();
        let Some(keep) = *keep else { return Ok(lines) };
        for k in [0, 1, 0, 1] {
            // Edges that end at lines across them may be short for the patch.
            lines[k] = Function { instance, patch, keep, k }.lines(&lines[1 - k])?;
        }
        Ok(lines)
    };
    keeps.par_iter().enumerate().map(of_patch).collect::<Vec<_>>().into_iter().collect()
}

/// Adds lines to the grid of a patch.
pub(super) fn insert_all(lines: &[Vec<f64>; 2], axes: &mut Axes) {
    lines.iter().zip(axes).for_each(|(lines, axis)| lines.iter().for_each(|line| insert(axis, *line)));
}

/// Divides the interval of an axis that a value lies in there.
fn insert(axis: &mut [Interval], at: f64) {
    let holds = |i: &&mut Interval| i.start() + APART < at && at < i.end() - APART;
    let Some(interval) = axis.iter_mut().find(holds) else { return };
    let next = interval.values.partition_point(|value| *value < at);
    if at - interval.values[next - 1] > APART && interval.values[next] - at > APART {
        interval.values.insert(next, at);
    }
}

/// Where a patch is there, along its lines of v (k = 0) or of u (k = 1).
struct Function<'a> {
    instance: &'a dyn Instance,
    patch: usize,
    keep: usize,
    k: usize,
}

impl Function<'_> {
    /// The values of the axis along whose lines edges run, those that most probes meet; `across` has some of the other
    /// axis, ascending.
    fn lines(&self, across: &[f64]) -> Result<Vec<f64>, EvaluationError> {
        let mut probes: Vec<f64> = (1..=PROBES).map(|probe| scattered(probe as f64, [0.0; 2])[self.k]).collect();
        if !across.is_empty() {
            let ends: Vec<f64> = std::iter::once(0.0).chain(across.iter().copied()).chain([1.0]).collect();
            let between = |ends: &[f64]| BETWEEN.map(|part| ends[0] + part * (ends[1] - ends[0]));
            probes.extend(ends.windows(2).flat_map(between));
        }
        let mut zeros = self.zeros(&probes)?;
        self.narrow(&mut zeros, ROUGH)?;
        zeros.sort_by(|a, b| a.ends.from.total_cmp(&b.ends.from));
        let mut shared: Vec<Stretch> = Vec::new();
        let mut rest = zeros.into_iter().peekable();
        while let Some(first) = rest.next() {
            let mut group = vec![first];
            while let Some(next) = rest.next_if(|next| next.ends.from - group[group.len() - 1].ends.from < ROUGHLY) {
                group.push(next);
            }
            if group.len() > 1 {
                shared.extend(group);
            }
        }
        self.narrow(&mut shared, EXACT)?;
        shared.sort_by(|a, b| a.ends.from.total_cmp(&b.ends.from));
        let mut lines: Vec<(usize, &Stretch)> = Vec::new();
        for of_line in shared.chunk_by(|a, b| b.ends.from - a.ends.from < SAME) {
            lines.push((of_line.len(), &of_line[0]));
        }
        lines.retain(|(probes, _)| *probes > 1);
        // Where the function jumps there is no place that is on the edge.
        let values = self.values(lines.iter().map(|(_, zero)| (zero.ends.from, zero.at)))?;
        let mut on_edge = values.into_iter().map(|value| sign(value) == 0);
        lines.retain(|_| on_edge.next().unwrap_or(false));
        lines.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.ends.from.total_cmp(&b.1.ends.from)));
        lines.truncate(MOST_LINES);
        let mut lines: Vec<f64> = lines.into_iter().map(|(_, zero)| zero.ends.from).collect();
        lines.sort_by(f64::total_cmp);
        Ok(lines)
    }

    /// Stretches of probes over which the function changes its sign.
    fn zeros(&self, probes: &[f64]) -> Result<Vec<Stretch>, EvaluationError> {
        // Not at round parts of the axis, at which edges lie.
        let step = |i: usize| match i {
            0 | STEPS => (i / STEPS) as f64,
            _ => (i as f64 - 0.377) / (STEPS as f64 - 0.5),
        };
        let sites: Vec<(f64, f64)> =
            probes.iter().flat_map(|probe| (0..=STEPS).map(move |i| (step(i), *probe))).collect();
        let values = self.values(sites.iter().copied())?;
        // No edge is on a surface that lies in another one as a whole, as the end of a drill does in the face of a
        // plate.
        if values.iter().all(|value| (value - values[0]).abs() < LEVEL) {
            return Ok(Vec::new());
        }
        let points = self.points(&sites)?;
        let mut open: Vec<Stretch> = (0..sites.len())
            .filter(|i| i % (STEPS + 1) < STEPS)
            .map(|i| Stretch {
                at: sites[i].1,
                ends: Bracket { from: sites[i].0, to: sites[i + 1].0, values: [values[i], values[i + 1]] },
                length: points[i].distance(points[i + 1]),
            })
            .collect();
        let mut zeros = Vec::new();
        for halving in 0..=HALVINGS {
            let (found, clear): (Vec<_>, Vec<_>) = open.into_iter().partition(Stretch::changes_sign);
            zeros.extend(found);
            open = clear.into_iter().filter(|stretch| halving < HALVINGS && stretch.may_hide()).collect();
            let middles = self.values(open.iter().map(|s| (s.ends.middle(), s.at)))?;
            let halves = |(s, value): (Stretch, f64)| {
                let (Bracket { from, to, values }, middle) = (s.ends, s.ends.middle());
                let before = Bracket { from, to: middle, values: [values[0], value] };
                let after = Bracket { from: middle, to, values: [value, values[1]] };
                [before, after].map(|ends| Stretch { at: s.at, ends, length: 0.5 * s.length })
            };
            open = open.into_iter().zip(middles).flat_map(halves).collect();
        }
        Ok(zeros)
    }

    /// Narrows stretches about the zero in each.
    fn narrow(&self, zeros: &mut [Stretch], width: f64) -> Result<(), EvaluationError> {
        let mut ends: Vec<Bracket> = zeros.iter().map(|s| s.ends).collect();
        narrow(&mut ends, width, |which, at| self.values(which.iter().zip(at).map(|(k, at)| (*at, zeros[*k].at))))?;
        zeros.iter_mut().zip(ends).for_each(|(s, ends)| s.ends = ends);
        Ok(())
    }

    /// The function's values at places along the axis and across it.
    fn values(&self, sites: impl Iterator<Item = (f64, f64)>) -> Result<Vec<f64>, EvaluationError> {
        let (u, v): (Vec<f64>, Vec<f64>) = sites.map(|site| self.uv(site)).unzip();
        self.instance.keeps(self.keep, &u, &v)
    }

    fn points(&self, sites: &[(f64, f64)]) -> Result<Vec<DVec3>, EvaluationError> {
        let (u, v): (Vec<f64>, Vec<f64>) = sites.iter().map(|site| self.uv(*site)).unzip();
        let mut points = vec![[0.0; 3]; u.len()];
        self.instance.points(self.patch, &u, &v, &mut points)?;
        Ok(points.into_iter().map(DVec3::from_array).collect())
    }

    fn uv(&self, (along, across): (f64, f64)) -> (f64, f64) {
        if self.k == 0 { (along, across) } else { (across, along) }
    }
}
