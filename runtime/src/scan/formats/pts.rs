//! PTS: a line with the number of points, then a line for each: its coordinates, the strength of its echo and its
//! colour. Several such blocks may follow each other; each is a scan. The format has no unit.

use super::batch::Batch;
use super::text::{self, Lines, lone_count, row};
use crate::scan::cloud::{Entry, Input, Points, RawPoint};
use crate::scan::error::ScanFault;

const FORMAT: &str = "PTS";
/// What a line of a point has.
const ROW: &str = "`x y z`, and intensity, `red green blue` or all four behind it";

/// Whether a file that begins so is of this format.
pub(in crate::scan) fn recognise(head: &[u8]) -> bool {
    // The first lines tell.
    let head = text::decoded(&head[..head.len().min(1 << 12)]);
    let lines = head.split(|b| *b == b'\n' || *b == b'\r');
    let mut lines = lines.filter(|line| !line.trim_ascii().is_empty());
    let (Some(count), Some(first)) = (lines.next(), lines.next()) else { return false };
    let mut numbers = [0.0; 7];
    let width = row(first, &mut numbers);
    // Normals are not for PTS.
    let colour = width.and_then(|width| numbers[..width].last_chunk()).and_then(|last| text::colour(*last, 255.0));
    lone_count(count).is_some() && (matches!(width, Some(3 | 4)) || matches!(width, Some(6 | 7)) && colour.is_some())
}

/// Reads a file of this format.
pub(in crate::scan) fn read(input: Input, points: &mut dyn Points) -> Result<(), ScanFault> {
    let only = input.only;
    let mut batch = Batch::new(points, input.size);
    let mut lines = Lines::new(input, FORMAT)?;
    let mut scans = 0;
    let mut more = lines.advance_to_text()?;
    if more && lone_count(lines.line()).is_none() {
        if row(lines.line(), &mut [0.0; 7]).is_none_or(|count| count < 3) {
            return Err(lines.unexpected(&format!("the number of points, or {ROW}")));
        }
        batch.warn("it does not begin with the number of its points: whether it was cut off cannot be told".to_owned());
        return read_uncounted(&mut lines, only, &mut batch);
    }
    while more {
        let Some(count) = lone_count(lines.line()) else {
            let message = format!(
                "expected the number of points of another scan, or the end: more points follow than were announced; found `{}`",
                lines.shown()
            );
            return Err(lines.fault(message));
        };
        let block = Block { count, line: lines.number() };
        if only.is_none_or(|only| only == scans) {
            batch.begin(Entry::default(), lines.read())?;
            block.read(&mut lines, &mut batch)?;
        } else {
            block.pass(&mut lines, &mut batch)?;
        }
        scans += 1;
        more = lines.advance_to_text()?;
    }
    batch.flush(lines.read())?;
    if only.is_some_and(|only| only >= scans) { Err(ScanFault::NoSuchScan { count: scans }) } else { Ok(()) }
}

/// A file of one scan without its count, whose first line is the current one.
fn read_uncounted(lines: &mut Lines, only: Option<usize>, batch: &mut Batch<'_>) -> Result<(), ScanFault> {
    super::batch::require_first(only)?;
    let mut width = None;
    loop {
        let point = point(lines, &mut width)?;
        batch.push(point, lines.read())?;
        if !lines.advance_to_text()? {
            return batch.flush(lines.read());
        }
    }
}

/// A scan of a file.
struct Block {
    /// Number of its points.
    count: u64,
    /// The line that says so.
    line: u64,
}

impl Block {
    fn read(&self, lines: &mut Lines, batch: &mut Batch<'_>) -> Result<(), ScanFault> {
        let mut width = None;
        for i in 0..self.count {
            self.go_on(lines, i)?;
            let point = point(lines, &mut width)?;
            batch.push(point, lines.read())?;
        }
        Ok(())
    }

    /// A scan that is not wanted.
    fn pass(&self, lines: &mut Lines, batch: &mut Batch<'_>) -> Result<(), ScanFault> {
        for i in 0..self.count {
            self.go_on(lines, i)?;
            if i % 65_536 == 0 {
                batch.progress(lines.read());
            }
        }
        Ok(())
    }

    fn go_on(&self, lines: &mut Lines, found: u64) -> Result<(), ScanFault> {
        let (count, line) = (self.count, self.line);
        if !lines.advance_to_text()? {
            let message = format!(
                "it announces {count} points, the file ends after {found}; it is cut off: export or copy it again"
            );
            return Err(ScanFault::malformed(FORMAT, format!("line {line}"), message));
        }
        if lone_count(lines.line()).is_some() {
            let message = format!(
                "line {line} announces {count} points, and after {found} the number of another scan's follows; export it again"
            );
            return Err(lines.fault(message));
        }
        Ok(())
    }
}

