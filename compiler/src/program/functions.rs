//! The functions that a model becomes.

use super::bounds::BoundsJacobian;
use super::jacobians::Jacobian;
use super::measures::MeasureFunctions;
use crate::diff::{self, DiffError, Entry};
use crate::ir::hash::HashMap;
use crate::ir::hoist::prelude::Body;
use crate::ir::{Function, FunctionId, Module, Node, Op, ParameterFunction, Requirement, Type, Value};
use std::sync::Arc;

/// The functions that are compiled in any case, all in one module.
pub(super) struct ModelFunctions {
    pub(super) module: Arc<Module>,
    /// `(params..) -> (lower, upper)..`.
    pub(super) bounds: FunctionId,
    pub(super) bounds_jacobian: BoundsJacobian,
    /// To be tried in order, before the prelude.
    pub(super) requires: Vec<Requirement>,
    /// `(params..) -> captures..`.
    pub(super) prelude: FunctionId,
    /// `(params..) -> entries..`: the Jacobian of the prelude, but for the entries that are 1 or -1.
    pub(super) prelude_jacobian: FunctionId,
    /// The bodies of the parts. Parts that differ in what they capture only have one body: those of a loop.
    pub(super) bodies: Vec<BodyFunction>,
    pub(super) parts: Vec<PartFunctions>,
    /// The parts that are trimmed. Behind the parts stand, in this order, their functions of where they are there.
    pub(super) trimmed: Vec<usize>,
    /// `(params..) -> length` of the parts that have a tolerance of their own.
    pub(super) tolerances: Vec<Option<FunctionId>>,
    pub(super) measures: Vec<MeasureFunctions>,
}

/// A part's function of its points. C stands for its captures, in order.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyFunction {
    /// `(C.., u, v) -> point`.
    pub(super) points: FunctionId,
    /// Number of C.
    pub(super) captures: usize,
    /// Number of the first C, which are not constant.
    pub(super) varied: usize,
}

/// The functions of a part.
pub(super) struct PartFunctions {
    /// The whole, for texts and for the interpreter: `(some parameters.., u, v) -> (x, y, z)`.
    pub(super) surface: ParameterFunction,
    /// Its body's index.
    pub(super) body: usize,
    /// Its C among all captures.
    pub(super) captures: Vec<u32>,
    pub(super) jacobian: Jacobian,
    /// The derivatives of its C, for the pullback.
    pub(super) entries: Vec<PreludeEntry>,
}

/// The derivative of a capture by a parameter, where it is not always zero.
#[derive(Clone, Copy, Debug)]
pub(super) struct PreludeEntry {
    /// The position among the part's captures.
    pub(super) capture: u32,
    pub(super) param: u32,
    pub(super) value: EntryValue,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum EntryValue {
    /// 1 or -1, whatever the parameters.
    Constant(f64),
    /// Result of `ModelFunctions::prelude_jacobian`.
    Computed(u32),
}

impl ModelFunctions {
    /// Drops the functions that were made on the way.
    pub(super) fn drop_unreached(mut self, mut module: Module) -> ModelFunctions {
        let mut named: Vec<&mut FunctionId> = vec![&mut self.bounds, &mut self.prelude, &mut self.prelude_jacobian];
        named.push(&mut self.bounds_jacobian.function);
        named.extend(self.requires.iter_mut().map(|r| &mut r.condition.function));
        named.extend(self.bodies.iter_mut().map(|b| &mut b.points));
        named.extend(self.parts.iter_mut().flat_map(|p| [&mut p.surface.function, &mut p.jacobian.function]));
        named.extend(self.tolerances.iter_mut().flatten());
        named.extend(
            self.measures
                .iter_mut()
                .flat_map(|m| [Some(&mut m.value), Some(&mut m.jacobian), m.limits.as_mut()])
                .flatten(),
        );
        let mut roots: Vec<FunctionId> = named.iter().map(|f| **f).collect();
        module.drop_unreached(&mut roots);
        named.into_iter().zip(roots).for_each(|(f, id)| *f = id);
        self.module = Arc::new(module);
        self
    }

