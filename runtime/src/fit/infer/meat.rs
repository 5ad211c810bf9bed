//! The meat of the sandwich estimator: the covariance of the objective's gradient, from the residuals themselves.

use super::blocks::{Blocks, Key};
use super::sums::{Groups, score, squares};
use crate::fit::problem::objective::Objective;
use crate::fit::problem::rows::{AllRows, RowPoint, Rows};
use crate::fit::problem::sums::{add_scaled, add_square};
use crate::fit::tuning::{BLOCK_GRIDS, BLOCK_ROOM, LEVERAGE_CAP};
use crate::sampling::halton;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

/// Sum of (score J) (score J)^T, for residuals that do not depend on each other. Scores are divided by 1 - h: a point's
/// leverage h = weight J (sum of weight J^T J)^-1 J^T is the part of its residual that the fit has absorbed. `inverse`
/// is that inverse (MacKinnon and White 1985, HC3).
pub(crate) fn of_points(all: &AllRows, inverse: &DMatrix<f64>) -> DMatrix<f64> {
    let squared = |rows: &Rows| {
        let inverse = among(inverse, &rows.columns);
        let of_point = |(point, row): (&RowPoint, &[f64])| {
            let of_column =
                |(a, r): (usize, &f64)| r * inverse.column(a).iter().zip(row).map(|(m, r)| m * r).sum::<f64>();
            let h = point.weight * row.iter().enumerate().map(of_column).sum::<f64>();
            let corrected = score(point) / (1.0 - h.clamp(0.0, LEVERAGE_CAP));
            [corrected * corrected]
        };
        rows.iter().map(of_point).collect()
    };
    let [meat] = squares(all, inverse.nrows(), squared);
    meat
}

/// Sum over blocks of (sum of scores J) (sum of scores J)^T, the mean over some positions of the grid, with the
/// leverages of the blocks (Bell and McCaffrey 2002, CR3). `inverse` as in `of_points`.
pub(crate) fn of_blocks(objective: &Objective, all: &AllRows, blocks: Blocks, inverse: &DMatrix<f64>) -> DMatrix<f64> {
    let total = inverse.nrows();
    let shifts: Vec<DVec3> = (1..=BLOCK_GRIDS).map(|i| DVec3::new(halton(i, 0), halton(i, 1), halton(i, 2))).collect();
    let widest = objective.space.model.parts().iter().map(|p| p.active.len() + 6).max().unwrap_or(0);
    let leverages = blocks.count.saturating_mul(BLOCK_GRIDS * widest * widest) < BLOCK_ROOM;
    let none = || shifts.iter().map(|_| Grid { leverages, ..Grid::default() }).collect::<Vec<Grid>>();
    let add = |grids: &mut Vec<Grid>, rows: &Rows| {
        for (point, row) in rows.iter() {
            let position = objective.points.position[point.index as usize];
            for (shift, grid) in shifts.iter().zip(grids.iter_mut()) {
                let block = grid.block(Blocks::key(blocks.edge, *shift, rows.patch, position), &rows.columns);
                add_scaled(&mut block.sum, score(point), row);
                if leverages {
                    add_square(&mut block.square, point.weight, row);
                }
            }
        }
    };
    let mut grids = none();
    all.fold(none, add, |chunk| {
        for (grid, part) in grids.iter_mut().zip(chunk) {
            for other in &part.blocks {
                let block = grid.block(other.key, &other.columns);
                add_scaled(&mut block.sum, 1.0, &other.sum);
                add_scaled(&mut block.square, 1.0, &other.square);
            }
        }
    });
    let mut meat = DMatrix::zeros(total, total);
    for grid in &grids {
        let count = grid.blocks.len() as f64;
        let scale = blocks.correction * count / (count - 1.0).max(1.0) / BLOCK_GRIDS as f64;
        for block in &grid.blocks {
            let sum = block.left_out(inverse);
            for (a, i) in block.columns.iter().enumerate() {
                for (b, j) in block.columns.iter().enumerate() {
                    meat[(*i, *j)] += scale * sum[a] * sum[b];
                }
            }
        }
    }
    meat
}

/// The rows and columns of a matrix that belong to some columns.
fn among(matrix: &DMatrix<f64>, columns: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(columns.len(), columns.len(), |a, b| matrix[(columns[a], columns[b])])
}

/// The blocks of one position of the grid, in the order in which they were first met.
#[derive(Default)]
struct Grid {
    /// Whether there is room for the squares from which leverages follow.
    leverages: bool,
    groups: Groups<Key>,
    blocks: Vec<Block>,
}

/// Sums over the points of a block.
struct Block {
    key: Key,
    columns: Vec<usize>,
    /// Sum of score times J.
    sum: Vec<f64>,
    /// The upper triangle of the sum of weight J^T J, row by row; empty where there is no room for it.
    square: Vec<f64>,
}

impl Grid {
    fn block(&mut self, key: Key, columns: &[usize]) -> &mut Block {
        let number = self.groups.number(key);
        if number == self.blocks.len() {
            let square = vec![0.0; if self.leverages { columns.len() * columns.len() } else { 0 }];
            self.blocks.push(Block { key, columns: columns.to_vec(), sum: vec![0.0; columns.len()], square });
        }
        debug_assert_eq!(self.blocks[number].columns, columns, "a block is of one patch, whose rows are alike");
        &mut self.blocks[number]
    }
}

impl Block {
    /// The sum as it would be had the fit not seen the block, s + M A s + (M A)^2 s + ..., where M is the block's
    /// square and A the inverse of all squares' sum: sum of w J (1 - H)^-1 d, with H = J A J^T w. The series ends where
    /// the rest would be that of a leverage above the cap.
    fn left_out(&self, inverse: &DMatrix<f64>) -> DVector<f64> {
        let mut sum = DVector::from_column_slice(&self.sum);
        if self.square.is_empty() {
            return sum;
        }
        let count = self.columns.len();
        let square = DMatrix::from_fn(count, count, |a, b| self.square[a.min(b) * count + a.max(b)]);
        let absorbed = square * among(inverse, &self.columns);
        let mut term = sum.clone();
        for _ in 0..(1.0 / (1.0 - LEVERAGE_CAP)) as usize {
            term = &absorbed * term;
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
