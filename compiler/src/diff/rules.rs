//! The derivative of every operation, once for both directions.
//!
//! An operation's derivative is linear, so a rule is a factor for each operand: the tangent of the result is the sum
//! of `factor(tangent of the operand)`, and the adjoint of an operand is `factor(adjoint of the result)`.
//!
//! At a pole of the derivative a tangent that is zero stays zero and any other gives an infinity or NaN, which is
//! then reported: sqrt and ln at 0, asin and acos at 1 and -1, atan2 at (0, 0), x^y at x = 0 with y < 1, division by 0.
//! By convention (LANGUAGE): abs' is 0 at 0, min and max split a tie in half, the derivative of x^y by y is 0 where x
//! is 0 and y > 0, and floor, ceil, round, sign and stop have the derivative 0 everywhere.

use crate::ir::{Binary, Compare, FunctionBuilder, Op, Unary, Value};

/// The partial derivative by an operand, as the factor of its tangent t.
#[derive(Clone, Copy, Debug)]
pub(super) enum Factor {
    /// t.
    One,
    /// -t.
    Minus,
    /// t * v; v is finite wherever the operation is.
    Times(Value),
    /// t * v, but 0 where t is.
    TimesOrZero(Value),
    /// t / v, but 0 where t is.
    Over(Value),
    /// v * t, but 0 where v is: for an operation that is itself 0 there whatever its other operand.
    Scaling(Value),
}

/// The rule by which an operation is differentiated.
#[derive(Clone, Debug)]
pub(super) enum Rule {
    /// By a factor for each operand, with its position.
    Linear(Vec<(usize, Factor)>),
    /// Like operand 1 where the condition holds, else like operand 2.
    Select(Value),
    /// Like operand 0 where the first condition holds, like operand 1 where the second does, else half of each.
    Extreme(Value, Value),
}

impl Factor {
    /// Applies it to a tangent or adjoint. Where `masked`, a zero may stand for "not taken": then a factor that is
    /// infinite or NaN must not spoil it.
    pub(super) fn apply(self, b: &mut FunctionBuilder, t: Value, masked: bool) -> Value {
        match self {
            Factor::One => t,
            Factor::Minus => b.neg(t),
            Factor::Times(v) if !masked => b.mul(t, v),
            Factor::Times(v) | Factor::TimesOrZero(v) => b.binary(Binary::MulOrZero, t, v),
            Factor::Over(v) => b.binary(Binary::DivOrZero, t, v),
            Factor::Scaling(v) => {
                let product = b.binary(Binary::MulOrZero, v, t);
                if !masked {
                    return product;
                }
                let zero = b.real(0.0);
                let nothing = b.compare(Compare::Eq, t, zero);
                b.select(nothing, zero, product)
            }
        }
    }
}

/// The rule of an operation that runs no function. `result` is its value; `needed` says for which operands a factor is
/// needed (a rule may leave out the others).
pub(super) fn rule(b: &mut FunctionBuilder, op: &Op, result: Value, needed: &[bool]) -> Rule {
    match *op {
        Op::Unary(op, x) => Rule::Linear(unary(b, op, x, result).map(|f| (0, f)).into_iter().collect()),
        Op::Binary(Binary::Min, x, y) => {
            let (first, second) = (b.compare(Compare::Lt, x, y), b.compare(Compare::Lt, y, x));
            Rule::Extreme(first, second)
        }
        Op::Binary(Binary::Max, x, y) => {
            let (first, second) = (b.compare(Compare::Lt, y, x), b.compare(Compare::Lt, x, y));
            Rule::Extreme(first, second)
        }
        Op::Binary(op, x, y) => {
            let mut factors = Vec::new();
            for (position, _) in needed.iter().enumerate().filter(|(_, n)| **n) {
                factors.extend(binary(b, op, [x, y], result, position).map(|f| (position, f)));
            }
            Rule::Linear(factors)
        }
        Op::PowInt(x, n) => {
            let power = b.pow_int(x, n - 1);
            let n_real = b.real(f64::from(n));
            let partial = b.mul(n_real, power);
            let factor = if n < 1 { Factor::TimesOrZero(partial) } else { Factor::Times(partial) };
            Rule::Linear(vec![(0, factor)])
        }
        Op::Select(condition, ..) => Rule::Select(condition),
        Op::Guard { .. } => Rule::Linear(vec![(0, Factor::One)]),
        _ => Rule::Linear(Vec::new()),
    }
}

