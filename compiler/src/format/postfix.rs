//! Calls, methods, fields, indices and primes.

use super::document::{DocId, Fit};
use super::lists::Spread;
use super::writer::{Piece, Writer};
use crate::syntax::ast::*;

impl Writer<'_> {
    /// An expression with calls, fields, indices and primes after it: a line for each method, if there are several that
    /// do not fit on one line.
    pub(super) fn postfix(&mut self, expr: &Expr) -> Piece {
        // From the last application to the first; the outermost may itself stand in parentheses, which were written.
        let mut applied = vec![expr];
        let mut head = operand(expr).unwrap_or(expr);
        while let Some(inner) = operand(head).filter(|inner| inner.span.start == head.span.start) {
            applied.push(head);
            head = inner;
        }
        let mut plain = vec![self.expr(head).doc];
        // The places of the methods in `plain`.
        let mut methods = Vec::new();
        let mut last = Piece::weak(plain[0]);
        for expr in applied.into_iter().rev() {
            if matches!(expr.kind, ExprKind::Method(..)) {
                methods.push(plain.len());
            }
            last = self.application(expr);
            plain.push(last.doc);
        }
        let strong = last.strong;
        let flat = self.docs.concat(plain.clone());
        if methods.len() < 2 {
            return Piece { doc: flat, strong };
        }
        let mut layouts = vec![(Fit::Flat, flat)];
        let before = &plain[..plain.len() - 1];
        if strong && self.docs.forced(last.doc) && !before.iter().any(|d| self.docs.forced(*d)) {
            layouts.push((Fit::First, flat));
        }
        let dotted = self.dotted(&plain, &methods);
        layouts.push((Fit::Always, dotted));
        Piece::weak(self.docs.choice(layouts))
    }

    /// A line for each method.
    fn dotted(&mut self, plain: &[DocId], methods: &[usize]) -> DocId {
        let mut docs = plain[..methods[0]].to_vec();
        for (i, from) in methods.iter().enumerate() {
            let to = methods.get(i + 1).copied().unwrap_or(plain.len());
            let method = self.docs.concat(plain[*from..to].to_vec());
            docs.push(self.docs.below(method));
        }
        self.docs.concat(docs)
    }

    /// `(args)`, `.name(args)`, `.name`, `[i]`, `'` or `'u`.
    fn application(&mut self, expr: &Expr) -> Piece {
        match &expr.kind {
            ExprKind::Call(_, args) => self.args(args),
            ExprKind::Method(_, _, args) => {
                let dot = self.token();
                let name = self.token();
                let args = self.args(args);
                Piece { doc: self.docs.concat(vec![dot, name, args.doc]), ..args }
            }
            ExprKind::Index(_, index) => {
                let open = self.token();
                let line = self.docs.line("");
                let index = self.expr(index).doc;
                let within = self.docs.nest(vec![line, index]);
                let close = self.token();
                Piece::weak(self.docs.group(vec![open, within, line, close]))
            }
            _ => Piece::weak(self.plain(expr.span.end)),
        }
    }

    fn args(&mut self, args: &[Arg]) -> Piece {
        self.list(
            args,
            Spread::Arguments,
            |a| a.value.span.end,
            |w, arg| {
                if arg.label.is_none() {
                    return w.expr(&arg.value);
                }
                let label = w.token();
                let colon = w.token_between("", " ");
                let value = w.expr(&arg.value);
                Piece { doc: w.docs.concat(vec![label, colon, value.doc]), ..value }
            },
        )
    }
}

/// The operand of a call, method, field, index or prime.
pub(super) fn operand(expr: &Expr) -> Option<&Expr> {
    match &expr.kind {
        ExprKind::Call(a, _) | ExprKind::Method(a, ..) | ExprKind::Field(a, _) => Some(a),
        ExprKind::Index(a, _) | ExprKind::Prime(a, _) => Some(a),
        _ => None,
    }
}
