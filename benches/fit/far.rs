//! Simulated cups whose shape is far from the script's defaults, from which they are fitted: radius, height and
//! exponent anywhere in most of their bounds, turned and shifted at random. A fit counts where these three are found
//! and nearly all points are inliers.

use crate::coverage::{TRUTH, simulated};
use crate::matrix::turn;
use crate::{program, seconds};
use gml_runtime::fit::{FitOptions, fit};
use gml_runtime::progress::Silent;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

/// Positions of the exponent, the radius and the height, where they may be, and how near a fit must come.
const SHAPE: [(usize, f64, f64, f64); 3] = [(6, 0.5, 8.0, 0.1), (7, 20.0, 70.0, 0.5), (8, 45.0, 180.0, 0.5)];

/// Prints how many of so many cups are found.
pub(crate) fn run(cups: usize) {
    let program = program("examples/cup/cup.gml", BTreeMap::new());
    let (mut found, mut times, mut evaluations) = (0, Vec::new(), 0);
    for seed in 0..cups as u64 {
        let mut random = ChaCha8Rng::seed_from_u64(1000 + seed);
        let mut truth = TRUTH;
        for (i, low, high, _) in SHAPE {
            truth[i] = random.random_range(low..high);
        }
        let scan = turn(&simulated(&program, &truth, seed % 2 == 1, seed), &mut random);
        let result = fit(&program, &scan, &FitOptions::default(), &Silent).unwrap_or_else(|e| panic!("{e}"));
        times.push(seconds(&result));
        evaluations += result.evaluations;
        let near =
            |(i, _, _, allowed): &(usize, f64, f64, f64)| (result.parameters[*i].value - truth[*i]).abs() < *allowed;
        if SHAPE.iter().all(near) && result.inliers > 0.97 {
            found += 1;
        } else {
            println!("  {seed}: inliers {:.3}", result.inliers);
        }
    }
    println!("{found} of {cups}   median {:.2} s   {evaluations} evaluations", crate::median(&mut times));
}
