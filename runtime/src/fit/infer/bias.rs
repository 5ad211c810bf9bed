//! The bias that noise has: where the surface is curved, or ends in an edge, more than noise is wide, points that are
//! off along the surface are nearest to other places of it, and on the average the estimate is beside the truth (Fuller
//! 1987, section 3.1). How far is found by simulation: noise is put on the feet of the points, and the step that
//! Newton's method takes is the bias. Noise and its opposite are put on each point, so that what is linear in it, which
//! has no bias but all of the variance, cancels.

use super::sandwich::Uncertainty;
use crate::fit::problem::objective::Order;
use crate::fit::refine::schedule::Solution;
use crate::fit::tuning::{BIAS_PAIRS, BIAS_POINTS};
use glam::DVec3;
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// The uncertainty with the bias by noise, which the covariance holds from here on as the mean square of a systematic
/// error (GUM 2008, F.2.4.5, of biases that are not corrected).
pub(crate) fn include(solution: &Solution, uncertainty: Uncertainty) -> Uncertainty {
    let Some(Pull { gradient, sum }) = pull_of_noise(solution) else { return uncertainty };
    let bias = uncertainty.newton_step(&gradient, sum);
    Uncertainty {
        covariance: &uncertainty.covariance + &bias * bias.transpose(),
        without_bounds: uncertainty.without_bounds.map(|without| without.biased(&(gradient * sum), &bias)),
        bias,
        ..uncertainty
    }
}

/// The pull of noise on the coordinates.
pub(super) struct Pull {
    /// The mean gradient of the mean loss that noise alone makes at the solution.
    pub(super) gradient: DVector<f64>,
    /// Half of sigma^2 times the weight of the points. Square millimetres.
    pub(super) sum: f64,
}

/// The pull of noise as the scan has it, the same in every direction. Zero without noise; None where the model does not
/// exist or no point lies near it.
pub(super) fn pull_of_noise(solution: &Solution) -> Option<Pull> {
    let Solution { level, estimate, loss, evaluation, .. } = solution;
    let problem = level.problem;
    let noise = problem.scan.noise.min(evaluation.rms());
    let mut sum = DVector::zeros(level.space.dim());
    if !(noise > 0.0) {
        return Some(Pull { gradient: sum, sum: 0.0 });
    }
    let sample = problem.points.every(BIAS_POINTS);
    let objective = solution.objective(&sample);
    let placed = objective.place(estimate).ok()?;
    let feet = solution.inlier_feet(&objective, &placed);
    if feet.is_empty() {
        return None;
    }
    let near = sample.pick(feet.iter().map(|(index, _)| *index));
    let exact: Vec<DVec3> = feet.iter().map(|(_, foot)| placed.motion.apply(foot.point)).collect();
    let mut random = ChaCha8Rng::seed_from_u64(0);
    for _ in 0..BIAS_PAIRS {
        let mut offset = || noise * DVec3::from_array(std::array::from_fn(|_| StandardNormal.sample(&mut random)));
        let offsets: Vec<DVec3> = exact.iter().map(|_| offset()).collect();
        for sign in [1.0, -1.0] {
            let mut simulated = near.clone();
            simulated.position = exact.iter().zip(&offsets).map(|(p, off)| *p + sign * *off).collect();
            sum += solution.objective(&simulated).evaluate(estimate, Order::Gradient)?.gradient;
        }
    }
    let gradient = sum / (2 * BIAS_PAIRS) as f64;
    let weight = problem.points.weight() * near.weight() / sample.weight();
    Some(Pull { gradient, sum: 0.5 * loss.sigma.powi(2) * weight })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::tests::cup::scan_of;
    use crate::fit::tests::shapes::{Simple, simple};
    use crate::fit::{FitOptions, fit};
    use crate::progress::Silent;

    #[test]
    fn a_sphere_is_too_large_by_the_squared_noise_over_its_radius() {
        // |c + R n + e| is R + n e + (|e|^2 - (n e)^2) / 2R + ..., whose mean is R + s^2 / R.
        let (radius, noise, scans) = (6.0, 0.5, 8);
        let expected = noise * noise / radius;
        let model = simple(Simple::Sphere, &[radius]);
        let (mut off, mut found) = (0.0, 0.0);
        for seed in 0..scans {
            let mut scan = scan_of(&model, &[radius], 0.0, 3000, seed);
            let mut random = ChaCha8Rng::seed_from_u64(1000 + seed);
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            scan.mesh.positions.iter_mut().for_each(|p| *p = p.map(|c| c + noise * normal()));
            scan.noise = noise;
            let options = FitOptions { sigma: Some(3.6 * noise), ..FitOptions::default() };
            let result = fit(&model, &scan, &options, &Silent).unwrap();
            let [ref r] = result.parameters[..] else { panic!("one parameter") };
            off += (r.value - radius) / scans as f64;
            found += r.bias.unwrap() / scans as f64;
            assert!((r.value - radius).abs() < 4.0 * r.sd.unwrap() && r.sd.unwrap() > r.bias.unwrap(), "{r:?}");
        }
        // The mean of eight has a standard deviation of 0.5 / sqrt(24000) = 0.0032, a thirteenth of what is expected.
        assert!((off / expected - 1.0).abs() < 0.25, "{off} for {expected}");
        assert!((found / expected - 1.0).abs() < 0.15, "{found} for {expected}");
    }
}
