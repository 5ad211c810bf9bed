//! How long the deviations of a large texture take, by stage: the paper's cup at the position of its scan, a texture of
//! 2048 x 2048, two directions a texel, 10 mm.
//!
//! `GMLC_TEST_DATA=... cargo bench --bench variance` prints wall and processor seconds, the least of several runs, and
//! queries (texels) a second. `-- --side 2304` takes another texture. With `-- --dump FILE` origins and normals are
//! written, and what was found, for benches/variance/peers.py, which casts the same rays with other libraries and
//! compares; likewise distances to closest points of some of the texels. With `GMLC_PEER_PYTHON=/path/to/python` that
//! script runs at the end, on files of its own.
//!
//! `-- --agreement` compares distances with those of other programs and needs no data ([`agreement`]).
//!
//! `-- --large` needs no data: a scan of ten million triangles is built and baked at, and the process's largest memory
//! is printed.

mod agreement;
mod large;

use cpu_time::ProcessTime;
use gml_compiler::program::{Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use gml_runtime::bvh::Bvh;
use gml_runtime::model::{Atlas, Model, Motion, Texels};
use gml_runtime::progress::Silent;
use gml_runtime::scan::{Scan, ScanSource, Unit, read};
use gml_runtime::variance::{
    self, Device, DistanceTexture, Facing, Matching, MeasureOptions, Reference, Resolution, VarianceReport,
};
use std::error::Error;
use std::io::Write;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// Side of the texture where no other is asked for.
const SIDE: u32 = 2048;

/// One texel in this many is compared with the closest points of other programs.
const CLOSEST_STEP: usize = 20;

/// Length of the rays. Millimetres.
const MAX_DISTANCE: f64 = 10.0;

/// The least times of each stage so far: name, wall, processor.
#[derive(Default)]
struct Stages(Vec<(&'static str, f64, f64)>);

impl Stages {
    fn time<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let (wall, processor) = (Instant::now(), ProcessTime::now());
        let result = work();
        let (wall, processor) = (wall.elapsed().as_secs_f64(), processor.elapsed().as_secs_f64());
        match self.0.iter_mut().find(|s| s.0 == name) {
            Some(stage) => (stage.1, stage.2) = (stage.1.min(wall), stage.2.min(processor)),
            None => self.0.push((name, wall, processor)),
        }
        result
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let value = |name: &str| arguments.iter().position(|a| a == name).and_then(|i| arguments.get(i + 1));
    if arguments.iter().any(|a| a == "--large") {
        return large::run();
    }
    let folder = std::env::var_os("GMLC_TEST_DATA").map(|folder| Path::new(&folder).join("cup"));
    let python = std::env::var_os("GMLC_PEER_PYTHON");
    if arguments.iter().any(|a| a == "--agreement") {
        let python = python.ok_or("GMLC_PEER_PYTHON must name a Python with numpy (docs/benchmarks.md)")?;
        return agreement::run(&python, folder.as_deref());
    }
    let Some(folder) = folder else {
        println!("skipped: GMLC_TEST_DATA is not set");
        return Ok(());
    };
    let program = cup()?;
    let x = true_parameters(&program, &folder)?;
    let scan = read(&folder.join("cup_scan.ply"), &Unit::Mm.into(), &Silent)?;
    let side = value("--side").map_or(Ok(SIDE), |side| side.parse())?;
    let own = tempfile::tempdir()?;
    let dump = match (value("--dump"), &python) {
        (Some(path), _) => Some(path.clone()),
        (None, Some(_)) => Some(own.path().join("rays").display().to_string()),
        (None, None) => None,
    };
    let dump = dump.as_deref();

    let mut stages = Stages::default();
    let mut count = 0;
    for run in 0..5 {
        let texels = stages.time("texels", || -> Result<_, Box<dyn Error>> {
            let instance = Model::instantiate(&program, &x)?;
            let atlas = Atlas::new(&program, &*instance, side)?;
            Ok(Texels::of_model(&program, &*instance, &atlas)?)
        })?;
        count = texels.len();
        if let (0, Some(dump)) = (run, dump) {
            write_rays(Path::new(dump), &texels)?;
        }
        let bvh = stages.time("build", || Bvh::build(&scan.mesh))?;
        let trace = stages.time("trace", || variance::cast(texels, &bvh, MAX_DISTANCE, Facing::Any, Device::Cpu))?;
        let deviations = trace.deviations;
        if let (0, Some(dump)) = (run, dump) {
            let both = deviations.outward.iter().zip(&deviations.inward).flat_map(|(a, b)| [*a, *b]);
            write_floats(Path::new(&format!("{dump}.found")), both)?;
            write_closest(dump, &deviations.texels, &bvh)?;
        }
        stages.time("texture", || DistanceTexture::new(&deviations));
        let report = stages.time("statistics", || VarianceReport::new(&deviations, &ScanSource::default(), "cpu", &[]));
        if run == 0 {
            let s = &report.overall;
            println!("{count} texels, coverage {:.4}, rms {:.4} mm", s.coverage, s.weighted.rms);
        }
    }
    stages.0.push(mutual_test(&program, &x, &scan, side)?);
    println!("{:12}{:>10}{:>12}", "stage", "wall s", "processor s");
    let mut all = (0.0, 0.0);
    for (name, wall, processor) in &stages.0 {
        println!("{name:12}{wall:10.3}{processor:12.3}");
        all = (all.0 + wall, all.1 + processor);
        if *name == "trace" {
            let million = count as f64 / 1e6;
            println!(
                "{:12}{:10.2}{:12.2}  million queries a second (of the wall, of a processor)",
                "",
                million / wall,
                million / processor
            );
        }
    }
    println!("{:12}{:10.3}{:12.3}", "all", all.0, all.1);
    if let Some(dump) = dump {
        let casting = stages.0.iter().find(|s| s.0 == "trace").map_or((0.0, 0.0), |s| (s.1, s.2));
        let times = serde_json::json!({ "casting": [casting.0, casting.1], "all": [all.0, all.1] });
        std::fs::write(format!("{dump}.times"), times.to_string())?;
        if let Some(python) = python {
            let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/variance/peers.py");
            let scan = folder.join("cup_scan.ply");
            let status = Command::new(python).arg(script).arg(dump).arg(scan).arg(MAX_DISTANCE.to_string()).status()?;
            if !status.success() {
                return Err(format!("the peers' script ended with {status}").into());
            }
        }
    }
    Ok(())
}

/// What the mutual test takes: by how much a whole measurement takes longer with it, the least of three runs each. Both
/// build the hierarchy over the model, which the distances of the scan's points need as well.
fn mutual_test(
    program: &Program,
    x: &[f64],
    scan: &Scan,
    side: u32,
) -> Result<(&'static str, f64, f64), Box<dyn Error>> {
    let mut options = MeasureOptions::default();
    options.resolution = Resolution::Side(side);
    (options.max_distance, options.device) = (Some(MAX_DISTANCE), Device::Cpu);
    // Deviations of form, which are not baked, take little time behind so long a filter.
    options.form_cutoff = Some(1e6);
    let mut stages = Stages::default();
    for _ in 0..3 {
        for matching in [Matching::All, Matching::Mutual] {
            options.matching = matching;
            let reference = Reference::Model { model: program, x, motion: Motion::IDENTITY };
            stages.time(matching.name(), || variance::measure(reference, scan, None, &options, &Silent))?;
        }
    }
    let [(_, wall, processor), (_, with_wall, with_processor)] = stages.0[..] else { unreachable!("two kinds") };
    Ok(("mutual test", (with_wall - wall).max(0.0), (with_processor - processor).max(0.0)))
}

/// The paper's cup.
fn cup() -> Result<Program, Box<dyn Error>> {
    let path = format!("{}/examples/cup/cup.gml", env!("CARGO_MANIFEST_DIR"));
    let script = SourceFile { text: std::fs::read_to_string(&path)?, name: path };
    Ok(compile(script, &NoFiles, &Options::default()).map_err(|_| "the cup does not compile")?.program)
}

/// The parameters that the scan was made with.
fn true_parameters(program: &Program, folder: &Path) -> Result<Vec<f64>, Box<dyn Error>> {
    let truth: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(folder.join("cup_truth.json"))?)?;
    let value = |name: &str| {
        let names = truth["names"].as_array()?;
        let i = names.iter().position(|n| n.as_str().is_some_and(|n| n.eq_ignore_ascii_case(name)))?;
        truth["x_true"][i].as_f64()
    };
    let of = |name: &str| value(name).ok_or(format!("the truth has no parameter {name}").into());
    program.parameters().iter().map(|p| of(&p.name)).collect()
}

/// Six numbers a texel: origin and normal.
fn write_rays(path: &Path, texels: &Texels) -> std::io::Result<()> {
    let ray = |(position, normal): (&[f64; 3], &[f32; 3])| [position.map(|x| x as f32), *normal].concat();
    write_floats(path, texels.position.iter().zip(&texels.normal).flat_map(ray))
}

/// Four numbers for some of the texels: where they are, and how far the scan's closest point is.
fn write_closest(dump: &str, texels: &Texels, bvh: &Bvh) -> std::io::Result<()> {
    let rows = texels.position.iter().step_by(CLOSEST_STEP).flat_map(|position| {
        let distance = bvh.closest_point((*position).into(), f64::INFINITY).map_or(f64::NAN, |c| c.distance);
        position.iter().copied().chain([distance])
    });
    write_doubles(Path::new(&format!("{dump}.closest")), rows)
}

/// In double precision, bytes in the machine's order.
fn write_doubles(path: &Path, values: impl Iterator<Item = f64>) -> std::io::Result<()> {
    let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
    for x in values {
        file.write_all(&x.to_ne_bytes())?;
    }
    file.flush()
}

/// In single precision, bytes in the machine's order.
fn write_floats(path: &Path, values: impl Iterator<Item = f32>) -> std::io::Result<()> {
    let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
    for x in values {
        file.write_all(&x.to_ne_bytes())?;
    }
    file.flush()
}
