//! `deriv f(x; dx) { ... }`: derivatives that the author gives.
//!
//! Such a derivative is a function of the arguments and of their tangents; what it gives is the tangent of the value of
//! `f`, so it has the dimension of that value (and a tangent that of its argument). It is checked for every instance of
//! `f`, after it.

use super::bindings::wrap;
use super::context::{Callee, Checker, Env, StackFrame};
use super::free;
use super::typed::{CustomDerivative, Expr, Function, FunctionId, Statement, Type};
use super::types::ClosureId;
use crate::diagnostic::{Code, Diagnostic};
use crate::source::Span;
use crate::suggest::nearest;
use crate::syntax::ast::{DerivativeDecl, FnParam, FunctionDecl, Item, ItemKind};

/// The derivatives among some items, each with its function; what is wrong with the others.
pub(super) fn pair(items: &[Item]) -> (Vec<(&FunctionDecl, &DerivativeDecl)>, Vec<Diagnostic>) {
    let mut pairs: Vec<(&FunctionDecl, &DerivativeDecl)> = Vec::new();
    let mut diagnostics = Vec::new();
    let functions = || {
        items.iter().filter_map(|item| match &item.kind {
            ItemKind::Function(decl) => Some(decl),
            _ => None,
        })
    };
    for item in items {
        let ItemKind::Derivative(decl) = &item.kind else { continue };
        let name = &decl.function;
        let Some(function) = functions().find(|f| f.name.text == name.text) else {
            let message = format!("there is no function '{}' here for this derivative", name.text);
            let error = Diagnostic::new(Code::UnknownName, name.span, message);
            diagnostics.push(match nearest(&name.text, functions().map(|f| f.name.text.as_str())) {
                Some(near) => error.hint(format!("did you mean '{near}'?")),
                None => error.hint("a derivative must be in the same block or file as its function"),
            });
            continue;
        };
        if let Some((_, before)) = pairs.iter().find(|(f, _)| std::ptr::eq(*f, function)) {
            let message = format!("'{}' has two derivatives", name.text);
            diagnostics.push(
                Diagnostic::new(Code::DuplicateName, name.span, message)
                    .related(before.function.span, "first given here"),
            );
            continue;
        }
        if decl.params.len() != function.params.len() {
            let message = format!(
                "this names {} of the arguments of '{}', which has {}",
                decl.params.len(),
                name.text,
                function.params.len()
            );
            diagnostics
                .push(Diagnostic::new(Code::Arguments, name.span, message).related(function.name.span, "the function"));
            continue;
        }
        pairs.push((function, decl));
    }
    (pairs, diagnostics)
}

impl<'a> Checker<'a> {
    /// Remembers the derivatives among some items by their functions.
    pub(super) fn pair_derivatives(&mut self, items: &'a [Item]) {
        if !items.iter().any(|item| matches!(item.kind, ItemKind::Derivative(_))) {
            return;
        }
        let (pairs, diagnostics) = pair(items);
        diagnostics.into_iter().for_each(|d| self.report(d));
        for (function, decl) in pairs {
            self.custom_derivatives.insert(std::ptr::from_ref(function) as usize, decl);
        }
    }

