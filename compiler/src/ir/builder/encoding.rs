//! Values of any type as Reals, which are all that is handed from what is hoisted to where it is used.

use crate::ir::{Binary, Compare, FunctionBuilder, Type, Unary, Value};

/// An integer is handed over as multiples of this and the rest: a Real holds either exactly, and not all integers.
const HALF: i64 = 1 << 32;

/// The number of Reals that a value is handed over as.
pub(crate) fn encoded_width(ty: Type) -> usize {
    if ty == Type::Int { 2 } else { 1 }
}

impl FunctionBuilder {
    /// A value as [`encoded_width`] Reals: an integer as two, a truth value as 0 or 1.
    pub(crate) fn encoded(&mut self, value: Value) -> Vec<Value> {
        match self.ty(value) {
            Type::Int => {
                let half = self.int(HALF);
                // The rest has the divisor's sign, so that what is left is a multiple, and within 64 bits.
                let rest = self.binary(Binary::Rem, value, half);
                let multiple = self.sub(value, rest);
                let quotient = self.binary(Binary::Div, multiple, half);
                [quotient, rest].map(|v| self.unary(Unary::ToReal, v)).to_vec()
            }
            Type::Bool => {
                let (one, zero) = (self.real(1.0), self.real(0.0));
                vec![self.select(value, one, zero)]
            }
            Type::Real | Type::Multi => vec![value],
        }
    }

    /// The value of a type of which [`FunctionBuilder::encoded`] made these Reals.
    pub(crate) fn decoded(&mut self, reals: &[Value], ty: Type) -> Value {
        match ty {
            Type::Int => {
                let half = self.int(HALF);
                let [quotient, rest] = [0, 1].map(|k| self.unary(Unary::ToInt, reals[k]));
                let product = self.mul(quotient, half);
                self.add(product, rest)
            }
            Type::Bool => {
                let half = self.real(0.5);
                self.compare(Compare::Lt, half, reals[0])
            }
            Type::Real | Type::Multi => reals[0],
        }
    }
}
