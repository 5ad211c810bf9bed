//! How well several scans together determine a shape and the poses: the sandwich estimator over all coordinates, with
//! the noise, the dependent residuals and the scale of the loss of every scan.

use super::bias::pull_of_noise;
use super::convergence::without_motions;
use super::pose::within_itself;
use super::sandwich::{Information, Inverse, Uncertainty, at_least, by_ends, is_held};
use super::switches;
use crate::eigen;
use crate::fit::optimise::joint::{add_square, add_vector, coordinates, motion_of};
use crate::fit::problem::objective::Objective;
use crate::fit::refine::joint::Joint;
use crate::fit::refine::schedule::Solution;
use crate::fit::result::WithoutSd;
use crate::fit::tuning::{HELD_STEP, SETTLED_STEP, SWITCH_ROUNDS};
use nalgebra::{DMatrix, DVector};

/// Eigenvalues of a scan's information on its pose, over the largest, below which there is only rounding.
const SINGULAR: f64 = 1e-10;

/// The covariance of the joint coordinates, and what of it belongs to each scan.
pub(crate) struct JointUncertainty {
    /// By scan, of the shape's coordinates and its motion's.
    pub(crate) of_scans: Vec<Uncertainty>,
    /// Directions (of unit length) of the joint coordinates in which no distance changes, without those in which one
    /// scan's motion alone varies.
    pub(crate) common: Vec<DVector<f64>>,
    /// The step that Newton's method would still take, in standard deviations.
    pub(crate) remaining: f64,
}

impl JointUncertainty {
    /// Whether so short a step remains that the place is the optimum.
    pub(crate) fn is_settled(&self) -> bool {
        self.remaining <= SETTLED_STEP
    }

    /// Whether so short a step remains that standard deviations can hold it.
    pub(crate) fn is_held(&self) -> bool {
        self.remaining <= HELD_STEP
    }
}

/// The sums over all scans. A scan's are multiplied by `factors`, sigma^2 of the first scan over that of this one: the
/// objective is the sum of losses by scales of their own.
struct Sums<'s> {
    free: usize,
    factors: Vec<f64>,
    information: Vec<Information<'s>>,
}

impl Sums<'_> {
    fn dim(&self) -> usize {
        self.free + 6 * self.factors.len()
    }

    /// The sum of matrices of all scans, times some powers of their factors.
    fn of(&self, power: i32, of_scan: impl Fn(usize) -> DMatrix<f64>) -> DMatrix<f64> {
        let mut sum = DMatrix::zeros(self.dim(), self.dim());
        for (scan, factor) in self.factors.iter().enumerate() {
            add_square(&mut sum, self.free, scan, factor.powi(power), &of_scan(scan));
        }
        sum
    }

    /// What of a joint matrix belongs to one scan.
    fn part(&self, matrix: &DMatrix<f64>, scan: usize) -> DMatrix<f64> {
        let chosen: Vec<usize> = coordinates(self.free, scan).collect();
        matrix.select_rows(&chosen).select_columns(&chosen)
    }
}

