//! The split of a function of the points of a surface for grids: what depends on u alone is computed once a column,
//! what depends on v alone once a row, the rest at every point.

use super::axes::{U, UV, V, axes};
use super::visit_frontier;
use crate::ir::builder::{Image, Rebuild, Step, encoded_width};
use crate::ir::hash::HashMap;
use crate::ir::{Function, FunctionBuilder, FunctionId, Module, Parameter, Value};

/// A function `(captures.., u, v) -> results..`, split. The operations are those of the whole, so that results are the
/// same to the bit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GridSplit {
    /// `(captures.., u, v) -> values..`, which do not depend on v.
    pub columns: FunctionId,
    /// `(captures.., u, v) -> values..`, which do not depend on u.
    pub rows: FunctionId,
    /// `(captures.., row values.., column values..) -> results..`; all Real.
    pub inner: FunctionId,
    /// The number of values of a row.
    pub row_values: usize,
    /// The number of values of a column.
    pub column_values: usize,
}

/// Splits a function of some captures, u and v. A branch or a loop that takes values of both axes stays whole.
pub(crate) fn split_grid(module: &mut Module, function: FunctionId, captures: usize) -> GridSplit {
    let whole = module.function(function).clone();
    let axes = axes(&whole, captures);
    let mut on_frontier = vec![false; whole.nodes.len()];
    visit_frontier(&whole, |v| axes[v.0 as usize] != UV, |v| on_frontier[v.0 as usize] = true);
    let [columns, rows] = [U, V].map(|axis| -> Vec<Value> {
        whole.values().filter(|v| on_frontier[v.0 as usize] && axes[v.0 as usize] == axis).collect()
    });
    let outer = |name: &str, values: &[Value]| {
        let names = (0..values.len()).map(|k| format!("r{k}")).collect();
        let outer = Function { name: name.to_owned(), results: values.to_vec(), result_names: names, ..whole.clone() };
        copy(&outer, outer.params.clone(), outer.params.len(), &[])
    };
    let (columns_function, rows_function) = (outer("columns", &columns), outer("rows", &rows));
    let mut params = whole.params[..captures].to_vec();
    let [row_values, column_values] =
        [&rows, &columns].map(|values| values.iter().map(|v| encoded_width(whole.ty(*v))).sum::<usize>());
    params.extend((0..row_values).map(|k| Parameter::real(format!("row{k}"))));
    params.extend((0..column_values).map(|k| Parameter::real(format!("column{k}"))));
    let inner = copy(&whole, params, captures, &[rows, columns].concat());
    GridSplit {
        columns: module.add(columns_function),
        rows: module.add(rows_function),
        inner: module.add(inner),
        row_values,
        column_values,
    }
}

/// The function with its first `shared` parameters and, in the place of the values `taken`, the other parameters. All
/// of its results become Real. Its operations stay as they are: the rules of the builder could change the rounding.
fn copy(function: &Function, params: Vec<Parameter>, shared: usize, taken: &[Value]) -> Function {
    let mut b = FunctionBuilder::new(function.name.clone(), params);
    let mut next = shared;
    let mut decoded = |v: &Value| {
        let ty = function.ty(*v);
        let reals: Vec<Value> = (next..next + encoded_width(ty)).map(|i| b.param(i)).collect();
        next += reals.len();
        (*v, b.decoded(&reals, ty))
    };
    let given: HashMap<Value, Value> = taken.iter().map(&mut decoded).collect();
    let arg =
        |i: usize| if i < shared { b.param(i) } else { given.get(&Value(i as u32)).copied().unwrap_or(Value::NONE) };
    let args: Vec<Value> = (0..function.params.len()).map(arg).collect();
    let mut rebuild = Rebuild::new(function, &args);
    while let Some(Step { index: v, node, op }) = rebuild.next(&mut b) {
        rebuild.push(Image::One(match given.get(&v) {
            Some(param) => *param,
            // A node that only the taken values need is left out.
            None if !op.all_operands(|v| v != Value::NONE) => Value::NONE,
            None => b.node(op, node.ty),
        }));
    }
    let mut results = Vec::new();
    for (name, v) in function.result_names.iter().zip(rebuild.results()) {
        results.extend(b.encoded(v).into_iter().map(|real| (name.clone(), real)));
    }
    b.finish_unsimplified(results)
}
