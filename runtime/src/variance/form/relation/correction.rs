//! What noise adds to the width of a relation: the distance of two axes is positive by noise alone. It is simulated
//! with the covariances of both surfaces.

use super::super::WithoutNoise;
use super::super::associated::Associated;
use super::super::datum::Datum;
use super::super::linear::MOST;
use crate::eigen;
use crate::spread::mean_and_sd;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Simulations, by which scatter is known to 4 %. The correction of each is computed by all of them.
const ROUNDS: usize = 300;

/// The errors of the surfaces of two parts by noise.
pub(super) struct Noise<'a> {
    parts: [&'a Associated; 2],
    seed: u64,
}

impl<'a> Noise<'a> {
    pub(super) fn new(parts: [&'a Associated; 2], seed: u64) -> Self {
        Self { parts, seed }
    }

    /// By round, what the errors of both surfaces add to some vectors of them.
    pub(super) fn errors(&self, vectors: impl Fn(&Datum, &Datum) -> Vec<DVec3>) -> Vec<Vec<DVec3>> {
        let roots = self.parts.map(|part| root(part.covariance.clone()));
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let plain = vectors(&self.parts[0].measured, &self.parts[1].measured);
        let mut round = || {
            let [datum, part] = [0, 1].map(|k| {
                let root = &roots[k];
                let drawn = root * DVector::<f64>::from_fn(root.ncols(), |_, _| StandardNormal.sample(&mut random));
                let by: [f64; MOST] = std::array::from_fn(|i| drawn.get(i).copied().unwrap_or(0.0));
                self.parts[k].measured.moved(&by)
            });
            vectors(&datum, &part).iter().zip(&plain).map(|(with, without)| *with - *without).collect()
        };
        (0..ROUNDS).map(|_| round()).collect()
    }
}

/// A matrix whose product with its transpose is a covariance, which may be singular: without noise it is zero.
fn root(covariance: DMatrix<f64>) -> DMatrix<f64> {
    let eigen = eigen::symmetric(covariance);
    let lengths = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
    eigen.eigenvectors * DMatrix::from_diagonal(&lengths)
}

/// The width of vectors without the part that noise adds to it. As for forms, vectors without noise are taken to be the
/// present ones, all smaller by one factor, so that the square of their width lacks what noise has on average; noise on
/// top of them says how much wider it makes them. The uncertainty is the root mean square error of that, by the same
/// noise.
pub(super) fn corrected(vectors: &[DVec3], errors: &[Vec<DVec3>], size: impl Fn(&[DVec3]) -> f64) -> WithoutNoise {
    let alone: Vec<f64> = errors.iter().map(|e| size(e)).collect();
    let square = alone.iter().map(|width| width * width).sum::<f64>() / alone.len().max(1) as f64;
    let with = |vectors: &[DVec3], error: &[DVec3]| vectors.iter().zip(error).map(|(v, e)| *v + *e).collect::<Vec<_>>();
    let plain = |vectors: &[DVec3]| -> Vec<DVec3> {
        let width = size(vectors);
        let shrunk = (1.0 - square / (width * width).max(f64::MIN_POSITIVE)).max(0.0).sqrt();
        vectors.iter().map(|v| shrunk * *v).collect()
    };
    let correct = |vectors: &[DVec3]| {
        let plain = plain(vectors);
        let (widened, _) = mean_and_sd(&errors.iter().map(|e| size(&with(&plain, e))).collect::<Vec<f64>>());
        (size(vectors) - (widened - size(&plain)).max(0.0)).max(0.0)
    };
    let truth = plain(vectors);
    let wrong = |error: &Vec<DVec3>| correct(&with(&truth, error)) - size(&truth);
    let squares: f64 = errors.iter().map(|error| wrong(error).powi(2)).sum();
    WithoutNoise {
        noise_alone: mean_and_sd(&alone).0,
        corrected: correct(vectors),
        uncertainty: (squares / errors.len().max(1) as f64).sqrt(),
    }
}
