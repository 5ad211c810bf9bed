use super::{Distances, SHARES, Summary, TASK, Values};
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

fn summary(values: &Values, range: f64) -> Summary {
    Distances::of([values].into_iter()).summary(range, None)
}

#[test]
fn few_values_and_none() {
    let four = summary(&Values { signed: vec![4.0, 1.0, 8.0, 2.0], areas: vec![3.0; 4] }, 8.0);
    for w in [0, 1] {
        // Hazen's positions 1/8, 3/8, 5/8, 7/8.
        assert_eq!(four.quantiles[0][w], [1.0, 1.0, 1.5, 3.0, 6.0, 8.0, 8.0]);
        assert_eq!([four.ends[0][w], four.ends[1][w], four.ends[2][w]], [1.0, 8.0, 1.0]);
    }
    let none = summary(&Values::default(), 8.0);
    assert!(none.quantiles[0][1][3].is_nan() && none.ends[0][0].is_nan() && none.mads[1][1].is_nan());
    let without_area = summary(&Values { signed: vec![7.0], areas: vec![0.0] }, 8.0);
    assert!(without_area.quantiles[0][0][3].is_nan() && without_area.ends[1][0].is_nan());
    assert_eq!((without_area.quantiles[0][1][3], without_area.ends[1][1]), (7.0, 7.0));
}

/// Few distinct values, so that many are equal, and many; hundreds, thousands, and more than a task; one part and two; areas alike,
/// and one that outweighs all others.
#[test]
fn everything_agrees_with_the_definitions() {
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    for round in 0..24 {
        let grid = if round % 2 == 0 { 4.0 } else { 1e6 };
        let count = [400, 5000, 900, 20_000, 300, TASK + 7000][round / 2 % 6] - rng.random_range(0..300);
        let signed: Vec<f32> =
            (0..count).map(|_| (rng.random_range(-1.0..1.2f32).powi(3) * grid).round() / grid).collect();
        let mut areas: Vec<f32> = (0..count).map(|_| rng.random_range(0..5) as f32).collect();
        if round % 5 == 0 {
            areas[count / 2] = 1e6;
        }
        let cut = rng.random_range(0..=count);
        let halves = [
            Values { signed: signed[..cut].to_vec(), areas: areas[..cut].to_vec() },
            Values { signed: signed[cut..].to_vec(), areas: areas[cut..].to_vec() },
        ];
        let found = Distances::of(halves.iter()).summary(2.0, None);
        for w in [0, 1] {
            let with = |key: &dyn Fn(f64) -> f64| -> Vec<(f64, f64)> {
                let weight = |a: &f32| if w == 0 { f64::from(*a) } else { 1.0 };
                signed.iter().zip(&areas).map(|(x, a)| (key(f64::from(*x)), weight(a))).collect()
            };
            let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-11, "round {round}: {a}, not {b}");
            let plain: [&dyn Fn(f64) -> f64; 2] = [&|x| x, &f64::abs];
            for (k, key) in plain.into_iter().enumerate() {
                for (share, value) in SHARES.iter().zip(&found.quantiles[k][w]) {
                    // Whole weights: sums are exact.
                    near(*value, plainly(with(key), *share));
                }
                let center = found.quantiles[k][w][3];
                near(found.mads[k][w], plainly(with(&|x| (key(x) - center).abs()), 0.5));
                let all = with(key);
                let total: f64 = all.iter().map(|v| v.1).sum();
                let mean = all.iter().map(|v| v.0 * v.1).sum::<f64>() / total;
                near(found.means[k][w], mean);
                near(found.variances[k][w], all.iter().map(|v| v.1 * (v.0 - mean).powi(2)).sum::<f64>() / total);
            }
            let weighing = with(&|x| x).into_iter().filter(|v| v.1 > 0.0).map(|v| v.0);
            let ends = weighing.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            assert_eq!((found.ends[0][w], found.ends[1][w]), ends);
        }
    }
}
