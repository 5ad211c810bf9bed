//! The treatment of the pose: by the script's own parameters, or by a motion beside them.

use super::rigid::RigidParameters;
use crate::fit::monitor::Monitor;
use crate::fit::options::FitOptions;
use crate::fit::start::Start;
use crate::model::Model;

/// The treatment of the pose.
pub(crate) struct PoseTreatment {
    /// The motion is a variable.
    pub(crate) moving: bool,
    /// Parameters that the motion stands for.
    pub(crate) stands_for: Vec<usize>,
    /// The motion ends in the script's parameters.
    pub(crate) write_back: bool,
    /// The motion is part of the result.
    pub(crate) report_pose: bool,
}

impl PoseTreatment {
    /// Chooses the treatment, with a warning where a user may not expect it.
    pub(crate) fn choose(
        model: &dyn Model,
        options: &FitOptions,
        rigid: &RigidParameters,
        start: &Start,
        monitor: &Monitor,
    ) -> Self {
        let names = || {
            rigid.indices.iter().map(|i| format!("`{}`", model.parameters()[*i].name)).collect::<Vec<_>>().join(", ")
        };
        let none = Self { moving: false, stands_for: Vec::new(), write_back: false, report_pose: false };
        if options.no_pose {
            return none;
        }
        if rigid.indices.is_empty() {
            return Self { moving: true, report_pose: true, ..none };
        }
        if rigid.indices.iter().any(|i| start.fixed[*i] || start.is_tied(*i)) {
            monitor.warn(format!(
                "some of the pose parameters {} are fixed or tied, so orientations are not searched: the fit begins at their start values",
                names()
            ));
            return none;
        }
        if rigid.rank == 6 {
            return Self { moving: true, stands_for: rigid.indices.clone(), write_back: true, ..none };
        }
        monitor.warn(format!(
            "{} move the whole model, but only in {} of the six ways of a rigid body: they are held, and the pose is reported beside the parameters",
            names(),
            rigid.rank
        ));
        Self { moving: true, stands_for: rigid.indices.clone(), report_pose: true, ..none }
    }

    /// The pose of one of several scans: a motion beside the script's parameters, whose own pose keeps its start
    /// values.
    pub(crate) fn beside(rigid: &RigidParameters) -> Self {
        Self { moving: true, stands_for: rigid.indices.clone(), write_back: false, report_pose: true }
    }

    /// The parameters that vary, ascending: neither fixed, nor following another one, nor replaced by the motion.
    pub(crate) fn free(&self, start: &Start) -> Vec<usize> {
        start.free().filter(|i| !self.stands_for.contains(i)).collect()
    }
}
