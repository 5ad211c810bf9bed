//! Which way the points of a cloud face, compared with the model.

use crate::bvh::Bvh;
use crate::feet::signed::Place;
use crate::scan::Scan;
use crate::variance::orientation::{Facings, PartVote};
use crate::variance::points::{PointSearch, places};

/// Points that vote.
const SAMPLES: usize = 20_000;

/// Cosine beyond which a point's normal tells which way it faces.
const TELLING: f64 = 0.5;

/// How a cloud whose sides are known faces: for a sample of its points the nearest surface of the model is found,
/// whichever way it faces. `names` are those of the parts, `model` is the hierarchy over the surface's triangles.
pub(in crate::variance) fn facings(
    search: &PointSearch<'_>,
    model: &Bvh,
    scan: &Scan,
    names: &[String],
    max_distance: f64,
) -> Facings {
    let all = places(scan);
    let sample: Vec<Place> = all.iter().step_by(all.len().div_ceil(SAMPLES).max(1)).copied().collect();
    let either_way: Vec<Place> = sample.iter().map(|place| Place { normal: None, ..*place }).collect();
    let feet = search.feet_of(model, &either_way, max_distance);
    let mut votes: Vec<Vec<PartVote>> = vec![Vec::new(); names.len()];
    for (i, foot) in feet.iter().enumerate() {
        let (Some(foot), Some(normal)) = (foot, sample[i].normal) else { continue };
        let cosine = foot.normal.dot(normal);
        if let Some(votes) = votes.get_mut(foot.part as usize).filter(|_| cosine.abs() > TELLING) {
            votes.push(PartVote { of: i, distance: foot.distance.abs(), sign: cosine.signum() });
        }
    }
    // The place of the model that faces as a point does, or as it does after the scan was turned.
    let own_side = |votes: &[PartVote], turn: f64| -> Vec<Option<f64>> {
        let at = |vote: &PartVote| Place { normal: sample[vote.of].normal.map(|n| turn * n), ..sample[vote.of] };
        let own = search.feet_of(model, &votes.iter().map(at).collect::<Vec<Place>>(), max_distance);
        own.into_iter().map(|foot| foot.map(|foot| foot.distance.abs())).collect()
    };
    Facings::of_votes(names, votes, own_side)
}
