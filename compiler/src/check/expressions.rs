//! Expressions: one function for each kind that has no file of its own.

use super::context::{Callee, Checker, boolean, error, int, known};
use super::free;
use super::iteration::ITERATIONS_HINT;
use super::typed::{Expr, ExprKind, LocalId, Type};
use super::types::Dimension;
use crate::diagnostic::{Code, Diagnostic};
use crate::source::Span;
use crate::syntax::ast::{self, FnParam, FunctionDecl, Ident, UnaryOp, Unit};
use std::rc::Rc;

/// Stack that must be left before an expression is checked, and how much is added where it is not.
const STACK_LEFT: usize = 128 << 10;
const STACK_MORE: usize = 2 << 20;

impl<'a> Checker<'a> {
    /// Checks an expression in the names that are in scope.
    pub(super) fn expr(&mut self, expr: &'a ast::Expr) -> Expr {
        if !self.use_fuel(1, expr.span) {
            return error(expr.span);
        }
        // Instantiation nests: each call checks a body. Its depth is bounded by an option, the stack follows.
        stacker::maybe_grow(STACK_LEFT, STACK_MORE, || self.dispatch(expr))
    }

    fn dispatch(&mut self, expr: &'a ast::Expr) -> Expr {
        use ast::ExprKind as K;
        let span = expr.span;
        match &expr.kind {
            K::Int(value) => {
                self.bare_literals.insert(span);
                int(*value, span)
            }
            K::Real(value, unit) => {
                if unit.is_none() {
                    self.bare_literals.insert(span);
                }
                number(*value, *unit, span)
            }
            K::Bool(value) => boolean(*value, span),
            K::Text(text) => {
                Expr { kind: ExprKind::Text(text.clone()), ty: Type::Text(Some(text.as_str().into())), span }
            }
            K::Name(name) => self.name(name, span),
            K::Tuple(items) => self.tuple(items, span),
            K::Array(items) => {
                let items = items.iter().map(|e| self.expr(e)).collect();
                self.array(items, span)
            }
            K::Record(fields) => self.record(fields, span),
            K::Unary(UnaryOp::Neg, e) => {
                let e = self.expr(e);
                self.negate(e, span)
            }
            K::Unary(UnaryOp::Not, e) => {
                let e = self.expr(e);
                self.not(e, span)
            }
            K::Binary(op, a, b) => self.binary(*op, a, b, span),
            K::Range(a, b) => self.range(a, b, span),
            K::Call(f, args) => self.call_expr(f, args, span),
            K::Method(receiver, name, args) => self.method(receiver, name, args, span),
            K::Field(e, name) => self.field(e, name, span),
            K::Index(e, index) => self.index(e, index, span),
            K::Prime(f, argument) => self.prime(f, argument.as_ref(), span),
            K::Lambda(params, body) => self.lambda(params, body, span),
            K::If(condition, then, otherwise) => self.if_expr(condition, then, otherwise.as_deref(), span),
            K::For(pattern, iterable, body) => self.comprehension(pattern, iterable, body, span),
            K::Block(items, result) => self.block(items, result.as_deref(), span),
            K::Error => error(span),
        }
    }

    fn tuple(&mut self, items: &'a [ast::Expr], span: Span) -> Expr {
        let items: Vec<Expr> = items.iter().map(|e| self.expr(e)).collect();
        self.make_tuple(items, span)
    }

    pub(super) fn make_tuple(&mut self, items: Vec<Expr>, span: Span) -> Expr {
        let ty = Type::tuple(items.iter().map(|e| e.ty.clone()).collect());
        if ty.is_error() || !self.use_fuel(self.size(&ty), span) {
            return error(span);
        }
        Expr { kind: ExprKind::Aggregate(items), ty, span }
    }

    /// An array of values of one type; a tuple where they are functions that differ.
    pub(super) fn array(&mut self, items: Vec<Expr>, span: Span) -> Expr {
        if items.iter().any(|e| e.ty.is_error()) {
            return error(span);
        }
        if items.len() > self.options.iterations {
            let message =
                format!("an array can have {} elements, but this has {}", self.options.iterations, items.len());
            return self.fail(Diagnostic::new(Code::TooLarge, span, message).hint(ITERATIONS_HINT));
        }
        let Some(first) = items.first() else {
            // Nothing is known of its elements, and nothing will be asked of them.
            return Expr { kind: ExprKind::Aggregate(items), ty: Type::Array(Type::REAL.into(), 0), span };
        };
        let mut ty = first.ty.clone();
        for item in &items[1..] {
            match self.join(&ty, &item.ty) {
                Some(joined) => ty = joined,
                None if item.ty.has_function() && ty.has_function() => return self.make_tuple(items, span),
                None if self.differ_in_length(&item.ty, &ty) => return self.make_tuple(items, span),
                None => {
                    let message = format!(
                        "the elements of an array must be of one kind: this is {}, the ones before are {}",
                        self.describe(&item.ty),
                        self.describe(&ty)
                    );
                    let mut error =
                        Diagnostic::new(Code::MixedArray, item.span, message).related(first.span, "first element");
                    if let Type::Real(d) = ty {
                        error = error.suggestion(self.unit_advice(item, d));
                    }
                    return self.fail(error);
                }
            }
        }
        let whole = Type::Array(ty.clone().into(), items.len());
        if !self.use_fuel(self.size(&whole), span) {
            return error(span);
        }
        let items = items.into_iter().map(|e| self.convert(e, &ty)).collect();
        Expr { kind: ExprKind::Aggregate(items), ty: whole, span }
    }

