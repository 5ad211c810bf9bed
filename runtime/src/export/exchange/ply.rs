//! Deviations as PLY (binary, little endian) with scalars. CloudCompare loads a property as a scalar by itself if its
//! name begins with `scalar_`; MeshLab knows one name, `quality`.

use super::surface::MeasuredSurface;
use super::{classes, distances, of_point};
use crate::export::atomic::{self, WriteError};
use crate::scan::Unit;
use crate::variance::MeasuredPoints;
use std::io::{self, Write};
use std::path::Path;

/// Writes the scan's points to a file: x, y and z in millimetres; the signed `distance`, NaN where there is none; the
/// number of the `part`, -1 where there is none; both again, and the number of the class, under names that other tools
/// know; `intensity`, and `red`, `green` and `blue`, if the scan has them; of several scans that were put together the
/// number of the point's own. Comments have the names of the parts, of the classes and of the scans.
///
/// # Errors
/// See [`atomic::write_with`].
pub fn write_points(path: &Path, points: &MeasuredPoints, parts: &[String]) -> Result<(), WriteError> {
    atomic::write_with(path, |out| write_points_to(out, points, parts))
}

/// [`write_points`] to `out`.
///
/// # Errors
/// Whatever `out` fails with.
pub fn write_points_to(out: &mut dyn Write, points: &MeasuredPoints, parts: &[String]) -> io::Result<()> {
    begin(out, parts)?;
    let scans = &points.parts;
    for (number, path) in scans.paths.iter().enumerate() {
        writeln!(out, "comment scan {number}: {}", on_one_line(path))?;
    }
    writeln!(out, "element vertex {}", points.positions.len())?;
    writeln!(out, "property double x\nproperty double y\nproperty double z")?;
    writeln!(out, "property double distance\nproperty int part")?;
    writeln!(out, "property float scalar_distance\nproperty int scalar_part\nproperty uchar scalar_class")?;
    writeln!(out, "property float quality")?;
    if !scans.of_points.is_empty() {
        writeln!(out, "property int scalar_scan")?;
    }
    if !points.intensities.is_empty() {
        writeln!(out, "property float intensity")?;
    }
    if !points.colours.is_empty() {
        writeln!(out, "property uchar red\nproperty uchar green\nproperty uchar blue")?;
    }
    writeln!(out, "end_header")?;
    for (i, position) in points.positions.iter().enumerate() {
        let (distance, part) = of_point(points, i);
        for figure in position.iter().chain([&distance]) {
            out.write_all(&figure.to_le_bytes())?;
        }
        out.write_all(&part.to_le_bytes())?;
        out.write_all(&(distance as f32).to_le_bytes())?;
        out.write_all(&part.to_le_bytes())?;
        out.write_all(&[points.class(i).code()])?;
        out.write_all(&(distance as f32).to_le_bytes())?;
        if let Some(scan) = scans.of_points.get(i) {
            out.write_all(&scan.to_le_bytes())?;
        }
        if let Some(intensity) = points.intensities.get(i) {
            out.write_all(&intensity.to_le_bytes())?;
        }
        if let Some(colour) = points.colours.get(i) {
            out.write_all(colour)?;
        }
    }
    Ok(())
}

/// Writes the surface with its deviations.
pub(super) fn write_surface(out: &mut dyn Write, surface: &MeasuredSurface, parts: &[String]) -> io::Result<()> {
    begin(out, parts)?;
    writeln!(
        out,
        "comment detection: level of detection of the part in mm; colours end at {} mm{}",
        surface.scale.end,
        surface.scale.neutral()
    )?;
    writeln!(out, "element vertex {}", surface.positions.len())?;
    writeln!(out, "property double x\nproperty double y\nproperty double z")?;
    writeln!(out, "property float nx\nproperty float ny\nproperty float nz")?;
    writeln!(out, "property uchar red\nproperty uchar green\nproperty uchar blue")?;
    writeln!(out, "property float quality\nproperty float scalar_distance\nproperty float scalar_detection")?;
    writeln!(out, "property int scalar_part\nproperty uchar scalar_class")?;
    writeln!(out, "element face {}\nproperty list uchar uint vertex_indices\nend_header", surface.triangles.len())?;
    for i in 0..surface.positions.len() {
        for c in surface.positions[i] {
            out.write_all(&c.to_le_bytes())?;
        }
        for c in surface.normals[i] {
            out.write_all(&(c as f32).to_le_bytes())?;
        }
        out.write_all(&surface.colours[i])?;
        for _ in ["quality", "scalar_distance"] {
            out.write_all(&surface.distance[i].to_le_bytes())?;
        }
        out.write_all(&surface.detection[i].to_le_bytes())?;
        out.write_all(&surface.part[i].to_le_bytes())?;
        out.write_all(&[surface.class[i].code()])?;
    }
    for triangle in &surface.triangles {
        out.write_all(&[3])?;
        for vertex in triangle {
            out.write_all(&vertex.to_le_bytes())?;
        }
    }
    Ok(())
}

/// The beginning of a header, with what the scalars mean.
fn begin(out: &mut dyn Write, parts: &[String]) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment {}", Unit::Mm.comment())?;
    writeln!(out, "comment distance: {}\ncomment class: {}", distances(), classes())?;
    for (number, name) in parts.iter().enumerate() {
        writeln!(out, "comment part {number}: {}", on_one_line(name))?;
    }
    Ok(())
}

/// A name without control characters, which would end the line.
fn on_one_line(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { '_' } else { c }).collect()
}
