//! What a result was made with: so that it can be made again, and told from others.

use serde::{Deserialize, Serialize};

/// How a result was made.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// The program and its version.
    pub tool: String,
    /// When the work began, in UTC (ISO 8601).
    pub time: String,
    /// The words of the command line.
    pub command: Vec<String>,
    /// The files that were read.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<UsedFile>,
    /// All options that have a value.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub settings: Vec<Setting>,
    /// What the user states: the part, the operator, the instrument, its calibration and so on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fields: Vec<Field>,
}

/// A file that was read.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UsedFile {
    /// `scan`, `script`, `reference`, `fit` or `fields`.
    pub role: String,
    /// Its name, without the folders that it lies in.
    pub name: String,
    /// SHA-256 of its bytes, in hexadecimal.
    pub sha256: String,
}

/// An option and its value.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Setting {
    /// Its name on the command line, without dashes.
    pub name: String,
    /// Its values as they are written there.
    pub values: Vec<String>,
    /// Whether the user gave it; otherwise it is the default.
    pub given: bool,
}

/// A statement of the user.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// What it is about.
    pub name: String,
    /// What is said of it.
    pub value: String,
}

/// A sum as it is written: two digits a byte.
#[must_use]
pub fn hexadecimal(sum: impl AsRef<[u8]>) -> String {
    sum.as_ref().iter().map(|byte| format!("{byte:02x}")).collect()
}
