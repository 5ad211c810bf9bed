//! PTX (Leica Cyclone): scans as grids of points in the scanner's own frame, each behind a header with its place.
//!
//! The header has ten lines: the number of columns, the number of rows, the scanner's place, its three axes, and a
//! matrix of four rows that is applied to points as rows, (x y z 1) M. Cells without an echo are `0 0 0`. The format's
//! unit is the metre.

use super::batch::Batch;
use super::raster;
use super::text::{self, Lines, lone_count, row};
use crate::scan::attributes::Station;
use crate::scan::cloud::{Entry, Input, Points, RawPoint};
use crate::scan::error::ScanFault;
use crate::scan::unit::METRE;

const FORMAT: &str = "PTX";
/// The largest difference of products of axes from those of a rotation: matrices have four digits and more.
const SKEWED: f64 = 2e-3;
/// The largest distance of two places that are said to be one, in metres, relative to their size or to 1.
const APART: f64 = 1e-3;

/// The cells of a scan by which it is judged whether they are a raster of angles.
const PROBED: u64 = 1 << 16;

/// Whether a file that begins so is of this format.
pub(in crate::scan) fn recognise(head: &[u8]) -> bool {
    // The first lines tell.
    let head = text::decoded(&head[..head.len().min(1 << 12)]);
    let lines = head.split(|b| *b == b'\n' || *b == b'\r');
    let mut lines = lines.filter(|line| !line.trim_ascii().is_empty());
    let is_size = lines.by_ref().take(2).filter(|line| lone_count(line).is_some()).count() == 2;
    is_size && lines.next().is_some_and(|place| row(place, &mut [0.0; 3]) == Some(3))
}

/// Reads a file of this format.
pub(in crate::scan) fn read(input: Input, points: &mut dyn Points) -> Result<(), ScanFault> {
    let only = input.only;
    let mut batch = Batch::new(points, input.size);
    batch.usual_unit(METRE);
    let mut lines = Lines::new(input, FORMAT)?;
    let mut scans = 0;
    while lines.advance_to_text()? {
        let header = Header::read(&mut lines)?;
        if only.is_none_or(|only| only == scans) {
            header.read_points(&mut lines, &mut batch)?;
        } else {
            for i in 0..header.cells {
                header.go_on(&mut lines, i)?;
                if i % 65_536 == 0 {
                    batch.progress(lines.read());
                }
            }
        }
        scans += 1;
    }
    batch.flush(lines.read())?;
    if only.is_some_and(|only| only >= scans) { Err(ScanFault::NoSuchScan { count: scans }) } else { Ok(()) }
}

/// What stands before the points of a scan.
struct Header {
    /// Its first line.
    line: u64,
    columns: u64,
    rows: u64,
    cells: u64,
    place: [f64; 3],
    axes: [[f64; 3]; 3],
    /// Applied to points as rows.
    matrix: [[f64; 4]; 4],
}

impl Header {
    /// Reads a header whose first line is the current one.
    fn read(lines: &mut Lines) -> Result<Self, ScanFault> {
        let line = lines.number();
        let columns = lone_count(lines.line()).ok_or_else(|| {
            lines.unexpected(
                "the number of columns of another scan, or the end (more points follow than its header has cells)",
            )
        })?;
        next(lines, "the number of rows")?;
        let rows = lone_count(lines.line()).ok_or_else(|| lines.unexpected("the number of rows"))?;
        let cells = columns.checked_mul(rows).ok_or_else(|| lines.unexpected("a number of rows that can be"))?;
        let place = numbers(lines, "the scanner's place, three numbers")?;
        let mut axes = [[0.0; 3]; 3];
        for axis in &mut axes {
            *axis = numbers(lines, "an axis of the scanner, three numbers")?;
        }
        let mut matrix = [[0.0; 4]; 4];
        for (i, row) in matrix.iter_mut().enumerate() {
            *row = numbers(lines, "a row of the matrix, four numbers")?;
            let last = if i == 3 { 1.0 } else { 0.0 };
            if (row[3] - last).abs() > 1e-6 {
                return Err(lines.unexpected(&format!(
                    "a row of the matrix that ends with {last} (the translation is its last row); export the scan again"
                )));
            }
        }
        let header = Self { line, columns, rows, cells, place, axes, matrix };
        let determinant = determinant(&header.turned());
        if !(determinant > 1e-9) {
            let what = if determinant < -1e-9 { "mirrors the scan" } else { "makes the scan flat" };
            return Err(lines.fault(format!("the matrix above {what}; export it again, or make it a rotation")));
        }
        Ok(header)
    }

