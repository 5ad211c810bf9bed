//! Text to tree, without types or the meaning of names.
//!
//! [`parse`] never fails: it returns a tree, and several diagnostics a file. The text passes through the lexer
//! (`lexer`), a pass that gives line ends their meaning and matches brackets (`layout`), and the grammar
//! (`grammar.lalrpop`), whose actions build the tree (`builder`). A statement that the grammar rejects is reported and
//! replaced by an error node; then the file is parsed again (`recover`). The messages say what was expected
//! (`messages`), or what to write instead of a construct of another language (`foreign`).
//!
//! No tree is deeper than [`NESTING_LIMIT`], so that everything that walks one may recurse.

pub mod ast;
mod builder;
mod characters;
mod classes;
mod depth;
mod foreign;
pub(crate) mod layout;
mod lexer;
pub(crate) mod literal;
mod messages;
mod print;
mod recover;
mod statements;
pub(crate) mod token;
mod tolerance;

#[cfg(test)]
mod tests;

pub use characters::{look_alikes, name};
pub use classes::{Class, classes};
pub(crate) use print::use_text;
pub use print::{print, type_text};
pub use recover::parse;
pub use statements::{Entry, is_incomplete, parse_entries};

use crate::source::{FileId, Span};

/// The greatest depth of a tree.
pub const NESTING_LIMIT: u32 = 200;

/// The greatest length of a file in bytes.
pub const LENGTH_LIMIT: usize = 4 << 20;

fn spanned(file: FileId, start: u32, end: u32) -> Span {
    Span { file, start, end }
}

lalrpop_util::lalrpop_mod!(
    #[allow(clippy::all, clippy::pedantic, missing_docs, unreachable_pub, unused, unreachable_patterns)]
    grammar,
    "/syntax/grammar.rs"
);
