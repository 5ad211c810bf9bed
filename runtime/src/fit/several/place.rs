//! The place of one more scan: all orientations of the known shape, of which all scans together choose one.

use crate::fit::optimise::joint::JointEstimate;
use crate::fit::options::FitError;
use crate::fit::problem::Problem;
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::level::Level;
use crate::fit::problem::parameterization::Estimate;
use crate::fit::problem::sides::Sides;
use crate::fit::refine::joint::Joint;
use crate::fit::refine::witness;
use crate::fit::register::screening::poses;
use crate::fit::tuning::{PLACED_AS_WELL, START_CHORD};

/// The shape in some scans, moved to where it explains one more as well, with its place there.
///
/// # Errors
/// The model cannot be evaluated at the shape.
pub(super) fn place<'a>(
    known: &[&'a Problem<'a>],
    base: &Level<'a>,
    at: &JointEstimate,
    next: &'a Problem<'a>,
) -> Result<JointEstimate, FitError> {
    let x = base.space.x(&at.z).unwrap_or_else(|| next.start.x.clone());
    let start = Estimate { z: Vec::new(), motion: Isometry::IDENTITY };
    let level = Level::new(next, base.space.of_motions(&x), &start, START_CHORD)?;
    let problems: Vec<&Problem> = known.iter().copied().chain([next]).collect();
    let mut places = Vec::new();
    for candidate in poses(&level) {
        let joint = Joint::new(&problems, base, at.with(candidate.estimate.motion))?.settle();
        places.push((joint.value(&joint.scales()), joint));
    }
    let least = places.iter().map(|(value, _)| *value).fold(f64::INFINITY, f64::min);
    places.retain(|(value, _)| *value <= PLACED_AS_WELL * least);
    let judged = places.into_iter().map(|(value, joint)| (contradicted(&joint), value, joint));
    let best = judged.min_by(|(a, u, _), (b, v, _)| a.total_cmp(b).then(u.total_cmp(v)));
    // Where the user has cancelled, there may be no candidate.
    Ok(best.map_or_else(|| at.with(Isometry::IDENTITY), |(.., joint)| joint.estimate))
}

/// The area of the model that stands where the last scan shows empty space, where that is no chance. Square
/// millimetres; 0 where the scan does not say.
fn contradicted(joint: &Joint) -> f64 {
    let Some(member) = joint.members.last() else { return 0.0 };
    let (level, scan) = (&member.level, joint.members.len() - 1);
    let Some(space) = level.problem.free_space() else { return 0.0 };
    let at = joint.estimate.of(scan);
    let reversed = Sides::of(level, &at, member.loss).is_some_and(|sides| sides.reversed);
    let Some(patches) = space.contradicted(level, &at, member.loss.sigma, reversed) else { return 0.0 };
    let (area, chance) = witness::total(&patches);
    if area > chance { area } else { 0.0 }
}
