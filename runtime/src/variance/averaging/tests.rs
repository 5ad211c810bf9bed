use super::average_normals;
use crate::bvh::Bvh;
use crate::mesh::TriangleMesh;
use crate::model::{Atlas, Fineness, Model, Motion, ReferenceSurface, Sensitivities, Tessellation, Texels};
use crate::scan::ScanSource;
use crate::variance::cast::closest;
use crate::variance::cast::tests::gpu;
use crate::variance::detection::detect;
use crate::variance::explained::explain;
use crate::variance::{Deviations, Device, Facing, Tolerance, VarianceReport, cast, signed_distances};
use glam::DVec3;
use gml_compiler::program::{Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};

const SIZE: u32 = 128;

/// A can of three patches, whose radius is 20 and whose height is 50; the seam of its side and its rims are creases or
/// none.
const CAN: &str = "use std.surface (cylinder, disc)\nmodel can { param r: length = 20mm; param h: length = 50mm\n\
    part side = cylinder(r, h)\n\
    part lid = |u, v| disc(r)(u, v) + (0mm, 0mm, h)\n\
    part floor = |u, v| { let p = disc(r)(u, 1 - v)\n (p.x, p.y, p.z) } }";

fn program(text: &str) -> Program {
    let script = SourceFile { name: "can.gml".to_owned(), text: text.to_owned() };
    compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program
}

fn surface(program: &Program, x: &[f64]) -> (Tessellation, Texels) {
    let instance = Model::instantiate(program, x).expect("it exists");
    let atlas = Atlas::new(program, &*instance, SIZE).expect("it fits");
    let texels = Texels::of_model(program, &*instance, &atlas).expect("it is finite");
    let fineness = Fineness { edge: 1.0, ..Fineness::default() };
    let tessellation = Tessellation::new(program, &*instance, fineness).expect("it is finite").with_atlas(&atlas);
    (tessellation, texels)
}

/// Vertices displaced by the texel in which they lie, as documents do it; none without data.
fn displaced(tessellation: &Tessellation, texels: &Texels, scan: &TriangleMesh, device: Device) -> Vec<Option<DVec3>> {
    let bvh = Bvh::build(scan).expect("a mesh");
    let found = cast(texels.clone(), &bvh, 5.0, Facing::SAME, device).expect("a distance").deviations;
    let distances = signed_distances(&found);
    let mesh = &tessellation.mesh;
    let vertex = |(k, [s, t]): (usize, &[f64; 2])| {
        let at = |x: f64| ((x * f64::from(SIZE)) as u32).min(SIZE - 1);
        // A vertex at the right or lower end of a chart lies on the border of the next texel.
        let near = [
            [s - 1e-9, 1.0 - t - 1e-9],
            [s + 1e-9, 1.0 - t + 1e-9],
            [s + 1e-9, 1.0 - t - 1e-9],
            [s - 1e-9, 1.0 - t + 1e-9],
        ];
        let distance = near.iter().map(|[s, t]| distances[(at(*t) * SIZE + at(*s)) as usize]).find(|d| !d.is_nan())?;
        Some(DVec3::from(mesh.positions[k]) + f64::from(distance) * DVec3::from(mesh.normals[k]))
    };
    mesh.texcoords.iter().enumerate().map(vertex).collect()
}

/// The largest distance of a displaced vertex on the edge of a patch from the displaced vertices of another patch,
/// among those that lay within half a millimetre of it.
fn gap(tessellation: &Tessellation, displaced: &[Option<DVec3>]) -> f64 {
    let (positions, origins) = (&tessellation.mesh.positions, &tessellation.origins);
    let rim: Vec<usize> = (0..positions.len())
        .filter(|&i| (DVec3::from(positions[i]).truncate().length() - 20.0).abs() < 1e-6)
        .filter(|&i| [0.0, 50.0].iter().any(|z| (positions[i][2] - z).abs() < 1e-6))
        .collect();
    assert!(rim.len() > 200);
    let to_other = |i: usize| {
        let own = displaced[i].unwrap_or_else(|| panic!("no data at {:?}", positions[i]));
        let others = rim.iter().filter(|&&j| {
            origins[j].patch != origins[i].patch && DVec3::from(positions[i]).distance(positions[j].into()) < 1.0
        });
        others.filter_map(|&j| displaced[j]).map(|other| other.distance(own)).fold(f64::INFINITY, f64::min)
    };
    rim.iter().map(|&i| to_other(i)).fold(0.0, f64::max)
}