    /// The matrix that turns points as columns.
    fn turned(&self) -> [[f64; 3]; 3] {
        std::array::from_fn(|i| std::array::from_fn(|j| self.matrix[j][i]))
    }

    /// Where the scanner stood: where the matrix puts the origin of its frame, or, in files whose points are in the
    /// common frame already, where the place and the axes say.
    fn station(&self, batch: &mut Batch<'_>) -> Option<Station> {
        let matrix = Station { place: self.shift(), rotation: self.turned() };
        if !is_rotation(&matrix.rotation) {
            batch.warn(format!(
                "line {}: the matrix behind it is not a rotation. It is applied as it stands, and where the scanner stood is not used",
                self.line
            ));
            return None;
        }
        let apart = (0..3).any(|k| {
            (self.place[k] - matrix.place[k]).abs() > APART * self.place[k].abs().max(matrix.place[k].abs()).max(1.0)
        });
        if !apart || self.place == [0.0; 3] {
            return Some(matrix);
        }
        if matrix == Station::at([0.0; 3]) {
            let rotation = std::array::from_fn(|i| std::array::from_fn(|j| self.axes[j][i]));
            let usable = is_rotation(&rotation) && determinant(&rotation) > 0.0;
            return Some(if usable { Station { place: self.place, rotation } } else { Station::at(self.place) });
        }
        batch.warn(format!(
            "line {}: the scanner's place is not that of the matrix behind it, which is used",
            self.line + 2
        ));
        Some(matrix)
    }

    /// The pose moves nothing and the place is the origin: programs write that for merged clouds, too.
    fn tells_nothing(&self) -> bool {
        self.place == [0.0; 3] && self.shift() == [0.0; 3] && self.turned() == Station::at([0.0; 3]).rotation
    }

    fn shift(&self) -> [f64; 3] {
        let [.., [x, y, z, _]] = self.matrix;
        [x, y, z]
    }

    fn read_points(&self, lines: &mut Lines, batch: &mut Batch<'_>) -> Result<(), ScanFault> {
        let mut width = None;
        let probed = if self.tells_nothing() { self.cells.min(PROBED) } else { 0 };
        let first: Vec<Option<RawPoint>> =
            (0..probed).map(|i| self.cell(lines, i, &mut width)).collect::<Result<_, ScanFault>>()?;
        let places: Vec<Option<[f64; 3]>> = first.iter().map(|cell| cell.map(|point| point.position)).collect();
        let station = if probed == 0 || raster::is_of_angles(&places) {
            self.station(batch)
        } else {
            batch.warn(format!(
                "line {}: the pose behind it moves nothing, as that of merged clouds, and the cells are no raster of angles about the origin: where the scanner stood is not known",
                self.line
            ));
            None
        };
        batch.begin(Entry { name: String::new(), station }, lines.read())?;
        let mut push = |cell: Option<RawPoint>, read: u64| match cell {
            Some(point) => batch.push(point, read),
            None => batch.push_empty(read),
        };
        first.into_iter().try_for_each(|cell| push(cell, lines.read()))?;
        for i in probed..self.cells {
            let cell = self.cell(lines, i, &mut width)?;
            push(cell, lines.read())?;
        }
        Ok(())
    }

    /// The next cell, the one of a number; None where it is empty. All lines have as many numbers as the first, whose
    /// number `width` takes.
    fn cell(&self, lines: &mut Lines, i: u64, width: &mut Option<usize>) -> Result<Option<RawPoint>, ScanFault> {
        let mut n = [0.0; 7];
        self.go_on(lines, i)?;
        let count = row(lines.line(), &mut n).filter(|count| matches!(count, 3 | 4 | 7));
        let expected = *width.get_or_insert(count.unwrap_or(4));
        if count != Some(expected) {
            let cells = "as there are cells left in the scan";
            let what = if expected == 7 { "`x y z intensity red green blue`" } else { "`x y z intensity`" };
            return Err(lines.unexpected(&format!("as many lines of {what} {cells} ({})", self.cells - i)));
        }
        if n[..3] == [0.0; 3] || !n[..3].iter().all(|c| c.is_finite()) {
            return Ok(None);
        }
        let (m, shift) = (self.turned(), self.shift());
        let position = std::array::from_fn(|k| m[k][0] * n[0] + m[k][1] * n[1] + m[k][2] * n[2] + shift[k]);
        let colour = match expected {
            7 => {
                let colour = text::colour([n[4], n[5], n[6]], 255.0);
                Some(colour.ok_or_else(|| lines.unexpected("a colour of numbers from 0 to 255"))?)
            }
            _ => None,
        };
        let intensity = (expected > 3).then_some(n[3] as f32);
        Ok(Some(RawPoint { position, normal: None, colour, intensity }))
    }

