//! What stands between the outer slices of the sandwich estimator: the covariance of the objective's gradient, from the residuals
//! themselves.

use super::blocks::{Blocks, Key};
use crate::fit::problem::objective::Objective;
use crate::fit::problem::rows::{AllRows, Rows};
use crate::fit::problem::sums::{add_scaled, add_square};
use crate::fit::register::proposals::halton;
use foldhash::fast::FixedState;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};
use std::collections::HashMap;

/// Grids over which block sums are averaged: together they act like a triangular kernel (Bartlett's).
const SHIFTS: usize = 4;
/// Numbers that may be kept for the leverages of blocks: 256 MB. Where there are so many blocks, no single one has any to speak of.
const ROOM: usize = 1 << 25;
/// The most that the part of a residual that the fit has taken in is allowed for.
const MOST: f64 = 0.9;

/// Adds an upper triangle by the columns of some rows to the lower one by everything.
pub(crate) fn add_square_at(matrix: &mut DMatrix<f64>, rows: &Rows, square: &[f64]) {
    let count = rows.columns.len();
    for (a, i) in rows.columns.iter().enumerate() {
        for (b, j) in rows.columns.iter().enumerate().skip(a) {
            matrix[(*j, *i)] += square[a * count + b];
        }
    }
}

/// Sum of (pull J) (pull J)^T, for residuals that do not depend on each other. A pull is weight times signed distance, over 1 - h:
/// a point's leverage h = weight J (sum of weight J^T J)^-1 J^T is the part of its residual that the fit has taken in.
/// `leverage` is that inverse. (MacKinnon and White 1985, HC3.)
pub(crate) fn of_points(all: &AllRows, leverage: &DMatrix<f64>) -> DMatrix<f64> {
    let total = leverage.nrows();
    let none = || DMatrix::zeros(total, total);
    let add = |matrix: &mut DMatrix<f64>, rows: &Rows| {
        let inverse = among(leverage, &rows.columns);
        let mut square = vec![0.0; rows.columns.len() * rows.columns.len()];
        for (point, row) in rows.iter() {
            let of_column =
                |(a, r): (usize, &f64)| r * inverse.column(a).iter().zip(row).map(|(m, r)| m * r).sum::<f64>();
            let h = point.weight * row.iter().enumerate().map(of_column).sum::<f64>();
            let pull = point.weight * point.distance / (1.0 - h.clamp(0.0, MOST));
            add_square(&mut square, pull * pull, row);
        }
        add_square_at(matrix, rows, &square);
    };
    let mut filling = none();
    all.fold(none, add, |chunk| filling += chunk);
    filling.fill_upper_triangle_with_lower_triangle();
    filling
}

/// Sum over blocks of (sum of pulls J) (sum of pulls J)^T, the mean over some positions of the grid, with the leverages of the
/// blocks. (Bell and McCaffrey 2002, CR3.)
pub(crate) fn between_blocks(
    objective: &Objective,
    all: &AllRows,
    blocks: Blocks,
    leverage: &DMatrix<f64>,
) -> DMatrix<f64> {
    let total = leverage.nrows();
    let shifts: Vec<DVec3> = (1..=SHIFTS).map(|i| DVec3::new(halton(i, 0), halton(i, 1), halton(i, 2))).collect();
    let widest = objective.space.model.parts().iter().map(|p| p.active.len() + 6).max().unwrap_or(0);
    let squares = blocks.count.saturating_mul(SHIFTS * widest * widest) < ROOM;
    let none = || shifts.iter().map(|_| Grid { squares, ..Grid::default() }).collect::<Vec<Grid>>();
    let add = |grids: &mut Vec<Grid>, rows: &Rows| {
        for (point, row) in rows.iter() {
            let place = objective.points.position[point.index as usize];
            for (shift, grid) in shifts.iter().zip(grids.iter_mut()) {
                let block = grid.block(Blocks::key(blocks.edge, *shift, rows.patch, place), &rows.columns);
                add_scaled(&mut block.sum, point.weight * point.distance, row);
                if squares {
                    add_square(&mut block.square, point.weight, row);
                }
            }
        }
    };
    let mut grids = none();
    all.fold(none, add, |chunk| {
        for (grid, part) in grids.iter_mut().zip(chunk) {
            part.blocks.iter().for_each(|block| grid.block(block.key, &block.columns).add(block));
        }
    });
    let mut filling = DMatrix::zeros(total, total);
    for grid in &grids {
        let count = grid.blocks.len() as f64;
        let scale = blocks.correction * count / (count - 1.0).max(1.0) / SHIFTS as f64;
        for block in &grid.blocks {
            let sum = block.left_out(leverage);
            for (a, i) in block.columns.iter().enumerate() {
                for (b, j) in block.columns.iter().enumerate() {
                    filling[(*i, *j)] += scale * sum[a] * sum[b];
                }
            }
        }
    }
    filling
}

