//! What stays the same while one fit goes on.

use super::coverage::Coverage;
use super::layout::Layout;
use super::loss::Loss;
use super::motion::Motion;
use super::objective::{Evaluation, Objective, no_hints};
use super::options::FitError;
use super::points::Points;
use super::pose::Field;
use super::space::{Estimate, Space};
use super::sums::PatchSum;
use super::trace::{Log, TracePoint};
use crate::model::Model;
use crate::progress::{Progress, Silent};
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex};

/// Points of the levels between the screening and the last one, which has all.
pub(crate) const MIDDLE: usize = 6000;

/// Everything that stays the same while one fit goes on.
pub(crate) struct Setting<'a> {
    pub(crate) model: &'a dyn Model,
    /// All points of the scan.
    pub(crate) points: &'a Points,
    /// Some of them, even in space.
    pub(crate) thin: Points,
    pub(crate) space: Space<'a>,
    pub(crate) layout: Layout,
    /// Radius of gyration of the scan: the scale of lengths. Millimetres.
    pub(crate) radius: f64,
    pub(crate) evaluations: &'a AtomicU64,
    /// Asked whether to go on.
    pub(crate) progress: &'a dyn Progress,
    /// Whether the scan's normals tell the sides of a wall from each other.
    pub(crate) oriented: bool,
    /// Every step after the screening.
    pub(crate) trace: Mutex<Vec<TracePoint>>,
    /// See `FitOptions`.
    pub(crate) seed: u64,
    /// What looks from the model to the scan, in the last stages and where it was asked for.
    pub(crate) coverage: Option<Arc<Coverage<'a>>>,
    start_x: Vec<f64>,
}

impl<'a> Setting<'a> {
    /// The setting of a fit that begins at `x`. `surfaces` are those of the points that lie on some surface.
    pub(crate) fn new(
        model: &'a dyn Model,
        (points, surfaces): (&'a Points, &Points),
        x: &[f64],
        (free, ties): (Vec<usize>, &[(usize, usize)]),
        moving: bool,
        radius: f64,
        evaluations: &'a AtomicU64,
    ) -> Result<Self, FitError> {
        let space = Space::new(model, x, free, moving, ties);
        let at = space.estimate(x, Motion::IDENTITY);
        let layout = Layout::default();
        let oriented = !points.normal.is_empty();
        let mut setting = Self {
            model,
            points,
            thin: surfaces.sample(MIDDLE),
            space,
            layout,
            radius,
            evaluations,
            progress: &Silent,
            oriented,
            trace: Mutex::default(),
            seed: 0,
            coverage: None,
            start_x: x.to_vec(),
        };
        setting.remodel(&at, 0.01 * radius)?;
        Ok(setting)
    }

    /// Divides the model's patches, and scales the coordinates, as is right at an estimate.
    pub(crate) fn remodel(&mut self, at: &Estimate, tolerance: f64) -> Result<(), FitError> {
        let x = self.space.x(&at.z).unwrap_or_else(|| self.start_x.clone());
        let instance = self.model.instantiate(&x)?;
        self.layout = Layout::new(self.model, &*instance, tolerance, 2.0 * self.radius);
        let (centre, _, gyration) = self.layout.facets(&*instance).moments();
        let field = Field::sample(self.model, &*instance)?;
        let sizes: Vec<f64> = (0..x.len()).map(|i| field.size(i)).collect();
        self.space.set_scale(at, &sizes, centre, gyration.max(1e-6 * self.radius));
        Ok(())
    }

    /// An objective without normals.
    pub(crate) fn objective<'s>(&'s self, space: &'s Space<'s>, points: &'s Points, loss: Loss) -> Objective<'s> {
        Objective {
            space,
            points,
            layout: &self.layout,
            loss,
            signs: None,
            tolerance: 1e-3 * loss.sigma,
            evaluations: self.evaluations,
            hints: no_hints(points),
            memory: None,
            coverage: self.coverage.clone(),
            curved: false,
            log: None,
            progress: self.progress,
        }
    }

    /// Per patch, which way its parametrisation faces: outwards, as the language's convention has it, unless the scan's
    /// normals say clearly otherwise. Where points lie on both sides (a thin wall whose sides are not told apart yet) the
    /// convention decides: without a decision, both sides of the scanned wall would pull at both of the model.
    /// A patch with too few points to say keeps the side that it had `before`.
    pub(crate) fn facing(&self, evaluation: &Evaluation, before: &[i8]) -> Vec<i8> {
        let sign = |(p, before): (&PatchSum, &i8)| {
            let inwards = if p.weight >= 10.0 { p.facing <= -0.85 * p.weight } else { *before < 0 };
            match (self.oriented, inwards) {
                (false, _) => 0,
                (true, true) => -1,
                (true, false) => 1,
            }
        };
        evaluation.patches.iter().zip(before).map(sign).collect()
    }

    /// Where the steps of a stage are written down.
    pub(crate) fn log(&self, stage: &'static str) -> Log<'_> {
        Log { stage, trace: &self.trace }
    }

    /// What stands for the evaluation of a model that does not exist.
    pub(crate) fn nothing(&self) -> Evaluation {
        let dim = self.space.dim();
        Evaluation {
            value: 1.0,
            gradient: nalgebra::DVector::zeros(dim),
            normal: nalgebra::DMatrix::zeros(dim, dim),
            patches: vec![Default::default(); self.model.parts().len()],
            absent: self.model.parts().len(),
        }
    }
}
