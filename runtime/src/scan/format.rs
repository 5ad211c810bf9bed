//! The format of a file: by its content first, by its extension second.

use super::error::ScanFault;
use super::formats::{gltf, off, pcd, pts, ptx, table};
use std::path::Path;

/// The formats that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Obj,
    Ply,
    Stl,
    Off,
    Gltf,
    ThreeMf,
    E57,
    Las,
    Pcd,
    Pts,
    Ptx,
    Table,
}

impl Format {
    /// Its name in messages.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Stl => "STL",
            Self::Off => "OFF",
            Self::Gltf => "glTF",
            Self::ThreeMf => "3MF",
            Self::E57 => "E57",
            Self::Las => "LAS",
            Self::Pcd => "PCD",
            Self::Pts => "PTS",
            Self::Ptx => "PTX",
            Self::Table => "text table",
        }
    }

    /// The format that the ending of a file's name says, in lower case.
    fn of_ending(ending: &str) -> Option<Self> {
        Some(match ending {
            "obj" => Self::Obj,
            "ply" => Self::Ply,
            "stl" => Self::Stl,
            "off" => Self::Off,
            "gltf" | "glb" => Self::Gltf,
            "3mf" => Self::ThreeMf,
            "e57" => Self::E57,
            "las" | "laz" => Self::Las,
            "pcd" => Self::Pcd,
            "pts" => Self::Pts,
            "ptx" => Self::Ptx,
            "xyz" | "txt" | "asc" | "csv" | "xyzn" | "xyzrgb" | "neu" | "tsv" | "dat" => Self::Table,
            _ => return None,
        })
    }
}

/// What the ending of a file's name says of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Named {
    /// A format of scans.
    Scan,
    /// Perhaps a table of coordinates: other texts have this ending, too.
    Text,
    /// Nothing that is read as a scan.
    Other,
}

/// What the ending of a file's name says of it, that before `.gz` among them.
#[must_use]
pub fn named(path: &Path) -> Named {
    let name = path.file_name().map(|name| name.to_string_lossy().to_lowercase()).unwrap_or_default();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    match name.rsplit_once('.').map_or("", |(_, ending)| ending) {
        "txt" | "csv" | "tsv" | "dat" => Named::Text,
        ending if Format::of_ending(ending).is_some() => Named::Scan,
        _ => Named::Other,
    }
}

/// Beginnings of files that people confuse with scans and scripts, in lower case, and their formats.
const FOREIGN: [(&[u8], &str, &str); 13] = [
    (b"version https://git-lfs", "a pointer of Git LFS, not the file itself", "`git lfs pull` fetches that"),
    (b"/annex/objects/", "a pointer of git-annex, not the file itself", "`git annex get` fetches that"),
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
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", "unpack it first"),
];

/// Beginnings of files that are scans and no scripts, in lower case, and their formats.
const SCANS: [(&[u8], &str); 11] = [
    (b"astm-e57", "an E57 file"),
    (b"lasf", "a LAS or LAZ file"),
    (b"gltf", "a binary glTF file"),
    (b"# .pcd", "a PCD file"),
    (b"version .", "a PCD file"),
    (b"off", "an OFF file"),
    (b"coff", "an OFF file"),
    (b"pk\x03\x04", "a ZIP archive (3MF, or compressed)"),
    (b"\x1f\x8b", "a gzip-compressed file"),
    (b"\xff\xfe", "a text in UTF-16"),
    (b"\xfe\xff", "a text in UTF-16"),
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

/// Recognises a file that is not a script by its beginning.
#[must_use]
pub fn foreign(bytes: &[u8]) -> Option<Foreign> {
    let start = beginning(bytes);
    let scan = SCANS.iter().find(|(magic, _)| begins_with(start, magic));
    scan.map(|(_, found)| Foreign { found, fix: None }).or_else(|| unreadable(bytes))
}

/// Recognises a file that is neither a scan nor a script by its beginning.
fn unreadable(bytes: &[u8]) -> Option<Foreign> {
    let start = beginning(bytes);
    let (_, found, fix) = FOREIGN.iter().find(|(magic, ..)| begins_with(start, magic))?;
    Some(Foreign { found, fix: Some(*fix).filter(|fix| *fix != CONVERT) })
}

fn beginning(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start()
}

fn begins_with(start: &[u8], magic: &[u8]) -> bool {
    start.get(..magic.len()).is_some_and(|begin| begin.eq_ignore_ascii_case(magic))
}

/// Recognises the format of a file of `size` bytes that begins with `head`. A file whose content does not tell (say, an
/// OBJ file of comments only) is taken for what its extension says, so that the message is about that format.
pub(super) fn recognise(path: &Path, head: &[u8], size: u64) -> Result<Format, ScanFault> {
    if let Some(format) = by_content(head, size) {
        return Ok(format);
    }
    if let Some(Foreign { found, fix }) = unreadable(head) {
        return Err(ScanFault::NotRecognised { found: found.to_owned(), fix: fix.unwrap_or(CONVERT) });
    }
    if is_ascii_stl(head) {
        return Ok(Format::Stl);
    }
    if is_obj(head) {
        return Ok(Format::Obj);
    }
    let texts = [(Format::Ptx, ptx::recognise as fn(&[u8]) -> bool), (Format::Pts, pts::recognise)];
    if let Some((format, _)) = texts.into_iter().find(|(_, recognise)| recognise(head)) {
        return Ok(format);
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let by_name = Format::of_ending(&extension);
    match by_name {
        None | Some(Format::Table) if table::recognise(head) => Ok(Format::Table),
        Some(format) if format != Format::Table && is_utf16(head) => {
            Err(ScanFault::NotRecognised { found: "a text in UTF-16".to_owned(), fix: "save it as UTF-8" })
        }
        // Any text may be called so.
        Some(Format::Table) if extension == "txt" || extension == "dat" => {
            Err(ScanFault::NotRecognised { found: describe(head), fix: CONVERT })
        }
        Some(format) => Ok(format),
        _ => Err(ScanFault::NotRecognised { found: describe(head), fix: CONVERT }),
    }
}

fn is_utf16(head: &[u8]) -> bool {
    head.starts_with(b"\xff\xfe") || head.starts_with(b"\xfe\xff")
}

/// The format that the first bytes say by themselves.
fn by_content(head: &[u8], size: u64) -> Option<Format> {
    let start = beginning(head);
    let is = |magic: &[u8]| begins_with(start, magic);
    if head.starts_with(b"ply") && head.get(3).is_none_or(u8::is_ascii_whitespace) {
        return Some(Format::Ply);
    }
    // Its header has any text, and its size is no accident.
    if binary_stl_size(head) == Some(size) {
        return Some(Format::Stl);
    }
    let formats = [
        (is(b"astm-e57"), Format::E57),
        (head.starts_with(b"LASF"), Format::Las),
        (pcd::recognise(head), Format::Pcd),
        (off::recognise(head), Format::Off),
        (gltf::recognise(head), Format::Gltf),
        (head.starts_with(b"PK\x03\x04"), Format::ThreeMf),
    ];
    formats.into_iter().find(|(is_it, _)| *is_it).map(|(_, format)| format)
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
