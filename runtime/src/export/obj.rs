//! Wavefront OBJ: positions, texture coordinates, normals and groups as text.

use super::atomic::{self, WriteError};
use crate::mesh::TriangleMesh;
use std::io::{self, Write};
use std::path::Path;

/// Writes a mesh as OBJ. Numbers are written so that reading them gives the same doubles.
///
/// # Errors
/// See [`atomic::write`].
pub fn write(path: &Path, mesh: &TriangleMesh) -> Result<(), WriteError> {
    atomic::write_with(path, |out| write_to(out, mesh))
}

/// Writes a mesh as OBJ to `out`. Units do not exist in OBJ; a comment names millimetres.
///
/// # Errors
/// Whatever `out` fails with.
pub fn write_to(out: &mut dyn Write, mesh: &TriangleMesh) -> io::Result<()> {
    writeln!(out, "# gmlc, unit: mm")?;
    for [x, y, z] in &mesh.positions {
        writeln!(out, "v {x} {y} {z}")?;
    }
    for [s, t] in &mesh.texcoords {
        writeln!(out, "vt {s} {t}")?;
    }
    for [x, y, z] in &mesh.normals {
        writeln!(out, "vn {x} {y} {z}")?;
    }
    let corner = match (mesh.texcoords.is_empty(), mesh.normals.is_empty()) {
        (false, false) => |i: u32| format!("{i}/{i}/{i}"),
        (false, true) => |i: u32| format!("{i}/{i}"),
        (true, false) => |i: u32| format!("{i}//{i}"),
        (true, true) => |i: u32| format!("{i}"),
    };
    let mut groups = mesh.groups.iter().peekable();
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        while let Some(group) = groups.next_if(|group| group.start <= i) {
            writeln!(out, "g {}", one_line(&group.name))?;
        }
        let [a, b, c] = triangle.map(|index| corner(index + 1));
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}

/// A name as OBJ can hold it: control characters would end the line.
fn one_line(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { '_' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Group;

    #[test]
    fn text_of_a_small_mesh() {
        let mesh = TriangleMesh {
            positions: vec![[0.0; 3], [1.5, 0.0, 0.0], [0.0, 1e-3, 0.0], [0.0, 0.0, 1e6]],
            normals: vec![[0.0, 0.0, 1.0]; 4],
            texcoords: vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.5]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            groups: vec![
                Group { name: "hole[0]".into(), start: 0, end: 1 },
                Group { name: "a\nb".into(), start: 1, end: 2 },
            ],
        };
        let mut out = Vec::new();
        write_to(&mut out, &mesh).unwrap();
        let text = String::from_utf8(out).unwrap();
        let tail: Vec<&str> = text.lines().skip(13).collect();
        assert_eq!(text.lines().nth(3), Some("v 0 0.001 0"));
        assert_eq!(tail, ["g hole[0]", "f 1/1/1 2/2/2 3/3/3", "g a_b", "f 1/1/1 3/3/3 4/4/4"]);
    }
}
