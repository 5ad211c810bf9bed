//! Large routines as several functions that run one after another.
//!
//! Unoptimised code has a place in its frame for every value, so that a routine with all values of a large model would
//! need more stack than there is. Each piece has some of the nodes, in their order; values that later pieces need are
//! in memory after the results.

use super::compiler::{Compiler, JitError};
use super::lower::{Frame, Lowered, Lowering};
use super::plan::Plan;
use crate::ir::hash::HashMap;
use crate::ir::{self, Function, FunctionId, Module, Op, Type};
use cranelift_frontend::FunctionBuilderContext;
use cranelift_module::{FuncId, Module as _};
use std::ops::Range;

/// A large function's nodes in pieces.
pub(super) struct Pieces {
    /// The nodes of every piece.
    pub(super) ranges: Vec<Range<usize>>,
    /// The first word of each value that later pieces need.
    places: HashMap<ir::Value, usize>,
    /// Words of the results and of these values.
    pub(super) words: usize,
}

impl Pieces {
    /// Pieces of about `most` nodes; `None` where the function is small enough to stay whole.
    pub(super) fn new(module: &Module, plan: &Plan, function: &Function, most: usize) -> Option<Pieces> {
        let (mut ranges, mut size, mut start) = (Vec::new(), 0, 0);
        for (i, node) in function.nodes.iter().enumerate() {
            size += 1 + plan.size_in_place(&node.op);
            if size >= most {
                ranges.push(start..i + 1);
                (start, size) = (i + 1, 0);
            }
        }
        if ranges.is_empty() {
            return None;
        }
        ranges.push(start..function.nodes.len());
        let mut pieces = Pieces { ranges, places: HashMap::default(), words: function.results.len() };
        for range in pieces.ranges.clone() {
            for node in &function.nodes[range.clone()] {
                node.op.visit_operands(|v| {
                    if (v.0 as usize) < range.start && !is_everywhere(function.op(v)) {
                        let words = result_types(module, function, v).len();
                        pieces.places.entry(v).or_insert_with(|| {
                            pieces.words += words;
                            pieces.words - words
                        });
                    }
                });
            }
        }
        Some(pieces)
    }
}

/// Whether every piece has the value without a place in memory: arguments and constants.
fn is_everywhere(op: &Op) -> bool {
    matches!(op, Op::Param(_) | Op::Real(_) | Op::Int(_) | Op::Bool(_))
}

/// The types of a node's values: of several where it has several.
fn result_types(module: &Module, function: &Function, v: ir::Value) -> Vec<Type> {
    match function.op(v) {
        Op::If { then: inner, .. } | Op::Loop { body: inner, .. } | Op::Call { function: inner, .. } => {
            module.function(*inner).result_types()
        }
        _ => vec![function.ty(v)],
    }
}

/// Builds `(context, arguments, results) -> status` for one piece; `results` has all words.
pub(super) fn build_piece(
    compiler: &mut Compiler<'_>,
    id: FunctionId,
    pieces: &Pieces,
    range: Range<usize>,
    context: &mut cranelift_codegen::Context,
    frontend: &mut FunctionBuilderContext,
) -> Result<(), JitError> {
    let (mut lowering, [arguments, results]) = Lowering::plain(compiler, context, frontend);
    let (module, function) = (lowering.compiler.module, lowering.compiler.module.function(id));
    let arguments = lowering.words(arguments, function.params.iter().map(|p| p.ty));
    let mut frame = Frame::of_range(function, range.clone());
    frame.values[..arguments.len()].clone_from_slice(&arguments);
    for node in &function.nodes[range.clone()] {
        node.op.visit_operands(|v| {
            if (v.0 as usize) < range.start
                && frame.is_missing(v)
                && let Some(place) = pieces.places.get(&v)
            {
                let first = 8 * *place as i32;
                let types = result_types(module, function, v).into_iter();
                let stored = lowering.words_at(results, first..first + 8, types);
                frame.values[v.0 as usize] = match function.ty(v) {
                    Type::Multi => Lowered::Many(lowering.values(&stored)),
                    _ => stored[0].clone(),
                };
            }
        });
    }
    lowering.pinned_nodes_of(&mut frame, range.clone())?;
    for v in range.clone().map(|i| ir::Value(i as u32)) {
        if let Some(place) = pieces.places.get(&v) {
            lowering.demand(&mut frame, v)?;
            let values = match frame.values[v.0 as usize].clone() {
                Lowered::Many(values) => values.into_iter().map(Lowered::One).collect(),
                one => vec![one],
            };
            for (word, value) in (*place..).zip(values) {
                let value = lowering.value(&value);
                lowering.store_word(results, 8 * word as i32, value);
            }
        }
    }
    for (word, result) in function.results.iter().enumerate() {
        if range.contains(&(result.0 as usize)) {
            let value = lowering.demanded(&mut frame, *result)?;
            lowering.store_word(results, 8 * word as i32, value);
        }
    }
    lowering.close_plain();
    Ok(())
}

/// Builds `(context, arguments, results) -> status`, which runs the pieces in their order.
pub(super) fn build_sequence(
    compiler: &mut Compiler<'_>,
    pieces: &[FuncId],
    context: &mut cranelift_codegen::Context,
    frontend: &mut FunctionBuilderContext,
) {
    let (mut lowering, [arguments, results]) = Lowering::plain(compiler, context, frontend);
    for piece in pieces {
        let function = lowering.compiler.memory.module_mut().declare_func_in_func(*piece, lowering.builder.func);
        lowering.call_native(function, arguments, results);
    }
    lowering.close_plain();
}
