//! Code that the tests of whole programs share.
#![allow(unreachable_pub, reason = "it is a module of several tests")]
#![allow(dead_code, reason = "not every test uses all of it")]

use gml_compiler::program::{Compilation, Options, Parameter, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use std::path::{Path, PathBuf};

/// The scripts of the examples: `cup/cup`, `cup/octagonal_cup`, ...
pub fn examples() -> Vec<String> {
    let folder = |path: &Path| -> Vec<PathBuf> {
        let entries = std::fs::read_dir(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        entries.map(|e| e.unwrap().path()).collect()
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let files = folder(&root).into_iter().filter(|p| p.is_dir()).flat_map(|p| folder(&p));
    let scripts = files.filter(|p| p.extension().is_some_and(|e| e == "gml"));
    let name = |p: PathBuf| p.strip_prefix(&root).unwrap().with_extension("").display().to_string();
    let mut names: Vec<String> = scripts.map(name).collect();
    names.sort();
    names
}

/// A script of the examples, compiled.
pub fn example(name: &str) -> Program {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(name).with_extension("gml");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    program(&format!("{name}.gml"), &text)
}

/// A script of the tests' own models, compiled: `library` has all curves and surfaces of the library, `orders` has
/// derivatives of several orders, through loops, recursion, branches and closures.
pub fn model(name: &str) -> Program {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/models").join(name).with_extension("gml");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    program(&format!("{name}.gml"), &text)
}

/// A script, compiled.
pub fn program(name: &str, text: &str) -> Program {
    let script = SourceFile { name: name.to_owned(), text: text.to_owned() };
    match compile(script, &NoFiles, &Options::default()) {
        Ok(Compilation { program, .. }) => program,
        Err(failed) => panic!("{failed}\n{:#?}", failed.diagnostics),
    }
}

/// Numbers in 0..1 that are the same in every run: splitmix64 (Steele, Lea and Flood 2014).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    /// A value of a parameter within its bounds or, if there are none, within 3 of its default (millimetres or
    /// radians).
    pub fn value(&mut self, parameter: &Parameter) -> f64 {
        let low =
            parameter.lower.max(parameter.default - if parameter.lower.is_finite() { f64::INFINITY } else { 3.0 });
        let high =
            parameter.upper.min(parameter.default + if parameter.upper.is_finite() { f64::INFINITY } else { 3.0 });
        let low = if low.is_finite() { low } else { parameter.default - 3.0 };
        let high = if high.is_finite() { high } else { parameter.default + 3.0 };
        // Values keep away from the bounds: differences need room.
        self.between(low + 0.01 * (high - low), high - 0.01 * (high - low))
    }

    /// Parameters for which the model exists. Bounds that depend on other parameters and `require` reject some.
    pub fn parameters(&mut self, program: &Program) -> Vec<f64> {
        for _ in 0..10_000 {
            let x: Vec<f64> = program.parameters().iter().map(|p| self.value(p)).collect();
            let bounded = program.bounds(&x).iter().zip(&x).all(|((low, high), x)| low < x && x < high);
            if bounded && program.instantiate(&x).is_ok() {
                return x;
            }
        }
        panic!("no parameters within the bounds were found");
    }
}

/// Steps of the differences, relative to the size of the variable: from those at which truncation dominates to those at
/// which rounding does.
const STEPS: [f64; 8] = [1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6];

/// Difference between a derivative and central differences, relative to its largest entry (or to 1e-3 mm a unit, if the
/// influence vanishes): the least of all steps, each extrapolated from h and h/2 (Richardson: the error is of order
/// h^4).
pub fn deviation(derivative: &[f64], scale: f64, mut f: impl FnMut(f64) -> Option<Vec<f64>>) -> f64 {
    let size = derivative.iter().fold(1e-3f64, |m, d| m.max(d.abs()));
    let mut best = f64::INFINITY;
    for step in STEPS {
        let h = step * scale;
        let sides = [h, -h, h / 2.0, -h / 2.0].map(&mut f);
        let [Some(a), Some(b), Some(c), Some(d)] = sides else { continue };
        let difference = |i: usize| {
            let wide = (a[i] - b[i]) / (2.0 * h);
            let narrow = (c[i] - d[i]) / h;
            narrow + (narrow - wide) / 3.0
        };
        let worst = (0..derivative.len()).map(|i| (difference(i) - derivative[i]).abs()).fold(0.0, f64::max);
        best = best.min(worst / size);
    }
    best
}

/// The size of a parameter, to which steps are relative.
pub fn scale(program: &Program, param: usize, x: &[f64]) -> f64 {
    let p = &program.parameters()[param];
    let range = p.upper - p.lower;
    if range.is_finite() { range.min(x[param].abs().max(0.1 * range)) } else { 1.0 }
}
