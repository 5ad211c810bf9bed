//! Faces of thin walls that a scan without sides cannot tell apart: where noise reaches from one face to the other, a
//! point belongs to the nearest one, right or wrong, and the fit settles between walls as they are and as thick as the
//! noise. No standard deviation knows of that.

use super::schedule::Solution;
use crate::fit::problem::objective::{Chunk, Correspondence, Objective, Placed};
use crate::fit::tuning::{FACING_POINTS, MIXED_OPPOSITE, MIXED_REACH, MIXED_SHARE};
use crate::robust::median;
use rayon::prelude::*;

/// Patches whose points may as well be another patch's, behind them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mixed {
    /// Positions of the patches.
    pub(crate) patches: Vec<usize>,
    /// Median distance of the faces. Millimetres.
    pub(crate) distance: f64,
    /// The scan's noise, or the root mean square of the residuals if that is more. Millimetres.
    pub(crate) noise: f64,
}

/// A point with the face behind its own, within reach or not.
struct Behind {
    patch: usize,
    /// Distance of the two faces where there is another one. Millimetres.
    distance: Option<f64>,
}

/// The mixed patches among those whose sides the scan does not tell. None where there are none, or no model.
pub(crate) fn find(solution: &Solution) -> Option<Mixed> {
    if solution.signs.iter().all(|sign| *sign != 0) {
        return None;
    }
    let objective = solution.objective(&solution.level.problem.thin);
    let placed = objective.place(&solution.estimate).ok()?;
    // A fit that has given the points to the wrong faces leaves less than the noise.
    let noise = solution.evaluation.rms().max(solution.level.problem.scan.noise);
    let reach = MIXED_REACH * noise;
    let chunks = objective.chunks(None).into_par_iter();
    let points: Vec<Behind> =
        chunks.flat_map_iter(|mut chunk| of_chunk(solution, &objective, &placed, &mut chunk, reach)).collect();
    let mut counts = vec![(0.0, 0.0); solution.signs.len()];
    for Behind { patch, distance } in &points {
        counts[*patch].0 += 1.0;
        counts[*patch].1 += f64::from(u8::from(distance.is_some()));
    }
    let is_mixed =
        |patch: &usize| counts[*patch].0 >= FACING_POINTS && counts[*patch].1 > MIXED_SHARE * counts[*patch].0;
    let patches: Vec<usize> = (0..counts.len()).filter(is_mixed).collect();
    let of_mixed = points.iter().filter(|point| patches.contains(&point.patch));
    let distance = median(&mut of_mixed.filter_map(|point| point.distance).collect::<Vec<f64>>())?;
    Some(Mixed { patches, distance, noise })
}

fn of_chunk(solution: &Solution, objective: &Objective, placed: &Placed, chunk: &mut Chunk, reach: f64) -> Vec<Behind> {
    let nearest = objective.correspondences(placed, chunk);
    let (mut own, mut others) = (Vec::new(), Vec::new());
    for matched in objective.with_feet(placed, &nearest) {
        if solution.signs[matched.patch] != 0 {
            continue;
        }
        for (point, foot) in matched.points.iter().zip(&matched.feet) {
            if solution.loss.value(foot.d2) >= 0.5 {
                continue;
            }
            own.push((point.index, matched.patch, *foot));
            others.extend(objective.elsewhere(placed, point, foot.d2.sqrt() + reach));
        }
    }
    own.sort_by_key(|(index, ..)| *index);
    others.sort_by_key(|other: &Correspondence| other.patch);
    let mut behind: Vec<Behind> = own.iter().map(|(_, patch, _)| Behind { patch: *patch, distance: None }).collect();
    for matched in objective.with_feet(placed, &others) {
        for (point, other) in matched.points.iter().zip(&matched.feet) {
            let Ok(place) = own.binary_search_by_key(&point.index, |(index, ..)| *index) else { continue };
            let (_, _, foot) = own[place];
            let (across, along) = (other.point - foot.point, foot.normal.normalize_or_zero());
            // Neither a part beside it, about an edge, nor the patch's continuation.
            let opposite = across.dot(along).abs() > MIXED_OPPOSITE * across.length()
                && along.dot(other.normal.normalize_or_zero()).abs() > MIXED_OPPOSITE;
            if opposite && across.length() < reach {
                behind[place].distance = Some(across.length());
            }
        }
    }
    behind
}
