//! The names that a function uses from outside of itself, and all names of a file.

use crate::syntax::ast::{DerivativeDecl, Expr, ExprKind, FnParam, FunctionDecl, Item, ItemKind, Pattern};
use std::collections::{HashMap, HashSet};

/// Names that occur free in a lambda, each once, in the order of their first use.
pub(super) fn of_lambda<'a>(params: &'a [FnParam], body: &'a Expr) -> Vec<&'a str> {
    let mut walk = Walk::default();
    walk.function(params, body);
    walk.free
}

/// Names that occur free in a function and its derivative by hand, its own name not among them.
pub(super) fn of_function<'a>(decl: &'a FunctionDecl, derivative: Option<&'a DerivativeDecl>) -> Vec<&'a str> {
    let mut walk = Walk::default();
    walk.push(&decl.name.text);
    walk.function(&decl.params, &decl.body);
    if let Some(derivative) = derivative {
        walk.derivative(derivative);
    }
    walk.free
}

/// Names that occur in items and are not bound within the same expression.
pub(super) fn of_items(items: &[Item]) -> Vec<&str> {
    let mut walk = Walk::default();
    walk.items(items);
    walk.free
}

#[derive(Default)]
struct Walk<'a> {
    bound: Vec<&'a str>,
    /// How often each name is bound at present.
    counts: HashMap<&'a str, u32>,
    free: Vec<&'a str>,
    seen: HashSet<&'a str>,
}

impl<'a> Walk<'a> {
    fn name(&mut self, name: &'a str) {
        if self.counts.get(name).is_none_or(|n| *n == 0) && self.seen.insert(name) {
            self.free.push(name);
        }
    }

    fn push(&mut self, name: &'a str) {
        self.bound.push(name);
        *self.counts.entry(name).or_default() += 1;
    }

    fn truncate(&mut self, mark: usize) {
        for name in self.bound.drain(mark..) {
            if let Some(count) = self.counts.get_mut(name) {
                *count -= 1;
            }
        }
    }

    fn bind(&mut self, pattern: &'a Pattern) {
        match pattern {
            Pattern::Name(ident) => self.push(&ident.text),
            Pattern::Tuple(patterns, _) => patterns.iter().for_each(|p| self.bind(p)),
        }
    }

    fn function(&mut self, params: &'a [FnParam], body: &'a Expr) {
        let mark = self.bound.len();
        for param in params {
            param.default.iter().for_each(|d| self.expr(d));
            self.bind(&param.pattern);
        }
        self.expr(body);
        self.truncate(mark);
    }

    fn derivative(&mut self, decl: &'a DerivativeDecl) {
        let mark = self.bound.len();
        decl.params.iter().chain(&decl.tangents).for_each(|i| self.push(&i.text));
        self.expr(&decl.body);
        self.truncate(mark);
    }

    fn items(&mut self, items: &'a [Item]) {
        let mark = self.bound.len();
        for item in items {
            self.item(item);
        }
        self.truncate(mark);
    }

    /// What an item binds stays bound for those after it.
    fn item(&mut self, item: &'a Item) {
        match &item.kind {
            ItemKind::Function(decl) => {
                self.push(&decl.name.text);
                self.function(&decl.params, &decl.body);
            }
            ItemKind::Derivative(decl) => {
                self.name(&decl.function.text);
                self.derivative(decl);
            }
            ItemKind::Let(binding) => {
                self.expr(&binding.value);
                self.bind(&binding.pattern);
            }
            ItemKind::Model(model) => self.items(&model.items),
            ItemKind::Param(decl) | ItemKind::Input(decl) => {
                decl.bounds.iter().for_each(|(lower, upper)| {
                    self.expr(lower);
                    self.expr(upper);
                });
                decl.default.iter().for_each(|d| self.expr(d));
                self.push(&decl.name.text);
            }
            ItemKind::Part(decl) => {
                decl.tolerance.iter().for_each(|t| self.expr(t));
                self.expr(&decl.shape);
                self.push(&decl.name.text);
            }
            ItemKind::Require(require) => self.expr(&require.condition),
            ItemKind::For(decl) => {
                self.expr(&decl.iterable);
                let mark = self.bound.len();
                self.bind(&decl.pattern);
                self.items(&decl.items);
                self.truncate(mark);
            }
            ItemKind::If(decl) => {
                self.expr(&decl.condition);
                self.items(&decl.then);
                self.items(&decl.otherwise);
            }
            ItemKind::Use(_) | ItemKind::Error => {}
        }
    }

    fn exprs(&mut self, exprs: impl IntoIterator<Item = &'a Expr>) {
        exprs.into_iter().for_each(|e| self.expr(e));
    }

    fn expr(&mut self, expr: &'a Expr) {
        match &expr.kind {
            ExprKind::Name(name) => self.name(name),
            ExprKind::Tuple(es) | ExprKind::Array(es) => self.exprs(es),
            ExprKind::Record(fields) => self.exprs(fields.iter().map(|(_, e)| e)),
            ExprKind::Unary(_, e) | ExprKind::Field(e, _) | ExprKind::Prime(e, _) => self.expr(e),
            ExprKind::Binary(_, a, b) | ExprKind::Range(a, b) | ExprKind::Index(a, b) => {
                self.expr(a);
                self.expr(b);
            }
            ExprKind::Call(f, args) => {
                self.expr(f);
                self.exprs(args.iter().map(|a| &a.value));
            }
            ExprKind::Method(receiver, name, args) => {
                self.expr(receiver);
                self.name(&name.text);
                self.exprs(args.iter().map(|a| &a.value));
            }
            ExprKind::Lambda(params, body) => self.function(params, body),
            ExprKind::If(condition, then, otherwise) => {
                self.expr(condition);
                self.expr(then);
                self.exprs(otherwise.as_deref());
            }
            ExprKind::For(pattern, iterable, body) => {
                self.expr(iterable);
                let mark = self.bound.len();
                self.bind(pattern);
                self.expr(body);
                self.truncate(mark);
            }
            ExprKind::Block(items, result) => {
                let mark = self.bound.len();
                items.iter().for_each(|i| self.item(i));
                self.exprs(result.as_deref());
                self.truncate(mark);
            }
            ExprKind::Int(_) | ExprKind::Real(..) | ExprKind::Bool(_) | ExprKind::Text(_) | ExprKind::Error => {}
        }
    }
}
