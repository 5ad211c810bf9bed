//! What a table is like, from its first lines.

use super::super::text::{self, shown_line as show};
use super::dialect::{Cell, DIALECTS, Dialect, Separator};
use super::doubts;
use super::guess::{self, Rows};
use super::names::{self, Columns, Names};
use crate::scan::error::ScanFault;
use std::collections::HashMap;

pub(super) const FORMAT: &str = "text table";
/// The number of bytes at a file's beginning that are looked at, and of lines in them.
pub(super) const SAMPLE: usize = 1 << 18;
const MOST_LINES: usize = 5000;
/// A table has a line of points among so many lines.
const SOON: usize = 200;
/// The most lines of other text before the points of a table.
const MOST_PREAMBLE: usize = 20;

/// What a table is like.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) dialect: Dialect,
    /// Number of columns.
    pub(super) width: usize,
    /// The line of the first point.
    pub(super) first: u64,
    pub(super) columns: Columns,
    /// The unit of the coordinates, in millimetres.
    pub(super) unit: Option<f64>,
    /// The number of points that a line announces, and that line.
    pub(super) count: Option<(u64, u64)>,
    pub(super) warnings: Vec<String>,
    /// Names or numbers of the columns that are not read.
    pub(super) ignored: Vec<String>,
    /// Whether nearly all lines are points.
    pub(super) clear: bool,
}

/// Why a file is none.
#[derive(Debug)]
pub(super) struct Refused {
    pub(super) fault: ScanFault,
    /// Its lines are points nevertheless.
    pub(super) has_points: bool,
}

/// A line and its number.
pub(super) type Line<'a> = (u64, &'a [u8]);

/// How far lines fit a dialect.
pub(super) struct Fit<'a> {
    pub(super) dialect: Dialect,
    pub(super) width: usize,
    /// What stands before the first point.
    preamble: &'a [Line<'a>],
    pub(super) first: u64,
    /// The columns of numbers.
    pub(super) numeric: Vec<usize>,
    /// Those that fit.
    pub(super) rows: Vec<Vec<Cell>>,
    /// Those that should.
    lines: usize,
    /// From the first point on.
    pub(super) rest: &'a [Line<'a>],
}

impl Layout {
    /// What a file is like that begins so.
    pub(super) fn of(head: &[u8]) -> Result<Self, Refused> {
        let is_part = head.len() >= SAMPLE;
        let text = text::decoded(&head[..head.len().min(SAMPLE)]);
        let lines = sample(&text, is_part);
        let mut best: Option<Fit<'_>> = None;
        for dialect in DIALECTS {
            let Some(fit) = Fit::of(dialect, &lines) else { continue };
            if best.as_ref().is_none_or(|best| best.share() < fit.share()) {
                let perfect = fit.rows.len() == fit.lines;
                best = Some(fit);
                if perfect {
                    break;
                }
            }
        }
        match best {
            Some(fit) => {
                let has_points = fit.is_clear();
                Self::of_fit(&fit).map_err(|fault| Refused { fault, has_points })
            }
            None => {
                let is_content = |line: &&Line<'_>| !DIALECTS[0].is_comment(line.1);
                // A line of names is not what is wrong.
                let with_digits = |line: &&Line<'_>| is_content(line) && line.1.iter().any(u8::is_ascii_digit);
                let found = lines.iter().find(with_digits).or(lines.iter().find(is_content)).or(lines.first());
                let (number, line) = found.copied().unwrap_or((1, b""));
                let hint = if has_grouped_digits(line) { " (write thousands without separators)" } else { "" };
                let message =
                    format!("expected points, at least three numbers in a line, found `{}`{hint}", show(line));
                Err(Refused { fault: fault(number, message), has_points: false })
            }
        }
    }

