//! What is known of a real value without running anything.

use super::{Binary, Op, Unary, Value};

/// True where proved. Overflow is left out of account: exp(x) counts as finite.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Facts {
    /// Neither infinite nor NaN.
    pub(super) finite: bool,
    /// Not below zero (or NaN).
    pub(super) nonnegative: bool,
    /// Not zero (or NaN).
    pub(super) nonzero: bool,
}

impl Facts {
    /// Of a constant.
    fn constant(x: f64) -> Facts {
        Facts { finite: x.is_finite(), nonnegative: x >= 0.0, nonzero: x != 0.0 }
    }

    /// Of an operation, from those of its operands.
    pub(super) fn of(op: &Op, facts: impl Fn(Value) -> Facts) -> Facts {
        match *op {
            Op::Real(bits) => Facts::constant(f64::from_bits(bits)),
            Op::Unary(op, a) => unary(op, facts(a)),
            Op::Binary(op, a, b) => binary(op, facts(a), facts(b), a == b),
            Op::PowInt(a, n) => {
                let a = facts(a);
                Facts {
                    finite: a.finite && (n >= 0 || a.nonzero),
                    nonnegative: n % 2 == 0 || a.nonnegative,
                    nonzero: a.nonzero,
                }
            }
            Op::Select(_, a, b) => both(facts(a), facts(b)),
            Op::Guard { value, .. } => facts(value),
            _ => Facts::default(),
        }
    }
}

fn both(a: Facts, b: Facts) -> Facts {
    Facts { finite: a.finite && b.finite, nonnegative: a.nonnegative && b.nonnegative, nonzero: a.nonzero && b.nonzero }
}

fn unary(op: Unary, a: Facts) -> Facts {
    let finite = a.finite;
    let unknown = Facts { finite, ..Facts::default() };
    match op {
        Unary::Neg => Facts { nonzero: a.nonzero, ..unknown },
        Unary::Abs => Facts { nonnegative: true, nonzero: a.nonzero, finite },
        Unary::Stop => a,
        Unary::Sqrt => Facts { finite: finite && a.nonnegative, nonnegative: true, nonzero: a.nonzero },
        Unary::Exp | Unary::Cosh => Facts { finite, nonnegative: true, nonzero: true },
        Unary::Sign | Unary::Atan | Unary::Sinh | Unary::Tanh => a,
        Unary::Floor | Unary::Ceil | Unary::Round => Facts { nonnegative: a.nonnegative, ..unknown },
        Unary::Sin | Unary::Cos | Unary::Tan => unknown,
        Unary::ToReal => Facts { finite: true, ..Facts::default() },
        Unary::Ln | Unary::Asin | Unary::Acos | Unary::Not | Unary::ToInt => Facts::default(),
    }
}

fn binary(op: Binary, a: Facts, b: Facts, same: bool) -> Facts {
    let finite = a.finite && b.finite;
    let unknown = Facts { finite, ..Facts::default() };
    match op {
        Binary::Add => {
            let nonnegative = a.nonnegative && b.nonnegative;
            Facts { finite, nonnegative, nonzero: nonnegative && (a.nonzero || b.nonzero) }
        }
        Binary::Mul => {
            Facts { finite, nonnegative: same || (a.nonnegative && b.nonnegative), nonzero: a.nonzero && b.nonzero }
        }
        Binary::Div => Facts {
            finite: finite && b.nonzero,
            nonnegative: a.nonnegative && b.nonnegative,
            nonzero: a.nonzero && b.finite,
        },
        Binary::Pow => Facts {
            finite: finite && a.nonnegative && a.nonzero,
            nonnegative: a.nonnegative,
            nonzero: a.nonnegative && a.nonzero && b.finite,
        },
        Binary::MulOrZero => Facts { nonnegative: a.nonnegative && b.nonnegative, ..unknown },
        Binary::DivOrZero => {
            Facts { finite: finite && b.nonzero, nonnegative: a.nonnegative && b.nonnegative, nonzero: false }
        }
        Binary::Min | Binary::Max => both(a, b),
        Binary::Sub | Binary::Atan2 => unknown,
        Binary::Rem | Binary::And | Binary::Or => Facts::default(),
    }
}
