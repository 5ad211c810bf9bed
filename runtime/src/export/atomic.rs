//! Files appear whole or not at all: written beside their place and renamed into it.

use super::begun;
use crate::reason::{in_words, of_kind};
use std::fs::{File, TryLockError};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;
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
    sweep(folder);
    let mut beside = Beside::new_in(folder).map_err(without_path)?;
    let mut out = BufWriter::new(beside.file.as_file_mut());
    fill(&mut out)?;
    out.flush()?;
    drop(out);
    if let Ok(there) = target.metadata() {
        // What others may not read is not opened to them by a new version. Some systems have no such permissions.
        _ = beside.file.as_file().set_permissions(there.permissions());
    }
    beside.persist(&target)
}

/// How the names of temporary files begin.
const TEMPORARY: &str = ".gmlc-tmp-";

/// A temporary file. It is locked as long as it is written, where the system has locks: one that could be and is not
/// was left by a process that was killed.
struct Beside {
    file: NamedTempFile,
    _listed: Listed,
}

/// A path on the list of what was begun.
struct Listed(PathBuf);

impl Drop for Listed {
    fn drop(&mut self) {
        begun::hold().is_done(&self.0);
    }
}

impl Beside {
    fn new_in(folder: &Path) -> io::Result<Beside> {
        let mut builder = tempfile::Builder::new();
        // Temporary files are private by default; an output has the permissions of any other new file.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        builder.prefix(TEMPORARY);
        loop {
            let mut begun = begun::hold();
            let file = builder.tempfile_in(folder)?;
            let is_held_by_other = matches!(file.as_file().try_lock(), Err(TryLockError::WouldBlock));
            // Another process may have taken it for an abandoned one before it was locked.
            if !is_held_by_other && file.path().exists() {
                begun.file(file.path());
                let _listed = Listed(file.path().to_owned());
                return Ok(Beside { file, _listed });
            }
        }
    }

    fn persist(self, target: &Path) -> io::Result<()> {
        let Self { file, _listed } = self;
        let begun = begun::hold();
        let done = file.persist(target);
        drop(begun);
        done.map(drop).map_err(|error| error.error)
    }
}

/// Removes the temporary files of processes that were killed.
pub(super) fn sweep(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_temporary = entry.file_name().to_str().is_some_and(|name| name.starts_with(TEMPORARY));
        // A link, or a pipe that nobody reads, is not ours.
        if is_temporary && entry.file_type().is_ok_and(|kind| kind.is_file()) {
            // Some systems lock only what may be written to.
            let Ok(file) = File::options().write(true).open(entry.path()) else { continue };
            // It stays locked until it is gone. What cannot be removed is no reason not to write.
            if file.try_lock().is_ok() {
                _ = std::fs::remove_file(entry.path());
            }
        }
    }
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
    fn what_a_killed_process_has_left_goes_with_the_next_write_and_what_is_being_written_stays() {
        let folder = tempfile::tempdir().unwrap();
        let left = |name: &str| folder.path().join(format!("{TEMPORARY}{name}"));
        std::fs::write(left("killed"), "half").unwrap();
        let alive = File::create(left("alive")).unwrap();
        alive.lock().unwrap();
        std::fs::create_dir(left("folder")).unwrap();
        let of_others = folder.path().join(".gmlc-mine");
        std::fs::write(&of_others, "").unwrap();
        write_with(&folder.path().join("a.txt"), |out| {
            // Another one that writes beside it does not take it away.
            write(&folder.path().join("b.txt"), b"whole").unwrap();
            out.write_all(b"whole")
        })
        .unwrap();
        let there = ["killed", "alive", "folder"].map(|name| left(name).exists());
        assert_eq!((there, of_others.exists()), ([false, true, true], true));
        drop(alive);
        write(&folder.path().join("a.txt"), b"again").unwrap();
        assert_eq!(std::fs::read(folder.path().join("b.txt")).unwrap(), b"whole");
        assert!(!left("alive").exists());
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
