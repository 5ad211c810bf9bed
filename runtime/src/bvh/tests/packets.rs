//! Packets against the same triangle test over all triangles, without a tree.

use super::{random_point, soup, sphere};
use crate::bvh::Bvh;
use crate::bvh::packet::{BothWays, HitCriteria, Line, Octant, PACKET, normal_length};
use crate::mesh::TriangleMesh;
use glam::{DVec3, Vec3A};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Woop, Benthin and Wald's test of one triangle, one operation at a time, in the order in which packets do it: t and
/// the doubled area in sheared coordinates, whose sign is that of the normal against the line.
fn woop(line: Line, [a, b, c]: [Vec3A; 3]) -> Option<(f32, f32, f32)> {
    let (o, d) = (line.origin.to_array(), line.direction.to_array());
    let kz = (1..3).fold(0, |best, k| if d[k].abs() > d[best].abs() { k } else { best });
    let (kx, ky) = ((kz + 1) % 3, (kz + 2) % 3);
    let (sx, sy, sz) = (d[kx] / d[kz], d[ky] / d[kz], 1.0 / d[kz]);
    let sheared = |p: Vec3A| {
        let z = p[kz] - o[kz];
        [p[kx] - o[kx] - sx * z, p[ky] - o[ky] - sy * z, z]
    };
    let ([ax, ay, az], [bx, by, bz], [cx, cy, cz]) = (sheared(a), sheared(b), sheared(c));
    let (u, v, w) = (cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax);
    let det = u + v + w;
    let inside = u.min(v).min(w) >= 0.0 || u.max(v).max(w) <= 0.0;
    (inside && det != 0.0).then(|| (sz * (u * az + v * bz + w * cz) / det, det, d[kz]))
}

fn brute(bvh: &Bvh, mesh: &TriangleMesh, line: Line, criteria: HitCriteria) -> BothWays {
    let mut found = BothWays::NOTHING;
    for triangle in &mesh.triangles {
        let corners = triangle.map(|v| bvh.to_local(mesh.positions[v as usize].into()));
        let Some((t, det, along)) = woop(line, corners) else { continue };
        // A triangle whose normal goes with the line is back-facing: its corners run clockwise.
        let slant = if criteria.cosine > 0.0 { criteria.cosine * normal_length(corners) } else { 0.0 };
        if criteria.facing * along * det + slant > 0.0 {
            continue;
        }
        let t = if t.abs() <= criteria.tolerance { 0.0 } else { t };
        if (0.0..=criteria.reach).contains(&t) {
            found.ahead = found.ahead.min(t);
        }
        if (0.0..=criteria.reach).contains(&-t) {
            found.behind = found.behind.min(-t);
        }
    }
    found
}

