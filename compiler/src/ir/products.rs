//! Recognizes functions of points that are sums of products of a value of the column and one of the row.

use super::magnitude::SAFE;
use super::{Binary, Function, Node, Op, Type, Unary, Value};
use crate::source::Span;

/// Terms beside the constant one at most.
pub(crate) const MOST_TERMS: usize = 4;

/// Three coordinates, each `((column_0 row_0 + column_1 row_1) + ..) + constant`, in the same columns; products are
/// rounded before they are added, from left to right.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Products {
    /// Which values of the column, and by what they are multiplied; at most [`MOST_TERMS`].
    pub terms: Vec<(usize, [Factor; 3])>,
    /// What is added last.
    pub constant: Option<[Factor; 3]>,
}

/// A factor that does not depend on the column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Factor {
    /// Where it is from.
    pub source: Source,
    /// Its negative is taken.
    pub negative: bool,
}

/// Where a factor is from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Source {
    /// A uniform, by its index.
    Uniform(usize),
    /// A value of the row, by its index.
    Row(usize),
    /// A number.
    Constant(f64),
}

/// A term of a sum: which value of the column, if any, and its factor.
type Term = (Option<usize>, Factor);

impl Products {
    /// What a function `(uniforms.., row values.., column values..) -> x, y, z` is, if it is of this form.
    #[must_use]
    pub(crate) fn of(function: &Function, uniforms: usize, row_values: usize) -> Option<Products> {
        let reader = Reader { function, uniforms, row_values };
        let &[x, y, z] = &function.results[..] else { return None };
        let (mut x, mut y, mut z) = (reader.sum(x)?, reader.sum(y)?, reader.sum(z)?);
        for other in [&mut y, &mut z] {
            // The sum of two is the same in either order.
            if other.len() > 1 && x.len() > 1 && other[0].0 != x[0].0 {
                other.swap(0, 1);
            }
        }
        let alike = |other: &[Term]| x.iter().map(|t| t.0).eq(other.iter().map(|t| t.0));
        if !alike(&y) || !alike(&z) {
            return None;
        }
        let mut all: Vec<(Option<usize>, [Factor; 3])> =
            x.drain(..).zip(y).zip(z).map(|((x, y), z)| (x.0, [x.1, y.1, z.1])).collect();
        // Of two terms the constant may stand first.
        if all.len() == 2 && all[0].0.is_none() {
            all.swap(0, 1);
        }
        let constant = all.pop_if(|(column, _)| column.is_none()).map(|(_, factors)| factors);
        let terms: Option<Vec<_>> = all.into_iter().map(|(column, factors)| Some((column?, factors))).collect();
        let terms = terms.filter(|t| (1..=MOST_TERMS).contains(&t.len()))?;
        Some(Products { terms, constant })
    }

    /// `(uniforms.., u, v) -> factors..`, three of every term and of the constant, from the function that gives the
    /// values of rows.
    #[must_use]
    pub(crate) fn factors(&self, rows: &Function) -> Function {
        let mut made = Function { results: Vec::new(), result_names: Vec::new(), ..rows.clone() };
        let mut push = |op: Op| {
            made.nodes.push(Node { op, ty: Type::Real, span: Span::default() });
            Value(made.nodes.len() as u32 - 1)
        };
        for factor in self.terms.iter().map(|(_, factors)| factors).chain(&self.constant).flatten() {
            let value = match factor.source {
                Source::Uniform(i) => Value(i as u32),
                Source::Row(i) => rows.results[i],
                Source::Constant(c) => push(Op::Real(c.to_bits())),
            };
            let value = if factor.negative { push(Op::Unary(Unary::Neg, value)) } else { value };
            made.results.push(value);
        }
        made.result_names = (0..made.results.len()).map(|k| format!("r{k}")).collect();
        made.drop_unused();
        made
    }

    /// Whether every coordinate is finite where columns and factors have at most these magnitudes.
    #[must_use]
    pub(crate) fn stay_finite(&self, factors: &[f64], columns: &[f64]) -> bool {
        let magnitudes = self.terms.iter().map(|(column, _)| columns[*column]).chain([1.0]);
        let products = magnitudes.zip(factors.chunks(3)).flat_map(|(m, factors)| factors.iter().map(move |f| m * f));
        products.sum::<f64>() < SAFE
    }
}

struct Reader<'f> {
    function: &'f Function,
    uniforms: usize,
    row_values: usize,
}

