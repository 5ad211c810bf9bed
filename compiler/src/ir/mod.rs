//! Scalar functions in SSA form with structured control flow.

pub mod arithmetic;
pub mod function;

pub use function::*;
