//! Walks over syntax trees that know which names are bound where.

use crate::syntax::ast::{Arg, DerivativeDecl, Expr, ExprKind, FnParam, Ident, Item, ItemKind, Pattern, Tolerance};

/// How a name is bound.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Binder {
    /// By a `let` of that one name.
    Let,
    /// By a `fn` within a block or model.
    Function,
    /// By an `input`.
    Input,
    /// Otherwise: by a parameter, a loop, a part or a pattern of several names.
    Other,
}

/// A scope of names, told of what a walk meets.
pub(super) trait Scope<'a> {
    /// A name is used.
    fn used(&mut self, name: &'a str);
    /// A name is bound from here on.
    fn bind(&mut self, name: &'a Ident, binder: Binder);
    /// A function is called by that name, as `name(args)` (0) or as `receiver.name(args)` (1 argument before them).
    fn called(&mut self, _name: &'a str, _args: &'a [Arg], _before: usize) {}
    /// The number of names that are bound at present.
    fn len(&self) -> usize;
    /// All names but the first `len` go out of scope.
    fn truncate(&mut self, len: usize);
}

/// A walk in a scope.
pub(super) struct Walk<S>(pub(super) S);

impl<'a, S: Scope<'a>> Walk<S> {
    fn within(&mut self, walk: impl FnOnce(&mut Self)) {
        let outer = self.0.len();
        walk(self);
        self.0.truncate(outer);
    }

    pub(super) fn bind(&mut self, pattern: &'a Pattern, binder: Binder) {
        match pattern {
            Pattern::Name(name) => self.0.bind(name, binder),
            Pattern::Tuple(patterns, _) => patterns.iter().for_each(|p| self.bind(p, Binder::Other)),
        }
    }

    pub(super) fn function(&mut self, params: &'a [FnParam], body: &'a Expr) {
        self.within(|walk| {
            for param in params {
                walk.exprs(&param.default);
                walk.bind(&param.pattern, Binder::Other);
            }
            walk.expr(body);
        });
    }

    pub(super) fn derivative(&mut self, decl: &'a DerivativeDecl) {
        self.within(|walk| {
            decl.params.iter().chain(&decl.tangents).for_each(|name| walk.0.bind(name, Binder::Other));
            walk.expr(&decl.body);
        });
    }

    /// The items of a model or a branch, and the value of a block.
    pub(super) fn items(&mut self, items: &'a [Item], result: Option<&'a Expr>) {
        self.within(|walk| {
            items.iter().for_each(|item| walk.item(item));
            walk.exprs(result);
        });
    }

    /// The names that an item binds stay bound for the items after it.
    fn item(&mut self, item: &'a Item) {
        match &item.kind {
            ItemKind::Function(decl) => {
                self.0.bind(&decl.name, Binder::Function);
                self.function(&decl.params, &decl.body);
            }
            ItemKind::Derivative(decl) => {
                self.0.used(&decl.function.text);
                self.derivative(decl);
            }
            ItemKind::Let(decl) => {
                self.expr(&decl.value);
                self.bind(&decl.pattern, Binder::Let);
            }
            ItemKind::Model(model) => self.items(&model.items, None),
            ItemKind::Param(decl) | ItemKind::Input(decl) => {
                let bounds = decl.bounds.iter().flat_map(|(lower, upper)| [lower, upper]);
                self.exprs(bounds.chain(&decl.default));
                let input = matches!(item.kind, ItemKind::Input(_));
                self.0.bind(&decl.name, if input { Binder::Input } else { Binder::Other });
            }
            ItemKind::Part(decl) => {
                self.exprs(decl.tolerance.iter().chain([&decl.shape]));
                self.0.bind(&decl.name, Binder::Other);
            }
            ItemKind::Measure(decl) => {
                decl.parts.iter().for_each(|part| self.0.used(&part.name.text));
                self.exprs(decl.tolerance.iter().flat_map(Tolerance::values).chain([&decl.value]));
                self.0.bind(&decl.name, Binder::Other);
            }
            ItemKind::Require(require) => self.expr(&require.condition),
            ItemKind::For(decl) => {
                self.expr(&decl.iterable);
                self.within(|walk| {
                    walk.bind(&decl.pattern, Binder::Other);
                    walk.items(&decl.items, None);
                });
            }
            ItemKind::If(decl) => {
                self.expr(&decl.condition);
                self.items(&decl.then, None);
                self.items(&decl.otherwise, None);
            }
            ItemKind::Use(_) | ItemKind::Error => {}
        }
    }

    fn exprs(&mut self, exprs: impl IntoIterator<Item = &'a Expr>) {
        exprs.into_iter().for_each(|e| self.expr(e));
    }

    pub(super) fn expr(&mut self, expr: &'a Expr) {
        match &expr.kind {
            ExprKind::Name(name) => self.0.used(name),
            ExprKind::Tuple(es) | ExprKind::Array(es) => self.exprs(es),
            ExprKind::Record(fields) => self.exprs(fields.iter().map(|(_, e)| e)),
            ExprKind::Unary(_, e) | ExprKind::Field(e, _) | ExprKind::Prime(e, _) => self.expr(e),
            ExprKind::Binary(_, a, b) | ExprKind::Range(a, b) | ExprKind::Index(a, b) => {
                self.expr(a);
                self.expr(b);
            }
            ExprKind::Call(f, args) => {
                if let ExprKind::Name(name) = &f.kind {
                    self.0.called(name, args, 0);
                }
                self.expr(f);
                self.exprs(args.iter().map(|a| &a.value));
            }
            ExprKind::Method(receiver, name, args) => {
                self.expr(receiver);
                self.0.used(&name.text);
                self.0.called(&name.text, args, 1);
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
                self.within(|walk| {
                    walk.bind(pattern, Binder::Other);
                    walk.expr(body);
                });
            }
            ExprKind::Block(items, result) => self.items(items, result.as_deref()),
            ExprKind::Int(_) | ExprKind::Real(..) | ExprKind::Bool(_) | ExprKind::Text(_) | ExprKind::Error => {}
        }
    }
}
