//! A fit that a command begins from: the file of `--params`.

mod figures;
mod measures;
mod sound;
mod texts;
mod truth;

use crate::cli::{CompileArgs, FitControls};
use crate::error::CommandError;
use crate::files;
use crate::provenance::{self, Provenance};
use gml_compiler::check::InputValue;
use gml_compiler::diagnostic::Code;
use gml_compiler::program::{Failed, Input, Parameter, Program, Quantity};
use gml_compiler::source::FileId;
use gml_compiler::syntax;
use gml_compiler::syntax::ast::{Item, ItemKind, Model};
use gml_runtime::fit::{Converged, EarlierFit, FitResult, FittedInput};
use gml_runtime::model::Motion;
use gml_runtime::scan::ScanSource;
use std::path::{Path, PathBuf};
use texts::{listed, short};

/// Relative difference of equal numbers: the last digits of a number may be lost in a file.
const ROUNDING: f64 = 1e-12;

/// A result of `gmlc fit`, or the truth of a virtual scan.
#[derive(Clone)]
pub(crate) struct SavedFit {
    path: PathBuf,
    fit: FitResult,
    /// Whether it is a truth, which has values, inputs and a pose only.
    is_truth: bool,
}

impl SavedFit {
    /// A fit that comes from no file.
    pub(crate) fn of(fit: FitResult) -> SavedFit {
        SavedFit { path: PathBuf::new(), fit, is_truth: false }
    }

    /// The fit.
    pub(crate) fn fit(&self) -> &FitResult {
        &self.fit
    }

    /// Reads fit.json or truth.json.
    pub(crate) fn read(path: &Path) -> Result<SavedFit, CommandError> {
        let text = files::read(path)?;
        let failed = |what: String| CommandError::Failed(format!("{}: {what}", path.display()));
        let is_truth = truth::is_truth(&text);
        let fit = if is_truth { sound::parse_truth(&text) } else { sound::parse(&text) }.map_err(failed)?;
        let again = if is_truth { "scan the model again" } else { "fit the model again" };
        sound::check(&fit).map_err(|what| failed(format!("{what}; {again}, or mend the file")))?;
        Ok(SavedFit { path: path.to_owned(), fit: texts::without_controls(fit), is_truth })
    }

    /// Whether it is the truth of a virtual scan.
    pub(crate) fn is_truth(&self) -> bool {
        self.is_truth
    }

    /// The file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The pose that the fit added.
    pub(crate) fn pose(&self) -> Option<Motion> {
        self.fit.pose
    }

    /// The poses in the scans of a fit of several, in their order; none of a fit of one.
    pub(crate) fn poses(&self) -> Vec<Motion> {
        self.fit.scans.iter().map(|scan| scan.pose).collect()
    }

    /// A sentence on a fit that did not end well, for what rests on its values; none if it did.
    pub(crate) fn doubt(&self) -> Option<String> {
        if self.is_truth {
            return None;
        }
        let shortcoming =
            if self.fit.interrupted { Some("it was interrupted".to_owned()) } else { self.fit.shortcoming() };
        shortcoming.map(|what| format!("{}: the fit cannot be relied on: {what}", self.path.display()))
    }

    /// Refuses a scan that is the fit's in another unit; a sentence on one that is another scan, which may be meant.
    pub(crate) fn about_scan(&self, scan: &ScanSource) -> Result<Option<String>, CommandError> {
        let of = &self.fit.scan;
        if of.sha256.is_empty() || scan.sha256.is_empty() {
            return Ok(None);
        }
        if of.sha256 != scan.sha256 {
            let (path, fitted, scan) = (self.path.display(), short(&of.path), &scan.path);
            return Ok(Some(format!("{path}: the model was fitted to another scan ({fitted}) than {scan}")));
        }
        if !of.unit.is_empty() && of.unit != scan.unit {
            let (fitted, now) = (&of.unit, &scan.unit);
            return Err(self.failed(&format!("was fitted to this scan in {fitted}, not in {now}: --unit {fitted}")));
        }
        Ok(None)
    }

    /// All of the file.
    pub(crate) fn into_result(self) -> FitResult {
        self.fit
    }

    /// Warns where a command has no use for the pose that the fit added.
    pub(crate) fn without_pose(&self) {
        if self.fit.pose.is_some() {
            let whose = if self.is_truth { "of the virtual scan" } else { "that gmlc added" };
            self.warn(&format!("the pose {whose} is left out: the model is where the script puts it"));
        }
    }

    /// Where the fit ended, for one of a program that may have other inputs or another text.
    pub(crate) fn earlier(&self, program: &Program, provenance: &Provenance) -> EarlierFit {
        let FitResult { parameters, equal, pose, scan, scans, loss, sigma, weights, .. } = &self.fit;
        let converged = Converged { scan_sha256: scan.sha256.clone(), loss: *loss, sigma: *sigma, weights: *weights };
        let inputs: Vec<FittedInput> = program.inputs().iter().map(provenance::input).collect();
        let free = equal.is_empty() && !parameters.iter().any(|p| p.fixed);
        let finished = self.fit.converged && !self.fit.interrupted && free;
        let same = finished && inputs == self.fit.inputs && !self.is_of_another_text(provenance);
        EarlierFit {
            values: parameters.iter().map(|p| (p.name.clone(), p.value)).collect(),
            pose: *pose,
            scans: scans.iter().map(|scan| scan.pose).collect(),
            converged: same.then_some(converged),
        }
    }

