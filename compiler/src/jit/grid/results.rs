//! What becomes of the results of a point of a grid: they are stored, or summed over the row and over the column.

use super::super::compiler::JitError;
use super::super::lower::{Frame, Lowering, TRUSTED};
use super::super::vector::PAIRS;
use super::Grid;
use crate::ir::Value as Node;
use cranelift_codegen::ir::{InstBuilder, Value, types};

/// So many results are computed before the first is stored: what several of them take is then loaded once.
const MOST_AT_ONCE: i32 = 3;

impl Grid {
    pub(super) fn put<'m>(
        &self,
        lowering: &mut Lowering<'_, '_, 'm>,
        frame: &mut Frame<'m>,
        place: Value,
    ) -> Result<(), JitError> {
        for (offset, result) in (0..).step_by(8).zip(&frame.function.results) {
            let value = lowering.demanded(frame, *result)?;
            lowering.builder.ins().store(TRUSTED, value, place, offset);
        }
        Ok(())
    }

    /// Stores the results of two points, one after the other, by pairs of words.
    pub(super) fn put_pairs<'m>(
        &self,
        lowering: &mut Lowering<'_, '_, 'm>,
        frame: &mut Frame<'m>,
        place: Value,
    ) -> Result<(), JitError> {
        let n = self.results as i32;
        let results: Vec<Node> = frame.function.results.clone();
        let store = |lowering: &mut Lowering<'_, '_, 'm>, pair: Value, word: i32| {
            lowering.builder.ins().store(PAIRS, pair, place, 8 * word);
        };
        let Some(first) = results.first() else { return Ok(()) };
        if n <= MOST_AT_ONCE {
            for result in &results {
                lowering.demand(frame, *result)?;
            }
        }
        let first = lowering.demanded(frame, *first)?;
        let mut before = first;
        // Words k and k + 1 of the first point where k is even, of the second one where it begins at an even word there.
        for (k, result) in (0..n).zip(&results).skip(1) {
            let value = lowering.demanded(frame, *result)?;
            let start = k - 1;
            if start % 2 == 0 {
                let pair = lowering.firsts(before, value);
                store(lowering, pair, start);
            }
            if (start + n) % 2 == 0 {
                let pair = lowering.seconds(before, value);
                store(lowering, pair, start + n);
            }
            before = value;
        }
        if n % 2 == 1 {
            let pair = if n == 1 { first } else { lowering.outer_lanes(before, first) };
            store(lowering, pair, n - 1);
        }
        Ok(())
    }

    /// Row sums at the begin of a row: in registers, or in memory, where there are none to be carried.
    pub(super) fn begin_sums(&self, lowering: &mut Lowering<'_, '_, '_>) -> Vec<Value> {
        let Some(sums) = self.shape.row_sums else { return Vec::new() };
        lowering.wide = true;
        let zero = lowering.constant(0.0);
        lowering.wide = false;
        if self.in_registers {
            return vec![zero; sums];
        }
        for k in 0..sums {
            let (slot, offset) = self.sum_place(k);
            lowering.builder.ins().store(PAIRS, zero, slot, offset);
        }
        Vec::new()
    }

    /// Where the two halves of row sum k are.
    fn sum_place(&self, k: usize) -> (Value, i32) {
        let slot = self.slot.unwrap_or(self.out);
        (slot, 16 * (self.pinned.len() + k) as i32)
    }

    /// Adds the results of a point or two to the sums.
    pub(super) fn add<'m>(
        &self,
        lowering: &mut Lowering<'_, '_, 'm>,
        frame: &mut Frame<'m>,
        column: Option<Value>,
        sums: &[Value],
    ) -> Result<Vec<Value>, JitError> {
        let row_sums = self.shape.row_sums.unwrap_or(0);
        let ty = if self.wide { types::F64X2 } else { types::F64 };
        let (mut half, mut of_column) = (self.sum_place(0).0, self.column_sums);
        if let Some(column) = column {
            if !self.wide {
                let odd = lowering.builder.ins().band_imm_s(column, 1);
                let offset = lowering.builder.ins().imul_imm_s(odd, 8);
                half = lowering.builder.ins().iadd(half, offset);
            }
            let per_column = (self.results - row_sums) as i64;
            let offset = lowering.builder.ins().imul_imm_s(column, 8 * per_column);
            of_column = lowering.builder.ins().iadd(of_column, offset);
        }
        let mut made = Vec::new();
        for (k, result) in frame.function.results.clone().into_iter().enumerate() {
            let value = lowering.demanded(frame, result)?;
            if let Some(sum) = sums.get(k) {
                made.push(lowering.builder.ins().fadd(*sum, value));
                continue;
            }
            let (base, offset) = match k.checked_sub(row_sums) {
                Some(k) => (of_column, (8 * self.lanes) as i32 * k as i32),
                None => (half, self.sum_place(k).1),
            };
            let sum = lowering.builder.ins().load(ty, PAIRS, base, offset);
            let sum = lowering.builder.ins().fadd(sum, value);
            lowering.builder.ins().store(PAIRS, sum, base, offset);
        }
        Ok(made)
    }

    /// Writes the sums of a row.
    pub(super) fn end_sums(&self, lowering: &mut Lowering<'_, '_, '_>, row: Value, sums: &[Value]) {
        let Some(count) = self.shape.row_sums else { return };
        let offset = lowering.builder.ins().imul_imm_s(row, 8 * count as i64);
        let place = lowering.builder.ins().iadd(self.out, offset);
        for k in 0..count {
            let halves = match sums.get(k) {
                Some(sum) => [0, 1].map(|lane| lowering.builder.ins().extractlane(*sum, lane)),
                None => {
                    let (slot, offset) = self.sum_place(k);
                    [0, 8].map(|half| lowering.builder.ins().load(types::F64, PAIRS, slot, offset + half))
                }
            };
            let sum = lowering.builder.ins().fadd(halves[0], halves[1]);
            lowering.builder.ins().store(TRUSTED, sum, place, 8 * k as i32);
        }
    }
}
