//! What columns without names are, from their numbers.

use super::dialect::Cell;
use super::names::Columns;

/// The largest difference of the square of a normal's length from 1: normals are written with three digits and more.
const UNIT_LENGTH: f64 = 0.02;
/// Fewer numbers in a row may have come one after the other by accident.
const FEWEST_INDICES: usize = 4;
/// In fewer rows the coordinates of a scan may rise as well.
const FEWEST_TIMES: usize = 50;

/// Three columns together, or one.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    Normal,
    Colour,
    Intensity,
}

/// What may follow the coordinates, by the number of columns; the first that fits is taken. An intensity stands before
/// a colour in PTS, and behind it elsewhere.
const ORDERS: [&[Part]; 13] = [
    &[Part::Intensity],
    &[Part::Normal],
    &[Part::Colour],
    &[Part::Intensity, Part::Colour],
    &[Part::Normal, Part::Intensity],
    &[Part::Intensity, Part::Normal],
    &[Part::Colour, Part::Intensity],
    &[Part::Colour, Part::Normal],
    &[Part::Normal, Part::Colour],
    &[Part::Intensity, Part::Colour, Part::Normal],
    &[Part::Colour, Part::Normal, Part::Intensity],
    &[Part::Normal, Part::Colour, Part::Intensity],
    &[Part::Colour, Part::Intensity, Part::Normal],
];

/// The rows of a sample, all of which fit.
pub(super) struct Rows<'a>(pub(super) &'a [Vec<Cell>]);

impl Rows<'_> {
    /// The numbers of a column.
    fn column(&self, c: usize) -> impl Iterator<Item = (f64, bool)> {
        self.0.iter().filter_map(move |row| match row.get(c) {
            Some(Cell::Number(value, whole)) if value.is_finite() => Some((*value, *whole)),
            _ => None,
        })
    }

    fn are_normals(&self, columns: &[usize]) -> bool {
        let length = |row: &Vec<Cell>| -> Option<f64> {
            let squares = columns.iter().map(|c| match row.get(*c) {
                Some(Cell::Number(value, _)) => Some(value * value),
                _ => None,
            });
            squares.sum::<Option<f64>>().filter(|square| square.is_finite())
        };
        let lengths: Vec<f64> = self.0.iter().filter_map(length).collect();
        let (mut units, mut others) = (0, 0);
        for square in lengths.into_iter().filter(|square| *square > 0.0) {
            if (square - 1.0).abs() < UNIT_LENGTH { units += 1 } else { others += 1 }
        }
        units > 0 && others == 0
    }

    /// The number that is full brightness in columns of colours; none if they are none. Without names, whole numbers
    /// from 0 to 255 and fractions from 0 to 1 are colours; with names larger ones are too.
    pub(super) fn brightest(&self, columns: &[usize], named: bool) -> Option<f64> {
        let (mut low, mut high, mut whole, mut any) = (0.0_f64, 0.0_f64, true, false);
        for (value, is_whole) in columns.iter().flat_map(|c| self.column(*c)) {
            (low, high, whole, any) =
                (low.min(value), high.max(value), whole && (is_whole || value.fract() == 0.0 && value > 1.0), true);
        }
        if !any || low < 0.0 {
            return None;
        }
        match high {
            ..=1.0 if !whole => Some(1.0),
            ..=255.0 if whole || named => Some(255.0),
            ..=65535.0 if named => Some(65535.0),
            _ => None,
        }
    }

    /// Whether a column counts the rows.
    fn is_index(&self, c: usize) -> bool {
        let values: Vec<(f64, bool)> = self.column(c).collect();
        let starts = values.first().is_some_and(|(first, _)| *first == 0.0 || *first == 1.0);
        starts
            && values.len() >= FEWEST_INDICES
            && values.iter().all(|(_, whole)| *whole)
            && values.windows(2).all(|pair| pair[1].0 == pair[0].0 + 1.0)
    }

    /// Whether columns behind one that counts the rows are coordinates. If all are whole numbers, the count may be a
    /// coordinate itself, of a row of a raster, whose other coordinate is then the same all along.
    fn are_coordinates(&self, columns: &[usize]) -> bool {
        let fractions = columns.iter().flat_map(|c| self.column(*c)).any(|(_, whole)| !whole);
        let differ = columns[..2].iter().all(|c| self.column(*c).zip(self.column(*c).skip(1)).any(|(a, b)| a.0 != b.0));
        fractions || self.0.len() >= FEWEST_TIMES && differ
    }

    /// Whether the numbers of a column rise from row to row, in so many rows that it is no accident.
    fn rises(&self, c: usize) -> bool {
        let values: Vec<f64> = self.column(c).map(|(value, _)| value).collect();
        values.len() >= FEWEST_TIMES && values.windows(2).all(|pair| pair[0] < pair[1])
    }
}

