//! Against published values, and against populations whose truth is known.

use super::*;
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, StandardNormal};

/// Vaccine against tuberculosis: log relative risks and their variances of 13 trials, from the counts in Colditz et
/// al., JAMA 271, 1994.
fn trials() -> Vec<(f64, f64)> {
    // Cases and others among the vaccinated and the controls.
    let counts: [[f64; 4]; 13] = [
        [4.0, 119.0, 11.0, 128.0],
        [6.0, 300.0, 29.0, 274.0],
        [3.0, 228.0, 11.0, 209.0],
        [62.0, 13536.0, 248.0, 12619.0],
        [33.0, 5036.0, 47.0, 5761.0],
        [180.0, 1361.0, 372.0, 1079.0],
        [8.0, 2537.0, 10.0, 619.0],
        [505.0, 87886.0, 499.0, 87892.0],
        [29.0, 7470.0, 45.0, 7232.0],
        [17.0, 1699.0, 65.0, 1600.0],
        [186.0, 50448.0, 141.0, 27197.0],
        [5.0, 2493.0, 3.0, 2338.0],
        [27.0, 16886.0, 29.0, 17825.0],
    ];
    let effect = |[a, b, c, d]: [f64; 4]| {
        let risk = ((a / (a + b)) / (c / (c + d))).ln();
        let variance = 1.0 / a - 1.0 / (a + b) + 1.0 / c - 1.0 / (c + d);
        (risk, f64::sqrt(variance))
    };
    counts.into_iter().map(effect).collect()
}

/// The figures that the R package metafor publishes for these trials.
#[test]
fn random_effects_are_those_of_metafor() {
    let found = RandomEffects::of(&trials()).expect("an estimate");
    let near = |a: f64, b: f64, error: f64| assert!((a - b).abs() < error, "{a} is not {b}");
    near(found.mean, -0.7145, 6e-5);
    near(found.between.powi(2), 0.3132, 6e-5);
    near(found.between_interval[0].powi(2), 0.1197, 6e-5);
    near(found.between_interval[1].powi(2), 1.1115, 6e-5);
    near(found.q, 152.2330, 6e-5);
    near(found.standard_error, 0.1808, 1e-4);
    near(found.mean_interval[0], -1.1084, 2e-4);
    near(found.mean_interval[1], -0.3206, 2e-4);
    assert!(found.p_equal < 1e-20);
}

/// Of 400 populations the intervals hold the truth of about 95 in a hundred: within four standard errors, 4.4 in a
/// hundred.
#[test]
fn intervals_hold_the_truth_as_often_as_they_say() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let (mut mean_held, mut spread_held) = (0, 0);
    for _ in 0..400 {
        let parts = Normal::new(10.0, 0.3).unwrap();
        let measured: Vec<(f64, f64)> = (0..15)
            .map(|_| {
                let sd = random.random_range(0.1..0.5);
                let truth: f64 = parts.sample(&mut random);
                (truth + Normal::new(0.0, sd).unwrap().sample(&mut random), sd)
            })
            .collect();
        let found = RandomEffects::of(&measured).unwrap();
        let holds = |[low, high]: [f64; 2], truth: f64| usize::from(low <= truth && truth <= high);
        mean_held += holds(found.mean_interval, 10.0);
        spread_held += holds(found.between_interval, 0.3);
    }
    for held in [mean_held, spread_held] {
        assert!((362..=397).contains(&held), "{held} of 400");
    }
}

#[test]
fn equal_objects_have_no_spread_between_them() {
    let equal: Vec<(f64, f64)> = (0..10).map(|i| (5.0 + 0.01 * f64::from(i % 2), 0.1)).collect();
    let found = RandomEffects::of(&equal).unwrap();
    assert_eq!((found.between, found.between_interval[0]), (0.0, 0.0));
    assert!(found.p_equal > 0.99);
    assert!(RandomEffects::of(&[(1.0, 0.1)]).is_none());
    assert!(RandomEffects::of(&[(1.0, 0.1), (2.0, f64::NAN)]).is_none());
}