/// The uncertainty of a shape in several scans, which have the solutions `of`. None where the model does not exist or
/// the scans determine nothing.
pub(crate) fn assess(joint: &Joint, of: &[Solution]) -> Option<JointUncertainty> {
    let objectives: Vec<Objective> = of
        .iter()
        .map(|one| Objective { cache: Some(one.cache.clone()), ..one.objective(&one.level.problem.points) })
        .collect();
    let free = joint.free();
    let information = objectives.iter().zip(of).map(|(objective, one)| Information::of(objective, &one.estimate));
    let information = information.collect::<Option<Vec<Information>>>()?;
    let factors = of.iter().map(|one| (of[0].loss.sigma / one.loss.sigma).powi(2)).collect();
    let sums = Sums { free, factors, information };
    if sums.information.iter().map(Information::points).sum::<usize>() <= sums.dim() {
        return None;
    }
    let held = of[0].level.space.at_bound(&of[0].estimate);
    let weighted = sums.of(1, |scan| sums.information[scan].weighted.clone());
    let within = sums.of(1, |scan| sums.information[scan].within.clone());
    let mut inverse = Inverse::of(&sums.of(1, |scan| sums.information[scan].bread.clone()), &weighted, &held)?;
    let leverage = |scan: usize| sums.part(&inverse.weighted, scan) * sums.factors[scan];
    let meats: Vec<DMatrix<f64>> =
        (0..of.len()).map(|scan| sums.information[scan].meat(&objectives[scan], &leverage(scan))).collect();
    let meat = sums.of(2, |scan| meats[scan].clone());
    let mut covariance = &inverse.matrix * &meat * &inverse.matrix;
    let switches = objectives.iter().zip(of);
    let switches: Vec<_> =
        switches.map(|(objective, one)| switches::find(objective, &one.estimate, &held).unwrap_or_default()).collect();
    for _ in 0..SWITCH_ROUNDS {
        let bread = sums.of(1, |scan| {
            let of_scan = sums.part(&covariance, scan);
            switches::smoothed(&sums.information[scan].bread, &switches[scan], &of_scan)
        });
        inverse = Inverse::of(&bread, &weighted, &held)?;
        covariance = &inverse.matrix * &meat * &inverse.matrix;
    }
    let degrees = sums.dim() / of.len();
    let noise = sums.of(2, |scan| {
        let one = &sums.information[scan];
        &one.alike * one.variance(degrees)
    });
    let naive = &inverse.weighted * noise * &inverse.weighted;
    at_least(&mut covariance, &naive);
    let at_ends = by_ends(&weighted, &within, &held);
    let mut bias = DVector::zeros(sums.dim());
    let mut gradient = DVector::zeros(sums.dim());
    for (scan, one) in of.iter().enumerate() {
        if let Some(pull) = pull_of_noise(one) {
            add_vector(&mut bias, free, scan, sums.factors[scan], &(pull.gradient * pull.sum));
        }
        let sum = 0.5 * one.loss.sigma.powi(2) * one.level.problem.points.weight();
        add_vector(&mut gradient, free, scan, sums.factors[scan], &(&one.evaluation.gradient * sum));
    }
    let bias = -(&inverse.matrix * bias);
    let step = -(&inverse.matrix * gradient);
    let reason = |k: usize| match (inverse.determined[k], is_held(&held, k)) {
        (true, _) => at_ends[k].then_some(WithoutSd::ScanEnds),
        (false, true) => Some(WithoutSd::AtBound),
        (false, false) => Some(WithoutSd::NotDetermined),
    };
    let without: Vec<Option<WithoutSd>> = (0..sums.dim()).map(reason).collect();
    let alone: Vec<Vec<DVector<f64>>> = (0..of.len()).map(|scan| motions_alone(&sums, scan)).collect();
    let effective_points = sums.information.iter().map(Information::effective_points).sum();
    let step = settled(&sums, step, &naive, &alone, &without);
    let deviation = |k: usize| covariance[(k, k)].max(0.0).sqrt().max(f64::MIN_POSITIVE);
    let remaining = (0..sums.dim()).map(|k| step[k].abs() / deviation(k)).fold(0.0, f64::max);
    covariance += &bias * bias.transpose();
    if remaining > SETTLED_STEP && remaining <= HELD_STEP {
        covariance += &step * step.transpose();
    }
    let of_scan = |scan: usize| {
        let chosen: Vec<usize> = coordinates(free, scan).collect();
        Uncertainty {
            covariance: sums.part(&covariance, scan),
            bias: bias.select_rows(&chosen),
            inverse: sums.part(&inverse.matrix, scan),
            naive: sums.part(&naive, scan),
            undetermined: alone[scan].clone(),
            without: chosen.iter().map(|k| without[*k]).collect(),
            effective_points,
            blocks: sums.information[scan].blocks,
            without_bounds: None,
        }
    };
    let of_scans = (0..of.len()).map(of_scan).collect();
    let common = common(&sums, &inverse.undetermined, &alone);
    Some(JointUncertainty { of_scans, common, remaining })
}

/// The directions, by one scan's coordinates, in which its motion alone varies and no distance changes.
fn motions_alone(sums: &Sums, scan: usize) -> Vec<DVector<f64>> {
    let free = sums.free;
    let weighted = &sums.information[scan].weighted;
    let eigen = eigen::symmetric(weighted.view((free, free), (6, 6)).into_owned());
    let least = SINGULAR * eigen.eigenvalues.amax();
    let flat = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()).filter(|(value, _)| **value <= least);
    let whole = |motion: nalgebra::DVectorView<f64>| {
        let mut direction = DVector::zeros(free + 6);
        direction.rows_mut(free, 6).copy_from(&motion);
        direction
    };
    flat.map(|(_, motion)| whole(motion.as_view())).collect()
}

/// What of the undetermined directions is none of one scan's motion alone.
fn common(sums: &Sums, undetermined: &[DVector<f64>], alone: &[Vec<DVector<f64>>]) -> Vec<DVector<f64>> {
    let mut known: Vec<DVector<f64>> = Vec::new();
    for (scan, motions) in alone.iter().enumerate() {
        for motion in motions {
            let mut whole = DVector::zeros(sums.dim());
            add_vector(&mut whole, sums.free, scan, 1.0, motion);
            known.push(whole);
        }
    }
    let first = known.len();
    for direction in undetermined {
        let mut rest = direction.clone();
        known.iter().for_each(|k| rest.axpy(-k.dot(direction), k, 1.0));
        // Half of a unit vector is well above what rounding leaves.
        if rest.norm() > 0.5 {
            known.push(rest.normalize());
        }
    }
    known.split_off(first)
}

/// A step without what no scan determines, and without motions by which the model moves within itself.
fn settled(
    sums: &Sums,
    mut step: DVector<f64>,
    naive: &DMatrix<f64>,
    alone: &[Vec<DVector<f64>>],
    without: &[Option<WithoutSd>],
) -> DVector<f64> {
    for (scan, alone) in alone.iter().enumerate() {
        let motions = within_itself(&sums.part(naive, scan), alone, sums.free);
        let range = motion_of(sums.free, scan);
        let mut own = step.rows(range.start, range.len()).into_owned();
        without_motions(&mut own, &motions);
        step.rows_mut(range.start, range.len()).copy_from(&own);
    }
    (0..step.len()).filter(|k| without[*k].is_some()).for_each(|k| step[k] = 0.0);
    step
}
