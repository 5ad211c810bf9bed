//! Grids of points that are sums of products, without code of their own: four columns at once, with whatever vectors the machine has.
//!
//! Cranelift's vectors have two lanes, and points of three coordinates have to be shuffled into place for them. Here what is
//! multiplied stands in memory as the results do, x y z x y z .., so that any width fits and nothing is shuffled. Operations and their
//! order are those of the function, so that results are the same to the bit.

use crate::ir::products::MOST_TERMS;

/// Coordinates of so many columns at once.
const COLUMNS: usize = 4;

/// What belongs to the coordinates of [`COLUMNS`] points.
type Block = [f64; 3 * COLUMNS];

/// Of the values of columns those that are `terms`, as [`run`] takes them: for every four columns a block for each term. The last four
/// of a number that four does not divide are the last ones; of fewer than four the last is repeated.
#[must_use]
pub fn blocks_of_columns(terms: impl Iterator<Item = usize> + Clone, columns: &[f64], values: usize) -> Vec<f64> {
    let count = columns.len().checked_div(values).unwrap_or(0);
    let mut blocks = Vec::new();
    for first in first_columns(count) {
        for value in terms.clone() {
            for k in 0..COLUMNS {
                let column = (first + k).min(count - 1);
                blocks.extend([columns[column * values + value]; 3]);
            }
        }
    }
    blocks
}

/// The first of every four columns.
fn first_columns(count: usize) -> impl Iterator<Item = usize> {
    (0..count).step_by(COLUMNS).map(move |first| first.min(count.saturating_sub(COLUMNS)))
}

/// Evaluates the points of a grid of `count` columns: sums of so many terms and, if there is one, a constant. `rows` has three
/// factors for each of them, row after row; `columns` the blocks.
///
/// # Panics
/// If a slice has another length than this says.
pub fn run(terms: usize, constant: bool, rows: &[f64], (columns, count): (&[f64], usize), out: &mut [f64]) {
    assert_eq!(columns.len(), count.div_ceil(COLUMNS) * terms * 3 * COLUMNS, "blocks of columns");
    let row_values = 3 * (terms + usize::from(constant));
    assert_eq!(out.len() * row_values, rows.len() * 3 * count, "coordinates of all rows");
    let run = match (terms, constant) {
        (1, false) => evaluate::<1, false>,
        (1, true) => evaluate::<1, true>,
        (2, false) => evaluate::<2, false>,
        (2, true) => evaluate::<2, true>,
        (3, false) => evaluate::<3, false>,
        (3, true) => evaluate::<3, true>,
        (MOST_TERMS, false) => evaluate::<MOST_TERMS, false>,
        (MOST_TERMS, true) => evaluate::<MOST_TERMS, true>,
        _ => panic!("as many terms as are recognized"),
    };
    let (blocks, _) = columns.as_chunks::<{ 3 * COLUMNS }>();
    let (rows, _) = rows.as_chunks::<3>();
    run(rows, blocks, 3 * count, out);
}

/// Of the terms and then of the constant.
type Factors = [Block; MOST_TERMS + 1];

/// All rows, each of so many coordinates, with the widest vectors that there are.
fn evaluate<const TERMS: usize, const CONSTANT: bool>(
    rows: &[[f64; 3]],
    columns: &[Block],
    coordinates: usize,
    out: &mut [f64],
) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx") {
        // SAFETY: the machine has what the function is compiled for.
        return unsafe { avx::evaluate::<TERMS, CONSTANT>(rows, columns, coordinates, out) };
    }
    for (row, out) in rows.chunks_exact(TERMS + usize::from(CONSTANT)).zip(out.chunks_exact_mut(coordinates.max(1))) {
        let factors = factors(row);
        evaluate_row(columns, out, |columns: &[Block; TERMS]| sums::<TERMS, CONSTANT>(&factors, columns));
    }
}

/// The factors of a row, as many times as a block has columns.
#[inline(always)]
fn factors(row: &[[f64; 3]]) -> Factors {
    let mut factors = [[0.0; 3 * COLUMNS]; MOST_TERMS + 1];
    for (block, [x, y, z]) in factors.iter_mut().zip(row) {
        *block = [*x, *y, *z, *x, *y, *z, *x, *y, *z, *x, *y, *z];
    }
    factors
}

