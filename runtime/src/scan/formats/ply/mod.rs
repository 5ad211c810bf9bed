//! PLY: ASCII and binary of both byte orders.

mod face_colours;
mod grid;
mod header;
mod vertices;

use crate::scan::error::{ScanFault, shown};
use crate::scan::polygon::fan;
use crate::scan::raw::{Odd, Polygon, RawMesh};
use face_colours::FaceColours;
use grid::Grid;
use header::{Element, Encoding, INDICES, Property, Scalar, parse_header, split_header};

const FORMAT: &str = "PLY";

/// Reads a PLY file: elements `vertex` (x y z; nx ny nz; s t; a colour; an intensity), `face` (`vertex_indices` or
/// `vertex_index`; `texcoord`; a colour), `tristrips` and `range_grid`; others are skipped. Polygons are fans so far;
/// without faces it is a cloud of points.
pub(in crate::scan) fn read(bytes: &[u8]) -> Result<RawMesh, ScanFault> {
    let (header, body) = split_header(bytes)?;
    let (encoding, elements) = parse_header(&header)?;
    let vertices = elements.iter().filter(|element| element.name == "vertex").map(|element| element.count).sum();
    if vertices == 0 {
        return Err(ScanFault::NoVertices);
    }
    let line = header.lines().count() + 1;
    let mut reader = Reader {
        rest: body,
        size: bytes.len(),
        line,
        encoding,
        vertices,
        textured: true,
        short: None,
        grid: None,
        face_colours: None,
        raw: RawMesh::default(),
    };
    for element in &elements {
        match element.name {
            "vertex" => reader.read_vertices(element)?,
            "face" => {
                // More vertices than the file has room for are an error, which comes later where they stand behind.
                let fits = vertices <= bytes.len() / 3;
                reader.face_colours = if fits { FaceColours::of(element, vertices) } else { None };
                let read = reader.read_plain_faces(element);
                reader.read_rows(element, read + 1, Reader::add_face)?;
            }
            "tristrips" => {
                reader.textured = false;
                reader.read_rows(element, 1, Reader::add_strip)?;
            }
            "range_grid" => reader.read_grid(element, &header)?,
            _ => reader.read_rows(element, 1, |_, _, _, _| Ok(()))?,
        }
    }
    if let Some(last) = elements.last() {
        reader.require_end(last)?;
    }
    let Reader { mut raw, textured, short, grid, face_colours, .. } = reader;
    if let Some(grid) = grid {
        grid.triangulate(&mut raw);
    }
    if let Some(odd) = short {
        let (place, others) = (&odd.first, odd.others());
        raw.warnings.push(format!("{place}: fewer than three corners, it is left out{others}"));
    }
    if let Some(colours) = face_colours.filter(|_| raw.attributes.colours.is_empty() && !raw.triangles.is_empty()) {
        raw.attributes.colours = colours.at_vertices();
        let sentence = "colours are those of its faces: a vertex has the mean of those that meet there";
        raw.warnings.push(sentence.to_owned());
    }
    if !textured {
        raw.corner_texcoords.clear();
    }
    Ok(raw)
}

/// A row's numbers, property by property.
type Row = [Vec<f64>];

/// The numbers of the property that has one of some names; none where no property has.
fn list<'r>(element: &Element, row: &'r Row, names: &[&str]) -> &'r [f64] {
    let place = element.properties.iter().position(|property| names.contains(&property.name));
    place.map_or(&[], |place| &row[place])
}

struct Reader<'a> {
    rest: &'a [u8],
    /// The file's size in bytes.
    size: usize,
    /// The line where `rest` begins, counted from 1, in an ASCII file.
    line: usize,
    encoding: Encoding,
    /// The number of vertices, which may come after the faces.
    vertices: usize,
    /// Whether every corner of every face so far has a texture coordinate.
    textured: bool,
    /// Faces and strips without a triangle, by their kinds and rows.
    short: Option<Odd<String>>,
    grid: Option<Grid>,
    face_colours: Option<FaceColours>,
    raw: RawMesh,
}

