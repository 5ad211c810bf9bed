//! Signed distances against closed formulas, and those from a mesh against all of its triangles.

mod trimmed;

use super::domain::Domain;
use super::foot::foot_points;
use super::signed::{ExactSurface, MeshSurface, Place, Target, layout_for};
use crate::bvh::Bvh;
use crate::mesh::TriangleMesh;
use crate::model::{Breaks, Closedness, Fineness, Instance, Model, Motion, Tessellation, Winding};
use glam::{DVec2, DVec3};
use gml_compiler::program::{Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A frustum whose wall makes 29 degrees with its base: along that edge a point may see one of the faces from behind.
const ACUTE: &str = "use std.solid (frustum)\nmodel m { part f = frustum(bottom: 10mm, top: 1mm, height: 5mm) }";

/// The same, with all of its parts written inside out.
const INVERTED: &str = "use std.surface (cone, disc, flip)\nmodel m { part wall = flip(cone(10mm, 1mm, 5mm))
    part lid = flip(disc(1mm).translate((0mm, 0mm, 5mm)))\npart base = disc(10mm) }";

const CORNERS: [DVec2; 4] = [DVec2::ZERO, DVec2::new(10.0, 0.0), DVec2::new(1.0, 5.0), DVec2::new(0.0, 5.0)];

