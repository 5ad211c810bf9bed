//! Strips: pieces of a part beyond its tolerance that are as large as a footprint, and so narrow that of no footprint
//! they are the half: a burr or a rim along an edge.

use super::Tolerance;
use crate::variance::Deviations;
use crate::variance::form::{Around, Point};
use glam::DVec3;
use std::collections::HashMap;

/// A texel is beyond a limit if it is so by so many standard deviations of a point.
const CLEARLY: f64 = 3.0;

/// A connected piece.
#[derive(Clone, Debug)]
pub(super) struct Strip {
    /// Square millimetres.
    pub(super) area: f64,
    /// Mean deviation. Millimetres.
    pub(super) deviation: f64,
    /// Its middle. Millimetres.
    pub(super) middle: DVec3,
}

/// The largest strip of some texels; none where nothing is beyond the tolerance with others about it. `noise` is the
/// standard deviation of a point, `spacing` how far apart the scan's points are. Millimetres.
pub(super) fn largest(
    deviations: &Deviations,
    texels: &[u32],
    tolerance: Tolerance,
    (noise, spacing): (f64, f64),
) -> Option<Strip> {
    let slack = CLEARLY * noise + deviations.precision;
    let is_beyond = |p: &Point| p.deviation > tolerance.upper + slack || p.deviation < tolerance.lower - slack;
    let points: Vec<Point> = texels.iter().map(|i| Point::without_sag(deviations, *i as usize)).collect();
    if !points.iter().any(is_beyond) {
        return None;
    }
    let around = Around::new(&points, spacing);
    let off: Vec<Option<f64>> = points.iter().map(|p| Some(p.deviation)).collect();
    let beyond: Vec<&Point> = (points.iter().enumerate())
        .filter(|(i, p)| is_beyond(p) && around.is_of_dent(*i, &off))
        .map(|(_, point)| point)
        .collect();
    pieces(&beyond, spacing).into_iter().map(strip).max_by(|a, b| a.area.total_cmp(&b.area))
}

fn strip(points: Vec<&Point>) -> Strip {
    let area: f64 = points.iter().map(|p| p.area).sum();
    let deviation = points.iter().map(|p| p.area * p.deviation).sum::<f64>() / area;
    let middle = points.iter().map(|p| p.area * p.place.position).sum::<DVec3>() / area;
    Strip { area, deviation, middle }
}

/// Points in pieces that are connected over less than two distances between the scan's points, each to one side.
fn pieces<'p>(points: &[&'p Point], spacing: f64) -> Vec<Vec<&'p Point>> {
    let key = |p: &Point| (p.place.position.to_array().map(|x| (x / spacing).floor() as i64), p.deviation > 0.0);
    let mut cells: HashMap<([i64; 3], bool), Vec<&Point>> = HashMap::new();
    points.iter().for_each(|p| cells.entry(key(p)).or_default().push(p));
    // In the order of the points, so that equal inputs have equal strips.
    let mut pieces = Vec::new();
    for first in points {
        let mut piece = Vec::new();
        let mut open = vec![key(first)];
        while let Some(([x, y, z], side)) = open.pop() {
            let Some(found) = cells.remove(&([x, y, z], side)) else { continue };
            piece.extend(found);
            open.extend((0..27).map(|k| ([x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1], side)));
        }
        if !piece.is_empty() {
            pieces.push(piece);
        }
    }
    pieces
}
