//! Errors of reading a scan or a mesh.

use crate::reason::in_words;
use gml_compiler::number::plain;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A file that could not be read, and its fault.
#[derive(Debug, Error)]
#[error("{}: {fault}", path.display())]
pub struct ScanError {
    /// The file.
    pub path: PathBuf,
    /// Its fault.
    #[source]
    pub fault: ScanFault,
}

/// The fault of a file, as a sentence with its fix.
#[derive(Debug, Error)]
pub enum ScanFault {
    /// There is no such file.
    #[error("there is no such file")]
    Missing,
    /// It is a folder.
    #[error("is a folder, not a file")]
    Folder,
    /// It is a device, a pipe or a socket.
    #[error("is a pipe or a device; save its contents to a file first")]
    NotAFile,
    /// The operating system refuses.
    #[error("it cannot be read: {}", in_words(.0))]
    Unreadable(#[source] std::io::Error),
    /// The user ended the work.
    #[error("interrupted")]
    Cancelled,
    /// It has no scan of that number.
    #[error("it has {count} scan{}; --scan-index counts from 0", if *count == 1 { "" } else { "s" })]
    NoSuchScan {
        /// Scans in the file.
        count: usize,
    },
    /// None of its points is in the box.
    #[error(
        "none of its {points} points is in the box of --crop, which is in the file's frame (`gmlc info` says where they are)"
    )]
    NothingInBox {
        /// Points in the file.
        points: u64,
    },
    /// No triangles can be made of its points.
    #[error("no triangles can be made of its {points} points, which lie on no surface; mesh the points first")]
    NoSurface {
        /// Points of the cloud.
        points: usize,
    },
    /// All of its points are none.
    #[error("none of its {count} points is valid: they have no coordinates, or the file marks them as invalid")]
    OnlyInvalid {
        /// Points in the file.
        count: u64,
    },
    /// It has no bytes.
    #[error("the file is empty (0 bytes); export the scan again")]
    Empty,
    /// It has more bytes than are read.
    #[error("the file has {bytes} bytes, more than the {limit} that are read; decimate or split the scan")]
    TooLarge {
        /// Size of the file.
        bytes: u64,
        /// The size of the largest file that is read.
        limit: u64,
    },
    /// It is none of the formats that are read.
    #[error(
        "expected a scan or a mesh (OBJ, PLY, STL, OFF, glTF, 3MF, E57, LAS, LAZ, PCD, PTS, PTX, XYZ or CSV), found {found}; {fix}"
    )]
    NotRecognised {
        /// The format that it seems to have, with an article.
        found: String,
        /// The way to a file that is read.
        fix: &'static str,
    },
    /// It breaks the rules of its format.
    #[error("malformed {format}, {place}: {message}")]
    Malformed {
        /// `OBJ`, `PLY` or `STL`.
        format: &'static str,
        /// Line, element or header.
        place: String,
        /// The expected and the actual content.
        message: String,
    },
    /// There are no points in it.
    #[error("it has no vertices; export the scan again, with its geometry")]
    NoVertices,
    /// A mesh is required, and there are only points.
    #[error("it has {vertices} vertices but no triangles; mesh the points first")]
    NoTriangles {
        /// Points in the file.
        vertices: usize,
    },
    /// There are triangles, but not one with an area.
    #[error("none of its {triangles} triangles has an area; check the export's precision and unit")]
    OnlyDegenerate {
        /// Triangles in the file.
        triangles: usize,
    },
    /// A coordinate is not a number, infinite or absurdly large.
    #[error(
        "vertex {vertex} (counted from 1) is at ({}, {}, {}), which is not finite or beyond 1e12 mm; check the unit, or remove it in the scanner's software",
        plain(at[0]), plain(at[1]), plain(at[2])
    )]
    NonFinite {
        /// The vertex, counted from 1.
        vertex: usize,
        /// Its coordinates.
        at: [f64; 3],
    },
    /// A face names a vertex (or a normal, or a texture coordinate) that is not there.
    #[error("{place} names {what} {index}, but there are {count}; the file is damaged or cut off: export it again")]
    IndexOutOfRange {
        /// Line or face.
        place: String,
        /// `vertex`, `normal` or `texture coordinate`.
        what: &'static str,
        /// The index as the file has it.
        index: i64,
        /// The number of those in the file.
        count: usize,
    },
}

/// A text for a message: its beginning, in one line.
pub(super) fn shown(text: &str) -> String {
    const MOST: usize = 60;
    let line = text.trim().lines().next().unwrap_or_default();
    match line.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}...", &line[..end]),
        None => line.to_owned(),
    }
}

impl ScanFault {
    pub(super) fn malformed(format: &'static str, place: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Malformed { format, place: place.into(), message: message.into() }
    }

    pub(super) fn at(self, path: &Path) -> ScanError {
        ScanError { path: path.to_owned(), fault: self }
    }
}
