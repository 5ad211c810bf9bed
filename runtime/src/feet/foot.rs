//! Distances to the exact surface: the nearest facet's point is refined by projected Newton steps in (u, v). They stop
//! at the breaks of the patch, as at its edges, and go on from the other side where that leads nearer.

use super::domain::{Domain, Stretch};
use super::tuning::{
    BACKTRACK, CURVED_CLEARLY, CURVED_SOUNDLY, FOOT_EVALUATIONS, LEVEL_PULL, SEAM_STEP, TAYLOR_GROWTH, TAYLOR_SHARE,
    TAYLOR_STEPS,
};
use crate::model::{EvaluationError, Instance, SecondPartials};
use glam::DVec3;

/// The point of a patch nearest to a given one.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Foot {
    /// The place on the patch, in [0, 1]^2.
    pub(crate) uv: [f64; 2],
    /// S(u, v). Millimetres.
    pub(crate) point: DVec3,
    /// dS/du x dS/dv, not of unit length; zero at a pole.
    pub(crate) normal: DVec3,
    /// Squared distance; infinite where nothing of the patch is there.
    pub(crate) d2: f64,
    /// What the edge of a trimmed patch holds: half of `d2` changes by so much less as the function of what is there
    /// grows by one. Zero within the patch.
    pub(crate) hold: f64,
    /// Of a foot on a corner of the surface, the same place by the parameters of the other side, and the share that
    /// this has in how the foot moves.
    pub(crate) beyond: [f64; 2],
    pub(crate) share: f64,
}

/// The iteration of one foot point.
#[derive(Clone, Copy)]
struct Iteration {
    /// Index of the point.
    index: usize,
    /// How half of the foot's squared distance changes with u and v.
    pull: [f64; 2],
    trial: [f64; 2],
    step: [f64; 2],
    /// The stretches of u and of v in which the foot lies.
    home: [u16; 2],
    /// Those of the trial where it lies across a break from the foot.
    crossed: Option<[u16; 2]>,
    /// Which of the four neighbouring stretches were looked at since the foot moved: all before this one.
    looked: usize,
}

/// The settings that all foot points of a call share.
#[derive(Clone, Copy)]
struct Search<'a> {
    domain: &'a Domain,
    tolerance: f64,
}

/// Moves every `uv` to the nearest point of the patch to its `q`, until another step would lower the squared distance
/// by less than `tolerance` squared. Foot points cross the seams of a patch that is closed, elsewhere they stop at the
/// edge.
///
/// # Errors
/// The patch cannot be evaluated.
pub(crate) fn foot_points(
    instance: &dyn Instance,
    patch: usize,
    domain: &Domain,
    q: &[DVec3],
    uv: &[[f64; 2]],
    tolerance: f64,
) -> Result<Vec<Foot>, EvaluationError> {
    let mut feet = vec![Foot { d2: f64::INFINITY, ..Foot::default() }; q.len()];
    let search = Search { domain, tolerance };
    let mut active: Vec<Iteration> = uv.iter().enumerate().map(|(index, uv)| search.begin(index, *uv)).collect();
    let (mut u, mut v, mut surface) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..FOOT_EVALUATIONS {
        if active.is_empty() {
            break;
        }
        u.clear();
        v.clear();
        u.extend(active.iter().map(|i| i.trial[0]));
        v.extend(active.iter().map(|i| i.trial[1]));
        surface.resize(active.len(), SecondPartials::default());
        instance.second_partials(patch, &u, &v, &mut surface)?;
        let mut remaining = 0;
        for i in 0..active.len() {
            let mut iteration = active[i];
            let index = iteration.index;
            if search.advance(&mut iteration, &mut feet[index], &surface[i], q[index]) {
                active[remaining] = iteration;
                remaining += 1;
            }
        }
        active.truncate(remaining);
    }
    Ok(feet)
}

