//! `gmlc fit`.

use crate::cli::{FitArgs, FitControls, NormalsArg, ScanArgs};
use crate::error::CommandError;
use crate::progress::TerminalProgress;
use crate::provenance::Provenance;
use crate::subject::Subject;
use crate::values::{self, Range};
use crate::{dimensions, info, interrupt, outputs, record, script, search, several, table};
use gml_compiler::program::{Program, Quantity};
use gml_runtime::fit::{
    self, Agreement, Bootstrap, FitError, FitOptions, FitResult, FittedScan, HypothesisTest, InputValues,
    PoseCovariance, SearchError, WithoutSd,
};
use gml_runtime::progress::Progress;
use gml_runtime::scan::{self, Scan, ScanError, ScanFault};
use std::path::Path;

pub(crate) fn run(args: &FitArgs) -> Result<(), CommandError> {
    let stated = record::fields_file(&args.script.model);
    for output in args.output.iter().chain(&args.controls.trace) {
        let given = [&args.script.model, &stated].into_iter().chain(several::paths(&args.scan, &args.more));
        outputs::require_apart(output, outputs::inputs(given, args.params.as_ref()))?;
    }
    outputs::require_files(args.output.iter().chain(&args.controls.trace))?;
    let subject = Subject::compiled(&args.script, args.params.as_deref(), &args.search, &args.controls)?;
    for output in args.output.iter().chain(&args.controls.trace) {
        outputs::require_apart_from_scripts(output, &subject.program)?;
    }
    outputs::require_two(args.output.as_ref(), args.controls.trace.as_ref())?;
    let options = subject.options(&args.controls, &subject.program)?;
    let mut record = record::of_process(&args.report, &args.script.model)?;
    let scans = several::read(&args.scan, &args.more)?;
    record::add_inputs(&mut record, &several::sources(&scans), &subject.program, args.params.as_deref());
    // The best so far is kept.
    let _grace = interrupt::grace();
    let progress = TerminalProgress::new();
    let fitting = Fitting { subject: &subject, controls: &args.controls, search: &args.search, scans: &scans };
    let fitted = fitting.run(&options, &progress);
    progress.finish();
    let Fitted { mut result, scan, .. } = fitted?;
    result.warnings.extend(scan.as_ref().unwrap_or(&scans[0]).warnings.iter().cloned());
    result.provenance = Some(record);
    outputs::make_parents(args.output.iter().chain(&args.controls.trace))?;
    write_trace(args.controls.trace.as_deref(), &result)?;
    if let Some(path) = &args.output {
        outputs::write_json(path, &result)?;
    }
    // What is on standard output already is a result for programs.
    match (args.output.as_deref().is_some_and(outputs::is_stream), args.result.is_json()) {
        (true, _) => {}
        (_, true) => outputs::print_json(&result)?,
        _ => print!("{}", summary(&result)),
    }
    unless_interrupted(&result)?;
    judge(&result)
}

/// A fit, or a search over inputs, as the command line describes it.
pub(crate) struct Fitting<'a> {
    pub(crate) subject: &'a Subject,
    pub(crate) controls: &'a FitControls,
    /// Ranges of inputs; empty for a single fit.
    pub(crate) search: &'a [Range],
    /// One, or several of one object.
    pub(crate) scans: &'a [Scan],
}

/// The outcome of a fit.
pub(crate) struct Fitted {
    /// The program with the selected inputs, of a search.
    pub(crate) program: Option<Program>,
    pub(crate) result: FitResult,
    /// All scans as one, where there are several.
    pub(crate) scan: Option<Scan>,
}

