//! Fuzzing of the built command: damaged scripts, fits and scans through all commands, and options with extreme
//! values. docs/fuzzing.md describes it. Without settings, the cases of tests/corpus and a few random ones are run:
//!
//! ```text
//! GMLC_FUZZ_SECONDS=3600 GMLC_FUZZ_SEED=7 cargo test --release --test fuzz -- --nocapture
//! ```
//!
//! A case that fails is reduced and written to a folder below target/tmp/fuzz, which may be moved to tests/corpus.

mod case;
#[path = "../../compiler/tests/hostile/damage.rs"]
mod damage;
mod fits;
mod formats;
#[path = "../../compiler/tests/random/generate/mod.rs"]
mod generate;
mod mutate;
mod options;
mod process;
mod scans;
mod scripts;
mod seal;
mod shrink;
mod verdict;

use case::{Base, Case};
use damage::Random;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The kinds of cases, in turn.
const TARGETS: [&str; 4] = ["scripts", "fits", "scans", "options"];

/// Number of random cases by default: a few seconds of them.
const CASES: u64 = 60;

fn setting(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name} is a whole number")))
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// What the generators begin from.
struct Generators {
    base: Base,
    texts: Vec<String>,
    options: options::Commands,
}

impl Generators {
    fn new() -> Generators {
        Generators { base: Base::new(), texts: scripts::texts(), options: options::Commands::of_the_command() }
    }

    /// The case with a number.
    fn case(&self, seed: u64, number: u64) -> (&'static str, Case) {
        let mut random = Random::new(seed, number);
        let only = std::env::var("GMLC_FUZZ_TARGET").ok();
        let target = TARGETS.iter().find(|t| Some(**t) == only.as_deref()).copied();
        let target = target.unwrap_or(TARGETS[(number % TARGETS.len() as u64) as usize]);
        let case = match target {
            "scripts" => scripts::case(&self.texts, &mut random),
            "fits" => fits::case(&self.base, &mut random),
            "scans" => scans::case(&mut random),
            _ => self.options.case(&mut random),
        };
        (target, case)
    }
}

/// How many cases of a target ended with each status, and their slowest and largest.
#[derive(Default)]
struct Tally {
    statuses: BTreeMap<i32, u64>,
    slowest: (Duration, u64),
    largest: (u64, u64),
}

impl Tally {
    fn add(&mut self, number: u64, ended: &process::Ended) {
        *self.statuses.entry(ended.status.unwrap_or(-1)).or_default() += 1;
        self.slowest = self.slowest.max((ended.time, number));
        self.largest = self.largest.max((ended.memory, number));
    }

    fn print(&self, target: &str) {
        let total: u64 = self.statuses.values().sum();
        let statuses: Vec<String> = self.statuses.iter().map(|(s, n)| format!("{s}: {n}")).collect();
        let ((time, slow), (memory, large)) = (self.slowest, self.largest);
        eprintln!(
            "{target:8} {total:7} cases; status {}; slowest {:.1} s (case {slow}), largest {} MiB (case {large})",
            statuses.join(", "),
            time.as_secs_f64(),
            memory >> 20
        );
    }
}

/// Keeps a case that failed, reduced, and says how.
fn keep(base: &Base, seed: u64, number: u64, case: Case, reason: &str) -> String {
    let small = shrink::shrunk(base, case, reason);
    let folder = root().join("target/tmp/fuzz").join(format!("{seed}-{number}"));
    small.save(&folder);
    format!("seed {seed}, case {number}: {reason}\n  gmlc {}\n  {}", small.args.join(" "), folder.display())
}

#[test]
fn random_cases_are_survived() {
    let seed = setting("GMLC_FUZZ_SEED").unwrap_or(1);
    let time = setting("GMLC_FUZZ_SECONDS").map(Duration::from_secs);
    // One case, or those from there on.
    let from = setting("GMLC_FUZZ_CASE");
    let (first, end) = from.map_or((0, CASES), |number| (number, number + 1));
    let generators = Generators::new();
    let (mut tallies, mut findings) = (BTreeMap::<&str, Tally>::new(), BTreeMap::<String, Vec<String>>::new());
    let begun = Instant::now();
    let mut number = first;
    while time.map_or(number < end, |time| begun.elapsed() < time) {
        let (target, case) = generators.case(seed, number);
        let ended = case.run(&generators.base);
        tallies.entry(target).or_default().add(number, &ended);
        if from.is_some() {
            eprintln!("{number}: {:?}: gmlc {}\n{}", ended.status, case.args.join(" "), ended.error.trim());
        }
        if let Some(reason) = &ended.failure {
            let alike = findings.entry(verdict::class(reason)).or_default();
            // The first of a class are reduced and kept; the others are counted.
            let told = if alike.len() < 3 {
                keep(&generators.base, seed, number, case, reason)
            } else {
                format!("seed {seed}, case {number}: {reason}")
            };
            eprintln!("--- {told}");
            alike.push(told);
        }
        number += 1;
    }
    eprintln!("seed {seed}: {} cases in {:.0} s", number - first, begun.elapsed().as_secs_f64());
    tallies.iter().for_each(|(target, tally)| tally.print(target));
    for (class, alike) in &findings {
        eprintln!("{:6} times: {class}", alike.len());
    }
    assert!(findings.is_empty(), "{} classes of failures, printed above", findings.len());
}

#[test]
fn the_corpus_is_survived() {
    let base = Base::new();
    let folder = root().join("tests/corpus");
    let mut folders: Vec<PathBuf> = fs::read_dir(&folder)
        .expect("the corpus")
        .map(|e| e.expect("an entry").path())
        .filter(|p| p.is_dir())
        .collect();
    folders.sort();
    assert!(!folders.is_empty(), "the corpus has cases");
    let failed: Vec<String> = folders
        .iter()
        .filter_map(|folder| Some(format!("{}: {}", folder.display(), Case::load(folder).run(&base).failure?)))
        .collect();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}
