//! Where the bodies of a model reach into each other, however small the place is.
//!
//! Winding numbers beside places that are spread over the whole surface miss the corner of a box that reaches into
//! another one by a twentieth of its edge. Here only what lies in the boxes around both is looked at.

use crate::bvh::Bvh;
use crate::mesh::{Bounds, TriangleMesh, tetrahedron};
use crate::model::{Winding, bodies};
use crate::sampling::{halton, in_triangle};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::OnceLock;

/// The least depth at which a place of one body counts as within another, as a share of the mesh's diagonal. Surfaces
/// that coincide, as of a peg that fills its hole, are in each other by two chords of the fine triangles (1e-4 each).
const DEEP: f64 = 3e-4;

/// Places of a body's triangles in the box of another, the fewest, and those of all pairs together: the check of a
/// plate with 36 pegs, 72 pairs, takes 1.6 s of processor time more for them and for the fine triangles that they are
/// on.
const PLACES: usize = 2000;
const FEWEST: usize = 50;
const ALL_PLACES: usize = 100_000;

/// The triangles of one part.
struct Body {
    triangles: Vec<[u32; 3]>,
    bounds: Bounds,
    /// None where it does not enclose anything by itself. Made when it is asked for.
    solid: OnceLock<Option<Solid>>,
}

struct Solid {
    winding: Winding,
    bvh: Bvh,
    /// It faces inwards: the wall of a cavity in others.
    is_cavity: bool,
}

impl Body {
    fn solid(&self, mesh: &TriangleMesh, numbers: &[u32]) -> Option<&Solid> {
        let make = || {
            let renumbered = self.triangles.iter().map(|t| t.map(|v| numbers[v as usize])).collect();
            let is_closed =
                TriangleMesh { triangles: renumbered, ..TriangleMesh::default() }.boundary_edges().is_empty();
            if !is_closed {
                return None;
            }
            let winding = Winding::new(self.triangles.iter().map(|t| mesh.corners(*t)).collect());
            let bvh = Bvh::build(&mesh.submesh(self.triangles.iter().copied())).ok()?;
            let centre = self.bounds.centre();
            let about = |t: &[u32; 3]| tetrahedron(mesh.corners(*t).map(|p| p - centre));
            let is_cavity = self.triangles.iter().map(about).sum::<f64>() < 0.0;
            Some(Solid { winding, bvh, is_cavity })
        };
        self.solid.get_or_init(make).as_ref()
    }
}

impl Solid {
    fn has(&self, place: DVec3) -> bool {
        self.winding.at(place) > 0.5
    }

    fn is_far(&self, place: DVec3, distance: f64) -> bool {
        self.bvh.closest_point(place, distance).is_none()
    }
}

/// Whether bodies are so near to each other that one may reach into the other: by the boxes around them.
pub(super) fn may_reach(mesh: &TriangleMesh) -> bool {
    !pairs(&divided(mesh), DEEP * mesh.bounds().diagonal()).is_empty()
}

/// A place of one body's surface that is clearly within another body, or of a cavity's wall that is clearly outside of
/// all; none where bodies only touch. Bodies that are not closed by themselves have no inside.
pub(super) fn reaching(mesh: &TriangleMesh) -> Option<[f64; 3]> {
    let deep = DEEP * mesh.bounds().diagonal();
    let bodies = divided(mesh);
    let pairs = pairs(&bodies, deep);
    let count = (ALL_PLACES / pairs.len().max(1)).clamp(FEWEST, PLACES);
    let numbers = if pairs.is_empty() { Vec::new() } else { mesh.position_numbers() };
    let found = |(a, b, region): &(usize, usize, Bounds)| {
        let solid = bodies[*b].solid(mesh, &numbers)?;
        if bodies[*a].solid(mesh, &numbers).is_some_and(|of_body| of_body.is_cavity) {
            return None;
        }
        let is_within = |place: &DVec3| solid.has(*place) && solid.is_far(*place, deep);
        places(mesh, &bodies[*a].triangles, region, count).into_iter().find(is_within)
    };
    let reaching = pairs.par_iter().find_map_first(found);
    reaching.or_else(|| beyond(mesh, &bodies, (&numbers, deep))).map(|place| place.to_array())
}

