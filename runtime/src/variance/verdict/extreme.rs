//! The worst of many places that were measured with noise.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Pairs of repeated measurements that are drawn. The mean over them has a standard deviation of less than a twentieth
/// of one measurement's noise.
const PAIRS: usize = 128;

/// The worst of several places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extreme {
    /// The place: the one whose value, with so many of its uncertainties added as are asked for, is the greatest.
    pub(super) place: usize,
    /// Its value as it was measured. Of many places that differ by less than the noise this is too large.
    pub(super) value: f64,
    /// The value that a second measurement would give, on average, of the place that one with noise calls the worst.
    pub(super) again: f64,
}

/// The greatest of values plus `guard` times their uncertainties `sd`, with normal noise of known standard deviations
/// `noise` (without what is common to all of them); none if there are no values.
///
/// The place that looks worst owes some of it to noise, so that its value is not to be compared with a limit as if the
/// place had been chosen beforehand. With x = y + e and x' = y - e, where e is drawn with the noise of y, x and x' are
/// two independent measurements of the same place, of twice the variance: x selects the place, x' is its value (Leiner,
/// Duan, Wasserman and Ramdas, 'Data fission: splitting a single data point', 2023). The mean of x' over many draws is
/// `again`, but not less than the median of the values: the worst place is no better than most.
pub(super) fn greatest(values: &[f64], noise: &[f64], sd: &[f64], guard: f64) -> Option<Extreme> {
    let guarded = |k: usize| values[k] + guard * sd[k];
    let place = (0..values.len()).max_by(|a, b| guarded(*a).total_cmp(&guarded(*b)))?;
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let mut sum = 0.0;
    let mut drawn = vec![0.0; values.len()];
    for _ in 0..PAIRS {
        for (drawn, noise) in drawn.iter_mut().zip(noise) {
            let unit: f64 = StandardNormal.sample(&mut random);
            *drawn = noise * unit;
        }
        for sign in [1.0, -1.0] {
            let looks = |k: usize| guarded(k) + sign * drawn[k];
            let selected = (0..values.len()).max_by(|a, b| looks(*a).total_cmp(&looks(*b))).unwrap_or(place);
            sum += values[selected] - sign * drawn[selected];
        }
    }
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (value, median) = (values[place], sorted[sorted.len() / 2]);
    Some(Extreme { place, value, again: value.min(median.max(sum / (2 * PAIRS) as f64)) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Means over `seeds` measurements of the truth with noise of 1: what was measured, and what would be again, and
    /// the shares that are above 1.65 of it.
    fn measured(truth: &[f64], seeds: u64) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let ones = vec![1.0; truth.len()];
        for seed in 0..seeds {
            let mut random = ChaCha8Rng::seed_from_u64(1000 + seed);
            let values: Vec<f64> = truth
                .iter()
                .map(|t| {
                    let unit: f64 = StandardNormal.sample(&mut random);
                    t + unit
                })
                .collect();
            let found = greatest(&values, &ones, &ones, -1.65).unwrap();
            let failed = f64::from(found.again > 1.65);
            for (sum, x) in sum.iter_mut().zip([found.value, found.again, failed]) {
                *sum += x / seeds as f64;
            }
        }
        sum
    }

    #[test]
    fn the_worst_of_equal_places_is_not_worse_than_they_are() {
        // Expected maxima of normal samples: 1.539 of ten, 2.508 of a hundred (tables of order statistics).
        for (count, maximum) in [(1, 0.0), (10, 1.539), (100, 2.508)] {
            let [value, again, failed] = measured(&vec![0.0; count], 1000);
            assert!((value - maximum).abs() < 0.1, "{count}: {value}");
            // Nearly half of the time it is the median of the places, so that the mean is somewhat above their value.
            assert!((-0.1..0.5).contains(&again), "{count}: {again}");
            // At the limit 5 % may be taken to be beyond it, of a thousand with a deviation of 0.7 %.
            assert!(failed < 0.07, "{count}: {failed}");
        }
    }

    #[test]
    fn a_place_that_is_the_worst_is_as_bad_as_it_looks() {
        let mut truth = vec![0.0; 100];
        truth[17] = 20.0;
        let [value, again, _] = measured(&truth, 100);
        assert!((value - 20.0).abs() < 0.4 && (value - again).abs() < 0.05, "{value} {again}");
        let exact = greatest(&truth, &[0.0; 100], &[0.0; 100], 1.65).unwrap();
        assert_eq!(exact, Extreme { place: 17, value: 20.0, again: 20.0 });
    }

    #[test]
    fn a_place_with_a_larger_uncertainty_comes_first_where_that_is_asked_for() {
        let place = |guard: f64| greatest(&[0.5, 0.4], &[0.01, 0.01], &[0.01, 0.2], guard).unwrap().place;
        assert_eq!([1.65, 0.0, -1.65].map(place), [1, 0, 0]);
        assert!(greatest(&[], &[], &[], 1.65).is_none());
    }
}
