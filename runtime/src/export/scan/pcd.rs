//! PCD, binary: a header of text, and points of as many bytes each.

use super::{Out, Recorded, single_rounding};
use glam::DVec3;
use std::io;

/// Coordinates are in single precision, which PCL's own types of points need, where that moves no point by more.
/// Millimetres along an axis.
const ROUNDED: f64 = 5e-4;

/// Writes a scan in this format. The viewpoint is the station, if there is one.
pub(super) fn write(out: &mut dyn Out, scan: &Recorded<'_>) -> io::Result<()> {
    let (mesh, attributes) = (scan.mesh, scan.attributes);
    let count = mesh.positions.len();
    let single = is_single(scan);
    let mut fields = vec![("x", if single { "4" } else { "8" }, "F")];
    fields.extend([("y", fields[0].1, "F"), ("z", fields[0].1, "F")]);
    if !mesh.normals.is_empty() {
        fields.extend(["normal_x", "normal_y", "normal_z"].map(|name| (name, "4", "F")));
    }
    if !attributes.colours.is_empty() {
        fields.push(("rgb", "4", "U"));
    }
    if !attributes.intensities.is_empty() {
        fields.push(("intensity", "4", "F"));
    }
    let column = |part: fn(&(&'static str, &'static str, &'static str)) -> &'static str| -> String {
        fields.iter().map(part).collect::<Vec<_>>().join(" ")
    };
    writeln!(out, "# .PCD v0.7 - Point Cloud Data file format\n# {}", scan.unit.comment())?;
    writeln!(out, "VERSION 0.7\nFIELDS {}", column(|f| f.0))?;
    writeln!(out, "SIZE {}\nTYPE {}\nCOUNT {}", column(|f| f.1), column(|f| f.2), column(|_| "1"))?;
    writeln!(out, "WIDTH {count}\nHEIGHT 1\nVIEWPOINT {}\nPOINTS {count}\nDATA binary", viewpoint(scan))?;
    for i in 0..count {
        for c in scan.position(i) {
            if single { out.write_all(&(c as f32).to_le_bytes())? } else { out.write_all(&c.to_le_bytes())? }
        }
        for c in mesh.normals.get(i).into_iter().flatten() {
            out.write_all(&(*c as f32).to_le_bytes())?;
        }
        if let Some([red, green, blue]) = attributes.colours.get(i) {
            out.write_all(&[*blue, *green, *red, 0])?;
        }
        if let Some(intensity) = attributes.intensities.get(i) {
            out.write_all(&intensity.to_le_bytes())?;
        }
    }
    Ok(())
}

/// Whether coordinates are in single precision.
pub(super) fn is_single(scan: &Recorded<'_>) -> bool {
    single_rounding(scan, DVec3::ZERO) <= ROUNDED
}

/// A translation and a quaternion.
fn viewpoint(scan: &Recorded<'_>) -> String {
    let [station] = &scan.attributes.stations.places[..] else { return "0 0 0 1 0 0 0".to_owned() };
    let [x, y, z] = station.place.map(|c| c / scan.unit.millimetres());
    let [qw, qx, qy, qz] = station.quaternion();
    format!("{x} {y} {z} {qw} {qx} {qy} {qz}")
}
