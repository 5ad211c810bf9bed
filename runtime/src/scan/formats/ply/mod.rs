//! PLY: ASCII and binary of both byte orders.

mod header;

use crate::scan::error::{ScanFault, shown};
use crate::scan::polygon::fan;
use crate::scan::raw::{Odd, Polygon, RawMesh};
use header::{Element, Encoding, INDICES, Property, Scalar, parse_header, split_header};

const FORMAT: &str = "PLY";

/// Reads a PLY file: elements `vertex` (x y z; nx ny nz; s t), `face` (`vertex_indices` or `vertex_index`; `texcoord`)
/// and `tristrips`; others are skipped. Polygons are fans so far; without faces it is a cloud of points.
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
        raw: RawMesh::default(),
    };
    for element in &elements {
        match element.name {
            "vertex" => reader.read_vertices(element)?,
            "face" => reader.read_rows(element, Reader::add_face)?,
            "tristrips" => {
                reader.textured = false;
                reader.read_rows(element, Reader::add_strip)?;
            }
            _ => reader.read_rows(element, |_, _, _, _| Ok(()))?,
        }
    }
    if let Some(last) = elements.last() {
        reader.require_end(last)?;
    }
    let Reader { mut raw, textured, short, .. } = reader;
    if let Some(odd) = short {
        let (place, others) = (&odd.first, odd.others());
        raw.warnings.push(format!("{place}: fewer than three corners, it is left out{others}"));
    }
    if !textured {
        raw.corner_texcoords.clear();
    }
    Ok(raw)
}

/// The place of a vertex's property in (x, y, z, nx, ny, nz, s, t).
fn slot(property: &Property) -> Option<usize> {
    const NAMES: [&[&str]; 8] =
        [&["x"], &["y"], &["z"], &["nx"], &["ny"], &["nz"], &["s", "u", "texture_u"], &["t", "v", "texture_v"]];
    NAMES.iter().position(|names| property.count.is_none() && names.contains(&property.name))
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
    raw: RawMesh,
}

impl Reader<'_> {
    fn read_vertices(&mut self, element: &Element) -> Result<(), ScanFault> {
        let slots: Vec<Option<usize>> = element.properties.iter().map(slot).collect();
        let has = |k: usize| slots.contains(&Some(k));
        let (has_normals, has_texcoords) = ((3..6).any(has), has(6) || has(7));
        self.read_rows(element, |reader, _, _, row| {
            let mut values = [f64::NAN, f64::NAN, f64::NAN, f64::NAN, f64::NAN, f64::NAN, 0.0, 0.0];
            for (slot, numbers) in slots.iter().zip(row) {
                if let (Some(slot), [number]) = (slot, &numbers[..]) {
                    values[*slot] = *number;
                }
            }
            let [x, y, z, nx, ny, nz, s, t] = values;
            reader.raw.positions.push([x, y, z]);
            if has_normals {
                reader.raw.normals.push([nx, ny, nz]);
            }
            if has_texcoords {
                reader.raw.texcoords.push([s, t]);
            }
            Ok(())
        })
    }

    /// Reads the rows of an element and gives them, counted from 1, to `add`.
    fn read_rows(
        &mut self,
        element: &Element,
        add: impl Fn(&mut Self, &Element, usize, &Row) -> Result<(), ScanFault>,
    ) -> Result<(), ScanFault> {
        let mut row = vec![Vec::new(); element.properties.len()];
        for number in 1..=element.count {
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
        Ok(match scalar {
            Scalar::I8 => i8::from_le_bytes(self.read_bytes()?).into(),
            Scalar::U8 => u8::from_le_bytes(self.read_bytes()?).into(),
            Scalar::I16 => i16::from_le_bytes(self.read_bytes()?).into(),
            Scalar::U16 => u16::from_le_bytes(self.read_bytes()?).into(),
            Scalar::I32 => i32::from_le_bytes(self.read_bytes()?).into(),
            Scalar::U32 => u32::from_le_bytes(self.read_bytes()?).into(),
            Scalar::F32 => f32::from_le_bytes(self.read_bytes()?).into(),
            Scalar::F64 => f64::from_le_bytes(self.read_bytes()?),
        })
    }

    /// The next word of an ASCII file.
    fn read_word(&mut self) -> Result<std::borrow::Cow<'_, str>, String> {
        self.skip_blank();
        let end = self.rest.iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        if word.is_empty() { Err(CUT_OFF.to_owned()) } else { Ok(String::from_utf8_lossy(word)) }
    }

    /// The next bytes of a binary file, the least significant first.
    fn read_bytes<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let (bytes, rest) = self.rest.split_first_chunk().ok_or(CUT_OFF)?;
        self.rest = rest;
        let mut bytes = *bytes;
        if self.encoding == Encoding::BigEndian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn add_face(&mut self, element: &Element, number: usize, row: &Row) -> Result<(), ScanFault> {
        let texcoords = list(element, row, &["texcoord"]);
        let indices = self.checked(list(element, row, &INDICES), "face", number)?;
        self.textured &= !indices.is_empty() && texcoords.len() == 2 * indices.len();
        if indices.len() < 3 {
            Odd::add(&mut self.short, || format!("face {number} (counted from 1)"));
        }
        if let (Ok(corners @ 4..), Ok(place)) = (u32::try_from(indices.len()), u32::try_from(number)) {
            self.raw.polygons.push(Polygon { start: self.raw.triangles.len(), corners, place });
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