/// A place of a cavity's wall that is clearly outside of all other bodies; none where one of them has no inside.
fn beyond(mesh: &TriangleMesh, bodies: &[Body], (numbers, deep): (&[u32], f64)) -> Option<DVec3> {
    if numbers.is_empty() {
        return None;
    }
    let solids: Vec<&Solid> = bodies.iter().map(|body| body.solid(mesh, numbers)).collect::<Option<_>>()?;
    let mut cavities = (0..bodies.len()).filter(|k| solids[*k].is_cavity);
    cavities.find_map(|k| {
        let others = || solids.iter().enumerate().filter(|(other, _)| *other != k).map(|(_, solid)| solid);
        let is_outside = |place: &DVec3| others().all(|solid| !solid.has(*place) && solid.is_far(*place, deep));
        places(mesh, &bodies[k].triangles, &bodies[k].bounds, PLACES).into_iter().find(is_outside)
    })
}

/// Two bodies, and where the surface of the first may be within the second.
fn pairs(bodies: &[Body], deep: f64) -> Vec<(usize, usize, Bounds)> {
    let others = |a: usize| (0..bodies.len()).filter(move |b| *b != a).map(move |b| (a, b));
    let region = |(a, b): (usize, usize)| {
        let region = common(&bodies[a].bounds, &within(&bodies[b].bounds, deep));
        (!region.is_empty()).then_some((a, b, region))
    };
    (0..bodies.len()).flat_map(others).filter_map(region).collect()
}

fn divided(mesh: &TriangleMesh) -> Vec<Body> {
    let mut divided: Vec<Body> = Vec::new();
    for (group, number) in mesh.groups.iter().zip(bodies(mesh.groups.iter().map(|group| group.name.as_str()))) {
        if number == divided.len() {
            divided.push(Body { triangles: Vec::new(), bounds: Bounds::EMPTY, solid: OnceLock::new() });
        }
        divided[number].triangles.extend_from_slice(&mesh.triangles[group.start..group.end]);
    }
    for body in &mut divided {
        body.bounds = body.triangles.iter().flat_map(|t| mesh.corners(*t)).collect();
    }
    divided
}

fn common(a: &Bounds, b: &Bounds) -> Bounds {
    Bounds { low: a.low.max(b.low), high: a.high.min(b.high) }
}

fn within(bounds: &Bounds, by: f64) -> Bounds {
    Bounds { low: bounds.low + by, high: bounds.high - by }
}

/// Corners of triangles that lie in a box, and places spread over what of them lies in it.
fn places(mesh: &TriangleMesh, triangles: &[[u32; 3]], region: &Bounds, count: usize) -> Vec<DVec3> {
    let is_in = |p: &DVec3| p.cmpge(region.low).all() && p.cmple(region.high).all();
    let corners: Vec<DVec3> = triangles.iter().flat_map(|t| mesh.corners(*t)).filter(is_in).collect();
    let mut places: Vec<DVec3> = corners.iter().step_by(corners.len().div_ceil(count).max(1)).copied().collect();
    let pieces: Vec<[DVec3; 3]> = triangles.iter().flat_map(|t| clipped(mesh.corners(*t), region)).collect();
    let area = |[a, b, c]: &[DVec3; 3]| 0.5 * (*b - *a).cross(*c - *a).length();
    let each = pieces.iter().map(area).sum::<f64>() / count as f64;
    // The place after so much of the area is in the piece in which that ends.
    let (mut passed, mut next) = (0.0, 0);
    for piece in &pieces {
        passed += area(piece);
        while next < count && (next as f64 + 0.5) * each <= passed {
            let (s, t) = in_triangle(halton(next + 1, 0), halton(next + 1, 1));
            let [a, b, c] = *piece;
            places.push(a + (b - a) * s + (c - a) * t);
            next += 1;
        }
    }
    places
}

