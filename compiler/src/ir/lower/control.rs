//! Branches, loops and indexing.

use super::free::Free;
use super::need::known_index;
use super::{Frame, SizeError};
use crate::check::typed::{Binary, Expr, ExprKind, LocalId, Statement, Type, Unary};
use crate::ir::scalar::Scalar;
use crate::ir::{self, Failure, Value};
use std::ops::Range;

/// Most operations in the two sides of an `if` that are computed whether they are taken or not.
const CHEAP: usize = 12;

impl<'m> Frame<'_, 'm> {
    pub(super) fn if_(
        &mut self,
        expr: &'m Expr,
        condition: &'m Expr,
        then: &'m Expr,
        otherwise: &'m Expr,
    ) -> Result<Vec<Value>, SizeError> {
        let condition = self.scalar(condition)?;
        if let Some(Scalar::Bool(holds)) = self.b.constant(condition) {
            return self.expr(if holds { then } else { otherwise });
        }
        let mut budget = CHEAP;
        if is_cheap(then, &mut budget) && is_cheap(otherwise, &mut budget) {
            let (a, b) = (self.expr(then)?, self.expr(otherwise)?);
            self.b.set_span(expr.span);
            return Ok(a.into_iter().zip(b).map(|(a, b)| self.b.select(condition, a, b)).collect());
        }
        let outer = self.outer_locals(&[then, otherwise], &[])?;
        let then = self.child("then", &outer.passed, &outer.constants, false).add(then)?;
        let otherwise = self.child("else", &outer.passed, &outer.constants, false).add(otherwise)?;
        self.b.set_span(expr.span);
        let results = self.lowerer.model.scalars(&expr.ty);
        Ok(self.b.if_(condition, then, otherwise, outer.args, &results))
    }

    pub(super) fn fold(&mut self, expr: &'m Expr) -> Result<Vec<Value>, SizeError> {
        let ExprKind::Fold { from, to, init, index, accumulator, body } = &expr.kind else {
            return self.expr(expr);
        };
        let (from, to, init) = (self.scalar(from)?, self.scalar(to)?, self.expr(init)?);
        self.b.set_span(expr.span);
        let count = self.count(from, to);
        let OuterLocals { constants, passed, args: invariant } = self.outer_locals(&[body], &[*index, *accumulator])?;
        let start = self.b.constant(from);
        let locals: Vec<LocalId> = [*index, *accumulator].into_iter().chain(passed).collect();
        let mut frame = self.child("fold", &locals, &constants, start.is_none());
        // The loop counts from 0.
        let i = frame.local(*index)?[0];
        frame.index = Some(i);
        let first = match start {
            Some(start) => frame.b.scalar(start),
            None => frame.b.param(frame.b.params().len() - 1),
        };
        let i = frame.b.add(i, first);
        frame.needs.bind(*index, vec![i]);
        let body = frame.add(body)?;
        let invariant = if start.is_none() { invariant.into_iter().chain([from]).collect() } else { invariant };
        Ok(self.b.loop_(count, body, init, invariant))
    }

    /// The element of an array at an int that is not known at compile time, by binary search with selections: one
    /// selection an element, at logarithmic depth.
    pub(super) fn index(&mut self, expr: &'m Expr, array: &'m Expr, index: &'m Expr) -> Result<Vec<Value>, SizeError> {
        if let Some(k) = known_index(array, index) {
            return self.element(array, k);
        }
        let (values, index) = (self.expr(array)?, self.scalar(index)?);
        self.b.set_span(expr.span);
        let (_, width) = self.lowerer.model.component(&array.ty, 0);
        let length = self.length(array);
        if let Some(Scalar::Int(i)) = self.b.constant(index)
            && let Some(i) = usize::try_from(i).ok().filter(|i| *i < length)
        {
            return Ok(values[i * width..(i + 1) * width].to_vec());
        }
        let mut picked = match length {
            // Nothing can be picked; the guard fails before the values are used.
            0 => self.zeros(expr),
            _ => (0..width).map(|k| self.pick(&values, width, k, index, 0..length)).collect(),
        };
        let (zero, end) = (self.b.int(0), self.b.int(length as i64));
        let (from, to) = (self.b.compare(ir::Compare::Ge, index, zero), self.b.compare(ir::Compare::Lt, index, end));
        let inside = self.b.binary(ir::Binary::And, from, to);
        let message = format!("index out of range: the array has {length} elements, the first is [0]");
        let failure = self.lowerer.module.fail(Failure { span: expr.span, message });
        picked.iter_mut().for_each(|v| *v = self.b.guard(*v, inside, failure));
        Ok(picked)
    }

    fn length(&self, array: &Expr) -> usize {
        if let Type::Array(_, n) = &array.ty { *n } else { 0 }
    }

    fn pick(&mut self, values: &[Value], width: usize, k: usize, index: Value, range: Range<usize>) -> Value {
        if range.len() == 1 {
            return values[range.start * width + k];
        }
        let middle = range.start + range.len() / 2;
        let low = self.pick(values, width, k, index, range.start..middle);
        let high = self.pick(values, width, k, index, middle..range.end);
        let middle = self.b.int(middle as i64);
        let below = self.b.compare(ir::Compare::Lt, index, middle);
        self.b.select(below, low, high)
    }

    fn zeros(&mut self, expr: &'m Expr) -> Vec<Value> {
        let types = self.lowerer.model.scalars(&expr.ty);
        let zero = |ty| match ty {
            ir::Type::Int => self.b.int(0),
            ir::Type::Bool => self.b.bool(false),
            _ => self.b.real(0.0),
        };
        types.into_iter().map(zero).collect()
    }

    /// The locals that expressions use from outside, but for those that the caller binds.
    fn outer_locals(&mut self, exprs: &[&Expr], bound: &[LocalId]) -> Result<OuterLocals, SizeError> {
        let mut outer = OuterLocals::default();
        for local in Free::of(exprs, bound) {
            let values = self.local(local)?;
            match values.iter().map(|v| self.b.constant(*v)).collect::<Option<Vec<Scalar>>>() {
                Some(scalars) => outer.constants.push((local, scalars)),
                None => {
                    outer.passed.push(local);
                    outer.args.extend_from_slice(&values);
                }
            }
        }
        Ok(outer)
    }

    /// Starts a function within this one: of the locals' scalars and, if `start`, an int after them.
    fn child(&mut self, name: &str, params: &[LocalId], constants: &Constants, start: bool) -> Frame<'_, 'm> {
        let mut frame = self.lowerer.frame(name, params, start.then_some("from"));
        for (local, scalars) in constants {
            let values = scalars.iter().map(|s| frame.b.scalar(*s)).collect();
            frame.needs.bind(*local, values);
        }
        frame
    }
}

