//! What the writers of binary glTF 2.0 share: numbers with their accessors, and the chunks of the file.

use serde_json::{Value, json};
use std::io::{self, ErrorKind, Write};

/// Metres in a millimetre: glTF's unit is the metre.
pub(super) const METRE: f64 = 1e-3;

/// The component types of accessors, and the targets of views, as glTF numbers them.
pub(super) const UNSIGNED_SHORT: u32 = 5123;
pub(super) const UNSIGNED_INT: u32 = 5125;
pub(super) const FLOAT: u32 = 5126;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// The numbers of a file, and what says where they are.
#[derive(Default)]
pub(super) struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Appends positions; returns the index of their accessor.
    pub(super) fn add_positions(&mut self, positions: &[[f32; 3]]) -> usize {
        let extreme = |pick: fn(f32, f32) -> f32, start: f32| {
            [0, 1, 2].map(|k| positions.iter().map(|p| p[k]).fold(start, pick)).map(f64::from)
        };
        let bounds = json!({ "min": extreme(f32::min, f32::INFINITY), "max": extreme(f32::max, f32::NEG_INFINITY) });
        self.add(positions.as_flattened(), f32::to_le_bytes, FLOAT, "VEC3", bounds)
    }

    /// Appends sRGB colours; returns the index of their accessor.
    pub(super) fn add_colours(&mut self, colours: impl Iterator<Item = [u8; 3]>) -> usize {
        let colours: Vec<[u16; 4]> = colours.map(linear).collect();
        let normalised = json!({ "normalized": true });
        self.add(colours.as_flattened(), u16::to_le_bytes, UNSIGNED_SHORT, "VEC4", normalised)
    }

    /// Appends numbers; returns the index of their accessor, which has `more` fields. Indices are scalars.
    pub(super) fn add<T: Copy, const N: usize>(
        &mut self,
        numbers: &[T],
        bytes: impl Fn(T) -> [u8; N],
        component: u32,
        kind: &str,
        more: Value,
    ) -> usize {
        let start = self.bytes.len();
        let of_element = match kind {
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 1,
        };
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

    /// Writes the file: a scene of these nodes, the first of which is its root, with these meshes and this material.
    ///
    /// # Errors
    /// Whatever `out` fails with; or the file would be larger than 4 GiB, which glTF cannot say.
    pub(super) fn write(
        mut self,
        out: &mut dyn Write,
        nodes: &[Value],
        meshes: &[Value],
        material: &str,
    ) -> io::Result<()> {
        let document = json!({
            "asset": { "version": "2.0", "generator": concat!("gmlc ", env!("CARGO_PKG_VERSION")) },
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": nodes,
            "meshes": meshes,
            "materials": [{
                "name": material, "doubleSided": true,
                "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 1.0 },
            }],
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{ "byteLength": self.bytes.len() }],
        });
        let mut text = document.to_string().into_bytes();
        pad(&mut text, b' ');
        pad(&mut self.bytes, 0);
        chunks(out, &text, &self.bytes)
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
