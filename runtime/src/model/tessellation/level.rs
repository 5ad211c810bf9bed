//! Where the function of what is there is level next to zero: there solids coincide.

use super::refine::{Refinement, between};
use super::stand::ZERO;
use crate::model::EvaluationError;

/// What is level where solids coincide is below this, in millimetres, and its values are the same but for this part of
/// them.
pub(super) const LEVEL_BELOW: f64 = 1e-5;
const LEVEL: f64 = 0.01;
/// The least number of places in a triangle that show that the function is level, where none of them is a corner. (One
/// corner is enough: beside a border along which another solid is tangent every second triangle has one there, and
/// would be divided for what its square hides.)
const LEAST_LEVEL: usize = 2;
/// Bisections of the way out of where the function is level: to a millionth of it.
const BISECTIONS: usize = 20;

/// Whether several values are one that is next to zero, and the others lie beyond: where surfaces of two solids
/// coincide the function is level at a small value, and so has no zero there. The first three are those of the corners.
pub(super) fn is_level(values: &[f64]) -> bool {
    let least = least(values);
    let level = values.iter().filter(|value| is_as(least, **value)).count();
    let at_corner = values[..3].iter().any(|value| is_as(least, *value));
    least > ZERO && least < LEVEL_BELOW && (at_corner || level >= LEAST_LEVEL)
}

fn least(values: &[f64]) -> f64 {
    values.iter().map(|value| value.abs()).fold(f64::INFINITY, f64::min)
}

fn is_as(least: f64, value: f64) -> bool {
    value.abs() < least * (1.0 + LEVEL)
}

/// The way from a place of a triangle where the function is level to one where it is not.
struct Way {
    /// The place of the triangle in the list, and its number.
    of: usize,
    triangle: usize,
    /// The level value.
    level: f64,
    from: [f64; 3],
    to: [f64; 3],
    /// The value at the end.
    value: f64,
}

impl Refinement<'_> {
    /// Which of some triangles with level places have an edge where the function stops being level: beyond that it is
    /// on the other side of zero, as on a narrow rim between a hole and the outline, which none of the places shows.
    /// `values` has those of `places` of each.
    pub(super) fn end_beside_level(
        &self,
        triangles: &[(usize, &[f64])],
        places: &[[f64; 3]],
        keeps: &[Option<usize>],
    ) -> Result<Vec<bool>, EvaluationError> {
        let mut ways = Vec::new();
        for (of, (triangle, values)) in triangles.iter().enumerate() {
            let least = least(values);
            let position = self.position(*triangle);
            let level: Vec<usize> = (0..values.len()).filter(|i| is_as(least, values[*i])).collect();
            for end in (0..values.len()).filter(|i| !level.contains(i)) {
                let to = position(places[end]);
                let apart = |i: &usize| position(places[*i]).distance_squared(to);
                let Some(from) = level.iter().copied().min_by(|a, b| apart(a).total_cmp(&apart(b))) else { continue };
                ways.push(Way {
                    of,
                    triangle: *triangle,
                    level: values[from],
                    from: places[from],
                    to: places[end],
                    value: values[end],
                });
            }
        }
        let numbers: Vec<usize> = ways.iter().map(|way| way.triangle).collect();
        for _ in 0..BISECTIONS {
            let middles: Vec<[f64; 3]> = ways.iter().map(|way| between(way.from, way.to, 0.5)).collect();
            let values = self.values_at(&numbers, &middles, keeps)?;
            for ((way, middle), value) in ways.iter_mut().zip(middles).zip(values) {
                if is_as(way.level.abs(), value) {
                    way.from = middle;
                } else {
                    (way.to, way.value) = (middle, value);
                }
            }
        }
        let mut ends = vec![false; triangles.len()];
        ways.iter().filter(|way| way.value * way.level < 0.0).for_each(|way| ends[way.of] = true);
        Ok(ends)
    }
}
