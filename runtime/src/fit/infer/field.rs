//! Residuals that depend on each other over no small part of the scan: the waves of a scanner, or a shape that the
//! model does not have. Blocks of space of that size are few, and much of such waves is in the estimate itself and not
//! in the residuals, so that sums over blocks say too little of them.
//!
//! They are taken for a random field: the residuals of some points, spread over the scan, have the covariance s^2 ((1 -
//! q) I + q K), where K falls with the distance of two points of one patch over a length L. The three follow by
//! restricted likelihood, which knows what the fit has taken up (Patterson and Thompson 1971); what a field does to the
//! estimate then is A (sum_ij w_i J_i s^2 q K_ij J_j w_j) A. Each field counts by how likely it is, and all of them by
//! how much likelier they are than independent residuals: which one is likeliest, and whether it is clearly so, depends
//! on the sample, and standard deviations must not.

use super::cholesky::lower_factor;
use super::sandwich::{Uncertainty, at_least};
use crate::fit::problem::objective::Objective;
use crate::fit::problem::rows::{AllRows, RowPoint, Rows};
use crate::fit::refine::schedule::Solution;
use crate::fit::tuning::{
    FIELD_BLOCKS, FIELD_CLEAR, FIELD_POINTS, FIELD_SAMPLES, FIELD_SHARES, FIELD_STEP, FIELD_TOLD,
};
use glam::DVec3;
use gml_compiler::number::plain;
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

/// What is added to the diagonal of covariances, relative to it: above the rounding of their factors.
const RIDGE: f64 = 1e-9;
/// What is less probable does not count.
const UNLIKELY: f64 = 1e-3;

/// The uncertainty with that of a field, where blocks of residuals are no small part of the scan.
pub(crate) fn include(solution: &Solution, uncertainty: Uncertainty) -> Uncertainty {
    let problem = solution.level.problem;
    let wide = uncertainty.blocks.is_some_and(|blocks| blocks.edge >= FIELD_BLOCKS * problem.radius);
    let Some((fields, response)) = wide.then(|| respond(solution, &uncertainty)).flatten() else { return uncertainty };
    let mut covariance = uncertainty.covariance.clone();
    let share: f64 = fields.iter().map(|f| f.weight * f.share).sum();
    at_least(&mut covariance, &(response + &uncertainty.naive * (1.0 - share)));
    let determined = (0..covariance.nrows()).filter(|k| uncertainty.determines(*k));
    let raised = determined.map(|k| covariance[(k, k)] / uncertainty.covariance[(k, k)].max(f64::MIN_POSITIVE));
    let factor = raised.fold(1.0, f64::max).sqrt();
    let likeliest = fields.iter().max_by(|a, b| a.weight.total_cmp(&b.weight));
    if let Some(field) = likeliest.filter(|_| factor > FIELD_TOLD) {
        let height = plain(format!("{:.1e}", (field.variance * field.share).sqrt()).parse().unwrap_or(0.0));
        problem.monitor.warn(format!(
            "the residuals have waves {height} mm high (root mean square), alike over some {:.0} mm of a scan that is {:.0} mm across, and the fit takes up a part of them. Standard deviations allow for that, and are up to {factor:.1} times what the residuals show; they do not allow for a shape that the model does not have",
            field.length,
            problem.scan.mesh.bounds().diagonal(),
        ));
    }
    Uncertainty { covariance, ..uncertainty }
}

/// The fields that the residuals may be, and the covariance that they give the estimate.
fn respond(solution: &Solution, uncertainty: &Uncertainty) -> Option<(Vec<Field>, DMatrix<f64>)> {
    let samples = Sample::all(solution);
    let fields = fields(&samples)?;
    let of_sample = |sample: &Sample| -> DMatrix<f64> {
        let weighted = DMatrix::from_fn(sample.rows.nrows(), sample.rows.ncols(), |i, k| {
            sample.weights[i] * sample.factor * sample.rows[(i, k)]
        });
        let of = |field: &Field| {
            let pull = weighted.tr_mul(&(sample.correlations(field.kernel, field.length) * &weighted));
            pull * (field.weight * field.variance * field.share / samples.len() as f64)
        };
        fields.par_iter().map(of).reduce(|| DMatrix::zeros(weighted.ncols(), weighted.ncols()), |a, b| a + b)
    };
    let pull = samples.iter().map(of_sample).sum::<DMatrix<f64>>();
    Some((fields, &uncertainty.inverse * pull * &uncertainty.inverse))
}

