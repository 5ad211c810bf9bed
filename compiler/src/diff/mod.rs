//! Derivatives of IR functions, as IR functions: [`tangent`], [`jacobian`], [`directional`], [`pullback`]; and
//! [`expand`], which replaces the derivatives that a script itself asks for.
//!
//! This is algorithmic differentiation by source transformation (Griewank and Walther, Evaluating Derivatives, 2nd
//! ed.): the program is differentiated operation by operation, by the rules of `rules`. The derivatives are simplified,
//! valid, and can be differentiated again. A function is best inlined before it is differentiated
//! ([`inline`](crate::ir::inline())). The calls (of recursive functions), branches and loops that are left are
//! differentiated as such: a branch becomes a branch of the derivatives of its sides, a call becomes a call.
//!
//! - **Forward mode**: values carry tangents in several seed directions at once (chapter 3); a value carries no tangent
//!   in a direction on which it does not depend. A loop carries the tangents of its carried values.
//! - **Reverse mode**: adjoints are summed from the results to the parameters. A loop's states are needed in reverse
//!   order, and functions have no memory in which to store n of them: a loop of a small known count is unrolled, and
//!   any other one is halved recursively (the state in the middle is computed, then the second half is reversed, then
//!   the first). This binary checkpointing (chapter 12) takes about (n/2) log2(n) iterations beside the n reversed
//!   ones, and log2(n) states at once. Transposing the forward derivative would take n iterations for each unknown.

use crate::diagnostic::{Code, Diagnostic};
use crate::ir::{self, FunctionBuilder, FunctionId, Module, Parameter, SizeError, Type, Value};
use crate::source::Span;

mod dependence;
mod directional;
mod expand;
mod forward;
mod reverse;
mod reverse_loop;
mod rules;
#[cfg(test)]
mod tests;

pub(crate) use directional::{Directions, Rate, directional};
pub use expand::expand;
use forward::{Tangents, forward};
use reverse::Reverse;

/// Why a function cannot be differentiated.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DiffError {
    /// The derivative would be too large a program.
    #[error(transparent)]
    Size(#[from] SizeError),
    /// A function needs its own derivative to compute its value: its order would have no end.
    #[error("'{function}' needs its own derivative to compute its value")]
    Recursive {
        /// The function.
        function: String,
        /// The place where the derivative is taken.
        span: Span,
    },
}

impl DiffError {
    /// The place in the source.
    #[must_use]
    pub fn span(&self) -> Span {
        match self {
            DiffError::Size(e) => e.span(),
            DiffError::Recursive { span, .. } => *span,
        }
    }

    /// For the user.
    #[must_use]
    pub fn diagnostic(&self) -> Diagnostic {
        match self {
            DiffError::Size(e) => e.diagnostic(),
            DiffError::Recursive { span, .. } => Diagnostic::new(Code::Derivative, *span, self.to_string()),
        }
    }
}

/// An entry of a Jacobian: the derivative of a result by a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Entry {
    /// Index of the result.
    pub result: u32,
    /// Index of the parameter.
    pub param: u32,
}

/// The directional derivative: `(p.., dp of each active..) -> (r.., dr of each Real result..)`.
/// The active parameters must be Real.
///
/// # Errors
/// If the derivative would be too large.
pub fn tangent(module: &mut Module, function: FunctionId, active: &[u32]) -> Result<FunctionId, DiffError> {
    let old = module.function(function).clone();
    let mut params = old.params.clone();
    params.extend(active.iter().map(|i| Parameter::real(format!("d{}", old.params[*i as usize].name))));
    let mut builder = FunctionBuilder::new(format!("d{}", old.name), params);
    let mut tangents = vec![Tangents::new(); old.params.len()];
    for (position, i) in active.iter().enumerate() {
        tangents[*i as usize].insert(0, builder.param(old.params.len() + position));
    }
    let args = builder.params()[..old.params.len()].to_vec();
    let (results, tangents) = forward(module, &mut builder, &old, &args, &tangents)?;
    let mut named: Vec<(String, Value)> = old.result_names.iter().cloned().zip(results).collect();
    for (k, name) in old.result_names.iter().enumerate() {
        if old.ty(old.results[k]) == Type::Real {
            let zero = builder.real(0.0);
            named.push((format!("d{name}"), tangents[k].get(&0).copied().unwrap_or(zero)));
        }
    }
    let id = module.add(builder.finish(named));
    clean(module, id)?;
    Ok(id)
}

