use super::gpu::{Gpu, GpuError};
use super::{Cast, CastError, Device, Facing, Rays, cast as cast_rays, closest, cpu};
use crate::bvh::Bvh;
use crate::mesh::TriangleMesh;
use crate::model::Texels;
use crate::variance::Deviations;
use glam::{DQuat, DVec3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};

/// Texels at the given points with the given normals.
fn texels(points: &[(DVec3, DVec3)]) -> Texels {
    let n = points.len();
    Texels {
        width: n as u32,
        height: 1,
        index: (0..n as u32).collect(),
        part: vec![0; n],
        position: points.iter().map(|(p, _)| p.to_array()).collect(),
        normal: points.iter().map(|(_, n)| n.as_vec3().to_array()).collect(),
        area: vec![1.0; n],
        side: vec![1.0; n],
        part_names: vec!["body".to_owned()],
    }
}

/// Directions of a grid over the sphere, without its poles.
fn directions(rings: u32, sectors: u32) -> Vec<DVec3> {
    let direction = |i: u32, j: u32| {
        let (sin, cos) = (PI * f64::from(i + 1) / f64::from(rings + 1)).sin_cos();
        let (y, x) = (TAU * f64::from(j) / f64::from(sectors)).sin_cos();
        DVec3::new(sin * x, sin * y, cos)
    };
    (0..rings).flat_map(|i| (0..sectors).map(move |j| direction(i, j))).collect()
}

/// A surface over `directions`, open at the poles; `radius` by direction; cells for which `keep` fails are holes.
fn star(
    rings: u32,
    sectors: u32,
    centre: DVec3,
    radius: impl Fn(DVec3) -> f64,
    mut keep: impl FnMut(u32, u32) -> bool,
) -> TriangleMesh {
    let positions = directions(rings, sectors).into_iter().map(|d| (centre + d * radius(d)).to_array()).collect();
    let at = |i: u32, j: u32| i * sectors + j % sectors;
    let mut triangles = Vec::new();
    for i in 0..rings - 1 {
        for j in 0..sectors {
            if keep(i, j) {
                triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    TriangleMesh { positions, triangles, ..TriangleMesh::default() }
}

fn cast(points: &[(DVec3, DVec3)], scan: &TriangleMesh, max_distance: f64, device: Device) -> Cast {
    cast_rays(texels(points), &Bvh::build(scan).unwrap(), max_distance, Facing::Any, device).unwrap()
}

/// Every ray goes through a vertex of the scan; far from the origin of coordinates.
#[test]
fn a_sphere_and_a_larger_one_differ_by_a_constant() {
    let centre = DVec3::new(4e5, -1e6, 300.0);
    // Without the first and the last ring, which are the scan's open ends.
    let inner = directions(50, 60)[60..49 * 60].to_vec();
    let points: Vec<_> = inner.into_iter().map(|d| (centre + d * 40.0, d)).collect();
    for offset in [1.25, -0.75, 0.0] {
        let scan = star(50, 60, centre, |_| 40.0 + offset, |_, _| true);
        let Cast { deviations, device, notice } = cast(&points, &scan, 2.0, Device::Cpu);
        assert_eq!((device.as_str(), notice), ("cpu", None));
        for i in 0..points.len() {
            // Positions of 1e6 mm have steps of 1e-10 mm; single precision within the scan of 4e-6.
            assert!((f64::from(deviations.signed(i)) - offset).abs() < 2e-5);
            assert_eq!(deviations.outward[i].is_nan(), offset < 0.0);
            assert_eq!(deviations.inward[i].is_nan(), offset > 0.0);
            if offset == 0.0 {
                assert!(deviations.outward[i] < 2e-5 && deviations.inward[i] < 2e-5);
            }
        }
    }
}

#[test]
fn a_tilted_plane_lies_at_its_equation() {
    let corners = [[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]];
    let height = |x: f64, y: f64| 0.3 * x - 0.1 * y + 0.05;
    let positions = corners.iter().map(|&[x, y]| [x, y, height(x, y)]).collect();
    let scan = TriangleMesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..TriangleMesh::default() };
    let points: Vec<_> = (0..2500)
        .map(|i| (DVec3::new(f64::from(i % 50) * 0.1 - 2.45, f64::from(i / 50) * 0.1 - 2.45, 0.0), DVec3::Z))
        .collect();
    let found = cast(&points, &scan, 0.8, Device::Cpu).deviations;
    let mut missing = 0;
    for (i, (p, _)) in points.iter().enumerate() {
        let expected = height(p.x, p.y);
        if (expected.abs() - 0.8).abs() < 1e-6 {
            continue;
        }
        if expected.abs() < 0.8 {
            assert!((f64::from(found.signed(i)) - expected).abs() < 1e-6);
        } else {
            assert!(found.signed(i).is_nan());
            missing += 1;
        }
    }
    assert!(missing > 0);
}

#[test]
fn texels_that_make_no_sense_have_no_data() {
    let scan = star(10, 10, DVec3::ZERO, |_| 10.0, |_, _| true);
    let points = [
        (DVec3::NAN, DVec3::X),
        (DVec3::new(f64::INFINITY, 0.0, 0.0), DVec3::X),
        (DVec3::X * 1e30, DVec3::X),
        (DVec3::X * 9.5, DVec3::ZERO),
        (DVec3::X * 9.5, DVec3::NAN),
        (DVec3::X * 9.0, DVec3::X),
    ];
    let found = cast(&points, &scan, 2.0, Device::Cpu).deviations;
    assert!((0..5).all(|i| found.signed(i).is_nan()));
    assert!(!found.signed(5).is_nan());
    let nothing = cast(&points, &TriangleMesh::default(), 2.0, Device::Cpu).deviations;
    assert!((0..6).all(|i| nothing.signed(i).is_nan()));
}

#[test]
fn the_maximum_distance_must_be_positive() {
    let scan = Bvh::build(&TriangleMesh::default()).unwrap();
    for max_distance in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-60] {
        let result = cast_rays(Texels::default(), &scan, max_distance, Facing::SAME, Device::Cpu);
        assert!(matches!(result, Err(CastError::MaxDistance(_))));
    }
}

#[test]
fn distances_do_not_depend_on_the_number_of_threads() {
    let (points, scan) = rough_scene(5000);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let Deviations { outward, inward, .. } = pool.install(|| cast(&points, &scan, 3.0, Device::Cpu)).deviations;
        [outward, inward].map(|d| d.into_iter().map(f32::to_bits).collect::<Vec<_>>())
    };
    assert!(run(1) == run(3));
}

