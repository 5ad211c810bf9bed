//! Bounds on the magnitudes of values, from bounds on the magnitudes of arguments (interval arithmetic).

use super::{Binary, Function, Op, Type, Unary};

/// Values below this are far from overflow, whatever rounding did to the bound.
pub(super) const SAFE: f64 = 1e300;

/// Whether [`stays_finite`] applies to a function: its operations take finite values to finite ones except for
/// overflow.
#[must_use]
pub(crate) fn is_bounded(function: &Function) -> bool {
    function.nodes.iter().all(|node| match &node.op {
        Op::Param(_) | Op::Real(_) => node.ty == Type::Real,
        Op::Unary(op, _) => {
            use Unary::{Abs, Ceil, Cos, Floor, Neg, Not, Round, Sign, Sin, Stop};
            node.ty != Type::Int && matches!(op, Abs | Ceil | Cos | Floor | Neg | Not | Round | Sign | Sin | Stop)
        }
        Op::Binary(op, ..) => {
            use Binary::{Add, And, Max, Min, Mul, MulOrZero, Or, Sub};
            node.ty != Type::Int && matches!(op, Add | And | Max | Min | Mul | MulOrZero | Or | Sub)
        }
        Op::PowInt(_, n) => *n >= 0,
        Op::Compare(..) | Op::Bool(_) | Op::Select(..) | Op::Guard { .. } => node.ty != Type::Int,
        _ => false,
    })
}

/// Whether all values of a bounded function are finite for all arguments of at most these magnitudes.
#[must_use]
pub(crate) fn stays_finite(function: &Function, arguments: &[f64]) -> bool {
    let mut bounds: Vec<f64> = Vec::with_capacity(function.nodes.len());
    for node in &function.nodes {
        let bound_of = |v: &super::Value| bounds[v.0 as usize];
        let bound = match &node.op {
            Op::Param(i) => arguments[*i as usize].abs(),
            Op::Real(bits) => f64::from_bits(*bits).abs(),
            Op::Unary(Unary::Sin | Unary::Cos | Unary::Sign, _) => 1.0,
            Op::Unary(Unary::Floor | Unary::Ceil | Unary::Round, a) => bound_of(a) + 1.0,
            Op::Unary(_, a) => bound_of(a),
            Op::Binary(Binary::Add | Binary::Sub, a, b) => bound_of(a) + bound_of(b),
            Op::Binary(Binary::Mul | Binary::MulOrZero, a, b) => bound_of(a) * bound_of(b),
            Op::Binary(_, a, b) | Op::Select(_, a, b) => bound_of(a).max(bound_of(b)),
            Op::PowInt(a, n) => bound_of(a).max(1.0).powi(*n),
            Op::Guard { value, .. } => bound_of(value),
            _ => 0.0,
        };
        if !(bound < SAFE) {
            return false;
        }
        bounds.push(bound);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::tests::function_of;

    #[test]
    fn sums_and_products_are_bounded_by_their_magnitudes() {
        let (module, id) = function_of(&["a", "b"], |b, p| {
            let product = b.mul(p[0], p[1]);
            let cube = b.pow_int(product, 3);
            b.sub(cube, p[0])
        });
        let function = module.function(id);
        assert!(is_bounded(function));
        assert!(stays_finite(function, &[1e60, -1e30]));
        assert!(!stays_finite(function, &[1e80, 1e30]));
        assert!(!stays_finite(function, &[f64::NAN, 1.0]));
        assert!(!stays_finite(function, &[1.0, f64::INFINITY]));
    }

    #[test]
    fn quotients_and_roots_are_not() {
        let (module, id) = function_of(&["a", "b"], |b, p| b.div(p[0], p[1]));
        assert!(!is_bounded(module.function(id)));
        let (module, id) = function_of(&["a"], |b, p| b.unary(Unary::Sqrt, p[0]));
        assert!(!is_bounded(module.function(id)));
    }
}
