//! Space that a scan shows to be empty. A scanner saw each surface from somewhere in front of it, so that what stands
//! in front of scanned surfaces, with no scan near it, is contradicted. What lies behind them, or where nothing was
//! scanned, is not.

use crate::bvh::Bvh;
use crate::mesh::TriangleMesh;
use crate::robust::median;
use crate::sampling::direction;
use crate::scan::Scan;
use glam::DVec3;

/// A place is away from the scan beyond so many standard deviations of its noise, and the spacing of its points.
const AWAY_NOISE: f64 = 4.0;

/// Directions from a place, how many must meet the front of a scanned surface, how many fronts a back may have beside
/// it, and the cosines between direction and normal of the front and of the back: what is between is grazing. Through
/// the gaps of a scan one looks into walls, at the backs of their other sides: of a shelf in a vessel whose scan lacks
/// 3 % of its triangles, 3 % stood in empty space if there might be no back, 67 % with one for 12 fronts. The right
/// model on twenty parts and views of two vessels has at most 14 square millimetres either way; up to 1,294 if 8 of 48
/// were enough.
const DIRECTIONS: usize = 48;
const SEEN_FROM_FRONT: usize = 12;
const FRONTS_FOR_A_BACK: usize = 12;
const FRONT: f64 = -0.3;
const BACK: f64 = 0.1;

/// Triangles whose edges say how far apart the points are.
const SPACING_TRIANGLES: usize = 10_000;

/// The surface of a scan as a witness of the empty space in front of it.
pub(crate) struct EmptySpace<'a> {
    surface: &'a TriangleMesh,
    bvh: &'a Bvh,
    /// 1, or -1 if the triangles face the other way.
    side: f64,
    /// Surface nearer to the scan than this may be where it is by the scan's noise or gaps. Millimetres.
    near: f64,
}

impl<'a> EmptySpace<'a> {
    /// Of triangles with a hierarchy over them, which face the other way if they are `reversed`.
    pub(crate) fn new(surface: &'a TriangleMesh, bvh: &'a Bvh, reversed: bool, near: f64) -> Self {
        Self { surface, bvh, side: if reversed { -1.0 } else { 1.0 }, near }
    }

    /// Of a scan with triangles and a hierarchy over them.
    pub(crate) fn of(scan: &'a Scan, bvh: &'a Bvh) -> Self {
        let mesh = &scan.mesh;
        let edges = mesh.triangles.iter().step_by((mesh.triangles.len() / SPACING_TRIANGLES).max(1)).map(|t| {
            let [a, b, _] = mesh.corners(*t);
            a.distance(b)
        });
        let spacing = median(&mut edges.collect::<Vec<f64>>()).unwrap_or(0.0);
        Self::new(mesh, bvh, false, Self::nearness(scan.noise, spacing))
    }

    /// The distance from a scan within which something may be where it is by the scan's `noise` (a standard
    /// deviation), or because its points are `spacing` apart. All in millimetres.
    pub(crate) fn nearness(noise: f64, spacing: f64) -> f64 {
        AWAY_NOISE * noise + spacing
    }

