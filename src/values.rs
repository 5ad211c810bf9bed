//! Values on the command line, such as `42mm`, `30deg`, `4` and `r=42mm`.

use crate::error::CommandError;
use gml_compiler::check::InputValue;
use gml_compiler::program::{Parameter, Quantity};

/// Units of values, with their quantity and size in millimetres or radians.
const UNITS: [(&str, Quantity, f64); 7] = [
    ("mm", Quantity::Length, 1.0),
    ("cm", Quantity::Length, 10.0),
    ("m", Quantity::Length, 1000.0),
    ("in", Quantity::Length, 25.4),
    ("deg", Quantity::Angle, std::f64::consts::PI / 180.0),
    ("rad", Quantity::Angle, 1.0),
    ("turn", Quantity::Angle, std::f64::consts::TAU),
];

/// Parses a value of the given quantity, in millimetres or radians. A length or an angle requires a unit, so that
/// nobody takes `r=4` for 4 mm and somebody else for 4 cm.
pub(crate) fn parse(what: &str, text: &str, quantity: Quantity) -> Result<f64, CommandError> {
    let text = text.trim();
    let wrong = |why: String| CommandError::usage(format!("{what}: '{text}' {why}"));
    if quantity == Quantity::Bool {
        return match text {
            "true" => Ok(1.0),
            "false" => Ok(0.0),
            _ => Err(wrong("is neither true nor false".into())),
        };
    }
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let (number, unit) = (digits.trim_end(), &text[digits.len()..]);
    let example = match quantity {
        Quantity::Length => "a length such as 42mm",
        Quantity::Angle => "an angle such as 30deg",
        Quantity::Int => "a whole number such as 6",
        Quantity::Real | Quantity::Bool => "a number such as 1.5",
    };
    let value: f64 = number.parse().map_err(|_| wrong(format!("is not {example}")))?;
    let scaled = match (unit, UNITS.iter().find(|u| u.0 == unit)) {
        ("", _) if matches!(quantity, Quantity::Real | Quantity::Int) || value == 0.0 => value,
        ("", _) => return Err(wrong(format!("has no unit: expected {example}"))),
        (_, Some((_, measured, size))) if *measured == quantity => value * size,
        (_, Some(_)) => return Err(wrong(format!("has the wrong unit: expected {example}"))),
        (_, None) => {
            let known: Vec<&str> = UNITS.iter().map(|u| u.0).collect();
            return Err(wrong(format!("has an unknown unit '{unit}' (known: {})", known.join(", "))));
        }
    };
    if !scaled.is_finite() {
        return Err(wrong("is not finite".into()));
    }
    if quantity == Quantity::Int && scaled.fract() != 0.0 {
        return Err(wrong("is not a whole number".into()));
    }
    Ok(scaled)
}

/// Parses a positive length, in millimetres.
pub(crate) fn positive_length(option: &str, text: &str) -> Result<f64, CommandError> {
    let value = parse(option, text, Quantity::Length)?;
    if value > 0.0 { Ok(value) } else { Err(CommandError::usage(format!("{option}: '{text}' is not positive"))) }
}

/// Parses an angle above zero and up to a right angle, in radians.
pub(crate) fn acute_angle(option: &str, text: &str) -> Result<f64, CommandError> {
    let value = parse(option, text, Quantity::Angle)?;
    if value > 0.0 && value <= 1.0001 * std::f64::consts::FRAC_PI_2 {
        return Ok(value);
    }
    Err(CommandError::usage(format!("{option}: '{text}' must be above 0deg and at most 90deg")))
}

/// Parses a length that is not negative, in millimetres.
pub(crate) fn length(option: &str, text: &str) -> Result<f64, CommandError> {
    let value = parse(option, text, Quantity::Length)?;
    if value >= 0.0 { Ok(value) } else { Err(CommandError::usage(format!("{option}: '{text}' is negative"))) }
}

/// Parses a tolerance: its ends in millimetres. `0.5mm` is from -0.5 to 0.5, `+0.3/-0.1mm` from -0.1 to 0.3 in either
/// order; the last unit holds for both numbers.
pub(crate) fn tolerance(option: &str, text: &str) -> Result<(f64, f64), CommandError> {
    let Some((first, second)) = text.split_once('/') else {
        return positive_length(option, text).map(|t| (-t, t));
    };
    let second = second.trim();
    let unit = &second[second.trim_end_matches(|c: char| c.is_ascii_alphabetic()).len()..];
    let has_unit = first.trim_end().ends_with(|c: char| c.is_ascii_alphabetic());
    let first = if has_unit { first.to_owned() } else { format!("{}{unit}", first.trim_end()) };
    let (a, b) = (parse(option, &first, Quantity::Length)?, parse(option, second, Quantity::Length)?);
    if a == b {
        return Err(CommandError::usage(format!("{option}: '{text}' allows only one value: both ends are equal")));
    }
    Ok((a.min(b), a.max(b)))
}

