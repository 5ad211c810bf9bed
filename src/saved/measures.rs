//! The measures of a saved fit. Verdicts rest on them, and the file may have been edited: what follows from the script
//! and from the parameters is computed, and where the file has something else, that is said.

use super::SavedFit;
use super::texts::{listed, quoted};
use crate::provenance::Provenance;
use gml_compiler::program::Program;
use gml_runtime::fit::{AllowedDeviation, FitResult, FittedMeasure};

/// Relative difference of figures that are the same: another release may compute in another order.
const SAME: f64 = 1e-6;

impl SavedFit {
    /// All of the file, with its measures by the program, whose parameters are the fit's.
    pub(crate) fn into_measured(self, program: &Program, provenance: &Provenance) -> FitResult {
        let mut fit = self.fit.clone();
        // The file may have them in another order.
        fit.parameters.sort_by_key(|f| program.parameters().iter().position(|p| p.name == f.name));
        let stated = std::mem::take(&mut fit.measures);
        let measured = fit.measured(program, &program.defaults());
        let same_text = fit.script_sha256.is_some() && fit.script_sha256 == provenance.sha256;
        // Of another text, and of a file without any, the defaults are the nominal model.
        fit.measures =
            if same_text && !stated.is_empty() { self.compared(&fit, program, measured, &stated) } else { measured };
        fit
    }

    /// The measures that follow, with the nominal values of the file.
    fn compared(
        &self,
        fit: &FitResult,
        program: &Program,
        mut measured: Vec<FittedMeasure>,
        stated: &[FittedMeasure],
    ) -> Vec<FittedMeasure> {
        let foreign = stated.iter().filter(|s| measured.iter().all(|m| m.name != s.name));
        let foreign: Vec<&str> = foreign.map(|s| s.name.as_str()).collect();
        if !foreign.is_empty() {
            self.warn(&format!("has measures that the script has not, left out: {}", listed(&foreign, |n| quoted(n))));
        }
        let held = fit.measured(program, &held(fit, program));
        for (k, measure) in measured.iter_mut().enumerate() {
            let Some(stated) = stated.iter().find(|s| s.name == measure.name) else {
                self.warn(&format!("lacks the measure {}, which is computed", quoted(&measure.name)));
                continue;
            };
            if let Some(what) = contradiction(stated, measure) {
                self.warn(&format!("{what} of the measure {}: computed anew", quoted(&measure.name)));
            }
            self.take_nominal(program, k, measure, stated, &held[k]);
        }
        measured
    }

    /// Takes the nominal value of the file, which start values may have made another one than that of the defaults, and
    /// the tolerance that belongs to it.
    fn take_nominal(
        &self,
        program: &Program,
        k: usize,
        measure: &mut FittedMeasure,
        stated: &FittedMeasure,
        held: &FittedMeasure,
    ) {
        let name = quoted(&measure.name);
        let declared = measure.tolerance;
        let shown = |nominal: Option<f64>, of: &FittedMeasure| {
            let figure = |n: f64| format!("{} {}", gml_compiler::number::plain(of.written(n).0), of.written(n).1);
            nominal.map_or("none".to_owned(), |n| figure(n).trim().to_owned())
        };
        if !agree(stated.nominal, measure.nominal) {
            measure.nominal = stated.nominal;
            measure.tolerance = held.tolerance;
            if !agree(stated.nominal, held.nominal) {
                let (here, there) = (shown(stated.nominal, measure), shown(held.nominal, held));
                self.warn(&format!(
                    "has the nominal value {here} of {name}, where the script's defaults give {there}: it is taken for \
                     that of start values (-p)"
                ));
                // A tolerance that depends on parameters may have been another one at those.
                let elsewhere = program.measure_limits(k, &self.values_of(program)).ok().flatten();
                if elsewhere.map(|[lower, upper]| AllowedDeviation { lower, upper }) != declared {
                    self.warn(&format!("the tolerance of {name} depends on parameters: that of the defaults counts"));
                }
            }
        }
        let limits = |t: Option<AllowedDeviation>| (t.map(|t| t.lower), t.map(|t| t.upper));
        let ((lower, upper), (low, high)) = (limits(stated.tolerance), limits(measure.tolerance));
        if !(agree(lower, low) && agree(upper, high)) {
            self.warn(&format!("has another tolerance of {name} than the script, whose own counts"));
        }
    }
}

/// The defaults, with the values at which parameters were held.
fn held(fit: &FitResult, program: &Program) -> Vec<f64> {
    let fixed = |name: &str| fit.parameters.iter().find(|f| f.name == name && f.fixed).map(|f| f.value);
    program.parameters().iter().map(|p| fixed(&p.name).unwrap_or(p.default)).collect()
}

/// Which figure of the file is not the one that follows.
fn contradiction(stated: &FittedMeasure, measure: &FittedMeasure) -> Option<&'static str> {
    let slopes = stated.derivatives.len() == measure.derivatives.len()
        && measure.derivatives.iter().all(|(name, slope)| agree(stated.derivatives.get(name).copied(), Some(*slope)));
    [
        (stated.unit == measure.unit, "has another unit"),
        (agree(stated.value, measure.value), "has another value"),
        (slopes, "has other derivatives"),
        (agree(stated.sd, measure.sd), "has another standard deviation"),
        (stated.at_bound == measure.at_bound, "has other parameters at bounds"),
    ]
    .into_iter()
    .find_map(|(same, what)| (!same).then_some(what))
}

fn agree(a: Option<f64>, b: Option<f64>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => (a - b).abs() <= SAME * (a.abs() + b.abs()) + f64::MIN_POSITIVE,
        (None, None) => true,
        _ => false,
    }
}
