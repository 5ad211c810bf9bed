//! A compiled script.

use super::error::EmbeddedError;
use crate::cli::{CompileArgs, ScriptArgs};
use crate::error::CommandError;
use crate::files::{folder_of, lexical};
use crate::provenance::Provenance;
use crate::script;
use crate::subject::Subject;
use clap::Parser;
use gml_compiler::program::{self, Program};
use gml_compiler::source::{Loader, SourceFile};
use std::path::{Path, PathBuf};

/// A compiled script, which many threads may use at once.
pub struct Model {
    pub(super) subject: Subject,
}

#[derive(Debug, Parser)]
#[command(no_binary_name = true)]
struct CompileLine {
    #[command(flatten)]
    compile: CompileArgs,
}

impl Model {
    /// Compiles a script from a file; `words` are options of compilation, such as `--input`, `bolts=6`. Warnings are
    /// returned as text.
    ///
    /// # Errors
    /// The file cannot be read, or the script has errors.
    pub fn load(path: &Path, words: &[String]) -> Result<(Self, String), EmbeddedError> {
        let compile = super::work::parsed::<CompileLine>(words)?.compile;
        let compilation = script::compile_quietly(path, &compile)?;
        let warnings = crate::diagnostics::render(&compilation.warnings, &compilation.sources, false);
        let program = compilation.program;
        let provenance = Provenance::of(path, &program);
        let script = ScriptArgs { model: path.to_owned(), compile };
        Ok((Self { subject: Subject { script, program, provenance, saved: None } }, warnings))
    }

    /// Compiles the first of several named texts; the others are what it uses, under the names that [`Model::texts`]
    /// gives.
    ///
    /// # Errors
    /// There is no text, or the script has errors.
    pub fn from_texts(texts: &[(String, String)], words: &[String]) -> Result<(Self, String), EmbeddedError> {
        let compile = super::work::parsed::<CompileLine>(words)?.compile;
        let (subject, warnings) = compiled(texts, compile)?;
        Ok((Self { subject }, warnings))
    }

    /// The program.
    #[must_use]
    pub fn program(&self) -> &Program {
        &self.subject.program
    }

    /// The script's path.
    #[must_use]
    pub fn path(&self) -> &PathBuf {
        &self.subject.script.model
    }

    /// SHA-256 of the script and of what it uses, in hexadecimal.
    #[must_use]
    pub fn sha256(&self) -> &str {
        self.subject.provenance.sha256.as_deref().unwrap_or_default()
    }

    /// Names and texts of the script, which is the first, and of the files that it uses.
    #[must_use]
    pub fn texts(&self) -> Vec<(String, String)> {
        texts(self.program())
    }

    /// Values of all parameters: the defaults, but for those that are given as `name`, `value`.
    ///
    /// # Errors
    /// There is no such parameter, or the value is none of its kind or beyond its bounds.
    pub fn values(&self, given: &[(String, String)]) -> Result<Vec<f64>, EmbeddedError> {
        let args = crate::cli::ValueArgs { values: given.to_vec(), params: None };
        Ok(script::values_for(self.program(), None, &args)?)
    }
}

/// Names and texts of a program's scripts.
pub(super) fn texts(program: &Program) -> Vec<(String, String)> {
    program.sources().scripts().map(|file| (file.name.to_string(), file.text.to_string())).collect()
}

/// The first of several texts, compiled.
pub(super) fn subject_of_texts(texts: &[(String, String)], compile: CompileArgs) -> Result<Subject, EmbeddedError> {
    compiled(texts, compile).map(|(subject, _)| subject)
}

fn compiled(texts: &[(String, String)], compile: CompileArgs) -> Result<(Subject, String), EmbeddedError> {
    let [(name, text), ..] = texts else { return Err(EmbeddedError::failed("there is no script")) };
    let file = SourceFile { name: name.clone(), text: text.clone() };
    let options = script::options(&compile)?;
    let compilation = program::compile(file, &Texts(texts), &options).map_err(CommandError::from)?;
    let warnings = crate::diagnostics::render(&compilation.warnings, &compilation.sources, false);
    let model = PathBuf::from(name);
    // Not that of a path: a text need not lie in a file.
    let provenance = Provenance::of(&model, &compilation.program);
    let script = ScriptArgs { model, compile };
    Ok((Subject { script, program: compilation.program, provenance, saved: None }, warnings))
}

/// Scripts that were read elsewhere, by their names.
struct Texts<'a>(&'a [(String, String)]);

impl Loader for Texts<'_> {
    fn load(&self, path: &str, from: &str) -> Result<SourceFile, String> {
        let full = lexical(&folder_of(Path::new(from)).join(path));
        let found = self.0.iter().find(|(name, _)| lexical(Path::new(name)) == full);
        let missing = || format!("{}: is not among the texts of the script", full.display());
        found.map(|(name, text)| SourceFile { name: name.clone(), text: text.clone() }).ok_or_else(missing)
    }
}
