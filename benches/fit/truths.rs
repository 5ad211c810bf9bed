//! Every example against virtual scans of shapes drawn from the middle half of its bounds, in any pose, from the
//! script's defaults: how often every parameter is within four of its standard deviations, or marked as one that is
//! not to be trusted (not converged, no standard deviation, or a warning that names it). What is wrong and silent is
//! listed.

use crate::case::Case;
use crate::{coverage, median, seconds};
use gml_compiler::program::Parameter;
use gml_runtime::fit::{FitOptions, FitResult, FittedParameter, fit};
use gml_runtime::model::{Atlas, Material, Model, Partials, Standing, Texels};
use gml_runtime::progress::Silent;
use gml_runtime::scan::Scan;
use gml_runtime::simulate::Scanner;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::ops::Range;

const EXAMPLES: [&str; 13] = [
    "amphora",
    "bowl",
    "can",
    "column",
    "cup",
    "elbow",
    "flange",
    "fluted_bowl",
    "jar",
    "mug",
    "pan",
    "planter",
    "tree",
];
/// A scan's points, about: between these.
const POINTS: Range<f64> = 6e3..20e3;
/// Noise over spacing: between these.
const NOISE: Range<f64> = 0.05..0.4;
/// Standard deviations within which a parameter is right.
const ALLOWED: f64 = 4.0;
/// Draws of a shape that exists.
const DRAWS: usize = 1000;
/// Samples of a patch each way, from which its area is known.
const SAMPLES: usize = 24;
/// Relative difference in area of two surfaces that are one: their samples are the same up to rounding.
const SAME_AREA: f64 = 1e-9;
/// Texels each way that are looked at for walls that pass through each other, and the share of them that may.
const LOOK: u32 = 256;
const PASSED: f64 = 1e-3;

/// Prints what is wrong, and a table.
pub(crate) fn run(seeds: Range<usize>, only: Option<&str>) {
    for name in EXAMPLES.iter().filter(|name| only.is_none_or(|only| only == **name)) {
        let case = Case::read(name);
        let (mut right, mut marked, mut times) = (0, 0, Vec::new());
        for seed in seeds.clone() {
            let Drawn { truth, scan, scanner } = draw(&case, seed as u64);
            let result = fit(&case.program, &scan, &FitOptions::default(), &Silent).unwrap_or_else(|e| panic!("{e}"));
            times.push(seconds(&result));
            let truth = exchanged(&case, &result, &truth).unwrap_or(truth);
            let wrong: Vec<usize> = (0..truth.len()).filter(|k| !is_right(&case, &result, &truth, *k)).collect();
            let silent: Vec<usize> = wrong.iter().copied().filter(|k| !is_marked(&result, *k)).collect();
            right += usize::from(wrong.is_empty());
            marked += usize::from(!wrong.is_empty() && silent.is_empty());
            if !silent.is_empty() {
                println!("  {name} {seed}: {}", described(&case, &scan, &scanner, &truth, &result, &silent));
            }
        }
        let count = seeds.len();
        println!(
            "{name:9} {right:3} right and {marked:3} marked of {count:3} ({:.1} %)   median {:.2} s, most {:.2} s",
            100.0 * (right + marked) as f64 / count as f64,
            median(&mut times),
            times.iter().copied().fold(0.0, f64::max),
        );
    }
}

/// A shape and its scan.
struct Drawn {
    truth: Vec<f64>,
    scan: Scan,
    scanner: Scanner,
}

fn draw(case: &Case, seed: u64) -> Drawn {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for _ in 0..DRAWS {
        let within = |p: &Parameter, random: &mut ChaCha8Rng| {
            let quarter = (p.upper - p.lower) / 4.0;
            if is_pose(p) { p.default } else { random.random_range(p.lower + quarter..p.upper - quarter) }
        };
        let truth: Vec<f64> = case.program.parameters().iter().map(|p| within(p, &mut random)).collect();
        if !is_an_object(case, &truth).unwrap_or(false) {
            continue;
        }
        let Some(area) = area(case, &truth) else { continue };
        let spacing = (area / random.random_range(POINTS)).sqrt();
        let noise = spacing * random.random_range(NOISE);
        let scanner = Scanner { spacing, noise, seed, ..Scanner::default() };
        if let Some(scan) = case.scan(&truth, &scanner) {
            return Drawn { truth, scan, scanner };
        }
    }
    panic!("no shape exists")
}

