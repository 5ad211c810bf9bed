//! Text to tree. Knows no types and no names.

pub mod ast;
