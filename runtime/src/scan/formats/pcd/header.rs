//! The header of a PCD file: lines of a keyword and values.

use super::super::batch::Batch;
use super::super::text::{Lines, shown_line, words};
use super::FORMAT;
use crate::scan::attributes::Station;
use crate::scan::error::ScanFault;

/// The most bytes of a point that are read, and the most values.
const MOST_OF_A_POINT: usize = 1 << 20;
/// The most lines of a header.
const MOST_LINES: u64 = 10_000;

/// How the points are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Data {
    Ascii,
    Binary,
    Compressed,
}

/// Values that every point has.
#[derive(Clone, Debug)]
pub(super) struct Field {
    /// In lower case.
    pub(super) name: String,
    /// Bytes of a value.
    pub(super) size: usize,
    /// `I`, `U` or `F`.
    pub(super) kind: u8,
    /// Number of its values.
    pub(super) count: usize,
    /// Bytes of a point before it.
    pub(super) offset: usize,
    /// Values of a point before it.
    pub(super) column: usize,
}

pub(super) struct Header {
    pub(super) fields: Vec<Field>,
    /// Bytes of a point.
    pub(super) stride: usize,
    pub(super) points: u64,
    /// From where the points were seen, if it is not where all of them are said to be seen from.
    pub(super) viewpoint: Option<Station>,
    pub(super) data: Data,
}

/// The lines so far.
#[derive(Default)]
struct Entries {
    names: Option<Vec<String>>,
    sizes: Option<Vec<usize>>,
    kinds: Option<Vec<u8>>,
    counts: Option<Vec<usize>>,
    width: Option<u64>,
    height: Option<u64>,
    points: Option<u64>,
    viewpoint: Option<Station>,
}

impl Header {
    /// Reads up to the line of `DATA`.
    pub(super) fn read(lines: &mut Lines, batch: &mut Batch<'_>) -> Result<Self, ScanFault> {
        let mut entries = Entries::default();
        loop {
            if !lines.advance_to_text()? || lines.number() > MOST_LINES {
                let message =
                    "there is no line `DATA ascii`, `DATA binary` or `DATA binary_compressed`; export it again";
                return Err(ScanFault::malformed(FORMAT, "header", message));
            }
            if lines.line().trim_ascii_start().starts_with(b"#") {
                continue;
            }
            let text = String::from_utf8_lossy(lines.line()).into_owned();
            let mut words = words(text.as_bytes()).map(|word| str::from_utf8(word).unwrap_or_default());
            let keyword = words.next().unwrap_or_default().to_ascii_uppercase();
            let values: Vec<&str> = words.take_while(|word| !word.starts_with('#')).collect();
            if keyword == "DATA" {
                let data = match values[..] {
                    ["ascii"] => Data::Ascii,
                    ["binary"] => Data::Binary,
                    ["binary_compressed"] => Data::Compressed,
                    _ => return Err(lines.unexpected("`DATA` and `ascii`, `binary` or `binary_compressed`")),
                };
                return entries.finish(data);
            }
            entries.take(&keyword, &values, lines, batch)?;
        }
    }

    /// The names of the fields for a message.
    pub(super) fn names(&self) -> String {
        let names: Vec<&str> = self.fields.iter().map(|field| field.name.as_str()).take(16).collect();
        shown_line((names.join(" ") + if self.fields.len() > 16 { " ..." } else { "" }).as_bytes())
    }
}

impl Entries {
    /// A line.
    fn take(&mut self, keyword: &str, values: &[&str], lines: &Lines, batch: &mut Batch<'_>) -> Result<(), ScanFault> {
        match keyword {
            "VERSION" => {}
            _ if !keyword.starts_with(|c: char| c.is_ascii_alphabetic()) => {
                return Err(
                    lines.unexpected("the header of a PCD file (a table of points without one may be called .xyz)")
                );
            }
            "FIELDS" | "COLUMNS" => self.names = Some(values.iter().map(|name| name.to_ascii_lowercase()).collect()),
            "SIZE" => {
                let size = |word: &&str| word.parse().ok().filter(|size| [1, 2, 4, 8].contains(size));
                self.sizes = Some(each(values, size).ok_or_else(|| lines.unexpected("sizes of 1, 2, 4 or 8 bytes"))?);
            }
            "TYPE" => {
                let kind = |word: &&str| match word.as_bytes() {
                    [kind] => Some(kind.to_ascii_uppercase()).filter(|kind| b"IUF".contains(kind)),
                    _ => None,
                };
                self.kinds = Some(each(values, kind).ok_or_else(|| lines.unexpected("types `I`, `U` or `F`"))?);
            }
            "COUNT" => {
                let count = |word: &&str| word.parse().ok().filter(|count| (1..=MOST_OF_A_POINT).contains(count));
                self.counts = Some(each(values, count).ok_or_else(|| lines.unexpected("counts of at least 1"))?);
            }
            "WIDTH" => self.width = Some(count(values, lines)?),
            "HEIGHT" => self.height = Some(count(values, lines)?),
            "POINTS" => self.points = Some(count(values, lines)?),
            "VIEWPOINT" => self.viewpoint = viewpoint(values, lines)?,
            _ => batch.warn(format!(
                "line {}: `{}` is not a line of a PCD header and is left out",
                lines.number(),
                lines.shown()
            )),
        }
        Ok(())
    }