/// How correlations fall with the distance: as the likelihood has it. A smooth one, as of waves, and a rough one.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kernel {
    /// exp(-d^2 / (2 L^2)).
    Gaussian,
    /// exp(-d / L).
    Exponential,
}

#[derive(Clone, Copy, Debug)]
struct Field {
    kernel: Kernel,
    /// L. Millimetres.
    length: f64,
    /// The share q of the variance, and the variance s^2 in all. Square millimetres.
    share: f64,
    variance: f64,
    /// The logarithm of the restricted likelihood, the mean over the samples.
    likelihood: f64,
    /// The probability that it is this one.
    weight: f64,
}

/// Some points near the model, evenly of all.
struct Sample {
    /// The foot, in the scan's frame, and the patch. (Of the points themselves the distance from the model is a smooth
    /// function of the place: noise would be a field.)
    places: Vec<(DVec3, u32)>,
    /// Signed distances from the model. Millimetres.
    distances: DVector<f64>,
    weights: Vec<f64>,
    /// J by the local coordinates.
    rows: DMatrix<f64>,
    /// Columns of the coordinates that have an influence, those at bounds included: what is left for a bound is no
    /// wave.
    fitted: Vec<usize>,
    /// The sum of the weights of all points near the model over that of these.
    factor: f64,
}

/// A point of the sample.
struct Chosen {
    place: (DVec3, u32),
    point: RowPoint,
    row: Vec<f64>,
}

impl Sample {
    /// Samples that have no point in common. None of them has fewer points than a field can be told from.
    fn all(solution: &Solution) -> Vec<Self> {
        let step = solution.level.problem.points.len().div_ceil(FIELD_POINTS).max(1);
        (0..step.min(FIELD_SAMPLES)).filter_map(|first| Self::of(solution, first, step)).collect()
    }

    /// Every so many points from the `first` on.
    fn of(solution: &Solution, first: usize, step: usize) -> Option<Self> {
        let Solution { level, estimate, cache, .. } = solution;
        let points = &level.problem.points;
        let objective = Objective { cache: Some(cache.clone()), ..solution.objective(points) };
        let all = AllRows::new(&objective, estimate)?;
        let chain = level.space.chain(estimate);
        let turn = estimate.motion.rotation;
        let mut sum = 0.0;
        let mut chosen: Vec<Chosen> = Vec::new();
        let add = |part: &mut (f64, Vec<_>), rows: &Rows| {
            for (point, row) in rows.iter().filter(|(point, _)| point.weight > 0.5 * point.prior) {
                part.0 += point.weight;
                if point.index as usize % step == first {
                    let mut full = vec![0.0; chain.nrows()];
                    rows.columns.iter().zip(row).for_each(|(k, slope)| full[*k] = *slope);
                    let foot = points.position[point.index as usize] - turn * point.away * point.distance;
                    part.1.push(Chosen { place: (foot, rows.patch), point: *point, row: full });
                }
            }
        };
        all.fold(
            || (0.0, Vec::new()),
            add,
            |(weight, part)| {
                sum += weight;
                chosen.extend(part);
            },
        );
        let of_sample: f64 = chosen.iter().map(|c| c.point.weight).sum();
        let slopes = DMatrix::from_fn(chosen.len(), chain.nrows(), |i, k| chosen[i].row[k]);
        let rows = slopes * chain;
        let fitted: Vec<usize> = (0..rows.ncols()).filter(|k| rows.column(*k).amax() > 0.0).collect();
        (chosen.len() > 4 * fitted.len()).then(|| Self {
            places: chosen.iter().map(|c| c.place).collect(),
            distances: DVector::from_iterator(chosen.len(), chosen.iter().map(|c| c.point.distance)),
            weights: chosen.iter().map(|c| c.point.weight).collect(),
            rows,
            fitted,
            factor: sum / of_sample,
        })
    }