    fn is_of_another_text(&self, provenance: &Provenance) -> bool {
        self.fit.script_sha256.is_some() && self.fit.script_sha256 != provenance.sha256
    }

    /// Names what the fit held and the next one, with these options, does not.
    pub(crate) fn name_released(&self, controls: &FitControls) {
        let fixed = |name: &str| controls.fix.iter().any(|fix| fix.split('=').next().is_some_and(|n| n.trim() == name));
        let released = self.fit.parameters.iter().filter(|p| p.fixed && !fixed(&p.name));
        let released: Vec<&str> = released.map(|p| p.name.as_str()).collect();
        if let [first, ..] = released[..] {
            self.warn(&format!("held {}, now free again (--fix {first} would hold it)", quoted(&released)));
        }
        let is_member = |group: &str, name: &str| group.split(',').any(|other| other.trim() == name);
        let equal = |group: &[String]| controls.equal.iter().any(|e| group.iter().all(|name| is_member(e, name)));
        for group in self.fit.equal.iter().filter(|group| !equal(group)) {
            let names: Vec<&str> = group.iter().map(String::as_str).collect();
            let again = names.join(",");
            self.warn(&format!("held {} equal, now free again (--equal {again} would hold them)", quoted(&names)));
        }
    }

    /// Names the values from which another fit cannot begin, since the script has other bounds now.
    pub(crate) fn name_outside(&self, program: &Program) {
        let x = self.values_of(program);
        for (parameter, (value, bounds)) in program.parameters().iter().zip(x.iter().zip(program.bounds(&x))) {
            if let Err(what) = parameter.within(*value, bounds) {
                self.warn(&format!("{what}: the fit begins at the nearest bound"));
            }
        }
    }

    /// The values of a program's parameters.
    pub(crate) fn values_of(&self, program: &Program) -> Vec<f64> {
        let fitted =
            |p: &Parameter| self.fit.parameters.iter().find(|f| f.name == p.name).map_or(p.default, |f| f.value);
        program.parameters().iter().map(fitted).collect()
    }

    /// The arguments of a compilation with the inputs of the fit, but for those that are `searched`.
    pub(crate) fn with_inputs(&self, args: &CompileArgs, searched: &[&str]) -> Result<CompileArgs, CommandError> {
        let mut args = args.clone();
        for input in self.fit.inputs.iter().filter(|i| !searched.contains(&i.name.as_str())) {
            let given = args.inputs.iter().find(|(name, _)| *name == input.name);
            match given {
                Some((_, given)) if !same(*given, input.value) => return Err(self.contradiction(input, *given)),
                Some(_) => {}
                None => args.inputs.push((input.name.clone(), value(input))),
            }
        }
        Ok(args)
    }

    fn contradiction(&self, input: &FittedInput, given: InputValue) -> CommandError {
        let given = match given {
            InputValue::Bool(flag) => flag.to_string(),
            InputValue::Int(whole) => whole.to_string(),
            InputValue::Real(number) => input.quantity.shown(number),
        };
        CommandError::usage(format!("--input {}={given}: {} was fitted with {input}", input.name, self.path.display(),))
    }

    /// Says what is wrong if a script cannot be compiled with the fit's inputs because it is another one.
    pub(crate) fn explain(&self, error: CommandError) -> CommandError {
        let CommandError::Script(failed) = &error else { return error };
        if !failed.diagnostics.iter().any(|d| d.code == Code::UnknownInput) {
            return error;
        }
        self.lost_inputs(failed).unwrap_or(error)
    }

    fn lost_inputs(&self, failed: &Failed) -> Option<CommandError> {
        let (tree, _) = syntax::parse(FileId(0), &failed.sources.scripts().next()?.text);
        let model = |item: &Item| if let ItemKind::Model(model) = &item.kind { Some(model.clone()) } else { None };
        let Model { name, items } = tree.items.iter().rev().find_map(model)?;
        let input =
            |item: &Item| if let ItemKind::Input(input) = &item.kind { Some(input.name.text.clone()) } else { None };
        let declared: Vec<String> = items.iter().filter_map(input).collect();
        self.require_inputs(&name.text, &declared).err()
    }

