//! The standard library: .gml files that are part of the compiler.

use super::modules::is_private;
use crate::diagnostic::Diagnostic;
use crate::source::FileId;
use crate::syntax::ast::File;
use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

/// Name and text of every module. Names that do not begin with `_` are in scope everywhere, behind those that a script
/// defines or uses.
pub use gml_stdlib::MODULES;

/// The tree of a module, and what is wrong with it, which is nothing if the library's tests pass. Read once in a
/// process.
pub(super) fn parsed(index: usize) -> &'static (Arc<File>, Vec<Diagnostic>) {
    static PARSED: [OnceLock<(Arc<File>, Vec<Diagnostic>)>; MODULES.len()] = [const { OnceLock::new() }; MODULES.len()];
    PARSED[index].get_or_init(|| {
        let (file, diagnostics) = crate::syntax::parse(FileId::of_library(index), MODULES[index].1);
        (Arc::new(file), diagnostics)
    })
}

/// The names that a module of the library defines for others. Its files begin every definition at the start of a line.
pub(crate) fn names(text: &'static str) -> impl Iterator<Item = &'static str> {
    text.lines().filter_map(|line| {
        let rest = ["fn ", "let ", "model "].iter().find_map(|word| line.strip_prefix(word))?;
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_')?;
        Some(&rest[..end]).filter(|name| !is_private(name))
    })
}

/// The module that a script with a name in it needs: the one that defines it, or that a built-in function calls.
pub(super) fn needed_by(name: &str) -> Option<usize> {
    if super::edges::Blend::named(name).is_some() {
        return MODULES.iter().position(|(module, _)| *module == super::edges::MODULE);
    }
    module_of(name)
}

/// The module that defines a name for others.
pub(super) fn module_of(name: &str) -> Option<usize> {
    static INDEX: OnceLock<HashMap<&str, usize>> = OnceLock::new();
    let index = INDEX.get_or_init(|| {
        let modules = MODULES.iter().enumerate();
        modules.flat_map(|(module, (_, text))| names(text).map(move |name| (name, module))).collect()
    });
    index.get(name).copied()
}
