//! 3MF: triangles with their unit, each group as an object. Normals and colours have no place in the core of the
//! format.

use super::{Out, Recorded};
use crate::export::escape::escape;
use crate::mesh::TriangleMesh;
use crate::scan::Unit;
use std::io::{self, BufWriter, ErrorKind, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

const MODEL: &str = "3D/3dmodel.model";
const TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"#;
const RELATIONS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"#;

/// Writes triangles.
///
/// # Errors
/// Whatever `out` fails with; or there are no triangles.
pub(super) fn write(out: &mut dyn Out, scan: &Recorded<'_>) -> io::Result<()> {
    if scan.mesh.triangles.is_empty() {
        let message = "3MF has triangles only, and the scan has none; choose a format of points";
        return Err(io::Error::new(ErrorKind::InvalidInput, message));
    }
    let mut archive = ZipWriter::new(out);
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (name, text) in [("[Content_Types].xml", TYPES), ("_rels/.rels", RELATIONS)] {
        archive.start_file(name, options)?;
        archive.write_all(text.as_bytes())?;
    }
    // Sizes beyond 4 GiB need a larger header, which is chosen before.
    archive.start_file(MODEL, options.large_file(true))?;
    let mut model = BufWriter::new(archive);
    write_model(&mut model, scan)?;
    model.into_inner().map_err(io::IntoInnerError::into_error)?.finish()?;
    Ok(())
}

fn write_model(out: &mut impl Write, scan: &Recorded<'_>) -> io::Result<()> {
    let unit = match scan.unit {
        Unit::Um => "micron",
        Unit::Mm => "millimeter",
        Unit::Cm => "centimeter",
        Unit::M => "meter",
        Unit::In => "inch",
        Unit::Ft => "foot",
    };
    writeln!(out, r#"<?xml version="1.0" encoding="UTF-8"?>"#)?;
    writeln!(
        out,
        r#"<model unit="{unit}" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">"#
    )?;
    writeln!(out, r#"<metadata name="Application">gmlc</metadata>"#)?;
    writeln!(out, "<resources>")?;
    let mesh = scan.mesh;
    let scale = scan.unit.millimetres();
    if mesh.groups.is_empty() {
        write_object(out, 1, "scan", mesh, scale)?;
    }
    for (group, id) in mesh.groups.iter().zip(1..) {
        let part = mesh.submesh(mesh.triangles[group.start..group.end].iter().copied());
        write_object(out, id, &group.name, &part, scale)?;
    }
    writeln!(out, "</resources>\n<build>")?;
    for id in 1..=mesh.groups.len().max(1) {
        writeln!(out, r#"<item objectid="{id}"/>"#)?;
    }
    writeln!(out, "</build>\n</model>")
}

fn write_object(out: &mut impl Write, id: usize, name: &str, mesh: &TriangleMesh, scale: f64) -> io::Result<()> {
    writeln!(out, r#"<object id="{id}" type="model" name="{}"><mesh><vertices>"#, escape(name))?;
    for [x, y, z] in mesh.positions.iter().map(|p| p.map(|c| c / scale)) {
        writeln!(out, r#"<vertex x="{x}" y="{y}" z="{z}"/>"#)?;
    }
    writeln!(out, "</vertices><triangles>")?;
    for [a, b, c] in &mesh.triangles {
        writeln!(out, r#"<triangle v1="{a}" v2="{b}" v3="{c}"/>"#)?;
    }
    writeln!(out, "</triangles></mesh></object>")
}
