//! Surfaces whose differences are known.

use super::{CompareError, CompareOptions, Comparison, NoVolume, Side, Stated, StatedCovariance, States, compare};
use crate::mesh::TriangleMesh;
use crate::model::{Fineness, Model, Motion, Tessellation};
use crate::progress::Silent;
use crate::progress::tests::Until;
use crate::variance::{Reference, Resolution};
use glam::DVec3;
use gml_compiler::program::{Options, Program, Quantity, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use std::f64::consts::PI;

const BALL: &str = "use std.surface (sphere)\nmodel ball { param r: length = 20mm\npart skin = sphere(r) }";

const BLOCK: &str = "use std.solid (box)
    use std.frame (rotate)
    model block {
      param x: length = 0mm
      param turn: angle = 0deg
      param height: length = 10mm
      part body = box(width: 30mm, depth: 20mm, height: height).rotate(turn, (1, 2, 3)).translate((x, 0mm, 0mm))
    }";

fn compiled(text: &str) -> Program {
    let script = SourceFile { name: "m.gml".to_owned(), text: text.to_owned() };
    compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program
}

fn options() -> CompareOptions {
    CompareOptions { resolution: Some(Resolution::Side(128)), ..CompareOptions::default() }
}

/// The values of a program's parameters, which were not fitted.
fn stated(program: &Program, x: &[f64]) -> Vec<Stated> {
    let parameters = Model::parameters(program).iter().zip(x);
    parameters
        .map(|(p, value)| Stated { name: p.name.clone(), quantity: p.quantity, value: *value, sd: None })
        .collect()
}

fn compared(program: &Program, a: &[f64], b: &[f64], options: &CompareOptions) -> Result<Comparison, CompareError> {
    let [states_a, states_b] = [a, b].map(|x| stated(program, x));
    let side = |x, parameters| Side {
        surface: Reference::Model { model: program, x, motion: Motion::IDENTITY },
        states: Some(States { parameters, covariance: None, scan: None }),
    };
    compare(&side(a, &states_a), &side(b, &states_b), options, &Silent)
}

fn meshed(program: &Program, x: &[f64], chord: f64) -> TriangleMesh {
    let instance = Model::instantiate(program, x).expect("it exists");
    Tessellation::new(program, &*instance, Fineness { chord, ..Fineness::default() }).expect("it is finite").mesh
}

fn side(surface: Reference<'_>) -> Side<'_> {
    Side { surface, states: None }
}

#[test]
fn spheres_differ_by_their_radii() {
    let program = compiled(BALL);
    let found = compared(&program, &[20.0], &[20.3], &options()).expect("a comparison");
    for (difference, expected) in [(&found.a_to_b, 0.3), (&found.b_to_a, -0.3)] {
        let overall = &difference.overall;
        let signed = &overall.moments.signed;
        assert!((signed.mean - expected).abs() < 1e-7 && signed.sd < 1e-7, "{signed:?}");
        assert!((overall.matched_area / overall.area - 1.0).abs() < 1e-9 && overall.unmatched_area < 1e-6);
        assert!((difference.hausdorff.distance - 0.3).abs() < 1e-7, "{:?}", difference.hausdorff);
    }
    assert!((found.hausdorff - 0.3).abs() < 1e-7);
    for (body, r) in [(&found.a, 20.0_f64), (&found.b, 20.3)] {
        let volume = body.volume.expect("it is closed");
        assert!((volume / (4.0 / 3.0 * PI * r.powi(3)) - 1.0).abs() < 1e-10, "{volume}");
        assert!((body.area / (4.0 * PI * r * r) - 1.0).abs() < 1e-10, "{}", body.area);
    }
    let explained = found.explained.expect("r differs");
    assert!((explained.rms - 0.3).abs() < 1e-7 && (explained.share - 1.0).abs() < 1e-6 && explained.remaining < 1e-6);
    let [r] = &explained.parameters[..] else { panic!("{explained:?}") };
    assert!(r.name == "r" && (r.movement - 0.3).abs() < 1e-7 && (r.share.expect("a share") - 1.0).abs() < 1e-6);
}

#[test]
fn a_shifted_block_is_off_on_two_faces_and_can_be_brought_back() {
    let program = compiled(BLOCK);
    let found = compared(&program, &[0.0, 0.0, 10.0], &[2.0, 0.0, 10.0], &options()).expect("a comparison");
    let median = |name: &str| {
        let part = found.a_to_b.parts.iter().find(|part| part.name == name).expect("a part");
        part.statistics.moments.signed.median
    };
    for (part, expected) in [("right", 2.0), ("left", -2.0), ("top", 0.0), ("base", 0.0), ("front", 0.0), ("back", 0.0)]
    {
        assert!(
            (median(&format!("body.{part}")) - expected).abs() < 1e-6,
            "{part}: {}",
            median(&format!("body.{part}"))
        );
    }
    // From the strip of the top beside the left face on, the nearest place of B's top is up to 2 mm away.
    let [right, top] =
        ["body.right", "body.top"].map(|n| found.a_to_b.parts.iter().find(|p| p.name == n).expect("a part").clone());
    assert!((top.statistics.largest.expect("one").distance + 2.0).abs() < 1e-6);
    assert!((right.statistics.moments.signed.mean - 2.0).abs() < 1e-6);
    assert!((found.hausdorff - 2.0).abs() < 1e-6);
    assert!((found.a.volume.expect("closed") - 6000.0).abs() < 1e-6 && (found.a.area - 2200.0).abs() < 1e-6);
    assert!((DVec3::from(found.a.high) - DVec3::new(15.0, 10.0, 10.0)).length() < 1e-9, "{:?}", found.a.high);
    // Turned and shifted at once, and 0.5 mm higher.
    let align = CompareOptions { align: true, ..options() };
    let found = compared(&program, &[0.0, 0.0, 10.0], &[200.0, 0.7, 10.0], &align).expect("a comparison");
    assert!(found.hausdorff < 1e-6 && found.aligned.is_some(), "{}", found.hausdorff);
    let found = compared(&program, &[0.0, 0.0, 10.0], &[200.0, 0.7, 10.5], &align).expect("a comparison");
    // The alignment halves what is at the top alone.
    assert!(found.hausdorff > 0.2 && found.hausdorff < 0.5, "{}", found.hausdorff);
    let explained = found.explained.expect("the height differs");
    assert!(explained.share > 0.99, "{explained:?}");
    let taken_back = |name: &str| {
        let parameter = found.parameters.iter().find(|p| p.name == name).expect("a parameter");
        parameter.without_sd.as_ref().is_some_and(|why| why.contains("the alignment takes back"))
    };
    assert!(taken_back("x") && taken_back("turn") && !taken_back("height"));
    let [height] = &explained.parameters[..] else { panic!("shift and turn were taken back: {explained:?}") };
    assert!(height.name == "height" && height.share.is_some_and(|share| (share - 1.0).abs() < 0.02), "{height:?}");
}

#[test]
fn equal_surfaces_have_no_difference_and_exchanged_ones_the_same() {
    let program = compiled(BLOCK);
    let (a, b) = ([0.0, 0.0, 10.0], [0.3, 0.01, 10.2]);
    let same = compared(&program, &b, &b, &options()).expect("a comparison");
    assert!(same.hausdorff == 0.0 && same.a_to_b.overall.moments.max == 0.0 && same.explained.is_none(), "{same:?}");
    assert!(same.parameters.iter().all(|p| p.difference == 0.0));
    let [there, back] = [(&a, &b), (&b, &a)].map(|(a, b)| compared(&program, a, b, &options()).expect("a comparison"));
    assert_eq!((&there.a_to_b, &there.b_to_a), (&back.b_to_a, &back.a_to_b));
    assert_eq!((&there.a, there.hausdorff, there.max_distance), (&back.b, back.hausdorff, back.max_distance));
    for (p, q) in there.parameters.iter().zip(&back.parameters) {
        assert_eq!((p.difference, p.a), (-q.difference, q.b));
    }
    let mesh = meshed(&program, &b, 0.1);
    let of = side(Reference::Mesh(&mesh));
    let meshes = compare(&of, &of, &options(), &Silent).expect("a comparison");
    assert!(meshes.hausdorff == 0.0 && meshes.parameters.is_empty());
}

#[test]
fn a_mesh_is_as_far_from_its_model_as_its_chords_even_inside_out() {
    let program = compiled(BALL);
    let mut mesh = meshed(&program, &[20.0], 0.2);
    let model = Reference::Model { model: &program, x: &[20.0], motion: Motion::IDENTITY };
    let found = compare(&side(model), &side(Reference::Mesh(&mesh)), &options(), &Silent).expect("a comparison");
    let from_mesh = &found.b_to_a.overall;
    // The mesh lies inside of the sphere, so that the sphere lies outside of it.
    assert!(from_mesh.moments.signed.min >= 0.0 && from_mesh.moments.max > 0.1, "{:?}", from_mesh.moments);
    assert!(found.hausdorff < 0.21 && found.hausdorff > 0.1, "{}", found.hausdorff);
    let volume = found.b.volume.expect("it is closed");
    assert!(volume < found.a.volume.expect("it is closed") && volume > 0.97 * 4.0 / 3.0 * PI * 8000.0, "{volume}");
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh.normals.iter_mut().for_each(|n| *n = n.map(|c| -c));
    let turned = compare(&side(model), &side(Reference::Mesh(&mesh)), &options(), &Silent).expect("a comparison");
    assert!((turned.hausdorff - found.hausdorff).abs() < 1e-9 && !turned.warnings.is_empty(), "{:?}", turned.warnings);
    assert!((turned.b_to_a.overall.moments.signed.mean - from_mesh.moments.signed.mean).abs() < 1e-6);
    // Without some triangles it encloses nothing.
    mesh.triangles.truncate(mesh.triangles.len() - 3);
    mesh.groups.clear();
    let open = compare(&side(model), &side(Reference::Mesh(&mesh)), &options(), &Silent).expect("a comparison");
    assert_eq!((open.b.volume, open.b.without_volume), (None, Some(NoVolume::Open)));
}

#[test]
fn what_is_far_away_or_of_another_size_is_refused_with_the_mend() {
    let program = compiled(BALL);
    let model = side(Reference::Model { model: &program, x: &[20.0], motion: Motion::IDENTITY });
    let moved = |scale: f64, by: f64| {
        let mut mesh = meshed(&program, &[20.0], 0.5);
        mesh.positions.iter_mut().for_each(|p| *p = (scale * DVec3::from(*p) + by).into());
        let error = compare(&model, &side(Reference::Mesh(&mesh)), &options(), &Silent).expect_err("it is elsewhere");
        error.to_string()
    };
    assert!(moved(1.0, 300.0).contains("`gmlc fit` brings a model to a mesh"));
    assert!(moved(1000.0, 0.0).contains("is the unit right?"));
    let mesh = meshed(&program, &[20.0], 0.5);
    let align = CompareOptions { align: true, ..options() };
    let error = compare(&model, &side(Reference::Mesh(&mesh)), &align, &Silent).expect_err("no model");
    assert_eq!(error, CompareError::NotAligned("not two models"));
}

#[test]
fn differences_of_parameters_are_held_against_both_covariances() {
    let length = |name: &str, value: f64, sd: Option<Result<f64, String>>| {
        let name = name.to_owned();
        Stated { name, quantity: Quantity::Length, value, sd }
    };
    let known = |value: f64| Some(Ok(value));
    let without = || Some(Err("fixed".to_owned()));
    let a = [
        length("r", 10.0, known(0.03)),
        length("h", 50.0, known(0.1)),
        length("w", 2.0, without()),
        length("t", 1.0, None),
    ];
    let b = [
        length("h", 50.3, known(0.1)),
        length("r", 10.1, known(0.04)),
        length("w", 2.0, known(0.1)),
        length("q", 1.0, None),
    ];
    let names = ["r".to_owned(), "h".to_owned()];
    let [first, second] = [vec![vec![9e-4, 1e-3], vec![1e-3, 0.01]], vec![vec![16e-4, -5e-4], vec![-5e-4, 0.01]]];
    let state = |parameters, matrix| States {
        parameters,
        covariance: Some(StatedCovariance { parameters: &names, matrix }),
        scan: Some("the same"),
    };
    let found = super::parameters::compare(&state(&a, &first), &state(&b, &second), &[]);
    let [r, h, w] = &found.differences[..] else { panic!("{found:?}") };
    assert!((r.sd.expect("sd") - 0.05).abs() < 1e-12 && (r.z.expect("z") - 2.0).abs() < 1e-9, "{r:?}");
    // Two-sided tails of the normal distribution at 2 and at 3 / sqrt 2.
    assert!((r.p.expect("p") - 0.045_500_26).abs() < 1e-7 && r.significant == Some(true), "{r:?}");
    assert!((h.p.expect("p") - 0.033_894_85).abs() < 1e-7, "{h:?}");
    assert_eq!((w.sd, w.without_sd.as_deref()), (None, Some("A: fixed")));
    assert_eq!((&found.only_a[..], &found.only_b[..]), (&["t".to_owned()][..], &["q".to_owned()][..]));
    // d^T C^-1 d of C = (2.5e-3, 5e-4; 5e-4, 2e-2) and d = (0.1, 0.3), by Cramer's rule.
    let determinant = 2.5e-3 * 2e-2 - 5e-4 * 5e-4;
    let expected = (2e-2 * 0.01 - 2.0 * 5e-4 * 0.03 + 2.5e-3 * 0.09) / determinant;
    let together = found.together.expect("two");
    assert!((together.statistic - expected).abs() < 1e-9 && together.degrees == 2, "{together:?} {expected}");
    assert!((together.p - (-expected / 2.0).exp()).abs() < 1e-12);
    assert_eq!(found.warnings.len(), 1, "they are of one scan");
}

#[test]
fn a_change_beyond_where_the_surface_is_linear_explains_nothing() {
    let program = compiled(BLOCK);
    let explained = |turn: f64| {
        let found = compared(&program, &[0.0, 0.0, 10.0], &[0.05, turn, 10.0], &options()).expect("a comparison");
        found.explained.expect("they differ")
    };
    let near = explained(0.003);
    let sum: f64 = near.parameters.iter().filter_map(|p| p.share).sum();
    assert!(near.share > 0.98 && (sum - near.share).abs() < 0.03, "{near:?}");
    assert!(near.parameters.iter().all(|p| p.share.is_some()), "{near:?}");
    let far = explained(1.4);
    let turn = far.parameters.iter().find(|p| p.name == "turn").expect("it moves the block");
    assert!(far.share >= 0.0 && turn.share.is_none_or(|share| share < 0.7), "{far:?}");
}

/// A cone of so many needles about its tip.
fn cone(needles: u32) -> TriangleMesh {
    let rim = |k: u32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(needles)).sin_cos();
        [10.0 * cos, 10.0 * sin, 0.0]
    };
    let positions = std::iter::once([0.0, 0.0, 10.0]).chain((0..needles).map(rim)).collect();
    let triangles = (0..needles).map(|k| [0, k + 1, (k + 1) % needles + 1]).collect();
    TriangleMesh { positions, triangles, ..TriangleMesh::default() }
}

