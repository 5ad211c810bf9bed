//! Whether the file of a fit can be one: people edit these files, cut them, and take them for those of other models.
//! What would give a wrong result is refused before any work begins.

use super::figures;
use super::texts::{self, quoted};
use super::truth;
use crate::print::{cut, visible_in_line};
use gml_compiler::program::Quantity;
use gml_runtime::fit::{Covariance, FitResult, FittedParameter};
use gml_runtime::model::Motion;
use std::collections::HashSet;

/// Deviation of a rotation's products from those of unit vectors that are at right angles, as files round it.
pub(super) const ROUNDING: f64 = 1e-6;
/// The largest shift, value or deviation that is believed, in millimetres, radians or 1: a thousand kilometres, as of a
/// scan's coordinates.
pub(super) const FARTHEST: f64 = 1e12;

/// Reads the text of a file; the error is a predicate.
pub(super) fn parse(text: &str) -> Result<FitResult, String> {
    let start = text.trim_start_matches('\u{feff}').trim_start();
    if !start.starts_with('{') {
        let foreign = gml_runtime::scan::foreign(text.as_bytes());
        let fix = foreign.as_ref().and_then(|f| f.fix).unwrap_or("name the file that `gmlc fit -o` wrote");
        let found = match &foreign {
            Some(foreign) => foreign.found.to_owned(),
            None if start.is_empty() => "an empty file".to_owned(),
            None => format!("a text that begins `{}`", cut(start, 24)),
        };
        return Err(format!("is not a result of `gmlc fit`: expected an object of JSON (`{{`), found {found}; {fix}"));
    }
    serde_json::from_str(start).map_err(|e| {
        let what = of_another_command(start).unwrap_or_else(|| readable(&e));
        format!("is not a result of `gmlc fit`: {what}")
    })
}

/// As [`parse`], of the truth of a virtual scan.
pub(super) fn parse_truth(text: &str) -> Result<FitResult, String> {
    let start = text.trim_start_matches('\u{feff}');
    truth::parse(start)
        .map_err(|e| format!("is not the truth of a virtual scan (`gmlc scan --truth`): {}", readable(&e)))
}

/// A sentence on a file that another command wrote, which its fields tell.
fn of_another_command(text: &str) -> Option<String> {
    let file: serde_json::Map<String, serde_json::Value> = serde_json::from_str(text).ok()?;
    let has = |names: &[&str]| names.iter().all(|name| file.contains_key(*name));
    if has(&["texels", "matching"]) || has(&["signed", "verdict"]) {
        return Some("it is a measurement (variance.json); name the fit.json that it was made from".to_owned());
    }
    None
}

/// An error of the reader without the names of types, which are nothing to its user.
fn readable(error: &serde_json::Error) -> String {
    let whole = error.to_string();
    let (message, _) = whole.rsplit_once(" at line ").unwrap_or((&whole, ""));
    let place = format!("line {}, column {}", error.line(), error.column());
    if error.is_eof() {
        return format!("{place}: the file ends here; it is cut off");
    }
    let what = |kind: &str| match kind {
        "f64" => "a number".to_owned(),
        "u64" | "usize" | "u32" => "a whole number".to_owned(),
        "a sequence" => "a list".to_owned(),
        _ if kind.starts_with("struct ") => "an object".to_owned(),
        _ => kind.to_owned(),
    };
    let said = if let Some(field) = message.strip_prefix("missing field ") {
        format!("there is no {field}")
    } else if let Some(field) = message.strip_prefix("duplicate field ") {
        format!("{field} is there twice")
    } else if let Some((field, _)) = message.strip_prefix("unknown field ").and_then(|m| m.split_once(", ")) {
        format!("{} is no field of such a file: it is misspelt, or from another version of gmlc", cut(field, 60))
    } else if let Some((found, expected)) =
        message.strip_prefix("invalid type: ").and_then(|m| m.rsplit_once(", expected "))
    {
        format!("expected {}, found {}", what(expected), cut(found, 60))
    } else if let Some((found, expected)) =
        message.strip_prefix("invalid value: ").and_then(|m| m.rsplit_once(", expected "))
    {
        let expected =
            if expected.starts_with('u') { "a whole number that is not negative".to_owned() } else { what(expected) };
        format!("expected {expected}, found {}", cut(found, 60))
    } else if let Some((length, expected)) =
        message.strip_prefix("invalid length ").and_then(|m| m.rsplit_once(", expected "))
    {
        format!("expected {}, found a list of length {length}", what(expected))
    } else if let Some((found, expected)) =
        message.strip_prefix("unknown variant ").and_then(|m| m.split_once(", expected "))
    {
        format!("expected {expected}, found {}", cut(found, 60))
    } else {
        cut(message, 120)
    };
    format!("{place}: {said}")
}