/// Whether the walls of a model do not pass through each other: there is no such object, and a fit would hold them
/// apart. None where the model does not exist.
fn is_an_object(case: &Case, values: &[f64]) -> Option<bool> {
    let instance = Model::instantiate(&case.program, values).ok()?;
    let atlas = Atlas::new(&case.program, &*instance, LOOK).ok()?;
    let texels = Texels::of_model(&case.program, &*instance, &atlas).ok()?;
    let standing = Material::new(&case.program, &*instance).ok()?.of_texels(&texels);
    let passed = standing.iter().filter(|standing| **standing == Standing::PassedThrough).count();
    Some(passed as f64 <= PASSED * standing.len() as f64)
}

/// Parameters without bounds move the model.
fn is_pose(p: &Parameter) -> bool {
    !(p.lower.is_finite() && p.upper.is_finite())
}

/// The area of the model. Square millimetres. None where it does not exist.
fn area(case: &Case, values: &[f64]) -> Option<f64> {
    let instance = Model::instantiate(&case.program, values).ok()?;
    let at = |k: usize| (k as f64 + 0.5) / SAMPLES as f64;
    let u: Vec<f64> = (0..SAMPLES * SAMPLES).map(|k| at(k % SAMPLES)).collect();
    let v: Vec<f64> = (0..SAMPLES * SAMPLES).map(|k| at(k / SAMPLES)).collect();
    let mut partials = vec![Partials::default(); u.len()];
    let mut sum = 0.0_f64;
    for patch in 0..Model::parts(&case.program).len() {
        instance.partials(patch, &u, &v, &mut partials).ok()?;
        sum += partials.iter().map(coverage::area).sum::<f64>() / u.len() as f64;
    }
    sum.is_finite().then_some(sum)
}

/// Whether a parameter is within some standard deviations of the truth.
fn is_right(case: &Case, result: &FitResult, truth: &[f64], k: usize) -> bool {
    let found = &result.parameters[k];
    is_pose(&case.program.parameters()[k]) || found.sd.is_some_and(|sd| (found.value - truth[k]).abs() <= ALLOWED * sd)
}

/// The truth with parameters exchanged as the result has them, if that is the same surface: a curve run backwards is
/// the same curve, and the fit takes the one nearer to the defaults. None where nothing is exchanged.
fn exchanged(case: &Case, result: &FitResult, truth: &[f64]) -> Option<Vec<f64>> {
    let mut values = truth.to_vec();
    for k in 0..truth.len() {
        if is_right(case, result, &values, k) {
            continue;
        }
        let with = |other: &usize| {
            let mut swapped = values.clone();
            swapped.swap(k, *other);
            is_right(case, result, &swapped, k) && is_right(case, result, &swapped, *other)
        };
        let other = (k + 1..truth.len()).find(with)?;
        values.swap(k, other);
    }
    let [before, after] = [area(case, truth)?, area(case, &values)?];
    (values != truth && (after / before - 1.0).abs() < SAME_AREA).then_some(values)
}

/// Whether the result says that a parameter is not to be trusted.
fn is_marked(result: &FitResult, k: usize) -> bool {
    let FittedParameter { name, sd, .. } = &result.parameters[k];
    !result.converged || sd.is_none() || result.warnings.iter().any(|w| w.contains(&format!("`{name}`")))
}

fn described(
    case: &Case,
    scan: &Scan,
    scanner: &Scanner,
    truth: &[f64],
    result: &FitResult,
    silent: &[usize],
) -> String {
    let of = |k: &usize| {
        let FittedParameter { name, value, sd, .. } = &result.parameters[*k];
        let sds = (value - truth[*k]) / sd.unwrap_or(f64::NAN);
        format!("{name} {value:.4} for {:.4} ({sds:.1} sd)", truth[*k])
    };
    let mut options = FitOptions::default();
    let shape = case.program.parameters().iter().zip(truth).filter(|(p, _)| !is_pose(p));
    options.start.extend(shape.map(|(p, x)| (p.name.clone(), *x)));
    let from_truth = fit(&case.program, scan, &options, &Silent).map_or(f64::NAN, |f| f.objective);
    let contradicted: f64 = result.contradicted.iter().flatten().map(|c| c.area).sum();
    let shown = |(p, x): (&Parameter, &f64)| format!(" -p {}={}", p.name, p.quantity.shown(*x).replace(' ', ""));
    let set = case.program.parameters().iter().zip(truth).filter(|(p, _)| !is_pose(p)).map(shown);
    format!(
        "{}; objective {:.5} (from the truth {from_truth:.5}), inliers {:.3}, contradicted {contradicted:.0} mm2, {} \
         warnings; gmlc scan{} --spacing {:.4}mm --noise {:.4}mm --seed {}",
        silent.iter().map(of).collect::<Vec<_>>().join(", "),
        result.objective,
        result.inliers,
        result.warnings.len(),
        set.collect::<String>(),
        scanner.spacing,
        scanner.noise,
        scanner.seed,
    )
}
