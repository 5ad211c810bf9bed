//! `gmlc mesh`.

use crate::cli::MeshArgs;
use crate::error::CommandError;
use crate::{script, values};
use gml_compiler::program::Program;
use gml_runtime::export::{obj, ply, stl};
use gml_runtime::mesh::TriangleMesh;
use gml_runtime::model::{Atlas, Fineness, Model, Motion, Tessellation};
use std::path::Path;

/// Texture coordinates of a mesh for other programs: those of an atlas of this many texels a side.
const ATLAS: u32 = 1024;

pub(crate) fn run(args: &MeshArgs) -> Result<(), CommandError> {
    check_format(&args.output)?;
    let chord = values::positive_length("--chord", &args.chord)?;
    let program = script::compile(&args.script)?;
    let (x, motion) = script::parameters(&program, &args.values)?;
    write_model(&args.output, &program, (&x, &motion), chord)
}

/// Writes the surface of a model at x, moved.
pub(crate) fn write_model(
    output: &Path,
    program: &Program,
    (x, motion): (&[f64], &Motion),
    chord: f64,
) -> Result<(), CommandError> {
    check_format(output)?;
    let instance = Model::instantiate(program, x).map_err(CommandError::failed)?;
    let fineness = Fineness { chord, ..Fineness::default() };
    let atlas = Atlas::new(program, &*instance, ATLAS).map_err(CommandError::failed)?;
    let mut tessellation =
        Tessellation::new(program, &*instance, fineness).map_err(CommandError::failed)?.with_atlas(&atlas);
    motion.move_tessellation(&mut tessellation);
    write(output, &tessellation.mesh)?;
    println!(
        "{}: {} vertices, {} triangles, {} parts",
        output.display(),
        tessellation.mesh.positions.len(),
        tessellation.mesh.triangles.len(),
        tessellation.mesh.groups.len()
    );
    Ok(())
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
