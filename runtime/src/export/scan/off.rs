//! OFF as text, in numbers that read back as the same: positions, normals and colours from 0 to 255, as far as there
//! are any.

use super::{Out, Recorded};
use std::io;

/// Writes points and triangles.
pub(super) fn write(out: &mut dyn Out, scan: &Recorded<'_>) -> io::Result<()> {
    let (mesh, colours) = (scan.mesh, &scan.attributes.colours);
    let prefix = |has: bool, prefix: &'static str| if has { prefix } else { "" };
    writeln!(out, "{}{}OFF", prefix(!colours.is_empty(), "C"), prefix(!mesh.normals.is_empty(), "N"))?;
    writeln!(out, "# {}", scan.unit.comment())?;
    writeln!(out, "{} {} 0", mesh.positions.len(), mesh.triangles.len())?;
    for i in 0..mesh.positions.len() {
        let [x, y, z] = scan.position(i);
        write!(out, "{x} {y} {z}")?;
        if let Some([x, y, z]) = mesh.normals.get(i) {
            write!(out, " {x} {y} {z}")?;
        }
        if let Some([r, g, b]) = colours.get(i) {
            write!(out, " {r} {g} {b} 255")?;
        }
        writeln!(out)?;
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(out, "3 {a} {b} {c}")?;
    }
    Ok(())
}
