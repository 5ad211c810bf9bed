//! Triangles of the scan across edges that lie elsewhere in the thing than in the model, as beside a floor that is too
//! high or slants: all their corners may be nearest to the wall, and some are points of the floor.

use super::associated::{OUTLYING, fitted};
use super::bridges::longest_side;
use super::datum::Placed;
use super::{FEWEST, Recognised, zone};
use crate::mesh::TriangleMesh;
use crate::robust::{MAD_TO_SD, median};
use crate::scan::Neighbours;
use crate::variance::Deviations;
use crate::variance::hits::Hit;
use glam::DVec3;
use rayon::prelude::*;

/// A point on the measured surface of a part belongs to it if a point that a texel of it sees is so near, in lengths of
/// the triangle's longest side. The last row of a floor that has moved may be seen by the wall's texels alone, and its
/// triangles may be those of a view that saw no more of the floor.
const BESIDE: f64 = 2.0;

/// By texel, whether what it sees of the scan is a triangle with a corner that is off the measured surface of the
/// texel's part, and on that of another one. Burrs and dents are on no other part's surface. Parts without a form have
/// no measured surface. `hits` are the places that the texels have their distances from.
pub(in crate::variance) fn across_moved_edges(
    deviations: &Deviations,
    shapes: &[Option<Recognised>],
    mesh: &TriangleMesh,
    hits: &[Option<Hit>],
) -> Vec<bool> {
    let seen: Vec<(u32, Hit)> =
        deviations.texels.part.iter().copied().zip(hits).filter_map(|(part, hit)| Some((part, (*hit)?))).collect();
    let mut of_parts = vec![Vec::new(); shapes.len()];
    for (part, hit) in &seen {
        of_parts[*part as usize].push(nearest_corner(hit, mesh.triangles[hit.triangle as usize]));
    }
    let surface =
        |(shape, seen): (&Option<Recognised>, &Vec<u32>)| Measured::new((*shape)?, mesh, seen, deviations.noise);
    let surfaces: Vec<Option<Measured>> = shapes.par_iter().zip(&of_parts).map(surface).collect();
    let mut looks: Vec<(u32, u32)> = seen.iter().map(|(part, hit)| (*part, hit.triangle)).collect();
    looks.sort_unstable();
    looks.dedup();
    let is_across = |(part, triangle): &(u32, u32)| {
        across(*part as usize, mesh.corners(mesh.triangles[*triangle as usize]), &surfaces)
    };
    let across: Vec<(u32, u32)> = looks.into_par_iter().filter(is_across).collect();
    let sees_one =
        |(part, hit): (&u32, &Option<Hit>)| hit.is_some_and(|hit| across.binary_search(&(*part, hit.triangle)).is_ok());
    deviations.texels.part.par_iter().zip(hits).map(sees_one).collect()
}

/// The corner of a triangle of the scan with the largest weight at a place of it. A part's texels have most of theirs
/// on the part, and so these corners, one for each texel, are a sample of its surface by area; of all corners of a
/// narrow wall's triangles two fifths may be the floor's.
fn nearest_corner(hit: &Hit, triangle: [u32; 3]) -> u32 {
    let [a, b, c] = hit.weights;
    let nearest = if a >= b.max(c) { 0 } else { 1 + usize::from(c > b) };
    triangle[nearest]
}

/// Whether a triangle with some corners that texels of a part see has one off that part's surface, on that of another.
fn across(part: usize, corners: [DVec3; 3], surfaces: &[Option<Measured>]) -> bool {
    let Some(Some(own)) = surfaces.get(part) else { return false };
    let reach = BESIDE * longest_side(corners);
    let others = || surfaces.iter().enumerate().filter(|(other, _)| *other != part).filter_map(|(_, s)| s.as_ref());
    corners.iter().any(|corner| own.is_off(*corner) && others().any(|other| other.has(*corner, reach)))
}

/// A part's surface of least squares. Millimetres.
struct Measured {
    surface: Placed,
    /// Points that are farther from the surface than this do not lie on it: so many robust standard deviations of the
    /// part's points, or of the noise.
    off: f64,
    /// The points that the part's texels see and that lie on the surface.
    points: Vec<[f64; 3]>,
    tree: Neighbours,
}

impl Measured {
    /// Of the part's form and the scan's points that its texels see, one for each; none of too few.
    fn new(shape: Recognised, mesh: &TriangleMesh, seen: &[u32], noise: f64) -> Option<Measured> {
        if seen.len() < FEWEST {
            return None;
        }
        let at = |vertex: &u32| DVec3::from(mesh.positions[*vertex as usize]);
        let sample: Vec<DVec3> = seen.iter().step_by(seen.len().div_ceil(zone::FITTED)).map(at).collect();
        let surface = fitted(&sample, shape.datum()?)?.0.placed();
        let mut heights: Vec<f64> = sample.iter().map(|p| surface.height(*p).abs()).collect();
        let off = OUTLYING * (MAD_TO_SD * median(&mut heights)?).max(noise);
        let mut vertices: Vec<u32> = seen.to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let on_it = vertices.iter().filter(|vertex| surface.height(at(vertex)).abs() <= off);
        let points: Vec<[f64; 3]> = on_it.map(|vertex| mesh.positions[*vertex as usize]).collect();
        let tree = Neighbours::new(&points);
        Some(Measured { surface, off, points, tree })
    }

    fn is_off(&self, point: DVec3) -> bool {
        self.surface.height(point).abs() > self.off
    }

    /// Whether a point is on the surface, and no farther from the points that are seen than `reach`.
    fn has(&self, point: DVec3, reach: f64) -> bool {
        let nearest = || self.tree.nearest(point.to_array(), 1).first().map(|i| DVec3::from(self.points[*i as usize]));
        !self.is_off(point) && nearest().is_some_and(|nearest| nearest.distance(point) <= reach)
    }
}
