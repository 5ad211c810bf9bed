//! Values that are known while compiling.

use super::context::Checker;
use super::finish;
use super::typed::{self, Binary, Expr, ExprKind, Local, LocalId, Model, Param, Statement, Type, Unary};
use super::types::Exponent;
use crate::syntax::ast::BinaryOp;
use std::collections::HashSet;

/// Computes the values of locals that the body of a model without parameters binds, each a number; or says why one has
/// no value. The checker itself evaluates literals only: later stages can run a model, and the caller hands them in.
pub type Evaluate = fn(&Model, &[LocalId]) -> Vec<Result<f64, String>>;

impl Checker<'_> {
    /// The finite values of numeric expressions of a model's body, where `lets` bind what they use. The parameters
    /// `free` have no value.
    pub(super) fn evaluate<'e>(
        &self,
        mut lets: Vec<(LocalId, &'e Expr)>,
        free: &[&Param],
        exprs: &[&'e Expr],
    ) -> Vec<Result<f64, String>> {
        let first = self.locals.len();
        let locals = (first..).map(|local| LocalId(local as u32)).zip(exprs.iter().copied());
        let computed: Vec<(LocalId, &Expr)> = locals.filter(|(_, e)| constant(e).is_none()).collect();
        lets.extend(&computed);
        let computed: Vec<LocalId> = computed.into_iter().map(|(local, _)| local).collect();
        let mut values = self.computed(lets, free, exprs, &computed).into_iter();
        let value = |e: &&Expr| match constant(e) {
            Some(x) if x.is_finite() => Ok(x),
            Some(_) => Err("its value is not finite".to_owned()),
            None => values.next().unwrap_or_else(|| Err("it cannot be evaluated".to_owned())),
        };
        exprs.iter().map(value).collect()
    }

    /// The values of those locals that are not literals; the expressions are those of new locals.
    fn computed(
        &self,
        lets: Vec<(LocalId, &Expr)>,
        free: &[&Param],
        exprs: &[&Expr],
        asked: &[LocalId],
    ) -> Vec<Result<f64, String>> {
        if asked.is_empty() {
            return Vec::new();
        }
        let none = |reason: String| vec![Err(reason); asked.len()];
        let mut needed: HashSet<LocalId> = asked.iter().copied().collect();
        let body = typed::needed_lets(lets.into_iter(), &mut needed);
        if let Some(param) = free.iter().find(|p| needed.contains(&p.local)) {
            return none(format!("it depends on the parameter '{}'", param.declared.name));
        }
        let body = body.into_iter().map(|(local, e)| Statement::Let(local, e.clone())).collect();
        let mut model = Model { body, ..Model::default() };
        finish::finish(self, &mut model);
        let functions = model.functions.values().map(|f| &f.body);
        if model.body.iter().map(Statement::expr).chain(functions).any(has_error) {
            return none("it has errors".to_owned());
        }
        let local = |e: &&Expr| Local { name: "constant".to_owned(), ty: e.ty.clone(), span: e.span };
        model.locals.extend(exprs.iter().map(local));
        (self.evaluate)(&model, asked)
    }
}

/// Whether there is an error in an expression.
fn has_error(e: &Expr) -> bool {
    let mut found = e.ty.is_error();
    e.for_each_child(&mut |child| found |= has_error(child));
    found
}

/// An operator on two known ints; `None` where the result is a real, which is not tracked.
pub(super) fn int_binary(op: BinaryOp, a: i64, b: i64) -> Result<Option<Type>, &'static str> {
    const LARGE: &str = "this whole number is too large";
    let value = match op {
        BinaryOp::Add => a.checked_add(b).ok_or(LARGE)?,
        BinaryOp::Sub => a.checked_sub(b).ok_or(LARGE)?,
        BinaryOp::Mul => a.checked_mul(b).ok_or(LARGE)?,
        BinaryOp::Rem if b == 0 => return Err("the remainder of a division by 0 is not defined"),
        // With the divisor's sign, as for reals.
        BinaryOp::Rem => match a.checked_rem(b).unwrap_or(0) {
            r if r != 0 && (r < 0) != (b < 0) => r + b,
            r => r,
        },
        BinaryOp::Pow if b < 0 => return Ok(None),
        BinaryOp::Pow => match (a, u32::try_from(b)) {
            (0 | 1, _) if b > 0 => a,
            (-1, _) => 1 - 2 * (b % 2),
            (_, Ok(b)) => a.checked_pow(b).ok_or(LARGE)?,
            (_, Err(_)) => return Err(LARGE),
        },
        BinaryOp::Div if b == 0 => return Err("division by 0"),
        BinaryOp::Div => return Ok(None),
        BinaryOp::Compare(op) => return Ok(Some(Type::Bool(Some(op.holds(a, b))))),
        BinaryOp::And | BinaryOp::Or | BinaryOp::Common => return Ok(None),
    };
    Ok(Some(Type::Int(Some(value))))
}

/// The value of a constant exponent as a fraction, such as `0.5` or `2/3`.
pub(super) fn exponent_of(e: &Expr) -> Option<Exponent> {
    let x = constant(e)?;
    (1..=12).find_map(|denominator| {
        let numerator = x * f64::from(denominator);
        let close = (numerator - numerator.round()).abs() < 1e-12 * numerator.abs().max(1.0);
        if close && numerator.abs() < 1e4 {
            Exponent::new(numerator.round() as i64, i64::from(denominator))
        } else {
            None
        }
    })
}

/// The value of an expression made of literals.
pub(super) fn constant(e: &Expr) -> Option<f64> {
    match &e.kind {
        // Whole numbers may be too large, which the evaluation says.
        ExprKind::Unary(..) | ExprKind::Binary(..) if matches!(e.ty, Type::Int(_)) => None,
        ExprKind::Real(x) => Some(*x),
        ExprKind::Int(k) => Some(*k as f64),
        ExprKind::Bool(b) => Some(f64::from(*b)),
        ExprKind::Convert(e) => constant(e),
        ExprKind::Unary(Unary::Neg, e) => Some(-constant(e)?),
        ExprKind::Binary(op, a, b) => {
            let (a, b) = (constant(a)?, constant(b)?);
            match op {
                Binary::Add => Some(a + b),
                Binary::Sub => Some(a - b),
                Binary::Mul => Some(a * b),
                Binary::Div => Some(a / b),
                _ => None,
            }
        }
        _ => None,
    }
}