/// Refuses a result that no fit has; the error is a predicate.
pub(super) fn check(fit: &FitResult) -> Result<(), String> {
    texts::check(fit)?;
    names("parameter", fit.parameters.iter().map(|p| (p.name.as_str(), p.unit.as_str(), p.quantity)))?;
    names("input", fit.inputs.iter().map(|i| (i.name.as_str(), i.unit.as_str(), i.quantity)))?;
    let values = fit.parameters.iter().map(|p| (p.name.as_str(), p.value));
    for (name, value) in values.chain(fit.inputs.iter().map(|i| (i.name.as_str(), i.value))) {
        if !(value.abs() <= FARTHEST) {
            return Err(format!("has the value {value:e} for {}, beyond {FARTHEST:e}", quoted(name)));
        }
    }
    let scales = [("objective", fit.objective), ("sigma", fit.sigma), ("noise", fit.noise), ("rms", fit.rms)];
    if let Some((name, value)) = scales.into_iter().find(|(_, value)| !(0.0..=FARTHEST).contains(value)) {
        return Err(format!("has `{name}` = {value:e}, which is below zero or beyond {FARTHEST:e}"));
    }
    if !(0.0..=1.0 + ROUNDING).contains(&fit.inliers) {
        return Err(format!("has `inliers` = {:e}, which is not between 0 and 1", fit.inliers));
    }
    fit.pose.iter().try_for_each(pose)?;
    digests(fit)?;
    for FittedParameter { name, sd, bias, .. } in &fit.parameters {
        if let Some(sd) = sd.filter(|sd| !(0.0..=FARTHEST).contains(sd)) {
            return Err(format!("has `sd` = {sd:e} for {}, which is below zero or beyond {FARTHEST:e}", quoted(name)));
        }
        if let Some(bias) = bias.filter(|bias| !(bias.abs() <= FARTHEST)) {
            return Err(format!("has `bias` = {bias:e} for {}, beyond {FARTHEST:e}", quoted(name)));
        }
    }
    if let Some(c) = &fit.covariance {
        covariance(fit, "covariance", &c.parameters, &c.matrix, 0)?;
        covariance(fit, "correlations", &c.parameters, &c.correlations, 0)?;
        deviations(fit, c)?;
    }
    if let Some(c) = &fit.pose_covariance {
        if fit.pose.is_none() {
            return Err("has a `pose_covariance` and no `pose`, which was removed".to_owned());
        }
        covariance(fit, "pose_covariance", &c.parameters, &c.matrix, 6)?;
    }
    fit.scans.iter().try_for_each(|scan| pose(&scan.pose))?;
    figures::check(fit)
}

/// Refuses digests that are none.
fn digests(fit: &FitResult) -> Result<(), String> {
    let is_digest = |text: &str| text.len() == 64 && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    let script = fit.script_sha256.as_deref().unwrap_or_default();
    for (name, text) in [("script_sha256", script), ("scan.sha256", fit.scan.sha256.as_str())] {
        if !text.is_empty() && !is_digest(text) {
            return Err(format!("has `{name}` = \"{}\", which is no SHA-256 in hexadecimal", cut(text, 24)));
        }
    }
    Ok(())
}

