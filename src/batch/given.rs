//! Which files a batch is of: scans, those in folders, those of patterns, and those that lists name.

use crate::error::CommandError;
use crate::files::{self, folder_of};
use gml_runtime::scan::{Named, named};
use std::cmp::Ordering;
use std::path::{Path, PathBuf};

/// The files in the order in which they were given; those of folders and patterns in the order of their names, numbers
/// in these by their size. A file is there once, however often it was named.
pub(super) fn scans(given: &[PathBuf], lists: &[PathBuf], output: &Path) -> Result<Vec<PathBuf>, CommandError> {
    let mut found = Vec::new();
    for path in given {
        found.extend(of_word(Path::new(""), path)?);
    }
    for list in lists {
        found.extend(of_list(list)?);
    }
    let real = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let results = real(output);
    let mut known = std::collections::HashSet::new();
    found.retain(|path| known.insert(real(path)));
    if let Some(inside) = found.iter().find(|path| real(folder_of(path)) == results) {
        return Err(CommandError::usage(format!(
            "{}: the results would lie among the scans; name another folder (-o)",
            inside.display()
        )));
    }
    if found.is_empty() {
        return Err(CommandError::usage("no scans are given"));
    }
    Ok(found)
}

/// The scans that a word means, relative to a folder.
fn of_word(folder: &Path, word: impl AsRef<Path>) -> Result<Vec<PathBuf>, CommandError> {
    let path = folder.join(&word);
    if path.is_dir() {
        return of_folder(&path);
    }
    let text = word.as_ref().to_string_lossy();
    if path.exists() || !text.contains(['*', '?', '[']) {
        // One that is not there is a scan without a result: the others are done.
        return Ok(vec![path]);
    }
    let failed = |what: String| CommandError::usage(format!("{text}: {what}"));
    // Characters of patterns in the folder's own name are meant as they stand.
    let pattern = Path::new(&glob::Pattern::escape(&folder.to_string_lossy())).join(&*text);
    let matches = glob::glob(&pattern.to_string_lossy()).map_err(|e| failed(format!("is no pattern: {}", e.msg)))?;
    let mut found: Vec<PathBuf> = matches.flatten().filter(|path| path.is_file()).collect();
    if found.is_empty() {
        return Err(failed("no file has a name of this pattern".to_owned()));
    }
    found.sort_by(|a, b| by_name(a, b));
    Ok(found)
}

/// The files of a folder whose names end as those of scans do; tables in texts only where there are no others.
fn of_folder(folder: &Path) -> Result<Vec<PathBuf>, CommandError> {
    let shown = folder.display();
    let entries =
        std::fs::read_dir(folder).map_err(|e| CommandError::Failed(format!("{shown}: {}", files::reason(&e))))?;
    // What is hidden is other programs' (`._scan.ply`); a link to nothing is a scan that is not there.
    let is_hidden = |path: &Path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    let is_file = |path: &PathBuf| !is_hidden(path) && (path.is_file() || path.is_symlink() && !path.exists());
    let all: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(is_file).collect();
    let of = |kind: Named| all.iter().filter(|path| named(path) == kind).cloned().collect::<Vec<PathBuf>>();
    // Among scans, texts are notes and lists.
    let (scans, texts) = (of(Named::Scan), of(Named::Text));
    if !scans.is_empty() && !texts.is_empty() {
        let beside = texts.len();
        note!(
            "{shown}: {beside} texts beside the scans are left out; name them one by one or by a pattern if they are scans"
        );
    }
    let mut found = if scans.is_empty() { texts } else { scans };
    if found.is_empty() {
        return Err(CommandError::usage(format!("{shown}: no file in this folder has the ending of a scan")));
    }
    found.sort_by(|a, b| by_name(a, b));
    Ok(found)
}

/// The scans that a text names, a line each as a word of the command line, relative to the text's folder.
fn of_list(list: &Path) -> Result<Vec<PathBuf>, CommandError> {
    let text = files::read(list)?;
    let folder = folder_of(list);
    let mut found = Vec::new();
    for (n, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let word = without_comment(line, folder);
        if !word.is_empty() {
            let at = |e: CommandError| CommandError::usage(format!("{}:{}: {}", list.display(), n + 1, e.reason()));
            found.extend(of_word(folder, word).map_err(at)?);
        }
    }
    Ok(found)
}

