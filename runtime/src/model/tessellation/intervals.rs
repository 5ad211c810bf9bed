//! The stretches of a patch's parameters between its breaks, and how finely each is divided.

use super::Fineness;
use super::piece::jitter;
use crate::model::{Break, BreakKind, Breaks, EvaluationError, Instance, SecondPartials, spans};
use glam::DVec3;
use std::iter::once;

/// A stretch of u or of v on which a patch is smooth, and the values at which it is divided.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::model) struct Interval {
    /// Ascending, with both ends.
    pub(super) values: Vec<f64>,
    /// Whether the surface jumps between the interval before and this one.
    pub(super) after_step: bool,
}

impl Interval {
    /// An interval in equal steps.
    pub(super) fn even(start: f64, end: f64, segments: u32) -> Self {
        let inner = (1..segments).map(|k| start + f64::from(k) / f64::from(segments) * (end - start));
        Self { values: once(start).chain(inner).chain([end]).collect(), after_step: false }
    }

    pub(super) fn start(&self) -> f64 {
        self.values[0]
    }

    pub(super) fn end(&self) -> f64 {
        self.values[self.values.len() - 1]
    }

    pub(super) fn segments(&self) -> usize {
        self.values.len() - 1
    }

    /// The value at a fraction of the length.
    pub(super) fn fraction(&self, f: f64) -> f64 {
        if f >= 1.0 { self.end() } else { (self.start() + f * (self.end() - self.start())).min(self.end()) }
    }

    /// Divides it into so many steps, in the proportions of those that it has.
    pub(super) fn divide(&mut self, segments: usize) {
        let scale = self.segments() as f64 / segments as f64;
        let inner = (1..segments).map(|k| self.between(k as f64 * scale));
        self.values = once(self.start()).chain(inner).chain([self.end()]).collect();
    }

    /// The part from one value to another one, in steps like those that it has there.
    pub(super) fn part(&self, start: f64, end: f64) -> Self {
        let [first, last] = [start, end].map(|t| self.steps_before(t));
        let segments = ((last - first).ceil() as usize).max(1);
        let inner = (1..segments).map(|k| self.between(first + (last - first) * k as f64 / segments as f64));
        Self { values: once(start).chain(inner).chain([end]).collect(), after_step: false }
    }

    /// The value after a number of steps, which need not be whole.
    fn between(&self, steps: f64) -> f64 {
        let k = (steps as usize).min(self.segments() - 1);
        self.values[k] + (steps - k as f64) * (self.values[k + 1] - self.values[k])
    }

    /// The number of steps before a value.
    fn steps_before(&self, t: f64) -> f64 {
        let k = self.values.partition_point(|value| *value <= t).clamp(1, self.segments()) - 1;
        k as f64 + (t - self.values[k]) / (self.values[k + 1] - self.values[k])
    }
}

/// The intervals of u and of v.
pub(in crate::model) type Axes = [Vec<Interval>; 2];

/// An interval on which no point moves by more than this part of the patch's size has no extent: a corner that a
/// polyline repeats, an arc whose radius is 0.
const STANDING: f64 = 1e-9;

/// The intervals between the breaks of a patch, in one step each; without those on which the surface stands still.
///
/// # Errors
/// The surface cannot be evaluated.
pub(in crate::model) fn of_patch(
    instance: &dyn Instance,
    patch: usize,
    breaks: &Breaks,
) -> Result<Axes, EvaluationError> {
    let of_axis = |breaks: &[Break]| -> Vec<Interval> {
        let after_step = once(false).chain(breaks.iter().map(|b| b.kind == BreakKind::Step));
        let spans = spans(breaks.iter().map(|b| (b.before, b.after))).zip(after_step);
        spans.map(|((start, end), after_step)| Interval { after_step, ..Interval::even(start, end, 1) }).collect()
    };
    let mut axes = [of_axis(&breaks.u), of_axis(&breaks.v)];
    // The only interval of a parameter stays.
    let divided = axes.each_ref().map(|axis| axis.len() > 1);
    for k in (0..2).filter(|k| divided[*k]) {
        let extents = extents(instance, patch, &axes, k)?;
        let least = STANDING * extents.iter().copied().fold(0.0, f64::max);
        let mut moves = extents.iter().map(|extent| *extent > least);
        if least > 0.0 {
            axes[k].retain(|_| moves.next().unwrap_or(true));
        }
    }
    Ok(axes)
}

