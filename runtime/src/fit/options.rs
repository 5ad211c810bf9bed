//! Options of a fit, and the reasons for which there is none.

use crate::fit::problem::loss::LossKind;
use crate::fit::problem::weights::Weights;
use crate::model::{EvaluationError, Motion};
use std::collections::BTreeMap;
use thiserror::Error;

/// How a fit is to be done. The defaults fit all parameters and, where the script has no pose of its own, a pose beside
/// them.
///
/// ```
/// use gml_runtime::fit::{FitOptions, LossKind};
/// let mut options = FitOptions::default();
/// options.start.insert("radius".to_owned(), 40.0);
/// options.loss = LossKind::Tukey;
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct FitOptions {
    /// Start values by parameter, in millimetres and radians; the script's defaults hold for the others. A start value
    /// of a pose parameter of the script is taken as a pose to begin from, and orientations are not screened.
    pub start: BTreeMap<String, f64>,
    /// An earlier fit of the model to go on from; `start` overrides its values.
    pub earlier: Option<EarlierFit>,
    /// Parameters that keep their start value. Where that was given in `start`, the result says whether the scan
    /// contradicts it.
    pub fixed: Vec<String>,
    /// Groups of parameters that have one value.
    pub equal: Vec<Vec<String>>,
    /// Neither adds nor searches a pose: the scan already lies where the script puts the model, except for the motion
    /// by the script's own parameters.
    pub no_pose: bool,
    /// The final scale of the loss, in millimetres; estimated from the scan where absent.
    pub sigma: Option<f64>,
    /// Ignores the scan's normals.
    pub ignore_normals: bool,
    /// The loss at the end. Before that, while the place is still sought, it is always Welsch's.
    pub loss: LossKind,
    /// The prior weights of the points of a mesh.
    pub weights: Weights,
    /// Holds the model's ends to the scan: surface of the model that could be seen and lies beyond the scan counts as
    /// well. For scans that show the ends.
    pub coverage: bool,
    /// Judges a fit by the scan's points alone. Otherwise the model's surface counts as well: what stands where the
    /// scan shows empty space speaks against a shape, and open ends that have grown beyond the scan end where it
    /// ends.
    pub one_sided: bool,
    /// Number of bootstrap samples: scans drawn from the scan, block by block with repetitions, and fitted again from
    /// where the fit ended. 0 for none.
    pub bootstrap: usize,
    /// Seed of the orientations that are screened and of the bootstrap. 0 is as good as any.
    pub seed: u64,
}

/// Where an earlier fit ended. It is taken for near: orientations are screened only if the model there explains less
/// than half of the scan to which that fit converged, or less than nine tenths of another one. Parameters that it held
/// are not held.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EarlierFit {
    /// Values of parameters, in millimetres and radians.
    pub values: BTreeMap<String, f64>,
    /// The pose that was added to them, if one was.
    pub pose: Option<Motion>,
    /// The poses in several scans, where it was a fit of several.
    pub scans: Vec<Motion>,
    /// How it converged; none if it did not, if it held parameters, or if it was a fit of another model, as one with
    /// other inputs is.
    pub converged: Option<Converged>,
}

/// The scan and the loss with which a fit converged: with the same ones, another fit has nothing left to do.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Converged {
    /// SHA-256 of the scan's file.
    pub scan_sha256: String,
    /// The kind of the loss.
    pub loss: LossKind,
    /// Its scale. Millimetres.
    pub sigma: f64,
    /// The prior weights of the points.
    pub weights: Weights,
}

