//! A scan of ten million triangles.

use gml_compiler::program::{Options, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use gml_runtime::bvh::Bvh;
use gml_runtime::mesh::TriangleMesh;
use gml_runtime::model::{Atlas, Model, Texels};
use gml_runtime::scan::ScanSource;
use gml_runtime::variance::{self, Device, DistanceTexture, Facing, VarianceReport};
use std::error::Error;
use std::f64::consts::TAU;
use std::time::Instant;

/// Points around the cylinder and along it.
const AROUND: u32 = 2500;
const ALONG: u32 = 2001;

/// Limit of the memory. Bytes.
const MEMORY: u64 = 3_000_000_000;

/// Builds the hierarchy over a wavy cylinder, bakes a texture of 2048 x 2048, and says how much memory the process had
/// at most.
pub(crate) fn run() -> Result<(), Box<dyn Error>> {
    let text = "use std.surface (cylinder)\nmodel pipe { part side = cylinder(50mm, 250mm) }";
    let script = SourceFile { text: text.to_owned(), name: "pipe.gml".to_owned() };
    let program = compile(script, &NoFiles, &Options::default()).map_err(|_| "the pipe does not compile")?.program;
    let scan = wavy();
    println!("{} triangles, {} vertices", scan.triangles.len(), scan.positions.len());
    let started = Instant::now();
    let bvh = Bvh::build(&scan)?;
    println!("built after {:.2} s", started.elapsed().as_secs_f64());
    let instance = Model::instantiate(&program, &[])?;
    let atlas = Atlas::new(&program, &*instance, super::SIDE)?;
    let texels = Texels::of_model(&program, &*instance, &atlas)?;
    let deviations = variance::cast(texels, &bvh, super::MAX_DISTANCE, Facing::SAME, Device::Cpu)?.deviations;
    let texture = DistanceTexture::new(&deviations);
    let report = VarianceReport::new(&deviations, &ScanSource::default(), "cpu", &[]);
    println!("baked after {:.2} s", started.elapsed().as_secs_f64());
    let all = &report.overall;
    // The waves are sines of amplitude 0.5 mm on 50 mm, of which chords cut off nothing that counts.
    let expected = 0.5 / 2f64.sqrt();
    println!(
        "{} texels, coverage {:.4}, rms {:.5} mm, of {expected:.5} mm",
        all.texels, all.coverage, all.weighted.rms
    );
    if (all.weighted.rms - expected).abs() > 1e-3 || all.coverage < 0.999 || texture.rgb.is_empty() {
        return Err("that is not what it should be".into());
    }
    match peak_memory() {
        Some(bytes) if bytes > MEMORY => Err(format!("{:.2} GB were needed", bytes as f64 * 1e-9).into()),
        Some(bytes) => {
            println!("at most {:.2} GB, of {:.2} that are allowed", bytes as f64 * 1e-9, MEMORY as f64 * 1e-9);
            Ok(())
        }
        None => {
            println!("this system does not say how much memory was needed");
            Ok(())
        }
    }
}

/// A pipe of radius 50 mm and length 250 mm with eight waves around it.
fn wavy() -> TriangleMesh {
    let point = |i: u32, j: u32| {
        let angle = TAU * f64::from(i) / f64::from(AROUND);
        let radius = 50.0 + 0.5 * (8.0 * angle).sin();
        // A little longer than the model at both ends.
        [radius * angle.cos(), radius * angle.sin(), -0.1 + 250.2 * f64::from(j) / f64::from(ALONG - 1)]
    };
    let positions = (0..ALONG).flat_map(|j| (0..AROUND).map(move |i| point(i, j))).collect();
    let mut mesh = TriangleMesh { positions, ..TriangleMesh::default() };
    mesh.triangles.reserve_exact(2 * (AROUND * (ALONG - 1)) as usize);
    for j in 0..ALONG - 1 {
        for i in 0..AROUND {
            let (a, b) = (j * AROUND + i, j * AROUND + (i + 1) % AROUND);
            let (c, d) = (b + AROUND, a + AROUND);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// The largest resident set of this process so far, in bytes, where the system says it.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kilobytes| 1024 * kilobytes)
}
