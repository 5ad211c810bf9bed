//! Linear fits to equations: by least squares, and with the least largest error (Chebyshev approximation).

use nalgebra::{DMatrix, DVector};

/// The largest number of unknowns.
pub(super) const MOST: usize = 6;

/// An equation: the sum of `factors` times the unknowns should be `value`. Factors of unused unknowns are zero.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Row {
    pub(super) factors: [f64; MOST],
    pub(super) value: f64,
}

impl Row {
    /// The residual; missing unknowns are zero.
    pub(super) fn error(&self, unknowns: &[f64]) -> f64 {
        self.value - self.factors.iter().zip(unknowns).map(|(f, x)| f * x).sum::<f64>()
    }
}

/// Least squares over `count` unknowns. Unknowns that the rows do not determine, such as the tilt of a ring, are zero,
/// all of them where there are no rows. Also returns the norm of the solution in units of the rows' values; none if the
/// solution is not finite.
pub(super) fn least_squares(rows: impl Iterator<Item = Row>, count: usize) -> Option<([f64; MOST], f64)> {
    let mut normal = DMatrix::<f64>::zeros(count, count);
    let mut right = DVector::<f64>::zeros(count);
    for row in rows {
        for i in 0..count {
            right[i] += row.factors[i] * row.value;
            for k in 0..=i {
                normal[(i, k)] += row.factors[i] * row.factors[k];
            }
        }
    }
    // Unknowns of different units are scaled.
    let scale_of = |square: f64| if square > 0.0 { square.sqrt() } else { 1.0 };
    let scale: Vec<f64> = (0..count).map(|i| scale_of(normal[(i, i)])).collect();
    if !normal.iter().chain(&right).all(|x| x.is_finite()) {
        return None;
    }
    for i in 0..count {
        right[i] /= scale[i];
        for k in 0..=i {
            normal[(i, k)] /= scale[i] * scale[k];
            normal[(k, i)] = normal[(i, k)];
        }
    }
    let scaled = normal.svd(true, true).solve(&right, 1e-10).ok()?;
    let solution = std::array::from_fn(|k| if k < count { scaled[k] / scale[k] } else { 0.0 });
    solution.iter().all(|x| x.is_finite()).then(|| (solution, scaled.norm()))
}

/// Largest number of simplex steps: far more than needed, but rounding must not cause an endless loop.
const STEPS: usize = 500;

/// A column of the dual problem's basis.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Entry {
    /// Row i with the sign of its error.
    Row(usize, f64),
    /// A placeholder for an unknown that no row has determined yet; always zero.
    Free(usize),
}

/// Minimises the largest |value - sum of factors times unknowns| over `count` unknowns.
///
/// This is a linear programme with two constraints per row; its dual has one constraint per unknown and one more, so
/// that the simplex method on the dual inverts matrices of at most seven rows, however many points there are (Watson,
/// 'Approximation Theory and Numerical Methods', 1980, sect. 2.3).
pub(super) fn chebyshev(rows: &[Row], count: usize) -> [f64; MOST] {
    let scale: [f64; MOST] = std::array::from_fn(|k| {
        let largest = rows.iter().map(|r| r.factors[k].abs()).fold(0.0, f64::max);
        if largest > 0.0 { 1.0 / largest } else { 1.0 }
    });
    let factor = |i: usize, k: usize| rows[i].factors[k] * scale[k];
    let size = rows.iter().map(|r| r.value.abs()).fold(0.0, f64::max);
    let Some(mut basis) = start(rows, count, &factor) else { return [0.0; MOST] };
    let column = |entry: Entry| {
        DVector::from_fn(count + 1, |k, _| match entry {
            Entry::Row(_, _) if k == count => 1.0,
            Entry::Row(i, sign) => sign * factor(i, k),
            Entry::Free(unknown) => f64::from(u8::from(k == unknown)),
        })
    };
    let mut unknowns = [0.0; MOST];
    for _ in 0..STEPS {
        let matrix = DMatrix::from_columns(&basis.iter().map(|e| column(*e)).collect::<Vec<_>>());
        let costs = DVector::from_iterator(
            count + 1,
            basis.iter().map(|e| match e {
                Entry::Row(i, sign) => sign * rows[*i].value,
                Entry::Free(_) => 0.0,
            }),
        );
        let Some(prices) = matrix.transpose().lu().solve(&costs) else { break };
        unknowns = std::array::from_fn(|k| if k < count { prices[k] * scale[k] } else { 0.0 });
        // The row with the largest error enters the basis.
        let worst = rows
            .iter()
            .map(|row| row.error(&unknowns))
            .enumerate()
            .fold((0, 0.0f64), |w, e| if e.1.abs() > w.1.abs() { e } else { w });
        if worst.1.abs() <= prices[count] + 1e-12 * size {
            break;
        }
        let entering = Entry::Row(worst.0, worst.1.signum());
        let lu = matrix.lu();
        let mut right = DVector::zeros(count + 1);
        right[count] = 1.0;
        let (Some(weights), Some(direction)) = (lu.solve(&right), lu.solve(&column(entering))) else { break };
        let Some(leaving) = leaving(&basis, &weights, &direction) else { break };
        basis[leaving] = entering;
    }
    unknowns
}

/// The first basis: a row with both signs, and placeholders for all unknowns but one of its own; none if all factors
/// are zero.
fn start(rows: &[Row], count: usize, factor: &impl Fn(usize, usize) -> f64) -> Option<Vec<Entry>> {
    let (mut row, mut unknown, mut largest) = (0, 0, 0.0);
    for k in 0..count {
        for i in 0..rows.len() {
            if factor(i, k).abs() > largest {
                (row, unknown, largest) = (i, k, factor(i, k).abs());
            }
        }
    }
    let free = (0..count).filter(|k| *k != unknown).map(Entry::Free);
    (largest > 0.0).then(|| free.chain([Entry::Row(row, 1.0), Entry::Row(row, -1.0)]).collect())
}

/// The entry that becomes zero first. Placeholders leave as soon as they would change.
fn leaving(basis: &[Entry], weights: &DVector<f64>, direction: &DVector<f64>) -> Option<usize> {
    let free = (0..basis.len()).filter(|r| matches!(basis[*r], Entry::Free(_)) && direction[*r].abs() > 1e-9);
    if let Some(r) = free.max_by(|a, b| direction[*a].abs().total_cmp(&direction[*b].abs())) {
        return Some(r);
    }
    let rows = (0..basis.len()).filter(|r| matches!(basis[*r], Entry::Row(..)) && direction[*r] > 1e-12);
    rows.min_by(|a, b| (weights[*a] / direction[*a]).total_cmp(&(weights[*b] / direction[*b])))
}
