//! Breaks: values of u and v at which a patch is not smooth, such as the corners of a polyline or the joints of an arc.
//!
//! The compiler tells which decisions (branches, signs, roundings) the evaluation of a point takes by u alone, by v
//! alone and by both ([`Order::Decisions`]). A surface can only break where one of them changes: these places are
//! bisected to adjacent doubles (`search`). Whether anything jumps there, and what, is seen from the derivatives on
//! both sides (`classify`): most decisions change without a trace.

mod classify;
mod follow;
mod oblique;
mod search;
#[cfg(test)]
mod tests;

pub(crate) use follow::Trail;

use super::surface::Instance;
use gml_compiler::program::{EvaluationError, Order, Sites};

/// A value of a surface parameter at which a patch is not smooth: the last value before it and the first one after it,
/// adjacent doubles. (Several breaks so close together that no surface is between them are one.)
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Break {
    /// The last value before it.
    pub before: f64,
    /// The first value after it.
    pub after: f64,
    /// What jumps there.
    pub kind: BreakKind,
}

/// What jumps at a break, somewhere along it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum BreakKind {
    /// Second derivatives, or the speed with which the parameter runs; the tangent planes of both sides are the same.
    Bend,
    /// The direction of the first partial derivative across the break.
    Corner,
    /// The surface itself.
    Step,
}

/// Where a patch is not smooth. `u` and `v` are ascending, inside of (0, 1).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Breaks {
    /// Breaks along lines of constant u.
    pub u: Vec<Break>,
    /// Breaks along lines of constant v.
    pub v: Vec<Break>,
    /// Whether there are corners or steps also along other curves.
    pub oblique: bool,
}

impl Breaks {
    /// Finds the breaks of a patch.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn of_patch(instance: &dyn Instance, patch: usize) -> Result<Breaks, EvaluationError> {
        let patch = Patch { instance, patch };
        let (gaps, uncounted) = search::gaps(patch)?;
        let size = classify::size(patch)?;
        let [u, v] = [Axis::U, Axis::V].map(|axis| classify::breaks(patch, axis, &gaps, size));
        let oblique = uncounted || oblique::is_oblique(patch, &gaps, size)?;
        Ok(Breaks { u, v, oblique })
    }
}

/// Moves values that lie within one of some breaks to its upper side: in between derivatives may be those of neither
/// side.
pub(super) fn move_off(breaks: &[Break], values: &mut [f64]) {
    for t in values {
        let next = breaks.partition_point(|b| b.after <= *t);
        if let Some(within) = breaks.get(next).filter(|b| b.before < *t) {
            *t = within.after;
        }
    }
}

/// The spans of 0..1 that some cuts leave, each the last value before it and the first one after it, ascending.
pub(crate) fn spans(cuts: impl Iterator<Item = (f64, f64)> + Clone) -> impl Iterator<Item = (f64, f64)> {
    let starts = std::iter::once(0.0).chain(cuts.clone().map(|(_, after)| after));
    let ends = cuts.map(|(before, _)| before).chain(std::iter::once(1.0));
    starts.zip(ends)
}

/// A surface parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Axis {
    U,
    V,
}

impl Axis {
    fn other(self) -> Axis {
        match self {
            Axis::U => Axis::V,
            Axis::V => Axis::U,
        }
    }

    /// u and v from the parameter and the other one.
    fn uv<T>(self, along: T, across: T) -> (T, T) {
        match self {
            Axis::U => (along, across),
            Axis::V => (across, along),
        }
    }
}

/// An interval between adjacent doubles, or few more, in which decisions change.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Gap {
    before: f64,
    after: f64,
}

/// The intervals of u and of v in which decisions change, ascending.
type Gaps = [Vec<Gap>; 2];

/// A patch of an instance.
#[derive(Clone, Copy)]
pub(super) struct Patch<'a> {
    pub(super) instance: &'a dyn Instance,
    pub(super) patch: usize,
}

impl Patch<'_> {
    /// The signatures of u, of v and of both at sites.
    fn decisions(self, u: &[f64], v: &[f64]) -> Result<Vec<[f64; 3]>, EvaluationError> {
        let mut out = vec![[0.0; 3]; u.len()];
        let sites = Sites::Scattered(u, v);
        self.instance.evaluate(self.patch, sites, Order::Decisions, out.as_flattened_mut())?;
        Ok(out)
    }

    /// The signatures of both at sites, for those who follow edges that are not along lines of constant u or v; 0
    /// everywhere where there are none.
    pub(super) fn oblique_signatures(self, u: &[f64], v: &[f64]) -> Result<Vec<f64>, EvaluationError> {
        Ok(self.decisions(u, v)?.into_iter().map(|[_, _, both]| both).collect())
    }
}

/// A value in each of the spans between gaps, at a fraction of its length.
fn between(gaps: &[Gap], fraction: f64) -> impl Iterator<Item = f64> {
    spans(gaps.iter().map(|g| (g.before, g.after))).map(move |(start, end)| start + (end - start) * fraction)
}
