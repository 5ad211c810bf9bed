//! What noise adds to the width of a zone: a range grows with noise, and with the number of places that it is taken
//! over. It is simulated with the filter's own weights.

use super::filter::{Cells, Filter, Place};
use crate::spread::mean_and_sd;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Simulations, of which the mean of widths is known to a tenth of their scatter, but not more than so many values in
/// all: with many places widths scatter less.
const ROUNDS: usize = 40;
const VALUES: usize = 1_000_000;
const FEWEST_ROUNDS: usize = 8;

/// The cut-off of a short filter, in distances between the scan's points: it follows the surface where a usual one does
/// not, and still takes half of the noise.
const SHORT: f64 = 3.0;

/// Where a filter overshoots its values are held between those of the cells about them, without so many standard
/// deviations of their noise: of 20 to 300 cells on one level the farthest has 2 to 3 of them.
const FARTHEST: f64 = 1.5;

/// The noise of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::variance) struct ScanNoise {
    /// Standard deviation of a point along the normal. Millimetres.
    pub(in crate::variance) sd: f64,
    /// Points per square millimetre.
    pub(in crate::variance) density: f64,
}

impl ScanNoise {
    /// Points per square millimetre among so many texels: where there are fewer of these than points of the scan, they
    /// are what is averaged.
    pub(super) fn density_among(self, texels: usize, area: f64) -> f64 {
        self.density.min(texels as f64 / area)
    }
}

/// A width without what noise adds to it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WithoutNoise {
    /// The width that noise alone would have, behind the same filter. Millimetres.
    pub noise_alone: f64,
    /// The width without what noise adds to it. Millimetres.
    pub corrected: f64,
    /// Standard uncertainty of the corrected width: of the scatter by noise, and of the correction. Millimetres.
    pub uncertainty: f64,
}

/// Standard uncertainties from which on a width is clearly another one.
const CLEARLY: f64 = 2.0;

impl WithoutNoise {
    /// Whether the width is clearly more than another one. Millimetres.
    pub(in crate::variance) fn is_clearly_above(&self, width: f64) -> bool {
        self.corrected - CLEARLY * self.uncertainty > width
    }
}

/// Noise of a part's cells.
pub(super) struct Simulation {
    /// By round, the noise of each cell. Millimetres.
    noise: Vec<Vec<f64>>,
    /// By cell, the standard deviation of its noise. Millimetres.
    sds: Vec<f64>,
    /// The cut-off of the short filter, not more than that of the form. Millimetres.
    short: f64,
}

/// The spread of filtered values of cells about the curves or surfaces that fit them by least squares.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    /// The width that is asked for. Millimetres.
    pub(super) width: f64,
    /// Their mean square. Square millimetres.
    pub(super) mean_square: f64,
}

impl Simulation {
    /// Noise of cells that hold so many points (texels).
    pub(super) fn new(cells: &Cells, points: usize, noise: ScanNoise, cutoff: f64) -> Self {
        let density = noise.density_among(points, cells.areas.iter().sum());
        let (groups, areas) = about_points(cells, density);
        let sds: Vec<f64> = areas.iter().map(|area| noise.sd / (density * area).max(1.0).sqrt()).collect();
        let rounds = (VALUES / cells.areas.len().max(1)).clamp(FEWEST_ROUNDS, ROUNDS);
        let mut random = ChaCha8Rng::seed_from_u64(0);
        let mut round = || -> Vec<f64> {
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let noise: Vec<f64> = sds.iter().map(|sd| sd * normal()).collect();
            groups.iter().map(|k| noise[*k as usize]).collect()
        };
        let noise = (0..rounds).map(|_| round()).collect();
        let sds = groups.iter().map(|k| sds[*k as usize]).collect();
        Self { noise, sds, short: cutoff.min(SHORT / density.sqrt()) }
    }

