use super::{Distribution, Sample};
use crate::variance::moments::{Moments, Percentiles};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The definition, written down plainly: values sorted, each at the middle of its weight.
fn plainly(mut values: Vec<(f64, f64)>, share: f64) -> f64 {
    values.retain(|v| v.1 > 0.0);
    values.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let goal = share * values.iter().map(|v| v.1).sum::<f64>();
    let mut before = 0.0;
    let mut last: Option<(f64, f64)> = None;
    for (value, weight) in values {
        let place = before + 0.5 * weight;
        if place >= goal {
            return last.map_or(value, |(least, from)| least + (value - least) * (goal - from) / (place - from));
        }
        (last, before) = (Some((value, place)), before + weight);
    }
    last.map_or(f64::NAN, |l| l.0)
}

const SHARES: [f64; 7] = [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99];

fn array(p: &Percentiles) -> [f64; 7] {
    [p.p1, p.p5, p.p25, p.p50, p.p75, p.p95, p.p99]
}

fn distribution(signed: &[f32], areas: &[f32]) -> Distribution {
    Distribution::new(signed.iter().zip(areas).map(|(x, area)| Sample::new(*x, *area)).collect())
}

#[test]
fn samples_are_ordered_by_distance_and_then_by_area() {
    let values = [-f32::MAX, -2.0, -1e-30, 0.0, 1e-30, 0.5, 3.0, f32::MAX];
    let samples: Vec<Sample> = values.iter().flat_map(|x| [Sample::new(*x, 0.0), Sample::new(*x, 2.5)]).collect();
    assert!(samples.is_sorted());
    assert!(samples.iter().zip(0..).all(|(s, i)| s.distance() == values[i / 2] && s.area() == 2.5 * (i % 2) as f32));
}

#[test]
fn few_values_and_none() {
    for m in distribution(&[4.0, 1.0, 8.0, 2.0], &[3.0; 4]).moments() {
        // Hazen's positions 1/8, 3/8, 5/8, 7/8.
        assert_eq!(array(&m.signed.percentiles), [1.0, 1.0, 1.5, 3.0, 6.0, 8.0, 8.0]);
        assert_eq!([m.signed.min, m.signed.max, m.min], [1.0, 8.0, 1.0]);
    }
    let [by_area, per_texel] = Distribution::default().moments();
    assert!(per_texel.signed.median.is_nan() && by_area.signed.min.is_nan() && per_texel.mad.is_nan());
    let [by_area, per_texel] = distribution(&[7.0], &[0.0]).moments();
    assert!(by_area.signed.median.is_nan() && by_area.signed.max.is_nan());
    assert_eq!((per_texel.signed.median, per_texel.signed.max), (7.0, 7.0));
}

/// Few distinct values, so that many are equal, and many; hundreds, thousands, and tens of thousands; one part and two;
/// areas alike, and one that outweighs all others.
#[test]
fn everything_agrees_with_the_definitions() {
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    for round in 0..24 {
        let grid = if round % 2 == 0 { 4.0 } else { 1e6 };
        let count = [400, 5000, 900, 20_000, 300, 72_000][round / 2 % 6] - rng.random_range(0..300);
        let signed: Vec<f32> =
            (0..count).map(|_| (rng.random_range(-1.0..1.2f32).powi(3) * grid).round() / grid + 0.0).collect();
        let mut areas: Vec<f32> = (0..count).map(|_| rng.random_range(0..5) as f32).collect();
        if round % 5 == 0 {
            areas[count / 2] = 1e6;
        }
        let cut = rng.random_range(0..=count);
        let halves = [distribution(&signed[..cut], &areas[..cut]), distribution(&signed[cut..], &areas[cut..])];
        let found = Distribution::merge(halves.iter()).moments();
        for (w, Moments { mean, sd, mad, percentiles, signed: with_signs, .. }) in found.iter().enumerate() {
            let with = |key: &dyn Fn(f64) -> f64| -> Vec<(f64, f64)> {
                let weight = |a: &f32| if w == 0 { f64::from(*a) } else { 1.0 };
                signed.iter().zip(&areas).map(|(x, a)| (key(f64::from(*x)), weight(a))).collect()
            };
            let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-11, "round {round}: {a}, not {b}");
            let of_signed = (with_signs.mean, with_signs.sd, with_signs.mad, &with_signs.percentiles);
            let plain: [&dyn Fn(f64) -> f64; 2] = [&|x| x, &f64::abs];
            for (key, (mean, sd, mad, percentiles)) in
                plain.into_iter().zip([of_signed, (*mean, *sd, *mad, percentiles)])
            {
                for (share, value) in SHARES.into_iter().zip(array(percentiles)) {
                    // Whole weights: sums are exact.
                    near(value, plainly(with(key), share));
                }
                near(mad, plainly(with(&|x| (key(x) - percentiles.p50).abs()), 0.5));
                let all = with(key);
                let total: f64 = all.iter().map(|v| v.1).sum();
                let expected = all.iter().map(|v| v.0 * v.1).sum::<f64>() / total;
                near(mean, expected);
                near(sd.powi(2), all.iter().map(|v| v.1 * (v.0 - expected).powi(2)).sum::<f64>() / total);
            }
            let weighing = with(&|x| x).into_iter().filter(|v| v.1 > 0.0).map(|v| v.0);
            let ends = weighing.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            assert_eq!((with_signs.min, with_signs.max), ends);
        }
    }
}
