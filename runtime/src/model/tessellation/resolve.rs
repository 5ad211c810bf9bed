//! Steps no longer than creases across u and v are apart, where the even grid leaves the surface: a triangle over many
//! creases is cut at one of them after the other, and what becomes of it is crumpled.

use super::grade::{departs, place};
use super::intervals::{Axes, Interval};
use super::piece::scattered;
use super::{EvaluationError, MOST_OBLIQUE};
use crate::model::Instance;
use crate::model::breaks::Patch;
use glam::DVec2;

/// Places at which the grid is compared with the surface.
const PLACES: u32 = 2_000;
/// The part of the chord by which it may leave the surface; beyond it refinement divides beside creases.
const KEPT: f64 = 0.85;
/// Lines of each parameter along which creases are counted, and places along a line.
const LINES: u32 = 9;
const ALONG: usize = 2_048;

/// Divides the intervals of a patch with creases across u and v into as many steps as lines along them cross creases,
/// where the grid leaves the surface by more than the chord.
///
/// # Errors
/// The surface cannot be evaluated.
pub(super) fn resolve(
    instance: &dyn Instance,
    patch: usize,
    axes: &mut Axes,
    chord: f64,
) -> Result<(), EvaluationError> {
    let places: Vec<_> = (1..=PLACES).map(|k| place(DVec2::from_array(scattered(f64::from(k), [0.0; 2])))).collect();
    if !departs(instance, patch, axes, &places, KEPT * chord)? {
        return Ok(());
    }
    let mut steps = [crossings(instance, patch, &axes[0], 0)?, crossings(instance, patch, &axes[1], 1)?];
    let total = |steps: &[usize], axis: &[Interval]| {
        steps.iter().zip(axis).map(|(steps, interval)| (*steps).max(interval.segments()) as f64).sum::<f64>()
    };
    // The creases of a patch may be everywhere.
    let share = (MOST_OBLIQUE as f64 / (2.0 * total(&steps[0], &axes[0]) * total(&steps[1], &axes[1]))).sqrt();
    for (axis, steps) in axes.iter_mut().zip(&mut steps) {
        for (interval, steps) in axis.iter_mut().zip(steps) {
            let steps = if share < 1.0 { (*steps as f64 * share) as usize } else { *steps };
            if steps > interval.segments() {
                interval.divide(steps);
            }
        }
    }
    Ok(())
}

/// How many creases lines along u (0) or v (1) cross in every interval, at most.
fn crossings(
    instance: &dyn Instance,
    patch: usize,
    axis: &[Interval],
    along: usize,
) -> Result<Vec<usize>, EvaluationError> {
    let mut most = vec![0; axis.len()];
    let places: Vec<Vec<f64>> = axis
        .iter()
        .map(|interval| {
            let count = ((interval.end() - interval.start()) * ALONG as f64).ceil().max(2.0) as usize;
            (0..count).map(|k| interval.fraction((k as f64 + 0.5) / count as f64)).collect()
        })
        .collect();
    for line in 1..=LINES {
        let across = scattered(f64::from(line), [0.0; 2])[0];
        for (most, places) in most.iter_mut().zip(&places) {
            let lines = vec![across; places.len()];
            let (u, v) = if along == 0 { (places, &lines) } else { (&lines, places) };
            let signatures = Patch { instance, patch }.oblique_signatures(u, v)?;
            let changes = signatures.windows(2).filter(|w| w[0].to_bits() != w[1].to_bits()).count();
            *most = (*most).max(changes);
        }
    }
    Ok(most)
}
