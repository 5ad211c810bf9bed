//! Two surfaces compared: where they differ, and by which parameters.
//!
//! [`compare()`] samples both surfaces and measures the signed distance of every sample from the other one, which is
//! the exact surface of a model or the triangles of a mesh.

mod body;
mod difference;
mod explained;
mod parameters;
mod prepared;
mod rigid;
mod sampled;
#[cfg(test)]
mod tests;

pub use crate::figures::NoVolume;
pub use body::Body;
pub use difference::{Difference, DifferenceStatistics, PartDifference};
pub use explained::{Contribution, ExplainedDifference, PartExplained};
pub use parameters::{JointTest, ParameterDifference, Stated, StatedCovariance, States};

use crate::mesh::Bounds;
use crate::model::{EvaluationError, Motion, Tessellation};
use crate::progress::Progress;
use crate::variance::{MeasureError, Reference, Resolution};
use prepared::Prepared;
use rigid::{RigidParts, SEGMENTS};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The maximum distance as a fraction of the smaller surface's diagonal, unless the options name one.
const MAX_DISTANCE: f64 = 0.1;

/// From this proportion of sizes on, surfaces may not be of one object in one unit.
const UNLIKE: f64 = 8.0;

/// So small a share of the area of both is no counterpart.
const LITTLE: f64 = 0.01;

/// Texels a side, in which samples are as far from each other as those of a texture of that size.
const SIDES: [u32; 4] = [512, 256, 128, 64];

/// The most triangles about all places that are looked at without being asked: some 10 s of processor time (3 to 6
/// million a second). A scan of a million triangles against itself has 5e6, a cone of 1,000 triangles 1.2e8.
const WORK: f64 = 5e7;

/// As many as the coarsest resolution may take, at which every triangle has a sample: up to half a minute.
const MOST_WORK: f64 = 2e8;

/// Options of [`compare()`].
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct CompareOptions {
    /// How finely the surfaces are sampled: as the texture of a measurement. None is the finest of 512, 256, ... texels
    /// a side that takes a bearable time.
    pub resolution: Option<Resolution>,
    /// Largest distance at which a place has a counterpart, in millimetres; by default a tenth of the smaller surface's
    /// diagonal.
    pub max_distance: Option<f64>,
    /// Whether B is moved so that equal places of both models lie as near to each other as can be.
    pub align: bool,
}

/// One of two surfaces.
#[derive(Clone, Copy)]
pub struct Side<'a> {
    /// The surface.
    pub surface: Reference<'a>,
    /// The values of its parameters, if it is a model's.
    pub states: Option<States<'a>>,
}

/// The result: the content of the file that `gmlc compare -o` writes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Meaning of a signed distance's sign.
    pub sign_convention: String,
    /// Unit of all lengths; areas are in its square, volumes in its cube.
    pub unit: String,
    /// Places farther from the other surface than this have no counterpart.
    pub max_distance: f64,
    /// Mean distance between neighbouring samples of A and of B.
    pub spacing: [f64; 2],
    /// Sizes of A.
    pub a: Body,
    /// Sizes of B.
    pub b: Body,
    /// Distances from A's surface to B.
    pub a_to_b: Difference,
    /// Distances from B's surface to A.
    pub b_to_a: Difference,
    /// The largest distance from a place of either surface to the other one.
    pub hausdorff: f64,
    /// The motion that brought B onto A, if that was requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aligned: Option<Motion>,
    /// Parameters that both have, in A's order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parameters: Vec<ParameterDifference>,
    /// Names of the parameters that only A has.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub only_a: Vec<String>,
    /// Names of the parameters that only B has.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub only_b: Vec<String>,
    /// Whether all parameters with a standard deviation are alike.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub together: Option<JointTest>,
    /// How much of the distances from A to B the differences of the parameters explain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub explained: Option<ExplainedDifference>,
    /// Sentences for the user.
    pub warnings: Vec<String>,
}

/// Meaning of the sign of distances.
const SIGN_CONVENTION: &str = "positive: the other surface lies outside of this one";