/// Refuses standard deviations that are not those of the covariance.
fn deviations(fit: &FitResult, covariance: &Covariance) -> Result<(), String> {
    for (i, name) in covariance.parameters.iter().enumerate() {
        let sd = fit.parameters.iter().find(|p| p.name == *name).and_then(|p| p.sd);
        let by_matrix = covariance.matrix[i][i].sqrt();
        if let Some(sd) = sd.filter(|sd| !((sd - by_matrix).abs() <= ROUNDING * (sd + by_matrix))) {
            return Err(format!("has `sd` = {sd:e} for {}, where its `covariance` has {by_matrix:e}", quoted(name)));
        }
    }
    Ok(())
}

/// Refuses names that are there twice, and units that are not those of files.
fn names<'a>(kind: &str, all: impl Iterator<Item = (&'a str, &'a str, Quantity)>) -> Result<(), String> {
    let mut seen = HashSet::new();
    for (name, unit, quantity) in all {
        if !seen.insert(name) {
            return Err(format!("has the {kind} {} twice; remove one", quoted(name)));
        }
        if unit != quantity.unit() {
            let is = if quantity.unit().is_empty() { "no unit".to_owned() } else { format!("`{}`", quantity.unit()) };
            let (name, unit) = (quoted(name), cut(&visible_in_line(unit), 60));
            return Err(format!("has the {kind} {name} in `{unit}`; convert its value: such files have {is} for it"));
        }
    }
    Ok(())
}

/// Refuses what is not a rigid motion of bearable length.
fn pose(Motion { rotation, translation }: &Motion) -> Result<(), String> {
    if let Some(shift) = translation.iter().find(|t| !(t.abs() <= FARTHEST)) {
        return Err(format!("has a pose that moves the model by {shift:e} mm, beyond {FARTHEST:e}"));
    }
    let dot = |i: usize, j: usize| (0..3).map(|k| rotation[i][k] * rotation[j][k]).sum::<f64>();
    for i in 0..3 {
        for j in i..3 {
            let error = dot(i, j) - f64::from(u8::from(i == j));
            if !(error.abs() <= ROUNDING) {
                let what = if i == j {
                    format!("row {} has the length {:.6e}, not 1", i + 1, dot(i, i).sqrt())
                } else {
                    format!("rows {} and {} are not at right angles", i + 1, j + 1)
                };
                return Err(format!("has a pose whose rotation is none: {what}"));
            }
        }
    }
    let [a, b, c] = *rotation;
    let determinant =
        a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
    if determinant < 0.0 {
        return Err("has a pose whose rotation is none: it mirrors the model".to_owned());
    }
    Ok(())
}

