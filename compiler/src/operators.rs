//! The operations on numbers and truth values, which the typed tree and the IR have in common.

/// Operations of one operand: Real, but for Not (Bool), ToReal (Int), and Neg and Abs in the typed tree (also Int).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "they are their names")]
pub enum Unary {
    Neg,
    Abs,
    /// -1, 0 or 1, and NaN at NaN; 0 at 0: the derivative of abs.
    Sign,
    Sqrt,
    Exp,
    Ln,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Floor,
    Ceil,
    /// Half away from zero.
    Round,
    /// Stop-gradient: Real unchanged, derivative zero; `stop(x)`.
    Stop,
    Not,
    /// Int to Real.
    ToReal,
    /// Real to Int, towards zero, saturating; NaN gives 0.
    ToInt,
}

/// Operations of two operands of one type: Real, or Int where noted; And and Or on Bool.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "they are their names")]
pub enum Binary {
    /// Real or Int.
    Add,
    /// Real or Int.
    Sub,
    /// Real or Int.
    Mul,
    /// Real, or Int towards zero (0 where the divisor is 0: the lowering guards it).
    Div,
    /// Remainder with the divisor's sign (Real or Int), so that x % n is periodic in x; Int: 0 where the divisor is 0.
    Rem,
    /// Real.
    Pow,
    /// Real.
    Atan2,
    /// Real or Int.
    Min,
    /// Real or Int.
    Max,
    /// a * b, but 0 where a is 0 even if b is infinite or NaN: a tangent that is zero stays zero at a pole.
    MulOrZero,
    /// a / b, but 0 where a is 0 even if b is 0 or NaN.
    DivOrZero,
    /// The first operand, a coordinate of a surface that is there where the second is positive; `keep(point, where)`.
    /// The second becomes a function of its own (`ir::keep`) before anything is run.
    Keep,
    And,
    Or,
}

/// Comparisons; false where either is NaN, but for Ne.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "they are their names")]
pub enum Compare {
    Eq,
    Ne,
    Lt,
    Le,
    Gt,
    Ge,
}

impl Compare {
    /// As it is written.
    #[must_use]
    pub fn sign(self) -> &'static str {
        match self {
            Compare::Eq => "==",
            Compare::Ne => "!=",
            Compare::Lt => "<",
            Compare::Le => "<=",
            Compare::Gt => ">",
            Compare::Ge => ">=",
        }
    }

    /// Whether it is true of two values.
    #[must_use]
    pub fn holds<T: PartialOrd>(self, a: T, b: T) -> bool {
        match self {
            Compare::Eq => a == b,
            Compare::Ne => a != b,
            Compare::Lt => a < b,
            Compare::Le => a <= b,
            Compare::Gt => a > b,
            Compare::Ge => a >= b,
        }
    }
}