    /// The mean distance from a point to the nearest other one. Millimetres.
    fn spacing(&self) -> f64 {
        let nearest = |(p, _): &(DVec3, u32)| {
            let others = self.places.iter().map(|(q, _)| p.distance_squared(*q)).filter(|d2| *d2 > 0.0);
            others.fold(f64::INFINITY, f64::min).sqrt()
        };
        self.places.iter().map(nearest).sum::<f64>() / self.places.len() as f64
    }

    fn correlations(&self, kernel: Kernel, length: f64) -> DMatrix<f64> {
        DMatrix::from_fn(self.places.len(), self.places.len(), |i, j| {
            let ((p, a), (q, b)) = (self.places[i], self.places[j]);
            let d2 = p.distance_squared(q) / (length * length);
            match kernel {
                _ if a != b => 0.0,
                Kernel::Gaussian => (-0.5 * d2).exp(),
                Kernel::Exponential => (-d2.sqrt()).exp(),
            }
        })
    }

    /// The columns that the fit has taken up, of one length each.
    fn columns(&self) -> DMatrix<f64> {
        let columns = self.rows.select_columns(&self.fitted);
        let norms: Vec<f64> = columns.column_iter().map(|c| c.norm().max(f64::MIN_POSITIVE)).collect();
        DMatrix::from_fn(columns.nrows(), columns.ncols(), |i, k| columns[(i, k)] / norms[k])
    }
}

/// Fields that the samples may be of, with their probabilities; that none is has what is left. None where that is all
/// but certain, or where the likeliest is as short as the points are apart.
fn fields(samples: &[Sample]) -> Option<Vec<Field>> {
    let first = samples.first()?;
    let shortest = FIELD_STEP * first.spacing();
    let widest = first.places.iter().map(|(p, _)| p.distance(first.places[0].0)).fold(0.0, f64::max);
    let lengths = std::iter::successors(Some(shortest), |length| Some(FIELD_STEP * length));
    let lengths = lengths.take_while(|length| *length < widest);
    let tried: Vec<(Kernel, f64)> =
        lengths.flat_map(|length| [(Kernel::Gaussian, length), (Kernel::Exponential, length)]).collect();
    let columns: Vec<DMatrix<f64>> = samples.iter().map(Sample::columns).collect();
    let count = samples.len() as f64;
    let of = |(kernel, length): &(Kernel, f64)| -> Vec<Field> {
        let correlations: Vec<DMatrix<f64>> = samples.iter().map(|s| s.correlations(*kernel, *length)).collect();
        let with = |share: &f64| {
            let mut field =
                Field { kernel: *kernel, length: *length, share: *share, variance: 0.0, likelihood: 0.0, weight: 0.0 };
            for ((sample, correlations), columns) in samples.iter().zip(&correlations).zip(&columns) {
                let (likelihood, variance) = restricted(correlations, *share, columns, &sample.distances)?;
                field.likelihood += likelihood / count;
                field.variance += variance / count;
            }
            Some(field)
        };
        FIELD_SHARES.iter().filter_map(with).collect()
    };
    let mut fields: Vec<Field> = tried.par_iter().flat_map_iter(of).collect();
    let mut independent = 0.0;
    for (sample, columns) in samples.iter().zip(&columns) {
        let none = DMatrix::zeros(sample.places.len(), sample.places.len());
        independent += restricted(&none, 0.0, columns, &sample.distances)?.0 / count;
    }
    let best = fields.iter().copied().max_by(|a, b| a.likelihood.total_cmp(&b.likelihood))?;
    let probability = 1.0 / (1.0 + (independent + FIELD_CLEAR - best.likelihood).exp());
    if probability < UNLIKELY || best.length <= shortest {
        return None;
    }
    fields.retain(|field| field.likelihood > best.likelihood + UNLIKELY.ln());
    let all: f64 = fields.iter().map(|field| (field.likelihood - best.likelihood).exp()).sum();
    for field in &mut fields {
        field.weight = probability * (field.likelihood - best.likelihood).exp() / all;
    }
    Some(fields)
}

