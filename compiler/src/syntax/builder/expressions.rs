//! Expressions.

use super::{Builder, Deep, Statement, split_all, split_option};
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::syntax::ast::*;

impl Builder<'_> {
    pub(in crate::syntax) fn unary(&mut self, l: u32, op: UnaryOp, a: Deep<Expr>) -> Deep<Expr> {
        let span = self.span(l, a.node.span.end);
        self.expr(span, ExprKind::Unary(op, Box::new(a.node)), a.depth)
    }

    pub(in crate::syntax) fn binary(&mut self, op: BinaryOp, a: Deep<Expr>, c: Deep<Expr>) -> Deep<Expr> {
        let span = a.node.span.to(c.node.span);
        let depth = a.depth.max(c.depth);
        self.expr(span, ExprKind::Binary(op, Box::new(a.node), Box::new(c.node)), depth)
    }

    pub(in crate::syntax) fn compare(&mut self, op: BinaryOp, a: Deep<Expr>, c: Deep<Expr>) -> Deep<Expr> {
        use BinaryOp::{Eq, Ge, Gt, Le, Lt, Ne};
        // Parentheses widen the span, so a chain is where the spans begin together.
        if let ExprKind::Binary(Eq | Ne | Lt | Le | Gt | Ge, first, second) = &a.node.kind
            && first.span.start == a.node.span.start
        {
            let text = |e: &Expr| self.slice(e.span.start, e.span.end);
            let hint = format!("write '{} and {} {} {}'", text(&a.node), text(second), op.text(), text(&c.node));
            let middle = Edit::after(second.span, format!(" and {}", text(second)));
            let span = a.node.span.to(c.node.span);
            let error = Diagnostic::new(Code::ComparisonChain, span, "comparisons do not chain");
            self.report(error.suggest(hint, [middle]));
            return Deep::flat(Expr { span, kind: ExprKind::Error });
        }
        self.binary(op, a, c)
    }

    pub(in crate::syntax) fn range(&mut self, a: Deep<Expr>, c: Deep<Expr>) -> Deep<Expr> {
        let span = a.node.span.to(c.node.span);
        let depth = a.depth.max(c.depth);
        self.expr(span, ExprKind::Range(Box::new(a.node), Box::new(c.node)), depth)
    }

    pub(in crate::syntax) fn lambda(
        &mut self,
        l: u32,
        params: Vec<Deep<FnParam>>,
        body: Deep<Expr>,
        r: u32,
    ) -> Deep<Expr> {
        let (params, a) = split_all(params);
        let span = self.span(l, r);
        self.expr(span, ExprKind::Lambda(params, Box::new(body.node)), a.max(body.depth))
    }

    pub(in crate::syntax) fn call(&mut self, f: Deep<Expr>, args: Vec<Deep<Arg>>, r: u32) -> Deep<Expr> {
        let (args, a) = split_all(args);
        let depth = a.max(f.depth);
        let span = self.span(f.node.span.start, r);
        let kind = match f.node.kind {
            // Parentheses widen the span: `(a.f)(b)` calls a field, `a.f(b)` a method.
            ExprKind::Field(receiver, name) if receiver.span.start == f.node.span.start => {
                ExprKind::Method(receiver, name, args)
            }
            kind => ExprKind::Call(Box::new(Expr { span: f.node.span, kind }), args),
        };
        self.expr(span, kind, depth)
    }

    pub(in crate::syntax) fn index(&mut self, a: Deep<Expr>, i: Deep<Expr>, r: u32) -> Deep<Expr> {
        let span = self.span(a.node.span.start, r);
        let depth = a.depth.max(i.depth);
        self.expr(span, ExprKind::Index(Box::new(a.node), Box::new(i.node)), depth)
    }

    pub(in crate::syntax) fn field(&mut self, a: Deep<Expr>, name: Ident) -> Deep<Expr> {
        let span = a.node.span.to(name.span);
        self.expr(span, ExprKind::Field(Box::new(a.node), name), a.depth)
    }

    /// `name` is where a prime with a name begins.
    pub(in crate::syntax) fn prime(&mut self, f: Deep<Expr>, name: Option<u32>, r: u32) -> Deep<Expr> {
        let name = name.map(|l| self.ident(l + 1, r));
        let span = self.span(f.node.span.start, r);
        self.expr(span, ExprKind::Prime(Box::new(f.node), name), f.depth)
    }

    pub(in crate::syntax) fn paren(&mut self, l: u32, items: Vec<Deep<Expr>>, r: u32) -> Deep<Expr> {
        let span = self.span(l, r);
        let (mut items, depth) = split_all(items);
        match items.pop() {
            Some(only) if items.is_empty() => Deep { node: Expr { span, kind: only.kind }, depth },
            Some(last) => {
                items.push(last);
                self.expr(span, ExprKind::Tuple(items), depth)
            }
            None => {
                self.report(Diagnostic::new(Code::EmptyTuple, span, "expected a value inside the parentheses"));
                Deep::flat(Expr { span, kind: ExprKind::Error })
            }
        }
    }

    pub(in crate::syntax) fn array(&mut self, l: u32, items: Vec<Deep<Expr>>, r: u32) -> Deep<Expr> {
        let (items, depth) = split_all(items);
        let span = self.span(l, r);
        self.expr(span, ExprKind::Array(items), depth)
    }

    pub(in crate::syntax) fn record(&mut self, l: u32, fields: Vec<Deep<(Ident, Expr)>>, r: u32) -> Deep<Expr> {
        let (fields, depth) = split_all(fields);
        let span = self.span(l, r);
        self.expr(span, ExprKind::Record(fields), depth)
    }

    pub(in crate::syntax) fn for_expr(
        &mut self,
        l: u32,
        pattern: Pattern,
        iterable: Deep<Expr>,
        body: Deep<Expr>,
        r: u32,
    ) -> Deep<Expr> {
        let depth = iterable.depth.max(body.depth);
        let span = self.span(l, r);
        self.expr(span, ExprKind::For(pattern, Box::new(iterable.node), Box::new(body.node)), depth)
    }

    pub(in crate::syntax) fn if_expr(
        &mut self,
        l: u32,
        condition: Deep<Expr>,
        then: Deep<Expr>,
        otherwise: Option<Deep<Expr>>,
        r: u32,
    ) -> Deep<Expr> {
        let (otherwise, a) = split_option(otherwise);
        let depth = a.max(condition.depth).max(then.depth);
        let span = self.span(l, r);
        let kind = ExprKind::If(Box::new(condition.node), Box::new(then.node), otherwise.map(Box::new));
        self.expr(span, kind, depth)
    }

    pub(in crate::syntax) fn block(&mut self, l: u32, lines: Vec<Statement>, r: u32) -> Deep<Expr> {
        let (mut items, mut value, mut depth) = (Vec::new(), None, 0);
        let count = lines.len();
        for (i, line) in lines.into_iter().enumerate() {
            let last = i + 1 == count;
            match line {
                Statement::Item(item) => {
                    depth = depth.max(item.depth);
                    items.push(item.node);
                }
                Statement::Expr(expr) if last => {
                    depth = depth.max(expr.depth);
                    value = Some(Box::new(expr.node));
                }
                Statement::Expr(expr) => {
                    let message = "this value is not used: only the last line of a block is its value";
                    let hint = "give it a name with 'let', or remove it";
                    self.report(Diagnostic::new(Code::UnusedValue, expr.node.span, message).hint(hint));
                }
                Statement::Bad(span) if last => value = Some(Box::new(Expr { span, kind: ExprKind::Error })),
                Statement::Bad(span) => items.push(Item { doc: String::new(), span, kind: ItemKind::Error }),
            }
        }
        let span = self.span(l, r);
        self.expr(span, ExprKind::Block(items, value), depth)
    }
}
