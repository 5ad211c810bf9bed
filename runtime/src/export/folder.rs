//! A folder of results is that of one run: its files are written into a folder of their own inside of it, and only when
//! all are there they take the place of those of an earlier run.
//!
//! [`ResultFolder::begin`] makes `.gmlc-new-*` in the folder, into which the run writes. [`ResultFolder::finish`]
//! renames it to `.gmlc-complete`: from then on the run's result is the folder's, and whoever comes next moves what is
//! not yet in its place. While files are moved, INCOMPLETE.txt says so to everybody else. The folder itself stays, as
//! people and programs are in it, and so does what is not a result of gmlc.

use super::atomic::{self, WriteError, without_path};
use super::begun;
use super::lock::locked;
use super::measurement::{COLOUR, SAG, UNCERTAINTY, UNMATCHED};
use super::views::{OVERVIEW, VIEWS};
use super::x3d::SceneFormat;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// The files of a result, by name; and those of maps of parameters, which begin and end so.
const FILES: [&str; 33] = [
    COLOUR,
    "colours.png",
    "conformance.png",
    "conformance.tif",
    "deviations.glb",
    "deviations.ply",
    "deviations.vtp",
    "distance.exr",
    "distance.png",
    "distance.tif",
    "filled.ply",
    FIT,
    "histogram.svg",
    "legend.svg",
    SceneFormat::X3d.file(),
    SceneFormat::X3dz.file(),
    OVERVIEW,
    "parameters.csv",
    "parts.csv",
    "labels.csv",
    "points.ply",
    "points.vtp",
    REPORT,
    ROW,
    "section.svg",
    "significant.png",
    UNFINISHED,
    UNCERTAINTY[0],
    UNCERTAINTY[1],
    SAG,
    UNMATCHED,
    FIGURES,
    VIEWS,
];
const MAPS: (&str, &str) = ("sensitivity-", ".png");

/// The file of a fit.
pub const FIT: &str = "fit.json";

/// The file of the figures, which every measurement has.
pub const FIGURES: &str = "variance.json";

/// The file of the report, which every inspection has.
pub const REPORT: &str = "report.html";

/// The file of the row of a table of many inspections.
pub const ROW: &str = "row.json";

/// The fit of a run that ended before the rest of its results was there, in the folder of an earlier result.
pub const UNFINISHED: &str = "unfinished-fit.json";

const NEW: &str = ".gmlc-new-";
const COMPLETE: &str = ".gmlc-complete";
/// The names of a complete result's files, which are moved one by one, and of those of an earlier result that are
/// removed, after a sign.
const LIST: &str = ".gmlc-list";
const REMOVED: &str = "- ";
const MARK: &str = "INCOMPLETE.txt";
const MARK_TEXT: &str = "The files of this folder are those of two runs of gmlc: the later one ended while it put them in their place.\n\
     The next run of gmlc into this folder completes it.\n";

/// Whether a file of that name in an output folder is a result, which the next run replaces.
#[must_use]
pub fn is_result(name: &str) -> bool {
    FILES.contains(&name) || (name.starts_with(MAPS.0) && name.ends_with(MAPS.1))
}

/// A result that is being written. What is not finished leaves the folder as it was.
#[derive(Debug)]
pub struct ResultFolder {
    target: PathBuf,
    /// Locked as long as this run is alive.
    lock: Option<File>,
    staged: PathBuf,
    is_finished: bool,
    say: fn(&str),
}

impl ResultFolder {
    /// Begins a result in a folder, which is made if it is not there; completes or removes what runs that were killed
    /// have left. `say` is told where it waits for another process that has locked the folder.
    ///
    /// # Errors
    /// If the folder cannot be made or written to, or stays locked.
    pub fn begin(target: &Path, say: fn(&str)) -> Result<Self, WriteError> {
        let failed = |source| WriteError { path: target.to_owned(), source };
        fs::create_dir_all(target).map_err(failed)?;
        // The folder of this run is made and locked while others are held off, so that they see none that is unlocked
        // but those of runs that are over.
        let held = locked(target, say).map_err(failed)?;
        complete(target).map_err(failed)?;
        if held.is_some() {
            sweep(target).map_err(failed)?;
        }
        let (staged, lock) = stage(target).map_err(|error| failed(without_path(error)))?;
        Ok(Self { target: target.to_owned(), lock, staged, is_finished: false, say })
    }

