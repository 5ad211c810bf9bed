//! XYZ: a line of names, then a line for each point with as many digits as its numbers need. The reader takes the names
//! for what they say; programs that know none skip the line.

use super::{Out, Recorded};
use crate::scan::Unit;
use std::io;

/// Writes a scan in this format.
pub(super) fn write(out: &mut dyn Out, scan: &Recorded<'_>) -> io::Result<()> {
    let (mesh, attributes) = (scan.mesh, scan.attributes);
    let parts = [
        ("nx ny nz", !mesh.normals.is_empty()),
        ("red green blue", !attributes.colours.is_empty()),
        ("intensity", !attributes.intensities.is_empty()),
    ];
    let names: Vec<&str> = parts.into_iter().filter(|(_, there)| *there).map(|(names, _)| names).collect();
    // Programs that know no remarks are spared one that says the usual.
    if scan.unit != Unit::default() {
        writeln!(out, "# {}", scan.unit.comment())?;
    }
    writeln!(out, "{}", [&["x y z"], &names[..]].concat().join(" "))?;
    for i in 0..mesh.positions.len() {
        let [x, y, z] = scan.position(i);
        write!(out, "{x} {y} {z}")?;
        if let Some([x, y, z]) = mesh.normals.get(i) {
            write!(out, " {x} {y} {z}")?;
        }
        if let Some([red, green, blue]) = attributes.colours.get(i) {
            write!(out, " {red} {green} {blue}")?;
        }
        if let Some(intensity) = attributes.intensities.get(i) {
            write!(out, " {intensity}")?;
        }
        writeln!(out)?;
    }
    Ok(())
}
