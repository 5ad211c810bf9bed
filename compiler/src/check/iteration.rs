//! Comprehensions, `fold`, `sum` and `each`.

use super::bindings::wrap;
use super::context::{Checker, error, int, known};
use super::expressions::element;
use super::operators::is_number;
use super::solids::{INSIDE, is_hidden};
use super::typed::{Expr, ExprKind, Statement, Type};
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::source::Span;
use crate::syntax::ast::{self, BinaryOp, Pattern};

/// The hint for raising the limit on iterations.
pub(super) const ITERATIONS_HINT: &str = "the limit can be raised: --limit iterations=N";

impl<'a> Checker<'a> {
    /// `for pattern in iterable { body }`: an array, written out.
    pub(super) fn comprehension(
        &mut self,
        pattern: &'a Pattern,
        iterable: &'a ast::Expr,
        body: &'a ast::Expr,
        span: Span,
    ) -> Expr {
        let iterable = self.expr(iterable);
        let mut outer = Vec::new();
        let Some(items) = self.items("for", iterable, &mut outer) else { return error(span) };
        let mut values = Vec::with_capacity(items.len());
        for item in items {
            let mark = self.env.names.len();
            let mut statements = Vec::new();
            self.bind(pattern, item, &mut statements);
            let value = self.expr(body);
            self.env.names.truncate(mark);
            if value.ty.is_error() {
                return error(span);
            }
            let at = value.span;
            values.push(wrap(statements, value, at));
        }
        let array = self.array(values, span);
        wrap(outer, array, span)
    }

    /// The elements of an array, a tuple or a known range, one by one, for the construct of the name `what`.
    pub(super) fn items(&mut self, what: &str, iterable: Expr, statements: &mut Vec<Statement>) -> Option<Vec<Expr>> {
        let span = iterable.span;
        let count = match &iterable.ty {
            Type::Error => return None,
            Type::Range(Some(from), Some(to)) => {
                let (from, to) = (*from, *to);
                if !self.few_enough(i128::from(to) - i128::from(from), span) {
                    return None;
                }
                return Some((from..to).map(|i| int(i, span)).collect());
            }
            Type::Range(..) => {
                let message = "the length of this array is known only at run time; it must be known at compile time";
                self.report(
                    Diagnostic::new(Code::UnknownLength, span, message)
                        .hint("loop over a range whose bounds are literals or inputs, or use fold"),
                );
                return None;
            }
            Type::Array(_, n) => *n,
            Type::Tuple(types) => types.len(),
            other => {
                let message = format!("'{what}' loops over a range or an array, but this is {}", self.describe(other));
                let diagnostic = Diagnostic::new(Code::TypeMismatch, span, message);
                self.report(match (what, other) {
                    ("for" | "sum", Type::Int(_)) => {
                        diagnostic.suggest("to repeat n times, write 0..n", [Edit::before(span, "0..")])
                    }
                    ("fold", _) => diagnostic.hint("the order is fold(init, xs, |so_far, x| ...)"),
                    ("min" | "max", _) => {
                        diagnostic.hint(format!("it takes two numbers or more, or one array: {what}(a, b)"))
                    }
                    ("sum", Type::Closure(_)) => {
                        diagnostic.hint("make an array of the values: sum(for i in 0..n { ... })")
                    }
                    _ => diagnostic,
                });
                return None;
            }
        };
        let whole = self.keep(iterable, statements);
        Some((0..count).map(|i| element(whole.clone(), i)).collect())
    }

    /// `count` is negative for a range whose end is before its start, which is empty.
    fn few_enough(&mut self, count: i128, span: Span) -> bool {
        let limit = self.options.iterations;
        if usize::try_from(count.max(0)).is_ok_and(|n| n <= limit) {
            return true;
        }
        let message = format!("this loop has {count} iterations, but at most {limit} can be unrolled");
        self.report(Diagnostic::new(Code::TooLarge, span, message).hint(ITERATIONS_HINT));
        false
    }

    /// `fold(init, xs, f)`: f(f(f(init, x0), x1), x2)...
    pub(super) fn fold(&mut self, init: Expr, xs: Expr, f: Expr, span: Span) -> Expr {
        if !self.takes_so_far_and_next(&f) {
            return error(span);
        }
        let long = match xs.ty {
            Type::Range(Some(from), Some(to)) => {
                usize::try_from(to.saturating_sub(from)).is_ok_and(|n| n > self.options.unroll)
            }
            Type::Range(..) => true,
            _ => false,
        };
        if long {
            return self.fold_loop(init, xs, f, span);
        }
        let mut statements = Vec::new();
        let Some(items) = self.items("fold", xs, &mut statements) else { return error(span) };
        let f = self.keep(f, &mut statements);
        let step = |checker: &mut Self, so_far, item| checker.call_with(f.clone(), vec![so_far, item], span);
        match self.accumulate(init, items, &mut statements, step) {
            Some(value) => wrap(statements, value, span),
            None => error(span),
        }
    }