    fn of_fit(fit: &Fit<'_>) -> Result<Self, ScanFault> {
        let Fit { dialect, width, first, .. } = *fit;
        let (texts, remarks): (Vec<_>, Vec<_>) = fit.preamble.iter().partition(|line| !dialect.is_comment(line.1));
        if let Some((number, line)) = texts.get(MOST_PREAMBLE) {
            let message = format!(
                "more than {MOST_PREAMBLE} lines of text stand before the first point, in line {first}; found `{}`",
                show(line)
            );
            return Err(fault(*number, message));
        }
        doubts::refuse_other_points(fit, &texts)?;
        let count = texts.iter().find_map(|(number, line)| Some((doubts::padded_count(line, dialect)?, *number)));
        let (named, header) = find_names(fit, &texts, &remarks)?;
        let mut warnings = Vec::new();
        let rows = Rows(&fit.rows);
        let stated = texts.iter().chain(&remarks).find_map(|(number, line)| Some((*number, names::stated_unit(line)?)));
        let mut column_names = Vec::new();
        let (mut columns, named_unit) = match named {
            Some(names) => {
                column_names = names.all;
                (names.columns, names.unit.map(|unit| (header.unwrap_or(1), unit)))
            }
            None => {
                doubts::refuse_mixed(fit)?;
                doubts::refuse_decimal_commas(fit)?;
                let (columns, warning) = guess::columns(&fit.numeric, &rows);
                warnings.extend(warning);
                (columns, None)
            }
        };
        let units = || [&named_unit, &stated].into_iter().flatten();
        let unit = units().find_map(|(_, unit)| unit.as_ref().ok());
        if let (None, Some((number, Err(word)))) = (unit, units().next()) {
            let known = "um, mm, cm, m, in or ft";
            warnings.push(format!("line {number}: the unit `{word}` is not known: --unit says which it is ({known})"));
        }
        warnings.extend(doubts::contradiction(&named_unit, &stated));
        warnings.extend(doubts::may_be_thousands(dialect, fit.rest, &fit.numeric).then(|| {
            "all numbers have three digits behind a mark, or no mark: if the marks group thousands, export the file without"
                .to_owned()
        }));
        if header.is_some() {
            check_named(fit, &mut columns, &mut warnings)?;
        }
        let of_unit = stated.as_ref().map(|(number, _)| number);
        let mut unused = texts.iter().copied().filter(|line| {
            Some(line.0) != header && Some(&line.0) != of_unit && doubts::padded_count(line.1, dialect).is_none()
        });
        if let Some((number, line)) = unused.next() {
            let others = match unused.count() {
                0 => String::new(),
                others => format!(" ({others} more lines like it)"),
            };
            warnings.push(format!("line {number}: `{}` is no point and is left out{others}", show(line)));
        }
        let name = |c: usize| column_names.get(c).cloned().unwrap_or_else(|| format!("column {}", c + 1));
        let ignored = (0..width).filter(|c| !columns.read(*c)).map(name).collect();
        let clear = fit.is_clear();
        let unit = unit.map(|unit| unit.millimetres());
        Ok(Self { dialect, width, first, columns, unit, count, warnings, ignored, clear })
    }
}

/// Whether the columns that have names of coordinates and so on have numbers.
fn check_named(fit: &Fit<'_>, columns: &mut Columns, warnings: &mut Vec<String>) -> Result<(), ScanFault> {
    let rows = Rows(&fit.rows);
    if let Some(c) = columns.position.iter().find(|c| !fit.numeric.contains(c)) {
        return Err(fault(fit.first, format!("expected coordinates, there are none in column {}", c + 1)));
    }
    let numbers = |all: &[usize]| all.iter().all(|c| fit.numeric.contains(c));
    columns.normal = columns.normal.filter(|all| numbers(all));
    columns.intensity = columns.intensity.filter(|c| numbers(&[*c]));
    if let Some(all) = columns.colour {
        match rows.brightest(&all, true) {
            Some(brightest) if numbers(&all) => {
                columns.brightest = brightest;
                if brightest > 255.0 {
                    let message = "colours were taken for numbers from 0 to 65535, since some are larger than 255";
                    warnings.push(message.to_owned());
                }
            }
            _ => {
                columns.colour = None;
                warnings
                    .push("colours are left out: numbers from 0 to 255, 0 to 1 or 0 to 65535 were expected".to_owned());
            }
        }
    }
    Ok(())
}

