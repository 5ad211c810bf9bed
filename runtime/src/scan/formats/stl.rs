//! STL, binary and ASCII. Its triangles repeat their vertices' positions; equal ones become one vertex here. Facet
//! normals are not used: they follow from the vertices, and many files have them wrong.

use crate::mesh::Group;
use crate::scan::equal::{merge_equal, position_key};
use crate::scan::error::{ScanFault, shown};
use crate::scan::format::{binary_stl_size, is_ascii_stl};
use crate::scan::raw::{RawMesh, is_usable};

const FORMAT: &str = "STL";
/// Bytes of a triangle in a binary file: a normal, three vertices, and two of attributes.
const FACET: usize = 50;

/// Reads either kind. ASCII files may hold several solids: they become groups.
pub(in crate::scan) fn read(bytes: &[u8]) -> Result<RawMesh, ScanFault> {
    let size = binary_stl_size(bytes);
    let whole = size == Some(bytes.len() as u64);
    let mut warnings = Vec::new();
    let is_text = !whole && is_ascii_stl(bytes);
    let ((positions, indices), groups) = if is_text {
        let (corners, groups) = read_ascii(&String::from_utf8_lossy(bytes))?;
        (merge_equal(corners.len(), |i| position_key(corners[i]), |i| corners[i]), groups)
    } else {
        let facets = read_binary(bytes)?;
        let read = merge_equal(
            facets.len() / FACET * 3,
            |corner| numbers(facets, corner).map(|c| (c + 0.0).to_bits()),
            |corner| numbers(facets, corner).map(f64::from),
        );
        let rest = size.map_or(0, |size| (bytes.len() as u64).saturating_sub(size));
        if rest > 0 {
            warnings.push(format!("{rest} bytes behind the last triangle of the header are left out"));
        }
        (read, Vec::new())
    };
    let triangles = indices.as_chunks().0.to_vec();
    Ok(RawMesh { positions, distinct: !is_text, triangles, groups, warnings, ..RawMesh::default() })
}

/// A corner's coordinates; there are three corners a triangle.
fn numbers(facets: &[u8], corner: usize) -> [f32; 3] {
    let at = corner / 3 * FACET + 12 * (corner % 3 + 1);
    let numbers = facets[at..at + 12].as_chunks().0;
    [0, 1, 2].map(|k| f32::from_le_bytes(numbers[k]))
}

/// The bytes of all triangles.
fn read_binary(bytes: &[u8]) -> Result<&[u8], ScanFault> {
    let Some(size) = binary_stl_size(bytes) else {
        let message = format!("a header of 84 bytes was expected, the file ends after {}", bytes.len());
        return Err(ScanFault::malformed(FORMAT, "header", message));
    };
    if size > bytes.len() as u64 {
        let (announced, room) = ((size - 84) / FACET as u64, (bytes.len() - 84) / FACET);
        let message = format!(
            "the header announces {announced} triangles, the file ends after {room}; it is cut off: export it again"
        );
        return Err(ScanFault::malformed(FORMAT, "header", message));
    }
    let (read, rest) = bytes.split_at(size as usize);
    let uncounted = rest.chunks_exact(FACET).take_while(|bytes| is_facet(bytes)).count();
    if uncounted > 0 {
        let announced = (size - 84) / FACET as u64;
        let message = format!(
            "the header announces {announced} triangles, and {uncounted} more follow at byte {size}; export it again"
        );
        return Err(ScanFault::malformed(FORMAT, "header", message));
    }
    Ok(&read[84..])
}

/// Whether bytes behind the last triangle of a header are another one: some programs pad the file, or add a text of
/// their own there, whose letters are absurd numbers.
fn is_facet(bytes: &[u8]) -> bool {
    let numbers: Vec<f32> = bytes[..48].as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    let sane = |x: &f32| *x == 0.0 || is_usable((*x).into()) && x.abs() > 1e-20;
    numbers.iter().all(sane) && numbers[3..].iter().any(|x| *x != 0.0)
}

/// The corners of all triangles, three a triangle, and the solids. In double precision and in any case of letters.
fn read_ascii(text: &str) -> Result<(Vec<[f64; 3]>, Vec<Group>), ScanFault> {
    let (mut corners, mut groups) = (Vec::new(), Vec::<Group>::new());
    let (mut triangles, mut in_solid) = (0, false);
    // Old programs end lines by a carriage return alone.
    let end = if text.contains('\n') { '\n' } else { '\r' };
    let lines = || text.trim_ascii_end().split(end).map(str::trim_ascii_end);
    for (i, line) in lines().enumerate() {
        let fault = |message: String| ScanFault::malformed(FORMAT, format!("line {}", i + 1), message);
        let mut words = line.split_whitespace();
        let Some(keyword) = words.next() else { continue };
        match keyword.to_ascii_lowercase().as_str() {
            "solid" => {
                in_solid = true;
                let name = words.collect::<Vec<_>>().join(" ");
                let name = if name.is_empty() { format!("solid {}", groups.len() + 1) } else { name };
                groups.push(Group { name, start: triangles, end: triangles });
            }
            "facet" => corners.truncate(3 * triangles),
            "outer" | "endloop" => {}
            "vertex" => {
                let numbers: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
                let wrong = || fault(format!("expected `vertex` and three numbers, found `{}`", shown(line)));
                corners.push(numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(wrong)?);
            }
            "endfacet" => {
                let count = corners.len() - 3 * triangles;
                if count != 3 {
                    return Err(fault(format!("a facet of 3 vertices was expected, this has {count}")));
                }
                triangles += 1;
                if let Some(group) = groups.last_mut() {
                    group.end = triangles;
                }
            }
            "endsolid" => in_solid = false,
            _ => {
                let expected = "`facet`, `outer loop`, `vertex`, `endloop`, `endfacet` or `endsolid`";
                return Err(fault(format!("expected {expected}, found `{}`", shown(line))));
            }
        }
    }
    if in_solid {
        let message = "the file ends before `endsolid`; it is cut off: export it again";
        return Err(ScanFault::malformed(FORMAT, format!("line {}", lines().count()), message));
    }
    corners.truncate(3 * triangles);
    groups.retain(|group| group.start < group.end);
    if groups.len() == 1 {
        groups.clear();
    }
    Ok((corners, groups))
}
