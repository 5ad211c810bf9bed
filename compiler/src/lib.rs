//! The .gml compiler: text in, [`Program`] out.
//!
//! # Example
//!
//! A script, points of its surface, and their derivatives by the parameters:
//!
//! ```
//! use gml_compiler::{NoFiles, Options, Order, Sites, SourceFile, compile};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let text = "
//!     model cone {
//!         param r: length in 1mm..50mm = 10mm
//!         param h: length in 1mm..90mm = 30mm
//!         part side = |u, v| (r * (1 - v) * cos(u * 360deg), r * (1 - v) * sin(u * 360deg), h * v)
//!     }";
//! let script = SourceFile { name: "cone.gml".to_owned(), text: text.to_owned() };
//! let program = compile(script, &NoFiles, &Options::default())?.program;
//! assert_eq!(program.parameters()[0].name, "r");
//!
//! let cone = program.instantiate(&[20.0, 40.0])?;
//! let sites = Sites::Scattered(&[0.0, 0.0], &[0.0, 0.5]);
//! let mut points = [0.0; 6];
//! cone.evaluate(0, sites, Order::Points, &mut points)?;
//! assert_eq!(points, [20.0, 0.0, 0.0, 10.0, 0.0, 20.0]);
//!
//! // For each point d(x, y, z)/dr and d(x, y, z)/dh.
//! let mut jacobian = [0.0; 12];
//! cone.evaluate(0, sites, Order::Jacobian, &mut jacobian)?;
//! assert_eq!(jacobian, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.5]);
//! # Ok(())
//! # }
//! ```
//!
//! # Stages
//!
//! A script passes through these stages, each a folder that knows only the ones before it:
//!
//! 1. [`syntax`]: text to tokens (logos) to a tree (LALRPOP). Never fails; returns diagnostics beside the tree.
//! 2. [`check`]: names, types, dimensions; generics are instantiated. The typed tree has no generics left.
//! 3. `ir`: the typed tree lowered to scalar functions in SSA form; simplified; validated; printed; interpreted.
//! 4. `diff`: tangent, Jacobian and pullback of those functions, again as functions.
//! 5. `jit`: machine code for them, by Cranelift.
//! 6. [`program`]: compiled scripts, as everything outside the compiler knows them.
//!
//! [`session`] evaluates texts that are entered one after another, by the same stages. [`format`](mod@format) lays out
//! scripts, and [`reference`](mod@reference) makes pages of doc comments.
//!
//! The crate is pure: no input or output, no threads, no clocks. Files that a script `use`s come in through
//! [`source::Loader`]; parallel work goes out to [`Workers`].

pub mod check;
pub mod diagnostic;
mod diff;
pub mod format;
mod ir;
mod jit;
pub mod number;
mod operators;
mod outline;
mod parameters;
pub mod program;
pub mod reference;
pub mod session;
pub mod source;
pub mod suggest;
pub mod syntax;
mod workers;

pub use program::{Compilation, Failed, Instance, Options, Order, Program, Sites, compile};
pub use source::{NoFiles, SourceFile};
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
            Binary, Compare, Failure, FailureId, Function, FunctionBuilder, FunctionId, LoweredMeasure, LoweredPart,
            Module, Node, Op, Parameter, ParameterFunction, Type, Unary, Value, interpret, scalar, validate,
        };

        pub mod lower {
            pub use crate::ir::lower::lower;
        }
    }
}