    /// Combines a value with items one after another; `None` after an error.
    pub(super) fn accumulate(
        &mut self,
        mut value: Expr,
        items: impl IntoIterator<Item = Expr>,
        statements: &mut Vec<Statement>,
        mut step: impl FnMut(&mut Self, Expr, Expr) -> Expr,
    ) -> Option<Expr> {
        for item in items {
            let next = step(self, value, item);
            if next.ty.is_error() {
                return None;
            }
            value = self.keep(next, statements);
        }
        Some(value)
    }

    /// Whether a function can be called as `fold` and `loop` do; else that is reported.
    fn takes_so_far_and_next(&mut self, f: &Expr) -> bool {
        let message = match f.ty {
            Type::Error => return true,
            Type::Closure(id) if self.accepts(id, 2) => return true,
            _ => format!("a function of two arguments is needed here, but this is {}", self.describe(&f.ty)),
        };
        let error = Diagnostic::new(Code::Arguments, f.span, message);
        self.report(error.hint("it is given the result so far and the next element: |so_far, x| ..."));
        false
    }

    /// `loop(init, count, f)`: as `fold(init, 0..count, f)`, and never written out, so that a long f stays one.
    pub(super) fn fold_count(&mut self, init: Expr, count: Expr, f: Expr, span: Span) -> Expr {
        let Type::Int(n) = count.ty else {
            let message =
                format!("the number of iterations must be a whole number, but this is {}", self.describe(&count.ty));
            return self.fail(Diagnostic::new(Code::TypeMismatch, count.span, message));
        };
        if !self.takes_so_far_and_next(&f) {
            return error(span);
        }
        let bounds = vec![int(0, count.span), count];
        let range = Expr { kind: ExprKind::Aggregate(bounds), ty: Type::Range(Some(0), n), span };
        self.fold_loop(init, range, f, span)
    }

    /// A fold over a range that is long, or known only at run time, stays a loop: the accumulator has one type.
    fn fold_loop(&mut self, init: Expr, range: Expr, f: Expr, span: Span) -> Expr {
        let mut statements = Vec::new();
        let range = self.keep(range, &mut statements);
        let f = self.keep(f, &mut statements);
        let (from, to) = (element(range.clone(), 0), element(range, 1));
        let index = self.local("", Type::INT, span);
        let mut ty = init.ty.forget();
        for _ in 0..4 {
            let accumulator = self.local("", ty.clone(), span);
            let (a, i) = (self.read(accumulator, span), self.read(index, span));
            let body = self.call_with(f.clone(), vec![a, i], span);
            if body.ty.is_error() {
                return error(span);
            }
            let Some(joined) = self.join(&ty, &body.ty) else {
                ty = body.ty;
                break;
            };
            if joined != ty {
                ty = joined;
                continue;
            }
            let (init, body) = (self.convert(init, &ty), self.convert(body, &ty));
            let kind = ExprKind::Fold {
                from: Box::new(from),
                to: Box::new(to),
                init: Box::new(init),
                index,
                accumulator,
                body: Box::new(body),
            };
            return wrap(statements, known(Expr { kind, ty, span }), span);
        }
        let message = format!(
            "a loop's accumulator must stay of one kind: it starts as {} and becomes {}",
            self.describe(&init.ty),
            self.describe(&ty)
        );
        self.fail(Diagnostic::new(Code::TypeMismatch, span, message))
    }

    /// `sum(xs)`.
    pub(super) fn sum_of(&mut self, xs: Expr, span: Span) -> Expr {
        let mut statements = Vec::new();
        let Some(items) = self.items("sum", xs, &mut statements) else { return error(span) };
        let mut items = items.into_iter();
        let Some(first) = items.next() else { return int(0, span) };
        let add = |checker: &mut Self, a, b| checker.operate(BinaryOp::Add, a, b, span);
        match self.accumulate(first, items, &mut statements, add) {
            Some(total) => wrap(statements, total, span),
            None => error(span),
        }
    }

    /// `each(shape, f)`: f of a function, a number or a vector; of anything that holds such, f of each in it.
    /// A solid's function and the sides of its surfaces are left out, and so no solid is left.
    pub(super) fn each(&mut self, shape: Expr, f: Expr, span: Span) -> Expr {
        let mut statements = Vec::new();
        let f = self.keep(f, &mut statements);
        let value = self.each_inner(shape, &f, None, span);
        wrap(statements, value, span)
    }

