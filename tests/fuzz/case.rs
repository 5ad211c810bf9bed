//! A case: files, the arguments of a command, and its standard input.

use crate::process::{self, Ended};
use crate::verdict;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use tempfile::tempdir;

/// Files by their names.
pub(crate) type Files = BTreeMap<String, Vec<u8>>;

/// The model of all cases that have no other. Its fits take less than a second.
pub(crate) const BALL: &str = "use std.surface (sphere)
model ball {
  input n: int in 1..3 = 1
  param r: length in 5mm..50mm = 20mm
  param flat: real in 0.5..1.5 = 1
  measure width = 2 * r
  part p tolerance 1mm = sphere(r * n / n).scale(z: flat)
}
";

/// Files that lie in the folder of every case, beside the case's own.
pub(crate) struct Base {
    pub(crate) files: Files,
}

impl Base {
    pub(crate) fn new() -> Base {
        let folder = tempdir().expect("a folder");
        let at = folder.path();
        fs::write(at.join("ball.gml"), BALL).expect("written");
        for args in [
            &["scan", "ball.gml", "--spacing", "6mm", "--no-pose", "-o", "scan.ply"][..],
            &["fit", "ball.gml", "scan.ply", "-o", "fit.json"],
        ] {
            let args: Vec<String> = args.iter().map(|a| (*a).to_owned()).collect();
            let ended = process::run(at, &args, &[], false);
            assert!(ended.status == Some(0), "gmlc {args:?}: {}", ended.error);
        }
        Base { files: files_of(at) }
    }
}

/// All files directly in a folder.
pub(crate) fn files_of(folder: &Path) -> Files {
    let entries = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let paths = entries.map(|e| e.expect("an entry").path()).filter(|p| p.is_file());
    let named = |p: std::path::PathBuf| {
        let name = p.file_name().unwrap_or_default().to_string_lossy().into_owned();
        (name, fs::read(&p).unwrap_or_default())
    };
    paths.map(named).collect()
}

#[derive(Clone, Default)]
pub(crate) struct Case {
    /// The files that were damaged.
    pub(crate) files: Files,
    pub(crate) args: Vec<String>,
    pub(crate) input: Vec<u8>,
    /// A command that must succeed after the first has.
    pub(crate) then: Vec<String>,
}

/// Names of what is no file of a case, in the folder that keeps it.
const ARGS: &str = "ARGS";
const THEN: &str = "THEN";
const INPUT: &str = "INPUT";

impl Case {
    pub(crate) fn of(args: &[&str]) -> Case {
        Case { args: args.iter().map(|a| (*a).to_owned()).collect(), ..Case::default() }
    }

    pub(crate) fn with(mut self, name: &str, content: Vec<u8>) -> Case {
        self.files.insert(name.to_owned(), content);
        self
    }

    /// Runs the case in a folder of its own.
    pub(crate) fn run(&self, base: &Base) -> Ended {
        let folder = tempdir().expect("a folder");
        let at = folder.path();
        for (name, content) in base.files.iter().chain(&self.files) {
            fs::write(at.join(name), content).expect("written");
        }
        let before = files_of(at);
        let mut ended = process::run(at, &self.args, &self.input, verdict::asks_for_work(&self.args));
        if ended.failure.is_none() {
            ended.failure = verdict::failure(self, at, &before, &ended);
        }
        if ended.failure.is_none() && ended.status == Some(0) && !self.then.is_empty() {
            let then = process::run(at, &self.then, &[], false);
            ended.failure = then.failure.or_else(|| {
                let why = || format!("then gmlc {} ends with {:?}: {}", self.then[0], then.status, then.error.trim());
                (then.status != Some(0)).then(why)
            });
        }
        ended
    }

    /// Writes the case into a folder.
    pub(crate) fn save(&self, folder: &Path) {
        fs::create_dir_all(folder).expect("a folder");
        let write = |name: &str, content: &[u8]| fs::write(folder.join(name), content).expect("written");
        self.files.iter().for_each(|(name, content)| write(name, content));
        write(ARGS, (self.args.join("\n") + "\n").as_bytes());
        if !self.then.is_empty() {
            write(THEN, (self.then.join("\n") + "\n").as_bytes());
        }
        if !self.input.is_empty() {
            write(INPUT, &self.input);
        }
    }

    /// Reads a case from a folder.
    pub(crate) fn load(folder: &Path) -> Case {
        let mut files = files_of(folder);
        let mut words = |name: &str| {
            let text = String::from_utf8(files.remove(name).unwrap_or_default()).expect("text");
            text.lines().map(str::to_owned).collect::<Vec<_>>()
        };
        let (args, then) = (words(ARGS), words(THEN));
        assert!(!args.is_empty(), "{} has the arguments of a command, one a line", folder.display());
        let input = files.remove(INPUT).unwrap_or_default();
        Case { files, args, input, then }
    }
}
