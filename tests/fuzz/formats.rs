//! Damaged scans of every format through the reader, in the process: thousands a second. There is a scan or an error
//! that names the file, and never a panic, a long wait or much memory.
//!
//! ```text
//! GMLC_MUTATIONS=100000 GMLC_FUZZ_SEED=7 cargo test --release --test fuzz formats -- --nocapture
//! ```

use crate::damage::Random;
use crate::mutate::damaged;
use crate::scans::Ball;
use crate::seal::seal;
use crate::setting;
use gml_runtime::export::scan::ScanFormat;
use gml_runtime::progress::Silent;
use gml_runtime::scan::{self, ReadOptions};
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

/// Damaged files of each format, unless GMLC_MUTATIONS says how many.
const MUTATIONS: u64 = 150;
/// The longest that a file of some ten thousand bytes may take, on a machine that does much else.
const LONGEST: Duration = Duration::from_secs(10);
/// What reading one may take beyond what the process had: buffers of the readers, and threads. Kibibytes.
const MOST_MEMORY: u64 = 128 << 10;

/// A line of /proc/self/status in kibibytes; none on other systems.
fn memory(line: &str) -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let found = status.lines().find_map(|l| l.strip_prefix(line))?;
    found.trim_start_matches(':').trim().trim_end_matches(" kB").parse().ok()
}

/// Forgets how much memory the process had at most until now.
fn forget_peak() {
    // Not on all systems; then the peak is that of all cases.
    drop(fs::write("/proc/self/clear_refs", "5"));
}

/// What came of the damaged files of a format.
#[derive(Default)]
struct Tally {
    read: u64,
    refused: u64,
    slowest: Duration,
    most_memory: u64,
}

fn try_one(path: &Path, content: &[u8], tally: &mut Tally, at: &str) {
    fs::write(path, content).expect("written");
    forget_peak();
    let (begun, before) = (Instant::now(), memory("VmRSS"));
    let outcome = catch_unwind(AssertUnwindSafe(|| scan::read(path, &ReadOptions::default(), &Silent)));
    let keep = |why: &str| {
        let kept = crate::root().join("target/tmp/fuzz").join(path.file_name().expect("a name"));
        fs::create_dir_all(kept.parent().expect("a folder")).expect("made");
        fs::write(&kept, content).expect("written");
        panic!("{at}: {why}; the file is {}", kept.display());
    };
    match outcome {
        Ok(Ok(_)) => tally.read += 1,
        Ok(Err(error)) => {
            let (text, name) = (error.to_string(), path.display().to_string());
            if !text.contains(&name) {
                keep(&format!("an error without the file's name: {text}"));
            }
            tally.refused += 1;
        }
        Err(_) => keep("a panic"),
    }
    tally.slowest = tally.slowest.max(begun.elapsed());
    if begun.elapsed() > LONGEST {
        keep(&format!("{:?}", begun.elapsed()));
    }
    if let (Some(before), Some(peak)) = (before, memory("VmHWM")) {
        let more = peak.saturating_sub(before);
        tally.most_memory = tally.most_memory.max(more);
        if more > MOST_MEMORY {
            keep(&format!("{} MiB", more >> 10));
        }
    }
}

#[test]
fn damaged_formats_are_read_or_refused() {
    let count = setting("GMLC_MUTATIONS").unwrap_or(MUTATIONS);
    let seed = setting("GMLC_FUZZ_SEED").unwrap_or(1);
    let folder = tempfile::tempdir().expect("a folder");
    let ball = Ball::new(8, 12);
    for (ending, format) in ScanFormat::ALL {
        let path = folder.path().join(format!("bad.{ending}"));
        let good = ball.file(format);
        fs::write(&path, &good).expect("written");
        let whole = scan::read(&path, &ReadOptions::default(), &Silent);
        whole.unwrap_or_else(|error| panic!("the file is good: {error}"));
        let mut tally = Tally::default();
        for number in 0..count {
            let mut random = Random::new(seed, number);
            let mut content = damaged(&good, &mut random);
            if format == ScanFormat::E57 && random.below(8) > 0 {
                seal(&mut content);
            }
            try_one(&path, &content, &mut tally, &format!("seed {seed}, {ending} {number}"));
        }
        let Tally { read, refused, slowest, most_memory } = tally;
        eprintln!(
            "{ending:4} {read:7} read, {refused:7} refused; slowest {slowest:.1?}, at most {} MiB more",
            most_memory >> 10
        );
        assert!(read > 0 && refused > 0, "{ending}: damage that does something, and not always too much");
    }
}