/// Not one bit may differ: coherent and incoherent packets, directions along axes and through vertices, all of
/// `facing`.
#[test]
fn packets_agree_with_all_triangles_one_by_one() {
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    let far = DVec3::new(3e5, -1e5, 40.0);
    let meshes = [
        soup(&mut rng, 3, 10.0, 5.0, DVec3::ZERO),
        soup(&mut rng, 900, 10.0, 1.5, far),
        sphere(14, 19, 12.0, DVec3::ZERO),
        TriangleMesh::default(),
    ];
    let mut hits = 0;
    for mesh in &meshes {
        let bvh = Bvh::build(mesh).unwrap();
        for case in 0..700 {
            let count = rng.random_range(1..=PACKET);
            let (origin, direction) = (random_point(&mut rng, 12.0), random_point(&mut rng, 1.0));
            let spread = [0.0, 0.1, 1.0, 12.0][case % 4];
            let lines: Vec<Line> = (0..count)
                .map(|i| {
                    let origin = (origin + random_point(&mut rng, 1e-9 + spread)).as_vec3a();
                    let mut direction = (direction + random_point(&mut rng, 1e-9 + 0.1 * spread)).as_vec3a();
                    match (case + i) % 9 {
                        0 => direction = [Vec3A::X, Vec3A::NEG_Y, Vec3A::Z, -Vec3A::Z][i % 4],
                        1 => direction[i % 3] = 0.0,
                        2 if !mesh.positions.is_empty() => {
                            let vertex = mesh.positions[rng.random_range(0..mesh.positions.len())];
                            direction = bvh.to_local(vertex.into()) - origin;
                        }
                        _ => {}
                    }
                    Line { origin, direction }
                })
                .collect();
            let criteria = HitCriteria {
                reach: rng.random_range(0.5..20.0),
                tolerance: [0.0, bvh.tolerance(), 0.5][case % 3],
                facing: [0.0, 1.0, -1.0, 1.0][case / 3 % 4],
                cosine: [0.0, 0.0, 0.0, 0.7][case / 3 % 4],
            };
            let mut found = [BothWays::NOTHING; PACKET];
            bvh.cast_both_ways(&lines, criteria, &mut found);
            for (&line, found) in lines.iter().zip(found) {
                assert_eq!(found, brute(&bvh, mesh, line, criteria), "{line:?} {criteria:?}");
                hits += usize::from(found != BothWays::NOTHING);
                // Four lanes, which other processors take.
                let mut on_four_lanes = [BothWays::NOTHING];
                bvh.cast_groups::<4, 4>(&[line], Octant::of(line.direction), criteria, &mut on_four_lanes);
                assert_eq!(on_four_lanes, [found], "{line:?} {criteria:?}");
            }
        }
    }
    assert!(hits > 3000, "only {hits} lines hit anything");
}

/// A line through the inside of a closed mesh hits it ahead and behind, wherever it is aimed: at vertices, at the
/// middles of edges, along axes, anywhere.
#[test]
fn no_line_slips_through_edges_and_vertices() {
    let mut rng = ChaCha8Rng::seed_from_u64(32);
    for (rings, sectors, centre) in [(2, 3, 0.0), (13, 18, 0.0), (90, 120, 500.0)] {
        let centre = DVec3::new(centre, -centre, 0.5 * centre);
        let mesh = sphere(rings, sectors, 50.0, centre);
        let bvh = Bvh::build(&mesh).unwrap();
        let middle = bvh.to_local(centre);
        let criteria = HitCriteria { reach: 200.0, tolerance: bvh.tolerance(), facing: 0.0, cosine: 0.0 };
        for case in 0..15_000 {
            // Within the coarsest mesh's inscribed sphere.
            let away = if case % 3 == 0 { Vec3A::ZERO } else { random_point(&mut rng, 5.0).as_vec3a() };
            let origin = middle + away;
            let first = rng.random_range(0..mesh.triangles.len());
            let lines: [Line; PACKET] = std::array::from_fn(|i| {
                // Neighbouring triangles, mostly.
                let triangle = mesh.triangles[(first + i / 4) % mesh.triangles.len()];
                let [a, b] = [0, 1].map(|k| bvh.to_local(mesh.positions[triangle[(k + i) % 3] as usize].into()));
                let direction = match i % 4 {
                    0 => a - origin,
                    1 => a + (b - a) * 0.5 - origin,
                    2 => a + (b - a) * rng.random_range(0.0..1.0f32) - origin,
                    _ => [Vec3A::X, Vec3A::Y, Vec3A::Z][case % 3],
                };
                Line { origin, direction: direction.normalize() }
            });
            let mut found = [BothWays::NOTHING; PACKET];
            bvh.cast_both_ways(&lines, criteria, &mut found);
            for (line, found) in lines.iter().zip(found) {
                assert!(found.ahead < 60.0 && found.behind < 60.0, "{line:?}: {found:?}");
                assert!(found.ahead > 10.0 && found.behind > 10.0, "{line:?}: {found:?}");
            }
        }
    }
}
