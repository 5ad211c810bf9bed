//! Operations that take one of several sides: where the side changes, the result or its derivative may jump.

use super::{Interpreter, Limits, RunError};
use crate::ir::scalar::Scalar;
use crate::ir::{FunctionId, Module, Op, Value};
use crate::operators::{Binary, Unary};
use crate::source::Span;

/// An operation that decided something in a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decision {
    /// Its place in the source.
    pub span: Span,
    /// Tells the sides apart.
    pub side: i64,
}

/// Whatever a run decides, in the order in which it does, and the number of nodes that it evaluates.
///
/// # Errors
/// As [`run`](super::run).
pub fn decisions(
    module: &Module,
    function: FunctionId,
    args: &[Scalar],
    limits: Limits,
) -> Result<(Vec<Decision>, u64), RunError> {
    let mut interpreter = Interpreter { decisions: Some(Vec::new()), ..Interpreter::new(module, limits) };
    interpreter.check(function, args)?;
    interpreter.run(function, args.to_vec(), Span::default())?;
    Ok((interpreter.decisions.unwrap_or_default(), limits.steps - interpreter.steps))
}

impl Op {
    /// Whether it takes one of several sides. (`If` and `Select` follow a comparison, which is what decides.)
    #[must_use]
    pub fn decides(&self) -> bool {
        match self {
            Op::Compare(..) => true,
            Op::Unary(op, _) => {
                matches!(op, Unary::Abs | Unary::Sign | Unary::Floor | Unary::Ceil | Unary::Round | Unary::ToInt)
            }
            Op::Binary(op, ..) => matches!(op, Binary::Min | Binary::Max | Binary::Rem | Binary::Atan2),
            _ => false,
        }
    }
}

/// The side that an operation takes; `None` of one that does not decide.
pub(super) fn side(op: &Op, result: Scalar, get: impl Fn(Value) -> Option<Scalar>) -> Option<i64> {
    if !op.decides() {
        return None;
    }
    let real = |v: Value| get(v).and_then(Scalar::real);
    match *op {
        Op::Unary(Unary::Abs, a) => Some(i64::from(real(a)? < 0.0)),
        Op::Binary(Binary::Min | Binary::Max, a, b) => Some(i64::from(real(a)? < real(b)?)),
        Op::Binary(Binary::Rem, a, b) => Some((real(a)? / real(b)?).floor() as i64),
        // The branch cut is the half of the x axis to the left.
        Op::Binary(Binary::Atan2, y, x) => Some(i64::from(real(x)? < 0.0 && real(y)? < 0.0)),
        _ => match result {
            Scalar::Bool(holds) => Some(i64::from(holds)),
            Scalar::Int(i) => Some(i),
            Scalar::Real(x) => Some(x as i64),
        },
    }
}
