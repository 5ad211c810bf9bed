//! The space of estimates: an estimate (the script's free parameters and a rigid motion), its scaled local coordinates,
//! and the bounds.

use super::isometry::{Isometry, left_jacobian};
use crate::model::Model;
use glam::{DQuat, DVec3};
use gml_compiler::program::Quantity;
use nalgebra::{DMatrix, DVector};

/// Parameters and motion: the scan's points lie at motion(M(x)).
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Estimate {
    /// Coordinates of the free parameters (see `Rule`).
    pub(crate) z: Vec<f64>,
    /// From the model's frame to the scan's.
    pub(crate) motion: Isometry,
}

/// How a free parameter follows from its coordinate. Bounds that depend on other parameters become constant ones in z,
/// so that the feasible set is always a box.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Rule {
    /// x = z; the bounds are constant.
    Plain { low: f64, high: f64 },
    /// x = low(x) + z (high(x) - low(x)), z in [0, 1].
    Fraction,
    /// x = low(x) + z, z >= 0.
    AboveLow,
    /// x = high(x) - z, z >= 0.
    BelowHigh,
}

/// The space of estimates of one model, with some parameters free and, mostly, the motion.
#[derive(Clone)]
pub(crate) struct Parameterization<'a> {
    pub(crate) model: &'a dyn Model,
    /// Values of the parameters that are not free (the others' are ignored).
    base: Vec<f64>,
    /// Indices of the free parameters, ascending.
    pub(crate) free: Vec<usize>,
    /// Pairs of a free parameter and one that follows it.
    pub(crate) ties: Vec<(usize, usize)>,
    rules: Vec<Rule>,
    /// Some parameter's bounds depend on others.
    dependent: bool,
    /// By parameter, whether it is free or follows one that is.
    varies: Vec<bool>,
    /// Whether the motion is free.
    pub(crate) moving: bool,
    /// Local motions turn about this point of the model's frame.
    pub(crate) centre: DVec3,
    /// Scaled coordinate = z * scale, so that all coordinates move the surface by about as much: in millimetres.
    scale: Vec<f64>,
    /// Millimetres a radian.
    pub(crate) radius: f64,
}

/// Motion of the surface (millimetres) per unit of a parameter that is only rounding.
const NO_MOTION: f64 = 1e-12;

impl<'a> Parameterization<'a> {
    /// The space in which the parameters `free` (ascending) and, if `moving`, the motion vary about `x`. Scales are 1
    /// until `set_scale`. Of every pair in `ties` the second parameter, which is not free, is to equal the first.
    pub(crate) fn new(
        model: &'a dyn Model,
        x: &[f64],
        free: Vec<usize>,
        moving: bool,
        ties: &[(usize, usize)],
    ) -> Self {
        let mut at = model.bounds(x);
        let mut varying = vec![false; x.len()];
        model.bounds_jacobian(x).iter().for_each(|d| varying[d.parameter] = true);
        for (leader, follower) in ties {
            let (low, high) = at[*follower];
            if !varying[*follower] {
                at[*leader] = (at[*leader].0.max(low), at[*leader].1.min(high));
            }
        }
        let rules: Vec<Rule> = free
            .iter()
            .map(|i| {
                let (low, high) = at[*i];
                match (varying[*i], low.is_finite(), high.is_finite()) {
                    (false, ..) | (true, false, false) => Rule::Plain { low, high },
                    (true, true, true) => Rule::Fraction,
                    (true, true, false) => Rule::AboveLow,
                    (true, false, true) => Rule::BelowHigh,
                }
            })
            .collect();
        let dependent = varying.contains(&true);
        let mut varies = vec![false; x.len()];
        for i in free.iter().copied().chain(ties.iter().map(|t| t.1)) {
            varies[i] = true;
        }
        let scale = vec![1.0; free.len()];
        let (base, ties, centre) = (x.to_vec(), ties.to_vec(), DVec3::ZERO);
        Self { model, base, free, ties, rules, dependent, varies, moving, centre, scale, radius: 1.0 }
    }

