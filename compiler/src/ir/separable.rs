//! Separable decomposition: points as `sum of row_i * column_i`, with rows that depend on v and columns that depend on
//! u.
//!
//! A tube's point in any pose is written as `R (c + r (n cos + b sin)) + t`; with n and c of the row and R uniform it
//! is `A cos + B sin + C` in every coordinate, with A, B and C once a row: four operations at a point, however many the
//! expression has. [`reassociate`](super::reassociate) moves factors but collects no terms; this pass multiplies out,
//! collects the terms with the same factors of u, and keeps the result only where it saves operations. Products of two
//! sums stay as they are: multiplied out they would cancel worse. Otherwise the pass changes the rounding as
//! reassociation does.

use super::builder::Rebuild;
use super::hash::HashMap;
use super::hoist::axes::{Axes, U, UV, axes};
use super::{Binary, Function, FunctionBuilder, FunctionId, Module, Op, Type, Unary, Value};
use std::rc::Rc;

/// Most monomials of a value; an expression with more stays as it is.
const MOST_MONOMIALS: usize = 24;

/// Most steps into an expression that is multiplied out: a script decides how deep it is, and each step recurses.
const DEPTH: usize = 64;

/// A product of values that depend on u alone and of values that do not depend on u.
#[derive(Clone, Debug)]
struct Monomial {
    negative: bool,
    /// Ascending.
    columns: Vec<Value>,
    rows: Vec<Value>,
}

/// The decomposition of a function of some captures, u and v: a new function, or the same one where nothing is saved.
#[must_use]
pub(crate) fn decompose(module: &mut Module, function: FunctionId, captures: usize) -> FunctionId {
    let old = module.function(function);
    let axes = axes(old, captures);
    let mut expansion = Expansion { old, axes: &axes, sums: HashMap::default() };
    let sums: Vec<Option<Polynomial>> = old.results.iter().map(|r| expansion.of_result(*r)).collect();
    let least: usize = sums.iter().flatten().map(operations).sum();
    if sums.iter().all(Option::is_none) || least >= operations_at_points(&axes) {
        return function;
    }
    let new = rebuilt(old, &axes, &sums);
    let saves = operations_at_points(&self::axes(&new, captures)) < operations_at_points(&axes);
    if saves { module.add(new) } else { function }
}

/// The number of operations at every point.
fn operations_at_points(axes: &[Axes]) -> usize {
    axes.iter().filter(|axes| **axes == UV).count()
}

/// A sum of monomials.
type Polynomial = Rc<[Monomial]>;

/// The number of operations at every point in a collected sum.
fn operations(sum: &Polynomial) -> usize {
    let mut columns: Vec<&[Value]> = sum.iter().map(|m| &m.columns[..]).collect();
    columns.sort_unstable();
    columns.dedup();
    let factors = columns.iter().filter(|c| !c.is_empty()).count();
    factors + columns.len() - 1
}

/// The values of a function as sums of monomials.
struct Expansion<'f> {
    old: &'f Function,
    axes: &'f [Axes],
    /// The sums of the values that were expanded so far.
    sums: HashMap<Value, Option<Polynomial>>,
}