impl Search<'_> {
    fn begin(&self, index: usize, uv: [f64; 2]) -> Iteration {
        let home = self.domain.numbers(uv);
        Iteration { index, pull: [0.0; 2], trial: uv, step: [0.0; 2], home, crossed: None, looked: 0 }
    }

    /// Accepts a trial if it is nearer and chooses the next one; false when the iteration is over.
    fn advance(&self, iteration: &mut Iteration, foot: &mut Foot, s: &SecondPartials, q: DVec3) -> bool {
        let [point, du, dv] = [s.first.point, s.first.du, s.first.dv].map(DVec3::from_array);
        let r = point - q;
        let d2 = r.length_squared();
        // Both sides of a corner are the same point, to rounding.
        let rounding = if iteration.crossed.is_some() { self.tolerance * self.tolerance + 1e-12 * d2 } else { 0.0 };
        if d2 > foot.d2 + rounding {
            if iteration.crossed.is_some() {
                return self.cross(iteration, foot);
            }
            iteration.step = iteration.step.map(|s| BACKTRACK * s);
            if iteration.step.iter().all(|s| s.abs() < 1e-14) {
                return false;
            }
            iteration.trial = stepped(foot.uv, iteration.step, self.domain.pieces(iteration.home));
            return true;
        }
        let within = self.domain.pieces(iteration.crossed.unwrap_or(iteration.home));
        let second = [s.duu, s.duv, s.dvv].map(DVec3::from_array);
        let (gradient, metric) = ([r.dot(du), r.dot(dv)], [du.dot(du), du.dot(dv), dv.dot(dv)]);
        let (mut step, gain) = newton(iteration.trial, within, gradient, metric, second.map(|d| r.dot(d)));
        // `gain` is the predicted decrease of d^2; below rounding nothing is gained.
        let least = (self.tolerance * self.tolerance).max(1e-16 * d2);
        let bend = off_saddle(iteration.trial, within, gradient, metric, r, second, gain.max(least));
        let rests = gain <= least && bend.is_none();
        let is_newton = bend.is_none();
        step = bend.unwrap_or(step);
        if let Some(numbers) = iteration.crossed {
            if rests && d2 + rounding >= foot.d2 {
                if foot.share == 0.0 && point.distance_squared(foot.point) <= rounding {
                    foot.share = share_beyond(iteration, gradient);
                    foot.beyond = iteration.trial;
                }
                return self.cross(iteration, foot);
            }
            (iteration.home, iteration.crossed, iteration.looked) = (numbers, None, 0);
        }
        *foot = Foot { uv: iteration.trial, point, normal: du.cross(dv), d2, ..Foot::default() };
        iteration.pull = gradient;
        if rests {
            return self.cross(iteration, foot);
        }
        if is_newton
            && let Some(there) = finish(iteration.trial, step, s, q, within, self.tolerance)
            && !self.is_at_break(iteration.home, there.uv)
        {
            if there.d2 < foot.d2 {
                *foot = there;
            }
            return false;
        }
        iteration.step = step;
        iteration.trial = stepped(foot.uv, step, within);
        true
    }

    /// From a foot that rests at a break to the other side of it; false where there is none that was not looked at.
    fn cross(&self, iteration: &mut Iteration, foot: &Foot) -> bool {
        while foot.d2 > self.tolerance * self.tolerance && iteration.looked < 4 {
            let (k, up) = (iteration.looked / 2, iteration.looked % 2 == 1);
            iteration.looked += 1;
            if let Some((number, t)) = self.domain.across(k, iteration.home[k], up, foot.uv[k]) {
                let mut numbers = iteration.home;
                (iteration.trial, numbers[k]) = (foot.uv, number);
                iteration.trial[k] = t;
                iteration.crossed = Some(numbers);
                return true;
            }
        }
        false
    }

    fn is_at_break(&self, home: [u16; 2], uv: [f64; 2]) -> bool {
        (0..2).any(|k| [false, true].iter().any(|up| self.domain.across(k, home[k], *up, uv[k]).is_some()))
    }
}

/// The share that the side across a break has in how a foot on it moves. The corner is somewhere else in u or v when
/// parameters change, which moves neither side's place at a fixed (u, v): that share of both for which nothing changes
/// with u or v does not depend on where it is (an element of Clarke's generalised gradient that vanishes there;
/// Optimization and Nonsmooth Analysis, 1983).
fn share_beyond(iteration: &Iteration, there: [f64; 2]) -> f64 {
    let axis = (iteration.looked - 1) / 2;
    let (here, there) = (iteration.pull[axis], there[axis]);
    // Where the other side does not pull, but for rounding, it is all that counts.
    if here * there <= LEVEL_PULL * here * here && here != 0.0 { (here / (here - there)).min(1.0) } else { 0.0 }
}

