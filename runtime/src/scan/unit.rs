//! The unit of a file's coordinates, which most formats do not say.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// The length in millimetres of the metre, which many formats have.
pub(super) const METRE: f64 = 1000.0;

const COMMENT: &str = "gmlc, unit: ";
/// The number of bytes in which a comment of gmlc stands.
const COMMENTS: usize = 1024;

/// The unit of a file's coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// Micrometres.
    Um,
    /// Millimetres.
    #[default]
    Mm,
    /// Centimetres.
    Cm,
    /// Metres.
    M,
    /// Inches.
    In,
    /// Feet.
    Ft,
}

impl Unit {
    /// All units.
    pub const ALL: [Self; 6] = [Self::Um, Self::Mm, Self::Cm, Self::M, Self::In, Self::Ft];

    /// Its length in millimetres.
    #[must_use]
    pub fn millimetres(self) -> f64 {
        self.describe().1
    }

    /// Its abbreviation.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.describe().0
    }

    /// The text by which files that have no unit of their own say theirs, in a comment.
    pub(crate) fn comment(self) -> String {
        format!("{COMMENT}{self}")
    }

    /// The unit that a comment of gmlc at the beginning of a file says.
    pub(super) fn in_comment(head: &[u8]) -> Option<Self> {
        let head = &head[..head.len().min(COMMENTS)];
        let at = head.windows(COMMENT.len()).position(|text| text == COMMENT.as_bytes())?;
        let word = head[at + COMMENT.len()..].split(|b| !b.is_ascii_alphabetic()).next()?;
        std::str::from_utf8(word).ok()?.parse().ok()
    }

    fn describe(self) -> (&'static str, f64) {
        match self {
            Self::Um => ("um", 1e-3),
            Self::Mm => ("mm", 1.0),
            Self::Cm => ("cm", 10.0),
            Self::M => ("m", METRE),
            Self::In => ("in", 25.4),
            Self::Ft => ("ft", 304.8),
        }
    }
}

/// The name of the unit of a length in millimetres, or the length.
pub(super) fn text(millimetres: f64) -> String {
    let known = Unit::ALL.into_iter().find(|unit| unit.millimetres() == millimetres);
    known.map_or_else(|| format!("{millimetres} mm"), |unit| unit.to_string())
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A word that is not a unit of length.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("`{0}` is not a unit of length; expected um, mm, cm, m, in or ft")]
pub struct UnknownUnit(
    /// The word.
    pub String,
);

impl FromStr for Unit {
    type Err = UnknownUnit;

    /// Reads abbreviations, and names in the singular or the plural, in British or American spelling. Capitals mean the
    /// same as small letters: there is no megametre among the units, with which the `Mm` of SI could be mistaken.
    fn from_str(text: &str) -> Result<Self, UnknownUnit> {
        let word = text.trim().to_lowercase();
        let of_name = match word.strip_suffix('s').unwrap_or(&word) {
            "micron" | "micrometre" | "micrometer" => Some(Self::Um),
            "millimetre" | "millimeter" => Some(Self::Mm),
            "centimetre" | "centimeter" => Some(Self::Cm),
            "metre" | "meter" => Some(Self::M),
            _ => None,
        };
        let unit = match word.as_str() {
            // The sign of micro-, and the Greek letter.
            "\u{b5}m" | "\u{3bc}m" => Some(Self::Um),
            "inch" | "inches" => Some(Self::In),
            "foot" | "feet" => Some(Self::Ft),
            _ => of_name.or_else(|| Self::ALL.into_iter().find(|unit| unit.name() == word)),
        };
        unit.ok_or_else(|| UnknownUnit(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for unit in Unit::ALL {
            assert_eq!(unit.to_string().parse(), Ok(unit));
        }
        for unit in Unit::ALL {
            assert_eq!(Unit::in_comment(format!("ply\ncomment {}\nx", unit.comment()).as_bytes()), Some(unit));
        }
        assert_eq!(Unit::in_comment(b"# gmlc, unit: furlong\n"), None);
        assert!("yd".parse::<Unit>().unwrap_err().to_string().contains("mm, cm"));
    }

    #[test]
    fn aliases_are_units() {
        let known = [
            (Unit::Um, "um UM \u{b5}m \u{3bc}m \u{39c}M micron Microns micrometre micrometers"),
            (Unit::Mm, "mm MM Mm millimetre Millimeters MILLIMETRES millimeter"),
            (Unit::Cm, "cm CM centimetre centimeters"),
            (Unit::M, "m M metre METER metres meters"),
            (Unit::In, "in IN inch Inches"),
            (Unit::Ft, "ft FT foot Feet"),
        ];
        for (unit, words) in known {
            for word in words.split(' ') {
                assert_eq!(word.parse(), Ok(unit), "{word}");
                assert_eq!(format!(" {word}\t").parse(), Ok(unit), "{word}");
            }
        }
        for word in
            ["", "s", "ms", "mms", "ins", "fts", "foots", "inche", "km", "dm", "nm", "megametre", "me ter", "m2"]
        {
            assert_eq!(word.parse::<Unit>(), Err(UnknownUnit(word.to_owned())), "{word}");
        }
    }
}
