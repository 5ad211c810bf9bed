//! Damaged scripts: none of them makes the compiler panic, hang, exhaust memory, or produce invalid functions.
//!
//! Every input is a text of the corpus (the language tests, the examples, the standard library, the blocks of the
//! reference), or a random well-typed script, with some damage: to bytes, to tokens, to whole lines, to numbers, to
//! nesting. It passes through all stages that accept it, up to the evaluation of machine code, with small limits.
//! `GMLC_HOSTILE_COUNT` sets the number of inputs (by default some thousands), `GMLC_HOSTILE_SEED` chooses them:
//!
//! ```text
//! GMLC_HOSTILE_COUNT=1000000 GMLC_HOSTILE_SEED=7 cargo test --release --test hostile -- --nocapture
//! ```
//!
//! An input that fails is reduced and printed. The test also prints how many inputs reached each stage, the slowest
//! input, and the one that took the most memory.

mod agree;
mod allocator;
mod corpus;
mod damage;
#[path = "../random/generate/mod.rs"]
mod generate;
mod survive;

use damage::Random;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use survive::{STAGES, Stage};

#[global_allocator]
static ALLOCATOR: allocator::Counting = allocator::Counting;

/// Limit of the memory for one input, in bytes. A sensible model takes a hundredth.
const MEMORY: usize = 512 << 20;

/// Limit of the processor time for one input.
const TIME: Duration = Duration::from_secs(10);

/// The present input, and the processor time at which it began.
static CURRENT: Mutex<Option<(Duration, String)>> = Mutex::new(None);

/// Processor time of a thread, which does not depend on other work of the machine; elapsed time if the system does not
/// report it.
struct Clock {
    task: PathBuf,
    start: Instant,
}

impl Clock {
    fn of_this_thread() -> Clock {
        let task = std::fs::read_link("/proc/thread-self").unwrap_or_default();
        Clock { task: Path::new("/proc").join(task).join("schedstat"), start: Instant::now() }
    }

    fn now(&self) -> Duration {
        let text = std::fs::read_to_string(&self.task).ok();
        let nanoseconds = text.and_then(|t| t.split_whitespace().next()?.parse().ok());
        nanoseconds.map_or_else(|| self.start.elapsed(), Duration::from_nanos)
    }
}

fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().map_or(default, |text| text.parse().unwrap_or_else(|_| panic!("{name} is a number")))
}

/// The result of an input.
struct Outcome {
    stage: Stage,
    time: Duration,
    memory: usize,
}

/// Runs an input; an error describes the failure.
fn look_at(clock: &Clock, text: &str, deep: bool) -> Result<Outcome, String> {
    let start = clock.now();
    *CURRENT.lock().unwrap() = Some((start, text.to_owned()));
    allocator::begin();
    let result = catch_unwind(AssertUnwindSafe(|| survive::survive(text, deep)));
    let (time, memory) = (clock.now() - start, allocator::peak());
    *CURRENT.lock().unwrap() = None;
    let stage = match result {
        Ok(stage) => stage?,
        Err(panic) => {
            let text = panic.downcast_ref::<String>().cloned();
            let text = text.or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()));
            return Err(format!("it panics: {}", text.unwrap_or_default()));
        }
    };
    if memory > MEMORY {
        return Err(format!("it takes {} MiB of memory", memory >> 20));
    }
    if time > TIME {
        return Err(format!("it takes {} s", time.as_secs()));
    }
    Ok(Outcome { stage, time, memory })
}

/// Prints the input and ends the process if an input does not terminate.
fn watch(clock: &Clock, done: &AtomicBool) {
    while !done.load(Ordering::Relaxed) {
        std::thread::sleep(Duration::from_millis(200));
        let current = CURRENT.lock().unwrap();
        if let Some((since, text)) = &*current
            && clock.now().saturating_sub(*since) > 3 * TIME
        {
            eprintln!("this input hangs:\n{text}");
            std::process::exit(101);
        }
    }
}

/// Reduces an input that fails: leaves out pieces, ever smaller ones, without which it still fails.
fn shrunk(clock: &Clock, text: &str, deep: bool) -> String {
    let mut pieces = damage::pieces(text);
    let mut size = pieces.len().div_ceil(2);
    let start = Instant::now();
    while size > 0 && start.elapsed() < Duration::from_secs(120) {
        let mut from = 0;
        while from < pieces.len() {
            let to = (from + size).min(pieces.len());
            let without = [&pieces[..from], &pieces[to..]].concat();
            if look_at(clock, &without.concat(), deep).is_err() {
                pieces = without;
            } else {
                from = to;
            }
        }
        size /= 2;
    }
    pieces.concat()
}

#[derive(Default)]
struct Summary {
    stages: [u64; STAGES],
    time: Duration,
    slowest: (Duration, String),
    largest: (usize, String),
    findings: Vec<String>,
}

impl Summary {
    fn add(&mut self, clock: &Clock, text: String, deep: bool) {
        match look_at(clock, &text, deep) {
            Ok(outcome) => {
                self.stages[outcome.stage as usize] += 1;
                self.time += outcome.time;
                if outcome.time > self.slowest.0 {
                    self.slowest = (outcome.time, text.clone());
                }
                if outcome.memory > self.largest.0 {
                    self.largest = (outcome.memory, text);
                }
            }
            Err(_) => {
                let small = shrunk(clock, &text, deep);
                let reason = look_at(clock, &small, deep).err().or_else(|| look_at(clock, &text, deep).err());
                let finding = format!("{}\n{small}", reason.unwrap_or_else(|| "it was wrong once".to_owned()));
                eprintln!("--- {finding}");
                self.findings.push(finding);
            }
        }
    }

    fn print(&self) {
        let total = self.stages.iter().sum::<u64>() + self.findings.len() as u64;
        eprintln!(
            "{total} inputs, {} findings, {:.0} s; how far they came:",
            self.findings.len(),
            self.time.as_secs_f64()
        );
        for (k, name) in survive::NAMES.iter().enumerate() {
            eprintln!("  {:9} {:5.2} % {name}", self.stages[k], 100.0 * self.stages[k] as f64 / total.max(1) as f64);
        }
        let head = |text: &str| text.lines().take(12).map(|l| format!("    {l:.150}\n")).collect::<String>();
        eprintln!("slowest, {:.2} s:\n{}", self.slowest.0.as_secs_f64(), head(&self.slowest.1));
        eprintln!("largest, {} MiB:\n{}", self.largest.0 >> 20, head(&self.largest.1));
    }
}

/// This is one test: two at once would share the present input.
#[test]
fn damaged_scripts_are_survived() {
    let (count, seed) = (setting("GMLC_HOSTILE_COUNT", 2000), setting("GMLC_HOSTILE_SEED", 1));
    let corpus = corpus::texts();
    let (clock, done) = (Clock::of_this_thread(), AtomicBool::new(false));
    let mut summary = Summary::default();
    std::panic::set_hook(Box::new(|_| {}));
    std::thread::scope(|scope| {
        scope.spawn(|| watch(&clock, &done));
        for i in 0..count {
            let mut random = Random::new(seed, i);
            let text = damage::input(&corpus, &mut random);
            // Making machine code takes much longer than all stages before it.
            let deep = random.below(3) == 0;
            summary.add(&clock, text, deep);
            if i % 50_000 == 49_999 {
                eprintln!("{} inputs, {} findings", i + 1, summary.findings.len());
            }
        }
        done.store(true, Ordering::Relaxed);
    });
    drop(std::panic::take_hook());
    summary.print();
    assert!(summary.findings.is_empty(), "{} findings, printed above", summary.findings.len());
}
