//! Measures of fits: standard deviations against draws from the covariance, and where there are none.

use super::shapes::program;
use crate::fit::{AllowedDeviation, Covariance, FitResult, FittedMeasure, FittedParameter, WithoutSd};
use gml_compiler::program::Quantity;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const SCRIPT: &str = "use std.surface (cylinder)
model rod {
  param a: length = 40mm
  param b: length = 30mm
  param c: angle = 20deg
  measure sum tolerance +0.2/-0.1mm = a + b
  measure difference = a - b
  measure hypotenuse = sqrt(a ^ 2 + b ^ 2 - 2 * a * b * cos(c))
  measure area = a * b
  measure constant = 2 * 3mm
  measure of_c = 2 * c
  measure root = sqrt(b - 30mm) * sqrt(1mm)
  part side = cylinder(a + b * sin(c), a + b)
}";

type Formula = fn(&[f64; 3]) -> f64;

/// Values, and a covariance with strong correlations.
const X: [f64; 3] = [40.1, 30.2, 0.35];
const COVARIANCE: [[f64; 3]; 3] = [[4e-4, -3.4e-4, 2e-6], [-3.4e-4, 9e-4, -6e-6], [2e-6, -6e-6, 1e-6]];

/// A fit in which the parameters of the names have standard deviations; the others have the reason.
fn fitted(known: &[&str], reason: WithoutSd) -> FitResult {
    let names = ["a", "b", "c"];
    let rows: Vec<usize> = (0..3).filter(|i| known.contains(&names[*i])).collect();
    let parameter = |i: usize| FittedParameter {
        name: names[i].to_owned(),
        value: X[i],
        unit: ["mm", "mm", "rad"][i].to_owned(),
        quantity: [Quantity::Length, Quantity::Length, Quantity::Angle][i],
        fixed: !rows.contains(&i) && reason == WithoutSd::Fixed,
        at_bound: !rows.contains(&i) && reason == WithoutSd::AtBound,
        lower: None,
        upper: None,
        sd: rows.contains(&i).then(|| COVARIANCE[i][i].sqrt()),
        bias: None,
        without_sd: (!rows.contains(&i)).then_some(reason),
    };
    FitResult {
        parameters: (0..3).map(parameter).collect(),
        covariance: Some(Covariance {
            parameters: rows.iter().map(|i| names[*i].to_owned()).collect(),
            matrix: rows.iter().map(|i| rows.iter().map(|j| COVARIANCE[*i][*j]).collect()).collect(),
            ..Covariance::default()
        }),
        ..FitResult::default()
    }
}

fn measured(fit: &FitResult) -> Vec<FittedMeasure> {
    let program = program(SCRIPT);
    fit.measured(&program, &program.defaults())
}

fn named<'m>(measures: &'m [FittedMeasure], name: &str) -> &'m FittedMeasure {
    measures.iter().find(|m| m.name == name).expect("the measure")
}

/// The spread of the measures over draws of the parameters, which sees correlations, and no derivative.
#[test]
fn standard_deviations_are_the_spread_over_the_covariance() {
    let measures = measured(&fitted(&["a", "b", "c"], WithoutSd::Fixed));
    // Cholesky's factor of the covariance.
    let mut lower = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..=i {
            let rest: f64 = COVARIANCE[i][j] - (0..j).map(|k| lower[i][k] * lower[j][k]).sum::<f64>();
            lower[i][j] = if i == j { rest.sqrt() } else { rest / lower[j][j] };
        }
    }
    let formulas: [(&str, Formula); 4] = [
        ("sum", |x| x[0] + x[1]),
        ("difference", |x| x[0] - x[1]),
        ("hypotenuse", |x| (x[0].powi(2) + x[1].powi(2) - 2.0 * x[0] * x[1] * x[2].cos()).sqrt()),
        ("area", |x| x[0] * x[1]),
    ];
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let draws: Vec<[f64; 3]> = (0..100_000)
        .map(|_| {
            let z: [f64; 3] = std::array::from_fn(|_| StandardNormal.sample(&mut random));
            std::array::from_fn(|i| X[i] + (0..=i).map(|k| lower[i][k] * z[k]).sum::<f64>())
        })
        .collect();
    for (name, formula) in formulas {
        let values: Vec<f64> = draws.iter().map(formula).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let spread = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt();
        let measure = named(&measures, name);
        let (value, sd) = (measure.value.expect("a value"), measure.sd.expect("a standard deviation"));
        assert!((value - formula(&X)).abs() < 1e-9, "{name}: {value}");
        // 100,000 draws know a spread to 0.22 %.
        assert!((sd / spread - 1.0).abs() < 0.01, "{name}: {sd}, not {spread}");
    }
    // Without the correlation the sum would have 1.448 times as much.
    let sum = named(&measures, "sum").sd.expect("a standard deviation");
    assert!((1.3e-3_f64.sqrt() / sum - 1.448).abs() < 0.01, "{sum}");
}

#[test]
fn nominal_values_and_tolerances_are_those_of_the_nominal_parameters() {
    let measures = measured(&fitted(&["a", "b", "c"], WithoutSd::Fixed));
    let sum = named(&measures, "sum");
    assert_eq!((sum.nominal, sum.unit.as_str()), (Some(70.0), "mm"));
    assert_eq!(sum.tolerance, Some(AllowedDeviation { lower: -0.1, upper: 0.2 }));
    assert!(sum.deviation().is_some_and(|d| (d - 0.3).abs() < 1e-12));
    assert_eq!(
        sum.derivatives.iter().map(|(name, slope)| (name.as_str(), *slope)).collect::<Vec<_>>(),
        [("a", 1.0), ("b", 1.0)]
    );
    assert_eq!((named(&measures, "area").unit.as_str(), named(&measures, "of_c").unit.as_str()), ("mm^2", "rad"));
    assert_eq!(named(&measures, "constant").sd, Some(0.0));
    // At the defaults its derivative does not exist, and is not needed.
    let root = named(&measures, "root");
    assert_eq!((root.nominal, root.sd.is_some()), (Some(0.0), true));
    assert!(root.value.is_some_and(|v| (v - 0.2_f64.sqrt()).abs() < 1e-12), "{root:?}");
}

/// What depends on a parameter without a standard deviation has none, and says why; one that was held has no spread.
#[test]
fn undetermined_parameters_leave_no_standard_deviation() {
    let measures = measured(&fitted(&["a", "b"], WithoutSd::NotDetermined));
    assert!(named(&measures, "sum").sd.is_some());
    for name in ["hypotenuse", "of_c"] {
        let measure = named(&measures, name);
        assert_eq!((measure.sd, measure.value.is_some()), (None, true));
        assert_eq!(measure.without_sd.as_deref(), Some("c: the scan does not determine it"));
    }
    let at_bound = measured(&fitted(&["a", "c"], WithoutSd::AtBound));
    let sum = named(&at_bound, "sum");
    assert_eq!((sum.sd, &sum.at_bound[..]), (None, &["b".to_owned()][..]));
    assert_eq!(sum.without_sd.as_deref(), Some("b: at its bound"));
    let held = measured(&fitted(&["a", "c"], WithoutSd::Fixed));
    assert_eq!(named(&held, "sum").sd, Some(0.02));
    let nothing = measured(&FitResult { covariance: None, ..fitted(&[], WithoutSd::NotConverged) });
    assert_eq!(named(&nothing, "sum").without_sd.as_deref(), Some("a: not converged; b: not converged"));
}
