//! The share of a part's deviations that changes of the parameters would explain, and the deviation of form that
//! remains.

use super::Deviations;
use crate::eigen;
use crate::model::{PartSensitivities, Sensitivities};
use crate::robust::{MAD_TO_SD, median_and_deviation};
use glam::DVec3;
use gml_compiler::program::Quantity;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Outliers (edges of holes, clutter) are this many robust standard deviations from the median; they are left out.
const OUTLYING: f64 = 4.0;

/// A movement whose square has at most this share along the normal is tangential, but for rounding.
const TANGENTIAL: f64 = 1e-12;

/// Eigenvalues below this share of the largest are singular.
const SINGULAR: f64 = 1e-9;

/// How a part's deviations follow from its parameters. With s_k = n . dS/dx_k, the change of parameter k that explains
/// most of the signed distances d is the least squares solution, each texel weighted by its area; its share is the part
/// of the mean square of d that vanishes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Explanation {
    /// Number of texels that this is estimated from.
    pub texels: usize,
    /// Root mean square of their deviations. Millimetres.
    pub rms: f64,
    /// The effect of each parameter alone, the largest first.
    pub parameters: Vec<ParameterEffect>,
    /// The share that all parameters of the part explain together.
    pub all_parameters: f64,
    /// The share that a rigid motion of the part explains (three shifts, three small rotations).
    pub position: f64,
    /// The deviation of form: root mean square of what remains without both, noise of the scan included. Millimetres.
    pub form: f64,
}

/// The effect of one parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterEffect {
    /// Its name.
    pub name: String,
    /// The change of the parameter that explains the most of this part's deviations.
    pub change: f64,
    /// Unit of `change`: `mm`, `rad` or empty.
    pub unit: String,
    /// The share of the mean square deviation that this change explains, from 0 to 1.
    pub share: f64,
}

/// The explanation of each part; none if too little was measured.
#[must_use]
pub(in crate::variance) fn explain(deviations: &Deviations, sensitivities: &Sensitivities) -> Vec<Option<Explanation>> {
    sensitivities.parts.iter().map(|part| explain_part(deviations, part, &sensitivities.parameters)).collect()
}

fn explain_part(
    deviations: &Deviations,
    part: &PartSensitivities,
    parameters: &[(String, Quantity)],
) -> Option<Explanation> {
    let inliers = inliers(deviations, &part.texels);
    let active = part.active.len();
    // Three equations for each unknown at least.
    if inliers.len() < 3 * (active + 6) {
        return None;
    }
    let texels = &deviations.texels;
    let point = |k: &usize| DVec3::from(texels.position[part.texels[*k]]);
    let centre = inliers.iter().map(&point).sum::<DVec3>() / inliers.len() as f64;
    let mut columns = DMatrix::zeros(inliers.len(), active + 6);
    let mut distances = DVector::zeros(inliers.len());
    for (row, k) in inliers.iter().enumerate() {
        let i = part.texels[*k];
        let normal = DVec3::from(part.normals[*k]);
        // Rows are scaled so that sums of squares are weighted by area.
        let weight = f64::from(texels.area[i]).max(0.0).sqrt();
        distances[row] = weight * f64::from(deviations.signed(i));
        for (c, derivative) in part.derivatives[k * active..(k + 1) * active].iter().enumerate() {
            columns[(row, c)] = weight * normal.dot(DVec3::from(*derivative));
        }
        let turned = (point(k) - centre).cross(normal);
        for (c, value) in normal.to_array().into_iter().chain(turned.to_array()).enumerate() {
            columns[(row, active + c)] = weight * value;
        }
    }
    for c in 0..active {
        let all = |k: &usize| {
            let area = f64::from(texels.area[part.texels[*k]]).max(0.0);
            area * DVec3::from(part.derivatives[k * active + c]).length_squared()
        };
        // A movement of the surface within itself explains nothing but rounding.
        if columns.column(c).norm_squared() <= TANGENTIAL * inliers.iter().map(all).sum::<f64>() {
            columns.column_mut(c).fill(0.0);
        }
    }
    let total_square = distances.norm_squared();
    let area: f64 = inliers.iter().map(|k| f64::from(texels.area[part.texels[*k]]).max(0.0)).sum();
    if !(total_square > 0.0 && area > 0.0 && columns.iter().all(|x| x.is_finite())) {
        return None;
    }
    let share =
        |first: usize, count: usize| explained(&columns.columns(first, count).into_owned(), &distances) / total_square;
    let mut effects: Vec<ParameterEffect> = part
        .active
        .iter()
        .enumerate()
        .filter_map(|(c, p)| {
            let (square, product) = (columns.column(c).norm_squared(), columns.column(c).dot(&distances));
            let (name, quantity) = parameters.get(*p)?;
            let change = product / square;
            let share = product * change / total_square;
            let effect = ParameterEffect { name: name.clone(), change, unit: quantity.unit().to_owned(), share };
            (square > 0.0 && change.is_finite()).then_some(effect)
        })
        .collect();
    effects.sort_by(|a, b| b.share.total_cmp(&a.share));
    let remaining = (1.0 - share(0, active + 6)).max(0.0);
    Some(Explanation {
        texels: inliers.len(),
        rms: (total_square / area).sqrt(),
        parameters: effects,
        all_parameters: share(0, active),
        position: share(active, 6),
        form: (remaining * total_square / area).sqrt(),
    })
}