    /// The space in which only the motion varies, of the shape with parameters `x`.
    pub(crate) fn of_motions(&self, x: &[f64]) -> Self {
        let (centre, radius) = (self.centre, self.radius);
        Self { centre, radius, ..Self::new(self.model, x, Vec::new(), true, &self.ties) }
    }

    /// Coordinates in all.
    pub(crate) fn dim(&self) -> usize {
        self.free.len() + if self.moving { 6 } else { 0 }
    }

    /// The estimate with parameters `x` (moved into their bounds).
    pub(crate) fn estimate(&self, x: &[f64], motion: Isometry) -> Estimate {
        let mut z = vec![0.0; self.free.len()];
        let mut now = self.base.clone();
        for i in &self.free {
            now[*i] = x[*i];
        }
        for (k, i) in self.free.iter().enumerate() {
            let (low, high) = match self.rules[k] {
                Rule::Plain { low, high } => (low, high),
                _ => self.model.bounds(&now)[*i],
            };
            let value = clamp(now[*i], low, high);
            now[*i] = value;
            z[k] = match self.rules[k] {
                Rule::Plain { .. } => value,
                Rule::Fraction if high > low => (value - low) / (high - low),
                Rule::Fraction => 0.5,
                Rule::AboveLow => value - low,
                Rule::BelowHigh => high - value,
            };
        }
        Estimate { z, motion }
    }

    /// The parameters of an estimate; None where the bounds leave no room or a fixed parameter breaks its bounds.
    pub(crate) fn x(&self, z: &[f64]) -> Option<Vec<f64>> {
        let mut x = self.base.clone();
        for ((i, rule), z) in self.free.iter().zip(&self.rules).zip(z) {
            if let Rule::Plain { .. } = rule {
                x[*i] = *z;
            }
        }
        self.tie(&mut x);
        if !self.dependent {
            return Some(x);
        }
        for ((i, rule), z) in self.free.iter().zip(&self.rules).zip(z) {
            if let Rule::Plain { .. } = rule {
                continue;
            }
            let (low, high) = self.model.bounds(&x)[*i];
            if !(low <= high) {
                return None;
            }
            x[*i] = match rule {
                Rule::Plain { .. } => *z,
                // Rounding must not leave the bounds.
                Rule::Fraction => (low + z * (high - low)).clamp(low, high),
                Rule::AboveLow => low + z,
                Rule::BelowHigh => high - z,
            };
            self.tie(&mut x);
        }
        let slack = |bound: f64| 1e-9 * (1.0 + bound.abs());
        let within = self.model.bounds(&x).iter().zip(&x).enumerate().all(|(i, ((low, high), x))| {
            self.free.binary_search(&i).is_ok() || (*x >= low - slack(*low) && *x <= high + slack(*high))
        });
        within.then_some(x)
    }

    fn tie(&self, x: &mut [f64]) {
        for (leader, follower) in &self.ties {
            x[*follower] = x[*leader];
        }
    }

    /// Whether a parameter is free or follows one that is.
    pub(crate) fn varies(&self, i: usize) -> bool {
        self.varies[i]
    }

    /// A free parameter and those that follow it.
    pub(crate) fn followers(&self, i: usize) -> impl Iterator<Item = usize> {
        std::iter::once(i).chain(self.ties.iter().filter(move |t| t.0 == i).map(|t| t.1))
    }

