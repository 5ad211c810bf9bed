//! `gmlc convert`.

use crate::cli::ConvertArgs;
use crate::error::CommandError;
use crate::progress::TerminalProgress;
use crate::{fit, info, outputs};
use gml_compiler::number::plain;
use gml_runtime::export::scan::{Recorded, ScanFormat};
use gml_runtime::mesh::TriangleMesh;
use gml_runtime::scan::{self, Attributes, Loaded, Unit};
use serde_json::json;
use std::path::Path;

pub(crate) fn run(args: &ConvertArgs) -> Result<(), CommandError> {
    args.json.require_apart(&args.output)?;
    outputs::require_apart(&args.output, [args.scan.as_path()])?;
    outputs::require_files([&args.output])?;
    let format = format_of(&args.output, args.format)?;
    let progress = TerminalProgress::new();
    let loaded = scan::load(&args.scan, &args.reading.options(), &progress);
    progress.finish();
    let loaded = loaded.map_err(fit::unreadable)?;
    let Loaded { mesh, attributes, unit, cleaning, warnings, .. } = &loaded;
    let no_triangles = mesh.triangles.is_empty();
    if no_triangles && format.is_of_triangles() {
        let path = args.scan.display();
        return Err(CommandError::usage(format!(
            "{path}: has points only, and a file of this format has triangles; write .ply, .e57, .laz or .xyz, or make \
             triangles of the points with --surface"
        )));
    }
    let unit = if format.has_metres() { Unit::M } else { args.output_unit.unwrap_or(*unit) };
    if let Some(other) = args.output_unit.filter(|other| *other != unit) {
        let path = args.output.display();
        return Err(CommandError::usage(format!(
            "{path}: files of this format have metres; leave --output-unit {other} out, or choose another format"
        )));
    }
    let scan = Recorded { mesh, attributes, grids: &[], unit };
    outputs::write_scan(&args.output, &scan, format)?;
    warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    let mut lost = lost(&loaded, format, unit);
    lost.extend(rounded(format.rounding(&scan)));
    lost.iter().for_each(|lost| eprintln!("warning: {}: {lost}", args.output.display()));
    let (points, triangles) = (format.count_points(mesh), if format.is_of_points() { 0 } else { mesh.triangles.len() });
    let left_out = info::left_out(cleaning);
    let ending = if left_out.is_empty() { String::new() } else { format!("; left out are {left_out}") };
    let line =
        format!("{}: {points} points, {triangles} triangles, coordinates in {unit}{ending}", args.output.display());
    let said = [&warnings[..], &lost[..]].concat();
    let result = json!({ "output": outputs::named(&args.output), "points": points, "triangles": triangles,
        "unit": unit, "cleaning": cleaning, "warnings": said });
    args.json.print(&args.output, &result, &line);
    Ok(())
}

/// What of a scan is not in the new file.
fn lost(loaded: &Loaded, format: ScanFormat, unit: Unit) -> Vec<String> {
    let Loaded { mesh, attributes, ignored, .. } = loaded;
    let mut sentences: Vec<String> = without(format, mesh, attributes).into_iter().collect();
    if !ignored.is_empty() {
        sentences.push(format!("gmlc does not read, and leaves out: {}", ignored.join(", ")));
    }
    if format.spreads(&attributes.intensities) {
        sentences.push("intensities are spread over the whole numbers from 0 to 65535 that the format has".to_owned());
    }
    if !format.says_unit() && unit != Unit::default() {
        sentences.push(format!("the format cannot say that the unit is {unit}: read it with --unit {unit}"));
    }
    sentences
}

/// A sentence on the data of a scan for which a file of a format has no room.
fn without(format: ScanFormat, mesh: &TriangleMesh, attributes: &Attributes) -> Option<String> {
    let can = format.holds(mesh, attributes);
    let stations = attributes.stations.places.len();
    let kinds = [
        (!mesh.triangles.is_empty() && format.is_of_points(), "triangles"),
        (!mesh.normals.is_empty() && !can.normals, "normals"),
        (!attributes.colours.is_empty() && !can.colours, "colours"),
        (!attributes.intensities.is_empty() && !can.intensities, "intensities"),
        (stations > 0 && !can.stations, if stations > 1 { "places of the scanner" } else { "place of the scanner" }),
        (!mesh.texcoords.is_empty() && !can.texcoords, "texture coordinates"),
    ];
    let lost: Vec<&str> = kinds.iter().filter(|(is_lost, _)| *is_lost).map(|(_, kind)| *kind).collect();
    (!lost.is_empty()).then(|| format!("the format has no room for {}: they are left out", lost.join(", ")))
}

/// A sentence on coordinates that the new file has rounded by up to a length in mm.
fn rounded(by: f64) -> Option<String> {
    /// Less is finer than what scanners and their files resolve. Millimetres.
    const UNSAID: f64 = 6e-4;
    (by > UNSAID).then(|| {
        let by = format!("{by:.1e}").parse().map_or_else(|_| plain(by), plain);
        format!("the format rounds coordinates, here by up to {by} mm: .ply, .obj, .off, .e57, .pcd and .xyz keep them")
    })
}

/// The format by --format, or else by the ending of the file's name.
pub(crate) fn format_of(path: &Path, given: Option<ScanFormat>) -> Result<ScanFormat, CommandError> {
    let known: Vec<String> = ScanFormat::ALL.iter().map(|(name, _)| format!(".{name}")).collect();
    outputs::format_of(path, given, ScanFormat::of, &format!("one of {}", known.join(", ")))
}
