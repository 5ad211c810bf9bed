//! `gmlc scan`: the virtual scanner.

use crate::cli::VirtualScanArgs;
use crate::error::CommandError;
use crate::progress::TerminalProgress;
use crate::script::{Valued, compile_valued};
use crate::{convert, outputs, provenance, scanner};
use gml_compiler::program::Program;
use gml_runtime::export::scan::{Recorded, ScanFormat};
use gml_runtime::fit::FittedInput;
use gml_runtime::model::{Closedness, Fineness, Model, Motion, Passages, Tessellation};
use gml_runtime::progress::Progress;
use gml_runtime::scan::{self, Attributes, ReferenceMesh, Unit};
use gml_runtime::simulate::{self, ExactSurface, Kind, Truth, VirtualScan};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// The true values that a fit should find.
#[derive(Serialize)]
struct TruthFile<'a> {
    #[serde(flatten)]
    scanned: Scanned<'a>,
    /// The file of the scan, in the result on standard output.
    #[serde(skip_serializing_if = "Option::is_none")]
    output: Option<String>,
    /// The scanner, and the pose that it added.
    #[serde(flatten)]
    scan: &'a Truth,
}

/// What was scanned.
#[derive(Serialize)]
#[serde(untagged)]
enum Scanned<'a> {
    Script {
        /// Name of the model.
        model: &'a str,
        /// The script.
        script: String,
        /// SHA-256 of the script's text and of what it uses.
        script_sha256: String,
        /// Its inputs, with the values that it was compiled with.
        inputs: Vec<FittedInput>,
        /// Its parameters, in millimetres and radians.
        parameters: BTreeMap<&'a str, f64>,
    },
    Mesh {
        /// Its file.
        mesh: String,
        /// The unit of its coordinates.
        unit: String,
    },
}

pub(crate) fn run(args: &VirtualScanArgs) -> Result<(), CommandError> {
    for output in [&args.output].into_iter().chain(&args.truth) {
        outputs::require_apart(output, outputs::inputs([&args.model], args.values.params.as_ref()))?;
    }
    args.json.require_apart(&args.output)?;
    let format = convert::format_of(&args.output, args.format)?;
    scanner::require_used(args, format)?;
    outputs::require_files([&args.output].into_iter().chain(&args.truth))?;
    outputs::require_two(Some(&args.output), args.truth.as_ref())?;
    if is_script(&args.model) { of_script(args, format) } else { of_mesh(args, format) }
}

/// What has not the name of a mesh is a script.
fn is_script(path: &Path) -> bool {
    path.extension().is_none_or(|ending| ending.eq_ignore_ascii_case("gml"))
}

fn of_script(args: &VirtualScanArgs, format: ScanFormat) -> Result<(), CommandError> {
    if args.mesh_unit.is_some() {
        return Err(CommandError::usage("--mesh-unit: the model is a script, which states its units itself"));
    }
    let valued = compile_valued(&args.model, &args.compile, &args.values)?;
    valued.warn_of_doubt();
    let Valued { program, x, motion, .. } = valued;
    for output in [&args.output].into_iter().chain(&args.truth) {
        outputs::require_apart_from_scripts(output, &program)?;
    }
    let progress = TerminalProgress::new();
    let scan = scan_script(args, &program, &x, motion, &progress);
    progress.finish();
    warn_of_passages(&program, &x)?;
    let parameters = program.parameters().iter().map(|p| p.name.as_str()).zip(x).collect();
    let scanned = Scanned::Script {
        model: program.name(),
        script: args.model.display().to_string(),
        script_sha256: provenance::sha256(program.sources()),
        inputs: program.inputs().iter().map(provenance::input).collect(),
        parameters,
    };
    write(args, format, &scan?, scanned)
}

/// Says where walls of the model pass through each other: the scan shows what no real object has.
fn warn_of_passages(program: &Program, x: &[f64]) -> Result<(), CommandError> {
    let passages = || {
        let instance = Model::instantiate(program, x)?;
        Passages::with_tessellation(program, &*instance, &Closedness::tessellation(program, &*instance)?)
    };
    if let Some(passages) = passages().map_err(CommandError::failed)? {
        eprintln!("warning: {}: the scan shows what no real object has", passages.sentence());
    }
    Ok(())
}

