//! A model at certain parameters.

use super::evaluators::Evaluator;
use super::failure::{EvaluationError, Place};
use super::functions::{EntryValue, PRELUDE, PRELUDE_JACOBIAN};
use super::{Order, Program, Sites};
use crate::jit::{Points, Stopped};
use std::sync::OnceLock;

/// Points that are evaluated, and checked, before the next ones, so that their results stay in the processor's cache.
const BATCH: usize = 256;

/// A model at certain parameters, whose patches are evaluated in batches, by several threads at once if need be.
pub struct Instance<'p> {
    pub(super) program: &'p Program,
    pub(super) x: Vec<f64>,
    /// Results of the prelude.
    pub(super) captures: Vec<f64>,
    /// The captures of every part, in its order.
    part_captures: Vec<Vec<f64>>,
    prelude_jacobian: OnceLock<Result<Vec<f64>, EvaluationError>>,
}

impl<'p> Instance<'p> {
    pub(super) fn new(program: &'p Program, x: &[f64]) -> Result<Instance<'p>, EvaluationError> {
        assert_eq!(x.len(), program.parameters.len(), "a value for every parameter");
        program.check_requires(x)?;
        let captures = program.routines.call_reals(PRELUDE, x, program.limits);
        let captures = captures.map_err(|trap| program.trapped(trap, &Place::of_model(x)))?;
        let gather = |indices: &[u32]| indices.iter().map(|c| captures[*c as usize]).collect();
        let part_captures = program.functions.parts.iter().map(|p| gather(&p.captures)).collect();
        Ok(Instance { program, x: x.to_vec(), captures, part_captures, prelude_jacobian: OnceLock::new() })
    }

    /// The parameters.
    #[must_use]
    pub fn x(&self) -> &[f64] {
        &self.x
    }

    /// Evaluates a patch: `out` has [`Order::width`] numbers for every site, one site after the other; or, for a
    /// pullback, an entry for every parameter of the model, to which it adds.
    ///
    /// # Errors
    /// A failure of the script, a limit, or a value that is not finite. `out` may be written in part; of a pullback it
    /// is unchanged.
    ///
    /// # Panics
    /// If there is no such patch or a slice has the wrong length.
    pub fn evaluate(
        &self,
        patch: usize,
        sites: Sites<'_>,
        order: Order<'_>,
        out: &mut [f64],
    ) -> Result<(), EvaluationError> {
        match (sites, order) {
            (Sites::Scattered(u, v), Order::Pullback(w)) => self.pull_back(patch, [u, v], w, out),
            (Sites::Scattered(u, v), _) => self.evaluate_scattered(patch, [u, v], order, out),
            (Sites::Grid(u, v), _) => {
                if !matches!(order, Order::Pullback(_)) && self.evaluate_grid(patch, [u, v], order, out)? {
                    return Ok(());
                }
                let (u, v) = sites.expanded();
                self.evaluate(patch, Sites::Scattered(&u, &v), order, out)
            }
        }
    }

    fn evaluate_scattered(
        &self,
        patch: usize,
        [u, v]: [&[f64]; 2],
        order: Order<'_>,
        out: &mut [f64],
    ) -> Result<(), EvaluationError> {
        let program = self.program;
        let evaluator = self.evaluator(false, order)?;
        let captures = self.captures_of(patch, order)?;
        let width = order.width(&program.patches[patch]);
        assert_eq!(v.len(), u.len(), "length of v");
        assert_eq!(Some(out.len()), u.len().checked_mul(width), "length of the output");
        let kernel = evaluator.of_part[patch];
        for ((u, v), out) in u.chunks(BATCH).zip(v.chunks(BATCH)).zip(out.chunks_mut((BATCH * width).max(1))) {
            let points = Points { count: u.len(), values: &[u, v].concat() };
            let run = evaluator.run(kernel, &captures, points, out, program.limits);
            run.map_err(|stopped| self.stopped(patch, stopped, [u, v]))?;
            if let Some(k) = first_not_finite(out) {
                let [u, v] = [u, v].map(|at| at[k / width]);
                let arguments: Vec<f64> = captures.iter().copied().chain([u, v]).collect();
                return Err(self.not_finite(patch, evaluator, &arguments, [u, v]));
            }
        }
        Ok(())
    }

    /// Evaluates values of rows and of columns once each, and the rest at every point: the operations, and so the bits,
    /// of the evaluation point by point. False where something fails or is not finite: that evaluation then gives the
    /// error.
    fn evaluate_grid(
        &self,
        patch: usize,
        [u, v]: [&[f64]; 2],
        order: Order<'_>,
        out: &mut [f64],
    ) -> Result<bool, EvaluationError> {
        let evaluator = self.evaluator(true, order)?;
        let mut captures = self.captures_of(patch, order)?;
        let width = order.width(&self.program.patches[patch]);
        let length = u.len().checked_mul(v.len()).and_then(|n| n.checked_mul(width));
        assert_eq!(Some(out.len()), length, "length of the output");
        if out.is_empty() {
            return Ok(true);
        }
        let (limits, function) = (self.program.limits, evaluator.of_part[patch]);
        let [columns, rows, inner] = [0, 1, 2].map(|stage| 3 * function + stage);
        let split = &evaluator.splits[function];
        let table = |kernel: usize, width: usize, at: &[f64]| -> Option<Vec<f64>> {
            let mut values = vec![0.0; width * at.len()];
            let points = Points { count: at.len(), values: &[at, at].concat() };
            evaluator.run(kernel, &captures, points, &mut values, limits).ok()?;
            Some(values)
        };
        let Some(by_column) = table(columns, split.column_values, u) else { return Ok(false) };
        let Some(by_row) = table(rows, split.row_values, v) else { return Ok(false) };
        let value = |k: usize| by_column.iter().skip(k).step_by(split.column_values);
        let values: Vec<f64> = (0..split.column_values).flat_map(value).copied().collect();
        let of_part = captures.len();
        captures.resize(of_part + split.row_values, 0.0);
        for (row, out) in out.chunks_exact_mut(u.len() * width).enumerate() {
            captures[of_part..].copy_from_slice(&by_row[row * split.row_values..][..split.row_values]);
            let points = Points { count: u.len(), values: &values };
            if evaluator.run(inner, &captures, points, out, limits).is_err() || first_not_finite(out).is_some() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Adds sum over the points of (dS/dx)^T w to `gradient`.
    fn pull_back(
        &self,
        patch: usize,
        [u, v]: [&[f64]; 2],
        w: &[[f64; 3]],
        gradient: &mut [f64],
    ) -> Result<(), EvaluationError> {
        let (program, order) = (self.program, Order::Pullback(w));
        assert_eq!((v.len(), w.len()), (u.len(), u.len()), "lengths of v and w");
        assert_eq!(gradient.len(), self.x.len(), "an entry for every parameter");
        let evaluator = self.evaluator(false, order)?;
        let captures = self.captures_of(patch, order)?;
        let prelude_jacobian = self.prelude_jacobian()?;
        let varied = program.functions.bodies[program.functions.parts[patch].body].varied;
        let run = |sites: std::ops::Range<usize>| {
            let weights = (0..3).flat_map(|c| w[sites.clone()].iter().map(move |w| w[c]));
            let values: Vec<f64> = [&u[sites.clone()], &v[sites.clone()]].concat().into_iter().chain(weights).collect();
            let points = Points { count: sites.len(), values: &values };
            let mut adjoints = vec![0.0; varied];
            let run = evaluator.run(evaluator.of_part[patch], &captures, points, &mut adjoints, program.limits);
            run.map(|()| adjoints)
        };
        let adjoints = run(0..u.len()).map_err(|stopped| self.stopped(patch, stopped, [u, v]))?;
        let mut sum = vec![0.0; gradient.len()];
        if first_not_finite(&adjoints).is_none() {
            self.add_to_gradient(patch, &adjoints, prelude_jacobian, &mut sum)?;
        } else {
            for i in 0..u.len() {
                match run(i..i + 1) {
                    Ok(adjoints) if first_not_finite(&adjoints).is_none() => {
                        self.add_to_gradient(patch, &adjoints, prelude_jacobian, &mut sum)?;
                    }
                    _ => self.add_transposed(patch, [u[i], v[i]], w[i], &mut sum)?,
                }
            }
        }
        if first_not_finite(&sum).is_some() {
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
        let active = &self.program.patches[patch].active;
        let mut jacobian = vec![0.0; 3 * active.len()];
        self.evaluate(patch, Sites::Scattered(&[u], &[v]), Order::Jacobian, &mut jacobian)?;
        for (param, d) in active.iter().zip(jacobian.chunks_exact(3)) {
            sum[*param as usize] += d[0] * w[0] + d[1] * w[1] + d[2] * w[2];
        }
        Ok(())
    }

    /// Adds what the adjoints of a part's captures contribute.
    ///
    /// # Errors
    /// If a capture that matters has no finite derivative.
    fn add_to_gradient(
        &self,
        patch: usize,
        adjoints: &[f64],
        prelude_jacobian: &[f64],
        gradient: &mut [f64],
    ) -> Result<(), EvaluationError> {
        for entry in &self.program.functions.parts[patch].entries {
            let value = match entry.value {
                EntryValue::Constant(x) => x,
                EntryValue::Computed(k) => prelude_jacobian[k as usize],
            };
            let adjoint = adjoints[entry.capture as usize];
            if !value.is_finite() && adjoint != 0.0 {
                return Err(self.capture_not_differentiable(patch));
            }
            gradient[entry.param as usize] += if adjoint == 0.0 { 0.0 } else { adjoint * value };
        }
        Ok(())
    }

    /// The code for an order, which is made if it is not there yet.
    fn evaluator(&self, on_grid: bool, order: Order<'_>) -> Result<&'p Evaluator, EvaluationError> {
        let program = self.program;
        program.evaluators.get(&program.functions, on_grid, order).map_err(|e| program.not_made(on_grid, order, e))
    }

    /// The arguments of an order's function before u and v: captures, and for the Jacobian entries of the prelude's.
    fn captures_of(&self, patch: usize, order: Order<'_>) -> Result<Vec<f64>, EvaluationError> {
        let mut captures = self.part_captures[patch].clone();
        if let Order::Jacobian = order {
            let all = self.prelude_jacobian()?;
            captures.extend(self.program.functions.parts[patch].jacobian.entries.iter().map(|k| all[*k as usize]));
        }
        Ok(captures)
    }

    /// The derivatives of captures by parameters, computed when first needed.
    pub(super) fn prelude_jacobian(&self) -> Result<&[f64], EvaluationError> {
        let program = self.program;
        let compute = || {
            let call = program.routines.call_reals(PRELUDE_JACOBIAN, &self.x, program.limits);
            call.map_err(|trap| program.trapped(trap, &Place::of_model(&self.x)))
        };
        self.prelude_jacobian.get_or_init(compute).as_deref().map_err(Clone::clone)
    }

    /// Whether the point itself is finite.
    pub(super) fn is_finite_at(&self, patch: usize, uv: [f64; 2]) -> bool {
        let (Ok(evaluator), mut point) = (self.evaluator(false, Order::Points), [0.0; 3]) else { return false };
        let (kernel, captures) = (evaluator.of_part[patch], &self.part_captures[patch]);
        let points = Points { count: 1, values: &uv };
        let run = evaluator.run(kernel, captures, points, &mut point, self.program.limits);
        run.is_ok() && first_not_finite(&point).is_none()
    }

    /// The error for code that stopped early at one of some points.
    fn stopped(&self, patch: usize, Stopped { trap, point }: Stopped, at: [&[f64]; 2]) -> EvaluationError {
        self.program.trapped(trap, &Place::of_part(&self.x, patch, Some(at.map(|values| values[point]))))
    }
}

/// The first value that is infinite or NaN. Whether there is one is found by integers, for which there are vector
/// instructions.
fn first_not_finite(values: &[f64]) -> Option<usize> {
    const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
    let any = |chunk: &[f64]| chunk.iter().fold(false, |any, x| any | (x.to_bits() & EXPONENT == EXPONENT));
    if !values.chunks(256).any(any) {
        return None;
    }
    values.iter().position(|x| !x.is_finite())
}
