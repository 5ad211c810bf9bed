//! The result of a fit, as written to fit.json (docs/output.md describes every field).

use crate::fit::measures::FittedMeasure;
use crate::fit::monitor::TracePoint;
use crate::fit::problem::loss::LossKind;
use crate::fit::problem::weights::Weights;
use crate::model::Motion;
use crate::record::Record;
use crate::scan::ScanSource;
use gml_compiler::program::Quantity;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};

/// The result of a fit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitResult {
    /// The model's name.
    pub model: String,
    /// Path of the script as the user gave it; filled in by the command.
    pub script: String,
    /// SHA-256 of the texts of the script and of what it uses, in hexadecimal; filled in by the command. Absent where
    /// the model does not come from a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub script_sha256: Option<String>,
    /// The script's inputs in its order, with the values that it was compiled with; filled in by the command.
    #[serde(default)]
    pub inputs: Vec<FittedInput>,
    /// The scan.
    pub scan: ScanSource,
    /// The scans, where there are several of one object, and where each shows it. Then `scan` stands for all of them in
    /// the frame of the first, and `pose` is that in the first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub scans: Vec<FittedScan>,
    /// The script's parameters in its order.
    pub parameters: Vec<FittedParameter>,
    /// The script's measures in its order, at these parameters.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub measures: Vec<FittedMeasure>,
    /// The parameters that the user held equal, by group; each in the script's order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub equal: Vec<Vec<String>>,
    /// The pose that was added because the script has none: it takes the model's points to the scan's frame. Absent
    /// where the script has its own.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub pose: Option<Motion>,
    /// Mean loss over the scan's points (\[VA\] eq. 1), by their weights: between 0 and 1 for bounded losses.
    pub objective: f64,
    /// The final scale of the loss. Millimetres.
    pub sigma: f64,
    /// The scan's noise (standard deviation). Millimetres.
    pub noise: f64,
    /// Fraction of the points with a loss below 1/2, by their weights.
    pub inliers: f64,
    /// Root mean square distance of the inliers, by their weights. Millimetres.
    pub rms: f64,
    /// Iterations of the optimisers.
    pub iterations: u64,
    /// Evaluations of the objective, over all points or some.
    pub evaluations: u64,
    /// The kind of the loss.
    #[serde(default)]
    pub loss: LossKind,
    /// The prior weights of the points: all alike in results that do not say it.
    #[serde(default = "all_alike")]
    pub weights: Weights,
    /// The user ended the fit before it was done: this is the best that was found until then.
    #[serde(default)]
    pub interrupted: bool,
    /// Whether the last stage met its criterion.
    pub converged: bool,
    /// The scan has too few points for the unknowns, or they lie in a plane or on a line: a warning says which.
    #[serde(default)]
    pub degenerate: bool,
    /// The covariance of the parameters that are free and determined.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Covariance>,
    /// The covariance of the pose that was added, joint with that of the parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose_covariance: Option<PoseCovariance>,
    /// Tests of values at which parameters were held.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tests: Vec<HypothesisTest>,
    /// The spread of fits to resampled scans, where it was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bootstrap: Option<Bootstrap>,
    /// The share of the model that was scanned, where its ends were held to the scan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage: Option<Covered>,
    /// The model's surface that stands where the scan shows empty space, by part; absent where the scan (a
    /// cloud, or a mesh whose sides are not known) does not say what is empty.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contradicted: Option<Vec<ContradictedPart>>,
    /// The pieces of the scan's surface that the model does not explain, largest first.
    #[serde(default)]
    pub unexplained: Vec<UnexplainedPiece>,
    /// Other shapes of parts that explain the scan as well.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub alternatives: Vec<Alternative>,
    /// The model's surface that has passed through another of its walls, by part.
    #[serde(default)]
    pub passed_through: Vec<PassedPart>,
    /// The candidates of a search over discrete inputs, if there was one: this is the fit of the best one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub search: Option<Search>,
    /// Seconds by stage.
    pub seconds: BTreeMap<String, f64>,
    /// Sentences for the user.
    pub warnings: Vec<String>,
    /// What the fit was made with; filled in by the command.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub provenance: Option<Record>,
    /// The steps that led here, in order. Not part of fit.json.
    #[serde(skip)]
    pub trace: Vec<TracePoint>,
}

