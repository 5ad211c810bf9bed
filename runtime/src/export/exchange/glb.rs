//! Deviations as binary glTF 2.0: a node and a mesh for every part, with colours at the vertices.

use super::distances;
use super::surface::{MeasuredSurface, PartOfSurface};
use glam::DVec3;
use serde_json::{Value, json};
use std::f64::consts::FRAC_1_SQRT_2;
use std::io::{self, ErrorKind, Write};

/// Metres in a millimetre: glTF's unit is the metre.
const METRE: f64 = 1e-3;

/// The component types of accessors, and the targets of views, as glTF numbers them.
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// The quaternion (x, y, z, w) of the turn by -90 degrees about x, which takes z to y: glTF's y points up.
const Z_TO_Y: [f64; 4] = [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2];

/// Writes the surface. `parts` are the names of its parts.
///
/// # Errors
/// Whatever `out` fails with; or the file would be larger than 4 GiB, which glTF cannot say.
pub(super) fn write(out: &mut dyn Write, surface: &MeasuredSurface, parts: &[String]) -> io::Result<()> {
    // Single precision keeps micrometres of an object, not those of its distance from the origin of a scan.
    let centre = middle(&surface.positions);
    let mut buffer = Buffer::default();
    let (mut meshes, mut nodes) = (Vec::new(), Vec::new());
    // glTF has no mesh without triangles.
    for (part, name) in surface.parts.iter().zip(parts).filter(|(part, _)| !part.triangles.is_empty()) {
        nodes.push(json!({ "name": name, "mesh": meshes.len() }));
        meshes.push(json!({ "name": name, "primitives": [primitive(&mut buffer, surface, part, centre)] }));
    }
    let placed = METRE * DVec3::new(centre.x, centre.z, -centre.y);
    let children: Vec<usize> = (1..=nodes.len()).collect();
    let root = json!({
        "name": "model", "rotation": Z_TO_Y, "translation": placed.to_array(), "children": children,
        "extras": {
            "unit": "m", "unit_of_distances": "mm", "distances": distances(), "colour_range_mm": surface.scale.end,
            "neutral_mm": surface.scale.tolerance.map(|t| [t.lower, t.upper]),
            "frame": "below this node x, y and z are those of the scan's frame, less its translation; z of the scan is up",
        },
    });
    nodes.insert(0, root);
    let document = json!({
        "asset": { "version": "2.0", "generator": concat!("gmlc ", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [{
            "name": "deviations", "doubleSided": true,
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 1.0 },
        }],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{ "byteLength": buffer.bytes.len() }],
    });
    let mut text = document.to_string().into_bytes();
    pad(&mut text, b' ');
    pad(&mut buffer.bytes, 0);
    chunks(out, &text, &buffer.bytes)
}

/// The middle of the box about some positions.
fn middle(positions: &[[f64; 3]]) -> DVec3 {
    let bounds: crate::mesh::Bounds = positions.iter().map(|p| DVec3::from_array(*p)).collect();
    bounds.centre()
}

/// A part's triangles, with its vertices in metres from `centre`.
fn primitive(buffer: &mut Buffer, surface: &MeasuredSurface, part: &PartOfSurface, centre: DVec3) -> Value {
    let vertices = part.vertices.clone();
    let place = |p: &[f64; 3]| (METRE * (DVec3::from_array(*p) - centre)).as_vec3().to_array();
    let positions: Vec<[f32; 3]> = surface.positions[vertices.clone()].iter().map(place).collect();
    let normal = |n: &[f64; 3]| DVec3::from_array(*n).as_vec3().to_array();
    let normals: Vec<[f32; 3]> = surface.normals[vertices.clone()].iter().map(normal).collect();
    let colours: Vec<[u16; 4]> = surface.colours[vertices.clone()].iter().map(|c| linear(*c)).collect();
    let first = vertices.start as u32;
    let corners: Vec<u32> =
        surface.triangles[part.triangles.clone()].iter().flatten().map(|vertex| vertex - first).collect();
    let extreme = |pick: fn(f32, f32) -> f32, start: f32| {
        [0, 1, 2].map(|k| positions.iter().map(|p| p[k]).fold(start, pick)).map(f64::from)
    };
    let position = json!({ "min": extreme(f32::min, f32::INFINITY), "max": extreme(f32::max, f32::NEG_INFINITY) });
    let places = buffer.add(positions.as_flattened(), f32::to_le_bytes, FLOAT, "VEC3", position);
    let normals = buffer.add(normals.as_flattened(), f32::to_le_bytes, FLOAT, "VEC3", json!({}));
    let normalised = json!({ "normalized": true });
    let colours = buffer.add(colours.as_flattened(), u16::to_le_bytes, UNSIGNED_SHORT, "VEC4", normalised);
    let indices = buffer.add(&corners, u32::to_le_bytes, UNSIGNED_INT, "SCALAR", json!({}));
    json!({
        "attributes": { "POSITION": places, "NORMAL": normals, "COLOR_0": colours }, "indices": indices, "material": 0,
    })
}

/// The numbers of a file, and what says where they are.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Appends numbers; returns the index of their accessor, which has `more` fields. Indices are scalars.
    fn add<T: Copy, const N: usize>(
        &mut self,
        numbers: &[T],
        bytes: impl Fn(T) -> [u8; N],
        component: u32,
        kind: &str,
        more: Value,
    ) -> usize {
        let (start, of_element) = (
            self.bytes.len(),
            match kind {
                "VEC3" => 3,
                "VEC4" => 4,
                _ => 1,
            },
        );
        self.bytes.extend(numbers.iter().flat_map(|number| bytes(*number)));
        let target = if kind == "SCALAR" { ELEMENT_ARRAY_BUFFER } else { ARRAY_BUFFER };
        let length = self.bytes.len() - start;
        self.views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": length, "target": target }));
        let mut accessor = json!({
            "bufferView": self.views.len() - 1, "componentType": component, "type": kind,
            "count": numbers.len() / of_element,
        });
        if let (Some(accessor), Value::Object(more)) = (accessor.as_object_mut(), more) {
            accessor.extend(more);
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }
}

/// An sRGB colour in linear components of 16 bits, as COLOR_0 asks for, and full opacity.
fn linear(rgb: [u8; 3]) -> [u16; 4] {
    let component = |c: u8| {
        let c = f64::from(c) / 255.0;
        let linear = if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
        (linear * f64::from(u16::MAX)).round() as u16
    };
    let [r, g, b] = rgb.map(component);
    [r, g, b, u16::MAX]
}

/// Fills up to a multiple of four bytes, as chunks ask for.
fn pad(bytes: &mut Vec<u8>, with: u8) {
    bytes.resize(bytes.len().next_multiple_of(4), with);
}

/// The header and the two chunks of the file.
fn chunks(out: &mut dyn Write, json: &[u8], binary: &[u8]) -> io::Result<()> {
    let too_large = || io::Error::new(ErrorKind::InvalidInput, "a GLB file holds at most 4 GiB");
    let length = |bytes: usize| u32::try_from(bytes).map_err(|_| too_large());
    let total = length(12 + 8 + json.len() + 8 + binary.len())?;
    out.write_all(b"glTF")?;
    out.write_all(&2_u32.to_le_bytes())?;
    out.write_all(&total.to_le_bytes())?;
    for (kind, chunk) in [(b"JSON", json), (b"BIN\0", binary)] {
        out.write_all(&length(chunk.len())?.to_le_bytes())?;
        out.write_all(kind)?;
        out.write_all(chunk)?;
    }
    Ok(())
}
