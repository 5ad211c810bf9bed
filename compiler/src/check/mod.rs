//! Names, types, dimensions and instantiation: the syntax tree to a typed tree without generics.
//!
//! Types are inferred forwards: the type of an expression follows from those of its parts. A function has no type of
//! its own; each call instantiates its body for the types of the arguments, once for each combination. A closure's type
//! is the place where it was written and the types of what it captured, so that every call is resolved here. Ints and
//! bools that are known now (literals, inputs, the bounds of ranges) are carried in their types: `if` on a known
//! condition checks only the side taken, `for` over a known range is unrolled, and recursion on a known int ends here.
//!
//! In reading order: [`types`] and [`typed`] are what comes out; `modules` finds the files; `context` is the state;
//! `expressions` dispatches on the kind of expression; `instantiate` makes function instances; `model` does the body of
//! a model; `finish` numbers what is used.

mod activity;
mod annotations;
mod bindings;
pub(crate) mod builtins;
mod calls;
mod comparisons;
mod constants;
mod context;
mod convert;
mod custom_derivatives;
mod derivatives;
mod describe;
mod edges;
pub(crate) mod entered;
mod expressions;
mod figures;
pub(crate) mod files;
mod finish;
mod fonts;
mod foreign;
pub(crate) mod free;
mod inputs;
mod instantiate;
mod iteration;
mod lints;
mod measures;
mod model;
pub(crate) mod modules;
mod names;
mod operators;
mod outlines;
mod params;
mod parts;
mod paths;
mod print;
mod sides;
pub(crate) mod signature;
mod solids;
pub(crate) mod stdlib;
pub mod typed;
pub mod types;
mod walk;

#[cfg(test)]
mod tests;

pub use constants::Evaluate;
pub use print::print;
pub use stdlib::MODULES as STANDARD_LIBRARY;

pub(crate) use params::dimension;

use crate::diagnostic::{Code, Diagnostic, Severity};
use crate::source::{FileId, Loader, Sources};
use crate::syntax::ast::File;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// The value of an input, given from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InputValue {
    /// For an `int`; also taken for a `real`.
    Int(i64),
    /// For a `bool`.
    Bool(bool),
    /// For a `real`, or in millimetres or radians for a `length` or `angle`.
    Real(f64),
}

/// Bounds on the checker's work, so that no script exhausts the machine.
#[derive(Clone, Debug)]
pub struct CheckOptions {
    /// The name of the model to check; the last one of the file if `None`.
    pub model: Option<String>,
    /// Maximal depth of calls instantiated within one another: of recursion on known ints.
    pub depth: usize,
    /// Maximal number of function instances.
    pub instances: usize,
    /// Maximal number of iterations of a comprehension, and of elements of an array.
    pub iterations: usize,
    /// Maximal number of iterations of a `fold` that is unrolled; a longer one becomes a loop.
    pub unroll: usize,
    /// Maximal number of a model's parts.
    pub parts: usize,
    /// Maximal number of nodes of the typed tree and of the types in it.
    pub nodes: usize,
    /// Set from elsewhere to end the check with an error.
    pub interrupt: Option<Arc<AtomicBool>>,
}

impl Default for CheckOptions {
    fn default() -> CheckOptions {
        CheckOptions {
            model: None,
            depth: 400,
            instances: 20_000,
            iterations: 4096,
            unroll: 64,
            parts: 1000,
            nodes: 4_000_000,
            interrupt: None,
        }
    }
}

/// Checks the file `main` and what it uses, with its last model (or the one that the options name) as the main one.
///
/// Returns `None` where there is an error, and where the file has no model: a library is checked as far as its
/// functions have annotated parameters. Diagnostics are in the order of the source.
pub fn check(
    sources: &mut Sources,
    loader: &dyn Loader,
    main: FileId,
    inputs: &BTreeMap<String, InputValue>,
    options: &CheckOptions,
    evaluate: Evaluate,
) -> (Option<typed::Model>, Vec<Diagnostic>) {
    let (loaded, mut diagnostics) = files::load(sources, loader, main);
    let (modules, more) = modules::index(&loaded);
    diagnostics.extend(more);
    let mut checker = context::Checker::new(&modules, options, evaluate);
    let model = checker.check_main(inputs);
    diagnostics.extend(checker.into_diagnostics());
    diagnostics.iter_mut().for_each(|d| without_double_parentheses(d, sources));
    diagnostics.sort_by_key(|d| (d.span.file, d.span.start));
    let failed = diagnostics.iter().any(|d| d.severity == Severity::Error);
    if failed {
        diagnostics.retain(tells_of_errors);
    }
    (model.filter(|_| !failed), diagnostics)
}

/// Errors, and warnings that explain errors. Names that seem to be unused or missing may stand in text that could not
/// be parsed.
fn tells_of_errors(diagnostic: &Diagnostic) -> bool {
    diagnostic.severity == Severity::Error || diagnostic.code == Code::HiddenParameter
}

/// The lints of a file without errors: definitions that are never used, and functions that hide those of the library.
#[must_use]
pub fn lints(file: &File) -> Vec<Diagnostic> {
    lints::lints(&file.items)
}

/// A suggestion that puts something in parentheses leaves them out where it has some already.
fn without_double_parentheses(diagnostic: &mut Diagnostic, sources: &Sources) {
    for suggestion in &mut diagnostic.suggestions {
        let [open, close] = &mut suggestion.edits[..] else { continue };
        let inner = sources.text(open.span.to(close.span));
        if open.replacement == "(" && close.replacement.starts_with(')') && is_in_parentheses(inner) {
            open.replacement.clear();
            close.replacement.remove(0);
        }
        suggestion.edits.retain(|e| e.span.start < e.span.end || !e.replacement.is_empty());
    }
}

/// Whether the first character opens what the last closes.
fn is_in_parentheses(text: &str) -> bool {
    let mut depth = 0;
    let closes = text.char_indices().find_map(|(at, c)| {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            _ => {}
        }
        (depth == 0).then_some(at)
    });
    text.starts_with('(') && closes == Some(text.len() - 1)
}
