//! The bytes of buffers: in a GLB file, in the JSON, or in files beside it.

use super::document::{self, Document, View};
use super::malformed;
use crate::scan::error::{ScanFault, shown};
use crate::scan::file::MOST_BYTES;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::borrow::Cow;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// Buffers, each of which is read when it is asked for.
pub(super) struct Buffers<'a> {
    buffers: &'a [document::Buffer],
    /// The binary chunk of a GLB file.
    binary: Option<&'a [u8]>,
    folder: &'a Path,
    read: Vec<Option<Cow<'a, [u8]>>>,
    /// Bytes of other files that may still be read.
    left: u64,
}

impl<'a> Buffers<'a> {
    pub(super) fn new(buffers: &'a [document::Buffer], binary: Option<&'a [u8]>, folder: &'a Path) -> Self {
        Self { buffers, binary, folder, read: vec![None; buffers.len()], left: MOST_BYTES }
    }

    /// The bytes of a view, with its description.
    pub(super) fn view<'d>(&mut self, document: &'d Document, index: usize) -> Result<(&'d View, &[u8]), ScanFault> {
        let place = || format!("bufferViews[{index}]");
        let count = document.buffer_views.len();
        let view = document.buffer_views.get(index).ok_or_else(|| malformed(place(), of(count)))?;
        if let Some(name) = view.extensions.keys().find(|name| name.contains("meshopt")) {
            return Err(document::extension(place(), name));
        }
        let buffer = self.bytes(view.buffer)?;
        let end = view.byte_offset.checked_add(view.byte_length);
        match end.and_then(|end| buffer.get(view.byte_offset..end)) {
            Some(bytes) => Ok((view, bytes)),
            None => {
                let (size, View { byte_offset, byte_length, buffer, .. }) = (buffer.len(), view);
                let message = format!(
                    "it has {byte_length} bytes from byte {byte_offset} on of buffer {buffer}, which has {size}; export it again"
                );
                Err(malformed(place(), message))
            }
        }
    }

    fn bytes(&mut self, index: usize) -> Result<&[u8], ScanFault> {
        let count = self.buffers.len();
        let buffer = self.buffers.get(index).ok_or_else(|| malformed(format!("buffers[{index}]"), of(count)))?;
        let bytes = match self.read[index].take() {
            Some(bytes) => bytes,
            None => self.load(buffer, index)?,
        };
        Ok(self.read[index].insert(bytes))
    }

    fn load(&mut self, buffer: &'a document::Buffer, index: usize) -> Result<Cow<'a, [u8]>, ScanFault> {
        let fault = |message: String| malformed(format!("buffers[{index}]"), message);
        let length = buffer.byte_length;
        let bytes = match (&buffer.uri, self.binary) {
            (None, Some(binary)) if index == 0 => Cow::Borrowed(binary),
            (None, _) => return Err(fault("it has no `uri`, and there is no binary chunk for it".into())),
            (Some(uri), _) if uri.starts_with("data:") => {
                let data = uri.split_once(";base64,").map(|(_, data)| data);
                let data = data.ok_or_else(|| fault("its `data:` URI is not in base64".into()))?;
                let bytes = STANDARD.decode(data);
                Cow::Owned(bytes.map_err(|error| fault(format!("its `data:` URI is no base64: {error}")))?)
            }
            (Some(uri), _) => {
                let name = inside(uri).ok_or_else(|| {
                    let only = "files are read in the folder of the glTF file only; put it there, or export a GLB file";
                    fault(format!("its `uri` is `{}`: {only}", shown(uri)))
                })?;
                self.file(&name, length as u64).map_err(|reason| fault(format!("`{}`: {reason}", shown(uri))))?.into()
            }
        };
        if bytes.len() < length {
            let message = format!("it announces {length} bytes, and there are {}; it is cut off", bytes.len());
            return Err(fault(format!("{message}: export it again")));
        }
        Ok(match bytes {
            Cow::Borrowed(bytes) => Cow::Borrowed(&bytes[..length]),
            Cow::Owned(mut bytes) => {
                bytes.truncate(length);
                Cow::Owned(bytes)
            }
        })
    }

    /// The first bytes of a file in the folder.
    fn file(&mut self, name: &Path, length: u64) -> Result<Vec<u8>, ScanFault> {
        let path = self.folder.join(name);
        self.left = self.left.checked_sub(length).ok_or(ScanFault::TooLarge { bytes: length, limit: MOST_BYTES })?;
        let unreadable = |error: std::io::Error| match error.kind() {
            std::io::ErrorKind::NotFound => ScanFault::Missing,
            _ => ScanFault::Unreadable(error),
        };
        if !std::fs::metadata(&path).map_err(unreadable)?.is_file() {
            return Err(ScanFault::NotAFile);
        }
        let mut bytes = Vec::new();
        File::open(&path).map_err(unreadable)?.take(length).read_to_end(&mut bytes).map_err(unreadable)?;
        Ok(bytes)
    }
}

/// The fault of an index.
pub(super) fn of(count: usize) -> String {
    format!("it is named, but there are {count}; export it again")
}

/// The path that a relative URI says, if it does not lead out of its folder.
fn inside(uri: &str) -> Option<PathBuf> {
    let mut decoded = Vec::new();
    let mut rest = uri.as_bytes();
    while let [first, others @ ..] = rest {
        rest = others;
        if *first != b'%' {
            decoded.push(*first);
            continue;
        }
        let (digits, others) = rest.split_at_checked(2)?;
        decoded.push(u8::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok()?);
        rest = others;
    }
    let path = PathBuf::from(String::from_utf8(decoded).ok()?);
    let text = path.to_str()?;
    // A scheme, or a drive or a path of Windows.
    let plain = !text.is_empty() && !text.contains([':', '\\', '\0']);
    let inside = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    (plain && inside).then_some(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_stay_in_the_folder() {
        for (uri, path) in [("a.bin", "a.bin"), ("b/a%20b.bin", "b/a b.bin"), ("./a.bin", "./a.bin")] {
            assert_eq!(inside(uri), Some(path.into()), "{uri}");
        }
        for uri in
            ["", "../a", "/a", "a/../b", "%2e%2e/a", "%2Fa", "file:a", "https://x/a", "a\\b", "%", "%zz", "a%00", "%ff"]
        {
            assert_eq!(inside(uri), None, "{uri}");
        }
    }
}
