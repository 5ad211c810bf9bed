//! Breaks that are found again where parameters have moved them.

use super::search::LINES;
use super::{Axis, Break, Breaks, Patch};
use crate::model::surface::Instance;
use gml_compiler::program::EvaluationError;

/// A break is looked for at first so far from where it was, in the parameter, and twice as far each time until both of
/// its sides are found; never nearer to 0 and 1 than this, where decisions are those of neither side.
const FIRST_REACH: f64 = 1e-12;

/// The breaks of a patch, and the decisions on both sides of each, by which it is found again when parameters have
/// changed: what was beside a break is still there then, and at least as wide as it has moved.
#[derive(Clone, Debug, Default)]
pub(crate) struct Trail {
    breaks: Breaks,
    marks: Vec<Mark>,
}

/// A break, and what it is found again by.
#[derive(Clone, Copy, Debug)]
struct Mark {
    axis: Axis,
    /// Its number among those of the axis.
    number: usize,
    at: Break,
    /// A value of the other parameter at which decisions change here, and the signatures on both sides.
    line: f64,
    signatures: [f64; 2],
}

/// A break that has moved: the change of its decisions is between these.
#[derive(Clone, Copy)]
struct Bracket {
    mark: Mark,
    low: f64,
    high: f64,
}

impl Trail {
    /// The trail of the breaks of a patch where these were found. Breaks that no line shows cannot be followed, and
    /// those of oblique patches are not: grids that move over corners which no line is at put feet now on one side of
    /// them and now on the other.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub(crate) fn new(instance: &dyn Instance, patch: usize, breaks: Breaks) -> Result<Self, EvaluationError> {
        if breaks.oblique {
            return Ok(Self { breaks, marks: Vec::new() });
        }
        let patch = Patch { instance, patch };
        let of_axis = |(axis, breaks): (Axis, &[Break])| {
            let marked = move |(number, at): (usize, &Break)| {
                LINES.map(|line| Mark { axis, number, at: *at, line, signatures: [0.0; 2] })
            };
            breaks.iter().enumerate().flat_map(marked).collect::<Vec<Mark>>()
        };
        let all: Vec<Mark> =
            [(Axis::U, &breaks.u[..]), (Axis::V, &breaks.v[..])].into_iter().flat_map(of_axis).collect();
        let sides = patch.sides(&all)?;
        let signed = all.iter().zip(sides).map(|(mark, signatures)| Mark { signatures, ..*mark });
        let mut marks: Vec<Mark> = signed.filter(|mark| mark.signatures[0] != mark.signatures[1]).collect();
        marks.dedup_by_key(|mark| (mark.axis, mark.number));
        Ok(Self { breaks, marks })
    }

    /// The breaks where they were found.
    pub(crate) fn breaks(&self) -> &Breaks {
        &self.breaks
    }

    /// The breaks where an instance has them; none if all are where they were. Those that are not found remain.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub(crate) fn followed(&self, instance: &dyn Instance, patch: usize) -> Result<Option<Breaks>, EvaluationError> {
        if self.marks.is_empty() {
            return Ok(None);
        }
        let patch = Patch { instance, patch };
        let here = patch.sides(&self.marks)?;
        let moved = self.marks.iter().zip(here).filter(|(mark, here)| mark.signatures != *here);
        let moved: Vec<Mark> = moved.map(|(mark, _)| *mark).collect();
        if moved.is_empty() {
            return Ok(None);
        }
        let mut followed = self.breaks.clone();
        for (Mark { axis, number, .. }, at) in patch.sought(&moved)? {
            match axis {
                Axis::U => followed.u[number] = at,
                Axis::V => followed.v[number] = at,
            }
        }
        let ascends = |all: &[Break]| all.windows(2).all(|pair| pair[0].after < pair[1].before);
        Ok(Some(followed).filter(|all| ascends(&all.u) && ascends(&all.v)))
    }
}

