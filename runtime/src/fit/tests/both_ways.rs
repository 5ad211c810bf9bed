//! What the model has and the scan does not.

use super::shapes::program;
use crate::fit::{FitOptions, FitResult, FittedParameter, fit};
use crate::mesh::TriangleMesh;
use crate::model::{Fineness, Model, Motion, Tessellation};
use crate::progress::Silent;
use crate::scan::{Scan, from_mesh};
use crate::simulate::{ExactSurface, Scanner, scan_exact};
use glam::DVec3;
use gml_compiler::program::Program;
use std::f64::consts::PI;

/// A vessel of 30 mm radius, 60 mm high, with walls of 2 mm, and a shelf inside that may have no radius.
const VESSEL: &str = "use std.surface (revolve, flip)
    model vessel {
      param shelf: length in 0mm..40mm = 0mm
      param r: length in 29mm..40mm = 30mm
      part outside = revolve(|t| (r, 60mm * t))
      part inside = flip(revolve(|t| (28mm, 2mm + 58mm * t)))
      part rim = revolve(|t| (mix(r, 28mm, t), 60mm))
      part floor = flip(revolve(|t| (28mm * t, 2mm)))
      part foot = revolve(|t| (r * t, 0mm))
      part shelf_top = flip(revolve(|t| (shelf * t, 30mm)))
    }";

/// The vessel's surface without the shelf, on one side of a plane through its axis or on both.
fn vessel(whole: bool) -> Scan {
    let program = program(VESSEL);
    let instance = Model::instantiate(&program, &[0.0, 30.0]).unwrap();
    let fineness = Fineness { chord: 0.05, edge: 1.5, ..Fineness::default() };
    let mesh = Tessellation::new(&program, &*instance, fineness).unwrap().mesh;
    let seen = |t: &&[u32; 3]| whole || mesh.corners(**t).iter().all(|p| p.x > 0.0);
    let triangles = mesh.triangles.iter().filter(seen).copied().collect();
    let positions = mesh.positions.clone();
    from_mesh(TriangleMesh { positions, triangles, ..TriangleMesh::default() }, "vessel").unwrap()
}

fn fitted(scan: &Scan, shelf: f64) -> FitResult {
    let mut options = FitOptions { no_pose: true, fixed: vec!["shelf".into()], ..FitOptions::default() };
    options.start.insert("shelf".into(), shelf);
    fit(&program(VESSEL), scan, &options, &Silent).unwrap()
}

#[test]
fn a_shelf_in_an_empty_vessel_is_contradicted() {
    let scan = vessel(true);
    let result = fitted(&scan, 20.0);
    let contradicted = result.contradicted.expect("a mesh says what is empty");
    assert_eq!(contradicted.len(), 1, "{contradicted:?}");
    let shelf = &contradicted[0];
    // Places are 3 mm apart.
    assert!(shelf.part == "shelf_top" && (shelf.area / (PI * 400.0) - 1.0).abs() < 0.02, "{shelf:?}");
    assert!(shelf.place[0].hypot(shelf.place[1]) < 0.5 && (shelf.place[2] - 30.0).abs() < 1e-6, "{shelf:?}");
    assert!(result.warnings.iter().any(|w| w.contains("`shelf_top`") && w.contains("empty space")));
    let result = fitted(&scan, 0.0);
    assert_eq!(result.contradicted, Some(Vec::new()), "{:?}", result.warnings);
}

/// The mesh of the vessel without its shelf, and a ball of 8 mm radius whose middle is 4 mm outside of its wall.
fn vessel_with_a_ball() -> TriangleMesh {
    let mut mesh = vessel(true).mesh;
    let ball = program("use std.surface (sphere)\nmodel ball { part ball = sphere(8mm) }");
    let fineness = Fineness { chord: 0.05, edge: 1.5, ..Fineness::default() };
    let ball = Tessellation::new(&ball, &*Model::instantiate(&ball, &[]).unwrap(), fineness).unwrap().mesh;
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(ball.positions.iter().map(|[x, y, z]| [x + 34.0, *y, z + 30.0]));
    mesh.triangles.extend(ball.triangles.iter().map(|t| t.map(|i| i + first)));
    mesh.normals.clear();
    mesh
}