    /// The folder to write the files into.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.staged
    }

    /// Whether the folder has a result of an earlier run.
    #[must_use]
    pub fn has_earlier(&self) -> bool {
        has_earlier(&self.target)
    }

    /// The same error, of the file where it would have come to lie.
    #[must_use]
    pub fn place(&self, error: WriteError) -> WriteError {
        match error.path.strip_prefix(&self.staged) {
            Ok(name) => WriteError { path: self.target.join(name), source: error.source },
            Err(_) => error,
        }
    }

    /// Has the system write all files to the disk: the list may not get there before what it lists.
    fn to_disk(&self) -> Result<(), WriteError> {
        let failed = |source| WriteError { path: self.target.clone(), source };
        for entry in fs::read_dir(&self.staged).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            File::open(&path)
                .and_then(|file| file.sync_all())
                .map_err(|source| self.place(WriteError { path, source }))?;
        }
        Ok(())
    }

    /// Puts the files into the place of those of an earlier run. `kept` is a file of that run that stays where it is,
    /// since this one has read it.
    ///
    /// # Errors
    /// If the folder cannot be written to, or a folder bears the name of one of the files; nothing is changed then. If
    /// it happens in the middle, INCOMPLETE.txt stays in the folder.
    pub fn finish(mut self, kept: Option<&str>) -> Result<(), WriteError> {
        let failed = |source| WriteError { path: self.target.clone(), source };
        let held = locked(&self.target, self.say).map_err(failed)?;
        // Another run may have ended in the middle since.
        complete(&self.target).map_err(failed)?;
        let list = self.moves(kept)?;
        self.to_disk()?;
        atomic::write(&self.staged.join(LIST), list.as_bytes()).map_err(|e| self.place(e))?;
        // From here on the result is whole: a signal comes too late.
        let mut begun = begun::hold();
        fs::rename(&self.staged, self.target.join(COMPLETE)).map_err(failed)?;
        self.is_finished = true;
        begun.is_done(&self.staged);
        let done = complete(&self.target).map_err(failed);
        drop(begun);
        if held.is_some() {
            // The result is in its place; what stays is swept by the next run.
            _ = sweep(&self.target);
        }
        done
    }

    /// The list of the files that are to be moved, and of those of an earlier result that are to be removed.
    fn moves(&self, kept: Option<&str>) -> Result<String, WriteError> {
        let failed = |source| WriteError { path: self.target.clone(), source };
        let new = entries(&self.staged).map_err(failed)?;
        let is_folder = |name: &&String| fs::symlink_metadata(self.target.join(name)).is_ok_and(|about| about.is_dir());
        if let Some(name) = new.iter().find(is_folder) {
            let source = io::Error::new(ErrorKind::IsADirectory, "a folder bears the name of a result; rename it");
            return Err(WriteError { path: self.target.join(name), source });
        }
        let there = entries(&self.target).map_err(failed)?;
        let has = |name: &str| there.iter().any(|other| other == name);
        let is_replaced = |name: &&String| {
            let is_of_earlier = match name.as_str() {
                // Without a report it may be that of `gmlc fit`.
                FIT => has(REPORT),
                UNFINISHED => new.iter().any(|name| name == FIT),
                _ => has(FIGURES),
            };
            is_result(name) && is_of_earlier && !new.contains(name) && !is_folder(name) && kept != Some(name.as_str())
        };
        let removed = there.iter().filter(is_replaced).map(|name| format!("{REMOVED}{name}"));
        Ok(new.iter().cloned().chain(removed).collect::<Vec<_>>().join("\n"))
    }

    /// Keeps the fit of a result that is not finished: in its place if the folder has no earlier result, otherwise
    /// beside that under another name. Returns where it is.
    ///
    /// # Errors
    /// If it cannot be moved.
    pub fn keep_fit(self) -> Result<PathBuf, WriteError> {
        keep_fit(&self.staged, &self.target)
    }
}