/// Why two surfaces cannot be compared.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CompareError {
    /// A surface cannot be sampled.
    #[error("{side}: {error}")]
    Surface {
        /// `A` or `B`.
        side: &'static str,
        /// The reason.
        error: MeasureError,
    },
    /// They are of different sizes, and nothing of one has a counterpart in the other.
    #[error("nothing of one is beside the other: {0}")]
    Unlike(String),
    /// Nothing of one has a counterpart in the other.
    #[error(
        "hardly a place of A has a counterpart on B within {max_distance:.3} mm that faces the same way; the middle of B is {beside:.3} mm \
         from that of A. Surfaces are compared where they are: `gmlc fit` brings a model to a mesh, and its fit.json can be A or B; \
         --align brings two states of one model together; or raise --max-distance"
    )]
    Apart {
        /// The maximum distance. Millimetres.
        max_distance: f64,
        /// Millimetres.
        beside: f64,
    },
    /// Only states of one model can be aligned.
    #[error(
        "--align brings two states of one model together by its parts, and these are {0}; `gmlc fit` brings a model to a mesh"
    )]
    NotAligned(&'static str),
    /// The triangles lie in each other, and there are many.
    #[error(
        "the triangles lie in each other or are needles: some {tests:.0e} of them lie about the samples, of which {MOST_WORK:.0e} are looked at; \
         remove what is there several times, or ask for it by --resolution"
    )]
    Tangled {
        /// Triangles about all samples at the coarsest resolution.
        tests: f64,
    },
    /// The user ended the work.
    #[error("interrupted")]
    Interrupted,
}

impl CompareError {
    /// The error of sampling a surface. An interrupt is no fault of that surface.
    fn of_surface(side: &'static str, error: MeasureError) -> Self {
        match error {
            MeasureError::Interrupted => Self::Interrupted,
            error => Self::Surface { side, error },
        }
    }
}

impl From<EvaluationError> for CompareError {
    fn from(error: EvaluationError) -> Self {
        Self::of_surface("A", error.into())
    }
}

/// Compares two surfaces.
///
/// # Errors
/// A surface cannot be evaluated or sampled, or nothing of one has a counterpart in the other.
pub fn compare(
    a: &Side<'_>,
    b: &Side<'_>,
    options: &CompareOptions,
    progress: &dyn Progress,
) -> Result<Comparison, CompareError> {
    let of = |side| move |error| CompareError::of_surface(side, error);
    let motion = if options.align { Some(alignment(&a.surface, &b.surface)?) } else { None };
    let surface_b = motion.map_or(b.surface, |motion| moved(b.surface, motion));
    progress.report("sampling the surfaces", f64::NAN, "");
    let at = |resolution| -> Result<[Prepared<'_>; 2], CompareError> {
        let a = Prepared::new(a.surface, resolution, progress).map_err(of("A"))?;
        Ok([a, Prepared::new(surface_b, resolution, progress).map_err(of("B"))?])
    };
    let (mut prepared, coarser) = match options.resolution {
        Some(resolution) => (at(resolution)?, None),
        None => bearable(at)?,
    };
    let sizes = [prepared[0].bounds().diagonal(), prepared[1].bounds().diagonal()];
    let max_distance = options.max_distance.unwrap_or(MAX_DISTANCE * sizes[0].min(sizes[1]));
    prepared::turn_alike(&mut prepared, max_distance).map_err(of("B"))?;
    let [first, second] = &prepared;
    if progress.cancelled() {
        return Err(CompareError::Interrupted);
    }
    progress.report("measuring distances", f64::NAN, &format!("{} places", first.len() + second.len()));
    let (from_a, from_b) = (first.distances(second, max_distance), second.distances(first, max_distance));
    if from_a.is_little() && from_b.is_little() {
        return Err(apart(first.bounds(), second.bounds(), max_distance));
    }
    if progress.cancelled() {
        return Err(CompareError::Interrupted);
    }
    let (a_to_b, b_to_a) = (from_a.difference(), from_b.difference());
    // An alignment has taken back what moves the model as a whole: B no longer lies apart by that.
    let rigid = match first.surface.parametrised.as_ref().filter(|_| options.align) {
        Some(model) => RigidParts::of(&model.reach, &model.motion())?,
        None => None,
    };
    let of_whole = rigid.as_ref().map_or(&[][..], |rigid| &rigid.of_whole);
    let parameters = a.states.zip(b.states).map(|(a, b)| parameters::compare(&a, &b, of_whole));
    let parameters = parameters.unwrap_or_default();
    let explained =
        explained::explain(first, &from_a.of_texels, &parameters.differences, rigid.as_ref()).map_err(of("A"))?;
    let mut warnings: Vec<String> = unlike(sizes).into_iter().chain(coarser).collect();
    warnings.extend(first.notices("A").chain(second.notices("B")));
    warnings.extend(parameters.warnings);
    Ok(Comparison {
        sign_convention: SIGN_CONVENTION.to_owned(),
        unit: "mm".to_owned(),
        max_distance,
        spacing: [first.spacing(), second.spacing()],
        a: first.body().map_err(of("A"))?,
        b: second.body().map_err(of("B"))?,
        hausdorff: a_to_b.hausdorff.distance.max(b_to_a.hausdorff.distance),
        a_to_b,
        b_to_a,
        aligned: motion,
        parameters: parameters.differences,
        only_a: parameters.only_a,
        only_b: parameters.only_b,
        together: parameters.together,
        explained,
        warnings,
    })
}