#[test]
fn what_the_model_does_not_explain_is_named_with_its_place_and_what_is_beside_it() {
    assert_eq!(fitted(&vessel(true), 0.0).unexplained, Vec::new());
    let mesh = vessel_with_a_ball();
    let whole = mesh.area();
    // The ball goes through the wall and is left over but for the strips that lie near the wall's two sides.
    let area = 4.0 * PI * 64.0;
    let cloud = TriangleMesh { positions: mesh.positions.clone(), ..TriangleMesh::default() };
    for mesh in [mesh, cloud] {
        let is_mesh = !mesh.triangles.is_empty();
        let result = fitted(&from_mesh(mesh, "vessel").unwrap(), 0.0);
        let [piece] = result.unexplained.as_slice() else { panic!("{:?}", result.unexplained) };
        assert_eq!(piece.area.is_some(), is_mesh);
        let share = area / whole;
        // The cloud's points are denser on the ball; of its end inside of the vessel only the middle is a piece.
        assert!((0.75 * share..1.1 * share).contains(&piece.share), "{piece:?} of {share}");
        let off = DVec3::from_array(piece.place) - DVec3::new(34.0, 0.0, 30.0);
        assert!(off.length() < if is_mesh { 1.0 } else { 4.0 }, "{piece:?}");
        assert!(piece.beside[0] == "outside" && piece.shaped_by == ["r"], "{piece:?}");
        let said = |w: &&String| w.contains("is not explained by the model") && w.contains("(`r`)");
        assert_eq!(result.warnings.iter().filter(said).count(), 1, "{:?}", result.warnings);
    }
}

/// A round tray as a cloud without its base: the points of its walls, which end where the scan does, are no base.
#[test]
fn a_base_between_walls_that_end_with_the_scan_has_no_place() {
    let tray = program(
        "use std.surface (revolve)
        model tray {
          param r: length in 20mm..80mm = 45mm
          param h: length in 15mm..60mm = 30mm
          param floor: length in 2mm..9mm = 5mm
          require floor + 4mm < h, \"deep enough\"
          part base = revolve(line((0mm, 0mm), (r, 0mm)))
          part outside = revolve(line((r, 0mm), (r, h)))
          part lip = revolve(line((r, h), (r - 3mm, h)))
          part inside = revolve(line((r - 3mm, h), (r - 3mm, floor)))
          part bottom = revolve(line((r - 3mm, floor), (0mm, floor)))
        }",
    );
    let scanner = Scanner { spacing: 1.3, noise: 0.15, seed: 1, random_pose: false, ..Scanner::default() };
    let cloud = |seen: &dyn Fn(DVec3) -> bool| {
        let scan = scanned(&tray, &[40.0, 31.0, 5.5], &scanner, seen);
        let (triangles, normals) = (Vec::new(), Vec::new());
        let cloud = from_mesh(TriangleMesh { triangles, normals, ..scan.mesh }, "tray").unwrap();
        fit(&tray, &cloud, &FitOptions::default(), &Silent).unwrap().parameters
    };
    let whole = cloud(&|_| true);
    assert!((whole[1].value - 31.0).abs() < 4.0 * whole[1].sd.expect("it was scanned"), "{whole:?}");
    let cut = cloud(&|p| p.z > 12.0);
    assert!(cut[1].sd.is_none() && cut[2].sd.is_none(), "{cut:?}");
    assert!((cut[0].value - 40.0).abs() < 4.0 * cut[0].sd.expect("its wall was scanned"), "{cut:?}");
}

#[test]
fn what_was_not_scanned_is_not_contradicted() {
    // Half of the vessel: the other half of the model stands where nothing was scanned.
    let result = fitted(&vessel(false), 0.0);
    assert_eq!(result.contradicted, Some(Vec::new()), "{:?}", result.warnings);
}

/// A handle that ends on the wall, and not inside of it where its curve meets the wall's profile once more: as found
/// with a virtual scan on which that explained four outliers more.
#[test]
fn a_handle_does_not_run_on_inside_of_the_wall() {
    let cup = cup();
    let truth = shaped([4.72, 28.8, 72.1, 0.85, 1.79, 0.91, 1.69, 0.05, 0.8]);
    let scan = scanned(&cup, &truth, &scanner(1.15, 0.24, 22), |_| true);
    let result = fit(&cup, &scan, &FitOptions::default(), &Silent).unwrap();
    assert!(result.parameters.iter().skip(6).all(|p| p.sd.is_some()), "{:?}", result.parameters);
    assert!(farthest(&result, &truth) < 4.0, "{:?}", result.parameters);
}

#[test]
fn a_cloud_says_what_is_empty_where_it_has_normals() {
    let mut cloud = vessel(true);
    let normals = cloud.mesh.positions.iter().map(|[x, y, z]| match (x.hypot(*y), *z) {
        (r, z) if r > 29.5 && z > 0.0 => [x / r, y / r, 0.0],
        (r, z) if r > 27.5 && z > 2.5 => [-x / r, -y / r, 0.0],
        (_, z) => [0.0, 0.0, if z > 1.0 { 1.0 } else { -1.0 }],
    });
    cloud.mesh.normals = normals.collect();
    cloud.mesh.triangles.clear();
    let shelf = &fitted(&cloud, 20.0).contradicted.expect("the normals say which side was seen")[0];
    assert!(shelf.part == "shelf_top" && (shelf.area / (PI * 400.0) - 1.0).abs() < 0.05, "{shelf:?}");
    cloud.mesh.normals.clear();
    cloud.oriented = false;
    assert_eq!(fitted(&cloud, 20.0).contradicted, None, "points do not say what is empty");
}

