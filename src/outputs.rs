//! What a command writes never replaces what it reads, and a folder of results is that of one run.

use crate::error::CommandError;
use crate::files::{self, folder_of};
use crate::print;
use gml_compiler::program::Program;
use gml_runtime::export::atomic::{self, WriteError};
use gml_runtime::export::folder::{self, ResultFolder};
use gml_runtime::export::json;
use gml_runtime::export::measurement::DocumentError;
use gml_runtime::export::scan::{self as export, Recorded, ScanFormat};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Whether an output is standard output: `-o -`. A file of that name is `./-`.
pub(crate) fn is_stream(path: &Path) -> bool {
    path == Path::new("-")
}

/// An output as results name it: nothing for standard output.
pub(crate) fn named(path: &Path) -> Option<String> {
    (!is_stream(path)).then(|| path.display().to_string())
}

/// Writes a file, creating the folder that it is in, and says where; or writes to standard output.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), CommandError> {
    if is_stream(path) {
        print::bytes(bytes);
        return Ok(());
    }
    make_parent(path)?;
    atomic::write(path, bytes).map_err(CommandError::failed)?;
    wrote(path);
    Ok(())
}

/// Writes a result as a JSON file likewise.
pub(crate) fn write_json(path: &Path, result: &impl Serialize) -> Result<(), CommandError> {
    if is_stream(path) {
        return print_json(result);
    }
    make_parent(path)?;
    json::write(path, result).map_err(CommandError::failed)?;
    wrote(path);
    Ok(())
}

/// Prints a result as JSON.
pub(crate) fn print_json(result: &impl Serialize) -> Result<(), CommandError> {
    println!("{}", serde_json::to_string_pretty(result).map_err(CommandError::failed)?);
    Ok(())
}

/// Refuses an output file that is one of the files that are read.
pub(crate) fn require_apart<'a>(output: &Path, inputs: impl IntoIterator<Item = &'a Path>) -> Result<(), CommandError> {
    if is_stream(output) {
        return Ok(());
    }
    let Ok(real) = output.canonicalize() else { return Ok(()) };
    match inputs.into_iter().find(|input| is_one(input, &real)) {
        Some(_) => Err(CommandError::usage(format!(
            "{}: is an input, which the output would replace; name another file",
            output.display()
        ))),
        None => Ok(()),
    }
}

/// Whether two paths lead to one file, which may have several names.
fn is_one(a: &Path, b: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let node =
            |path: &Path| path.metadata().ok().filter(|about| !about.is_dir()).map(|about| (about.dev(), about.ino()));
        node(a).is_some() && node(a) == node(b)
    }
    #[cfg(not(unix))]
    {
        a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b))
    }
}

/// Refuses an output file that is one of a program's scripts or fonts, those that are used among them.
pub(crate) fn require_apart_from_scripts(output: &Path, program: &Program) -> Result<(), CommandError> {
    let sources = program.sources();
    let names = sources.scripts().map(|script| &script.name).chain(sources.fonts().iter().map(|font| &font.name));
    require_apart(output, names.map(|name| Path::new(name.as_str())))
}

/// Refuses two outputs of one name: the later one would replace the other.
pub(crate) fn require_two(first: Option<&PathBuf>, second: Option<&PathBuf>) -> Result<(), CommandError> {
    let place = |path: &Path| Some(folder_of(path).canonicalize().ok()?.join(path.file_name()?));
    match (first, second) {
        (Some(a), Some(b)) if a == b || (place(a).is_some() && place(a) == place(b)) => {
            Err(CommandError::usage(format!("{}: two outputs have this name", b.display())))
        }
        _ => Ok(()),
    }
}

/// Refuses outputs that are folders before any work is done: of two outputs, none is to be written if one cannot be.
pub(crate) fn require_files<'a>(outputs: impl IntoIterator<Item = &'a PathBuf>) -> Result<(), CommandError> {
    match outputs.into_iter().find(|output| !is_stream(output) && output.is_dir()) {
        Some(folder) => Err(CommandError::usage(format!(
            "{}: is a folder, which a file cannot replace; name a file in it",
            folder.display()
        ))),
        None => Ok(()),
    }
}

/// Creates the folders of all outputs before the first is written.
pub(crate) fn make_parents<'a>(outputs: impl IntoIterator<Item = &'a PathBuf>) -> Result<(), CommandError> {
    outputs.into_iter().try_for_each(|output| make_parent(output))
}

/// Creates the folder of an output.
pub(crate) fn make_parent(path: &Path) -> Result<(), CommandError> {
    match path.parent() {
        _ if is_stream(path) => Ok(()),
        Some(folder) if !folder.as_os_str().is_empty() => make_folder(folder),
        _ => Ok(()),
    }
}

/// Creates a folder for outputs.
pub(crate) fn make_folder(folder: &Path) -> Result<(), CommandError> {
    std::fs::create_dir_all(folder).map_err(|e| CommandError::failed(WriteError { path: folder.to_owned(), source: e }))
}

