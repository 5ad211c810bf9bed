//! How long files take to read: a surface of two million triangles in every format that is written.
//!
//! `cargo bench --bench read` prints, for each format, the size of the file, wall and processor seconds of reading
//! alone (the least of five runs, the file in the cache of the operating system), megabytes of the file a second, and
//! the seconds of `read`, which also cleans, computes normals and estimates the noise (the least of two).
//! `-- --triangles 10000000` takes a larger surface, `-- ply stl` some formats only. With
//! `GMLC_PEER_PYTHON=/path/to/python` the same files are read by Open3D and trimesh in the same run.

use cpu_time::ProcessTime;
use gml_runtime::export::scan::{Recorded, ScanFormat, write};
use gml_runtime::mesh::TriangleMesh;
use gml_runtime::progress::Silent;
use gml_runtime::scan::{Attributes, ReadOptions, Unit, load, read};
use std::error::Error;
use std::f64::consts::TAU;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// Triangles of the surface where no others are asked for.
const TRIANGLES: usize = 2_000_000;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let at = arguments.iter().position(|a| a == "--triangles");
    let triangles = at.and_then(|at| arguments.get(at + 1)).map_or(Ok(TRIANGLES), |number| number.parse())?;
    let wanted: Vec<&str> = arguments.iter().map(String::as_str).filter(|a| ScanFormat::named(a).is_some()).collect();
    let mesh = surface(triangles);
    println!("{} vertices, {} triangles", mesh.positions.len(), mesh.triangles.len());
    println!("{:18}{:>9}{:>10}{:>13}{:>9}{:>12}", "format", "MB", "reading s", "processor s", "MB/s", "read() s");
    let folder = tempfile::tempdir()?;
    for (ending, format) in ScanFormat::ALL {
        if !wanted.is_empty() && !wanted.contains(&ending) {
            continue;
        }
        let path = folder.path().join(format!("surface.{ending}"));
        if ending == "ply" {
            // As most programs write it: single precision, no normals.
            plain_ply(&path, &mesh)?;
        } else {
            let attributes = Attributes::default();
            let recorded = Recorded { mesh: &mesh, attributes: &attributes, grids: &[], unit: Unit::Mm };
            if let Err(error) = write(&path, &recorded, format) {
                println!("{ending:18}{error}");
                continue;
            }
        }
        time(ending, &path)?;
        if let Some(python) = std::env::var_os("GMLC_PEER_PYTHON") {
            let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/read/peers.py");
            let status = Command::new(python).arg(script).arg(&path).status()?;
            if !status.success() {
                return Err(format!("the peers' script ended with {status}").into());
            }
        }
        std::fs::remove_file(&path)?;
    }
    Ok(())
}

/// Prints a file's line.
fn time(ending: &str, path: &Path) -> Result<(), Box<dyn Error>> {
    let megabytes = std::fs::metadata(path)?.len() as f64 / 1e6;
    let options = ReadOptions::default();
    let (mut wall, mut processor, mut whole) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
    for _ in 0..5 {
        let (start, used) = (Instant::now(), ProcessTime::now());
        load(path, &options, &Silent)?;
        wall = wall.min(start.elapsed().as_secs_f64());
        processor = processor.min(used.elapsed().as_secs_f64());
    }
    for _ in 0..2 {
        let start = Instant::now();
        read(path, &options, &Silent)?;
        whole = whole.min(start.elapsed().as_secs_f64());
    }
    let speed = megabytes / wall;
    println!("{ending:18}{megabytes:9.1}{wall:10.3}{processor:13.3}{speed:9.0}{whole:12.3}");
    Ok(())
}

/// A ball with waves and noise of some micrometres, open at its poles.
fn surface(triangles: usize) -> TriangleMesh {
    let rows = (triangles as f64 / 4.0).sqrt().ceil().max(1.0) as usize;
    let columns = 2 * rows;
    let mut mesh = TriangleMesh::default();
    for (i, j) in (0..=rows).flat_map(|i| (0..columns).map(move |j| (i, j))) {
        let theta = TAU / 2.0 * (0.1 + 0.8 * i as f64 / rows as f64);
        let phi = TAU * j as f64 / columns as f64;
        let noise = ((i * columns + j) as f64 * 12.9898).sin() * 0.005;
        let radius = 50.0 + 2.0 * (6.0 * phi).sin() * (3.0 * theta).sin() + noise;
        let position = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()].map(|c| radius * c);
        mesh.positions.push(position);
    }
    let at = |i: usize, j: usize| (i * columns + j % columns) as u32;
    for (i, j) in (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}

fn plain_ply(path: &Path, mesh: &TriangleMesh) -> std::io::Result<()> {
    let mut out = BufWriter::new(std::fs::File::create(path)?);
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}", mesh.positions.len())?;
    writeln!(out, "property float x\nproperty float y\nproperty float z\nelement face {}", mesh.triangles.len())?;
    writeln!(out, "property list uchar int vertex_indices\nend_header")?;
    for c in mesh.positions.iter().flatten() {
        out.write_all(&(*c as f32).to_le_bytes())?;
    }
    for triangle in &mesh.triangles {
        out.write_all(&[3])?;
        for vertex in triangle {
            out.write_all(&vertex.to_le_bytes())?;
        }
    }
    out.flush()
}
