mod packets;

use super::sweep::MAX_DEPTH;
use super::{Bvh, BvhError};
use crate::mesh::TriangleMesh;
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn mesh(positions: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> TriangleMesh {
    TriangleMesh { positions, triangles, ..TriangleMesh::default() }
}

pub(super) fn random_point(rng: &mut ChaCha8Rng, scale: f64) -> DVec3 {
    DVec3::from(std::array::from_fn::<f64, 3, _>(|_| rng.random_range(-scale..scale)))
}

/// Triangles of size `size` within a cube of half side `scale` around `centre`.
pub(super) fn soup(rng: &mut ChaCha8Rng, count: usize, scale: f64, size: f64, centre: DVec3) -> TriangleMesh {
    let mut positions = Vec::new();
    for _ in 0..count {
        let p = centre + random_point(rng, scale);
        positions.extend((0..3).map(|_| (p + random_point(rng, size)).to_array()));
    }
    mesh(positions, (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// A closed sphere of `rings` by `sectors` with poles.
pub(super) fn sphere(rings: u32, sectors: u32, radius: f64, centre: DVec3) -> TriangleMesh {
    let mut positions = vec![(centre + DVec3::Z * radius).to_array()];
    for i in 1..rings {
        let (sin, cos) = (std::f64::consts::PI * f64::from(i) / f64::from(rings)).sin_cos();
        for j in 0..sectors {
            let (y, x) = (std::f64::consts::TAU * f64::from(j) / f64::from(sectors)).sin_cos();
            positions.push((centre + DVec3::new(sin * x, sin * y, cos) * radius).to_array());
        }
    }
    let last = positions.len() as u32;
    positions.push((centre - DVec3::Z * radius).to_array());
    let at = |i: u32, j: u32| 1 + (i - 1) * sectors + j % sectors;
    let mut triangles = Vec::new();
    for j in 0..sectors {
        triangles.push([0, at(1, j), at(1, j + 1)]);
        triangles.push([last, at(rings - 1, j + 1), at(rings - 1, j)]);
        for i in 1..rings - 1 {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    mesh(positions, triangles)
}

fn corners(mesh: &TriangleMesh, triangle: usize) -> [DVec3; 3] {
    mesh.triangles[triangle].map(|v| DVec3::from(mesh.positions[v as usize]))
}

/// Möller and Trumbore's test in double precision, all triangles: t and how far inside the triangle the hit lies
/// (its least barycentric weight).
fn brute_hits(mesh: &TriangleMesh, origin: DVec3, direction: DVec3, max_t: f64) -> Vec<(f64, f64)> {
    (0..mesh.triangles.len())
        .filter_map(|i| {
            let [a, b, c] = corners(mesh, i);
            let (e1, e2) = (b - a, c - a);
            let p = direction.cross(e2);
            let det = e1.dot(p);
            let s = origin - a;
            let q = s.cross(e1);
            let (u, v, t) = (s.dot(p) / det, direction.dot(q) / det, e2.dot(q) / det);
            let inside = u.min(v).min(1.0 - u - v);
            (inside >= -1e-4 && (-1e-4..=max_t + 1e-4).contains(&t)).then_some((t, inside))
        })
        .collect()
}

/// A second formulation: by projection onto the plane, else onto the three segments.
fn brute_closest(mesh: &TriangleMesh, p: DVec3) -> f64 {
    let segment = |a: DVec3, b: DVec3| {
        let ab = b - a;
        let t = if ab.length_squared() > 0.0 { ((p - a).dot(ab) / ab.length_squared()).clamp(0.0, 1.0) } else { 0.0 };
        (a + ab * t - p).length()
    };
    (0..mesh.triangles.len())
        .map(|i| {
            let [a, b, c] = corners(mesh, i);
            let n = (b - a).cross(c - a);
            let edges = segment(a, b).min(segment(b, c)).min(segment(c, a));
            let inside = [(a, b), (b, c), (c, a)].iter().all(|&(a, b)| n.cross(b - a).dot(p - a) >= 0.0);
            if inside && n.length() > 0.0 { edges.min(((p - a).dot(n) / n.length()).abs()) } else { edges }
        })
        .fold(f64::INFINITY, f64::min)
}

#[test]
fn nearest_hits_agree_with_brute_force() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for (count, size, centre) in [(1, 5.0, 0.0), (7, 5.0, 0.0), (300, 3.0, 0.0), (300, 0.5, 1e6), (2000, 1.0, -4e5)] {
        let centre = DVec3::new(centre, -0.5 * centre, 0.1 * centre);
        let mesh = soup(&mut rng, count, 10.0, size, centre);
        let bvh = Bvh::build(&mesh).unwrap();
        for _ in 0..2000 {
            let (origin, direction) = (centre + random_point(&mut rng, 30.0), random_point(&mut rng, 3.0));
            let max_t = rng.random_range(0.1..30.0);
            let hit = bvh.nearest_hit(origin, direction, max_t);
            // Rounding to single precision moves corners by up to 2^-21 of 15 mm: decisions closer than 1e-4 are left.
            let brute = brute_hits(&mesh, origin, direction, max_t);
            let sure = brute
                .iter()
                .filter(|(t, inside)| *inside > 1e-4 && (1e-4..max_t - 1e-4).contains(t))
                .fold(f64::INFINITY, |m, (t, _)| m.min(*t));
            match hit {
                Some(hit) => {
                    assert!(hit.t <= sure + 1e-4);
                    assert!(brute.iter().any(|(t, _)| (t - hit.t).abs() < 1e-4), "{hit:?} is no hit");
                    // The triangle is the one that is hit: the more it is seen edge-on, the less t says of the place.
                    let own = TriangleMesh { triangles: vec![mesh.triangles[hit.triangle as usize]], ..mesh.clone() };
                    let [a, b, c] = corners(&own, 0);
                    let longest = [b - a, c - b, a - c].map(DVec3::length_squared).into_iter().fold(0.0, f64::max);
                    let condition = (b - a).cross(c - a).dot(direction.normalize()).abs() / longest;
                    assert!(brute_closest(&own, origin + direction * hit.t) * condition < 4e-5);
                }
                None => assert!(sure.is_infinite()),
            }
        }
    }
}

#[test]
fn closest_points_agree_with_brute_force() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for (count, size, centre) in [(1, 5.0, 0.0), (5, 0.0, 0.0), (300, 3.0, 0.0), (1000, 0.5, 1e6)] {
        let centre = DVec3::splat(centre);
        let mesh = soup(&mut rng, count, 10.0, f64::max(size, 1e-300), centre);
        let bvh = Bvh::build(&mesh).unwrap();
        for _ in 0..1000 {
            let p = centre + random_point(&mut rng, 25.0);
            let expected = brute_closest(&mesh, p);
            let found = bvh.closest_point(p, f64::INFINITY).unwrap();
            // Corners are rounded by at most 2^-24 of 15 mm.
            assert!((found.distance - expected).abs() < 2e-6, "{found:?}, expected {expected}");
            let [a, b, c] = corners(&mesh, found.triangle as usize);
            let point = a * found.weights[0] + b * found.weights[1] + c * found.weights[2];
            assert!((point - found.point).length() < 3e-6);
            assert!(found.weights.iter().all(|w| (-1e-12..=1.0 + 1e-12).contains(w)));
            assert!(bvh.closest_point(p, expected - 1e-5).is_none());
            assert!(bvh.closest_point(p, expected + 1e-5).is_some());
        }
    }
}

/// From inside a closed mesh every ray must hit, wherever it is aimed.
#[test]
fn no_ray_slips_through_edges_and_vertices() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for (rings, sectors, centre) in [(2, 3, 0.0), (12, 17, 0.0), (60, 80, 300.0)] {
        let centre = DVec3::new(centre, 2.0 * centre, -centre);
        let mesh = sphere(rings, sectors, 50.0, centre);
        let bvh = Bvh::build(&mesh).unwrap();
        let local = |p: DVec3| bvh.to_local(p).as_dvec3() + bvh.centre;
        for case in 0..100_000 {
            // Within the coarsest mesh's inscribed sphere.
            let origin = if case % 4 == 0 { centre } else { centre + random_point(&mut rng, 5.0) };
            let origin = local(origin);
            let triangle = mesh.triangles[rng.random_range(0..mesh.triangles.len())];
            let [a, b] = [0, 1].map(|i| local(mesh.positions[triangle[i] as usize].into()));
            let s = match case % 3 {
                0 => 0.0,
                1 => 0.5,
                _ => rng.random_range(0.0..1.0),
            };
            let direction = if case % 7 == 0 {
                [DVec3::X, DVec3::Y, DVec3::Z][case % 3] * if case % 2 == 0 { 1.0 } else { -1.0 }
            } else {
                a + (b - a) * s - origin
            };
            let hit = bvh.nearest_hit(origin, direction, 1e3);
            assert!(hit.is_some(), "from {origin} along {direction}");
        }
    }
}

/// Axis-parallel rays over a flat grid: boxes without thickness, ray origins and corners in the same planes.
#[test]
fn axis_parallel_grids_do_not_leak() {
    let n = 40u32;
    let positions = (0..=n).flat_map(|i| (0..=n).map(move |j| [f64::from(i), f64::from(j), 0.0])).collect();
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let cells = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let triangles = cells
        .flat_map(|(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]])
        .collect();
    let bvh = Bvh::build(&mesh(positions, triangles)).unwrap();
    for i in 0..=8 * n {
        for j in 0..=8 * n {
            let (x, y) = (f64::from(i) / 8.0, f64::from(j) / 8.0);
            for (z, down) in [(5.0, -1.0), (-5.0, 1.0), (0.0, 1.0)] {
                let hit = bvh.nearest_hit([x, y, z].into(), [0.0, 0.0, down].into(), 10.0).expect("the grid is hit");
                assert!((hit.t - z.abs()).abs() < 1e-5);
            }
        }
    }
    assert!(
        bvh.nearest_hit([3.0, 3.5, 0.0].into(), [1.0, 0.0, 0.0].into(), 10.0).is_none(),
        "edge-on triangles are not hit"
    );
    assert!(bvh.nearest_hit([3.0, 3.5, 5.0].into(), [0.0, 0.0, -1.0].into(), 4.999).is_none());
}

#[test]
fn meshes_without_surface() {
    let bvh = Bvh::build(&TriangleMesh::default()).unwrap();
    assert!(bvh.nearest_hit([0.0; 3].into(), [1.0, 0.0, 0.0].into(), 1.0).is_none());
    assert!(bvh.closest_point([0.0; 3].into(), f64::INFINITY).is_none());

    let line = mesh(vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], vec![[0, 1, 2], [0, 0, 0], [1, 1, 2]]);
    let bvh = Bvh::build(&line).unwrap();
    assert!(bvh.nearest_hit([0.5, 0.0, 1.0].into(), [0.0, 0.0, -1.0].into(), 5.0).is_none());
    let closest = bvh.closest_point([0.5, 3.0, 0.0].into(), 5.0).unwrap();
    assert!((closest.distance - 3.0).abs() < 1e-6);
    assert!((bvh.closest_point([5.0, 0.0, 0.0].into(), 5.0).unwrap().distance - 3.0).abs() < 1e-6);
}

#[test]
fn odd_rays_and_meshes_are_refused() {
    let triangle = mesh(vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
    let bvh = Bvh::build(&triangle).unwrap();
    let inside = DVec3::new(0.2, 0.2, 1.0);
    assert!((bvh.nearest_hit(inside, [0.0, 0.0, -2.0].into(), 1.0).unwrap().t - 0.5).abs() < 1e-6);
    assert!(
        (bvh.nearest_hit([0.2, 0.2, 1e9].into(), [0.0, 0.0, -1.0].into(), f64::INFINITY).unwrap().t - 1e9).abs() < 1e-6
    );
    assert!(bvh.nearest_hit(inside, [0.0, 0.0, -1e-300].into(), f64::INFINITY).is_some());
    assert!(bvh.nearest_hit(inside, [0.0; 3].into(), 1.0).is_none());
    assert!(bvh.nearest_hit(inside, [0.0, 0.0, f64::NAN].into(), 1.0).is_none());
    assert!(bvh.nearest_hit([f64::INFINITY, 0.0, 0.0].into(), [0.0, 0.0, 1.0].into(), 1.0).is_none());
    assert!(bvh.nearest_hit(inside, [0.0, 0.0, -1.0].into(), f64::NAN).is_none());
    assert!(bvh.nearest_hit(inside, [0.0, 0.0, -1.0].into(), -1.0).is_none());
    assert!(bvh.closest_point([f64::NAN; 3].into(), 1.0).is_none());

    let build = |positions, triangle| Bvh::build(&mesh(positions, vec![triangle])).err();
    let origin = [0.0; 3];
    assert_eq!(build(vec![origin; 2], [0, 1, 2]), Some(BvhError::BadIndex { triangle: 0, vertex: 2, vertices: 2 }));
    assert_eq!(build(vec![origin, origin, [f64::NAN; 3]], [0, 1, 2]), Some(BvhError::BadPosition { triangle: 0 }));
    let wide = build(vec![origin, origin, [1e300; 3]], [0, 1, 2]);
    assert!(matches!(wide, Some(BvhError::TooWide { triangle: 1, .. })), "{wide:?}");
    let wide = build(vec![[-1.7e308; 3], origin, [1.7e308; 3]], [0, 1, 2]);
    assert!(matches!(wide, Some(BvhError::TooWide { triangle: 1, .. })), "{wide:?}");
    assert!(build(vec![origin, origin, origin, [f64::NAN; 3]], [0, 1, 2]).is_none(), "unused vertices play no role");
}

/// Every leaf has one to four triangles, every triangle is in one leaf, boxes contain what is below them; the depth.
fn check_tree(bvh: &Bvh) -> usize {
    let mut seen = vec![false; bvh.triangle_count()];
    let mut deepest = 0;
    let mut pending = vec![(0usize, 0usize)];
    while let Some((i, depth)) = pending.pop() {
        let node = &bvh.tree.nodes[i];
        deepest = deepest.max(depth);
        let first = node.first_index as usize;
        if node.is_leaf() {
            let count = node.prim_count as usize;
            assert!((1..=4).contains(&count) && first.is_multiple_of(4));
            for lane in 0..count {
                let triangle = bvh.tree.primitive_indices[first + lane] as usize;
                assert!(!std::mem::replace(&mut seen[triangle], true));
                assert!(bvh.blocks[first / 4].triangle(lane).iter().all(|&c| node.aabb().contains_point(c)));
            }
        } else {
            for child in [first, first + 1] {
                let inner = bvh.tree.nodes[child].aabb();
                assert!(node.aabb().contains_point(inner.min) && node.aabb().contains_point(inner.max));
                pending.push((child, depth + 1));
            }
        }
    }
    assert!(seen.iter().all(|&s| s));
    deepest
}

#[test]
fn trees_are_sound_and_their_depth_is_bounded() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    assert!(check_tree(&Bvh::build(&soup(&mut rng, 20_000, 10.0, 0.1, DVec3::ZERO)).unwrap()) < 32);
    // Sizes and places in geometric progression: the best split cuts off one triangle at a time.
    let positions = (0..3000)
        .flat_map(|i| {
            let s = 1.02f64.powi(-(i % 1400)) * 1e6;
            [[s, 0.0, 0.0], [s, s, 0.0], [s, 0.0, s]]
        })
        .collect();
    let triangles = (0..3000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    assert!(check_tree(&Bvh::build(&mesh(positions, triangles)).unwrap()) <= MAX_DEPTH);
}

#[test]
fn a_million_identical_triangles() {
    let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let bvh = Bvh::build(&mesh(corners, vec![[0, 1, 2]; 1_000_000])).unwrap();
    assert!(check_tree(&bvh) <= 20);
    assert!((bvh.nearest_hit([0.2, 0.2, 1.0].into(), [0.0, 0.0, -1.0].into(), 2.0).unwrap().t - 1.0).abs() < 1e-6);
    assert!(bvh.nearest_hit([2.0, 2.0, 1.0].into(), [0.0, 0.0, -1.0].into(), 2.0).is_none());
}

#[test]
fn the_tree_does_not_depend_on_the_number_of_threads() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mesh = soup(&mut rng, 30_000, 10.0, 0.2, DVec3::ZERO);
    let build = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let bvh = pool.install(|| Bvh::build(&mesh)).unwrap();
        let nodes: Vec<_> = bvh.tree.nodes.iter().map(|n| (n.min, n.max, n.prim_count, n.first_index)).collect();
        (nodes, bvh.tree.primitive_indices.clone())
    };
    assert!(build(1) == build(3));
}