/// By hand: mean 10, moving ranges 1, 2, 3, mean 2.
#[test]
fn limits_follow_from_moving_ranges() {
    let chart = IndividualsChart::of(&[10.0, 11.0, 9.0, 12.0, 8.0], &[]).unwrap();
    assert_eq!((chart.centre, chart.mean_range), (10.0, 2.5));
    assert!((chart.limits[1] - (10.0 + 3.0 * 2.5 / 1.128)).abs() < 1e-2);
    assert!((chart.range_limit - 3.267 * 2.5).abs() < 2e-3);
    assert!(chart.signals.is_empty() && chart.few);
    let mut shifted = vec![0.1, -0.1, 0.2, -0.2, 0.1, 0.0, -0.1, 0.1, 0.2, -0.1, 5.0];
    let chart = IndividualsChart::of(&shifted, &[]).unwrap();
    assert!(chart.signals.iter().any(|s| s.at == 10 && s.reason.contains("beyond")), "{:?}", chart.signals);
    shifted.truncate(10);
    shifted.extend([0.3; 10]);
    let chart = IndividualsChart::of(&shifted, &[]).unwrap();
    assert!(chart.signals.iter().any(|s| s.reason.contains("9th in a row")), "{:?}", chart.signals);
    assert!(IndividualsChart::of(&[1.0], &[]).is_none());
}

/// Values of equal spacing: sd by hand; chi-squared by table (24 degrees: 12.401 and 39.364).
#[test]
fn indices_are_those_of_tables() {
    let values: Vec<f64> = (0..25).map(|i| 10.0 + 0.01 * f64::from((i * 7) % 25 - 12)).collect();
    let chart = IndividualsChart::of(&values, &[]).unwrap();
    let limits = Limits { lower: 9.7, upper: 10.4 };
    let found = Capability::of(&values, limits, &chart, 0.0).unwrap();
    let sd = 0.01 * f64::sqrt((25.0 * 25.0 - 1.0) / 12.0 * 25.0 / 24.0);
    assert!((found.sd - sd).abs() < 1e-12);
    assert!((found.pp.value - 0.7 / (6.0 * sd)).abs() < 1e-9);
    assert!((found.ppk.value - 0.3 / (3.0 * sd)).abs() < 1e-9);
    assert!((found.pp.interval[0] / found.pp.value - f64::sqrt(12.401 / 24.0)).abs() < 1e-4);
    assert!((found.pp.interval[1] / found.pp.value - f64::sqrt(39.364 / 24.0)).abs() < 1e-4);
    let k = found.ppk.value;
    let reach = 1.959_964 * f64::sqrt(1.0 / 225.0 + k * k / 48.0);
    assert!((found.ppk.interval[1] - k - reach).abs() < 1e-6);
    assert_eq!(found.beyond, 0);
    let noisy = Capability::of(&values, limits, &chart, 0.05).unwrap();
    assert!(noisy.notes.iter().any(|note| note.contains("of the variance is that of measurement")));
}

#[test]
fn normal_values_are_taken_for_normal_and_others_are_not() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let normal = Normal::new(3.0, 0.2).unwrap();
    let rejected = |skewed: bool, random: &mut ChaCha8Rng| {
        let one = |random: &mut ChaCha8Rng| {
            let values: Vec<f64> = (0..40)
                .map(|_| {
                    let value: f64 = normal.sample(random);
                    if skewed { (4.0 * value).exp() } else { value }
                })
                .collect();
            Normality::of(&values).unwrap().p < 0.05
        };
        (0..400).filter(|_| one(random)).count()
    };
    // One in twenty, with four standard errors of 4.4.
    let normal_rejected = rejected(false, &mut random);
    assert!((3..=37).contains(&normal_rejected), "{normal_rejected}");
    assert!(rejected(true, &mut random) > 350);
    assert!(Normality::of(&[1.0; 20]).is_none());
}

