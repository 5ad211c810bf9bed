//! How long it takes from text to machine code for M and its derivatives, by stage, and how that grows with the
//! program.
//!
//! `cargo bench --bench compile` prints two tables: models of this repository, and generated ones of growing size.
//! Times are those of the clock, in milliseconds, the least of several compilations: machine code is made on as many
//! threads as there are processors, so that other work on the machine counts. The column `cpu` is the processors' time
//! in all. What only the first compilation of a process does (the code generator's tables, the library's parsing) is in
//! the column `first`, which is the whole of the first one.

mod scripts;

use cpu_time::ProcessTime;
use gml_compiler::program::{Compilation, Options, Program, Stage, compile_observed};
use gml_compiler::source::{NoFiles, SourceFile};
use gml_runtime::workers::workers;
use std::time::{Duration, Instant};

/// One compilation, in milliseconds.
#[derive(Clone, Copy, Default)]
struct Times {
    /// Time of each stage.
    stages: [f64; 4],
    /// Time of all processors together.
    cpu: f64,
}

impl Times {
    fn all(&self) -> f64 {
        self.stages.iter().sum()
    }
}

fn main() {
    println!("{:24} {}", "", columns());
    for name in ["cup/cup", "cup/octagonal_cup", "mug/mug"] {
        let path = format!("{}/examples/{name}.gml", env!("CARGO_MANIFEST_DIR"));
        match std::fs::read_to_string(&path) {
            Ok(text) => _ = measure(name, &text),
            Err(e) => println!("{path}: {e}"),
        }
    }
    println!("\n{:24} {}", "", columns());
    grow("lines", &[250, 500, 1000, 2000, 4000], scripts::lines);
    grow("holes", &[64, 256, 1024, 4096], scripts::holes);
}

fn columns() -> String {
    let names = ["lines", "parts", "check", "lower", "diff", "code", "all", "cpu", "first", "us/line", "us/part"];
    names.iter().map(|n| format!("{n:>9}")).collect()
}

fn grow(what: &str, sizes: &[usize], script: fn(usize) -> String) {
    let mut each = Vec::new();
    for size in sizes {
        let text = script(*size);
        let all = measure(&format!("{size} {what}"), &text);
        each.push(all / *size as f64);
    }
    let (least, most) = each.iter().fold((f64::INFINITY, 0.0f64), |(a, b), x| (a.min(*x), b.max(*x)));
    println!("{:24} time of one, most over least: {:.2}\n", "", most / least);
}

/// Compiles a script several times and prints a row; the least time in milliseconds.
fn measure(name: &str, text: &str) -> f64 {
    let (program, first) = compile(name, text);
    let mut best = first;
    let mut left = Duration::from_secs(2);
    for _ in 0..200 {
        let (_, again) = compile(name, text);
        if again.all() < best.all() {
            best = again;
        }
        left = left.saturating_sub(Duration::from_secs_f64(again.all() / 1e3));
        if left.is_zero() {
            break;
        }
    }
    let all = best.all();
    let (lines, parts) = (text.lines().count(), program.parts().len());
    let times: String = best.stages.iter().chain([&all, &best.cpu, &first.all()]).map(|t| format!("{t:9.2}")).collect();
    let (line, part) = (1e3 * all / lines as f64, 1e3 * all / parts as f64);
    println!("{name:24} {lines:9}{parts:9}{times}{line:9.1}{part:9.1}");
    all
}

fn compile(name: &str, text: &str) -> (Program, Times) {
    let script = SourceFile { name: name.to_owned(), text: text.to_owned() };
    let options = Options { workers: workers(), ..Options::default() };
    let mut times = Times::default();
    let (start, mut last) = (ProcessTime::now(), Instant::now());
    let mut done = |stage: Stage| {
        let now = Instant::now();
        times.stages[stage as usize] = (now - last).as_secs_f64() * 1e3;
        last = now;
    };
    let compiled = compile_observed(script, &NoFiles, &options, &mut done);
    times.cpu = start.elapsed().as_secs_f64() * 1e3;
    match compiled {
        Ok(Compilation { program, .. }) => (program, times),
        Err(failed) => panic!("{failed}"),
    }
}
