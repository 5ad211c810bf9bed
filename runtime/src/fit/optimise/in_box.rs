//! The minimum of a convex quadratic form in a box, by active sets (Nocedal and Wright, Numerical Optimization, 2nd
//! edition, algorithm 16.3). To clip the coordinates of the free minimum would not do: where two of them are strongly
//! correlated, what is left of a step may lead uphill.

use nalgebra::{DMatrix, DVector};

/// Changes of the active set, per coordinate. The form falls at every one, so that each set is met once at most; what
/// has been reached is returned where rounding would go on for ever.
const CHANGES: usize = 10;
/// A coordinate leaves a bound if the slope there leads inside by more than this share of the slopes at the origin:
/// below is rounding.
const SLOPE: f64 = 1e-12;

/// The minimum of gradient . s + s . matrix s / 2 where every coordinate of s is within its `room`, which holds zero.
/// None where the matrix of those that are free is not positive definite.
pub(crate) fn minimum(gradient: &DVector<f64>, matrix: &DMatrix<f64>, room: &[(f64, f64)]) -> Option<DVector<f64>> {
    let n = gradient.len();
    let mut step = DVector::zeros(n);
    let mut held: Vec<bool> = (0..n).map(|k| pushed(gradient[k], room[k])).collect();
    let tolerance = SLOPE * gradient.amax();
    for _ in 0..CHANGES * n.max(1) {
        let slope = gradient + matrix * &step;
        let free: Vec<usize> = (0..n).filter(|k| !held[*k]).collect();
        let way = if free.is_empty() { DVector::zeros(0) } else { newton(matrix, &slope, &free)? };
        match nearest_bound(&step, &way, &free, room) {
            Some((along, k, bound)) => {
                for (k, w) in free.iter().zip(way.iter()) {
                    step[*k] += along * w;
                }
                step[k] = bound;
                held[k] = true;
            }
            None => {
                for (k, w) in free.iter().zip(way.iter()) {
                    step[*k] += w;
                }
                let slope = gradient + matrix * &step;
                let inside = |k: usize| {
                    let (low, high) = room[k];
                    let into = if step[k] <= low { -slope[k] } else { slope[k] };
                    (held[k] && low < high && into > tolerance).then_some((k, into))
                };
                match (0..n).filter_map(inside).max_by(|a, b| a.1.total_cmp(&b.1)) {
                    Some((k, _)) => held[k] = false,
                    None => return Some(step),
                }
            }
        }
    }
    Some(step)
}

/// Whether a coordinate stands at a bound and the gradient pushes it against it. `room` is how far it may go.
pub(crate) fn pushed(gradient: f64, room: (f64, f64)) -> bool {
    (room.0 >= 0.0 && gradient > 0.0) || (room.1 <= 0.0 && gradient < 0.0)
}

/// The way from here to the minimum over the free coordinates.
fn newton(matrix: &DMatrix<f64>, slope: &DVector<f64>, free: &[usize]) -> Option<DVector<f64>> {
    let part = DMatrix::from_fn(free.len(), free.len(), |a, b| matrix[(free[a], free[b])]);
    let slope = DVector::from_iterator(free.len(), free.iter().map(|k| -slope[*k]));
    Some(part.cholesky()?.solve(&slope))
}

/// The part of a way after which the first of its coordinates meets its bound: that part, the coordinate and the bound.
fn nearest_bound(
    step: &DVector<f64>,
    way: &DVector<f64>,
    free: &[usize],
    room: &[(f64, f64)],
) -> Option<(f64, usize, f64)> {
    let moved = free.iter().zip(way.iter()).filter(|(_, w)| **w != 0.0);
    let met = moved.filter_map(|(k, w)| {
        let (low, high) = room[*k];
        let bound = if *w < 0.0 { low } else { high };
        let along = ((bound - step[*k]) / w).max(0.0);
        (along < 1.0).then_some((along, *k, bound))
    });
    met.min_by(|a, b| a.0.total_cmp(&b.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn value(gradient: &DVector<f64>, matrix: &DMatrix<f64>, step: &DVector<f64>) -> f64 {
        gradient.dot(step) + 0.5 * step.dot(&(matrix * step))
    }

    /// A narrow valley across the box: the free minimum is at (4, -1.5), and (1, -1) lies higher than the origin.
    #[test]
    fn a_step_in_a_narrow_valley_is_shortened_and_not_clipped() {
        let matrix = DMatrix::from_row_slice(2, 2, &[1.0, 1.998, 1.998, 4.0]);
        let gradient = -&matrix * DVector::from_row_slice(&[4.0, -1.5]);
        let free = matrix.clone().cholesky().unwrap().solve(&-&gradient);
        let clipped = free.map(|x: f64| x.clamp(-1.0_f64, 1.0));
        assert!(value(&gradient, &matrix, &clipped) > 0.0, "{clipped}");
        let step = minimum(&gradient, &matrix, &[(-1.0, 1.0); 2]).unwrap();
        assert!(value(&gradient, &matrix, &step) < -0.5, "{step}");
    }

    proptest! {
        /// Karush, Kuhn and Tucker: no slope where a coordinate is free, and none that leads inside at a bound.
        #[test]
        fn no_slope_leads_on_from_the_minimum(
            entries in prop::collection::vec(-1.0..1.0_f64, 36),
            gradient in prop::collection::vec(-1.0..1.0_f64, 6),
            low in prop::collection::vec(prop::sample::select(vec![0.0, -0.01, -0.3, -1e2, f64::NEG_INFINITY]), 6),
            high in prop::collection::vec(prop::sample::select(vec![0.0, 0.01, 0.3, 1e2, f64::INFINITY]), 6),
        ) {
            let a = DMatrix::from_row_slice(6, 6, &entries);
            let matrix = &a * a.transpose() + DMatrix::identity(6, 6) * 1e-3;
            let gradient = DVector::from_vec(gradient);
            let room: Vec<(f64, f64)> = low.into_iter().zip(high).collect();
            let step = minimum(&gradient, &matrix, &room).unwrap();
            let slope = &gradient + &matrix * &step;
            for k in 0..6 {
                let (low, high) = room[k];
                prop_assert!(step[k] >= low && step[k] <= high);
                prop_assert!(slope[k] < 1e-8 || step[k] == low, "{k}: {} at {} of {:?}", slope[k], step[k], room[k]);
                prop_assert!(slope[k] > -1e-8 || step[k] == high, "{k}: {} at {} of {:?}", slope[k], step[k], room[k]);
            }
        }
    }
}
