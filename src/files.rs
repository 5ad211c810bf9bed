//! Text files: scripts, what they use, and fits.

use crate::error::CommandError;
use gml_compiler::source::{FontFile, Loader, SourceFile};
use gml_runtime::reason::in_words;
use gml_runtime::scan::{self, Foreign};
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Component, Path, PathBuf};

/// The largest text in bytes: people write scripts, so that a larger file is probably not one.
pub(crate) const LARGEST_TEXT: u64 = 16 << 20;

/// The largest font in bytes: those with all letters of East Asia have some 20 MiB.
const LARGEST_FONT: u64 = 64 << 20;

/// Loads the scripts that scripts `use`, relative to the using script: only those in folders that are allowed, so that
/// a script from elsewhere cannot read, and quote in its messages, whatever its user may read.
#[derive(Clone, Debug, Default)]
pub(crate) struct FileLoader {
    /// Without links.
    folders: Vec<PathBuf>,
}

impl FileLoader {
    /// What a script may use: the scripts in its own folder and below, and those in the folders of `--allow-path`.
    ///
    /// # Errors
    /// If one of the latter is not there.
    pub(crate) fn of(script: &Path, allowed: &[PathBuf]) -> Result<Self, CommandError> {
        let mut loader = Self::default();
        loader.allow(folder_of(script));
        loader.allow_all(allowed)?;
        Ok(loader)
    }

    /// Allows the scripts in the folders of `--allow-path`.
    ///
    /// # Errors
    /// If one of them is not there.
    pub(crate) fn allow_all(&mut self, folders: &[PathBuf]) -> Result<(), CommandError> {
        if let Some(absent) = folders.iter().find(|folder| !folder.is_dir()) {
            let absent = absent.display();
            return Err(CommandError::usage(format!("--allow-path {absent}: there is no such folder")));
        }
        folders.iter().for_each(|folder| self.allow(folder));
        Ok(())
    }

    /// Allows the scripts in a folder and below; none where it does not exist.
    pub(crate) fn allow(&mut self, folder: &Path) {
        self.folders.extend(folder.canonicalize());
    }
}

impl FileLoader {
    /// The path of a file that a script names, if it has one of the endings and lies where it may be read.
    fn allowed(&self, path: &str, from: &str, endings: &[&str], kind: &str) -> Result<PathBuf, String> {
        let full = plain(&folder_of(Path::new(from)).join(path));
        let real = full.canonicalize().map_err(|e| format!("{}: {}", full.display(), reason(&e)))?;
        if real.is_dir() {
            return Err(format!("{}: is a folder, not a {kind}", full.display()));
        }
        if !ends_with(&full, endings) {
            return Err(format!("{}: is not a {kind}", full.display()));
        }
        // Links are followed first: what lies elsewhere is elsewhere.
        if !self.folders.iter().any(|folder| real.starts_with(folder)) {
            return Err(format!(
                "{}: is outside of the script's folder; `--allow-path {}` allows it",
                full.display(),
                folder_of(&real).display()
            ));
        }
        Ok(full)
    }
}

impl Loader for FileLoader {
    fn load(&self, path: &str, from: &str) -> Result<SourceFile, String> {
        let full = self.allowed(path, from, SCRIPT, "script (.gml)")?;
        let text = script_text(&full)?;
        Ok(SourceFile { name: full.display().to_string(), text })
    }

    fn load_font(&self, path: &str, from: &str) -> Result<FontFile, String> {
        let full = self.allowed(path, from, FONT, "font (.ttf, .otf)")?;
        let bytes = bytes(&full, LARGEST_FONT, "a font")?.into();
        Ok(FontFile { name: full.display().to_string(), bytes })
    }
}

/// The endings of scripts.
const SCRIPT: &[&str] = &["gml"];

/// The endings of fonts.
const FONT: &[&str] = &["ttf", "otf", "ttc", "otc"];

/// Whether a file is a script by its name, also at the end of a link: what a stranger's file names is read, and quoted
/// in messages, only then.
pub(crate) fn is_script(path: &Path) -> bool {
    ends_with(path, SCRIPT)
}

/// Whether a file has one of the endings, also at the end of a link.
fn ends_with(path: &Path, endings: &[&str]) -> bool {
    let named = |path: &Path| path.extension().is_some_and(|ending| endings.iter().any(|e| ending == *e));
    named(path) && path.canonicalize().is_ok_and(|real| named(&real))
}

/// The folder of a file.
pub(crate) fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|parent| *parent != Path::new("")).unwrap_or_else(|| Path::new("."))
}

/// A path without `.` and `..`, as far as its own text tells.
pub(crate) fn lexical(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match (part, plain.components().next_back()) {
            (Component::CurDir, _) => {}
            (Component::ParentDir, Some(Component::Normal(_))) => _ = plain.pop(),
            _ => plain.push(part),
        }
    }
    plain
}

/// The path without `.` and `..`, if that leads to the same file, so that a file has one name however it is used.
fn plain(path: &Path) -> PathBuf {
    let plain = lexical(path);
    // Behind a symbolic link to a folder, `..` leads elsewhere.
    match (plain.canonicalize(), path.canonicalize()) {
        (Ok(a), Ok(b)) if a == b => plain,
        (Err(_), Err(_)) => plain,
        _ => path.to_owned(),
    }
}

/// Reads a text.
pub(crate) fn read(path: &Path) -> Result<String, CommandError> {
    read_text(path).map_err(CommandError::Failed)
}

/// Reads a script: other kinds of files are named, whose text would have an error in every line.
pub(crate) fn read_script(path: &Path) -> Result<String, CommandError> {
    script_text(path).map_err(CommandError::Failed)
}

