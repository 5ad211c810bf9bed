//! The table of the parameters.

use super::csv::{Cell, Table};
use crate::fit::{FitResult, FittedParameter, WithoutSd};
use crate::model::Model;
use gml_compiler::program::Quantity;

/// The reason for which a value that was not fitted has no standard deviation.
const NOT_FITTED: &str = "not fitted";

/// A parameter of the model from which was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterRow {
    /// What is known of it. Values are in its unit.
    parameter: FittedParameter,
    /// The reason for which there is no standard deviation; empty where there is one.
    without_sd: &'static str,
}

impl ParameterRow {
    /// The parameters of a fit, in the script's order.
    #[must_use]
    pub fn of_fit(fit: &FitResult) -> Vec<Self> {
        let row =
            |p: &FittedParameter| Self { parameter: p.clone(), without_sd: p.without_sd.map_or("", WithoutSd::text) };
        fit.parameters.iter().map(row).collect()
    }

    /// The parameters of a model at `x` that was not fitted, in the script's order.
    #[must_use]
    pub fn of_model(model: &dyn Model, x: &[f64]) -> Vec<Self> {
        let finite = |bound: f64| bound.is_finite().then_some(bound);
        let all = model.parameters().iter().zip(x).zip(model.bounds(x));
        all.map(|((p, value), (lower, upper))| Self {
            parameter: FittedParameter {
                lower: finite(lower),
                upper: finite(upper),
                ..FittedParameter::new(p.name.as_str(), *value, p.quantity)
            },
            without_sd: NOT_FITTED,
        })
        .collect()
    }
}

/// A quantity as fit.json names it.
fn name(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Real => "real",
        Quantity::Length => "length",
        Quantity::Angle => "angle",
        Quantity::Int => "int",
        Quantity::Bool => "bool",
    }
}

/// The table of parameters. Their units differ, so that `unit` is a column.
pub(super) fn table(rows: &[ParameterRow]) -> String {
    let head =
        ["parameter", "value", "unit", "quantity", "lower", "upper", "sd", "bias", "without_sd", "fixed", "at_bound"];
    let mut table = Table::new(head.into_iter());
    for ParameterRow { parameter, without_sd } in rows {
        let cells = [
            Cell::Text(&parameter.name),
            Cell::Number(parameter.value),
            Cell::Text(&parameter.unit),
            Cell::Text(name(parameter.quantity)),
            Cell::number(parameter.lower),
            Cell::number(parameter.upper),
            Cell::number(parameter.sd),
            Cell::number(parameter.bias),
            Cell::Text(without_sd),
            Cell::Flag(parameter.fixed),
            Cell::Flag(parameter.at_bound),
        ];
        table.row(cells.into_iter());
    }
    table.into_text()
}
