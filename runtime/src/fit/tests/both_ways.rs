//! What the model has and the scan does not.

use crate::fit::{FitOptions, FitResult, fit};
use crate::mesh::TriangleMesh;
use crate::model::{Fineness, Model, Motion, Tessellation};
use crate::progress::Silent;
use crate::scan::{Scan, from_mesh};
use crate::simulate::{ExactSurface, Scanner, scan_exact};
use gml_compiler::program::{Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use std::f64::consts::PI;

fn program(text: &str) -> Program {
    let script = SourceFile { name: "m.gml".to_owned(), text: text.to_owned() };
    compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program
}

/// A vessel of 30 mm radius, 60 mm high, with walls of 2 mm, and a shelf inside that may have no radius.
const VESSEL: &str = "use std.surface (revolve, flip)
    model vessel {
      param shelf: length in 0mm..40mm = 0mm
      part outside = revolve(|t| (30mm, 60mm * t))
      part inside = flip(revolve(|t| (28mm, 2mm + 58mm * t)))
      part rim = revolve(|t| (30mm - 2mm * t, 60mm))
      part floor = flip(revolve(|t| (28mm * t, 2mm)))
      part foot = revolve(|t| (30mm * t, 0mm))
      part shelf_top = flip(revolve(|t| (shelf * t, 30mm)))
    }";

/// The vessel's surface without the shelf, on one side of a plane through its axis or on both.
fn vessel(whole: bool) -> Scan {
    let program = program(VESSEL);
    let instance = Model::instantiate(&program, &[0.0]).unwrap();
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

#[test]
fn what_was_not_scanned_is_not_contradicted() {
    // Half of the vessel: the other half of the model stands where nothing was scanned.
    let result = fitted(&vessel(false), 0.0);
    assert_eq!(result.contradicted, Some(Vec::new()), "{:?}", result.warnings);
    let mut cloud = vessel(true);
    cloud.mesh.triangles.clear();
    assert_eq!(fitted(&cloud, 20.0).contradicted, None, "points do not say what is empty");
}

/// A handle that ends on the wall, and not inside of it where its curve meets the wall's profile once more: as found
/// with a virtual scan on which that explained four outliers more.
#[test]
fn a_handle_does_not_run_on_inside_of_the_wall() {
    let cup = program(include_str!("../../../../examples/cup/cup.gml"));
    let truth = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 4.72, 28.8, 72.1, 0.85, 1.79, 0.91, 1.69, 0.05, 0.8];
    let instance = Model::instantiate(&cup, &truth).unwrap();
    let tessellation = Tessellation::new(&cup, &*instance, Fineness::default()).unwrap();
    let scanner = Scanner { spacing: 1.15, noise: 0.24, dropouts: 0.01, holes: 6, seed: 22, ..Scanner::default() };
    let surface = ExactSurface { instance: &*instance, tessellation: &tessellation, motion: Motion::IDENTITY };
    let scan = from_mesh(scan_exact(surface, &scanner, &Silent).unwrap().mesh, "cup").unwrap();
    let result = fit(&cup, &scan, &FitOptions::default(), &Silent).unwrap();
    for (p, truth) in result.parameters.iter().zip(truth).skip(6) {
        let sd = p.sd.expect("it is determined");
        assert!((p.value - truth).abs() < 4.0 * sd, "{}: {} +- {sd}, not {truth}", p.name, p.value);
    }
}
