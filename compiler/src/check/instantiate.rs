//! Function instances: a body checked for certain types of captures and arguments.

use super::bindings::wrap;
use super::calls::Parameter;
use super::context::{Binding, Callee, Checker, Env, StackFrame};
use super::expressions::local_expr;
use super::typed::{Expr, ExprKind, Function, FunctionId, LocalId, Type};
use super::types::ClosureId;
use crate::diagnostic::{Code, Diagnostic};
use crate::source::Span;
use crate::syntax::ast::{self, FnParam};

/// How far an instance is.
pub(super) enum Instance {
    /// Its body is being checked; the type of its result, where that is written.
    Running(FunctionId, Option<Type>),
    Done(FunctionId, Type),
    /// Something in it is wrong and was reported.
    Failed,
}

impl<'a> Checker<'a> {
    /// The instance of a function for types of arguments (`None` where one is left to its default), and the type of its
    /// result. `None` after an error.
    pub(super) fn instantiate(
        &mut self,
        id: ClosureId,
        args: Vec<Option<Type>>,
        span: Span,
    ) -> Option<(FunctionId, Type)> {
        let key = (id, args, false);
        match self.instances.get(&key) {
            Some(Instance::Done(function, ty)) => return Some((*function, ty.clone())),
            Some(Instance::Failed) => return None,
            Some(Instance::Running(function, Some(ty))) => return Some((*function, ty.clone())),
            Some(Instance::Running(_, None)) => {
                self.unknown_result(id, span);
                return None;
            }
            None => {}
        }
        let size = key.1.iter().flatten().map(|t| self.size(t)).sum::<usize>() + self.closure(id).size;
        if !self.use_fuel(1 + size, span) || !self.within_limits(id, span) {
            return None;
        }
        let function = FunctionId(self.functions.len() as u32);
        self.functions.push(None);
        let written = self.written_result(id);
        self.instances.insert(key.clone(), Instance::Running(function, written));
        let made = self.make_instance(id, &key.1, span);
        let done = match made {
            Some(made) if !made.body.ty.is_error() => {
                let ty = made.body.ty.clone();
                self.functions[function.0 as usize] = Some(made);
                Instance::Done(function, ty)
            }
            _ => Instance::Failed,
        };
        let args = key.1.clone();
        let result = match &done {
            Instance::Done(function, ty) => Some((*function, ty.clone())),
            _ => None,
        };
        self.instances.insert(key, done);
        if let Some((function, ty)) = &result {
            self.attach_derivative(id, &args, (*function, ty), span);
        }
        result
    }

    /// The same instance with every int of its result made a real, for derivatives. An error where the result holds
    /// anything else but numbers.
    pub(super) fn instantiate_real(
        &mut self,
        id: ClosureId,
        args: &[Option<Type>],
        span: Span,
    ) -> Option<(FunctionId, Type)> {
        let (inner, ty) = self.instantiate(id, args.to_vec(), span)?;
        let Some(real) = ty.all_real() else {
            let message = format!("only numbers have derivatives, but this function returns {}", self.describe(&ty));
            self.report(Diagnostic::new(Code::NoDerivative, span, message));
            return None;
        };
        if real == ty {
            return Some((inner, ty));
        }
        let key = (id, args.to_vec(), true);
        if let Some(Instance::Done(function, ty)) = self.instances.get(&key) {
            return Some((*function, ty.clone()));
        }
        let captures = self.capture_locals(id, span);
        let params: Vec<LocalId> = args.iter().flatten().map(|t| self.local("", t.clone(), span)).collect();
        let mut read = |ids: &[LocalId]| ids.iter().map(|l| self.read(*l, span)).collect::<Vec<Expr>>();
        let (capture_values, values) = (read(&captures), read(&params));
        let f = Expr { kind: ExprKind::Aggregate(capture_values), ty: Type::Closure(id), span };
        let call = self.make_call(inner, f, values, ty, span);
        let body = self.convert(call, &real);
        let function = FunctionId(self.functions.len() as u32);
        let name = self.closure(id).name.to_string();
        self.functions.push(Some(Function { name, captures, params, body, custom_derivative: None, span }));
        self.instances.insert(key, Instance::Done(function, real.clone()));
        Some((function, real))
    }

