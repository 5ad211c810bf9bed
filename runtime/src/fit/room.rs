//! Start values within bounds that may depend on each other, with a common value where parameters are held equal.

use super::options::FitError;
use super::tuning::{ROOM_SAMPLES, ROOM_SWEEPS};
use crate::model::Model;
use gml_compiler::program::Quantity;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The bounds and ties of a model's parameters.
pub(crate) struct Room<'a> {
    pub(crate) model: &'a dyn Model,
    pub(crate) fixed: &'a [bool],
    /// By parameter, whether the user gave its start value.
    pub(crate) given: &'a [bool],
    /// Pairs of a leader and its follower.
    pub(crate) ties: &'a [(usize, usize)],
}

/// Parameters that have no value within their bounds at `x`.
struct Conflict {
    members: Vec<usize>,
    x: Vec<f64>,
}

impl Room<'_> {
    /// Start values within all bounds, with tied parameters equal: `x` as far as possible. Values that were not given
    /// move if they must.
    ///
    /// # Errors
    /// There is no common value.
    pub(crate) fn start(&self, x: &[f64]) -> Result<Vec<f64>, FitError> {
        let conflict = match self.settle(x.to_vec()) {
            Ok(x) => return Ok(x),
            Err(conflict) => conflict,
        };
        if let Some(x) = self.nearby(x, |i| !self.fixed[i] && !self.given[i]) {
            return Ok(x);
        }
        let elsewhere = self.nearby(x, |i| !self.fixed[i]);
        let moved = |elsewhere: Vec<f64>| {
            let others = (0..x.len()).filter(|i| self.given[*i] && !self.fixed[*i] && elsewhere[*i] != x[*i]);
            others.map(|i| self.named(i, elsewhere[i])).collect()
        };
        Err(self.error(&conflict, elsewhere.map(moved).unwrap_or_default()))
    }

    /// Moves all parameters that are not fixed into their bounds, tied ones together, until nothing moves any longer.
    fn settle(&self, mut x: Vec<f64>) -> Result<Vec<f64>, Conflict> {
        let mut last = Vec::new();
        for _ in 0..ROOM_SWEEPS {
            last.clear();
            for i in (0..x.len()).filter(|i| !self.ties.iter().any(|(_, follower)| follower == i)) {
                let members = self.members(i);
                let bounds = self.model.bounds(&x);
                let low = members.iter().map(|m| bounds[*m].0).fold(f64::NEG_INFINITY, f64::max);
                let high = members.iter().map(|m| bounds[*m].1).fold(f64::INFINITY, f64::min);
                let computed = members.iter().all(|m| bounds[*m].0 <= bounds[*m].1);
                let slack = 1e-9 * (1.0 + x[i].abs());
                let outside = !(x[i] >= low - slack && x[i] <= high + slack);
                if !(computed && low <= high + slack) || (self.fixed[i] && outside) {
                    return Err(Conflict { members, x });
                }
                // The bounds may cross by rounding.
                let value = if self.fixed[i] { x[i] } else { x[i].max(low).min(high) };
                if members.iter().any(|m| x[*m] != value) {
                    members.iter().for_each(|m| x[*m] = value);
                    last = members;
                }
            }
            if last.is_empty() {
                return Ok(x);
            }
        }
        Err(Conflict { members: last, x })
    }

    /// Settles at random places, farther and farther from `x` in the parameters that `movable` allows.
    fn nearby(&self, x: &[f64], movable: impl Fn(usize) -> bool) -> Option<Vec<f64>> {
        let bounds = self.model.bounds(x);
        let mut random = ChaCha8Rng::seed_from_u64(0);
        (1..=ROOM_SAMPLES).find_map(|sample| {
            let reach = f64::from(sample) / f64::from(ROOM_SAMPLES);
            let mut moved = |i: usize| {
                let far = 10.0 * (1.0 + x[i].abs());
                let (low, high) = bounds[i];
                let low = if low.is_finite() { low } else { x[i] - far };
                let high = if high.is_finite() { high } else { x[i] + far };
                x[i] + reach * (low + random.random_range(0.0..=1.0) * (high - low) - x[i])
            };
            self.settle((0..x.len()).map(|i| if movable(i) { moved(i) } else { x[i] }).collect()).ok()
        })
    }

    /// A parameter that follows no other, with its followers.
    fn members(&self, i: usize) -> Vec<usize> {
        std::iter::once(i).chain(self.ties.iter().filter(|(leader, _)| *leader == i).map(|(_, f)| *f)).collect()
    }

    fn error(&self, conflict: &Conflict, instead: Vec<(String, String)>) -> FitError {
        let Conflict { members, x } = conflict;
        let parameters = self.model.parameters();
        let bounds = self.model.bounds(x);
        let derivatives = self.model.bounds_jacobian(x);
        let on = |j: &usize| derivatives.iter().any(|d| d.by == *j && members.contains(&d.parameter));
        let of = |m: &usize| {
            let (low, high) = bounds[*m];
            (parameters[*m].name.clone(), range(low, high, parameters[*m].quantity))
        };
        FitError::NoCommonValue {
            bounds: members.iter().map(of).collect(),
            at: (0..x.len()).filter(on).map(|j| self.named(j, x[j])).collect(),
            instead,
        }
    }

    fn named(&self, i: usize, value: f64) -> (String, String) {
        let parameter = &self.model.parameters()[i];
        let fixed = if self.fixed[i] { " (fixed)" } else { "" };
        (parameter.name.clone(), shown(value, parameter.quantity) + fixed)
    }
}

