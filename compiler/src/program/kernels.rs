//! A model's functions as machine code.

use super::derivatives::{ModelFunctions, PartFunctions};
use crate::ir::FunctionId;
use crate::jit::{Code, Compiler, JitError, Kernel, KernelShape, Listing, Options, Output, Routine};

/// Machine code of a model.
pub(super) struct Kernels {
    pub(super) code: Code,
    pub(super) bounds: Routine,
    pub(super) requires: Vec<Routine>,
    pub(super) prelude: Routine,
    pub(super) slopes: Routine,
    pub(super) parts: Vec<PartKernels>,
}

/// Machine code of a part, as in [`PartFunctions`].
#[derive(Clone, Copy)]
pub(super) struct PartKernels {
    pub(super) points: Kernel,
    pub(super) partials: Kernel,
    pub(super) second_partials: Kernel,
    pub(super) jacobian: Kernel,
    pub(super) pullback: Kernel,
}

impl Kernels {
    pub(super) fn new(functions: &ModelFunctions) -> Result<Kernels, JitError> {
        Kernels::with_listings(functions, false).map(|(kernels, _)| kernels)
    }

    /// The texts of everything that a program consists of.
    pub(super) fn listings(functions: &ModelFunctions) -> Result<Vec<Listing>, JitError> {
        Kernels::with_listings(functions, true).map(|(_, listings)| listings)
    }

    fn with_listings(functions: &ModelFunctions, listings: bool) -> Result<(Kernels, Vec<Listing>), JitError> {
        let options = Options { verify: cfg!(test), listings, quick: false };
        let mut compiler = Compiler::new(&functions.module, options)?;
        let bounds = compiler.routine(functions.bounds)?;
        let requires = functions.requires.iter().map(|r| compiler.routine(r.function)).collect::<Result<_, _>>()?;
        let prelude = compiler.routine(functions.prelude)?;
        let slopes = compiler.routine(functions.slopes)?;
        let parts = functions.parts.iter().map(|p| PartKernels::new(&mut compiler, p)).collect::<Result<_, _>>()?;
        let listings = compiler.listings().to_vec();
        Ok((Kernels { code: compiler.finish()?, bounds, requires, prelude, slopes, parts }, listings))
    }
}

impl PartKernels {
    fn new(compiler: &mut Compiler<'_>, part: &PartFunctions) -> Result<PartKernels, JitError> {
        let captures = part.captures.len();
        let mut stored = |function: FunctionId, uniforms: usize| {
            compiler.kernel(KernelShape { function, uniforms, weights: false, output: Output::Store })
        };
        Ok(PartKernels {
            points: stored(part.points, captures)?,
            partials: stored(part.partials, captures)?,
            second_partials: stored(part.second_partials, captures)?,
            jacobian: stored(part.jacobian, captures + part.jacobian_slopes.len())?,
            pullback: compiler.kernel(KernelShape {
                function: part.pullback,
                uniforms: captures,
                weights: true,
                output: Output::Accumulate,
            })?,
        })
    }
}
