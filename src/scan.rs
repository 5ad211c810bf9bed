//! `gmlc scan`: the virtual laser scanner.

use crate::cli::VirtualScanArgs;
use crate::error::CommandError;
use crate::progress::TerminalProgress;
use crate::script::{Valued, compile_valued};
use crate::{mesh, outputs, provenance};
use gml_runtime::fit::FittedInput;
use gml_runtime::model::{Fineness, Model, Tessellation};
use gml_runtime::simulate::{self, ExactSurface, Scanner, Truth};
use serde::Serialize;
use std::collections::BTreeMap;

/// Points along a large model where no spacing was asked for.
const SPACINGS: f64 = 500.0;

/// The true values that a fit should find.
#[derive(Serialize)]
struct TruthFile<'a> {
    /// Name of the model.
    model: &'a str,
    /// The script.
    script: String,
    /// The file of the scan, in the result on standard output.
    #[serde(skip_serializing_if = "Option::is_none")]
    output: Option<String>,
    /// SHA-256 of the script's text and of what it uses.
    script_sha256: String,
    /// Its inputs, with the values that it was compiled with.
    inputs: Vec<FittedInput>,
    /// Its parameters, in millimetres and radians.
    parameters: BTreeMap<&'a str, f64>,
    /// The scanner, and the pose that it added.
    #[serde(flatten)]
    scan: &'a Truth,
}

pub(crate) fn run(args: &VirtualScanArgs) -> Result<(), CommandError> {
    for output in [&args.output].into_iter().chain(&args.truth) {
        let inputs = outputs::inputs([&args.script.model], args.values.params.as_ref());
        outputs::require_apart(output, inputs)?;
    }
    args.json.require_apart(&args.output)?;
    let format = mesh::format_of(&args.output, args.format.as_deref(), ".obj, .ply or .stl")?;
    outputs::require_files([&args.output].into_iter().chain(&args.truth))?;
    let valued = compile_valued(&args.script.model, &args.script.compile, &args.values)?;
    valued.warn_of_doubt();
    let Valued { program, x, motion, .. } = valued;
    for output in [&args.output].into_iter().chain(&args.truth) {
        outputs::require_apart_from_scripts(output, &program)?;
    }
    outputs::require_two(Some(&args.output), args.truth.as_ref())?;
    let instance = Model::instantiate(&program, &x).map_err(CommandError::failed)?;
    let progress = TerminalProgress::new();
    // A spacing that takes too many rays would take too many triangles first: coarse ones tell the size.
    let coarse = Fineness { chord: f64::INFINITY, max_segments: 16, ..Fineness::default() };
    let coarse = Tessellation::with_progress(&program, &*instance, coarse, &progress).map_err(CommandError::failed)?;
    let size = coarse.mesh.bounds().diagonal();
    let scanner = scanner(args, size);
    simulate::require_affordable(&scanner, size).map_err(CommandError::failed)?;
    // Facets say which part of the surface a ray meets, and what hides it: a silhouette may be off by this.
    let fineness = Fineness { chord: 0.02 * scanner.spacing, ..Fineness::default() };
    let mut tessellation =
        Tessellation::with_progress(&program, &*instance, fineness, &progress).map_err(CommandError::failed)?;
    motion.move_tessellation(&mut tessellation);
    let surface = ExactSurface { tessellation: &tessellation, instance: &*instance, motion };
    let scan = simulate::scan_exact(surface, &scanner, &progress);
    progress.finish();
    let scan = scan.map_err(CommandError::failed)?;
    outputs::make_parents([&args.output].into_iter().chain(&args.truth))?;
    mesh::write(&args.output, &scan.mesh, format)?;
    let parameters = program.parameters().iter().map(|p| p.name.as_str()).zip(x).collect();
    let mut truth = TruthFile {
        model: program.name(),
        script: args.script.model.display().to_string(),
        output: None,
        script_sha256: provenance::sha256(program.sources()),
        inputs: program.inputs().iter().map(provenance::input).collect(),
        parameters,
        scan: &scan.truth,
    };
    if let Some(path) = &args.truth {
        outputs::write_json(path, &truth)?;
    }
    truth.output = outputs::named(&args.output);
    let line = format!(
        "{}: {} points, {} triangles, {:.1} % of the surface",
        args.output.display(),
        scan.truth.points,
        scan.truth.triangles,
        scan.truth.coverage * 100.0
    );
    args.json.print(&args.output, &serde_json::to_value(&truth).map_err(CommandError::failed)?, &line);
    Ok(())
}

/// The scanner of the options, for a model of a size in millimetres. Without --spacing, the spacing is one with which a
/// scan takes seconds, also of something as large as a house.
fn scanner(args: &VirtualScanArgs, size: f64) -> Scanner {
    let default = Scanner::default();
    let usual = default.spacing.max(size / SPACINGS);
    Scanner {
        views: args.views as usize,
        spacing: args.spacing.unwrap_or(usual),
        noise: args.noise,
        outliers: args.outliers,
        dropouts: args.dropouts,
        holes: args.holes as usize,
        random_pose: !args.no_pose,
        seed: args.seed,
        ..default
    }
}