fn all_alike() -> Weights {
    Weights::Points
}

/// One of several scans of one object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FittedScan {
    /// The file.
    pub source: ScanSource,
    /// The motion that takes the model's points to this scan's frame.
    pub pose: Motion,
    /// Its covariance, joint with that of the parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose_covariance: Option<PoseCovariance>,
    /// Fraction of its points with a loss below 1/2, by their weights.
    pub inliers: f64,
    /// Root mean square distance of these. Millimetres.
    pub rms: f64,
    /// The final scale of the loss for this scan. Millimetres.
    pub sigma: f64,
    /// Its noise (standard deviation). Millimetres.
    pub noise: f64,
    /// Whether it agrees with the other scans on the shape. Absent where there is nothing to compare.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub agreement: Option<Agreement>,
    /// It may be of another object, or in the wrong place: the shape of all explains little of it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub foreign: bool,
}

/// A test of whether the shape of one scan, fitted to it alone, is that of the other scans, fitted without it: Wald's,
/// over all parameters that both determine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Agreement {
    /// The squared difference by its covariance.
    pub statistic: f64,
    /// Degrees of freedom.
    pub degrees: usize,
    /// The probability of such a statistic, or a larger one, if all scans show one shape.
    pub p: f64,
    /// Whether so small a probability is said to be no chance.
    pub agrees: bool,
    /// The parameters that differ by more than three standard deviations of the difference, the clearest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub differences: Vec<ShapeDifference>,
}

/// A parameter's value in one scan and in the others, with standard deviations, in the parameter's unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShapeDifference {
    /// The parameter.
    pub name: String,
    /// Its value by this scan alone.
    pub value: f64,
    /// Its standard deviation there.
    pub sd: f64,
    /// Its value by the other scans.
    pub others: f64,
    /// Its standard deviation there.
    pub others_sd: f64,
}

/// Another shape of some parts that explains the scan as well: the two differ where nothing was scanned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Alternative {
    /// The parts, or groups of parts, that have another shape.
    pub parts: Vec<String>,
    /// The values of the parameters that shape them, in the parameters' units.
    pub values: BTreeMap<String, f64>,
    /// n ln(ratio of the mean loss to that of the fit), with the effective points: below zero it explains the scan
    /// better.
    pub evidence: f64,
}

/// An input of the script.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FittedInput {
    /// Its name.
    pub name: String,
    /// Its value, in `unit`; 0 or 1 for a `bool`.
    pub value: f64,
    /// `mm`, `rad` or empty.
    pub unit: String,
    /// What it measures.
    pub quantity: Quantity,
}

/// `knobs=5`, as on the command line.
impl Display for FittedInput {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self.quantity {
            Quantity::Bool => write!(f, "{}={}", self.name, self.value != 0.0),
            quantity => write!(f, "{}={}", self.name, quantity.shown(self.value)),
        }
    }
}

/// A parameter of the script.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FittedParameter {
    /// Its name.
    pub name: String,
    /// Its value, in `unit`.
    pub value: f64,
    /// `mm`, `rad` or empty.
    pub unit: String,
    /// Whether it is a length, an angle or a plain number.
    pub quantity: Quantity,
    /// The user held it at its value.
    pub fixed: bool,
    /// It ended at one of its bounds.
    pub at_bound: bool,
    /// Its bounds, in `unit`; infinite ones are absent.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub lower: Option<f64>,
    /// The upper one.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub upper: Option<f64>,
    /// Standard deviation, where it was estimated, in `unit`.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub sd: Option<f64>,
    /// The estimate's bias by noise, as the simulation of it has it, where there is a standard deviation, which holds
    /// it; in `unit`. The value is not corrected.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub bias: Option<f64>,
    /// The reason for which there is no standard deviation.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub without_sd: Option<WithoutSd>,
}

