//! Evaluation on grids: rows of points with the same v, columns with the same u.
//!
//! What depends on u or v alone is computed once a column or once a row, and what is left usually two points at once. The
//! values are those of the evaluation point by point, to the bit; a pullback is a sum in another order.

use super::Instance;
use super::failure::EvaluationError;
use super::grids::{Columns, GridCode, GridKernels, Inner, OnGrid, constant};
use super::instance::all_finite;
use crate::ir::magnitude::stays_finite;
use crate::jit::{Code, GridTables, Kernel, Points, products};
use std::sync::Arc;

/// An entry of a part's Jacobian dS/dx that is not zero whatever the parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JacobianEntry {
    /// By which of the model's parameters.
    pub param: u32,
    /// Of which coordinate.
    pub coordinate: u8,
    /// Its value, where it is the same everywhere.
    pub constant: Option<f64>,
}

/// Values of rows and columns as the inner kernel takes them.
struct Tables {
    rows: Vec<f64>,
    columns: Arc<Columns>,
}

impl super::Program {
    /// The entries of a part's Jacobian, by parameter and then by coordinate. [`Instance::jacobian_grid`] gives those
    /// that are not constant, in this order.
    ///
    /// # Panics
    /// If there is no such part.
    #[must_use]
    pub fn jacobian_entries(&self, patch: usize) -> Vec<JacobianEntry> {
        let part = &self.functions.parts[patch];
        let jacobian = self.functions.module.function(part.jacobian.function);
        let entry = |(k, value): (usize, &crate::ir::Value)| {
            let constant = constant(jacobian, *value);
            let (param, coordinate) = (part.jacobian.active[k / 3], (k % 3) as u8);
            (constant != Some(0.0)).then_some(JacobianEntry { param, coordinate, constant })
        };
        jacobian.results.iter().enumerate().filter_map(entry).collect()
    }
}

/// Every point of a grid, row after row.
fn every_point(u: &[f64], v: &[f64]) -> (Vec<f64>, Vec<f64>) {
    v.iter().flat_map(|v| u.iter().map(move |u| (*u, *v))).unzip()
}