/// Random texels on a sphere and a rough scan of it with noise and holes.
fn rough_scene(count: usize) -> (Vec<(DVec3, DVec3)>, TriangleMesh) {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let centre = DVec3::new(100.0, -250.0, 1000.0);
    let points = (0..count)
        .map(|_| {
            let d = DVec3::from(std::array::from_fn::<f64, 3, _>(|_| rng.random_range(-1.0..1.0))).normalize();
            (centre + d * 50.0, d)
        })
        .collect();
    let wave = |d: DVec3| (7.0 * d.x).sin() * (5.0 * d.y).cos() * (6.0 * d.z).sin();
    let mut noise = ChaCha8Rng::seed_from_u64(8);
    let mut scan = star(150, 220, centre, |d| 50.0 + 2.5 * wave(d), |i, j| (i * 31 + j * 17) % 97 != 0);
    for p in &mut scan.positions {
        p.iter_mut().for_each(|x| *x += noise.random_range(-0.1..0.1));
    }
    (points, scan)
}

/// Says so where there is no Vulkan device at all, and fails if the environment insists on one.
pub(in crate::variance) fn gpu() -> Option<Gpu> {
    match Gpu::open(true) {
        Ok(gpu) => Some(gpu),
        Err(GpuError::NoAdapter) if std::env::var_os("GMLC_REQUIRE_GPU").is_none_or(|v| v != "1") => {
            println!("skipped: there is no Vulkan device (GMLC_REQUIRE_GPU=1 makes this a failure)");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// Texels at which two arrays of distances differ by more than 1e-4 of the maximum distance.
fn disagreements(a: &[f32], b: &[f32], max_distance: f32) -> usize {
    let differ = |(a, b): (&f32, &f32)| a.is_nan() != b.is_nan() || (a - b).abs() > 1e-4 * max_distance;
    a.iter().zip(b).filter(|&pair| differ(pair)).count()
}

#[test]
fn the_shader_agrees_with_native_code() {
    let Some(gpu) = gpu() else { return };
    let (mut points, scan) = rough_scene(200_000);
    points[17].0 = DVec3::NAN;
    let (texels, scan) = (texels(&points), Bvh::build(&scan).unwrap());
    let rays = Rays::new(&texels, &scan, 2.0, Facing::SAME).unwrap();
    let native = cpu::cast(&rays);
    let shader = gpu.cast(&rays).unwrap();
    let missing = native.outward.iter().filter(|d| d.is_nan()).count();
    assert!((50_000..150_000).contains(&missing), "the scene has hits and misses, {missing} misses");
    let differing =
        disagreements(&native.outward, &shader.outward, 2.0).max(disagreements(&native.inward, &shader.inward, 2.0));
    println!("{}: {differing} of {} texels differ", gpu.name(), points.len());
    assert!(differing <= points.len() / 100_000);
}

/// The paper's cup, from points of its own surface displaced by up to 2 mm, many of them near its holes.
#[test]
fn the_shader_agrees_on_a_real_scan() {
    let Some(folder) = std::env::var_os("GMLC_TEST_DATA") else {
        println!("skipped: GMLC_TEST_DATA is not set");
        return;
    };
    let Some(gpu) = gpu() else { return };
    let path = std::path::Path::new(&folder).join("cup/cup_scan.ply");
    let mesh = crate::scan::read(&path, &crate::scan::Unit::Mm.into(), &crate::progress::Silent).unwrap().mesh;
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let points: Vec<_> = (0..100_000)
        .map(|_| {
            let triangle = mesh.triangles[rng.random_range(0..mesh.triangles.len())];
            let [a, b, c] = triangle.map(|v| DVec3::from(mesh.positions[v as usize]));
            let (u, v): (f64, f64) = (rng.random_range(0.0..1.0), rng.random_range(0.0..0.5));
            let normal = DVec3::from(mesh.normals[triangle[0] as usize]);
            (a + (b - a) * u + (c - a) * v + normal * rng.random_range(-2.0..2.0), normal)
        })
        .collect();
    let (texels, scan) = (texels(&points), Bvh::build(&mesh).unwrap());
    let rays = Rays::new(&texels, &scan, 3.0, Facing::SAME).unwrap();
    let (native, shader) = (cpu::cast(&rays), gpu.cast(&rays).unwrap());
    let differing =
        disagreements(&native.outward, &shader.outward, 3.0).max(disagreements(&native.inward, &shader.inward, 3.0));
    println!("{}: {differing} of {} texels differ", gpu.name(), points.len());
    assert!(differing <= 1);
}

/// The scan cut into several bindings, none of which holds more than 64 KiB, on the CPU, in one binding and in several.
#[test]
fn a_scan_that_no_binding_holds_is_cut() {
    let Some(gpu) = gpu() else { return };
    let (points, scan) = rough_scene(2000);
    let (texels, scan) = (texels(&points), Bvh::build(&scan).unwrap());
    let (nodes, blocks) = scan.parts();
    let limit = (size_of_val(nodes).max(size_of_val(blocks)) / 3 + 1000) as u64;
    let rays = Rays::new(&texels, &scan, 2.0, Facing::SAME).unwrap();
    let whole = gpu.cast(&rays).unwrap();
    let gpu = gpu.with_limit(limit);
    let cut = gpu.cast(&rays).unwrap();
    let bits = |d: &[f32]| d.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!((bits(&cut.outward), bits(&cut.inward)), (bits(&whole.outward), bits(&whole.inward)));
    let native = cpu::cast(&rays);
    assert!(disagreements(&native.outward, &cut.outward, 2.0) <= 1);
    assert!(native.outward.iter().filter(|d| !d.is_nan()).count() > 500);
    // So small that the device has not as many bindings.
    let error = gpu.with_limit(64).cast(&rays).err();
    assert!(matches!(error, Some(GpuError::TooLarge { .. })), "{error:?}");
}

/// Rays through vertices and edges, one triangle, nothing: the shader's corner cases.
#[test]
fn the_shader_is_watertight_and_copes_with_small_scans() {
    let Some(gpu) = gpu() else { return };
    let scans = [
        star(50, 60, DVec3::ZERO, |_| 41.0, |_, _| true),
        star(2, 3, DVec3::ZERO, |_| 41.0, |_, j| j == 0),
        star(2, 3, DVec3::ZERO, |_| 41.0, |_, _| false),
    ];
    let points: Vec<_> = directions(50, 60).into_iter().map(|d| (d * 40.0, d)).collect();
    let inner = 60..49 * 60;
    for (n, scan) in scans.iter().enumerate() {
        let (texels, scan) = (texels(&points), Bvh::build(scan).unwrap());
        let rays = Rays::new(&texels, &scan, 30.0, Facing::Any).unwrap();
        let native = cpu::cast(&rays);
        let shader = gpu.cast(&rays).unwrap();
        assert!(n != 0 || shader.outward[inner.clone()].iter().all(|d| (d - 1.0).abs() < 1e-4));
        // The rays of a regular grid may run exactly along open edges, where rounding decides.
        assert!(disagreements(&native.outward, &shader.outward, 30.0) <= 1);
        assert!(disagreements(&native.inward, &shader.inward, 30.0) <= 1);
    }
}

/// A wall 2 mm thick that is bulged inwards by 5 mm on its inner side: the inner side's texels must see the bulge, and
/// not the back of the outer side, which is nearer.
#[test]
fn the_other_side_of_a_thin_wall_is_not_measured() {
    let mut wall = star(50, 60, DVec3::ZERO, |_| 40.0, |_, _| true);
    let inner = star(50, 60, DVec3::ZERO, |_| 33.0, |_, _| true);
    let first = wall.positions.len() as u32;
    wall.positions.extend(inner.positions);
    wall.triangles.extend(inner.triangles.iter().map(|t| [t[0] + first, t[2] + first, t[1] + first]));
    let points: Vec<_> = directions(50, 60)[60..49 * 60].iter().map(|&d| (d * 38.0, -d)).collect();
    let scan = Bvh::build(&wall).unwrap();
    let same = cast_rays(texels(&points), &scan, 20.0, Facing::SAME, Device::Cpu).unwrap().deviations;
    // Chords of 60 segments lie up to 40 (1 - cos 3 deg) = 0.06 mm below the sphere.
    assert!((0..points.len()).all(|i| (same.signed(i) - 5.0).abs() < 0.1), "{:?}", &same.outward[..5]);
    let any = cast_rays(texels(&points), &scan, 20.0, Facing::Any, Device::Cpu).unwrap().deviations;
    assert!((0..points.len()).all(|i| (any.signed(i) + 2.0).abs() < 0.1), "{:?}", &any.inward[..5]);
}

/// Texels are cast in squares of a picture; what they find does not depend on which others are there. Rows of all
/// lengths, gaps, a width that squares do not divide.
#[test]
fn a_texel_finds_the_same_in_any_picture() {
    let (points, scan) = rough_scene(1500);
    let scan = Bvh::build(&scan).unwrap();
    let in_a_row = cast_rays(texels(&points), &scan, 2.0, Facing::Any, Device::Cpu).unwrap().deviations;
    assert!((200..1300).contains(&in_a_row.outward.iter().filter(|d| d.is_nan()).count()));
    let mut rng = ChaCha8Rng::seed_from_u64(14);
    for width in [1, 37, 1024] {
        let mut picture = texels(&points);
        let mut next = 0;
        for index in &mut picture.index {
            next += if rng.random_bool(0.9) { 1 } else { rng.random_range(1..3 * width) };
            *index = next;
        }
        (picture.width, picture.height) = (width, next / width + 1);
        let found = cast_rays(picture, &scan, 2.0, Facing::Any, Device::Cpu).unwrap().deviations;
        let bits = |d: &[f32]| d.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&found.outward), bits(&in_a_row.outward));
        assert_eq!(bits(&found.inward), bits(&in_a_row.inward));
    }
}

/// Planes at some angle to the texels' normals, turned about different axes and facing either way; they pass 1 mm
/// above.
#[test]
fn triangles_count_up_to_the_largest_angle() {
    let gpu = gpu();
    for turn in [0.1f64, 0.8, 2.0, 4.4] {
        let normal = DVec3::new(0.3, -0.5, 0.8).normalize();
        let (side, up) = normal.any_orthonormal_pair();
        let axis = side * turn.cos() + up * turn.sin();
        for (degrees, turned) in [(0.0, false), (30.0, false), (50.0, false), (50.0, true), (85.0, false)] {
            let across = DQuat::from_axis_angle(axis, f64::to_radians(degrees)) * normal;
            let (a, b) = across.any_orthonormal_pair();
            let corners =
                [a * 50.0 - b * 40.0, b * 60.0 - a * 10.0, -a * 50.0 - b * 30.0].map(|c| (c + normal).to_array());
            let counter = (DVec3::from(corners[1]) - DVec3::from(corners[0]))
                .cross(DVec3::from(corners[2]) - DVec3::from(corners[0]))
                .dot(across);
            let triangle = if (counter > 0.0) == turned { [0, 2, 1] } else { [0, 1, 2] };
            let mesh =
                TriangleMesh { positions: corners.to_vec(), triangles: vec![triangle], ..TriangleMesh::default() };
            let (texels, scan) = (texels(&[(DVec3::ZERO, normal)]), Bvh::build(&mesh).unwrap());
            for limit in [20.0, 45.0, 55.0, 90.0] {
                let facing = Facing::Within(f64::to_radians(limit));
                let rays = Rays::new(&texels, &scan, 2.0, facing).unwrap();
                let expected = if !turned && degrees <= limit { 1.0 } else { f32::NAN };
                // Single precision, seen under five degrees from fifty millimetres off.
                let agrees = |found: f32| found.is_nan() && expected.is_nan() || (found - expected).abs() < 1e-4;
                let native = cpu::cast(&rays).outward[0];
                assert!(agrees(native), "{degrees} degrees, at most {limit}: {native}");
                if let Some(gpu) = &gpu {
                    let shader = gpu.cast(&rays).unwrap().outward[0];
                    assert!(agrees(shader), "{degrees} degrees, at most {limit}: {shader} by the shader");
                }
                let nearest = closest(texels.clone(), &scan, &mesh, 2.0, facing).unwrap().deviations.outward[0];
                let expected = expected * f64::to_radians(degrees).cos() as f32;
                assert!(nearest.is_nan() && expected.is_nan() || (nearest - expected).abs() < 1e-5, "{nearest}");
            }
        }
    }
}

/// A slope of 40 degrees passes 0.3 mm below the texel; the level plate at its foot is further away. Where the slope is
/// too steep there is no data, and not the distance to the plate, as wide as that is off to the side. On the edge
/// between slope and plate either is the closest surface.
#[test]
fn closest_points_do_not_slide_off_a_steep_slope() {
    let (sin, cos) = f64::to_radians(40.0).sin_cos();
    let foot = |y: f64| [0.0, y, 0.0];
    let top = |y: f64| [-20.0 * cos, y, 20.0 * sin];
    let end = |y: f64| [20.0, y, 0.0];
    let positions = vec![foot(-20.0), foot(20.0), top(-20.0), top(20.0), end(-20.0), end(20.0)];
    for triangles in
        [vec![[2, 0, 1], [2, 1, 3], [0, 4, 5], [0, 5, 1]], vec![[0, 4, 5], [0, 5, 1], [2, 0, 1], [2, 1, 3]]]
    {
        let mesh = TriangleMesh { positions: positions.clone(), triangles, ..TriangleMesh::default() };
        let scan = Bvh::build(&mesh).unwrap();
        let above_the_slope = DVec3::new(-0.6 * cos, 0.0, 0.6 * sin) + 0.3 * DVec3::new(sin, 0.0, cos);
        // Below the concave edge, from where the edge is the closest point.
        let below_the_edge = DVec3::new(-0.1, 0.0, -0.3);
        let above_the_plate = DVec3::new(2.0, 0.0, 0.3);
        let points = [above_the_slope, below_the_edge, above_the_plate].map(|p| (p, DVec3::Z));
        for (limit, expected) in [(20.0, f32::NAN), (45.0, -0.3), (90.0, -0.3)] {
            let facing = Facing::Within(f64::to_radians(limit));
            let found = closest(texels(&points), &scan, &mesh, 2.0, facing).unwrap().deviations;
            let slope = found.signed(0);
            assert!(slope.is_nan() && expected.is_nan() || (slope - expected).abs() < 1e-5, "{limit}: {slope}");
            assert!((found.signed(1) - 0.1f32.hypot(0.3)).abs() < 1e-5, "{limit}: {}", found.signed(1));
            assert!((found.signed(2) + 0.3).abs() < 1e-5, "{limit}: {}", found.signed(2));
        }
    }
}

/// Over a plate with a hole, from above and from below, straight and beside it.
#[test]
fn closest_points_do_not_leak_from_free_edges() {
    let row = |y: f64| [-10.0, -2.0, 2.0, 10.0].map(|x| [x, y, 0.0]);
    let positions: Vec<[f64; 3]> = [-10.0, -2.0, 2.0, 10.0].into_iter().flat_map(row).collect();
    let cells = (0..9u32).filter(|c| *c != 4).map(|c| c / 3 * 4 + c % 3);
    let triangles = cells.flat_map(|a| [[a, a + 1, a + 5], [a, a + 5, a + 4]]).collect();
    let mesh = TriangleMesh { positions, triangles, ..TriangleMesh::default() };
    let scan = Bvh::build(&mesh).unwrap();
    let up = DVec3::Z;
    let points = [
        // Above, below, aslant above the plate; above an inner vertex's corner and a free edge, straight.
        (DVec3::new(5.0, 5.0, -0.5), up),
        (DVec3::new(5.0, 5.0, 0.25), up),
        (DVec3::new(-6.0, 1.0, -0.5), DVec3::new(0.6, 0.0, 0.8)),
        (DVec3::new(2.0, 2.0, -0.5), up),
        (DVec3::new(2.0, 0.5, -0.5), up),
        // Above the hole, and beside the plate.
        (DVec3::new(1.5, 0.0, -0.5), up),
        (DVec3::new(10.5, 0.0, -0.5), up),
        (DVec3::new(-10.5, -10.5, 0.0), up),
    ];
    let found = closest(texels(&points), &scan, &mesh, 1.0, Facing::SAME).unwrap().deviations;
    let signed: Vec<f32> = (0..points.len()).map(|i| found.signed(i)).collect();
    let expected = [0.5, -0.25, 0.5, 0.5, 0.5, f32::NAN, f32::NAN, f32::NAN];
    for (k, (found, expected)) in signed.iter().zip(expected).enumerate() {
        assert!(found.is_nan() && expected.is_nan() || (found - expected).abs() < 1e-6, "{k}: {found}, not {expected}");
    }
}

/// A sphere scanned from a smaller one that is off its centre: |p - c| is known.
#[test]
fn closest_points_of_a_sphere_are_radial() {
    let centre = DVec3::new(30.0, -20.0, 10.0);
    let mesh = star(180, 360, centre, |_| 41.0, |_, _| true);
    let off = DVec3::new(0.6, -0.2, 0.3);
    let points: Vec<_> =
        directions(30, 40).into_iter().filter(|d| d.z.abs() < 0.9).map(|d| (centre + off + d * 40.0, d)).collect();
    let found = closest(texels(&points), &Bvh::build(&mesh).unwrap(), &mesh, 5.0, Facing::SAME).unwrap().deviations;
    for (i, (p, _)) in points.iter().enumerate() {
        let expected = 41.0 - (*p - centre).length();
        // The facets lie within the sphere by at most r (1 - cos(1 degree / sqrt 2)).
        assert!((f64::from(found.signed(i)) - expected).abs() < 0.004, "{} {expected}", found.signed(i));
    }
}
