//! The texts of a fit's file. It may be a stranger's: a name that is none could forge lines and cells of what is
//! printed, and so could other texts that hold what terminals obey.

use crate::print::{cut, visible_in_line};
use gml_compiler::syntax::{Class, classes};
use gml_runtime::fit::FitResult;
use gml_runtime::scan::Unit;
use serde_json::Value;
use std::borrow::Cow;

/// Characters of a text of a file that messages quote.
const MOST: usize = 60;
/// Names that a message lists.
const LISTED: usize = 8;

/// A name in quotes for messages.
pub(super) fn quoted(name: &str) -> String {
    format!("'{}'", cut(name, MOST))
}

/// Names in quotes, or other texts by `shown`, the first few of them.
pub(super) fn listed<T>(all: &[T], shown: impl Fn(&T) -> String) -> String {
    let mut said: Vec<String> = all.iter().take(LISTED).map(shown).collect();
    if all.len() > LISTED {
        said.push(format!("{} more", all.len() - LISTED));
    }
    said.join(", ")
}

/// A text for messages.
pub(super) fn short(text: &str) -> String {
    cut(text, MOST)
}

/// Refuses names and units that no script has; the error is a predicate.
pub(super) fn check(fit: &FitResult) -> Result<(), String> {
    // Files from before the model's name was written have an empty one.
    if !fit.model.is_empty() {
        require("model", [&fit.model], is_name)?;
    }
    require("input", fit.inputs.iter().map(|i| &i.name), is_name)?;
    require("parameter", fit.parameters.iter().map(|p| &p.name), is_name)?;
    require("measure", fit.measures.iter().map(|m| &m.name), is_path)?;
    for measure in &fit.measures {
        require("unit", [&measure.unit], is_unit)?;
        require("parameter", measure.at_bound.iter().chain(measure.derivatives.keys()), is_name)?;
    }
    if !fit.scan.unit.is_empty() && Unit::ALL.iter().all(|unit| unit.name() != fit.scan.unit) {
        return Err(no("unit", &fit.scan.unit));
    }
    require("part", parts(fit), is_path)?;
    let searched = fit.search.iter().flat_map(|search| search.candidates.iter().flat_map(|c| c.inputs.keys()));
    require("input", searched, is_name)?;
    require("stage", fit.seconds.keys(), |stage| visible_in_line(stage) == stage)
}

/// The parts, or groups of parts, that a fit names.
pub(super) fn parts(fit: &FitResult) -> impl Iterator<Item = &String> {
    let contradicted = fit.contradicted.iter().flatten().map(|c| &c.part);
    let passed = fit.passed_through.iter().flat_map(|p| std::iter::once(&p.part).chain(&p.through));
    let beside = fit.unexplained.iter().flat_map(|piece| &piece.beside);
    let other = fit.alternatives.iter().flat_map(|a| &a.parts);
    let moved = fit.pose_covariance.iter().flat_map(|c| c.symmetries.iter().flat_map(|s| &s.moves));
    contradicted.chain(passed).chain(beside).chain(other).chain(moved)
}

fn require<'n>(
    kind: &str,
    names: impl IntoIterator<Item = &'n String>,
    is_one: impl Fn(&str) -> bool,
) -> Result<(), String> {
    names.into_iter().find(|name| !is_one(name)).map_or(Ok(()), |name| Err(no(kind, name)))
}

fn no(kind: &str, name: &str) -> String {
    format!("has the {kind} \"{}\", which is no {kind}'s name", cut(&visible_in_line(name), MOST))
}

/// Whether a text is one name of the language.
fn is_name(text: &str) -> bool {
    let mut all = classes(text);
    all.next() == Some((0..text.len(), Class::Name)) && all.next().is_none()
}

/// Whether a text is the name of a part or a measure: `shell.wall`, `knob[3]`.
fn is_path(text: &str) -> bool {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    text.split('.').all(|member| {
        let mut pieces = member.split('[');
        let first = pieces.next().unwrap_or_default();
        (is_name(first) || is_number(first)) && pieces.all(|index| index.strip_suffix(']').is_some_and(is_number))
    })
}

/// Whether a text is the unit of a measure: `mm`, `rad`, a power such as `mm^2` or `mm^-1/2`, or empty.
fn is_unit(text: &str) -> bool {
    let is_power = |power: &str| power.len() < 20 && power.bytes().all(|b| b.is_ascii_digit() || b"-/().".contains(&b));
    matches!(text, "" | "rad" | "mm") || text.strip_prefix("mm^").is_some_and(is_power)
}

/// The fit with the control characters of its other texts (paths, sentences) written out. They are not refused: a
/// path may have any, and sentences quote what scripts say.
pub(super) fn without_controls(fit: FitResult) -> FitResult {
    let Ok(mut value) = serde_json::to_value(&fit) else { return fit };
    if !write_out(&mut value) {
        return fit;
    }
    serde_json::from_value(value).unwrap_or(fit)
}

/// Whether there were any.
fn write_out(value: &mut Value) -> bool {
    match value {
        Value::String(text) => {
            let Cow::Owned(shown) = visible_in_line(text) else { return false };
            *text = shown;
            true
        }
        Value::Array(all) => all.iter_mut().fold(false, |changes, value| write_out(value) | changes),
        Value::Object(all) => all.values_mut().fold(false, |changes, value| write_out(value) | changes),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_scripts() {
        for name in ["r", "größe", "measure", "_a1"] {
            assert!(is_name(name) && is_path(name), "{name}");
        }
        for name in ["", "a b", "a\n", " a", "a'", "model", "1", "a\u{202e}b", "a//b", "<b>", "a|b"] {
            assert!(!is_name(name), "{name}");
        }
        for name in ["shell.wall", "knob[3]", "a[0][12].b", "pair.0"] {
            assert!(is_path(name) && !is_name(name), "{name}");
        }
        for name in ["", "a.", "a[", "a[]", "a[x]", "[0]", "a[0]b", "a. b"] {
            assert!(!is_path(name), "{name}");
        }
        assert!(["", "mm", "rad", "mm^2", "mm^-1", "mm^(1/2)"].into_iter().all(is_unit));
        assert!(!["cm", "mm^a", "mm\nx"].into_iter().any(is_unit));
    }

    #[test]
    fn other_texts_are_written_out() {
        let mut fit = FitResult { script: "a\u{202e}b".into(), warnings: vec!["a\nb".into()], ..FitResult::default() };
        fit = without_controls(fit);
        assert_eq!((fit.script.as_str(), fit.warnings[0].as_str()), ("a\\u202eb", "a\\u000ab"));
    }
}