/// Refuses a folder of results in which one of the files that are read would be replaced; `fit.json` only is if
/// `writes_fit`.
pub(crate) fn require_folder_apart<'a>(
    output: &Path,
    writes_fit: bool,
    inputs: impl IntoIterator<Item = &'a Path>,
) -> Result<(), CommandError> {
    if is_stream(output) {
        return Err(CommandError::usage(
            "--output: the results are several files in a folder, which standard output cannot hold; a folder of the name - is ./-",
        ));
    }
    let Ok(entries) = std::fs::read_dir(output) else { return Ok(()) };
    let is_replaced = |name: &str| folder::is_result(name) && (writes_fit || name != folder::FIT);
    let replaced: Vec<PathBuf> = entries
        .flatten()
        .filter(|entry| entry.file_name().to_str().is_some_and(is_replaced))
        .map(|entry| entry.path())
        .collect();
    // Under whichever name, or through a link: what is read may not vanish from where the user put it.
    match inputs.into_iter().find(|input| replaced.iter().any(|there| is_one(input, there))) {
        Some(input) => Err(CommandError::usage(format!(
            "{}: is an input, which the results in `{}` would replace; name another folder (-o)",
            input.display(),
            output.display()
        ))),
        None => Ok(()),
    }
}

/// Begins a result in a folder.
pub(crate) fn begin(output: &Path) -> Result<ResultFolder, CommandError> {
    ResultFolder::begin(output, |text| note!("{text}")).map_err(unwritable)
}

/// Whether the file that values were taken from is the fit.json of a folder of results: it stays there.
pub(crate) fn is_fit_of(output: &Path, params: Option<&Path>) -> bool {
    params.is_some_and(|params| is_one(params, &output.join(folder::FIT)))
}

/// Whether the result in a folder is that of an inspection, whose fit.json belongs to it. A measurement has a report as
/// well; a fit.json beside that is the user's.
pub(crate) fn is_inspection(output: &Path) -> bool {
    let Ok(text) = files::read(&output.join(folder::FIGURES)) else { return true };
    let figures: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    // Files without a command are from before measurements had reports.
    let Some(command) = figures["provenance"]["command"].as_array() else { return true };
    command.iter().filter_map(|word| word.as_str()).any(|word| word == "inspect" || word.starts_with(":inspect"))
}

/// Puts a result into its place, and says where it is. `kept` is a file of the folder that the run has read; `first` is
/// the file to open first.
pub(crate) fn finish(folder: ResultFolder, output: &Path, kept: Option<&str>, first: &str) -> Result<(), CommandError> {
    let count = std::fs::read_dir(folder.path()).map_or(0, Iterator::count);
    folder.finish(kept).map_err(CommandError::failed)?;
    wrote_files(output, first, count);
    Ok(())
}

/// The format of an output that --format gives, or else the ending of its name, by `of`. `known` names the endings for
/// the message.
pub(crate) fn format_of<F>(
    path: &Path,
    given: Option<F>,
    of: impl Fn(&Path) -> Option<F>,
    known: &str,
) -> Result<F, CommandError> {
    if is_stream(path) && given.is_none() {
        return Err(CommandError::usage("-o -: standard output has no name that says the format; add --format ply"));
    }
    let unknown = || CommandError::usage(format!("-o {}: the file name must end in {known}", path.display()));
    given.or_else(|| of(path)).ok_or_else(unknown)
}

/// Writes a scan or a mesh, creating the folder that it is in.
pub(crate) fn write_scan(path: &Path, scan: &Recorded<'_>, format: ScanFormat) -> Result<(), CommandError> {
    if is_stream(path) {
        return write(path, &export::to_bytes(scan, format).map_err(CommandError::failed)?);
    }
    make_parent(path)?;
    export::write(path, scan, format).map_err(CommandError::failed)?;
    wrote(path);
    Ok(())
}

/// Says where a file was written. Of standard output the reader knows.
pub(crate) fn wrote(path: &Path) {
    if !is_stream(path) {
        note!("wrote {}", path.display());
    }
}

/// Says where several files were written, of which `first` is the one to open first.
pub(crate) fn wrote_files(folder: &Path, first: &str, count: usize) {
    let folder = folder.display().to_string();
    let folder = folder.trim_end_matches('/');
    match count.saturating_sub(1) {
        0 => note!("wrote {folder}/{first}"),
        1 => note!("wrote {folder}/: {first} and another file"),
        others => note!("wrote {folder}/: {first} and {others} other files"),
    }
}

/// An error of a file in a folder of results, which names the file where the user would look for it.
pub(crate) fn failed(folder: &ResultFolder, error: DocumentError) -> CommandError {
    match error {
        DocumentError::Write(error) => failed_write(folder, error),
        error => CommandError::failed(error),
    }
}

/// The same of one file.
pub(crate) fn failed_write(folder: &ResultFolder, error: WriteError) -> CommandError {
    unwritable(folder.place(error))
}

/// Nothing of what is written there can be, such as on a full disk.
pub(crate) fn unwritable(error: WriteError) -> CommandError {
    CommandError::Unwritable(error.to_string())
}

/// The files that a command reads, of which some may not have been given.
pub(crate) fn inputs<'a>(
    given: impl IntoIterator<Item = &'a PathBuf>,
    optional: Option<&'a PathBuf>,
) -> impl Iterator<Item = &'a Path> {
    given.into_iter().chain(optional).map(PathBuf::as_path)
}
