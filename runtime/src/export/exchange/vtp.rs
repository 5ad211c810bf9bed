//! Deviations as PolyData of VTK (XML). Arrays are deflated in blocks, in base64.

use super::surface::MeasuredSurface;
use super::{classes, distances, of_point};
use crate::variance::MeasuredPoints;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::io::{self, Write};

/// Bytes that are deflated together, a multiple of the size of every number.
const BLOCK: usize = 1 << 20;

/// Writes the surface with its deviations.
pub(super) fn write_surface(out: &mut dyn Write, surface: &MeasuredSurface, parts: &[String]) -> io::Result<()> {
    let (points, polygons) = (surface.positions.len(), surface.triangles.len());
    begin(out, parts, &[], &format!("NumberOfPoints=\"{points}\" NumberOfVerts=\"0\" NumberOfPolys=\"{polygons}\""))?;
    let normals: Vec<f32> = surface.normals.iter().flatten().map(|c| *c as f32).collect();
    let class: Vec<u8> = surface.class.iter().map(|class| class.code()).collect();
    let part_of = |triangle: &[u32; 3]| surface.part[triangle[0] as usize] as i32;
    writeln!(out, "      <PointData Scalars=\"distance\" Normals=\"Normals\">")?;
    array(out, "distance", 1, &surface.distance)?;
    array(out, "detection", 1, &surface.detection)?;
    array(out, "part", 1, &surface.part.iter().map(|part| *part as i32).collect::<Vec<_>>())?;
    array(out, "class", 1, &class)?;
    array(out, "colour", 3, surface.colours.as_flattened())?;
    array(out, "Normals", 3, &normals)?;
    writeln!(out, "      </PointData>\n      <CellData>")?;
    array(out, "part", 1, &surface.triangles.iter().map(part_of).collect::<Vec<_>>())?;
    writeln!(out, "      </CellData>")?;
    places(out, &surface.positions)?;
    let corners: Vec<i64> = surface.triangles.iter().flatten().map(|vertex| i64::from(*vertex)).collect();
    cells(out, "Polys", &corners, 3)?;
    end(out)
}

/// Writes the scan's points with their distances.
pub(super) fn write_points(out: &mut dyn Write, points: &MeasuredPoints, parts: &[String]) -> io::Result<()> {
    let count = points.positions.len();
    begin(
        out,
        parts,
        &points.parts.paths,
        &format!("NumberOfPoints=\"{count}\" NumberOfVerts=\"{count}\" NumberOfPolys=\"0\""),
    )?;
    let (distance, part): (Vec<f64>, Vec<i32>) = (0..count).map(|i| of_point(points, i)).unzip();
    let class: Vec<u8> = (0..count).map(|i| points.class(i).code()).collect();
    writeln!(out, "      <PointData Scalars=\"distance\">")?;
    array(out, "distance", 1, &distance)?;
    array(out, "part", 1, &part)?;
    array(out, "class", 1, &class)?;
    if !points.parts.of_points.is_empty() {
        array(out, "scan", 1, &points.parts.of_points.iter().map(|scan| *scan as i32).collect::<Vec<_>>())?;
    }
    if !points.intensities.is_empty() {
        array(out, "intensity", 1, &points.intensities)?;
    }
    if !points.colours.is_empty() {
        array(out, "colour", 3, points.colours.as_flattened())?;
    }
    writeln!(out, "      </PointData>\n      <CellData/>")?;
    places(out, &points.positions)?;
    cells(out, "Verts", &(0..count as i64).collect::<Vec<_>>(), 1)?;
    end(out)
}

fn begin(out: &mut dyn Write, parts: &[String], scans: &[String], counts: &str) -> io::Result<()> {
    writeln!(out, "<?xml version=\"1.0\"?>")?;
    writeln!(
        out,
        "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" \
         compressor=\"vtkZLibDataCompressor\">\n  <PolyData>\n    <FieldData>"
    )?;
    texts(out, "parts", parts)?;
    if !scans.is_empty() {
        texts(out, "scans", scans)?;
    }
    texts(out, "unit", &["mm".to_owned()])?;
    texts(out, "distances", &[distances()])?;
    texts(out, "classes", &[classes()])?;
    writeln!(out, "    </FieldData>\n    <Piece {counts} NumberOfLines=\"0\" NumberOfStrips=\"0\">")
}

fn end(out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "    </Piece>\n  </PolyData>\n</VTKFile>")
}

/// An array of texts: the bytes of each as numbers, and a zero, so that nothing in them is markup.
fn texts(out: &mut dyn Write, name: &str, texts: &[String]) -> io::Result<()> {
    let count = texts.len();
    writeln!(out, "      <Array type=\"String\" Name=\"{name}\" NumberOfTuples=\"{count}\" format=\"ascii\">")?;
    for text in texts {
        let bytes = text.bytes().filter(|byte| *byte != 0).map(|byte| format!("{byte} "));
        writeln!(out, "        {}0", bytes.collect::<String>())?;
    }
    writeln!(out, "      </Array>")
}

fn places(out: &mut dyn Write, positions: &[[f64; 3]]) -> io::Result<()> {
    writeln!(out, "      <Points>")?;
    array(out, "Points", 3, positions.as_flattened())?;
    writeln!(out, "      </Points>")
}

/// Cells of equal numbers of `corners`.
fn cells(out: &mut dyn Write, kind: &str, corners: &[i64], of_cell: usize) -> io::Result<()> {
    let offsets: Vec<i64> = (1..=corners.len() / of_cell).map(|cell| (cell * of_cell) as i64).collect();
    writeln!(out, "      <{kind}>")?;
    array(out, "connectivity", 1, corners)?;
    array(out, "offsets", 1, &offsets)?;
    writeln!(out, "      </{kind}>")
}

/// A type of numbers in arrays.
trait Number: Copy {
    const NAME: &'static str;
    fn append(self, bytes: &mut Vec<u8>);
}

macro_rules! number {
    ($($number:ty => $name:literal),*) => {$(
        impl Number for $number {
            const NAME: &'static str = $name;
            fn append(self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
        }
    )*};
}

number!(f32 => "Float32", f64 => "Float64", i32 => "Int32", i64 => "Int64", u8 => "UInt8");

fn array<T: Number>(out: &mut dyn Write, name: &str, components: usize, values: &[T]) -> io::Result<()> {
    let mut bytes = Vec::with_capacity(std::mem::size_of_val(values));
    values.iter().for_each(|value| value.append(&mut bytes));
    let kind = T::NAME;
    writeln!(
        out,
        "        <DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"binary\">"
    )?;
    writeln!(out, "          {}\n        </DataArray>", deflated(&bytes)?)
}

/// Bytes as VTK reads them: the number of blocks, the size of a block, that of the last one if it is smaller (otherwise
/// 0), and the deflated sizes, 64 bits each, in base64; then the deflated blocks in base64 of their own.
pub(super) fn deflated(bytes: &[u8]) -> io::Result<String> {
    let mut header = vec![bytes.len().div_ceil(BLOCK) as u64, BLOCK as u64, (bytes.len() % BLOCK) as u64];
    let mut blocks = Vec::new();
    for block in bytes.chunks(BLOCK) {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(block)?;
        let block = encoder.finish()?;
        header.push(block.len() as u64);
        blocks.extend(block);
    }
    let header: Vec<u8> = header.into_iter().flat_map(u64::to_le_bytes).collect();
    Ok(STANDARD.encode(header) + &STANDARD.encode(blocks))
}