    /// Refuses a fit of a model of another name, or one with inputs that are not `declared`.
    pub(crate) fn require_inputs(&self, model: &str, declared: &[String]) -> Result<(), CommandError> {
        self.require_name(model)?;
        let lost: Vec<String> =
            self.fit.inputs.iter().filter(|i| !declared.contains(&i.name)).map(|i| short(&i.to_string())).collect();
        if lost.is_empty() {
            return Ok(());
        }
        let inputs = if lost.len() == 1 { "input of that name" } else { "inputs of these names" };
        Err(self.failed(&format!(
            "was fitted with {}, and the model '{model}' has no {inputs}",
            listed(&lost, String::clone)
        )))
    }

    fn require_name(&self, name: &str) -> Result<(), CommandError> {
        // Files from before the name was written have an empty one.
        if self.fit.model.is_empty() || self.fit.model == name {
            return Ok(());
        }
        Err(self.failed(&format!("is of the model {}, and this model is '{name}'", texts::quoted(&self.fit.model))))
    }

    /// Refuses a fit of another model, and warns of one of another text. `args` are those of the command line.
    pub(crate) fn require_model(
        &self,
        program: &Program,
        provenance: &Provenance,
        args: &CompileArgs,
    ) -> Result<(), CommandError> {
        self.require_name(program.name())?;
        self.require_parameters(program)?;
        let unknown = |i: &&Input| {
            self.fit.inputs.iter().all(|f| f.name != i.name) && args.inputs.iter().all(|(name, _)| *name != i.name)
        };
        for input in program.inputs().iter().filter(unknown) {
            let taken = provenance::input(input);
            self.warn(&format!("does not say with which '{}' it was fitted: {taken} is taken", input.name));
        }
        // Other inputs may make other parts.
        let inputs: Vec<FittedInput> = program.inputs().iter().map(provenance::input).collect();
        let is_same = inputs == self.fit.inputs && self.fit.script_sha256.is_some();
        if is_same && self.fit.script_sha256 == provenance.sha256 {
            figures::check_parts(&self.fit, program).map_err(|what| self.failed(&what))?;
        }
        if self.is_of_another_text(provenance) {
            let since = if self.is_truth { "virtual scan" } else { "fit" };
            self.warn(&format!("the text of the script, or of what it uses, has changed since the {since}"));
        }
        Ok(())
    }

    /// Refuses a fit with other inputs than those of a session's model.
    pub(crate) fn require_same_inputs(&self, program: &Program) -> Result<(), CommandError> {
        for fitted in &self.fit.inputs {
            let of_session = program.inputs().iter().find(|i| i.name == fitted.name).map(provenance::input);
            if let Some(input) = of_session.filter(|input| *input != *fitted) {
                return Err(
                    self.failed(&format!("was fitted with {fitted}, and the model has {input}: `:set {fitted}`"))
                );
            }
        }
        Ok(())
    }

    /// Refuses a fit whose parameters are not the model's.
    fn require_parameters(&self, program: &Program) -> Result<(), CommandError> {
        let (fitted, known) = (&self.fit.parameters, program.parameters());
        let extra = fitted.iter().filter(|f| known.iter().all(|k| k.name != f.name)).map(|f| f.name.as_str());
        let lacking = known.iter().filter(|k| fitted.iter().all(|f| f.name != k.name)).map(|k| k.name.as_str());
        let (extra, lacking) = (quoted(&extra.collect::<Vec<_>>()), quoted(&lacking.collect::<Vec<_>>()));
        let mut differences = Vec::new();
        if !extra.is_empty() {
            differences.push(format!("the fit has {extra}, which the model has not"));
        }
        if !lacking.is_empty() {
            differences.push(format!("the model has {lacking}, which the fit has not"));
        }
        // A truth does not say what its values measure.
        let another =
            |k: &&Parameter| !self.is_truth && fitted.iter().any(|f| f.name == k.name && f.quantity != k.quantity);
        let another = quoted(&known.iter().filter(another).map(|k| k.name.as_str()).collect::<Vec<_>>());
        if !another.is_empty() {
            differences.push(format!("{another} measured something else"));
        }
        if differences.is_empty() {
            return Ok(());
        }
        let differences = differences.join("; ");
        Err(self.failed(&format!(
            "was fitted to other parameters than those of the model '{}': {differences}",
            program.name()
        )))
    }

    fn failed(&self, what: &str) -> CommandError {
        CommandError::Failed(format!("{}: {what}", self.path.display()))
    }

    fn warn(&self, what: &str) {
        eprintln!("warning: {}: {what}", self.path.display());
    }
}

fn quoted(names: &[&str]) -> String {
    listed(names, |name| texts::quoted(name))
}

/// The value of an input for the compiler.
fn value(input: &FittedInput) -> InputValue {
    match input.quantity {
        Quantity::Int => InputValue::Int(input.value as i64),
        Quantity::Bool => InputValue::Bool(input.value != 0.0),
        _ => InputValue::Real(input.value),
    }
}

fn same(given: InputValue, fitted: f64) -> bool {
    let given = match given {
        InputValue::Int(whole) => whole as f64,
        InputValue::Bool(flag) => f64::from(flag),
        InputValue::Real(number) => number,
    };
    (given - fitted).abs() <= ROUNDING * fitted.abs()
}