impl Fitting<'_> {
    /// Fits.
    pub(crate) fn run(&self, options: &FitOptions, progress: &dyn Progress) -> Result<Fitted, CommandError> {
        let Subject { script, program, provenance, .. } = self.subject;
        let [scan] = self.scans else { return self.run_several(options, progress) };
        if self.search.is_empty() {
            let result = run_fit(program, provenance, scan, options, progress)?;
            return Ok(Fitted { program: None, result, scan: None });
        }
        let values = search::combinations(program, &script.compile, self.search)?;
        let prepare = |inputs: &InputValues| -> Result<(Program, FitOptions), CommandError> {
            let args = search::with_inputs(&script.compile, inputs);
            let program = script::compile_quietly(&script.model, &args)?.program;
            let options = self.subject.options(self.controls, &program)?;
            Ok((program, options))
        };
        let selected = fit::search(values, scan, |inputs| prepare(inputs).map_err(|e| e.reason()), progress);
        let selected = selected.map_err(|error| match error {
            SearchError::Fit(error) => error.into(),
            error => CommandError::Failed(format!("--search: {error}")),
        })?;
        let result = provenance.named(selected.fit, &selected.model);
        Ok(Fitted { program: Some(selected.model), result, scan: None })
    }

    fn run_several(&self, options: &FitOptions, progress: &dyn Progress) -> Result<Fitted, CommandError> {
        if !self.search.is_empty() {
            let message = "--search takes one scan: find the inputs with one of them, and give them by --input";
            return Err(CommandError::usage(message));
        }
        let Subject { program, provenance, .. } = self.subject;
        let fitted = fit::fit_several(program, self.scans, options, progress)?;
        Ok(Fitted { program: None, result: provenance.named(fitted.fit, program), scan: Some(fitted.scan) })
    }
}

impl From<FitError> for CommandError {
    fn from(error: FitError) -> Self {
        if error.is_about_options() { Self::usage(error) } else { Self::failed(error) }
    }
}

/// An error if the user interrupted the fit.
pub(crate) fn unless_interrupted(result: &FitResult) -> Result<(), CommandError> {
    if result.interrupted { Err(CommandError::interrupted()) } else { Ok(()) }
}

/// An error if the fit cannot be relied on.
pub(crate) fn judge(result: &FitResult) -> Result<(), CommandError> {
    result.shortcoming().map_or(Ok(()), |reason| Err(CommandError::Unreliable(reason)))
}

/// Writes the optimisers' steps as comma-separated values.
pub(crate) fn write_trace(path: Option<&Path>, result: &FitResult) -> Result<(), CommandError> {
    let Some(path) = path else { return Ok(()) };
    let mut text = String::from("step,stage,evaluations,points,sigma,objective,inliers\n");
    for (step, t) in result.trace.iter().enumerate() {
        text.push_str(&format!(
            "{step},{},{},{},{},{},{}\n",
            t.stage, t.evaluations, t.points, t.sigma, t.objective, t.inliers
        ));
    }
    outputs::write(path, text.as_bytes())
}

/// Reads and cleans a scan, and says what of its file is not in it.
pub(crate) fn read_scan(args: &ScanArgs) -> Result<Scan, CommandError> {
    let progress = TerminalProgress::new();
    let scan = scan::read(&args.scan, &args.reading.options(), &progress);
    progress.finish();
    let scan = scan.map_err(unreadable)?;
    let left_out = info::left_out(&scan.source.cleaning);
    if !left_out.is_empty() {
        note!("{}: {} points are read; left out are {left_out}", scan.source.path, scan.source.points);
    }
    Ok(scan)
}

/// Why a scan was not read.
pub(crate) fn unreadable(error: ScanError) -> CommandError {
    match error.fault {
        ScanFault::Cancelled => CommandError::interrupted(),
        _ => CommandError::failed(error),
    }
}