    /// The filtered values of the cells at their own places. A filter of second order overshoots by a tenth of a step,
    /// and by a quarter between a step and a rim: if a value is beyond those of all cells that it has a share of, all
    /// are held between these.
    pub(super) fn held(&self, cells: &Cells, filter: &Filter) -> Vec<Option<f64>> {
        let range = |k: usize, noise: f64| {
            filter.weights[k].iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (cell, _)| {
                let (value, noise) = (cells.values[*cell as usize], noise * self.sds[*cell as usize]);
                [low.min(value + noise), high.max(value - noise)]
            })
        };
        let mut values = filter.apply(&cells.values);
        let overshoots = |(k, value): (usize, &Option<f64>)| {
            let [low, high] = range(k, 0.0);
            value.is_some_and(|value| value < low || value > high)
        };
        if values.par_iter().enumerate().any(overshoots) {
            values.par_iter_mut().enumerate().for_each(|(k, value)| {
                // Cells on one level have nothing between their bounds.
                let [low, high] = range(k, FARTHEST);
                *value = value.map(|value| if low < high { value.clamp(low, high) } else { value });
            });
        }
        values
    }

    /// By place, what a filter with a short cut-off gives beyond another one, and the standard deviation that this has
    /// by noise; none where one of both has no value.
    pub(super) fn unfollowed(&self, cells: &Cells, places: &[Place], filter: &Filter) -> Vec<Option<[f64; 2]>> {
        let short = Filter::new(cells, places, self.short);
        let of_place = |k: usize| {
            let difference = |values: &[f64]| Some(short.value(k, values)? - filter.value(k, values)?);
            let square: f64 = self.noise.iter().filter_map(|noise| difference(noise)).map(|d| d * d).sum();
            Some([difference(&cells.values)?, (square / self.noise.len() as f64).sqrt()])
        };
        (0..places.len()).into_par_iter().map(of_place).collect()
    }

    /// The width `found` without the part that noise adds to it. `spread` computes the spread of a list of the cells'
    /// values. The values without noise are taken to be the present ones, all smaller by one factor, so that their mean
    /// square lacks what noise adds to it; simulated noise on top of them says how much wider it makes them.
    pub(super) fn corrected(
        &self,
        found: f64,
        values: &[f64],
        spread: impl Fn(&[f64]) -> Option<Spread> + Sync,
    ) -> WithoutNoise {
        let alone: Vec<Spread> = self.noise.par_iter().filter_map(|noise| spread(noise)).collect();
        let of = |of: fn(&Spread) -> f64| mean_and_sd(&alone.iter().map(of).collect::<Vec<f64>>());
        let ((noise_alone, _), (square, scatter)) = (of(|s| s.width), of(|s| s.mean_square));
        let here = spread(values);
        // A mean square that noise alone reaches in one case of forty is no form.
        let shrunk = here.map_or(0.0, |s| (1.0 - (square + 2.0 * scatter) / s.mean_square).max(0.0).sqrt());
        let plain: Vec<f64> = values.iter().map(|value| shrunk * value).collect();
        let noisy = |noise: &Vec<f64>| spread(&plain.iter().zip(noise).map(|(p, n)| p + n).collect::<Vec<f64>>());
        let widened: Vec<f64> = self.noise.par_iter().filter_map(noisy).map(|s| s.width).collect();
        let narrower = (found / here.map_or(found, |s| s.width).max(f64::MIN_POSITIVE)).min(1.0);
        let (mean, scatter) = mean_and_sd(&widened);
        let added = narrower * (mean - spread(&plain).map_or(0.0, |s| s.width)).max(0.0);
        WithoutNoise {
            noise_alone: narrower * noise_alone,
            corrected: (found - added).max(0.0),
            // The correction lies between nothing and twice of it, uniformly (GUM 4.3.7).
            uncertainty: (narrower * scatter).hypot(added / 3.0_f64.sqrt()),
        }
    }
}

/// Cells in groups as wide as points of the scan are apart, which share their noise: by cell its group, and the groups'
/// areas.
fn about_points(cells: &Cells, density: f64) -> (Vec<u32>, Vec<f64>) {
    let mut groups: HashMap<[i64; 3], u32> = HashMap::new();
    let mut areas: Vec<f64> = Vec::new();
    let mut group = |(place, area): (&Place, &f64)| {
        let key = place.position.to_array().map(|x| (x * density.sqrt()).floor() as i64);
        let number = *groups.entry(key).or_insert_with(|| {
            areas.push(0.0);
            areas.len() as u32 - 1
        });
        areas[number as usize] += area;
        number
    };
    let of_cell = cells.places.iter().zip(&cells.areas).map(&mut group).collect();
    (of_cell, areas)
}
