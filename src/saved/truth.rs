//! The truth of a virtual scan (`gmlc scan --truth`) in the place of a fit: its values and its pose, of which nothing
//! is uncertain.

use gml_compiler::program::Quantity;
use gml_runtime::fit::{FitResult, FittedInput, FittedParameter};
use gml_runtime::model::Motion;
use serde::Deserialize;
use serde::de::Error as D;
use std::collections::BTreeMap;

/// What is taken of the file. It does not name the quantities of its values, which are in millimetres and radians.
#[derive(Deserialize)]
struct TruthFile {
    #[serde(default)]
    model: String,
    /// A mesh that was scanned has none.
    script: Option<String>,
    #[serde(default)]
    script_sha256: Option<String>,
    #[serde(default)]
    inputs: Vec<FittedInput>,
    #[serde(default)]
    parameters: BTreeMap<String, f64>,
    pose: Motion,
}

/// Whether a text is the truth of a virtual scan, by the fields that no other file of gmlc has.
pub(super) fn is_truth(text: &str) -> bool {
    // Most files are none, and are not read twice.
    let has = |field: &str| text.contains(field);
    has("\"scanner\"") && has("\"euler\"") && has("\"pitch\"") && {
        let text = text.trim_start_matches('\u{feff}');
        let file = serde_json::from_str::<serde_json::Map<String, serde_json::Value>>(text);
        file.is_ok_and(|file| ["scanner", "euler", "pitch"].iter().all(|field| file.contains_key(*field)))
    }
}

/// The values of a truth as those of a fit that is known to be right.
pub(super) fn parse(text: &str) -> Result<FitResult, serde_json::Error> {
    let TruthFile { model, script, script_sha256, inputs, parameters, pose } = serde_json::from_str(text)?;
    let Some(script) = script else {
        return Err(D::custom("it is of a mesh, which has no parameters; no field `script`"));
    };
    let parameter = |(name, value): (String, f64)| FittedParameter::new(name, value, Quantity::Real);
    let parameters = parameters.into_iter().map(parameter).collect();
    // A scan in the script's own position has no pose that a command would have to leave out.
    let pose = (pose != Motion::IDENTITY).then_some(pose);
    Ok(FitResult { model, script, script_sha256, inputs, parameters, pose, ..FitResult::default() })
}