/// Options from the command line.
pub(crate) fn options(controls: &FitControls, program: &Program) -> Result<FitOptions, CommandError> {
    let parameters = program.parameters();
    let mut options = FitOptions::default();
    for (name, value) in &controls.values {
        let (i, value) = values::parameter_value("-p", name, value, program)?;
        options.start.insert(parameters[i].name.clone(), value);
    }
    for given in &controls.fix {
        let (name, value) = given.split_once('=').map_or((given.trim(), None), |(n, value)| (n.trim(), Some(value)));
        match value {
            Some(text) => {
                let (_, value) = values::parameter_value("--fix", name, text, program)?;
                if options.start.insert(name.to_owned(), value).is_some_and(|other| other != value) {
                    let message = format!("--fix {name}={}: another value of {name} is given as well", text.trim());
                    return Err(CommandError::usage(message));
                }
            }
            None => _ = values::parameter("--fix", name, program)?,
        }
        if !options.fixed.iter().any(|other| other == name) {
            options.fixed.push(name.to_owned());
        }
    }
    for names in &controls.equal {
        let names: Vec<&str> = names.split(',').map(str::trim).collect();
        if names.len() < 2 {
            return Err(CommandError::usage(format!("--equal {}: expected two names or more, such as a,b", names[0])));
        }
        for name in &names {
            values::parameter("--equal", name, program)?;
        }
        options.equal.push(names.into_iter().map(str::to_owned).collect());
    }
    options.sigma = controls.sigma;
    options.loss = controls.loss;
    options.weights = controls.weights;
    options.no_pose = controls.no_pose;
    options.ignore_normals = controls.normals == NormalsArg::Ignore;
    options.bootstrap = controls.bootstrap as usize;
    options.coverage = controls.coverage;
    options.one_sided = controls.one_sided;
    options.seed = controls.seed;
    Ok(options)
}

/// Fits.
pub(crate) fn run_fit(
    program: &Program,
    provenance: &Provenance,
    scan: &Scan,
    options: &FitOptions,
    progress: &dyn Progress,
) -> Result<FitResult, CommandError> {
    Ok(provenance.named(fit::fit(program, scan, options, progress)?, program))
}

/// The verdict of a test of a held value.
fn test_sentence(test: &HypothesisTest) -> String {
    let verdict = if test.p < 0.05 { "the scan contradicts it" } else { "the scan does not contradict it" };
    let names = test.parameters.join(", ");
    format!(
        "held {names}: {verdict} (chi-squared {} with {} degree{} of freedom, p = {:.3e})\n",
        table::number(test.statistic),
        test.degrees,
        if test.degrees == 1 { "" } else { "s" },
        test.p
    )
}

/// The intervals of a bootstrap.
fn bootstrap_table(bootstrap: &Bootstrap, fit: &FitResult) -> String {
    let rows: Vec<Vec<String>> = bootstrap
        .parameters
        .iter()
        .map(|r| {
            let degrees = fit.parameters.iter().any(|p| p.name == r.name && p.quantity == Quantity::Angle);
            let written = |x: f64| if degrees { x.to_degrees() } else { x };
            let shown = |x: f64| table::rounded(written(x), Some(written(r.sd)));
            vec![r.name.clone(), shown(r.sd), shown(r.low), shown(r.high)]
        })
        .collect();
    let drawn = match bootstrap.block {
        Some(edge) => format!("blocks of {} mm", table::number(edge)),
        None => "single points".to_owned(),
    };
    let heading = format!("bootstrap: {} scans resampled in {drawn}\n", bootstrap.samples);
    heading + &table::render(&["parameter", "sd", "2.5 %", "97.5 %"], &rows)
}

/// The standard deviations of the pose that was added, and the motions along which it is held.
fn pose_deviations(covariance: &PoseCovariance) -> String {
    let (shift, turn) = covariance.deviations();
    let [shift, turn] = [shift, turn.map(f64::to_degrees)].map(|sd| sd.map(table::number).join(" "));
    let centre = covariance.centre.map(|c| format!("{c:.1}")).join(", ");
    let mut out =
        format!("  sd: shift {shift} mm along x, y, z; turn {turn} deg about x, y, z through ({centre}) mm\n");
    for symmetry in &covariance.symmetries {
        let why = if symmetry.moves.is_empty() { "a symmetry" } else { "not determined" };
        out.push_str(&format!("  held, {why}: {}\n", symmetry.text));
    }
    out
}