    /// The functions that run once for every x: routines of one `Code`, at the places below.
    pub(super) fn routines(&self) -> Vec<FunctionId> {
        let mut routines = vec![self.bounds, self.prelude, self.prelude_jacobian];
        routines.extend(self.requires.iter().map(|r| r.condition.function));
        routines
    }
}

/// Places among [`ModelFunctions::routines`].
pub(super) const BOUNDS: usize = 0;
pub(super) const PRELUDE: usize = 1;
pub(super) const PRELUDE_JACOBIAN: usize = 2;
pub(super) const REQUIRES: usize = 3;

/// The different bodies, and the one of each part.
pub(super) fn bodies(parts: &[Body]) -> (Vec<BodyFunction>, Vec<usize>) {
    let mut bodies = Vec::new();
    let mut indices: HashMap<FunctionId, usize> = HashMap::default();
    let of_part = parts.iter().map(|part| {
        *indices.entry(part.function).or_insert_with(|| {
            let captures = part.captures.len();
            bodies.push(BodyFunction { points: part.function, captures, varied: captures - part.constants });
            bodies.len() - 1
        })
    });
    let of_part = of_part.collect();
    (bodies, of_part)
}

/// Differentiates the prelude by all parameters. Entries that are 1 or -1 are left out of the function, so that such
/// factors vanish. (Other constants stay, lest parts in a loop differ in them.) Returns it with the entries of every
/// capture.
pub(super) fn prelude_jacobian(
    module: &mut Module,
    prelude: FunctionId,
) -> Result<(FunctionId, Vec<Vec<PreludeEntry>>), DiffError> {
    let wrt: Vec<u32> = (0..module.function(prelude).params.len() as u32).collect();
    let (jacobian, pattern) = diff::jacobian(module, prelude, &wrt)?;
    let function = module.function(jacobian);
    let first = function.results.len() - pattern.len();
    let mut picks = Vec::new();
    let mut entries = vec![Vec::new(); first];
    for (entry, result) in pattern.iter().zip(first..) {
        let value = match function.op(function.results[result]) {
            Op::Real(bits) if f64::from_bits(*bits).abs() == 1.0 => EntryValue::Constant(f64::from_bits(*bits)),
            _ => {
                picks.push(Some(result));
                EntryValue::Computed(picks.len() as u32 - 1)
            }
        };
        entries[entry.result as usize].push(PreludeEntry { capture: entry.result, param: entry.param, value });
    }
    let picked = pick(function, "prelude_jacobian", &picks);
    Ok((module.add(picked), entries))
}

/// The entries of the captures that a part takes.
pub(super) fn entries_of_part(captures: &[u32], entries: &[Vec<PreludeEntry>]) -> Vec<PreludeEntry> {
    let of_capture = |(position, capture): (u32, &u32)| {
        entries[*capture as usize].iter().map(move |entry| PreludeEntry { capture: position, ..*entry })
    };
    (0..).zip(captures).flat_map(of_capture).collect()
}

/// The places of a Jacobian's entries among a function's results, after `first` others, by result and parameter.
pub(super) fn positions(pattern: &[Entry], first: usize) -> HashMap<(u32, u32), usize> {
    pattern.iter().zip(first..).map(|(e, position)| ((e.result, e.param), position)).collect()
}

/// A function with some of another's results; zero where nothing is picked.
pub(super) fn pick(function: &Function, name: &str, picks: &[Option<usize>]) -> Function {
    let mut picked = Function { name: name.to_owned(), ..function.clone() };
    let zero = Value(picked.nodes.len() as u32);
    picked.nodes.push(Node { op: Op::Real(0), ty: Type::Real, span: crate::source::Span::default() });
    picked.results = picks.iter().map(|p| p.map_or(zero, |k| function.results[k])).collect();
    picked.result_names =
        picks.iter().map(|p| p.map_or_else(|| "zero".to_owned(), |k| function.result_names[k].clone())).collect();
    picked.drop_unused();
    picked
}
