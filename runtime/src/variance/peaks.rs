//! Where deviations are largest.

use super::{Deviations, VarianceReport};
use crate::model::{ChartMap, Tessellation, surface_coordinates};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// How many are named.
const PEAKS: usize = 10;

/// How far apart they are at least, as a share of the surface's diagonal: so that a dent is named once. Labels of ten
/// such places also keep apart in a picture of the whole.
const APART: f64 = 0.08;

/// A place where the deviation is larger than at all places near it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// The part.
    pub part: String,
    /// The surface's parameters there; absent where the surface has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uv: Option<[f64; 2]>,
    /// Column and row of the texel, from the left and the top, from 0.
    pub texel: [u32; 2],
    /// The place in the scan's frame. Millimetres.
    pub place: [f64; 3],
    /// The signed distance of that texel. Millimetres.
    pub distance: f64,
    /// The level of detection of the part. Millimetres; absent where it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub level: Option<f64>,
}

/// The places of the largest deviations, largest first: those above the level of detection that are the largest
/// within [`APART`]. A texel counts as its neighbours let it: its deviation is the median of those of the same part
/// around it, and the texel that has this median is named, so that no spike of the scan is a place. Triangles across
/// edges are none either.
pub(in crate::variance) fn peaks(
    deviations: &Deviations,
    tessellation: &Tessellation,
    report: &VarianceReport,
) -> Vec<Peak> {
    let texels = &deviations.texels;
    let levels: Vec<Option<f64>> = report.parts.iter().map(|part| part.detection.map(|d| d.level)).collect();
    let level = |i: usize| levels.get(texels.part[i] as usize).copied().flatten();
    let counts = |i: &usize| {
        let distance = f64::from(deviations.signed(*i)).abs();
        distance > level(*i).unwrap_or(0.0).max(deviations.precision) && !deviations.is_bridged(*i)
    };
    let mut order: Vec<usize> = (0..texels.len()).filter(counts).collect();
    order.sort_by(|a, b| deviations.signed(*b).abs().total_cmp(&deviations.signed(*a).abs()).then(a.cmp(b)));
    let apart = APART * tessellation.mesh.bounds().diagonal();
    let mut chosen: Vec<usize> = Vec::new();
    for &i in &order {
        let here = DVec3::from_array(texels.position[i]);
        let is_far = |other: &usize| here.distance(DVec3::from_array(texels.position[*other])) >= apart;
        if chosen.len() == PEAKS {
            break;
        }
        if chosen.iter().all(is_far)
            && let Some(median) = median_around(deviations, i)
            && counts(&median)
        {
            chosen.push(median);
        }
    }
    chosen.sort_by(|a, b| deviations.signed(*b).abs().total_cmp(&deviations.signed(*a).abs()));
    let maps = tessellation.chart_maps();
    chosen.into_iter().map(|i| peak(deviations, &maps, level(i), i)).collect()
}

/// The texel of the median of the deviations of texel i and its neighbours of the same part; none where fewer than five
/// of the nine have one: at a border of the data a distance is least certain.
fn median_around(deviations: &Deviations, i: usize) -> Option<usize> {
    let texels = &deviations.texels;
    let [x, y] = texels.place(i).map(i64::from);
    let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
    let inside =
        |(x, y): &(i64, i64)| (0..i64::from(texels.width)).contains(x) && (0..i64::from(texels.height)).contains(y);
    let index = |(x, y): (i64, i64)| texels.index.binary_search(&((y * i64::from(texels.width) + x) as u32)).ok();
    let mut found: Vec<usize> = around
        .filter(inside)
        .filter_map(index)
        .filter(|j| texels.part[*j] == texels.part[i] && !deviations.signed(*j).is_nan())
        .collect();
    found.sort_by(|a, b| deviations.signed(*a).total_cmp(&deviations.signed(*b)));
    (found.len() >= 5).then(|| found[found.len() / 2])
}

fn peak(deviations: &Deviations, maps: &[Option<ChartMap>], level: Option<f64>, i: usize) -> Peak {
    let texels = &deviations.texels;
    let part = texels.part[i] as usize;
    let [x, y] = texels.place(i);
    let [width, height] = [texels.width, texels.height].map(f64::from);
    let place = [(f64::from(x) + 0.5) / width, 1.0 - (f64::from(y) + 0.5) / height];
    Peak {
        part: texels.part_names[part].clone(),
        uv: maps.get(part).copied().flatten().map(|map| surface_coordinates(&map, place)),
        texel: [x, y],
        place: texels.position[i],
        distance: f64::from(deviations.signed(i)),
        level,
    }
}