impl FittedParameter {
    /// A value, in the unit of its quantity, of which nothing else is known.
    #[must_use]
    pub fn new(name: impl Into<String>, value: f64, quantity: Quantity) -> Self {
        Self {
            name: name.into(),
            value,
            unit: quantity.unit().to_owned(),
            quantity,
            fixed: false,
            at_bound: false,
            lower: None,
            upper: None,
            sd: None,
            bias: None,
            without_sd: None,
        }
    }
}

/// The reason for which a parameter has no standard deviation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum WithoutSd {
    /// The user held it at its value.
    #[serde(rename = "fixed")]
    Fixed,
    /// It ended at one of its bounds, which hold it there.
    #[serde(rename = "at its bound")]
    AtBound,
    /// No point of the model's surface depends on it.
    #[serde(rename = "no influence")]
    NoInfluence,
    /// It moves the whole model, and the pose that was added does that.
    #[serde(rename = "part of the pose")]
    InPose,
    /// All parts that it shapes were not scanned, or cannot be told from others.
    #[serde(rename = "its part was not scanned")]
    NotScanned,
    /// No distance depends on it, or only together with other parameters.
    #[serde(rename = "the scan does not determine it")]
    NotDetermined,
    /// The scan leaves it open on one side: it is where the surface is least, as of an open end that the scan may have
    /// seen or not.
    #[serde(rename = "the scan ends there")]
    ScanEnds,
    /// The fit stopped too far from the optimum.
    #[serde(rename = "not converged")]
    NotConverged,
    /// The user ended the fit before it was computed.
    #[serde(rename = "interrupted")]
    Interrupted,
}

impl WithoutSd {
    /// The reason as fit.json has it.
    #[must_use]
    pub fn text(self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::AtBound => "at its bound",
            Self::NoInfluence => "no influence",
            Self::InPose => "part of the pose",
            Self::NotScanned => "its part was not scanned",
            Self::NotDetermined => "the scan does not determine it",
            Self::ScanEnds => "the scan ends there",
            Self::NotConverged => "not converged",
            Self::Interrupted => "interrupted",
        }
    }
}

/// The covariance of the parameters that have a standard deviation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Covariance {
    /// The parameters' names, in the script's order.
    pub parameters: Vec<String>,
    /// The matrix, by rows; in the parameters' units.
    pub matrix: Vec<Vec<f64>>,
    /// The matrix divided by the standard deviations of its rows and columns.
    pub correlations: Vec<Vec<f64>>,
    /// Standard deviations that take the residuals for independent of each other and all alike: for comparison.
    #[serde(default)]
    pub naive: Vec<f64>,
    /// The number of independent points that would determine as much as the scan's points near the model.
    pub effective_points: f64,
    /// Edge of the blocks within which residuals were found to depend on each other. Millimetres; absent where they do
    /// not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub block: Option<f64>,
}

/// The covariance of the pose that was added, joint with that of the parameters. The pose varies by a motion in the
/// scan's frame after it, p -> exp(turn) (p - centre) + centre + shift.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseCovariance {
    /// The point about which turns are, in the scan's frame. Millimetres.
    pub centre: [f64; 3],
    /// The names of the parameters, as in `Covariance`.
    pub parameters: Vec<String>,
    /// The matrix, by rows: the parameters in their units, the shift along x, y and z in millimetres, and the turn
    /// about x, y and z (a rotation vector) in radians.
    pub matrix: Vec<Vec<f64>>,
    /// Motions by which the model moves within itself, or at least what was scanned of it. They are held: the matrix is
    /// zero along them.
    pub symmetries: Vec<Symmetry>,
}

impl PoseCovariance {
    /// The standard deviations of the shift along x, y and z (millimetres), and of the turn about them (radians).
    #[must_use]
    pub fn deviations(&self) -> ([f64; 3], [f64; 3]) {
        let of = |i: usize| self.matrix.get(i).and_then(|row| row.get(i)).map_or(f64::NAN, |v| v.max(0.0).sqrt());
        let first = self.parameters.len();
        ([0, 1, 2].map(|k| of(first + k)), [3, 4, 5].map(|k| of(first + k)))
    }
}