/// What the columns of numbers are, and a sentence about it where it matters.
pub(super) fn columns(numeric: &[usize], rows: &Rows<'_>) -> (Columns, Option<String>) {
    let mut said = Vec::new();
    let (mut numeric, all) = (numeric, numeric.len());
    if numeric.len() > 3 && rows.is_index(numeric[0]) && rows.are_coordinates(&numeric[1..4]) {
        said.push(format!("column {} counts the points", numeric[0] + 1));
        numeric = &numeric[1..];
    } else if numeric.len() > 3 && rows.rises(numeric[0]) {
        said.push(format!(
            "column {} is x, although it rises from line to line like a time (if it is one, put a line of names such \
             as `t x y z` before the points)",
            numeric[0] + 1
        ));
    }
    let counted = numeric.len() < all;
    let (position, rest) = numeric.split_at(3);
    let mut columns = Columns { position: [position[0], position[1], position[2]], ..Columns::default() };
    if counted {
        let [x, y, z] = columns.position.map(|c| c + 1);
        said.push(format!("columns {x}, {y} and {z} are coordinates"));
    }
    let fitting = ORDERS.iter().find_map(|order| read_order(order, rest, rows));
    match fitting {
        _ if rest.is_empty() => {}
        Some(found) => {
            said.extend(found.said());
            columns = Columns { position: columns.position, ..found };
        }
        None => said.push("those behind the coordinates are left out".to_owned()),
    }
    let warning = (!said.is_empty()).then(|| format!("its columns have no names; assumed: {}", said.join(", ")));
    (columns, warning)
}

/// The columns in an order, if they fit it.
fn read_order(order: &[Part], columns: &[usize], rows: &Rows<'_>) -> Option<Columns> {
    let mut found = Columns::default();
    let mut rest = columns;
    for part in order {
        if *part == Part::Intensity {
            let (first, behind) = rest.split_first()?;
            (found.intensity, rest) = (Some(*first), behind);
            continue;
        }
        let (three, behind) = rest.split_at_checked(3)?;
        let columns = Some([three[0], three[1], three[2]]);
        if *part == Part::Normal {
            found.normal = columns.filter(|_| rows.are_normals(three));
            found.normal?;
        } else {
            found.brightest = rows.brightest(three, false)?;
            found.colour = columns;
        }
        rest = behind;
    }
    rest.is_empty().then_some(found)
}

impl Columns {
    /// What is where, for a message.
    fn said(&self) -> Vec<String> {
        let mut said = Vec::new();
        if let Some([first, _, last]) = self.normal {
            said.push(format!("columns {} to {} are normals", first + 1, last + 1));
        }
        if let Some([first, _, last]) = self.colour {
            said.push(format!("columns {} to {} are colours from 0 to {}", first + 1, last + 1, self.brightest));
        }
        if let Some(c) = self.intensity {
            said.push(format!("column {} is the intensity", c + 1));
        }
        said
    }
}
