//! One level of resolution of a fit: the facets and the scaled coordinates that are right about one estimate.

use super::Problem;
use super::loss::Loss;
use super::objective::Objective;
use super::parameterization::{Estimate, Parameterization};
use super::points::Points;
use super::rigid::VelocityField;
use crate::fit::correspond::layout::Layout;
use crate::fit::problem::coverage::Coverage;
use crate::fit::problem::separation::Separation;
use crate::fit::tuning::{CHORD, MODEL_SIZE};
use crate::model::EvaluationError;
use std::sync::Arc;

/// A problem with coordinates and facets. Every stage works on one level or makes a new one from it.
#[derive(Clone)]
pub(crate) struct Level<'a> {
    pub(crate) problem: &'a Problem<'a>,
    /// Coordinates of estimates, scaled so that all of them move the surface by about as much.
    pub(crate) space: Parameterization<'a>,
    /// The division of patches into facets.
    pub(crate) layout: Layout,
    /// The coverage term, in the last stages and where it was asked for.
    pub(crate) coverage: Option<Arc<Coverage<'a>>>,
    /// The term that holds walls apart, in the last stage and where they passed through each other.
    pub(crate) separation: Option<Arc<Separation>>,
}

impl<'a> Level<'a> {
    /// Divides the model's patches, and scales the coordinates, as is right at the estimate `at`: facets are
    /// about `chord` radii of the scan off the surface.
    ///
    /// # Errors
    /// The model cannot be evaluated there.
    pub(crate) fn new(
        problem: &'a Problem<'a>,
        mut space: Parameterization<'a>,
        at: &Estimate,
        chord: f64,
    ) -> Result<Self, EvaluationError> {
        let model = problem.model;
        let x = space.x(&at.z).unwrap_or_else(|| problem.start.x.clone());
        let instance = model.instantiate(&x)?;
        let layout = Layout::new(model, &*instance, chord * problem.radius, MODEL_SIZE * problem.radius);
        let (centre, gyration) = layout.facets(&*instance).moments();
        let field = VelocityField::sample(model, &*instance)?;
        let sizes: Vec<f64> = (0..x.len()).map(|i| field.size(i)).collect();
        space.set_scale(at, &sizes, centre, gyration.max(1e-6 * problem.radius));
        Ok(Self { problem, space, layout, coverage: None, separation: None })
    }

    /// A level with the same coordinates whose facets and scales are right at another estimate, without the terms of
    /// the last stages.
    ///
    /// # Errors
    /// The model cannot be evaluated there.
    pub(crate) fn around(&self, at: &Estimate) -> Result<Self, EvaluationError> {
        Self::new(self.problem, self.space.clone(), at, CHORD)
    }

    /// The level without the term that holds walls apart.
    pub(crate) fn without_separation(&self) -> Self {
        Self { separation: None, ..self.clone() }
    }

    /// An objective on this level, without normals.
    pub(crate) fn objective<'s>(&'s self, points: &'s Points, loss: Loss) -> Objective<'s> {
        Objective {
            coverage: self.coverage.clone(),
            separation: self.separation.clone(),
            ..Objective::new(&self.space, &self.layout, points, loss, self.problem.monitor)
        }
    }
}
