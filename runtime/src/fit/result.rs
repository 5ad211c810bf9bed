//! What a fit found, as written to fit.json (docs/output.md describes every field).

use crate::model::Motion;
use crate::scan::ScanSource;
use gml_compiler::program::Quantity;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What a fit found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FitResult {
    /// The model's name.
    pub model: String,
    /// Path of the script as the user gave it; filled in by the command.
    pub script: String,
    /// The scan.
    pub scan: ScanSource,
    /// The script's parameters in its order.
    pub parameters: Vec<FittedParameter>,
    /// The pose that was added because the script has none: where a model's point lies in the scan. Absent where the
    /// script has its own.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub pose: Option<Motion>,
    /// Mean of psi over the scan's points ([VA] eq. 1): between 0 and 1.
    pub objective: f64,
    /// The scale of psi at the end. Millimetres.
    pub sigma: f64,
    /// The scan's noise (standard deviation). Millimetres.
    pub noise: f64,
    /// Fraction of the points with psi below 1/2.
    pub inliers: f64,
    /// Root mean square distance of the inliers. Millimetres.
    pub rms: f64,
    /// Iterations of the optimisers.
    pub iterations: u64,
    /// Evaluations of the objective, over all points or some.
    pub evaluations: u64,
    /// Whether the last stage met its criterion.
    pub converged: bool,
    /// Seconds by stage.
    pub seconds: BTreeMap<String, f64>,
    /// Sentences for the user.
    pub warnings: Vec<String>,
}

/// A parameter of the script.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedParameter {
    /// Its name.
    pub name: String,
    /// Its value in `unit`.
    pub value: f64,
    /// `mm`, `rad` or empty.
    pub unit: String,
    /// What it measures.
    pub quantity: Quantity,
    /// Held at its value by the user.
    pub fixed: bool,
    /// Ended at one of its bounds.
    pub at_bound: bool,
    /// Standard deviation, where it was estimated. In `unit`.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub sd: Option<f64>,
}
