//! `gmlc mesh`.

use crate::cli::MeshArgs;
use crate::closedness::near;
use crate::error::CommandError;
use crate::outputs;
use crate::picture::{self, Framing};
use crate::progress::TerminalProgress;
use crate::script::{Valued, compile_valued};
use crate::table;
use gml_compiler::program::Program;
use gml_runtime::export::mesh::MeshFormat;
use gml_runtime::export::scan::{Recorded, ScanFormat};
use gml_runtime::figures::overlap;
use gml_runtime::mesh::TriangleMesh;
use gml_runtime::model::{Atlas, Faults, Fineness, Instance, Model, Motion, OpenBorder, Passages, Tessellation};
use gml_runtime::scan::{Attributes, Unit};
use serde_json::json;

/// The format of a picture.
const PICTURE: &str = "png";

/// Texels per side of the atlas whose texture coordinates a mesh has.
const ATLAS: u32 = 1024;

/// Default of the largest distance between a mesh and the exact surface. Millimetres.
const CHORD: f64 = 0.02;

/// The most triangles of a mesh whose chord was asked for: some gigabytes.
const MOST_TRIANGLES: usize = 10_000_000;

pub(crate) fn run(args: &MeshArgs) -> Result<(), CommandError> {
    // Errors in the command line are reported before any work is done.
    kind(args)?;
    outputs::require_apart(&args.output, outputs::inputs([&args.script.model], args.values.params.as_ref()))?;
    let valued = compile_valued(&args.script.model, &args.script.compile, &args.values)?;
    valued.warn_of_doubt();
    let Valued { program, x, motion, .. } = valued;
    write_model(args, &program, &x, &motion)
}

/// What is written.
#[derive(Clone, Copy)]
enum Kind {
    Mesh(MeshFormat),
    Picture(Framing),
}

/// Writes the moved surface of a model at x.
pub(crate) fn write_model(args: &MeshArgs, program: &Program, x: &[f64], motion: &Motion) -> Result<(), CommandError> {
    let kind = kind(args)?;
    outputs::require_apart_from_scripts(&args.output, program)?;
    let instance = Model::instantiate(program, x).map_err(|error| CommandError::failed(program.placed(error, x)))?;
    let chord = match (args.chord, &kind) {
        (Some(chord), _) => chord,
        (None, Kind::Picture(framing)) => framing.chord(program, &*instance).map_err(CommandError::failed)?,
        (None, Kind::Mesh(_)) => CHORD,
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
    match kind {
        Kind::Picture(framing) => {
            outputs::write(&args.output, &framing.png(&tessellation)?)?;
            let parts = tessellation.mesh.groups.len();
            let Framing { width, height, .. } = framing;
            let result = json!({ "output": outputs::named(&args.output), "width": width, "height": height,
                "parts": parts, "warnings": [] });
            let line = format!("{}: {width} x {height} pixels, {parts} parts", args.output.display());
            args.json.print(&args.output, &result, &line);
            Ok(())
        }
        Kind::Mesh(format) => write_surface(args, program, &*instance, tessellation, chord, format),
    }
}

/// Writes the tessellation of a model as a mesh. `chord` is the distance from the surface that was asked for.
fn write_surface(
    args: &MeshArgs,
    program: &Program,
    instance: &dyn Instance,
    mut tessellation: Tessellation,
    chord: f64,
    format: MeshFormat,
) -> Result<(), CommandError> {
    if tessellation.mesh.triangles.is_empty() {
        let why = match program.parts().len() {
            0 => "it has no parts",
            _ => "no triangle of its parts has an area at this size and precision",
        };
        return Err(CommandError::failed(format!("the model has no surface to write: {why}")));
    }
    // STL has no texture coordinates.
    if format != MeshFormat::Stl {
        let atlas = Atlas::linear(program, instance, ATLAS).map_err(CommandError::failed)?;
        tessellation = tessellation.with_atlas(&atlas);
    }
    let passages = Passages::of_tessellation(&tessellation, program, instance).map_err(CommandError::failed)?;
    let mesh = &tessellation.mesh;
    let recorded = Recorded { mesh, attributes: &Attributes::default(), grids: &[], unit: Unit::Mm };
    outputs::write_scan(&args.output, &recorded, ScanFormat::Mesh(format))?;
    let mut warnings = warnings(&tessellation, chord, format, passages.map(|passages| passages.sentence()));
    if program.is_trimmed() {
        let faults = Faults::of_mesh(mesh);
        warnings.extend(gap(program, mesh, &faults.open));
        warnings.extend(fold(program, &faults.against));
        if faults.open.is_empty() {
            let overlap = overlap(program, instance, mesh).map_err(CommandError::failed)?;
            // Bodies that lie in each other may be meant to do so: `gmlc check` says it.
            let of_chord = overlap.filter(|overlap| overlap.of_bodies.is_none());
            warnings.extend(of_chord.map(|overlap| overlapping(overlap.place)));
        }
    }
    let vertices = mesh.position_numbers().into_iter().max().map_or(0, |last| last + 1);
    let (triangles, parts) = (mesh.triangles.len(), mesh.groups.len());
    let result = json!({ "output": outputs::named(&args.output), "vertices": vertices, "triangles": triangles,
        "parts": parts, "chord": tessellation.chord, "warnings": warnings });
    let line = format!(
        "{}: {vertices} vertices, {triangles} triangles, {parts} parts, within {:.3e} mm of the surface",
        args.output.display(),
        tessellation.chord,
    );
    args.json.print(&args.output, &result, &line);
    warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    Ok(())
}

/// Open borders of a trimmed part that are shorter than this part of the model's diagonal are a gap, whatever is beside
/// them: a surface that ends somewhere on purpose has longer ones.
const SHORT: f64 = 0.01;

fn widest<'o>(all: &[&'o OpenBorder]) -> Option<&'o OpenBorder> {
    all.iter().copied().max_by(|a, b| a.length.total_cmp(&b.length))
}

