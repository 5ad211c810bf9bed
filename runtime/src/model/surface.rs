//! Models as the runtime sees them: named parameters and, for their values, patches of surface over [0, 1]^2 with exact
//! derivatives. `gml_compiler`'s programs implement it; so do the analytic shapes in tests.

use bytemuck::{Pod, Zeroable};
use gml_compiler::program::{BoundDerivative, EvaluationError, Measure, Order, Parameter, Part, PartFigure, Sites};

/// A point of a surface with its first partial derivatives. Millimetres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Partials {
    /// S(u, v).
    pub point: [f64; 3],
    /// dS/du.
    pub du: [f64; 3],
    /// dS/dv.
    pub dv: [f64; 3],
}

/// Second partial derivatives of a surface beside the first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SecondPartials {
    /// The point and the first partials.
    pub first: Partials,
    /// d2S/du2.
    pub duu: [f64; 3],
    /// d2S/du dv.
    pub duv: [f64; 3],
    /// d2S/dv2.
    pub dvv: [f64; 3],
}

/// A model: a function from parameters to patches of surface. How many patches there are, and what they are called,
/// does not depend on the parameters.
pub trait Model: Sync {
    /// Its name.
    fn name(&self) -> &str;
    /// Its free parameters, in order.
    fn parameters(&self) -> &[Parameter];
    /// Its patches, in order.
    fn parts(&self) -> &[Part];
    /// The patch behind the parts whose first coordinate says where a part is there, if it is trimmed: it is there
    /// where that is positive.
    fn keep(&self, part: usize) -> Option<usize> {
        let _ = part;
        None
    }
    /// Whether any part is trimmed.
    fn is_trimmed(&self) -> bool {
        (0..self.parts().len()).any(|part| self.keep(part).is_some())
    }
    /// The parameters that the function of where a part is there depends on, ascending; none if it is not trimmed.
    fn keep_active(&self, part: usize) -> &[u32] {
        let _ = part;
        &[]
    }
    /// Bounds of every parameter at x (a bound may depend on earlier parameters); infinite where there is none.
    fn bounds(&self, x: &[f64]) -> Vec<(f64, f64)>;
    /// The Jacobian of the bounds at x: an entry for each pair of a parameter and another one that its bounds depend
    /// on, the same pairs at any x.
    fn bounds_jacobian(&self, x: &[f64]) -> Vec<BoundDerivative>;
    /// Tolerances of the parts at x, for those to which the model gives one: the largest magnitude of a deviation in
    /// millimetres.
    ///
    /// # Errors
    /// If a tolerance cannot be evaluated.
    fn tolerances(&self, x: &[f64]) -> Result<Vec<Option<f64>>, EvaluationError> {
        let _ = x;
        Ok(vec![None; self.parts().len()])
    }
    /// The values that it reports, in order.
    fn measures(&self) -> &[Measure] {
        &[]
    }
    /// The figures of parts that the measures take.
    fn figures(&self) -> &[PartFigure] {
        &[]
    }
    /// The indices of the [`figures`](Self::figures) that a measure takes, ascending.
    fn figures_of(&self, measure: usize) -> &[u32] {
        let _ = measure;
        &[]
    }
    /// The value of a measure at x, in millimetres and radians, where the figures that it takes have some values.
    ///
    /// # Errors
    /// If it cannot be computed.
    fn measure(&self, measure: usize, x: &[f64], figures: &[f64]) -> Result<f64, EvaluationError> {
        let _ = (x, figures);
        Err(EvaluationError::new(format!("there is no measure {measure}")))
    }
    /// Its derivatives by every parameter, and then by every figure that it takes.
    ///
    /// # Errors
    /// If one cannot be computed.
    fn measure_gradient(&self, measure: usize, x: &[f64], figures: &[f64]) -> Result<Vec<f64>, EvaluationError> {
        self.measure(measure, x, figures).map(|_| Vec::new())
    }
    /// The error of a measure at x: what is said of it, such as that it cannot be computed, with the reason.
    fn wrong_measure(&self, measure: usize, x: &[f64], said: &str) -> EvaluationError {
        let _ = x;
        EvaluationError::new(format!("measure {measure} {said}"))
    }
    /// What the tolerance of a measure allows about its value at x, if it has one: the lower and the upper limit.
    ///
    /// # Errors
    /// If it cannot be computed, or leaves nothing.
    fn measure_limits(&self, measure: usize, x: &[f64]) -> Result<Option<[f64; 2]>, EvaluationError> {
        let _ = x;
        Err(EvaluationError::new(format!("there is no measure {measure}")))
    }
    /// The model at x.
    ///
    /// # Errors
    /// A `require` that does not hold, a limit, or a value that is not finite, with the place in the source.
    fn instantiate<'a>(&'a self, x: &[f64]) -> Result<Box<dyn Instance + 'a>, EvaluationError>;
}