/// A reason for which there is no fit.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum FitError {
    /// A start value for a parameter that the model does not have, or such a parameter held or tied.
    #[error("the model has no parameter `{name}`{}", .nearest.as_ref().map(|n| format!("; did you mean `{n}`?")).unwrap_or_default())]
    UnknownParameter {
        /// The name as given.
        name: String,
        /// The parameter with the most similar name.
        nearest: Option<String>,
    },
    /// Parameters that cannot be equal.
    #[error("`{0}` and `{1}` cannot be held equal: {2}")]
    Equal(String, String, &'static str),
    /// A parameter whose bounds leave no value, or parameters that are to be equal and have no common one.
    #[error("{}", no_common_value(.bounds, .at, .instead))]
    NoCommonValue {
        /// The parameters' names with their bounds.
        bounds: Vec<(String, String)>,
        /// The parameters on which these bounds depend, with the values at which they leave nothing.
        at: Vec<(String, String)>,
        /// The given start values that prevent a common value, with values of the same parameters that do not.
        instead: Vec<(String, String)>,
    },
    /// A start value outside the parameter's bounds, or not finite.
    #[error("the start value {value} of `{name}` is not within its bounds {bounds}{}", depends(*.above, .at))]
    OutOfBounds {
        /// The parameter's name.
        name: String,
        /// The value as given, with its unit.
        value: String,
        /// The bounds, with their unit.
        bounds: String,
        /// Whether the value is above the upper bound.
        above: bool,
        /// The parameters on which the bound depends that the value breaks, with their start values.
        at: Vec<(String, String)>,
    },
    /// Sigma is not a positive number.
    #[error("sigma must be a positive number of millimetres, not {0}")]
    Sigma(f64),
    /// The scan has too few points to determine anything, or they coincide.
    #[error(
        "{}the scan has {points} distinct point{}, too few to fit a model: it may be the wrong file, or cut too small",
        if scan.is_empty() { String::new() } else { format!("{scan}: ") },
        if *points == 1 { "" } else { "s" }
    )]
    EmptyScan {
        /// The scan's file; empty where it has none.
        scan: String,
        /// The scan's number of points.
        points: usize,
    },
    /// An option that several scans of one object have no use for.
    #[error("with several scans {0}")]
    Several(&'static str),
    /// The model has no surface.
    #[error("the model has no parts, so there is nothing to fit")]
    EmptyModel,
    /// The model cannot be evaluated where the fit begins.
    #[error("the model cannot be evaluated at the start values: {0}")]
    Evaluation(#[from] EvaluationError),
}

impl FitError {
    /// Whether the options are wrong, rather than the scan or the model.
    #[must_use]
    pub fn is_about_options(&self) -> bool {
        match self {
            Self::UnknownParameter { .. } | Self::OutOfBounds { .. } | Self::NoCommonValue { .. } => true,
            Self::Sigma(_) | Self::Equal(..) | Self::Several(_) => true,
            Self::EmptyScan { .. } | Self::EmptyModel | Self::Evaluation(_) => false,
        }
    }
}

fn listed(values: &[(String, String)], between: &str) -> String {
    values.iter().map(|(name, value)| format!("`{name}`{between}{value}")).collect::<Vec<_>>().join(", ")
}

fn no_common_value(bounds: &[(String, String)], at: &[(String, String)], instead: &[(String, String)]) -> String {
    let names: Vec<String> = bounds.iter().map(|(name, _)| format!("`{name}`")).collect();
    let mut message = match (&names[..], bounds) {
        ([name], [(_, bounds)]) => format!("the bounds of {name} leave no value: {bounds}"),
        ([names @ .., last], _) => format!(
            "{} and {last} cannot be held equal: their bounds leave no common value: {}",
            names.join(", "),
            listed(bounds, " ")
        ),
        ([], _) => String::new(),
    };
    if !at.is_empty() {
        message.push_str(&format!(", where {}", listed(at, " = ")));
    }
    if !instead.is_empty() {
        message.push_str(&format!("; the given start values prevent it, not so {}", listed(instead, " = ")));
    }
    message
}

fn depends(above: bool, at: &[(String, String)]) -> String {
    let which = if above { "upper" } else { "lower" };
    match at {
        [] => String::new(),
        [(name, value)] => format!("; the {which} bound depends on `{name}`, whose start value is {value}"),
        _ => format!("; the {which} bound depends on parameters with the start values {}", listed(at, " = ")),
    }
}