/// The surfaces at the finest resolution that takes a bearable time, with a sentence if that is coarser than usual.
fn bearable<'a>(
    at: impl Fn(Resolution) -> Result<[Prepared<'a>; 2], CompareError>,
) -> Result<([Prepared<'a>; 2], Option<String>), CompareError> {
    let [finest, others @ ..] = SIDES;
    let mut prepared = at(Resolution::Side(finest))?;
    let mut coarser = None;
    for side in others {
        if work(&prepared) <= WORK {
            break;
        }
        prepared = at(Resolution::Side(side))?;
        coarser = Some(format!(
            "the surfaces are sampled as coarsely as {side} x {side} texels, since triangles lie in each other or are needles, which takes long; \
             --resolution {finest} samples them as usual"
        ));
    }
    let tests = work(&prepared);
    if tests > MOST_WORK { Err(CompareError::Tangled { tests }) } else { Ok((prepared, coarser)) }
}

/// The triangles that lie about all places of two surfaces, of which each is searched for the nearest one.
fn work([a, b]: &[Prepared<'_>; 2]) -> f64 {
    let of = |from: &Prepared<'_>, to: &Prepared<'_>| from.len() as f64 * to.overlap();
    of(a, b) + of(b, a)
}

fn apart(a: Bounds, b: Bounds, max_distance: f64) -> CompareError {
    match unlike([a.diagonal(), b.diagonal()]) {
        None => CompareError::Apart { max_distance, beside: a.centre().distance(b.centre()) },
        Some(sentence) => CompareError::Unlike(sentence),
    }
}

/// A sentence on surfaces of so different sizes that the unit of one may be wrong. Millimetres.
fn unlike([a, b]: [f64; 2]) -> Option<String> {
    let is_unlike = !(1.0 / UNLIKE..UNLIKE).contains(&(a / b));
    is_unlike.then(|| {
        format!(
            "A is {a:.3} mm across, and B {b:.3} mm: is the unit right? (--unit-a and --unit-b name those of meshes)"
        )
    })
}

/// The motion from B to A that brings equal places (u, v) of equal parts together, in the sense of least squares.
fn alignment(a: &Reference<'_>, b: &Reference<'_>) -> Result<Motion, CompareError> {
    let (Reference::Model { model: first, .. }, Reference::Model { model: second, .. }) = (a, b) else {
        return Err(CompareError::NotAligned("not two models"));
    };
    if !first.parts().iter().map(|p| &p.name).eq(second.parts().iter().map(|p| &p.name)) {
        return Err(CompareError::NotAligned("models with other parts"));
    }
    let places = |surface: &Reference<'_>| -> Result<Vec<[f64; 3]>, EvaluationError> {
        let Reference::Model { model, x, motion } = surface else { return Ok(Vec::new()) };
        let instance = model.instantiate(x)?;
        let mesh = Tessellation::uniform(*model, &*instance, SEGMENTS, SEGMENTS)?.mesh;
        Ok(mesh.positions.into_iter().map(|p| motion.point(p)).collect())
    };
    Ok(Motion::between(&places(b)?, &places(a)?))
}

/// A model's surface moved.
fn moved(surface: Reference<'_>, by: Motion) -> Reference<'_> {
    match surface {
        Reference::Model { model, x, motion } => Reference::Model { model, x, motion: by.after(&motion) },
        Reference::Mesh(mesh) => Reference::Mesh(mesh),
    }
}
