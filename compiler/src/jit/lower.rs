//! IR nodes to Cranelift instructions.

use super::compiler::{Compiler, JitError};
use super::context::{Context, DEPTH};
use super::libcalls::{is_libcall, powers, sincos_pairs};
use super::vector::PAIRS;
use crate::ir::hash::HashMap;
use crate::ir::{self, Function, FunctionId, Op, Type};
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{Block, FuncRef, InstBuilder, MemFlagsData, StackSlot, Value, types};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_module::Module as _;
use std::ops::Range;

mod operations;

/// Memory that generated code touches is there, aligned, and its own.
pub(super) const TRUSTED: MemFlagsData = MemFlagsData::trusted();

/// One function of Cranelift in the making.
pub(super) struct Lowering<'a, 'f, 'm> {
    pub(super) compiler: &'a mut Compiler<'m>,
    pub(super) builder: FunctionBuilder<'f>,
    /// Address of the [`Context`].
    pub(super) context: Value,
    /// The block that takes a status other than 0.
    pub(super) fail: Block,
    /// Reals are pairs of reals and truth values pairs of masks ([`vector`](super::vector)).
    pub(super) two_lanes: bool,
    pub(super) hosts: HashMap<&'static str, FuncRef>,
    pub(super) natives: HashMap<FunctionId, FuncRef>,
    /// Stack slots for arguments and results of calls, by their size in words.
    pub(super) slots: HashMap<(bool, usize), StackSlot>,
}

/// The form of a lowered node.
///
/// A loop over points calls functions, and a call keeps no vector register: a real that lived over it would go to the
/// stack and come back. Reals that are in memory therefore stay there until an instruction uses them (most take an
/// operand from memory), which also leaves the register allocator little to do.
#[derive(Clone, Debug)]
pub(super) enum Lowered {
    /// Not lowered yet.
    Nothing,
    /// A value.
    One(Value),
    /// A real at an address and offset.
    Stored(Value, i32),
    /// A real constant, by its bits.
    Constant(u64),
    /// The results of a branch, loop or call.
    Many(Vec<Value>),
}

/// A function that is being lowered, with the values of its nodes so far.
pub(super) struct Frame<'m> {
    pub(super) function: &'m Function,
    pub(super) values: Vec<Lowered>,
    /// Sine and cosine of the same number, by that.
    pub(super) sincos: HashMap<ir::Value, [ir::Value; 2]>,
    /// Powers and logarithms of the same number, by that.
    pub(super) powers: HashMap<ir::Value, Vec<ir::Value>>,
}