impl Patch<'_> {
    /// The signature of each mark's own parameter at a value of it.
    fn signatures<'m>(self, sites: impl Iterator<Item = (&'m Mark, f64)> + Clone) -> Result<Vec<f64>, EvaluationError> {
        let (u, v): (Vec<f64>, Vec<f64>) = sites.clone().map(|(mark, at)| mark.axis.uv(at, mark.line)).unzip();
        let all = self.decisions(&u, &v)?;
        Ok(all.iter().zip(sites).map(|(all, (mark, _))| all[mark.axis as usize]).collect())
    }

    /// The signatures on both sides of where each was found.
    fn sides(self, marks: &[Mark]) -> Result<Vec<[f64; 2]>, EvaluationError> {
        let before = self.signatures(marks.iter().map(|mark| (mark, mark.at.before)))?;
        let after = self.signatures(marks.iter().map(|mark| (mark, mark.at.after)))?;
        Ok(before.into_iter().zip(after).map(<[f64; 2]>::from).collect())
    }

    /// Where breaks that have moved are now.
    fn sought(self, moved: &[Mark]) -> Result<Vec<(Mark, Break)>, EvaluationError> {
        let brackets = self.bracketed(moved)?;
        // The last value of the lower side, and after it the first one of the upper side: mostly the next.
        let lower = self.bisected(brackets.clone(), 0)?;
        let rest = brackets.iter().zip(&lower).map(|(bracket, lower)| Bracket { low: lower.low, ..*bracket });
        let upper = self.bisected(rest.collect(), 1)?;
        let at = |(lower, upper): (&Bracket, &Bracket)| {
            let mark = lower.mark;
            (mark, Break { before: lower.low, after: upper.high, ..mark.at })
        };
        Ok(lower.iter().zip(&upper).map(at).collect())
    }

    /// Values on both sides of each break; those of which there are none are left out.
    fn bracketed(self, moved: &[Mark]) -> Result<Vec<Bracket>, EvaluationError> {
        let unknown = |mark: &Mark| Bracket { mark: *mark, low: f64::NAN, high: f64::NAN };
        let mut open: Vec<Bracket> = moved.iter().map(unknown).collect();
        let mut found = Vec::new();
        let mut reach = FIRST_REACH;
        while reach < 1.0 && !open.is_empty() {
            let low = |mark: &Mark| (mark.at.before - reach).max(FIRST_REACH);
            let high = |mark: &Mark| (mark.at.after + reach).min(1.0 - FIRST_REACH);
            let lows = self.signatures(open.iter().map(|b| (&b.mark, low(&b.mark))))?;
            let highs = self.signatures(open.iter().map(|b| (&b.mark, high(&b.mark))))?;
            for (bracket, here) in open.iter_mut().zip(lows.into_iter().zip(highs)) {
                let [before, after] = bracket.mark.signatures;
                if bracket.low.is_nan() && here.0 == before {
                    bracket.low = low(&bracket.mark);
                }
                if bracket.high.is_nan() && here.1 == after {
                    bracket.high = high(&bracket.mark);
                }
            }
            let is_closed = |b: &Bracket| b.low < b.high;
            found.extend(open.iter().filter(|b| is_closed(b)).copied());
            open.retain(|b| !is_closed(b));
            reach *= 2.0;
        }
        Ok(found)
    }

    /// The brackets halved until their ends are adjacent: of the last value of the lower side (0), or of the first one
    /// of the upper side (1).
    fn bisected(self, mut brackets: Vec<Bracket>, side: usize) -> Result<Vec<Bracket>, EvaluationError> {
        let middle = |b: &Bracket| b.low + (b.high - b.low) / 2.0;
        while brackets.iter().any(|b| b.low < middle(b) && middle(b) < b.high) {
            let signatures = self.signatures(brackets.iter().map(|b| (&b.mark, middle(b))))?;
            for (bracket, signature) in brackets.iter_mut().zip(signatures) {
                let middle = middle(bracket);
                let is_of_side = signature == bracket.mark.signatures[side];
                *(if is_of_side == (side == 0) { &mut bracket.low } else { &mut bracket.high }) = middle;
            }
        }
        Ok(brackets)
    }
}
