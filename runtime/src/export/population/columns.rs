//! The columns of the table of many inspections. docs/batch.md describes them; [`SCHEMA`] counts their changes.

use crate::export::population::SCANS;
use crate::population::{Inspected, Measured, Outcome, PartRow, Row, SCHEMA};

/// The beginning of the names of columns of parameters.
const PARAMETER: &str = "param";

/// A column: its name, the unit of its figures, and a cell a row.
pub(super) struct Column {
    pub(super) name: String,
    /// Empty of texts, shares and plain numbers.
    pub(super) unit: String,
    pub(super) cells: Cells,
}

/// Cells of one kind, of which some may be empty.
pub(super) enum Cells {
    Text(Vec<Option<String>>),
    Number(Vec<Option<f64>>),
    Whole(Vec<Option<i64>>),
    Flag(Vec<Option<bool>>),
}

/// All columns. Those of parameters, measures and parts are of all that any row has, in the order in which they come
/// first.
pub(super) fn columns(rows: &[Row]) -> Vec<Column> {
    let mut columns = of_scans(rows);
    let all = |list: fn(&Inspected) -> &Vec<Measured>| {
        names(rows.iter().filter_map(Row::inspected).flat_map(move |i| list(i).iter().map(|m| (&m.name, &m.unit))))
    };
    for (name, unit) in all(|i| &i.parameters) {
        columns.extend(of_measured(PARAMETER, &name, &unit, rows, |i| &i.parameters));
    }
    for (name, unit) in all(|i| &i.measures) {
        columns.extend(of_measured("measure", &name, &unit, rows, |i| &i.measures));
        columns.extend(of_tolerance(&name, &unit, rows));
    }
    columns.extend(of_part("surface", rows, |i| Some(&i.surface)));
    let none = String::new();
    let parts = names(rows.iter().filter_map(Row::inspected).flat_map(|i| i.parts.iter().map(|p| (&p.name, &none))));
    for (name, _) in parts {
        let head = format!("part.{name}");
        columns.extend(of_part(&head, rows, |i| i.parts.iter().find(|part| part.name == name)));
        let verdict = |i: &Inspected| i.parts.iter().find(|part| part.name == name)?.verdict.clone();
        columns.push(text(&format!("{head}.verdict"), rows, |row| verdict(row.inspected()?)));
    }
    columns.extend(of_origin(rows));
    columns
}

/// Names without repetition.
fn names<'a>(all: impl Iterator<Item = (&'a String, &'a String)>) -> Vec<(String, String)> {
    let mut found: Vec<(String, String)> = Vec::new();
    for (name, unit) in all {
        if !found.iter().any(|(other, _)| other == name) {
            found.push((name.clone(), unit.clone()));
        }
    }
    found
}

fn text(name: &str, rows: &[Row], of: impl Fn(&Row) -> Option<String>) -> Column {
    Column { name: name.to_owned(), unit: String::new(), cells: Cells::Text(rows.iter().map(of).collect()) }
}

fn number(name: &str, unit: &str, rows: &[Row], of: impl Fn(&Row) -> Option<f64>) -> Column {
    let cells = rows.iter().map(|row| of(row).filter(|x| x.is_finite())).collect();
    Column { name: name.to_owned(), unit: unit.to_owned(), cells: Cells::Number(cells) }
}

fn whole(name: &str, rows: &[Row], of: impl Fn(&Row) -> Option<i64>) -> Column {
    Column { name: name.to_owned(), unit: String::new(), cells: Cells::Whole(rows.iter().map(of).collect()) }
}

fn flag(name: &str, rows: &[Row], of: impl Fn(&Row) -> Option<bool>) -> Column {
    Column { name: name.to_owned(), unit: String::new(), cells: Cells::Flag(rows.iter().map(of).collect()) }
}

