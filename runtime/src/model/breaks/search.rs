//! The search for the places at which decisions change.

use super::{Axis, Gap, Gaps, Patch, spans};
use gml_compiler::program::EvaluationError;
use std::collections::HashSet;

/// Samples of a parameter on each line. Two changes between neighbouring samples that undo each other are not seen.
const SAMPLES: usize = 2048;

/// The same on lines that are added: what they show is a surface within strips.
const SAMPLES_ADDED: usize = 512;

/// Values of the other parameter of the first lines. They are scattered, so that symmetric surfaces show all.
pub(super) const LINES: [f64; 5] = [0.0711, 0.2823, 0.4936, 0.7049, 0.9161];

/// Most lines that are added, for intervals of the other parameter that have none.
const MOST_LINES: usize = 64;

/// Rounds of added lines: changes that are found on some lines of u give lines of v, and so on.
const ROUNDS: usize = 3;

/// Most intervals that are bisected at once. Beyond, not all changes within an interval are found.
const MOST_OPEN: usize = 4096;

/// Most intervals on a line in which decisions change. A surface of so many pieces is not one of pieces: it is treated
/// as one that breaks anywhere. (What is done with pieces grows with their square: `gmlc check` took 5 s for 1,600 of
/// them, with a hundred sines at every point.)
const MOST_CHANGES: usize = 1_000;

/// Gaps that are closer than this are one: they are the ends of a piece without length, such as the arc of a corner
/// that is rounded with a radius of 0. Nor is there a break so close to 0 or 1.
const CLOSE: f64 = 1e-9;

/// The places at which the decisions of u, and those of v, change; and whether there are too many of one of them to be
/// told, which then has none.
pub(super) fn gaps(patch: Patch<'_>) -> Result<(Gaps, bool), EvaluationError> {
    let mut gaps = Gaps::default();
    let mut uncounted = [false; 2];
    let mut lines: [Vec<f64>; 2] = [LINES.to_vec(), LINES.to_vec()];
    let mut new = lines.clone();
    for round in 0..ROUNDS {
        let samples = if round == 0 { SAMPLES } else { SAMPLES_ADDED };
        for axis in [Axis::U, Axis::V] {
            let own = axis as usize;
            if new[own].is_empty() || uncounted[own] {
                continue;
            }
            let known = std::mem::take(&mut gaps[own]);
            let found = changes(patch, axis, &new[own], samples)?.map(|found| merged(known, found));
            let found = found.filter(|all| all.len() <= MOST_CHANGES);
            uncounted[own] = found.is_none();
            gaps[own] = found.unwrap_or_default();
        }
        for axis in [Axis::U, Axis::V] {
            let own = axis as usize;
            new[own] = missing(&gaps[axis.other() as usize], &lines[own]);
            lines[own].extend(&new[own]);
        }
        if new.iter().all(Vec::is_empty) {
            break;
        }
    }
    Ok((gaps, uncounted != [false; 2]))
}

/// Values in the intervals between gaps in which there is no line yet.
fn missing(gaps: &[Gap], lines: &[f64]) -> Vec<f64> {
    let room = MOST_LINES.saturating_sub(lines.len());
    let spans = spans(gaps.iter().map(|g| (g.before, g.after)));
    let empty = spans.filter(|(start, end)| !lines.iter().any(|line| start < line && line < end));
    let empty: Vec<f64> = empty.map(|(start, end)| start + (end - start) * 0.382).collect();
    let every = empty.len().div_ceil(room.max(1)).max(1);
    empty.into_iter().step_by(every).take(room).collect()
}

/// An interval of one parameter, at a value of the other, at whose ends decisions differ.
#[derive(Clone, Copy)]
struct Open {
    low: f64,
    high: f64,
    /// The signatures at both ends.
    signatures: [f64; 2],
    line: f64,
}

impl Open {
    fn middle(&self) -> f64 {
        self.low + (self.high - self.low) / 2.0
    }

    /// Equal intervals of different lines have equal keys, if the decisions are equal.
    fn key(&self) -> [u64; 4] {
        [self.low, self.high, self.signatures[0], self.signatures[1]].map(f64::to_bits)
    }
}

/// The changes of the decisions of one parameter alone on lines at values of the other; none if there are too many on
/// one of them.
fn changes(patch: Patch<'_>, axis: Axis, lines: &[f64], samples: usize) -> Result<Option<Vec<Gap>>, EvaluationError> {
    let signatures = |along: &[f64], across: &[f64]| -> Result<Vec<f64>, EvaluationError> {
        let (u, v) = axis.uv(along, across);
        Ok(patch.decisions(u, v)?.into_iter().map(|all| all[axis as usize]).collect())
    };
    let sample = |k: usize| CLOSE + (1.0 - 2.0 * CLOSE) * (k as f64 / samples as f64);
    let samples: Vec<f64> = (0..=samples).map(sample).collect();
    let mut open = Vec::new();
    for line in lines {
        let signatures = signatures(&samples, &vec![*line; samples.len()])?;
        if signatures.windows(2).filter(|pair| pair[0] != pair[1]).count() > MOST_CHANGES {
            return Ok(None);
        }
        for (ends, signatures) in samples.windows(2).zip(signatures.windows(2)) {
            // Nearly all are equal.
            if signatures[0] != signatures[1] {
                let signatures = [signatures[0], signatures[1]];
                open.push(Open { low: ends[0], high: ends[1], signatures, line: *line });
            }
        }
    }
    let (mut found, mut known) = (Vec::new(), HashSet::new());
    while !open.is_empty() {
        open.retain(|o| o.signatures[0] != o.signatures[1] && known.insert(o.key()));
        let closed = |o: &Open| o.middle() <= o.low || o.middle() >= o.high;
        found.extend(open.iter().filter(|o| closed(o)).map(|o| Gap { before: o.low, after: o.high }));
        open.retain(|o| !closed(o));
        let (middles, lines): (Vec<f64>, Vec<f64>) = open.iter().map(|o| (o.middle(), o.line)).unzip();
        let mut halves = Vec::with_capacity(2 * open.len());
        for (o, (middle, signature)) in open.iter().zip(middles.iter().zip(signatures(&middles, &lines)?)) {
            let lower = Open { high: *middle, signatures: [o.signatures[0], signature], ..*o };
            let upper = Open { low: *middle, signatures: [signature, o.signatures[1]], ..*o };
            let changes = lower.signatures[0] != lower.signatures[1];
            halves.push(if changes { lower } else { upper });
            if changes && open.len() < MOST_OPEN {
                halves.push(upper);
            }
        }
        open = halves;
    }
    Ok(Some(found))
}

/// All gaps in order; those that are close are one.
fn merged(mut gaps: Vec<Gap>, more: Vec<Gap>) -> Vec<Gap> {
    gaps.extend(more);
    gaps.sort_by(|a, b| a.before.total_cmp(&b.before));
    gaps.dedup_by(|next, last| {
        let close = next.before - last.after <= CLOSE;
        if close {
            last.after = last.after.max(next.after);
        }
        close
    });
    gaps
}