/// A model at certain parameters.
pub trait Instance: Sync {
    /// Evaluates a patch: `out` has [`Order::width`] numbers for every site, one site after the other; or, for a
    /// pullback, an entry for every parameter of the model, to which is added.
    ///
    /// # Errors
    /// A limit, or a value that is not finite. (Fits that want to go on treat the patch as absent.)
    fn evaluate(
        &self,
        patch: usize,
        sites: Sites<'_>,
        order: Order<'_>,
        out: &mut [f64],
    ) -> Result<(), EvaluationError>;
}

/// [`Instance::evaluate`] with the types of its results. `u`, `v` and the output have one entry a point; of grids the
/// output has one for every u for every v, u running fastest. Errors are those of `evaluate`.
#[allow(clippy::missing_errors_doc)]
impl<'a> dyn Instance + 'a {
    /// Points of patch `patch`.
    pub fn points(&self, patch: usize, u: &[f64], v: &[f64], out: &mut [[f64; 3]]) -> Result<(), EvaluationError> {
        self.evaluate(patch, Sites::Scattered(u, v), Order::Points, out.as_flattened_mut())
    }

    /// Points with first partials.
    pub fn partials(&self, patch: usize, u: &[f64], v: &[f64], out: &mut [Partials]) -> Result<(), EvaluationError> {
        self.evaluate(patch, Sites::Scattered(u, v), Order::Partials, bytemuck::cast_slice_mut(out))
    }

    /// Points with first and second partials.
    pub fn second_partials(
        &self,
        patch: usize,
        u: &[f64],
        v: &[f64],
        out: &mut [SecondPartials],
    ) -> Result<(), EvaluationError> {
        self.evaluate(patch, Sites::Scattered(u, v), Order::SecondPartials, bytemuck::cast_slice_mut(out))
    }

    /// Points on a grid.
    pub fn points_grid(&self, patch: usize, u: &[f64], v: &[f64], out: &mut [[f64; 3]]) -> Result<(), EvaluationError> {
        self.evaluate(patch, Sites::Grid(u, v), Order::Points, out.as_flattened_mut())
    }

    /// Points with first partials on a grid.
    pub fn partials_grid(
        &self,
        patch: usize,
        u: &[f64],
        v: &[f64],
        out: &mut [Partials],
    ) -> Result<(), EvaluationError> {
        self.evaluate(patch, Sites::Grid(u, v), Order::Partials, bytemuck::cast_slice_mut(out))
    }

    /// Whether a part is there at some places, by the patch of its function of that: everywhere if it has none.
    pub fn is_there(&self, keep: Option<usize>, u: &[f64], v: &[f64]) -> Result<Vec<bool>, EvaluationError> {
        let Some(keep) = keep else { return Ok(vec![true; u.len()]) };
        Ok(self.keeps(keep, u, v)?.into_iter().map(|value| value > 0.0).collect())
    }

    /// The values of the function of where a part is there, by its patch: positive where it is.
    pub fn keeps(&self, keep: usize, u: &[f64], v: &[f64]) -> Result<Vec<f64>, EvaluationError> {
        let mut values = vec![[0.0; 3]; u.len()];
        self.points(keep, u, v, &mut values)?;
        Ok(values.into_iter().map(|value| value[0]).collect())
    }

    /// dS/dx over the patch's active parameters: `out[(i * active + a) * 3 + c]` is the derivative of coordinate c of
    /// point i with respect to parameter `parts()[patch].active[a]`.
    pub fn jacobian(&self, patch: usize, u: &[f64], v: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        self.evaluate(patch, Sites::Scattered(u, v), Order::Jacobian, out)
    }

    /// Adds sum over i of (dS/dx at point i)^T `w[i]` to `gradient`, which has an entry for every parameter.
    pub fn pullback(
        &self,
        patch: usize,
        u: &[f64],
        v: &[f64],
        w: &[[f64; 3]],
        gradient: &mut [f64],
    ) -> Result<(), EvaluationError> {
        self.evaluate(patch, Sites::Scattered(u, v), Order::Pullback(w), gradient)
    }
}