/// How well each of several scans is explained, and how well its pose is known.
fn scans_table(scans: &[FittedScan]) -> String {
    if scans.is_empty() {
        return String::new();
    }
    let agreement = |agreement: &Agreement| match agreement.agrees {
        true => format!("{:.2}", agreement.p),
        false => format!("{:.0e}", agreement.p),
    };
    let row = |scan: &FittedScan| {
        let deviations = scan.pose_covariance.as_ref().map(PoseCovariance::deviations);
        let largest = |sd: [f64; 3]| table::number(sd.into_iter().fold(0.0, f64::max));
        vec![
            scan.source.path.clone(),
            scan.source.points.to_string(),
            format!("{:.1}", 100.0 * scan.inliers),
            table::number(scan.rms),
            table::number(scan.noise),
            deviations.map(|(shift, _)| largest(shift)).unwrap_or_default(),
            deviations.map(|(_, turn)| largest(turn.map(f64::to_degrees))).unwrap_or_default(),
            scan.agreement.as_ref().map(agreement).unwrap_or_default(),
        ]
    };
    let head = ["scan", "points", "inliers %", "rms mm", "noise mm", "pose sd mm", "sd deg", "agreement p"];
    let mut out = table::render(&head, &scans.iter().map(row).collect::<Vec<_>>());
    for scan in scans {
        for symmetry in scan.pose_covariance.iter().flat_map(|covariance| &covariance.symmetries) {
            out.push_str(&format!("  {}: its pose is held, not determined: {}\n", scan.source.path, symmetry.text));
        }
    }
    out + "the pose and all places are those in the first scan\n"
}

/// The tables and sentences of a result.
pub(crate) fn summary(fit: &FitResult) -> String {
    let rows: Vec<Vec<String>> = fit
        .parameters
        .iter()
        .map(|p| {
            let degrees = p.quantity == Quantity::Angle;
            let written = |x: f64| if degrees { x.to_degrees() } else { x };
            let shown = |x: f64| table::rounded(written(x), p.sd.map(written));
            let state = p.without_sd.map_or("", WithoutSd::text);
            let unit = if degrees { "deg" } else { &p.unit };
            vec![p.name.clone(), shown(p.value), p.sd.map(shown).unwrap_or_default(), unit.into(), state.into()]
        })
        .collect();
    let mut out = table::render(&["parameter", "value", "sd", "unit", ""], &rows);
    out.push_str(&dimensions::fitted(&fit.measures));
    for group in &fit.equal {
        out.push_str(&format!("held equal: {}\n", group.join(", ")));
    }
    if !fit.inputs.is_empty() {
        let inputs: Vec<String> = fit.inputs.iter().map(ToString::to_string).collect();
        out.push_str(&format!("inputs: {}\n", inputs.join(" ")));
    }
    if let Some(pose) = &fit.pose {
        let t = pose.translation.map(table::number);
        out.push_str(&format!("pose (added by gmlc): translation {} {} {} mm, rotation\n", t[0], t[1], t[2]));
        for row in pose.rotation {
            let r = row.map(|c| format!("{c:9.6}"));
            out.push_str(&format!("  {} {} {}\n", r[0], r[1], r[2]));
        }
    }
    out.push_str(&scans_table(&fit.scans));
    if let Some(covariance) = &fit.pose_covariance {
        out.push_str(&pose_deviations(covariance));
    }
    for test in &fit.tests {
        out.push_str(&test_sentence(test));
    }
    if let Some(bootstrap) = &fit.bootstrap {
        out.push_str(&bootstrap_table(bootstrap, fit));
    }
    if let Some(coverage) = &fit.coverage {
        out.push_str(&format!(
            "coverage: {:.1} % of the model's visible surface was scanned\n",
            100.0 * coverage.share
        ));
    }
    if let Some(search) = &fit.search {
        out.push_str(&search::summary(search));
    }
    out.push_str(&format!(
        "objective {}  sigma {} mm  inliers {:.1} % (within {} mm)  rms {} mm  noise {} mm\n",
        table::number(fit.objective),
        table::number(fit.sigma),
        fit.inliers * 100.0,
        table::number(fit.inlier_distance()),
        table::number(fit.rms),
        table::number(fit.noise)
    ));
    out.push_str(&format!(
        "{} after {} iterations, {} evaluations, {:.2} s\n",
        match (fit.interrupted, fit.converged) {
            (true, _) => "INTERRUPTED",
            (_, true) => "converged",
            _ => "NOT CONVERGED",
        },
        fit.iterations,
        fit.evaluations,
        fit.seconds.values().sum::<f64>()
    ));
    for w in &fit.warnings {
        out.push_str(&format!("warning: {w}\n"));
    }
    out
}
