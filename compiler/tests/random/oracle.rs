//! A script by the interpreter: lowered, its derivatives expanded, neither inlined nor simplified otherwise.

use gml_compiler::check::{CheckOptions, check};
use gml_compiler::diff::{self, expand};
use gml_compiler::ir::interpret::{Limits, run_real};
use gml_compiler::ir::lower::lower;
use gml_compiler::ir::{FunctionId, Module};
use gml_compiler::source::{NoFiles, Sources};
use std::collections::BTreeMap;

/// The functions of a script's parts.
pub(crate) struct Oracle {
    module: Module,
    pub(crate) parts: Vec<FunctionId>,
    pub(crate) params: usize,
}

impl Oracle {
    pub(crate) fn new(text: &str) -> Result<Oracle, String> {
        let mut sources = Sources::default();
        let main = sources.add("random.gml", text);
        let (model, diagnostics) = check(&mut sources, &NoFiles, main, &BTreeMap::new(), &CheckOptions::default());
        let model = model.ok_or_else(|| format!("{diagnostics:#?}"))?;
        let lowered = lower(&model).map_err(|e| e.to_string())?;
        let (mut module, parts) = (lowered.module, lowered.parts.iter().map(|p| p.surface).collect::<Vec<_>>());
        expand(&mut module, &parts).map_err(|e| e.to_string())?;
        Ok(Oracle { module, parts, params: lowered.params.len() })
    }

    fn run(&self, function: FunctionId, args: &[f64]) -> Result<Vec<f64>, String> {
        run_real(&self.module, function, args, Limits::default()).map_err(|e| format!("interpreter: {e}"))
    }

    /// The point of a part at (x, u, v).
    pub(crate) fn point(&self, part: usize, x: &[f64], uv: [f64; 2]) -> Result<Vec<f64>, String> {
        self.run(self.parts[part], &[x, &uv].concat())
    }

    /// The functions `tangent` and `gradient` of a part, and the tangent of the gradient.
    pub(crate) fn derivatives(&mut self, part: usize) -> Result<Derivatives, String> {
        let wrt: Vec<u32> = (0..self.params as u32).collect();
        let f = self.parts[part];
        let text = |e: diff::DiffError| e.to_string();
        let tangent = diff::tangent(&mut self.module, f, &wrt).map_err(text)?;
        let gradient = diff::pullback(&mut self.module, f, &wrt, false).map_err(text)?;
        let hessian = diff::tangent(&mut self.module, gradient, &wrt).map_err(text)?;
        Ok(Derivatives { tangent, gradient, hessian })
    }

    /// The tangent of the point in the direction `dx`.
    pub(crate) fn tangent(&self, d: &Derivatives, x: &[f64], uv: [f64; 2], dx: &[f64]) -> Result<Vec<f64>, String> {
        Ok(self.run(d.tangent, &[x, &uv, dx].concat())?[3..].to_vec())
    }

    /// The gradient of w times the point.
    pub(crate) fn gradient(&self, d: &Derivatives, x: &[f64], uv: [f64; 2], w: &[f64; 3]) -> Result<Vec<f64>, String> {
        self.run(d.gradient, &[x, &uv, w].concat())
    }

    /// The Hessian of w times the point, times `dx`.
    pub(crate) fn hessian(
        &self,
        d: &Derivatives,
        (x, uv, w): (&[f64], [f64; 2], &[f64; 3]),
        dx: &[f64],
    ) -> Result<Vec<f64>, String> {
        Ok(self.run(d.hessian, &[x, &uv, w, dx].concat())?[self.params..].to_vec())
    }
}

/// Functions that are derivatives of a part.
pub(crate) struct Derivatives {
    tangent: FunctionId,
    gradient: FunctionId,
    hessian: FunctionId,
}