    /// `each_solid(shape, f, of_inside)`: as `each`, and `of_inside` of the function of what is inside of a solid,
    /// which stays one, and of the sides of its surfaces.
    pub(super) fn each_solid(&mut self, shape: Expr, f: Expr, of_inside: Expr, span: Span) -> Expr {
        let mut statements = Vec::new();
        let f = self.keep(f, &mut statements);
        let of_inside = self.keep(of_inside, &mut statements);
        let value = self.each_inner(shape, &f, Some(&of_inside), span);
        wrap(statements, value, span)
    }

    fn each_inner(&mut self, shape: Expr, f: &Expr, of_inside: Option<&Expr>, span: Span) -> Expr {
        let single = match &shape.ty {
            Type::Tuple(types) => types.iter().all(is_number),
            Type::Array(..) | Type::Record(_) => false,
            _ => true,
        };
        if single {
            return self.call_with(f.clone(), vec![shape], span);
        }
        let mut statements = Vec::new();
        let ty = shape.ty.clone();
        let whole = self.keep(shape, &mut statements);
        let value = match ty {
            Type::Record(fields) => {
                let mut values = Vec::new();
                for (i, (name, _)) in fields.iter().enumerate() {
                    let value = element(whole.clone(), i);
                    values.push((
                        &**name,
                        match of_inside {
                            Some(g) if &**name == INSIDE => self.call_with(g.clone(), vec![value], span),
                            None if is_hidden(name) => continue,
                            _ => self.each_inner(value, f, of_inside, span),
                        },
                    ));
                }
                self.make_record(values, span)
            }
            Type::Tuple(types) => {
                let item = |i| self.each_inner(element(whole.clone(), i), f, of_inside, span);
                let values = (0..types.len()).map(item).collect();
                self.make_tuple(values, span)
            }
            Type::Array(_, n) => {
                let item = |i| self.each_inner(element(whole.clone(), i), f, of_inside, span);
                let values = (0..n).map(item).collect();
                self.array(values, span)
            }
            _ => error(span),
        };
        wrap(statements, value, span)
    }

    /// `a[i]`.
    pub(super) fn index(&mut self, e: &'a ast::Expr, index: &'a ast::Expr, span: Span) -> Expr {
        let (value, index) = (self.expr(e), self.expr(index));
        if value.ty.is_error() || index.ty.is_error() {
            return error(span);
        }
        let Type::Int(at) = index.ty else {
            let message = format!("an index must be a whole number, but this is {}", self.describe(&index.ty));
            let diagnostic = Diagnostic::new(Code::TypeMismatch, index.span, message);
            return self.fail(diagnostic.hint("floor(...) makes a whole number"));
        };
        let count = match &value.ty {
            Type::Array(_, n) => *n,
            Type::Tuple(types) => types.len(),
            other => {
                let message = format!("only arrays and tuples have elements, but this is {}", self.describe(other));
                return self.fail(Diagnostic::new(Code::TypeMismatch, value.span, message));
            }
        };
        match at {
            Some(at) => match usize::try_from(at).ok().filter(|i| *i < count) {
                Some(i) => Expr { span, ..element(value, i) },
                None => {
                    let message = format!("there is no element {at}: the array has {count}, counted from 0");
                    self.fail(Diagnostic::new(Code::Index, index.span, message))
                }
            },
            None => self.index_later(value, index, span),
        }
    }

    /// An index that is known only at run time: all elements must be of one kind.
    fn index_later(&mut self, value: Expr, index: Expr, span: Span) -> Expr {
        let ty = match &value.ty {
            Type::Array(ty, _) => Some((**ty).clone()),
            Type::Tuple(types) => {
                let types = types.clone();
                let first = types.first().cloned();
                types.iter().fold(first, |joined, ty| joined.and_then(|j| self.join(&j, ty)))
            }
            _ => None,
        };
        let Some(ty) = ty.map(|t| t.forget()) else {
            let message = "an index that is known only at run time cannot select from values of different types";
            return self.fail(Diagnostic::new(Code::FunctionChoice, span, message));
        };
        let n = value.ty.count();
        if n == 0 {
            return self.fail(Diagnostic::new(Code::Index, span, "this array has no elements"));
        }
        let value = if matches!(value.ty, Type::Tuple(_)) {
            let whole = Type::tuple(vec![ty.clone(); n]);
            Expr { ty: Type::Array(ty.clone().into(), n), ..self.convert(value, &whole) }
        } else {
            value
        };
        Expr { kind: ExprKind::Index(Box::new(value), Box::new(index)), ty, span }
    }
}