/// A sentence on the gaps between trimmed parts, or on where one ends that nothing meets.
fn gap(program: &Program, mesh: &TriangleMesh, open: &[OpenBorder]) -> Option<String> {
    let short = SHORT * mesh.bounds().diagonal();
    let is_gap = |open: &&OpenBorder| open.beside.is_some() || open.length < short;
    let ends = |open: &&OpenBorder| !is_gap(open) && Model::keep(program, open.patch).is_some();
    let length = |all: &[&OpenBorder]| all.iter().map(|open| open.length).sum::<f64>();
    let name = |patch: usize| &program.parts()[patch].name;
    let gaps: Vec<&OpenBorder> = open.iter().filter(is_gap).collect();
    if let Some(widest) = widest(&gaps) {
        let place = match widest.beside {
            Some(beside) => format!("between '{}' and '{}'", name(widest.patch), name(beside)),
            None => format!("in '{}'", name(widest.patch)),
        };
        let mend = if widest.length < short { "; another --chord may close it" } else { "" };
        return Some(format!(
            "the mesh is not closed: {place}{} is a gap ({:.3} mm of border in all){mend}",
            near(widest),
            length(&gaps),
        ));
    }
    let ends: Vec<&OpenBorder> = open.iter().filter(ends).collect();
    let widest = widest(&ends)?;
    Some(format!(
        "the mesh is open: '{}' ends{} where no other part meets it ({:.3} mm of border in all)",
        name(widest.patch),
        near(widest),
        length(&ends),
    ))
}

/// Sentences on what the mesh is not, or the model.
fn warnings(tessellation: &Tessellation, chord: f64, format: MeshFormat, passages: Option<String>) -> Vec<String> {
    let mut warnings = Vec::new();
    let largest = tessellation.mesh.positions.iter().flatten().fold(0.0_f64, |most, c| most.max(c.abs()));
    // Half a unit in the last place of a number in single precision.
    let rounding = largest * f64::from(f32::EPSILON) / 2.0;
    if format == MeshFormat::Stl && rounding > 0.1 * chord {
        warnings.push(format!(
            "STL has single precision: so far from the origin its points are off by up to {rounding:.1e} mm; write .obj or \
             .ply"
        ));
    }
    warnings.extend(passages);
    if tessellation.chord > chord {
        warnings.push(format!(
            "the mesh leaves the surface by up to {:.3e} mm, more than --chord {chord}mm: it is the best that was reached; \
             where the surface jumps, or bends too narrowly, none may be",
            tessellation.chord
        ));
    }
    warnings
}

/// What the options ask for: by --format, or else by the ending of the file's name.
fn kind(args: &MeshArgs) -> Result<Kind, CommandError> {
    args.json.require_apart(&args.output)?;
    let is_picture = match &args.format {
        Some(format) => format == PICTURE,
        None => args.output.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(PICTURE)),
    };
    if is_picture {
        let (width, height) = args.size.unwrap_or((640, 640));
        return Ok(Kind::Picture(Framing { view: args.view.unwrap_or_else(picture::corner), width, height }));
    }
    if args.view.is_some() || args.size.is_some() {
        return Err(CommandError::usage("--view and --size require a picture: -o must end in .png"));
    }
    let named = args.format.as_deref().and_then(MeshFormat::named);
    outputs::format_of(&args.output, named, MeshFormat::of, ".obj, .ply, .stl or .png").map(Kind::Mesh)
}

/// A sentence on where triangles lie in each other.
fn overlapping(place: [f64; 3]) -> String {
    format!(
        "near {} triangles pass through each other, as walls or gaps are thin for this --chord: a smaller one mends it",
        table::place(place)
    )
}

/// A sentence on triangles that run against their neighbours.
fn fold(program: &Program, against: &[(usize, [f64; 3])]) -> Option<String> {
    let (patch, at) = against.first()?;
    Some(format!(
        "the mesh has folds: near {} triangles of '{}' run against their neighbours, at {} edges in all; another --chord may \
         mend it",
        table::place(*at),
        program.parts()[*patch].name,
        against.len(),
    ))
}
