//! Points with their distances as a PLY file (binary, little endian), whose properties viewers show as scalar fields.

use super::atomic::{self, WriteError};
use crate::variance::{MeasuredPoints, SIGN_CONVENTION};
use std::io::{self, Write};
use std::path::Path;

/// Writes points to a file: x, y and z in millimetres; the signed `distance`, NaN where there is none; and the number
/// of the `part`, -1 where there is none. Comments have the names of the parts.
///
/// # Errors
/// See [`atomic::write_with`].
pub fn write(path: &Path, points: &MeasuredPoints, parts: &[String]) -> Result<(), WriteError> {
    atomic::write_with(path, |out| write_to(out, points, parts))
}

fn write_to(out: &mut dyn Write, points: &MeasuredPoints, parts: &[String]) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment gmlc, unit: mm")?;
    writeln!(out, "comment distance: {SIGN_CONVENTION}; nan: none")?;
    for (number, name) in parts.iter().enumerate() {
        // Control characters would end the line.
        let name: String = name.chars().map(|c| if c.is_control() { '_' } else { c }).collect();
        writeln!(out, "comment part {number}: {name}")?;
    }
    writeln!(out, "element vertex {}", points.positions.len())?;
    writeln!(out, "property double x\nproperty double y\nproperty double z")?;
    writeln!(out, "property double distance\nproperty int part\nend_header")?;
    for (position, measured) in points.positions.iter().zip(&points.distances) {
        let distance = measured.map_or(f64::NAN, |m| m.distance);
        let part = measured.map_or(-1, |m| m.part as i32);
        for figure in position.iter().chain([&distance]) {
            out.write_all(&figure.to_le_bytes())?;
        }
        out.write_all(&part.to_le_bytes())?;
    }
    Ok(())
}