#[test]
fn needles_are_sampled_more_coarsely_with_a_warning() {
    let [few, many] = [100, 3000].map(cone);
    let compared = |mesh: &TriangleMesh, resolution| {
        let options = CompareOptions { resolution, ..CompareOptions::default() };
        compare(&side(Reference::Mesh(mesh)), &side(Reference::Mesh(mesh)), &options, &Silent).expect("compared")
    };
    assert_eq!(compared(&few, None).warnings, [""; 0]);
    let coarse = compared(&many, None);
    assert!(
        coarse.warnings.len() == 1 && coarse.warnings[0].contains("as coarsely as 128 x 128"),
        "{:?}",
        coarse.warnings
    );
    assert!(coarse.a_to_b.overall.matched_area > 0.99 * coarse.a_to_b.overall.area);
    assert_eq!(compared(&many, Some(Resolution::Side(64))).warnings, [""; 0], "as was requested");
    // Triangles on each other that are not quite the same: each has a sample.
    let mut pile = TriangleMesh::default();
    for k in 0..12_000 {
        let z = 1e-6 * f64::from(k);
        pile.positions.extend([[0.0, 0.0, z], [10.0, 0.0, z], [0.0, 10.0, z]]);
        pile.triangles.push([3 * k, 3 * k + 1, 3 * k + 2]);
    }
    let pile = side(Reference::Mesh(&pile));
    let error = compare(&pile, &pile, &CompareOptions::default(), &Silent).unwrap_err();
    assert!(matches!(error, CompareError::Tangled { .. }), "{error}");
}