impl Drop for ResultFolder {
    fn drop(&mut self) {
        if !self.is_finished {
            // What cannot be removed now is swept by the next run.
            _ = fs::remove_dir_all(&self.staged);
            begun::hold().is_done(&self.staged);
        }
        self.lock = None;
    }
}

/// Makes a folder for the files of a result, and locks it where the system has locks.
fn stage(target: &Path) -> io::Result<(PathBuf, Option<File>)> {
    let mut begun = begun::hold();
    let staged = tempfile::Builder::new().prefix(NEW).tempdir_in(target)?.keep();
    begun.folder(&staged, target);
    let lock = File::open(&staged).ok().filter(|folder| folder.try_lock().is_ok());
    Ok((staged, lock))
}

fn has_earlier(target: &Path) -> bool {
    entries(target).is_ok_and(|names| names.iter().any(|name| is_result(name) && name != UNFINISHED))
}

/// [`ResultFolder::keep_fit`] of the folder of a run.
pub(super) fn keep_fit(staged: &Path, target: &Path) -> Result<PathBuf, WriteError> {
    let name = if has_earlier(target) { UNFINISHED } else { FIT };
    let path = target.join(name);
    fs::rename(staged.join(FIT), &path).map_err(|source| WriteError { path: path.clone(), source })?;
    Ok(path)
}

/// Moves the files of a complete result into their place, if there is one that is not there yet: of a process that was
/// killed while it did so.
///
/// # Errors
/// If files of the folder cannot be read or moved.
pub fn complete(target: &Path) -> io::Result<()> {
    let from = target.join(COMPLETE);
    if !fs::symlink_metadata(&from).is_ok_and(|about| about.is_dir()) {
        return Ok(());
    }
    let list = match fs::read_to_string(from.join(LIST)) {
        Ok(list) => list,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(error),
    };
    let mark = target.join(MARK);
    // A link would be written through.
    remove(&mark)?;
    File::create_new(&mark)?.write_all(MARK_TEXT.as_bytes())?;
    for line in list.lines() {
        let (name, is_removed) = line.strip_prefix(REMOVED).map_or((line, false), |name| (name, true));
        if !is_result(name) {
            let message = format!("`{COMPLETE}` in it was not written by gmlc: `{name}` is no result; remove it");
            return Err(io::Error::new(ErrorKind::InvalidData, message));
        }
        if is_removed {
            remove(&target.join(name))?;
            continue;
        }
        match fs::rename(from.join(name), target.join(name)) {
            // The run that ended in the middle has moved it.
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            moved => moved?,
        }
    }
    fs::remove_file(from.join(LIST))?;
    tidy(target)
}

/// Removes what is left of a result that is in its place. The folder goes last: as long as it is there, the next run
/// knows that the mark is to go.
fn tidy(target: &Path) -> io::Result<()> {
    remove(&target.join(MARK))?;
    fs::remove_dir(target.join(COMPLETE))
}

/// Removes a file, if it is there.
fn remove(file: &Path) -> io::Result<()> {
    match fs::remove_file(file) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        removed => removed,
    }
}

/// Removes what runs that are no longer alive have begun; the lock of the folder is held. A run holds the lock of its
/// own folder as long as it lives.
fn sweep(target: &Path) -> io::Result<()> {
    for name in entries(target)? {
        let path = target.join(&name);
        let is_abandoned = || File::open(&path).is_ok_and(|folder| folder.try_lock().is_ok());
        if name.starts_with(NEW) && is_abandoned() {
            fs::remove_dir_all(&path)?;
        }
    }
    atomic::sweep(target);
    // A run was killed after the last file was in its place.
    if entries(&target.join(COMPLETE)).is_ok_and(|names| names.is_empty()) {
        tidy(target)?;
    }
    Ok(())
}

/// The names in a folder that are text.
fn entries(folder: &Path) -> io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        names.extend(entry?.file_name().into_string());
    }
    names.sort();
    Ok(names)
}

#[cfg(test)]
mod tests;
