//! A Gaussian filter over a surface (ISO 16610-61, as a regression filter of second order, so that edges do not bend
//! what runs on beyond them, nor flatten what is bent): what is shorter than its cut-off is noise or roughness, and no
//! form.
//!
//! The points of a part are gathered in cells of an eighth of the cut-off. A filtered value is that of the quadric
//! (a + b x + c y + d x^2 + e x y + f y^2) that fits the cells about a place best, with weights
//! exp(-pi (s / (alpha cut-off))^2) times their areas at a distance s: the filter is linear in the cells' values, and
//! what noise becomes is computed with the same weights.

use super::quadric::{Near, Quadric};
use crate::model::Texels;
use crate::robust::median;
use crate::variance::Deviations;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::collections::HashMap;

/// Of a wave as long as the cut-off half passes (ISO 16610-31, second order): (1 + k) exp(-k) is 1/2 for
/// k = pi alpha^2.
const ALPHA: f64 = 0.730_913_428_094_675_9;
/// Cells are as wide as this share of the cut-off.
const CELL: f64 = 0.125;
/// Weights beyond this share of the cut-off, 3e-4 and less, are none.
const REACH: f64 = 1.17;
/// A place without a cell within this share of the cut-off has no value.
const NEAREST: f64 = 0.25;
/// Places where the filter lets so many times as much noise pass as at the median one have no value: at corners and
/// borders of holes, where the quadric hangs on cells of one side.
const NOISIER: f64 = 3.2;
/// Cells whose normals are farther apart than this cosine are on other sides of a wall.
pub(super) const SAME_SIDE: f64 = 0.3;

/// A place of a surface with its unit normal.
#[derive(Clone, Copy, Debug)]
pub(in crate::variance) struct Place {
    pub(in crate::variance) position: DVec3,
    pub(in crate::variance) normal: DVec3,
}

impl Place {
    /// The point at a signed distance along the normal.
    pub(super) fn displaced(&self, by: f64) -> DVec3 {
        self.position + by * self.normal
    }
}

/// A texel's place, area (square millimetres) and deviation (millimetres).
#[derive(Clone, Copy, Debug)]
pub(in crate::variance) struct Point {
    pub(in crate::variance) place: Place,
    pub(in crate::variance) area: f64,
    pub(in crate::variance) deviation: f64,
}

impl Point {
    /// Texel i with its place on the model's surface and its distance along the normal.
    pub(super) fn measured(deviations: &Deviations, i: usize) -> Self {
        Self::of(&deviations.texels, i, deviations.along(i))
    }

    /// Texel i with its deviation without the sag of the scan's triangle.
    pub(in crate::variance) fn without_sag(deviations: &Deviations, i: usize) -> Self {
        Self::of(&deviations.texels, i, deviations.without_sag(i))
    }

    fn of(texels: &Texels, i: usize, deviation: f32) -> Self {
        let normal = DVec3::from(texels.normal[i].map(f64::from));
        let place = Place { position: DVec3::from(texels.position[i]), normal };
        Self { place, area: f64::from(texels.area[i]), deviation: f64::from(deviation) }
    }
}

/// The points of a part, gathered.
pub(super) struct Cells {
    /// The point nearest to each cell's centre of gravity.
    pub(super) places: Vec<Place>,
    centres: Vec<DVec3>,
    /// Square millimetres.
    pub(super) areas: Vec<f64>,
    /// Mean deviations. Millimetres.
    pub(super) values: Vec<f64>,
    /// By point, its cell.
    pub(super) of_point: Vec<u32>,
}

/// Where a point is gathered: its cell, and the side that its normal looks to.
type Key = ([i64; 3], u8);

fn key(place: &Place, width: f64) -> Key {
    let n = place.normal.to_array();
    let largest = (0..3).fold(0, |best, k| if n[k].abs() > n[best].abs() { k } else { best });
    let side = 2 * largest as u8 + u8::from(n[largest] < 0.0);
    (place.position.to_array().map(|x| (x / width).floor() as i64), side)
}