/// Checks that a fraction is between 0 and 1.
pub(crate) fn fraction(option: &str, value: f64) -> Result<f64, CommandError> {
    if (0.0..=1.0).contains(&value) {
        Ok(value)
    } else {
        Err(CommandError::usage(format!("{option}: {value} is not between 0 and 1")))
    }
}

/// Splits `name=value`.
pub(crate) fn assignment<'a>(option: &str, text: &'a str) -> Result<(&'a str, &'a str), CommandError> {
    text.split_once('=')
        .map(|(name, value)| (name.trim(), value.trim()))
        .filter(|(name, _)| !name.is_empty())
        .ok_or_else(|| {
            let given = format!("{option} {text}");
            CommandError::usage(format!("{}: expected NAME=VALUE, such as r=42mm", given.trim_end()))
        })
}

/// The index of a parameter by its name.
pub(crate) fn parameter(option: &str, name: &str, parameters: &[Parameter]) -> Result<usize, CommandError> {
    let known = parameters.iter().map(|p| p.name.as_str());
    known.clone().position(|p| p == name).ok_or_else(|| CommandError::usage(unknown(option, "parameter", name, known)))
}

/// Parameter values from `-p` options: indices and values.
pub(crate) fn parameters(texts: &[String], known: &[Parameter]) -> Result<Vec<(usize, f64)>, CommandError> {
    texts
        .iter()
        .map(|text| {
            let (name, value) = assignment("-p", text)?;
            let index = parameter("-p", name, known)?;
            Ok((index, parse(&format!("-p {name}"), value, known[index].quantity)?))
        })
        .collect()
}

/// Parses the value of an input: true or false, a whole number, or a number with an optional unit. The compiler checks
/// it against the declaration.
pub(crate) fn input_value(name: &str, text: &str) -> Result<InputValue, CommandError> {
    let what = format!("--input {name}");
    if let Ok(flag) = text.parse() {
        return Ok(InputValue::Bool(flag));
    }
    if let Ok(whole) = text.parse() {
        return Ok(InputValue::Int(whole));
    }
    if matches!(text.to_lowercase().as_str(), "yes" | "no" | "on" | "off" | "true" | "false") {
        return Err(CommandError::usage(format!("{what}: '{text}' is not a value: write true or false")));
    }
    let quantity = UNITS.iter().filter(|u| text.ends_with(u.0)).map(|u| u.1).next_back();
    parse(&what, text, quantity.unwrap_or(Quantity::Real)).map(InputValue::Real)
}

fn unknown<'a>(option: &str, kind: &str, name: &str, known: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = known.collect();
    if names.is_empty() {
        return format!("{option} {name}: the model has no {kind}s");
    }
    format!("{option} {name}: the model has no {kind} of that name; it has {}", names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_scaled_to_millimetres_and_radians() {
        assert_eq!(parse("r", "42mm", Quantity::Length).ok(), Some(42.0));
        assert_eq!(parse("r", "4.2 cm", Quantity::Length).ok(), Some(42.0));
        assert_eq!(parse("r", "-1e-3m", Quantity::Length).ok(), Some(-1.0));
        assert_eq!(parse("a", "0.5turn", Quantity::Angle).ok(), Some(std::f64::consts::PI));
        assert_eq!(parse("s", "1e2", Quantity::Real).ok(), Some(100.0));
        assert_eq!(parse("x", "0", Quantity::Length).ok(), Some(0.0), "zero is zero in any unit");
    }

    #[test]
    fn tolerances_have_one_end_or_two() {
        for (text, expected) in [
            ("0.5mm", (-0.5, 0.5)),
            ("+0.3/-0.1mm", (-0.1, 0.3)),
            ("-0.1mm/+0.03cm", (-0.1, 0.3)),
            ("0/0.2 mm", (0.0, 0.2)),
        ] {
            let (low, high) = tolerance("t", text).expect(text);
            assert!((low - expected.0).abs() < 1e-15 && (high - expected.1).abs() < 1e-15, "{text}: {low} {high}");
        }
        for text in ["0.5", "0mm", "-1mm", "1mm/1mm", "+0.3/-0.1", "1mm/", "/", "1mm/2mm/3mm", "1deg/2mm"] {
            assert!(matches!(tolerance("t", text), Err(CommandError::Usage(_))), "{text}");
        }
    }

    #[test]
    fn wrong_units_are_refused_with_an_example() {
        for (text, quantity) in [
            ("42", Quantity::Length),
            ("42deg", Quantity::Length),
            ("1mm", Quantity::Angle),
            ("1mm", Quantity::Real),
            ("1.5", Quantity::Int),
            ("1ft", Quantity::Length),
            ("inf", Quantity::Real),
            ("", Quantity::Length),
            ("yes", Quantity::Bool),
        ] {
            let error = parse("it", text, quantity);
            assert!(matches!(error, Err(CommandError::Usage(_))), "{text}: {error:?}");
        }
    }
}