/// Indices into the sample of the texels that have a distance and are not outliers.
fn inliers(deviations: &Deviations, texels: &[usize]) -> Vec<usize> {
    let signed = |k: usize| f64::from(deviations.signed(texels[k]));
    let measured: Vec<usize> = (0..texels.len()).filter(|k| !signed(*k).is_nan()).collect();
    let mut distances: Vec<f64> = measured.iter().map(|k| signed(*k)).collect();
    let Some((middle, spread)) = median_and_deviation(&mut distances) else { return Vec::new() };
    let limit = (OUTLYING * MAD_TO_SD * spread).max(deviations.precision);
    measured.into_iter().filter(|k| (signed(*k) - middle).abs() <= limit).collect()
}

/// The squared length of the projection of `distances` onto the space of the columns.
fn explained(columns: &DMatrix<f64>, distances: &DVector<f64>) -> f64 {
    if columns.ncols() == 0 {
        return 0.0;
    }
    // Columns of different units are normalised first; those that are zero stay zero.
    let scaled = DMatrix::from_columns(
        &columns
            .column_iter()
            .map(|c| if c.norm() > 0.0 { c / c.norm() } else { c.into_owned() })
            .collect::<Vec<DVector<f64>>>(),
    );
    let eigen = eigen::symmetric(scaled.tr_mul(&scaled));
    let product = scaled.tr_mul(distances);
    let largest = eigen.eigenvalues.max();
    let shares = eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter())
        .filter(|(value, _)| **value > SINGULAR * largest)
        .map(|(value, vector)| vector.dot(&product).powi(2) / value);
    // The sum of nothing is -0.
    0.0 + shares.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Atlas, Model, Motion, Texels};
    use gml_compiler::program::{Options, compile};
    use gml_compiler::source::{NoFiles, SourceFile};
    use std::f64::consts::TAU;

    /// A cylinder of radius 20 and height 50, moved, with deviations that depend on the angle and the height.
    fn explained(deviation: impl Fn(f64, f64) -> f64) -> Explanation {
        let text = "use std.surface (cylinder)\nmodel can { param r: length = 20mm; param h: length = 50mm; param idle: length = 1mm\n\
                    part side = cylinder(r, h) }";
        let script = SourceFile { name: "can.gml".to_owned(), text: text.to_owned() };
        let program = compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program;
        let instance = Model::instantiate(&program, &[20.0, 50.0, 1.0]).expect("it exists");
        let atlas = Atlas::new(&program, &*instance, 128).expect("it fits");
        let mut texels = Texels::of_model(&program, &*instance, &atlas).expect("it is finite");
        let at = |p: &[f64; 3]| deviation(p[1].atan2(p[0]), p[2]) as f32;
        let outward: Vec<f32> = texels.position.iter().map(at).map(|d| if d >= 0.0 { d } else { f32::NAN }).collect();
        let inward = texels.position.iter().map(at).map(|d| if d < 0.0 { -d } else { f32::NAN }).collect();
        let motion =
            Motion { rotation: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], translation: [5.0, 7.0, -3.0] };
        motion.move_texels(&mut texels);
        let sensitivities = Sensitivities::new(&program, &*instance, &atlas, &texels, &motion).expect("it is smooth");
        let deviations = Deviations::new(texels, 5.0, outward, inward);
        explain(&deviations, &sensitivities).remove(0).expect("enough is measured")
    }

    fn near(a: f64, b: f64, what: &str) {
        // The sample is a subset of the texels: sums of waves over it vanish to about a percent.
        assert!((a - b).abs() < 0.01, "{what}: {a}, not {b}");
    }

    #[test]
    fn a_larger_radius_and_three_lobes_are_told_apart() {
        let found = explained(|angle, _| 0.2 + 0.1 * (3.0 * angle).cos());
        assert_eq!(found.parameters.iter().map(|p| p.name.as_str()).collect::<Vec<_>>(), ["r"]);
        near(found.parameters[0].change, 0.2, "change of r");
        near(found.parameters[0].share, 0.04 / 0.045, "share of r");
        near(found.all_parameters, 0.04 / 0.045, "share of all");
        near(found.position, 0.0, "share of the position");
        near(found.rms, 0.045f64.sqrt(), "rms");
        near(found.form, 0.1 / 2f64.sqrt(), "form");
    }

    #[test]
    fn a_shift_is_a_position_and_no_radius() {
        let found = explained(|angle, _| 0.3 * angle.cos());
        near(found.parameters[0].share, 0.0, "share of r");
        near(found.position, 1.0, "share of the position");
        near(found.form, 0.0, "form");
    }

    #[test]
    fn waves_along_the_axis_are_form() {
        let found = explained(|_, z| 0.1 * (z / 50.0 * 4.0 * TAU).sin());
        near(found.form, found.rms, "form");
    }
}
