//! How far apart the points of a cloud are.

use super::neighbours::Neighbours;
use std::f64::consts::PI;

/// Neighbours that tell the spacing: that of points spread by chance is then known to a sixth. Twice as many are looked
/// at, since half of them may lie on the other side of a wall.
const NEIGHBOURS: usize = 12;
const LOOKED_AT: usize = 2 * NEIGHBOURS + 1;

/// The edge of the square of surface that belongs to each of some points: pi d^2 / k is the area of one of k neighbours
/// within a distance d. `tree` is that of the points, and `alike` says whether two points lie on the same surface. Of
/// the points' own unit; 0 where there are no others.
pub(crate) fn spacings(
    points: &[[f64; 3]],
    tree: &Neighbours,
    alike: impl Fn(usize, usize) -> bool + Sync,
) -> Vec<f64> {
    tree.at_each(LOOKED_AT, |i, near| {
        let others = near.iter().filter(|j| **j as usize != i && alike(i, **j as usize)).take(NEIGHBOURS);
        let (count, last) = others.fold((0, i), |(count, _), j| (count + 1, *j as usize));
        let squared: f64 = (0..3).map(|k| (points[last][k] - points[i][k]).powi(2)).sum();
        if count > 0 { (PI * squared / f64::from(count)).sqrt() } else { 0.0 }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robust::median;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn the_square_of_the_spacing_is_the_area_of_a_point_on_either_side_of_a_wall() {
        // Two squares of 50 x 50 mm, 0.1 mm apart, with 2 points to a square millimetre each.
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(2);
        let mut any = || random.random_range(0.0..50.0);
        let points: Vec<[f64; 3]> = (0..10_000).map(|k| [any(), any(), 0.1 * f64::from(k % 2)]).collect();
        let tree = Neighbours::new(&points);
        let mut found = spacings(&points, &tree, |i, j| i % 2 == j % 2);
        let middle = median(&mut found).unwrap();
        // Borders have fewer neighbours on one side.
        assert!((middle / 0.5f64.sqrt() - 1.0).abs() < 0.05, "{middle}");
        assert_eq!(spacings(&points[..1], &Neighbours::new(&points[..1]), |_, _| true), [0.0]);
    }
}