/// An interrupt while a surface is sampled is no fault of the surface.
#[test]
fn an_interrupted_comparison_says_only_that() {
    let program = compiled(BALL);
    let ball = side(Reference::Model { model: &program, x: &[20.0], motion: Motion::IDENTITY });
    let error = compare(&ball, &ball, &options(), &Until::asked(0)).unwrap_err();
    assert_eq!(error.to_string(), "interrupted");
}

/// A closed cube, moved and scaled; it faces inwards if it is `reversed`.
fn cube(by: f64, size: f64, reversed: bool) -> TriangleMesh {
    let corner = |i: u32| [i & 1, i >> 1 & 1, i >> 2 & 1].map(|c| by + size * f64::from(c));
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut triangles: Vec<[u32; 3]> = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    if reversed {
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    TriangleMesh { positions: (0..8).map(corner).collect(), triangles, ..TriangleMesh::default() }
}

/// Two meshes in one.
fn both(mut a: TriangleMesh, b: TriangleMesh) -> TriangleMesh {
    let first = a.positions.len() as u32;
    a.positions.extend(b.positions);
    a.triangles.extend(b.triangles.into_iter().map(|t| t.map(|v| v + first)));
    a
}

#[test]
fn bodies_in_each_other_have_no_volume() {
    let outer = || cube(0.0, 20.0, false);
    for (mesh, expected) in [
        (outer(), Ok(8000.0)),
        (both(outer(), cube(30.0, 10.0, false)), Ok(9000.0)),
        (both(outer(), cube(20.0, 10.0, false)), Ok(9000.0)),
        (both(outer(), cube(5.0, 10.0, true)), Ok(7000.0)),
        (both(outer(), cube(5.0, 10.0, false)), Err(NoVolume::Overlapping)),
        (both(outer(), cube(10.0, 20.0, false)), Err(NoVolume::Overlapping)),
        (both(outer(), outer()), Err(NoVolume::Overlapping)),
        (both(outer(), cube(0.0, 20.0, true)), Err(NoVolume::Flat)),
    ] {
        let alone = side(Reference::Mesh(&mesh));
        let options = CompareOptions { resolution: Some(Resolution::Side(16)), ..CompareOptions::default() };
        let body = compare(&alone, &alone, &options, &Silent).expect("compared").a;
        match expected {
            Ok(volume) => assert!((body.volume.expect("a volume") - volume).abs() < 1e-9 * volume, "{body:?}"),
            Err(why) => assert_eq!((body.volume, body.without_volume), (None, Some(why))),
        }
    }
    // Two parts that are the same surface.
    let program = compiled("model m {\n param r: length = 10mm\n part a = sphere(r)\n part b = sphere(r)\n}");
    let spheres = compared(&program, &[10.0], &[10.0], &options()).expect("compared");
    assert_eq!((spheres.a.volume, spheres.a.without_volume), (None, Some(NoVolume::Overlapping)));
}
