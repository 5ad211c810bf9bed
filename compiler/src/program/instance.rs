//! A model at certain parameters.

use super::Program;
use super::derivatives::SlopeValue;
use super::failure::{EvaluationError, Place};
use super::on_demand::Derivative;
use crate::ir::{FunctionId, Module};
use crate::jit::{Code, Kernel, Points};
use std::sync::OnceLock;

/// A model at certain parameters: patches that are evaluated in batches. Batches may be evaluated by several threads at
/// once. `u`, `v` and the output have one entry a point.
pub struct Instance<'p> {
    pub(super) program: &'p Program,
    pub(super) x: Vec<f64>,
    pub(super) captures: Vec<f64>,
    /// Every part's captures, in its order.
    pub(super) uniforms: Vec<Vec<f64>>,
    slopes: OnceLock<Result<Vec<f64>, EvaluationError>>,
}

/// A function at the points of a part, as machine code.
struct Evaluator<'p> {
    module: &'p Module,
    function: FunctionId,
    code: &'p Code,
    kernel: Kernel,
    /// Numbers a point.
    results: usize,
}

impl<'p> Instance<'p> {
    pub(super) fn new(program: &'p Program, x: &[f64]) -> Result<Instance<'p>, EvaluationError> {
        assert_eq!(x.len(), program.parameters.len(), "a value for every parameter");
        program.check_requires(x)?;
        let captures =
            program.kernels.captures(x, program.limits).map_err(|stop| program.stopped(stop, &Place::of_model(x)))?;
        let gather = |indices: &[u32]| indices.iter().map(|c| captures[*c as usize]).collect();
        let uniforms = program.functions.parts.iter().map(|p| gather(&p.captures)).collect();
        Ok(Instance { program, x: x.to_vec(), captures, uniforms, slopes: OnceLock::new() })
    }

    /// The parameters.
    #[must_use]
    pub fn x(&self) -> &[f64] {
        &self.x
    }

    /// Points of a patch: x, y, z each.
    ///
    /// # Errors
    /// A failure of the script, a limit, or a value that is not finite.
    ///
    /// # Panics
    /// If there is no such patch or a slice has the wrong length, as in all evaluations.
    pub fn points(&self, patch: usize, u: &[f64], v: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        let Program { functions, kernels, .. } = self.program;
        let body = functions.parts[patch].body;
        let (function, (code, kernel)) = (functions.bodies[body].points, kernels.points(body));
        let evaluator = Evaluator { module: &functions.module, function, code, kernel, results: 3 };
        self.batch(patch, &evaluator, &self.uniforms[patch], (u, v), out)
    }

    /// Points with first partials: point, dS/du, dS/dv.
    ///
    /// # Errors
    /// As [`Instance::points`].
    pub fn partials(&self, patch: usize, u: &[f64], v: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        self.batch(patch, &self.derived(patch, Derivative::Partials, 9)?, &self.uniforms[patch], (u, v), out)
    }

    /// Points with first and second partials: point, dS/du, dS/dv, d2S/du2, d2S/du dv, d2S/dv2.
    ///
    /// # Errors
    /// As [`Instance::points`].
    pub fn second_partials(&self, patch: usize, u: &[f64], v: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        self.batch(patch, &self.derived(patch, Derivative::SecondPartials, 18)?, &self.uniforms[patch], (u, v), out)
    }

    /// dS/dx over the patch's active parameters: for every point, for every active parameter, three coordinates.
    ///
    /// # Errors
    /// As [`Instance::points`].
    pub fn jacobian(&self, patch: usize, u: &[f64], v: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        let Program { functions, kernels, .. } = self.program;
        let part = &functions.parts[patch];
        let uniforms = self.jacobian_uniforms(patch)?;
        let (code, kernel) = kernels.jacobian(patch);
        let results = 3 * part.jacobian.active.len();
        let evaluator =
            Evaluator { module: &functions.module, function: part.jacobian.function, code, kernel, results };
        self.batch(patch, &evaluator, &uniforms, (u, v), out)
    }

    /// Adds sum over the points of (dS/dx)^T w to `gradient`, which has an entry for every parameter of the model.
    ///
    /// # Errors
    /// As [`Instance::points`]; `gradient` is then unchanged.
    pub fn pullback(
        &self,
        patch: usize,
        u: &[f64],
        v: &[f64],
        w: &[[f64; 3]],
        gradient: &mut [f64],
    ) -> Result<(), EvaluationError> {
        assert_eq!(gradient.len(), self.x.len(), "an entry for every parameter");
        let part = &self.program.functions.parts[patch];
        let varied = self.program.functions.bodies[part.body].varied;
        let pullback = self.derived(patch, Derivative::Pullback, varied)?;
        let uniforms = &self.uniforms[patch];
        let slopes = self.slopes()?;
        let run = |points: Points<'_>| {
            let mut adjoints = vec![0.0; varied];
            let run = pullback.code.run(pullback.kernel, uniforms, points, &mut adjoints, self.program.limits);
            run.map(|()| adjoints)
        };
        let adjoints = run(Points { u, v, w: w.as_flattened() }).map_err(|stopped| {
            let at = Some([u[stopped.point], v[stopped.point]]);
            self.program.stopped(stopped.stop, &Place::of_part(&self.x, patch, at))
        })?;
        let mut sum = vec![0.0; gradient.len()];
        if adjoints.iter().all(|a| a.is_finite()) {
            self.add_to_gradient(patch, &adjoints, slopes, &mut sum)?;
        } else {
            for i in 0..u.len() {
                let points = Points { u: &u[i..=i], v: &v[i..=i], w: w[i..=i].as_flattened() };
                match run(points) {
                    Ok(adjoints) if adjoints.iter().all(|a| a.is_finite()) => {
                        self.add_to_gradient(patch, &adjoints, slopes, &mut sum)?;
                    }
                    _ => self.add_transposed(patch, [u[i], v[i]], w[i], &mut sum)?,
                }
            }
        }
        if !sum.iter().all(|g| g.is_finite()) {
            return Err(self.overflow(patch));
        }
        gradient.iter_mut().zip(sum).for_each(|(gradient, sum)| *gradient += sum);
        Ok(())
    }