/// How far the points of a patch move over every interval of u (0) or of v (1), at most. Millimetres.
fn extents(instance: &dyn Instance, patch: usize, axes: &Axes, k: usize) -> Result<Vec<f64>, EvaluationError> {
    const ALONG: usize = 5;
    const ACROSS: [f64; 3] = [0.1382, 0.5527, 0.9045];
    let lines: Vec<f64> = axes[1 - k].iter().flat_map(|i| ACROSS.map(|f| i.fraction(f))).collect();
    let along = |i: &Interval| (0..ALONG).map(|s| i.fraction(s as f64 / (ALONG - 1) as f64)).collect::<Vec<_>>();
    let sites = axes[k].iter().flat_map(|i| {
        let along = along(i);
        lines.iter().flat_map(move |line| along.clone().into_iter().map(|t| (t, *line))).collect::<Vec<_>>()
    });
    let (u, v): (Vec<f64>, Vec<f64>) = sites.map(|(t, line)| if k == 0 { (t, line) } else { (line, t) }).unzip();
    let mut points = vec![[0.0; 3]; u.len()];
    instance.points(patch, &u, &v, &mut points)?;
    let moved = |line: &[[f64; 3]]| {
        let [first, rest @ ..] = line else { return 0.0 };
        rest.iter().map(|p| DVec3::from_array(*p).distance(DVec3::from_array(*first))).fold(0.0, f64::max)
    };
    let of_interval = |lines: &[[f64; 3]]| lines.chunks(ALONG).map(moved).fold(0.0, f64::max);
    Ok(points.chunks(ALONG * lines.len()).map(of_interval).collect())
}

/// Sites along an axis at which curvature is sampled: in every interval its ends and places between them.
const SITES: usize = 48;
/// Steps of u that are tried: the longest ones that the bend along u allows, divided by powers of this, so many.
const SHARE: f64 = 1.3;
const SHARES: i32 = 49;
/// Divisions have about as few cells as the one with the fewest up to this factor: whole numbers of steps alone differ
/// by a twentieth.
const ABOUT: f64 = 1.1;
/// Turns of the normal by twist over a cell below this are all the same, and the fewest cells are taken: 3 degrees, of
/// which the area is a thousandth too large. Radians.
const TURNED: f64 = 0.05;

/// How far chords leave a surface: along u, along v and along both at once, in a frame of the surface.
#[derive(Clone, Copy, Default)]
struct Bend {
    /// Components of the second derivatives along the normal.
    uu: f64,
    uv: f64,
    vv: f64,
    /// Across the line, in any direction: what counts for lines that bound the surface, where it is smooth.
    across: [f64; 2],
    /// Lengths of the first derivatives.
    speed: [f64; 2],
}

impl Bend {
    fn of(s: &SecondPartials) -> Self {
        let vector = DVec3::from_array;
        let (du, dv) = (vector(s.first.du), vector(s.first.dv));
        let normal = du.cross(dv).normalize_or_zero();
        let across = |second: DVec3, first: DVec3| {
            first.try_normalize().map_or(0.0, |along| second.reject_from_normalized(along).length())
        };
        Self {
            uu: vector(s.duu).dot(normal),
            uv: vector(s.duv).dot(normal),
            vv: vector(s.dvv).dot(normal),
            across: [across(vector(s.duu), du), across(vector(s.dvv), dv)],
            speed: [du.length(), dv.length()],
        }
    }

    /// By how much twist turns the normal over a cell with these steps. Radians.
    fn turn(&self, [of_u, of_v]: [f64; 2]) -> f64 {
        let turn = self.uv.abs() * (of_v / self.speed[0]).hypot(of_u / self.speed[1]);
        if turn.is_finite() { turn } else { 0.0 }
    }

