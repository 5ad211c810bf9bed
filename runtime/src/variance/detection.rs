//! Levels of detection: above them a deviation is more than the uncertainty of the scan and of the fit.

use super::Deviations;
use crate::model::{Sensitivities, Texels};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Two-sided 95 % of the normal distribution.
const LEVEL: f64 = 1.959_964;

/// Covariance of fitted parameters and of a fitted pose.
#[derive(Clone, Copy, Debug)]
pub struct ParameterCovariance<'a> {
    /// Names of the parameters.
    pub parameters: &'a [String],
    /// The matrix by rows, in the parameters' units; where a pose was fitted as well, with six more rows and columns
    /// for its shift along x, y and z (millimetres) and its turn about them (radians).
    pub matrix: &'a [Vec<f64>],
    /// The point about which the pose turns, in the scan's frame, if one was fitted. Millimetres.
    pub centre: Option<[f64; 3]>,
}

/// The level of detection of a part, as M3C2 defines it for pairs of scans (Lague, Brodu and Leroux, 'Accurate 3D
/// comparison of complex topography with terrestrial laser scanner', 2013): at 95 % confidence, the scan's noise and
/// the fit's uncertainty do not explain a deviation above 1.96 sqrt(noise^2 + model^2). In a cloud every texel has a
/// level of its own, with its own uncertainty for the noise; `level` is that of the part's `noise`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Detection {
    /// Standard deviation of a point of the scan along the normal; in a cloud standard uncertainty of a texel's
    /// distance by the scatter of the points about it, root mean square over the part. Millimetres.
    pub noise: f64,
    /// Standard deviation of the model's surface along its normal, from the covariance of the fitted parameters: root
    /// mean square over the part. Millimetres; 0 without a fit.
    pub model: f64,
    /// The level. Millimetres.
    pub level: f64,
    /// The share of the part's measured area that deviates by more than the level.
    pub significant: f64,
}

