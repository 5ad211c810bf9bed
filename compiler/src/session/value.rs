//! Values as data.

use crate::check::typed::Dimension;
use crate::source::Span;
use serde::Serialize;

/// A value with its type. `Display` prints it with its dimension.
///
/// Numbers are printed with about six significant digits, whole ones in full; angles in degrees. What is made of
/// numbers of one dimension alone has its unit once, at the end: `(1, 2, 3) mm`, `[1, 2] mm`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Value {
    /// The data.
    pub data: Data,
    /// Its type in words: `a length`, `a point in space`, `a function of 2 arguments`.
    #[serde(rename = "type")]
    pub ty: String,
    /// The line that it belongs to.
    #[serde(skip)]
    pub span: Span,
}

/// The components of a value, in millimetres and radians.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Data {
    /// A number that is not whole by its type.
    Number {
        /// In millimetres to some power, or radians.
        value: f64,
        /// `mm`, `mm^2`, `rad`, or empty.
        #[serde(serialize_with = "unit_text")]
        unit: Dimension,
    },
    /// A whole number.
    Int(i64),
    /// A truth value.
    Bool(bool),
    /// A text; nothing where it cannot be followed to where it is written.
    Text(Option<String>),
    /// From the first up to but without the second.
    Range(i64, i64),
    /// Vectors and points are tuples.
    Tuple(Vec<Data>),
    /// Elements of one type.
    Array(Vec<Data>),
    /// Fields in the order in which they were written.
    Record(Vec<(String, Data)>),
    /// A function, surface, curve or model: `surface (u, v) -> point3`.
    Function(String),
}

fn unit_text<S: serde::Serializer>(dimension: &Dimension, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&super::display::inner_unit(*dimension))
}
