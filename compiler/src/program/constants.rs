//! The checking stage, with an interpreter for the constants that it needs.

use crate::check::{self, CheckOptions, InputValue, typed};
use crate::diagnostic::Diagnostic;
use crate::diff;
use crate::ir::interpret::{self, Limits, RunError};
use crate::ir::lower;
use crate::ir::scalar::Scalar;
use crate::source::{FileId, Loader, Sources};
use std::collections::BTreeMap;

/// Limits of the evaluation of a constant.
const LIMITS: Limits = Limits { steps: 2_000_000, depth: 500, memory: 2_000_000 };

/// Checks the file `main` and what it uses: [`check::check`] with constants evaluated by lowering and interpreting
/// them.
pub fn check(
    sources: &mut Sources,
    loader: &dyn Loader,
    main: FileId,
    inputs: &BTreeMap<String, InputValue>,
    options: &CheckOptions,
) -> (Option<typed::Model>, Vec<Diagnostic>) {
    check::check(sources, loader, main, inputs, options, constants)
}

/// The values of locals that the body of a model without parameters binds ([`check::Evaluate`]).
pub(crate) fn constants(model: &typed::Model, locals: &[typed::LocalId]) -> Vec<Result<f64, String>> {
    let none = |reason: String| vec![Err(reason); locals.len()];
    let (mut module, functions) = match lower::lower_values(model, locals) {
        Ok(lowered) => lowered,
        Err(e) => return none(e.to_string()),
    };
    if let Err(e) = diff::expand(&mut module, &functions) {
        return none(e.to_string());
    }
    let value = |function| match interpret::run(&module, function, &[], LIMITS).as_deref() {
        Ok([Scalar::Real(x)]) if x.is_finite() => Ok(*x),
        Ok([Scalar::Int(k)]) => Ok(*k as f64),
        Ok([Scalar::Bool(b)]) => Ok(f64::from(*b)),
        Ok(_) => Err("its value is not finite".to_owned()),
        Err(RunError::Failed(failure)) => Err(module.failures[failure.0 as usize].message.clone()),
        Err(e) => Err(e.to_string()),
    };
    functions.into_iter().map(value).collect()
}