/// A value with its unit, in degrees for angles, to the decimal place of a `digit` that is not below zero, and to nine
/// digits at most.
pub(crate) fn shown_to(value: f64, digit: f64, quantity: Quantity) -> String {
    let (of_unit, unit) = in_unit(digit, quantity);
    let decimals = (-of_unit.log10().floor()).clamp(0.0, 12.0);
    let (value, _) = in_unit(value, quantity);
    match value.abs() {
        1e9.. => format!("{value:.2e}{unit}"),
        _ if of_unit > 1e-8 * value.abs() => format!("{value:.0$}{unit}", decimals as usize),
        _ => format!("{value:.8}{unit}"),
    }
}

/// A value in the unit in which it is shown, and that unit.
fn in_unit(value: f64, quantity: Quantity) -> (f64, &'static str) {
    match quantity {
        Quantity::Length => (value, " mm"),
        Quantity::Angle => (value.to_degrees(), " deg"),
        Quantity::Real | Quantity::Int | Quantity::Bool => (value, ""),
    }
}

/// A value with its unit, in degrees for angles, to nine digits.
pub(crate) fn shown(value: f64, quantity: Quantity) -> String {
    let (value, unit) = in_unit(value, quantity);
    let rounded: f64 = format!("{value:.8e}").parse().unwrap_or(value);
    match rounded.abs() {
        1e9.. => format!("{rounded:e}{unit}"),
        _ => format!("{rounded}{unit}"),
    }
}

/// An interval in words.
pub(crate) fn range(low: f64, high: f64, quantity: Quantity) -> String {
    let [from, to] = [low, high].map(|bound| shown(bound, quantity));
    match (low.is_finite(), high.is_finite()) {
        (true, true) => format!("{from} to {to}"),
        (true, false) => format!("of at least {from}"),
        (false, true) => format!("of at most {to}"),
        (false, false) => "(any value)".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_rounded_to_what_tells_them_apart() {
        let of = |value, digit| shown_to(value, digit, Quantity::Length);
        assert_eq!(of(4.11457743, 0.0026), "4.115 mm");
        assert_eq!(of(28.1664818, 0.14), "28.2 mm");
        assert_eq!(of(1234.5, 12.0), "1234 mm");
        assert_eq!(of(-0.00012345, 1e-6), "-0.000123 mm");
        assert_eq!(of(5.0, 0.0), "5.00000000 mm");
        assert_eq!(of(3e12, 1.0), "3.00e12 mm");
        assert_eq!(shown_to(1.0, 0.001, Quantity::Angle), "57.30 deg");
        assert_eq!(shown_to(0.25, 0.01, Quantity::Real), "0.25");
    }
}