#[test]
fn correlations_have_intervals() {
    let pairs: Vec<(f64, f64)> =
        (0..30).map(|i| (f64::from(i), f64::from((i * 17) % 30) + 2.0 * f64::from(i))).collect();
    let found = Correlation::of(["a", "b"], &pairs).unwrap();
    // By Fisher's transformation: atanh(r) +- 1.96 / sqrt(27).
    let z = found.r.atanh();
    assert!((found.interval[0] - (z - 1.959_964 / 27f64.sqrt()).tanh()).abs() < 1e-6);
    assert!(found.is_clear() && found.r < 1.0);
    assert!(Correlation::of(["a", "b"], &[(1.0, 2.0), (1.0, 3.0), (1.0, 4.0), (1.0, 5.0)]).is_none());
}

#[test]
fn a_value_far_from_the_others_is_outlying_unless_its_measurement_is_poor() {
    let mut values: Vec<(usize, f64, Option<f64>)> =
        (0..20).map(|i| (i, 10.0 + 0.01 * f64::from(i as u32 % 5), Some(0.01))).collect();
    values[7] = (7, 10.5, Some(0.01));
    values[9] = (9, 10.5, Some(0.4));
    let found = outlying("r", &values, 1);
    assert_eq!(found.iter().map(|o| o.row).collect::<Vec<_>>(), [7]);
    assert!(outlying("r", &values[..4], 1).is_empty());
}

/// Of populations of equal objects one in twenty has an outlier, and no more.
#[test]
fn few_populations_of_equal_objects_have_outliers() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for count in [5, 8, 20, 60] {
        let mut with = 0;
        for _ in 0..2000 {
            let value = |row| (row, StandardNormal.sample(&mut random), None);
            let values: Vec<(usize, f64, Option<f64>)> = (0..count).map(value).collect();
            with += usize::from(!outlying("r", &values, 1).is_empty());
        }
        // Of 2,000 trials 100 are expected, with a standard deviation of 10; the formula is safe for few values.
        assert!((20..130).contains(&with), "{with} of 2,000 with {count} values");
    }
}

#[test]
fn a_poorer_measurement_has_wider_control_limits() {
    let mut values: Vec<f64> = (0..30).map(|i| 9.9 + 0.1 * f64::from(i % 3)).collect();
    values[6] = 10.8;
    let known = |poor: f64| (0..30).map(|i| Some(if i == 6 { poor } else { 0.05 })).collect::<Vec<Option<f64>>>();
    let at = |poor| {
        let chart = IndividualsChart::of(&values, &known(poor)).unwrap();
        chart.signals.iter().map(|s| s.at).collect::<Vec<_>>()
    };
    assert!(at(0.05).contains(&6), "{:?}", at(0.05));
    assert!(at(0.4).is_empty(), "{:?}", at(0.4));
}

#[test]
fn maps_are_means_and_deviations_of_what_was_measured() {
    let mut map = DeviationMap::default();
    let textures = [[1.0, f32::NAN, 2.0, f32::NAN], [3.0, f32::NAN, 4.0, f32::NAN], [5.0, 1.0, f32::NAN, f32::NAN]];
    textures.iter().for_each(|t| map.add(t).unwrap());
    let (mean, sd) = (map.mean(), map.sd());
    assert_eq!((mean[0], sd[0]), (3.0, 2.0));
    assert_eq!((mean[2], sd[2]), (3.0, 2f32.sqrt()));
    // One of three is not enough.
    assert!(mean[1].is_nan() && mean[3].is_nan());
    // Of two degrees of freedom p = 1 - t / sqrt(2 + t^2), t = 3 / (2 / sqrt(3)).
    assert!((map.chance()[0] - 0.121_69).abs() < 1e-4, "{}", map.chance()[0]);
    assert!(map.add(&[0.0; 3]).is_err());
}