    /// The derivative that was given for a function.
    pub(super) fn given_derivative(&self, function: &FunctionDecl) -> Option<&'a DerivativeDecl> {
        self.custom_derivatives.get(&(std::ptr::from_ref(function) as usize)).copied()
    }

    /// Makes the derivative of an instance that is done, where the author gave one.
    pub(super) fn attach_derivative(
        &mut self,
        id: ClosureId,
        args: &[Option<Type>],
        (of, result): (FunctionId, &Type),
        span: Span,
    ) {
        let Callee::Function(module, function) = self.closure(id).callee else { return };
        let Some(decl) = self.given_derivative(function) else { return };
        let Some(result) = result.all_real() else {
            let kind = self.describe(result);
            let message = format!("only numbers have derivatives, but '{}' returns {kind}", decl.function.text);
            return self.report(Diagnostic::new(Code::NoDerivative, decl.function.span, message));
        };
        let Some(paired) = self.paired(decl, &function.params, args) else { return };
        if !self.is_complete(id, decl, &function.params) {
            return;
        }
        let id_of_derivative = FunctionId(self.functions.len() as u32);
        self.functions.push(None);
        self.call_stack.push(StackFrame { span, name: self.closure(id).name.clone() });
        let outer = std::mem::replace(&mut self.env, Env { module, names: Vec::new() });
        let derivative = self.derivative_instance(id, function, decl, args, &paired, &result);
        self.env = outer;
        self.call_stack.pop();
        if derivative.body.ty.is_error() {
            return;
        }
        self.functions[id_of_derivative.0 as usize] = Some(derivative);
        // Positions among the parameters that the instance has.
        let position = |param: usize| args[..param].iter().flatten().count();
        let params = paired.into_iter().filter(|p| args[*p].is_some()).map(position).collect();
        if let Some(Some(function)) = self.functions.get_mut(of.0 as usize) {
            function.custom_derivative = Some(CustomDerivative { function: id_of_derivative, params });
        }
    }

    /// The parameter of each tangent.
    fn paired(&mut self, decl: &'a DerivativeDecl, params: &'a [FnParam], args: &[Option<Type>]) -> Option<Vec<usize>> {
        let count = decl.tangents.len();
        let numeric = |i: &usize| args[*i].as_ref().is_none_or(|ty| ty.all_real().is_some());
        let numbers: Vec<usize> = (0..params.len()).filter(numeric).collect();
        // If there are more numbers than tangents, the whole numbers have none.
        let is_int = |i: &usize| {
            let written = params[*i]
                .ty
                .as_ref()
                .is_some_and(|ty| matches!(&ty.kind, crate::syntax::ast::TypeKind::Name(name) if name == "int"));
            written || matches!(args[*i], Some(Type::Int(_)))
        };
        let real: Vec<usize> = numbers.iter().copied().filter(|i| !is_int(i)).collect();
        if numbers.len() == count {
            return Some(numbers);
        }
        if real.len() == count {
            return Some(real);
        }
        let several = |n: usize, what: &str| if n == 1 { format!("one {what}") } else { format!("{n} {what}s") };
        let message = format!(
            "'{}' has {} that can vary, and this names {}",
            decl.function.text,
            several(numbers.len(), "argument"),
            several(count, "tangent"),
        );
        let names = decl.params.iter().map(|p| p.text.as_str()).collect::<Vec<_>>().join(", ");
        let tangents = numbers.iter().map(|i| format!("d{}", decl.params[*i].text)).collect::<Vec<_>>().join(", ");
        let hint = format!("write: deriv {}({names}; {tangents})", decl.function.text);
        self.report(Diagnostic::new(Code::Arguments, decl.function.span, message).hint(hint));
        None
    }

    /// Whether the tangents can say all: what the function takes from around it, or computes as a default, would
    /// be forgotten if it varied.
    fn is_complete(&mut self, id: ClosureId, decl: &'a DerivativeDecl, params: &'a [FnParam]) -> bool {
        let captures = self.closure(id).captures.clone();
        if let Some((name, _)) = captures.iter().find(|(_, ty)| self.varies(ty)) {
            let message = format!(
                "'{}' uses '{name}' from outside, which its custom derivative does not take into account",
                decl.function.text
            );
            let error = Diagnostic::new(Code::IncompleteDerivative, decl.function.span, message);
            self.report(error.hint(format!("make '{name}' an argument of the function")));
            return false;
        }
        for param in params {
            let Some(default) = &param.default else { continue };
            let names = free::of_lambda(&[], default);
            let used =
                params.iter().filter_map(|p| Some(p.pattern.name()?.text.as_str())).find(|name| names.contains(name));
            if let Some(used) = used {
                let message = format!(
                    "this default depends on '{used}', which the custom derivative of '{}' does not take into account",
                    decl.function.text
                );
                self.report(Diagnostic::new(Code::IncompleteDerivative, default.span, message));
                return false;
            }
        }
        true
    }

    /// Whether there is a real in it.
    fn varies(&self, ty: &Type) -> bool {
        match ty {
            Type::Real(_) => true,
            Type::Tuple(types) => types.iter().any(|t| self.varies(t)),
            Type::Array(ty, n) => *n > 0 && self.varies(ty),
            Type::Record(fields) => fields.iter().any(|(_, t)| self.varies(t)),
            Type::Closure(id) => self.closure(*id).captures.iter().any(|(_, t)| self.varies(t)),
            _ => false,
        }
    }

    /// The derivative as a function of the captures, the arguments, and the tangents.
    fn derivative_instance(
        &mut self,
        id: ClosureId,
        function: &'a FunctionDecl,
        decl: &'a DerivativeDecl,
        args: &[Option<Type>],
        paired: &[usize],
        result: &Type,
    ) -> Function {
        let span = decl.function.span;
        let captures = self.bind_captures(id, span);
        let mut params = Vec::new();
        let mut statements: Vec<Statement> = Vec::new();
        for ((name, param), arg) in decl.params.iter().zip(&function.params).zip(args) {
            match (arg, &param.default) {
                (Some(ty), _) => params.push(self.bind_local(name, ty.clone())),
                (None, Some(default)) => {
                    let value = self.expr(default);
                    self.bind_name(name, value, &mut statements);
                }
                // The call was refused before.
                (None, None) => {}
            }
        }
        for (name, param) in decl.tangents.iter().zip(paired) {
            match args[*param].as_ref().and_then(Type::all_real) {
                Some(ty) => params.push(self.bind_local(name, ty)),
                // An argument left to its default does not vary.
                None => {
                    let zero = super::context::int(0, name.span);
                    self.bind_name(name, zero, &mut statements);
                }
            }
        }
        let value = self.expr(&decl.body);
        let value = self.tangent_of_result(decl, value, result);
        let at = value.span;
        let body = wrap(statements, value, at);
        let name = format!("d{}", decl.function.text);
        Function { name, captures, params, body, custom_derivative: None, span }
    }

    fn tangent_of_result(&mut self, decl: &DerivativeDecl, value: Expr, result: &Type) -> Expr {
        if value.ty.is_error() {
            return value;
        }
        if self.join(result, &value.ty).as_ref() == Some(result) {
            return self.convert(value, result);
        }
        let message = format!(
            "the derivative of '{}' must be {}, as its value is, but this is {}",
            decl.function.text,
            self.describe(result),
            self.describe(&value.ty)
        );
        let error = Diagnostic::new(Code::DimensionMismatch, value.span, message);
        let advice = match result {
            Type::Real(d) => self.unit_advice(&value, *d),
            _ => None,
        };
        self.fail(error.suggestion(advice))
    }
}
