//! Functions as loops over a batch of points.

use super::compiler::{Compiler, JitError, KernelShape, Output};
use super::context::Context;
use super::lower::{Frame, Lowered, Lowering, TRUSTED};
use crate::ir::{Function, Op, Type};
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{BlockArg, InstBuilder, StackSlotData, StackSlotKind, Value, types};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};

/// Builds `(context, uniforms, u, v, w, n, out) -> status`. Nodes that depend on uniforms only are computed once, before
/// the loop.
pub(super) fn build(
    compiler: &mut Compiler<'_>,
    shape: KernelShape,
    context: &mut cranelift_codegen::Context,
    frontend: &mut FunctionBuilderContext,
) -> Result<(), JitError> {
    let mut builder = FunctionBuilder::new(&mut context.func, frontend);
    let entry = builder.create_block();
    builder.append_block_params_for_function_params(entry);
    builder.switch_to_block(entry);
    let &[context, uniforms, u, v, w, n, out] = builder.block_params(entry) else {
        unreachable!("it has this signature")
    };
    let (early_fail, late_fail) = (builder.create_block(), builder.create_block());
    let (some, turn, done) = (builder.create_block(), builder.create_block(), builder.create_block());
    let any = builder.ins().icmp_imm_s(IntCC::SignedGreaterThan, n, 0);
    builder.ins().brif(any, some, [], done, []);

    builder.switch_to_block(some);
    let mut lowering = Lowering::new(compiler, builder, context, early_fail);
    let function = lowering.compiler.module.function(shape.function);
    let mut frame = Frame::new(function);
    before(&mut lowering, &mut frame, shape, uniforms)?;
    let zero = lowering.builder.ins().iconst(types::I64, 0);
    lowering.builder.ins().jump(turn, &[BlockArg::Value(zero)]);

    let index = lowering.builder.append_block_param(turn, types::I64);
    lowering.builder.switch_to_block(turn);
    lowering.fail = late_fail;
    if lowering.compiler.plan.counts_steps(shape.function) {
        let steps = lowering.builder.ins().load(types::I64, TRUSTED, context, Context::STEPS_PER_POINT);
        lowering.builder.ins().store(TRUSTED, steps, context, Context::STEPS);
    }
    find_point(&mut lowering, &mut frame, shape, index, [u, v, w]);
    lowering.anchors(&mut frame)?;
    put(&mut lowering, &mut frame, shape.output, index, out)?;
    let next = lowering.builder.ins().iadd_imm_s(index, 1);
    let more = lowering.builder.ins().icmp(IntCC::SignedLessThan, next, n);
    lowering.builder.ins().brif(more, turn, &[BlockArg::Value(next)], done, []);

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

/// What comes before the loop: what depends on uniforms alone. Reals of it that the loop uses go to the stack.
fn before<'m>(
    lowering: &mut Lowering<'_, '_, 'm>,
    frame: &mut Frame<'m>,
    shape: KernelShape,
    uniforms: Value,
) -> Result<(), JitError> {
    let types = frame.function.params[..shape.uniforms].iter().map(|p| p.ty);
    let uniforms = lowering.words(uniforms, types);
    frame.values[..uniforms.len()].clone_from_slice(&uniforms);
    let varying = varying(frame.function, shape.uniforms);
    for node in frame.function.values().filter(|v| !varying[v.0 as usize]) {
        lowering.demand(frame, node)?;
    }
    let mut kept: Vec<(usize, Value)> = Vec::new();
    for (i, used) in used_by(frame.function, &varying).into_iter().enumerate() {
        if let Lowered::One(value) = frame.values[i]
            && used
            && frame.function.nodes[i].ty == Type::Real
        {
            kept.push((i, value));
        }
    }
    if kept.is_empty() {
        return Ok(());
    }
    let bytes = u32::try_from(8 * kept.len()).unwrap_or(u32::MAX);
    let slot = lowering.builder.create_sized_stack_slot(StackSlotData::new(StackSlotKind::ExplicitSlot, bytes, 3));
    let base = lowering.builder.ins().stack_addr(types::I64, slot, 0);
    for (offset, (i, value)) in (0..).step_by(8).zip(kept) {
        lowering.builder.ins().store(TRUSTED, value, base, offset);
        frame.values[i] = Lowered::Stored(base, offset);
    }
    Ok(())
}

/// What becomes of a point's results: stored at its place, or added to the sums there.
fn put<'m>(
    lowering: &mut Lowering<'_, '_, 'm>,
    frame: &mut Frame<'m>,
    output: Output,
    index: Value,
    out: Value,
) -> Result<(), JitError> {
    let results = &frame.function.results;
    let place = match output {
        Output::Store => {
            let offset = lowering.builder.ins().imul_imm_s(index, 8 * results.len() as i64);
            lowering.builder.ins().iadd(out, offset)
        }
        Output::Accumulate => out,
    };
    for (offset, result) in (0..).step_by(8).zip(results) {
        let mut value = lowering.demanded(frame, *result)?;
        if output == Output::Accumulate {
            let sum = lowering.builder.ins().load(types::F64, TRUSTED, place, offset);
            value = lowering.builder.ins().fadd(sum, value);
        }
        lowering.store_word(place, offset, value);
    }
    Ok(())
}

/// Which nodes depend on more than the first parameters.
pub(super) fn varying(function: &Function, uniforms: usize) -> Vec<bool> {
    let mut varying: Vec<bool> = Vec::with_capacity(function.nodes.len());
    for node in &function.nodes {
        let mut any = matches!(node.op, Op::Param(i) if i as usize >= uniforms);
        node.op.visit_operands(|v| any |= varying[v.0 as usize]);
        varying.push(any);
    }
    varying
}

/// Which nodes those of a set use, and the results are.
pub(super) fn used_by(function: &Function, users: &[bool]) -> Vec<bool> {
    let mut used = vec![false; function.nodes.len()];
    for (node, _) in function.nodes.iter().zip(users).filter(|(_, user)| **user) {
        node.op.visit_operands(|v| used[v.0 as usize] = true);
    }
    function.results.iter().for_each(|r| used[r.0 as usize] = true);
    used
}

/// Where u, v and the weights of the point at an index are.
fn find_point(
    lowering: &mut Lowering<'_, '_, '_>,
    frame: &mut Frame<'_>,
    shape: KernelShape,
    index: Value,
    [u, v, w]: [Value; 3],
) {
    let builder = &mut lowering.builder;
    let offset = builder.ins().imul_imm_s(index, 8);
    let mut places = vec![(builder.ins().iadd(u, offset), 0), (builder.ins().iadd(v, offset), 0)];
    if shape.weights > 0 {
        let offset = builder.ins().imul_imm_s(index, 8 * shape.weights as i64);
        let base = builder.ins().iadd(w, offset);
        places.extend((0..shape.weights as i32).map(|c| (base, 8 * c)));
    }
    for (k, (base, offset)) in places.into_iter().enumerate() {
        frame.values[shape.uniforms + k] = Lowered::Stored(base, offset);
    }
}