    /// The longest step of v beside one of u with which the surface leaves the triangles of a cell by an eighth of
    /// `most`, by second order: its sides, and the diagonal that leaves less.
    fn longest_v(&self, of_u: f64, most: f64) -> f64 {
        let (along, twist) = (self.uu * of_u * of_u, 2.0 * self.uv * of_u);
        let diagonals = [twist, -twist].map(|twist| first_exit(self.vv, twist, along, most));
        (most / self.vv.abs()).sqrt().min(diagonals[0].max(diagonals[1]))
    }
}

/// Bends at sites of the intervals of u and of v.
struct Lattice {
    /// For each axis: the interval of each site.
    of_site: [Vec<usize>; 2],
    /// For each axis: whether the site is an end of its interval.
    at_end: [Vec<bool>; 2],
    bends: Vec<Bend>,
}

impl Lattice {
    /// Ends of intervals are left out where second derivatives do not exist there.
    fn new(instance: &dyn Instance, patch: usize, axes: &Axes) -> Result<Self, EvaluationError> {
        Self::sampled(instance, patch, axes, true).or_else(|_| Self::sampled(instance, patch, axes, false))
    }

    fn sampled(instance: &dyn Instance, patch: usize, axes: &Axes, ends: bool) -> Result<Self, EvaluationError> {
        let mut at: [Vec<f64>; 2] = Default::default();
        let (mut of_site, mut at_end): ([Vec<usize>; 2], [Vec<bool>; 2]) = Default::default();
        for k in 0..2 {
            let inner = (SITES / axes[k].len()).clamp(4, 16);
            for (i, interval) in axes[k].iter().enumerate() {
                let first = if ends { vec![0.0, 1.0] } else { Vec::new() };
                let fractions = first.into_iter().chain((0..inner).map(|s| (s as f64 + jitter(s)) / inner as f64));
                for fraction in fractions {
                    at[k].push(interval.fraction(fraction));
                    of_site[k].push(i);
                    at_end[k].push(fraction == 0.0 || fraction == 1.0);
                }
            }
        }
        let (u, v): (Vec<f64>, Vec<f64>) = at[1].iter().flat_map(|v| at[0].iter().map(move |u| (*u, *v))).unzip();
        let mut samples = vec![SecondPartials::default(); u.len()];
        instance.second_partials(patch, &u, &v, &mut samples)?;
        let mut lattice = Self { of_site, at_end, bends: samples.iter().map(Bend::of).collect() };
        lattice.tame_ends();
        Ok(lattice)
    }

    /// The longest steps of u (0) or of v (1), by interval: those that a function allows at the sites, given the
    /// interval of the other parameter; and that border lines and the length of edges allow.
    fn longest(
        &self,
        k: usize,
        axes: &Axes,
        fineness: Fineness,
        most: f64,
        allowed: impl Fn(&Bend, usize) -> f64,
    ) -> Vec<f64> {
        let width = self.of_site[0].len();
        let mut longest: Vec<f64> = axes[k].iter().map(|interval| interval.end() - interval.start()).collect();
        for (i, bend) in self.bends.iter().enumerate() {
            let site = [i % width, i / width];
            let mut step = allowed(bend, self.of_site[1 - k][site[1 - k]]).min(fineness.edge / bend.speed[k]);
            // Along lines that bound the surface, or a smooth part of it, any departure counts.
            if self.at_end[1 - k][site[1 - k]] {
                step = step.min((most / bend.across[k]).sqrt());
            }
            let longest = &mut longest[self.of_site[k][site[k]]];
            *longest = longest.min(step);
        }
        longest
    }

    /// By how much twist turns the normal over a cell, at most, of intervals in so many steps. Radians.
    fn turn(&self, axes: &Axes, counts: &[Vec<u32>; 2]) -> f64 {
        let width = self.of_site[0].len();
        let step = |k: usize, site: usize| {
            let i = self.of_site[k][site];
            (axes[k][i].end() - axes[k][i].start()) / f64::from(counts[k][i])
        };
        let of_site = |(i, bend): (usize, &Bend)| bend.turn([step(0, i % width), step(1, i / width)]);
        self.bends.iter().enumerate().map(of_site).fold(0.0, f64::max)
    }

