//! Blocks: statements that bind names, and what is required.

use super::context::{Binding, Checker, error, known};
use super::expressions::element;
use super::typed::{Expr, ExprKind, LocalId, Statement, Type};
use crate::diagnostic::{Code, Diagnostic};
use crate::source::Span;
use crate::syntax::ast::{self, Ident, Item, ItemKind, Pattern};

impl<'a> Checker<'a> {
    pub(super) fn block(&mut self, items: &'a [Item], result: Option<&'a ast::Expr>, span: Span) -> Expr {
        let mark = self.env.names.len();
        let mut statements = Vec::new();
        self.pair_derivatives(items);
        for item in items {
            if let ItemKind::Require(decl) = &item.kind {
                // The statements after it may rely on it.
                if !self.requirement(decl, item.span, &mut statements) {
                    self.env.names.truncate(mark);
                    return error(span);
                }
            } else {
                self.statement(item, &mut statements);
            }
        }
        let value = match result {
            Some(result) => self.expr(result),
            None => {
                let message = "this block has no value: its last line must be an expression";
                let brace = Span { start: span.end.saturating_sub(1).max(span.start), ..span };
                self.report(Diagnostic::new(Code::NoValue, brace, message).label("a value is missing before this"));
                error(span)
            }
        };
        self.env.names.truncate(mark);
        wrap(statements, value, span)
    }

    /// A statement that may stand in a block and in a model.
    pub(super) fn statement(&mut self, item: &'a Item, out: &mut Vec<Statement>) {
        match &item.kind {
            ItemKind::Let(decl) => {
                let outer = self.defining.replace(&decl.pattern);
                let mut value = self.expr(&decl.value);
                self.defining = outer;
                value = self.coerce_written(value, decl.ty.as_ref(), "the value");
                self.bind(&decl.pattern, value, out);
            }
            ItemKind::Function(decl) => {
                let value = self.local_function(decl);
                self.bind_name(&decl.name, value, out);
            }
            ItemKind::Require(decl) => _ = self.requirement(decl, item.span, out),
            // Derivatives were paired with their functions.
            ItemKind::Derivative(_) | ItemKind::Error => {}
            ItemKind::Param(ast::ParamDecl { name, .. })
            | ItemKind::Input(ast::ParamDecl { name, .. })
            | ItemKind::Part(ast::PartDecl { name, .. })
            | ItemKind::Measure(ast::MeasureDecl { name, .. }) => {
                let error = Diagnostic::new(Code::Misplaced, item.span, "this belongs in the body of a model");
                self.report(error.hint("write it directly between the braces of `model name { ... }`"));
                self.bind_local(name, Type::Error);
            }
            ItemKind::Model(decl) => {
                let message = "a model belongs at the top of the file";
                let error = Diagnostic::new(Code::Misplaced, decl.name.span, message);
                self.report(error.hint("define it there, and use it here: 'part NAME = MODEL()'"));
            }
            ItemKind::Use(_) | ItemKind::For(_) | ItemKind::If(_) => {
                self.report(Diagnostic::new(Code::Misplaced, item.span, "this belongs at the top of the file"));
            }
        }
    }

    /// A condition that must hold; false where it is known not to.
    fn requirement(&mut self, decl: &'a ast::Require, span: Span, out: &mut Vec<Statement>) -> bool {
        let condition = self.expr(&decl.condition);
        let message = decl.message.as_deref().unwrap_or("a condition that the script requires does not hold");
        match condition.ty {
            Type::Bool(Some(true)) | Type::Error => {}
            Type::Bool(Some(false)) => {
                self.report(Diagnostic::new(Code::Require, span, message));
                return false;
            }
            Type::Bool(None) => out.push(Statement::Require { condition, message: message.to_owned(), span }),
            _ => self.condition_error(&condition),
        }
        true
    }

    /// Binds the names of a pattern.
    pub(super) fn bind(&mut self, pattern: &'a Pattern, value: Expr, out: &mut Vec<Statement>) {
        match pattern {
            Pattern::Name(name) => self.bind_name(name, value, out),
            Pattern::Tuple(patterns, span) => {
                let whole = self.keep(value, out);
                for (i, pattern) in patterns.iter().enumerate() {
                    let component = match self.destructured(whole.clone(), i, patterns.len(), *span) {
                        Some(component) => component,
                        None => error(*span),
                    };
                    self.bind(pattern, component, out);
                }
            }
        }
    }

    /// Brings a new local into scope.
    pub(super) fn bind_local(&mut self, name: &'a Ident, ty: Type) -> LocalId {
        let local = self.local(&name.text, ty, name.span);
        self.env.names.push((&name.text, Binding::Local(local)));
        local
    }

    pub(super) fn bind_name(&mut self, name: &'a Ident, value: Expr, out: &mut Vec<Statement>) {
        let id = self.local(&name.text, value.ty.clone(), name.span);
        // A known value is read as a constant.
        if !matches!(
            (&value.ty, &value.kind),
            (Type::Int(Some(_)), ExprKind::Int(_)) | (Type::Bool(Some(_)), ExprKind::Bool(_))
        ) {
            out.push(Statement::Let(id, value));
        }
        self.env.names.push((&name.text, Binding::Local(id)));
    }

    /// Binds a value that is used several times to a local, unless it is cheap to repeat.
    pub(super) fn keep(&mut self, value: Expr, out: &mut Vec<Statement>) -> Expr {
        if matches!(value.kind, ExprKind::Local(_) | ExprKind::Int(_) | ExprKind::Real(_) | ExprKind::Bool(_)) {
            return value;
        }
        let (ty, span) = (value.ty.clone(), value.span);
        let id = self.local("", ty, span);
        out.push(Statement::Let(id, value));
        self.read(id, span)
    }

    /// Component `index` of a value that a pattern of `count` names takes apart.
    pub(super) fn destructured(&mut self, value: Expr, index: usize, count: usize, span: Span) -> Option<Expr> {
        let have = match &value.ty {
            Type::Error => return None,
            Type::Tuple(types) => types.len(),
            Type::Array(_, n) => *n,
            other => {
                let message = format!("{} cannot be destructured into {count} names", self.describe(other));
                self.report(Diagnostic::new(Code::Pattern, span, message));
                return None;
            }
        };
        if have != count {
            let message = format!("this pattern names {count} values, but there are {have}");
            self.report(Diagnostic::new(Code::Pattern, span, message).related(value.span, self.describe(&value.ty)));
            return None;
        }
        Some(element(value, index))
    }
}

/// A block, where there is anything to say before the value.
pub(super) fn wrap(statements: Vec<Statement>, value: Expr, span: Span) -> Expr {
    if statements.is_empty() || value.ty.is_error() {
        return value;
    }
    let ty = value.ty.clone();
    known_unless_guarded(Expr { kind: ExprKind::Block(statements, Box::new(value)), ty, span })
}

/// A known value does not wait for its block, unless something is required there.
fn known_unless_guarded(expr: Expr) -> Expr {
    match &expr.kind {
        ExprKind::Block(statements, _) if statements.iter().any(|s| matches!(s, Statement::Require { .. })) => expr,
        _ => known(expr),
    }
}