/// A motion that changes no distance, in the scan's frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Symmetry {
    /// The shift of the centre: a unit vector, or millimetres per radian of the turn.
    pub shift: [f64; 3],
    /// The axis of the turn, of unit length; zero if there is none.
    pub turn: [f64; 3],
    /// The motion in words.
    pub text: String,
    /// The parts that it moves all the same, of which the scan shows nothing there; none of a symmetry of the whole
    /// model.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub moves: Vec<String>,
}

/// Wald's test of values at which parameters were held.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HypothesisTest {
    /// The parameters' names.
    pub parameters: Vec<String>,
    /// The values at which they were held. Millimetres and radians.
    pub held: Vec<f64>,
    /// The values that they take when released.
    pub free: Vec<f64>,
    /// The standard deviations of these.
    pub sd: Vec<f64>,
    /// Squared distance between the two in standard deviations (of correlated values: Mahalanobis').
    pub statistic: f64,
    /// Degrees of freedom of the chi-squared distribution that it has if the held values are true.
    pub degrees: usize,
    /// The probability of such a statistic, or a larger one, if the held values are true.
    pub p: f64,
}

/// A part of the model some of which stands where the scan shows empty space.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContradictedPart {
    /// The part's name.
    pub part: String,
    /// The area. Square millimetres.
    pub area: f64,
    /// That area as a share of the part's.
    pub share: f64,
    /// The middle of that area, in the scan's frame. Millimetres.
    pub place: [f64; 3],
}

/// A connected piece of the scan's surface that the model does not explain.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UnexplainedPiece {
    /// Its area as a share of the scan's; of a cloud, its points as a share of all.
    pub share: f64,
    /// Its area; absent in a cloud. Square millimetres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub area: Option<f64>,
    /// Its middle, in the scan's frame. Millimetres.
    pub place: [f64; 3],
    /// The parts of the model that are next to it.
    pub beside: Vec<String>,
    /// The free parameters that shape these.
    pub shaped_by: Vec<String>,
}

/// A part of the model that has passed through another of its walls.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PassedPart {
    /// The part's name.
    pub part: String,
    /// The names of the parts that its normals meet from there.
    pub through: Vec<String>,
    /// The area. Square millimetres.
    pub area: f64,
    /// The largest distance to the other wall. Millimetres.
    pub depth: f64,
    /// The middle of that area, in the scan's frame. Millimetres.
    pub place: [f64; 3],
}

/// Fits with several values of discrete inputs, compared.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Search {
    /// Best first; those without a fit last.
    pub candidates: Vec<SearchCandidate>,
    /// The difference of BIC between the second best and the best; absent where nothing else could be fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub margin: Option<f64>,
    /// The scale of the loss at which all were compared. Millimetres.
    pub sigma: f64,
    /// The number of independent points on which the BIC is based.
    pub effective_points: f64,
}

/// One value of every input that was searched.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchCandidate {
    /// The inputs.
    pub inputs: BTreeMap<String, i64>,
    /// Schwarz's criterion: smaller is better.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bic: Option<f64>,
    /// Mean loss at the common scale.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub objective: Option<f64>,
    /// It was only fitted quickly, to some of the points and from another candidate's pose, and given up.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub quick: bool,
    /// The reason for which there is no fit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
}

/// The part of the model's visible surface that was scanned.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Covered {
    /// Its share of the visible area, between 0 and 1.
    pub share: f64,
    /// The scale of the loss for distances beyond the scan. Millimetres.
    pub sigma: f64,
}

/// Fits of scans that are drawn from the scan itself, block by block with repetitions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bootstrap {
    /// Number of scans that were drawn and fitted.
    pub samples: usize,
    /// Edge of the blocks. Millimetres; absent where single points were drawn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub block: Option<f64>,
    /// The spread of every free parameter, in the script's order.
    pub parameters: Vec<Resampled>,
}

/// The spread of a parameter over resampled scans, in its unit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Resampled {
    /// Its name.
    pub name: String,
    /// Standard deviation.
    pub sd: f64,
    /// 2.5 % of the fits were below this.
    pub low: f64,
    /// 2.5 % of the fits were above this.
    pub high: f64,
}
