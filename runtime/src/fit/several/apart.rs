//! Fits of each scan alone, and of the others without it, from the shape of all.

use super::Whole;
use crate::fit::infer::agreement::{Shape, compare};
use crate::fit::infer::joint::{JointUncertainty, assess};
use crate::fit::refine::joint::Joint;
use crate::fit::result::Agreement;
use crate::fit::tuning::OTHER_OBJECT;

/// By scan, whether it agrees with the others on the shape; None where there is nothing to compare, or the user does not
/// wait.
pub(super) fn agreements(whole: &Whole, joint: &Joint) -> Vec<Option<Agreement>> {
    let scans = joint.members.len();
    let alone: Vec<Option<Shape>> = (0..scans).map(|scan| shape(whole, joint, &[scan])).collect();
    let names: Vec<String> = whole.model.parameters().iter().map(|p| p.name.clone()).collect();
    let free = &joint.members[0].level.space.free;
    let least = OTHER_OBJECT / scans as f64;
    let agreement = |scan: usize| {
        let own = alone[scan].as_ref()?;
        let rest: Vec<usize> = (0..scans).filter(|other| *other != scan).collect();
        match rest[..] {
            [other] => compare(own, alone[other].as_ref()?, free, &names, least),
            _ => compare(own, &shape(whole, joint, &rest)?, free, &names, least),
        }
    };
    (0..scans).map(agreement).collect()
}

/// The shape of some of the scans.
fn shape(whole: &Whole, joint: &Joint, scans: &[usize]) -> Option<Shape> {
    if whole.monitor.cancelled() {
        return None;
    }
    let mut apart = joint.of_scans(scans).refine(whole.given());
    // As it is done for all scans: shorter steps, where what remains is not small.
    for step in [1.0, 0.1, 0.01] {
        apart = apart.polish(step, None);
        let of = apart.solutions()?;
        let uncertainty = assess(&apart, &of);
        if step == 0.01 || uncertainty.as_ref().is_none_or(JointUncertainty::is_settled) || whole.monitor.cancelled() {
            return Shape::of(&of, uncertainty);
        }
    }
    None
}