    /// Goes on to the next cell.
    fn go_on(&self, lines: &mut Lines, found: u64) -> Result<(), ScanFault> {
        if lines.advance_to_text()? {
            return Ok(());
        }
        let Self { columns, rows, cells, line, .. } = self;
        let message = format!(
            "it announces {columns} columns of {rows} rows, {cells} cells, and the file ends after {found}; it is cut off: export or copy it again"
        );
        Err(ScanFault::malformed(FORMAT, format!("line {line}"), message))
    }
}

/// Goes on to the next line with something in it, which is expected.
fn next(lines: &mut Lines, expected: &str) -> Result<(), ScanFault> {
    if lines.advance_to_text()? {
        return Ok(());
    }
    Err(lines.fault(format!("expected {expected}, the file ends; it is cut off: export or copy it again")))
}

/// The numbers of the next line.
fn numbers<const N: usize>(lines: &mut Lines, expected: &str) -> Result<[f64; N], ScanFault> {
    next(lines, expected)?;
    let mut numbers = [0.0; N];
    let count = row(lines.line(), &mut numbers);
    if count != Some(N) || !numbers.iter().all(|n| n.is_finite()) {
        return Err(lines.unexpected(expected));
    }
    Ok(numbers)
}

fn determinant(m: &[[f64; 3]; 3]) -> f64 {
    let minor = |i: usize, j: usize| m[1][i] * m[2][j] - m[1][j] * m[2][i];
    m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
}

/// Whether rows are of unit length and at right angles.
fn is_rotation(m: &[[f64; 3]; 3]) -> bool {
    (0..3).all(|i| {
        (0..=i).all(|j| {
            let product: f64 = (0..3).map(|k| m[i][k] * m[j][k]).sum();
            (product - if i == j { 1.0 } else { 0.0 }).abs() < SKEWED
        })
    })
}

#[cfg(test)]
mod tests {
    use super::super::collected::{collect, mutate};
    use super::*;

    /// A quarter of a turn about z: the scanner's x is the scan's y.
    const TURNED: &str = "10 20 30\n0 1 0\n-1 0 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n10 20 30 1\n";
    const PLAIN: &str = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";

    fn two() -> String {
        format!("2\n2\n{TURNED}1 2 3 0.25\n0 0 0 0.5\n4 5 6 1\nnan 0 0 0\n1\n1\n{PLAIN}1 2 3 0.5 9 8 7\n")
    }

    #[test]
    fn scans_in_their_places() {
        let two = two();
        assert!(recognise(two.as_bytes()));
        let found = collect(read, two.as_bytes(), None).unwrap();
        let positions: Vec<_> = found.points.iter().map(|p| p.position).collect();
        assert_eq!(positions, [[8.0, 21.0, 33.0], [5.0, 24.0, 36.0], [1.0, 2.0, 3.0]]);
        assert_eq!((found.empty, found.unit, found.entries.len()), (2, Some(1000.0), 2));
        let station = found.entries[0].0.station.unwrap();
        assert_eq!(station.point([1.0, 2.0, 3.0]), positions[0]);
        assert_eq!((found.points[2].colour, found.points[0].intensity), (Some([9, 8, 7]), Some(0.25)));
        let second = collect(read, two.as_bytes(), Some(1)).unwrap();
        assert_eq!((second.points.as_slice(), second.empty), (&found.points[2..], 0));
        assert!(collect(read, two.as_bytes(), Some(2)).is_err());
    }

