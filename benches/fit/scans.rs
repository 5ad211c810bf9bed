//! The real scans of the test data: what share of their points the fits explain, and how long they take.

use crate::{program, seconds};
use gml_compiler::check::InputValue;
use gml_runtime::fit::{FitOptions, fit};
use gml_runtime::progress::Silent;
use gml_runtime::scan::{self, Unit};
use std::collections::BTreeMap;
use std::path::Path;

/// An example, the file and its unit, and an input.
type Case = (&'static str, &'static str, &'static str, Option<(&'static str, i64)>);

const SCANS: [Case; 4] = [
    ("mug", "ycb_025_mug.ply", "m", None),
    ("can", "ycb_005_tomato_soup_can.obj", "m", None),
    ("bowl", "ycb_024_bowl.obj", "m", None),
    ("amphora", "ggg_sea_vase.ply", "mm", Some(("handles", 1))),
];

/// Prints a line for every scan.
pub(crate) fn run(data: &str) {
    for (name, file, unit, input) in SCANS {
        let inputs: BTreeMap<String, InputValue> =
            input.iter().map(|(n, v)| ((*n).to_owned(), InputValue::Int(*v))).collect();
        let program = program(&format!("examples/{name}/{name}.gml"), inputs);
        let scan = scan::read(
            Path::new(&format!("{data}/scans/{file}")),
            &unit.parse::<Unit>().unwrap_or_default().into(),
            &Silent,
        );
        let scan = scan.unwrap_or_else(|e| panic!("{e}"));
        let result = fit(&program, &scan, &FitOptions::default(), &Silent).unwrap_or_else(|e| panic!("{e}"));
        println!(
            "{name:9} inliers {:5.1} %   sigma {:.3} mm   rms {:.3} mm   {:.2} s",
            100.0 * result.inliers,
            result.sigma,
            result.rms,
            seconds(&result)
        );
    }
}
