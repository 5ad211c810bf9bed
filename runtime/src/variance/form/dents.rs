//! Points that are off together, as those of a dent or a bump are: no stray ones, which stand among others.

use super::filter::Point;
use glam::DVec3;
use std::collections::HashMap;

/// The radius, in distances between the scan's points, of a disc of the surface all of whose points are off to the same
/// side: of twelve points. Stray ones pull at the triangles about them, over one distance; a row of texels along an edge
/// whose rays met another surface is narrower, too.
const RADIUS: f64 = 2.0;
/// How much of such a disc's area must have been measured: beside an edge or a hole less is.
const WHOLE: f64 = 0.9;
/// Points whose normals are farther apart than this cosine are on other sides of a wall.
const SAME_SIDE: f64 = 0.3;

/// The points about others.
pub(super) struct Around<'p> {
    points: &'p [Point],
    radius: f64,
    /// By cell, as wide as the radius.
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl<'p> Around<'p> {
    /// Of a scan whose points are so far apart, in millimetres.
    pub(super) fn new(points: &'p [Point], spacing: f64) -> Self {
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

    /// The points within some radius of a point, not larger than the discs', on its side of a wall.
    fn near(&self, i: u32, radius: f64) -> impl Iterator<Item = u32> {
        let (points, own) = (self.points, self.points[i as usize].place);
        let [x, y, z] = self.cell(own.position);
        let cells = (0..27).filter_map(move |k| self.cells.get(&[x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1]));
        cells.flatten().copied().filter(move |k| {
            let place = &points[*k as usize].place;
            place.position.distance_squared(own.position) <= radius * radius && place.normal.dot(own.normal) > SAME_SIDE
        })
    }

    /// Whether all points of the disc about a point are off to its side. `side` is, by point, 0 where it is not off.
    fn is_within(&self, i: u32, side: &[i8]) -> bool {
        let own = side[i as usize];
        let mut area = 0.0;
        for k in self.near(i, self.radius) {
            if side[k as usize] != own {
                return false;
            }
            area += self.points[k as usize].area;
        }
        area >= WHOLE * std::f64::consts::PI * self.radius * self.radius
    }

    /// By point, whether it belongs to a dent or a bump. `side` is as above: 1 where it is off outwards, -1 inwards.
    pub(super) fn of_dents(&self, side: &[i8]) -> Vec<bool> {
        let mut found = vec![false; side.len()];
        if !self.radius.is_finite() {
            return found;
        }
        let off = (0..).zip(side).filter(|(_, side)| **side != 0).map(|(i, _)| i);
        let mut reached: Vec<u32> = off.filter(|i| self.is_within(*i, side)).collect();
        reached.iter().for_each(|i| found[*i as usize] = true);
        // What is off beside it belongs to it.
        while let Some(i) = reached.pop() {
            for k in self.near(i, 0.5 * self.radius) {
                if side[k as usize] == side[i as usize] && !std::mem::replace(&mut found[k as usize], true) {
                    reached.push(k);
                }
            }
        }
        found
    }
}