    /// Adds (dS/dx)^T w of one point by the derivative forward. In reverse a pole gives an infinite adjoint, even where
    /// the tangents that arrive there are zero, so that the derivative is too; what is infinite forward is an error.
    fn add_transposed(
        &self,
        patch: usize,
        [u, v]: [f64; 2],
        w: [f64; 3],
        sum: &mut [f64],
    ) -> Result<(), EvaluationError> {
        let active = &self.program.parts[patch].active;
        let mut jacobian = vec![0.0; 3 * active.len()];
        self.jacobian(patch, &[u], &[v], &mut jacobian)?;
        for (param, d) in active.iter().zip(jacobian.chunks_exact(3)) {
            sum[*param as usize] += d[0] * w[0] + d[1] * w[1] + d[2] * w[2];
        }
        Ok(())
    }

    /// Adds what the adjoints of a part's captures contribute.
    ///
    /// # Errors
    /// Where a capture that matters has no finite derivative.
    pub(super) fn add_to_gradient(
        &self,
        patch: usize,
        adjoints: &[f64],
        slopes: &[f64],
        gradient: &mut [f64],
    ) -> Result<(), EvaluationError> {
        for slope in &self.program.functions.parts[patch].slopes {
            let value = match slope.value {
                SlopeValue::Constant(x) => x,
                SlopeValue::Computed(k) => slopes[k as usize],
            };
            let adjoint = adjoints[slope.position as usize];
            if !value.is_finite() && adjoint != 0.0 {
                return Err(self.slope_not_finite(patch));
            }
            gradient[slope.param as usize] += if adjoint == 0.0 { 0.0 } else { adjoint * value };
        }
        Ok(())
    }

    /// What a part's Jacobian takes beside u and v.
    pub(super) fn jacobian_uniforms(&self, patch: usize) -> Result<Vec<f64>, EvaluationError> {
        let slopes = self.slopes()?;
        let own = self.program.functions.parts[patch].jacobian.slopes.iter().map(|k| slopes[*k as usize]);
        Ok(self.uniforms[patch].iter().copied().chain(own).collect())
    }

    /// The derivatives of captures by parameters, computed when first needed.
    pub(super) fn slopes(&self) -> Result<&[f64], EvaluationError> {
        let program = self.program;
        let compute = || {
            let call = program.kernels.slopes(&self.x, program.limits);
            call.map_err(|stop| program.stopped(stop, &Place::of_model(&self.x)))
        };
        self.slopes.get_or_init(compute).as_deref().map_err(Clone::clone)
    }

    /// Whether the point itself is finite.
    pub(super) fn is_finite_at(&self, patch: usize, [u, v]: [f64; 2]) -> bool {
        let program = self.program;
        let mut point = [0.0; 3];
        let points = Points { u: &[u], v: &[v], w: &[] };
        let (code, kernel) = program.kernels.points(program.functions.parts[patch].body);
        let run = code.run(kernel, &self.uniforms[patch], points, &mut point, program.limits);
        run.is_ok() && all_finite(&point)
    }

    /// A derivative of a part's body, which is made if it is not there yet.
    fn derived(&self, patch: usize, derivative: Derivative, results: usize) -> Result<Evaluator<'p>, EvaluationError> {
        let program = self.program;
        let derived = program.derived.get(&program.functions, derivative);
        let derived = derived.map_err(|e| program.not_made(derivative, e))?;
        let body = program.functions.parts[patch].body;
        let (function, (code, kernel)) = (derived.functions[body], derived.kernels.kernel(body));
        Ok(Evaluator { module: &derived.module, function, code, kernel, results })
    }

    /// Runs a kernel and looks for what is not finite in its output.
    fn batch(
        &self,
        patch: usize,
        evaluator: &Evaluator<'_>,
        uniforms: &[f64],
        (u, v): (&[f64], &[f64]),
        out: &mut [f64],
    ) -> Result<(), EvaluationError> {
        let program = self.program;
        let points = Points { u, v, w: &[] };
        evaluator.code.run(evaluator.kernel, uniforms, points, out, program.limits).map_err(|stopped| {
            let at = Some([u[stopped.point], v[stopped.point]]);
            program.stopped(stopped.stop, &Place::of_part(&self.x, patch, at))
        })?;
        if all_finite(out) {
            return Ok(());
        }
        let i = out.iter().position(|x| !x.is_finite()).unwrap_or(0) / evaluator.results;
        let arguments: Vec<f64> = uniforms.iter().chain([&u[i], &v[i]]).copied().collect();
        Err(self.not_finite(patch, (evaluator.module, evaluator.function), &arguments, [u[i], v[i]]))
    }
}

/// Whether no value is infinite or NaN: by integers, which the compiler makes into wide instructions.
pub(super) fn all_finite(values: &[f64]) -> bool {
    const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
    values.chunks(256).all(|chunk| !chunk.iter().fold(false, |any, x| any | (x.to_bits() & EXPONENT == EXPONENT)))
}
