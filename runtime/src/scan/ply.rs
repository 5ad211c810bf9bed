//! PLY: ASCII and binary of both byte orders, read by `serde_ply`.

use super::error::ScanFault;
use super::ply_rows::{FaceRow, Rows, SkippedRow, VertexRow};
use super::raw::{RawMesh, fan};
use serde::de::DeserializeOwned;
use serde_ply::{DeserializeError, ElementDef, PlyFormat, PlyReader, PropertyType, ScalarType};
use std::io::{BufRead, Cursor, Read};

const FORMAT: &str = "PLY";

/// Reads a PLY file: elements `vertex` (x y z; nx ny nz; s t), `face` (`vertex_indices` or `vertex_index`; `texcoord`)
/// and `tristrips`; others are skipped. Polygons become fans; without faces it is a cloud of points.
pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, ScanFault> {
    let (header, body) = split_header(bytes)?;
    // The library wants white space behind the last number of an ASCII file.
    let end: &[u8] = if header.contains("format ascii") { b"\n" } else { b"" };
    let input = Cursor::new(header.as_bytes()).chain(Cursor::new(body)).chain(end);
    let mut reader =
        PlyReader::from_reader(input).map_err(|error| ScanFault::malformed(FORMAT, "header", words(&error)))?;
    let format = reader.header().format;
    let mut vertices = Vec::new();
    let mut faces = Faces::default();
    while let Some(element) = reader.current_element().cloned() {
        check_coordinates(&element)?;
        check_size(&element, format, body.len())?;
        match element.name.as_str() {
            "vertex" => vertices = rows::<VertexRow, _>(&mut reader, &element)?,
            "face" => faces.polygons = rows::<FaceRow, _>(&mut reader, &element)?,
            "tristrips" => faces.strips = rows::<FaceRow, _>(&mut reader, &element)?,
            _ => drop(rows::<SkippedRow, _>(&mut reader, &element)?),
        }
    }
    if vertices.is_empty() {
        return Err(ScanFault::NoVertices);
    }
    u32::try_from(vertices.len()).map_err(|_| ScanFault::TooMany { what: "vertices" })?;
    assemble(&vertices, &faces)
}

/// The header as text with plain line ends, and what follows it. Comments in other encodings than UTF-8 are common.
fn split_header(bytes: &[u8]) -> Result<(String, &[u8]), ScanFault> {
    let cut_off = || ScanFault::malformed(FORMAT, "header", "the file ends before `end_header`");
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
    let header = String::from_utf8_lossy(&bytes[..end]).replace("\r\n", "\n").replace('\r', "\n");
    Ok((header + "\n", body))
}

/// An announced count is believed only if the file is long enough for it.
fn check_size(element: &ElementDef, format: PlyFormat, available: usize) -> Result<(), ScanFault> {
    let width = |scalar: ScalarType| match scalar {
        _ if format == PlyFormat::Ascii => 1,
        ScalarType::I8 | ScalarType::U8 => 1,
        ScalarType::I16 | ScalarType::U16 => 2,
        ScalarType::I32 | ScalarType::U32 | ScalarType::F32 => 4,
        ScalarType::F64 => 8,
    };
    let row: u128 = element
        .properties
        .iter()
        .map(|property| match property.property_type {
            PropertyType::Scalar(scalar) => width(scalar),
            PropertyType::List { count_type, .. } => width(count_type),
        })
        .sum();
    if element.count > 0 && row == 0 {
        let message = format!("element `{}` has {} rows but no properties", element.name, element.count);
        return Err(ScanFault::malformed(FORMAT, "header", message));
    }
    if row * element.count as u128 > available as u128 {
        let (name, count) = (&element.name, element.count);
        let message =
            format!("{count} rows of element `{name}` are announced, {available} bytes follow; the file is cut off");
        return Err(ScanFault::malformed(FORMAT, "header", message));
    }
    Ok(())
}

fn check_coordinates(element: &ElementDef) -> Result<(), ScanFault> {
    match ["x", "y", "z"].into_iter().find(|name| !element.has_property(name)) {
        Some(name) if element.name == "vertex" => {
            let message = format!("element `vertex` has no property `{name}`; x, y and z are needed");
            Err(ScanFault::malformed(FORMAT, "header", message))
        }
        _ => Ok(()),
    }
}

fn rows<T: DeserializeOwned, R: BufRead>(reader: &mut PlyReader<R>, element: &ElementDef) -> Result<Vec<T>, ScanFault> {
    let read: Result<Rows<T>, _> = reader.next_element();
    read.map(|rows| rows.0)
        .map_err(|error| ScanFault::malformed(FORMAT, format!("element `{}`", element.name), words(&error)))
}

/// The library's message in a user's words.
fn words(error: &DeserializeError) -> String {
    let message = error.to_string().replace("Error while deserializing ply: ", "");
    message.replace("failed to fill whole buffer", "the file ends here; it is cut off")
}

#[derive(Default)]
struct Faces {
    polygons: Vec<FaceRow>,
    strips: Vec<FaceRow>,
}

fn assemble(vertices: &[VertexRow], faces: &Faces) -> Result<RawMesh, ScanFault> {
    let mut raw = RawMesh { vertices_read: vertices.len(), ..RawMesh::default() };
    raw.positions = vertices.iter().map(|row| row.position).collect();
    if vertices.iter().any(|row| row.normal.is_some()) {
        raw.normals = vertices.iter().map(|row| row.normal.unwrap_or([f64::NAN; 3])).collect();
    }
    if vertices.iter().all(|row| row.texcoord.is_some()) {
        raw.texcoords = vertices.iter().filter_map(|row| row.texcoord).collect();
    }
    let textured = faces.strips.is_empty() && faces.polygons.iter().all(FaceRow::has_texcoords);
    for (i, face) in faces.polygons.iter().enumerate() {
        let indices = checked(&face.indices, vertices.len(), i, "face")?;
        for corners in fan(indices.len()) {
            raw.triangles.push(corners.map(|c| indices[c]));
            if textured {
                raw.corner_texcoords.push(corners.map(|c| [face.texcoords[2 * c], face.texcoords[2 * c + 1]]));
            }
        }
    }
    for (i, strip) in faces.strips.iter().enumerate() {
        // A negative index ends a strip; every other triangle of a strip is turned round.
        for run in strip.indices.split(|&index| index < 0) {
            let indices = checked(run, vertices.len(), i, "strip")?;
            for (k, w) in indices.windows(3).enumerate() {
                raw.triangles.push(if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] });
            }
        }
    }
    Ok(raw)
}

fn checked(indices: &[i64], count: usize, row: usize, kind: &str) -> Result<Vec<u32>, ScanFault> {
    let check = |&index: &i64| match u32::try_from(index) {
        Ok(valid) if (valid as usize) < count => Ok(valid),
        _ => {
            let place = format!("{kind} {} (counted from 1)", row + 1);
            Err(ScanFault::IndexOutOfRange { place, what: "vertex", index, count })
        }
    };
    indices.iter().map(check).collect()
}