    fn within_limits(&mut self, id: ClosureId, span: Span) -> bool {
        let name = self.closure(id).name.clone();
        if self.call_stack.len() >= self.options.depth {
            let message =
                format!("calls are nested more than {} deep; the innermost call is of '{name}'", self.options.depth);
            self.report(Diagnostic::new(Code::TooDeep, span, message).hint(
                "recursion must end on a known whole number or array length, or the function's parameters and result must be annotated with their types; if it does end, raise the limit: --limit nesting=N",
            ));
            return false;
        }
        if self.functions.len() >= self.options.instances {
            let message = format!("functions are instantiated more than {} times", self.options.instances);
            let error = Diagnostic::new(Code::TooLarge, span, message);
            self.report(error.hint("the limit can be raised: --limit instances=N"));
            return false;
        }
        true
    }

    fn unknown_result(&mut self, id: ClosureId, span: Span) {
        let name = self.closure(id).name.clone();
        let diagnostic = match self.closure(id).callee {
            Callee::Global(_, decl) => {
                let message = "this constant is defined in terms of itself".to_owned();
                Diagnostic::new(Code::Recursion, span, message).related(decl.pattern.span(), "defined here")
            }
            Callee::Model(_, model) => {
                Diagnostic::new(Code::Recursion, span, format!("the model '{name}' contains itself"))
                    .related(model.name.span, "defined here")
            }
            _ => {
                let message = format!("'{name}' calls itself, so the type of its result must be written");
                Diagnostic::new(Code::Recursion, span, message)
                    .hint(format!("annotate it, such as: fn {name}(...) -> real"))
            }
        };
        self.report(diagnostic);
    }

    /// The type of the result, where the function says it in full.
    fn written_result(&mut self, id: ClosureId) -> Option<Type> {
        match self.closure(id).callee {
            Callee::Function(module, decl) => {
                let ty = decl.result.as_ref()?;
                let before = std::mem::replace(&mut self.env.module, module);
                let expected = self.expected(ty);
                self.env.module = before;
                expected.exact()
            }
            _ => None,
        }
    }

    fn make_instance(&mut self, id: ClosureId, args: &[Option<Type>], span: Span) -> Option<Function> {
        let (name, callee) = (self.closure(id).name.clone(), self.closure(id).callee);
        self.call_stack.push(StackFrame { span, name: name.clone() });
        let module = match callee {
            Callee::Function(m, _) | Callee::Lambda(m, ..) | Callee::Model(m, _) | Callee::Global(m, _) => m,
            Callee::Builtin(_) | Callee::Derivative(..) => self.env.module,
        };
        let outer = std::mem::replace(&mut self.env, Env { module, names: Vec::new() });
        let body = self.body(id, callee, args, span);
        self.env = outer;
        self.call_stack.pop();
        Some(Function { name: name.to_string(), span: definition(callee, span), ..body? })
    }

    /// Brings a closure's captures into scope, and the name of a function itself.
    pub(super) fn bind_captures(&mut self, id: ClosureId, span: Span) -> Vec<LocalId> {
        if let Callee::Function(_, decl) = self.closure(id).callee {
            let first = LocalId(self.locals.len() as u32);
            self.env.names.push((&decl.name.text, Binding::Itself(id, first)));
        }
        let captures = self.capture_locals(id, span);
        for ((name, _), local) in self.closure(id).captures.clone().into_iter().zip(&captures) {
            self.env.names.push((name, Binding::Local(*local)));
        }
        captures
    }

    fn capture_locals(&mut self, id: ClosureId, span: Span) -> Vec<LocalId> {
        let captures = self.closure(id).captures.clone();
        captures.into_iter().map(|(name, ty)| self.local(name, ty, span)).collect()
    }

