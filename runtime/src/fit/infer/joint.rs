//! How well several scans together determine a shape and the poses: the sandwich estimator over all coordinates, with
//! the noise, the dependent residuals and the scale of the loss of every scan, and whether a scan agrees with the rest.

use super::bias::pull_of_noise;
use super::convergence::without_motions;
use super::pose::within_itself;
use super::sandwich::{Information, Inverse, Uncertainty, at_least, by_ends, is_held};
use super::significance::chi_squared_tail;
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
/// Eigenvalues of the covariance of a difference, over the largest, below which it says nothing.
const NO_DIFFERENCE: f64 = 1e-9;

/// The covariance of the joint coordinates, and what of it belongs to each scan.
pub(crate) struct JointUncertainty {
    /// By scan, of the shape's coordinates and its motion's.
    pub(crate) of_scans: Vec<Uncertainty>,
    /// Directions (of unit length) of the joint coordinates in which no distance changes, without those in which one
    /// scan's motion alone varies.
    pub(crate) common: Vec<DVector<f64>>,
    /// By scan, the probability of such a difference between what it says of the shape and what the others say; None
    /// where they have nothing to compare.
    pub(crate) agreement: Vec<Option<f64>>,
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
    let agreement = (0..of.len()).map(|scan| agreement(&sums, &meats, scan)).collect();
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
    Some(JointUncertainty { of_scans, common, agreement, remaining })
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

/// The probability of such a difference between the shape that one scan suggests and that of the others, if all show
/// one object. At the optimum the pulls of all scans on the shape, with their poses free, cancel; that of each has a
/// covariance that follows from all their meats (a score test, Rao 1948). `meats` are those of the scans' coordinates.
/// None where the scan says nothing of the shape or the others do not.
fn agreement(sums: &Sums, meats: &[DMatrix<f64>], scan: usize) -> Option<f64> {
    let free = sums.free;
    let of = |scan: usize| {
        let one = &sums.information[scan];
        let factor = sums.factors[scan];
        // From the scan's coordinates to the shape's, with the motion where it is best for each shape.
        let motion = one.weighted.view((free, free), (6, 6)).into_owned();
        let inverse = pseudo_inverse(&motion, SINGULAR);
        let mixed = one.weighted.view((0, free), (free, 6)).into_owned();
        let mut eliminate = DMatrix::zeros(free, free + 6);
        eliminate.view_mut((0, 0), (free, free)).fill_with_identity();
        eliminate.view_mut((0, free), (free, 6)).copy_from(&-(&mixed * &inverse));
        let information = &eliminate * &one.weighted * eliminate.transpose() * factor;
        let spread = &eliminate * &meats[scan] * eliminate.transpose() * factor.powi(2);
        let pull = &eliminate * one.pull() * factor;
        (information, spread, pull)
    };
    let all: Vec<(DMatrix<f64>, DMatrix<f64>, DVector<f64>)> = (0..sums.factors.len()).map(of).collect();
    let whole: DMatrix<f64> = all.iter().map(|(information, ..)| information).sum();
    let inverse = pseudo_inverse(&whole, NO_DIFFERENCE);
    let (information, spread, pull) = &all[scan];
    let others: DMatrix<f64> = all.iter().map(|(_, spread, _)| spread).sum();
    // The pull is a - S W a_all, with a the scan's own at the truth, S its information and W the inverse of all.
    let share = information * &inverse;
    let off = spread - &share * spread - spread * share.transpose() + &share * others * share.transpose();
    let off = (&off + off.transpose()) * 0.5;
    // By units in which information of all is 1, so that small eigenvalues are those of what is not compared.
    let unit = DVector::from_fn(free, |k, _| if whole[(k, k)] > 0.0 { whole[(k, k)].sqrt().recip() } else { 0.0 });
    let scaled = DMatrix::from_fn(free, free, |a, b| off[(a, b)] * unit[a] * unit[b]);
    let pull = pull.component_mul(&unit);
    let eigen = eigen::symmetric(scaled);
    let least = NO_DIFFERENCE * eigen.eigenvalues.amax();
    let known = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()).filter(|(value, _)| **value > least);
    let terms: Vec<f64> = known.map(|(value, direction)| direction.dot(&pull).powi(2) / value).collect();
    (!terms.is_empty()).then(|| chi_squared_tail(terms.iter().sum(), terms.len()))
}

/// The inverse over the eigenvectors whose eigenvalues are above a part of the largest, of a matrix whose coordinates
/// have one unit.
fn pseudo_inverse(matrix: &DMatrix<f64>, least: f64) -> DMatrix<f64> {
    let eigen = eigen::symmetric(matrix.clone());
    let least = least * eigen.eigenvalues.amax();
    let mut inverse = DMatrix::zeros(matrix.nrows(), matrix.nrows());
    for (value, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > least {
            inverse += direction * direction.transpose() / *value;
        }
    }
    inverse
}