/// Refuses a matrix that is not one of these parameters, and of so `many` others.
fn covariance(fit: &FitResult, name: &str, of: &[String], matrix: &[Vec<f64>], many: usize) -> Result<(), String> {
    figures::of_parameters(fit, name, of)?;
    let size = of.len() + many;
    if matrix.len() != size || matrix.iter().any(|row| row.len() != size) {
        return Err(format!("has a `{name}` that is not a matrix of {size} x {size}"));
    }
    let cell = |i: usize, j: usize| format!("{:e} in row {}, column {}", matrix[i][j], i + 1, j + 1);
    for i in 0..size {
        if !(0.0..=FARTHEST * FARTHEST).contains(&matrix[i][i]) {
            return Err(format!("has a `{name}` with the variance {}", cell(i, i)));
        }
        for j in 0..i {
            let most = (matrix[i][i] * matrix[j][j]).sqrt();
            let is_symmetric = (matrix[i][j] - matrix[j][i]).abs() <= ROUNDING * most;
            if !(is_symmetric && matrix[i][j].abs() <= (1.0 + ROUNDING) * most) {
                let why =
                    if is_symmetric { "beyond the product of the deviations" } else { "which is another one across" };
                return Err(format!("has a `{name}` with {}, {why}", cell(i, j)));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_the_reader_are_readable() {
        let good = serde_json::to_string_pretty(&FitResult::default()).unwrap();
        assert!(parse(&good).is_ok() && parse(&format!("\u{feff}{good}")).is_ok());
        let of = |from: &str, to: &str| {
            assert!(good.contains(from), "{from}");
            good.replacen(from, to, 1)
        };
        for (text, expected) in [
            ("[]".to_owned(), "found a text that begins `[]`; name the file that `gmlc fit -o` wrote"),
            (String::new(), "found an empty file"),
            ("<!doctype html>".into(), "found an HTML page"),
            ("{}".into(), "line 1, column 2: there is no `model`"),
            (r#"{"signed": {}, "verdict": {}}"#.into(), "it is a measurement (variance.json)"),
            (good[..good.len() / 2].into(), "the file ends here; it is cut off"),
            (of("\"sigma\": 0.0", "\"sigma\": \"x\""), "expected a number, found string \"x\""),
            (of("\"sigma\": 0.0", "\"sigma\": null"), "expected a number, found null"),
            (of("\"sigma\": 0.0", "\"sigma\": 0.0, \"sigma\": 0.0"), "`sigma` is there twice"),
            (of("\"parameters\": []", "\"parameters\": [[]]"), "expected an object, found a list of length 0"),
            (
                of("\"sigma\": 0.0", "\"sigma\": 0.0, \"sgima\": 1"),
                "`sgima` is no field of such a file: it is misspelt",
            ),
            (of("\"parameters\": []", "\"parameters\": 7"), "expected a list, found integer `7`"),
        ] {
            let error = parse(&text).unwrap_err();
            assert!(error.contains(expected) && !error.contains("struct"), "{text}\n gave: {error}\n not: {expected}");
        }
    }

    #[test]
    fn truths_of_virtual_scans_have_values_and_a_pose() {
        let pose = r#""pose": {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation": [1, 2, 3]}"#;
        let rest = r#""scanner": {}, "euler": [0, 0, 0], "pitch": 1"#;
        let text = format!(r#"{{"script": "a.gml", "parameters": {{"r": 42, "a": 0.5}}, {pose}, {rest}}}"#);
        assert!(truth::is_truth(&text) && !truth::is_truth("{\"pose\": {}}"));
        let read = parse_truth(&text).unwrap();
        let values: Vec<(&str, f64)> = read.parameters.iter().map(|p| (p.name.as_str(), p.value)).collect();
        assert_eq!(values, [("a", 0.5), ("r", 42.0)]);
        assert_eq!(read.pose.map(|pose| pose.translation), Some([1.0, 2.0, 3.0]));
        assert!(check(&read).is_ok());
        let error = parse_truth(&text.replace("42", "\"x\"")).unwrap_err();
        assert!(error.contains("is not the truth of a virtual scan") && error.contains("expected a number"), "{error}");
        let far = parse_truth(&text.replace("42", "1e300")).unwrap();
        assert!(check(&far).unwrap_err().contains("beyond"), "values are checked");
    }

    #[test]
    fn poses_are_rigid() {
        let turned = |rotation, translation| pose(&Motion { rotation, translation });
        let [x, y, z] = Motion::IDENTITY.rotation;
        assert!(turned([x, y, z], [1e6, 0.0, 0.0]).is_ok());
        assert!(turned([y, z, x], [0.0; 3]).is_ok());
        for (rotation, shift, expected) in [
            ([x, y, z], 1e30, "moves the model by 1e30 mm"),
            ([x, y, z], f64::NAN, "moves the model by NaN mm"),
            ([x, z, y], 0.0, "mirrors the model"),
            ([x, y, z.map(|c| 2.0 * c)], 0.0, "row 3 has the length 2.000000e0, not 1"),
            ([x, x, z], 0.0, "rows 1 and 2 are not at right angles"),
            ([x, y, [f64::NAN; 3]], 0.0, "not at right angles"),
        ] {
            let error = turned(rotation, [0.0, shift, 0.0]).unwrap_err();
            assert!(error.contains(expected), "{error}, not: {expected}");
        }
    }
}