#[test]
fn what_the_scan_leaves_open_has_the_least_surface() {
    // The shelf has no points, and stands in the way of what was seen.
    let options = FitOptions { no_pose: true, start: [("shelf".to_owned(), 20.0)].into(), ..FitOptions::default() };
    let shelf = |options: &FitOptions| {
        fit(&program(VESSEL), &vessel(true), options, &Silent).unwrap().parameters.swap_remove(0)
    };
    let found = shelf(&options);
    assert!(found.value < 0.1 && found.sd.is_none(), "{found:?}");
    let found = shelf(&FitOptions { one_sided: true, ..options });
    assert!(found.value == 20.0 && found.sd.is_none(), "{found:?}");
}

fn cup() -> Program {
    program(include_str!("../../../../examples/cup/cup.gml"))
}

/// The cup's parameters: no pose, and a shape.
fn shaped(shape: [f64; 9]) -> [f64; 15] {
    std::array::from_fn(|k| if k < 6 { 0.0 } else { shape[k - 6] })
}

pub(super) fn scanner(spacing: f64, noise: f64, seed: u64) -> Scanner {
    Scanner { spacing, noise, dropouts: 0.01, holes: 6, seed, ..Scanner::default() }
}

/// An exact scan of a model with the scanner's noise, the triangles whose corners are all on one side.
pub(super) fn scanned(model: &Program, truth: &[f64], scanner: &Scanner, seen: impl Fn(DVec3) -> bool) -> Scan {
    let instance = Model::instantiate(model, truth).unwrap();
    let tessellation = Tessellation::new(model, &*instance, Fineness::default()).unwrap();
    let surface = ExactSurface { instance: &*instance, tessellation: &tessellation, motion: Motion::IDENTITY };
    let mesh = scan_exact(surface, scanner, &Silent).unwrap().mesh;
    let part = mesh.triangles.iter().filter(|t| mesh.corners(**t).iter().all(|p| seen(*p))).copied();
    from_mesh(mesh.submesh(part), "part").unwrap()
}

/// The largest error of the parameters from the seventh on, in standard deviations.
fn farthest(result: &FitResult, truth: &[f64]) -> f64 {
    let off = |(p, truth): (&FittedParameter, &f64)| p.sd.map_or(0.0, |sd| (p.value - truth).abs() / sd);
    result.parameters.iter().zip(truth).skip(6).map(off).fold(0.0, f64::max)
}

/// Half of a tall cup, of which the middle is not the cup's: from the defaults all orientations led elsewhere.
#[test]
fn half_of_an_object_is_found() {
    let cup = cup();
    let truth = shaped([4.65, 52.65, 136.44, 0.87, 1.7, 0.95, 1.85, 0.2, 0.7]);
    let scanner = Scanner { random_pose: false, ..scanner(1.8, 0.1, 17) };
    let scan = scanned(&cup, &truth, &scanner, |p| p.y < 0.0);
    let result = fit(&cup, &scan, &FitOptions::default(), &Silent).unwrap();
    assert!(result.converged && result.inliers > 0.95, "{} {:?}", result.inliers, result.warnings);
    assert!(farthest(&result, &truth) < 4.0, "{:?}", result.parameters);
}

/// A cup without its lower two fifths: other pieces of the handle's curve end on the wall that was not scanned.
#[test]
fn a_hidden_end_has_alternatives_that_the_intervals_hold() {
    let cup = cup();
    let truth = shaped([3.4, 43.3, 133.2, 0.906, 1.906, 0.95, 1.911, 0.2, 0.646]);
    for seed in [20, 21] {
        let scanner = Scanner { random_pose: false, ..scanner(1.5, 0.2, seed) };
        let upper = scanned(&cup, &truth, &scanner, |p| p.z > 53.0);
        let result = fit(&cup, &upper, &FitOptions::default(), &Silent).unwrap();
        assert!(!result.alternatives.is_empty(), "{:?}", result.parameters);
        assert!(result.warnings.iter().any(|w| w.contains("another shape of `handle`")), "{:?}", result.warnings);
        assert!(farthest(&result, &truth) < 4.0, "{:?}", result.parameters);
    }
    let scanner = Scanner { random_pose: false, ..scanner(1.5, 0.2, 16) };
    // All of it was scanned: there is one answer.
    let result = fit(&cup, &scanned(&cup, &truth, &scanner, |_| true), &FitOptions::default(), &Silent).unwrap();
    assert!(result.alternatives.is_empty(), "{:?}", result.alternatives);
    assert!(farthest(&result, &truth) < 4.0, "{:?}", result.parameters);
    let sd = result.parameters[14].sd.expect("it is determined");
    assert!(sd < 0.02, "{sd}");
}

