//! The smooth pieces of a patch: the stretches of u and of v between its breaks.

use crate::model::{Break, BreakKind, Breaks, spans};

/// A stretch of u or of v on which a patch is smooth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stretch {
    pub(crate) start: f64,
    pub(crate) end: f64,
    /// Whether the surface jumps between the stretch before and this one.
    pub(super) after_step: bool,
    /// Whether the patch closes and has no breaks along this parameter, so that steps cross the seam.
    pub(super) wraps: bool,
}

/// How a patch's parameters are divided.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Domain {
    /// Whether the patch closes in u, and in v.
    pub(super) closed: [bool; 2],
    /// Of u and of v, ascending, at least one.
    stretches: [Vec<Stretch>; 2],
}

/// Foot points so close to a break lie on it.
const ON_BREAK: f64 = 1e-12;

impl Domain {
    /// The domain of a patch with certain breaks, which is not closed as far as is known.
    pub(crate) fn new(breaks: &Breaks) -> Self {
        Self { closed: [false; 2], stretches: [&breaks.u, &breaks.v].map(|breaks| stretches(breaks)) }
    }

    /// The same of a patch that closes in u, or in v.
    pub(super) fn closing(mut self, closed: [bool; 2]) -> Self {
        self.closed = closed;
        for (stretches, closed) in self.stretches.iter_mut().zip(closed) {
            let alone = stretches.len() == 1;
            stretches.iter_mut().for_each(|s| s.wraps = closed && alone);
        }
        self
    }

    /// The same where the breaks, as many, are elsewhere.
    pub(super) fn moved(&self, breaks: &Breaks) -> Self {
        Self::new(breaks).closing(self.closed)
    }

    /// The stretches of u (0) or of v (1).
    pub(super) fn along(&self, k: usize) -> &[Stretch] {
        &self.stretches[k]
    }

    /// The stretches of u and of v that are numbered so.
    pub(super) fn pieces(&self, numbers: [u16; 2]) -> [Stretch; 2] {
        [0, 1].map(|k| self.stretches[k][usize::from(numbers[k])])
    }

    /// The numbers of the stretches of a place.
    pub(super) fn numbers(&self, uv: [f64; 2]) -> [u16; 2] {
        [0, 1].map(|k| {
            let before = self.stretches[k].partition_point(|s| s.end < uv[k]);
            before.min(self.stretches[k].len() - 1) as u16
        })
    }

    /// Whether there is another stretch beyond a place that lies at an end of stretch `number` of u or of v: upwards,
    /// or downwards. Returns its number, and the place's parameter in it.
    pub(super) fn across(&self, k: usize, number: u16, up: bool, t: f64) -> Option<(u16, f64)> {
        let (all, number) = (&self.stretches[k], usize::from(number));
        let here = all[number];
        if all.len() == 1 || (t - if up { here.end } else { here.start }).abs() > ON_BREAK {
            return None;
        }
        let last = all.len() - 1;
        let next = match (up, self.closed[k]) {
            (true, true) if number == last => 0,
            (false, true) if number == 0 => last,
            (true, _) if number < last => number + 1,
            (false, _) if number > 0 => number - 1,
            _ => return None,
        };
        Some((next as u16, if up { all[next].start } else { all[next].end }))
    }
}

impl Default for Stretch {
    fn default() -> Self {
        Self { start: 0.0, end: 1.0, after_step: false, wraps: false }
    }
}

impl Stretch {
    /// The nearest value inside.
    pub(super) fn clamp(&self, t: f64) -> f64 {
        t.clamp(self.start, self.end)
    }
}

/// The stretches between breaks; one alone where there are more than numbers for them.
fn stretches(breaks: &[Break]) -> Vec<Stretch> {
    if breaks.len() >= usize::from(u16::MAX) {
        return vec![Stretch::default()];
    }
    let after_step = std::iter::once(false).chain(breaks.iter().map(|b| b.kind == BreakKind::Step));
    let spans = spans(breaks.iter().map(|b| (b.before, b.after))).zip(after_step);
    spans.map(|((start, end), after_step)| Stretch { start, end, after_step, wraps: false }).collect()
}
