//! Fits of each scan alone, and of the others without it, from the shape of all.

use super::Whole;
use crate::fit::infer::agreement::{Shape, compare};
use crate::fit::refine::joint::Joint;
use crate::fit::result::Agreement;
use crate::fit::tuning::OTHER_OBJECT;

/// By scan, whether it agrees with the others on the shape; None where there is nothing to compare, or the user does
/// not wait. Others of which one is another object agree with nobody: the scan that agrees least is put aside, and
/// those that are left are compared among themselves.
pub(super) fn agreements(whole: &Whole, joint: &Joint) -> Vec<Option<Agreement>> {
    let mut left: Vec<usize> = (0..joint.members.len()).collect();
    let alone: Vec<Option<Shape>> = left.iter().map(|scan| shape(whole, joint, &[*scan])).collect();
    let mut agreements = vec![None; left.len()];
    loop {
        for scan in &left {
            agreements[*scan] = agreement(whole, joint, &alone, *scan, &left);
        }
        let off = |scan: &usize| agreements[*scan].as_ref().filter(|a| !a.agrees).map_or(0.0, |a| a.statistic);
        let worst = left.iter().copied().max_by(|a, b| off(a).total_cmp(&off(b)));
        match worst.filter(|scan| left.len() > 2 && off(scan) > 0.0) {
            Some(worst) => left.retain(|scan| *scan != worst),
            None => return agreements,
        }
    }
}

/// Whether a scan agrees with the others that are `left`. `alone` has the shapes of all by themselves.
fn agreement(whole: &Whole, joint: &Joint, alone: &[Option<Shape>], scan: usize, left: &[usize]) -> Option<Agreement> {
    let own = alone[scan].as_ref()?;
    let names: Vec<String> = whole.model.parameters().iter().map(|p| p.name.clone()).collect();
    let free = &joint.members[0].level.space.free;
    let least = OTHER_OBJECT / joint.members.len() as f64;
    let others: Vec<usize> = left.iter().copied().filter(|other| *other != scan).collect();
    match others[..] {
        [other] => compare(own, alone[other].as_ref()?, free, &names, least),
        _ => compare(own, &shape(whole, joint, &others)?, free, &names, least),
    }
}

/// The shape of some of the scans.
fn shape(whole: &Whole, joint: &Joint, scans: &[usize]) -> Option<Shape> {
    if whole.monitor.cancelled() {
        return None;
    }
    let apart = joint.of_scans(scans).refine(whole.given()).polish(1.0, None);
    let (_, of, uncertainty) = whole.assessed(apart, None).ok()?;
    Shape::of(&of, uncertainty)
}