fn unary(b: &mut FunctionBuilder, op: Unary, x: Value, result: Value) -> Option<Factor> {
    let one = b.real(1.0);
    Some(match op {
        Unary::Neg => Factor::Minus,
        Unary::Abs => Factor::Times(b.unary(Unary::Sign, x)),
        Unary::Sqrt => {
            let half = b.real(0.5);
            Factor::TimesOrZero(b.div(half, result))
        }
        Unary::Exp => Factor::Times(result),
        Unary::Ln => Factor::Over(x),
        Unary::Sin => Factor::Times(b.unary(Unary::Cos, x)),
        Unary::Cos => {
            let sin = b.unary(Unary::Sin, x);
            Factor::Times(b.neg(sin))
        }
        Unary::Tan => {
            let square = b.pow_int(result, 2);
            Factor::Times(b.add(square, one))
        }
        Unary::Asin => Factor::Over(root_of_one_minus_square(b, x)),
        Unary::Acos => {
            let root = root_of_one_minus_square(b, x);
            Factor::Over(b.neg(root))
        }
        Unary::Atan => {
            let square = b.pow_int(x, 2);
            Factor::Over(b.add(square, one))
        }
        Unary::Sinh => Factor::Times(b.unary(Unary::Cosh, x)),
        Unary::Cosh => Factor::Times(b.unary(Unary::Sinh, x)),
        Unary::Tanh => {
            let square = b.pow_int(result, 2);
            Factor::Times(b.sub(one, square))
        }
        Unary::Sign
        | Unary::Floor
        | Unary::Ceil
        | Unary::Round
        | Unary::Stop
        | Unary::Not
        | Unary::ToReal
        | Unary::ToInt => return None,
    })
}

/// sqrt(1 - x^2), without cancellation near x = 1 and -1.
fn root_of_one_minus_square(b: &mut FunctionBuilder, x: Value) -> Value {
    let one = b.real(1.0);
    let (less, more) = (b.sub(one, x), b.add(one, x));
    let product = b.mul(less, more);
    b.unary(Unary::Sqrt, product)
}

fn binary(b: &mut FunctionBuilder, op: Binary, [x, y]: [Value; 2], result: Value, position: usize) -> Option<Factor> {
    let first = position == 0;
    Some(match op {
        Binary::Add => Factor::One,
        Binary::Sub => {
            if first {
                Factor::One
            } else {
                Factor::Minus
            }
        }
        Binary::Mul => Factor::Times(if first { y } else { x }),
        Binary::Div if first => Factor::Over(y),
        Binary::Div => {
            let quotient = b.div(result, y);
            Factor::TimesOrZero(b.neg(quotient))
        }
        // a - b * floor(a / b).
        Binary::Rem if first => Factor::One,
        Binary::Rem => {
            let quotient = b.div(x, y);
            let whole = b.unary(Unary::Floor, quotient);
            Factor::Times(b.neg(whole))
        }
        Binary::Pow if first => {
            let one = b.real(1.0);
            let less = b.sub(y, one);
            let power = b.pow(x, less);
            Factor::TimesOrZero(b.binary(Binary::MulOrZero, y, power))
        }
        Binary::Pow => {
            let ln = b.unary(Unary::Ln, x);
            Factor::TimesOrZero(b.binary(Binary::MulOrZero, result, ln))
        }
        // d atan2(y, x) = dy x / (x^2 + y^2) - dx y / (x^2 + y^2); here x is the first argument.
        Binary::Atan2 => {
            let (xx, yy) = (b.pow_int(x, 2), b.pow_int(y, 2));
            let square = b.add(xx, yy);
            let numerator = if first { y } else { b.neg(x) };
            Factor::TimesOrZero(b.div(numerator, square))
        }
        Binary::MulOrZero if first => Factor::TimesOrZero(y),
        Binary::MulOrZero => Factor::Scaling(x),
        Binary::DivOrZero if first => Factor::Over(y),
        Binary::DivOrZero => {
            let quotient = b.binary(Binary::DivOrZero, result, y);
            Factor::Scaling(b.neg(quotient))
        }
        Binary::Keep if first => Factor::One,
        Binary::Keep | Binary::Min | Binary::Max | Binary::And | Binary::Or => return None,
    })
}