/// The locals that a function for some expressions takes from the one around it.
#[derive(Default)]
struct OuterLocals {
    /// The function binds these by itself.
    constants: Constants,
    /// The others, which are passed to it.
    passed: Vec<LocalId>,
    /// Their scalars.
    args: Vec<Value>,
}

/// Locals whose scalars are constants.
type Constants = Vec<(LocalId, Vec<Scalar>)>;

/// Whether an expression may be computed where its value is not needed: it has few operations, and all of them have
/// finite results and derivatives wherever their operands are finite. Each operation is taken off the budget.
fn is_cheap(expr: &Expr, budget: &mut usize) -> bool {
    let cost = match &expr.kind {
        ExprKind::Real(_) | ExprKind::Int(_) | ExprKind::Bool(_) | ExprKind::Text(_) | ExprKind::Local(_) => {
            return true;
        }
        // Whole numbers may be too large, which fails.
        ExprKind::Unary(Unary::Neg | Unary::Abs, _) | ExprKind::Binary(..) if matches!(expr.ty, Type::Int(None)) => {
            return false;
        }
        ExprKind::Convert(_) | ExprKind::Element(..) | ExprKind::Aggregate(_) => 0,
        ExprKind::Block(statements, _) if statements.iter().all(|s| matches!(s, Statement::Let(..))) => 0,
        ExprKind::Unary(Unary::Neg | Unary::Abs | Unary::Sign | Unary::Stop | Unary::Not, _)
        | ExprKind::Compare(..)
        | ExprKind::If(..) => 1,
        ExprKind::Binary(op, ..) if !matches!(op, Binary::Div | Binary::Rem | Binary::Pow | Binary::Atan2) => 1,
        _ => return false,
    };
    if *budget == 0 {
        return false;
    }
    *budget -= cost;
    let mut cheap = true;
    expr.for_each_child(&mut |e| cheap = cheap && is_cheap(e, budget));
    cheap
}
