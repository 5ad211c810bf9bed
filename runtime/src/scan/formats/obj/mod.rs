//! Wavefront OBJ, read by `tobj` from a prepared text.
//!
//! The preparation removes or rewrites everything that `tobj` does not accept: bytes that are not UTF-8, continued
//! lines, colours and comments behind the numbers, materials without a name, points and lines among the faces, and
//! files of points only. It also records line numbers and groups.

mod lost;

use crate::mesh::Group;
use crate::scan::colour;
use crate::scan::error::{ScanFault, shown};
use crate::scan::raw::{Polygon, RawMesh, is_usable};
use lost::{Signs, require_whole_end};
use std::borrow::Cow;
use std::io::{self, BufRead, Read};
use tobj::{LoadError, LoadOptions};

const FORMAT: &str = "OBJ";

/// Reads an OBJ file. Polygons are fans so far; without any face it is a cloud of points.
pub(in crate::scan) fn read(bytes: &[u8]) -> Result<RawMesh, ScanFault> {
    let text = String::from_utf8_lossy(bytes);
    let prepared = Prepared::new(&text)?;
    if prepared.vertices == 0 {
        return Err(ScanFault::NoVertices);
    }
    require_whole_end(&text)?;
    if prepared.triangles == 0 { prepared.cloud(!text.ends_with(['\n', '\r'])) } else { prepared.mesh() }
}

/// The statements of the geometry, and their counts before any number is parsed.
#[derive(Default)]
struct Prepared {
    text: String,
    /// Line in the file of every line of `text`, counted from 1.
    lines: Vec<u32>,
    vertices: usize,
    texcoords: usize,
    normals: usize,
    triangles: usize,
    groups: Vec<Group>,
    polygons: Vec<Polygon>,
    /// A face has a corner without texture coordinate; without normal.
    bare_texcoord: bool,
    bare_normal: bool,
    /// The numbers behind the coordinates of the first vertices, three each.
    colours: Vec<[f32; 3]>,
    signs: Signs,
}

impl Prepared {
    fn new(text: &str) -> Result<Self, ScanFault> {
        let mut prepared = Self::default();
        let mut lines = text.trim_start_matches('\u{feff}').lines().enumerate();
        while let Some((i, line)) = lines.next() {
            let mut line = Cow::Borrowed(line);
            // Each part is copied once, however many there are.
            while let Some(continued) = line.trim_end().strip_suffix('\\') {
                let end = continued.len();
                let whole = line.to_mut();
                whole.truncate(end);
                whole.push(' ');
                whole.push_str(lines.next().map_or("", |(_, next)| next));
            }
            prepared.signs.look(&line, i + 1);
            prepared.take(&line, i + 1)?;
        }
        if let Some(last) = prepared.groups.last_mut() {
            last.end = prepared.triangles;
        }
        prepared.groups.retain(|group| group.start < group.end);
        Ok(prepared)
    }

    fn take(&mut self, line: &str, number: usize) -> Result<(), ScanFault> {
        let line = line.split('#').next().unwrap_or_default();
        let mut words = line.split_whitespace();
        let Some(keyword) = words.next() else { return Ok(()) };
        match keyword {
            "v" => {
                let count = words.clone().count();
                // A fourth number is the weight; three are a colour, and a seventh its opacity.
                if matches!(count, 6 | 7) && self.colours.len() == self.vertices {
                    let colour: Option<Vec<f32>> = words.clone().skip(3).take(3).map(|c| c.parse().ok()).collect();
                    self.colours.extend(colour.and_then(|colour| <[f32; 3]>::try_from(colour).ok()));
                }
                self.push(keyword, words.take(if count == 4 { 4 } else { 3 }), number);
                self.vertices += 1;
            }
            "vt" => {
                self.push(keyword, words.chain(std::iter::once("0")).take(2), number);
                self.texcoords += 1;
            }
            "vn" => {
                self.push(keyword, words.take(3), number);
                self.normals += 1;
            }
            "f" => self.take_face(words, number)?,
            "g" | "o" => {
                let name = words.collect::<Vec<_>>().join(" ");
                let start = self.triangles;
                if let Some(last) = self.groups.last_mut() {
                    last.end = start;
                } else if start > 0 {
                    self.groups.push(Group { name: "unnamed".into(), start: 0, end: start });
                }
                let name = if name.is_empty() { "unnamed".to_owned() } else { name };
                self.groups.push(Group { name, start, end: start });
            }
            _ => {}
        }
        Ok(())
    }

