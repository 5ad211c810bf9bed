//! Fits of each scan alone, and of the others without it. They begin at the shape of all, and where that leaves a part
//! of the scan unexplained, also afresh: what lies beyond the reach of a robust loss does not draw a shape out of a
//! local minimum, so that two objects would pass as one whose difference is large.

use super::{Found, Whole, better_of};
use crate::fit::infer::agreement::{Shape, compare};
use crate::fit::optimise::joint::JointEstimate;
use crate::fit::options::FitOptions;
use crate::fit::refine::joint::Joint;
use crate::fit::result::Agreement;
use crate::fit::tuning::{BETTER_ALONE, COMPARED, LEFT_BY_ALL, LEFT_CLEAR, OTHER_OBJECT, WORTH_A_SEARCH};

/// What a scan says of the shape of all.
#[derive(Clone, Debug, Default)]
pub(super) struct Apart {
    /// Whether it agrees with the others on the shape; None where there is nothing to compare, or the user does not
    /// wait.
    pub(super) agreement: Option<Agreement>,
    /// The shares of its points that are inliers by the shape of all, and by its own, at the scale of the first.
    pub(super) explained: Option<[f64; 2]>,
}

/// A fit of one scan alone.
struct Lone<'a> {
    joint: Joint<'a>,
    shape: Option<Shape>,
    explained: [f64; 2],
    /// Its optimum is not where the shape of all leads.
    is_elsewhere: bool,
}

impl Lone<'_> {
    /// Whether the scan shows clearly more of its own shape than of the shape of all.
    fn is_of_another(&self) -> bool {
        let [by_all, by_own] = self.explained;
        // The variance of a difference of shares of the same points is at most the difference, over their number.
        let gain = by_own - by_all;
        gain > LEFT_BY_ALL && gain > LEFT_CLEAR * (gain / COMPARED as f64).sqrt()
    }
}

/// By scan, whether it agrees with the others on the shape. Others of which one is another object agree with nobody:
/// the scan is put aside without which the others are explained best, and those that are left are compared among
/// themselves.
pub(super) fn agreements<'a>(whole: &Whole<'a>, joint: &Joint<'a>) -> Vec<Apart> {
    let mut left: Vec<usize> = (0..joint.members.len()).collect();
    let alone: Vec<Option<Lone>> = left.iter().map(|scan| lone(whole, joint, *scan)).collect();
    let explained = alone.iter().map(|lone| lone.as_ref().map(|lone| lone.explained));
    let mut all: Vec<Apart> = explained.map(|explained| Apart { explained, agreement: None }).collect();
    loop {
        let compared = left.iter().map(|scan| agreement(whole, joint, &alone, *scan, &left));
        let compared: Vec<Option<Compared>> = compared.collect();
        let odd = odd_one(&left, &compared).filter(|_| left.len() > 2);
        for (scan, compared) in left.iter().zip(compared) {
            all[*scan].agreement = compared.map(|compared| compared.agreement);
        }
        match odd {
            Some(odd) => left.retain(|scan| *scan != odd),
            None => break,
        }
    }
    // Where one was put aside, the shape of all may be that of that one.
    if left.len() == all.len() {
        all.iter_mut().zip(&alone).for_each(|(apart, lone)| disown(apart, lone.as_ref()));
    }
    all
}

/// Of the scans that do not agree with the others, the one without which these are explained best, or, where that is
/// alike up to chance, the one that differs most.
fn odd_one(left: &[usize], compared: &[Option<Compared>]) -> Option<usize> {
    let off = left.iter().zip(compared).filter_map(|(scan, compared)| {
        let Compared { agreement, others } = compared.as_ref().filter(|compared| !compared.agreement.agrees)?;
        Some((*scan, (others / LEFT_BY_ALL).round(), agreement.statistic))
    });
    let odd = off.max_by(|(_, a, u), (_, b, v)| a.total_cmp(b).then(u.total_cmp(v)));
    odd.map(|(scan, ..)| scan)
}

/// A scan of which its own shape explains clearly more does not agree, whatever parameters are compared.
fn disown(apart: &mut Apart, lone: Option<&Lone>) {
    if lone.is_some_and(Lone::is_of_another) {
        let nothing = Agreement { statistic: 0.0, degrees: 0, p: 1.0, agrees: false, differences: Vec::new() };
        let agreement = apart.agreement.take().unwrap_or(nothing);
        apart.agreement = Some(Agreement { agrees: false, ..agreement });
    }
}

/// A scan beside the others.
struct Compared {
    agreement: Agreement,
    /// The least share that the shape of the others explains of one of these.
    others: f64,
}