/// The part of a triangle that lies in a box, as triangles (Sutherland and Hodgman 1974).
fn clipped(corners: [DVec3; 3], region: &Bounds) -> Vec<[DVec3; 3]> {
    let of: Bounds = corners.into_iter().collect();
    if common(&of, region).is_empty() {
        return Vec::new();
    }
    let mut polygon = corners.to_vec();
    for (axis, side) in (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]) {
        let limit = if side > 0.0 { region.low[axis] } else { region.high[axis] };
        let inside = |p: &DVec3| side * (p[axis] - limit);
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (k, p) in polygon.iter().enumerate() {
            let q = polygon[(k + 1) % polygon.len()];
            let (here, there) = (inside(p), inside(&q));
            if here >= 0.0 {
                kept.push(*p);
            }
            if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
                kept.push(*p + (q - *p) * (here / (here - there)));
            }
        }
        polygon = kept;
    }
    (2..polygon.len()).map(|k| [polygon[0], polygon[k - 1], polygon[k]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Group;

    fn boxes(all: &[(&str, [f64; 3], [f64; 3])]) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        for (name, low, high) in all {
            let (first, start) = (mesh.positions.len() as u32, mesh.triangles.len());
            let corner = |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { high[axis] } else { low[axis] });
            mesh.positions.extend((0..8).map(corner));
            let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
            for [a, b, c, d] in sides.map(|side| side.map(|v| first + v)) {
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
            mesh.groups.push(Group { name: (*name).to_owned(), start, end: mesh.triangles.len() });
        }
        mesh
    }

    #[test]
    fn a_corner_and_a_thin_bar_that_reach_in_are_found_and_what_touches_is_not() {
        let with = |low: [f64; 3], high: [f64; 3]| reaching(&boxes(&[("a", [0.0; 3], [20.0; 3]), ("b", low, high)]));
        for d in [0.05, 0.2, 1.0] {
            assert!(with([20.0 - d; 3], [40.0; 3]).is_some(), "{d}");
        }
        // No corner of either is in the other.
        assert!(with([19.9, 5.0, -1.0], [40.0, 5.1, 21.0]).is_some());
        assert!(with([-1.0, 19.9, 19.9], [21.0, 40.0, 40.0]).is_some());
        assert!(with([20.0, 0.0, 0.0], [40.0; 3]).is_none());
        assert!(with([20.0; 3], [40.0; 3]).is_none());
        // A cavity by a part of its own, and one that reaches out.
        let cavity = |high: f64| {
            let mut mesh = boxes(&[("a", [0.0; 3], [20.0; 3]), ("b", [5.0; 3], [high; 3])]);
            mesh.triangles[12..].iter_mut().for_each(|triangle| triangle.swap(1, 2));
            reaching(&mesh)
        };
        assert!(cavity(15.0).is_none() && cavity(20.0).is_none());
        assert!(cavity(20.2).is_some());
        let one = boxes(&[("a.left", [0.0; 3], [20.0; 3]), ("a.right", [19.0; 3], [40.0; 3])]);
        assert!(reaching(&one).is_none(), "one part");
    }

    #[test]
    fn what_of_a_triangle_lies_in_a_box_has_its_area() {
        let region = Bounds { low: DVec3::splat(-1.0), high: DVec3::splat(1.0) };
        let large = [DVec3::new(-9.0, -9.0, 0.0), DVec3::new(9.0, -9.0, 0.0), DVec3::new(0.0, 30.0, 0.0)];
        let area = |pieces: Vec<[DVec3; 3]>| -> f64 {
            pieces.iter().map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a).length()).sum()
        };
        assert!((area(clipped(large, &region)) - 4.0).abs() < 1e-12);
        assert!(clipped(large.map(|p| p + DVec3::Z * 2.0), &region).is_empty());
    }
}
