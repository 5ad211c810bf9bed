//! Brings points to the form `sum of row_i * column_i`: rows depend on v, columns on u.
//!
//! A tube's point in any pose is written as `R (c + r (n cos + b sin)) + t`; with n and c of the row and R uniform it is
//! `A cos + B sin + C` in every coordinate, with A, B and C once a row: four operations at a point, however many the
//! expression has. [`regroup`](super::regroup) moves factors, but collects no terms; this pass multiplies out, collects what
//! has the same factors of u, and is undone where that saves nothing. Products of two sums stay as they are: multiplied
//! out they would cancel worse. Otherwise it changes the rounding as regrouping does.

use super::hash::HashMap;
use super::stages::{Class, U, V, classes};
use super::{Binary, Function, FunctionBuilder, FunctionId, Module, Op, Type, Unary, Value};
use std::rc::Rc;

/// Monomials of a value at most; an expression of more stays as it is.
const MOST_MONOMIALS: usize = 24;

/// Expressions are multiplied out this deep: a script decides how deep they are, and each step recurses.
const DEPTH: usize = 64;

/// A product, of values that depend on u only and of values that do not depend on u.
#[derive(Clone, Debug)]
struct Monomial {
    negative: bool,
    /// Ascending.
    columns: Vec<Value>,
    rows: Vec<Value>,
}

/// A function of these uniforms, u and v, separated: another one, or itself where that saves nothing.
#[must_use]
pub fn separated(module: &mut Module, function: FunctionId, uniforms: usize) -> FunctionId {
    let old = module.function(function);
    let classes = classes(old, uniforms);
    let mut separate = Separate { old, classes: &classes, known: HashMap::default() };
    let sums: Vec<Option<Polynomial>> = old.results.iter().map(|r| separate.of_result(*r)).collect();
    let least: usize = sums.iter().flatten().map(operations).sum();
    if sums.iter().all(Option::is_none) || least >= at_points(&classes) {
        return function;
    }
    let new = rebuilt(old, &classes, &sums);
    if at_points(&self::classes(&new, uniforms)) < at_points(&classes) { module.add(new) } else { function }
}

/// How many operations there are at every point.
fn at_points(classes: &[Class]) -> usize {
    classes.iter().filter(|class| **class == U | V).count()
}

/// A sum of monomials.
type Polynomial = Rc<[Monomial]>;

/// How many operations of points a collected sum has.
fn operations(sum: &Polynomial) -> usize {
    let mut columns: Vec<&[Value]> = sum.iter().map(|m| &m.columns[..]).collect();
    columns.sort_unstable();
    columns.dedup();
    let factors = columns.iter().filter(|c| !c.is_empty()).count();
    factors + columns.len() - 1
}

struct Separate<'f> {
    old: &'f Function,
    classes: &'f [Class],
    known: HashMap<Value, Option<Polynomial>>,
}

impl Separate<'_> {
    /// The sum that a result is, if it depends on u and v.
    fn of_result(&mut self, result: Value) -> Option<Polynomial> {
        let separable = self.class(result) == U | V && self.old.ty(result) == Type::Real;
        if separable { self.sum(result, DEPTH) } else { None }
    }

    fn class(&self, value: Value) -> Class {
        self.classes[value.0 as usize]
    }

    /// A value as a sum; nothing where it is none, or too long a one.
    fn sum(&mut self, value: Value, depth: usize) -> Option<Polynomial> {
        if let Some(known) = self.known.get(&value) {
            return known.clone();
        }
        let sum = self.multiplied_out(value, depth).filter(|s| s.len() <= MOST_MONOMIALS).map(Polynomial::from);
        self.known.insert(value, sum.clone());
        sum
    }

    fn multiplied_out(&mut self, value: Value, depth: usize) -> Option<Vec<Monomial>> {
        let class = self.class(value);
        if class & U == 0 {
            return Some(vec![Monomial { negative: false, columns: Vec::new(), rows: vec![value] }]);
        }
        let deeper = depth.checked_sub(1)?;
        match *self.old.op(value) {
            Op::Unary(Unary::Neg, a) => Some(negated(&self.sum(a, deeper)?)),
            Op::Binary(Binary::Mul, a, b) => {
                // A product of two values of columns is one.
                if class == U && self.class(a) == U && self.class(b) == U {
                    return Some(vec![column(value)]);
                }
                let (a, b) = (self.sum(a, deeper)?, self.sum(b, deeper)?);
                let (one, many) = if a.len() == 1 { (a, b) } else { (b, a) };
                (one.len() == 1).then(|| many.iter().map(|m| product(&one[0], m)).collect())
            }
            Op::Binary(op @ (Binary::Add | Binary::Sub), a, b) if class == U | V => {
                let (a, b) = (self.sum(a, deeper)?, self.sum(b, deeper)?);
                let b = if op == Binary::Sub { negated(&b) } else { b.to_vec() };
                Some([a.to_vec(), b].concat())
            }
            _ => (class == U).then(|| vec![column(value)]),
        }
    }
}

fn column(value: Value) -> Monomial {
    Monomial { negative: false, columns: vec![value], rows: Vec::new() }
}

fn negated(sum: &[Monomial]) -> Vec<Monomial> {
    sum.iter().map(|m| Monomial { negative: !m.negative, ..m.clone() }).collect()
}

fn product(a: &Monomial, b: &Monomial) -> Monomial {
    let mut columns = [&a.columns[..], &b.columns].concat();
    columns.sort_unstable();
    Monomial { negative: a.negative != b.negative, columns, rows: [&a.rows[..], &b.rows].concat() }
}

