//! Which parameters make the objects differ, by how far they move the surface.

use crate::eigen;
use crate::model::{Atlas, AtlasError, Model, Motion, Sensitivities, Texels};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Side of the texture whose texels sample the surface.
const SIDE: u32 = 128;

/// How far the surface moves along its normal where parameters change: the mean over the area of the product of the
/// movements by two parameters, per unit of each. Square millimetres over the units.
#[derive(Clone, Debug, PartialEq)]
pub struct Movements {
    names: Vec<String>,
    matrix: DMatrix<f64>,
}

impl Movements {
    /// The movements of a model at `x`.
    ///
    /// # Errors
    /// If the surface cannot be evaluated there, or has too many patches to be sampled.
    pub fn of(model: &dyn Model, x: &[f64]) -> Result<Self, AtlasError> {
        let instance = model.instantiate(x)?;
        let atlas = Atlas::new(model, &*instance, SIDE)?;
        let texels = Texels::of_model(model, &*instance, &atlas)?;
        let sensitivities = Sensitivities::new(model, &*instance, &atlas, &texels, &Motion::IDENTITY)?;
        let count = model.parameters().len();
        let mut matrix = DMatrix::zeros(count, count);
        let mut total = 0.0;
        let mut areas = vec![0.0; texels.part_names.len()];
        let area = |i: usize| f64::from(texels.area[i]).max(0.0);
        (0..texels.len()).for_each(|i| areas[texels.part[i] as usize] += area(i));
        for part in &sensitivities.parts {
            let all: f64 = part.texels.iter().map(|i| area(*i)).sum();
            // Of large parts only a sample has derivatives; it stands for the whole.
            let whole = part.texels.first().map_or(0.0, |i| areas[texels.part[*i] as usize]);
            total += whole;
            for (k, i) in part.texels.iter().enumerate() {
                let weight = area(*i) * if all > 0.0 { whole / all } else { 0.0 };
                let rows = &part.derivatives[k * part.active.len()..(k + 1) * part.active.len()];
                let along: Vec<f64> = rows.iter().map(|d| (0..3).map(|c| d[c] * part.normals[k][c]).sum()).collect();
                for (a, p) in part.active.iter().enumerate() {
                    for (b, q) in part.active.iter().enumerate() {
                        let product = weight * along[a] * along[b];
                        matrix[(*p, *q)] += if product.is_finite() { product } else { 0.0 };
                    }
                }
            }
        }
        matrix /= if total > 0.0 { total } else { 1.0 };
        Ok(Self { names: sensitivities.parameters.into_iter().map(|(name, _)| name).collect(), matrix })
    }

    /// The matrix of some parameters.
    fn of_names(&self, names: &[String]) -> Option<DMatrix<f64>> {
        let place = |name: &String| self.names.iter().position(|other| other == name);
        let places = names.iter().map(place).collect::<Option<Vec<usize>>>()?;
        Some(DMatrix::from_fn(places.len(), places.len(), |i, j| self.matrix[(places[i], places[j])]))
    }
}

/// What one parameter contributes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Contribution {
    /// The parameter.
    pub name: String,
    /// Its standard deviation between objects, without that of measurement. In its unit.
    pub between: f64,
    /// Root mean square movement of the surface along its normal by that. Millimetres.
    pub movement: f64,
    /// Its share of the mean square movement by all parameters together; may be negative where it makes up for others.
    pub share: f64,
    /// How it changes along the direction in which the objects differ most, for one standard deviation. In its unit.
    pub principal: f64,
}

/// How the objects differ: the covariance of the parameters between objects, which is that of the values less the mean
/// covariance of measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Variation {
    /// The number of objects.
    pub count: usize,
    /// The parameters, the one that moves the surface most first.
    pub contributions: Vec<Contribution>,
    /// Root mean square movement of the surface by all of them. Millimetres.
    pub movement: f64,
    /// The share of the mean square movement along the direction in which the objects differ most.
    pub principal_share: f64,
}

impl Variation {
    /// From the values of the parameters `names` by object, and the covariances of their errors. None of fewer than
    /// three objects, or if nothing varies beyond measurement.
    #[must_use]
    pub fn of(
        names: &[String],
        values: &[Vec<f64>],
        errors: &[DMatrix<f64>],
        movements: &Movements,
    ) -> Option<(Self, DMatrix<f64>)> {
        let (n, p) = (values.len(), names.len());
        if n < 3 || p == 0 || errors.len() != n {
            return None;
        }
        let metric = movements.of_names(names)?;
        let between = between(values, errors);
        // Movements as lengths: the metric's root makes every direction a length on the surface.
        let half = root(&metric);
        let moved = eigen::symmetric(&half * &between * &half);
        let total = moved.eigenvalues.iter().map(|l| l.max(0.0)).sum::<f64>();
        if !(total > 0.0) {
            return None;
        }
        let first = (0..p).max_by(|a, b| moved.eigenvalues[*a].total_cmp(&moved.eigenvalues[*b]))?;
        let largest = moved.eigenvalues[first];
        let axis: DVector<f64> = moved.eigenvectors.column(first).into_owned();
        let principal = &between * &half * axis / largest.sqrt();
        let product = &metric * &between;
        let contribution = |k: usize| Contribution {
            name: names[k].clone(),
            between: between[(k, k)].max(0.0).sqrt(),
            movement: (metric[(k, k)] * between[(k, k)]).max(0.0).sqrt(),
            share: product[(k, k)] / product.trace(),
            principal: principal[k],
        };
        let mut contributions: Vec<Contribution> = (0..p).map(contribution).collect();
        contributions.sort_by(|a, b| b.movement.total_cmp(&a.movement));
        let (movement, principal_share) = (total.sqrt(), largest / total);
        Some((Self { count: n, contributions, movement, principal_share }, between))
    }
}

/// The covariance between objects, with no variance below zero.
fn between(values: &[Vec<f64>], errors: &[DMatrix<f64>]) -> DMatrix<f64> {
    let (n, p) = (values.len() as f64, values[0].len());
    let mean = |k: usize| values.iter().map(|x| x[k]).sum::<f64>() / n;
    let means: Vec<f64> = (0..p).map(mean).collect();
    let sample = DMatrix::from_fn(p, p, |i, j| {
        values.iter().map(|x| (x[i] - means[i]) * (x[j] - means[j])).sum::<f64>() / (n - 1.0)
    });
    let of_errors = errors.iter().fold(DMatrix::zeros(p, p), |sum, c| sum + c) / n;
    // In standard deviations of the sample, or parameters of small units would be clipped away.
    let scale = DVector::from_fn(p, |k, _| if sample[(k, k)] > 0.0 { sample[(k, k)].sqrt() } else { 1.0 });
    let difference = DMatrix::from_fn(p, p, |i, j| (sample[(i, j)] - of_errors[(i, j)]) / (scale[i] * scale[j]));
    let clipped = positive(&difference, |l| l);
    DMatrix::from_fn(p, p, |i, j| clipped[(i, j)] * scale[i] * scale[j])
}

/// A symmetric matrix with its eigenvalues changed, those below zero being zero.
fn positive(matrix: &DMatrix<f64>, change: impl Fn(f64) -> f64) -> DMatrix<f64> {
    let eigen = eigen::symmetric(matrix.clone());
    let values = eigen.eigenvalues.map(|l| change(l.max(0.0)));
    &eigen.eigenvectors * DMatrix::from_diagonal(&values) * eigen.eigenvectors.transpose()
}

fn root(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    positive(matrix, f64::sqrt)
}