impl Expansion<'_> {
    /// A result as a sum, if it depends on u and v.
    fn of_result(&mut self, result: Value) -> Option<Polynomial> {
        let separable = self.axes(result) == UV && self.old.ty(result) == Type::Real;
        if separable { self.sum(result, DEPTH) } else { None }
    }

    fn axes(&self, value: Value) -> Axes {
        self.axes[value.0 as usize]
    }

    /// A value as a sum; `None` where it is not one, or too long.
    fn sum(&mut self, value: Value, depth: usize) -> Option<Polynomial> {
        if let Some(sum) = self.sums.get(&value) {
            return sum.clone();
        }
        let sum = self.multiplied_out(value, depth).filter(|s| s.len() <= MOST_MONOMIALS).map(Polynomial::from);
        self.sums.insert(value, sum.clone());
        sum
    }

    fn multiplied_out(&mut self, value: Value, depth: usize) -> Option<Vec<Monomial>> {
        let axes = self.axes(value);
        if axes & U == 0 {
            return Some(vec![Monomial { negative: false, columns: Vec::new(), rows: vec![value] }]);
        }
        let deeper = depth.checked_sub(1)?;
        match *self.old.op(value) {
            Op::Unary(Unary::Neg, a) => Some(negated(&self.sum(a, deeper)?)),
            Op::Binary(Binary::Mul, a, b) => {
                // A product of two values of columns is a value of columns.
                if axes == U && self.axes(a) == U && self.axes(b) == U {
                    return Some(vec![column(value)]);
                }
                let (a, b) = (self.sum(a, deeper)?, self.sum(b, deeper)?);
                let (one, many) = if a.len() == 1 { (a, b) } else { (b, a) };
                (one.len() == 1).then(|| many.iter().map(|m| product(&one[0], m)).collect())
            }
            Op::Binary(op @ (Binary::Add | Binary::Sub), a, b) if axes == UV => {
                let (a, b) = (self.sum(a, deeper)?, self.sum(b, deeper)?);
                let b = if op == Binary::Sub { negated(&b) } else { b.to_vec() };
                Some([a.to_vec(), b].concat())
            }
            _ => (axes == U).then(|| vec![column(value)]),
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

/// The function with its sums collected.
fn rebuilt(old: &Function, axes: &[Axes], sums: &[Option<Polynomial>]) -> Function {
    let mut builder = FunctionBuilder::like(old);
    let params = builder.params();
    let rebuild = builder.splice_nodes(old, &params);
    let mut results = Vec::new();
    for (result, sum) in old.results.iter().zip(sums) {
        builder.set_span(old.nodes[result.0 as usize].span);
        results.push(match sum {
            Some(sum) => collected(&mut builder, axes, &rebuild, sum),
            None => rebuild.value(*result),
        });
    }
    builder.finish_like(old, results)
}

/// A sum of products of a value of the row with one of the column; the term without a factor of the column comes last.
/// The rules of the builder, which would bring constants of rows out to the points, are not applied.
fn collected(builder: &mut FunctionBuilder, axes: &[Axes], values: &Rebuild<'_>, sum: &[Monomial]) -> Value {
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
            let product = row_product(builder, axes, values, &monomial.rows);
            row = Some(added(builder, row, (monomial.negative, product)));
        }
        let Some((negative, row)) = row else { continue };
        let column = columns.iter().map(|f| values.value(*f));
        let term = match column.reduce(|a, b| builder.unsimplified_binary(Binary::Mul, a, b)) {
            Some(column) if builder.real_constant(row) == Some(1.0) => column,
            Some(column) => builder.unsimplified_binary(Binary::Mul, column, row),
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
        Some((other, a)) if other == negative => (negative, builder.unsimplified_binary(Binary::Add, a, b)),
        Some((false, a)) => (false, builder.unsimplified_binary(Binary::Sub, a, b)),
        Some((true, a)) => (false, builder.unsimplified_binary(Binary::Sub, b, a)),
    }
}

/// The product of old values (1 if there are none); what does not depend on v comes first, so that it is computed once.
fn row_product(builder: &mut FunctionBuilder, axes: &[Axes], values: &Rebuild<'_>, factors: &[Value]) -> Value {
    let (uniform, rest): (Vec<Value>, Vec<Value>) = factors.iter().copied().partition(|f| axes[f.0 as usize] == 0);
    let uniform = uniform.iter().map(|f| values.value(*f)).reduce(|a, b| builder.mul(a, b));
    let rest = rest.iter().map(|f| values.value(*f));
    let product = uniform.into_iter().chain(rest).reduce(|a, b| builder.unsimplified_binary(Binary::Mul, a, b));
    product.unwrap_or_else(|| builder.real(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::tests::{reals, run};

    /// `p * (c + a * cos(u)) + q * sin(u) * 5 - p * v * cos(u)` of captures p, q, a, c.
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
        let new = decompose(&mut module, old, 4);
        assert_ne!(new, old);
        // cos A(v) + sin B + C: two products and two sums.
        assert_eq!(operations_at_points(&axes(module.function(new), 4)), 4);
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
        assert_eq!(decompose(&mut module, function, 4), function);
    }
}
