//! Files that other tools read: deviations as PLY and VTP (at the model's points and at the scan's) and as GLB, tables
//! as CSV, and drawings as SVG. docs/output.md describes them.

pub(in crate::export) mod csv;
mod glb;
mod labels;
mod parameters;
mod parts;
mod ply;
mod surface;
mod vtp;

pub use parameters::ParameterRow;
pub use ply::{write_points, write_points_to};

use super::atomic::{self, WriteError};
use super::scale::Scale;
use super::svg::{self, SectionDrawing};
use crate::variance::{Class, MeasuredPoints, Measurement, SIGN_CONVENTION};
use std::path::Path;
use surface::MeasuredSurface;

/// The files, by format.
const SURFACE_PLY: &str = "deviations.ply";
const SURFACE_VTP: &str = "deviations.vtp";
const SURFACE_GLB: &str = "deviations.glb";
const POINTS_PLY: &str = "points.ply";
const POINTS_VTP: &str = "points.vtp";
const PARTS_CSV: &str = "parts.csv";
const LABELS_CSV: &str = "labels.csv";
const PARAMETERS_CSV: &str = "parameters.csv";

const LEGEND_SVG: &str = "legend.svg";
const HISTOGRAM_SVG: &str = "histogram.svg";
const SECTION_SVG: &str = "section.svg";

/// A format of other tools.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Deviations as PLY, whose properties CloudCompare and MeshLab show as scalars.
    Ply,
    /// Deviations as PolyData of VTK, for ParaView and PyVista.
    Vtp,
    /// Deviations as colours in binary glTF, for viewers and presentations.
    Glb,
    /// Tables of the parts and of the parameters, for spreadsheets.
    Csv,
    /// Legend, histogram and a section as drawings for documents.
    Svg,
}

/// Writes the files of some formats into a folder, which must exist, but for drawings ([`write_drawings`]).
/// `parameters` are the rows of the table of parameters, which is not written where there are none.
///
/// # Errors
/// If a file cannot be written; or the surface is too large for GLB, which holds at most 4 GiB.
pub fn write(
    folder: &Path,
    measurement: &Measurement,
    formats: &[Format],
    scale: &Scale,
    parameters: &[ParameterRow],
) -> Result<(), WriteError> {
    let needs_surface = formats.iter().any(|format| !matches!(format, Format::Csv | Format::Svg));
    let surface = needs_surface.then(|| MeasuredSurface::new(measurement, scale));
    let names = &measurement.deviations.texels.part_names;
    if let Some(surface) = &surface {
        if formats.contains(&Format::Ply) {
            atomic::write_with(&folder.join(SURFACE_PLY), |out| ply::write_surface(out, surface, names))?;
            write_points(&folder.join(POINTS_PLY), &measurement.points, names)?;
        }
        if formats.contains(&Format::Vtp) {
            atomic::write_with(&folder.join(SURFACE_VTP), |out| vtp::write_surface(out, surface, names))?;
            atomic::write_with(&folder.join(POINTS_VTP), |out| vtp::write_points(out, &measurement.points, names))?;
        }
        if formats.contains(&Format::Glb) {
            atomic::write_with(&folder.join(SURFACE_GLB), |out| glb::write(out, surface, names))?;
        }
    }
    if formats.contains(&Format::Csv) {
        atomic::write(&folder.join(PARTS_CSV), parts::table(&measurement.report).as_bytes())?;
        atomic::write(&folder.join(LABELS_CSV), labels::table(&measurement.report.peaks).as_bytes())?;
        if !parameters.is_empty() {
            atomic::write(&folder.join(PARAMETERS_CSV), parameters::table(parameters).as_bytes())?;
        }
    }
    Ok(())
}

/// Writes legend.svg, histogram.svg and section.svg into a folder, which must exist.
///
/// # Errors
/// If a file cannot be written.
pub fn write_drawings(folder: &Path, drawing: &SectionDrawing<'_>) -> Result<(), WriteError> {
    let SectionDrawing { title, measurement, scale, .. } = drawing;
    let deviations = &measurement.deviations;
    atomic::write(&folder.join(LEGEND_SVG), svg::legend_file(title, deviations, scale).as_bytes())?;
    atomic::write(&folder.join(HISTOGRAM_SVG), svg::histogram_file(title, deviations, scale).as_bytes())?;
    atomic::write(&folder.join(SECTION_SVG), drawing.file().as_bytes())
}

/// The distance and the part of a point of the scan; NaN and -1 where there are none.
fn of_point(points: &MeasuredPoints, i: usize) -> (f64, i32) {
    match points.distances.get(i).copied().flatten() {
        Some(measured) => (measured.distance, i32::try_from(measured.part).unwrap_or(-1)),
        None => (f64::NAN, -1),
    }
}

/// The numbers of the classes in words: `0: no data; 1: measured; ...`.
fn classes() -> String {
    Class::ALL.map(|class| format!("{}: {}", class.code(), class.text())).join("; ")
}

/// What the signs of distances mean, and what stands where there is no distance.
fn distances() -> String {
    format!("{SIGN_CONVENTION}; nan: none")
}

#[cfg(test)]
mod tests;
