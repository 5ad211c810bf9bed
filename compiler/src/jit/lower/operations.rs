//! Arithmetic and comparisons.

use super::super::host;
use super::Lowering;
use crate::ir::arithmetic::pow_int_steps;
use crate::ir::{Binary, Compare, Type, Unary};
use cranelift_codegen::ir::condcodes::{FloatCC, IntCC};
use cranelift_codegen::ir::{InstBuilder, Value, types};

impl Lowering<'_, '_, '_> {
    pub(super) fn unary(&mut self, op: Unary, a: Value) -> Value {
        if let Some(symbols) = host::unary(op) {
            return self.host(symbols, &[a]);
        }
        match op {
            Unary::Neg if self.builder.func.dfg.value_type(a) == types::I64 => self.builder.ins().ineg(a),
            Unary::Neg => self.builder.ins().fneg(a),
            Unary::Abs => self.builder.ins().fabs(a),
            Unary::Sign => self.sign(a),
            Unary::Sqrt => self.builder.ins().sqrt(a),
            Unary::Floor => self.builder.ins().floor(a),
            Unary::Ceil => self.builder.ins().ceil(a),
            Unary::Not if self.two_lanes => self.builder.ins().bnot(a),
            Unary::Not => self.builder.ins().bxor_imm_u(a, 1),
            Unary::ToReal => self.builder.ins().fcvt_from_sint(types::F64, a),
            Unary::ToInt => self.builder.ins().fcvt_to_sint_sat(types::I64, a),
            _ => a,
        }
    }

    pub(super) fn binary(&mut self, op: Binary, a: Value, b: Value) -> Value {
        if let Some(symbols) = host::binary(op) {
            return self.host(symbols, &[a, b]);
        }
        match op {
            Binary::Add => self.builder.ins().fadd(a, b),
            Binary::Sub => self.builder.ins().fsub(a, b),
            Binary::Mul => self.builder.ins().fmul(a, b),
            Binary::Div => self.builder.ins().fdiv(a, b),
            Binary::Min => self.builder.ins().fmin(a, b),
            Binary::Max => self.builder.ins().fmax(a, b),
            Binary::Keep => a,
            Binary::MulOrZero => {
                let product = self.builder.ins().fmul(a, b);
                self.zero_where_zero(a, product)
            }
            Binary::DivOrZero => {
                let quotient = self.builder.ins().fdiv(a, b);
                self.zero_where_zero(a, quotient)
            }
            Binary::Rem | Binary::Pow | Binary::Atan2 => unreachable!("host functions"),
            Binary::And | Binary::Or => unreachable!("operations of truth values"),
        }
    }

    /// Operations of integers and of truth values (which are the integers 0 and 1 in eight bits).
    pub(super) fn binary_int(&mut self, op: Binary, a: Value, b: Value) -> Value {
        match op {
            Binary::Add => self.builder.ins().iadd(a, b),
            Binary::Sub => self.builder.ins().isub(a, b),
            Binary::Mul => self.builder.ins().imul(a, b),
            Binary::Min => self.builder.ins().smin(a, b),
            Binary::Max => self.builder.ins().smax(a, b),
            Binary::And => self.builder.ins().band(a, b),
            Binary::Or => self.builder.ins().bor(a, b),
            Binary::Div => self.divide_int(a, b).0,
            Binary::Rem => self.divide_int(a, b).1,
            _ => unreachable!("operations of reals"),
        }
    }

    /// Quotient towards zero and remainder with the divisor's sign; both 0 where the divisor is 0. The machine's
    /// division traps at a divisor of 0 and at the least integer over -1: such divisors are replaced by 1.
    fn divide_int(&mut self, a: Value, b: Value) -> (Value, Value) {
        let one = self.builder.ins().iconst(types::I64, 1);
        let zero = self.builder.ins().iconst(types::I64, 0);
        let is_zero = self.builder.ins().icmp_imm_s(IntCC::Equal, b, 0);
        let is_minus_one = self.builder.ins().icmp_imm_s(IntCC::Equal, b, -1);
        let special = self.builder.ins().bor(is_zero, is_minus_one);
        let divisor = self.builder.ins().select(special, one, b);
        let quotient = self.builder.ins().sdiv(a, divisor);
        let negated = self.builder.ins().ineg(a);
        let quotient = self.builder.ins().select(is_minus_one, negated, quotient);
        let quotient = self.builder.ins().select(is_zero, zero, quotient);
        let rest = self.builder.ins().srem(a, divisor);
        // Another sign than the divisor's: one divisor more.
        let signs = self.builder.ins().bxor(rest, divisor);
        let differs = self.builder.ins().icmp_imm_s(IntCC::SignedLessThan, signs, 0);
        let exact = self.builder.ins().icmp_imm_s(IntCC::Equal, rest, 0);
        let moved = self.builder.ins().iadd(rest, divisor);
        let moved = self.builder.ins().select(differs, moved, rest);
        let remainder = self.builder.ins().select(exact, zero, moved);
        (quotient, remainder)
    }

    pub(super) fn pow_int(&mut self, x: Value, n: i32) -> Value {
        let one = self.constant(1.0);
        let mut multiply = |a, b| self.builder.ins().fmul(a, b);
        let power = pow_int_steps(&mut multiply, x, n.unsigned_abs()).unwrap_or(one);
        if n < 0 { self.builder.ins().fdiv(one, power) } else { power }
    }

    fn sign(&mut self, a: Value) -> Value {
        let [zero, one, minus_one] = [0.0, 1.0, -1.0].map(|x| self.constant(x));
        let negative = self.builder.ins().fcmp(FloatCC::LessThan, a, zero);
        let positive = self.builder.ins().fcmp(FloatCC::GreaterThan, a, zero);
        // 0 at 0 of either sign, and NaN at NaN.
        let neither = self.builder.ins().fadd(a, zero);
        let rest = self.select(negative, minus_one, neither);
        self.select(positive, one, rest)
    }

    fn zero_where_zero(&mut self, a: Value, otherwise: Value) -> Value {
        let zero = self.constant(0.0);
        let is_zero = self.builder.ins().fcmp(FloatCC::Equal, a, zero);
        self.select(is_zero, zero, otherwise)
    }

    pub(super) fn compare(&mut self, op: Compare, ty: Type, a: Value, b: Value) -> Value {
        if ty == Type::Real {
            let condition = match op {
                Compare::Eq => FloatCC::Equal,
                Compare::Ne => FloatCC::NotEqual,
                Compare::Lt => FloatCC::LessThan,
                Compare::Le => FloatCC::LessThanOrEqual,
                Compare::Gt => FloatCC::GreaterThan,
                Compare::Ge => FloatCC::GreaterThanOrEqual,
            };
            return self.builder.ins().fcmp(condition, a, b);
        }
        let condition = match op {
            Compare::Eq => IntCC::Equal,
            Compare::Ne => IntCC::NotEqual,
            Compare::Lt => IntCC::SignedLessThan,
            Compare::Le => IntCC::SignedLessThanOrEqual,
            Compare::Gt => IntCC::SignedGreaterThan,
            Compare::Ge => IntCC::SignedGreaterThanOrEqual,
        };
        self.builder.ins().icmp(condition, a, b)
    }
}