    /// Arrays of the same elements, but not as many: an array of such is a tuple.
    fn differ_in_length(&mut self, a: &Type, b: &Type) -> bool {
        match (a, b) {
            (Type::Array(x, n), Type::Array(y, m)) => *n == 0 || *m == 0 || self.join(x, y).is_some(),
            _ => false,
        }
    }

    fn record(&mut self, fields: &'a [(Ident, ast::Expr)], span: Span) -> Expr {
        let mut values = Vec::new();
        for (i, (name, value)) in fields.iter().enumerate() {
            if let Some((before, _)) = fields[..i].iter().find(|(n, _)| n.text == name.text) {
                self.report(
                    Diagnostic::new(
                        Code::DuplicateName,
                        name.span,
                        format!("the field '{}' is given twice", name.text),
                    )
                    .related(before.span, "first given here"),
                );
            }
            values.push((name.text.as_str(), self.expr(value)));
        }
        self.make_record(values, span)
    }

    pub(super) fn make_record(&mut self, values: Vec<(&str, Expr)>, span: Span) -> Expr {
        let ty = Type::Record(values.iter().map(|(n, e)| ((*n).into(), e.ty.clone())).collect());
        if ty.is_error() || !self.use_fuel(self.size(&ty), span) {
            return error(span);
        }
        Expr { kind: ExprKind::Aggregate(values.into_iter().map(|(_, e)| e).collect()), ty, span }
    }

    fn range(&mut self, a: &'a ast::Expr, b: &'a ast::Expr, span: Span) -> Expr {
        let (a, b) = (self.expr(a), self.expr(b));
        match (&a.ty, &b.ty) {
            (Type::Int(from), Type::Int(to)) => {
                let ty = Type::Range(*from, *to);
                Expr { kind: ExprKind::Aggregate(vec![a, b]), ty, span }
            }
            (a, b) if a.is_error() || b.is_error() => error(span),
            _ => {
                let wrong = if matches!(a.ty, Type::Int(_)) { &b } else { &a };
                let message =
                    format!("the bounds of a range must be whole numbers, but this is {}", self.describe(&wrong.ty));
                let diagnostic = Diagnostic::new(Code::TypeMismatch, wrong.span, message)
                    .hint("a count is a literal or an 'input n: int'; for n steps over 0..1 write: for i in 0..n { ... i / n ... }");
                self.fail(diagnostic)
            }
        }
    }

    fn if_expr(
        &mut self,
        condition: &'a ast::Expr,
        then: &'a ast::Expr,
        otherwise: Option<&'a ast::Expr>,
        span: Span,
    ) -> Expr {
        let literal = is_literal(condition);
        let condition = self.expr(condition);
        let Some(otherwise) = otherwise else {
            let error = Diagnostic::new(
                Code::MissingElse,
                span,
                "this 'if' has no 'else', so it has no value where the condition is false",
            )
            .hint("add `else { ... }`");
            return self.fail(error);
        };
        match condition.ty {
            // The same side is taken in every call, so that the types of both need not agree.
            Type::Bool(Some(holds)) if literal => {
                let (a, b) = (self.expr(then), self.expr(otherwise));
                let functions = a.ty.has_function() && b.ty.has_function();
                if self.join(&a.ty, &b.ty).is_none() && !functions {
                    return self.choose(condition, a, b, span);
                }
                if holds { a } else { b }
            }
            Type::Bool(Some(true)) => self.expr(then),
            Type::Bool(Some(false)) => self.expr(otherwise),
            Type::Bool(None) => {
                let (a, b) = (self.expr(then), self.expr(otherwise));
                self.choose(condition, a, b, span)
            }
            _ => {
                // Both sides may have mistakes of their own.
                self.condition_error(&condition);
                self.expr(then);
                self.expr(otherwise);
                error(span)
            }
        }
    }

    pub(super) fn condition_error(&mut self, condition: &Expr) {
        if !condition.ty.is_error() {
            let message = format!("a condition must be a truth value, but this is {}", self.describe(&condition.ty));
            self.report(
                Diagnostic::new(Code::TypeMismatch, condition.span, message).hint("write a comparison, such as x > 0"),
            );
        }
    }

