//! A model's functions as machine code.

use super::derivatives::ModelFunctions;
use crate::ir::FunctionId;
use crate::ir::hash::HashMap;
use crate::jit::{Code, Compiler, JitError, Kernel, KernelShape, Listing, Options, Output, Routine};

/// How code is made: tests let Cranelift verify its input.
pub(super) const OPTIONS: Options = Options { verify: cfg!(test), listings: false, quick: false, narrow: false };

/// Machine code of a model, but for what is made on demand.
pub(super) struct Kernels {
    pub(super) code: Code,
    pub(super) bounds: Routine,
    pub(super) requires: Vec<Routine>,
    pub(super) prelude: Routine,
    pub(super) slopes: Routine,
    /// Of each body.
    pub(super) points: Vec<Kernel>,
    /// Of each part.
    pub(super) jacobians: Vec<Kernel>,
}

impl Kernels {
    pub(super) fn new(functions: &ModelFunctions) -> Result<Kernels, JitError> {
        Kernels::with_listings(functions, OPTIONS).map(|(kernels, _)| kernels)
    }

    /// The texts of everything that is compiled in any case.
    pub(super) fn listings(functions: &ModelFunctions) -> Result<Vec<Listing>, JitError> {
        Kernels::with_listings(functions, Options { listings: true, ..OPTIONS }).map(|(_, listings)| listings)
    }

    fn with_listings(functions: &ModelFunctions, options: Options) -> Result<(Kernels, Vec<Listing>), JitError> {
        let mut compiler = Compiler::new(&functions.module, options)?;
        let stored = |compiler: &mut Compiler<'_>, function: FunctionId, uniforms: usize| {
            compiler.kernel(KernelShape { function, uniforms, weights: 0, output: Output::Store })
        };
        // Kernels first: functions that they share with routines are compiled to run fast.
        let bodies = functions.bodies.iter();
        let points = bodies.map(|b| stored(&mut compiler, b.points, b.captures)).collect::<Result<_, _>>()?;
        let mut known: HashMap<FunctionId, Kernel> = HashMap::default();
        let mut jacobians = Vec::new();
        for part in &functions.parts {
            let kernel = match known.get(&part.jacobian) {
                Some(kernel) => *kernel,
                None => stored(&mut compiler, part.jacobian, part.captures.len() + part.jacobian_slopes.len())?,
            };
            known.insert(part.jacobian, kernel);
            jacobians.push(kernel);
        }
        let bounds = compiler.routine(functions.bounds)?;
        let requires = functions.requires.iter().map(|r| compiler.routine(r.function)).collect::<Result<_, _>>()?;
        let prelude = compiler.routine(functions.prelude)?;
        let slopes = compiler.routine(functions.slopes)?;
        let listings = compiler.listings().to_vec();
        Ok((Kernels { code: compiler.finish()?, bounds, requires, prelude, slopes, points, jacobians }, listings))
    }
}
