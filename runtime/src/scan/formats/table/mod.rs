//! Tables of points as text: XYZ, ASC, CSV and whatever else programs call them. They have a line for each point, and
//! agree on nothing else: separators, decimal marks, names and order of the columns are found out from the first lines.

mod dialect;
mod doubts;
mod guess;
mod layout;
mod names;

use super::batch::{Batch, require_first};
use super::text::{self, Lines, leading, missing, number};
use crate::scan::cloud::{Input, Points, RawPoint};
use crate::scan::error::ScanFault;
use crate::scan::raw::Odd;
use dialect::Separator;
use layout::{FORMAT, Layout, SAMPLE};
use std::io::{Read, SeekFrom};
use std::ops::Range;

/// Numbers of a point: coordinates, normal, colour, intensity.
const VALUES: usize = 10;

/// Whether a file that begins so is a table of points, or is meant to be one.
pub(in crate::scan) fn recognise(head: &[u8]) -> bool {
    match Layout::of(head) {
        Ok(layout) => layout.clear,
        Err(refused) => refused.has_points,
    }
}

/// Reads a file of this format.
pub(in crate::scan) fn read(mut input: Input, points: &mut dyn Points) -> Result<(), ScanFault> {
    require_first(input.only)?;
    let mut head = Vec::new();
    Read::by_ref(&mut input.bytes).take(SAMPLE as u64).read_to_end(&mut head).map_err(ScanFault::Unreadable)?;
    input.bytes.seek(SeekFrom::Start(0)).map_err(ScanFault::Unreadable)?;
    let layout = Layout::of(&head).map_err(|refused| refused.fault)?;
    drop(head);
    let mut batch = Batch::new(points, input.size);
    if let Some(unit) = layout.unit {
        batch.unit(unit);
    }
    layout.ignored.iter().for_each(|column| batch.ignore(column));
    layout.warnings.iter().for_each(|warning| batch.warn(warning.clone()));
    let mut lines = Lines::new(input, FORMAT)?;
    let mut reader = Reader::new(&layout);
    let (mut rows, mut partial) = (0, None);
    while lines.advance_to_text()? {
        if lines.number() < layout.first {
            continue;
        }
        if !reader.read_fast(lines.line()) {
            if layout.dialect.is_comment(lines.line()) {
                continue;
            }
            reader.read_any(&lines)?;
        }
        rows += 1;
        let point = reader.point(&lines)?;
        let missing = point.position.iter().filter(|c| c.is_nan()).count();
        if missing == 1 || missing == 2 {
            // A cell without an echo lacks all three.
            Odd::add(&mut partial, || lines.number());
        }
        batch.push(point, lines.read())?;
    }
    if let Some(odd) = partial {
        batch.warn(format!(
            "line {}: the point has only some of its coordinates and is left out{}",
            odd.first,
            odd.others()
        ));
    }
    batch.flush(lines.read())?;
    match layout.count {
        Some((count, line)) if count != rows => {
            let message =
                format!("the line announces {count} points, {rows} follow; correct it or export the file again");
            Err(ScanFault::malformed(FORMAT, format!("line {line}"), message))
        }
        _ => Ok(()),
    }
}

/// Reads lines of a layout.
struct Reader<'a> {
    layout: &'a Layout,
    /// By column, the place of its number among the values.
    plan: Vec<Option<usize>>,
    values: [f64; VALUES],
    fields: Vec<Range<usize>>,
}

impl<'a> Reader<'a> {
    fn new(layout: &'a Layout) -> Self {
        let mut plan = vec![None; layout.width];
        let columns = &layout.columns;
        let threes = [(Some(columns.position), 0), (columns.normal, 3), (columns.colour, 6)];
        for (three, first) in threes {
            for (k, c) in three.iter().flatten().enumerate() {
                plan[*c] = Some(first + k);
            }
        }
        if let Some(c) = columns.intensity {
            plan[c] = Some(9);
        }
        Self { layout, plan, values: [0.0; VALUES], fields: Vec::new() }
    }

    /// Reads a line that has nothing but numbers in the usual form where numbers belong; false if it is another.
    fn read_fast(&mut self, line: &[u8]) -> bool {
        let (mark, separator) = (self.layout.dialect.mark, self.layout.dialect.separator);
        let one = match separator {
            Separator::One(separator) => Some(separator),
            Separator::Blanks => None,
            Separator::CommaBlank => return false,
        };
        let is_blank = |b: u8| b.is_ascii_whitespace() && Some(b) != one;
        let mut at = 0;
        for (c, place) in self.plan.iter().enumerate() {
            let start = at;
            while line.get(at).is_some_and(|b| is_blank(*b)) {
                at += 1;
            }
            if one.is_none() && c > 0 && at == start {
                return false;
            }
            match place {
                Some(place) => {
                    let Some((number, length)) = leading(&line[at..], mark) else { return false };
                    self.values[*place] = number;
                    at += length;
                }
                None => {
                    while line.get(at).is_some_and(|b| !is_blank(*b) && Some(*b) != one && *b != b'"') {
                        at += 1;
                    }
                }
            }
            if let Some(one) = one {
                while line.get(at).is_some_and(|b| is_blank(*b)) {
                    at += 1;
                }
                if c + 1 < self.plan.len() {
                    if line.get(at) != Some(&one) {
                        return false;
                    }
                    at += 1;
                }
            }
        }
        line[at..].trim_ascii().is_empty()
    }

    /// Reads any line that has a point.
    fn read_any(&mut self, lines: &Lines) -> Result<(), ScanFault> {
        let (line, dialect) = (lines.line(), self.layout.dialect);
        dialect.split(line, &mut self.fields);
        let width = self.layout.width;
        let behind = self.fields.get(width..).unwrap_or_default();
        if self.fields.len() < width || behind.iter().any(|field| !field.is_empty()) {
            let message = format!(
                "expected {width} columns as in line {}, found {} in `{}`",
                self.layout.first,
                self.fields.len(),
                lines.shown()
            );
            return Err(lines.fault(message));
        }
        for (c, place) in self.plan.iter().enumerate() {
            let Some(place) = place else { continue };
            let field = &line[self.fields[c].clone()];
            let value = number(field, dialect.mark).or_else(|| missing(field).then_some(f64::NAN));
            self.values[*place] = value.ok_or_else(|| {
                let mark = if dialect.mark == b',' { " with a decimal comma" } else { "" };
                lines.unexpected(&format!("a number{mark} in column {}", c + 1))
            })?;
        }
        Ok(())
    }

    /// The point that was read.
    fn point(&self, lines: &Lines) -> Result<RawPoint, ScanFault> {
        let [x, y, z, nx, ny, nz, r, g, b, intensity] = self.values;
        let columns = &self.layout.columns;
        let normal = [nx, ny, nz].map(|c| c as f32);
        let colour = match columns.colour {
            Some(_) if !(r + g + b).is_nan() => {
                let most = columns.brightest;
                let wrong =
                    || lines.unexpected(&format!("a colour of numbers from 0 to {most} as in the lines before"));
                Some(text::colour([r, g, b], most).ok_or_else(wrong)?)
            }
            _ => None,
        };
        Ok(RawPoint {
            position: [x, y, z],
            normal: columns.normal.map(|_| normal).filter(|normal| normal.iter().all(|c| c.is_finite())),
            colour,
            intensity: columns.intensity.map(|_| intensity as f32).filter(|intensity| !intensity.is_nan()),
        })
    }
}

#[cfg(test)]
mod tests;
