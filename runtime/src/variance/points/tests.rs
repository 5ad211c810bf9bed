//! Distances of points that were placed at known ones.

use crate::mesh::TriangleMesh;
use crate::model::{Fineness, Model, Motion, Tessellation};
use crate::progress::Silent;
use crate::scan::{Scan, from_mesh};
use crate::variance::{MeasureOptions, PointDistances, Reference, Resolution, measure};
use glam::DVec3;
use gml_compiler::program::{Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};

const CAN: &str = "use std.surface (cylinder)\nmodel can { param r: length = 20mm\npart side = cylinder(r, 50mm) }";

fn compiled(text: &str) -> Program {
    let script = SourceFile { name: "can.gml".to_owned(), text: text.to_owned() };
    compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program
}

/// The vertices of the can's side at another radius are exactly there, and its chords are not.
fn at_radius(program: &Program, r: f64) -> TriangleMesh {
    let instance = Model::instantiate(program, &[r]).expect("it exists");
    Tessellation::new(program, &*instance, Fineness { chord: 0.2, ..Fineness::default() }).expect("it is finite").mesh
}

fn points(reference: Reference<'_>, scan: &Scan, max_distance: f64) -> PointDistances {
    let resolution = Resolution::Side(128);
    let options = MeasureOptions { resolution, max_distance: Some(max_distance), ..MeasureOptions::default() };
    let measured = measure(reference, scan, None, &options, &Silent).expect("a measurement");
    let points = measured.report.points.expect("points");
    assert_eq!(measured.points.distances.iter().flatten().count(), points.overall.measured);
    assert_eq!(measured.points.distances.len(), points.points);
    assert_eq!(points.points, points.overall.measured + points.beyond + points.facing_away);
    points
}

#[test]
fn vertices_of_a_larger_cylinder_are_off_by_the_difference_although_its_chords_are_not() {
    let program = compiled(CAN);
    let scan = from_mesh(at_radius(&program, 20.7), "scan").expect("a scan");
    let reference = Reference::Model { model: &program, x: &[20.0], motion: Motion::IDENTITY };
    let found = points(reference, &scan, 3.0);
    let signed = &found.overall.moments.signed;
    // Statistics are of distances in single precision.
    assert!((signed.mean - 0.7).abs() < 1e-6 && signed.sd < 1e-6 && (signed.min - 0.7).abs() < 1e-6, "{signed:?}");
    assert_eq!((found.beyond, found.facing_away, found.share), (0, 0, 1.0));
    assert_eq!(found.parts.len(), 1);
    // From the mesh of that cylinder the same points are as far off as its chords leave them, or farther.
    let reference = at_radius(&program, 20.0);
    let meshed = points(Reference::Mesh(&reference), &scan, 3.0);
    let signed = &meshed.overall.moments.signed;
    assert!(signed.min > 0.7 - 1e-6 && signed.max < 0.7 + 0.2 + 1e-6, "{signed:?}");
}

#[test]
fn points_that_have_no_distance_are_counted_by_their_reason() {
    let program = compiled(CAN);
    let instance = Model::instantiate(&program, &[20.5]).expect("it exists");
    let mut mesh = Tessellation::uniform(&program, &*instance, 120, 50).expect("it is finite").mesh;
    let good = mesh.positions.len();
    let mut add = |corners: [DVec3; 3]| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners.map(|c| c.to_array()));
        mesh.triangles.push([first, first + 1, first + 2]);
    };
    // It is dense enough that noise is told from shape. A sheet 9.5 mm beside the side, and one 1 mm inside of it that
    // faces the axis.
    let [y, z] = [DVec3::Y, DVec3::Z];
    let at = DVec3::new(30.0, 0.0, 20.0);
    add([at, at + y, at + z]);
    let at = DVec3::new(19.0, 0.0, 20.0);
    add([at, at + z, at + y]);
    mesh.normals.clear();
    mesh.groups.clear();
    let scan = from_mesh(mesh, "scan").expect("a scan");
    // Vertices along the seam are one.
    let good = good.min(scan.mesh.positions.len() - 6);
    let reference = Reference::Model { model: &program, x: &[20.0], motion: Motion::IDENTITY };
    let found = points(reference, &scan, 3.0);
    assert_eq!((found.overall.measured, found.beyond, found.facing_away), (good, 3, 3));
    let largest = found.overall.largest.expect("one");
    assert!((largest.distance - 0.5).abs() < 1e-9 && largest.part == "side", "{largest:?}");
    let found = points(reference, &scan, 12.0);
    assert_eq!((found.beyond, found.facing_away), (0, 3));
    let largest = found.overall.largest.expect("one");
    // The corner (30, 1, 20) and its neighbours.
    assert!((largest.distance - (30f64.hypot(1.0) - 20.0)).abs() < 1e-9, "{largest:?}");
    assert_eq!(largest.place, [30.0, 1.0, 20.0]);
}
