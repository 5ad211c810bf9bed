//! Machine code for IR functions, by Cranelift.
//!
//! A [`Compiler`] takes functions of one IR module, as plain [`Routine`]s or as [`Kernel`]s that loop over a batch of
//! surface points, and gives a [`Code`] that owns their machine code and frees it when dropped.
//!
//! Generated code never traps and never writes but to its results: every call returns a status. Loops and calls count
//! against the budget of [`Limits`]; calls also against a depth and against the stack in use; integer divisions
//! are guarded; conversions saturate. What an operation computes is what
//! [`arithmetic`](crate::ir::arithmetic) says, bit for bit: elementary functions are called, for one number or a pair, and the
//! rest are the IEEE operations that it uses.

mod called;
mod code;
mod code_set;
mod compiler;
mod context;
mod control;
mod grid;
mod host;
mod kernel;
mod lower;
mod memory;
mod pair;
mod plan;
pub mod products;
mod vector;

#[cfg(test)]
mod tests;

pub use code::{Code, GridTables, Points, Stopped};
pub use code_set::CodeSet;
pub use compiler::{Compiler, GridKernel, JitError, Kernel, KernelShape, Listing, Options, Output, Routine};
pub use context::{Limits, Stop};
pub use grid::GridShape;
