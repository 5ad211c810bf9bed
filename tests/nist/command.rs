//! `cargo run --release --example nist_strd -- NAME.gml NAME.dat ...` prints how many digits of NIST's certified values
//! fits find.

#[path = "../suite/support/nist.rs"]
mod nist;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

fn main() -> ExitCode {
    let files: Vec<PathBuf> = std::env::args().skip(1).map(PathBuf::from).collect();
    if files.is_empty() || !files.len().is_multiple_of(2) {
        eprintln!("usage: nist_strd NAME.gml NAME.dat [NAME.gml NAME.dat ...]");
        return ExitCode::from(2);
    }
    println!(
        "{:12} {:>5} {:>10} {:>10} {:>10} {:>6}",
        "digits of", "start", "parameters", "deviations", "squares", "steps"
    );
    let mut good = true;
    for pair in files.chunks_exact(2) {
        good &= row(&pair[0], &pair[1]);
    }
    if good { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Prints the results from both starts; returns whether that from the second one is right.
fn row(script: &Path, data: &Path) -> bool {
    let name = data.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let found = match nist::compare(script, data) {
        Ok(found) => found,
        Err(e) => {
            eprintln!("{e}");
            return false;
        }
    };
    for (start, d) in found.iter().enumerate() {
        println!(
            "{name:12} {:>5} {:>10.1} {:>10.1} {:>10.1} {:>6}",
            start + 1,
            d.parameters,
            d.deviations,
            d.sum_of_squares,
            d.iterations
        );
    }
    found[1].parameters >= 8.0 && found[1].deviations >= 6.0 && found[1].sum_of_squares >= 8.0
}
