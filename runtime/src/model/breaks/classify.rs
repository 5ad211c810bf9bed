//! What jumps where decisions change.

use super::{Axis, Break, BreakKind, Gap, Gaps, Patch, between};
use crate::model::surface::{Partials, SecondPartials};
use glam::DVec3;
use gml_compiler::program::EvaluationError;

/// A step is a distance of both sides of more than this times the size of the patch. Rounding errors are a few times
/// 1e-16 of it.
pub(super) const STEP: f64 = 1e-9;

/// A corner is a change of direction by more than this, in radians; a change of speed by more than this times the speed
/// is a bend. A chord of 10 mm over such a corner leaves the surface by 2.5 um. The frames of sweeps, which are carried
/// from station to station, turn by 2e-6 along a helix of two turns and by up to 1.2e-4 along a knot.
pub(super) const CORNER: f64 = 1e-3;

/// A bend is a jump of the second derivative by more than this times the largest one at any gap of the patch ...
const BEND: f64 = 0.01;

/// ... and than this times the size of the patch: over all of 0..1 a chord is off by an eighth of it.
const BEND_OF_SIZE: f64 = 1e-3;

/// Where in an interval of the other parameter a break is looked at. (The lines of the search are elsewhere: on these a
/// change of decisions by both parameters looks like one by this parameter alone.)
const PLACES: [f64; 3] = [0.1382, 0.5527, 0.9045];

/// Most values of the other parameter at which a break is looked at.
const MOST_PLACES: usize = 48;

/// Steps away from a gap, where derivatives at its ends are not finite.
const ASIDE: [f64; 3] = [1e-9, 1e-7, 1e-5];

/// The diagonal of a box around a patch.
pub(super) fn size(patch: Patch<'_>) -> Result<f64, EvaluationError> {
    const LATTICE: u32 = 9;
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(LATTICE);
    let (u, v): (Vec<f64>, Vec<f64>) = (0..LATTICE).flat_map(|j| (0..LATTICE).map(move |i| (at(i), at(j)))).unzip();
    let mut points = vec![[0.0; 3]; u.len()];
    patch.instance.points(patch.patch, &u, &v, &mut points)?;
    let points = points.into_iter().map(DVec3::from_array);
    let (low, high) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    Ok(low.distance(high))
}

/// The gaps of a parameter at which something jumps.
pub(super) fn breaks(patch: Patch<'_>, axis: Axis, gaps: &Gaps, size: f64) -> Vec<Break> {
    let (own, other) = (&gaps[axis as usize], &gaps[axis.other() as usize]);
    if own.is_empty() {
        // The second derivatives of a smooth model are not even compiled.
        return Vec::new();
    }
    let mut places: Vec<f64> = PLACES.iter().flat_map(|fraction| between(other, *fraction)).collect();
    places.sort_by(f64::total_cmp);
    let every = places.len().div_ceil(MOST_PLACES);
    let places: Vec<f64> = places.into_iter().step_by(every).collect();
    // The ends of all gaps, the lower ones first, at all places.
    let ends = |end: fn(&Gap) -> f64, outward: f64| {
        let ends: Vec<(f64, f64)> = own.iter().flat_map(|g| places.iter().map(move |p| (end(g), *p))).collect();
        jets(patch, axis, &ends, outward)
    };
    let (before, after) = (ends(|g| g.before, -1.0), ends(|g| g.after, 1.0));
    let all = before.iter().chain(&after).flatten();
    let largest = all.map(|jet| jet.second.length()).filter(|x| x.is_finite()).fold(0.0, f64::max);
    let bend = (BEND * largest).max(BEND_OF_SIZE * size);
    let kind = |k: usize| {
        let range = k * places.len()..(k + 1) * places.len();
        let sides = before[range.clone()].iter().zip(&after[range]);
        let apart = own[k].after - own[k].before;
        sides.filter_map(|(a, b)| jump([a.as_ref()?, b.as_ref()?], apart, size, bend)).max()
    };
    let found = own.iter().enumerate();
    found.filter_map(|(k, g)| Some(Break { before: g.before, after: g.after, kind: kind(k)? })).collect()
}

/// A point with its first and second derivatives by one parameter; the second one NaN where it is not finite.
struct Jet {
    point: DVec3,
    first: DVec3,
    second: DVec3,
}

/// Derivatives at sites (parameter, other parameter); where they are not finite, a little further outward.
fn jets(patch: Patch<'_>, axis: Axis, sites: &[(f64, f64)], outward: f64) -> Vec<Option<Jet>> {
    let (along, across): (Vec<f64>, Vec<f64>) = sites.iter().copied().unzip();
    let (u, v) = axis.uv(&along, &across);
    let mut all = vec![SecondPartials::default(); sites.len()];
    let jet = |p: &SecondPartials| {
        let (first, second) = axis.pick([p.first.du, p.first.dv], [p.duu, p.dvv]);
        Jet { point: DVec3::from_array(p.first.point), first, second }
    };
    if patch.instance.second_partials(patch.patch, u, v, &mut all).is_ok() {
        return all.iter().map(|p| Some(jet(p))).collect();
    }
    let alone = |(along, across): &(f64, f64)| {
        [0.0].iter().chain(&ASIDE).find_map(|aside| {
            let (u, v) = axis.uv(along + outward * aside, *across);
            let mut second = [SecondPartials::default()];
            if patch.instance.second_partials(patch.patch, &[u], &[v], &mut second).is_ok() {
                return Some(jet(&second[0]));
            }
            let mut first = [Partials::default()];
            patch.instance.partials(patch.patch, &[u], &[v], &mut first).ok()?;
            let unknown = [f64::NAN; 3];
            Some(jet(&SecondPartials { first: first[0], duu: unknown, duv: unknown, dvv: unknown }))
        })
    };
    sites.iter().map(alone).collect()
}

impl Axis {
    /// The derivatives by this parameter, from those by u and v.
    fn pick(self, first: [[f64; 3]; 2], second: [[f64; 3]; 2]) -> (DVec3, DVec3) {
        (DVec3::from_array(first[self as usize]), DVec3::from_array(second[self as usize]))
    }
}

/// What jumps between two sides of a gap that are a little apart.
fn jump([a, b]: [&Jet; 2], apart: f64, size: f64, bend: f64) -> Option<BreakKind> {
    let (from, to) = (a.first.length(), b.first.length());
    if a.point.distance(b.point) > STEP * size + 2.0 * apart * from.max(to) {
        return Some(BreakKind::Step);
    }
    // Without speed there is no direction: at a pole, or where a parameter slows down to a halt.
    let still = STEP * size;
    let turns = a.first.cross(b.first).length() > CORNER * from * to || a.first.dot(b.first) < 0.0;
    if from > still && to > still && turns {
        return Some(BreakKind::Corner);
    }
    let speeds = (from - to).abs() > CORNER * from.max(to) && from.max(to) > still;
    let bends = a.second.distance(b.second) > bend;
    (speeds || bends).then_some(BreakKind::Bend)
}