/// Sizes that no scan has, but a file may.
#[test]
fn tiny_and_huge_meshes() {
    for scale in [1e-9, 1e-3, 1e5, 9e8] {
        let shape = sphere(12, 17, scale, DVec3::ZERO);
        let bvh = Bvh::build(&shape).unwrap();
        let t = bvh.nearest_hit([0.0, 0.0, 1.5 * scale].into(), [0.0, 0.0, -1.0].into(), 10.0 * scale).unwrap().t;
        assert!((t / scale - 0.5).abs() < 1e-5);
        for far in [1.5, 1e6] {
            let closest = bvh.closest_point([0.0, 0.0, far * scale].into(), f64::INFINITY).unwrap();
            assert!((closest.distance / scale - (far - 1.0)).abs() < 1e-5 * far);
        }
    }
}

/// The scan that later stages are measured on, or none where the tests have no data.
fn cup_scan() -> Option<TriangleMesh> {
    let Some(folder) = std::env::var_os("GMLC_TEST_DATA") else {
        println!("skipped: GMLC_TEST_DATA is not set");
        return None;
    };
    let path = std::path::Path::new(&folder).join("cup/cup_scan.ply");
    Some(crate::scan::read(&path, &crate::scan::Unit::Mm.into(), &crate::progress::Silent).unwrap().mesh)
}

