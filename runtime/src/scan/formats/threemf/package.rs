//! The archive, and the parts in it.

use super::model::{self, Model, Objects};
use super::{malformed, part};
use crate::scan::error::{ScanFault, shown};
use crate::scan::file::{MODEST, MOST_UNPACKED};
use quick_xml::Reader;
use quick_xml::events::Event;
use std::io::{BufReader, Cursor, Read};
use std::sync::Arc;
use zip::ZipArchive;

/// The type of the relation to the model of a package.
const RELATION: &str = "3dmodel";

pub(super) struct Package<'a> {
    archive: ZipArchive<Cursor<&'a [u8]>>,
    /// The names of its files, by index.
    names: Vec<String>,
    /// Bytes of parts that may still be unpacked; that were.
    left: u64,
    unpacked: u64,
}

impl<'a> Package<'a> {
    pub(super) fn open(bytes: &'a [u8]) -> Result<Self, ScanFault> {
        let archive = ZipArchive::new(Cursor::new(bytes)).map_err(|error| {
            malformed("archive", format!("it cannot be opened ({error}); it is damaged or cut off: export it again"))
        })?;
        let names = archive.file_names_raw().map(|name| String::from_utf8_lossy(name).into_owned()).collect();
        let left = (MOST_UNPACKED * bytes.len() as u64).max(MODEST);
        Ok(Self { archive, names, left, unpacked: 0 })
    }

    /// Bytes that were unpacked.
    pub(super) fn unpacked(&self) -> usize {
        self.unpacked as usize
    }

    /// The name of the part that has the build: by the package's relations.
    pub(super) fn root(&mut self) -> Result<Arc<str>, ScanFault> {
        const RELATIONS: &str = "_rels/.rels";
        let named = if self.index(RELATIONS).is_some() { self.related(RELATIONS)? } else { None };
        let usual = || self.names.iter().find(|name| name.to_ascii_lowercase().ends_with(".model")).cloned();
        named.or_else(usual).map(|name| name.trim_start_matches('/').into()).ok_or_else(|| {
            let shown_names: Vec<String> = self.names.iter().take(4).map(|name| part(name)).collect();
            let more = if self.names.len() > 4 { ", ..." } else { "" };
            let found =
                if self.names.is_empty() { "nothing".into() } else { format!("{}{more}", shown_names.join(", ")) };
            let message =
                format!("it is a ZIP archive without a 3D model, it has {found}; unpack it, and give the scan in it");
            malformed("archive", message)
        })
    }

    fn index(&self, name: &str) -> Option<usize> {
        let name = name.trim_start_matches('/');
        self.names.iter().position(|known| known.trim_start_matches('/').eq_ignore_ascii_case(name))
    }

    /// The target of the relation to the model.
    fn related(&mut self, relations: &str) -> Result<Option<String>, ScanFault> {
        let mut found = None;
        self.read(relations, |reader| {
            let mut buffer = Vec::new();
            loop {
                buffer.clear();
                match model::event(reader, &mut buffer, relations)? {
                    Event::Eof => return Ok(()),
                    Event::Start(element) | Event::Empty(element)
                        if element.local_name().as_ref() == "Relationship" =>
                    {
                        let attributes = model::Attributes::of(&element, relations)?;
                        if attributes.get("Type").is_some_and(|kind| kind.ends_with(RELATION)) {
                            found = attributes.get("Target").map(str::to_owned).or(found.take());
                        }
                    }
                    _ => {}
                }
            }
        })?;
        Ok(found)
    }

    /// Reads a model; its objects are added to `objects`.
    pub(super) fn model(&mut self, name: &Arc<str>, objects: &mut Objects) -> Result<Model, ScanFault> {
        let mut model = Model::default();
        self.read(name, |reader| {
            model = model::read(reader, name, objects)?;
            Ok(())
        })?;
        Ok(model)
    }

    /// Reads a part as a stream of XML.
    fn read(
        &mut self,
        name: &str,
        parse: impl FnOnce(&mut Reader<BufReader<Limited<'_>>>) -> Result<(), ScanFault>,
    ) -> Result<(), ScanFault> {
        let index = self
            .index(name)
            .ok_or_else(|| malformed(part(name), "the package refers to it and does not have it; export it again"))?;
        let file = self.archive.by_index(index).map_err(|error| {
            let message = format!("it cannot be unpacked ({error}); export it again, without a password");
            malformed(part(name), message)
        })?;
        let before = self.left;
        let limited = Limited { file: Box::new(file), left: &mut self.left };
        let mut reader = Reader::from_reader(BufReader::with_capacity(1 << 16, limited));
        let parsed = parse(&mut reader);
        drop(reader);
        self.unpacked += before - self.left;
        if self.left == 0 {
            let message = format!("it unpacks to more than {MOST_UNPACKED} times the file's size; simplify the mesh");
            return Err(malformed(part(name), message));
        }
        parsed
    }
}

/// A part, up to the limit of all parts.
pub(super) struct Limited<'a> {
    file: Box<dyn Read + 'a>,
    left: &'a mut u64,
}

impl Read for Limited<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if *self.left == 0 {
            return Err(std::io::Error::other("it is too large"));
        }
        let most = usize::try_from(*self.left).unwrap_or(usize::MAX).min(buffer.len());
        let read = self.file.read(&mut buffer[..most])?;
        *self.left -= read as u64;
        Ok(read)
    }
}

/// For messages about values of attributes.
pub(super) fn quoted(text: &str) -> String {
    format!("`{}`", shown(text))
}