/// The line that names the columns, and its number. Lines that are nearer to the points come first.
fn find_names(
    fit: &Fit<'_>,
    texts: &[Line<'_>],
    remarks: &[Line<'_>],
) -> Result<(Option<Names>, Option<u64>), ScanFault> {
    let dialect = fit.dialect;
    for (number, line) in texts.iter().rev() {
        let words = names::words(line, dialect);
        let in_columns = words.len() >= 3 && words.iter().all(|word| dialect.cell(word.as_bytes()) == Cell::Text);
        match Names::of(line, dialect) {
            Ok(Some(names)) => {
                let excess: Vec<_> = fit.numeric.iter().filter(|c| **c >= names.count).collect();
                if !excess.is_empty() || names.count > fit.width {
                    let message = format!(
                        "the line names {} columns, line {} has {}{}",
                        names.count,
                        fit.first,
                        fit.width,
                        if fit.width == 2 * names.count && dialect.separator == Separator::One(b',') {
                            ": are commas decimal marks? Export with another separator, or with decimal points"
                        } else {
                            ": name all columns, in their order"
                        }
                    );
                    return Err(fault(*number, message));
                }
                return Ok((Some(names), Some(*number)));
            }
            Ok(None) if in_columns && words.len() == fit.width => {
                return Err(fault(*number, format!("expected columns called x, y and z, found `{}`", show(line))));
            }
            Err(message) => {
                return Err(fault(*number, format!("{message}: expected x, y and z, found `{}`", show(line))));
            }
            Ok(None) => {}
        }
    }
    for (number, line) in remarks.iter().rev() {
        // A remark may be anything.
        if let Ok(Some(names)) = Names::of(line, dialect)
            && names.count == fit.width
        {
            return Ok((Some(names), Some(*number)));
        }
    }
    Ok((None, None))
}

/// Whether a line has digits in groups of thousands, in quotes: `"1,234.5"`.
fn has_grouped_digits(line: &[u8]) -> bool {
    let is_group = |w: &[u8]| {
        let [before, mark, digits @ ..] = w else { return false };
        before.is_ascii_digit() && matches!(mark, b',' | b'.' | b'\'' | b' ') && digits.iter().all(u8::is_ascii_digit)
    };
    line.contains(&b'"') && line.windows(5).any(is_group)
}

pub(super) fn fault(line: u64, message: String) -> ScanFault {
    ScanFault::malformed(FORMAT, format!("line {line}"), message)
}

/// The lines of a text that are not empty, and their numbers; the last of a part of a text may not be whole.
fn sample(text: &[u8], is_part: bool) -> Vec<Line<'_>> {
    let (mut lines, mut rest, mut number) = (Vec::new(), text, 0);
    while !rest.is_empty() && lines.len() < MOST_LINES {
        number += 1;
        let end = rest.iter().position(|b| *b == b'\n' || *b == b'\r');
        if end.is_none() && is_part && !lines.is_empty() {
            break;
        }
        let (line, behind) = rest.split_at(end.unwrap_or(rest.len()));
        rest = match behind {
            [b'\r', b'\n', behind @ ..] | [_, behind @ ..] => behind,
            [] => &[],
        };
        if !line.trim_ascii().is_empty() {
            lines.push((number, line));
        }
    }
    lines
}

impl<'a> Fit<'a> {
    /// None if no line has three numbers in it.
    fn of(dialect: Dialect, lines: &'a [Line<'a>]) -> Option<Self> {
        let (mut fields, mut widths) = (Vec::new(), HashMap::<usize, usize>::new());
        let mut all: Vec<Option<Vec<Cell>>> = Vec::new();
        for (i, (_, line)) in lines.iter().enumerate() {
            if dialect.is_comment(line) {
                all.push(None);
                continue;
            }
            dialect.split(line, &mut fields);
            let cells: Vec<Cell> = fields.iter().map(|field| dialect.cell(&line[field.clone()])).collect();
            if count_numbers(&cells) >= 3 {
                *widths.entry(cells.len()).or_default() += 1;
            }
            all.push(Some(cells));
            if i == SOON && widths.is_empty() {
                return None;
            }
        }
        // The smallest of the most frequent.
        let (width, _) = widths.into_iter().max_by_key(|(width, count)| (*count, std::cmp::Reverse(*width)))?;
        let is_row = |cells: &Option<Vec<Cell>>| {
            cells.as_ref().is_some_and(|cells| cells.len() == width && count_numbers(cells) >= 3)
        };
        let start = all.iter().position(is_row)?;
        let lines_behind = all[start..].iter().flatten().count();
        let mut rows: Vec<Vec<Cell>> = all.drain(start..).flatten().filter(|cells| cells.len() == width).collect();
        let numeric: Vec<usize> = (0..width).filter(|c| is_numeric(&rows, *c)).collect();
        if numeric.len() < 3 {
            return None;
        }
        rows.retain(|row| numeric.iter().all(|c| row[*c] != Cell::Text));
        if dialect.separator == Separator::CommaBlank && !is_decimal_throughout(&rows, &numeric, lines_behind) {
            return None;
        }
        let (preamble, rest) = lines.split_at(start);
        Some(Self { dialect, width, preamble, first: rest[0].0, rest, numeric, rows, lines: lines_behind })
    }

    /// Whether nearly all lines are points, with a few others before them at most.
    fn is_clear(&self) -> bool {
        let remarks = self.preamble.iter().filter(|line| self.dialect.is_comment(line.1)).count();
        let texts = self.preamble.len() - remarks;
        let damaged = self.lines - self.rows.len();
        damaged < self.rows.len()
            && damaged <= (self.lines / 10).max(1)
            && texts <= MOST_PREAMBLE.min(self.rows.len())
            && !self.preamble.iter().any(|line| line.1.contains(&0))
    }

    /// The share of lines that fit.
    fn share(&self) -> f64 {
        self.rows.len() as f64 / self.lines as f64
    }
}

/// Commas are decimal marks beside commas as separators only where every number has one.
fn is_decimal_throughout(rows: &[Vec<Cell>], numeric: &[usize], lines: usize) -> bool {
    rows.len() == lines && rows.iter().all(|row| numeric.iter().all(|c| !matches!(row[*c], Cell::Number(_, true))))
}

fn count_numbers(cells: &[Cell]) -> usize {
    cells.iter().filter(|cell| matches!(cell, Cell::Number(..))).count()
}

/// Whether a column has numbers: some lines of a table may be damaged.
fn is_numeric(rows: &[Vec<Cell>], c: usize) -> bool {
    let texts = rows.iter().filter(|row| row[c] == Cell::Text).count();
    let numbers = rows.iter().any(|row| matches!(row[c], Cell::Number(..)));
    numbers && texts * 2 <= rows.len()
}
