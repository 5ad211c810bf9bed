//! `gmlc mesh`.

use crate::cli::MeshArgs;
use crate::error::CommandError;
use crate::outputs;
use crate::picture::{self, Framing};
use crate::progress::TerminalProgress;
use crate::script::{Valued, compile_valued};
use gml_compiler::program::Program;
use gml_runtime::export::mesh::{self, MeshFormat};
use gml_runtime::mesh::TriangleMesh;
use gml_runtime::model::{Atlas, Fineness, Model, Motion, Passages, Tessellation};
use std::path::Path;

/// Texels per side of the atlas whose texture coordinates a mesh has.
const ATLAS: u32 = 1024;

/// Default of the largest distance between a mesh and the exact surface. Millimetres.
const CHORD: f64 = 0.02;

/// The most triangles of a mesh whose chord was asked for: some gigabytes.
const MOST_TRIANGLES: usize = 10_000_000;

pub(crate) fn run(args: &MeshArgs) -> Result<(), CommandError> {
    // Errors in the command line are reported before any work is done.
    framing(args)?;
    outputs::require_apart(&args.output, outputs::inputs([&args.script.model], args.values.params.as_ref()))?;
    let valued = compile_valued(&args.script.model, &args.script.compile, &args.values)?;
    valued.warn_of_doubt();
    let Valued { program, x, motion, .. } = valued;
    write_model(args, &program, &x, &motion)
}

/// Writes the moved surface of a model at x.
pub(crate) fn write_model(args: &MeshArgs, program: &Program, x: &[f64], motion: &Motion) -> Result<(), CommandError> {
    let framing = framing(args)?;
    outputs::require_apart_from_scripts(&args.output, program)?;
    let instance = Model::instantiate(program, x).map_err(CommandError::failed)?;
    let chord = match (args.chord, &framing) {
        (Some(chord), _) => chord,
        (None, Some(framing)) => framing.chord(program, &*instance).map_err(CommandError::failed)?,
        (None, None) => CHORD,
    };
    let mut fineness = Fineness { chord, ..Fineness::default() };
    if args.chord.is_some() {
        fineness.max_triangles = MOST_TRIANGLES;
    }
    let progress = TerminalProgress::new();
    let tessellation = Tessellation::with_progress(program, &*instance, fineness, &progress);
    progress.finish();
    let mut tessellation = tessellation.map_err(CommandError::failed)?;
    motion.move_tessellation(&mut tessellation);
    if let Some(framing) = framing {
        outputs::make_parent(&args.output)?;
        framing.write(&args.output, &tessellation)?;
        outputs::wrote(&args.output);
        let parts = tessellation.mesh.groups.len();
        println!("{}: {} x {} pixels, {parts} parts", args.output.display(), framing.width, framing.height);
        return Ok(());
    }
    let format = check_format(&args.output, ".obj, .ply or .stl")?;
    if tessellation.mesh.triangles.is_empty() {
        let why = match program.parts().len() {
            0 => "it has no parts",
            _ => "no triangle of its parts has an area at this size and precision",
        };
        return Err(CommandError::failed(format!("the model has no surface to write: {why}")));
    }
    // STL has no texture coordinates.
    if format != MeshFormat::Stl {
        let atlas = Atlas::linear(program, &*instance, ATLAS).map_err(CommandError::failed)?;
        tessellation = tessellation.with_atlas(&atlas);
    }
    let passages = Passages::of_tessellation(&tessellation, program, &*instance).map_err(CommandError::failed)?;
    let mesh = &tessellation.mesh;
    write(&args.output, mesh, format)?;
    outputs::wrote(&args.output);
    let vertices = mesh.position_numbers().into_iter().max().map_or(0, |last| last + 1);
    println!(
        "{}: {vertices} vertices, {} triangles, {} parts, within {:.3e} mm of the surface",
        args.output.display(),
        mesh.triangles.len(),
        mesh.groups.len(),
        tessellation.chord,
    );
    let largest = mesh.positions.iter().flatten().fold(0.0_f64, |most, c| most.max(c.abs()));
    // Half a unit in the last place of a number in single precision.
    let rounding = largest * f64::from(f32::EPSILON) / 2.0;
    if format == MeshFormat::Stl && rounding > 0.1 * chord {
        eprintln!(
            "warning: STL has single precision: so far from the origin its points are off by up to {rounding:.1e} mm; write \
             .obj or .ply"
        );
    }
    if let Some(passages) = passages {
        eprintln!("warning: {}", passages.sentence());
    }
    if tessellation.chord > chord {
        eprintln!(
            "warning: the mesh leaves the surface by up to {:.3e} mm, more than --chord {chord}mm: it is the best that \
             was reached; where the surface jumps, or bends too narrowly, none may be",
            tessellation.chord
        );
    }
    Ok(())
}

/// The framing of a picture; none if the output is a mesh.
fn framing(args: &MeshArgs) -> Result<Option<Framing>, CommandError> {
    if args.output.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png")) {
        let (width, height) = args.size.unwrap_or((640, 640));
        return Ok(Some(Framing { view: args.view.unwrap_or_else(picture::corner), width, height }));
    }
    if args.view.is_some() || args.size.is_some() {
        return Err(CommandError::usage("--view and --size require a picture: -o must end in .png"));
    }
    check_format(&args.output, ".obj, .ply, .stl or .png")?;
    Ok(None)
}

/// The mesh format of a file name. `known` names the formats for the message.
pub(crate) fn check_format(path: &Path, known: &str) -> Result<MeshFormat, CommandError> {
    MeshFormat::of(path)
        .ok_or_else(|| CommandError::usage(format!("-o {}: the file name must end in {known}", path.display())))
}

/// Writes a mesh, creating the folder that it is in.
pub(crate) fn write(path: &Path, mesh: &TriangleMesh, format: MeshFormat) -> Result<(), CommandError> {
    outputs::make_parent(path)?;
    mesh::write(path, mesh, format).map_err(CommandError::failed)
}
