//! Nonlinear regression: least squares of a script's function over measured values, to full precision, with its exact
//! Jacobian. The residuals are those of the response, not distances from the surface.

use gml_runtime::model::Model;
use nalgebra::{DMatrix, DVector};

/// A measurement: the response at one or two predictors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Observation {
    /// The first predictor, passed to the part's surface as u. Any number: it need not lie in [0, 1].
    pub(crate) u: f64,
    /// The second predictor, passed as v.
    pub(crate) v: f64,
    /// The response; the model's is the z coordinate of its first part, in millimetres.
    pub(crate) response: f64,
}

/// The result of a regression.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Regression {
    /// The model's parameters in its order.
    pub(crate) x: Vec<f64>,
    /// Their standard deviations: the residual standard deviation times the roots of the diagonal of (J^T J)^-1.
    pub(crate) sd: Vec<f64>,
    /// The sum of squared residuals.
    pub(crate) sum_of_squares: f64,
    /// Number of steps that were tried.
    pub(crate) iterations: usize,
    /// Whether the last steps were as small as rounding errors.
    pub(crate) converged: bool,
}

/// Largest number of steps.
const ITERATIONS: usize = 5000;

/// Residuals and Jacobian at some parameters.
struct Linear {
    residual: DVector<f64>,
    jacobian: DMatrix<f64>,
    sum: f64,
}

/// Minimises the sum of squared differences between the response of the model's first part and the observations, from
/// `start`: Levenberg-Marquardt with orthogonal factorisations and columns scaled by their largest norms so far (More
/// 1978), which does not square the condition of the Jacobian. Bounds are ignored. None if the model cannot be
/// evaluated at the start or has no part, or if there are not more observations than parameters.
pub(crate) fn regress(model: &dyn Model, observations: &[Observation], start: &[f64]) -> Option<Regression> {
    let n = start.len();
    if model.parts().is_empty() || observations.len() <= n || n == 0 {
        return None;
    }
    let mut x = DVector::from_column_slice(start);
    let mut at = linearise(model, observations, &x)?;
    let mut scale = DVector::from_element(n, 0.0);
    let (mut damping, mut growth) = (1e-3, 2.0);
    let (mut iterations, mut converged) = (0, false);
    while iterations < ITERATIONS && !converged {
        iterations += 1;
        for k in 0..n {
            scale[k] = at.jacobian.column(k).norm().max(scale[k]).max(f64::MIN_POSITIVE);
        }
        let Some(step) = solve(&at, &scale, damping) else { break };
        let trial_x = &x + &step;
        let small = (0..n).all(|k| step[k].abs() <= 1e-15 * x[k].abs());
        let trial = linearise(model, observations, &trial_x);
        let gain = trial.as_ref().map_or(f64::NEG_INFINITY, |t| at.sum - t.sum);
        if gain > 0.0 {
            let predicted = at.sum - (&at.residual + &at.jacobian * &step).norm_squared();
            let ratio = gain / predicted.max(f64::MIN_POSITIVE);
            damping = (damping * (1.0 - (2.0 * ratio - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-30);
            growth = 2.0;
            x = trial_x;
            at = trial?;
        } else {
            damping *= growth;
            growth *= 2.0;
        }
        converged = small || damping > 1e30;
    }
    // Undamped steps still improve the parameters where rounding of the sum hides the gain.
    for _ in 0..10 {
        let Some(step) = solve(&at, &scale, 0.0) else { break };
        let next = &x + &step;
        match linearise(model, observations, &next) {
            Some(there) if there.sum <= at.sum * (1.0 + 1e-12) => {
                converged |= (0..n).all(|k| step[k].abs() <= 1e-10 * next[k].abs());
                (x, at) = (next, there);
            }
            _ => break,
        }
    }
    let sd = deviations(&at, &scale);
    Some(Regression { x: x.as_slice().to_vec(), sd, sum_of_squares: at.sum, iterations, converged })
}

fn linearise(model: &dyn Model, observations: &[Observation], x: &DVector<f64>) -> Option<Linear> {
    let (m, n) = (observations.len(), x.len());
    let instance = model.instantiate(x.as_slice()).ok()?;
    let (u, v): (Vec<f64>, Vec<f64>) = observations.iter().map(|o| (o.u, o.v)).unzip();
    let mut points = vec![[0.0; 3]; m];
    instance.points(0, &u, &v, &mut points).ok()?;
    let active = &model.parts()[0].active;
    let mut slopes = vec![0.0; m * active.len() * 3];
    instance.jacobian(0, &u, &v, &mut slopes).ok()?;
    let residual = DVector::from_iterator(m, points.iter().zip(observations).map(|(p, o)| p[2] - o.response));
    let mut jacobian = DMatrix::zeros(m, n);
    for i in 0..m {
        for (a, k) in active.iter().enumerate() {
            jacobian[(i, *k as usize)] = slopes[(i * active.len() + a) * 3 + 2];
        }
    }
    let sum = residual.norm_squared();
    (sum.is_finite() && jacobian.iter().all(|j| j.is_finite())).then_some(Linear { residual, jacobian, sum })
}

/// The least-squares solution of [J; sqrt(damping) D] step = [-r; 0], by Householder's factorisation.
fn solve(at: &Linear, scale: &DVector<f64>, damping: f64) -> Option<DVector<f64>> {
    let (m, n) = at.jacobian.shape();
    let mut matrix = DMatrix::zeros(m + n, n);
    for k in 0..n {
        matrix.view_mut((0, k), (m, 1)).copy_from(&(at.jacobian.column(k) / scale[k]));
        matrix[(m + k, k)] = damping.sqrt();
    }
    let mut rhs = DVector::zeros(m + n);
    rhs.rows_mut(0, m).copy_from(&(-&at.residual));
    let factor = matrix.qr();
    factor.q_tr_mul(&mut rhs);
    let step = factor.unpack_r().solve_upper_triangular(&rhs.rows(0, n).into_owned())?;
    step.iter().all(|s| s.is_finite()).then(|| step.component_div(scale))
}

fn deviations(at: &Linear, scale: &DVector<f64>) -> Vec<f64> {
    let (m, n) = at.jacobian.shape();
    let scaled = DMatrix::from_fn(m, n, |i, k| at.jacobian[(i, k)] / scale[k]);
    let r = scaled.qr().unpack_r();
    let variance = at.sum / (m - n) as f64;
    match r.solve_upper_triangular(&DMatrix::identity(n, n)) {
        Some(inverse) => (0..n).map(|k| (variance * inverse.row(k).norm_squared()).sqrt() / scale[k]).collect(),
        None => vec![f64::INFINITY; n],
    }
}