/// The values and the sparse Jacobian: `(p..) -> (r.., entries..)`, with the derivative that each entry is, by result
/// and then by parameter. Derivatives that are zero for all parameters are left out. The parameters `wrt` must be Real.
///
/// # Errors
/// If the derivative would be too large.
pub fn jacobian(module: &mut Module, function: FunctionId, wrt: &[u32]) -> Result<(FunctionId, Vec<Entry>), DiffError> {
    let old = module.function(function).clone();
    let mut builder = FunctionBuilder::new(format!("jacobian_{}", old.name), old.params.clone());
    let one = builder.real(1.0);
    let mut tangents = vec![Tangents::new(); old.params.len()];
    for i in wrt {
        tangents[*i as usize].insert(*i, one);
    }
    let args = builder.params();
    let (results, tangents) = forward(module, &mut builder, &old, &args, &tangents)?;
    let values = old.result_names.iter().cloned().zip(results).collect();
    let name = |e: Entry| format!("d{}_d{}", old.result_names[e.result as usize], old.params[e.param as usize].name);
    finish_jacobian(module, builder, values, &tangents, name)
}

/// Completes a function of some values and of the tangents of results; those that turn out to be zero are left out.
fn finish_jacobian(
    module: &mut Module,
    builder: FunctionBuilder,
    values: Vec<(String, Value)>,
    tangents: &[Tangents],
    name: impl Fn(Entry) -> String,
) -> Result<(FunctionId, Vec<Entry>), DiffError> {
    let first = values.len();
    let entries = |(result, tangents): (u32, &Tangents)| -> Vec<(Entry, Value)> {
        tangents.iter().map(|(param, value)| (Entry { result, param: *param }, *value)).collect()
    };
    let entries: Vec<(Entry, Value)> = (0..).zip(tangents).flat_map(entries).collect();
    let named = entries.iter().map(|(entry, value)| (name(*entry), *value));
    let id = module.add(builder.finish(values.into_iter().chain(named)));
    clean(module, id)?;
    let function = &mut module.functions[id.0 as usize];
    let names = function.result_names.split_off(first);
    let results = function.results.split_off(first);
    let mut pattern = Vec::new();
    for (((entry, _), name), result) in entries.into_iter().zip(names).zip(results) {
        if *function.op(result) != ir::Op::Real(0) {
            function.results.push(result);
            function.result_names.push(name);
            pattern.push(entry);
        }
    }
    function.drop_unused();
    Ok((id, pattern))
}

/// The reverse derivative: `(p.., adjoint of each Real result..) -> (adjoint of each parameter of wrt..)`, preceded
/// by the results themselves if `with_results`. The parameters `wrt` must be Real.
///
/// # Errors
/// If the derivative would be too large.
pub fn pullback(
    module: &mut Module,
    function: FunctionId,
    wrt: &[u32],
    with_results: bool,
) -> Result<FunctionId, DiffError> {
    let old = module.function(function).clone();
    let real: Vec<usize> = (0..old.results.len()).filter(|k| old.ty(old.results[*k]) == Type::Real).collect();
    let mut params = old.params.clone();
    params.extend(real.iter().map(|k| Parameter::real(format!("{}_bar", old.result_names[*k]))));
    let mut builder = FunctionBuilder::new(format!("pullback_{}", old.name), params);
    let args = builder.params()[..old.params.len()].to_vec();
    let mut adjoints = vec![None; old.results.len()];
    for (position, k) in real.iter().enumerate() {
        adjoints[*k] = Some(reverse::Adjoint { value: builder.param(args.len() + position), masked: false });
    }
    let mut reverse = Reverse::new(module);
    let (results, adjoints) = reverse.splice(&mut builder, &old, &args, &adjoints, wrt)?;
    reverse.finish()?;
    let mut named = Vec::new();
    if with_results {
        named.extend(old.result_names.iter().cloned().zip(results));
    }
    for (i, adjoint) in wrt.iter().zip(adjoints) {
        let zero = builder.real(0.0);
        named.push((format!("{}_bar", old.params[*i as usize].name), adjoint.unwrap_or(zero)));
    }
    let id = module.add(builder.finish(named));
    clean(module, id)?;
    Ok(id)
}

/// Inlines and simplifies a derivative.
fn clean(module: &mut Module, id: FunctionId) -> Result<(), DiffError> {
    ir::inline(module, &[id])?;
    ir::simplify(module, &[id]);
    Ok(())
}

/// An error if a function under construction has outgrown the limit.
fn check_size(builder: &FunctionBuilder, function: &str, limit: usize) -> Result<(), DiffError> {
    if builder.node_count() <= limit {
        return Ok(());
    }
    Err(SizeError::too_large(function.to_owned(), builder.span(), limit).into())
}
