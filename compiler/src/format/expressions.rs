//! Expressions but for calls.

use super::document::{DocId, Fit};
use super::lists::Spread;
use super::postfix::operand;
use super::writer::{Piece, Writer};
use crate::syntax::ast::*;
use crate::syntax::token::Token;

/// Arrays of at least so many short elements have several of them on a line.
const FILLED: usize = 8;

impl Writer<'_> {
    pub(super) fn expr(&mut self, expr: &Expr) -> Piece {
        self.expr_at(expr, true)
    }

    /// An expression. If it is broken at its operators, `indented` says whether the lines after the first are indented.
    fn expr_at(&mut self, expr: &Expr, indented: bool) -> Piece {
        // The recursion is as deep as the tree, and the stack may be small.
        stacker::maybe_grow(128 << 10, 1 << 20, || match self.parentheses(expr) {
            0 => self.bare(expr, indented),
            n => self.parenthesised(expr, n),
        })
    }

    /// The number of parentheses around the expression that begins here.
    fn parentheses(&self, expr: &Expr) -> usize {
        let (limit, own) = match &expr.kind {
            ExprKind::Tuple(items) => (items.first().map_or(u32::MAX, |e| e.span.start), 1),
            _ => (first(expr).map_or(u32::MAX, |e| e.span.start), 0),
        };
        let opens =
            |ahead: &usize| self.cursor.peek(*ahead).is_some_and(|l| l.token == Token::ParenOpen && l.start < limit);
        (0..).take_while(opens).count().saturating_sub(own)
    }

    fn parenthesised(&mut self, expr: &Expr, count: usize) -> Piece {
        let mut docs: Vec<DocId> = (0..count).map(|_| self.token()).collect();
        let inner = self.bare(expr, false);
        let mut close = Vec::new();
        for _ in 0..count {
            if self.cursor.at(Token::Comma) {
                // A comma does not make a tuple of one.
                close.append(&mut self.comments_before());
                self.cursor.take();
            }
            close.push(self.token());
        }
        let hugs = inner.strong || matches!(expr.kind, ExprKind::If(..) | ExprKind::For(..));
        if hugs {
            docs.push(inner.doc);
        } else {
            let line = self.docs.line("");
            docs.push(self.docs.nest(vec![line, inner.doc]));
            docs.push(line);
        }
        docs.append(&mut close);
        Piece::weak(self.docs.group(docs))
    }

    fn bare(&mut self, expr: &Expr, indented: bool) -> Piece {
        match &expr.kind {
            ExprKind::Int(_) | ExprKind::Real(..) | ExprKind::Bool(_) | ExprKind::Text(_) | ExprKind::Name(_) => {
                Piece::weak(self.token())
            }
            ExprKind::Tuple(items) => Piece { strong: false, ..self.elements(items) },
            ExprKind::Array(items) => Piece { strong: !items.is_empty(), ..self.elements(items) },
            ExprKind::Record(fields) => {
                let list = self.list(
                    fields,
                    Spread::Listed,
                    |(_, value)| value.span.end,
                    |w, (_, value)| {
                        let name = w.token();
                        let colon = w.token_between("", " ");
                        let value = w.expr(value).doc;
                        Piece::weak(w.docs.concat(vec![name, colon, value]))
                    },
                );
                Piece { strong: true, ..list }
            }
            ExprKind::Unary(op, a) => {
                let after = if *op == UnaryOp::Not { " " } else { "" };
                let op = self.token_between("", after);
                let a = self.expr(a).doc;
                Piece::weak(self.docs.concat(vec![op, a]))
            }
            ExprKind::Binary(..) => Piece::weak(self.operators(expr, indented)),
            ExprKind::Range(a, b) => {
                let a = self.expr(a).doc;
                let dots = self.token();
                let b = self.expr(b).doc;
                Piece::weak(self.docs.concat(vec![a, dots, b]))
            }
            ExprKind::Lambda(params, body) => {
                let bars = self.bars(params);
                let body = self.after(body);
                Piece { doc: self.docs.concat(vec![bars, body]), strong: true }
            }
            ExprKind::If(condition, then, otherwise) => {
                let layouts = self.if_expr(condition, then, otherwise.as_deref());
                let doc = layouts.here(&mut self.docs);
                Piece { doc, strong: self.docs.forced(doc) }
            }
            ExprKind::For(pattern, iterable, body) => {
                let head = self.for_head(pattern, iterable);
                let block = self.block_expr(body).doc;
                Piece { doc: self.docs.concat(vec![head, block]), strong: true }
            }
            ExprKind::Block(items, value) => Piece { doc: self.block(items, value.as_deref()).doc, strong: true },
            ExprKind::Call(..)
            | ExprKind::Method(..)
            | ExprKind::Field(..)
            | ExprKind::Index(..)
            | ExprKind::Prime(..) => self.postfix(expr),
            // Files with errors are not formatted.
            ExprKind::Error => Piece::weak(self.plain(expr.span.end)),
        }
    }

    fn elements(&mut self, items: &[Expr]) -> Piece {
        let spread = if items.len() >= FILLED && items.iter().all(is_short) { Spread::Filled } else { Spread::Listed };
        self.list(items, spread, |e| e.span.end, |w, e| w.expr(e))
    }

    /// `|a, b: real|`
    fn bars(&mut self, params: &[FnParam]) -> DocId {
        let open = self.token();
        let params = self.plain(params.last().map_or(0, super::items::param_end));
        let mut docs = vec![open, params];
        if self.cursor.at(Token::Comma) {
            docs.push(self.plain(self.cursor.start() + 1));
        }
        docs.push(self.token());
        self.docs.concat(docs)
    }

    /// The expression after `=` or `|x|`, with the space or line end before it.
    pub(super) fn after(&mut self, expr: &Expr) -> DocId {
        if let ExprKind::If(condition, then, otherwise) = &expr.kind
            && self.cursor.at(Token::If)
        {
            let layouts = self.if_expr(condition, then, otherwise.as_deref());
            return layouts.after(&mut self.docs);
        }
        // An expression that begins with a bracket stays on the line, and is broken within.
        let bracketed = matches!(expr.kind, ExprKind::Tuple(_) | ExprKind::Array(_) | ExprKind::Record(_))
            || matches!(expr.kind, ExprKind::Lambda(..) | ExprKind::For(..) | ExprKind::Block(..));
        let called = matches!(expr.kind, ExprKind::Call(..) | ExprKind::Method(..));
        let doc = self.expr_at(expr, false).doc;
        let spaced = self.docs.spaced(doc);
        if bracketed {
            return spaced;
        }
        let below = self.docs.below(doc);
        let mut layouts = vec![(Fit::Flat, spaced)];
        if called {
            layouts.extend([(Fit::Whole, below), (Fit::First, spaced)]);
        }
        layouts.push((Fit::Always, below));
        self.docs.choice(layouts)
    }

    /// Operators of one precedence: a line each if they do not fit on one.
    fn operators(&mut self, expr: &Expr, indented: bool) -> DocId {
        let ExprKind::Binary(op, a, b) = &expr.kind else { return self.expr(expr).doc };
        if *op == BinaryOp::Pow || is_ratio(expr) {
            let space = if *op == BinaryOp::Pow { " " } else { "" };
            let a = self.expr(a).doc;
            let op = self.token_between(space, space);
            let b = self.expr(b).doc;
            return self.docs.concat(vec![a, op, b]);
        }
        // The operands from the last to the first.
        let mut operands = vec![b];
        let mut left = a;
        while let ExprKind::Binary(inner, a, b) = &left.kind
            && level(*inner) == level(*op)
            && left.span.start == a.span.start
            && !is_fraction(left)
        {
            operands.push(b);
            left = a;
        }
        let mut docs = vec![self.expr(left).doc];
        let mut rest = Vec::new();
        for operand in operands.into_iter().rev() {
            rest.push(self.docs.line(" "));
            rest.push(self.token_between("", " "));
            rest.push(self.expr(operand).doc);
        }
        if indented {
            docs.push(self.docs.nest(rest));
        } else {
            docs.append(&mut rest);
        }
        self.docs.group(docs)
    }
}

