//! Points that are off together, as those of a dent or a bump are: no stray ones, which stand among others.

use super::filter::{Point, SAME_SIDE};
use glam::DVec3;
use std::collections::HashMap;
use std::f64::consts::PI;

/// The radius of a disc of the surface about a point, in distances between the scan's points: it has twelve of them.
const RADIUS: f64 = 2.0;
/// The share of the disc that is off with a point of a dent, to the same side ...
const TOGETHER: f64 = 0.4;
/// ... and at least by this part as far. A stray point pulls at the triangles about it, over one distance: 6 % of the
/// disc are half as far off. Texels along an edge whose rays met another surface, in a row one distance wide, are 32 %;
/// of a dent with a radius of 2.1 distances it is so in the middle, and of a wide hole at its steep rim.
const AS_FAR: f64 = 0.5;

/// The points about others.
pub(in crate::variance) struct Around<'p> {
    points: &'p [Point],
    /// Of the discs. Millimetres.
    radius: f64,
    /// By cell, as wide as the radius.
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl<'p> Around<'p> {
    /// Of a scan whose points are so far apart, in millimetres.
    pub(in crate::variance) fn new(points: &'p [Point], spacing: f64) -> Self {
        let radius = RADIUS * spacing;
        let mut around = Self { points, radius, cells: HashMap::new() };
        for (i, point) in (0..).zip(points) {
            around.cells.entry(around.cell(point.place.position)).or_default().push(i);
        }
        around
    }

    fn cell(&self, at: DVec3) -> [i64; 3] {
        at.to_array().map(|x| (x / self.radius).floor() as i64)
    }

    /// The points of the disc about a point.
    fn disc(&self, i: usize) -> impl Iterator<Item = usize> {
        let own = self.points[i].place;
        let [x, y, z] = self.cell(own.position);
        let cells = (0..27).filter_map(move |k| self.cells.get(&[x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1]));
        cells.flatten().map(|k| *k as usize).filter(move |k| {
            let place = &self.points[*k].place;
            place.position.distance(own.position) <= self.radius && place.normal.dot(own.normal) > SAME_SIDE
        })
    }

    /// Whether a point that is off is so with others. `errors` has, by point, how far it is off, if that is known.
    pub(in crate::variance) fn is_of_dent(&self, i: usize, errors: &[Option<f64>]) -> bool {
        let Some(own) = errors[i].filter(|_| self.radius.is_finite()) else { return false };
        let is_as_far = |k: &usize| errors[*k].is_some_and(|error| error * own.signum() >= AS_FAR * own.abs());
        let area: f64 = self.disc(i).filter(is_as_far).map(|k| self.points[k].area).sum();
        area >= TOGETHER * PI * self.radius * self.radius
    }
}