/// The signed distance of a point from that frustum.
fn truth(p: DVec3) -> f64 {
    let q = DVec2::new(DVec2::new(p.x, p.y).length(), p.z);
    let to_edge = |k: usize| {
        let (a, b) = (CORNERS[k], CORNERS[k + 1]);
        let t = ((q - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        q.distance(a + t * (b - a))
    };
    let is_inside = (0..3).all(|k| (CORNERS[k + 1] - CORNERS[k]).perp_dot(q - CORNERS[k]) > 0.0);
    let distance = (0..3).map(to_edge).fold(f64::INFINITY, f64::min);
    if is_inside { -distance } else { distance }
}

fn compiled(text: &str) -> Program {
    let script = SourceFile { name: "m.gml".to_owned(), text: text.to_owned() };
    compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program
}

/// Evenly random points in a box about the frustum.
fn points(count: usize) -> Vec<DVec3> {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut at = |low: f64, high: f64| rng.random_range(low..high);
    (0..count).map(|_| DVec3::new(at(-14.0, 14.0), at(-14.0, 14.0), at(-4.0, 9.0))).collect()
}

fn places(points: &[DVec3]) -> Vec<Place> {
    points.iter().map(|point| Place { point: *point, normal: None }).collect()
}

/// Looks at the exact surface of a model, moved.
fn with_target(program: &Program, motion: Motion, look: impl FnOnce(&Target<'_>, &dyn Instance)) {
    let instance = Model::instantiate(program, &[]).expect("it exists");
    let size = Tessellation::rough_diagonal(program, &*instance, 8).expect("it is finite");
    let turned = Closedness::of(program, &*instance).expect("it is finite").inverted;
    let inverted: Vec<bool> = (0..Model::parts(program).len()).map(|patch| turned.contains(&patch)).collect();
    let layout = layout_for(program, &*instance, size);
    look(&Target::Model(ExactSurface::new(&*instance, &layout, &inverted, motion, size)), &*instance);
}

#[test]
fn distances_from_a_frustum_are_those_of_its_formula_whichever_side_is_written() {
    let (sin, cos) = 0.7f64.sin_cos();
    let rotation = [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]];
    let motion = Motion { rotation, translation: [30.0, -20.0, 11.0] };
    for text in [ACUTE, INVERTED] {
        with_target(&compiled(text), motion, |target, _| {
            let points = points(20_000);
            let moved: Vec<DVec3> = points.iter().map(|p| motion.point((*p).into()).into()).collect();
            for (p, foot) in points.iter().zip(target.feet(&places(&moved), 100.0)) {
                let (found, truth) = (foot.expect("it is near").distance, truth(*p));
                assert!((found - truth).abs() < 1e-8, "{text} at {p}: {found}, not {truth}");
            }
        });
    }
}

#[test]
fn what_is_beyond_the_reach_or_faces_the_other_way_has_no_foot() {
    with_target(&compiled(ACUTE), Motion::IDENTITY, |target, _| {
        let above = DVec3::new(0.2, 0.1, 5.5);
        let foot = |reach: f64, normal: Option<DVec3>| target.feet(&[Place { point: above, normal }], reach)[0];
        assert!((foot(0.6, None).expect("the lid").distance - 0.5).abs() < 1e-9);
        assert!(foot(0.49, None).is_none());
        // The base faces down, and lies 5.5 mm below.
        let base = foot(6.0, Some(DVec3::NEG_Z)).expect("the base");
        assert!((base.distance + 5.5).abs() < 1e-9 && base.normal.distance(DVec3::NEG_Z) < 1e-9, "{base:?}");
        assert!(foot(5.0, Some(DVec3::NEG_Z)).is_none());
    });
}

/// The distance from all triangles of a mesh, positive where its winding number is 0.
fn by_all(mesh: &TriangleMesh, p: DVec3) -> f64 {
    let winding = Winding::new(mesh.triangles.iter().map(|t| mesh.corners(*t)).collect());
    let least = mesh.triangles.iter().map(|t| {
        let [a, b, c] = mesh.corners(*t);
        super::tree::triangle_closest(p, a, b, c).1
    });
    let distance = least.fold(f64::INFINITY, f64::min).sqrt();
    if winding.at(p) > 0.5 { -distance } else { distance }
}

#[test]
fn distances_from_a_mesh_are_those_from_all_of_its_triangles() {
    let program = compiled(ACUTE);
    let instance = Model::instantiate(&program, &[]).expect("it exists");
    let fineness = Fineness { chord: 0.1, ..Fineness::default() };
    let mut mesh = Tessellation::new(&program, &*instance, fineness).expect("it is finite").mesh;
    // Far from the origin single precision is coarse.
    let away = DVec3::new(3000.0, -2000.0, 500.0);
    mesh.positions.iter_mut().for_each(|p| *p = (DVec3::from(*p) + away).into());
    let bvh = Bvh::build(&mesh).expect("a mesh");
    let target = Target::Mesh(MeshSurface::new(&mesh, &bvh));
    let points: Vec<DVec3> = points(3000).into_iter().map(|p| p + away).collect();
    for (p, foot) in points.iter().zip(target.feet(&places(&points), 100.0)) {
        let (found, truth) = (foot.expect("it is near").distance, by_all(&mesh, *p));
        assert!((found - truth).abs() < 1e-9, "at {p}: {found}, not {truth}");
    }
}

/// Of a plane, the land between two holes of 14 mm diameter on a circle of 62 mm radius, 60 degrees apart: towards its
/// ends in v the radius is stationary.
const LAND: &str = "model m {
    fn land(u: real, v: real) {
      let a = mix(-90deg, 90deg, v)
      let (along, out) = (7mm * cos(a), 62mm + 7mm * sin(a))
      let edge = atan2(along, out)
      polar(hypot(along, out), mix(edge, 60deg - edge, u))
    }
    part land = land }";

#[test]
fn a_foot_is_found_from_about_an_edge_where_the_distance_is_stationary() {
    let program = compiled(LAND);
    let instance = Model::instantiate(&program, &[]).expect("it exists");
    let domain = Domain::new(&Breaks::default());
    let (height, tolerance) = (0.1, 3e-5);
    for below in [1e-3, 0.01, 0.03, 0.1, 0.3, 1.0] {
        for tenth in 2..9 {
            let share = 0.1 * f64::from(tenth);
            let (sin, cos) = (60.0 * share).to_radians().sin_cos();
            for (radius, edge) in [(69.0 - below, 1.0), (55.0 + below, 0.0)] {
                let q = DVec3::new(radius * cos, radius * sin, height);
                for (aside, off) in [(0.0, 0.0), (0.02, 0.0), (-0.02, 1e-6), (0.01, 0.003), (0.02, 0.05)] {
                    let start = [share + aside, f64::abs(edge - off)];
                    let foot = foot_points(&*instance, 0, &domain, &[q], &[start], tolerance).expect("it exists")[0];
                    // A distance is wrong by the square of the foot's error over twice the distance.
                    let error = foot.d2.sqrt() - height;
                    assert!(error.abs() < 1e-7, "{below} {start:?}: {error}, {foot:?}");
                }
            }
        }
    }
}
