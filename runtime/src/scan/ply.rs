//! PLY: ASCII and binary of both byte orders.

use super::error::ScanFault;
use super::polygon::fan;
use super::raw::{Polygon, RawMesh};

const FORMAT: &str = "PLY";

/// Reads a PLY file: elements `vertex` (x y z; nx ny nz; s t), `face` (`vertex_indices` or `vertex_index`; `texcoord`)
/// and `tristrips`; others are skipped. Polygons are fans so far; without faces it is a cloud of points.
pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, ScanFault> {
    let (header, body) = split_header(bytes)?;
    let (encoding, elements) = parse_header(&header)?;
    let vertices = elements.iter().filter(|element| element.name == "vertex").map(|element| element.count).sum();
    if vertices == 0 {
        return Err(ScanFault::NoVertices);
    }
    let mut reader = Reader { rest: body, encoding, vertices, textured: true, raw: RawMesh::default() };
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
    let Reader { mut raw, textured, .. } = reader;
    if !textured {
        raw.corner_texcoords.clear();
    }
    Ok(raw)
}

/// How the numbers of the body are written.
#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

struct Property<'a> {
    name: &'a str,
    /// The type of the count that precedes the numbers of a list; none where there is one number.
    count: Option<Scalar>,
    scalar: Scalar,
}

struct Element<'a> {
    name: &'a str,
    /// The number of rows.
    count: usize,
    properties: Vec<Property<'a>>,
}

/// The header as text with plain line ends, and what follows it. Comments in other encodings than UTF-8 are common.
fn split_header(bytes: &[u8]) -> Result<(String, &[u8]), ScanFault> {
    let cut_off =
        || ScanFault::malformed(FORMAT, "header", "the file ends before `end_header`; it is cut off: export it again");
    if !bytes.starts_with(b"ply") {
        return Err(ScanFault::malformed(FORMAT, "line 1", "expected `ply`"));
    }
    let marker = b"end_header";
    let mut from = 0;
    let end = loop {
        let found = bytes[from..].windows(marker.len()).position(|window| window == marker).ok_or_else(cut_off)?;
        let (start, end) = (from + found, from + found + marker.len());
        // The word may also stand in a comment: it must have a line of its own.
        if matches!(bytes[start - 1], b'\n' | b'\r') && bytes.get(end).is_none_or(u8::is_ascii_whitespace) {
            break end;
        }
        from = end;
    };
    let blanks = bytes[end..].iter().take_while(|b| matches!(b, b' ' | b'\t')).count();
    let rest = &bytes[end + blanks..];
    let body = rest.strip_prefix(b"\r\n").or(rest.strip_prefix(b"\n")).or(rest.strip_prefix(b"\r")).unwrap_or(rest);
    Ok((String::from_utf8_lossy(&bytes[..end]).replace("\r\n", "\n").replace('\r', "\n"), body))
}

fn parse_header(header: &str) -> Result<(Encoding, Vec<Element<'_>>), ScanFault> {
    let (mut encoding, mut elements) = (None, Vec::<Element>::new());
    for (i, line) in header.lines().enumerate() {
        let fault = |expected: &str| {
            let message = format!("expected {expected}, found `{}`", line.trim());
            ScanFault::malformed(FORMAT, format!("line {}", i + 1), message)
        };
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["format", name, ..] => {
                encoding = Some(match name {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    _ => return Err(fault("format ascii, binary_little_endian or binary_big_endian")),
                });
            }
            ["element", name, count, ..] => {
                let count = count.parse().map_err(|_| fault("the element's number of rows"))?;
                elements.push(Element { name, count, properties: Vec::new() });
            }
            ["property", ref words @ ..] => match (elements.last_mut(), Property::of(words)) {
                (Some(element), Some(property)) => element.properties.push(property),
                _ => return Err(fault(PROPERTY)),
            },
            _ => {}
        }
    }
    let fault = |message: String| ScanFault::malformed(FORMAT, "header", message);
    for Element { name, count, properties } in &elements {
        if *count > 0 && properties.is_empty() {
            return Err(fault(format!("element `{name}` has {count} rows but no properties")));
        }
        let has = |axis: &str| properties.iter().any(|p| p.name == axis && p.count.is_none());
        let missing = ["x", "y", "z"].into_iter().find(|axis| !has(axis));
        if let Some(axis) = missing.filter(|_| *name == "vertex") {
            return Err(fault(format!("element `vertex` has no property `{axis}`; x, y and z are needed")));
        }
    }
    let encoding = encoding.ok_or_else(|| fault("there is no line `format`".to_owned()))?;
    Ok((encoding, elements))
}

/// The form of a line `property`, for messages.
const PROPERTY: &str = "`property TYPE NAME` or `property list TYPE TYPE NAME` below `element`, with the types char, uchar, short, \
                        ushort, int, uint, float and double";

impl<'a> Property<'a> {
    /// The property that the words behind `property` declare.
    fn of(words: &[&'a str]) -> Option<Self> {
        let scalar = |name: &str| match name {
            "char" | "int8" => Some(Scalar::I8),
            "uchar" | "uint8" => Some(Scalar::U8),
            "short" | "int16" => Some(Scalar::I16),
            "ushort" | "uint16" => Some(Scalar::U16),
            "int" | "int32" => Some(Scalar::I32),
            "uint" | "uint32" => Some(Scalar::U32),
            "float" | "float32" => Some(Scalar::F32),
            "double" | "float64" => Some(Scalar::F64),
            _ => None,
        };
        match *words {
            ["list", count, element, name, ..] => {
                Some(Self { name, count: Some(scalar(count)?), scalar: scalar(element)? })
            }
            [element, name, ..] => Some(Self { name, count: None, scalar: scalar(element)? }),
            _ => None,
        }
    }
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

/// The names of the list of a face's vertices.
const INDICES: [&str; 2] = ["vertex_indices", "vertex_index"];

struct Reader<'a> {
    rest: &'a [u8],
    encoding: Encoding,
    /// The number of vertices, which may come after the faces.
    vertices: usize,
    /// Whether every corner of every face so far has a texture coordinate.
    textured: bool,
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
            for (property, numbers) in element.properties.iter().zip(&mut row) {
                self.read_property(property, numbers).map_err(|message| {
                    ScanFault::malformed(FORMAT, format!("element `{}`, row {number}", element.name), message)
                })?;
            }
            add(self, element, number, &row)?;
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
            let shown = || word.chars().take(40).collect::<String>();
            return number.map_err(|_| format!("expected a number, found `{}`", shown()));
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
        let text = self.rest.trim_ascii_start();
        let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
        let (word, rest) = text.split_at(end);
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
            for (k, w) in indices.windows(3).enumerate() {
                self.raw.triangles.push(if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] });
            }
        }
        Ok(())
    }

    fn checked(&self, indices: &[f64], kind: &str, number: usize) -> Result<Vec<u32>, ScanFault> {
        let check = |&index: &f64| {
            if index >= 0.0 && index < self.vertices as f64 {
                return Ok(index as u32);
            }
            let place = format!("{kind} {number} (counted from 1)");
            Err(ScanFault::IndexOutOfRange { place, what: "vertex", index: index as i64, count: self.vertices })
        };
        indices.iter().map(check).collect()
    }
}

const CUT_OFF: &str = "the file ends here; it is cut off: export it again";