    /// `if` on a condition that is known only when the program runs.
    pub(super) fn choose(&mut self, condition: Expr, a: Expr, b: Expr, span: Span) -> Expr {
        if a.ty.is_error() || b.ty.is_error() {
            return error(span);
        }
        let Some(ty) = self.join(&a.ty, &b.ty) else {
            let (first, second) = (self.describe(&a.ty), self.describe(&b.ty));
            let diagnostic = if a.ty.has_function() && b.ty.has_function() {
                Diagnostic::new(
                    Code::FunctionChoice,
                    span,
                    "a condition that is known only at run time cannot choose between functions",
                )
                .hint("let the function choose between values: |u, v| if c { f(u, v) } else { g(u, v) }")
            } else {
                let error = Diagnostic::new(
                    Code::BranchesDiffer,
                    b.span,
                    format!("the branches of this 'if' differ: {first} and {second}"),
                )
                .related(a.span, first);
                let advice = match (&a.ty, &b.ty) {
                    (Type::Real(d), _) => self.unit_advice(&b, *d),
                    (_, Type::Real(d)) => self.unit_advice(&a, *d),
                    _ => None,
                };
                error.suggestion(advice)
            };
            return self.fail(diagnostic);
        };
        let (a, b) = (self.convert(a, &ty), self.convert(b, &ty));
        known(Expr { kind: ExprKind::If(Box::new(condition), Box::new(a), Box::new(b)), ty, span })
    }

    fn lambda(&mut self, params: &'a [FnParam], body: &'a ast::Expr, span: Span) -> Expr {
        let address = std::ptr::from_ref(body) as usize;
        let free = self.free_names.entry(address).or_insert_with(|| free::of_lambda(params, body).into()).clone();
        let names: Vec<&str> = params.iter().map(|p| p.pattern.name().map_or("(..)", |name| &name.text)).collect();
        let name = format!("|{}|", names.join(", "));
        self.capture(&name, Callee::Lambda(self.env.module, params, body), &free, span)
    }

    pub(super) fn local_function(&mut self, decl: &'a FunctionDecl) -> Expr {
        let address = std::ptr::from_ref(decl) as usize;
        let given = self.given_derivative(decl);
        let free = self.free_names.entry(address).or_insert_with(|| free::of_function(decl, given).into()).clone();
        self.capture(&decl.name.text, Callee::Function(self.env.module, decl), &free, decl.name.span)
    }

    /// A closure over those of the names that are bound outside of it.
    fn capture(&mut self, name: &str, callee: Callee<'a>, free: &Rc<[&'a str]>, span: Span) -> Expr {
        let mut captures = Vec::new();
        let mut values = Vec::new();
        for name in free.iter() {
            if self.env.names.iter().any(|(n, _)| n == name)
                && let Some(value) = self.find(name, span)
            {
                if value.ty.is_error() {
                    return error(span);
                }
                captures.push((*name, value.ty.clone()));
                values.push(value);
            }
        }
        let id = self.intern(name, callee, captures);
        Expr { kind: ExprKind::Aggregate(values), ty: Type::Closure(id), span }
    }
}

/// Whether an expression consists of literals and operators only.
fn is_literal(e: &ast::Expr) -> bool {
    use ast::ExprKind as K;
    match &e.kind {
        K::Int(_) | K::Real(..) | K::Bool(_) => true,
        K::Unary(_, a) => is_literal(a),
        K::Binary(_, a, b) => is_literal(a) && is_literal(b),
        _ => false,
    }
}

/// Component `index` of a tuple, array or record.
pub(super) fn element(value: Expr, index: usize) -> Expr {
    let span = value.span;
    let ty = match &value.ty {
        Type::Tuple(types) => types.get(index).cloned(),
        Type::Array(ty, _) => Some((**ty).clone()),
        Type::Record(fields) => fields.get(index).map(|(_, ty)| ty.clone()),
        Type::Range(a, b) => Some(Type::Int(if index == 0 { *a } else { *b })),
        _ => None,
    };
    let Some(ty) = ty else { return error(span) };
    if let ExprKind::Aggregate(items) = value.kind {
        return items.into_iter().nth(index).unwrap_or_else(|| error(span));
    }
    known(Expr { kind: ExprKind::Element(Box::new(value), index), ty, span })
}

fn number(value: f64, unit: Option<Unit>, span: Span) -> Expr {
    let (scale, dimension) = match unit {
        None => (1.0, Dimension::NONE),
        Some(Unit::Mm) => (1.0, Dimension::LENGTH),
        Some(Unit::Cm) => (10.0, Dimension::LENGTH),
        Some(Unit::M) => (1000.0, Dimension::LENGTH),
        Some(Unit::In) => (25.4, Dimension::LENGTH),
        Some(Unit::Deg) => (std::f64::consts::PI / 180.0, Dimension::ANGLE),
        Some(Unit::Rad) => (1.0, Dimension::ANGLE),
        Some(Unit::Turn) => (std::f64::consts::TAU, Dimension::ANGLE),
    };
    Expr { kind: ExprKind::Real(value * scale), ty: Type::Real(dimension), span }
}

/// A local's value, for code that makes trees by hand.
pub(super) fn local_expr(id: LocalId, ty: Type, span: Span) -> Expr {
    known(Expr { kind: ExprKind::Local(id), ty, span })
}
