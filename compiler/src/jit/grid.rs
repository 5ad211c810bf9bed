//! Functions as loops over a grid of points: what was computed once a row and once a column comes from tables.
//!
//! A function whose operations all have instructions for pairs runs on two columns at once. Sums over points are made of two,
//! of the even and of the odd columns, in either case, so that results do not depend on that.

use super::called::is_called;
use super::compiler::{Compiler, JitError};
use super::context::Context;
use super::kernel::{used_by, varying};
use super::lower::{Frame, Lowered, Lowering, TRUSTED};
use super::vector::PAIRS;
use crate::ir::{FunctionId, Type};
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{Block, BlockArg, InstBuilder, StackSlotData, StackSlotKind, Value, types};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use std::mem::offset_of;

mod results;

/// A kernel over a grid: a function `(uniforms.., row values.., column values..) -> results..`, followed by three weights
/// of each point if it sums; all Real.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GridShape {
    /// The function.
    pub function: FunctionId,
    /// How many of its parameters are the same for all points.
    pub uniforms: usize,
    /// How many are of the row.
    pub row_values: usize,
    /// How many are of the column.
    pub column_values: usize,
    /// Results are stored point by point; or, here, so many of them summed over each row and the rest over each column.
    pub row_sums: Option<usize>,
}

impl GridShape {
    /// Weights of a point.
    pub(super) fn weights(&self) -> usize {
        if self.row_sums.is_some() { 3 } else { 0 }
    }

    /// Bytes of what a point has in memory: weights or so many results.
    pub(super) fn point_bytes(&self, results: usize) -> usize {
        // Places count the columns: they differ even where nothing is stored.
        8 * if self.row_sums.is_some() { 3 } else { results.max(1) }
    }

    /// Parameters of the function.
    pub(super) fn params(&self) -> usize {
        self.uniforms + self.row_values + self.column_values + self.weights()
    }
}

/// What generated code gets, by address.
#[repr(C)]
pub(super) struct Arguments {
    pub(super) uniforms: *const f64,
    pub(super) rows: *const f64,
    pub(super) columns: *const f64,
    pub(super) weights: *const f64,
    pub(super) out: *mut f64,
    pub(super) column_sums: *mut f64,
    pub(super) row_count: i64,
    /// Bytes of the points of a row.
    pub(super) row_bytes: i64,
    /// Where in them the last point begins, or the last pair.
    pub(super) last: i64,
}

/// Values of a loop that stay in registers (of which there are 16) at most; else all are in memory.
const MOST_PINNED: usize = 11;

/// Builds `(context, arguments) -> status`.
pub(super) fn build(
    compiler: &mut Compiler<'_>,
    shape: GridShape,
    wide: bool,
    context: &mut cranelift_codegen::Context,
    frontend: &mut FunctionBuilderContext,
) -> Result<(), JitError> {
    let mut builder = FunctionBuilder::new(&mut context.func, frontend);
    let entry = builder.create_block();
    builder.append_block_params_for_function_params(entry);
    builder.switch_to_block(entry);
    let &[context, arguments] = builder.block_params(entry) else { unreachable!("it has this signature") };
    let fail = builder.create_block();
    let mut lowering = Lowering::new(compiler, builder, context, fail);
    let function = lowering.compiler.module.function(shape.function);
    let mut frame = Frame::new(function);
    let mut grid = Grid::new(&mut lowering, &frame, shape, wide, arguments);
    grid.before(&mut lowering, &mut frame)?;
    let (turn, done) = (lowering.builder.create_block(), lowering.builder.create_block());
    let zero = lowering.builder.ins().iconst(types::I64, 0);
    lowering.builder.ins().jump(turn, &[BlockArg::Value(zero)]);
    let row = lowering.builder.append_block_param(turn, types::I64);
    lowering.builder.switch_to_block(turn);
    grid.row(&mut lowering, &mut frame, row)?;
    let next = lowering.builder.ins().iadd_imm_s(row, 1);
    let more = lowering.builder.ins().icmp(IntCC::SignedLessThan, next, grid.row_count);
    lowering.builder.ins().brif(more, turn, &[BlockArg::Value(next)], done, []);
    lowering.builder.switch_to_block(done);
    lowering.return_status(0);
    lowering.open_fail_block(fail);
    lowering.return_fail_status(fail);
    lowering.finish();
    Ok(())
}