/// The point of the current line, which has as many numbers as the others of its scan.
fn point(lines: &Lines, width: &mut Option<usize>) -> Result<RawPoint, ScanFault> {
    let mut n = [0.0; 7];
    let count = row(lines.line(), &mut n).filter(|count| matches!(count, 3 | 4 | 6 | 7));
    let Some(count) = count else {
        let decimal = if lines.line().contains(&b',') { " (with a point as decimal mark)" } else { "" };
        return Err(lines.unexpected(&format!("{ROW}{decimal}")));
    };
    let expected = *width.get_or_insert(count);
    if count != expected {
        return Err(lines.unexpected(&format!("{expected} numbers as in the lines before")));
    }
    let colour = match count {
        6 | 7 => {
            let numbers = [n[count - 3], n[count - 2], n[count - 1]];
            Some(text::colour(numbers, 255.0).ok_or_else(|| lines.unexpected("a colour of numbers from 0 to 255"))?)
        }
        _ => None,
    };
    let intensity = matches!(count, 4 | 7).then_some(n[3] as f32);
    Ok(RawPoint { position: [n[0], n[1], n[2]], normal: None, colour, intensity })
}

#[cfg(test)]
mod tests {
    use super::super::collected::{collect, mutate};
    use super::*;

    const TWO: &str = "2\n1 2 3 -100 255 0 1\n1.5 2.5e1 -3 2047 0 0 0\n\n1\r\n4 5 6 7 8 9 10\n";

    #[test]
    fn blocks_with_intensities_and_colours() {
        let found = collect(read, TWO.as_bytes(), None).unwrap();
        assert!(recognise(TWO.as_bytes()));
        assert_eq!(found.points.len(), 3);
        assert_eq!(found.entries.iter().map(|(_, first)| *first).collect::<Vec<_>>(), [0, 2]);
        assert_eq!((found.points[1].position, found.points[1].intensity), ([1.5, 25.0, -3.0], Some(2047.0)));
        assert_eq!((found.points[0].colour, found.unit), (Some([255, 0, 1]), None));
        let second = collect(read, TWO.as_bytes(), Some(1)).unwrap();
        assert_eq!((second.points.as_slice(), second.entries.len()), (&found.points[2..], 1));
        let error = collect(read, TWO.as_bytes(), Some(2)).unwrap_err();
        assert!(matches!(error, ScanFault::NoSuchScan { count: 2 }));
    }

    #[test]
    fn other_widths_and_no_count() {
        let three = collect(read, b"1\n1 2 3\n", None).unwrap();
        assert_eq!((three.points[0].colour, three.points[0].intensity), (None, None));
        let six = collect(read, b"1\n1 2 3 4 5 6\n", None).unwrap();
        assert_eq!((six.points[0].colour, six.points[0].intensity), (Some([4, 5, 6]), None));
        let bare = collect(read, b"1 2 3 4\nnan 2 3 4\n", None).unwrap();
        assert!(bare.points.len() == 1 && bare.empty == 1 && bare.warnings[0].contains("cut off"));
    }

    #[test]
    fn faults_name_the_line() {
        let cases = [
            ("3\n1 2 3\n4 5 6\n", "line 1: it announces 3 points, the file ends after 2"),
            ("1\n1 2 3\n4 5 6\n", "line 3: expected the number of points of another scan, or the end"),
            ("2\n1 2 3\n1\n4 5 6\n", "line 3: line 1 announces 2 points, and after 1"),
            ("2\n1 2 3\n4 5 x\n", "line 3: expected `x y z`"),
            ("2\n1 2 3\n4 5 6 7\n", "line 3: expected 3 numbers as in the lines before, found `4 5 6 7`"),
            ("1\n1,5 2 3\n", "point as decimal mark"),
            ("1\n1 2 3 0 0 256\n", "colour of numbers from 0 to 255"),
            ("version: 1\n", "line 1: expected the number of points"),
            ("99999999999999999999999\n1 2 3", "line 1: expected the number of points"),
        ];
        for (text, expected) in cases {
            let error = collect(read, text.as_bytes(), None).unwrap_err().to_string();
            assert!(error.contains(expected), "{text}: {error}");
        }
        assert!(!recognise(b"1\n1 2 3 0 -0.6 0.8\n") && recognise(b"1\n1 2 3 0 6 8\n"));
        assert!(!recognise(b"12\nfoo bar") && !recognise(b"1\n2\n1 2 3") && !recognise(b"1 2 3\n"));
    }

    #[test]
    fn faulty_files_do_no_harm() {
        mutate(read, &[TWO.as_bytes(), b"3\n1 2 3\n4 5 6\n7 8 9\n"], 5_000);
    }
}