fn of_scans(rows: &[Row]) -> Vec<Column> {
    let failed = |row: &Row| match &row.outcome {
        Outcome::Failed { reason } => Some(reason.clone()),
        Outcome::Copy { of } => Some(format!("it is the same file as {of}")),
        Outcome::Inspected(_) => None,
    };
    let status = |row: &Row| {
        let status = match &row.outcome {
            Outcome::Inspected(_) => "inspected",
            Outcome::Failed { .. } => "failed",
            Outcome::Copy { .. } => "copy",
        };
        Some(status.to_owned())
    };
    vec![
        whole("schema", rows, |_| Some(i64::from(SCHEMA))),
        text("scan", rows, |row| Some(row.scan.clone())),
        text("name", rows, |row| Some(row.name.clone())),
        text("status", rows, status),
        text("reason", rows, failed),
        text("verdict", rows, |row| row.inspected()?.verdict.clone()),
        flag("reliable", rows, |row| Some(row.inspected()?.is_sound())),
        text("shortcoming", rows, |row| row.inspected()?.shortcoming.clone()),
        text("result", rows, |row| row.inspected().map(|_| format!("{SCANS}/{}", row.name))),
        text("inputs", rows, |row| Some(row.inspected()?.inputs.join(" "))),
        whole("points", rows, |row| i64::try_from(row.inspected()?.points).ok()),
        number("noise", "mm", rows, |row| Some(row.inspected()?.noise)),
        number("sigma", "mm", rows, |row| Some(row.inspected()?.sigma)),
        number("inliers", "", rows, |row| Some(row.inspected()?.inliers)),
        number("rms", "mm", rows, |row| Some(row.inspected()?.rms)),
        flag("converged", rows, |row| Some(row.inspected()?.converged)),
    ]
}

fn of_measured(
    kind: &str,
    name: &str,
    unit: &str,
    rows: &[Row],
    list: fn(&Inspected) -> &Vec<Measured>,
) -> Vec<Column> {
    let find = |row: &Row| list(row.inspected()?).iter().find(|m| m.name == name).cloned();
    let head = format!("{kind}.{name}");
    vec![
        number(&head, unit, rows, |row| find(row)?.value),
        number(&format!("{head}.sd"), unit, rows, |row| find(row)?.sd),
        number(&format!("{head}.noise_sd"), unit, rows, |row| find(row)?.noise_sd),
        text(&format!("{head}.without_sd"), rows, |row| find(row)?.without_sd),
    ]
}

fn of_tolerance(name: &str, unit: &str, rows: &[Row]) -> [Column; 4] {
    let find = |row: &Row| row.inspected()?.measures.iter().find(|m| m.name == name).cloned();
    let limit = |row: &Row, k: usize| {
        let measure = find(row)?;
        Some(measure.nominal? + measure.tolerance?[k])
    };
    let head = |what: &str| format!("measure.{name}.{what}");
    [
        number(&head("nominal"), unit, rows, |row| find(row)?.nominal),
        number(&head("lower"), unit, rows, |row| limit(row, 0)),
        number(&head("upper"), unit, rows, |row| limit(row, 1)),
        text(&head("verdict"), rows, |row| find(row)?.verdict),
    ]
}

/// A figure of a part.
type Figure = fn(&PartRow) -> Option<f64>;

fn of_part<'a>(head: &str, rows: &'a [Row], find: impl Fn(&'a Inspected) -> Option<&'a PartRow>) -> Vec<Column> {
    let figures: [(&str, &str, Figure); 7] = [
        ("area", "mm2", |p| Some(p.area)),
        ("coverage", "", |p| Some(p.coverage)),
        ("mean", "mm", |p| p.mean),
        ("rms", "mm", |p| p.rms),
        ("p95", "mm", |p| p.p95),
        ("max", "mm", |p| p.max),
        ("within", "", |p| p.within),
    ];
    let column = |(name, unit, figure): (&str, &str, Figure)| {
        let of = |row: &'a Row| row.inspected().and_then(&find).and_then(figure);
        let cells = rows.iter().map(|row| of(row).filter(|x| x.is_finite())).collect();
        Column { name: format!("{head}.{name}"), unit: unit.to_owned(), cells: Cells::Number(cells) }
    };
    figures.into_iter().map(column).collect()
}

fn of_origin(rows: &[Row]) -> [Column; 8] {
    [
        whole("warning_count", rows, |row| i64::try_from(row.inspected()?.warnings.len()).ok()),
        text("warnings", rows, |row| Some(row.inspected()?.warnings.join(" | ")).filter(|text| !text.is_empty())),
        number("seconds", "s", rows, |row| Some(row.seconds)),
        text("time", rows, |row| Some(row.time.clone())),
        text("tool", rows, |row| Some(row.tool.clone())),
        text("scan_sha256", rows, |row| Some(row.scan_sha256.clone()).filter(|sum| !sum.is_empty())),
        text("script_sha256", rows, |row| Some(row.inspected()?.script_sha256.clone())),
        text("key", rows, |row| Some(row.key.clone())),
    ]
}