impl Reader<'_> {
    /// Reads the rows of an element from number `from` on and gives them, counted from 1, to `add`.
    fn read_rows(
        &mut self,
        element: &Element,
        from: usize,
        mut add: impl FnMut(&mut Self, &Element, usize, &Row) -> Result<(), ScanFault>,
    ) -> Result<(), ScanFault> {
        let mut row = vec![Vec::new(); element.properties.len()];
        for number in from..=element.count {
            if self.encoding == Encoding::Ascii {
                self.skip_blank();
            }
            let begun = self.line;
            for (property, numbers) in element.properties.iter().zip(&mut row) {
                self.read_property(property, numbers).map_err(|message| {
                    let (place, name) = (self.place(), shown(property.name));
                    self.fault(element, number, format!("{place}, property `{name}`"), message)
                })?;
            }
            if self.encoding == Encoding::Ascii && !self.at_line_end() {
                let message = if self.line == begun {
                    format!("more numbers than the properties in the header: `{}` is left", self.rest_of_line())
                } else {
                    format!("fewer numbers than the properties in the header: the row goes on to line {}", self.line)
                };
                return Err(self.fault(element, number, format!("line {begun}"), message));
            }
            add(self, element, number, &row)?;
        }
        Ok(())
    }

    fn fault(&self, element: &Element, number: usize, place: String, message: String) -> ScanFault {
        let Element { name, count, .. } = element;
        let place = format!("{place}, element `{}`, row {number} of {count}", shown(name));
        ScanFault::malformed(FORMAT, place, message)
    }

    /// The place of what was read last.
    fn place(&self) -> String {
        match self.encoding {
            Encoding::Ascii => format!("line {}", self.line),
            _ => format!("byte {}", self.size - self.rest.len()),
        }
    }

    fn skip_blank(&mut self) {
        let text = self.rest.trim_ascii_start();
        self.line += count_lines(&self.rest[..self.rest.len() - text.len()]);
        self.rest = text;
    }

    fn at_line_end(&self) -> bool {
        let blank = |b: &&u8| b.is_ascii_whitespace() && !is_line_end(b);
        self.rest.iter().find(|b| !blank(b)).is_none_or(is_line_end)
    }

    /// The rest of a line, cut.
    fn rest_of_line(&self) -> String {
        let line = self.rest.trim_ascii_start();
        let end = line.iter().take(400).position(is_line_end).unwrap_or(line.len().min(400));
        shown(&String::from_utf8_lossy(&line[..end]))
    }

    /// Refuses rows that the header does not count: what it counts is then a part of the object. Some programs pad a
    /// file; less than a row is a rest that nobody misses.
    fn require_end(&mut self, last: &Element) -> Result<(), ScanFault> {
        let wrong = "the header counts fewer rows than the file holds, or rows of another kind; export it again";
        let name = shown(last.name);
        if self.encoding == Encoding::Ascii {
            self.skip_blank();
            if !self.rest.is_empty() {
                let message = format!("`{}` follows the last row of `{name}`: {wrong}", self.rest_of_line());
                return Err(ScanFault::malformed(FORMAT, self.place(), message));
            }
            return Ok(());
        }
        let padding = self.rest.iter().rev().take_while(|b| **b == 0 || b.is_ascii_whitespace()).count();
        let size = |p: &Property| p.count.unwrap_or(p.scalar).bytes();
        if self.rest.len() - padding >= last.properties.iter().map(size).sum::<usize>().max(1) {
            let message = format!("{} bytes follow the last row of `{name}`: {wrong}", self.rest.len());
            return Err(ScanFault::malformed(FORMAT, self.place(), message));
        }
        Ok(())
    }

    fn read_property(&mut self, property: &Property, numbers: &mut Vec<f64>) -> Result<(), String> {
        numbers.clear();
        let count = match property.count {
            None => 1.0,
            Some(scalar) => self.read_number(scalar)?,
        };
        if !(count >= 0.0 && count.fract() == 0.0) {
            return Err(format!("the list `{}` is {count} numbers long", property.name));
        }
        for _ in 0..count as u64 {
            numbers.push(self.read_number(property.scalar)?);
        }
        Ok(())
    }

    fn read_number(&mut self, scalar: Scalar) -> Result<f64, String> {
        if self.encoding == Encoding::Ascii {
            let word = self.read_word()?;
            // Numbers that are declared as single precision are rounded to it.
            let number = if let Scalar::F32 = scalar { word.parse().map(f32::into) } else { word.parse() };
            let number: f64 = number.map_err(|_| format!("expected a number, found `{}`", shown(&word)))?;
            if let Some((least, most)) = scalar.range() {
                if number.fract() != 0.0 {
                    return Err(format!("expected a whole number, found `{}`", shown(&word)));
                }
                if !(least..=most).contains(&number) {
                    let word = shown(&word);
                    return Err(format!("expected a whole number from {least} to {most} by its type, found `{word}`"));
                }
            }
            return Ok(number);
        }
        let (bytes, rest) = self.rest.split_at_checked(scalar.bytes()).ok_or(CUT_OFF)?;
        self.rest = rest;
        Ok(scalar.number(bytes, self.encoding == Encoding::BigEndian))
    }

    /// The next word of an ASCII file.
    fn read_word(&mut self) -> Result<std::borrow::Cow<'_, str>, String> {
        self.skip_blank();
        let end = self.rest.iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        if word.is_empty() { Err(CUT_OFF.to_owned()) } else { Ok(String::from_utf8_lossy(word)) }
    }

    /// Reads faces of a binary file that have a list of corners, with a count of one byte, and numbers of their own;
    /// stops before the first that is cut off or has a wrong index. Returns the number of those that were read.
    fn read_plain_faces(&mut self, element: &Element) -> usize {
        let mut sizes = [0, 0];
        let mut indices = None;
        for property in &element.properties {
            match (property.count, property.scalar) {
                (None, scalar) => sizes[usize::from(indices.is_some())] += scalar.bytes(),
                (Some(Scalar::U8), Scalar::I32 | Scalar::U32) if indices.is_none() => indices = Some(property.name),
                _ => return 0,
            }
        }
        if self.encoding == Encoding::Ascii || !indices.is_some_and(|name| INDICES.contains(&name)) {
            return 0;
        }
        let ([before, after], big_endian) = (sizes, self.encoding == Encoding::BigEndian);
        let index = |bytes: &[u8; 4]| if big_endian { u32::from_be_bytes(*bytes) } else { u32::from_le_bytes(*bytes) };
        let least = before + 1 + after;
        self.raw.triangles.reserve(element.count.min(self.rest.len() / (least + 12)));
        for read in 0..element.count {
            let Some(count) = self.rest.get(before).map(|count| usize::from(*count)) else { return read };
            let size = least + 4 * count;
            if size > self.rest.len() {
                return read;
            }
            let corners = self.rest[before + 1..before + 1 + 4 * count].as_chunks::<4>().0;
            // Negative ones are larger than any number of vertices that fits into a file.
            if corners.iter().any(|corner| index(corner) as usize >= self.vertices) {
                return read;
            }
            if let Some(colours) = &mut self.face_colours {
                let parts = [&self.rest[..before], &self.rest[size - after..size]];
                colours.add_bytes(parts, big_endian, corners.iter().map(index));
            }
            if let [a, b, c] = corners {
                self.raw.triangles.push([index(a), index(b), index(c)]);
            } else {
                let corners: Vec<u32> = corners.iter().map(index).collect();
                self.note_corners(corners.len(), read + 1);
                self.raw.triangles.extend(fan(corners.len()).map(|triangle| triangle.map(|c| corners[c])));
            }
            self.textured = false;
            self.rest = &self.rest[size..];
        }
        element.count
    }

    /// Notes the face with a number if it is not a triangle.
    fn note_corners(&mut self, corners: usize, number: usize) {
        if corners < 3 {
            Odd::add(&mut self.short, || format!("face {number} (counted from 1)"));
        }
        if let (Ok(corners @ 4..), Ok(place)) = (u32::try_from(corners), u32::try_from(number)) {
            self.raw.polygons.push(Polygon { start: self.raw.triangles.len(), corners, place });
        }
    }

    fn add_face(&mut self, element: &Element, number: usize, row: &Row) -> Result<(), ScanFault> {
        let texcoords = list(element, row, &["texcoord"]);
        let indices = self.checked(list(element, row, &INDICES), "face", number)?;
        self.textured &= !indices.is_empty() && texcoords.len() == 2 * indices.len();
        self.note_corners(indices.len(), number);
        if let Some(colours) = &mut self.face_colours {
            colours.add(row, &indices);
        }
        for corners in fan(indices.len()) {
            self.raw.triangles.push(corners.map(|c| indices[c]));
            if self.textured {
                self.raw.corner_texcoords.push(corners.map(|c| [texcoords[2 * c], texcoords[2 * c + 1]]));
            }
        }
        Ok(())
    }

    /// Adds a strip of triangles. A negative index ends a run; every other triangle of a run is turned round.
    fn add_strip(&mut self, element: &Element, number: usize, row: &Row) -> Result<(), ScanFault> {
        for run in list(element, row, &INDICES).split(|index| *index < 0.0) {
            let indices = self.checked(run, "strip", number)?;
            if indices.len() < 3 && !run.is_empty() {
                Odd::add(&mut self.short, || format!("strip {number} (counted from 1)"));
            }
            for (k, w) in indices.windows(3).enumerate() {
                self.raw.triangles.push(if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] });
            }
        }
        Ok(())
    }

    fn checked(&self, indices: &[f64], kind: &str, number: usize) -> Result<Vec<u32>, ScanFault> {
        let check = |&index: &f64| {
            if index >= 0.0 && index < self.vertices as f64 && index.fract() == 0.0 {
                return Ok(index as u32);
            }
            let place = format!("{}: {kind} {number} (counted from 1)", self.place());
            Err(ScanFault::IndexOutOfRange { place, what: "vertex", index: index as i64, count: self.vertices })
        };
        indices.iter().map(check).collect()
    }
}

/// Whether a byte ends a line; files from old programs have no other than the second.
fn is_line_end(byte: &u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

/// The number of lines that end in some bytes.
fn count_lines(bytes: &[u8]) -> usize {
    let ends = |byte: u8| bytes.iter().filter(|b| **b == byte).count();
    ends(b'\n').max(ends(b'\r'))
}

const CUT_OFF: &str = "the file ends here; it is cut off: export it again";
