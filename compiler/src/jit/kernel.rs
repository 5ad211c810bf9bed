//! Functions as loops over a batch of points.

use super::compiler::{Compiler, JitError, KernelShape, Output};
use super::context::Context;
use super::lower::{Frame, Lowered, Lowering, TRUSTED};
use crate::ir::{Function, Op};
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{BlockArg, InstBuilder, Value, types};
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
    let first = before(&mut lowering, &mut frame, shape, uniforms, out)?;
    lowering.builder.ins().jump(turn, &first);

    let index = lowering.builder.append_block_param(turn, types::I64);
    let sums: Vec<Value> = (1..first.len()).map(|_| lowering.builder.append_block_param(turn, types::F64)).collect();
    lowering.builder.switch_to_block(turn);
    lowering.fail = late_fail;
    if lowering.compiler.plan.counts_steps(shape.function) {
        let steps = lowering.builder.ins().load(types::I64, TRUSTED, context, Context::STEPS_PER_POINT);
        lowering.builder.ins().store(TRUSTED, steps, context, Context::STEPS);
    }
    load_point(&mut lowering, &mut frame, shape, index, [u, v, w]);
    lowering.nodes(&mut frame, |_| true)?;
    let results = frame.all(&function.results);
    let totals = put(&mut lowering, shape.output, &results, &sums, index, out);
    let next = lowering.builder.ins().iadd_imm_s(index, 1);
    let more = lowering.builder.ins().icmp(IntCC::SignedLessThan, next, n);
    let again: Vec<BlockArg> = std::iter::once(next).chain(totals.iter().copied()).map(BlockArg::Value).collect();
    let last = lowering.builder.create_block();
    lowering.builder.ins().brif(more, turn, &again, last, []);
    lowering.builder.switch_to_block(last);
    lowering.store_words(out, &totals);
    lowering.builder.ins().jump(done, []);

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

/// What comes before the loop: uniforms, and what depends on them alone. Returns what the loop starts with: the index
/// of the first point, and the sums so far where it accumulates.
fn before<'m>(
    lowering: &mut Lowering<'_, '_, 'm>,
    frame: &mut Frame<'m>,
    shape: KernelShape,
    uniforms: Value,
    out: Value,
) -> Result<Vec<BlockArg>, JitError> {
    load_uniforms(lowering, frame, shape, uniforms);
    let varying = varying(frame.function, shape.uniforms);
    lowering.nodes(frame, |i| !varying[i])?;
    let mut first = vec![lowering.builder.ins().iconst(types::I64, 0)];
    if shape.output == Output::Accumulate {
        let types = frame.function.result_types();
        first.extend(lowering.load_words(out, types.into_iter()));
    }
    Ok(first.into_iter().map(BlockArg::Value).collect())
}

/// What becomes of a point's results: stored at its place, or added to the sums, which are returned.
fn put(
    lowering: &mut Lowering<'_, '_, '_>,
    output: Output,
    results: &[Value],
    sums: &[Value],
    index: Value,
    out: Value,
) -> Vec<Value> {
    match output {
        Output::Store => {
            let offset = lowering.builder.ins().imul_imm_s(index, 8 * results.len() as i64);
            let place = lowering.builder.ins().iadd(out, offset);
            lowering.store_words(place, results);
            Vec::new()
        }
        Output::Accumulate => {
            sums.iter().zip(results).map(|(sum, result)| lowering.builder.ins().fadd(*sum, *result)).collect()
        }
    }
}

/// Which nodes depend on more than the first parameters.
fn varying(function: &Function, uniforms: usize) -> Vec<bool> {
    let mut varying: Vec<bool> = Vec::with_capacity(function.nodes.len());
    for node in &function.nodes {
        let mut any = matches!(node.op, Op::Param(i) if i as usize >= uniforms);
        node.op.visit_operands(|v| any |= varying[v.0 as usize]);
        varying.push(any);
    }
    varying
}

fn load_uniforms(lowering: &mut Lowering<'_, '_, '_>, frame: &mut Frame<'_>, shape: KernelShape, uniforms: Value) {
    let types = frame.function.params[..shape.uniforms].iter().map(|p| p.ty);
    for (i, value) in lowering.load_words(uniforms, types).into_iter().enumerate() {
        frame.values[i] = Lowered::One(value);
    }
}

/// Loads u, v and the weights of the point at an index.
fn load_point(
    lowering: &mut Lowering<'_, '_, '_>,
    frame: &mut Frame<'_>,
    shape: KernelShape,
    index: Value,
    [u, v, w]: [Value; 3],
) {
    let builder = &mut lowering.builder;
    let offset = builder.ins().imul_imm_s(index, 8);
    let mut loads = vec![(u, offset, 0), (v, offset, 0)];
    if shape.weights {
        let offset = builder.ins().imul_imm_s(index, 24);
        loads.extend((0..3).map(|c| (w, offset, 8 * c)));
    }
    for (k, (base, offset, component)) in loads.into_iter().enumerate() {
        let address = builder.ins().iadd(base, offset);
        let value = builder.ins().load(types::F64, TRUSTED, address, component);
        frame.values[shape.uniforms + k] = Lowered::One(value);
    }
}
