//! Derivatives that are made when they are first asked for: not everybody needs them.

use super::compile::BuildError;
use super::derivatives::{BodyFunction, ModelFunctions, pick, positions};
use super::kernels::OPTIONS;
use crate::diff;
use crate::ir::{FunctionId, Module};
use crate::jit::{CodeSet, JitError, KernelShape, Listing, Options, Output};
use crate::workers::Workers;
use std::sync::OnceLock;

/// What can be made of a body. C stands for its captures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Derivative {
    /// `(C.., u, v) -> (point, du, dv)`.
    Partials,
    /// `(C.., u, v) -> (point, du, dv, duu, duv, dvv)`.
    SecondPartials,
    /// `(C.., u, v, w..) -> adjoints of C..`, but for those that are constant.
    Pullback,
}

impl Derivative {
    pub(super) const ALL: [Derivative; 3] = [Derivative::Partials, Derivative::SecondPartials, Derivative::Pullback];
}

/// A derivative of all bodies, in their order.
pub(super) struct Derived {
    /// The functions below, and what they name.
    pub(super) module: Module,
    pub(super) functions: Vec<FunctionId>,
    pub(super) kernels: CodeSet,
}

/// Derivatives that were asked for. Several threads may ask at once; one of them makes it.
pub(super) struct OnDemand {
    workers: Workers,
    made: [OnceLock<Result<Derived, BuildError>>; 3],
}

impl OnDemand {
    pub(super) fn new(workers: Workers) -> OnDemand {
        OnDemand { workers, made: Default::default() }
    }

    pub(super) fn get(&self, functions: &ModelFunctions, derivative: Derivative) -> Result<&Derived, &BuildError> {
        let make = || {
            let (module, made) = self.differentiate(functions, derivative)?;
            let (kernels, _) = compile(&module, &made, &functions.bodies, derivative, OPTIONS, self.workers)?;
            Ok(Derived { module, functions: made, kernels })
        };
        self.made[derivative as usize].get_or_init(make).as_ref()
    }

    /// The texts of a derivative's machine code.
    pub(super) fn listings(
        &self,
        functions: &ModelFunctions,
        derivative: Derivative,
    ) -> Result<Vec<Listing>, BuildError> {
        let derived = self.get(functions, derivative).map_err(Clone::clone)?;
        let options = Options { listings: true, ..OPTIONS };
        Ok(compile(&derived.module, &derived.functions, &functions.bodies, derivative, options, Workers::ONE)?.1)
    }

    fn differentiate(
        &self,
        functions: &ModelFunctions,
        derivative: Derivative,
    ) -> Result<(Module, Vec<FunctionId>), BuildError> {
        let (mut module, mut made) = match derivative {
            Derivative::SecondPartials => {
                let partials = self.get(functions, Derivative::Partials).map_err(Clone::clone)?;
                (partials.module.clone(), partials.functions.clone())
            }
            Derivative::Partials | Derivative::Pullback => {
                (functions.module.clone(), functions.bodies.iter().map(|b| b.points).collect())
            }
        };
        module.drop_unreached(&mut made);
        for (function, body) in made.iter_mut().zip(&functions.bodies) {
            let (n, varied) = (body.captures as u32, body.varied as u32);
            *function = match derivative {
                Derivative::Partials => partials(&mut module, *function, n)?,
                Derivative::SecondPartials => second_partials(&mut module, *function, n)?,
                Derivative::Pullback => {
                    diff::pullback(&mut module, *function, &(0..varied).collect::<Vec<_>>(), false)?
                }
            };
        }
        module.drop_unreached(&mut made);
        Ok((module, made))
    }
}

fn compile(
    module: &Module,
    functions: &[FunctionId],
    bodies: &[BodyFunction],
    derivative: Derivative,
    options: Options,
    workers: Workers,
) -> Result<(CodeSet, Vec<Listing>), JitError> {
    let (weights, output) = match derivative {
        Derivative::Pullback => (3, Output::Accumulate),
        Derivative::Partials | Derivative::SecondPartials => (0, Output::Store),
    };
    let shape = |(function, body): (&FunctionId, &BodyFunction)| KernelShape {
        function: *function,
        uniforms: body.captures,
        weights,
        output,
    };
    let shapes: Vec<KernelShape> = functions.iter().zip(bodies).map(shape).collect();
    CodeSet::compile(module, &shapes, &[], options, workers)
}

/// `(C.., u, v) -> (point, du, dv)`.
fn partials(module: &mut Module, points: FunctionId, captures: u32) -> Result<FunctionId, BuildError> {
    let uv = [captures, captures + 1];
    let (first, pattern) = diff::jacobian(module, points, &uv)?;
    let entries = positions(&pattern, 3);
    let mut picks: Vec<Option<usize>> = (0..3).map(Some).collect();
    picks.extend(uv.iter().flat_map(|p| [0, 1, 2].map(|r| entries.get(&(r, *p)).copied())));
    let partials = pick(module.function(first), "partials", &picks);
    Ok(module.add(partials))
}

/// `(C.., u, v) -> (point, du, dv, duu, duv, dvv)` from the partials.
fn second_partials(module: &mut Module, partials: FunctionId, captures: u32) -> Result<FunctionId, BuildError> {
    let [u, v] = [captures, captures + 1];
    let (second, pattern) = diff::jacobian(module, partials, &[u, v])?;
    let entries = positions(&pattern, 9);
    let mut picks: Vec<Option<usize>> = (0..9).map(Some).collect();
    // The partials of du are duu and duv; of those of dv, dvv is new.
    for (results, param) in [(3..6, u), (3..6, v), (6..9, v)] {
        picks.extend(results.map(|r| entries.get(&(r, param)).copied()));
    }
    let second = pick(module.function(second), "second_partials", &picks);
    Ok(module.add(second))
}
