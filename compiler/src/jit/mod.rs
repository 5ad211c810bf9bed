//! Machine code for IR functions, by Cranelift.
//!
//! [`Code::compile`] takes functions of one IR module, as plain routines or as kernels that loop over a batch of
//! surface points, two at once where they can. A [`Code`] owns its machine code and frees it when dropped.
//!
//! Generated code never faults and never writes but to its results: every call returns a status. Loops and calls count
//! against the budget of [`Limits`]; calls also against a depth and against the stack in use; integer divisions are
//! guarded; conversions saturate. What an operation computes is what [`arithmetic`](crate::ir::arithmetic) says, bit
//! for bit: elementary functions are called, for one number or a pair, and the rest are the IEEE operations that it
//! uses.

mod code;
mod compiler;
mod context;
mod control;
mod host;
mod kernel;
mod libcalls;
mod lower;
mod memory;
mod pair;
mod pieces;
mod plan;
mod vector;

#[cfg(test)]
mod tests;

pub use code::{Code, Points, Stopped};
pub use compiler::{JitError, KernelShape, Listing, Options, Output};
pub use context::{Limits, Trap};
