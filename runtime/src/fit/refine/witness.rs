//! The scan as a witness against a solution: the model's surface that stands where it shows empty space.

use super::schedule::Solution;
use crate::fit::problem::free_space::{Contradicted, FreeSpace};
use crate::fit::problem::parameterization::Estimate;
use crate::fit::problem::sides::Sides;
use crate::fit::tuning::CONTRADICTED;

/// A scan that says what is empty, for shapes next to one solution.
pub(crate) struct Witness<'s> {
    solution: &'s Solution<'s>,
    space: &'s FreeSpace,
    /// The scan's triangles face the other way.
    reversed: bool,
}

impl<'s> Witness<'s> {
    /// None where the scan does not say.
    pub(crate) fn of(solution: &'s Solution<'s>) -> Option<Self> {
        let Solution { level, estimate, loss, .. } = solution;
        level.problem.free_space()?;
        Self::by(solution, &Sides::of(level, estimate, *loss)?)
    }

    /// The same by the solution's sides, where they are known.
    pub(crate) fn by(solution: &'s Solution<'s>, sides: &Sides) -> Option<Self> {
        let space = solution.level.problem.free_space()?;
        Some(Self { solution, space, reversed: sides.reversed })
    }

    /// The contradicted surface of every patch at an estimate. None where the model does not exist.
    pub(crate) fn contradicted(&self, at: &Estimate) -> Option<Vec<Contradicted>> {
        let Solution { level, loss, .. } = self.solution;
        self.space.contradicted(level, at, loss.sigma, self.reversed)
    }
}

/// The contradicted area of a model, and how much of it is no chance. Square millimetres.
pub(crate) fn total(patches: &[Contradicted]) -> (f64, f64) {
    let sum = |of: &dyn Fn(&Contradicted) -> f64| patches.iter().map(of).sum::<f64>();
    (sum(&|c| c.area), CONTRADICTED * sum(&|c| c.of))
}
