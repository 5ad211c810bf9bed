//! Warnings that names alone tell: what is defined and never used, and what hides a function of the library.

use super::builtins;
use super::stdlib;
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::source::Span;
use crate::syntax::ast::{Expr, ExprKind, FnParam, Ident, Item, ItemKind, Pattern};

/// The warnings for a file without errors.
pub(super) fn lints(items: &[Item]) -> Vec<Diagnostic> {
    let mut walk = Walk { scope: Vec::new(), warnings: Vec::new() };
    for item in items {
        walk.declare_at_top(item);
    }
    let top = walk.scope.len();
    for item in items {
        walk.item(item);
    }
    // Other files may use what the top of this one defines.
    walk.scope.truncate(top);
    walk.close(0);
    walk.warnings.extend(items.iter().filter_map(hides_the_library));
    walk.warnings
}

/// What to say of a name that is never used.
#[derive(Clone, Copy)]
enum Kind {
    /// Nothing: parameters of functions, whose number is their caller's affair, and names for other files.
    Silent,
    Let,
    Function,
    Input,
    Use,
}

struct Name<'a> {
    text: &'a str,
    span: Span,
    kind: Kind,
    used: bool,
}

struct Walk<'a> {
    scope: Vec<Name<'a>>,
    warnings: Vec<Diagnostic>,
}

impl<'a> Walk<'a> {
    fn bind(&mut self, name: &'a Ident, kind: Kind) {
        self.scope.push(Name { text: &name.text, span: name.span, kind, used: name.text.starts_with('_') });
    }

    fn bind_pattern(&mut self, pattern: &'a Pattern, kind: Kind) {
        match pattern {
            Pattern::Name(name) => self.bind(name, kind),
            // Some of the names of a tuple are often there for the others' sake.
            Pattern::Tuple(patterns, _) => patterns.iter().for_each(|p| self.bind_pattern(p, Kind::Silent)),
        }
    }

    fn use_name(&mut self, text: &str) {
        if let Some(name) = self.scope.iter_mut().rev().find(|n| n.text == text) {
            name.used = true;
        }
    }

    /// Leaves a scope.
    fn close(&mut self, mark: usize) {
        for name in self.scope.split_off(mark).into_iter().filter(|n| !n.used) {
            let what = match name.kind {
                Kind::Silent => continue,
                Kind::Let | Kind::Function => format!("'{}' is not used", name.text),
                Kind::Input => format!("the input '{}' is not used", name.text),
                Kind::Use => format!("'{}' is imported but not used", name.text),
            };
            let warning = Diagnostic::new(Code::UnusedName, name.span, what);
            self.warnings.push(match name.kind {
                Kind::Use => warning.hint("remove it"),
                _ => {
                    let question = format!("if this is intended, rename it to '_{}'", name.text);
                    warning.suggest(question, [Edit::before(name.span, "_")])
                }
            });
        }
    }

    /// Names of the file's top, which are known throughout.
    fn declare_at_top(&mut self, item: &'a Item) {
        match &item.kind {
            ItemKind::Use(u) => u.names.iter().flatten().for_each(|name| self.bind(name, Kind::Use)),
            ItemKind::Function(decl) => self.bind(&decl.name, Kind::Silent),
            ItemKind::Let(decl) => self.bind_pattern(&decl.pattern, Kind::Silent),
            ItemKind::Model(model) => self.bind(&model.name, Kind::Silent),
            _ => {}
        }
    }

    fn item(&mut self, item: &'a Item) {
        match &item.kind {
            ItemKind::Function(decl) => self.function(&decl.params, &decl.body),
            ItemKind::Derivative(decl) => {
                let mark = self.scope.len();
                self.use_name(&decl.function.text);
                decl.params.iter().chain(&decl.tangents).for_each(|name| self.bind(name, Kind::Silent));
                self.expr(&decl.body);
                self.close(mark);
            }
            ItemKind::Let(decl) => self.expr(&decl.value),
            ItemKind::Model(model) => self.statements(&model.items, None),
            ItemKind::Param(decl) | ItemKind::Input(decl) => {
                let bounds = decl.bounds.iter().flat_map(|(lower, upper)| [lower, upper]);
                bounds.chain(&decl.default).for_each(|e| self.expr(e));
            }
            ItemKind::Part(decl) => decl.tolerance.iter().chain([&decl.shape]).for_each(|e| self.expr(e)),
            ItemKind::Require(require) => self.expr(&require.condition),
            ItemKind::For(decl) => {
                self.expr(&decl.iterable);
                let mark = self.scope.len();
                self.bind_pattern(&decl.pattern, Kind::Silent);
                self.statements(&decl.items, None);
                self.close(mark);
            }
            ItemKind::If(decl) => {
                self.expr(&decl.condition);
                self.statements(&decl.then, None);
                self.statements(&decl.otherwise, None);
            }
            ItemKind::Use(_) | ItemKind::Error => {}
        }
    }