impl<'m> Frame<'m> {
    pub(super) fn new(function: &'m Function) -> Frame<'m> {
        Frame::of_range(function, 0..function.nodes.len())
    }

    /// A frame in which some of the nodes are lowered.
    pub(super) fn of_range(function: &'m Function, range: Range<usize>) -> Frame<'m> {
        let values = vec![Lowered::Nothing; function.nodes.len()];
        Frame { function, values, sincos: sincos_pairs(function, range.clone()), powers: powers(function, range) }
    }

    pub(super) fn is_missing(&self, v: ir::Value) -> bool {
        matches!(self.values[v.0 as usize], Lowered::Nothing)
    }

    /// The forms of some nodes.
    pub(super) fn all(&self, values: &[ir::Value]) -> Vec<Lowered> {
        values.iter().map(|v| self.values[v.0 as usize].clone()).collect()
    }
}

/// Builds `(context, arguments, results) -> status` for a function.
pub(super) fn build_plain(
    compiler: &mut Compiler<'_>,
    id: FunctionId,
    context: &mut cranelift_codegen::Context,
    frontend: &mut FunctionBuilderContext,
) -> Result<(), JitError> {
    let (mut lowering, [arguments, results]) = Lowering::plain(compiler, context, frontend);
    let function = lowering.compiler.module.function(id);
    let arguments = lowering.words(arguments, function.params.iter().map(|p| p.ty));
    let mut frame = Frame::new(function);
    frame.values[..arguments.len()].clone_from_slice(&arguments);
    lowering.pinned_nodes(&mut frame)?;
    for (offset, result) in (0..).step_by(8).zip(&function.results) {
        let value = lowering.demanded(&mut frame, *result)?;
        lowering.store_word(results, offset, value);
    }
    lowering.close_plain();
    Ok(())
}

impl<'a, 'f, 'm> Lowering<'a, 'f, 'm> {
    pub(super) fn new(
        compiler: &'a mut Compiler<'m>,
        builder: FunctionBuilder<'f>,
        context: Value,
        fail: Block,
    ) -> Lowering<'a, 'f, 'm> {
        Lowering {
            compiler,
            builder,
            context,
            fail,
            two_lanes: false,
            hosts: HashMap::default(),
            natives: HashMap::default(),
            slots: HashMap::default(),
        }
    }

    /// Opens a function `(context, arguments, results) -> status`; gives the addresses of arguments and results.
    pub(super) fn plain(
        compiler: &'a mut Compiler<'m>,
        context: &'f mut cranelift_codegen::Context,
        frontend: &'f mut FunctionBuilderContext,
    ) -> (Lowering<'a, 'f, 'm>, [Value; 2]) {
        let mut builder = FunctionBuilder::new(&mut context.func, frontend);
        let entry = builder.create_block();
        builder.append_block_params_for_function_params(entry);
        builder.switch_to_block(entry);
        let &[context, arguments, results] = builder.block_params(entry) else { unreachable!("it has this signature") };
        let fail = builder.create_block();
        let mut lowering = Lowering::new(compiler, builder, context, fail);
        lowering.check_stack();
        (lowering, [arguments, results])
    }

    /// Closes such a function.
    pub(super) fn close_plain(mut self) {
        let fail = self.fail;
        self.return_status(0);
        self.open_fail_block(fail);
        self.return_fail_status(fail);
        self.finish();
    }

    pub(super) fn finish(mut self) {
        self.builder.seal_all_blocks();
        self.builder.finalize(self.compiler.memory.module().target_config());
    }

    /// Lowers a function in place, for these arguments.
    pub(super) fn function(&mut self, function: &'m Function, arguments: &[Lowered]) -> Result<Vec<Lowered>, JitError> {
        let mut frame = Frame::new(function);
        frame.values[..arguments.len()].clone_from_slice(arguments);
        self.pinned_nodes(&mut frame)?;
        for result in &function.results {
            self.demand(&mut frame, *result)?;
        }
        Ok(frame.all(&function.results))
    }

    /// Lowers the nodes of a function that may end it early, in their order, and all calls, with what they need.
    /// Results are to be demanded after them.
    pub(super) fn pinned_nodes(&mut self, frame: &mut Frame<'m>) -> Result<(), JitError> {
        self.pinned_nodes_of(frame, 0..frame.function.nodes.len())
    }

    /// Those of some of a function's nodes.
    pub(super) fn pinned_nodes_of(&mut self, frame: &mut Frame<'m>, range: Range<usize>) -> Result<(), JitError> {
        let function = frame.function;
        self.compiler.spend(&function.name, range.len())?;
        for (i, node) in (range.start as u32..).zip(&function.nodes[range]) {
            let pinned = match &node.op {
                Op::If { .. } | Op::Loop { .. } | Op::Call { .. } | Op::Guard { .. } => true,
                op => is_libcall(op, node.ty),
            };
            if pinned {
                self.demand(frame, ir::Value(i))?;
            }
        }
        Ok(())
    }

    /// Lowers a node with what it needs, where that is still to be done. Values are thus made shortly before they are
    /// used; in the order of a derivative's nodes, which has every value's tangents side by side, most would live at
    /// once.
    pub(super) fn demand(&mut self, frame: &mut Frame<'m>, node: ir::Value) -> Result<(), JitError> {
        let function = frame.function;
        let mut open = vec![node];
        while let Some(&node) = open.last() {
            if !frame.is_missing(node) {
                open.pop();
                continue;
            }
            let ir::Node { op, ty, .. } = &function.nodes[node.0 as usize];
            let first = open.len();
            op.visit_operands(|v| open.extend(frame.is_missing(v).then_some(v)));
            if open.len() == first {
                if !self.joint_call(frame, node, op) {
                    frame.values[node.0 as usize] = self.node(frame, op, *ty)?;
                }
            } else {
                open[first..].reverse();
            }
        }
        Ok(())
    }

    /// The value of a node, which is lowered if need be.
    pub(super) fn demanded(&mut self, frame: &mut Frame<'m>, node: ir::Value) -> Result<Value, JitError> {
        self.demand(frame, node)?;
        Ok(self.value(&frame.values[node.0 as usize]))
    }

    /// The value of a node that is not `Multi`, for an instruction that comes next.
    pub(super) fn value(&mut self, lowered: &Lowered) -> Value {
        match *lowered {
            Lowered::One(value) => value,
            Lowered::Stored(base, offset) => {
                let (ty, flags) = if self.two_lanes { (types::F64X2, PAIRS) } else { (types::F64, TRUSTED) };
                self.builder.ins().load(ty, flags, base, offset)
            }
            Lowered::Constant(bits) => self.constant(f64::from_bits(bits)),
            Lowered::Nothing | Lowered::Many(_) => unreachable!("operands are single values made before their users"),
        }
    }

    pub(super) fn values(&mut self, all: &[Lowered]) -> Vec<Value> {
        all.iter().map(|lowered| self.value(lowered)).collect()
    }

    fn node(&mut self, frame: &Frame<'m>, op: &Op, ty: Type) -> Result<Lowered, JitError> {
        let mut get = |v: &ir::Value| self.value(&frame.values[v.0 as usize]);
        Ok(Lowered::One(match op {
            Op::Param(_) => unreachable!("parameters are there before the nodes"),
            Op::Real(bits) => return Ok(Lowered::Constant(*bits)),
            Op::Int(i) => self.builder.ins().iconst(types::I64, *i),
            Op::Bool(b) => self.truth(*b),
            Op::Unary(op, a) => {
                let a = get(a);
                self.unary(*op, a)
            }
            Op::Binary(op, a, b) => {
                let (a, b) = (get(a), get(b));
                if ty == Type::Real { self.binary(*op, a, b) } else { self.binary_int(*op, a, b) }
            }
            Op::PowInt(a, n) => {
                let a = get(a);
                self.pow_int(a, *n)
            }
            Op::Compare(op, a, b) => {
                let ty = frame.function.ty(*a);
                let (a, b) = (get(a), get(b));
                self.compare(*op, ty, a, b)
            }
            Op::Select(c, a, b) => {
                let (c, a, b) = (get(c), get(a), get(b));
                self.select(c, a, b)
            }
            Op::Guard { value, condition, failure } => {
                let condition = get(condition);
                self.guard(condition, *failure);
                return Ok(frame.values[value.0 as usize].clone());
            }
            Op::Project(multi, k) => match &frame.values[multi.0 as usize] {
                Lowered::Many(values) => values[*k as usize],
                _ => unreachable!("a projection's operand has several values"),
            },
            Op::If { condition, then, otherwise, args } => {
                let condition = get(condition);
                return self.branch(condition, [*then, *otherwise], &frame.all(args)).map(Lowered::Many);
            }
            Op::Loop { count, body, init, invariant } => {
                let count = get(count);
                return self.repeat(count, *body, &frame.all(init), &frame.all(invariant)).map(Lowered::Many);
            }
            Op::Call { function, args } => {
                return self.counted_call(*function, &frame.all(args)).map(Lowered::Many);
            }
            Op::Tangent { .. } => return Err(JitError::Tangent(frame.function.name.clone())),
        }))
    }

    /// Fails where the stack is used up. (The frame is there already; it is no larger than the reserve.)
    fn check_stack(&mut self) {
        let pointer = self.builder.ins().get_stack_pointer(types::I64);
        let limit = self.builder.ins().load(types::I64, TRUSTED, self.context, Context::STACK_LIMIT);
        let enough = self.builder.ins().icmp(IntCC::UnsignedGreaterThanOrEqual, pointer, limit);
        self.require(enough, DEPTH);
    }
}

impl Lowering<'_, '_, '_> {
    /// Values of 64-bit words in memory, side by side, which must not change while they are in use. Reals stay there.
    pub(super) fn words(&mut self, base: Value, types: impl Iterator<Item = Type>) -> Vec<Lowered> {
        self.words_at(base, 0..8, types)
    }