/// A line without its comment, from `#` at its beginning or behind a space, unless a file has the line as its name.
fn without_comment<'a>(line: &'a str, folder: &Path) -> &'a str {
    let line = line.trim();
    let comment =
        line.match_indices('#').find(|(at, _)| line[..*at].chars().next_back().is_none_or(char::is_whitespace));
    match comment {
        Some((at, _)) if at == 0 || !folder.join(line).exists() => line[..at].trim_end(),
        _ => line,
    }
}

/// The order of names for people: `scan_9` before `scan_10`.
fn by_name(a: &Path, b: &Path) -> Ordering {
    let pieces = |path: &Path| pieces(&path.to_string_lossy());
    pieces(a).cmp(&pieces(b)).then_with(|| a.cmp(b))
}

/// A name as texts and numbers in turn. Numbers are compared by their length, without leading zeros, before their
/// digits.
fn pieces(name: &str) -> Vec<(String, usize, String)> {
    let mut pieces = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let digits = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        let (text, tail) = rest.split_at(digits);
        let end = tail.find(|c: char| !c.is_ascii_digit()).unwrap_or(tail.len());
        let (number, tail) = tail.split_at(end);
        let number = number.trim_start_matches('0');
        pieces.push((text.to_owned(), number.len(), number.to_owned()));
        rest = tail;
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_count_by_their_size() {
        let mut names: Vec<PathBuf> =
            ["s10.ply", "s9.ply", "s009b.ply", "a2_10", "a2_9", "s.ply"].map(PathBuf::from).to_vec();
        names.sort_by(|a, b| by_name(a, b));
        let names: Vec<String> = names.iter().map(|n| n.display().to_string()).collect();
        assert_eq!(names, ["a2_9", "a2_10", "s9.ply", "s009b.ply", "s10.ply", "s.ply"]);
    }

    #[test]
    fn folders_patterns_and_lists_are_files_once() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["b2.ply", "b10.ply", "notes.txt.bak", "c.xyz"] {
            std::fs::write(at(name), "x").unwrap();
        }
        std::fs::write(at("list.txt.names"), "# these\nb10.ply # the second\n\nabsent.ply\n").unwrap();
        std::fs::create_dir(at("day [1]")).unwrap();
        std::fs::write(at("day [1]/e #1.ply"), "x").unwrap();
        std::fs::write(at("day [1]/list.names"), "e #1.ply\n  ../b?.ply  \n../day [1] # all\n").unwrap();
        std::fs::write(at("wrong.names"), "c.xyz\n\nz*.ply\n").unwrap();
        let names = |found: Vec<PathBuf>| -> Vec<String> {
            found.iter().map(|p| p.file_name().unwrap().to_string_lossy().into_owned()).collect()
        };
        let out = at("out");
        let all = scans(&[folder.path().to_owned()], &[], &out).unwrap();
        assert_eq!(names(all), ["b2.ply", "b10.ply", "c.xyz"]);
        let some = scans(&[at("c.xyz"), at("b*.ply")], &[at("list.txt.names")], &out).unwrap();
        assert_eq!(names(some), ["c.xyz", "b2.ply", "b10.ply", "absent.ply"]);
        let relative = scans(&[], &[at("day [1]/list.names")], &out).unwrap();
        assert_eq!(names(relative), ["e #1.ply", "b2.ply"]);
        let wrong = scans(&[], &[at("wrong.names")], &out).unwrap_err().reason();
        assert!(wrong.ends_with("wrong.names:3: z*.ply: no file has a name of this pattern"), "{wrong}");
        assert!(scans(&[at("z*.ply")], &[], &out).unwrap_err().reason().contains("no file has a name"));
        assert!(
            scans(&[folder.path().to_owned()], &[], folder.path()).unwrap_err().reason().contains("among the scans")
        );
    }
}