    #[test]
    fn points_that_are_in_place_already() {
        let text = format!("1\n1\n{}1 2 3 0.5\n", PLAIN.replacen("0 0 0\n", "7 8 9\n", 1));
        let found = collect(read, text.as_bytes(), None).unwrap();
        assert_eq!(found.entries[0].0.station, Some(Station::at([7.0, 8.0, 9.0])));
        assert_eq!(found.points[0].position, [1.0, 2.0, 3.0]);
        let text = format!("1\n1\n{}1 2 3 0.5\n", TURNED.replacen("10 20 30\n", "7 8 9\n", 1));
        let found = collect(read, text.as_bytes(), None).unwrap();
        assert!(found.warnings[0].contains("line 3: the scanner's place"), "{:?}", found.warnings);
        let scaled = TURNED.replace("0 1 0 0\n-1 0 0 0\n0 0 1 0\n", "0 2 0 0\n-2 0 0 0\n0 0 2 0\n");
        let found = collect(read, format!("1\n1\n{scaled}1 2 3 0.5\n").as_bytes(), None).unwrap();
        assert_eq!((found.points[0].position, found.entries[0].0.station), ([6.0, 22.0, 36.0], None));
        assert!(found.warnings[0].contains("not a rotation"), "{:?}", found.warnings);
    }

    #[test]
    fn a_pose_that_moves_nothing_is_one_only_of_a_raster() {
        let rows = |turned: bool| -> String {
            let cell = |i: u32| {
                let (azimuth, elevation) = (f64::from(i / 40) * 0.02, f64::from(i % 40) * 0.02 - 0.3);
                let p = [azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin()];
                let p = p.map(|c| c * (2.0 + 0.3 * f64::from(i * 7 % 5)));
                let p = if turned { [p[2], 2.0 + p[0], p[1]] } else { p };
                format!("{:.5} {:.5} {:.5} 0.5\n", p[0], p[1], p[2])
            };
            (0..400).map(cell).collect()
        };
        for (turned, station) in [(false, Some(Station::at([0.0; 3]))), (true, None)] {
            let text = format!("10\n40\n{PLAIN}{}", rows(turned));
            let found = collect(read, text.as_bytes(), None).unwrap();
            assert_eq!((found.entries[0].0.station, found.points.len()), (station, 400));
            assert_eq!(found.warnings.iter().any(|w| w.contains("line 1: the pose behind it moves nothing")), turned);
        }
    }

    #[test]
    fn faults_name_the_line() {
        let with = |columns: &str, header: &str, rows: &str| format!("{columns}\n1\n{header}{rows}");
        let cases = [
            (
                with("2", PLAIN, "1 2 3 4\n"),
                "line 1: it announces 2 columns of 1 rows, 2 cells, and the file ends after 1",
            ),
            (with("1", PLAIN, "1 2 3 4\n1 2 3 4\n"), "line 12: expected the number of columns of another scan"),
            (with("2", PLAIN, "1 2 3 4\n5\n"), "line 12: expected as many lines of `x y z intensity`"),
            (with("1", PLAIN, "1 2 3 4 0 0 256\n"), "colour of numbers from 0 to 255"),
            (with("99999999999999999999", PLAIN, ""), "line 1: expected the number of columns"),
            (with("1", &PLAIN.replace("0 0 1 0\n", "0 0 -1 0\n"), ""), "line 10: the matrix above mirrors"),
            (with("1", &PLAIN.replace("0 0 1 0\n", "0 0 0 0\n"), ""), "line 10: the matrix above makes the scan flat"),
            (
                with("1", &PLAIN.replace("0 0 1 0\n", "0 0 1 5\n"), ""),
                "line 9: expected a row of the matrix that ends with 0",
            ),
            (with("1", "0 0\n", ""), "line 3: expected the scanner's place"),
            ("4000000000\n5000000000\n0 0 0\n".to_owned(), "line 2: expected a number of rows that can be"),
        ];
        for (text, expected) in cases {
            let error = collect(read, text.as_bytes(), None).unwrap_err().to_string();
            assert!(error.contains(expected), "{text}: {error}");
        }
        assert!(!recognise(b"1\n2\n3\n4\n") && !recognise(b"2\n1 2 3\n1 2 3\n"));
    }

    #[test]
    fn faulty_files_do_no_harm() {
        mutate(read, &[two().as_bytes()], 5_000);
    }
}