/// Scans a script's exact surface.
pub(crate) fn scan_script(
    args: &VirtualScanArgs,
    program: &Program,
    x: &[f64],
    motion: Motion,
    progress: &dyn Progress,
) -> Result<VirtualScan, CommandError> {
    let instance = Model::instantiate(program, x).map_err(|error| CommandError::failed(program.placed(error, x)))?;
    // A spacing that takes too many rays would take too many triangles first: coarse ones tell the size.
    let coarse = Fineness { chord: f64::INFINITY, max_segments: 16, ..Fineness::default() };
    let coarse = Tessellation::with_progress(program, &*instance, coarse, progress).map_err(CommandError::failed)?;
    let size = coarse.mesh.bounds().diagonal();
    let scanner = scanner::of(args, size);
    simulate::require_affordable(&scanner, size).map_err(CommandError::failed)?;
    // Facets say which part of the surface a ray meets, and what hides it: a silhouette may be off by this.
    let fineness = Fineness { chord: 0.02 * scanner.spacing, ..Fineness::default() };
    let mut tessellation =
        Tessellation::with_progress(program, &*instance, fineness, progress).map_err(CommandError::failed)?;
    motion.move_tessellation(&mut tessellation);
    let surface = ExactSurface { tessellation: &tessellation, instance: &*instance, motion };
    simulate::scan_exact(surface, &scanner, progress).map_err(CommandError::failed)
}

fn of_mesh(args: &VirtualScanArgs, format: ScanFormat) -> Result<(), CommandError> {
    let of_scripts = [
        ("-p", !args.values.values.is_empty()),
        ("--params", args.values.params.is_some()),
        ("--input", !args.compile.inputs.is_empty()),
        ("--limit", !args.compile.limits.is_empty()),
        ("--allow-path", !args.compile.allowed.is_empty()),
    ];
    if let Some((option, _)) = of_scripts.into_iter().find(|(_, is_given)| *is_given) {
        let path = args.model.display();
        return Err(CommandError::usage(format!("{option}: {path} is a mesh, which has no parameters; leave it out")));
    }
    let ReferenceMesh { mesh, unit, warnings, .. } =
        scan::read_mesh(&args.model, args.mesh_unit).map_err(CommandError::failed)?;
    warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    let scanner = scanner::of(args, mesh.bounds().diagonal());
    let progress = TerminalProgress::new();
    let scan = simulate::scan(&mesh, &scanner, &progress);
    progress.finish();
    let scan = scan.map_err(CommandError::failed)?;
    write(args, format, &scan, Scanned::Mesh { mesh: args.model.display().to_string(), unit })
}

/// Writes a scan and its truth.
fn write(
    args: &VirtualScanArgs,
    format: ScanFormat,
    scan: &VirtualScan,
    scanned: Scanned<'_>,
) -> Result<(), CommandError> {
    let truth = &scan.truth;
    outputs::make_parents([&args.output].into_iter().chain(&args.truth))?;
    write_scan(args, format, scan)?;
    let mut file = TruthFile { scanned, output: None, scan: truth };
    if let Some(path) = &args.truth {
        outputs::write_json(path, &file)?;
    }
    file.output = outputs::named(&args.output);
    let line = format!("{}: {}", args.output.display(), summary(truth, format));
    args.json.print(&args.output, &serde_json::to_value(&file).map_err(CommandError::failed)?, &line);
    Ok(())
}

/// Writes a scan, and warns of what its format cannot hold.
pub(crate) fn write_scan(args: &VirtualScanArgs, format: ScanFormat, scan: &VirtualScan) -> Result<(), CommandError> {
    let VirtualScan { mesh, attributes, grids, .. } = scan;
    // A mesh has what a fit requires, and no more.
    let bare = Attributes::default();
    let is_cloud = mesh.triangles.is_empty() || format.is_of_points();
    let attributes = if is_cloud { attributes } else { &bare };
    let unit = args.unit.unwrap_or_default();
    outputs::write_scan(&args.output, &Recorded { mesh, attributes, grids, unit }, format)?;
    if let Some(warning) = other_unit(args.unit, format) {
        eprintln!("warning: {}: {warning}", args.output.display());
    }
    if !attributes.stations.places.is_empty() && !format.holds(mesh, attributes).stations {
        eprintln!(
            "warning: {}: the format has no room for the places of the scanner, which tell the outer side of a surface: \
             they are left out; .e57 and .ptx have it",
            args.output.display()
        );
    }
    Ok(())
}

/// What a scan has, in words.
fn summary(truth: &Truth, format: ScanFormat) -> String {
    let mut parts = vec![format!("{} points", truth.points)];
    if truth.triangles > 0 && !format.is_of_points() {
        parts.push(format!("{} triangles", truth.triangles));
    }
    if truth.triangles == 0 && !truth.stations.is_empty() {
        parts.push(match truth.stations.len() {
            1 => "1 station".to_owned(),
            count => format!("{count} stations"),
        });
    }
    if truth.scanner.kind != Kind::Ct {
        parts.push(format!("{:.1} % of the surface", truth.coverage * 100.0));
    }
    parts.join(", ")
}

/// A sentence on a unit that a format does not have.
fn other_unit(given: Option<Unit>, format: ScanFormat) -> Option<String> {
    let given = given.filter(|unit| format.has_metres() && *unit != Unit::M)?;
    Some(format!("the coordinates of this format are metres: --unit {given} was not taken"))
}
