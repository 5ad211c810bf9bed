//! OFF, the Object File Format of Geomview: text, and binary of the byte order of networks.

mod binary;
mod text;

use crate::scan::colour;
use crate::scan::error::ScanFault;
use crate::scan::polygon::fan;
use crate::scan::raw::{Odd, Polygon, RawMesh};

const FORMAT: &str = "OFF";

/// Reads an OFF file with any of the prefixes ST, C, N and 4. Polygons are fans so far; colours of faces are left out;
/// without faces it is a cloud of points.
pub(in crate::scan) fn read(bytes: &[u8]) -> Result<RawMesh, ScanFault> {
    let Some((kind, rest)) = Kind::of(bytes) else {
        let message = "expected `OFF`, before which `ST`, `C`, `N` and `4` may stand";
        return Err(ScanFault::malformed(FORMAT, "header", message));
    };
    if kind.dimensions {
        let message = "`nOFF` has points of any dimension; export it as `OFF`, in three dimensions";
        return Err(ScanFault::malformed(FORMAT, "header", message));
    }
    let mut mesh = Mesh { kind, ..Mesh::default() };
    match rest.trim_ascii_start().strip_prefix(b"BINARY") {
        Some(body) => binary::read(body, bytes.len(), &mut mesh)?,
        None => text::read(bytes, bytes.len() - rest.len(), &mut mesh)?,
    }
    mesh.finish()
}

/// Whether a file that begins so is of this format.
pub(in crate::scan) fn recognise(head: &[u8]) -> bool {
    Kind::of(head).is_some()
}

/// What a vertex has, by the file's first word.
#[derive(Clone, Copy, Default, Debug, PartialEq, Eq)]
struct Kind {
    texcoords: bool,
    colours: bool,
    normals: bool,
    /// Positions have a fourth number, by which the others are divided.
    homogeneous: bool,
    /// The number of dimensions follows.
    dimensions: bool,
}

impl Kind {
    /// The kind, and what follows the first word; comments may precede it.
    fn of(bytes: &[u8]) -> Option<(Self, &[u8])> {
        let mut rest = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
        while rest.starts_with(b"#") {
            rest = &rest[rest.iter().position(|b| matches!(b, b'\n' | b'\r'))?..];
            rest = rest.trim_ascii_start();
        }
        let mut kind = Self::default();
        // `n` is not `N`, but where the whole word is in small letters.
        let take = |rest: &mut &[u8], prefix: &str| {
            let begins = rest.get(..prefix.len()).is_some_and(|begin| begin.eq_ignore_ascii_case(prefix.as_bytes()));
            *rest = if begins { &rest[prefix.len()..] } else { rest };
            begins
        };
        kind.texcoords = take(&mut rest, "ST");
        // Either order is written.
        kind.colours = take(&mut rest, "C");
        kind.normals = !rest.starts_with(b"nOFF") && take(&mut rest, "N");
        kind.colours |= take(&mut rest, "C");
        kind.homogeneous = take(&mut rest, "4");
        kind.dimensions = !kind.normals && take(&mut rest, "n");
        let ends = |b: &u8| b.is_ascii_whitespace() || b.is_ascii_digit() || *b == b'#';
        (take(&mut rest, "OFF") && rest.first().is_none_or(ends)).then_some((kind, rest))
    }

    /// The word.
    fn name(self) -> String {
        let prefixes =
            [(self.texcoords, "ST"), (self.colours, "C"), (self.normals, "N"), (self.homogeneous, "4"), (true, "OFF")];
        prefixes.into_iter().filter(|(is, _)| *is).map(|(_, prefix)| prefix).collect()
    }

    /// The fewest numbers of a vertex: colours have three, or four with their opacity.
    fn numbers(self) -> usize {
        3 + usize::from(self.homogeneous)
            + 3 * usize::from(self.normals)
            + 3 * usize::from(self.colours)
            + 2 * usize::from(self.texcoords)
    }
}

/// What has been read.
#[derive(Default)]
struct Mesh {
    kind: Kind,
    raw: RawMesh,
    /// As many as positions, or none.
    colours: Vec<[f32; 3]>,
    /// A colour or an opacity is greater than 1.
    large: bool,
    short: Option<Odd<String>>,
}

impl Mesh {
    /// Takes the numbers of a vertex; false if they are too few or too many.
    fn add_vertex(&mut self, numbers: &[f64]) -> bool {
        let (kind, least) = (self.kind, self.kind.numbers());
        if numbers.len() != least && !(kind.colours && numbers.len() == least + 1) {
            return false;
        }
        let of = |at: usize| [numbers[at], numbers[at + 1], numbers[at + 2]];
        let mut at = 3;
        let mut position = of(0);
        if kind.homogeneous {
            position = position.map(|c| c / numbers[3]);
            at = 4;
        }
        self.raw.positions.push(position);
        if kind.normals {
            self.raw.normals.push(of(at));
            at += 3;
        }
        if kind.colours {
            self.colours.push(of(at).map(|c| c as f32));
            let end = numbers.len() - 2 * usize::from(kind.texcoords);
            self.large |= numbers[at..end].iter().any(|c| *c > 1.0);
        }
        if kind.texcoords {
            self.raw.texcoords.push([numbers[numbers.len() - 2], numbers[numbers.len() - 1]]);
        }
        true
    }

    /// Takes the corners of the face with a number, counted from 1, which are valid.
    fn add_face(&mut self, corners: &[u32], number: usize) {
        if corners.len() < 3 {
            Odd::add(&mut self.short, || format!("face {number} (counted from 1)"));
        }
        if let (Ok(count @ 4..), Ok(place)) = (u32::try_from(corners.len()), u32::try_from(number)) {
            self.raw.polygons.push(Polygon { start: self.raw.triangles.len(), corners: count, place });
        }
        self.raw.triangles.extend(fan(corners.len()).map(|triangle| triangle.map(|c| corners[c])));
    }

    /// A corner of a face, if there is such a vertex.
    fn corner(&self, index: i64, place: impl FnOnce() -> String) -> Result<u32, ScanFault> {
        let count = self.raw.positions.len();
        match u32::try_from(index) {
            Ok(corner) if (corner as usize) < count => Ok(corner),
            _ => Err(ScanFault::IndexOutOfRange { place: place(), what: "vertex", index, count }),
        }
    }

    fn finish(mut self) -> Result<RawMesh, ScanFault> {
        if self.raw.positions.is_empty() {
            return Err(ScanFault::NoVertices);
        }
        if let Some(odd) = self.short {
            let (place, others) = (&odd.first, odd.others());
            self.raw.warnings.push(format!("{place}: fewer than three corners, it is left out{others}"));
        }
        // Opacities tell the scale of colours that are nearly black.
        self.raw.attributes.colours = if self.large {
            self.colours.iter().map(|colour| colour.map(colour::byte)).collect()
        } else {
            colour::of_numbers(&self.colours)
        };
        Ok(self.raw)
    }
}