/// How feet on a patch move by each of its active parameters, three coordinates each.
///
/// # Errors
/// The patch cannot be evaluated.
pub(crate) fn motions(
    instance: &dyn Instance,
    patch: usize,
    feet: &[Foot],
    active: usize,
) -> Result<Vec<f64>, EvaluationError> {
    let mut motions = motions_at(instance, patch, feet.iter().map(|foot| foot.uv), active)?;
    let at_corner: Vec<usize> = (0..feet.len()).filter(|i| feet[*i].share > 0.0).collect();
    if active == 0 || at_corner.is_empty() {
        return Ok(motions);
    }
    let beyond = motions_at(instance, patch, at_corner.iter().map(|i| feet[*i].beyond), active)?;
    for (i, beyond) in at_corner.into_iter().zip(beyond.chunks_exact(active * 3)) {
        let share = feet[i].share;
        let here = &mut motions[i * active * 3..(i + 1) * active * 3];
        here.iter_mut().zip(beyond).for_each(|(here, beyond)| *here += share * (beyond - *here));
    }
    Ok(motions)
}

fn motions_at(
    instance: &dyn Instance,
    patch: usize,
    uv: impl Iterator<Item = [f64; 2]>,
    active: usize,
) -> Result<Vec<f64>, EvaluationError> {
    let (u, v): (Vec<f64>, Vec<f64>) = uv.map(|[u, v]| (u, v)).unzip();
    let mut motions = vec![0.0; u.len() * active * 3];
    instance.jacobian(patch, &u, &v, &mut motions)?;
    Ok(motions)
}

fn stepped(uv: [f64; 2], step: [f64; 2], within: [Stretch; 2]) -> [f64; 2] {
    [0, 1].map(|k| {
        let x = uv[k] + step[k];
        match within[k].wraps {
            true if (0.0..1.0).contains(&x) => x,
            true => x - x.floor(),
            false => within[k].clamp(x),
        }
    })
}

/// The foot on the surface's Taylor polynomial of second order about `uv`, where that is the surface to a small part of
/// `tolerance`: close to the foot the surface need not be evaluated again. `step` is the first one.
fn finish(
    uv: [f64; 2],
    step: [f64; 2],
    s: &SecondPartials,
    q: DVec3,
    within: [Stretch; 2],
    tolerance: f64,
) -> Option<Foot> {
    let [point, du, dv] = [s.first.point, s.first.du, s.first.dv].map(DVec3::from_array);
    let [duu, duv, dvv] = [s.duu, s.duv, s.dvv].map(DVec3::from_array);
    let size = [du.length() + duu.length(), dv.length() + dvv.length()];
    let mixed = duv.length();
    // The next term of the series, from the last one and from how much faster a surface's higher derivatives grow.
    let beyond = |step: [f64; 2]| {
        let [a, b] = step.map(f64::abs);
        TAYLOR_GROWTH / 6.0 * (size[0] * a * a * a + size[1] * b * b * b + 3.0 * mixed * a * b * (a + b))
    };
    let mut walked = [0.0; 2];
    let mut step = step;
    for _ in 0..TAYLOR_STEPS {
        walked = [walked[0] + step[0], walked[1] + step[1]];
        if !(beyond(walked) <= TAYLOR_SHARE * tolerance) {
            return None;
        }
        let [a, b] = walked;
        let here = point + du * a + dv * b + duu * (0.5 * a * a) + duv * (a * b) + dvv * (0.5 * b * b);
        let (du, dv) = (du + duu * a + duv * b, dv + duv * a + dvv * b);
        let r = here - q;
        let (gradient, metric) = ([r.dot(du), r.dot(dv)], [du.dot(du), du.dot(dv), dv.dot(dv)]);
        let second = [duu, duv, dvv];
        let at = [uv[0] + a, uv[1] + b];
        let (next, gain) = newton(at, within, gradient, metric, second.map(|d| r.dot(d)));
        let d2 = r.length_squared();
        let least = (tolerance * tolerance).max(1e-16 * d2);
        if gain <= least {
            let rests = off_saddle(at, within, gradient, metric, r, second, least).is_none();
            let uv = stepped(uv, walked, within);
            return rests.then(|| Foot { uv, point: here, normal: du.cross(dv), d2, ..Foot::default() });
        }
        step = next;
    }
    None
}

