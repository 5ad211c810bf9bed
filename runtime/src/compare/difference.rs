//! Distances from one surface to another.

use super::LITTLE;
use super::prepared::Prepared;
use crate::feet::signed::{Place, SignedFoot, Target};
use crate::model::Texels;
use crate::variance::{Distribution, LargestDistance, Moments, Sample};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// The distances from a surface to another one. In JSON the statistics stand beside `parts`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Difference {
    /// Statistics of all of the surface.
    #[serde(flatten)]
    pub overall: DifferenceStatistics,
    /// The place that is the farthest from the other surface, whichever way that faces and however far off it is: the
    /// directed Hausdorff distance, without a sign.
    pub hausdorff: LargestDistance,
    /// The same of every part.
    pub parts: Vec<PartDifference>,
}

/// Distances from a part of a surface to the other one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartDifference {
    /// Name of the part.
    pub name: String,
    /// The statistics; their fields stand beside the name in JSON.
    #[serde(flatten)]
    pub statistics: DifferenceStatistics,
}

/// Statistics of the distances from some of a surface to another one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DifferenceStatistics {
    /// Area that can be seen. Square millimetres.
    pub area: f64,
    /// Area that has a counterpart on the other surface: one that faces the same way, within the maximum distance.
    pub matched_area: f64,
    /// The rest.
    pub unmatched_area: f64,
    /// Signed distances from the area that has a counterpart to the nearest such place, weighted by area.
    #[serde(flatten)]
    pub moments: Moments,
    /// The largest of these distances, also at corners, with the place on this surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest: Option<LargestDistance>,
}

/// A place that counts, with its distance.
#[derive(Clone, Copy)]
struct Measured {
    part: u32,
    point: DVec3,
    distance: f64,
}

/// The distances from all places of a surface to another one.
pub(super) struct Distances<'a> {
    texels: &'a Texels,
    target: Target<'a>,
    /// The texels that can be seen, whose places are the first, and the part of every place.
    seen: Vec<usize>,
    parts: Vec<u32>,
    places: Vec<Place>,
    measured: Vec<Option<Measured>>,
    /// By texel, NaN where there is none. Millimetres.
    pub(super) of_texels: Vec<f64>,
}

impl Prepared<'_> {
    /// The distances to another surface, where it is at most so far away.
    pub(super) fn distances<'a>(&'a self, to: &'a Prepared<'_>, max_distance: f64) -> Distances<'a> {
        let target = to.target();
        let texels = &self.surface.texels;
        let (of_texels, corners) = self.places();
        let seen: Vec<usize> = (0..of_texels.len()).filter(|i| of_texels[*i].is_some()).collect();
        let parts: Vec<u32> =
            seen.iter().map(|i| texels.part[*i]).chain(corners.iter().map(|(_, part)| *part)).collect();
        let places: Vec<Place> = of_texels.into_iter().flatten().chain(corners.iter().map(|(p, _)| *p)).collect();
        // A place that lies outside of the other surface has that inside of its own.
        let feet = target.feet(&places, max_distance);
        let measured = |(k, foot): (usize, &Option<SignedFoot>)| {
            let distance = 0.0 - (*foot)?.distance;
            Some(Measured { part: parts[k], point: places[k].point, distance })
        };
        let measured: Vec<Option<Measured>> = feet.iter().enumerate().map(measured).collect();
        let mut of_texels = vec![f64::NAN; texels.len()];
        for (k, i) in seen.iter().enumerate() {
            of_texels[*i] = measured[k].map_or(f64::NAN, |m| m.distance);
        }
        Distances { texels, target, seen, parts, places, measured, of_texels }
    }
}

