//! `gmlc mesh`.

use crate::cli::MeshArgs;
use crate::error::CommandError;
use crate::picture::Framing;
use crate::{script, values};
use gml_compiler::program::Program;
use gml_runtime::export::{obj, ply, stl};
use gml_runtime::mesh::TriangleMesh;
use gml_runtime::model::{Atlas, Fineness, Model, Motion, Tessellation};
use std::path::Path;

/// Texture coordinates of a mesh for other programs: those of an atlas of this many texels a side.
const ATLAS: u32 = 1024;

/// Largest distance between a mesh and the exact surface where the user says nothing. Millimetres.
const CHORD: f64 = 0.02;

pub(crate) fn run(args: &MeshArgs) -> Result<(), CommandError> {
    check_options(args)?;
    let program = script::compile(&args.script)?;
    let (x, motion) = script::parameters(&program, &args.values)?;
    write_model(args, &program, (&x, &motion))
}

/// What is wrong with the command line, before any work is done.
fn check_options(args: &MeshArgs) -> Result<(Option<Framing>, Option<f64>), CommandError> {
    let framing = framing(args)?;
    let chord = args.chord.as_deref().map(|text| values::positive_length("--chord", text)).transpose()?;
    Ok((framing, chord))
}

/// Writes the surface of a model at x, moved, as the arguments say.
pub(crate) fn write_model(
    args: &MeshArgs,
    program: &Program,
    (x, motion): (&[f64], &Motion),
) -> Result<(), CommandError> {
    let (framing, chord) = check_options(args)?;
    let instance = Model::instantiate(program, x).map_err(CommandError::failed)?;
    let chord = match (chord, &framing) {
        (Some(chord), _) => chord,
        (None, Some(framing)) => framing.chord(program, &*instance).map_err(CommandError::failed)?,
        (None, None) => CHORD,
    };
    let fineness = Fineness { chord, ..Fineness::default() };
    let mut tessellation = Tessellation::new(program, &*instance, fineness).map_err(CommandError::failed)?;
    motion.move_tessellation(&mut tessellation);
    if let Some(framing) = framing {
        make_parent(&args.output)?;
        framing.write(&args.output, &tessellation)?;
        let parts = tessellation.mesh.groups.len();
        println!("{}: {} x {} pixels, {parts} parts", args.output.display(), framing.width, framing.height);
        return Ok(());
    }
    let atlas = Atlas::new(program, &*instance, ATLAS).map_err(CommandError::failed)?;
    let tessellation = tessellation.with_atlas(&atlas);
    write(&args.output, &tessellation.mesh)?;
    println!(
        "{}: {} vertices, {} triangles, {} parts",
        args.output.display(),
        tessellation.mesh.positions.len(),
        tessellation.mesh.triangles.len(),
        tessellation.mesh.groups.len()
    );
    Ok(())
}

/// How the picture is framed, where the output is one.
fn framing(args: &MeshArgs) -> Result<Option<Framing>, CommandError> {
    let (view, size) = (args.view.as_deref(), args.size.as_deref());
    if extension(&args.output) == "png" {
        return Framing::new(view, size).map(Some);
    }
    if view.is_some() || size.is_some() {
        return Err(CommandError::usage("--view and --size are for pictures: -o must end in .png"));
    }
    if matches!(extension(&args.output).as_str(), "obj" | "ply" | "stl") {
        return Ok(None);
    }
    Err(CommandError::usage(format!(
        "-o {}: the name must end in .obj, .ply, .stl or .png, which says the format",
        args.output.display()
    )))
}

/// Refuses a file name whose format cannot be written, before any work is done.
pub(crate) fn check_format(path: &Path) -> Result<(), CommandError> {
    if matches!(extension(path).as_str(), "obj" | "ply" | "stl") {
        return Ok(());
    }
    Err(CommandError::usage(format!(
        "-o {}: the name must end in .obj, .ply or .stl, which says the format",
        path.display()
    )))
}

/// Writes a mesh in the format that its file name says.
pub(crate) fn write(path: &Path, mesh: &TriangleMesh) -> Result<(), CommandError> {
    make_parent(path)?;
    match extension(path).as_str() {
        "obj" => obj::write(path, mesh),
        "ply" => ply::write(path, mesh, &[]),
        _ => stl::write(path, mesh),
    }
    .map_err(CommandError::failed)
}

/// Makes the folder of an output.
pub(crate) fn make_parent(path: &Path) -> Result<(), CommandError> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => make_folder(folder),
        _ => Ok(()),
    }
}

/// Makes a folder for outputs.
pub(crate) fn make_folder(folder: &Path) -> Result<(), CommandError> {
    std::fs::create_dir_all(folder)
        .map_err(|e| CommandError::Failed(format!("{}: this folder cannot be made: {e}", folder.display())))
}

fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}