impl Cells {
    /// Gathers the points of which `counts` is true; the others have a cell as well if one is there.
    pub(super) fn gather(points: &[Point], counts: &[bool], cutoff: f64) -> Self {
        let width = CELL * cutoff;
        let mut numbers: HashMap<Key, u32> = HashMap::new();
        let mut of_point = Vec::with_capacity(points.len());
        for point in points {
            let next = numbers.len() as u32;
            of_point.push(*numbers.entry(key(&point.place, width)).or_insert(next));
        }
        let count = numbers.len();
        let mut cells = Self {
            places: Vec::new(),
            centres: vec![DVec3::ZERO; count],
            areas: vec![0.0; count],
            values: vec![0.0; count],
            of_point,
        };
        for (i, point) in points.iter().enumerate().filter(|(i, _)| counts[*i]) {
            let cell = cells.of_point[i] as usize;
            cells.areas[cell] += point.area;
            cells.centres[cell] += point.area * point.place.position;
            cells.values[cell] += point.area * point.deviation;
        }
        for cell in 0..count {
            if cells.areas[cell] > 0.0 {
                cells.centres[cell] /= cells.areas[cell];
                cells.values[cell] /= cells.areas[cell];
            }
        }
        let mut nearest = vec![(f64::INFINITY, 0); count];
        for (i, point) in points.iter().enumerate() {
            let cell = cells.of_point[i] as usize;
            let distance =
                if cells.areas[cell] > 0.0 { point.place.position.distance(cells.centres[cell]) } else { 0.0 };
            if distance < nearest[cell].0 {
                nearest[cell] = (distance, i);
            }
        }
        cells.places = nearest.iter().map(|(_, i)| points[*i].place).collect();
        cells
    }
}

/// The weights of cells in the filtered values of some places.
pub(super) struct Filter {
    /// By place the cells about it with their weights; empty where there is no value.
    pub(super) weights: Vec<Vec<(u32, f64)>>,
    /// By place, how many times as much noise passes as at the median one.
    pub(super) noisier: Vec<f64>,
}

impl Filter {
    /// The filter of some cells, for some places.
    pub(super) fn new(cells: &Cells, places: &[Place], cutoff: f64) -> Self {
        let reach = REACH * cutoff;
        let block = |p: DVec3| p.to_array().map(|x| (x / reach).floor() as i64);
        let mut blocks: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        for cell in (0..cells.areas.len()).filter(|cell| cells.areas[*cell] > 0.0) {
            blocks.entry(block(cells.centres[cell])).or_default().push(cell as u32);
        }
        let of_place = |place: &Place| {
            let [i, j, k] = block(place.position);
            let offsets = || -1..=1_i64;
            let about =
                offsets().flat_map(|a| offsets().flat_map(move |b| offsets().map(move |c| [i + a, j + b, k + c])));
            let near = about.filter_map(|block| blocks.get(&block)).flatten().copied();
            weights(cells, place, near, cutoff)
        };
        let mut weights: Vec<Vec<(u32, f64)>> = places.par_iter().map(of_place).collect();
        let passed = |weights: &Vec<(u32, f64)>| -> f64 {
            weights.iter().map(|(cell, w)| w * w / cells.areas[*cell as usize]).sum()
        };
        let all: Vec<f64> = weights.iter().map(passed).collect();
        let mut noisier = vec![1.0; weights.len()];
        if let Some(usual) = median(&mut all.iter().copied().filter(|p| *p > 0.0).collect::<Vec<f64>>()) {
            for ((weights, passed), noisier) in weights.iter_mut().zip(all).zip(&mut noisier) {
                *noisier = (passed / usual).sqrt();
                if *noisier > NOISIER {
                    weights.clear();
                }
            }
        }
        Self { weights, noisier }
    }