/// The expression that an expression begins with.
fn first(expr: &Expr) -> Option<&Expr> {
    match &expr.kind {
        ExprKind::Binary(_, a, _) | ExprKind::Range(a, _) => Some(a),
        _ => operand(expr),
    }
}

/// The ratio of two whole numbers.
fn is_ratio(expr: &Expr) -> bool {
    let is_int = |e: &Expr| matches!(e.kind, ExprKind::Int(_));
    matches!(&expr.kind, ExprKind::Binary(BinaryOp::Div, a, b) if is_int(a) && is_int(b))
}

/// `1/25`: a number rather than a division. Parentheses widen the spans.
fn is_fraction(expr: &Expr) -> bool {
    is_ratio(expr) && first(expr).is_some_and(|a| a.span.start == expr.span.start)
}

/// A number with or without a sign, or a name.
fn is_short(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Int(_) | ExprKind::Real(..) | ExprKind::Bool(_) | ExprKind::Name(_) => true,
        ExprKind::Unary(UnaryOp::Neg, a) => is_short(a),
        _ => is_fraction(expr),
    }
}

fn level(op: BinaryOp) -> u32 {
    match op {
        BinaryOp::Or => 0,
        BinaryOp::And => 1,
        BinaryOp::Compare(_) => 2,
        BinaryOp::Common => 3,
        BinaryOp::Add | BinaryOp::Sub => 4,
        BinaryOp::Mul | BinaryOp::Div | BinaryOp::Rem => 5,
        BinaryOp::Pow => 6,
    }
}
