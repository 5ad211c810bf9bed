//! Scalar functions in SSA form with structured control flow.
//!
//! [`lower`] makes them from the typed tree. [`FunctionBuilder`] builds functions and simplifies on the way; every pass
//! rebuilds functions through it:
//!
//! | pass | purpose |
//! |---|---|
//! | [`inline()`] | replaces calls by the functions called |
//! | [`simplify()`] | value numbering, algebraic rules, specialised branches and loops, dead code |
//! | [`reassociate`] | combines operands first that depend on the same coordinates |
//! | [`separable`] | points as sums of products of a value of the row and a value of the column |
//! | [`hoist`] | moves invariant values out of loops: to the prelude, to rows and columns, before loops |
//! | [`merge`] | makes one of equal functions and of bodies that differ in constants |
//! | [`decisions`] | signatures of the branches that are taken, for those who look for corners and jumps |
//!
//! [`validate()`] says whether a module is well formed; [`interpret`] is the oracle with which every other way of
//! running a function must agree; [`print`] shows functions.

pub(crate) mod arithmetic;
pub(crate) mod builder;
pub(crate) mod call_graph;
pub(crate) mod decisions;
pub(crate) mod elementary;
pub(crate) mod function;
pub(crate) mod hoist;
pub(crate) mod inline;
pub mod interpret;
pub(crate) mod keep;
pub(crate) mod lower;
pub(crate) mod merge;
pub(crate) mod operands;
pub(crate) mod print;
pub(crate) mod reassociate;
pub mod scalar;
pub(crate) mod separable;
pub(crate) mod simplify;
pub(crate) mod size;
pub mod validate;
pub(crate) mod worklist;

mod dce;
pub(crate) mod hash;

#[cfg(test)]
pub(crate) mod tests;

pub use crate::operators::{Binary, Compare, Unary};
pub use builder::FunctionBuilder;
pub use function::*;
pub(crate) use inline::inline;
pub use lower::model::{LoweredMeasure, LoweredPart};
pub(crate) use lower::model::{LoweredModel, Requirement};
pub(crate) use simplify::simplify;
pub(crate) use size::{SizeError, SizeLimits};
pub use validate::validate;
