//! Fits of several models to one scan, compared by Schwarz's criterion (BIC).

use crate::fit::correspond::layout::Layout;
use crate::fit::monitor::Monitor;
use crate::fit::options::FitError;
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::{Objective, Order};
use crate::fit::problem::parameterization::Parameterization;
use crate::fit::problem::points::Points;
use crate::fit::result::FitResult;
use crate::fit::tuning::{CHORD, MODEL_SIZE};
use crate::model::Model;
use crate::scan::Scan;

/// A model and what its fit found.
#[derive(Clone, Copy)]
pub(crate) struct Rival<'a> {
    /// The model.
    pub model: &'a dyn Model,
    /// Its fit.
    pub fit: &'a FitResult,
}

/// The outcome of `compare`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Comparison {
    /// BIC of every rival; smaller is better.
    pub bic: Vec<f64>,
    /// Mean loss of every rival at the common scale.
    pub objective: Vec<f64>,
    /// The common scale of the loss: the least of the fits'. Millimetres.
    pub sigma: f64,
    /// How many independent points the best rival's fit says that there are.
    pub effective_points: f64,
}

/// Compares fits of several models to one scan: BIC = n ln(mean loss) + k ln n, for k parameters and n independent
/// points. With the squared distance as the loss this is the criterion of least squares with a variance that is not
/// known (Schwarz 1978). All are judged at one scale, the least of the fits' own, as a wider one forgives more. A
/// difference beyond 10 is strong (Kass and Raftery 1995).
///
/// # Errors
/// A scan without points, or a model that cannot be evaluated where its fit ended.
pub(crate) fn compare(rivals: &[Rival], scan: &Scan) -> Result<Comparison, FitError> {
    let weights = rivals.first().map(|rival| rival.fit.weights).unwrap_or_default();
    let points = Points::of(scan, weights);
    let radius = points.gyration();
    if points.len() == 0 || !(radius > 0.0) {
        return Err(FitError::EmptyScan { scan: scan.source.path.clone(), points: points.len() });
    }
    let sigma = rivals.iter().map(|r| r.fit.sigma).fold(f64::INFINITY, f64::min);
    let objective =
        rivals.iter().map(|r| mean_loss(*r, &points, radius, sigma)).collect::<Result<Vec<f64>, FitError>>()?;
    let best = (0..rivals.len()).min_by(|a, b| objective[*a].total_cmp(&objective[*b]));
    let known = best.and_then(|b| rivals[b].fit.covariance.as_ref()).map(|c| c.effective_points);
    let n = known.unwrap_or_else(|| points.effective()).max(2.0);
    let bic = rivals
        .iter()
        .zip(&objective)
        .map(|(rival, loss)| {
            let free = rival.fit.parameters.iter().filter(|p| !p.fixed).count();
            let pose = if rival.fit.pose.is_some() { 6 } else { 0 };
            n * loss.max(f64::MIN_POSITIVE).ln() + (free + pose) as f64 * n.ln()
        })
        .collect();
    Ok(Comparison { bic, objective, sigma, effective_points: n })
}

/// The mean loss of a fit at a scale (millimetres).
///
/// # Errors
/// The model cannot be evaluated where the fit ended.
pub(crate) fn at_scale(model: &dyn Model, fit: &FitResult, scan: &Scan, sigma: f64) -> Result<f64, FitError> {
    let points = Points::of(scan, fit.weights);
    let radius = points.gyration();
    mean_loss(Rival { model, fit }, &points, radius, sigma)
}

fn mean_loss(rival: Rival, points: &Points, radius: f64, sigma: f64) -> Result<f64, FitError> {
    let x: Vec<f64> = rival.fit.parameters.iter().map(|p| p.value).collect();
    let space = Parameterization::new(rival.model, &x, Vec::new(), true, &[]);
    let motion = rival.fit.pose.map_or(Isometry::IDENTITY, Isometry::from);
    let at = space.estimate(&x, motion);
    let instance = rival.model.instantiate(&x)?;
    let layout = Layout::new(rival.model, &*instance, CHORD * radius, MODEL_SIZE * radius);
    let monitor = Monitor::default();
    let objective = Objective::new(&space, &layout, points, Loss::welsch(sigma), &monitor);
    Ok(objective.evaluate(&at, Order::Value).map_or(1.0, |e| e.value))
}
