//! Parameters that can be exchanged for one another without changing the surface: a curve run backwards is the same curve.

use crate::fit::problem::objective::{Objective, Order};
use crate::fit::problem::parameterization::{Estimate, Parameterization};
use gml_compiler::program::Quantity;

/// Coordinates that change places.
type Pairs = Vec<(usize, usize)>;

/// Exchanges that are tried at most.
const MOST: usize = 128;
/// A value as good as another, but for where the surface happens to be sampled.
const SAME: f64 = 1.01;

/// The estimates that follow from `at` by exchanging coordinates `members` in pairs, and that lie nearer to `reference` and are as
/// good by `objective`.
pub(crate) fn relabelled(
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
    exchanges(members, &quantity)
        .into_iter()
        .filter_map(|pairs| {
            let mut estimate = at.clone();
            for (a, b) in pairs {
                estimate.z.swap(a, b);
            }
            let inside = within(space, &estimate);
            let nearer = away(&estimate) < before;
            (inside && nearer && objective.evaluate(&estimate, Order::Value)?.value <= SAME * value).then_some(estimate)
        })
        .collect()
}

fn within(space: &Parameterization, at: &Estimate) -> bool {
    let room = space.room(at);
    room.iter().all(|(low, high)| *low <= 0.0 && *high >= 0.0)
}

/// All ways to exchange some of `members` in pairs of the same quantity, but for the one that exchanges none.
fn exchanges(members: &[usize], quantity: &dyn Fn(usize) -> Quantity) -> Vec<Pairs> {
    let mut open: Vec<(Pairs, Vec<usize>)> = vec![(Vec::new(), members.to_vec())];
    let mut found = Vec::new();
    while let Some((pairs, rest)) = open.pop() {
        if found.len() >= MOST {
            break;
        }
        let Some((first, others)) = rest.split_first() else {
            if !pairs.is_empty() {
                found.push(pairs);
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
    found
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