    /// An instance without its name; the names in scope are already its own.
    fn body(&mut self, id: ClosureId, callee: Callee<'a>, args: &[Option<Type>], span: Span) -> Option<Function> {
        let captures = self.bind_captures(id, definition(callee, span));
        let (params, body) = match callee {
            Callee::Function(_, decl) => {
                let (params, body) = self.function_body(&decl.params, &decl.body, args);
                let what = format!("the result of '{}'", decl.name.text);
                (params, self.coerce_written(body, decl.result.as_ref(), &what))
            }
            Callee::Lambda(_, params, body) => self.function_body(params, body, args),
            Callee::Model(_, model) => self.submodel(model, args),
            Callee::Global(_, decl) => {
                let value = self.expr(&decl.value);
                (Vec::new(), self.coerce_written(value, decl.ty.as_ref(), "the value"))
            }
            Callee::Builtin(builtin) => {
                let params: Vec<LocalId> = args.iter().flatten().map(|t| self.local("", t.clone(), span)).collect();
                let values = params.iter().map(|l| self.read(*l, span)).collect();
                let body = self.builtin(builtin, values, span);
                (params, body)
            }
            Callee::Derivative(of, wrt) => self.derivative_body(of, wrt, captures[0], args, span)?,
        };
        Some(Function { name: String::new(), captures, params, body, custom_derivative: None, span })
    }

    fn function_body(
        &mut self,
        params: &'a [FnParam],
        body: &'a ast::Expr,
        args: &[Option<Type>],
    ) -> (Vec<LocalId>, Expr) {
        let mut locals = Vec::new();
        let mut statements = Vec::new();
        for (i, param) in params.iter().enumerate() {
            match (args.get(i).cloned().flatten(), &param.default) {
                (Some(ty), _) => {
                    let span = param.pattern.span();
                    match &param.pattern {
                        ast::Pattern::Name(name) => locals.push(self.bind_local(name, ty)),
                        ast::Pattern::Tuple(..) => {
                            let local = self.local("", ty.clone(), span);
                            locals.push(local);
                            self.bind(&param.pattern, local_expr(local, ty, span), &mut statements);
                        }
                    }
                }
                (None, Some(default)) => {
                    let value = self.expr(default);
                    let value = self.coerce_written(value, param.ty.as_ref(), "the default");
                    self.bind(&param.pattern, value, &mut statements);
                }
                // The call was refused before.
                (None, None) => {}
            }
        }
        let value = self.expr(body);
        let span = value.span;
        (locals, wrap(statements, value, span))
    }

    /// Checks what of a file no call has reached: its constants, and functions as far as their parameters are
    /// annotated.
    pub(super) fn check_annotated(&mut self, module: usize) {
        for item in self.modules[module].items {
            if let ast::ItemKind::Let(decl) = &item.kind {
                let id = self.intern(
                    decl.pattern.names().first().map_or("_", |name| &name.text),
                    Callee::Global(module, decl),
                    Vec::new(),
                );
                self.instantiate(id, Vec::new(), decl.pattern.span());
            }
            let ast::ItemKind::Function(decl) = &item.kind else { continue };
            let id = self.intern(&decl.name.text, Callee::Function(module, decl), Vec::new());
            let params: Vec<Parameter<'a>> = self.parameters(id);
            // Whole numbers may have to be known to it, which here they are not.
            let types: Option<Vec<Option<Type>>> = params
                .iter()
                .map(|p| p.ty.map(|ty| self.expected(ty)).and_then(|expected| expected.exact()))
                .map(|ty| ty.filter(|ty| !matches!(ty, Type::Int(_) | Type::Bool(_))).map(Some))
                .collect();
            if let Some(types) = types {
                self.instantiate(id, types, decl.name.span);
            }
        }
    }
}

impl<'a> Checker<'a> {
    /// Checks a model that is not the main one with the defaults of its parameters, unless another uses it.
    pub(super) fn check_model(&mut self, decl: &'a ast::Model) {
        let id = self.intern(&decl.name.text, Callee::Model(0, decl), Vec::new());
        if self.instances.keys().any(|(closure, ..)| *closure == id) {
            return;
        }
        let params: Vec<Parameter<'a>> = self.parameters(id);
        let types = params
            .iter()
            .map(|p| match (p.optional, p.ty) {
                (false, Some(ty)) => self.expected(ty).exact(),
                _ => None,
            })
            .collect();
        self.instantiate(id, types, decl.name.span);
    }
}

/// The place of the callee's definition.
fn definition(callee: Callee<'_>, span: Span) -> Span {
    match callee {
        Callee::Function(_, decl) => decl.name.span,
        Callee::Lambda(_, _, body) => body.span,
        Callee::Model(_, model) => model.name.span,
        Callee::Global(_, decl) => decl.pattern.span(),
        Callee::Builtin(_) | Callee::Derivative(..) => span,
    }
}