/// The function with those results that are sums collected.
fn rebuilt(old: &Function, classes: &[Class], sums: &[Option<Polynomial>]) -> Function {
    let mut builder = FunctionBuilder::new(old.name.clone(), old.params.clone());
    let mut values: Vec<Value> = Vec::with_capacity(old.nodes.len());
    for node in &old.nodes {
        builder.set_span(node.span);
        values.push(builder.emit(&node.op.map_operands(|v| values[v.0 as usize]), node.ty));
    }
    let mut results = Vec::new();
    for ((name, result), sum) in old.result_names.iter().zip(&old.results).zip(sums) {
        builder.set_span(old.nodes[result.0 as usize].span);
        let value = match sum {
            Some(sum) => collected(&mut builder, classes, &values, sum),
            None => values[result.0 as usize],
        };
        results.push((name.clone(), value));
    }
    builder.finish(results)
}

/// A sum of products of a value of the row with one of the column; what has no factor of the column comes last. The sums
/// and products are made as they are: the builder's rules would bring constants of rows out to the points.
fn collected(builder: &mut FunctionBuilder, classes: &[Class], values: &[Value], sum: &[Monomial]) -> Value {
    let mut terms: Vec<(&[Value], Vec<&Monomial>)> = Vec::new();
    for monomial in sum {
        match terms.iter_mut().find(|(columns, _)| *columns == monomial.columns) {
            Some((_, monomials)) => monomials.push(monomial),
            None => terms.push((&monomial.columns, vec![monomial])),
        }
    }
    terms.sort_by_key(|(columns, _)| columns.is_empty());
    let mut total = None;
    for (columns, monomials) in terms {
        let mut row = None;
        for monomial in monomials {
            let product = row_product(builder, classes, values, &monomial.rows);
            row = Some(added(builder, row, (monomial.negative, product)));
        }
        let Some((negative, row)) = row else { continue };
        let column = columns.iter().map(|f| values[f.0 as usize]);
        let term = match column.reduce(|a, b| builder.raw_binary(Binary::Mul, a, b)) {
            Some(column) if builder.real_constant(row) == Some(1.0) => column,
            Some(column) => builder.raw_binary(Binary::Mul, column, row),
            None => row,
        };
        total = Some(added(builder, total, (negative, term)));
    }
    match total {
        Some((true, sum)) => builder.neg(sum),
        Some((false, sum)) => sum,
        None => builder.real(0.0),
    }
}

/// A term of a sum; true where it is subtracted.
type Term = (bool, Value);

fn added(builder: &mut FunctionBuilder, sum: Option<Term>, (negative, b): Term) -> Term {
    match sum {
        None => (negative, b),
        Some((other, a)) if other == negative => (negative, builder.raw_binary(Binary::Add, a, b)),
        Some((false, a)) => (false, builder.raw_binary(Binary::Sub, a, b)),
        Some((true, a)) => (false, builder.raw_binary(Binary::Sub, b, a)),
    }
}

/// The product of old values, 1 of none; what does not depend on v first, so that it is computed once.
fn row_product(builder: &mut FunctionBuilder, classes: &[Class], values: &[Value], factors: &[Value]) -> Value {
    let (uniform, rest): (Vec<Value>, Vec<Value>) = factors.iter().copied().partition(|f| classes[f.0 as usize] == 0);
    let uniform = uniform.iter().map(|f| values[f.0 as usize]).reduce(|a, b| builder.mul(a, b));
    let rest = rest.iter().map(|f| values[f.0 as usize]);
    let product = uniform.into_iter().chain(rest).reduce(|a, b| builder.raw_binary(Binary::Mul, a, b));
    product.unwrap_or_else(|| builder.real(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::testing::{reals, run};

    /// `p * (c + a * cos(u)) + q * sin(u) * 5 - p * v * cos(u)` of uniforms p, q, a, c.
    fn tube(product_of_sums: bool) -> (Module, FunctionId) {
        let mut b = FunctionBuilder::new("tube", reals(&["p", "q", "a", "c", "u", "v"]));
        let &[p, q, a, c, u, v] = &b.params()[..] else { panic!("six parameters") };
        let (cos, sin, five) = (b.unary(Unary::Cos, u), b.unary(Unary::Sin, u), b.real(5.0));
        let wave = b.mul(a, cos);
        let wave = b.mul(wave, v);
        let ring = b.add(c, wave);
        let other = b.mul(v, sin);
        let other = b.add(c, other);
        let first = if product_of_sums { b.mul(ring, other) } else { b.mul(p, ring) };
        let side = b.mul(q, sin);
        let side = b.mul(side, five);
        let back = b.mul(v, cos);
        let back = b.mul(back, p);
        let sum = b.add(first, side);
        let sum = b.sub(sum, back);
        let mut module = Module::default();
        let function = module.add(b.finish([("x".to_owned(), sum)]));
        (module, function)
    }

    #[test]
    fn terms_with_the_same_factor_are_collected() {
        let (mut module, old) = tube(false);
        let new = separated(&mut module, old, 4);
        assert_ne!(new, old);
        // cos A(v) + sin B + C: two products and two sums.
        assert_eq!(at_points(&classes(module.function(new), 4)), 4);
        crate::ir::validate(&module).expect("a valid module");
        for args in [[1.0, -2.0, 0.5, 3.0, 0.3, 0.7], [0.1, 4.0, -3.0, 0.0, 2.9, 1.0]] {
            let (before, after) = (run(&module, old, &args)[0], run(&module, new, &args)[0]);
            // Sums of values below 20, in another order.
            assert!((before - after).abs() < 1e-13, "{before} {after}");
        }
    }

    #[test]
    fn products_of_two_sums_stay() {
        let (mut module, function) = tube(true);
        assert_eq!(separated(&mut module, function, 4), function);
    }
}
