//! Scalar functions in SSA form with structured control flow.
//!
//! [`FunctionBuilder`] makes functions and simplifies while it does so; the passes rebuild functions
//! through it.

pub mod arithmetic;
pub mod builder;
pub mod function;
pub mod lower;
pub mod lowered;
pub mod operands;
pub mod scalar;

mod algebra;
mod dce;
mod facts;
mod logic;
mod powers;

pub use builder::FunctionBuilder;
pub use function::*;
pub use lowered::{LoweredModel, LoweredPart, LoweredRequire};