/// The rows and columns of a matrix that belong to some columns.
fn among(matrix: &DMatrix<f64>, columns: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(columns.len(), columns.len(), |a, b| matrix[(columns[a], columns[b])])
}

/// Blocks in the order in which they were first met.
#[derive(Default)]
struct Grid {
    squares: bool,
    index: HashMap<Key, usize, FixedState>,
    /// The last one that was asked for: neighbours in the list are neighbours in space.
    last: Option<(Key, usize)>,
    blocks: Vec<Block>,
}

/// Sums over the points of a block.
struct Block {
    key: Key,
    columns: Vec<usize>,
    /// Of weight times signed distance times J.
    sum: Vec<f64>,
    /// The upper triangle of the sum of weight J^T J, row by row; empty where there is no room for it.
    square: Vec<f64>,
}

impl Grid {
    fn block(&mut self, key: Key, columns: &[usize]) -> &mut Block {
        let slot = match self.last {
            Some((last, slot)) if last == key => slot,
            _ => {
                let next = self.blocks.len();
                let slot = *self.index.entry(key).or_insert(next);
                if slot == next {
                    let square = vec![0.0; if self.squares { columns.len() * columns.len() } else { 0 }];
                    let sum = vec![0.0; columns.len()];
                    self.blocks.push(Block { key, columns: columns.to_vec(), sum, square });
                }
                self.last = Some((key, slot));
                slot
            }
        };
        &mut self.blocks[slot]
    }
}

impl Block {
    fn add(&mut self, other: &Self) {
        add_scaled(&mut self.sum, 1.0, &other.sum);
        add_scaled(&mut self.square, 1.0, &other.square);
    }

    /// The sum as it would be had the fit not seen the block, s + M A s + (M A)^2 s + ..., where M is the block's square and A
    /// `leverage`: sum of w J (1 - H)^-1 d, with H = J A J^T w. The series ends where what is left out would be that of a
    /// leverage above `MOST`.
    fn left_out(&self, leverage: &DMatrix<f64>) -> DVector<f64> {
        let mut sum = DVector::from_column_slice(&self.sum);
        if self.square.is_empty() {
            return sum;
        }
        let count = self.columns.len();
        let square = DMatrix::from_fn(count, count, |a, b| self.square[a.min(b) * count + a.max(b)]);
        let taken_in = square * among(leverage, &self.columns);
        let mut term = sum.clone();
        for _ in 0..(1.0 / (1.0 - MOST)) as usize {
            term = &taken_in * term;
            sum += &term;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn a_block_left_out_moves_the_estimate_as_its_sum_says() {
        // A linear regression: the estimate without a block is the estimate less A s, with the block's corrected sum s.
        const BLOCK: usize = 7;
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let mut number = |_: usize, _: usize| random.random_range(-1.0..1.0);
        let (j, d) = (DMatrix::from_fn(84, 3, &mut number), DMatrix::from_fn(84, 1, &mut number));
        let solve = |j: &DMatrix<f64>, d: &DMatrix<f64>| {
            let inverse = j.tr_mul(j).try_inverse().unwrap();
            (&inverse * j.tr_mul(d), inverse)
        };
        let (estimate, inverse) = solve(&j, &d);
        let residual = &d - &j * &estimate;
        for first in (0..84).step_by(BLOCK) {
            let (own, of_own) = (j.rows(first, BLOCK), residual.rows(first, BLOCK));
            let block = Block {
                key: (0, 0),
                columns: vec![0, 1, 2],
                sum: own.tr_mul(&of_own).as_slice().to_vec(),
                square: own.tr_mul(&own).as_slice().to_vec(),
            };
            let moved = &inverse * block.left_out(&inverse);
            let (without, _) = solve(&j.clone().remove_rows(first, BLOCK), &d.clone().remove_rows(first, BLOCK));
            // Leverages are below 0.4 here, so that the series is exact to 0.4^11.
            assert!((&estimate - moved - &without).amax() < 1e-4 * estimate.amax(), "{first}");
        }
    }
}
