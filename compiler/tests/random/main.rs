//! Random well-typed scripts. On each, all ways to compute a value or a derivative must agree: the interpreter of the
//! lowered functions, native code, tangents, pullbacks, finite differences.
//!
//! By default there are a few scripts, the same in every run. If `GMLC_RANDOM_SECONDS` is set, the test runs for that
//! time, from the seed `GMLC_RANDOM_SEED`:
//!
//! ```text
//! GMLC_RANDOM_SECONDS=60 cargo test --release --test random -- --nocapture
//! ```
//!
//! A script that fails is reduced and printed.

#[path = "../suite/common/mod.rs"]
mod common;
mod differences;
mod generate;
mod numbers;
mod oracle;
mod properties;
mod ways;
mod whole;

use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

/// Number of scripts by default.
const SCRIPTS: usize = 40;

fn setting(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name} is a whole number")))
}

/// Checks the script of some bytes; returns the failure.
fn wrong(bytes: &[u8], seen: &mut properties::Seen) -> Option<String> {
    let text = generate::script(bytes);
    match catch_unwind(AssertUnwindSafe(|| properties::hold(&text, seen))) {
        Ok(result) => result.err(),
        Err(panic) => Some(format!("it panics: {:?}", panic.downcast_ref::<String>())),
    }
}

/// The smallest script that fails, by proptest's reduction.
fn smallest(tree: &mut impl ValueTree<Value = Vec<u8>>, first: String) -> (String, String) {
    let (mut bytes, mut reason) = (tree.current(), first);
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(90) {
        let seen = &mut properties::Seen::default();
        let moved = match wrong(&tree.current(), seen) {
            Some(why) => {
                (bytes, reason) = (tree.current(), why);
                tree.simplify()
            }
            None => tree.complicate(),
        };
        if !moved {
            break;
        }
    }
    (generate::script(&bytes), reason)
}

#[test]
fn random_scripts_agree_with_themselves() {
    let time = setting("GMLC_RANDOM_SECONDS").map(Duration::from_secs);
    let mut seed = [7; 32];
    seed[..8].copy_from_slice(&setting("GMLC_RANDOM_SEED").unwrap_or(1).to_le_bytes());
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &seed);
    let mut runner = TestRunner::new_with_rng(Config { failure_persistence: None, ..Config::default() }, rng);
    let bytes = prop::collection::vec(any::<u8>(), 0..250);
    let mut seen = properties::Seen::default();
    let (mut findings, mut scripts) = (0, 0);
    let start = Instant::now();
    while time.map_or(scripts < SCRIPTS, |time| start.elapsed() < time) && findings < 3 {
        let mut tree = bytes.new_tree(&mut runner).expect("bytes");
        scripts += 1;
        if let Some(reason) = wrong(&tree.current(), &mut seen) {
            let (text, reason) = smallest(&mut tree, reason);
            eprintln!("--- {reason}\n{text}");
            findings += 1;
        }
    }
    eprintln!("{scripts} scripts in {:.0} s: {seen:?}", start.elapsed().as_secs_f64());
    assert_eq!(findings, 0, "printed above");
    assert!(seen.refused * 20 <= scripts, "few are refused as too large: {seen:?}");
    // The test would show nothing if there were no differences, or if all derivatives were zero.
    assert!(seen.compared * 10 > seen.compared_or_skipped * 8, "most can be compared: {seen:?}");
    assert!(seen.nonzero * 5 > seen.compared, "derivatives are not zero: {seen:?}");
}

/// Without any bytes the script is the smallest one, and all properties hold for it.
#[test]
fn the_smallest_script() {
    assert_eq!(wrong(&[], &mut properties::Seen::default()), None);
}