    fn take_face<'a>(&mut self, words: impl Iterator<Item = &'a str> + Clone, number: usize) -> Result<(), ScanFault> {
        let corners = words.clone().count();
        if corners < 3 {
            return Ok(()); // A point or a line.
        }
        for corner in words.clone() {
            let mut indices = corner.split('/').skip(1);
            self.bare_texcoord |= indices.next().is_none_or(str::is_empty);
            self.bare_normal |= indices.next().is_none_or(str::is_empty);
            // Indices of more digits overflow inside `tobj`.
            if corner.split('/').any(|index| index.len() > 18) {
                let message = format!("an index has more than 18 digits: `{}`", shown(corner));
                return Err(ScanFault::malformed(FORMAT, format!("line {number}"), message));
            }
        }
        self.push("f", words, number);
        if let (Ok(corners @ 4..), Ok(place)) = (u32::try_from(corners), u32::try_from(number)) {
            self.polygons.push(Polygon { start: self.triangles, corners, place });
        }
        self.triangles += corners - 2;
        Ok(())
    }

    fn push<'a>(&mut self, keyword: &str, words: impl Iterator<Item = &'a str>, number: usize) {
        self.text.push_str(keyword);
        for word in words {
            self.text.push(' ');
            self.text.push_str(word);
        }
        self.text.push('\n');
        self.lines.push(u32::try_from(number).unwrap_or(u32::MAX));
    }

    fn mesh(self) -> Result<RawMesh, ScanFault> {
        let mut reader = CountedLines { rest: self.text.as_bytes(), lines: 0 };
        let options = LoadOptions { triangulate: true, ..LoadOptions::default() };
        let loaded = tobj::load_obj_buf(&mut reader, &options, |_| Err(LoadError::MaterialParseError));
        let (models, _) = loaded.map_err(|error| self.explain(error, reader.lines))?;
        // Without `o` and `g` there is one model.
        let mesh = models.into_iter().next().map(|model| model.mesh).unwrap_or_default();
        let positions: Vec<[f64; 3]> = mesh.positions.as_chunks().0.to_vec();
        // `tobj` drops vertices that no face uses; they are checked all the same.
        let suspicious = positions.len() < self.vertices || positions.iter().flatten().any(|&c| !is_usable(c));
        if let Some(fault) = suspicious.then(|| self.non_finite()).flatten() {
            return Err(fault);
        }
        let mut warnings = self.signs.warnings(self.vertices, Some(positions.len()), false);
        let mut colours = self.colours(&mut warnings);
        if !colours.is_empty() {
            colours = self.in_order_of_use(&colours);
        }
        let corners = |indices: &[u32]| indices.as_chunks::<3>().0.to_vec();
        let (groups, polygons) = (self.groups, self.polygons);
        let triangles = corners(&mesh.indices);
        let mut raw = RawMesh { positions, triangles, groups, polygons, warnings, ..RawMesh::default() };
        raw.attributes.colours = colours;
        if !self.bare_normal && self.normals > 0 {
            let values = mesh.normals.as_chunks::<3>().0;
            raw.corner_normals = corners(&mesh.normal_indices).iter().map(|t| t.map(|i| values[i as usize])).collect();
        }
        if !self.bare_texcoord && self.texcoords > 0 {
            let values = mesh.texcoords.as_chunks::<2>().0;
            raw.corner_texcoords =
                corners(&mesh.texcoord_indices).iter().map(|t| t.map(|i| values[i as usize])).collect();
        }
        Ok(raw)
    }

    /// The colours of all vertices, or none.
    fn colours(&self, warnings: &mut Vec<String>) -> Vec<[u8; 3]> {
        if self.colours.len() == self.vertices {
            return colour::of_numbers(&self.colours);
        }
        if !self.colours.is_empty() {
            warnings
                .push("some vertices have a colour behind their coordinates and others none: it is left out".into());
        }
        Vec::new()
    }

    /// Values of vertices in the order in which faces name these first: that in which `tobj` has them.
    fn in_order_of_use<T: Copy>(&self, values: &[T]) -> Vec<T> {
        let (mut seen, mut ordered, mut so_far) = (vec![false; values.len()], Vec::new(), 0_i64);
        for text in self.text.lines() {
            let (keyword, rest) = text.split_once(' ').unwrap_or((text, ""));
            so_far += i64::from(keyword == "v");
            for corner in rest.split_whitespace().take(if keyword == "f" { usize::MAX } else { 0 }) {
                let index = corner.split('/').next().and_then(|index| index.parse::<i64>().ok()).unwrap_or(0);
                let vertex = if index < 0 { so_far + index } else { index - 1 } as usize;
                if seen.get(vertex) == Some(&false) {
                    seen[vertex] = true;
                    ordered.push(values[vertex]);
                }
            }
        }
        ordered
    }

    /// A file without faces, of which `tobj` keeps nothing.
    fn cloud(self, ends_within_line: bool) -> Result<RawMesh, ScanFault> {
        let mut warnings = self.signs.warnings(self.vertices, None, ends_within_line);
        let colours = self.colours(&mut warnings);
        let mut raw = RawMesh { warnings, ..RawMesh::default() };
        raw.attributes.colours = colours;
        for (i, (keyword, numbers)) in self.number_lines().enumerate() {
            let fault = || {
                let expected = match keyword {
                    "v" => "expected `v` and three numbers",
                    "vn" => "expected `vn` and three numbers",
                    _ => "expected `vt` and two numbers",
                };
                self.fault(i, expected)
            };
            let values = numbers.ok_or_else(fault)?;
            match (keyword, &values[..]) {
                ("v", &[x, y, z]) => raw.positions.push([x, y, z]),
                ("v", &[x, y, z, w]) => raw.positions.push([x / w, y / w, z / w]),
                ("vn", &[x, y, z]) => raw.normals.push([x, y, z]),
                ("vt", _) => {}
                _ => return Err(fault()),
            }
        }
        if raw.normals.len() != raw.positions.len() {
            raw.normals.clear();
        }
        Ok(raw)
    }

    /// The lines of numbers (all but faces): keyword, and the numbers if they parse.
    fn number_lines(&self) -> impl Iterator<Item = (&str, Option<Vec<f64>>)> {
        self.text.lines().filter_map(|text| {
            let (keyword, rest) = text.split_once(' ').unwrap_or((text, ""));
            let numbers = || rest.split_whitespace().map(|word| word.parse().ok()).collect();
            (keyword != "f").then(|| (keyword, numbers()))
        })
    }

    /// A message about a line of the prepared text, counted from 0.
    fn fault(&self, index: usize, expected: &str) -> ScanFault {
        let text = shown(self.text.lines().nth(index).unwrap_or_default());
        let line = self.lines.get(index).copied().unwrap_or_default();
        ScanFault::malformed(FORMAT, format!("line {line}"), format!("{expected}, found `{text}`"))
    }

    /// The first vertex that is not usable, by its number in the file.
    fn non_finite(&self) -> Option<ScanFault> {
        let vertices = self.number_lines().filter(|(keyword, _)| *keyword == "v");
        vertices.enumerate().find_map(|(i, (_, numbers))| match numbers.unwrap_or_default()[..] {
            [x, y, z, ..] if ![x, y, z].into_iter().all(is_usable) => {
                Some(ScanFault::NonFinite { vertex: i + 1, at: [x, y, z] })
            }
            _ => None,
        })
    }

    /// An error of `tobj` with the line that it is about, after `lines` have been read.
    fn explain(&self, error: LoadError, lines: usize) -> ScanFault {
        if matches!(
            error,
            LoadError::FaceVertexOutOfBounds | LoadError::FaceTexCoordOutOfBounds | LoadError::FaceNormalOutOfBounds
        ) && let Some(fault) = self.index_out_of_range()
        {
            return fault;
        }
        let message = match error {
            LoadError::PositionParseError => "expected `v` and three numbers",
            LoadError::ScalingByZeroError => "the vertex's weight (its fourth number) is zero",
            LoadError::NormalParseError => "expected `vn` and three numbers",
            LoadError::TexcoordParseError => "expected `vt` and two numbers",
            LoadError::FaceParseError => "expected `f` and corners such as 1, 1/2, 1//3 or 1/2/3",
            _ => return self.fault(lines.saturating_sub(1), &error.to_string()),
        };
        self.fault(lines.saturating_sub(1), message)
    }

    /// The first face with an index that is out of range. Negative indices count back from the face's line.
    fn index_out_of_range(&self) -> Option<ScanFault> {
        let totals = [self.vertices, self.texcoords, self.normals];
        let mut so_far = [0_usize; 3];
        for (text, line) in self.text.lines().zip(&self.lines) {
            let (keyword, rest) = text.split_once(' ').unwrap_or((text, ""));
            match keyword {
                "v" => so_far[0] += 1,
                "vt" => so_far[1] += 1,
                "vn" => so_far[2] += 1,
                _ => {}
            }
            for corner in rest.split_whitespace().take(if keyword == "f" { usize::MAX } else { 0 }) {
                for (kind, index) in corner.split('/').take(3).enumerate() {
                    let Ok(index) = index.parse::<i64>() else { continue };
                    let (size, total) = (index.unsigned_abs(), totals[kind]);
                    let bad = if index < 0 { size > so_far[kind] as u64 } else { size == 0 || size > total as u64 };
                    if bad && (total > 0 || kind == 0) {
                        let what = ["vertex", "texture coordinate", "normal"][kind];
                        return Some(ScanFault::IndexOutOfRange {
                            place: format!("line {line}"),
                            what,
                            index,
                            count: if index < 0 { so_far[kind] } else { total },
                        });
                    }
                }
            }
        }
        None
    }
}

/// Hands out a text line by line and counts how many were taken, so that an error can name its line.
struct CountedLines<'a> {
    rest: &'a [u8],
    lines: usize,
}

impl Read for CountedLines<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.fill_buf()?.read(buffer)?;
        self.consume(n);
        Ok(n)
    }
}

impl BufRead for CountedLines<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        let end = self.rest.iter().position(|&b| b == b'\n').map_or(self.rest.len(), |i| i + 1);
        Ok(&self.rest[..end])
    }

    fn consume(&mut self, n: usize) {
        self.lines += self.rest[..n].iter().filter(|&&b| b == b'\n').count();
        self.rest = &self.rest[n..];
    }
}
