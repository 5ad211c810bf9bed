//! Name resolution: locals, then the file's own definitions, its imports, built-in names, the standard library.

use super::builtins::{self, Builtin};
use super::context::{Binding, Callee, Checker};
use super::foreign::{self, Foreign};
use super::modules::{Definition, is_private, private_name};
use super::stdlib;
use super::typed::{Call, Expr, ExprKind, Type};
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::source::Span;
use crate::suggest::{nearest, nearest_of};
use crate::syntax::ast::{self, ItemKind, Let, Pattern};

impl<'a> Checker<'a> {
    /// The value of a name.
    pub(super) fn name(&mut self, name: &'a str, span: Span) -> Expr {
        match self.find(name, span) {
            Some(expr) => expr,
            None => {
                let error = self.unknown_name(name, span);
                self.fail(error)
            }
        }
    }

    /// The value of a name, if it is known.
    pub(super) fn find(&mut self, name: &'a str, span: Span) -> Option<Expr> {
        if name == "_" {
            return None;
        }
        if let Some((_, binding)) = self.env.names.iter().rev().find(|(n, _)| *n == name) {
            return Some(self.bound(*binding, span));
        }
        let module = self.env.module;
        let shadowed = self.modules[module].earlier && self.modules[module].import(name).is_some();
        if let Some(definition) = self.modules[module].definitions.get(name).filter(|_| !shadowed) {
            return Some(self.definition(name, *definition, module, span));
        }
        if let Some(target) = self.modules[module].import(name) {
            // Names that the module does not have were reported with the `use`.
            return Some(match self.modules[target].definitions.get(name) {
                Some(definition) => self.definition(name, *definition, target, span),
                None => super::context::error(span),
            });
        }
        if self.modules[module].broken.contains(name) {
            return Some(super::context::error(span));
        }
        if let Some(value) = builtins::constant_named(name, span) {
            return Some(value);
        }
        if let Some(builtin) = Builtin::named(name) {
            let id = self.intern(name, Callee::Builtin(builtin), Vec::new());
            return Some(Expr { kind: ExprKind::Aggregate(Vec::new()), ty: Type::Closure(id), span });
        }
        let library = stdlib::MODULES[stdlib::module_of(name)?].0;
        let target = self.modules.iter().position(|m| m.std && m.name == library)?;
        let definition = *self.modules[target].definitions.get(name)?;
        Some(self.definition(name, definition, target, span))
    }

    /// The value of `module.name`, where `module` is a module used whole and no local hides it.
    pub(super) fn module_member(&mut self, module: &'a str, name: &'a str, span: Span) -> Option<Expr> {
        if self.env.names.iter().any(|(n, _)| *n == module) {
            return None;
        }
        if self.modules[self.env.module].broken.contains(module) {
            return Some(super::context::error(span));
        }
        let target = self.modules[self.env.module].whole(module)?;
        Some(match self.modules[target].definitions.get(name) {
            Some(definition) if is_private(name) => self.fail(private_name(name, *definition, span)),
            Some(definition) => self.definition(name, *definition, target, span),
            None if !self.suggests() => {
                self.fail(Diagnostic::new(Code::UnknownName, span, format!("the module '{module}' has no '{name}'")))
            }
            None => {
                let names = self.modules[target].public_names();
                let error = Diagnostic::new(Code::UnknownName, span, format!("the module '{module}' has no '{name}'"));
                let built_in = Builtin::named(name).is_some() || builtins::constant_named(name, span).is_some();
                let error = match (stdlib::module_of(name), nearest(name, names)) {
                    _ if built_in => error.hint(format!("it is built in, and written without a module: '{name}'")),
                    (Some(other), _) => {
                        let home = stdlib::MODULES[other].0;
                        error.hint(format!("'{name}' is in {home}: add `use {home} ({name})`"))
                    }
                    (None, Some(near)) => error.did_you_mean(span, near),
                    (None, None) => error,
                };
                self.fail(error)
            }
        })
    }

    /// The value of a name that a file defines.
    pub(super) fn of_file(&mut self, module: usize, name: &'a str, span: Span) -> Expr {
        match self.modules[module].definitions.get(name) {
            Some(definition) => self.definition(name, *definition, module, span),
            None => super::context::error(span),
        }
    }

    fn bound(&mut self, binding: Binding, span: Span) -> Expr {
        match binding {
            Binding::Local(id) => self.read(id, span),
            Binding::Measured(index) => self.measured_value(index, span),
            Binding::Itself(closure, first) => {
                let count = self.closure(closure).captures.len() as u32;
                let captures = (first.0..first.0 + count).map(|i| self.read(super::typed::LocalId(i), span)).collect();
                Expr { kind: ExprKind::Aggregate(captures), ty: Type::Closure(closure), span }
            }
        }
    }

