//! Options of a fit, and the reasons for which there is none.

use crate::fit::problem::loss::LossKind;
use crate::model::{EvaluationError, Model};
use gml_compiler::program::Parameter;
use gml_compiler::suggest;
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
    /// Holds the model's ends to the scan: surface of the model that could be seen and lies beyond the scan counts as
    /// well. For scans that show the ends.
    pub coverage: bool,
    /// Number of bootstrap samples: scans drawn from the scan, block by block with repetitions, and fitted again from
    /// where the fit ended. 0 for none.
    pub bootstrap: usize,
    /// Seed of the orientations that are screened and of the bootstrap. 0 is as good as any.
    pub seed: u64,
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
    /// A start value outside the parameter's bounds, or not finite.
    #[error("the start value {value} of `{name}` is not within its bounds {low} to {high}")]
    OutOfBounds {
        /// The parameter's name.
        name: String,
        /// The value as given. Millimetres or radians.
        value: f64,
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
    },
    /// Sigma is not a positive number.
    #[error("sigma must be a positive number of millimetres, not {0}")]
    Sigma(f64),
    /// The scan has too few points to determine anything, or they coincide.
    #[error("the scan has {points} points, too few or too close to one another to fit a model")]
    EmptyScan {
        /// The scan's number of points.
        points: usize,
    },
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
        matches!(self, Self::UnknownParameter { .. } | Self::OutOfBounds { .. } | Self::Sigma(_) | Self::Equal(..))
    }
}

/// The parameter that a wrong name most likely means: the nearest one, or one with which the name begins.
fn nearest_parameter(name: &str, parameters: &[Parameter]) -> Option<String> {
    let names = || parameters.iter().map(|p| p.name.as_str());
    suggest::nearest(name, names()).or_else(|| names().find(|known| name.starts_with(known))).map(str::to_owned)
}

impl FitOptions {
    /// The options in terms of the model's parameters.
    ///
    /// # Errors
    /// Names that the model does not have, start values outside of their bounds, and parameters that cannot be tied.
    pub(crate) fn resolve(&self, model: &dyn Model) -> Result<Start, FitError> {
        if let Some(sigma) = self.sigma
            && !(sigma > 0.0 && sigma.is_finite())
        {
            return Err(FitError::Sigma(sigma));
        }
        let parameters = model.parameters();
        let index = |name: &String| {
            parameters.iter().position(|p| p.name == *name).ok_or_else(|| FitError::UnknownParameter {
                name: name.clone(),
                nearest: nearest_parameter(name, parameters),
            })
        };
        let mut x: Vec<f64> = parameters.iter().map(|p| p.default).collect();
        let mut given = vec![false; x.len()];
        for (name, value) in &self.start {
            let i = index(name)?;
            x[i] = *value;
            given[i] = true;
        }
        let bounds = model.bounds(&x);
        for i in 0..x.len() {
            let (low, high) = bounds[i];
            // Rounding of a value printed and read again is not the user's error.
            let slack = 1e-9 * (1.0 + x[i].abs());
            if given[i] && !(x[i].is_finite() && x[i] >= low - slack && x[i] <= high + slack) {
                return Err(FitError::OutOfBounds { name: parameters[i].name.clone(), value: x[i], low, high });
            }
        }
        let mut fixed = vec![false; x.len()];
        for name in &self.fixed {
            fixed[index(name)?] = true;
        }
        let mut ties = Vec::new();
        for group in &self.equal {
            let members = group.iter().map(index).collect::<Result<Vec<usize>, FitError>>()?;
            let Some((leader, followers)) = members.split_first() else { continue };
            for follower in followers {
                let refuse =
                    |why| FitError::Equal(parameters[*leader].name.clone(), parameters[*follower].name.clone(), why);
                if parameters[*leader].quantity != parameters[*follower].quantity {
                    return Err(refuse("they measure different things"));
                }
                let taken = |i: &usize| fixed[*i] || ties.iter().any(|(a, b)| a == i || b == i);
                if leader == follower || taken(follower) || (fixed[*leader]) {
                    return Err(refuse("one of them is fixed or tied already"));
                }
                let (low, high) = bounds[*follower];
                if !(x[*leader] >= low && x[*leader] <= high) {
                    x[*leader] = x[*leader].min(high).max(low);
                }
                x[*follower] = x[*leader];
                ties.push((*leader, *follower));
            }
        }
        Ok(Start { x, fixed, ties })
    }
}

/// The start vector, and which parameters do not vary by themselves.
pub(crate) struct Start {
    /// All parameters in the model's order. Millimetres and radians.
    pub(crate) x: Vec<f64>,
    pub(crate) fixed: Vec<bool>,
    /// Pairs of a leader and its follower, which has the leader's value.
    pub(crate) ties: Vec<(usize, usize)>,
}

impl Start {
    /// Parameters that neither are fixed nor follow another one, ascending.
    pub(crate) fn free(&self) -> impl Iterator<Item = usize> {
        (0..self.x.len()).filter(|i| !self.fixed[*i] && !self.ties.iter().any(|(_, follower)| follower == i))
    }

    /// Whether a parameter follows another one or is followed by one.
    pub(crate) fn is_tied(&self, i: usize) -> bool {
        self.ties.iter().any(|(leader, follower)| *leader == i || *follower == i)
    }
}
