//! Wavefront OBJ: vertices, texture coordinates, normals, polygons and groups. Materials, points, lines and curves are
//! skipped; so are colours and comments behind the numbers. Bytes that are not UTF-8 may stand in names and comments.

use super::error::ScanFault;
use super::raw::{RawMesh, fan, is_usable};
use crate::mesh::Group;
use std::borrow::Cow;

const FORMAT: &str = "OBJ";

/// The things that a corner of a face names, in the order in which slashes separate them: keyword, and what a user
/// calls it.
const KINDS: [(&str, &str); 3] = [("v", "vertex"), ("vt", "texture coordinate"), ("vn", "normal")];

/// The index of a texture coordinate or a normal that a corner does not have.
const ABSENT: u32 = u32::MAX;

/// Reads an OBJ file. Polygons become fans; without any face it is a cloud of points.
pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, ScanFault> {
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}');
    let mut reader = Reader::default();
    // Faces may name what stands further down.
    for (_, statement) in statements(text) {
        let keyword = statement.split_whitespace().next();
        if let Some(kind) = KINDS.iter().position(|kind| Some(kind.0) == keyword) {
            reader.totals[kind] += 1;
        }
    }
    if reader.totals[0] == 0 {
        return Err(ScanFault::NoVertices);
    }
    for (line, statement) in statements(text) {
        reader.take(line, &statement)?;
    }
    reader.finish()
}

/// The statements of a text without their comments, and their lines, counted from 1. A backslash continues a line.
fn statements(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (i, line) = lines.next()?;
        let mut line = Cow::Borrowed(line);
        while let Some(continued) = line.trim_end().strip_suffix('\\') {
            line = Cow::Owned(format!("{continued} {}", lines.next().map_or("", |(_, next)| next)));
        }
        if let Some(comment) = line.find('#') {
            line = Cow::Owned(line[..comment].to_owned());
        }
        Some((i + 1, line))
    })
}

#[derive(Default)]
struct Reader {
    /// The numbers of vertices, texture coordinates and normals in the file.
    totals: [usize; 3],
    positions: Vec<[f64; 3]>,
    texcoords: Vec<[f64; 2]>,
    normals: Vec<[f64; 3]>,
    /// The indices at the triangles' corners, of each kind.
    triangles: [Vec<[u32; 3]>; 3],
    groups: Vec<Group>,
}

impl Reader {
    fn take(&mut self, line: usize, statement: &str) -> Result<(), ScanFault> {
        let mut words = statement.split_whitespace();
        let Some(keyword) = words.next() else { return Ok(()) };
        let fault = |expected: &str| {
            let statement: String = statement.trim().chars().take(60).collect();
            ScanFault::malformed(FORMAT, format!("line {line}"), format!("expected {expected}, found `{statement}`"))
        };
        match keyword {
            "v" => {
                let position = numbers(words.clone()).ok_or_else(|| fault("`v` and three numbers"))?;
                // A fourth number is the weight; more are a colour.
                self.positions.push(if words.clone().count() == 4 {
                    let weight = numbers(words.skip(3)).filter(|[weight]| *weight != 0.0);
                    let [weight] = weight.ok_or_else(|| fault("a weight (the fourth number) other than zero"))?;
                    position.map(|c| c / weight)
                } else {
                    position
                });
            }
            "vt" => {
                let texcoord = numbers(words.chain(std::iter::once("0")));
                self.texcoords.push(texcoord.ok_or_else(|| fault("`vt` and two numbers"))?);
            }
            "vn" => self.normals.push(numbers(words).ok_or_else(|| fault("`vn` and three numbers"))?),
            // With fewer corners it is a point or a line.
            "f" if words.clone().count() >= 3 => {
                let mut corners = Vec::new();
                for corner in words {
                    let corner = self.corner(line, corner)?;
                    corners.push(corner.ok_or_else(|| fault("`f` and corners such as 1, 1/2, 1//3 or 1/2/3"))?);
                }
                for triangle in fan(corners.len()) {
                    for (kind, indices) in self.triangles.iter_mut().enumerate() {
                        indices.push(triangle.map(|c| corners[c][kind]));
                    }
                }
            }
            "g" | "o" => self.begin_group(&words.collect::<Vec<_>>().join(" ")),
            _ => {}
        }
        Ok(())
    }