    /// Limits the bends at ends of intervals, which may be as good as infinite, to some times those between.
    fn tame_ends(&mut self) {
        const MOST: f64 = 4.0;
        let width = self.of_site[0].len();
        let end = |lattice: &Self, i: usize| lattice.at_end[0][i % width] || lattice.at_end[1][i / width];
        let inner = |of: fn(&Bend) -> f64| {
            let inner = (0..self.bends.len()).filter(|i| !end(self, *i)).map(|i| of(&self.bends[i]).abs());
            MOST * inner.fold(0.0, f64::max)
        };
        let limits = [inner(|b| b.uu), inner(|b| b.uv), inner(|b| b.vv)];
        let across = [inner(|b| b.across[0]), inner(|b| b.across[1])];
        for i in 0..self.bends.len() {
            if end(self, i) {
                let b = &mut self.bends[i];
                b.uu = b.uu.clamp(-limits[0], limits[0]);
                b.uv = b.uv.clamp(-limits[1], limits[1]);
                b.vv = b.vv.clamp(-limits[2], limits[2]);
                b.across = [b.across[0].min(across[0]), b.across[1].min(across[1])];
            }
        }
    }
}

/// Divides the intervals of a patch so that its triangles leave the surface by about the tolerance, by second order,
/// with as few of them as even steps allow; and so that no edge is longer than wanted. Of divisions with about as few
/// that is taken over whose cells twist turns the normal least: on a twisted surface cells over the whole width keep to
/// any chord, and their normals and their area never become those of the surface (Schwarz's lantern).
pub(super) fn divide(
    instance: &dyn Instance,
    patch: usize,
    axes: &mut Axes,
    fineness: Fineness,
) -> Result<(), EvaluationError> {
    let lattice = Lattice::new(instance, patch, axes)?;
    // Rounding and terms of higher order.
    let most = 8.0 * 0.95 * fineness.chord;
    let alone = lattice.longest(0, axes, fineness, most, |bend, _| (most / bend.uu.abs()).sqrt());
    let counts = |axis: &[Interval], steps: &[f64]| -> Vec<u32> {
        let count = |(interval, step): (&Interval, &f64)| {
            let n = ((interval.end() - interval.start()) / step).ceil();
            // NaN becomes 1.
            (n.max(1.0) as u32).min(fineness.max_segments.max(1))
        };
        axis.iter().zip(steps).map(count).collect()
    };
    let sum = |counts: &[u32]| counts.iter().map(|n| f64::from(*n)).sum::<f64>();
    let (mut divisions, mut least) = (Vec::new(), f64::INFINITY);
    for k in 0..SHARES {
        let of_u: Vec<f64> = alone.iter().map(|step| SHARE.powi(-k) * step).collect();
        let in_u = counts(&axes[0], &of_u);
        // With shorter steps of u there are only more of them.
        if sum(&in_u) * axes[1].len() as f64 > ABOUT * least {
            break;
        }
        let of_v = lattice.longest(1, axes, fineness, most, |bend, of| bend.longest_v(of_u[of], most));
        let in_v = counts(&axes[1], &of_v);
        let total = sum(&in_u) * sum(&in_v);
        least = least.min(total);
        divisions.push((total, [in_u, in_v]));
    }
    let few = divisions.into_iter().filter(|(total, _)| *total <= ABOUT * least);
    let turning = few.map(|(total, counts)| (lattice.turn(axes, &counts).max(TURNED), total, counts));
    let best = turning.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))).map(|(_, _, counts)| counts);
    for (axis, best) in axes.iter_mut().zip(best.unwrap_or_default()) {
        axis.iter_mut().zip(best).for_each(|(interval, segments)| interval.divide(segments as usize));
    }
    Ok(())
}

/// The least positive w at which |d w^2 + b w + a| is `most`; infinite if there is none.
fn first_exit(d: f64, b: f64, a: f64, most: f64) -> f64 {
    // At the edge itself rounding would decide.
    let a = a.clamp(-0.999 * most, 0.999 * most);
    let roots = [most, -most].into_iter().flat_map(|bound| {
        let c = a - bound;
        let q = -0.5 * (b + b.signum() * (b * b - 4.0 * d * c).sqrt());
        [q / d, c / q]
    });
    roots.filter(|root| *root > 0.0).fold(f64::INFINITY, f64::min)
}
