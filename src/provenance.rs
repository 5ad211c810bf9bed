//! What a fit says of the script that it belongs to.

use crate::files::{self, FileLoader};
use gml_compiler::check::CheckOptions;
use gml_compiler::program::{self, Input, Program};
use gml_compiler::source::Sources;
use gml_runtime::fit::{FitResult, FittedInput};
use gml_runtime::record::hexadecimal;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::Path;

/// A script as its fits name it.
pub(crate) struct Provenance {
    script: String,
    /// Of its text and of what it uses; none for a model that was entered.
    pub(crate) sha256: Option<String>,
}

impl Provenance {
    /// The script that a program was compiled from.
    pub(crate) fn of(script: &Path, program: &Program) -> Provenance {
        Provenance { script: script.display().to_string(), sha256: Some(sha256(program.sources())) }
    }

    /// The current model of a session, which has read other texts as well, by the name of its script; or by its own,
    /// if it was entered.
    pub(crate) fn of_current(script: &Path, entered: bool, loader: &FileLoader) -> Provenance {
        let text = if entered { None } else { files::read_script(script).ok() };
        let sha256 = text.map(|text| {
            let mut sources = Sources::default();
            let main = sources.add(script.display().to_string(), text);
            // The check finds what the script uses, whatever the inputs.
            program::check(&mut sources, loader, main, &BTreeMap::new(), &CheckOptions::default());
            sha256(&sources)
        });
        Provenance { script: script.display().to_string(), sha256 }
    }

    /// The fit with its script and inputs.
    pub(crate) fn named(&self, fit: FitResult, program: &Program) -> FitResult {
        FitResult {
            script: self.script.clone(),
            script_sha256: self.sha256.clone(),
            inputs: program.inputs().iter().map(input).collect(),
            ..fit
        }
    }
}

/// An input with the value that it was compiled with.
pub(crate) fn input(input: &Input) -> FittedInput {
    let Input { name, value, quantity, .. } = input;
    FittedInput { name: name.clone(), value: *value, unit: quantity.unit().to_owned(), quantity: *quantity }
}

/// SHA-256 of a script and of what it uses, fonts among it, the standard library left out: every release of gmlc has
/// its own. Names of files do not count, as they depend on the folder that gmlc runs in; lengths keep two files from
/// passing for one.
pub(crate) fn sha256(sources: &Sources) -> String {
    let mut hash = Sha256::new();
    for file in sources.scripts() {
        hash.update((file.text.len() as u64).to_le_bytes());
        hash.update(file.text.as_bytes());
    }
    for font in sources.fonts() {
        hash.update((font.bytes.len() as u64).to_le_bytes());
        hash.update(&font.bytes);
    }
    hexadecimal(hash.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_is_of_texts_and_of_where_they_end() {
        let sum = |texts: &[(&str, &str)]| {
            let mut sources = Sources::default();
            texts.iter().for_each(|(name, text)| _ = sources.add(*name, *text));
            sha256(&sources)
        };
        // `printf '\003\0\0\0\0\0\0\0abc' | sha256sum`
        let abc = "ce91dc5eec0139adf091900d225971d6ad246a845bad791b5693a9d0d55dd391";
        assert_eq!(sum(&[("a.gml", "abc")]), abc);
        assert_eq!(sum(&[("folder/a.gml", "abc")]), abc, "the name does not count");
        assert_ne!(sum(&[("a.gml", "ab"), ("b.gml", "c")]), sum(&[("a.gml", "a"), ("b.gml", "bc")]));
    }
}
