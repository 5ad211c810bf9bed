//! One of the two things that are compared: a script, a fit or a mesh.

use crate::cli::{CompareArgs, CompileArgs, ValueArgs};
use crate::error::CommandError;
use crate::files::is_script;
use crate::outputs;
use crate::print::cut;
use crate::provenance;
use crate::saved::SavedFit;
use crate::script::{Valued, compile_valued};
use gml_compiler::check::InputValue;
use gml_compiler::program::{Parameter, Program};
use gml_runtime::compare::{Side, Stated, StatedCovariance, States};
use gml_runtime::export::mesh::MeshFormat;
use gml_runtime::fit::{FitResult, WithoutSd};
use gml_runtime::model::Motion;
use gml_runtime::scan::{self, ReferenceMesh, Unit};
use gml_runtime::variance::Reference;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What the command line says of one of them.
pub(super) struct Given<'a> {
    pub(super) path: &'a Path,
    pub(super) parameters: &'a [(String, String)],
    pub(super) inputs: &'a [(String, InputValue)],
    pub(super) unit: Option<Unit>,
    /// `a` or `b`, as at the end of the options.
    pub(super) side: &'static str,
}

/// The kinds of files, by their endings.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Script,
    Fit,
    Mesh,
}

impl Kind {
    /// None where the ending is none of these.
    fn of(path: &Path) -> Option<Self> {
        let ending = path.extension().unwrap_or_default();
        match () {
            () if ending.eq_ignore_ascii_case("gml") => Some(Self::Script),
            () if ending.eq_ignore_ascii_case("json") => Some(Self::Fit),
            () => MeshFormat::of(path).map(|_| Self::Mesh),
        }
    }
}

impl Given<'_> {
    fn kind(&self) -> Result<Kind, CommandError> {
        Kind::of(self.path).ok_or_else(|| {
            CommandError::usage(format!(
                "{}: is no script (.gml), result of `gmlc fit` (.json) or mesh (.ply, .obj, .stl) by the ending of its name",
                self.path.display()
            ))
        })
    }

    /// An error with the name that this command gives to `-p`.
    fn rename(&self, error: CommandError) -> CommandError {
        match error {
            CommandError::Usage(message) => CommandError::Usage(match message.strip_prefix("-p ") {
                // An input is named with the option that sets it.
                Some(rest) => {
                    format!(
                        "--param-{} {}",
                        self.side,
                        rest.replace(": --input ", &format!(": --input-{} ", self.side))
                    )
                }
                None => message,
            }),
            error => error,
        }
    }

    /// Refuses options that make no sense for such a file.
    pub(super) fn check(&self, args: &CompareArgs) -> Result<(), CommandError> {
        let (shown, side, kind) = (self.path.display(), self.side, self.kind()?);
        if kind == Kind::Mesh && !(self.parameters.is_empty() && self.inputs.is_empty()) {
            return Err(CommandError::usage(format!(
                "{shown}: --param-{side} and --input-{side} require a script or a fit; a mesh has no parameters"
            )));
        }
        if kind != Kind::Mesh && self.unit.is_some() {
            return Err(CommandError::usage(format!(
                "{shown}: --unit-{side} requires a mesh; a script states the units of its lengths"
            )));
        }
        if args.script.is_some() && [&args.a, &args.b].iter().all(|path| Kind::of(path) != Some(Kind::Fit)) {
            return Err(CommandError::usage("--script requires a result of `gmlc fit` (.json) as A or B"));
        }
        Ok(())
    }
}

/// A file that was read.
pub(super) struct Operand {
    path: PathBuf,
    content: Content,
}

enum Content {
    Model(Box<ModelState>),
    Mesh(ReferenceMesh),
}

struct ModelState {
    script: PathBuf,
    program: Program,
    x: Vec<f64>,
    motion: Motion,
    parameters: Vec<Stated>,
    fit: Option<FitResult>,
    /// Whether the values are the truth of a virtual scan.
    is_truth: bool,
}

impl Operand {
    pub(super) fn read(given: &Given<'_>, args: &CompareArgs) -> Result<Operand, CommandError> {
        let content = match given.kind()? {
            Kind::Mesh => Content::Mesh(scan::read_surface(given.path, given.unit).map_err(CommandError::failed)?),
            Kind::Script => Content::Model(Box::new(ModelState::read(given, given.path.to_owned(), None, args)?)),
            Kind::Fit => {
                let saved = SavedFit::read(given.path)?;
                let is_truth = saved.is_truth();
                let fit = saved.into_result();
                let script = script_of(&fit, given.path, args)?;
                // Of a truth nothing is uncertain: it has values only.
                let read = ModelState::read(given, script, Some(fit).filter(|_| !is_truth), args)?;
                Content::Model(Box::new(ModelState { is_truth, ..read }))
            }
        };
        Ok(Operand { path: given.path.to_owned(), content })
    }

    /// Refuses an output that would replace a script of the operand.
    pub(super) fn require_apart(&self, output: &Path) -> Result<(), CommandError> {
        match &self.content {
            Content::Mesh(_) => Ok(()),
            Content::Model(model) => outputs::require_apart_from_scripts(output, &model.program),
        }
    }

    pub(super) fn is_mesh(&self) -> bool {
        matches!(self.content, Content::Mesh(_))
    }

