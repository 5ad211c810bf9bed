//! What is done with every scan of a batch, and under which name.

use crate::cli::{BatchArgs, ValueArgs};
use crate::error::CommandError;
use crate::subject::Subject;
use crate::{measure, record, script};
use gml_runtime::fit::FitOptions;
use gml_runtime::population::{CommonTexture, SCHEMA};
use gml_runtime::reason::in_words;
use gml_runtime::record::{Record, hexadecimal};
use gml_runtime::variance::{self, MeasureOptions};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Bytes of a file that are read at once.
const CHUNK: usize = 1 << 20;

/// What is done with every scan.
pub(crate) struct Plan<'a> {
    pub(crate) args: &'a BatchArgs,
    pub(crate) subject: Arc<Subject>,
    pub(crate) fit_options: FitOptions,
    pub(crate) measure_options: MeasureOptions,
    /// The record of the batch; that of a scan has its file besides.
    pub(crate) record: Record,
    /// The values that stand for all objects: where fits begin.
    pub(crate) start: Vec<f64>,
    /// The texture that all objects share, laid out there.
    pub(crate) texture: Arc<CommonTexture>,
    /// SHA-256 of all that a result follows from but for the scan.
    settings: String,
}

/// A scan of a batch.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Scan {
    /// The file as it was given.
    pub(crate) path: PathBuf,
    /// The name of its folder in the results.
    pub(crate) name: String,
    /// SHA-256 of the file; or why it cannot be read.
    pub(crate) sha256: Result<String, String>,
    /// SHA-256 of all that its result follows from.
    pub(crate) key: String,
    /// An earlier scan with the same content.
    pub(crate) copy_of: Option<String>,
}

impl<'a> Plan<'a> {
    /// Compiles the script, and reads options before any work is done.
    pub(crate) fn new(args: &'a BatchArgs, record: Record) -> Result<Self, CommandError> {
        // Options that are wrong are told before the script is compiled.
        measure::options(&args.variance)?;
        let subject = Subject::compiled(&args.script, args.params.as_deref(), &[], &args.fit)?;
        let mut record = record;
        record::add_inputs(&mut record, &[], &subject.program, args.params.as_deref());
        let texture = Self::texture_of(args, &subject)?;
        Self::of(args, Arc::new(subject), texture, record)
    }

    /// The texture that all objects share.
    pub(crate) fn texture_of(args: &BatchArgs, subject: &Subject) -> Result<Arc<CommonTexture>, CommandError> {
        let start = start(args, subject)?;
        let texture = CommonTexture::of(&subject.program, &start, args.variance.resolution);
        let failed = |error| CommandError::Failed(format!("the model where fits begin: {error}"));
        texture.map(Arc::new).map_err(failed)
    }

    /// The plan for a script that is compiled; the record has all files but the scans.
    pub(crate) fn of(
        args: &'a BatchArgs,
        subject: Arc<Subject>,
        texture: Arc<CommonTexture>,
        record: Record,
    ) -> Result<Self, CommandError> {
        let mut measure_options = measure::options(&args.variance)?;
        let fit_options = subject.options(&args.fit, &subject.program)?;
        let parts: Vec<String> = subject.program.parts().iter().map(|part| part.name.clone()).collect();
        variance::require_datum(measure_options.datum.as_deref(), &parts, |_| true)?;
        measure_options.atlas = Some(texture.atlas.clone());
        let (settings, start) = (settings(&record, &subject), start(args, &subject)?);
        Ok(Self { args, subject, fit_options, measure_options, record, start, texture, settings })
    }

    /// The scans with their names and keys.
    pub(crate) fn scans(&self, paths: &[PathBuf]) -> Result<Vec<Scan>, CommandError> {
        let names = names(paths);
        let mut known: HashMap<String, String> = HashMap::new();
        let mut scans = Vec::with_capacity(paths.len());
        let sums: Vec<Result<String, String>> = paths.par_iter().map(|path| sum(path)).collect();
        for ((path, name), sha256) in paths.iter().zip(names).zip(sums) {
            let key = self.key(sha256.as_deref().unwrap_or_default());
            let copy_of = sha256.as_ref().ok().and_then(|sum| known.get(sum)).cloned();
            if let (Ok(sum), None) = (&sha256, &copy_of) {
                known.insert(sum.clone(), path.display().to_string());
            }
            scans.push(Scan { path: path.clone(), name, sha256, key, copy_of });
        }
        Ok(scans)
    }

    /// The key of a scan with this sum.
    fn key(&self, scan: &str) -> String {
        hexadecimal(Sha256::digest(format!("{} {scan}", self.settings)))
    }
}