/// The loops in the making.
struct Grid {
    shape: GridShape,
    wide: bool,
    /// Columns at once.
    lanes: i64,
    results: usize,
    /// What the columns' loop needs of uniforms and row values as pairs; whether it is kept in registers.
    pinned: Vec<usize>,
    in_registers: bool,
    /// Room for what is not: 16 bytes for each node of `pinned`, then for each row sum.
    slot: Option<Value>,
    uniforms: Value,
    rows: Value,
    columns: Value,
    weights: Value,
    out: Value,
    column_sums: Value,
    row_count: Value,
    row_bytes: Value,
    last: Value,
}

/// Where the loop over the columns is.
#[derive(Clone, Copy)]
struct Place {
    /// Address of the values of the column or columns.
    table: Value,
    /// Address of the results or weights of the point or points.
    point: Value,
    /// The column's number, where it is needed.
    column: Option<Value>,
}

/// Addresses in a row: of its first point, of the last one or two that are computed at once, and behind it.
struct RowPlace {
    first: Value,
    last: Value,
    end: Value,
}

impl Grid {
    fn new(lowering: &mut Lowering<'_, '_, '_>, frame: &Frame<'_>, shape: GridShape, wide: bool, base: Value) -> Grid {
        let mut load = |offset: usize| lowering.builder.ins().load(types::I64, TRUSTED, base, offset as i32);
        let uniforms = load(offset_of!(Arguments, uniforms));
        let rows = load(offset_of!(Arguments, rows));
        let columns = load(offset_of!(Arguments, columns));
        let weights = load(offset_of!(Arguments, weights));
        let out = load(offset_of!(Arguments, out));
        let column_sums = load(offset_of!(Arguments, column_sums));
        let row_count = load(offset_of!(Arguments, row_count));
        let row_bytes = load(offset_of!(Arguments, row_bytes));
        let last = load(offset_of!(Arguments, last));
        let function = frame.function;
        let of_points = varying(function, shape.uniforms);
        let used = used_by(function, &of_points);
        let of_row = shape.uniforms..shape.uniforms + shape.row_values;
        let pinned = |i: &usize| used[*i] && (!of_points[*i] || of_row.contains(i));
        let pinned: Vec<usize> = (0..function.nodes.len()).filter(pinned).collect();
        let sums = shape.row_sums.unwrap_or(0);
        // No register keeps its pair over a call.
        let calls = function.nodes.iter().zip(&of_points).any(|(n, varies)| *varies && is_called(&n.op, n.ty));
        let in_registers = wide && !calls && pinned.len() + sums <= MOST_PINNED;
        let words = pinned.len() + sums;
        let slot = (words > 0).then(|| {
            let bytes = u32::try_from(16 * words).unwrap_or(u32::MAX);
            let slot = StackSlotData::new(StackSlotKind::ExplicitSlot, bytes, 4);
            let slot = lowering.builder.create_sized_stack_slot(slot);
            lowering.builder.ins().stack_addr(types::I64, slot, 0)
        });
        Grid {
            shape,
            wide,
            lanes: if wide { 2 } else { 1 },
            results: function.results.len(),
            pinned,
            in_registers,
            slot,
            uniforms,
            rows,
            columns,
            weights,
            out,
            column_sums,
            row_count,
            row_bytes,
            last,
        }
    }