impl Instance<'_> {
    /// Points of a patch at every u for every v, u running fastest: x, y, z each.
    ///
    /// # Errors
    /// As [`Instance::points`].
    ///
    /// # Panics
    /// If there is no such patch or `out` has the wrong length, as in all evaluations.
    pub fn points_grid(&self, patch: usize, u: &[f64], v: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        if self.stored_on_grid(patch, OnGrid::Points, &self.uniforms[patch], (u, v), out)? {
            return Ok(());
        }
        let (u, v) = every_point(u, v);
        self.points(patch, &u, &v, out)
    }

    /// Points with first partials, as [`Instance::partials`], at every u for every v, u running fastest.
    ///
    /// # Errors
    /// As [`Instance::points`].
    pub fn partials_grid(&self, patch: usize, u: &[f64], v: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        if self.stored_on_grid(patch, OnGrid::Partials, &self.uniforms[patch], (u, v), out)? {
            return Ok(());
        }
        let (u, v) = every_point(u, v);
        self.partials(patch, &u, &v, out)
    }

    /// dS/dx at every u for every v, u running fastest: for every point those entries of
    /// [`jacobian_entries`](super::Program::jacobian_entries) that are not constant.
    ///
    /// # Errors
    /// As [`Instance::points`].
    pub fn jacobian_grid(&self, patch: usize, u: &[f64], v: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        let uniforms = self.jacobian_uniforms(patch)?;
        if self.stored_on_grid(patch, OnGrid::Jacobian, &uniforms, (u, v), out)? {
            return Ok(());
        }
        let (u, v) = every_point(u, v);
        let part = &self.program.functions.parts[patch];
        let jacobian = self.program.functions.module.function(part.jacobian.function);
        let varies: Vec<bool> = jacobian.results.iter().map(|r| constant(jacobian, *r).is_none()).collect();
        let mut all = vec![0.0; u.len() * varies.len()];
        self.jacobian(patch, &u, &v, &mut all)?;
        let kept = all.iter().zip(varies.iter().cycle()).filter(|(_, varies)| **varies);
        out.iter_mut().zip(kept).for_each(|(out, (value, _))| *out = *value);
        Ok(())
    }

    /// Adds sum over the points of (dS/dx)^T w to `gradient`, as [`Instance::pullback`]; `w` has the weights at every u for
    /// every v, u running fastest.
    ///
    /// # Errors
    /// As [`Instance::points`]; `gradient` is then unchanged.
    pub fn pullback_grid(
        &self,
        patch: usize,
        u: &[f64],
        v: &[f64],
        w: &[[f64; 3]],
        gradient: &mut [f64],
    ) -> Result<(), EvaluationError> {
        assert_eq!(gradient.len(), self.x.len(), "an entry for every parameter");
        assert_eq!(Some(w.len()), u.len().checked_mul(v.len()), "a weight for every point");
        if w.is_empty() {
            return Ok(());
        }
        let slopes = self.slopes()?;
        if let Some(adjoints) = self.adjoints_on_grid(patch, (u, v), w)? {
            let mut sum = vec![0.0; gradient.len()];
            self.add_to_gradient(patch, &adjoints, slopes, &mut sum)?;
            if sum.iter().all(|g| g.is_finite()) {
                gradient.iter_mut().zip(sum).for_each(|(gradient, sum)| *gradient += sum);
                return Ok(());
            }
        }
        let (u, v) = every_point(u, v);
        self.pullback(patch, &u, &v, w, gradient)
    }

    /// What is made for grids.
    fn grid_code(&self, what: OnGrid) -> Result<&GridCode, EvaluationError> {
        let program = self.program;
        let code = program.grids.get(&program.functions, &program.derived, what);
        code.map_err(|e| program.too_large("evaluation on grids", e))
    }

    /// Evaluates on a grid; false where something fails or is not finite: then the evaluation point by point finds out what.
    fn stored_on_grid(
        &self,
        patch: usize,
        what: OnGrid,
        uniforms: &[f64],
        (u, v): (&[f64], &[f64]),
        out: &mut [f64],
    ) -> Result<bool, EvaluationError> {
        let grid = self.grid_code(what)?;
        let kernels = grid.of_part(patch);
        let length = u.len().checked_mul(v.len()).and_then(|n| n.checked_mul(kernels.results));
        assert_eq!(Some(out.len()), length, "length of the output");
        if out.is_empty() {
            return Ok(true);
        }
        if u.len() == 1 && kernels.in_pairs(&grid.code) {
            // Two columns at once, of which one is not wanted.
            let mut twice = vec![0.0; 2 * out.len()];
            let done = self.stored_on_grid(patch, what, uniforms, (&[u[0]; 2], v), &mut twice)?;
            let n = kernels.results;
            out.chunks_exact_mut(n)
                .zip(twice.chunks_exact(2 * n))
                .for_each(|(one, two)| one.copy_from_slice(&two[..n]));
            return Ok(done);
        }
        let Some(Tables { rows, columns }) = self.tables(&grid.code, kernels, uniforms, (u, v)) else {
            return Ok(false);
        };
        match &kernels.inner {
            Inner::Products(products) => {
                let constant = products.constant.is_some();
                products::run(products.terms.len(), constant, &rows, (&columns.values, u.len()), out);
            }
            Inner::Code(kernel) => {
                let columns = &columns.values[..];
                let tables = GridTables { row_count: v.len(), rows: &rows, column_count: u.len(), columns, w: &[] };
                if grid.code.run_grid(*kernel, uniforms, tables, out, &mut [], self.program.limits).is_err() {
                    return Ok(false);
                }
            }
        }
        // Bounds say at once what looking at every value would.
        let of_rows = magnitudes_of(&rows, kernels.row_values);
        let finite = match (&kernels.inner, &kernels.bounded) {
            (Inner::Products(products), _) => products.stay_finite(&of_rows, &columns.magnitudes),
            (Inner::Code(_), Some(inner)) => {
                let bounds = [uniforms, &of_rows, &columns.magnitudes].concat();
                stays_finite(inner, &bounds)
            }
            (Inner::Code(_), None) => false,
        };
        Ok(finite || all_finite(out))
    }

    /// Adjoints of a part's captures; nothing where something fails or is not finite.
    fn adjoints_on_grid(
        &self,
        patch: usize,
        (u, v): (&[f64], &[f64]),
        w: &[[f64; 3]],
    ) -> Result<Option<Vec<f64>>, EvaluationError> {
        let grid = self.grid_code(OnGrid::Pullback)?;
        let kernels = grid.of_part(patch);
        let (Some(adjoints), Inner::Code(kernel)) = (&kernels.adjoints, &kernels.inner) else { return Ok(None) };
        let wide = kernels.in_pairs(&grid.code);
        if wide && u.len() % 2 == 1 {
            // One more column, of no weight.
            let n = u.len();
            let padded: Vec<f64> = u.iter().chain(&u[n - 1..]).copied().collect();
            let weight = |row: &[[f64; 3]]| row.iter().copied().chain([[0.0; 3]]).collect::<Vec<_>>();
            let w: Vec<[f64; 3]> = w.chunks_exact(n).flat_map(weight).collect();
            return self.adjoints_on_grid(patch, (&padded, v), &w);
        }
        let (uniforms, limits) = (&self.uniforms[patch], self.program.limits);
        let Some(Tables { rows, columns }) = self.tables(&grid.code, kernels, uniforms, (u, v)) else {
            return Ok(None);
        };
        let [of_rows, of_columns] = [&adjoints.rows, &adjoints.columns].map(|a| a.as_ref().map_or(0, |(n, _)| *n));
        let n = adjoints.captures.len() + of_rows;
        let (mut row_sums, mut column_sums) = (vec![0.0; n * v.len()], vec![0.0; of_columns * u.len()]);
        let columns = &columns.values[..];
        let tables = GridTables { row_count: v.len(), rows: &rows, column_count: u.len(), columns, w };
        let run = grid.code.run_grid(*kernel, uniforms, tables, &mut row_sums, &mut column_sums, limits);
        if run.is_err() {
            return Ok(None);
        }
        let body = self.program.functions.parts[patch].body;
        let mut sums = vec![0.0; self.program.functions.bodies[body].varied];
        let mut weights = Vec::with_capacity(of_rows * v.len());
        for row in row_sums.chunks_exact(n.max(1)) {
            let (captures, values) = row.split_at(adjoints.captures.len());
            adjoints.captures.iter().zip(captures).for_each(|(c, sum)| sums[*c as usize] += sum);
            weights.extend_from_slice(values);
        }
        let mut pull = |kernel: Kernel, at: &[f64], w: &[f64]| {
            grid.code.run(kernel, uniforms, Points { u: at, v: at, w }, &mut sums, limits).is_ok()
        };
        let mut done = true;
        if let Some((_, kernel)) = adjoints.rows {
            done &= pull(kernel, v, &weights);
        }
        if let Some((_, kernel)) = adjoints.columns {
            if wide {
                column_sums = unpaired(&column_sums, of_columns);
            }
            done &= pull(kernel, u, &column_sums);
        }
        Ok((done && sums.iter().all(|a| a.is_finite())).then_some(sums))
    }

    /// The values of rows and columns; nothing where something fails.
    fn tables(&self, code: &Code, kernels: &GridKernels, uniforms: &[f64], (u, v): (&[f64], &[f64])) -> Option<Tables> {
        let rows = self.row_values(code, kernels, uniforms, v)?;
        let last = kernels.kept.try_lock().ok().map(|last| last.clone());
        let used: Vec<f64> = kernels.column_uniforms.iter().map(|p| uniforms[*p]).collect();
        if let Some(last) = last.filter(|last| same_bits(&last.u, u) && same_bits(&last.uniforms, &used)) {
            return Some(Tables { rows, columns: last });
        }
        let mut values = vec![0.0; kernels.column_values * u.len()];
        code.run(kernels.columns, uniforms, Points { u, v: u, w: &[] }, &mut values, self.program.limits).ok()?;
        let magnitudes = magnitudes_of(&values, kernels.column_values);
        if let Inner::Products(products) = &kernels.inner {
            let terms = products.terms.iter().map(|(column, _)| *column);
            values = products::blocks_of_columns(terms, &values, kernels.column_values);
        } else if kernels.in_pairs(code) {
            values = paired(&values, kernels.column_values);
        }
        let columns = Arc::new(Columns { u: u.to_vec(), uniforms: used, values, magnitudes });
        if let Ok(mut last) = kernels.kept.try_lock() {
            *last = columns.clone();
        }
        Some(Tables { rows, columns })
    }

    /// The values of rows; nothing where something fails.
    fn row_values(&self, code: &Code, kernels: &GridKernels, uniforms: &[f64], v: &[f64]) -> Option<Vec<f64>> {
        // Two rows at once are two at least.
        let twice = v.len() == 1 && code.is_wide(kernels.rows);
        let v = if twice { &[v[0]; 2][..] } else { v };
        let mut values = vec![0.0; kernels.row_values * v.len()];
        if values.is_empty() {
            return Some(values);
        }
        let pairs = (code.is_wide(kernels.rows) && v.len() % 2 == 1).then(|| paired(v, 1));
        let columns = pairs.as_deref().unwrap_or(v);
        // Any u: these values do not depend on it.
        let tables = GridTables { row_count: 1, rows: &[0.0], column_count: v.len(), columns, w: &[] };
        code.run_grid(kernels.rows, uniforms, tables, &mut values, &mut [], self.program.limits).ok()?;
        values.truncate(if twice { kernels.row_values } else { values.len() });
        Some(values)
    }
}

