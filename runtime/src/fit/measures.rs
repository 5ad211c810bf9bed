//! Measures of a fitted model: their values, and their standard deviations by the covariance of the parameters.

use super::options::FitOptions;
use super::result::{FitResult, FittedParameter, WithoutSd};
use crate::figures::measured;
use crate::model::Model;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A measure of the script, at the fitted parameters.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FittedMeasure {
    /// Its name.
    pub name: String,
    /// Its value, in `unit`; absent where it cannot be computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// `mm`, `rad`, a power of `mm`, or empty.
    pub unit: String,
    /// Standard deviation of the value, in `unit`; 0 where it depends on parameters alone that were held, or on none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sd: Option<f64>,
    /// Why there is no value, or no standard deviation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub without_sd: Option<String>,
    /// The parameters at one of their bounds that it depends on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub at_bound: Vec<String>,
    /// Its derivative by each parameter that it depends on, in the unit over that of the parameter.
    pub derivatives: BTreeMap<String, f64>,
    /// The value at the defaults of the parameters, or at the start values that were given instead of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nominal: Option<f64>,
    /// What its tolerance allows, if it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<AllowedDeviation>,
}

/// What a tolerance allows: deviations from the nominal value, in the measure's unit, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AllowedDeviation {
    /// The least; usually negative.
    pub lower: f64,
    /// The greatest.
    pub upper: f64,
}

impl FittedMeasure {
    /// The value less the nominal one, where there are both.
    #[must_use]
    pub fn deviation(&self) -> Option<f64> {
        Some(self.value? - self.nominal?)
    }

    /// A value of it as people write it, and its unit: angles in degrees.
    #[must_use]
    pub fn written(&self, value: f64) -> (f64, &str) {
        if self.unit == "rad" { (value.to_degrees(), "deg") } else { (value, &self.unit) }
    }
}

impl FitResult {
    /// Measures of the fitted model. `nominal` has the parameters at which they have their nominal values.
    #[must_use]
    pub fn measured(&self, model: &dyn Model, nominal: &[f64]) -> Vec<FittedMeasure> {
        let x: Vec<f64> = self.parameters.iter().map(|p| p.value).collect();
        let measures = model.measures().iter().enumerate();
        let values = measured(model, nominal).into_iter().zip(measured(model, &x));
        measures
            .zip(values)
            .map(|((k, declared), (at_nominal, at_fit))| {
                let mut measure = FittedMeasure {
                    name: declared.name.clone(),
                    unit: declared.unit.clone(),
                    nominal: at_nominal.ok().map(|measured| measured.value),
                    ..FittedMeasure::default()
                };
                match model.measure_limits(k, nominal) {
                    Ok(limits) => measure.tolerance = limits.map(|[lower, upper]| AllowedDeviation { lower, upper }),
                    Err(error) => measure.without_sd = Some(error.message),
                }
                let computed = at_fit.and_then(|measured| {
                    measure.value = Some(measured.value);
                    self.add_deviation(&mut measure, &measured.gradient?);
                    Ok(())
                });
                if let Err(error) = computed {
                    measure.without_sd = Some(error.message);
                }
                measure
            })
            .collect()
    }

    /// Adds derivatives and, by them and the covariance, the standard deviation.
    fn add_deviation(&self, measure: &mut FittedMeasure, gradient: &[f64]) {
        let used: Vec<(&FittedParameter, f64)> =
            self.parameters.iter().zip(gradient.iter().copied()).filter(|(_, slope)| *slope != 0.0).collect();
        measure.derivatives = used.iter().map(|(p, slope)| (p.name.clone(), *slope)).collect();
        measure.at_bound = used.iter().filter(|(p, _)| p.at_bound && !p.fixed).map(|(p, _)| p.name.clone()).collect();
        let open: Vec<String> = used.iter().filter_map(|(p, _)| Some(format!("{}: {}", p.name, reason(p)?))).collect();
        if open.is_empty() {
            measure.sd = Some(self.variance(&measure.derivatives).max(0.0).sqrt());
        } else {
            measure.without_sd = Some(open.join("; "));
        }
    }

    /// g^T C g over the parameters of the covariance; those that are not in it were held.
    fn variance(&self, derivatives: &BTreeMap<String, f64>) -> f64 {
        let Some(covariance) = &self.covariance else { return 0.0 };
        let g: Vec<f64> =
            covariance.parameters.iter().map(|name| derivatives.get(name).copied().unwrap_or(0.0)).collect();
        let product = |row: &Vec<f64>| row.iter().zip(&g).map(|(c, g)| c * g).sum::<f64>();
        covariance.matrix.iter().zip(&g).map(|(row, g)| g * product(row)).sum()
    }
}

/// Why nothing that depends on a parameter has a standard deviation.
fn reason(parameter: &FittedParameter) -> Option<&'static str> {
    match (parameter.sd, parameter.without_sd) {
        (Some(_), _) | (None, Some(WithoutSd::Fixed)) => None,
        (None, Some(reason)) => Some(reason.text()),
        (None, None) => Some(WithoutSd::NotDetermined.text()),
    }
}

/// The parameters of the nominal model: the defaults, and the start values that the user gave.
pub(crate) fn nominal(model: &dyn Model, options: &FitOptions) -> Vec<f64> {
    let value = |p: &gml_compiler::program::Parameter| options.start.get(&p.name).copied().unwrap_or(p.default);
    model.parameters().iter().map(value).collect()
}