    /// dx/dz over the free parameters, with the scales: the derivative of every x (rows) by every scaled coordinate of
    /// a free parameter (columns). Zero where the bounds leave no room at z.
    fn slope(&self, z: &[f64]) -> DMatrix<f64> {
        let n = self.free.len();
        let mut slope = DMatrix::zeros(self.base.len(), n);
        let set = |slope: &mut DMatrix<f64>, i: usize, row: DVector<f64>| {
            for follower in self.followers(i) {
                slope.set_row(follower, &row.transpose());
            }
        };
        let unit = |k: usize, length: f64| {
            let mut row = DVector::zeros(n);
            row[k] = length;
            row
        };
        // As in `x`: first what has constant bounds, then what follows it, in order.
        for (k, i) in self.free.iter().enumerate() {
            if let Rule::Plain { .. } = self.rules[k] {
                set(&mut slope, *i, unit(k, 1.0));
            }
        }
        if self.dependent {
            let Some(x) = self.x(z) else { return DMatrix::zeros(self.base.len(), n) };
            let (bounds, jacobian) = (self.model.bounds(&x), self.model.bounds_jacobian(&x));
            for (k, i) in self.free.iter().enumerate() {
                let (low, high) = bounds[*i];
                // dx/dz at constant bounds, and dx by the lower and by the upper bound.
                let (by_z, by_low, by_high) = match self.rules[k] {
                    Rule::Plain { .. } => continue,
                    Rule::Fraction => (high - low, 1.0 - z[k], z[k]),
                    Rule::AboveLow => (1.0, 1.0, 0.0),
                    Rule::BelowHigh => (-1.0, 0.0, 1.0),
                };
                let mut row = unit(k, by_z);
                for d in jacobian.iter().filter(|d| d.parameter == *i) {
                    row += (by_low * d.lower + by_high * d.upper) * slope.row(d.by).transpose();
                }
                set(&mut slope, *i, row);
            }
        }
        for (k, scale) in self.scale.iter().enumerate() {
            slope.column_mut(k).scale_mut(1.0 / scale);
        }
        slope
    }

    /// Sets how far a unit of each free parameter's x moves the surface (millimetres, root mean square).
    pub(crate) fn set_scale(&mut self, estimate: &Estimate, motion_of_x: &[f64], centre: DVec3, radius: f64) {
        self.centre = centre;
        self.radius = radius.max(f64::MIN_POSITIVE);
        self.scale = vec![1.0; self.free.len()];
        let slope = self.slope(&estimate.z);
        for k in 0..self.free.len() {
            let moved: f64 = (0..self.base.len()).map(|i| slope[(i, k)].abs() * motion_of_x[i]).sum();
            // Without influence there is nothing to scale by, and rounding errors are no influence.
            self.scale[k] = if moved.is_finite() && moved > NO_MOTION { moved } else { 1.0 };
        }
    }

    /// Takes the scales of another space of the same model, which has all these parameters free.
    pub(crate) fn copy_scale(&mut self, other: &Parameterization) {
        self.centre = other.centre;
        self.radius = other.radius;
        for (i, scale) in self.free.iter().zip(&mut self.scale) {
            if let Ok(k) = other.free.binary_search(i) {
                *scale = other.scale[k];
            }
        }
    }

    /// The interval in which coordinate k of the free parameters is sought: its bounds, or a stretch about the start
    /// where it has none.
    pub(crate) fn search_range(&self, k: usize, start: f64, size: f64) -> (f64, f64) {
        let (low, high) = self.rules[k].range();
        let reach = match self.model.parameters()[self.free[k]].quantity {
            Quantity::Length => start.abs().max(size),
            Quantity::Angle => std::f64::consts::PI,
            _ => start.abs().max(1.0),
        };
        (if low.is_finite() { low } else { start - reach }, if high.is_finite() { high } else { start + reach })
    }

    /// Lowest and highest admissible scaled steps from an estimate.
    pub(crate) fn room(&self, from: &Estimate) -> Vec<(f64, f64)> {
        let mut room: Vec<(f64, f64)> = self
            .rules
            .iter()
            .zip(&from.z)
            .zip(&self.scale)
            .map(|((rule, z), scale)| {
                let (low, high) = rule.range();
                ((low - z) * scale, (high - z) * scale)
            })
            .collect();
        room.resize(self.dim(), (f64::NEG_INFINITY, f64::INFINITY));
        room
    }

    /// The estimate at scaled local coordinates `y` from another; what leaves the bounds is moved back to them.
    pub(crate) fn retract(&self, from: &Estimate, y: &[f64]) -> Estimate {
        let n = self.free.len();
        let z = (0..n)
            .map(|k| {
                let (low, high) = self.rules[k].range();
                clamp(from.z[k] + y[k] / self.scale[k], low, high)
            })
            .collect();
        let motion = if self.moving {
            from.motion.after_local(shift(&y[n..]), self.turn(&y[n..]), self.centre)
        } else {
            from.motion
        };
        Estimate { z, motion }
    }

