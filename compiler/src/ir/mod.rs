//! Scalar functions in SSA form with structured control flow.
//!
//! [`FunctionBuilder`] makes functions and simplifies while it does so; the passes ([`inline()`],
//! [`simplify()`]) rebuild functions through it. [`validate()`] says whether a module is well formed; [`interpret`] is the
//! oracle that every other way of running a function must agree with; [`print`] shows functions.

pub mod arithmetic;
pub mod builder;
pub mod elementary;
pub mod function;
pub mod graph;
pub mod inline;
pub mod interpret;
pub mod lower;
pub mod lowered;
pub mod magnitude;
pub mod merge;
pub mod operands;
pub mod print;
pub mod products;
pub mod regroup;
pub mod scalar;
pub mod separate;
pub mod simplify;
pub mod split;
pub mod stages;
pub mod validate;

mod algebra;
mod dce;
mod facts;
pub(crate) mod hash;
mod logic;
mod powers;

#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;

pub use builder::FunctionBuilder;
pub use function::*;
pub use inline::inline;
pub use lowered::{LoweredModel, LoweredPart, LoweredRequire};
pub use simplify::simplify;
pub use validate::validate;
