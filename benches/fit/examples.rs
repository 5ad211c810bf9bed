//! Every example against virtual scans of it: those of its README's `gmlc scan` command, with other seeds for noise,
//! losses and pose. A fit counts where every parameter is found to a tenth of how far it had to go from its default,
//! or, where the scan does not say it that well, to three standard deviations of less than a tenth each.

use crate::case::Case;
use crate::{median, seconds};
use gml_runtime::fit::{FitOptions, fit};
use gml_runtime::progress::Silent;
use gml_runtime::simulate::Scanner;

const EXAMPLES: [&str; 12] =
    ["amphora", "bowl", "can", "column", "elbow", "flange", "fluted_bowl", "jar", "mug", "pan", "planter", "tree"];
const ALLOWED: f64 = 0.1;

/// Prints the table for all examples, or those that `words` name.
pub(crate) fn run(seeds: usize, words: &[String]) {
    for name in EXAMPLES {
        if EXAMPLES.iter().any(|e| words.iter().any(|w| w == e)) && !words.iter().any(|w| w == name) {
            continue;
        }
        let (mut found, mut times) = (0, Vec::new());
        let case = Case::read(name);
        for seed in 1..=seeds as u64 {
            let scanner = Scanner { seed, ..case.scanner.clone() };
            let scan = case.scan(&case.truth, &scanner).expect("a README's scan");
            let result = fit(&case.program, &scan, &FitOptions::default(), &Silent).unwrap_or_else(|e| panic!("{e}"));
            times.push(seconds(&result));
            let off: Vec<String> = result
                .parameters
                .iter()
                .zip(case.program.parameters().iter().zip(&case.truth))
                .filter(|(p, (known, truth))| {
                    let allowed = ALLOWED * (*truth - known.default).abs();
                    let sd = p.sd.filter(|sd| *sd < allowed).unwrap_or(0.0);
                    !((p.value - **truth).abs() < allowed.max(3.0 * sd))
                })
                .map(|(p, (_, truth))| format!("{} {:.3} for {truth:.3}", p.name, p.value))
                .collect();
            if off.is_empty() {
                found += 1;
            } else {
                println!(
                    "  {name} {seed}: inliers {:.3}, sigma {:.3}, {}",
                    result.inliers,
                    result.sigma,
                    off.join(", ")
                );
            }
        }
        println!("{name:9} {found:3} of {seeds:3}   median {:.2} s", median(&mut times));
    }
}
