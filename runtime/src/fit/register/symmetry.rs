//! Parameter symmetries: parameters that can be exchanged without changing the surface. A curve run backwards is the
//! same curve.

use crate::fit::problem::objective::{Objective, Order};
use crate::fit::problem::parameterization::Estimate;
use crate::fit::tuning::{EXCHANGES, SAME_SURFACE};
use gml_compiler::program::Quantity;

/// Coordinates that change places.
type Pairs = Vec<(usize, usize)>;

/// The estimates that follow from `at` by exchanging coordinates `members` in pairs, and that lie nearer to the
/// reference and are as good by `objective`. `size` is the scale of lengths (millimetres).
pub(crate) fn equivalents(
    objective: &Objective,
    at: &Estimate,
    members: &[usize],
    reference: &Estimate,
    size: f64,
) -> Vec<Estimate> {
    let space = objective.space;
    let Some(value) = objective.evaluate(at, Order::Value).map(|e| e.value) else { return Vec::new() };
    let quantity = |k: usize| space.model.parameters()[space.free[k]].quantity;
    let away = |e: &Estimate| space.normalised_distance(members, e, reference, size);
    let before = away(at);
    let exchanged = |pairs: Pairs| {
        let mut estimate = at.clone();
        for (a, b) in pairs {
            estimate.z.swap(a, b);
        }
        let inside = space.room(&estimate).iter().all(|(low, high)| *low <= 0.0 && *high >= 0.0);
        let same = |e: &Estimate| Some(objective.evaluate(e, Order::Value)?.value <= SAME_SURFACE * value);
        (inside && away(&estimate) < before && same(&estimate)?).then_some(estimate)
    };
    exchanges(members, &quantity).into_iter().filter_map(exchanged).collect()
}

/// All ways to exchange some of `members` in pairs of the same quantity, but for the one that exchanges none.
fn exchanges(members: &[usize], quantity: &dyn Fn(usize) -> Quantity) -> Vec<Pairs> {
    let mut open: Vec<(Pairs, Vec<usize>)> = vec![(Vec::new(), members.to_vec())];
    let mut complete = Vec::new();
    while let Some((pairs, rest)) = open.pop() {
        if complete.len() >= EXCHANGES {
            break;
        }
        let Some((first, others)) = rest.split_first() else {
            if !pairs.is_empty() {
                complete.push(pairs);
            }
            continue;
        };
        open.push((pairs.clone(), others.to_vec()));
        for (i, other) in others.iter().enumerate() {
            if quantity(*first) == quantity(*other) {
                let mut more = pairs.clone();
                more.push((*first, *other));
                let mut left = others.to_vec();
                left.remove(i);
                open.push((more, left));
            }
        }
    }
    complete
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_to_exchange_is_tried_once() {
        // Involutions of 4 and of 6 things, without the one that changes nothing: 10 - 1 and 76 - 1.
        for (count, ways) in [(1, 0), (4, 9), (6, 75)] {
            let members: Vec<usize> = (0..count).collect();
            assert_eq!(exchanges(&members, &|_| Quantity::Real).len(), ways);
        }
        let quantity = |k: usize| if k == 0 { Quantity::Length } else { Quantity::Real };
        assert_eq!(exchanges(&[0, 1, 2], &quantity), [[(1, 2)]]);
    }
}