fn script_text(path: &Path) -> Result<String, String> {
    let text = read_text(path)?;
    match scan::foreign(text.as_bytes()) {
        Some(Foreign { found, fix }) => {
            let fix = fix.unwrap_or("name a script (.gml)");
            Err(format!("{}: expected a script, found {found}; {fix}", path.display()))
        }
        None => Ok(text),
    }
}

/// The text of a file of settings.
pub(crate) fn read_settings(path: &Path) -> Result<String, CommandError> {
    read_text(path).map_err(CommandError::Failed)
}

fn read_text(path: &Path) -> Result<String, String> {
    text(bytes(path, LARGEST_TEXT, "a text")?).map_err(|what| format!("{}: {what}", path.display()))
}

/// The bytes of a file of a kind, which has no more than the largest of them.
fn bytes(path: &Path, largest: u64, kind: &str) -> Result<Vec<u8>, String> {
    let failed = |e: &std::io::Error| format!("{}: {}", path.display(), reason(e));
    // Looked at before it is opened: opening a pipe waits for its writer.
    let about = std::fs::metadata(path).map_err(|e| failed(&e))?;
    if about.is_dir() {
        return Err(format!("{}: is a folder, not a file", path.display()));
    }
    if !about.is_file() {
        return Err(format!("{}: is a pipe or a device; save its contents to a file first", path.display()));
    }
    let mut bytes = Vec::new();
    // What grows while it is read has no end.
    File::open(path).and_then(|file| file.take(largest + 1).read_to_end(&mut bytes)).map_err(|e| failed(&e))?;
    if bytes.len() as u64 > largest {
        return Err(format!("{}: has more than {} MiB, too much for {kind}", path.display(), largest >> 20));
    }
    Ok(bytes)
}

/// The text of a file's bytes. A byte-order mark of UTF-8 stays: places in the text are places in the file.
pub(crate) fn text(bytes: Vec<u8>) -> Result<String, String> {
    if let [0xff, 0xfe, ..] | [0xfe, 0xff, ..] = bytes[..] {
        return Err("is a text in UTF-16; save it as UTF-8".to_owned());
    }
    String::from_utf8(bytes).map_err(|e| {
        let place = e.utf8_error().valid_up_to();
        if e.as_bytes().contains(&0) {
            format!("is not a text (byte {} is not UTF-8, and there are zeros)", place + 1)
        } else {
            format!("is not a text in UTF-8 (byte {}); save it as UTF-8", place + 1)
        }
    })
}

/// The reason of an IO error in words.
pub(crate) fn reason(e: &std::io::Error) -> String {
    match e.kind() {
        ErrorKind::NotFound => "there is no such file".into(),
        _ => in_words(e),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_utf_8() {
        assert_eq!(text(b"\xef\xbb\xbfmodel".to_vec()).unwrap(), "\u{feff}model");
        assert_eq!(text("größe".into()).unwrap(), "größe");
        assert!(text(b"\xff\xfem\0".to_vec()).unwrap_err().contains("UTF-16"));
        assert!(text(b"gr\xf6\xdfe".to_vec()).unwrap_err().contains("byte 3"));
        assert!(text(b"\x7fELF\0\xff".to_vec()).unwrap_err().contains("is not a text ("));
    }

    #[test]
    fn scripts_use_what_is_below_them() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(&path, "let a = 1").unwrap();
            path
        };
        let main = write("model/main.gml");
        let from = main.display().to_string();
        write("model/parts/knob.gml");
        write("library/shared.gml");
        write("model/notes.txt");
        let loader = FileLoader::of(&main, &[]).unwrap();
        assert!(loader.load("parts/knob.gml", &from).is_ok());
        assert!(loader.load("parts/../parts/knob.gml", &from).is_ok());
        // From a file below, the script's own folder is allowed still.
        assert!(loader.load("../main.gml", &folder.path().join("model/parts/knob.gml").display().to_string()).is_ok());
        let outside = loader.load("../library/shared.gml", &from).unwrap_err();
        assert!(outside.contains("outside of the script's folder") && outside.contains("--allow-path"), "{outside}");
        for folder in [".", "parts", "parts/.."] {
            assert!(loader.load(folder, &from).unwrap_err().contains("is a folder, not a script"), "{folder}");
        }
        assert!(loader.load("notes.txt", &from).unwrap_err().contains("not a script"));
        assert!(loader.load("/etc/passwd", &from).unwrap_err().contains("not a script"));
        let allowed = FileLoader::of(&main, &[folder.path().join("library")]).unwrap();
        assert!(FileLoader::of(&main, &[folder.path().join("absent")]).is_err());
        assert!(allowed.load("../library/shared.gml", &from).is_ok());
    }

    #[cfg(unix)]
    #[test]
    fn links_lead_nowhere_else_and_pipes_are_no_files() {
        let folder = tempfile::tempdir().unwrap();
        let main = folder.path().join("model/main.gml");
        std::fs::create_dir(folder.path().join("model")).unwrap();
        let secret = folder.path().join("secret.txt");
        std::fs::write(&secret, "password").unwrap();
        std::os::unix::fs::symlink(&secret, folder.path().join("model/link.gml")).unwrap();
        std::os::unix::fs::symlink(folder.path(), folder.path().join("model/up")).unwrap();
        std::fs::write(folder.path().join("other.gml"), "let a = 1").unwrap();
        let loader = FileLoader::of(&main, &[]).unwrap();
        let from = main.display().to_string();
        assert!(loader.load("link.gml", &from).unwrap_err().contains("not a script"));
        assert!(loader.load("up/other.gml", &from).unwrap_err().contains("outside"));
        for device in ["/dev/zero", "/dev/null"] {
            assert!(read_text(Path::new(device)).unwrap_err().contains("a pipe or a device"));
        }
    }
}
