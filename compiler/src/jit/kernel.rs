//! Functions as loops over points, one or two at once.
//!
//! Every lane computes what the code for one point does, with the same operations: results are the same to the bit.
//! Even and odd points are summed apart in either case.

use super::compiler::{Compiler, JitError, KernelShape, Output};
use super::context::Context;
use super::libcalls::is_libcall;
use super::lower::{Frame, Lowered, Lowering, TRUSTED};
use super::vector::PAIRS;
use crate::ir::{Function, Op, Type};
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{BlockArg, InstBuilder, StackSlotData, StackSlotKind, Value, types};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};

/// Most loop invariants that stay in registers, of which there are 16; more of them, or all where the loop has calls,
/// are in memory.
const MOST_IN_REGISTERS: usize = 11;

/// Builds `(context, captures, values, stride, n, out) -> status`. Nodes that depend on captures only are computed
/// once, before the loop. For two lanes the captures are there twice each, side by side.
pub(super) fn build(
    compiler: &mut Compiler<'_>,
    shape: KernelShape,
    two_lanes: bool,
    context: &mut cranelift_codegen::Context,
    frontend: &mut FunctionBuilderContext,
) -> Result<(), JitError> {
    let mut builder = FunctionBuilder::new(&mut context.func, frontend);
    let entry = builder.create_block();
    builder.append_block_params_for_function_params(entry);
    builder.switch_to_block(entry);
    let &[context, captures, values, stride, n, out] = builder.block_params(entry) else {
        unreachable!("it has this signature")
    };
    let (early_fail, late_fail) = (builder.create_block(), builder.create_block());
    let (some, body, done) = (builder.create_block(), builder.create_block(), builder.create_block());
    let any = builder.ins().icmp_imm_s(IntCC::SignedGreaterThan, n, 0);
    builder.ins().brif(any, some, [], done, []);

    builder.switch_to_block(some);
    let mut lowering = Lowering::new(compiler, builder, context, early_fail);
    let function = lowering.compiler.module.function(shape.function);
    let mut frame = Frame::new(function);
    invariants(&mut lowering, &mut frame, shape, two_lanes, captures)?;
    let zero = lowering.builder.ins().iconst(types::I64, 0);
    lowering.builder.ins().jump(body, &[BlockArg::Value(zero)]);

    let index = lowering.builder.append_block_param(body, types::I64);
    lowering.builder.switch_to_block(body);
    lowering.fail = late_fail;
    lowering.two_lanes = two_lanes;
    if lowering.compiler.plan.counts_steps(shape.function) {
        let steps = lowering.builder.ins().load(types::I64, TRUSTED, context, Context::STEPS_PER_POINT);
        lowering.builder.ins().store(TRUSTED, steps, context, Context::STEPS);
    }
    let offset = lowering.builder.ins().imul_imm_s(index, 8);
    let stride = lowering.builder.ins().imul_imm_s(stride, 8);
    let mut place = lowering.builder.ins().iadd(values, offset);
    for value in &mut frame.values[shape.captures..function.params.len()] {
        *value = Lowered::Stored(place, 0);
        place = lowering.builder.ins().iadd(place, stride);
    }
    lowering.pinned_nodes(&mut frame)?;
    match shape.output {
        Output::Store => {
            let offset = lowering.builder.ins().imul_imm_s(index, 8 * function.results.len() as i64);
            let place = lowering.builder.ins().iadd(out, offset);
            store(&mut lowering, &mut frame, place)?;
        }
        Output::Accumulate => accumulate(&mut lowering, &mut frame, index, out)?,
    }
    let next = lowering.builder.ins().iadd_imm_s(index, if two_lanes { 2 } else { 1 });
    let more = lowering.builder.ins().icmp(IntCC::SignedLessThan, next, n);
    lowering.builder.ins().brif(more, body, &[BlockArg::Value(next)], done, []);

    lowering.builder.switch_to_block(done);
    lowering.return_status(0);
    lowering.open_fail_block(late_fail);
    lowering.builder.ins().store(TRUSTED, index, context, Context::POINT);
    lowering.return_fail_status(late_fail);
    lowering.open_fail_block(early_fail);
    lowering.return_fail_status(early_fail);
    lowering.finish();
    Ok(())
}

