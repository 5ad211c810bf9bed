//! How often 95 % intervals (the estimate and 1.96 standard deviations either way) hold the truth: scans of the cup
//! with points spread evenly over its surface, displaced along the normal. Once by white noise, once by waves of noise
//! over a few millimetres with a little white noise on them. `naive` intervals are those that take residuals for
//! independent of each other.

use crate::program;
use gml_compiler::program::Program;
use gml_runtime::fit::{FitOptions, FitResult, fit};
use gml_runtime::mesh::TriangleMesh;
use gml_runtime::model::{Instance, Model, Partials};
use gml_runtime::progress::Silent;
use gml_runtime::scan::{self, Scan};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Points of a scan.
const POINTS: usize = 6000;
/// Standard deviation of the noise. Millimetres.
const NOISE: f64 = 0.3;
/// Waves of which correlated noise is the sum, and their length. Millimetres.
const WAVES: usize = 60;
const LENGTH: f64 = 8.0;
/// Draws from which the largest area that one stands for is taken.
const PROBES: usize = 3000;
/// Pose and shape of the cup.
pub(crate) const TRUTH: [f64; 15] =
    [30.0, -12.0, 55.0, 0.7, 0.4, -0.9, 3.0, 44.0, 80.0, 0.97, 1.8, 0.9, 1.75, 0.25, 0.84];

/// Prints both tables, over so many scans each.
pub(crate) fn run(scans: usize) {
    let program = program("examples/cup/cup.gml", BTreeMap::new());
    for (title, waves) in [("white noise", false), ("correlated noise", true)] {
        let mut tallies = vec![Tally::default(); TRUTH.len()];
        let mut counted = 0;
        for seed in 0..scans as u64 {
            let scan = simulated(&program, &TRUTH, waves, seed);
            let start = program.parameters().iter().zip(TRUTH).map(|(p, x)| (p.name.clone(), x)).collect();
            let mut options = FitOptions::default();
            (options.start, options.no_pose) = (start, true);
            let result = fit(&program, &scan, &options, &Silent).unwrap_or_else(|e| panic!("{e}"));
            counted += usize::from(count(&result, &mut tallies));
        }
        println!("{title}: {counted} of {scans} scans had standard deviations for all parameters");
        println!("          within     naive    bias  spread   (of the estimates, in standard deviations reported)");
        for (p, tally) in program.parameters().iter().zip(&tallies) {
            let n = counted.max(1) as f64;
            let (share, bias) = (tally.within.map(|w| 100.0 * w as f64 / n), tally.off / n);
            let spread = (tally.off2 / n - bias * bias).max(0.0).sqrt();
            println!("  {:6} {:5.1} %   {:5.1} %   {bias:5.2}   {spread:5.2}", p.name, share[0], share[1]);
        }
    }
}

/// Results of one parameter over all scans.
#[derive(Clone, Default)]
struct Tally {
    /// How often the interval held the truth: ours, and the naive one.
    within: [usize; 2],
    /// Sums of the error in standard deviations, and of its square.
    off: f64,
    off2: f64,
}

/// Adds one fit; false where it has no covariance of everything.
fn count(result: &FitResult, tallies: &mut [Tally]) -> bool {
    let Some(known) = &result.covariance else { return false };
    if known.parameters.len() != TRUTH.len() || known.naive.len() != TRUTH.len() {
        return false;
    }
    for (i, (p, truth)) in result.parameters.iter().zip(TRUTH).enumerate() {
        let off = p.value - truth;
        let scaled = off / p.sd.unwrap_or(f64::INFINITY);
        tallies[i].within[0] += usize::from(scaled.abs() <= 1.96);
        tallies[i].within[1] += usize::from(off.abs() <= 1.96 * known.naive[i]);
        tallies[i].off += scaled;
        tallies[i].off2 += scaled * scaled;
    }
    true
}

/// Points spread evenly over the surface, with noise along the normal, which points out.
pub(crate) fn simulated(program: &Program, truth: &[f64; 15], waves: bool, seed: u64) -> Scan {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let instance = Model::instantiate(program, truth).unwrap_or_else(|e| panic!("{e}"));
    let field = Field::new(&mut random);
    let mut mesh = TriangleMesh::default();
    let largest = (0..PROBES).map(|_| area(&draw(program, &*instance, &mut random))).fold(0.0, f64::max);
    while mesh.positions.len() < POINTS {
        let p = draw(program, &*instance, &mut random);
        // Points are drawn evenly over (u, v) and kept with a probability like the area that they stand for.
        if random.random::<f64>() * largest < area(&p) {
            let unit = cross(p.du, p.dv).map(|c| c / area(&p));
            let white = NOISE * gaussian(&mut random);
            let off = if waves { field.at(p.point) + 0.2 * white } else { white };
            mesh.positions.push([0, 1, 2].map(|k| p.point[k] + off * unit[k]));
            mesh.normals.push(unit);
        }
    }
    scan::from_mesh(mesh, "simulated").unwrap_or_else(|e| panic!("{e}"))
}

/// A place on any of the parts.
fn draw(program: &Program, instance: &dyn Instance, random: &mut ChaCha8Rng) -> Partials {
    let patch = random.random_range(0..Model::parts(program).len());
    let mut out = [Partials::default()];
    let (u, v) = (random.random::<f64>(), random.random::<f64>());
    instance.partials(patch, &[u], &[v], &mut out).unwrap_or_else(|e| panic!("{e}"));
    out[0]
}

/// The size of a place's piece of surface.
pub(crate) fn area(p: &Partials) -> f64 {
    cross(p.du, p.dv).iter().map(|c| c * c).sum::<f64>().sqrt()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
}

/// Box and Muller's.
fn gaussian(random: &mut ChaCha8Rng) -> f64 {
    let (a, b): (f64, f64) = (1.0 - random.random::<f64>(), random.random());
    (-2.0 * a.ln()).sqrt() * (TAU * b).cos()
}

/// A sum of waves in random directions: nearly Gaussian noise whose neighbours resemble each other.
struct Field(Vec<([f64; 3], f64)>);

impl Field {
    fn new(random: &mut ChaCha8Rng) -> Self {
        let wave = |_| {
            let direction = crate::matrix::unit(random);
            let frequency = TAU / LENGTH * random.random_range(0.5..1.5);
            (direction.map(|c| c * frequency), random.random_range(0.0..TAU))
        };
        Self((0..WAVES).map(wave).collect())
    }

    fn at(&self, p: [f64; 3]) -> f64 {
        let wave = |(k, phase): &([f64; 3], f64)| (k[0] * p[0] + k[1] * p[1] + k[2] * p[2] + phase).cos();
        NOISE * (2.0 / WAVES as f64).sqrt() * self.0.iter().map(wave).sum::<f64>()
    }
}
