//! The problem that a fit solves: a model, a scan and its noise, the parameterization of estimates, and the objective.

mod contested;
pub(crate) mod coverage;
pub(crate) mod extent;
pub(crate) mod free_space;
pub(crate) mod isometry;
pub(crate) mod level;
pub(crate) mod loss;
pub(crate) mod objective;
pub(crate) mod parameterization;
pub(crate) mod points;
pub(crate) mod pose_treatment;
pub(crate) mod rigid;
pub(crate) mod rows;
pub(crate) mod separation;
pub(crate) mod sides;
pub(crate) mod sums;
pub(crate) mod walls;
pub(crate) mod weights;

use super::monitor::Monitor;
use super::options::{Converged, FitError, FitOptions};
use super::start::Start;
use crate::fit::tuning::{CONVINCING, EXPLAINED, FACING_CLEAR, FACING_POINTS, FEWEST_POINTS, START_CHORD, THIN_POINTS};
use crate::model::Model;
use crate::scan::Scan;
use free_space::FreeSpace;
use isometry::Isometry;
use level::Level;
use objective::Evaluation;
use parameterization::Parameterization;
use points::Points;
use pose_treatment::PoseTreatment;
use rigid::{RigidParameters, recognise};
use std::sync::OnceLock;
use sums::PatchSum;

/// A model to be fitted to a scan. It does not change during the fit.
pub(crate) struct Problem<'a> {
    pub(crate) model: &'a dyn Model,
    pub(crate) scan: &'a Scan,
    pub(crate) options: &'a FitOptions,
    /// The start vector, and which parameters are fixed or tied to others.
    pub(crate) start: Start,
    /// All points of the scan.
    pub(crate) points: Points,
    /// Some of them, even in space; without outliers.
    pub(crate) thin: Points,
    /// Radius of gyration of the scan: the scale of lengths. Millimetres.
    pub(crate) radius: f64,
    /// Whether the scan's normals tell the sides of a wall from each other.
    pub(crate) oriented: bool,
    /// The script's own pose parameters.
    pub(crate) rigid: RigidParameters,
    /// The treatment of the pose.
    pub(crate) pose: PoseTreatment,
    pub(crate) monitor: &'a Monitor<'a>,
    /// The space that the scan shows to be empty, once it was asked for.
    free_space: OnceLock<Option<FreeSpace>>,
}

impl<'a> Problem<'a> {
    /// The problem of fitting a model to a scan.
    ///
    /// # Errors
    /// See [`crate::fit::fit()`].
    pub(crate) fn new(
        model: &'a dyn Model,
        scan: &'a Scan,
        options: &'a FitOptions,
        monitor: &'a Monitor<'a>,
    ) -> Result<Self, FitError> {
        let start = options.resolve(model)?;
        if model.parts().is_empty() {
            return Err(FitError::EmptyModel);
        }
        let points = Points::of(scan, options.weights);
        // Outliers must not decide on the place and the size of the object.
        let surfaces = points.on_surfaces(scan);
        let radius = surfaces.gyration();
        if points.len() < FEWEST_POINTS || !(radius > 0.0) {
            return Err(FitError::EmptyScan { scan: scan.source.path.clone(), points: points.len() });
        }
        let thin = surfaces.sample(THIN_POINTS);
        drop(surfaces);
        let rigid = recognise(model, &start.x, radius)?;
        let pose = PoseTreatment::choose(model, options, &rigid, &start, monitor);
        let oriented = !points.normal.is_empty() && scan.oriented && !options.ignore_normals;
        Ok(Self {
            model,
            scan,
            options,
            start,
            points,
            thin,
            radius,
            oriented,
            rigid,
            pose,
            monitor,
            free_space: OnceLock::new(),
        })
    }

    /// The problem of fitting a model to one of several scans, each of which has a pose of its own beside the script's
    /// parameters.
    ///
    /// # Errors
    /// See [`crate::fit::fit()`].
    pub(crate) fn one_of_several(
        model: &'a dyn Model,
        scan: &'a Scan,
        options: &'a FitOptions,
        monitor: &'a Monitor<'a>,
    ) -> Result<Self, FitError> {
        // What is said of the pose is said for all scans together.
        let (problem, _) = monitor.aside(|| Self::new(model, scan, options, monitor));
        let problem = problem?;
        Ok(Self { pose: PoseTreatment::beside(&problem.rigid), ..problem })
    }

    /// The space that the scan shows to be empty. None where it does not say, or the user wants nothing of it, or wants
    /// the fit to end.
    pub(crate) fn free_space(&self) -> Option<&FreeSpace> {
        if self.options.one_sided || self.monitor.cancelled() {
            return None;
        }
        self.free_space.get_or_init(|| FreeSpace::of(self.scan, self.points.spacing())).as_ref()
    }

    /// The motion that an earlier fit added, as far as the pose may be sought.
    pub(crate) fn start_motion(&self) -> Isometry {
        let pose = self.options.earlier.as_ref().and_then(|earlier| earlier.pose);
        pose.filter(|_| self.pose.moving).map_or(Isometry::IDENTITY, Isometry::from)
    }

    /// The end of an earlier fit, if that converged to this scan.
    pub(crate) fn converged(&self) -> Option<&Converged> {
        let end = self.options.earlier.as_ref()?.converged.as_ref()?;
        // Scans that are not from files have no sum.
        (!end.scan_sha256.is_empty() && end.scan_sha256 == self.scan.source.sha256).then_some(end)
    }

    /// Inlier ratio above which no other orientations than that of the start are sought.
    pub(crate) fn convincing(&self) -> f64 {
        if self.converged().is_some() { EXPLAINED } else { CONVINCING }
    }

    /// The level of the registration: about the start values, with coarse facets.
    ///
    /// # Errors
    /// The model cannot be evaluated at the start.
    pub(crate) fn start_level(&'a self) -> Result<Level<'a>, FitError> {
        let Start { x, ties, .. } = &self.start;
        let space = Parameterization::new(self.model, x, self.pose.free(&self.start), self.pose.moving, ties);
        let at = space.estimate(x, Isometry::IDENTITY);
        Ok(Level::new(self, space, &at, START_CHORD)?)
    }

    /// Per patch, which way its parametrisation seems to face while the fit seeks its place (`Sides` has the last
    /// word): outwards, as the language's convention has it, unless the scan's normals say clearly otherwise. Where
    /// points lie on both sides (a thin wall whose sides are not told apart yet) the convention decides: without a
    /// decision, both sides of the scanned wall would pull at both of the model. A patch with too few points to say
    /// keeps the side that it had `before`.
    pub(crate) fn facing(&self, evaluation: &Evaluation, before: &[i8]) -> Vec<i8> {
        let sign = |(p, before): (&PatchSum, &i8)| {
            let inwards = if p.near >= FACING_POINTS { p.facing <= -FACING_CLEAR * p.weight } else { *before < 0 };
            match (self.oriented, inwards) {
                (false, _) => 0,
                (true, true) => -1,
                (true, false) => 1,
            }
        };
        evaluation.patches.iter().zip(before).map(sign).collect()
    }
}
