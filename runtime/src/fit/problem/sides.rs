//! Which side of the model's patches is out. The script says so; the scan only says whether it faces the same way.

use super::level::Level;
use super::loss::Loss;
use super::objective::{Objective, Order};
use super::parameterization::Estimate;
use super::sums::{FaceSum, PatchSum};
use crate::fit::tuning::{
    FACING_AGAINST, FACING_POINTS, OTHER_SIDE, REVERSED_SHARE, SHEET_LOST, SHEET_NOISE, SHEET_SHARE, SHEET_SPACINGS,
    SIDED_SHARE,
};
use crate::model::Closedness;

/// The sides of the patches as the script has them, beside a scan.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Sides {
    /// Per patch, which way is out, in the sense of the scan's normals (see `Facing`). 0 for patches that face the
    /// other side of the scan, and for sheets: their points belong to them whichever way these face.
    pub(crate) signs: Vec<i8>,
    /// The scan's normals all point the other way.
    pub(crate) reversed: bool,
    /// Patches that face the other side of the scan.
    pub(crate) contested: Vec<usize>,
    /// Patches both of whose faces the scan shows in one place: surfaces without thickness.
    pub(crate) sheets: Vec<usize>,
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
            // Between the sides of a thin wall, what is nearest decides nothing.
            let sided = Objective { signs: Some(&signs), ..level.objective(&problem.thin, loss) };
            let homes = Homes::of(&objective, &sided, estimate)?;
            contested.retain(|p| homes.have_none_elsewhere(*p));
            contested.iter().for_each(|p| signs[*p] = 0);
        }
        let margin = SHEET_NOISE * problem.scan.noise + SHEET_SPACINGS * problem.points.spacing();
        let is_sheet = |p: &usize| signs[*p] != 0 && distance_of_faces(&unsided[*p]).is_some_and(|d| d < margin);
        let mut sheets: Vec<usize> = (0..parts).filter(is_sheet).collect();
        if !sheets.is_empty() {
            // Noise brings points of a wall's other face as near; but these have a patch of their own.
            let sided = Objective { signs: Some(&signs), ..level.objective(&problem.thin, loss) };
            let homes = Homes::of(&objective, &sided, estimate)?;
            sheets.retain(|p| homes.lost(*p) > SHEET_LOST * lesser_face(&unsided[*p]));
            sheets.iter().for_each(|p| signs[*p] = 0);
        }
        Some(Self { signs, reversed, contested, sheets })
    }

    /// Sentences for the user.
    pub(crate) fn warn(&self, level: &Level) {
        let monitor = level.problem.monitor;
        if self.reversed {
            monitor.warn(crate::scan::TURNED);
        }
        let name = |p: &usize| format!("`{}`", level.problem.model.parts()[*p].name);
        let names = |patches: &[usize]| patches.iter().map(name).collect::<Vec<String>>().join(", ");
        if !self.contested.is_empty() {
            monitor.warn(format!(
                "the outer side of {} faces the inner one of the scan: signs are the script's, and `flip` would turn them",
                names(&self.contested)
            ));
        }
        if !self.sheets.is_empty() {
            monitor.warn(format!(
                "the scan shows both faces of {} in the same place: a surface without thickness, to which the points of both belong",
                names(&self.sheets)
            ));
        }
    }
}

/// Whether the scan's normals say that a patch faces the other way than `sign`.
fn is_against(patch: &PatchSum, sign: i8) -> bool {
    patch.near >= FACING_POINTS && f64::from(sign) * patch.facing < -FACING_AGAINST * patch.weight
}

/// The distance of the two faces of a patch as the scan shows them, at most: that of the means of their points, and two
/// standard errors of it. None where it hardly shows one of them. Millimetres.
fn distance_of_faces(unsided: &PatchSum) -> Option<f64> {
    let [along, against] = unsided.faces;
    let shown = |face: &FaceSum| face.near >= FACING_POINTS && face.weight >= SHEET_SHARE * unsided.weight;
    if !shown(&along) || !shown(&against) {
        return None;
    }
    let mean = |face: &FaceSum| face.displacement / face.weight;
    let variance = unsided.weighted_d2 / unsided.weight;
    Some((mean(&along) - mean(&against)).abs() + 2.0 * (variance * (1.0 / along.near + 1.0 / against.near)).sqrt())
}

/// The weight of the face of a patch that the scan shows less.
fn lesser_face(unsided: &PatchSum) -> f64 {
    let [along, against] = unsided.faces;
    along.weight.min(against.weight)
}

/// The points of every patch where they may face any way, and where these points belong once they have to face the way
/// of their patch: the same patch or another one.
struct Homes {
    /// Per patch and for both: sums of weights, and of weights times squared distances.
    sums: Vec<[(f64, f64); 2]>,
}

impl Homes {
    /// None where the model does not exist.
    fn of(unsided: &Objective, sided: &Objective, estimate: &Estimate) -> Option<Self> {
        let placed = unsided.place(estimate).ok()?;
        let mut sums = vec![[(0.0, 0.0); 2]; unsided.space.model.parts().len()];
        let mut patch_of = vec![None; unsided.points.len()];
        unsided.patches(&placed).into_iter().for_each(|(point, patch)| patch_of[point] = Some(patch));
        let mut add = |objective: &Objective, which: usize| {
            for (point, foot) in objective.feet(&placed) {
                let Some(patch) = patch_of[point] else { continue };
                let weight = objective.loss.at(foot.d2).times(objective.points.prior(point)).weight;
                let (sum, square) = &mut sums[patch][which];
                *sum += weight;
                *square += weight * foot.d2;
            }
        };
        add(unsided, 0);
        add(sided, 1);
        Some(Self { sums })
    }

    /// The weight that the points of a patch lose once they have to face its way.
    fn lost(&self, patch: usize) -> f64 {
        let [(unsided, _), (sided, _)] = self.sums[patch];
        unsided - sided
    }

    /// Whether the points of a patch have no place that faces their way, or one that is much farther off.
    fn have_none_elsewhere(&self, patch: usize) -> bool {
        let [unsided, sided] = self.sums[patch];
        let square = |(weight, square): (f64, f64)| square / weight.max(f64::MIN_POSITIVE);
        sided.0 < SIDED_SHARE * unsided.0 || square(sided) > OTHER_SIDE.powi(2) * square(unsided)
    }
}

/// Per patch, the outer side as the script has it: as it is written, and of closed bodies by their volume.
fn outward(level: &Level, estimate: &Estimate) -> Vec<i8> {
    let model = level.problem.model;
    let mut signs = vec![1; model.parts().len()];
    let instance = level.space.x(&estimate.z).and_then(|x| model.instantiate(&x).ok());
    if let Some(inverted) = instance.and_then(|instance| Closedness::inverted(model, &*instance).ok()) {
        inverted.iter().for_each(|patch| signs[*patch] = -1);
    }
    signs
}