/// Whether numbers are the same, zeros by their signs.
fn same_bits(a: &[f64], b: &[f64]) -> bool {
    a.iter().map(|x| x.to_bits()).eq(b.iter().map(|x| x.to_bits()))
}

/// The sum of the magnitudes of each value in a table: a bound of them, and quickly had. NaN where one is.
fn magnitudes_of(table: &[f64], values: usize) -> Vec<f64> {
    let mut sums = vec![0.0; values];
    for group in table.chunks_exact(values.max(1)) {
        sums.iter_mut().zip(group).for_each(|(sum, x): (&mut f64, &f64)| *sum += x.abs());
    }
    sums
}

/// Values of columns, one column after the other, by pairs of columns: both of each value. The last pair of an odd number is of the last
/// two.
fn paired(columns: &[f64], values: usize) -> Vec<f64> {
    if values == 0 {
        return Vec::new();
    }
    let count = columns.len() / values;
    let mut pairs = Vec::with_capacity(count.next_multiple_of(2) * values);
    for first in (0..count).step_by(2) {
        let first = first.min(count - 2) * values;
        let (a, b) = (&columns[first..first + values], &columns[first + values..first + 2 * values]);
        pairs.extend(a.iter().zip(b).flat_map(|(a, b)| [*a, *b]));
    }
    pairs
}

/// The reverse, for an even number of columns.
fn unpaired(pairs: &[f64], values: usize) -> Vec<f64> {
    let lane = |pair: &[f64], lane: usize| pair.iter().skip(lane).step_by(2).copied().collect::<Vec<_>>();
    pairs.chunks_exact(2 * values.max(1)).flat_map(|pair| [lane(pair, 0), lane(pair, 1)].concat()).collect()
}
