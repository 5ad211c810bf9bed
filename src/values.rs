//! Values on the command line, such as `42mm`, `30deg`, `4` and `r=42mm`.

use crate::error::CommandError;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use gml_compiler::check::InputValue;
use gml_compiler::number;
use gml_compiler::program::{Input, Program, Quantity};
use gml_compiler::suggest::nearest;
use gml_compiler::syntax;
use gml_runtime::export::scan::ScanFormat;
use gml_runtime::mesh::Bounds;
use gml_runtime::model::{LARGEST, SMALLEST};
use gml_runtime::variance::{DecisionRule, Resolution, Tolerance};
use std::fmt::Display;
use std::str::FromStr;

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

/// Parses a value of the given quantity, in millimetres or radians; the error is a predicate such as `is not finite`.
/// A length or an angle requires a unit, so that nobody takes `r=4` for 4 mm and somebody else for 4 cm.
pub(crate) fn parse(text: &str, quantity: Quantity) -> Result<f64, String> {
    let text = text.trim();
    if quantity == Quantity::Bool {
        return match text {
            "true" => Ok(1.0),
            "false" => Ok(0.0),
            _ => Err("is neither true nor false".into()),
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
    let value: f64 = number.parse().map_err(|_| format!("is not {example}"))?;
    let scaled = match (unit, UNITS.iter().find(|u| u.0 == unit)) {
        ("", _) if matches!(quantity, Quantity::Real | Quantity::Int) || value == 0.0 => value,
        ("", _) => return Err(format!("has no unit: expected {example}")),
        (_, Some((_, measured, size))) if *measured == quantity => value * size,
        (_, Some(_)) => return Err(format!("has the wrong unit: expected {example}")),
        (_, None) => {
            let known: Vec<&str> = UNITS.iter().map(|u| u.0).collect();
            return Err(format!("has an unknown unit '{unit}' (known: {})", known.join(", ")));
        }
    };
    if !scaled.is_finite() {
        return Err("is not finite".into());
    }
    if quantity == Quantity::Int && scaled.fract() != 0.0 {
        return Err("is not a whole number".into());
    }
    Ok(scaled)
}

/// A value that an option can have.
#[derive(Clone, Copy)]
pub(crate) struct Choice<T: 'static> {
    pub(crate) name: &'static str,
    pub(crate) help: &'static str,
    pub(crate) value: T,
}

/// The parser of an option with a few named values.
pub(crate) fn one_of<T: Copy + Send + Sync>(choices: &'static [Choice<T>]) -> impl TypedValueParser<Value = T> {
    let names = PossibleValuesParser::new(choices.iter().map(|c| PossibleValue::new(c.name).help(c.help)));
    names.try_map(|name| choices.iter().find(|c| c.name == name).map(|c| c.value).ok_or("is not one of them"))
}

/// The largest length of an option in millimetres, which is that of a scan's coordinates too: a thousand kilometres.
const LONGEST: f64 = 1e12;
/// The smallest length above zero likewise: a millionth of an atom.
const SHORTEST: f64 = 1e-12;

/// Parses a positive length, in millimetres.
///
/// # Errors
/// A sentence without a subject: what the text is, and what is expected.
pub fn positive_length(text: &str) -> Result<f64, String> {
    match length(text)? {
        x if x > 0.0 => Ok(x),
        _ => Err("is not above zero: expected a length such as 42mm".into()),
    }
}

/// Parses a length that is not negative, in millimetres.
pub(crate) fn length(text: &str) -> Result<f64, String> {
    match parse(text, Quantity::Length)? {
        x if x < 0.0 => Err("is below zero: expected a length such as 42mm".into()),
        x if x > LONGEST => Err(format!("is beyond {LONGEST:e} mm")),
        x if x > 0.0 && x < SHORTEST => Err(format!("is below {SHORTEST:e} mm")),
        x => Ok(x),
    }
}

/// A parser of whole numbers from `low` to `high`, which says so in words.
pub(crate) fn whole<T>(low: T, high: T) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr + PartialOrd + Display + Copy + Send + Sync + 'static,
{
    move |text| match text.trim().parse::<T>() {
        Ok(value) if low <= value && value <= high => Ok(value),
        _ => Err(format!("is not a whole number from {low} to {high}")),
    }
}

/// Parses an angle above zero and up to a right angle, in radians.
pub(crate) fn acute_angle(text: &str) -> Result<f64, String> {
    let allowed = |x: &f64| *x > 0.0 && *x <= 1.0001 * std::f64::consts::FRAC_PI_2;
    Some(parse(text, Quantity::Angle)?).filter(allowed).ok_or_else(|| "must be above 0deg and at most 90deg".into())
}

/// Parses a fraction.
pub(crate) fn fraction(text: &str) -> Result<f64, String> {
    let value = parse(text, Quantity::Real)?;
    if (0.0..=1.0).contains(&value) { Ok(value) } else { Err("is not between 0 and 1".into()) }
}

/// Parses a box: ranges of x, y and z, whose ends may be left out. Millimetres.
pub(crate) fn crop(text: &str) -> Result<Bounds, String> {
    const EXPECTED: &str = "expected three ranges such as 1.2m..1.8m,..,0mm..2m";
    let mut bounds = Bounds { low: [f64::NEG_INFINITY; 3].into(), high: [f64::INFINITY; 3].into() };
    let ranges: Vec<&str> = text.split(',').collect();
    if ranges.len() != 3 {
        return Err(format!("has {} ranges: {EXPECTED}", ranges.len()));
    }
    for (axis, range) in ranges.into_iter().enumerate() {
        let Some((low, high)) = range.split_once("..") else {
            return Err(format!("has a range without `..`: {EXPECTED}"));
        };
        for (end, text) in [(&mut bounds.low[axis], low), (&mut bounds.high[axis], high)] {
            if !text.trim().is_empty() {
                *end = parse(text, Quantity::Length).map_err(|e| format!("has an end, `{}`, that {e}", text.trim()))?;
            }
        }
        if bounds.low[axis] > bounds.high[axis] {
            return Err(format!("has a range, `{}`, that ends before it begins", range.trim()));
        }
    }
    Ok(bounds)
}

/// Parses the name of a format of scans.
pub(crate) fn scan_format(text: &str) -> Result<ScanFormat, String> {
    ScanFormat::named(text.trim_start_matches('.')).ok_or_else(|| {
        let known: Vec<&str> = ScanFormat::ALL.iter().map(|(name, _)| *name).collect();
        format!("is not one of {}", known.join(", "))
    })
}

/// Parses a tolerance: `0.5mm` is from -0.5 to 0.5, `+0.3/-0.1mm` from -0.1 to 0.3 in either order; the last unit holds
/// for both numbers.
pub(crate) fn tolerance(text: &str) -> Result<Tolerance, String> {
    if text.contains('=') {
        return Err(
            "holds for all parts: that of one part is in its script, such as `part lid tolerance 0.2mm = ...`".into()
        );
    }
    if text.contains("..") {
        return Err("has two ends, which are written as +0.3/-0.1mm".into());
    }
    let Some((first, second)) = text.split_once('/') else {
        return positive_length(text).map(|t| Tolerance { lower: -t, upper: t });
    };
    let second = second.trim();
    let unit = &second[second.trim_end_matches(|c: char| c.is_ascii_alphabetic()).len()..];
    let has_unit = first.trim_end().ends_with(|c: char| c.is_ascii_alphabetic());
    let first = if has_unit { first.to_owned() } else { format!("{}{unit}", first.trim_end()) };
    let (a, b) = (parse(&first, Quantity::Length)?, parse(second, Quantity::Length)?);
    if a == b {
        return Err("allows only one value: both ends are equal".into());
    }
    // Not -0, which would be printed with its sign.
    Ok(Tolerance { lower: a.min(b) + 0.0, upper: a.max(b) + 0.0 })
}

/// Parses a decision rule: `guarded`, `simple` or `p=0.95`.
pub(crate) fn decision(text: &str) -> Result<DecisionRule, String> {
    match text.trim() {
        "guarded" => return Ok(DecisionRule::Guarded),
        "simple" => return Ok(DecisionRule::Simple),
        _ => {}
    }
    let (name, value) = assignment(text).map_err(|_| "expected guarded, simple or p=0.95")?;
    let p = if name == "p" { parse(&value, Quantity::Real)? } else { f64::NAN };
    // At a half or less a part could conform and not conform.
    if p > 0.5 && p < 1.0 {
        Ok(DecisionRule::Probability(p))
    } else {
        Err("expected p above 0.5 and below 1, such as p=0.95".into())
    }
}

/// Parses a number of texels per side, which must be a power of two because X3D viewers resample other textures, or the
/// width of a texel.
pub(crate) fn resolution(text: &str) -> Result<Resolution, String> {
    let Ok(size) = text.trim().parse::<u32>() else { return positive_length(text).map(Resolution::Texel) };
    if size.is_power_of_two() && (SMALLEST..=LARGEST).contains(&size) {
        return Ok(Resolution::Side(size));
    }
    Err(format!("must be a power of two from {SMALLEST} to {LARGEST}, such as 1024, or a length such as 0.2mm"))
}

/// Parses an amount of memory, in bytes.
pub(crate) fn memory(text: &str) -> Result<u64, String> {
    const UNITS: [(&str, f64); 4] = [("GiB", 1_073_741_824.0), ("MiB", 1_048_576.0), ("GB", 1e9), ("MB", 1e6)];
    let amount =
        UNITS.iter().find_map(|(unit, size)| Some(text.trim().strip_suffix(unit)?.trim().parse::<f64>().ok()? * size));
    let bytes =
        amount.filter(|bytes| *bytes > 0.0 && *bytes < 1e18).ok_or("expected an amount such as 8GB or 500MB")?;
    Ok(bytes as u64)
}

/// Parses a fraction that leaves something.
pub(crate) fn part(text: &str) -> Result<f64, String> {
    match fraction(text)? {
        1.0 => Err("leaves nothing: must be below 1".into()),
        value => Ok(value),
    }
}

/// Splits `name=value`.
pub(crate) fn assignment(text: &str) -> Result<(String, String), String> {
    let parts = text.split_once('=').map(|(name, value)| (syntax::name(name.trim()), value.trim().to_owned()));
    parts.filter(|(name, _)| !name.is_empty()).ok_or_else(|| "expected NAME=VALUE, such as r=42mm".into())
}

/// The most bytes of what the user states in one field of a report.
pub(crate) const LONGEST_FIELD: usize = 2000;

/// Parses `name=text`, which may be any text of some length.
pub(crate) fn report_field(text: &str) -> Result<(String, String), String> {
    if text.len() > LONGEST_FIELD {
        return Err(format!("is longer than {LONGEST_FIELD} bytes"));
    }
    let parts = text.split_once('=').map(|(name, value)| (name.trim().to_owned(), value.trim().to_owned()));
    parts.filter(|(name, _)| !name.is_empty()).ok_or_else(|| "expected NAME=TEXT, such as Operator=Roe".into())
}

/// Parses `name=limit`.
pub(crate) fn limit(text: &str) -> Result<(String, u64), String> {
    let (name, value) = assignment(text).map_err(|_| "expected NAME=N, such as steps=1000000")?;
    let value = value.parse().map_err(|_| format!("'{value}' is not a whole number such as 100000"))?;
    Ok((name, value))
}

/// A range of values of an input.
#[derive(Clone, Debug)]
pub(crate) struct Range {
    pub(crate) name: String,
    pub(crate) low: i64,
    pub(crate) high: i64,
}

/// Parses `name=low..high`.
pub(crate) fn range(text: &str) -> Result<Range, String> {
    let (name, range) = assignment(text).map_err(|_| "expected NAME=LOW..HIGH, such as bolts=3..16")?;
    let ends = range.split_once("..");
    let ends = ends.and_then(|(low, high)| Some((low.trim().parse().ok()?, high.trim().parse().ok()?)));
    let (low, high) = ends.ok_or("expected two whole numbers, such as 3..16")?;
    Ok(Range { name, low, high })
}

/// Parses `name=value` of an input: true or false, a whole number, or a number with an optional unit. The compiler
/// checks it against the declaration.
pub(crate) fn input(text: &str) -> Result<(String, InputValue), String> {
    let (name, value) = assignment(text).map_err(|_| "expected NAME=VALUE, such as bolts=6")?;
    if let Ok(flag) = value.parse() {
        return Ok((name, InputValue::Bool(flag)));
    }
    if let Ok(whole) = value.parse() {
        return Ok((name, InputValue::Int(whole)));
    }
    if matches!(value.to_lowercase().as_str(), "yes" | "no" | "on" | "off" | "true" | "false") {
        return Err(format!("'{value}' is not a value: write true or false"));
    }
    let quantity = UNITS.iter().filter(|u| value.ends_with(u.0)).map(|u| u.1).next_back();
    let number = parse(&value, quantity.unwrap_or(Quantity::Real)).map_err(|why| format!("'{value}' {why}"))?;
    Ok((name, InputValue::Real(number)))
}

/// The index of a parameter by its name. `option` is the option that names it.
pub(crate) fn parameter(option: &str, name: &str, program: &Program) -> Result<usize, CommandError> {
    program.parameters().iter().position(|p| p.name == name).ok_or_else(|| {
        let what = no_parameter(name, program);
        CommandError::Usage(format!("{option} {name}: {what}"))
    })
}

/// What a name is that is no parameter's: that of an input, or nearly one of a parameter.
fn no_parameter(name: &str, program: &Program) -> String {
    let names: Vec<&str> = program.parameters().iter().map(|p| p.name.as_str()).collect();
    if let Some(input) = program.inputs().iter().find(|input| input.name == name) {
        let example = input_example(input);
        return format!("`{name}` is an input, not a parameter: --input {name}={example}");
    }
    if names.is_empty() {
        return "the model has no parameters".to_owned();
    }
    match nearest(name, names.iter().copied()) {
        Some(near) => format!("the model has no parameter of that name; did you mean `{near}`?"),
        None => format!("the model has no parameter of that name; it has {}", names.join(", ")),
    }
}

/// The value of an input as the command line takes it.
fn input_example(input: &Input) -> String {
    match input.quantity {
        Quantity::Bool => (input.value != 0.0).to_string(),
        quantity => {
            let (value, unit) = quantity.written(input.value);
            format!("{}{unit}", number::plain(value))
        }
    }
}

/// The index and value of a parameter.
pub(crate) fn parameter_value(
    option: &str,
    name: &str,
    value: &str,
    program: &Program,
) -> Result<(usize, f64), CommandError> {
    let index = parameter(option, name, program)?;
    let parsed = parse(value, program.parameters()[index].quantity);
    Ok((index, parsed.map_err(|why| CommandError::Usage(format!("{option} {name}: '{value}' {why}")))?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_scaled_to_millimetres_and_radians() {
        assert_eq!(parse("42mm", Quantity::Length).ok(), Some(42.0));
        assert_eq!(parse("4.2 cm", Quantity::Length).ok(), Some(42.0));
        assert_eq!(parse("-1e-3m", Quantity::Length).ok(), Some(-1.0));
        assert_eq!(parse("0.5turn", Quantity::Angle).ok(), Some(std::f64::consts::PI));
        assert_eq!(parse("1e2", Quantity::Real).ok(), Some(100.0));
        assert_eq!(parse("0", Quantity::Length).ok(), Some(0.0), "zero is zero in any unit");
    }

    #[test]
    fn tolerances_have_one_end_or_two() {
        for (text, expected) in [
            ("0.5mm", (-0.5, 0.5)),
            ("+0.3/-0.1mm", (-0.1, 0.3)),
            ("-0.1mm/+0.03cm", (-0.1, 0.3)),
            ("0/0.2 mm", (0.0, 0.2)),
        ] {
            let Tolerance { lower: low, upper: high } = tolerance(text).expect(text);
            assert!((low - expected.0).abs() < 1e-15 && (high - expected.1).abs() < 1e-15, "{text}: {low} {high}");
        }
        for text in ["0.5", "0mm", "-1mm", "1mm/1mm", "+0.3/-0.1", "1mm/", "/", "1mm/2mm/3mm", "1deg/2mm"] {
            assert!(tolerance(text).is_err(), "{text}");
        }
    }

    #[test]
    fn decision_rules_have_names() {
        for (text, expected) in [
            ("guarded", DecisionRule::Guarded),
            ("simple", DecisionRule::Simple),
            ("p=0.95", DecisionRule::Probability(0.95)),
        ] {
            let found = decision(text).expect(text);
            assert_eq!((found, found.name().as_str()), (expected, text));
        }
        for text in ["", "lenient", "p", "p=0.5", "p=1", "p=95", "p=-1", "q=0.95"] {
            assert!(decision(text).is_err(), "{text}");
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
            let error = parse(text, quantity);
            assert!(error.is_err(), "{text}: {error:?}");
        }
    }
}