    fn finish(self, data: Data) -> Result<Header, ScanFault> {
        let fault = |message: String| ScanFault::malformed(FORMAT, "header", message);
        let names = self.names.ok_or_else(|| fault("there is no line FIELDS; export the file again".to_owned()))?;
        let number = names.len();
        // The oldest files have text without them.
        let fill = |known: bool| known || data == Data::Ascii;
        if !fill(self.sizes.is_some()) || !fill(self.kinds.is_some()) {
            return Err(fault("the lines SIZE and TYPE are missing; export the file again".to_owned()));
        }
        let sizes = self.sizes.unwrap_or_else(|| vec![4; number]);
        let kinds = self.kinds.unwrap_or_else(|| vec![b'F'; number]);
        let counts = self.counts.unwrap_or_else(|| vec![1; number]);
        for (keyword, length) in [("SIZE", sizes.len()), ("TYPE", kinds.len()), ("COUNT", counts.len())] {
            if length != number {
                let message = format!("FIELDS names {number} fields, {keyword} has {length} values; export it again");
                return Err(fault(message));
            }
        }
        let (mut offset, mut column, mut fields) = (0, 0, Vec::new());
        for (i, name) in names.into_iter().enumerate() {
            let (size, kind, count) = (sizes[i], kinds[i], counts[i]);
            fields.push(Field { name, size, kind, count, offset, column });
            (offset, column) = (offset + size * count, column + count);
            if offset > MOST_OF_A_POINT {
                return Err(fault(format!("a point has more than the {MOST_OF_A_POINT} bytes that are read")));
            }
        }
        let area = match (self.width, self.height) {
            (Some(width), height) => width.checked_mul(height.unwrap_or(1)),
            (None, _) => None,
        };
        let points = match (self.points, area) {
            (Some(points), Some(area)) if points != area => {
                let (width, height) = (self.width.unwrap_or(0), self.height.unwrap_or(1));
                return Err(fault(format!(
                    "POINTS is {points}, but WIDTH {width} times HEIGHT {height} are {area}; correct the one that is wrong"
                )));
            }
            (points, area) => points.or(area).ok_or_else(|| fault("the line POINTS is missing".to_owned()))?,
        };
        Ok(Header { fields, stride: offset, points, viewpoint: self.viewpoint, data })
    }
}

fn each<T>(values: &[&str], read: impl Fn(&&str) -> Option<T>) -> Option<Vec<T>> {
    values.iter().map(read).collect()
}

fn count(values: &[&str], lines: &Lines) -> Result<u64, ScanFault> {
    match values {
        [count] => count.parse().ok(),
        _ => None,
    }
    .ok_or_else(|| lines.unexpected("the keyword and a whole number"))
}

/// A translation and a quaternion whose first number is the real one. That of a file that says nothing is no station.
fn viewpoint(values: &[&str], lines: &Lines) -> Result<Option<Station>, ScanFault> {
    let wrong = || lines.unexpected("`VIEWPOINT` and 7 numbers, of which the last 4 are a quaternion");
    let numbers: Vec<f64> = each(values, |word| word.parse().ok()).ok_or_else(wrong)?;
    let [x, y, z, qw, qx, qy, qz] = numbers[..] else { return Err(wrong()) };
    let square = qw * qw + qx * qx + qy * qy + qz * qz;
    if !(x + y + z).is_finite() || !square.is_finite() || square <= 0.0 {
        return Err(wrong());
    }
    let station = Station::turned([x, y, z], [qw, qx, qy, qz]);
    Ok(Some(station).filter(|station| *station != Station::at([0.0; 3])))
}
