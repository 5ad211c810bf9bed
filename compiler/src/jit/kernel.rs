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
    let mut lowering = Lowering::new(compiler, builder, context, early_fail);
    let function = lowering.compiler.module.function(shape.function);
    let mut frame = Frame::new(function);
    let (some, turn, done) =
        (lowering.builder.create_block(), lowering.builder.create_block(), lowering.builder.create_block());
    let any = lowering.builder.ins().icmp_imm_s(IntCC::SignedGreaterThan, n, 0);
    lowering.builder.ins().brif(any, some, [], done, []);

    // Before the loop.
    lowering.builder.switch_to_block(some);
    load_uniforms(&mut lowering, &mut frame, shape, uniforms);
    let varying = varying(function, shape.uniforms);
    lowering.nodes(&mut frame, |i| !varying[i])?;
    let zero = lowering.builder.ins().iconst(types::I64, 0);
    let mut first = vec![zero];
    if shape.output == Output::Accumulate {
        let real = |k| (types::F64, 8 * k as i32);
        let loads = (0..function.results.len()).map(real);
        first.extend(loads.map(|(ty, offset)| lowering.builder.ins().load(ty, TRUSTED, out, offset)));
    }
    let first: Vec<BlockArg> = first.into_iter().map(BlockArg::Value).collect();
    lowering.builder.ins().jump(turn, &first);

    // A point.
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
    let mut again = vec![lowering.builder.ins().iadd_imm_s(index, 1)];
    match shape.output {
        Output::Store => {
            let offset = lowering.builder.ins().imul_imm_s(index, 8 * results.len() as i64);
            let place = lowering.builder.ins().iadd(out, offset);
            lowering.store_words(place, &results);
        }
        Output::Accumulate => {
            for (sum, result) in sums.iter().zip(&results) {
                again.push(lowering.builder.ins().fadd(*sum, *result));
            }
        }
    }
    let more = lowering.builder.ins().icmp(IntCC::SignedLessThan, again[0], n);
    let last = lowering.builder.create_block();
    let totals = again[1..].to_vec();
    let again: Vec<BlockArg> = again.into_iter().map(BlockArg::Value).collect();
    lowering.builder.ins().brif(more, turn, &again, last, []);
    lowering.builder.switch_to_block(last);
    lowering.store_words(out, &totals);
    lowering.builder.ins().jump(done, []);

    lowering.builder.switch_to_block(done);
    lowering.return_status(0);
    lowering.open_fail_block(late_fail);
    lowering.builder.ins().store(TRUSTED, index, context, Context::POINT);
    let status = lowering.builder.block_params(late_fail)[0];
    lowering.builder.ins().return_(&[status]);
    lowering.open_fail_block(early_fail);
    let status = lowering.builder.block_params(early_fail)[0];
    lowering.builder.ins().return_(&[status]);
    lowering.finish();
    Ok(())
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
