//! PTS: the number of points, then a line for each with its coordinates, intensity and colour, as far as there are any.

use super::{Out, Recorded};
use std::io;

/// Writes a scan in this format, whichever stations saw it.
pub(super) fn write(out: &mut dyn Out, scan: &Recorded<'_>) -> io::Result<()> {
    let attributes = scan.attributes;
    writeln!(out, "{}", scan.mesh.positions.len())?;
    for i in 0..scan.mesh.positions.len() {
        let [x, y, z] = scan.position(i);
        write!(out, "{x} {y} {z}")?;
        if let Some(intensity) = attributes.intensities.get(i) {
            write!(out, " {intensity}")?;
        }
        if let Some([red, green, blue]) = attributes.colours.get(i) {
            write!(out, " {red} {green} {blue}")?;
        }
        writeln!(out)?;
    }
    Ok(())
}
