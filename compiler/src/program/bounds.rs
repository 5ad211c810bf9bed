//! Bounds of the parameters at x, and how they follow other parameters.

use super::Program;
use super::functions::{BOUNDS, positions};
use crate::diff::{self, DiffError};
use crate::ir::{FunctionId, Module, interpret};
use crate::parameters::bounds_of;

/// The derivatives of a parameter's bounds by a parameter that they depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundDerivative {
    /// Index of the parameter that has the bounds.
    pub parameter: usize,
    /// Index of the parameter that they depend on.
    pub by: usize,
    /// The lower bound's derivative: the lower bound's unit per unit of `by`, both in millimetres and radians.
    pub lower: f64,
    /// The upper bound's derivative.
    pub upper: f64,
}

/// The Jacobian of all bounds, as a function.
pub(super) struct BoundsJacobian {
    /// `(params..) -> (lower, upper).., entries..`.
    pub(super) function: FunctionId,
    dependences: Vec<Dependence>,
}

/// A parameter whose bounds depend on another one. Data flow decides: the derivatives may still be zero, as those of a
/// rounded value are.
struct Dependence {
    parameter: usize,
    by: usize,
    /// The derivatives of the lower and the upper bound among the function's results; none where it is always zero.
    entries: [Option<usize>; 2],
}

impl BoundsJacobian {
    /// Differentiates the function `bounds` of `params` parameters, which is inlined and simplified.
    pub(super) fn new(module: &mut Module, bounds: FunctionId, params: usize) -> Result<BoundsJacobian, DiffError> {
        let wrt: Vec<u32> = (0..params as u32).collect();
        let (function, pattern) = diff::jacobian(module, bounds, &wrt)?;
        let position = positions(&pattern, 2 * params);
        let mut dependences = Vec::new();
        for parameter in 0..params {
            let results = [2 * parameter, 2 * parameter + 1];
            let mut pair = module.function(bounds).clone();
            pair.results = results.map(|r| pair.results[r]).to_vec();
            pair.drop_unused();
            let used = pair.used_params().into_iter().enumerate().filter(|(_, used)| *used);
            dependences.extend(used.map(|(by, _)| {
                let entries = results.map(|r| position.get(&(r as u32, by as u32)).copied());
                Dependence { parameter, by, entries }
            }));
        }
        Ok(BoundsJacobian { function, dependences })
    }
}

impl Program {
    /// Bounds of every parameter at x, as a bound may depend on other parameters; infinite where there is none, and
    /// where the bound cannot be computed at x.
    ///
    /// # Panics
    /// If x does not have a value for every parameter.
    #[must_use]
    pub fn bounds(&self, x: &[f64]) -> Vec<(f64, f64)> {
        assert_eq!(x.len(), self.parameters.len(), "a value for every parameter");
        bounds_of(self.routines.call_reals(BOUNDS, x, self.limits).ok(), x.len())
    }

    /// The Jacobian of the bounds at x: an entry for each pair of a parameter and another one that its bounds depend
    /// on, ascending. The pairs are the same at any x; the derivatives are 0 where a bound cannot be computed. (The
    /// entries are few: the interpreter computes them.)
    ///
    /// # Panics
    /// If x does not have a value for every parameter.
    #[must_use]
    pub fn bounds_jacobian(&self, x: &[f64]) -> Vec<BoundDerivative> {
        assert_eq!(x.len(), self.parameters.len(), "a value for every parameter");
        let jacobian = &self.functions.bounds_jacobian;
        if jacobian.dependences.is_empty() {
            return Vec::new();
        }
        let results =
            interpret::run_real(&self.functions.module, jacobian.function, x, self.replay_limits()).unwrap_or_default();
        let finite = |entry: Option<usize>| {
            entry.and_then(|k| results.get(k)).copied().filter(|slope| slope.is_finite()).unwrap_or(0.0)
        };
        let derivative = |d: &Dependence| {
            let [lower, upper] = d.entries.map(finite);
            BoundDerivative { parameter: d.parameter, by: d.by, lower, upper }
        };
        jacobian.dependences.iter().map(derivative).collect()
    }

    /// Whether the bounds of a parameter depend on another one.
    pub(super) fn bounds_depend(&self, parameter: usize, on: usize) -> bool {
        self.functions.bounds_jacobian.dependences.iter().any(|d| d.parameter == parameter && d.by == on)
    }
}
