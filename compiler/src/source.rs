//! Source files and positions in them.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Index of a file in [`Sources`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct FileId(pub u32);

/// A range of bytes in a source file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Span {
    /// The file.
    pub file: FileId,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    /// The smallest span that covers both; `self` where they are in different files.
    #[must_use]
    pub fn to(self, other: Span) -> Span {
        if self.file != other.file {
            return self;
        }
        Span { file: self.file, start: self.start.min(other.start), end: self.end.max(other.end) }
    }
}

/// A source file: its name as the user would write it, and its text.
#[derive(Clone, Debug)]
pub struct SourceFile {
    /// Path, or `std.curve` for a module of the standard library.
    pub name: String,
    /// The whole text.
    pub text: String,
}

/// A font that a script names: its name as the user would write it, and its bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FontFile {
    /// Path.
    pub name: String,
    /// The whole file.
    pub bytes: Arc<[u8]>,
}

/// Every file that took part in a compilation, for messages that quote them.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    files: Vec<SourceFile>,
    /// Files of the library that take part, by their index there.
    library: BTreeMap<u32, SourceFile>,
    fonts: Vec<FontFile>,
}

/// The library's files have ids from here on, whatever other files take part: their trees are read once in a process.
const LIBRARY: u32 = 1 << 31;

impl FileId {
    /// The library's file of that index.
    #[must_use]
    pub(crate) fn of_library(index: usize) -> FileId {
        FileId(LIBRARY + index as u32)
    }

    /// Whether it is a file of the library.
    pub(crate) fn is_library(self) -> bool {
        self.0 >= LIBRARY
    }
}

impl Sources {
    /// Adds a file.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<String>) -> FileId {
        self.files.push(SourceFile { name: name.into(), text: text.into() });
        FileId(u32::try_from(self.files.len() - 1).expect("fewer than 2^32 files"))
    }

    /// Adds a file of the library, if it is not there yet.
    pub(crate) fn add_library(&mut self, index: usize, name: &str, text: &str) -> FileId {
        let file = || SourceFile { name: name.to_owned(), text: text.to_owned() };
        self.library.entry(index as u32).or_insert_with(file);
        FileId::of_library(index)
    }

    /// Adds a font, if it is not there yet.
    pub(crate) fn add_font(&mut self, font: FontFile) {
        if !self.fonts.contains(&font) {
            self.fonts.push(font);
        }
    }

    /// The fonts in the order in which they were added.
    #[must_use]
    pub fn fonts(&self) -> &[FontFile] {
        &self.fonts
    }

    /// The file, if there is one of that index.
    #[must_use]
    pub fn get(&self, id: FileId) -> Option<&SourceFile> {
        match id.0.checked_sub(LIBRARY) {
            Some(index) => self.library.get(&index),
            None => self.files.get(id.0 as usize),
        }
    }

    /// The text under a span; empty where the span lies outside its file.
    #[must_use]
    pub fn text(&self, span: Span) -> &str {
        self.get(span.file).and_then(|f| f.text.get(span.start as usize..span.end as usize)).unwrap_or("")
    }

    /// Line and column of a span's start, both from 1; the column counts characters.
    #[must_use]
    pub fn line_column(&self, span: Span) -> (usize, usize) {
        let Some(file) = self.get(span.file) else {
            return (1, 1);
        };
        let before = &file.text[..file.text.floor_char_boundary(span.start as usize)];
        let line = before.bytes().filter(|b| *b == b'\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
        (line, column)
    }

    /// `cup.gml:12:5`: the file, line and column of a span's start.
    #[must_use]
    pub fn place(&self, span: Span) -> Option<String> {
        let (line, column) = self.line_column(span);
        Some(format!("{}:{line}:{column}", self.get(span.file)?.name))
    }

    /// The text under a span as messages quote it, if it is a short one.
    pub(crate) fn quoted(&self, span: Span) -> String {
        let text = self.text(span);
        let long = text.is_empty() || text.contains('\n') || text.chars().count() > 60;
        if long { "a value".to_owned() } else { format!("`{text}`") }
    }

    /// The number of files that are not of the library.
    pub(crate) fn len(&self) -> usize {
        self.files.len()
    }

    /// Forgets all but the first files; the library's and fonts stay.
    pub(crate) fn truncate(&mut self, files: usize) {
        self.files.truncate(files);
    }

    /// The files that are not of the library, in the order in which they were added: a script before what it uses.
    pub fn scripts(&self) -> impl Iterator<Item = &SourceFile> {
        self.files.iter()
    }

    /// All files in the order in which they were added, those of the library last.
    pub fn iter(&self) -> impl Iterator<Item = (FileId, &SourceFile)> {
        let library = self.library.iter().map(|(i, f)| (FileId(LIBRARY + i), f));
        self.files.iter().enumerate().map(|(i, f)| (FileId(i as u32), f)).chain(library)
    }
}

/// Gives the compiler the text of files that a script names in `use`. The standard library needs no loader: it is part
/// of the compiler.
pub trait Loader {
    /// The text of `path` (as written, relative to the file `from`) with the name to show for it.
    ///
    /// # Errors
    /// A sentence that says why the file cannot be read.
    fn load(&self, path: &str, from: &str) -> Result<SourceFile, String>;

    /// The font of `path` likewise, for `glyphs`.
    ///
    /// # Errors
    /// A sentence that says why the font cannot be read, which is so of all where a loader has texts only.
    fn load_font(&self, path: &str, _from: &str) -> Result<FontFile, String> {
        Err(format!("the font '{path}' cannot be read here: only texts are at hand"))
    }
}

/// A loader for scripts that use only the standard library.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoFiles;

impl Loader for NoFiles {
    fn load(&self, path: &str, _from: &str) -> Result<SourceFile, String> {
        Err(format!("'{path}' cannot be used here: only the standard library is at hand"))
    }
}