/// The level of each part. `noise` is the scan's, in millimetres.
#[must_use]
pub(in crate::variance) fn detect(
    deviations: &Deviations,
    noise: f64,
    fit: Option<(&Sensitivities, ParameterCovariance<'_>)>,
) -> Vec<Detection> {
    let texels = &deviations.texels;
    let model = |part: usize| {
        fit.map_or(0.0, |(sensitivities, covariance)| {
            surface_deviation(sensitivities, covariance, &deviations.texels, part)
        })
    };
    let noises = noises(deviations, noise);
    let models: Vec<f64> = (0..texels.part_names.len()).map(model).collect();
    let mut areas = vec![[0.0; 2]; models.len()];
    for (i, part) in texels.part.iter().enumerate() {
        let (signed, area) = (f64::from(deviations.signed(i)), f64::from(texels.area[i]));
        if !signed.is_nan() && area > 0.0 {
            let part = *part as usize;
            let noise = deviations.uncertainty.get(i).map_or(noise, |u| f64::from(*u));
            let level = LEVEL * noise.hypot(models[part]);
            areas[part][usize::from(signed.abs() > level.max(deviations.precision))] += area;
        }
    }
    let detection = |((model, noise), [below, above]): ((f64, f64), [f64; 2])| Detection {
        noise,
        model,
        level: LEVEL * noise.hypot(model),
        significant: if below + above > 0.0 { above / (below + above) } else { 0.0 },
    };
    models.into_iter().zip(noises).zip(areas).map(detection).collect()
}

/// By part the noise of its texels: that of the scan's points, or of a cloud the root mean square of the texels' own
/// uncertainties. Millimetres.
fn noises(deviations: &Deviations, noise: f64) -> Vec<f64> {
    let texels = &deviations.texels;
    let mut sums = vec![(0.0, 0.0); texels.part_names.len()];
    for (i, u) in deviations.uncertainty.iter().enumerate() {
        let (area, square) = (f64::from(texels.area[i]).max(0.0), f64::from(*u).powi(2));
        if !(deviations.signed(i).is_nan() || square.is_nan()) {
            let (sum, total) = sums[texels.part[i] as usize];
            sums[texels.part[i] as usize] = (sum + area * square, total + area);
        }
    }
    sums.into_iter().map(|(sum, area)| if area > 0.0 { f64::sqrt(sum / area) } else { noise }).collect()
}

/// Root mean square over a part's sampled texels of the surface's standard deviation along its normal. Millimetres.
fn surface_deviation(
    sensitivities: &Sensitivities,
    covariance: ParameterCovariance<'_>,
    texels: &Texels,
    part: usize,
) -> f64 {
    let variances = surface_variances(sensitivities, covariance, texels, part);
    if variances.is_empty() { 0.0 } else { (variances.iter().sum::<f64>() / variances.len() as f64).sqrt() }
}

/// At each of a part's sampled texels the variance s^T C s of the surface along its normal, where s are the effects of
/// the parameters and of the pose there. Square millimetres.
pub(in crate::variance) fn surface_variances(
    sensitivities: &Sensitivities,
    covariance: ParameterCovariance<'_>,
    texels: &Texels,
    part: usize,
) -> Vec<f64> {
    let Some(part) = sensitivities.parts.get(part) else { return Vec::new() };
    let index = |p: &usize| {
        let (name, _) = sensitivities.parameters.get(*p)?;
        covariance.parameters.iter().position(|fitted| fitted == name)
    };
    let indices: Vec<Option<usize>> = part.active.iter().map(index).collect();
    let entry = |a: usize, b: usize| covariance.matrix.get(a).and_then(|row| row.get(b)).copied().unwrap_or(0.0);
    let variance = |(k, normal): (usize, &[f64; 3])| {
        let normal = DVec3::from(*normal);
        let mut effects: Vec<(usize, f64)> = part.derivatives[k * indices.len()..(k + 1) * indices.len()]
            .iter()
            .zip(&indices)
            .filter_map(|(d, index)| Some(((*index)?, normal.dot(DVec3::from(*d)))))
            .collect();
        if let Some(centre) = covariance.centre {
            // shift + turn x (p - centre), along the normal.
            let p = DVec3::from(texels.position[part.texels[k]]);
            let turned = (p - DVec3::from(centre)).cross(normal);
            let first = covariance.parameters.len();
            effects.extend(
                normal.to_array().into_iter().chain(turned.to_array()).enumerate().map(|(a, x)| (first + a, x)),
            );
        }
        let variance: f64 =
            effects.iter().map(|(a, x)| effects.iter().map(|(b, y)| x * entry(*a, *b) * y).sum::<f64>()).sum();
        variance.max(0.0)
    };
    part.normals.iter().enumerate().map(variance).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::PartSensitivities;
    use gml_compiler::program::Quantity;

    /// Two parts of two texels, one of which deviates by much, one by little, one by nothing known.
    #[test]
    fn what_is_above_noise_and_fit_is_significant() {
        let texels = Texels {
            width: 4,
            height: 1,
            index: vec![0, 1, 2, 3],
            part: vec![0, 0, 1, 1],
            position: vec![[0.0; 3]; 4],
            normal: vec![[0.0, 0.0, 1.0]; 4],
            area: vec![1.0, 3.0, 2.0, 5.0],
            side: vec![1.0; 4],
            part_names: vec!["a".into(), "b".into()],
        };
        let nan = f32::NAN;
        let deviations = Deviations::new(texels, 5.0, vec![1.1, 0.9, nan, nan], vec![nan, nan, 0.7, nan]);
        // The surface of `a` moves by 2 along its normal for a unit of p, and by 1 for one of q; `b` does not.
        let part = |derivatives: Vec<[f64; 3]>, active: Vec<usize>, texels: Vec<usize>| PartSensitivities {
            normals: vec![[0.0, 0.0, 1.0]; texels.len()],
            texels,
            active,
            derivatives,
        };
        let a = part(vec![[9.0, 0.0, 2.0], [0.0, 0.0, 1.0], [0.0, 5.0, 2.0], [0.0, 0.0, 1.0]], vec![1, 2], vec![0, 1]);
        let sensitivities = Sensitivities {
            parts: vec![a, part(vec![], vec![], vec![2, 3])],
            parameters: ["fixed", "p", "q"].map(|n| (n.to_owned(), Quantity::Length)).to_vec(),
        };
        let parameters = ["q".to_owned(), "p".to_owned()];
        let matrix = [vec![0.04, -0.01], vec![-0.01, 0.03]];
        let covariance = ParameterCovariance { parameters: &parameters, matrix: &matrix, centre: None };
        let found = detect(&deviations, 0.3, Some((&sensitivities, covariance)));
        // 4 * 0.03 + 0.04 - 2 * 2 * 0.01
        assert!((found[0].model - 0.12f64.sqrt()).abs() < 1e-12, "{found:?}");
        assert!((found[0].level - 1.959_964 * 0.21f64.sqrt()).abs() < 1e-12, "{found:?}");
        assert_eq!((found[0].significant, found[1].significant), (0.25 + 0.75, 1.0));
        // A pose that shifts along z as `p` moves the surface back, and turns about an axis 2 mm beside the texels.
        let mut joint = vec![vec![0.0; 8]; 8];
        joint[1][1] = 0.25;
        joint[4][4] = 1.0;
        (joint[1][4], joint[4][1]) = (-0.4999, -0.4999);
        joint[5][5] = 0.01;
        let covariance =
            ParameterCovariance { parameters: &parameters, matrix: &joint, centre: Some([0.0, -2.0, 0.0]) };
        let found = detect(&deviations, 0.3, Some((&sensitivities, covariance)));
        // 4 * 0.25 + 1 - 2 * 2 * 0.4999, and 2^2 * 0.01 of the turn; without the pose it would be 1.
        assert!((found[0].model - 0.0404f64.sqrt()).abs() < 1e-12, "{found:?}");
        // The second part moves with the pose alone.
        assert!((found[1].model - 1.04f64.sqrt()).abs() < 1e-12, "{found:?}");
        let alone = detect(&deviations, 0.5, None);
        assert_eq!((alone[0].model, alone[0].significant, alone[1].significant), (0.0, 0.25, 0.0));
    }
}
