//! What of a table cannot be told, or contradicts itself: errors and warnings that say how to make it clear.

use super::super::text::{lone_count, shown_line as show};
use super::dialect::{Cell, Dialect, Separator};
use super::layout::{Fit, Line, fault};
use crate::scan::error::ScanFault;
use crate::scan::unit::Unit;
use std::ops::Range;

/// A unit and the line that has it, or the word there that is none.
type Stated = Option<(u64, Result<Unit, String>)>;

/// The number of points that a line announces: it has nothing else, but for the separators of empty fields, which
/// spreadsheets add (`1200,,`).
pub(super) fn padded_count(line: &[u8], dialect: Dialect) -> Option<u64> {
    let end = match dialect.separator {
        Separator::One(separator) => line.iter().rposition(|b| *b != separator && !b.is_ascii_whitespace())? + 1,
        _ => line.len(),
    };
    lone_count(&line[..end])
}

/// A line that begins with three numbers, before the first point, is a point that is not like the others.
pub(super) fn refuse_other_points(fit: &Fit<'_>, texts: &[Line<'_>]) -> Result<(), ScanFault> {
    let mut fields = Vec::new();
    for (number, line) in texts.iter().filter(|(_, line)| padded_count(line, fit.dialect).is_none()) {
        fit.dialect.split(line, &mut fields);
        let is_number = |field: &Range<usize>| fit.dialect.cell(&line[field.clone()]) != Cell::Text;
        if fields.len() >= 3 && fields[..3].iter().all(is_number) {
            if fields.len() == fit.width {
                let message = format!("expected three numbers as in line {}, found `{}`", fit.first, show(line));
                return Err(fault(*number, message));
            }
            let message = format!(
                "expected {} columns as in line {} and others, found {} in `{}`",
                fit.width,
                fit.first,
                fields.len(),
                show(line)
            );
            return Err(fault(*number, message));
        }
    }
    Ok(())
}

/// Without names, a column that has numbers here and text there may be a coordinate that is damaged.
pub(super) fn refuse_mixed(fit: &Fit<'_>) -> Result<(), ScanFault> {
    let is_mixed =
        |c: &usize| !fit.numeric.contains(c) && fit.rows.iter().any(|row| matches!(row[*c], Cell::Number(..)));
    match (0..fit.numeric[2]).find(is_mixed) {
        Some(c) => {
            let message =
                format!("column {} has numbers in some lines and text in others; name the columns x, y, z", c + 1);
            Err(fault(fit.first, message))
        }
        None => Ok(()),
    }
}

/// Without names, `1,5,2,5,3,5` may be three numbers with decimal commas, or six whole ones: where there are no points
/// and no signs behind every second comma, nothing tells.
pub(super) fn refuse_decimal_commas(fit: &Fit<'_>) -> Result<(), ScanFault> {
    let is_pairs = fit.dialect == Dialect { separator: Separator::One(b','), mark: b'.' }
        && fit.width >= 6
        && fit.width.is_multiple_of(2)
        && fit.numeric.len() == fit.width;
    let is_whole = |cell: &Cell| matches!(cell, Cell::Number(_, true));
    let is_digits = |row: &Vec<Cell>| row.iter().skip(1).step_by(2).all(|c| matches!(c, Cell::Number(0.0.., true)));
    if !is_pairs || !fit.rows.iter().all(|row| row.iter().all(is_whole) && is_digits(row)) {
        return Ok(());
    }
    let message = format!(
        "{} whole numbers, or {} with decimal commas? Export with decimal points or another separator; or name the \
         columns in a line before the points, such as `x,y,z,red,green,blue`",
        fit.width,
        fit.width / 2
    );
    Err(fault(fit.first, message))
}

/// A sentence on two units that a file states, of which that of the names of the columns is taken.
pub(super) fn contradiction(named: &Stated, stated: &Stated) -> Option<String> {
    match (named, stated) {
        (Some((header, Ok(taken))), Some((line, Ok(other)))) if taken != other => Some(format!(
            "line {line} states {other}, and the columns are named with {taken} in line {header}: {taken} is taken; \
             --unit says otherwise"
        )),
        _ => None,
    }
}

/// Whether the first three columns of numbers have marks in front of exactly three digits wherever they have any, and
/// numbers without a mark as well: `1.182;643;12.077` may be thousands.
pub(super) fn may_be_thousands(dialect: Dialect, lines: &[Line<'_>], numeric: &[usize]) -> bool {
    /// Fewer numbers with a mark say nothing.
    const FEWEST: usize = 20;
    let (mut fields, mut marked, mut bare) = (Vec::new(), 0, 0);
    for (_, line) in lines.iter().filter(|line| !dialect.is_comment(line.1)) {
        dialect.split(line, &mut fields);
        for field in numeric.iter().take(3).filter_map(|c| fields.get(*c)) {
            let field = &line[field.clone()];
            match field.iter().position(|b| *b == dialect.mark) {
                Some(at) if field.len() == at + 4 && !field.starts_with(b"0") && !field.starts_with(b"-0") => {
                    marked += 1
                }
                Some(_) => return false,
                None if field.iter().any(u8::is_ascii_alphabetic) => return false,
                None => bare += 1,
            }
        }
    }
    marked >= FEWEST && bare > 0
}
