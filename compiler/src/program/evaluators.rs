//! The machine code that evaluates parts: one cache for all of it, by kind of sites and by order. Code that not
//! everybody needs is made when it is first asked for.

use super::Order;
use super::functions::ModelFunctions;
use super::pipeline::{BuildError, differentiated, split_for_grids};
use crate::ir::hoist::grid::GridSplit;
use crate::ir::{FunctionId, Module};
use crate::jit::{Code, JitError, KernelShape, Limits, Listing, Options, Points, Stopped};
use crate::workers::Workers;
use std::sync::{Arc, OnceLock};

/// Options of all code of programs: tests let Cranelift verify its input.
pub(super) const OPTIONS: Options =
    Options { verify: cfg!(test), listings: false, one_lane: false, piece: Options::PIECE };

/// Evaluators that were asked for. Several threads may ask at once; one of them makes it.
pub(super) struct Evaluators {
    pub(super) workers: Workers,
    made: [OnceLock<Result<Evaluator, BuildError>>; 2 * Order::ALL.len()],
}

/// Functions of the points of all parts as machine code.
pub(super) struct Evaluator {
    /// The functions below, and what they name.
    pub(super) module: Arc<Module>,
    /// `(captures.., u, v) -> results..`, or for a pullback `(captures.., u, v, w..) -> adjoints of captures..`. Parts
    /// that are alike share one.
    pub(super) functions: Vec<FunctionId>,
    /// For each part the index of its function among them.
    pub(super) of_part: Vec<usize>,
    /// For grids each function split: its kernels are those of the columns, of the rows, and of every point.
    pub(super) splits: Vec<GridSplit>,
    pub(super) shapes: Vec<KernelShape>,
    /// The kernels of these shapes are those from `first` on.
    pub(super) code: Arc<Code>,
    pub(super) first: usize,
}

impl Evaluators {
    /// Evaluators at scattered sites that are there from the start.
    pub(super) fn new(workers: Workers, made: impl IntoIterator<Item = (Order<'static>, Evaluator)>) -> Evaluators {
        let evaluators = Evaluators { workers, made: Default::default() };
        for (order, evaluator) in made {
            _ = evaluators.made[2 * order.index()].set(Ok(evaluator));
        }
        evaluators
    }

    /// The evaluator at scattered sites or on grids.
    pub(super) fn get(
        &self,
        model: &ModelFunctions,
        on_grid: bool,
        order: Order<'_>,
    ) -> Result<&Evaluator, &BuildError> {
        let place = 2 * order.index() + usize::from(on_grid);
        let make = || if on_grid { split_for_grids(self, model, order) } else { differentiated(self, model, order) };
        self.made[place].get_or_init(make).as_ref()
    }
}

impl Evaluator {
    /// A kernel of a shape among `shapes`.
    pub(super) fn run(
        &self,
        kernel: usize,
        captures: &[f64],
        points: Points<'_>,
        out: &mut [f64],
        limits: Limits,
    ) -> Result<(), Stopped> {
        self.code.run(self.first + kernel, captures, points, out, limits)
    }

    /// The texts of the machine code.
    pub(super) fn listings(&self) -> Result<Vec<Listing>, JitError> {
        let options = Options { listings: true, ..OPTIONS };
        Ok(Code::compile(&self.module, &self.shapes, &[], options, Workers::ONE)?.1)
    }
}
