//! Which side of the model's patches is out. The script says so; the scan only says whether it faces the same way.

use super::level::Level;
use super::loss::Loss;
use super::objective::{Objective, Order};
use super::parameterization::Estimate;
use super::sums::PatchSum;
use crate::fit::tuning::{FACING_AGAINST, FACING_POINTS, OTHER_SIDE, REVERSED_SHARE, SIDED_SHARE};
use crate::model::Closedness;

/// The sides of the patches as the script has them, beside a scan.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Sides {
    /// Per patch, which way is out, in the sense of the scan's normals (see `Facing`). 0 for patches that face the
    /// other side of the scan: their points belong to them whichever way these face.
    pub(crate) signs: Vec<i8>,
    /// The scan's normals all point the other way.
    pub(crate) reversed: bool,
    /// Patches with the sign 0.
    pub(crate) contested: Vec<usize>,
}

impl Sides {
    /// The sides at an estimate, by points that are within the reach of `loss`. None where the model does not exist.
    pub(crate) fn of(level: &Level, estimate: &Estimate, loss: Loss) -> Option<Self> {
        let problem = level.problem;
        let parts = problem.model.parts().len();
        if !problem.oriented {
            return Some(Self { signs: vec![0; parts], ..Self::default() });
        }
        let objective = level.objective(&problem.thin, loss);
        let unsided = objective.evaluate(estimate, Order::Value)?.patches;
        let mut signs = vec![1; parts];
        if unsided.iter().any(|p| is_against(p, 1)) {
            // Only then it is worth the time to look at the bodies that the parts enclose.
            signs = outward(level, estimate);
        }
        let weight = |p: &PatchSum| if p.near >= FACING_POINTS { p.weight } else { 0.0 };
        let against = |signs: &[i8]| {
            unsided.iter().zip(signs).filter(|(p, s)| is_against(p, **s)).map(|(p, _)| weight(p)).sum::<f64>()
        };
        let reversed = against(&signs) > REVERSED_SHARE * unsided.iter().map(weight).sum::<f64>();
        if reversed {
            signs.iter_mut().for_each(|sign| *sign = -*sign);
        }
        let mut contested: Vec<usize> = (0..parts).filter(|p| is_against(&unsided[*p], signs[*p])).collect();
        if !contested.is_empty() {
            let sided = Objective { signs: Some(&signs), ..objective }.evaluate(estimate, Order::Value)?.patches;
            // Between the sides of a thin wall, what is nearest decides nothing.
            contested.retain(|p| faces_other_side(&unsided[*p], &sided[*p]));
            contested.iter().for_each(|p| signs[*p] = 0);
        }
        Some(Self { signs, reversed, contested })
    }

    /// Sentences for the user.
    pub(crate) fn warn(&self, level: &Level) {
        let monitor = level.problem.monitor;
        if self.reversed {
            monitor.warn(crate::scan::TURNED);
        }
        if !self.contested.is_empty() {
            let name = |p: &usize| format!("`{}`", level.problem.model.parts()[*p].name);
            let names: Vec<String> = self.contested.iter().map(name).collect();
            monitor.warn(format!(
                "the outer side of {} faces the inner one of the scan: signs are the script's, and `flip` would turn them",
                names.join(", ")
            ));
        }
    }
}

/// Whether the scan's normals say that a patch faces the other way than `sign`.
fn is_against(patch: &PatchSum, sign: i8) -> bool {
    patch.near >= FACING_POINTS && f64::from(sign) * patch.facing < -FACING_AGAINST * patch.weight
}

/// Whether points that face a patch's way are few or far off, compared with points that face any way.
fn faces_other_side(unsided: &PatchSum, sided: &PatchSum) -> bool {
    let square = |p: &PatchSum| p.weighted_d2 / p.weight.max(f64::MIN_POSITIVE);
    sided.weight < SIDED_SHARE * unsided.weight || square(sided) > OTHER_SIDE.powi(2) * square(unsided)
}

/// Per patch, the outer side as the script has it: as it is written, and of closed bodies by their volume.
fn outward(level: &Level, estimate: &Estimate) -> Vec<i8> {
    let model = level.problem.model;
    let mut signs = vec![1; model.parts().len()];
    let instance = level.space.x(&estimate.z).and_then(|x| model.instantiate(&x).ok());
    if let Some(closedness) = instance.and_then(|instance| Closedness::of(model, &*instance).ok()) {
        closedness.inverted.iter().for_each(|patch| signs[*patch] = -1);
    }
    signs
}