    /// Whether a place of a surface with an outward normal stands in empty space: nothing of the scan is near, and from
    /// a little behind the place many directions lead to the front of a scanned surface, and hardly any to the back of
    /// one.
    pub(crate) fn contains(&self, place: DVec3, outward: DVec3) -> bool {
        if self.bvh.closest_point(place, self.near).is_some() {
            return false;
        }
        let from = place - outward * (0.5 * self.near);
        let (mut fronts, mut backs) = (0, 0);
        for k in 0..DIRECTIONS {
            let direction = direction(k);
            let Some(hit) = self.bvh.nearest_hit(from, direction, f64::INFINITY) else { continue };
            let [a, b, c] = self.surface.corners(self.surface.triangles[hit.triangle as usize]);
            let cosine = self.side * (b - a).cross(c - a).normalize_or_zero().dot(direction);
            fronts += usize::from(cosine < FRONT);
            backs += usize::from(cosine > BACK);
            if backs * FRONTS_FOR_A_BACK > fronts + DIRECTIONS - 1 - k {
                return false;
            }
        }
        fronts >= SEEN_FROM_FRONT
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::halton;

    /// A sphere by its rings, without some of its triangles; it faces outwards, or inwards.
    fn sphere(radius: f64, outwards: bool, lacks: impl Fn(usize) -> bool) -> TriangleMesh {
        const RINGS: u32 = 60;
        let mut mesh = TriangleMesh::default();
        for i in 0..=RINGS {
            for k in 0..RINGS {
                let [polar, around] = [(i, 0.5), (k, 1.0)]
                    .map(|(n, turns)| std::f64::consts::TAU * turns * f64::from(n) / f64::from(RINGS));
                let (s, z) = polar.sin_cos();
                mesh.positions.push([s * around.cos(), s * around.sin(), z].map(|c| radius * c));
            }
        }
        let corner = |i: u32, k: u32| i * RINGS + k % RINGS;
        for i in 0..RINGS {
            for k in 0..RINGS {
                let (a, b, c, d) = (corner(i, k), corner(i + 1, k), corner(i + 1, k + 1), corner(i, k + 1));
                for [a, b, c] in [[a, b, c], [a, c, d]] {
                    mesh.triangles.push(if outwards { [a, b, c] } else { [a, c, b] });
                }
            }
        }
        let mut number = 0;
        mesh.triangles.retain(|_| {
            number += 1;
            !lacks(number)
        });
        mesh
    }

    /// A hollow ball with a wall of 3, whose scan lacks triangles.
    fn ball(lacks: impl Fn(usize) -> bool) -> TriangleMesh {
        let (mut ball, outside) = (sphere(40.0, false, &lacks), sphere(43.0, true, lacks));
        let first = ball.positions.len() as u32;
        ball.positions.extend(outside.positions);
        ball.triangles.extend(outside.triangles.into_iter().map(|t| t.map(|corner| first + corner)));
        ball
    }

    /// The share of places at a distance from the middle, and above a height, that stand in empty space.
    fn share(scan: &TriangleMesh, reversed: bool, radius: f64, above: f64) -> f64 {
        let bvh = Bvh::build(scan).unwrap();
        let space = EmptySpace::new(scan, &bvh, reversed, 1.0);
        let places: Vec<DVec3> = (0..200).map(direction).filter(|p| radius * p.z > above).collect();
        places.iter().filter(|p| space.contains(radius * **p, **p)).count() as f64 / places.len() as f64
    }

    #[test]
    fn a_hollow_is_empty_although_its_scan_has_gaps_and_a_wall_is_not() {
        for (gaps, least) in [(0.0, 1.0), (0.03, 0.9)] {
            let scan = ball(|number| halton(number, 3) < gaps);
            for radius in [10.0, 38.5] {
                let found = share(&scan, false, radius, -100.0);
                assert!(found >= least, "{found} of the hollow at {radius}, {gaps} missing");
            }
            // Near to the scan, in the wall, and outside, where little of the ball is to be seen.
            for radius in [39.5, 41.5, 60.0] {
                assert_eq!(share(&scan, false, radius, -100.0), 0.0, "{radius}");
            }
            assert_eq!(share(&scan, true, 10.0, -100.0), 0.0);
        }
    }

    #[test]
    fn what_is_not_scanned_is_not_empty() {
        // Of a ball of which the lower half was scanned, the upper one.
        let half = ball(|number| (number - 1) % 7200 < 3600);
        for radius in [39.0, 41.5, 43.0] {
            // A few places are close to the edge of what was scanned, and see much of it.
            let found = share(&half, false, radius, 2.0);
            assert!(found < 0.03, "{found} at {radius}");
        }
    }
}
