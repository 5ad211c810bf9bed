//! A script in the interpreter: lowered, with its derivatives expanded, and neither inlined nor simplified.

use gml_compiler::check::CheckOptions;
use gml_compiler::internals::diff::{self, expand};
use gml_compiler::internals::ir::interpret::{Limits, run_real};
use gml_compiler::internals::ir::lower::lower;
use gml_compiler::internals::ir::{FunctionId, LoweredPart, Module, ParameterFunction};
use gml_compiler::program::check;
use gml_compiler::source::{NoFiles, Sources};
use std::collections::BTreeMap;

/// The functions of a script's parts. Each function takes the parameters that it uses; arguments and results of the
/// methods are for all parameters.
pub(crate) struct Oracle {
    module: Module,
    pub(crate) parts: Vec<LoweredPart>,
    pub(crate) params: usize,
}

impl Oracle {
    pub(crate) fn new(text: &str) -> Result<Oracle, String> {
        let mut sources = Sources::default();
        let main = sources.add("random.gml", text);
        let (model, diagnostics) = check(&mut sources, &NoFiles, main, &BTreeMap::new(), &CheckOptions::default());
        let model = model.ok_or_else(|| format!("{diagnostics:#?}"))?;
        let lowered = lower(&model).map_err(|e| e.to_string())?;
        let mut module = lowered.module;
        let surfaces: Vec<FunctionId> = lowered.parts.iter().map(|p| p.surface.function).collect();
        expand(&mut module, &surfaces).map_err(|e| e.to_string())?;
        Ok(Oracle { module, parts: lowered.parts, params: model.params.len() })
    }

    fn run(&self, function: FunctionId, args: &[f64]) -> Result<Vec<f64>, String> {
        run_real(&self.module, function, args, Limits::default()).map_err(|e| format!("interpreter: {e}"))
    }

    /// The point of a part at (x, u, v).
    pub(crate) fn point(&self, part: usize, x: &[f64], uv: [f64; 2]) -> Result<Vec<f64>, String> {
        let surface = &self.parts[part].surface;
        self.run(surface.function, &surface.arguments(x, &uv))
    }

    /// The functions `tangent` and `gradient` of a part, and the tangent of the gradient.
    pub(crate) fn derivatives(&mut self, part: usize) -> Result<Derivatives, String> {
        let ParameterFunction { function: f, params } = self.parts[part].surface.clone();
        let wrt: Vec<u32> = (0..params.len() as u32).collect();
        let text = |e: diff::DiffError| e.to_string();
        let tangent = diff::tangent(&mut self.module, f, &wrt).map_err(text)?;
        let gradient = diff::pullback(&mut self.module, f, &wrt, false).map_err(text)?;
        let hessian = diff::tangent(&mut self.module, gradient, &wrt).map_err(text)?;
        Ok(Derivatives { params, tangent, gradient, hessian })
    }

    /// The tangent of the point in the direction `dx`.
    pub(crate) fn tangent(&self, d: &Derivatives, x: &[f64], uv: [f64; 2], dx: &[f64]) -> Result<Vec<f64>, String> {
        Ok(self.run(d.tangent, &[&d.of(x)[..], &uv, &d.of(dx)].concat())?[3..].to_vec())
    }

    /// The gradient of w times the point.
    pub(crate) fn gradient(&self, d: &Derivatives, x: &[f64], uv: [f64; 2], w: &[f64; 3]) -> Result<Vec<f64>, String> {
        Ok(self.of_all(d, &self.run(d.gradient, &[&d.of(x)[..], &uv, w].concat())?))
    }

    /// The Hessian of w times the point, times `dx`.
    pub(crate) fn hessian(
        &self,
        d: &Derivatives,
        (x, uv, w): (&[f64], [f64; 2], &[f64; 3]),
        dx: &[f64],
    ) -> Result<Vec<f64>, String> {
        let results = self.run(d.hessian, &[&d.of(x)[..], &uv, w, &d.of(dx)].concat())?;
        Ok(self.of_all(d, &results[d.params.len()..]))
    }

    /// Values for the parameters that a part uses, extended by zeros for the others.
    fn of_all(&self, d: &Derivatives, used: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; self.params];
        d.params.iter().zip(used).for_each(|(i, x)| all[*i as usize] = *x);
        all
    }
}

/// Functions that are derivatives of a part.
pub(crate) struct Derivatives {
    /// The parameters that the part uses.
    params: Vec<u32>,
    tangent: FunctionId,
    gradient: FunctionId,
    hessian: FunctionId,
}

impl Derivatives {
    /// The values for the parameters that the part uses.
    fn of(&self, all: &[f64]) -> Vec<f64> {
        self.params.iter().map(|i| all[*i as usize]).collect()
    }
}