    /// The surface with its parameters, in the position of the scan that a model was fitted to if it is `posed`.
    pub(super) fn side(&self, posed: bool) -> Side<'_> {
        match &self.content {
            Content::Mesh(mesh) => Side { surface: Reference::Mesh(&mesh.mesh), states: None },
            Content::Model(model) => {
                let motion = if posed { model.motion } else { Motion::IDENTITY };
                let surface = Reference::Model { model: &model.program, x: &model.x, motion };
                Side { surface, states: Some(model.states()) }
            }
        }
    }

    /// What it is.
    pub(super) fn named(&self) -> Named<'_> {
        let path = self.path.display().to_string();
        match &self.content {
            Content::Mesh(_) => Named { kind: "mesh", path, model: None, script: None, scan: None },
            Content::Model(model) => Named {
                kind: match () {
                    () if model.is_truth => "truth",
                    () if model.fit.is_some() => "fit",
                    () => "script",
                },
                path,
                model: Some(model.program.name()),
                script: Some(model.script.display().to_string()),
                scan: model.fit.as_ref().map(|fit| fit.scan.path.as_str()),
            },
        }
    }

    /// Sentences of the file, which is called so.
    pub(super) fn warnings(&self, name: &str) -> impl Iterator<Item = String> {
        let all = match &self.content {
            Content::Mesh(mesh) => mesh.warnings.clone(),
            Content::Model(model) => {
                let shortcoming = model.fit.as_ref().and_then(FitResult::shortcoming);
                shortcoming.map(|s| format!("the fit cannot be relied on: {s}")).into_iter().collect()
            }
        };
        let name = name.to_owned();
        all.into_iter().map(move |warning| format!("{name}: {warning}"))
    }
}

/// Sentences on what two models do not have in common but their parameters.
pub(super) fn differences(a: &Operand, b: &Operand) -> Vec<String> {
    let (Content::Model(first), Content::Model(second)) = (&a.content, &b.content) else { return Vec::new() };
    let mut all = Vec::new();
    let (first, second) = (&first.program, &second.program);
    if first.name() != second.name() {
        all.push(format!(
            "A is the model '{}' and B the model '{}': parameters are compared by their names",
            first.name(),
            second.name()
        ));
    } else if provenance::sha256(first.sources()) != provenance::sha256(second.sources()) {
        all.push("the texts of the two scripts differ: parameters are compared by their names".to_owned());
    }
    for input in first.inputs().iter().map(provenance::input) {
        let other = second.inputs().iter().map(provenance::input).find(|other| other.name == input.name);
        if let Some(other) = other.filter(|other| *other != input) {
            all.push(format!("A has {input}, B has {other}"));
        }
    }
    all
}

/// The script that a fit names: from here, or else from the folder of the fit. The fit may be a stranger's.
fn script_of(fit: &FitResult, path: &Path, args: &CompareArgs) -> Result<PathBuf, CommandError> {
    if let Some(script) = &args.script {
        return Ok(script.clone());
    }
    let failed = |what: String| CommandError::Failed(format!("{}: {what}", path.display()));
    let beside = path.parent().unwrap_or_else(|| Path::new("")).join(&fit.script);
    let found = [PathBuf::from(&fit.script), beside].into_iter().find(|p| !fit.script.is_empty() && p.is_file());
    let shown = cut(&fit.script, 100);
    let Some(script) = found else {
        return Err(failed(format!(
            "its script `{shown}` is found neither from here nor from the folder of the fit; --script names it"
        )));
    };
    if is_script(&script) {
        Ok(script)
    } else {
        Err(failed(format!("its script `{shown}` is none (.gml) and is not read; --script names the right one")))
    }
}

impl ModelState {
    fn read(
        given: &Given<'_>,
        script: PathBuf,
        fit: Option<FitResult>,
        args: &CompareArgs,
    ) -> Result<Self, CommandError> {
        let compile =
            CompileArgs { inputs: given.inputs.to_vec(), limits: args.limits.clone(), allowed: args.allowed.clone() };
        let params = (given.kind()? == Kind::Fit).then(|| given.path.to_owned());
        let values = ValueArgs { values: given.parameters.to_vec(), params };
        let valued = compile_valued(&script, &compile, &values).map_err(|error| given.rename(error))?;
        let Valued { program, x, motion, .. } = valued;
        let stated = |(parameter, value): (&Parameter, &f64)| {
            let is_given = given.parameters.iter().any(|(name, _)| *name == parameter.name);
            let sd = fit.as_ref().filter(|_| !is_given).map(|fit| deviation(fit, &parameter.name));
            Stated { name: parameter.name.clone(), quantity: parameter.quantity, value: *value, sd }
        };
        let parameters = program.parameters().iter().zip(&x).map(stated).collect();
        Ok(Self { script, program, x, motion, parameters, fit, is_truth: false })
    }

    fn states(&self) -> States<'_> {
        let covariance = self.fit.as_ref().and_then(|fit| fit.covariance.as_ref());
        let covariance = covariance.map(|c| StatedCovariance { parameters: &c.parameters, matrix: &c.matrix });
        let scan = self.fit.as_ref().map(|fit| fit.scan.sha256.as_str()).filter(|sum| !sum.is_empty());
        States { parameters: &self.parameters, covariance, scan }
    }
}

/// The standard deviation of a fitted parameter, or why it has none.
fn deviation(fit: &FitResult, name: &str) -> Result<f64, String> {
    let parameter = fit.parameters.iter().find(|p| p.name == name);
    let without = parameter.and_then(|p| p.without_sd).map(WithoutSd::text);
    parameter.and_then(|p| p.sd).ok_or_else(|| without.unwrap_or("it has no standard deviation").to_owned())
}

/// An operand as it is named in results.
#[derive(Serialize)]
pub(super) struct Named<'a> {
    /// `script`, `fit`, `truth` or `mesh`.
    pub(super) kind: &'static str,
    /// Path as it was given.
    pub(super) path: String,
    /// Name of the model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) model: Option<&'a str>,
    /// Path of the script.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) script: Option<String>,
    /// Path of the scan that it was fitted to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) scan: Option<&'a str>,
}
