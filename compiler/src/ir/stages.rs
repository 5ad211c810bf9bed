//! Divides a function of the points of a surface into what depends on u, on v, and on both: on a grid the first is computed
//! once a column and the second once a row.

use super::{Binary, Compare, Function, FunctionId, Module, Node, Op, Parameter, Type, Unary, Value};
use crate::source::Span;

/// A function `(uniforms.., u, v) -> results..`, divided. Operations are those of the whole, so that results are the same
/// to the bit.
#[derive(Clone, Copy, Debug)]
pub struct Stages {
    /// `(uniforms.., u, v) -> values..`, which do not depend on v.
    pub columns: FunctionId,
    /// `(uniforms.., u, v) -> values..`, which do not depend on u.
    pub rows: FunctionId,
    /// `(uniforms.., row values.., column values..) -> results..`; all Real.
    pub inner: FunctionId,
    /// How many values a row has.
    pub row_values: usize,
    /// How many values a column has.
    pub column_values: usize,
}

/// What a value depends on beside the uniforms: u is 1, v is 2.
pub(super) type Class = u8;
pub(super) const U: Class = 1;
pub(super) const V: Class = 2;

/// Divides a function of these uniforms, u and v. Branches and loops are not cut: one that takes both is of the inner stage.
pub fn stages(module: &mut Module, function: FunctionId, uniforms: usize) -> Stages {
    let whole = module.function(function).clone();
    let classes = classes(&whole, uniforms);
    let [columns, rows] = [U, V].map(|class| cut_values(&whole, &classes, class));
    let stage = |name: &str, values: &[Value]| {
        let mut copy = Copy::new(&whole, name, whole.params.clone());
        copy.bind(0, 0..whole.params.len());
        let results = values.iter().map(|v| copy.real(*v)).collect();
        copy.finish(results)
    };
    let (columns_of, rows_of) = (stage("columns", &columns), stage("rows", &rows));
    let mut params = whole.params[..uniforms].to_vec();
    params.extend((0..rows.len()).map(|k| Parameter::real(format!("row{k}"))));
    params.extend((0..columns.len()).map(|k| Parameter::real(format!("column{k}"))));
    let mut copy = Copy::new(&whole, &whole.name, params);
    copy.bind(0, 0..uniforms);
    for (k, value) in rows.iter().chain(&columns).enumerate() {
        copy.bind_real(*value, uniforms + k);
    }
    let results = whole.results.iter().map(|r| copy.real(*r)).collect();
    let inner = Function { result_names: whole.result_names.clone(), ..copy.finish(results) };
    let (row_values, column_values) = (rows.len(), columns.len());
    Stages {
        columns: module.add(columns_of),
        rows: module.add(rows_of),
        inner: module.add(inner),
        row_values,
        column_values,
    }
}

/// What each value of a function is computed from: u, v, both or none. Where a uniform times a value that depends on u alone is
/// used at points only, the product counts as one of both: the values of columns then stay while parameters change.
pub(super) fn classes(function: &Function, uniforms: usize) -> Vec<Class> {
    let mut classes: Vec<Class> = Vec::with_capacity(function.nodes.len());
    // Which depend on uniforms; constants do not.
    let mut varies: Vec<bool> = Vec::with_capacity(function.nodes.len());
    for node in &function.nodes {
        let (mut class, mut varying) = match node.op {
            Op::Param(i) if i as usize == uniforms => (U, false),
            Op::Param(i) if i as usize == uniforms + 1 => (V, false),
            Op::Param(i) => (0, (i as usize) < uniforms),
            _ => (0, false),
        };
        node.op.visit_operands(|v| {
            class |= classes[v.0 as usize];
            varying |= varies[v.0 as usize];
        });
        classes.push(class);
        varies.push(varying);
    }
    let mut used_by_columns = vec![false; classes.len()];
    for (node, _) in function.nodes.iter().zip(&classes).filter(|(_, class)| **class == U) {
        node.op.visit_operands(|v| used_by_columns[v.0 as usize] = true);
    }
    for (i, node) in function.nodes.iter().enumerate() {
        if let Op::Binary(Binary::Mul, a, b) = node.op
            && classes[i] == U
            && !used_by_columns[i]
            && [(a, b), (b, a)].iter().any(|(a, b)| {
                let (a, b) = (a.0 as usize, b.0 as usize);
                classes[a] == 0 && varies[a] && classes[b] == U && !varies[b]
            })
        {
            classes[i] = U | V;
        }
    }
    classes
}

