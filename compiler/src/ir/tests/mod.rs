//! Tests of the builder and the passes; random functions and ways to run functions, which the tests of other stages use
//! too.

use super::interpret::{self, Limits};
use super::scalar::Scalar;
use super::*;

mod passes;
pub(crate) mod random;

/// Runs a function on reals; panics if it fails.
pub(crate) fn run(module: &Module, function: FunctionId, args: &[f64]) -> Vec<f64> {
    match interpret::run_real(module, function, args, Limits::default()) {
        Ok(results) => results,
        Err(e) => panic!("{e}\n{module}"),
    }
}

/// Runs a function of an integer and reals.
pub(crate) fn run_with(module: &Module, function: FunctionId, n: i64, args: &[f64]) -> Vec<f64> {
    let all: Vec<Scalar> = std::iter::once(Scalar::Int(n)).chain(args.iter().map(|x| Scalar::Real(*x))).collect();
    match interpret::run(module, function, &all, Limits::default()) {
        Ok(results) => results.into_iter().map(|r| r.real().unwrap_or(f64::NAN)).collect(),
        Err(e) => panic!("{e}\n{module}"),
    }
}

/// Real parameters of these names.
pub(crate) fn reals(names: &[&str]) -> Vec<Parameter> {
    names.iter().map(|n| Parameter::real(*n)).collect()
}

/// A module of one function of reals with one result named `f`.
pub(crate) fn function_of(
    names: &[&str],
    make: impl FnOnce(&mut FunctionBuilder, &[Value]) -> Value,
) -> (Module, FunctionId) {
    let mut module = Module::default();
    let mut b = FunctionBuilder::new("f", reals(names));
    let params = b.params();
    let result = make(&mut b, &params);
    let id = module.add(b.finish([("f".to_owned(), result)]));
    validate(&module).unwrap();
    (module, id)
}