/// Compares a scan with the others that are `left`. `alone` has the fits of all by themselves.
fn agreement<'a>(
    whole: &Whole<'a>,
    joint: &Joint<'a>,
    alone: &[Option<Lone<'a>>],
    scan: usize,
    left: &[usize],
) -> Option<Compared> {
    let own = alone[scan].as_ref()?.shape.as_ref()?;
    let names: Vec<String> = whole.model.parameters().iter().map(|p| p.name.clone()).collect();
    let free = &joint.members[0].level.space.free;
    let least = OTHER_OBJECT / joint.members.len() as f64;
    let others: Vec<usize> = left.iter().copied().filter(|other| *other != scan).collect();
    if let [other] = others[..] {
        let other = alone[other].as_ref()?;
        let agreement = compare(own, other.shape.as_ref()?, free, &names, least)?;
        return Some(Compared { agreement, others: other.explained[1] });
    }
    let best = together(whole, joint, alone, &others)?;
    let explained = best.clone().like(&joint.of_scans(&others)).inliers().into_iter().fold(1.0, f64::min);
    Some(Compared { agreement: compare(own, &shape(whole, best)?, free, &names, least)?, others: explained })
}

/// A fit of one scan by itself.
fn lone<'a>(whole: &Whole<'a>, joint: &Joint<'a>, scan: usize) -> Option<Lone<'a>> {
    if whole.monitor.cancelled() {
        return None;
    }
    let by_all = joint.of_scans(&[scan]);
    let near = by_all.clone().refine(whole.given());
    let mut best = clearly_better(near.clone(), by_all.clone().anneal(whole.given()));
    if best.inliers()[0] < 1.0 - WORTH_A_SEARCH
        && let Some(afresh) = afresh(whole, joint, scan)
    {
        best = clearly_better(best, afresh);
    }
    let is_elsewhere = best.estimate != near.estimate;
    let explained = [by_all.inliers()[0], best.clone().like(&by_all).inliers()[0]];
    Some(Lone { shape: shape(whole, best.clone()), joint: best, explained, is_elsewhere })
}

/// A fit of one scan that knows nothing of the shape of all. None where the model does not exist there.
fn afresh<'a>(whole: &Whole<'a>, joint: &Joint<'a>, scan: usize) -> Option<Joint<'a>> {
    let level = &joint.members[scan].level;
    let x = level.space.x(&joint.estimate.z)?;
    let mut options = FitOptions { earlier: None, ..whole.options.clone() };
    // Held values are those of the fit of all.
    for (parameter, value) in whole.model.parameters().iter().zip(&x) {
        if options.fixed.contains(&parameter.name) {
            options.start.insert(parameter.name.clone(), *value);
        }
    }
    let Found { x, motion } = whole.solved(&whole.scans[scan], &options).ok()?;
    let at = level.space.estimate(&x, motion);
    let at = JointEstimate { z: at.z, motions: vec![at.motion] };
    Some(Joint::new(&[whole.problems[scan]], level, at).ok()?.anneal(whole.given()))
}

/// A fit of some scans, from the shape of all or from that of one of them alone.
fn together<'a>(
    whole: &Whole<'a>,
    joint: &Joint<'a>,
    alone: &[Option<Lone<'a>>],
    scans: &[usize],
) -> Option<Joint<'a>> {
    let lone: Option<Vec<&Lone>> = scans.iter().map(|scan| alone[*scan].as_ref()).collect();
    let (by_all, lone) = (joint.of_scans(scans), lone?);
    let mut best = clearly_better(by_all.clone().refine(whole.given()), by_all.anneal(whole.given()));
    let problems: Vec<_> = scans.iter().map(|scan| whole.problems[*scan]).collect();
    for one in lone.iter().filter(|lone| lone.is_elsewhere) {
        let motions = lone.iter().map(|lone| lone.joint.estimate.motions[0]).collect();
        let at = JointEstimate { z: one.joint.estimate.z.clone(), motions };
        let other = Joint::new(&problems, &joint.members[scans[0]].level, at).ok()?.settle().anneal(whole.given());
        best = clearly_better(best, other);
    }
    Some(best)
}

/// The other one of two if it explains its scans clearly better: what explains them alike may be the same surface by
/// other parameters, which is no other shape.
fn clearly_better<'a>(one: Joint<'a>, other: Joint<'a>) -> Joint<'a> {
    better_of(one, other, BETTER_ALONE)
}

/// The shape of scans at an optimum of theirs.
fn shape<'a>(whole: &Whole<'a>, near: Joint<'a>) -> Option<Shape> {
    if whole.monitor.cancelled() {
        return None;
    }
    let (_, of, uncertainty) = whole.assessed(near.polish(1.0, None), None).ok()?;
    Shape::of(&of, uncertainty)
}
