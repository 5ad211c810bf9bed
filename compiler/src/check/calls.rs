//! Calls: which argument goes to which parameter.

use super::context::{Callee, Checker, error, known};
use super::edges::name_of;
use super::expressions::element;
use super::solids::{is_hidden, is_solid};
use super::typed::{Call, Expr, ExprKind, FunctionId, Type};
use super::types::ClosureId;
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::source::Span;
use crate::suggest::nearest;
use crate::syntax::ast::{self, Arg, FnParam, Ident, ItemKind, TypeExpr};

/// An argument of a call.
pub(super) struct Given<'a> {
    pub(super) label: Option<&'a Ident>,
    pub(super) value: Expr,
}

/// A parameter as callers see it.
#[derive(Clone, Copy)]
pub(super) struct Parameter<'a> {
    /// Its label; empty for a tuple pattern.
    pub(super) name: &'a str,
    pub(super) ty: Option<&'a TypeExpr>,
    pub(super) optional: bool,
}

impl<'a> Checker<'a> {
    /// The parameters of a function value.
    pub(super) fn parameters(&self, id: ClosureId) -> Vec<Parameter<'a>> {
        match self.closure(id).callee {
            Callee::Function(_, decl) => decl.params.iter().map(parameter).collect(),
            Callee::Lambda(_, params, _) => params.iter().map(parameter).collect(),
            Callee::Model(_, model) => model.items.iter().filter_map(model_parameter).collect(),
            Callee::Global(..) => Vec::new(),
            Callee::Builtin(builtin) => {
                let required = builtin.required();
                let names = builtin.parameters().iter().enumerate();
                names.map(|(i, name)| Parameter { name, ty: None, optional: i >= required }).collect()
            }
            Callee::Derivative(of, _) => self.parameters(of),
        }
    }

    /// The number of arguments that a function must be given.
    pub(super) fn arity(&self, id: ClosureId) -> usize {
        self.parameters(id).iter().filter(|p| !p.optional).count()
    }

    /// Whether a function can be called with `n` arguments in order.
    pub(super) fn accepts(&self, id: ClosureId, n: usize) -> bool {
        if let Callee::Builtin(builtin) = self.closure(id).callee
            && builtin.variadic()
        {
            return n >= 1;
        }
        let params = self.parameters(id);
        n <= params.len() && params[n..].iter().all(|p| p.optional)
    }

    pub(super) fn call_expr(&mut self, f: &'a ast::Expr, args: &'a [Arg], span: Span) -> Expr {
        let paths = || args.iter().map(|arg| &arg.value).collect::<Vec<_>>();
        if let Some(of_parts) = self.hidden_of_parts(f) {
            return self.figure(of_parts, &paths(), span);
        }
        let f = self.expr(f);
        if let Some(of_parts) = self.of_parts(&f) {
            return self.figure(of_parts, &paths(), span);
        }
        if let Some(blend) = self.blend_of(&f) {
            return self.blend_in_call(blend, args, span);
        }
        let args = self.given(args);
        self.call(f, args, span)
    }

    fn given(&mut self, args: &'a [Arg]) -> Vec<Given<'a>> {
        let outer = self.preceding_args;
        let given = args.iter().enumerate().map(|(i, arg)| {
            self.preceding_args = &args[..i];
            Given { label: arg.label.as_ref(), value: self.expr(&arg.value) }
        });
        let given = given.collect();
        self.preceding_args = outer;
        given
    }

    /// `a.f(b)`: a function of a module used whole, a function in a field, or `f(a, b)`.
    pub(super) fn method(&mut self, receiver: &'a ast::Expr, name: &'a Ident, args: &'a [Arg], span: Span) -> Expr {
        if let ast::ExprKind::Name(module) = &receiver.kind
            && let Some(f) = self.module_member(module, &name.text, name.span)
        {
            let args = self.given(args);
            return self.call(f, args, span);
        }
        if self.measuring.is_some()
            && let Some(f) = self.find(&name.text, name.span)
            && let Some(of_parts) = self.of_parts(&f)
        {
            let paths: Vec<&ast::Expr> = std::iter::once(receiver).chain(args.iter().map(|arg| &arg.value)).collect();
            return self.figure(of_parts, &paths, span);
        }
        let named = name_of(receiver);
        let receiver = self.expr(receiver);
        // A body that has fillets has a field of this name, too.
        if (is_solid(&receiver.ty) || receiver.ty.is_error())
            && let Some(f) = self.find(&name.text, name.span)
            && let Some(blend) = self.blend_of(&f)
        {
            return self.blend(blend, receiver, named, args, span);
        }
        if let Some(index) = field_index(&receiver.ty, &name.text) {
            let f = element(receiver, index);
            let args = self.given(args);
            return self.call(f, args, span);
        }
        let f = self.find(&name.text, name.span);
        let mut all = vec![Given { label: None, value: receiver }];
        all.extend(self.given(args));
        match f {
            Some(f) => self.call(f, all, span),
            None => self.name(&name.text, name.span),
        }
    }

    pub(super) fn field(&mut self, e: &'a ast::Expr, name: &'a Ident, span: Span) -> Expr {
        if let ast::ExprKind::Name(module) = &e.kind
            && let Some(member) = self.module_member(module, &name.text, name.span)
        {
            return member;
        }
        let value = self.expr(e);
        if value.ty.is_error() {
            return error(span);
        }
        if let Some(index) = field_index(&value.ty, &name.text) {
            return Expr { span, ..element(value, index) };
        }
        let message = format!("{} has no '.{}'", self.describe(&value.ty), name.text);
        let diagnostic = Diagnostic::new(Code::UnknownField, name.span, message);
        let fields: Vec<&str> = match &value.ty {
            Type::Record(fields) => fields.iter().map(|(n, _)| &**n).filter(|n| !is_hidden(n)).collect(),
            _ => Vec::new(),
        };
        let diagnostic = match (nearest(&name.text, fields.iter().copied()), &value.ty) {
            (Some(near), _) => diagnostic.suggest(format!("did you mean '.{near}'?"), [Edit::replace(name.span, near)]),
            (None, Type::Record(_)) => diagnostic.hint(format!("its fields are {}", fields.join(", "))),
            (None, Type::Tuple(types)) if !self.is_function(&name.text) => diagnostic.hint(match types.len() {
                2 => "the components are .x and .y",
                3 => "the components are .x, .y and .z",
                _ => "the components are accessed by index, as in t[3]",
            }),
            (None, Type::Array(..)) if matches!(name.text.as_str(), "length" | "size" | "count") => {
                diagnostic.suggest("it is written '.len()'", [Edit::replace(name.span, "len()")])
            }
            (None, ty) if self.is_function(&name.text) && !matches!(ty, Type::Closure(_)) => diagnostic
                .suggest(format!("it is a function: call it, '.{}()'", name.text), [Edit::after(name.span, "()")]),
            (None, Type::Closure(_)) => diagnostic.hint("call the function first"),
            _ => diagnostic,
        };
        self.fail(diagnostic)
    }

    /// Calls a function value.
    pub(super) fn call(&mut self, f: Expr, args: Vec<Given<'a>>, span: Span) -> Expr {
        if f.ty.is_error() || args.iter().any(|a| a.value.ty.is_error()) {
            return error(span);
        }
        let Type::Closure(id) = f.ty else {
            let message = format!("only a function can be called, but this is {}", self.describe(&f.ty));
            let diagnostic = Diagnostic::new(Code::NotAFunction, f.span, message);
            return self.fail(match f.ty {
                Type::Int(_) | Type::Real(_) => diagnostic.suggest("write * to multiply", [Edit::after(f.span, " * ")]),
                // In a list over several lines a line end separates nothing.
                Type::Tuple(_) | Type::Array(..) | Type::Record(_) | Type::Text(_) => {
                    diagnostic.suggest("is a comma missing after it?", [Edit::after(f.span, ",")])
                }
                _ => diagnostic,
            });
        };
        let callee = self.closure(id).callee;
        let mut params = self.parameters(id);
        if let Callee::Builtin(builtin) = callee
            && builtin.variadic()
        {
            params.resize(args.len().max(1), Parameter { name: "", ty: None, optional: false });
        }
        let Some(slots) = self.match_args(id, &params, args, span) else { return error(span) };
        if let Callee::Builtin(builtin) = callee {
            return self.builtin(builtin, slots.into_iter().flatten().collect(), span);
        }
        let mut types = Vec::new();
        let mut values = Vec::new();
        for (param, slot) in params.iter().zip(slots) {
            let Some(value) = slot else {
                types.push(None);
                continue;
            };
            let value = self.coerce_written(value, param.ty, &format!("'{}'", param.name));
            if value.ty.is_error() {
                return error(span);
            }
            values.push(value);
            types.push(Some(values[values.len() - 1].ty.clone()));
        }
        self.seeds_real(id, &mut types, &mut values);
        match self.instantiate(id, types, span) {
            Some((function, ty)) => self.make_call(function, f, values, ty, span),
            None => error(span),
        }
    }

    /// Calls a function value with values in order.
    pub(super) fn call_with(&mut self, f: Expr, values: Vec<Expr>, span: Span) -> Expr {
        let args = values.into_iter().map(|value| Given { label: None, value }).collect();
        self.call(f, args, span)
    }

    pub(super) fn make_call(&self, function: FunctionId, f: Expr, args: Vec<Expr>, ty: Type, span: Span) -> Expr {
        let captures = match f.ty {
            Type::Closure(id) => !self.closure(id).captures.is_empty(),
            _ => false,
        };
        let closure = captures.then(|| Box::new(f));
        known(Expr { kind: ExprKind::Call(Call { function, closure, args }), ty, span })
    }

    /// A derivative's argument is a real, also where an int is given.
    fn seeds_real(&mut self, id: ClosureId, types: &mut [Option<Type>], values: &mut [Expr]) {
        let mut callee = self.closure(id).callee;
        while let Callee::Derivative(of, wrt) = callee {
            let at = types[..wrt].iter().flatten().count();
            if let Some(Some(ty @ Type::Int(_))) = types.get_mut(wrt) {
                *ty = Type::REAL;
                let value = std::mem::replace(&mut values[at], error(Span::default()));
                values[at] = self.convert(value, &Type::REAL);
            }
            callee = self.closure(of).callee;
        }
    }

    /// The argument of every parameter; `None` where it is left to its default.
    fn match_args(
        &mut self,
        id: ClosureId,
        params: &[Parameter<'a>],
        args: Vec<Given<'a>>,
        span: Span,
    ) -> Option<Vec<Option<Expr>>> {
        let mut slots: Vec<Option<Expr>> = params.iter().map(|_| None).collect();
        let mut position = 0;
        let mut good = true;
        for arg in args {
            let at = match arg.label {
                Some(label) => match params.iter().position(|p| p.name == label.text) {
                    Some(at) => at,
                    None => {
                        let diagnostic = self.unknown_label(&self.called(id), label, params);
                        self.report(diagnostic);
                        good = false;
                        continue;
                    }
                },
                None if matches!(self.closure(id).callee, Callee::Model(..)) => {
                    let message = format!("the arguments of the model {} must be labelled", self.called(id));
                    let hint = params.first().map(|p| format!("write {}: before the value, for example", p.name));
                    let mut diagnostic = Diagnostic::new(Code::Arguments, arg.value.span, message);
                    diagnostic.hint = hint;
                    self.report(diagnostic);
                    return None;
                }
                None => {
                    position += 1;
                    position - 1
                }
            };
            match slots.get_mut(at) {
                None => {
                    self.one_too_many(id, params.len(), &arg.value, slots.first().and_then(Option::as_ref));
                    return None;
                }
                Some(Some(_)) => {
                    let message = format!("'{}' is given twice", params[at].name);
                    self.report(Diagnostic::new(Code::Arguments, arg.value.span, message));
                    good = false;
                }
                Some(slot) => *slot = Some(arg.value),
            }
        }
        (good && self.none_is_missing(id, params, &slots, span)).then_some(slots)
    }

    fn one_too_many(&mut self, id: ClosureId, count: usize, value: &Expr, first: Option<&Expr>) {
        let name = self.called(id);
        let message = match count {
            0 => format!("{name} takes no arguments"),
            1 => format!("{name} takes one argument, but this is one more"),
            n => format!("{name} takes {n} arguments, but this is one more"),
        };
        let mut diagnostic = Diagnostic::new(Code::Arguments, value.span, message);
        let point = |e: &Expr| matches!(e.ty, Type::Tuple(_));
        if count == 1 && point(value) && first.is_some_and(point) {
            let hint = format!("several points are given as an array: {}([a, b])", name.trim_matches('\''));
            diagnostic = diagnostic.hint(hint);
        }
        self.report(self.with_definition(id, diagnostic));
    }

    /// Whether every parameter without a default has its argument; else that is reported.
    fn none_is_missing(&mut self, id: ClosureId, params: &[Parameter<'a>], slots: &[Option<Expr>], span: Span) -> bool {
        let missing = params.iter().zip(slots).filter(|(p, s)| s.is_none() && !p.optional);
        let missing: Vec<String> = missing
            .map(|(p, _)| if p.name.is_empty() { "'a tuple'".to_owned() } else { format!("'{}'", p.name) })
            .collect();
        if missing.is_empty() {
            return true;
        }
        let (name, list) = (self.called(id), missing.join(" and "));
        let message = if name.starts_with('\'') {
            format!("this call of {name} is missing {list}")
        } else {
            format!("a function is called here without {list}")
        };
        self.report(self.with_definition(id, Diagnostic::new(Code::Arguments, span, message)));
        false
    }

    fn unknown_label(&self, name: &str, label: &Ident, params: &[Parameter<'a>]) -> Diagnostic {
        let names: Vec<&str> = params.iter().map(|p| p.name).filter(|n| !n.is_empty()).collect();
        let message = format!("{name} has no parameter '{}'", label.text);
        let diagnostic = Diagnostic::new(Code::UnknownLabel, label.span, message);
        let mut begun = names.iter().filter(|n| n.starts_with(label.text.as_str()));
        let abbreviated = begun.next().filter(|_| begun.next().is_none());
        match nearest(&label.text, names.iter().copied()).or(abbreviated.copied()) {
            Some(near) => diagnostic.did_you_mean(label.span, near),
            None if names.is_empty() => diagnostic,
            None if names.contains(&"radius") && (label.text == "d" || label.text.starts_with("diam")) => {
                diagnostic.hint("give the radius: half of the diameter")
            }
            None => diagnostic.hint(parameters_in_words(&names)),
        }
    }

    /// Adds where the function is defined.
    fn with_definition(&self, id: ClosureId, diagnostic: Diagnostic) -> Diagnostic {
        match self.closure(id).callee {
            Callee::Function(_, decl) => diagnostic.related(decl.name.span, "defined here"),
            Callee::Lambda(_, _, body) => diagnostic.related(body.span, "the function"),
            Callee::Model(_, model) => diagnostic.related(model.name.span, "defined here"),
            _ => diagnostic,
        }
    }
}

/// `its parameters are a, b`.
pub(super) fn parameters_in_words(names: &[&str]) -> String {
    match names {
        [only] => format!("its only parameter is '{only}'"),
        _ => format!("its parameters are {}", names.join(", ")),
    }
}

/// Index of a record's field, or of a tuple's component by its letter.
pub(super) fn field_index(ty: &Type, name: &str) -> Option<usize> {
    match ty {
        Type::Record(fields) => fields.iter().position(|(n, _)| &**n == name),
        Type::Tuple(types) => ["x", "y", "z", "w"].iter().position(|n| *n == name).filter(|i| *i < types.len()),
        _ => None,
    }
}

pub(super) fn parameter(param: &FnParam) -> Parameter<'_> {
    let name = param.pattern.name().map_or("", |name| &name.text);
    Parameter { name, ty: param.ty.as_ref(), optional: param.default.is_some() }
}

fn model_parameter(item: &ast::Item) -> Option<Parameter<'_>> {
    match &item.kind {
        ItemKind::Param(decl) | ItemKind::Input(decl) => {
            Some(Parameter { name: &decl.name.text, ty: Some(&decl.ty), optional: decl.default.is_some() })
        }
        _ => None,
    }
}