/// Computes the loop's invariants, which depend on captures alone. Those that the loop uses go to the stack, as a call
/// in the loop keeps no register; two lanes have them twice. Captures stay where they are, or go to registers.
fn invariants<'m>(
    lowering: &mut Lowering<'_, '_, 'm>,
    frame: &mut Frame<'m>,
    shape: KernelShape,
    two_lanes: bool,
    captures: Value,
) -> Result<(), JitError> {
    let function = frame.function;
    let types = function.params[..shape.captures].iter().map(|p| p.ty);
    let (flags, size) = if two_lanes { (PAIRS, 16) } else { (TRUSTED, 8) };
    let captures = lowering.words_at(captures, 0..size, types);
    frame.values[..captures.len()].clone_from_slice(&captures);
    let varying = varying(function, shape.captures);
    for node in function.values().filter(|v| !varying[v.0 as usize]) {
        lowering.demand(frame, node)?;
    }
    let used = used_by(function, &varying);
    let computed = |i: &usize| used[*i] && matches!(frame.values[*i], Lowered::One(_));
    let computed: Vec<usize> = (0..function.nodes.len()).filter(computed).collect();
    let read: Vec<usize> = (0..captures.len()).filter(|i| used[*i] && two_lanes).collect();
    let calls = function.nodes.iter().zip(&varying).any(|(n, varies)| *varies && is_libcall(&n.op, n.ty));
    let in_registers = two_lanes && !calls && computed.len() + read.len() <= MOST_IN_REGISTERS;
    if in_registers {
        for i in read {
            if let Lowered::Stored(base, offset) = frame.values[i] {
                let pair = lowering.builder.ins().load(types::F64X2, PAIRS, base, offset);
                frame.values[i] = Lowered::One(pair);
            }
        }
    }
    if computed.is_empty() {
        return Ok(());
    }
    let bytes = u32::try_from(size as usize * computed.len()).unwrap_or(u32::MAX);
    let slot = StackSlotData::new(StackSlotKind::ExplicitSlot, bytes, 4);
    let slot = lowering.builder.create_sized_stack_slot(slot);
    let base = lowering.builder.ins().stack_addr(types::I64, slot, 0);
    for (offset, i) in (0..).step_by(size as usize).zip(computed) {
        let mut value = lowering.value(&frame.values[i]);
        if two_lanes {
            value = lowering.splat(value);
        }
        frame.values[i] = if in_registers || function.nodes[i].ty != Type::Real {
            Lowered::One(value)
        } else {
            lowering.builder.ins().store(flags, value, base, offset);
            Lowered::Stored(base, offset)
        };
    }
    Ok(())
}

/// Most results that are all computed before the first is stored: their common operands are then loaded once.
const MOST_AT_ONCE: usize = 3;

/// Stores the results of a point; or of two, one after the other, by pairs of words.
fn store<'m>(lowering: &mut Lowering<'_, '_, 'm>, frame: &mut Frame<'m>, place: Value) -> Result<(), JitError> {
    let results = &frame.function.results;
    if !lowering.two_lanes {
        for (offset, result) in (0..).step_by(8).zip(results) {
            let value = lowering.demanded(frame, *result)?;
            lowering.builder.ins().store(TRUSTED, value, place, offset);
        }
        return Ok(());
    }
    if results.len() <= MOST_AT_ONCE {
        for result in results {
            lowering.demand(frame, *result)?;
        }
    }
    let Some(first) = results.first() else { return Ok(()) };
    let first = lowering.demanded(frame, *first)?;
    let first = lowering.bytes(first);
    let (mut before, n) = (first, results.len() as i32);
    // Words k - 1 and k of the first point where k - 1 is even, of the second where it begins at an even word there.
    for (start, result) in (0..).zip(&results[1..]) {
        let value = lowering.demanded(frame, *result)?;
        let value = lowering.bytes(value);
        if start % 2 == 0 {
            let pair = lowering.firsts(before, value);
            lowering.builder.ins().store(PAIRS, pair, place, 8 * start);
        }
        if (start + n) % 2 == 0 {
            let pair = lowering.seconds(before, value);
            lowering.builder.ins().store(PAIRS, pair, place, 8 * (start + n));
        }
        before = value;
    }
    if n % 2 == 1 {
        let pair = if n == 1 { first } else { lowering.outer_lanes(before, first) };
        lowering.builder.ins().store(PAIRS, pair, place, 8 * (n - 1));
    }
    Ok(())
}

/// Adds the results of a point to the sum of the even or of the odd points; or of two points to both sums, which are
/// side by side.
fn accumulate<'m>(
    lowering: &mut Lowering<'_, '_, 'm>,
    frame: &mut Frame<'m>,
    index: Value,
    out: Value,
) -> Result<(), JitError> {
    let (mut place, mut ty) = (out, types::F64X2);
    if !lowering.two_lanes {
        let odd = lowering.builder.ins().band_imm_s(index, 1);
        let offset = lowering.builder.ins().imul_imm_s(odd, 8);
        (place, ty) = (lowering.builder.ins().iadd(out, offset), types::F64);
    }
    for (offset, result) in (0..).step_by(16).zip(&frame.function.results) {
        let value = lowering.demanded(frame, *result)?;
        let sum = lowering.builder.ins().load(ty, PAIRS, place, offset);
        let sum = lowering.builder.ins().fadd(sum, value);
        lowering.builder.ins().store(PAIRS, sum, place, offset);
    }
    Ok(())
}

/// Marks the nodes that depend on more than the captures.
pub(super) fn varying(function: &Function, captures: usize) -> Vec<bool> {
    let mut varying: Vec<bool> = Vec::with_capacity(function.nodes.len());
    for node in &function.nodes {
        let mut any = matches!(node.op, Op::Param(i) if i as usize >= captures);
        node.op.visit_operands(|v| any |= varying[v.0 as usize]);
        varying.push(any);
    }
    varying
}

/// Marks the operands of some nodes, and the results.
fn used_by(function: &Function, users: &[bool]) -> Vec<bool> {
    let mut used = vec![false; function.nodes.len()];
    for (node, _) in function.nodes.iter().zip(users).filter(|(_, user)| **user) {
        node.op.visit_operands(|v| used[v.0 as usize] = true);
    }
    function.results.iter().for_each(|r| used[r.0 as usize] = true);
    used
}
