//! What is fitted: a compiled script, from its beginning or from where an earlier fit ended.

use crate::cli::{FitControls, ScriptArgs, ValueArgs};
use crate::error::CommandError;
use crate::provenance::Provenance;
use crate::saved::SavedFit;
use crate::script::Valued;
use crate::values::Range;
use crate::{fit, script};
use gml_compiler::program::Program;
use gml_runtime::fit::FitOptions;
use std::path::{Path, PathBuf};

/// A compiled script to be fitted.
pub(crate) struct Subject {
    /// The script, with the inputs of the earlier fit.
    pub(crate) script: ScriptArgs,
    /// The program for these inputs; those that are searched have their defaults.
    pub(crate) program: Program,
    pub(crate) provenance: Provenance,
    /// The fit to go on from.
    pub(crate) saved: Option<SavedFit>,
}

impl Subject {
    /// Compiles a script; `params` is the file of an earlier fit. Inputs that are searched may differ from that fit's.
    pub(crate) fn compiled(
        script: &ScriptArgs,
        params: Option<&Path>,
        searched: &[Range],
        controls: &FitControls,
    ) -> Result<Subject, CommandError> {
        let saved = params.map(SavedFit::read).transpose()?;
        let searched: Vec<&str> = searched.iter().map(|range| range.name.as_str()).collect();
        let program = script::compile_for(&script.model, &script.compile, saved.as_ref(), &searched)?;
        let provenance = Provenance::of(&script.model, &program);
        if let Some(saved) = &saved {
            saved.name_released(controls);
            saved.name_outside(&program);
        }
        let mut script = script.clone();
        if let Some(saved) = &saved {
            script.compile = saved.with_inputs(&script.compile, &searched)?;
        }
        Ok(Subject { script, program, provenance, saved })
    }

    /// The model of an earlier fit as it was fitted; the fit is in the file `params`.
    pub(crate) fn fitted(script: &ScriptArgs, params: Option<&PathBuf>) -> Result<Subject, CommandError> {
        let values = ValueArgs { values: Vec::new(), params: params.cloned() };
        let Valued { program, saved, .. } = script::compile_valued(&script.model, &script.compile, &values)?;
        let provenance = Provenance::of(&script.model, &program);
        Ok(Subject { script: script.clone(), program, provenance, saved })
    }

    /// The options of a fit of this script with perhaps other inputs, which is `program`.
    pub(crate) fn options(&self, controls: &FitControls, program: &Program) -> Result<FitOptions, CommandError> {
        let mut options = fit::options(controls, program)?;
        options.earlier = self.saved.as_ref().map(|saved| saved.earlier(program, &self.provenance));
        if controls.no_pose && options.earlier.as_ref().is_some_and(|earlier| earlier.pose.is_some()) {
            return Err(CommandError::usage(
                "--no-pose: the fit to go on from (--params) has a pose, which gmlc added",
            ));
        }
        Ok(options)
    }
}