    fn turn(&self, pose: &[f64]) -> DVec3 {
        DVec3::new(pose[3], pose[4], pose[5]) / self.radius
    }

    /// The matrix C with local derivative = C^T (derivative by x, shift and turn), all at one estimate.
    pub(crate) fn chain(&self, at: &Estimate) -> DMatrix<f64> {
        let (n, m) = (self.base.len(), self.free.len());
        let mut chain = DMatrix::zeros(n + 6, self.dim());
        chain.view_mut((0, 0), (n, m)).copy_from(&self.slope(&at.z));
        if self.moving {
            for k in 0..6 {
                chain[(n + k, m + k)] = if k < 3 { 1.0 } else { 1.0 / self.radius };
            }
        }
        chain
    }

    /// Turns the gradient in local coordinates at `retract(from, y)` into the one in the coordinates `y` about `from`.
    pub(crate) fn pull_to(&self, y: &[f64], gradient: &mut DVector<f64>) {
        if !self.moving {
            return;
        }
        let n = self.free.len();
        let turn = self.turn(&y[n..]);
        let rotation = DQuat::from_scaled_axis(turn);
        let force = rotation * shift(&gradient.as_slice()[n..]);
        let torque = left_jacobian(turn).transpose() * (rotation * shift(&gradient.as_slice()[n + 3..]));
        for k in 0..3 {
            gradient[n + k] = force[k];
            gradient[n + 3 + k] = torque[k];
        }
    }

    /// The largest difference of two estimates' free parameters, in scaled coordinates.
    pub(crate) fn apart(&self, a: &Estimate, b: &Estimate) -> f64 {
        (0..a.z.len()).map(|k| self.coordinate_distance(k, a, b)).fold(0.0, f64::max)
    }

    /// The difference in free parameter k, scaled.
    pub(crate) fn coordinate_distance(&self, k: usize, a: &Estimate, b: &Estimate) -> f64 {
        ((a.z[k] - b.z[k]) * self.scale[k]).abs()
    }

    /// The scaled step from one estimate's free parameters to another's.
    pub(crate) fn step(&self, from: &Estimate, to: &Estimate) -> Vec<f64> {
        from.z.iter().zip(&to.z).zip(&self.scale).map(|((from, to), scale)| (to - from) * scale).collect()
    }

    /// How different some of an estimate's free parameters are from those at reference, by what they may be: the sum of
    /// squared differences, each over the stretch in which the parameter is looked for. What moves the surface most
    /// does not count more than the rest here: a start that is 20 % off in every value is nearer to the truth than to
    /// the truth relabelled.
    pub(crate) fn normalised_distance(&self, members: &[usize], at: &Estimate, reference: &Estimate, size: f64) -> f64 {
        let one = |k: &usize| {
            let (low, high) = self.search_range(*k, reference.z[*k], size);
            ((at.z[*k] - reference.z[*k]) / (high - low).max(f64::MIN_POSITIVE)).powi(2)
        };
        members.iter().map(one).sum()
    }

    /// Per free parameter: whether it stands at a bound.
    pub(crate) fn at_bound(&self, at: &Estimate) -> Vec<bool> {
        self.rules
            .iter()
            .zip(&at.z)
            .map(|(rule, z)| {
                let (low, high) = rule.range();
                let near = 1e-9 * (high - low).min(1.0 + z.abs());
                *z <= low + near || *z >= high - near
            })
            .collect()
    }
}

impl Rule {
    fn range(self) -> (f64, f64) {
        match self {
            Rule::Plain { low, high } => (low, high),
            Rule::Fraction => (0.0, 1.0),
            Rule::AboveLow | Rule::BelowHigh => (0.0, f64::INFINITY),
        }
    }
}

/// As `f64::clamp`, but without a panic where the bounds are crossed.
fn clamp(x: f64, low: f64, high: f64) -> f64 {
    x.min(high).max(low)
}

fn shift(pose: &[f64]) -> DVec3 {
    DVec3::new(pose[0], pose[1], pose[2])
}
