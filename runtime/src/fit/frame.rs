//! How the pose is treated: by the script's own parameters, or by a motion beside them.

use super::options::FitOptions;
use super::pose::RigidParameters;
use crate::model::Model;

/// How the pose is treated.
pub(crate) struct Frame {
    /// The motion is a variable.
    pub(crate) moving: bool,
    /// Parameters that the motion stands for.
    pub(crate) stands_for: Vec<usize>,
    /// The motion ends in the script's parameters.
    pub(crate) write_back: bool,
    /// The motion is part of the result.
    pub(crate) report_pose: bool,
    pub(crate) warnings: Vec<String>,
}

impl Frame {
    pub(crate) fn choose(model: &dyn Model, options: &FitOptions, rigid: &RigidParameters, fixed: &[bool]) -> Self {
        let names = || {
            rigid.indices.iter().map(|i| format!("`{}`", model.parameters()[*i].name)).collect::<Vec<_>>().join(", ")
        };
        let none =
            Self { moving: false, stands_for: Vec::new(), write_back: false, report_pose: false, warnings: Vec::new() };
        if options.no_pose {
            return none;
        }
        if rigid.indices.is_empty() {
            return Self { moving: true, report_pose: true, ..none };
        }
        if rigid.indices.iter().any(|i| fixed[*i]) {
            let warning = format!(
                "some of the pose parameters {} are fixed or tied, so orientations are not searched: the fit begins at their start values",
                names()
            );
            return Self { warnings: vec![warning], ..none };
        }
        if rigid.rank == 6 {
            return Self { moving: true, stands_for: rigid.indices.clone(), write_back: true, ..none };
        }
        let warning = format!(
            "{} move the whole model, but only in {} of the six ways of a rigid body: they are held, and the pose is reported beside the parameters",
            names(),
            rigid.rank
        );
        Self { moving: true, stands_for: rigid.indices.clone(), report_pose: true, warnings: vec![warning], ..none }
    }

    pub(crate) fn free(&self, fixed: &[bool]) -> Vec<usize> {
        (0..fixed.len()).filter(|i| !fixed[*i] && !self.stands_for.contains(i)).collect()
    }
}
