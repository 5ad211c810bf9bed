//! What the scene keeps in words: parameters, measures, statistics and verdicts, and with what they were made.

use super::MetadataGroup;
use crate::export::number;
use crate::fit::{FitResult, FittedMeasure, FittedParameter};
use crate::model::Motion;
use crate::record::Record;
use crate::variance::{Statistics, Tolerance, VarianceReport};

/// The groups of a measurement, and of a fit if there is one.
#[must_use]
pub fn metadata(fit: Option<&FitResult>, report: &VarianceReport) -> Vec<MetadataGroup> {
    let mut groups: Vec<MetadataGroup> = report.provenance.iter().map(provenance).collect();
    if let Some(fit) = fit {
        groups.extend(of_fit(fit));
    }
    groups.push(statistics("all", &report.overall, report.overall.tolerance.and_then(|t| t.tolerance)));
    groups.extend(report.parts.iter().map(|part| {
        let tolerance = part.statistics.tolerance.and_then(|t| t.tolerance);
        let mut group = statistics(&part.name, &part.statistics, tolerance);
        if let Some(verdict) = &part.verdict {
            group.entries.extend([
                entry("verdict", verdict.outcome.text().to_owned()),
                entry("value decided on", number(verdict.value)),
                entry("standard uncertainty", number(verdict.uncertainty)),
                entry("probability of conformance", number(verdict.probability)),
            ]);
        }
        group
    }));
    groups
}

fn entry(name: &str, value: String) -> (String, String) {
    (name.to_owned(), value)
}

/// Program, time, files with their SHA-256, and what the user states.
fn provenance(record: &Record) -> MetadataGroup {
    let mut entries = vec![entry("tool", record.tool.clone()), entry("time", record.time.clone())];
    let file = |file: &crate::record::UsedFile| entry(&file.role, format!("{} SHA-256 {}", file.name, file.sha256));
    entries.extend(record.files.iter().map(file));
    entries.extend(record.fields.iter().map(|field| entry(&field.name, field.value.clone())));
    MetadataGroup { name: "provenance".to_owned(), entries }
}

/// The parameters with standard deviations, the measures with tolerances, and the pose.
fn of_fit(fit: &FitResult) -> Vec<MetadataGroup> {
    let with_sd = |value: f64, sd: Option<f64>, unit: &str| {
        let sd = sd.map_or_else(String::new, |sd| format!(" +- {sd:.2e}"));
        format!("{value}{sd} {unit}").trim_end().to_owned()
    };
    let parameter = |p: &FittedParameter| entry(&p.name, with_sd(p.value, p.sd, &p.unit));
    let entries = fit.parameters.iter().map(parameter).collect();
    let mut groups = vec![MetadataGroup { name: "parameters".to_owned(), entries }];
    let measure = |m: &FittedMeasure| {
        let limits = m.tolerance.map_or_else(String::new, |t| format!(" (tolerance {} to {})", t.lower, t.upper));
        Some(entry(&m.name, format!("{}{limits}", with_sd(m.value?, m.sd, &m.unit))))
    };
    let entries: Vec<(String, String)> = fit.measures.iter().filter_map(measure).collect();
    if !entries.is_empty() {
        groups.push(MetadataGroup { name: "measures".to_owned(), entries });
    }
    groups.extend(fit.pose.as_ref().map(pose));
    groups
}

/// The motion from the model's coordinates to the scan's.
fn pose(motion: &Motion) -> MetadataGroup {
    let joined = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let entries = vec![
        entry("rotation, row by row", joined(motion.rotation.as_flattened())),
        entry("translation in mm", joined(&motion.translation)),
    ];
    MetadataGroup { name: "pose".to_owned(), entries }
}

fn statistics(name: &str, s: &Statistics, tolerance: Option<Tolerance>) -> MetadataGroup {
    let mut entries = vec![
        entry("coverage", number(s.coverage)),
        entry("mean", number(s.weighted.mean)),
        entry("sd", number(s.weighted.sd)),
        entry("max", number(s.weighted.max)),
        entry("signed mean", number(s.weighted.signed.mean)),
        entry("rms", number(s.weighted.rms)),
    ];
    entries.extend(tolerance.map(|t| entry("tolerance", format!("{} to {} mm", t.lower, t.upper))));
    MetadataGroup { name: name.to_owned(), entries }
}
