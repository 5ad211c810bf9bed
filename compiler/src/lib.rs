//! The .gml compiler: text in, [`Program`](program::Program) out.
//!
//! A script passes through these stages, each a folder that knows only the ones before it:
//!
//! 1. [`syntax`]: text to tokens (logos) to a tree (LALRPOP). Never fails; returns diagnostics beside the tree.
//! 2. [`check`]: names, types, dimensions; generics are instantiated. The typed tree has no generics left.
//! 3. `ir`: the typed tree lowered to scalar functions in SSA form; simplified; validated; printed; interpreted.
//! 4. `diff`: tangent, Jacobian and pullback of those functions, again as functions.
//! 5. `jit`: machine code for them, by Cranelift.
//! 6. [`program`]: what everything outside may know of a compiled script.
//!
//! [`session`] goes the same way with texts that are entered one after another.
//! Beside this way lie [`format`], from text to its one layout, and [`reference`], from doc comments to pages.
//!
//! The crate is pure: no input or output, no threads, no clocks. Files that a script `use`s come in through
//! [`source::Loader`]; work that can be done at once goes out to [`Workers`].

pub mod check;
pub mod diagnostic;
mod diff;
pub mod format;
mod ir;
mod jit;
mod operators;
mod parameters;
pub mod program;
pub mod reference;
pub mod session;
pub mod source;
pub mod suggest;
pub mod syntax;
mod workers;

pub use workers::Workers;

/// The stages between the typed tree and machine code, for the integration tests of this crate: not a public interface.
#[doc(hidden)]
pub mod internals {
    pub mod diff {
        pub use crate::diff::{DiffError, expand, jacobian, pullback, tangent};
    }

    pub mod jit {
        pub use crate::jit::{Code, JitError, KernelShape, Listing, Options, Output, Points, Stopped};
    }

    pub mod ir {
        pub use crate::ir::{
            Binary, Compare, Failure, FailureId, Function, FunctionBuilder, FunctionId, LoweredPart, Module, Node, Op,
            Parameter, Type, Unary, Value, interpret, scalar, validate,
        };

        pub mod lower {
            pub use crate::ir::lower::lower;
        }
    }
}
