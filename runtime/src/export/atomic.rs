//! Files appear whole or not at all: written beside their place and renamed into it.

use crate::reason::{in_words, of_kind};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A file could not be written; whatever was at its place before is still there.
#[derive(Debug, Error)]
#[error("cannot write `{}`: {}", path.display(), in_words(source))]
pub struct WriteError {
    /// The file.
    pub path: PathBuf,
    /// The reason.
    #[source]
    pub source: io::Error,
}

/// Writes `bytes` to `path`, replacing what is there.
///
/// # Errors
/// The folder is missing or may not be written to, the disk is full, or `path` is a folder.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    write_with(path, |out| out.write_all(bytes))
}

/// Writes to `path` whatever `fill` writes, replacing what is there.
///
/// # Errors
/// As `write`, and whatever `fill` fails with.
pub fn write_with<F>(path: &Path, fill: F) -> Result<(), WriteError>
where
    F: FnOnce(&mut dyn Write) -> io::Result<()>,
{
    try_write(path, fill).map_err(|source| WriteError { path: path.to_owned(), source })
}

fn try_write<F>(path: &Path, fill: F) -> io::Result<()>
where
    F: FnOnce(&mut dyn Write) -> io::Result<()>,
{
    // A symbolic link keeps pointing where it does: its target is replaced.
    let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    if let Ok(there) = target.metadata() {
        if there.is_dir() {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder; name a file in it"));
        }
        if is_named_pipe(&target, &there) {
            let message = "it is a pipe, whose reader may never come; name a file";
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
        if !there.is_file() {
            // A pipe or a device such as /dev/null cannot be replaced by renaming.
            let mut out = BufWriter::new(File::options().write(true).open(&target)?);
            fill(&mut out)?;
            return out.flush();
        }
    }
    let folder = match target.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        let message = format!("folder `{}` does not exist; make it first", folder.display());
        return Err(io::Error::new(io::ErrorKind::NotFound, message));
    }
    let mut beside = new_file_in(folder).map_err(without_path)?;
    let mut out = BufWriter::new(beside.as_file_mut());
    fill(&mut out)?;
    out.flush()?;
    drop(out);
    beside.persist(&target).map_err(|error| error.error)?;
    Ok(())
}

/// An error that does not name the temporary file, which means nothing to the user.
pub(super) fn without_path(error: io::Error) -> io::Error {
    io::Error::new(error.kind(), of_kind(error.kind()))
}

/// Whether a path is that of a pipe in a folder: opening it waits for a reader, whatever the user sends. Pipes of a
/// shell (`/dev/stdout`, `>(...)`) have one.
#[cfg(unix)]
fn is_named_pipe(target: &Path, there: &std::fs::Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    there.file_type().is_fifo() && !target.starts_with("/proc") && !target.starts_with("/dev")
}

#[cfg(not(unix))]
fn is_named_pipe(_target: &Path, _there: &std::fs::Metadata) -> bool {
    false
}

fn new_file_in(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    // Temporary files are private by default; an output has the permissions of any other new file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.prefix(".gmlc-").tempfile_in(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaces_and_leaves_nothing_beside() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write(&path, b"one").unwrap();
        write(&path, b"two").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_failure_keeps_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write(&path, b"old").unwrap();
        let failed = write_with(&path, |out| {
            out.write_all(b"half")?;
            Err(io::Error::other("no more"))
        });
        assert!(failed.unwrap_err().to_string().ends_with("no more"));
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn says_what_is_wrong() {
        let folder = tempfile::tempdir().unwrap();
        let error = write(folder.path(), b"x").unwrap_err().to_string();
        assert!(error.contains("it is a folder"), "{error}");
        let error = write(&folder.path().join("absent/a.txt"), b"x").unwrap_err().to_string();
        assert!(error.contains("absent` does not exist"), "{error}");
        assert!(!error.contains(".gmlc-"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn devices_and_links_stay() {
        use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
        write(Path::new("/dev/null"), b"x").unwrap();
        assert!(std::fs::metadata("/dev/null").unwrap().file_type().is_char_device());
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        write(&file, b"old").unwrap();
        symlink(&file, &link).unwrap();
        write(&link, b"new").unwrap();
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(std::fs::read(&file).unwrap(), b"new");
        assert_ne!(std::fs::metadata(&file).unwrap().permissions().mode() & 0o044, 0, "others may read it");
    }
}