/// A can that is larger or smaller by an offset is reached from both sides of its rims in the same places; along plain
/// normals they are an offset's diagonal apart.
#[test]
fn displaced_rims_of_a_can_coincide() {
    let program = program(CAN);
    for offset in [1.0, -0.5] {
        let (mut scan, _) = surface(&program, &[20.0 + offset, 50.0 + 2.0 * offset]);
        scan.mesh.positions.iter_mut().for_each(|p| p[2] -= offset);
        let (mut tessellation, mut texels) = surface(&program, &[20.0, 50.0]);
        if offset > 0.0 {
            let apart = gap(&tessellation, &displaced(&tessellation, &texels, &scan.mesh, Device::Cpu));
            assert!((apart - offset * 2f64.sqrt()).abs() < 0.15, "{apart}");
        }
        average_normals(&mut texels, &mut tessellation, None, 2.0).expect("a surface");
        let moved = displaced(&tessellation, &texels, &scan.mesh, Device::Cpu);
        let apart = gap(&tessellation, &moved);
        // Texels of 0.7 mm, within which a normal turns by a third of 45 degrees; vertices up to 1 mm apart on either
        // side, half of that from the nearest.
        assert!(apart < 0.65, "{apart}");
        if gpu().is_some() {
            let on_gpu = displaced(&tessellation, &texels, &scan.mesh, Device::Gpu);
            let differ = moved.iter().zip(on_gpu).filter(|(a, b)| match (a, b) {
                (Some(a), Some(b)) => a.distance(*b) > 1e-4,
                (a, b) => a.is_some() != b.is_some(),
            });
            assert_eq!(differ.count(), 0);
        }
    }
}

/// Normals at the rims are the mean of both; on the seam and far from the rims they stay what they were.
#[test]
fn normals_turn_within_the_band_only() {
    let program = program(CAN);
    let (mut tessellation, mut texels) = surface(&program, &[20.0, 50.0]);
    let before = texels.clone();
    average_normals(&mut texels, &mut tessellation, None, 2.0).expect("a surface");
    let mut turned = 0;
    for i in 0..texels.len() {
        let position = DVec3::from(texels.position[i]);
        let to_rim = position.truncate().length() - 20.0;
        let to_rim = to_rim.hypot(position.z.min(50.0 - position.z));
        let (a, b) = (before.normal[i], texels.normal[i]);
        let change = DVec3::from(a.map(f64::from)).angle_between(DVec3::from(b.map(f64::from)));
        if to_rim > 2.01 {
            assert_eq!(a, b, "{position}");
        } else {
            // A normal mixed with one at 45 degrees to it: linear in the added vector.
            let share = 1.0 - to_rim / 2.0;
            let half = std::f64::consts::FRAC_1_SQRT_2;
            let expected = (share * half).atan2(1.0 - share * (1.0 - half));
            assert!((change - expected).abs() < 0.03, "{change} {expected} at {position}");
            turned += 1;
        }
    }
    assert!(turned > 400);
    let rims = tessellation.mesh.positions.iter().zip(&tessellation.mesh.normals).filter(|(p, _)| {
        (DVec3::from(**p).truncate().length() - 20.0).abs() < 1e-9 && (p[2].abs() < 1e-9 || (p[2] - 50.0).abs() < 1e-9)
    });
    for (p, n) in rims {
        let out = DVec3::new(p[0], p[1], if p[2] > 25.0 { 20.0 } else { -20.0 }).normalize();
        assert!(out.dot(DVec3::from(*n)) > 1.0 - 1e-4, "{p:?} {n:?}");
    }
}