/// The values of a class that a result is, or that something uses which depends on both.
fn cut_values(function: &Function, classes: &[Class], class: Class) -> Vec<Value> {
    let mut cut = vec![false; function.nodes.len()];
    for (node, of) in function.nodes.iter().zip(classes) {
        if *of == U | V {
            node.op.visit_operands(|v| cut[v.0 as usize] = true);
        }
    }
    function.results.iter().for_each(|r| cut[r.0 as usize] = true);
    function.values().filter(|v| cut[v.0 as usize] && classes[v.0 as usize] == class).collect()
}

/// Copies what some values need from one function to another, as it is.
struct Copy<'f> {
    from: &'f Function,
    to: Function,
    values: Vec<Option<Value>>,
}

impl<'f> Copy<'f> {
    fn new(from: &'f Function, name: &str, params: Vec<Parameter>) -> Copy<'f> {
        let nodes = (0..).zip(&params).map(|(i, p)| Node { op: Op::Param(i), ty: p.ty, span: Span::default() });
        let nodes = nodes.collect();
        let to = Function { name: name.to_owned(), params, nodes, ..Function::default() };
        Copy { from, to, values: vec![None; from.nodes.len()] }
    }

    /// Parameters of the old function are those of the new one, from `first` on.
    fn bind(&mut self, first: u32, old: std::ops::Range<usize>) {
        for (new, old) in (first..).zip(old) {
            self.values[old] = Some(Value(new));
        }
    }

    /// A value is what [`Copy::real`] made of it, which is parameter `param`.
    fn bind_real(&mut self, value: Value, param: usize) {
        let param = Value(param as u32);
        self.values[value.0 as usize] = Some(match self.from.ty(value) {
            Type::Int => self.push(Op::Unary(Unary::ToInt, param), Type::Int),
            Type::Bool => {
                let half = self.push(Op::Real(0.5f64.to_bits()), Type::Real);
                self.push(Op::Compare(Compare::Lt, half, param), Type::Bool)
            }
            Type::Real | Type::Multi => param,
        });
    }

    /// A value as a real: integers by value (exact up to 2^53), truth values as 0 or 1.
    fn real(&mut self, value: Value) -> Value {
        let made = self.value(value);
        match self.from.ty(value) {
            Type::Int => self.push(Op::Unary(Unary::ToReal, made), Type::Real),
            Type::Bool => {
                let one = self.push(Op::Real(1.0f64.to_bits()), Type::Real);
                let zero = self.push(Op::Real(0), Type::Real);
                self.push(Op::Select(made, one, zero), Type::Real)
            }
            Type::Real | Type::Multi => made,
        }
    }

    /// A value of the old function in the new one, with what it needs.
    fn value(&mut self, value: Value) -> Value {
        let mut open = vec![value];
        while let Some(&next) = open.last() {
            if self.values[next.0 as usize].is_some() {
                open.pop();
                continue;
            }
            let node = &self.from.nodes[next.0 as usize];
            let first = open.len();
            node.op.visit_operands(|v| open.extend(self.values[v.0 as usize].is_none().then_some(v)));
            if open.len() == first {
                let op = node.op.map_operands(|v| self.values[v.0 as usize].unwrap_or(v));
                self.to.nodes.push(Node { op, ..node.clone() });
                self.values[next.0 as usize] = Some(Value(self.to.nodes.len() as u32 - 1));
            } else {
                open[first..].reverse();
            }
        }
        self.values[value.0 as usize].unwrap_or(value)
    }

    fn push(&mut self, op: Op, ty: Type) -> Value {
        self.to.nodes.push(Node { op, ty, span: Span::default() });
        Value(self.to.nodes.len() as u32 - 1)
    }

    fn finish(self, results: Vec<Value>) -> Function {
        let result_names = (0..results.len()).map(|k| format!("r{k}")).collect();
        Function { results, result_names, ..self.to }
    }
}
