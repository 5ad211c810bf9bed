//! glTF 2.0, binary (GLB) and as JSON, whose buffers are in it or beside it.
//!
//! The accessors are read here and not by a crate: each offset and count is checked against the bytes, and each message
//! names what of the document it is about. Coordinates stay as they are: y is up by the format's rule, and z where a
//! program has not turned its object; a file of the same object in another format is most likely in the frame of the
//! latter.

mod accessor;
mod buffers;
mod document;
mod scene;

use crate::scan::error::ScanFault;
use crate::scan::raw::RawMesh;
use crate::scan::unit::METRE;
use buffers::Buffers;
use document::Document;
use std::path::Path;

const FORMAT: &str = "glTF";
/// Header of a GLB file, and of each of its chunks.
const HEADER: usize = 12;
const CHUNK: usize = 8;

/// Reads the default scene of a file, whose other files lie in `folder`.
pub(in crate::scan) fn read(bytes: &[u8], folder: &Path) -> Result<RawMesh, ScanFault> {
    let mut warnings = Vec::new();
    let (json, binary) = if bytes.starts_with(b"glTF") { chunks(bytes, &mut warnings)? } else { (bytes, None) };
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    let document: Document = serde_json::from_slice(json).map_err(|error| {
        let place = format!("line {}, column {} of the JSON", error.line(), error.column());
        let text = error.to_string();
        let text = text.split(" at line ").next().unwrap_or_default();
        let cut_off = if error.is_eof() { "; it is cut off: export it again" } else { "" };
        malformed(place, format!("{text}{cut_off}"))
    })?;
    document.require_readable()?;
    let mut buffers = Buffers::new(&document.buffers, binary, folder);
    let mut raw = scene::read(&document, &mut buffers, bytes.len())?;
    raw.unit = Some(METRE);
    raw.warnings.splice(0..0, warnings);
    Ok(raw)
}

/// Whether a file that begins so is of this format: the header of the binary kind, or an object with a key "asset".
pub(in crate::scan) fn recognise(head: &[u8]) -> bool {
    let start = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
    let has = |key: &[u8]| start.windows(key.len()).any(|window| window == key);
    head.starts_with(b"glTF") || start.starts_with(b"{") && has(b"\"asset\"") && has(b"\"version\"")
}

fn malformed(place: impl Into<String>, message: impl Into<String>) -> ScanFault {
    ScanFault::malformed(FORMAT, place, message)
}

/// The chunks of a GLB file: its JSON, and its binary one if there is one. Others are for extensions.
fn chunks<'a>(bytes: &'a [u8], warnings: &mut Vec<String>) -> Result<(&'a [u8], Option<&'a [u8]>), ScanFault> {
    let word = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(malformed("header", "the file ends within it; it is cut off: export it again"));
    };
    if version != 2 {
        return Err(malformed("header", format!("it has version {version}; export it as glTF 2.0")));
    }
    let length = length as usize;
    if length > bytes.len() {
        let message =
            format!("it announces {length} bytes, the file has {}; it is cut off: export it again", bytes.len());
        return Err(malformed("header", message));
    }
    if length < bytes.len() {
        warnings.push(format!("{} bytes behind the end that its header tells are left out", bytes.len() - length));
    }
    let (mut json, mut binary, mut at) = (None, None, HEADER);
    while at < length {
        let (Some(size), Some(kind)) = (word(at), bytes.get(at + 4..at + CHUNK)) else {
            return Err(malformed(format!("byte {at}"), "a chunk begins in its last bytes; export it again"));
        };
        let begin = at + CHUNK;
        let Some(chunk) = bytes[..length].get(begin..begin.saturating_add(size as usize)) else {
            let message =
                format!("a chunk of {size} bytes begins here and the file ends; it is cut off: export it again");
            return Err(malformed(format!("byte {at}"), message));
        };
        match (kind, json) {
            (b"JSON", None) => json = Some(chunk),
            (b"BIN\0", Some(_)) if binary.is_none() => binary = Some(chunk),
            _ => {}
        }
        at = begin + chunk.len();
    }
    let json = json.ok_or_else(|| malformed("header", "there is no chunk of JSON; export it again"))?;
    Ok((json, binary))
}
