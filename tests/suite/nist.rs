//! Fits against NIST's reference data: nonlinear regression (StRD), and least-squares surfaces (pairs of points and
//! fits).

use crate::support::nist as strd;
use crate::support::{root, test_data};
use gml_compiler::check::InputValue;
use gml_compiler::program::{Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use gml_runtime::fit::{FitOptions, FitResult, LossKind, fit};
use gml_runtime::mesh::TriangleMesh;
use gml_runtime::model::Motion;
use gml_runtime::progress::Silent;
use gml_runtime::scan::{Scan, ScanSource};
use std::path::Path;

/// Problems of the higher level of difficulty that are not solved from the first, distant start: there the valleys of
/// the sum of squares lead elsewhere (BoxBOD), or are longer than the steps allow (MGH10).
const FAR: [&str; 2] = ["BoxBOD", "MGH10"];

#[test]
fn regressions_have_the_certified_digits_from_both_starts() {
    let Some(data) = test_data() else { return };
    let mut failed = Vec::new();
    for entry in std::fs::read_dir(data.join("nist-strd")).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        let script = root().join(format!("tests/nist/{name}.gml"));
        if !script.is_file() {
            continue;
        }
        for (start, d) in strd::compare(&script, &path).unwrap_or_else(|e| panic!("{e}")).into_iter().enumerate() {
            // Eleven digits are certified. The condition of the worst of these problems costs the parameters two or
            // three of sixteen digits, and their standard deviations twice as many.
            let far = start == 0 && FAR.contains(&name.as_str());
            let agrees = d.parameters >= 8.0 && d.deviations >= 6.0 && d.sum_of_squares >= 8.0;
            if !far && !agrees {
                failed.push(format!("{name} from start {}: {d:?}", start + 1));
            }
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn a_reference_file_is_read_and_another_refused() {
    let text = "Model: y = b1*x\n  b1 =   1  2  3.5E+00  0.5E+00\nResidual Sum of Squares:  0.25\n\nData:   y   x\n 1.0 2.0\n 3.0 4.0\n";
    let reference = strd::parse(text).expect("a reference");
    assert_eq!((reference.starts, reference.certified), ([vec![1.0], vec![2.0]], vec![3.5]));
    assert_eq!((reference.observations.len(), reference.observations[1].u, reference.sum_of_squares), (2, 4.0, 0.25));
    assert!(strd::parse("no data at all").is_err());
    assert!((strd::digits(1.000_001, 1.0) - 6.0).abs() < 1e-6);
}

fn program(name: &str, reach: f64) -> Program {
    let path = root().join(format!("tests/nist/{name}.gml"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let source = SourceFile { name: path.display().to_string(), text };
    let inputs = [("reach".to_owned(), InputValue::Real(reach))].into();
    compile(source, &NoFiles, &Options { inputs, ..Options::default() }).unwrap_or_else(|e| panic!("{e}")).program
}

fn numbers(path: &Path) -> Vec<f64> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    text.split_whitespace().map(|t| t.parse().expect("a number")).collect()
}

/// The orthogonal least-squares fit of a script to a file of points, without a start value for the pose.
fn surface(name: &str, points: &Path) -> (FitResult, Motion) {
    let positions: Vec<[f64; 3]> = numbers(points)[1..].chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    let n = positions.len() as f64;
    let centre = [0, 1, 2].map(|k| positions.iter().map(|p| p[k]).sum::<f64>() / n);
    let spread = positions.iter().map(|p| dot(from(centre, *p), from(centre, *p))).sum::<f64>() / n;
    let mesh = TriangleMesh { positions, ..TriangleMesh::default() };
    let scan = Scan {
        mesh,
        attributes: Default::default(),
        oriented: false,
        source: ScanSource::default(),
        noise: 0.0,
        warnings: Vec::new(),
    };
    let mut options = FitOptions::default();
    options.loss = LossKind::Squared;
    let result = fit(&program(name, spread.sqrt()), &scan, &options, &Silent).unwrap_or_else(|e| panic!("{e}"));
    let pose = result.pose.expect("the scripts have no pose of their own");
    (result, pose)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn from(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [b[0] - a[0], b[1] - a[1], b[2] - a[2]]
}

/// The sine of the angle between two lines.
fn sine(a: [f64; 3], b: [f64; 3]) -> f64 {
    let c = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    dot(c, c).sqrt()
}

/// The distance of a point from a line.
fn off_line(p: [f64; 3], at: [f64; 3], direction: [f64; 3]) -> f64 {
    let d = from(at, p);
    let along = dot(d, direction);
    [0, 1, 2].map(|k| d[k] - along * direction[k]).iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// Fits every file of a kind; `check` compares the reference's numbers with the fit and the model's z axis.
fn each(script: &str, kind: &str, check: impl Fn(&[f64], &FitResult, &Motion, [f64; 3]) -> Vec<(f64, f64)>) {
    let Some(data) = test_data() else { return };
    for entry in std::fs::read_dir(data.join("nist-l2")).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if !(name.starts_with(kind) && name.ends_with(".ds")) {
            continue;
        }
        let (found, pose) = surface(script, &path);
        let axis = from(pose.point([0.0; 3]), pose.point([0.0, 0.0, 1.0]));
        for (off, size) in check(&numbers(&path.with_extension("fit")), &found, &pose, axis) {
            // The certified fits have twenty digits; gmlc promises 1e-8 of the size.
            assert!(off.abs() < 1e-8 * size, "{name}: off by {off:e}\n{found:?}");
        }
    }
}

#[test]
fn spheres_are_those_of_the_reference() {
    each("sphere", "sph", |fit, found, pose, _| {
        let centre = from([fit[0], fit[1], fit[2]], pose.point([0.0; 3]));
        let d = fit[3];
        vec![(dot(centre, centre).sqrt(), d), (2.0 * found.parameters[0].value - d, d)]
    });
}

#[test]
fn cylinders_are_those_of_the_reference() {
    each("cylinder", "cyl", |fit, found, pose, axis| {
        let direction = [fit[3], fit[4], fit[5]];
        let d = fit[6];
        vec![
            (sine(axis, direction), 1.0),
            (off_line(pose.point([0.0; 3]), [fit[0], fit[1], fit[2]], direction), d),
            (2.0 * found.parameters[0].value - d, d),
        ]
    });
}

#[test]
fn planes_are_those_of_the_reference() {
    each("plane", "pla", |fit, _, pose, axis| {
        let normal = [fit[3], fit[4], fit[5]];
        let off = dot(from([fit[0], fit[1], fit[2]], pose.point([0.0; 3])), normal);
        vec![(sine(axis, normal), 1.0), (off, 10.0)]
    });
}

#[test]
fn cones_are_those_of_the_reference() {
    each("cone", "con", |fit, found, pose, axis| {
        let (at, direction) = ([fit[0], fit[1], fit[2]], [fit[3], fit[4], fit[5]]);
        let (r, half) = (found.parameters[0].value, found.parameters[1].value);
        let origin = pose.point([0.0; 3]);
        let along = dot(from(origin, at), axis);
        vec![
            (sine(axis, direction), 1.0),
            (off_line(origin, at, direction), fit[6]),
            (2.0 * half.to_degrees() - fit[7], fit[7]),
            ((r + along * half.tan()) * half.cos() - fit[6], fit[6]),
        ]
    });
}