/// The blocks of a row, one after the other.
#[inline(always)]
fn evaluate_row<const TERMS: usize>(columns: &[Block], out: &mut [f64], sums: impl Fn(&[Block; TERMS]) -> Block) {
    let (columns, _) = columns.as_chunks::<TERMS>();
    let (whole, rest) = out.as_chunks_mut::<{ 3 * COLUMNS }>();
    let (even, last) = columns.split_at(whole.len().min(columns.len()));
    for (points, columns) in whole.iter_mut().zip(even) {
        *points = sums(columns);
    }
    if let ([columns], false) = (last, rest.is_empty()) {
        let (points, n) = (sums(columns), out.len());
        // Fewer columns than a block has: its first ones. Else the last four.
        match n.checked_sub(points.len()) {
            Some(start) => out[start..].copy_from_slice(&points),
            None => out.copy_from_slice(&points[..n]),
        }
    }
}

/// The coordinates of a block of points.
fn sums<const TERMS: usize, const CONSTANT: bool>(factors: &Factors, columns: &[Block; TERMS]) -> Block {
    std::array::from_fn(|k| {
        let products = columns.iter().zip(factors).map(|(column, factor)| column[k] * factor[k]);
        let sum = products.reduce(|sum, product| sum + product).unwrap_or(0.0);
        if CONSTANT { sum + factors[TERMS][k] } else { sum }
    })
}

/// Vectors of four.
#[cfg(target_arch = "x86_64")]
mod avx {
    use super::{Block, evaluate_row, factors};
    use std::arch::x86_64::{__m256d, _mm256_add_pd, _mm256_loadu_pd, _mm256_mul_pd, _mm256_storeu_pd};

    #[target_feature(enable = "avx")]
    pub(super) fn evaluate<const TERMS: usize, const CONSTANT: bool>(
        rows: &[[f64; 3]],
        columns: &[Block],
        coordinates: usize,
        out: &mut [f64],
    ) {
        let rows = rows.chunks_exact(TERMS + usize::from(CONSTANT));
        for (row, out) in rows.zip(out.chunks_exact_mut(coordinates.max(1))) {
            let factors = factors(row).each_ref().map(|block| loaded(block));
            evaluate_row(columns, out, |columns: &[Block; TERMS]| {
                let first = loaded(&columns[0]);
                let mut sums = std::array::from_fn(|i| _mm256_mul_pd(first[i], factors[0][i]));
                for term in 1..TERMS {
                    let column = loaded(&columns[term]);
                    sums = std::array::from_fn(|i| _mm256_add_pd(sums[i], _mm256_mul_pd(column[i], factors[term][i])));
                }
                if CONSTANT {
                    sums = std::array::from_fn(|i| _mm256_add_pd(sums[i], factors[TERMS][i]));
                }
                stored(sums)
            });
        }
    }

    #[target_feature(enable = "avx")]
    fn loaded(block: &Block) -> [__m256d; 3] {
        let (vectors, _) = block.as_chunks::<4>();
        // SAFETY: the reference is to four doubles, and nothing is asked of their alignment.
        std::array::from_fn(|i| unsafe { _mm256_loadu_pd(vectors[i].as_ptr()) })
    }

    #[target_feature(enable = "avx")]
    fn stored(sums: [__m256d; 3]) -> Block {
        let mut block = [0.0; 12];
        let (vectors, _) = block.as_chunks_mut::<4>();
        for (vector, sum) in vectors.iter_mut().zip(sums) {
            // SAFETY: the reference is to four doubles, and nothing is asked of their alignment.
            unsafe { _mm256_storeu_pd(vector.as_mut_ptr(), sum) };
        }
        block
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_of_columns_and_terms() {
        let mut random = 7u64;
        let mut next = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        for (terms, constant, count) in
            (1..=MOST_TERMS).flat_map(|t| (1..14).flat_map(move |n| [(t, false, n), (t, true, n)]))
        {
            let row_values = 3 * (terms + usize::from(constant));
            let rows: Vec<f64> = (0..2 * row_values).map(|_| next()).collect();
            let columns: Vec<f64> = (0..count * terms).map(|_| next()).collect();
            let blocks = blocks_of_columns((0..terms).rev(), &columns, terms);
            let mut out = vec![f64::NAN; 6 * count];
            run(terms, constant, &rows, (&blocks, count), &mut out);
            for (i, found) in out.iter().enumerate() {
                let (row, column) = (&rows[i / (3 * count) * row_values + i % 3..], &columns[i / 3 % count * terms..]);
                let mut expected = column[terms - 1] * row[0];
                (1..terms).for_each(|k| expected += column[terms - 1 - k] * row[3 * k]);
                expected += if constant { row[3 * terms] } else { 0.0 };
                assert_eq!(*found, expected, "{terms} {constant} {count}: {i}");
            }
        }
    }
}