/// A can that is 0.3 mm larger all around is so wherever and in whatever direction it is looked for: by statistics,
/// tolerances, levels of detection and explanations. (Along averaged normals it is 0.42 mm away at the rims.)
#[test]
fn figures_are_the_same_for_every_kind_of_distance() {
    const OFFSET: f64 = 0.3;
    let program = program(CAN);
    let (mut scan, _) = surface(&program, &[20.0 + OFFSET, 50.0 + 2.0 * OFFSET]);
    scan.mesh.positions.iter_mut().for_each(|p| p[2] -= OFFSET);
    let bvh = Bvh::build(&scan.mesh).expect("a mesh");
    let (mut tessellation, texels) = surface(&program, &[20.0, 50.0]);
    let instance = Model::instantiate(&program, &[20.0, 50.0]).expect("it exists");
    let atlas = Atlas::new(&program, &*instance, SIZE).expect("it fits");
    let sensitivities =
        Sensitivities::new(&program, &*instance, &atlas, &texels, &Motion::IDENTITY).expect("it is smooth");
    let along = |texels: Texels| cast(texels, &bvh, 5.0, Facing::SAME, Device::Cpu).expect("a distance").deviations;
    let nearest = closest(texels.clone(), &bvh, &scan.mesh, 5.0, Facing::SAME).expect("a distance").deviations;
    let mut turned = texels.clone();
    let cosine = average_normals(&mut turned, &mut tessellation, None, 2.0).expect("a surface");
    let averaged = Deviations { cosine, ..along(turned) };
    let furthest = (0..averaged.texels.len()).map(|i| averaged.along(i)).fold(0.0, f32::max);
    assert!(furthest > 0.37, "{furthest}: no direction was turned");
    // Chords of the scan's circles are up to 0.006 mm inside of them, texels on the model's.
    let near = |a: f64, b: f64| (a - b).abs() < 0.008;
    for (name, found) in [("normal", along(texels)), ("closest", nearest), ("averaged", averaged)] {
        let tolerance = Some(Tolerance { lower: -0.1, upper: 0.32 });
        let report = VarianceReport::new(&found, &ScanSource::default(), "cpu", &[tolerance; 3]);
        let all = &report.overall;
        assert_eq!(all.measured_texels, all.texels, "{name}");
        for value in [all.weighted.mean, all.weighted.min, all.weighted.max, all.weighted.signed.median] {
            assert!(near(value, OFFSET), "{name}: {value}");
        }
        assert!(all.tolerance.is_some_and(|t| t.within), "{name}: {:?}", all.tolerance);
        // A level just above and one just below the offset.
        for (noise, share) in [(0.165, 0.0), (0.14, 1.0)] {
            assert!(detect(&found, noise, None).iter().all(|d| d.significant == share), "{name} {noise}");
        }
        let parts: Vec<_> =
            explain(&found, &sensitivities).into_iter().map(|p| p.expect("enough is measured")).collect();
        assert_eq!(parts[0].parameters[0].name, "r", "{name}");
        assert!(near(parts[0].parameters[0].change, OFFSET) && parts[0].form < 0.004, "{name}: {:?}", parts[0]);
        assert_eq!(parts[1].parameters[0].name, "h", "{name}");
        assert!(near(parts[1].parameters[0].change, OFFSET) && parts[1].form < 0.004, "{name}: {:?}", parts[1]);
    }
}

/// A mesh has no patches: normals are those of its corners, interpolated.
#[test]
fn a_box_from_elsewhere_gets_the_normals_of_its_corners() {
    let positions: Vec<[f64; 3]> =
        (0..8).map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 1 { 10.0 } else { -10.0 })).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    let mesh = TriangleMesh { positions, triangles, ..TriangleMesh::default() };
    let ReferenceSurface { mut tessellation, mut texels, .. } = ReferenceSurface::new(&mesh, 64).expect("a box");
    average_normals(&mut texels, &mut tessellation, None, 1.0).expect("a surface");
    for (p, n) in tessellation.mesh.positions.iter().zip(&tessellation.mesh.normals) {
        assert!(DVec3::from(*p).normalize().dot(DVec3::from(*n)) > 1.0 - 1e-9, "{p:?} {n:?}");
    }
    for (p, n) in texels.position.iter().zip(&texels.normal) {
        // Linear between the corners of a square: along the line from the centre, but for the diagonal.
        let (p, n) = (DVec3::from(*p), DVec3::from(n.map(f64::from)));
        assert!(p.normalize().dot(n) > 0.9, "{p} {n}");
    }
}