/// The step that minimises the quadratic model of |S - q|^2 / 2 `within` stretches, and how much it lowers |S - q|^2.
/// `metric` is the first fundamental form, `bend` the rest of the Hessian.
fn newton(uv: [f64; 2], within: [Stretch; 2], g: [f64; 2], metric: [f64; 3], bend: [f64; 3]) -> ([f64; 2], f64) {
    let blocked = |k: usize| {
        let Stretch { start, end, wraps, .. } = within[k];
        !wraps && ((uv[k] <= start && g[k] > 0.0) || (uv[k] >= end && g[k] < 0.0))
    };
    let limited = |k: usize, step: f64| {
        if within[k].wraps { step.clamp(-SEAM_STEP, SEAM_STEP) } else { within[k].clamp(uv[k] + step) - uv[k] }
    };
    let free = [!blocked(0), !blocked(1)];
    // If the full Hessian is not safely positive (the point lies beyond a centre of curvature), the metric alone
    // (Gauss-Newton) still gives a descent direction.
    let mut h = [metric[0] + bend[0], metric[1] + bend[1], metric[2] + bend[2]];
    let positive = |k: usize| h[2 * k] > CURVED_CLEARLY * metric[2 * k];
    let both = free[0] && free[1];
    if (free[0] && !positive(0))
        || (free[1] && !positive(1))
        || (both && h[0] * h[2] - h[1] * h[1] <= CURVED_SOUNDLY * h[0] * h[2])
    {
        h = [metric[0] + bend[0].abs(), metric[1], metric[2] + bend[2].abs()];
    }
    // A pole has no metric in one direction; the ridge keeps the solution finite.
    let ridge = 1e-14 * (h[0].abs() + h[2].abs()) + f64::MIN_POSITIVE;
    h[0] += ridge;
    h[2] += ridge;
    let mut step = match free {
        [true, true] => {
            let det = h[0] * h[2] - h[1] * h[1];
            [(h[1] * g[1] - h[2] * g[0]) / det, (h[1] * g[0] - h[0] * g[1]) / det]
        }
        [true, false] => [-g[0] / h[0], 0.0],
        [false, true] => [0.0, -g[1] / h[2]],
        [false, false] => [0.0; 2],
    };
    // A step that leaves through one edge follows the edge: the other variable is solved again.
    for k in 0..2 {
        let clipped = limited(k, step[k]);
        if clipped != step[k] {
            step[k] = clipped;
            let other = 1 - k;
            if free[other] {
                step[other] = -(g[other] + h[1] * clipped) / h[2 * other];
            }
        }
    }
    for k in 0..2 {
        step[k] = limited(k, step[k]);
    }
    let linear = g[0] * step[0] + g[1] * step[1];
    let quadratic = h[0] * step[0] * step[0] + 2.0 * h[1] * step[0] * step[1] + h[2] * step[1] * step[1];
    (step, -(2.0 * linear + quadratic))
}

/// The step away from where the squared distance is stationary but not least: about an edge at which the surface turns
/// back (dS/dv vanishes) neither the gradient nor the metric says how far to go, but the second derivatives do. None
/// where they do not promise to lower the squared distance by more than `least`. `r` is S - q.
fn off_saddle(
    uv: [f64; 2],
    within: [Stretch; 2],
    g: [f64; 2],
    metric: [f64; 3],
    r: DVec3,
    second: [DVec3; 3],
    least: f64,
) -> Option<[f64; 2]> {
    let [a, b, c] = [0, 1, 2].map(|k| metric[k] + r.dot(second[k]));
    let lowest = 0.5 * (a + c) - (0.25 * (a - c) * (a - c) + b * b).sqrt();
    if !(lowest < 0.0) {
        return None;
    }
    // Its eigenvector, of two parallel expressions the longer one.
    let (one, other) = ([b, lowest - a], [lowest - c, b]);
    let squared = |p: [f64; 2]| p[0] * p[0] + p[1] * p[1];
    let p = if squared(one) > squared(other) { one } else { other };
    let bend = |p: [f64; 2]| second[0] * (p[0] * p[0]) + second[1] * (2.0 * p[0] * p[1]) + second[2] * (p[1] * p[1]);
    // |r + bend w^2 / 2|^2 has its least value where w^2 is -2 lowest |p|^2 / |bend|^2.
    let w = (-2.0 * lowest * squared(p)).sqrt() / bend(p).length();
    let limited = |k: usize, step: f64| {
        if within[k].wraps { step.clamp(-SEAM_STEP, SEAM_STEP) } else { within[k].clamp(uv[k] + step) - uv[k] }
    };
    let gain = |s: [f64; 2]| {
        let linear = 2.0 * (g[0] * s[0] + g[1] * s[1]);
        let quadratic = a * s[0] * s[0] + 2.0 * b * s[0] * s[1] + c * s[1] * s[1];
        -(linear + quadratic + 0.25 * bend(s).length_squared())
    };
    let ways = [w, -w].map(|w| [limited(0, w * p[0]), limited(1, w * p[1])]);
    let best = if gain(ways[0]) >= gain(ways[1]) { ways[0] } else { ways[1] };
    (gain(best) > least).then_some(best)
}
