//! A model's functions as machine code.

use super::derivatives::ModelFunctions;
use crate::ir::FunctionId;
use crate::ir::hash::HashMap;
use crate::jit::{Code, CodeSet, JitError, Kernel, KernelShape, Limits, Listing, Options, Output, Routine, Stop};
use crate::workers::Workers;

/// How code is made: tests let Cranelift verify its input.
pub(super) const OPTIONS: Options = Options { verify: cfg!(test), listings: false, quick: false, narrow: false };

/// Machine code of a model, but for what is made on demand.
pub(super) struct Kernels {
    /// Kernels: points of each body, then different Jacobians. Routines: bounds, prelude, slopes, then requirements.
    set: CodeSet,
    bodies: usize,
    /// Which of the Jacobians each part has.
    jacobian_of: Vec<usize>,
}

const BOUNDS: usize = 0;
const PRELUDE: usize = 1;
const SLOPES: usize = 2;
const REQUIRES: usize = 3;

impl Kernels {
    pub(super) fn new(functions: &ModelFunctions, workers: Workers) -> Result<Kernels, JitError> {
        Kernels::with_listings(functions, OPTIONS, workers).map(|(kernels, _)| kernels)
    }

    /// The texts of everything that is compiled in any case.
    pub(super) fn listings(functions: &ModelFunctions) -> Result<Vec<Listing>, JitError> {
        Kernels::with_listings(functions, Options { listings: true, ..OPTIONS }, Workers::ONE)
            .map(|(_, listings)| listings)
    }

    fn with_listings(
        functions: &ModelFunctions,
        options: Options,
        workers: Workers,
    ) -> Result<(Kernels, Vec<Listing>), JitError> {
        let stored = |function, uniforms| KernelShape { function, uniforms, weights: 0, output: Output::Store };
        let mut shapes: Vec<KernelShape> = functions.bodies.iter().map(|b| stored(b.points, b.captures)).collect();
        let bodies = shapes.len();
        let mut known: HashMap<FunctionId, usize> = HashMap::default();
        let mut jacobian_of = Vec::new();
        for part in &functions.parts {
            jacobian_of.push(*known.entry(part.jacobian.function).or_insert_with(|| {
                shapes.push(stored(part.jacobian.function, part.captures.len() + part.jacobian.slopes.len()));
                shapes.len() - 1 - bodies
            }));
        }
        let mut routines = vec![functions.bounds, functions.prelude, functions.slopes];
        routines.extend(functions.requires.iter().map(|r| r.function));
        let (set, listings) = CodeSet::compile(&functions.module, &shapes, &routines, options, workers)?;
        Ok((Kernels { set, bodies, jacobian_of }, listings))
    }

    /// The points of a body.
    pub(super) fn points(&self, body: usize) -> (&Code, Kernel) {
        self.set.kernel(body)
    }

    /// The Jacobian of a part.
    pub(super) fn jacobian(&self, part: usize) -> (&Code, Kernel) {
        self.set.kernel(self.bodies + self.jacobian_of[part])
    }

    /// Lower and upper bound of every parameter.
    pub(super) fn bounds(&self, x: &[f64], limits: Limits) -> Result<Vec<f64>, Stop> {
        self.call(BOUNDS, x, limits)
    }

    /// What the bodies capture.
    pub(super) fn captures(&self, x: &[f64], limits: Limits) -> Result<Vec<f64>, Stop> {
        self.call(PRELUDE, x, limits)
    }

    /// The derivatives of captures by parameters.
    pub(super) fn slopes(&self, x: &[f64], limits: Limits) -> Result<Vec<f64>, Stop> {
        self.call(SLOPES, x, limits)
    }

    /// The condition of a requirement.
    pub(super) fn require(&self, index: usize) -> (&Code, Routine) {
        self.set.routine(REQUIRES + index)
    }

    fn call(&self, routine: usize, x: &[f64], limits: Limits) -> Result<Vec<f64>, Stop> {
        let (code, routine) = self.set.routine(routine);
        code.call_reals(routine, x, limits)
    }
}