impl Reader<'_> {
    /// The terms of a sum in the order in which they are added.
    fn sum(&self, value: Value) -> Option<Vec<Term>> {
        // From the last term to the first, each with whether what is before it is negative.
        let mut terms = Vec::new();
        let (mut rest, mut negative) = (value, false);
        loop {
            if let Some(term) = self.term(rest, negative) {
                terms.push(term);
                terms.reverse();
                return Some(terms);
            }
            let (a, b, subtracted) = match *self.function.op(rest) {
                Op::Binary(Binary::Add, a, b) => (a, b, false),
                Op::Binary(Binary::Sub, a, b) => (a, b, true),
                _ => return None,
            };
            if terms.len() > MOST_TERMS {
                return None;
            }
            if let Some(term) = self.term(b, negative != subtracted) {
                terms.push(term);
                rest = a;
            } else {
                terms.push(self.term(a, negative)?);
                (rest, negative) = (b, negative != subtracted);
            }
        }
    }

    fn term(&self, value: Value, negative: bool) -> Option<Term> {
        if let Some(source) = self.source(value) {
            return Some((None, Factor { source, negative }));
        }
        if let Some(column) = self.column(value) {
            return Some((Some(column), Factor { source: Source::Constant(1.0), negative }));
        }
        match *self.function.op(value) {
            Op::Unary(Unary::Neg, a) => self.term(a, !negative),
            Op::Binary(Binary::Mul, a, b) => {
                let (column, source) = match (self.column(a), self.column(b)) {
                    (Some(column), None) => (column, self.source(b)?),
                    (None, Some(column)) => (column, self.source(a)?),
                    _ => return None,
                };
                Some((Some(column), Factor { source, negative }))
            }
            _ => None,
        }
    }

    fn source(&self, value: Value) -> Option<Source> {
        match *self.function.op(value) {
            Op::Real(bits) => Some(Source::Constant(f64::from_bits(bits))),
            Op::Param(i) if (i as usize) < self.uniforms => Some(Source::Uniform(i as usize)),
            Op::Param(i) => {
                let row = i as usize - self.uniforms;
                (row < self.row_values).then_some(Source::Row(row))
            }
            _ => None,
        }
    }

    fn column(&self, value: Value) -> Option<usize> {
        if let Op::Param(i) = *self.function.op(value) {
            (i as usize).checked_sub(self.uniforms + self.row_values)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::tests::reals;
    use crate::ir::{Function, FunctionBuilder};

    /// A function of a uniform a, two values of the row and two of the column.
    fn found(make: impl FnOnce(&mut FunctionBuilder, &[Value]) -> [Value; 3]) -> Option<Products> {
        let mut b = FunctionBuilder::new("f", reals(&["a", "row0", "row1", "column0", "column1"]));
        let params = b.params();
        let results = make(&mut b, &params).map(|r| ("r".to_owned(), r));
        let function: Function = b.finish(results);
        Products::of(&function, 1, 2)
    }

    #[test]
    fn sums_of_products_are_recognized() {
        let found = found(|b, p| {
            let (first, second) = (b.mul(p[3], p[1]), b.mul(p[0], p[4]));
            let [sum, difference] = [b.add(first, second), b.sub(second, first)];
            let [x, y] = [sum, difference].map(|s| b.add(s, p[2]));
            let z = b.sub(p[2], sum);
            [x, y, z]
        });
        let row = |negative| Factor { source: Source::Row(0), negative };
        let uniform = |negative| Factor { source: Source::Uniform(0), negative };
        let expected = Products {
            terms: vec![(0, [row(false), row(true), row(true)]), (1, [uniform(false), uniform(false), uniform(true)])],
            constant: Some([Factor { source: Source::Row(1), negative: false }; 3]),
        };
        assert_eq!(found, Some(expected));
    }

    #[test]
    fn a_coordinate_without_one_of_the_terms_is_none() {
        // A zero in its place would change the sign of a zero.
        let missing = found(|b, p| {
            let (first, second) = (b.mul(p[3], p[1]), b.mul(p[4], p[2]));
            let both = b.add(first, second);
            [both, both, first]
        });
        assert_eq!(missing, None);
        let squares = found(|b, p| {
            let square = b.mul(p[3], p[3]);
            [square; 3]
        });
        assert_eq!(squares, None);
    }
}
