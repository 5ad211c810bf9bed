//! The format of a file: by its content first, by its extension second.

use super::error::ScanFault;
use std::path::Path;

/// The formats that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Obj,
    Ply,
    Stl,
}

impl Format {
    /// Its name in messages.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Stl => "STL",
        }
    }
}

/// Beginnings of files that people confuse with scans and scripts, in lower case, and their formats.
const FOREIGN: [(&[u8], &str, &str); 23] = [
    (b"astm-e57", "an E57 file", CONVERT),
    (b"lasf", "a LAS or LAZ file", CONVERT),
    (b"gltf", "a binary glTF file", CONVERT),
    (b"# .pcd", "a PCD file", CONVERT),
    (b"version https://git-lfs", "a pointer of Git LFS, not the file itself", "`git lfs pull` fetches that"),
    (b"/annex/objects/", "a pointer of git-annex, not the file itself", "`git annex get` fetches that"),
    (b"version", "a PCD file", CONVERT),
    (b"off", "an OFF file", CONVERT),
    (b"coff", "an OFF file", CONVERT),
    (b"pk\x03\x04", "a ZIP archive (3MF, or compressed)", CONVERT),
    (b"\x1f\x8b", "a gzip-compressed file", "`gunzip` it first"),
    (b"iso-10303-21", "a STEP file", CONVERT),
    (b"\x89png", "a PNG picture", CONVERT),
    (b"<!doctype html", "an HTML page", DOWNLOAD),
    (b"<html", "an HTML page", DOWNLOAD),
    (b"<head", "an HTML page", DOWNLOAD),
    (b"<?xml", "an XML file", CONVERT),
    (b"<", "an HTML or XML file", DOWNLOAD),
    (b"{", "a JSON file", CONVERT),
    (b"%pdf", "a PDF file", CONVERT),
    (b"kaydara fbx", "an FBX file", CONVERT),
    (b"\xff\xfe", "a text in UTF-16", "save it as UTF-8"),
    (b"\xfe\xff", "a text in UTF-16", "save it as UTF-8"),
];
const CONVERT: &str = "convert it to one of these";
const DOWNLOAD: &str = "download the file again: the site may have wanted a login or a click first";

/// A format that is not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Foreign {
    /// Its name, with an article.
    pub found: &'static str,
    /// The way to a file that is read, where the format itself tells one.
    pub fix: Option<&'static str>,
}

/// Recognises a file that is neither a scan nor a script by its beginning.
#[must_use]
pub fn foreign(bytes: &[u8]) -> Option<Foreign> {
    let start = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let is = |magic: &[u8]| start.get(..magic.len()).is_some_and(|begin| begin.eq_ignore_ascii_case(magic));
    let (_, found, fix) = FOREIGN.iter().find(|(magic, ..)| is(magic))?;
    Some(Foreign { found, fix: Some(*fix).filter(|fix| *fix != CONVERT) })
}

/// Recognises a file's format. A file whose content does not tell (say, an OBJ file of comments only) is taken for what
/// its extension says, so that the message is about that format.
pub(super) fn recognise(path: &Path, bytes: &[u8]) -> Result<Format, ScanFault> {
    if bytes.starts_with(b"ply") && bytes.get(3).is_none_or(u8::is_ascii_whitespace) {
        return Ok(Format::Ply);
    }
    // Its header has any text, and its size is no accident.
    if binary_stl_size(bytes) == Some(bytes.len() as u64) {
        return Ok(Format::Stl);
    }
    if let Some(Foreign { found, fix }) = foreign(bytes) {
        return Err(ScanFault::NotRecognised { found: found.to_owned(), fix: fix.unwrap_or(CONVERT) });
    }
    if is_ascii_stl(bytes) {
        return Ok(Format::Stl);
    }
    if is_obj(bytes) {
        return Ok(Format::Obj);
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    match extension.as_str() {
        "obj" => Ok(Format::Obj),
        "ply" => Ok(Format::Ply),
        "stl" => Ok(Format::Stl),
        _ => Err(ScanFault::NotRecognised { found: describe(bytes), fix: CONVERT }),
    }
}

/// The size that a binary STL file with this header would have.
pub(super) fn binary_stl_size(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(80..84)?;
    Some(84 + 50 * u64::from(u32::from_le_bytes(count.try_into().ok()?)))
}

/// Begins with `solid` and goes on with a facet or the end. (Binary files may begin with `solid` too.)
pub(super) fn is_ascii_stl(bytes: &[u8]) -> bool {
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(4096)]).to_ascii_lowercase();
    head.trim_start().starts_with("solid") && (head.contains("facet") || head.contains("endsolid"))
}

/// Has a line such as `v 1 2 3` before anything that no text file holds.
fn is_obj(bytes: &[u8]) -> bool {
    let text_end = bytes.iter().position(|&b| b == 0).unwrap_or(bytes.len());
    bytes[..text_end].split(|&b| b == b'\n').any(|line| {
        let line = String::from_utf8_lossy(&line[..line.len().min(200)]);
        let mut words = line.split_whitespace();
        words.next() == Some("v") && words.next().is_some_and(|word| word.parse::<f64>().is_ok())
    })
}

fn describe(bytes: &[u8]) -> String {
    let head = &bytes[..bytes.len().min(1024)];
    if head.iter().all(|b| b.is_ascii_graphic() || b.is_ascii_whitespace()) {
        let text = String::from_utf8_lossy(head);
        let first = text.lines().map(str::trim).find(|line| !line.is_empty()).unwrap_or_default();
        format!("text that begins `{}`", first.chars().take(24).collect::<String>())
    } else {
        let hex: Vec<String> = head.iter().take(8).map(|b| format!("{b:02x}")).collect();
        format!("a file that begins with the bytes {}", hex.join(" "))
    }
}
