//! The table of the parameters.

use super::csv::{Cell, Table};
use crate::fit::{FitResult, FittedParameter, WithoutSd};
use crate::model::Model;
use gml_compiler::program::Quantity;

/// The reason for which a value that was not fitted has no standard deviation.
const NOT_FITTED: &str = "not fitted";

/// A parameter of the model from which was measured. Values are in `unit`.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterRow {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// `mm`, `rad` or empty.
    pub unit: String,
    /// What it measures.
    pub quantity: Quantity,
    /// Whether it was held at its value.
    pub fixed: bool,
    /// Whether the fit ended at one of its bounds.
    pub at_bound: bool,
    /// Its lower bound at these values, if there is one.
    pub lower: Option<f64>,
    /// Its upper bound, if there is one.
    pub upper: Option<f64>,
    /// Its standard deviation, if there is one.
    pub sd: Option<f64>,
    /// The bias of its value by noise, if it was estimated.
    pub bias: Option<f64>,
    /// The reason for which there is no standard deviation; empty where there is one.
    pub without_sd: String,
}

impl ParameterRow {
    /// The parameters of a fit, in the script's order.
    #[must_use]
    pub fn of_fit(fit: &FitResult) -> Vec<Self> {
        let row = |p: &FittedParameter| Self {
            name: p.name.clone(),
            value: p.value,
            unit: p.unit.clone(),
            quantity: p.quantity,
            fixed: p.fixed,
            at_bound: p.at_bound,
            lower: p.lower,
            upper: p.upper,
            sd: p.sd,
            bias: p.bias,
            without_sd: p.without_sd.map_or("", WithoutSd::text).to_owned(),
        };
        fit.parameters.iter().map(row).collect()
    }

    /// The parameters of a model at `x` that was not fitted, in the script's order.
    #[must_use]
    pub fn of_model(model: &dyn Model, x: &[f64]) -> Vec<Self> {
        let finite = |bound: f64| bound.is_finite().then_some(bound);
        let all = model.parameters().iter().zip(x).zip(model.bounds(x));
        all.map(|((p, value), (lower, upper))| Self {
            name: p.name.clone(),
            value: *value,
            unit: p.quantity.unit().to_owned(),
            quantity: p.quantity,
            fixed: false,
            at_bound: false,
            lower: finite(lower),
            upper: finite(upper),
            sd: None,
            bias: None,
            without_sd: NOT_FITTED.to_owned(),
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
    for row in rows {
        let cells = [
            Cell::Text(&row.name),
            Cell::Number(row.value),
            Cell::Text(&row.unit),
            Cell::Text(name(row.quantity)),
            Cell::number(row.lower),
            Cell::number(row.upper),
            Cell::number(row.sd),
            Cell::number(row.bias),
            Cell::Text(&row.without_sd),
            Cell::Flag(row.fixed),
            Cell::Flag(row.at_bound),
        ];
        table.row(cells.into_iter());
    }
    table.into_text()
}