    /// The indices that a corner names, from 0; none where it is no corner.
    fn corner(&self, line: usize, corner: &str) -> Result<Option<[u32; 3]>, ScanFault> {
        let read = [self.positions.len(), self.texcoords.len(), self.normals.len()];
        let mut indices = [ABSENT; 3];
        for (kind, word) in corner.split('/').enumerate() {
            if kind > 2 || kind == 0 && word.is_empty() {
                return Ok(None);
            }
            // An index of texture coordinates or normals that the file does not have is as good as none.
            if word.is_empty() || kind > 0 && self.totals[kind] == 0 {
                continue;
            }
            let Ok(index) = word.parse::<i64>() else { return Ok(None) };
            // Negative indices count back from the face's line.
            let (place, count) = if index < 0 {
                (index.checked_add_unsigned(read[kind] as u64), read[kind])
            } else {
                (index.checked_sub(1), self.totals[kind])
            };
            let place = place.and_then(|place| u32::try_from(place).ok()).filter(|place| (*place as usize) < count);
            let Some(place) = place else {
                let place = format!("line {line}");
                return Err(ScanFault::IndexOutOfRange { place, what: KINDS[kind].1, index, count });
            };
            indices[kind] = place;
        }
        Ok(Some(indices))
    }

    fn begin_group(&mut self, name: &str) {
        let start = self.triangles[0].len();
        if self.groups.is_empty() && start > 0 {
            self.groups.push(Group { name: "unnamed".to_owned(), start: 0, end: start });
        }
        self.end_group();
        let name = if name.is_empty() { "unnamed" } else { name };
        self.groups.push(Group { name: name.to_owned(), start, end: start });
    }

    fn end_group(&mut self) {
        if let Some(last) = self.groups.last_mut() {
            last.end = self.triangles[0].len();
        }
    }

    fn finish(mut self) -> Result<RawMesh, ScanFault> {
        self.end_group();
        self.groups.retain(|group| group.start < group.end);
        let [triangles, texcoord_indices, normal_indices] = self.triangles;
        let mut raw = RawMesh::default();
        if triangles.is_empty() {
            if self.normals.len() == self.positions.len() {
                raw.normals = self.normals;
            }
            raw.positions = self.positions;
            return Ok(raw);
        }
        raw.corner_normals = at_corners(&normal_indices, &self.normals);
        raw.corner_texcoords = at_corners(&texcoord_indices, &self.texcoords);
        raw.groups = self.groups;
        // Vertices come in the order of their first use. Those that no face uses are left out, but looked at all the
        // same.
        if let Some(i) = self.positions.iter().position(|p| !p.iter().all(|c| is_usable(*c))) {
            return Err(ScanFault::NonFinite { vertex: i + 1, at: self.positions[i] });
        }
        let mut numbers = vec![ABSENT; self.positions.len()];
        let mut number = |vertex: u32| {
            let number = &mut numbers[vertex as usize];
            if *number == ABSENT {
                *number = raw.positions.len() as u32;
                raw.positions.push(self.positions[vertex as usize]);
            }
            *number
        };
        raw.triangles = triangles.into_iter().map(|triangle| triangle.map(&mut number)).collect();
        Ok(raw)
    }
}

/// The first N of some words as numbers; none where there are fewer or one is no number.
fn numbers<'a, const N: usize>(words: impl Iterator<Item = &'a str>) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> = words.take(N).map(|word| word.parse().ok()).collect();
    numbers?.try_into().ok()
}

/// The values at the corners of all triangles; none where a corner has none.
fn at_corners<const N: usize>(triangles: &[[u32; 3]], values: &[[f64; N]]) -> Vec<[[f64; N]; 3]> {
    if values.is_empty() || triangles.iter().flatten().any(|index| *index == ABSENT) {
        return Vec::new();
    }
    triangles.iter().map(|triangle| triangle.map(|index| values[index as usize])).collect()
}
