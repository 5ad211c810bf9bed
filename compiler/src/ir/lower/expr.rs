//! Expressions.

use super::{Frame, SizeError};
use crate::check::typed::{Call, Expr, ExprKind, Statement, Type};
use crate::ir::{Failure, Unary, Value};

impl<'m> Frame<'_, 'm> {
    /// The scalars of an expression's value.
    pub(super) fn expr(&mut self, expr: &'m Expr) -> Result<Vec<Value>, SizeError> {
        self.check_size(expr.span)?;
        // The tree may be deeper than what a thread's stack has room for.
        stacker::maybe_grow(128 << 10, 2 << 20, || self.kind(expr))
    }

    fn kind(&mut self, expr: &'m Expr) -> Result<Vec<Value>, SizeError> {
        self.b.set_span(expr.span);
        Ok(match &expr.kind {
            ExprKind::Real(x) => vec![self.b.real(*x)],
            ExprKind::Int(i) => vec![self.b.int(*i)],
            ExprKind::Bool(b) => vec![self.b.bool(*b)],
            ExprKind::Text(_) => Vec::new(),
            ExprKind::Local(local) => self.local(*local)?.to_vec(),
            ExprKind::Convert(a) => self.convert(a, &expr.ty)?,
            ExprKind::Unary(op, a) => {
                let values = self.expr(a)?;
                self.b.set_span(expr.span);
                values.into_iter().map(|v| self.unary(*op, v)).collect()
            }
            ExprKind::Binary(op, a, b) => self.binary(*op, a, b, expr.span)?,
            ExprKind::Compare(op, a, b) => vec![self.compare(*op, a, b, expr.span)?],
            ExprKind::If(condition, then, otherwise) => self.if_(expr, condition, then, otherwise)?,
            ExprKind::Aggregate(items) => {
                let mut values = Vec::new();
                for item in items {
                    values.extend(self.expr(item)?);
                }
                values
            }
            ExprKind::Element(a, k) => self.element(a, *k)?,
            ExprKind::Index(a, i) => self.index(expr, a, i)?,
            ExprKind::Block(statements, value) => self.block(statements, value)?,
            ExprKind::Call(call) => {
                let args = self.arguments(call)?;
                self.b.set_span(expr.span);
                let function = self.lowerer.instance(call.function);
                let results = self.lowerer.model.scalars(&expr.ty);
                self.b.call(function, args, &results)
            }
            ExprKind::Derivative { call, wrt } => self.derivative(expr, call, *wrt)?,
            ExprKind::Fold { .. } => self.fold(expr)?,
        })
    }

    /// The value of an expression of one scalar.
    pub(super) fn scalar(&mut self, expr: &'m Expr) -> Result<Value, SizeError> {
        let values = self.expr(expr)?;
        debug_assert_eq!(values.len(), 1, "a scalar");
        Ok(values[0])
    }

    fn block(&mut self, statements: &'m [Statement], value: &'m Expr) -> Result<Vec<Value>, SizeError> {
        let mut guards = Vec::new();
        for statement in statements {
            match statement {
                Statement::Let(local, value) => self.bind_let(*local, value)?,
                Statement::Require { condition, message, span } => {
                    let condition = self.scalar(condition)?;
                    let failure = self.lowerer.module.fail(Failure { span: *span, message: message.clone() });
                    guards.push((condition, failure));
                }
            }
        }
        let mut values = self.expr(value)?;
        // Nodes are evaluated in their order: the first requirement is the first to fail.
        for (condition, failure) in guards {
            values.iter_mut().for_each(|v| *v = self.b.guard(*v, condition, failure));
        }
        Ok(values)
    }

    fn arguments(&mut self, call: &'m Call) -> Result<Vec<Value>, SizeError> {
        let mut values = Vec::new();
        for arg in call.closure.iter().map(|c| &**c).chain(&call.args) {
            values.extend(self.expr(arg)?);
        }
        Ok(values)
    }

    fn derivative(&mut self, expr: &'m Expr, call: &'m Call, wrt: usize) -> Result<Vec<Value>, SizeError> {
        let args = self.arguments(call)?;
        let model = self.lowerer.model;
        let before = call.closure.iter().map(|c| &**c).chain(&call.args[..wrt]);
        let index = before.map(|e| model.width(&e.ty)).sum::<usize>();
        self.b.set_span(expr.span);
        let one = self.b.real(1.0);
        let function = self.lowerer.instance(call.function);
        Ok(self.b.tangent(function, args, vec![(index as u32, one)], model.width(&expr.ty)))
    }

    /// Ints become reals where the type has reals.
    fn convert(&mut self, a: &'m Expr, ty: &Type) -> Result<Vec<Value>, SizeError> {
        use crate::ir::Type::{Int, Real};
        let values = self.expr(a)?;
        let (from, to) = (self.lowerer.model.scalars(&a.ty), self.lowerer.model.scalars(ty));
        let scalars = values.into_iter().zip(from.into_iter().zip(to));
        Ok(scalars.map(|(v, types)| if types == (Int, Real) { self.b.unary(Unary::ToReal, v) } else { v }).collect())
    }
}
