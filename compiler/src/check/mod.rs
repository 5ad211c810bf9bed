//! Names, types, dimensions and instantiation: the syntax tree to a typed tree without generics.

pub mod typed;
pub mod types;
