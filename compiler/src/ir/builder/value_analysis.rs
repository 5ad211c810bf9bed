//! Value analysis: properties of Real values that follow from the operations that compute them.

use crate::ir::{Binary, Op, Unary, Value};

/// Properties of a value; a property holds where it is true and is unknown where it is false. Overflow is ignored:
/// exp(x) counts as finite.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Properties {
    /// Neither infinite nor NaN.
    pub(super) finite: bool,
    /// Not below zero (or NaN).
    pub(super) nonnegative: bool,
    /// Not zero (or NaN).
    pub(super) nonzero: bool,
}

impl Properties {
    fn constant(x: f64) -> Properties {
        Properties { finite: x.is_finite(), nonnegative: x >= 0.0, nonzero: x != 0.0 }
    }

    /// Above zero, and not NaN.
    pub(super) fn is_positive(self) -> bool {
        self.finite && self.nonnegative && self.nonzero
    }

    /// The properties of an operation's value, from those of its operands.
    pub(super) fn of(op: &Op, operand: impl Fn(Value) -> Properties) -> Properties {
        match *op {
            Op::Real(bits) => Properties::constant(f64::from_bits(bits)),
            Op::Unary(op, a) => unary(op, operand(a)),
            Op::Binary(op, a, b) => binary(op, operand(a), operand(b), a == b),
            Op::PowInt(a, n) => {
                let a = operand(a);
                Properties {
                    finite: a.finite && (n >= 0 || a.nonzero),
                    nonnegative: n % 2 == 0 || a.nonnegative,
                    nonzero: a.nonzero,
                }
            }
            Op::Select(_, a, b) => both(operand(a), operand(b)),
            Op::Guard { value, .. } => operand(value),
            _ => Properties::default(),
        }
    }
}

fn both(a: Properties, b: Properties) -> Properties {
    Properties {
        finite: a.finite && b.finite,
        nonnegative: a.nonnegative && b.nonnegative,
        nonzero: a.nonzero && b.nonzero,
    }
}

fn unary(op: Unary, a: Properties) -> Properties {
    let finite = a.finite;
    let unknown = Properties { finite, ..Properties::default() };
    match op {
        Unary::Neg => Properties { nonzero: a.nonzero, ..unknown },
        Unary::Abs => Properties { nonnegative: true, nonzero: a.nonzero, finite },
        Unary::Stop => a,
        Unary::Sqrt => Properties { finite: finite && a.nonnegative, nonnegative: true, nonzero: a.nonzero },
        Unary::Exp | Unary::Cosh => Properties { finite, nonnegative: true, nonzero: true },
        Unary::Sign | Unary::Atan | Unary::Sinh | Unary::Tanh => a,
        Unary::Floor | Unary::Ceil | Unary::Round => Properties { nonnegative: a.nonnegative, ..unknown },
        Unary::Sin | Unary::Cos | Unary::Tan => unknown,
        Unary::ToReal => Properties { finite: true, ..Properties::default() },
        Unary::Ln | Unary::Asin | Unary::Acos | Unary::Not | Unary::ToInt => Properties::default(),
    }
}

fn binary(op: Binary, a: Properties, b: Properties, same: bool) -> Properties {
    let finite = a.finite && b.finite;
    let unknown = Properties { finite, ..Properties::default() };
    match op {
        Binary::Add => {
            let nonnegative = a.nonnegative && b.nonnegative;
            Properties { finite, nonnegative, nonzero: nonnegative && (a.nonzero || b.nonzero) }
        }
        Binary::Mul => Properties {
            finite,
            nonnegative: same || (a.nonnegative && b.nonnegative),
            nonzero: a.nonzero && b.nonzero,
        },
        Binary::Div => Properties {
            finite: finite && b.nonzero,
            nonnegative: a.nonnegative && b.nonnegative,
            nonzero: a.nonzero && b.finite,
        },
        Binary::Pow => Properties {
            finite: finite && a.nonnegative && a.nonzero,
            nonnegative: a.nonnegative,
            nonzero: a.nonnegative && a.nonzero && b.finite,
        },
        Binary::MulOrZero => Properties { nonnegative: a.nonnegative && b.nonnegative, ..unknown },
        Binary::DivOrZero => {
            Properties { finite: finite && b.nonzero, nonnegative: a.nonnegative && b.nonnegative, nonzero: false }
        }
        Binary::Min | Binary::Max => both(a, b),
        Binary::Keep => a,
        Binary::Sub | Binary::Atan2 => unknown,
        Binary::Rem | Binary::And | Binary::Or => Properties::default(),
    }
}
