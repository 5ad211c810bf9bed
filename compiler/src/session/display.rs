//! Values as text.

use super::{Data, Value};
use crate::check::typed::Dimension;
use std::fmt::{Display, Formatter, Result};

impl Display for Value {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        self.data.fmt(f)
    }
}

impl Display for Data {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self.common() {
            Some(dimension) => {
                self.bare(f)?;
                let unit = shown_unit(dimension);
                if unit.is_empty() { Ok(()) } else { write!(f, " {unit}") }
            }
            None => self.each(f),
        }
    }
}

impl Data {
    /// The dimension of all numbers, where there is nothing else.
    fn common(&self) -> Option<Dimension> {
        match self {
            Data::Number { unit, .. } => Some(*unit),
            Data::Tuple(parts) | Data::Array(parts) => {
                let first = parts.first()?.common()?;
                parts[1..].iter().all(|p| p.common() == Some(first)).then_some(first)
            }
            _ => None,
        }
    }

    /// Numbers without their unit.
    fn bare(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Data::Number { value, unit } => f.write_str(&number(if unit.angle { value.to_degrees() } else { *value })),
            Data::Tuple(parts) => list(f, "(", ")", parts, |p, f| p.bare(f)),
            Data::Array(parts) => list(f, "[", "]", parts, |p, f| p.bare(f)),
            other => other.each(f),
        }
    }

    fn each(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Data::Number { .. } => write!(f, "{self}"),
            Data::Int(k) => write!(f, "{k}"),
            Data::Bool(b) => write!(f, "{b}"),
            Data::Text(Some(text)) => write!(f, "{text:?}"),
            Data::Text(None) => f.write_str("<text>"),
            Data::Range(from, to) => write!(f, "{from}..{to}"),
            Data::Tuple(parts) => list(f, "(", ")", parts, |p, f| p.fmt(f)),
            Data::Array(parts) => list(f, "[", "]", parts, |p, f| p.fmt(f)),
            Data::Record(fields) => list(f, "{", "}", fields, |(name, p), f| write!(f, "{name}: {p}")),
            Data::Function(signature) => write!(f, "<{signature}>"),
        }
    }
}

fn list<T>(
    f: &mut Formatter<'_>,
    open: &str,
    close: &str,
    parts: &[T],
    each: impl Fn(&T, &mut Formatter<'_>) -> Result,
) -> Result {
    f.write_str(open)?;
    for (i, part) in parts.iter().enumerate() {
        if i > 0 {
            f.write_str(", ")?;
        }
        each(part, f)?;
    }
    f.write_str(close)
}

/// A number with six significant digits; a whole one in full. Negative zero is zero.
pub(super) fn number(x: f64) -> String {
    if !x.is_finite() {
        return x.to_string();
    }
    if x == x.trunc() && x.abs() < 1e15 {
        return format!("{}", x as i64);
    }
    let rounded = format!("{x:.5e}");
    let (mantissa, exponent) = rounded.split_once('e').unwrap_or((&rounded, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-5..15).contains(&exponent) {
        let digits = usize::try_from(5 - exponent).unwrap_or(0);
        let text = format!("{x:.digits$}");
        return if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text };
    }
    let mantissa = if mantissa.contains('.') { mantissa.trim_end_matches('0').trim_end_matches('.') } else { mantissa };
    format!("{mantissa}e{exponent}")
}

/// The unit of a value as it is printed: degrees for angles.
pub(super) fn shown_unit(d: Dimension) -> String {
    if d.angle { "deg".to_owned() } else { inner_unit(d) }
}

/// The unit of a value inside: millimetres and radians.
pub(super) fn inner_unit(d: Dimension) -> String {
    d.unit()
}