#[test]
fn a_real_scan_agrees_with_brute_force() {
    let Some(scan) = cup_scan() else { return };
    let bvh = Bvh::build(&scan).unwrap();
    assert!(check_tree(&bvh) < 40);
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    for _ in 0..100 {
        let target = DVec3::from(scan.positions[rng.random_range(0..scan.positions.len())]);
        let direction = random_point(&mut rng, 1.0).normalize();
        let origin = target - direction * rng.random_range(1.0..50.0) + random_point(&mut rng, 0.3);
        let sure = brute_hits(&scan, origin, direction, 100.0).into_iter().filter(|(_, inside)| *inside > 1e-3);
        let sure = sure.filter(|(t, _)| *t > 0.0).fold(f64::INFINITY, |m, (t, _)| m.min(t));
        let found = bvh.nearest_hit(origin, direction, 100.0).map_or(f64::INFINITY, |h| h.t);
        assert!(found <= sure + 1e-4);
        if found < sure - 1e-4 {
            let brute = brute_hits(&scan, origin, direction, 100.0);
            assert!(brute.iter().any(|(t, _)| (t - found).abs() < 1e-4));
        }
        let closest = bvh.closest_point(origin, f64::INFINITY).unwrap().distance;
        assert!((closest - brute_closest(&scan, origin)).abs() < 1e-5);
    }
}
