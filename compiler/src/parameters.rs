//! The declarations of a script: parameters, inputs, parts, measures.

use crate::number::plain;
use crate::source::Span;
use serde::{Deserialize, Serialize};

/// The quantity that a parameter or input measures; values are in millimetres and radians.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Quantity {
    /// Without a unit.
    Real,
    /// Millimetres.
    Length,
    /// Radians.
    Angle,
    /// A whole number (inputs only).
    Int,
    /// 0 or 1 (inputs only).
    Bool,
}

impl Quantity {
    /// The unit of values: `mm`, `rad`, or empty.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Quantity::Length => "mm",
            Quantity::Angle => "rad",
            Quantity::Real | Quantity::Int | Quantity::Bool => "",
        }
    }

    /// A value as people write it, and its unit: angles in degrees.
    #[must_use]
    pub fn written(self, value: f64) -> (f64, &'static str) {
        match self {
            Quantity::Angle => (value.to_degrees(), "deg"),
            _ => (value, self.unit()),
        }
    }

    /// A value in full with its unit: `40mm`, `30deg`.
    #[must_use]
    pub fn shown(self, value: f64) -> String {
        let (value, unit) = self.written(value);
        // Degrees have the rounding of their conversion.
        let value = if self == Quantity::Angle { (value * 1e9).round() / 1e9 } else { value };
        format!("{}{unit}", plain(value))
    }
}

/// A continuous, free parameter of a model.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// The quantity that it measures.
    pub quantity: Quantity,
    /// Its default, within its bounds at the defaults.
    pub default: f64,
    /// Lower bound at the defaults; -infinity where there is none. (`Program::bounds` gives them at any x.)
    #[serde(with = "infinite_as_null")]
    pub lower: f64,
    /// Upper bound likewise.
    #[serde(with = "infinite_as_null")]
    pub upper: f64,
    /// The place of its declaration.
    #[serde(skip)]
    pub span: Span,
}

impl Parameter {
    /// `r = 40mm`.
    #[must_use]
    pub fn equals(&self, value: f64) -> String {
        format!("{} = {}", self.name, self.quantity.shown(value))
    }

    /// Whether a value is within its bounds. The rounding of a printed value does not count.
    ///
    /// # Errors
    /// The sentence: `r = 90mm is not within its bounds 15mm..80mm`.
    pub fn within(&self, value: f64, (low, high): (f64, f64)) -> Result<(), String> {
        let slack = 1e-9 * (1.0 + value.abs());
        if value >= low - slack && value <= high + slack {
            return Ok(());
        }
        let [low, high] = [low, high].map(|x| if x.is_finite() { self.quantity.shown(x) } else { String::new() });
        Err(format!("{} is not within its bounds {low}..{high}", self.equals(value)))
    }
}

/// Bounds of parameters from the results of the function that computes them: lower and upper of each, NaN where one
/// cannot be computed, which is then infinite; all are where there are no results.
pub(crate) fn bounds_of(results: Option<Vec<f64>>, parameters: usize) -> Vec<(f64, f64)> {
    let or = |x: f64, none: f64| if x.is_nan() { none } else { x };
    let results = results.unwrap_or_else(|| vec![f64::NAN; 2 * parameters]);
    results.chunks_exact(2).map(|b| (or(b[0], f64::NEG_INFINITY), or(b[1], f64::INFINITY))).collect()
}

/// A value given from outside, without derivative, fixed when the program is compiled.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Input {
    /// Its name.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// The quantity that it measures.
    pub quantity: Quantity,
    /// The value that it was compiled with.
    pub value: f64,
    /// Bounds; infinite where there is none.
    #[serde(with = "infinite_as_null")]
    pub lower: f64,
    /// Upper bound likewise.
    #[serde(with = "infinite_as_null")]
    pub upper: f64,
    /// The place of its declaration.
    #[serde(skip)]
    pub span: Span,
}

/// A value that a model reports, as an expression of its parameters.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Measure {
    /// `rim_diameter`, `pitch[2]`.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// The names of the parts whose measured points show it, too.
    pub parts: Vec<String>,
    /// The unit of its value: `mm`, `rad`, `mm^2` or another power of millimetres, or empty.
    pub unit: String,
    /// The place of its declaration.
    #[serde(skip)]
    pub span: Span,
}

/// A figure of parts of a model, which its measures use.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartFigure {
    /// Its kind.
    pub figure: Figure,
    /// The indices of the parts, ascending.
    pub parts: Vec<usize>,
    /// Those of the parts that it is to, of figures between parts.
    pub others: Vec<usize>,
}

/// The kind of a figure of parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Figure {
    /// Their area. Square millimetres.
    Area,
    /// The volume that they enclose. Cubic millimetres.
    Volume,
    /// A coordinate (0 to 2) of the centroid of that volume. Millimetres.
    Centroid(usize),
    /// The least distance to the others. Millimetres.
    Distance,
    /// The angle between the outward normals of plane parts and of the others. Radians, from 0 to pi.
    Angle,
}

/// One patch of surface of a model: a part, or one member of a group of parts.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Part {
    /// `body`, `hole[2]`, `leg.shaft`.
    pub name: String,
    /// The name without an index: `hole`.
    pub group: String,
    /// The indices of the parameters that this patch depends on, ascending.
    pub active: Vec<u32>,
}

/// JSON has no infinity: a missing bound is null.
mod infinite_as_null {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(x: &f64, s: S) -> Result<S::Ok, S::Error> {
        x.is_finite().then_some(*x).serialize(s)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<f64, D::Error> {
        Ok(Option::<f64>::deserialize(d)?.unwrap_or(f64::INFINITY))
    }
}