/// The values where fits begin.
fn start(args: &BatchArgs, subject: &Subject) -> Result<Vec<f64>, CommandError> {
    let values = ValueArgs { values: args.fit.values.clone(), params: None };
    script::values_for(&subject.program, subject.saved.as_ref(), &values)
}

/// The sum of all that results follow from besides scans. Lengths keep two texts from passing for one.
fn settings(record: &Record, subject: &Subject) -> String {
    let mut hash = Sha256::new();
    let mut add = |text: &str| {
        hash.update((text.len() as u64).to_le_bytes());
        hash.update(text.as_bytes());
    };
    add(&format!("schema {SCHEMA}"));
    add(&record.tool);
    add(subject.provenance.sha256.as_deref().unwrap_or_default());
    for setting in &record.settings {
        add(&setting.name);
        setting.values.iter().for_each(|value| add(value));
    }
    for file in record.files.iter().filter(|file| file.role == "fit") {
        add(&file.sha256);
    }
    for field in &record.fields {
        add(&field.name);
        add(&field.value);
    }
    hexadecimal(hash.finalize())
}

/// SHA-256 of a file, or why it cannot be read.
fn sum(path: &Path) -> Result<String, String> {
    let failed = |e: &io::Error| match e.kind() {
        io::ErrorKind::NotFound => "there is no such file".to_owned(),
        _ => in_words(e),
    };
    let about = std::fs::metadata(path).map_err(|e| failed(&e))?;
    if !about.is_file() {
        return Err("is not a file".to_owned());
    }
    let mut file = File::open(path).map_err(|e| failed(&e))?;
    let (mut hash, mut chunk) = (Sha256::new(), vec![0; CHUNK]);
    loop {
        match file.read(&mut chunk) {
            Ok(0) => return Ok(hexadecimal(hash.finalize())),
            Ok(n) => hash.update(&chunk[..n]),
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(failed(&e)),
        }
    }
}

/// Names of folders: those of the files without their endings; where several have one, with those of their folders
/// before them, and with a number where that is not enough.
fn names(paths: &[PathBuf]) -> Vec<String> {
    let simple: Vec<String> = paths.iter().map(|path| stem(path)).collect();
    // File systems may not tell capitals from others.
    let count = |names: &[String]| {
        let mut counts: HashMap<String, usize> = HashMap::new();
        names.iter().for_each(|name| *counts.entry(name.to_lowercase()).or_default() += 1);
        counts
    };
    let simple_counts = count(&simple);
    let longer = |(path, name): (&PathBuf, &String)| {
        let folder = path.parent().and_then(Path::file_name).map(|folder| plain(&folder.to_string_lossy()));
        match folder.filter(|_| simple_counts[&name.to_lowercase()] > 1) {
            Some(folder) => format!("{folder}-{name}"),
            None => name.clone(),
        }
    };
    let names: Vec<String> = paths.iter().zip(&simple).map(longer).collect();
    let counts = count(&names);
    let mut seen: HashMap<String, usize> = HashMap::new();
    let numbered = |name: &String| {
        let low = name.to_lowercase();
        let n = seen.entry(low.clone()).or_default();
        *n += 1;
        if counts[&low] > 1 { format!("{name}~{n}") } else { name.clone() }
    };
    names.iter().map(numbered).collect()
}

/// The name of a file without its endings, `.gz` among them.
fn stem(path: &Path) -> String {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    plain(if stem.is_empty() { name } else { stem })
}

/// The most bytes of a name's plain text: two of them, as of a folder and a file, are a name that file systems take, of
/// 255 bytes.
const NAME_BYTES: usize = 120;

/// A name that all file systems take, and that is no hidden file.
fn plain(name: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_+.,() ".contains(c);
    let plain: String = name.chars().map(|c| if is_plain(c) { c } else { '_' }).collect();
    let plain = plain[..plain.floor_char_boundary(NAME_BYTES)].trim().trim_start_matches('.').trim_end_matches('.');
    if plain.is_empty() { "scan".to_owned() } else { plain.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scan_has_a_name_of_its_own() {
        let paths =
            ["a/x.ply", "b/x.ply", "a/y.xyz.gz", "b/Y.las", "c/z.ply", ".ply", "q/we:ird*.ply", "d/k.ply", "d/k.xyz"];
        let names = names(&paths.map(PathBuf::from));
        assert_eq!(names, ["a-x", "b-x", "a-y", "b-Y", "z", "ply", "we_ird_", "d-k~1", "d-k~2"]);
        assert_eq!(stem(Path::new("scans/part.xyz.gz")), "part");
        assert_eq!(plain(&"器".repeat(100)).len(), NAME_BYTES);
    }
}