    fn definition(&mut self, name: &'a str, definition: Definition<'a>, module: usize, span: Span) -> Expr {
        let callee = match definition {
            Definition::Function(decl) => Callee::Function(module, decl),
            Definition::Model(model) => Callee::Model(module, model),
            Definition::Let(decl) => return self.global(name, decl, module, span),
        };
        let id = self.intern(name, callee, Vec::new());
        Expr { kind: ExprKind::Aggregate(Vec::new()), ty: Type::Closure(id), span }
    }

    /// A top-level `let`: a call of a function without parameters, and the way to the name in its pattern.
    fn global(&mut self, name: &'a str, decl: &'a Let, module: usize, span: Span) -> Expr {
        let id = self.intern(name, Callee::Global(module, decl), Vec::new());
        let Some((function, ty)) = self.instantiate(id, Vec::new(), span) else {
            return super::context::error(span);
        };
        let kind = ExprKind::Call(Call { function, closure: None, args: Vec::new() });
        let mut value = super::context::known(Expr { kind, ty, span });
        let Some(path) = path_to(&decl.pattern, name) else { return super::context::error(span) };
        for (index, count) in path {
            value = match self.destructured(value, index, count, decl.pattern.span()) {
                Some(component) => component,
                None => return super::context::error(span),
            };
        }
        value
    }

    /// Whether the language, its library or the file has a function of the name.
    pub(super) fn is_function(&self, name: &str) -> bool {
        let own = self.modules[self.env.module].definitions.get(name);
        Builtin::named(name).is_some()
            || stdlib::module_of(name).is_some()
            || matches!(own, Some(Definition::Function(_)))
    }

    fn unknown_name(&self, name: &str, span: Span) -> Diagnostic {
        let error = Diagnostic::new(Code::UnknownName, span, format!("there is no '{name}' here"));
        if !self.suggests() {
            return error;
        }
        let module = &self.modules[self.env.module];
        if module.whole(name).is_some() {
            return error.hint(format!("it is a module: its functions are written '{name}.NAME'"));
        }
        let locals: Vec<&str> = self.env.names.iter().map(|(n, _)| *n).collect();
        let own: Vec<&str> = module.definitions.keys().copied().chain(module.imported()).collect();
        let built_in: Vec<&str> = builtins::names().collect();
        let library: Vec<&str> = stdlib::MODULES.iter().flat_map(|(_, text)| stdlib::names(text)).collect();
        if self.defining.is_some_and(|pattern| pattern.names().iter().any(|n| n.text == name)) {
            let message = format!("'{name}' is not known yet within its own definition");
            let hint = "a line that begins with '-' continues the one before; a negative value is written '(-a)'";
            return Diagnostic::new(Code::UnknownName, span, message).hint(hint);
        }
        if let Some(near) = nearest_of(name, &[&locals, &own]) {
            return error.did_you_mean(span, near);
        }
        if let Some(foreign) = foreign::meaning(name) {
            return match foreign {
                Foreign::Name(ours) => {
                    error.suggest(format!("it is called '{ours}' here"), [Edit::replace(span, ours)])
                }
                Foreign::Hint(hint) => error.hint(hint),
            };
        }
        if self.is_parameter_of_preceding_lambda(name) {
            return error.hint(format!(
                "'{name}' is known only in the function before the comma; write a point in parentheses: |{name}| (x, y)"
            ));
        }
        match self.defined_in_model(name, span) {
            Some((_, true)) => {
                return error.hint("it is defined below: move its definition before this line");
            }
            Some((model, false)) => {
                return error
                    .hint(format!("it belongs to the model '{model}'; pass it to this function as an argument"));
            }
            None => {}
        }
        match nearest_of(name, &[&built_in, &library]) {
            Some(near) => error.did_you_mean(span, near),
            None => error,
        }
    }

    /// Whether an argument before the one that is checked is a function with a parameter of the name.
    fn is_parameter_of_preceding_lambda(&self, name: &str) -> bool {
        self.preceding_args.iter().any(|arg| match &arg.value.kind {
            ast::ExprKind::Lambda(params, _) => params.iter().any(|p| p.pattern.names().iter().any(|n| n.text == name)),
            _ => false,
        })
    }

    /// The model of the file that defines the name, which is not in scope, and whether it was used within.
    fn defined_in_model(&self, name: &str, span: Span) -> Option<(&'a str, bool)> {
        let models = self.modules[self.env.module].items.iter().filter_map(|item| match &item.kind {
            ItemKind::Model(model) if model.items.iter().any(|item| item.defines(name)) => {
                let inside = item.span.start <= span.start && span.end <= item.span.end;
                Some((model.name.text.as_str(), inside))
            }
            _ => None,
        });
        models.max_by_key(|(_, inside)| *inside)
    }
}

/// The way to a name in a pattern: index and number of components at every step.
fn path_to(pattern: &Pattern, name: &str) -> Option<Vec<(usize, usize)>> {
    match pattern {
        Pattern::Name(ident) => (ident.text == name).then(Vec::new),
        Pattern::Tuple(patterns, _) => patterns.iter().enumerate().find_map(|(i, p)| {
            let mut path = path_to(p, name)?;
            path.insert(0, (i, patterns.len()));
            Some(path)
        }),
    }
}
