//! STL, binary and ASCII. Its triangles repeat their vertices' positions; equal ones become one vertex here.

use super::error::ScanFault;
use super::format::{binary_stl_size, is_ascii_stl};
use super::raw::RawMesh;
use crate::mesh::Group;
use std::collections::HashMap;
use std::io::Cursor;

const FORMAT: &str = "STL";

/// Reads either kind. ASCII files may hold several solids: they become groups. Facet normals are not used: they follow
/// from the vertices, and many files have them wrong.
pub(super) fn read(bytes: Vec<u8>) -> Result<RawMesh, ScanFault> {
    let whole = binary_stl_size(&bytes) == Some(bytes.len() as u64);
    if !whole && is_ascii_stl(&bytes) { read_ascii(&String::from_utf8_lossy(&bytes)) } else { read_binary(bytes) }
}

fn read_binary(mut bytes: Vec<u8>) -> Result<RawMesh, ScanFault> {
    let Some(size) = binary_stl_size(&bytes) else {
        let message = format!("a header of 84 bytes was expected, the file ends after {}", bytes.len());
        return Err(ScanFault::malformed(FORMAT, "header", message));
    };
    if size > bytes.len() as u64 {
        let (announced, room) = ((size - 84) / 50, (bytes.len() - 84) / 50);
        let message = format!("the header announces {announced} triangles, the file ends after {room}");
        return Err(ScanFault::malformed(FORMAT, "header", message));
    }
    // The library takes a file whose comment begins with `solid` for ASCII.
    bytes[..80].fill(0);
    let read = stl_io::read_stl(&mut Cursor::new(bytes));
    let mesh = read.map_err(|error| ScanFault::malformed(FORMAT, "triangles", error.to_string()))?;
    let index = |i: usize| u32::try_from(i).map_err(|_| ScanFault::TooMany { what: "vertices" });
    let mut raw = RawMesh { vertices_read: mesh.vertices.len(), ..RawMesh::default() };
    raw.positions = mesh.vertices.iter().map(|v| v.0.map(f64::from)).collect();
    for face in &mesh.faces {
        let [a, b, c] = face.vertices;
        raw.triangles.push([index(a)?, index(b)?, index(c)?]);
    }
    Ok(raw)
}

/// ASCII, by hand: unlike the library this reads every solid of the file, doubles, any case, and names the line.
#[derive(Default)]
struct AsciiReader {
    raw: RawMesh,
    seen: HashMap<[u64; 3], u32>,
    corners: Vec<u32>,
    in_solid: bool,
}

fn read_ascii(text: &str) -> Result<RawMesh, ScanFault> {
    let mut reader = AsciiReader::default();
    for (i, line) in text.lines().enumerate() {
        reader.line(line).map_err(|fault| match fault {
            LineFault::Message(message) => ScanFault::malformed(FORMAT, format!("line {}", i + 1), message),
            LineFault::Scan(fault) => fault,
        })?;
    }
    let mut raw = reader.raw;
    if reader.in_solid {
        let message = "the file ends before `endsolid`; it is cut off";
        return Err(ScanFault::malformed(FORMAT, format!("line {}", text.lines().count()), message));
    }
    raw.vertices_read = raw.positions.len();
    raw.groups.retain(|group| group.start < group.end);
    if raw.groups.len() == 1 {
        raw.groups.clear();
    }
    Ok(raw)
}

enum LineFault {
    Message(String),
    Scan(ScanFault),
}

impl AsciiReader {
    fn line(&mut self, line: &str) -> Result<(), LineFault> {
        let mut words = line.split_whitespace();
        let Some(first) = words.next() else { return Ok(()) };
        match first.to_ascii_lowercase().as_str() {
            "solid" => {
                self.in_solid = true;
                let start = self.raw.triangles.len();
                let name = words.collect::<Vec<_>>().join(" ");
                let name = if name.is_empty() { format!("solid {}", self.raw.groups.len() + 1) } else { name };
                self.raw.groups.push(Group { name, start, end: start });
            }
            "facet" => self.corners.clear(),
            "outer" | "endloop" => {}
            "vertex" => self.vertex(words)?,
            "endfacet" => {
                let [a, b, c] = self.corners[..] else {
                    let message = format!("a facet of 3 vertices was expected, this has {}", self.corners.len());
                    return Err(LineFault::Message(message));
                };
                self.raw.triangles.push([a, b, c]);
                if let Some(group) = self.raw.groups.last_mut() {
                    group.end = self.raw.triangles.len();
                }
            }
            "endsolid" => self.in_solid = false,
            _ => {
                let shown: String = line.trim().chars().take(40).collect();
                let message = format!("expected `facet`, `outer loop`, `vertex` or `endsolid`, found `{shown}`");
                return Err(LineFault::Message(message));
            }
        }
        Ok(())
    }

    fn vertex<'a>(&mut self, words: impl Iterator<Item = &'a str>) -> Result<(), LineFault> {
        let numbers: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
        let [x, y, z] = numbers[..] else {
            return Err(LineFault::Message("expected `vertex` and three numbers".to_owned()));
        };
        // Adding 0 turns -0 into 0, so that both are one position.
        let key = [x, y, z].map(|c| (c + 0.0).to_bits());
        let next = self.raw.positions.len();
        let index = match self.seen.get(&key) {
            Some(&index) => index,
            None => {
                let index =
                    u32::try_from(next).map_err(|_| LineFault::Scan(ScanFault::TooMany { what: "vertices" }))?;
                self.seen.insert(key, index);
                self.raw.positions.push([x, y, z]);
                index
            }
        };
        self.corners.push(index);
        Ok(())
    }
}
