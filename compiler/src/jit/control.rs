//! Branches, loops, calls and guards.

use super::compiler::JitError;
use super::context::{Context, DEPTH, FIRST_FAILURE, STEPS};
use super::lower::{Lowered, Lowering, TRUSTED};
use crate::ir::{FailureId, FunctionId, Type};
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{
    BlockArg, FuncRef, InstBuilder, StackSlot, StackSlotData, StackSlotKind, Type as ClifType, Value, types,
};
use cranelift_module::Module as _;

impl Lowering<'_, '_, '_> {
    /// Runs one of two bodies.
    pub(super) fn branch(
        &mut self,
        condition: Value,
        bodies: [FunctionId; 2],
        arguments: &[Lowered],
    ) -> Result<Vec<Value>, JitError> {
        let blocks = [self.builder.create_block(), self.builder.create_block()];
        let after = self.builder.create_block();
        let results: Vec<Value> =
            self.result_types(bodies[0]).into_iter().map(|ty| self.builder.append_block_param(after, ty)).collect();
        self.builder.ins().brif(condition, blocks[0], [], blocks[1], []);
        for (block, body) in blocks.into_iter().zip(bodies) {
            self.builder.switch_to_block(block);
            let values = self.body(body, arguments)?;
            let values = self.values(&values);
            self.builder.ins().jump(after, &block_arguments(&values));
        }
        self.builder.switch_to_block(after);
        Ok(results)
    }

    /// Runs a body `count` times: a do-while behind a guard, so that invariants move out of it. Its steps are taken
    /// from the budget before it begins.
    pub(super) fn repeat(
        &mut self,
        count: Value,
        body: FunctionId,
        init: &[Lowered],
        invariant: &[Lowered],
    ) -> Result<Vec<Value>, JitError> {
        let init = self.values(init);
        let (start, iteration, after) =
            (self.builder.create_block(), self.builder.create_block(), self.builder.create_block());
        let index = self.builder.append_block_param(iteration, types::I64);
        let types: Vec<ClifType> = init.iter().map(|v| self.builder.func.dfg.value_type(*v)).collect();
        let carried: Vec<Value> = types.iter().map(|ty| self.builder.append_block_param(iteration, *ty)).collect();
        let results: Vec<Value> = types.iter().map(|ty| self.builder.append_block_param(after, *ty)).collect();

        let any = self.builder.ins().icmp_imm_s(IntCC::SignedGreaterThan, count, 0);
        self.builder.ins().brif(any, start, [], after, &block_arguments(&init));

        self.builder.switch_to_block(start);
        self.take_steps(count);
        let zero = self.builder.ins().iconst(types::I64, 0);
        let first: Vec<Value> = std::iter::once(zero).chain(init.iter().copied()).collect();
        self.builder.ins().jump(iteration, &block_arguments(&first));

        self.builder.switch_to_block(iteration);
        let changing = std::iter::once(index).chain(carried).map(Lowered::One);
        let arguments: Vec<Lowered> = changing.chain(invariant.iter().cloned()).collect();
        let values = self.body(body, &arguments)?;
        let values = self.values(&values);
        let next = self.builder.ins().iadd_imm_s(index, 1);
        let more = self.builder.ins().icmp(IntCC::SignedLessThan, next, count);
        let again: Vec<Value> = std::iter::once(next).chain(values.iter().copied()).collect();
        self.builder.ins().brif(more, iteration, &block_arguments(&again), after, &block_arguments(&values));
        self.builder.switch_to_block(after);
        Ok(results)
    }

    /// Calls a function on the script's behalf: one step, and one level deeper.
    pub(super) fn counted_call(&mut self, function: FunctionId, arguments: &[Lowered]) -> Result<Vec<Value>, JitError> {
        let one = self.builder.ins().iconst(types::I64, 1);
        self.take_steps(one);
        let depth = self.builder.ins().load(types::I64, TRUSTED, self.context, Context::DEPTH);
        let left = self.builder.ins().iadd_imm_s(depth, -1);
        let enough = self.builder.ins().icmp_imm_s(IntCC::SignedGreaterThanOrEqual, left, 0);
        self.require(enough, DEPTH);
        self.builder.ins().store(TRUSTED, left, self.context, Context::DEPTH);
        let results = self.call(function, arguments)?;
        self.builder.ins().store(TRUSTED, depth, self.context, Context::DEPTH);
        Ok(results)
    }

    /// Ends the evaluation with a failure where a condition does not hold.
    pub(super) fn guard(&mut self, condition: Value, failure: FailureId) {
        let condition = self.in_all_lanes(condition);
        self.require(condition, FIRST_FAILURE + i64::from(failure.0));
    }

    /// Ends the evaluation with a status where a condition does not hold.
    pub(super) fn require(&mut self, condition: Value, status: i64) {
        let status = self.builder.ins().iconst(types::I32, status);
        let next = self.builder.create_block();
        self.builder.ins().brif(condition, next, [], self.fail, &[BlockArg::Value(status)]);
        self.builder.switch_to_block(next);
    }

    /// Takes steps (0 or more) from the budget.
    fn take_steps(&mut self, steps: Value) {
        let budget = self.builder.ins().load(types::I64, TRUSTED, self.context, Context::STEPS);
        // Neither is negative: the difference does not overflow.
        let left = self.builder.ins().isub(budget, steps);
        let enough = self.builder.ins().icmp_imm_s(IntCC::SignedGreaterThanOrEqual, left, 0);
        self.require(enough, STEPS);
        self.builder.ins().store(TRUSTED, left, self.context, Context::STEPS);
    }

    /// A body of a branch or loop: in place, or called.
    fn body(&mut self, body: FunctionId, arguments: &[Lowered]) -> Result<Vec<Lowered>, JitError> {
        if self.compiler.plan.is_called(body) {
            return Ok(self.call(body, arguments)?.into_iter().map(Lowered::One).collect());
        }
        let function = self.compiler.module.function(body);
        self.function(function, arguments)
    }

    /// Calls a function's code; its failure is ours.
    fn call(&mut self, id: FunctionId, arguments: &[Lowered]) -> Result<Vec<Value>, JitError> {
        let native = self.native(id)?;
        let function = self.compiler.module.function(id);
        let (types, results) = (function.result_types(), function.results.len());
        let (inputs, outputs) = (self.slot(false, arguments.len()), self.slot(true, results));
        let inputs = self.builder.ins().stack_addr(types::I64, inputs, 0);
        let outputs = self.builder.ins().stack_addr(types::I64, outputs, 0);
        self.store_all(inputs, arguments);
        self.call_native(native, inputs, outputs);
        Ok((0..).zip(types).map(|(i, ty)| self.load_word(outputs, 8 * i, ty)).collect())
    }

    /// Calls code on arguments and results in memory; its failure is ours.
    pub(super) fn call_native(&mut self, native: FuncRef, inputs: Value, outputs: Value) {
        let call = self.builder.ins().call(native, &[self.context, inputs, outputs]);
        let status = self.builder.inst_results(call)[0];
        let next = self.builder.create_block();
        self.builder.ins().brif(status, self.fail, &[BlockArg::Value(status)], next, []);
        self.builder.switch_to_block(next);
    }

    fn native(&mut self, id: FunctionId) -> Result<FuncRef, JitError> {
        if let Some(native) = self.natives.get(&id) {
            return Ok(*native);
        }
        let function = self.compiler.native(id)?;
        let native = self.compiler.memory.module_mut().declare_func_in_func(function, self.builder.func);
        self.natives.insert(id, native);
        Ok(native)
    }

    /// A stack slot of so many words; calls of the same size share theirs, one for arguments and one for results.
    pub(super) fn slot(&mut self, results: bool, words: usize) -> StackSlot {
        let builder = &mut self.builder;
        *self.slots.entry((results, words)).or_insert_with(|| {
            let bytes = u32::try_from(8 * words.max(1)).unwrap_or(u32::MAX);
            builder.create_sized_stack_slot(StackSlotData::new(StackSlotKind::ExplicitSlot, bytes, 3))
        })
    }

    fn result_types(&self, function: FunctionId) -> Vec<ClifType> {
        let types = self.compiler.module.function(function).result_types();
        types.into_iter().map(clif_type).collect()
    }
}

fn clif_type(ty: Type) -> ClifType {
    match ty {
        Type::Real => types::F64,
        Type::Int => types::I64,
        Type::Bool => types::I8,
        Type::Multi => unreachable!("no parameter or result is Multi"),
    }
}

fn block_arguments(values: &[Value]) -> Vec<BlockArg> {
    values.iter().map(|v| BlockArg::Value(*v)).collect()
}