/// An amphora with a wide foot: the first search continues its profile below the scanned base, to a narrow one.
#[test]
fn what_the_scan_contradicts_is_searched_for_once_more() {
    let amphora = program(include_str!("../../../../examples/amphora/amphora.gml"));
    let truth = [
        96.15, 153.06, 141.75, 86.41, 50.64, 288.95, 107.04, 451.9, 18.74, 3.114, 1.842, 163.17, 38.06, 26.85, 13.98,
        24.7,
    ];
    let scanner = Scanner { dropouts: 0.005, ..scanner(6.88, 1.4, 206) };
    let result =
        fit(&amphora, &scanned(&amphora, &truth, &scanner, |_| true), &FitOptions::default(), &Silent).unwrap();
    let off: Vec<f64> = result.parameters.iter().zip(truth).map(|(p, t)| (p.value - t) / p.sd.unwrap()).collect();
    assert!(off.iter().all(|sds| sds.abs() < 4.0), "{off:?}");
    assert_eq!(result.contradicted, Some(Vec::new()), "{:?}", result.warnings);
}

/// A model's parameters fitted to the part of its scan that is seen.
fn fitted_where_seen(
    model: &Program,
    truth: &[f64],
    spacing: f64,
    seen: impl Fn(DVec3) -> bool,
) -> Vec<FittedParameter> {
    let scanner = Scanner { spacing, noise: 0.1, seed: 1, random_pose: false, ..Scanner::default() };
    fit(model, &scanned(model, truth, &scanner, seen), &FitOptions::default(), &Silent).unwrap().parameters
}

/// An L bracket of which one arm was cut off, or its lower end: the face that ends it was not scanned, and the last
/// points beside the cut do not take its place. Its outline is one patch, with the end faces.
#[test]
fn an_end_face_that_was_not_scanned_has_no_place() {
    let bracket = program(
        "use std.polyline (polyline)
        use std.sweep (prism)
        model bracket {
          param a: length in 30mm..120mm = 70mm
          param b: length in 30mm..120mm = 55mm
          param w: length in 10mm..60mm = 30mm
          let body = prism(polyline([(0mm, 0mm), (a, 0mm), (a, 6mm), (10mm, 6mm), (10mm, b), (0mm, b), (0mm, 0mm)]), w)
          part wall = body.wall
          part top = body.top
          part base = body.base
        }",
    );
    let fitted = |seen: &dyn Fn(DVec3) -> bool| {
        let parameters = fitted_where_seen(&bracket, &[75.0, 50.0, 32.0], 1.0, seen);
        parameters.into_iter().map(|p| (p.value, p.sd)).collect::<Vec<_>>()
    };
    let known = |(value, sd): (f64, Option<f64>), truth: f64| (value - truth).abs() < 4.0 * sd.expect("it was scanned");
    let whole = fitted(&|_| true);
    assert!(known(whole[0], 75.0) && known(whole[1], 50.0) && known(whole[2], 32.0), "{whole:?}");
    let one_arm = fitted(&|p| p.x < 45.0);
    assert!(one_arm[0].1.is_none() && known(one_arm[1], 50.0) && known(one_arm[2], 32.0), "{one_arm:?}");
    let upper = fitted(&|p| p.z > 12.0);
    assert!(known(upper[0], 75.0) && known(upper[1], 50.0) && upper[2].1.is_none(), "{upper:?}");
}

/// A cone on a plinth, without its foot: the cone's lower end may slide along its line, whatever else is free.
#[test]
fn an_end_that_slides_along_its_surface_is_not_known_for_what_else_is_free() {
    let pawn = program(
        "use std.polyline (polyline)
        use std.surface (disc, flip, revolve)
        model pawn {
          param total: length in 40mm..120mm = 70mm
          param foot: length in 12mm..35mm = 20mm
          param base: length in 1mm..15mm = 7mm
          part under = flip(disc(foot))
          part body = revolve(polyline([(foot, 0mm), (foot, base), (foot * 0.75, base), (6mm, total), (0mm, total)]))
        }",
    );
    let fitted = |seen: &dyn Fn(DVec3) -> bool| fitted_where_seen(&pawn, &[80.0, 16.0, 10.0], 1.2, seen);
    let whole = fitted(&|_| true);
    assert!(whole.iter().all(|p| p.sd.is_some()) && (whole[1].value - 16.0).abs() < 4.0 * whole[1].sd.unwrap());
    let cut = fitted(&|p| p.z > 14.0);
    assert!(cut.iter().all(|p| p.sd.is_none()), "{cut:?}");
}