    /// Those that begin at the start of a range of bytes, one every length of it.
    pub(super) fn words_at(
        &mut self,
        base: Value,
        first: Range<i32>,
        types: impl Iterator<Item = Type>,
    ) -> Vec<Lowered> {
        let mut values = Vec::new();
        for (offset, ty) in (first.start..).step_by(first.len()).zip(types) {
            values.push(match ty {
                Type::Real => Lowered::Stored(base, offset),
                _ => Lowered::One(self.load_word(base, offset, ty)),
            });
        }
        values
    }

    /// A value from a 64-bit word in memory.
    pub(super) fn load_word(&mut self, base: Value, offset: i32, ty: Type) -> Value {
        match ty {
            Type::Real => self.builder.ins().load(types::F64, TRUSTED, base, offset),
            Type::Int => self.builder.ins().load(types::I64, TRUSTED, base, offset),
            Type::Bool => {
                let word = self.builder.ins().load(types::I64, TRUSTED, base, offset);
                self.builder.ins().icmp_imm_s(IntCC::NotEqual, word, 0)
            }
            Type::Multi => unreachable!("no parameter or result is Multi"),
        }
    }

    /// Values to 64-bit words in memory.
    pub(super) fn store_all(&mut self, base: Value, values: &[Lowered]) {
        for (i, value) in values.iter().enumerate() {
            let value = self.value(value);
            self.store_word(base, 8 * i as i32, value);
        }
    }

    pub(super) fn store_word(&mut self, base: Value, offset: i32, value: Value) {
        let wide = match self.builder.func.dfg.value_type(value) {
            types::I8 => self.builder.ins().uextend(types::I64, value),
            _ => value,
        };
        self.builder.ins().store(TRUSTED, wide, base, offset);
    }

    pub(super) fn return_status(&mut self, status: i64) {
        let status = self.builder.ins().iconst(types::I32, status);
        self.builder.ins().return_(&[status]);
    }

    /// Returns the status with which a fail block was reached.
    pub(super) fn return_fail_status(&mut self, block: Block) {
        let status = self.builder.block_params(block)[0];
        self.builder.ins().return_(&[status]);
    }

    /// Goes on in a block that others jump to with a status.
    pub(super) fn open_fail_block(&mut self, block: Block) {
        self.builder.append_block_param(block, types::I32);
        self.builder.set_cold_block(block);
        self.builder.switch_to_block(block);
    }
}