    /// The statements of a block or a model, each of which knows what those before it define.
    fn statements(&mut self, items: &'a [Item], result: Option<&'a Expr>) {
        let mark = self.scope.len();
        for item in items {
            if let ItemKind::Function(decl) = &item.kind {
                self.bind(&decl.name, Kind::Function);
            }
            self.item(item);
            match &item.kind {
                ItemKind::Let(decl) => self.bind_pattern(&decl.pattern, Kind::Let),
                ItemKind::Input(decl) => self.bind(&decl.name, Kind::Input),
                // Of parameters that are not used the checker speaks; parts are there to be seen.
                ItemKind::Param(decl) => self.bind(&decl.name, Kind::Silent),
                ItemKind::Part(decl) => self.bind(&decl.name, Kind::Silent),
                _ => {}
            }
        }
        result.into_iter().for_each(|e| self.expr(e));
        self.close(mark);
    }

    fn function(&mut self, params: &'a [FnParam], body: &'a Expr) {
        let mark = self.scope.len();
        for param in params {
            param.default.iter().for_each(|d| self.expr(d));
            self.bind_pattern(&param.pattern, Kind::Silent);
        }
        self.expr(body);
        self.close(mark);
    }

    fn expr(&mut self, expr: &'a Expr) {
        match &expr.kind {
            ExprKind::Name(name) => self.use_name(name),
            ExprKind::Tuple(es) | ExprKind::Array(es) => es.iter().for_each(|e| self.expr(e)),
            ExprKind::Record(fields) => fields.iter().for_each(|(_, e)| self.expr(e)),
            ExprKind::Unary(_, e) | ExprKind::Field(e, _) | ExprKind::Prime(e, _) => self.expr(e),
            ExprKind::Binary(_, a, b) | ExprKind::Range(a, b) | ExprKind::Index(a, b) => {
                self.expr(a);
                self.expr(b);
            }
            ExprKind::Call(f, args) => {
                self.expr(f);
                args.iter().for_each(|a| self.expr(&a.value));
            }
            ExprKind::Method(receiver, name, args) => {
                self.expr(receiver);
                self.use_name(&name.text);
                args.iter().for_each(|a| self.expr(&a.value));
            }
            ExprKind::Lambda(params, body) => self.function(params, body),
            ExprKind::If(condition, then, otherwise) => {
                [condition, then].into_iter().chain(otherwise).for_each(|e| self.expr(e));
            }
            ExprKind::For(pattern, iterable, body) => {
                self.expr(iterable);
                let mark = self.scope.len();
                self.bind_pattern(pattern, Kind::Silent);
                self.expr(body);
                self.close(mark);
            }
            ExprKind::Block(items, result) => self.statements(items, result.as_deref()),
            ExprKind::Int(_) | ExprKind::Real(..) | ExprKind::Bool(_) | ExprKind::Text(_) | ExprKind::Error => {}
        }
    }
}

/// A function of the file's own in the place of one of the library, which is known without `use`.
fn hides_the_library(item: &Item) -> Option<Diagnostic> {
    let ItemKind::Function(decl) = &item.kind else { return None };
    let name = &decl.name.text;
    let home = match stdlib::module_of(name) {
        Some(module) => stdlib::MODULES[module].0.to_owned(),
        None => builtins::names().find(|n| n == name).map(|_| "the language".to_owned())?,
    };
    let message = format!("this hides the function '{name}' of {home}");
    Some(Diagnostic::new(Code::HiddenFunction, decl.name.span, message).hint("give it a name of its own"))
}
