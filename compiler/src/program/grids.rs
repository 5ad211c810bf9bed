//! Machine code that evaluates parts on grids, made when it is first asked for.

use super::compile::BuildError;
use super::derivatives::ModelFunctions;
use super::kernels::OPTIONS;
use super::on_demand::{Derivative, OnDemand};
use crate::diff;
use crate::ir::hash::HashMap;
use crate::ir::hoist::grid::{GridSplit, split_grid};
use crate::ir::magnitude::is_bounded;
use crate::ir::products::Products;
use crate::ir::{Function, FunctionId, Module, Op, Value};
use crate::jit::{Code, Compiler, GridKernel, GridShape, Kernel, KernelShape, Listing, Options, Output};
use std::sync::{Arc, Mutex, OnceLock};

/// What is computed on a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OnGrid {
    Points,
    Partials,
    /// The entries of the Jacobian that are not constant.
    Jacobian,
    Pullback,
}

impl OnGrid {
    /// All of them, as people call them.
    pub(super) const ALL: [(OnGrid, &'static str); 4] = [
        (OnGrid::Points, "points"),
        (OnGrid::Partials, "partials"),
        (OnGrid::Jacobian, "jacobian"),
        (OnGrid::Pullback, "pullback"),
    ];
}

/// What was asked for. Several threads may ask at once; one of them makes it.
#[derive(Default)]
pub(super) struct Grids {
    made: [OnceLock<Result<GridCode, BuildError>>; 4],
}

/// Kernels over grids.
pub(super) struct GridCode {
    pub(super) code: Code,
    kernels: Vec<GridKernels>,
    /// Which of them each part has.
    of_part: Vec<usize>,
}

/// Kernels of a function of points.
pub(super) struct GridKernels {
    /// `(uniforms.., u, v) -> values..` of a column.
    pub(super) columns: Kernel,
    pub(super) column_values: usize,
    /// `(uniforms.., u, v) -> values..` of a row: over a grid of one u, as there may be two rows at once.
    pub(super) rows: GridKernel,
    pub(super) row_values: usize,
    pub(super) inner: Inner,
    /// Results of the inner stage.
    pub(super) results: usize,
    /// The inner stage, where bounds of its values can be had from its tables.
    pub(super) bounded: Option<Function>,
    /// Which uniforms the values of columns depend on: often none, or constants of the script.
    pub(super) column_uniforms: Vec<usize>,
    /// The last values of columns that were computed.
    pub(super) kept: Kept,
    /// Of a pullback.
    pub(super) adjoints: Option<Adjoints>,
}

/// What is done at every point.
pub(super) enum Inner {
    /// Code for it.
    Code(GridKernel),
    /// Sums of products, which need none.
    Products(Products),
}

impl GridKernels {
    /// The code of the inner stage, if it takes two columns at once.
    pub(super) fn in_pairs(&self, code: &Code) -> bool {
        matches!(self.inner, Inner::Code(kernel) if code.is_wide(kernel))
    }
}

/// Values of columns as the inner stage takes them.
#[derive(Default)]
pub(super) struct Columns {
    /// Where they are.
    pub(super) u: Vec<f64>,
    /// The values of the uniforms that they depend on.
    pub(super) uniforms: Vec<f64>,
    pub(super) values: Vec<f64>,
    /// A bound of the magnitude of each value.
    pub(super) magnitudes: Vec<f64>,
}

/// The last columns: grids stay while parameters change. Whoever comes while another looks computes them itself.
pub(super) type Kept = Mutex<Arc<Columns>>;

/// What the sums of a pullback's inner stage are, and how they go on.
pub(super) struct Adjoints {
    /// The first row sums are the adjoints of these captures.
    pub(super) captures: Vec<u32>,
    /// The others are the adjoints of values of the row: of so many; and from these to the adjoints of captures.
    pub(super) rows: Option<(usize, Kernel)>,
    /// Likewise the column sums.
    pub(super) columns: Option<(usize, Kernel)>,
}

impl GridCode {
    pub(super) fn of_part(&self, part: usize) -> &GridKernels {
        &self.kernels[self.of_part[part]]
    }
}

impl Grids {
    pub(super) fn get(
        &self,
        functions: &ModelFunctions,
        derived: &OnDemand,
        what: OnGrid,
    ) -> Result<&GridCode, &BuildError> {
        self.made[what as usize].get_or_init(|| Ok(make(functions, derived, what, OPTIONS)?.0)).as_ref()
    }
}

impl Grids {
    /// The text of the code.
    pub(super) fn listings(
        functions: &ModelFunctions,
        derived: &OnDemand,
        what: OnGrid,
    ) -> Result<Vec<Listing>, BuildError> {
        Ok(make(functions, derived, what, Options { listings: true, ..OPTIONS })?.1)
    }
}

/// A function of points, and how many uniforms it takes.
type Whole = (FunctionId, usize);

/// The functions that a function of points is divided into.
struct Staged {
    uniforms: usize,
    stages: GridSplit,
    /// Of points that are sums of products: these, and the function of their factors.
    products: Option<(Products, FunctionId)>,
    /// Of a pullback.
    pulled: Option<Pulled>,
}

fn staged(
    functions: &ModelFunctions,
    derived: &OnDemand,
    what: OnGrid,
) -> Result<(Module, Vec<Staged>, Vec<usize>), BuildError> {
    let (mut module, wholes, of_part) = wholes(functions, derived, what)?;
    let mut all = Vec::new();
    for (i, (function, uniforms)) in wholes.into_iter().enumerate() {
        let stages = split_grid(&mut module, function, uniforms);
        let pulled = match what {
            OnGrid::Pullback => Some(pull_back(&mut module, stages, uniforms, functions.bodies[i].varied)?),
            OnGrid::Points | OnGrid::Partials | OnGrid::Jacobian => None,
        };
        let products = match what {
            OnGrid::Points => Products::of(module.function(stages.inner), uniforms, stages.row_values),
            OnGrid::Partials | OnGrid::Jacobian | OnGrid::Pullback => None,
        };
        let products = products.map(|products| {
            let factors = products.factors(module.function(stages.rows));
            (products, module.add(factors))
        });
        all.push(Staged { uniforms, stages, products, pulled });
    }
    Ok((module, all, of_part))
}

fn make(
    functions: &ModelFunctions,
    derived: &OnDemand,
    what: OnGrid,
    options: Options,
) -> Result<(GridCode, Vec<Listing>), BuildError> {
    let (module, staged, of_part) = staged(functions, derived, what)?;
    let mut compiler = Compiler::new(&module, options)?;
    let mut kernels = Vec::new();
    for staged in staged {
        kernels.push(compile(&mut compiler, staged)?);
    }
    let listings = compiler.listings().to_vec();
    Ok((GridCode { code: compiler.finish()?, kernels, of_part }, listings))
}

/// The functions as text, for people: `write` gets a title, the module, and a function of it.
pub(super) fn show(
    functions: &ModelFunctions,
    derived: &OnDemand,
    what: OnGrid,
    mut write: impl FnMut(&str, &Module, FunctionId),
) -> Result<(), BuildError> {
    let (module, staged, _) = staged(functions, derived, what)?;
    for Staged { stages, pulled, .. } in staged {
        write("once a column", &module, stages.columns);
        write("once a row", &module, stages.rows);
        match pulled {
            None => write("at every point", &module, stages.inner),
            Some(pulled) => {
                write("pulled back at every point", &module, pulled.inner);
                for (title, of) in [("from rows", pulled.rows), ("from columns", pulled.columns)] {
                    of.iter().for_each(|(_, f)| write(title, &module, *f));
                }
            }
        }
    }
    Ok(())
}

/// The functions that are to be evaluated, and the one of each part.
fn wholes(
    functions: &ModelFunctions,
    derived: &OnDemand,
    what: OnGrid,
) -> Result<(Module, Vec<Whole>, Vec<usize>), BuildError> {
    let by_body = || functions.parts.iter().map(|p| p.body).collect();
    let (mut module, mut roots, of_part): (Module, Vec<FunctionId>, Vec<usize>) = match what {
        OnGrid::Points | OnGrid::Pullback => {
            (functions.module.clone(), functions.bodies.iter().map(|b| b.points).collect(), by_body())
        }
        OnGrid::Partials => {
            let partials = derived.get(functions, Derivative::Partials).map_err(Clone::clone)?;
            (partials.module.clone(), partials.functions.clone(), by_body())
        }
        OnGrid::Jacobian => {
            let mut module = functions.module.clone();
            let mut indices: HashMap<FunctionId, usize> = HashMap::default();
            let (mut roots, mut of_part) = (Vec::new(), Vec::new());
            for part in &functions.parts {
                let index = *indices.entry(part.jacobian.function).or_insert_with(|| {
                    let varying = varying_entries(module.function(part.jacobian.function));
                    roots.push(module.add(varying));
                    roots.len() - 1
                });
                of_part.push(index);
            }
            (module, roots, of_part)
        }
    };
    module.drop_unreached(&mut roots);
    let uniforms = |f: &FunctionId| module.function(*f).params.len() - 2;
    let wholes = roots.iter().map(|f| (*f, uniforms(f))).collect();
    Ok((module, wholes, of_part))
}

/// A Jacobian without its constants.
fn varying_entries(jacobian: &Function) -> Function {
    let mut varying = jacobian.clone();
    let kept = |i: &usize| constant(jacobian, jacobian.results[*i]).is_none();
    let kept: Vec<usize> = (0..jacobian.results.len()).filter(kept).collect();
    varying.results = kept.iter().map(|i| jacobian.results[*i]).collect();
    varying.result_names = kept.iter().map(|i| jacobian.result_names[*i].clone()).collect();
    varying.drop_unused();
    varying
}

/// The value, where it is a real constant.
pub(super) fn constant(function: &Function, value: Value) -> Option<f64> {
    if let Op::Real(bits) = function.op(value) { Some(f64::from_bits(*bits)) } else { None }
}

/// The pullbacks of the stages of a function of points: what is summed, and the functions of that.
struct Pulled {
    inner: FunctionId,
    captures: Vec<u32>,
    rows: Option<(usize, FunctionId)>,
    columns: Option<(usize, FunctionId)>,
}

/// The pullbacks of stages to the first captures.
fn pull_back(module: &mut Module, stages: GridSplit, captures: usize, varied: usize) -> Result<Pulled, BuildError> {
    let depends = |module: &Module, f: FunctionId, first: usize| -> Vec<usize> {
        let depends = depends_on(module.function(f), varied).into_iter().enumerate();
        depends.filter(|(_, yes)| *yes).map(|(k, _)| first + k).collect()
    };
    let (first_row, first_column) = (captures, captures + stages.row_values);
    let mut wrt: Vec<usize> = (0..varied).collect();
    wrt.extend(depends(module, stages.rows, first_row));
    wrt.extend(depends(module, stages.columns, first_column));
    let params: Vec<u32> = wrt.iter().map(|p| *p as u32).collect();
    let inner = diff::pullback(module, stages.inner, &params, false)?;
    // Adjoints that are always zero are not summed.
    let mut function = module.function(inner).clone();
    let kept = |i: &usize| constant(&function, function.results[*i]) != Some(0.0);
    let kept: Vec<usize> = (0..wrt.len()).filter(kept).collect();
    function.results = kept.iter().map(|i| function.results[*i]).collect();
    function.result_names = kept.iter().map(|i| function.result_names[*i].clone()).collect();
    function.drop_unused();
    let inner = module.add(function);
    let within = |range: std::ops::Range<usize>| -> Vec<usize> {
        let params = kept.iter().map(|i| wrt[*i]).filter(|p| range.contains(p));
        params.map(|p| p - range.start).collect()
    };
    let (of_captures, of_rows) = (within(0..varied), within(first_row..first_column));
    let of_columns = within(first_column..first_column + stages.column_values);
    let mut outer = |stage: FunctionId, values: Vec<usize>| -> Result<_, BuildError> {
        if values.is_empty() {
            return Ok(None);
        }
        let mut function = module.function(stage).clone();
        function.results = values.iter().map(|k| function.results[*k]).collect();
        function.result_names = values.iter().map(|k| function.result_names[*k].clone()).collect();
        function.drop_unused();
        let function = module.add(function);
        let wrt: Vec<u32> = (0..varied as u32).collect();
        Ok(Some((values.len(), diff::pullback(module, function, &wrt, false)?)))
    };
    let (rows, columns) = (outer(stages.rows, of_rows)?, outer(stages.columns, of_columns)?);
    Ok(Pulled { inner, captures: of_captures.into_iter().map(|c| c as u32).collect(), rows, columns })
}

/// Which results depend on the first parameters.
fn depends_on(function: &Function, first: usize) -> Vec<bool> {
    let mut depends: Vec<bool> = Vec::with_capacity(function.nodes.len());
    for node in &function.nodes {
        let mut any = matches!(node.op, Op::Param(i) if (i as usize) < first);
        node.op.visit_operands(|v| any |= depends[v.0 as usize]);
        depends.push(any);
    }
    function.results.iter().map(|r| depends[r.0 as usize]).collect()
}

fn compile(compiler: &mut Compiler<'_>, staged: Staged) -> Result<GridKernels, BuildError> {
    let Staged { uniforms, stages, products, pulled } = staged;
    let shape = KernelShape { function: stages.columns, uniforms, weights: 0, output: Output::Store };
    let columns = compiler.kernel(shape)?;
    let of_rows = products.as_ref().map_or(stages.rows, |(_, factors)| *factors);
    let shape = GridShape { function: of_rows, uniforms, row_values: 1, column_values: 1, row_sums: None };
    let rows = compiler.grid(shape)?;
    let of_rows = compiler.function(of_rows).results.len();
    let GridSplit { row_values, column_values, .. } = stages;
    let function = pulled.as_ref().map_or(stages.inner, |p| p.inner);
    let row_sums = pulled.as_ref().map(|p| p.captures.len() + p.rows.map_or(0, |(n, _)| n));
    let results = compiler.function(function).results.len();
    let stored = pulled.is_none().then(|| compiler.function(function));
    let bounded = stored.filter(|f| is_bounded(f)).cloned();
    let inner = match products {
        Some((products, _)) => Inner::Products(products),
        None => Inner::Code(compiler.grid(GridShape { function, uniforms, row_values, column_values, row_sums })?),
    };
    let used = compiler.function(stages.columns).used_params();
    let column_uniforms = (0..uniforms).filter(|p| used[*p]).collect();
    let mut outer = |pulled: Option<(usize, FunctionId)>| -> Result<_, BuildError> {
        let Some((weights, function)) = pulled else { return Ok(None) };
        let shape = KernelShape { function, uniforms, weights, output: Output::Accumulate };
        Ok(Some((weights, compiler.kernel(shape)?)))
    };
    let adjoints = match pulled {
        Some(p) => Some(Adjoints { captures: p.captures, rows: outer(p.rows)?, columns: outer(p.columns)? }),
        None => None,
    };
    Ok(GridKernels {
        columns,
        column_values,
        rows,
        row_values: of_rows,
        inner,
        results,
        bounded,
        column_uniforms,
        kept: Kept::default(),
        adjoints,
    })
}
