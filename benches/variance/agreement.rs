//! Whether gmlc's distances are those of Open3D, libigl and CloudCompare on the same meshes. The built command makes
//! the meshes, of examples and virtual scans of them, and of the paper's cup where there is data; what is measured with
//! the mutual test and without goes into files, and benches/variance/agreement.py compares it with the others.

use super::write_doubles;
use gml_runtime::progress::Silent;
use gml_runtime::scan::{self, Scan, Unit};
use gml_runtime::variance::{
    Device, DistanceKind, Matching, MeasureOptions, Measurement, Reference, Resolution, measure,
};
use std::error::Error;
use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

/// Examples whose virtual scans are compared: one with sharp edges and holes, one with a thread, and one with thin
/// walls whose mesh is open, where the handle ends in the wall.
const EXAMPLES: [&str; 3] = ["flange", "jar", "mug"];

/// Options of the virtual scans: coarser than by default, because libigl takes rays by trying all triangles.
const SCANNER: [&str; 6] = ["--spacing", "1.5mm", "--seed", "1", "--no-pose", "-o"];

/// Side of the texture in texels.
const SIDE: u32 = 256;

/// Compares all cases with the packages of a Python.
pub(super) fn run(python: &OsString, data: Option<&Path>) -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let mut cases = Vec::new();
    for name in EXAMPLES {
        let case = folder.path().join(name);
        let (model, scan) = (case.join("model.ply"), case.join("scan.ply"));
        let script = format!("{}/examples/{name}/{name}.gml", env!("CARGO_MANIFEST_DIR"));
        gmlc(&["mesh", &script, "-o"], &model)?;
        gmlc(&[&["scan", script.as_str()], &SCANNER[..]].concat(), &scan)?;
        cases.push((case, model, scan));
    }
    match data {
        Some(data) => {
            let case = folder.path().join("cup");
            let (model, scan) = (case.join("model.ply"), data.join("cup_scan.ply"));
            let script = format!("{}/examples/cup/cup.gml", env!("CARGO_MANIFEST_DIR"));
            let program = super::cup()?;
            let values = program.parameters().iter().zip(super::true_parameters(&program, data)?);
            let values: Vec<String> =
                values.map(|(p, value)| format!("{}={}", p.name, p.quantity.shown(value))).collect();
            let values = values.iter().flat_map(|value| ["-p", value.as_str()]);
            let words: Vec<&str> = ["mesh", &script].into_iter().chain(values).chain(["-o"]).collect();
            gmlc(&words, &model)?;
            cases.push((case, model, scan));
        }
        None => println!("the cup's scan is left out: GMLC_TEST_DATA is not set"),
    }
    let mut peers = Command::new(python);
    peers.arg(concat!(env!("CARGO_MANIFEST_DIR"), "/benches/variance/agreement.py"));
    for (case, model, scan) in &cases {
        write(case, model, scan)?;
        peers.arg(case).arg(model).arg(scan);
    }
    match peers.status()? {
        status if status.success() => Ok(()),
        status => Err(format!("the peers' script ended with {status}").into()),
    }
}

/// Runs the built command, which says what it writes.
fn gmlc(words: &[&str], output: &Path) -> Result<(), Box<dyn Error>> {
    let made = Command::new(env!("CARGO_BIN_EXE_gmlc")).args(words).arg(output).output()?;
    if !made.status.success() {
        return Err(format!("gmlc {}: {}", words.join(" "), String::from_utf8_lossy(&made.stderr)).into());
    }
    Ok(())
}

/// Writes what is measured from a model's mesh to a scan. All files but `case.json` are rows of doubles:
/// `points.bin` has position, normal and distance of every point of the scan from the model's mesh; `texels.bin`
/// position, normal and area of every texel; `closest.bin` and `normal.bin` a texel's distances outwards and inwards
/// without the mutual test, and its signed distance with it.
fn write(folder: &Path, model: &Path, scan: &Path) -> Result<(), Box<dyn Error>> {
    let model = scan::read_mesh(model, Some(Unit::Mm))?.mesh;
    let scan = scan::read(scan, &Unit::Mm.into(), &Silent)?;
    let measured = |distance, matching| -> Result<Measurement, Box<dyn Error>> {
        let mut options = MeasureOptions::default();
        options.resolution = Resolution::Side(SIDE);
        options.device = Device::Cpu;
        (options.distance, options.matching) = (distance, matching);
        Ok(measure(Reference::Mesh(&model), &scan, None, &options, &Silent)?)
    };
    let mut refused = Vec::new();
    for (name, distance) in [("closest", DistanceKind::Closest), ("normal", DistanceKind::Normal)] {
        let (all, mutual) = (measured(distance, Matching::All)?, measured(distance, Matching::Mutual)?);
        let rows = (0..all.deviations.texels.len()).flat_map(|i| {
            let (all, mutual) = (&all.deviations, &mutual.deviations);
            [all.outward[i], all.inward[i], mutual.signed(i)].map(f64::from)
        });
        write_doubles(&folder.join(format!("{name}.bin")), rows)?;
        refused.push(mutual.report.overall.ambiguous_area);
        if distance == DistanceKind::Normal {
            write_places(folder, &scan, &all)?;
            let deviations = &all.deviations;
            let case = serde_json::json!({
                "refused": refused,
                "max_distance": deviations.max_distance,
                "precision": deviations.precision,
                "oriented": scan.oriented,
                "triangles": scan.mesh.triangles.len(),
                "buried": (0..deviations.texels.len()).filter(|i| deviations.is_buried(*i)).collect::<Vec<_>>(),
            });
            std::fs::write(folder.join("case.json"), case.to_string())?;
        }
    }
    Ok(())
}

fn write_places(folder: &Path, scan: &Scan, measured: &Measurement) -> std::io::Result<()> {
    let texels = &measured.deviations.texels;
    let texel = |i: usize| {
        let [x, y, z] = texels.normal[i].map(f64::from);
        texels.position[i].into_iter().chain([x, y, z, f64::from(texels.area[i])])
    };
    write_doubles(&folder.join("texels.bin"), (0..texels.len()).flat_map(texel))?;
    let points = &measured.points;
    let point = |i: usize| {
        let distance = points.distances[i].map_or(f64::NAN, |measured| measured.distance);
        points.positions[i].into_iter().chain(scan.mesh.normals[i]).chain([distance])
    };
    write_doubles(&folder.join("points.bin"), (0..points.positions.len()).flat_map(point))
}