impl Distances<'_> {
    /// Whether hardly a place has a counterpart. It is asked before [`Self::difference`], since the farthest place of
    /// a small surface amid a huge one is as far from all of that.
    pub(super) fn is_little(&self) -> bool {
        let area = |chosen: &mut dyn Iterator<Item = &usize>| chosen.map(|i| area(self.texels, *i)).sum::<f64>();
        let matched = area(&mut self.seen.iter().filter(|i| !self.of_texels[**i].is_nan()));
        matched <= LITTLE * area(&mut self.seen.iter())
    }

    /// Their statistics.
    pub(super) fn difference(&self) -> Difference {
        let names = &self.texels.part_names;
        let farthest = farthest(&self.target, &self.places, &self.measured).map(|(k, distance)| Measured {
            part: self.parts[k],
            point: self.places[k].point,
            distance,
        });
        let hausdorff = largest(farthest.into_iter(), names);
        let hausdorff =
            hausdorff.unwrap_or(LargestDistance { distance: f64::NAN, place: [f64::NAN; 3], part: String::new() });
        let mut of_parts = vec![(Vec::new(), Vec::new()); names.len()];
        self.seen.iter().for_each(|i| of_parts[self.texels.part[*i] as usize].0.push(*i));
        let all: Vec<Measured> = self.measured.iter().copied().flatten().collect();
        all.iter().for_each(|m| of_parts[m.part as usize].1.push(*m));
        let part = |(name, (of_part, measured)): (&String, &(Vec<usize>, Vec<Measured>))| PartDifference {
            name: name.clone(),
            statistics: statistics(self.texels, of_part, &self.of_texels, measured),
        };
        let parts = names.iter().zip(&of_parts).map(part).collect();
        let overall = statistics(self.texels, &self.seen, &self.of_texels, &all);
        Difference { overall, hausdorff, parts }
    }
}

/// The area that a texel stands for. Square millimetres.
fn area(texels: &Texels, i: usize) -> f64 {
    f64::from(if texels.area[i].is_finite() { texels.area[i].max(0.0) } else { 0.0 })
}

/// The statistics of some texels (`chosen`), of which `distances` has all, and the largest of what was measured there
/// and at corners.
fn statistics(texels: &Texels, chosen: &[usize], distances: &[f64], measured: &[Measured]) -> DifferenceStatistics {
    let (mut whole, mut samples) = (0.0, Vec::new());
    for i in chosen {
        let of_texel = area(texels, *i);
        whole += of_texel;
        if !distances[*i].is_nan() {
            samples.push(Sample::new(distances[*i] as f32, of_texel as f32));
        }
    }
    let distribution = Distribution::new(samples);
    let matched_area = 0.0 + distribution.area();
    let [moments, _] = distribution.moments();
    let largest = largest(measured.iter().copied(), &texels.part_names);
    let unmatched_area = (whole - matched_area).max(0.0);
    DifferenceStatistics { area: whole, matched_area, unmatched_area, moments, largest }
}

/// Places whose distances are computed at once.
const BATCH: usize = 4096;

/// The place that is the farthest from a surface, whichever way that faces, with its distance. What faces the same way
/// is as near at most, so that few places need a second search.
fn farthest(target: &Target<'_>, places: &[Place], measured: &[Option<Measured>]) -> Option<(usize, f64)> {
    let most = |k: usize| measured[k].map_or(f64::INFINITY, |m| m.distance.abs());
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.sort_by(|a, b| most(*b).total_cmp(&most(*a)));
    let mut best: Option<(usize, f64)> = None;
    for batch in order.chunks(BATCH) {
        if best.is_some_and(|(_, distance)| distance >= most(batch[0])) {
            break;
        }
        let any: Vec<Place> = batch.iter().map(|k| Place { normal: None, ..places[*k] }).collect();
        for (k, foot) in batch.iter().zip(target.feet(&any, f64::INFINITY)) {
            let distance = foot.map_or(f64::NAN, |foot| foot.distance.abs());
            if best.map_or(!distance.is_nan(), |(_, known)| distance > known) {
                best = Some((*k, distance));
            }
        }
    }
    best
}

/// The place with the largest distance either way, of equals the first.
fn largest(all: impl Iterator<Item = Measured>, names: &[String]) -> Option<LargestDistance> {
    let larger = |a: Measured, b: Measured| if b.distance.abs() > a.distance.abs() { b } else { a };
    let Measured { part, point, distance } = all.reduce(larger)?;
    Some(LargestDistance { distance, place: point.into(), part: names.get(part as usize).cloned().unwrap_or_default() })
}