    /// What comes before the loops: what depends on uniforms alone.
    fn before<'m>(&self, lowering: &mut Lowering<'_, '_, 'm>, frame: &mut Frame<'m>) -> Result<(), JitError> {
        let types = frame.function.params[..self.shape.uniforms].iter().map(|p| p.ty);
        let uniforms = lowering.words(self.uniforms, types);
        frame.values[..uniforms.len()].clone_from_slice(&uniforms);
        let of_points = varying(frame.function, self.shape.uniforms);
        for node in frame.function.values().filter(|v| !of_points[v.0 as usize]) {
            lowering.demand(frame, node)?;
        }
        for (k, node) in self.pinned.iter().enumerate().filter(|(_, i)| !of_points[**i]) {
            if !matches!(frame.values[*node], Lowered::Constant(_) | Lowered::Many(_)) {
                let value = lowering.value(&frame.values[*node]);
                frame.values[*node] = self.pin(lowering, k, frame.function.nodes[*node].ty, value);
            }
        }
        Ok(())
    }

    /// A value for the columns' loop.
    fn pin(&self, lowering: &mut Lowering<'_, '_, '_>, k: usize, ty: Type, value: Value) -> Lowered {
        let wide = if self.wide { lowering.widened(value) } else { value };
        match self.slot {
            Some(slot) if !self.in_registers && ty == Type::Real => {
                let offset = 16 * k as i32;
                lowering.builder.ins().store(PAIRS, wide, slot, offset);
                Lowered::Stored(slot, offset)
            }
            _ => Lowered::One(wide),
        }
    }

    /// One row.
    fn row<'m>(
        &mut self,
        lowering: &mut Lowering<'_, '_, 'm>,
        frame: &mut Frame<'m>,
        row: Value,
    ) -> Result<(), JitError> {
        let offset = lowering.builder.ins().imul_imm_s(row, 8 * self.shape.row_values as i64);
        let values = lowering.builder.ins().iadd(self.rows, offset);
        for (k, node) in self.pinned.iter().enumerate().filter(|(_, i)| **i >= self.shape.uniforms) {
            if let Some(position) = node.checked_sub(self.shape.uniforms).filter(|p| *p < self.shape.row_values) {
                let value = lowering.builder.ins().load(types::F64, TRUSTED, values, 8 * position as i32);
                frame.values[*node] = self.pin(lowering, k, Type::Real, value);
            }
        }
        let place = self.row_place(lowering, row);
        let (turn, after) = (lowering.builder.create_block(), lowering.builder.create_block());
        let sums = self.begin_sums(lowering);
        let zero = self.numbers_columns().then(|| lowering.builder.ins().iconst(types::I64, 0));
        let start = [self.columns, place.first].into_iter().chain(zero).chain(sums.iter().copied());
        let start: Vec<BlockArg> = start.map(BlockArg::Value).collect();
        lowering.builder.ins().jump(turn, &start);
        let mut address = || lowering.builder.append_block_param(turn, types::I64);
        let at = Place { table: address(), point: address(), column: zero.map(|_| address()) };
        let carried: Vec<Value> =
            sums.iter().map(|_| lowering.builder.append_block_param(turn, types::F64X2)).collect();
        let results: Vec<Value> =
            sums.iter().map(|_| lowering.builder.append_block_param(after, types::F64X2)).collect();
        lowering.builder.switch_to_block(turn);
        lowering.wide = self.wide;
        let made = self.column(lowering, frame, at, &carried)?;
        lowering.wide = false;
        self.next(lowering, at, &place, made, [turn, after]);
        lowering.builder.switch_to_block(after);
        self.end_sums(lowering, row, &results);
        Ok(())
    }

    /// Where the points of a row are.
    fn row_place(&self, lowering: &mut Lowering<'_, '_, '_>, row: Value) -> RowPlace {
        let builder = &mut lowering.builder;
        let offset = builder.ins().imul(row, self.row_bytes);
        let points = if self.shape.row_sums.is_some() { self.weights } else { self.out };
        let first = builder.ins().iadd(points, offset);
        let [last, end] = [self.last, self.row_bytes].map(|offset| builder.ins().iadd(first, offset));
        RowPlace { first, last, end }
    }

    /// Whether sums need to know the column: there are sums of columns, or of even and of odd ones.
    fn numbers_columns(&self) -> bool {
        self.shape.row_sums.is_some_and(|sums| !self.wide || sums < self.results)
    }

    /// Goes to the next columns, or on.
    fn next(
        &self,
        lowering: &mut Lowering<'_, '_, '_>,
        at: Place,
        of_row: &RowPlace,
        made: Vec<Value>,
        [turn, after]: [Block; 2],
    ) {
        let builder = &mut lowering.builder;
        let next = builder.ins().iadd_imm_s(at.point, self.lanes * self.shape.point_bytes(self.results) as i64);
        let table = builder.ins().iadd_imm_s(at.table, 8 * self.lanes * self.shape.column_values as i64);
        let column = at.column.map(|column| builder.ins().iadd_imm_s(column, self.lanes));
        let made: Vec<BlockArg> = made.into_iter().map(BlockArg::Value).collect();
        let again = |point: Value| -> Vec<BlockArg> {
            let at = [table, point].into_iter().chain(column).map(BlockArg::Value);
            at.chain(made.iter().copied()).collect()
        };
        let more = builder.ins().icmp(IntCC::UnsignedLessThanOrEqual, next, of_row.last);
        if !self.wide || self.shape.row_sums.is_some() {
            builder.ins().brif(more, turn, &again(next), after, &made);
            return;
        }
        // The last pair of an odd number is of the last two columns.
        let odd = builder.create_block();
        builder.ins().brif(more, turn, &again(next), odd, []);
        builder.switch_to_block(odd);
        let more = builder.ins().icmp(IntCC::UnsignedLessThan, next, of_row.end);
        builder.ins().brif(more, turn, &again(of_row.last), after, &made);
    }

    /// The point or points at a column. Returns the sums that are in registers.
    fn column<'m>(
        &self,
        lowering: &mut Lowering<'_, '_, 'm>,
        frame: &mut Frame<'m>,
        at: Place,
        sums: &[Value],
    ) -> Result<Vec<Value>, JitError> {
        if lowering.compiler.plan.counts_steps(self.shape.function) {
            let context = lowering.context;
            let steps = lowering.builder.ins().load(types::I64, TRUSTED, context, Context::STEPS_PER_POINT);
            lowering.builder.ins().store(TRUSTED, steps, context, Context::STEPS);
        }
        let params = self.shape.uniforms + self.shape.row_values;
        for k in 0..self.shape.column_values {
            frame.values[params + k] = Lowered::Stored(at.table, (8 * self.lanes) as i32 * k as i32);
        }
        if self.shape.row_sums.is_some() {
            let weights = self.point_weights(lowering, at.point);
            frame.values[params + self.shape.column_values..][..3].clone_from_slice(&weights);
        }
        lowering.anchors(frame)?;
        if self.shape.row_sums.is_some() {
            return self.add(lowering, frame, at.column, sums);
        }
        if self.wide {
            self.put_pairs(lowering, frame, at.point)?
        } else {
            self.put(lowering, frame, at.point)?
        }
        Ok(Vec::new())
    }

    /// The weights of the point or points at a place.
    fn point_weights(&self, lowering: &mut Lowering<'_, '_, '_>, base: Value) -> [Lowered; 3] {
        if !self.wide {
            return [0, 8, 16].map(|offset| Lowered::Stored(base, offset));
        }
        // x y, z x', y' z'
        let [xy, zx, yz] = [0, 16, 32].map(|o| lowering.builder.ins().load(types::F64X2, PAIRS, base, o));
        let (x, y, z) = (lowering.outer_lanes(xy, zx), lowering.inner_lanes(xy, yz), lowering.outer_lanes(zx, yz));
        [x, y, z].map(Lowered::One)
    }
}
