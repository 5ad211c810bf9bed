//! Files: opened, unpacked and hashed.

use super::error::ScanFault;
use crate::record::hexadecimal;
use flate2::read::MultiGzDecoder;
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The largest file that is read into memory, in bytes: vertices and triangles of such a file can be numbered with 32
/// bits.
pub(super) const MOST_BYTES: u64 = 4 << 30;
/// The number of bytes at a file's beginning that tell its format: comments may come first.
const HEAD: u64 = 1 << 20;
/// A compressed file is unpacked to so many times its size, or to `MODEST` bytes if that is more. Scans as text shrink
/// to a third or a tenth.
pub(super) const MOST_UNPACKED: u64 = 100;
pub(super) const MODEST: u64 = 256 << 20;

/// The first bytes of a compressed file.
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// A file that can be read, and its beginning.
pub(super) struct Opened {
    file: File,
    /// The name that tells its format: without the ending `.gz`.
    pub(super) name: PathBuf,
    pub(super) size: u64,
    pub(super) head: Vec<u8>,
}

impl Opened {
    pub(super) fn new(path: &Path) -> Result<Self, ScanFault> {
        let about = std::fs::metadata(path).map_err(unreadable)?;
        if about.is_dir() {
            return Err(ScanFault::Folder);
        }
        if !about.is_file() {
            return Err(ScanFault::NotAFile);
        }
        let mut file = File::open(path).map_err(unreadable)?;
        if about.len() == 0 {
            return Err(ScanFault::Empty);
        }
        let head = beginning(&mut file)?;
        if head.starts_with(&GZIP) {
            return Self::unpack(path, file, about.len());
        }
        Ok(Self { file, name: path.to_owned(), size: about.len(), head })
    }

    /// Unpacks a file into a temporary one.
    fn unpack(path: &Path, packed: File, size: u64) -> Result<Self, ScanFault> {
        let most = (MOST_UNPACKED * size).max(MODEST);
        let mut file = tempfile::tempfile().map_err(ScanFault::Unreadable)?;
        let mut unpacked = MultiGzDecoder::new(BufReader::new(packed)).take(most + 1);
        let (mut chunk, mut bytes) = (vec![0; 1 << 16], 0_u64);
        loop {
            let read = unpacked.read(&mut chunk).map_err(|error| {
                let message = format!("it cannot be unpacked behind byte {bytes} ({error}); it is damaged or cut off");
                ScanFault::malformed("gzip", "compressed data", message)
            })?;
            if read == 0 {
                break;
            }
            bytes += read as u64;
            file.write_all(&chunk[..read]).map_err(ScanFault::Unreadable)?;
        }
        if bytes > most {
            let message = format!("it unpacks to more than {MOST_UNPACKED} times its size; unpack it first");
            return Err(ScanFault::malformed("gzip", "compressed data", message));
        }
        if bytes == 0 {
            return Err(ScanFault::Empty);
        }
        let head = beginning(&mut file)?;
        if head.starts_with(&GZIP) {
            let message = "it holds another compressed file; unpack it once".to_owned();
            return Err(ScanFault::malformed("gzip", "compressed data", message));
        }
        let name = match path.extension() {
            Some(ending) if ending.eq_ignore_ascii_case("gz") => path.with_extension(""),
            _ => path.to_owned(),
        };
        Ok(Self { file, name, size: bytes, head })
    }

    /// All of it.
    pub(super) fn bytes(mut self) -> Result<Vec<u8>, ScanFault> {
        if self.size > MOST_BYTES {
            return Err(ScanFault::TooLarge { bytes: self.size, limit: MOST_BYTES });
        }
        let mut bytes = Vec::with_capacity(self.size as usize);
        // What grows while it is read has no end.
        Read::by_ref(&mut self.file).take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
        Ok(bytes)
    }

    /// A file that is not on a disk.
    #[cfg(test)]
    pub(super) fn in_memory(name: &str, bytes: Vec<u8>) -> Result<Self, ScanFault> {
        let mut file = tempfile::tempfile().map_err(ScanFault::Unreadable)?;
        file.write_all(&bytes).map_err(ScanFault::Unreadable)?;
        let head = beginning(&mut file)?;
        Ok(Self { file, name: name.into(), size: bytes.len() as u64, head })
    }

    /// Its bytes one after the other.
    pub(super) fn stream(self) -> BufReader<File> {
        BufReader::with_capacity(1 << 18, self.file)
    }
}

/// The first bytes; the file is left at its beginning.
fn beginning(file: &mut File) -> Result<Vec<u8>, ScanFault> {
    let mut head = Vec::new();
    file.seek(SeekFrom::Start(0)).map_err(unreadable)?;
    Read::by_ref(file).take(HEAD).read_to_end(&mut head).map_err(unreadable)?;
    file.seek(SeekFrom::Start(0)).map_err(unreadable)?;
    Ok(head)
}

/// The SHA-256 of a file, in hexadecimal.
pub(super) fn digest(path: &Path) -> Result<String, ScanFault> {
    let mut file = File::open(path).map_err(unreadable)?;
    let (mut sum, mut chunk) = (Sha256::new(), vec![0; 1 << 20]);
    loop {
        match file.read(&mut chunk).map_err(unreadable)? {
            0 => return Ok(hexadecimal(sum.finalize())),
            read => sum.update(&chunk[..read]),
        }
    }
}

fn unreadable(error: std::io::Error) -> ScanFault {
    match error.kind() {
        ErrorKind::NotFound | ErrorKind::NotADirectory => ScanFault::Missing,
        _ => ScanFault::Unreadable(error),
    }
}