/// Objects that differ by two correlated parameters, measured with errors of which the larger ones are of a third.
#[test]
fn what_varies_between_objects_is_told_from_errors() {
    let text = "use std.surface (cylinder, plane)
model tin { param r: length = 20mm
param h: length = 50mm
param w: length = 30mm
part wall = cylinder(radius: r, height: h)
part plate = plane(w, 1mm) }";
    let script = gml_compiler::SourceFile { name: "tin.gml".into(), text: text.into() };
    let options = gml_compiler::Options::default();
    let program =
        gml_compiler::compile(script, &gml_compiler::NoFiles, &options).unwrap_or_else(|e| panic!("{e}")).program;
    let movements = Movements::of(&program, &[20.0, 50.0, 30.0]).expect("it exists");
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let unit = Normal::new(0.0, 1.0).unwrap();
    let mut draw = |sd: f64| sd * unit.sample(&mut random);
    let (mut values, mut errors) = (Vec::new(), Vec::new());
    for _ in 0..300 {
        let r = 20.0 + draw(0.2);
        let h = 50.0 + 0.5 * (r - 20.0) + draw(0.05);
        values.push(vec![r + draw(0.1), h + draw(0.05), 30.0 + draw(0.5)]);
        errors.push(DMatrix::from_diagonal(&nalgebra::DVector::from_vec(vec![0.01, 0.0025, 0.25])));
    }
    let names = ["r", "h", "w"].map(str::to_owned);
    let (found, between) = Variation::of(&names, &values, &errors, &movements).expect("they differ");
    assert_eq!(found.contributions[0].name, "r", "{found:?}");
    // The whole wall moves by the radius' 0.2 mm, within three standard errors: 0.2 / sqrt(600) each.
    assert!((found.contributions[0].movement - 0.2).abs() < 0.03, "{found:?}");
    assert!(found.principal_share > 0.8);
    let correlation = between[(0, 1)] / (between[(0, 0)] * between[(1, 1)]).sqrt();
    // 0.1 over the root of 0.1^2 + 0.05^2.
    assert!((correlation - 0.894).abs() < 0.08, "{correlation}");
}

/// Ten objects whose fits share an error that is far larger than what they differ by.
#[test]
fn errors_that_all_objects_share_do_not_hide_their_spread() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let unit = Normal::new(0.0, 1.0).unwrap();
    let row = |i: u32, noise_sd: Option<f64>, random: &mut ChaCha8Rng| {
        let value = 10.0 + 0.05 * unit.sample(random) + 0.01 * unit.sample(random);
        let r = Measured {
            name: "r".into(),
            unit: "mm".into(),
            value: Some(value),
            sd: Some(0.5),
            noise_sd,
            ..Measured::default()
        };
        let inspected = Inspected { parameters: vec![r], ..Inspected::default() };
        Row {
            schema: SCHEMA,
            scan: format!("{i}"),
            name: format!("{i}"),
            scan_sha256: String::new(),
            key: String::new(),
            tool: String::new(),
            time: String::new(),
            seconds: 0.0,
            outcome: Outcome::Inspected(Box::new(inspected)),
        }
    };
    let of = |noise_sd, random: &mut ChaCha8Rng| {
        let rows: Vec<Row> = (0..40).map(|i| row(i, noise_sd, random)).collect();
        Summary::of("m", &rows, &[], None)
    };
    let by_scanner = |summary: &Summary| {
        // The scanner's uncertainty is in the interval of the mean, and neither in the mean nor in the spread.
        let with = summary.clone().with_device_uncertainty(0.3).series[0].effects.unwrap();
        let without = summary.series[0].effects.unwrap();
        let half = |e: &RandomEffects| 0.5 * (e.mean_interval[1] - e.mean_interval[0]);
        assert!((half(&with) - half(&without).hypot(1.96 * 0.3)).abs() < 1e-4, "{with:?} {without:?}");
        assert_eq!((with.mean, with.between_interval), (without.mean, without.between_interval));
    };
    let told = of(Some(0.01), &mut random);
    by_scanner(&told);
    let told = &told.series[0];
    let effects = told.effects.unwrap();
    assert!(told.by_noise && effects.overstated && told.notes[0].contains("share"), "{told:?}");
    assert!(effects.between_interval[0] < 0.05 && 0.05 < effects.between_interval[1], "{effects:?}");
    let bounded = of(None, &mut random).series[0].effects.unwrap();
    assert!(bounded.between.is_nan() && bounded.between_interval[0] == 0.0, "{bounded:?}");
    assert!((0.05..0.1).contains(&bounded.between_interval[1]), "{bounded:?}");
}
