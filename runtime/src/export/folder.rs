//! A folder of results is that of one run: its files are written into a folder of their own inside of it, and only when
//! all are there they take the place of those of an earlier run.
//!
//! [`ResultFolder::begin`] makes `.gmlc-new-*` in the folder, into which the run writes. [`ResultFolder::finish`]
//! renames it to `.gmlc-complete`: from then on the run's result is the folder's, and whoever comes next moves what is
//! not yet in its place. While files are moved, INCOMPLETE.txt says so to everybody else. The folder itself stays, as
//! people and programs are in it, and so does what is not a result of gmlc.

use super::atomic::{WriteError, without_path};
use super::lock::locked;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The files of a result, by name; and those of maps of parameters, which begin and end so.
const FILES: [&str; 16] = [
    "colours.png",
    "conformance.png",
    "conformance.tif",
    "distance.exr",
    "distance.png",
    "distance.tif",
    "filled.ply",
    FIT,
    "model.x3d",
    "points.ply",
    REPORT,
    "significant.png",
    UNFINISHED,
    "unmatched.ply",
    FIGURES,
    "views.png",
];
const MAPS: (&str, &str) = ("sensitivity-", ".png");

/// The file of a fit.
pub const FIT: &str = "fit.json";

/// The files that every measurement and every inspection have.
const FIGURES: &str = "variance.json";
const REPORT: &str = "report.html";

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

/// A folder younger than this may belong to a run that has not locked it yet. Making it and locking it are two calls of
/// the system, which take microseconds.
const YOUNG: Duration = Duration::from_secs(1);

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
        {
            let _held = locked(target, say).map_err(failed)?;
            complete(target).map_err(failed)?;
            sweep(target).map_err(failed)?;
        }
        let staged = tempfile::Builder::new()
            .prefix(NEW)
            .tempdir_in(target)
            .map_err(|error| failed(without_path(error)))?
            .keep();
        let lock = File::open(&staged).ok().filter(|folder| folder.try_lock().is_ok());
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
        entries(&self.target).is_ok_and(|names| names.iter().any(|name| is_result(name) && name != UNFINISHED))
    }

    /// The same error, of the file where it would have come to lie.
    #[must_use]
    pub fn place(&self, error: WriteError) -> WriteError {
        match error.path.strip_prefix(&self.staged) {
            Ok(name) => WriteError { path: self.target.join(name), source: error.source },
            Err(_) => error,
        }
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
        super::atomic::write(&self.staged.join(LIST), list.as_bytes()).map_err(|e| self.place(e))?;
        fs::rename(&self.staged, self.target.join(COMPLETE)).map_err(failed)?;
        let done = complete(&self.target).map_err(failed);
        self.is_finished = true;
        drop(held);
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
        let name = if self.has_earlier() { UNFINISHED } else { FIT };
        let path = self.target.join(name);
        fs::rename(self.staged.join(FIT), &path).map_err(|source| WriteError { path: path.clone(), source })?;
        Ok(path)
    }
}

impl Drop for ResultFolder {
    fn drop(&mut self) {
        if !self.is_finished {
            // What cannot be removed now is swept by the next run.
            _ = fs::remove_dir_all(&self.staged);
        }
        self.lock = None;
    }
}

/// Moves the files of a complete result into their place, if there is one that is not there yet.
fn complete(target: &Path) -> io::Result<()> {
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
    fs::remove_dir(&from)?;
    fs::remove_file(mark)
}

/// Removes a file, if it is there.
fn remove(file: &Path) -> io::Result<()> {
    match fs::remove_file(file) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        removed => removed,
    }
}