    /// The filtered values of the cells' `values`; none where there are no cells about a place.
    pub(super) fn apply(&self, values: &[f64]) -> Vec<Option<f64>> {
        (0..self.weights.len()).into_par_iter().map(|k| self.value(k, values)).collect()
    }

    /// That at one place.
    pub(super) fn value(&self, k: usize, values: &[f64]) -> Option<f64> {
        let weights = &self.weights[k];
        (!weights.is_empty()).then(|| weights.iter().map(|(cell, w)| w * values[*cell as usize]).sum())
    }
}

/// The weights of cells in the filtered value at a place.
fn weights(cells: &Cells, place: &Place, near: impl Iterator<Item = u32>, cutoff: f64) -> Vec<(u32, f64)> {
    let near = gather_near(cells, place, near, cutoff);
    if near.is_empty() {
        return Vec::new();
    }
    let quadric = Quadric::of(&near);
    near.iter().map(|n| (n.cell, n.weight * quadric.at(n.at))).collect()
}

/// The cells that count at a place; none if the nearest is far.
fn gather_near(cells: &Cells, place: &Place, near: impl Iterator<Item = u32>, cutoff: f64) -> Vec<Near> {
    let (x, y) = place.normal.any_orthonormal_pair();
    let mut taken = Vec::new();
    let mut nearest = f64::INFINITY;
    for cell in near {
        let to = cells.centres[cell as usize] - place.position;
        let distance = to.length();
        let normal = cells.places[cell as usize].normal;
        if distance > REACH * cutoff || normal.dot(place.normal) < SAME_SIDE {
            continue;
        }
        nearest = nearest.min(distance);
        let weight = cells.areas[cell as usize] * (-std::f64::consts::PI * (distance / (ALPHA * cutoff)).powi(2)).exp();
        let flat = DVec2::new(to.dot(x), to.dot(y));
        let at = if flat.length() > 0.0 { flat * (distance / flat.length()) } else { flat };
        taken.push(Near { cell, weight, at: at / cutoff });
    }
    let sum: f64 = taken.iter().map(|n| n.weight).sum();
    if !(nearest < NEAREST * cutoff && sum > 0.0) {
        return Vec::new();
    }
    taken.iter_mut().for_each(|n| n.weight /= sum);
    taken
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// A square plate of 40 mm with a point every 0.5 mm.
    fn plate(deviation: impl Fn(f64, f64) -> f64) -> Vec<Point> {
        let at = |i: usize| 0.5 * i as f64 + 0.25;
        let point = |i: usize, j: usize| Point {
            place: Place { position: DVec3::new(at(i), at(j), 0.0), normal: DVec3::Z },
            area: 0.25,
            deviation: deviation(at(i), at(j)),
        };
        (0..80).flat_map(|i| (0..80).map(move |j| (i, j))).map(|(i, j)| point(i, j)).collect()
    }

    fn filtered(points: &[Point], cutoff: f64) -> (Cells, Vec<Option<f64>>) {
        let cells = Cells::gather(points, &vec![true; points.len()], cutoff);
        let values = filtered_values(&cells, cutoff);
        (cells, values)
    }

    fn filtered_values(cells: &Cells, cutoff: f64) -> Vec<Option<f64>> {
        Filter::new(cells, &cells.places, cutoff).apply(&cells.values)
    }

    /// Of a wave of length l the part (1 + k) exp(-k) passes, k = pi (alpha cut-off / l)^2: half where l is the cut-off
    /// (ISO 16610-31).
    #[test]
    fn waves_pass_as_the_standard_says() {
        for (cutoff, length) in [(8.0, 8.0), (8.0, 20.0), (4.0, 4.0), (12.0, 40.0), (12.0, 12.0)] {
            let wave = |x: f64| (TAU * (x - 20.0) / length).cos();
            let (cells, values) = filtered(&plate(|x, _| wave(x)), cutoff);
            let k = std::f64::consts::PI * (ALPHA * cutoff / length).powi(2);
            let expected = (1.0 + k) * (-k).exp();
            for (place, value) in cells.places.iter().zip(values).filter_map(|(p, v)| Some((p, v?))) {
                let p = place.position;
                if (p - DVec3::new(20.0, 20.0, 0.0)).abs().max_element() < 20.0 - 1.18 * cutoff {
                    // Cells average over an eighth of the cut-off, which takes 2.5 % of a wave as long as it.
                    let error = (value - expected * wave(p.x)).abs();
                    assert!(error < 0.03 * expected + 0.002, "{cutoff} {length}: {value} at {p}");
                }
            }
        }
    }

    /// A bend is that of the cells' means, which lie above it: by a twelfth of the square of their width, 1 mm.
    #[test]
    fn slopes_and_bends_pass_at_the_edges() {
        let bent = |x: f64, y: f64| 0.1 + 0.02 * x - 0.01 * y + 0.003 * x * x - 0.002 * x * y + 0.001 * y * y;
        let (cells, values) = filtered(&plate(bent), 8.0);
        let filtered = cells.places.iter().zip(values).filter_map(|(p, v)| Some((p, v?)));
        for (place, value) in filtered {
            let p = place.position;
            assert!((value - bent(p.x, p.y)).abs() < 5e-4, "{value} at {p}");
        }
        // Edges have values, and corners have none.
        let at = |x: f64, y: f64| {
            let near = |p: &Place| p.position.distance_squared(DVec3::new(x, y, 0.0));
            let all = cells.places.iter().enumerate();
            all.min_by(|a, b| near(a.1).total_cmp(&near(b.1))).map(|(i, _)| i).expect("cells")
        };
        let values = filtered_values(&cells, 8.0);
        assert!(values[at(20.0, 0.0)].is_some() && values[at(0.0, 20.0)].is_some());
        assert!(values[at(0.0, 0.0)].is_none());
    }

    /// White noise of 1 at every point of 0.25 mm2 becomes 1 / sqrt((alpha cut-off)^2 / 1.25 / 0.25).
    #[test]
    fn noise_becomes_what_the_area_of_the_filter_says() {
        use rand::SeedableRng;
        use rand_distr::Distribution;
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let noise: Vec<f64> = (0..6400).map(|_| rand_distr::StandardNormal.sample(&mut random)).collect();
        let cutoff = 5.0;
        let (cells, values) = filtered(&plate(|x, y| noise[((2.0 * x) as usize) * 80 + (2.0 * y) as usize]), cutoff);
        let inner: Vec<f64> = cells
            .places
            .iter()
            .zip(values)
            .filter(|(place, _)| (place.position - DVec3::new(20.0, 20.0, 0.0)).abs().max_element() < 16.0)
            .filter_map(|(_, value)| value)
            .collect();
        let sd = (inner.iter().map(|v| v * v).sum::<f64>() / inner.len() as f64).sqrt();
        let expected = (0.25 * 1.25 / (ALPHA * cutoff).powi(2)).sqrt();
        // Some 90 independent places: the standard deviation of the estimate is 7 %.
        assert!((sd / expected - 1.0).abs() < 0.25, "{sd} for {expected}");
    }

    #[test]
    fn the_two_sides_of_a_wall_are_two() {
        let mut points = plate(|_, _| 1.0);
        points.extend(plate(|_, _| -1.0).into_iter().map(|mut point| {
            point.place.position.z -= 0.2;
            point.place.normal = -DVec3::Z;
            point
        }));
        let (cells, values) = filtered(&points, 8.0);
        let is_own = |(place, value): (&Place, Option<f64>)| value.is_none_or(|v| (v - place.normal.z).abs() < 1e-9);
        assert!(cells.places.iter().zip(values).all(is_own));
    }
}
