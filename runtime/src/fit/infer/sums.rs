//! Sums over the rows of all points, and groups of points by key.

use crate::fit::problem::rows::{AllRows, RowPoint, Rows};
use crate::fit::problem::sums::add_square;
use foldhash::fast::FixedState;
use nalgebra::DMatrix;
use std::collections::HashMap;
use std::hash::Hash;

/// Sums over all points of factors times J J^T, by the parameters, shift and turn. `factors` has those of every point
/// of some rows, one for each of the sums.
pub(crate) fn squares<const N: usize>(
    all: &AllRows,
    total: usize,
    factors: impl Fn(&Rows) -> Vec<[f64; N]> + Sync,
) -> [DMatrix<f64>; N] {
    let none = || [(); N].map(|()| DMatrix::zeros(total, total));
    let add = |sums: &mut [DMatrix<f64>; N], rows: &Rows| {
        let count = rows.columns.len();
        let mut squares = [(); N].map(|()| vec![0.0; count * count]);
        for ((_, row), factors) in rows.iter().zip(factors(rows)) {
            squares.iter_mut().zip(factors).for_each(|(square, factor)| add_square(square, factor, row));
        }
        for (sum, square) in sums.iter_mut().zip(&squares) {
            for (a, i) in rows.columns.iter().enumerate() {
                for (b, j) in rows.columns.iter().enumerate().skip(a) {
                    sum[(*j, *i)] += square[a * count + b];
                }
            }
        }
    };
    let mut sums = none();
    all.fold(none, add, |chunk| sums.iter_mut().zip(chunk).for_each(|(sum, part)| *sum += part));
    // Only one triangle was summed.
    sums.iter_mut().for_each(DMatrix::fill_upper_triangle_with_lower_triangle);
    sums
}

/// The contribution of a residual to the gradient of the objective: weight times signed distance, of which J is the
/// direction.
pub(crate) fn score(point: &RowPoint) -> f64 {
    point.weight * point.distance
}

/// Groups of things with the same key, numbered in the order in which they were first met.
pub(crate) struct Groups<K> {
    index: HashMap<K, usize, FixedState>,
    /// The last one that was asked for: neighbours in a list of points are neighbours in space.
    last: Option<(K, usize)>,
}

impl<K> Default for Groups<K> {
    fn default() -> Self {
        Self { index: HashMap::default(), last: None }
    }
}

impl<K: Copy + Eq + Hash> Groups<K> {
    /// The number of a key's group; that of a new group is the number of groups before.
    pub(crate) fn number(&mut self, key: K) -> usize {
        match self.last {
            Some((last, number)) if last == key => number,
            _ => {
                let next = self.index.len();
                let number = *self.index.entry(key).or_insert(next);
                self.last = Some((key, number));
                number
            }
        }
    }
}