/// Removes what runs that are no longer alive have begun.
fn sweep(target: &Path) -> io::Result<()> {
    for name in entries(target)? {
        let path = target.join(&name);
        // A run holds the lock of its folder from a moment after it made it; of one that is so young it may not yet.
        let is_abandoned = || {
            let made = path.metadata().and_then(|about| about.modified()).ok();
            let is_old = made.and_then(|made| made.elapsed().ok()).is_some_and(|age| age > YOUNG);
            is_old && File::open(&path).is_ok_and(|folder| folder.try_lock().is_ok())
        };
        if name.starts_with(NEW) && is_abandoned() {
            fs::remove_dir_all(&path)?;
        }
    }
    // A run was killed after the last file was in its place.
    if fs::remove_dir(target.join(COMPLETE)).is_ok() {
        remove(&target.join(MARK))?;
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
mod tests {
    use super::*;

    fn write(folder: &Path, files: &[(&str, &str)]) {
        files.iter().for_each(|(name, text)| fs::write(folder.join(name), text).unwrap());
    }

    fn contents(folder: &Path) -> Vec<(String, String)> {
        let read = |name: String| {
            let text = fs::read_to_string(folder.join(&name)).unwrap_or_else(|_| "folder".to_owned());
            (name, text)
        };
        entries(folder).unwrap().into_iter().map(read).collect()
    }

    fn owned(files: &[(&str, &str)]) -> Vec<(String, String)> {
        files.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect()
    }

    #[test]
    fn a_result_replaces_all_of_an_earlier_one_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a/b");
        let first = ResultFolder::begin(&target, |_| {}).unwrap();
        assert!(!first.has_earlier());
        write(
            first.path(),
            &[("filled.ply", "1"), ("fit.json", "1"), ("sensitivity-r.png", "1"), ("variance.json", "1")],
        );
        first.finish(None).unwrap();
        write(&target, &[("notes.txt", "mine")]);
        let second = ResultFolder::begin(&target, |_| {}).unwrap();
        assert!(second.has_earlier());
        write(second.path(), &[("fit.json", "2"), ("report.html", "2")]);
        let before = [
            ("filled.ply", "1"),
            ("fit.json", "1"),
            ("notes.txt", "mine"),
            ("sensitivity-r.png", "1"),
            ("variance.json", "1"),
        ];
        let seen: Vec<_> = contents(&target).into_iter().filter(|(name, _)| !name.starts_with('.')).collect();
        assert_eq!(seen, owned(&before), "until it is finished nothing changes");
        second.finish(None).unwrap();
        assert_eq!(contents(&target), owned(&[("fit.json", "2"), ("notes.txt", "mine"), ("report.html", "2")]));
    }

    #[test]
    fn what_no_earlier_result_has_is_the_users() {
        let folder = tempfile::tempdir().unwrap();
        let mine = [("fit.json", "mine"), ("points.ply", "mine"), ("sensitivity-x.png", "mine"), (UNFINISHED, "mine")];
        write(folder.path(), &mine);
        let result = ResultFolder::begin(folder.path(), |_| {}).unwrap();
        write(result.path(), &[("variance.json", "1")]);
        result.finish(None).unwrap();
        assert_eq!(contents(folder.path()), owned(&[&mine[..], &[("variance.json", "1")]].concat()));
        // The fit of an inspection belongs to it, unless it was read.
        write(folder.path(), &[("report.html", "1")]);
        for (kept, is_there) in [(Some(FIT), true), (None, false)] {
            write(folder.path(), &[("report.html", "1")]);
            let result = ResultFolder::begin(folder.path(), |_| {}).unwrap();
            write(result.path(), &[("variance.json", "2")]);
            result.finish(kept).unwrap();
            assert_eq!(folder.path().join(FIT).exists(), is_there);
        }
    }

    #[test]
    fn a_folder_with_the_name_of_a_result_is_an_error_before_anything_is_moved() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("report.html")).unwrap();
        write(folder.path(), &[("fit.json", "1")]);
        let result = ResultFolder::begin(folder.path(), |_| {}).unwrap();
        write(result.path(), &[("fit.json", "2"), ("report.html", "2")]);
        let error = result.finish(None).unwrap_err().to_string();
        assert!(error.contains("report.html") && error.contains("rename it"), "{error}");
        assert_eq!(contents(folder.path()), owned(&[("fit.json", "1"), ("report.html", "folder")]));
    }

    #[test]
    fn a_list_that_gmlc_did_not_write_moves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let complete = folder.path().join(COMPLETE);
        fs::create_dir(&complete).unwrap();
        write(&complete, &[(LIST, "../victim.txt")]);
        write(folder.path(), &[("notes.txt", "mine")]);
        let error = ResultFolder::begin(folder.path(), |_| {}).unwrap_err().to_string();
        assert!(error.contains("not written by gmlc"), "{error}");
    }

    #[test]
    fn what_is_not_finished_leaves_the_earlier_result() {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), &[("fit.json", "1"), ("report.html", "1")]);
        let begun = ResultFolder::begin(folder.path(), |_| {}).unwrap();
        write(begun.path(), &[("fit.json", "2")]);
        drop(begun);
        assert_eq!(contents(folder.path()), owned(&[("fit.json", "1"), ("report.html", "1")]));
        let begun = ResultFolder::begin(folder.path(), |_| {}).unwrap();
        write(begun.path(), &[("fit.json", "2")]);
        assert!(begun.keep_fit().unwrap().ends_with(UNFINISHED));
        let files = [("fit.json", "1"), ("report.html", "1"), (UNFINISHED, "2")];
        assert_eq!(contents(folder.path()), owned(&files));
        let empty = tempfile::tempdir().unwrap();
        let begun = ResultFolder::begin(empty.path(), |_| {}).unwrap();
        write(begun.path(), &[("fit.json", "2")]);
        begun.keep_fit().unwrap();
        assert_eq!(contents(empty.path()), owned(&[("fit.json", "2")]));
    }

    /// A run that was killed at any step after its result was complete: the next one puts it in its place.
    #[test]
    fn a_run_that_was_killed_while_it_moved_files_is_completed() {
        let new = ["fit.json", "report.html", "views.png"];
        for moved in 0..=new.len() {
            let folder = tempfile::tempdir().unwrap();
            write(folder.path(), &[("fit.json", "1"), ("filled.ply", "1"), ("report.html", "1")]);
            let complete = folder.path().join(COMPLETE);
            fs::create_dir(&complete).unwrap();
            write(&complete, &[(LIST, &format!("{}\n{REMOVED}filled.ply", new.join("\n")))]);
            write(folder.path(), &[(MARK, MARK_TEXT)]);
            for (k, name) in new.iter().enumerate() {
                write(if k < moved { folder.path() } else { &complete }, &[(name, "2")]);
            }
            drop(ResultFolder::begin(folder.path(), |_| {}).unwrap());
            assert_eq!(contents(folder.path()), owned(&new.map(|name| (name, "2"))), "{moved} were moved");
        }
        // After the list was removed.
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join(COMPLETE)).unwrap();
        write(folder.path(), &[("fit.json", "2"), (MARK, MARK_TEXT)]);
        drop(ResultFolder::begin(folder.path(), |_| {}).unwrap());
        assert_eq!(contents(folder.path()), owned(&[("fit.json", "2")]));
    }

    #[test]
    fn of_two_runs_into_one_folder_one_is_there_whole() {
        let folder = tempfile::tempdir().unwrap();
        let run = |text: &'static str| {
            let target = folder.path().to_owned();
            std::thread::spawn(move || {
                for _ in 0..50 {
                    let result = ResultFolder::begin(&target, |_| {}).unwrap();
                    write(result.path(), &[("fit.json", text), ("report.html", text), ("views.png", text)]);
                    result.finish(None).unwrap();
                }
            })
        };
        [run("a"), run("b")].into_iter().for_each(|thread| thread.join().unwrap());
        let files = contents(folder.path());
        assert!(files.len() == 3 && files.iter().all(|(_, text)| *text == files[0].1), "{files:?}");
    }

    #[test]
    fn errors_name_the_place_that_was_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let result = ResultFolder::begin(folder.path(), |_| {}).unwrap();
        let source = io::Error::other("the disk is full");
        let error = result.place(WriteError { path: result.path().join("views.png"), source }).to_string();
        assert!(
            error.contains(&folder.path().join("views.png").display().to_string()) && !error.contains(NEW),
            "{error}"
        );
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        assert!(ResultFolder::begin(&file, |_| {}).is_err());
    }
}