/// The logarithm of the restricted likelihood of residuals with the covariance s^2 ((1 - q) I + q K), after a linear
/// fit of some columns, and the likeliest s^2.
fn restricted(
    correlations: &DMatrix<f64>,
    share: f64,
    columns: &DMatrix<f64>,
    residuals: &DVector<f64>,
) -> Option<(f64, f64)> {
    let mut covariance = correlations * share;
    covariance.fill_diagonal(1.0 + RIDGE);
    let lower = lower_factor(covariance)?;
    let columns = lower.solve_lower_triangular(columns)?;
    let residuals = lower.solve_lower_triangular(residuals)?;
    let mut normal = columns.tr_mul(&columns);
    normal.set_diagonal(&normal.diagonal().add_scalar(RIDGE * normal.diagonal().amax()));
    let normal = Cholesky::new(normal)?;
    let pull = columns.tr_mul(&residuals);
    let left = residuals.norm_squared() - pull.dot(&normal.solve(&pull));
    let degrees = (residuals.len() - columns.ncols()) as f64;
    let variance = left / degrees;
    let log = |lower: &DMatrix<f64>| lower.diagonal().iter().map(|d| d.ln()).sum::<f64>();
    let likelihood = -0.5 * degrees * variance.ln() - log(&lower) - log(normal.l_dirty());
    (variance > 0.0 && likelihood.is_finite()).then_some((likelihood, variance))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// The mean of what lies on a square of 60 mm: white noise, and a field of which the square holds some five
    /// lengths.
    #[test]
    fn the_error_of_a_mean_is_that_of_the_field_which_its_residuals_show() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let count = 200;
        let mut place = || DVec3::new(random.random_range(0.0..60.0), random.random_range(0.0..60.0), 0.0);
        let places: Vec<(DVec3, u32)> = (0..count).map(|_| (place(), 0)).collect();
        let mut sample = Sample {
            places,
            distances: DVector::zeros(count),
            weights: vec![1.0; count],
            rows: DMatrix::from_element(count, 1, 1.0),
            fitted: vec![0],
            factor: 1.0,
        };
        let (share, length) = (0.8, 12.0);
        let correlations = sample.correlations(Kernel::Gaussian, length);
        let expected = share * correlations.mean();
        let covariance = correlations * share + DMatrix::identity(count, count) * (1.0 - share);
        let lower = covariance.cholesky().unwrap().unpack();
        let (mut of_means, mut said, mut draws) = (0.0, 0.0, 0.0);
        for _ in 0..12 {
            let white = DVector::from_fn(count, |_, _| StandardNormal.sample(&mut random));
            let drawn = &lower * white;
            let off = drawn.mean();
            sample.distances = drawn.add_scalar(-off);
            let fields = fields(std::slice::from_ref(&sample)).expect("it is no white noise");
            let mean = |f: &Field| f.weight * f.variance * f.share * sample.correlations(f.kernel, f.length).mean();
            let of_mean: f64 = fields.iter().map(mean).sum();
            assert!((0.3..4.0).contains(&(of_mean / expected)), "{of_mean} for {expected}: {fields:?}");
            (of_means, said, draws) = (of_means + off * off, said + of_mean, draws + 1.0);
        }
        // The mean of so many squares is known to 40 %, that of what is said to some 15 %.
        assert!((said / draws / expected - 1.0).abs() < 0.4, "{} for {expected}", said / draws);
        assert!((of_means / draws / expected - 1.0).abs() < 1.0, "{} for {expected}", of_means / draws);
    }

    #[test]
    fn white_noise_is_no_field() {
        let mut random = ChaCha8Rng::seed_from_u64(8);
        let count = 200;
        let mut place = || DVec3::new(random.random_range(0.0..60.0), random.random_range(0.0..60.0), 0.0);
        let places: Vec<(DVec3, u32)> = (0..count).map(|_| (place(), 0)).collect();
        for _ in 0..8 {
            let distances = DVector::from_fn(count, |_, _| StandardNormal.sample(&mut random));
            let (rows, weights) = (DMatrix::from_element(count, 1, 1.0), vec![1.0; count]);
            let sample = Sample { places: places.clone(), distances, weights, rows, fitted: vec![0], factor: 1.0 };
            let probable: f64 = fields(&[sample]).iter().flatten().map(|field| field.weight).sum();
            assert!(probable < 0.02, "{probable}");
        }
    }
}
