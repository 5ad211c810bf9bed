//! The checker's state, and the small things that everything in it needs.

use super::CheckOptions;
use super::builtins::Builtin;
use super::constants::Evaluate;
use super::figures::{Measuring, Wanted};
use super::instantiate::Instance;
use super::modules::{Definition, Module};
use super::typed::{Expr, ExprKind, Function, FunctionId, Local, LocalId, Type};
use super::types::ClosureId;
use crate::diagnostic::{Code, Diagnostic, Severity};
use crate::source::Span;
use crate::syntax::ast;
use std::collections::{HashMap, HashSet};
use std::rc::Rc;
use std::sync::atomic::Ordering;

/// The state of the checker.
pub(super) struct Checker<'a> {
    pub(super) modules: &'a [Module<'a>],
    pub(super) options: &'a CheckOptions,
    pub(super) evaluate: Evaluate,
    /// All locals so far, and whether each is used.
    pub(super) locals: Vec<Local>,
    pub(super) used: Vec<bool>,
    /// All closure types so far.
    pub(super) closures: Vec<Closure<'a>>,
    pub(super) closure_ids: HashMap<(Origin, Vec<Type>), ClosureId>,
    /// Function instances; `None` while in progress.
    pub(super) functions: Vec<Option<Function>>,
    pub(super) instances: HashMap<InstanceKey, Instance>,
    /// The names in scope.
    pub(super) env: Env<'a>,
    /// The call stack: the calls that led to the instance being checked, outermost first.
    pub(super) call_stack: Vec<StackFrame>,
    /// Free names of lambdas and functions, by the address of their tree.
    pub(super) free_names: HashMap<usize, Rc<[&'a str]>>,
    /// custom derivatives, by the address of their function's tree.
    pub(super) custom_derivatives: HashMap<usize, &'a ast::DerivativeDecl>,
    /// The names of the `let` whose value is being checked.
    pub(super) defining: Option<&'a ast::Pattern>,
    /// The preceding arguments of the call whose argument is being checked.
    pub(super) preceding_args: &'a [ast::Arg],
    /// The places of numbers without a unit.
    pub(super) bare_literals: HashSet<Span>,
    /// The measure whose value is being checked.
    pub(super) measuring: Option<Measuring>,
    /// The figures of parts that measures use.
    pub(super) wanted: Vec<Wanted>,
    /// The values of the measures that use figures of parts.
    pub(super) measured_values: Vec<Expr>,
    diagnostics: Vec<Diagnostic>,
    reported: HashSet<(Span, Code)>,
    nodes: usize,
    exhausted: bool,
}

/// A function instance: what is called, for which types of arguments (`None` for one left to its default), and whether
/// ints in the result are made reals.
pub(super) type InstanceKey = (ClosureId, Vec<Option<Type>>, bool);

/// A call on the way to the instance being checked.
pub(super) struct StackFrame {
    pub(super) span: Span,
    pub(super) name: Rc<str>,
}

/// The names in scope: those of one function, in one module.
pub(super) struct Env<'a> {
    pub(super) module: usize,
    pub(super) names: Vec<(&'a str, Binding)>,
}

/// The meaning of a name in scope.
#[derive(Clone, Copy)]
pub(super) enum Binding {
    /// A local.
    Local(LocalId),
    /// The closure whose body this is; its captures are the locals from that one on.
    Itself(ClosureId, LocalId),
    /// A measure that uses figures of parts: its index among the values of such.
    Measured(usize),
}

/// A closure type.
pub(super) struct Closure<'a> {
    pub(super) name: Rc<str>,
    pub(super) callee: Callee<'a>,
    pub(super) captures: Vec<(&'a str, Type)>,
    /// Nodes in the types of the captures.
    pub(super) size: usize,
}

/// The code of a closure. `usize` is the module.
#[derive(Clone, Copy)]
pub(super) enum Callee<'a> {
    Function(usize, &'a ast::FunctionDecl),
    Lambda(usize, &'a [ast::FnParam], &'a ast::Expr),
    Model(usize, &'a ast::Model),
    /// A top-level `let`, as a function without parameters.
    Global(usize, &'a ast::Let),
    Builtin(Builtin),
    /// The derivative of another closure (its only capture) in the argument of that index.
    Derivative(ClosureId, usize),
}

/// The identity of a closure type apart from the types of its captures.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Origin {
    /// The address of the tree.
    Tree(usize),
    Builtin(Builtin),
    Derivative(ClosureId, usize),
}

impl Callee<'_> {
    pub(super) fn origin(&self) -> Origin {
        match *self {
            Callee::Function(_, decl) => Origin::Tree(std::ptr::from_ref(decl) as usize),
            Callee::Lambda(_, _, body) => Origin::Tree(std::ptr::from_ref(body) as usize),
            Callee::Model(_, model) => Origin::Tree(std::ptr::from_ref(model) as usize),
            Callee::Global(_, decl) => Origin::Tree(std::ptr::from_ref(decl) as usize),
            Callee::Builtin(builtin) => Origin::Builtin(builtin),
            Callee::Derivative(of, wrt) => Origin::Derivative(of, wrt),
        }
    }
}

impl<'a> Checker<'a> {
    pub(super) fn new(modules: &'a [Module<'a>], options: &'a CheckOptions, evaluate: Evaluate) -> Checker<'a> {
        let mut checker = Checker {
            modules,
            options,
            evaluate,
            locals: Vec::new(),
            used: Vec::new(),
            closures: Vec::new(),
            closure_ids: HashMap::new(),
            functions: Vec::new(),
            instances: HashMap::new(),
            env: Env { module: 0, names: Vec::new() },
            call_stack: Vec::new(),
            free_names: HashMap::new(),
            custom_derivatives: HashMap::new(),
            defining: None,
            preceding_args: &[],
            bare_literals: HashSet::new(),
            measuring: None,
            wanted: Vec::new(),
            measured_values: Vec::new(),
            diagnostics: Vec::new(),
            reported: HashSet::new(),
            nodes: 0,
            exhausted: false,
        };
        modules.iter().for_each(|module| checker.pair_derivatives(module.items));
        checker
    }

    pub(super) fn into_diagnostics(self) -> Vec<Diagnostic> {
        self.diagnostics
    }

    pub(super) fn closure(&self, id: ClosureId) -> &Closure<'a> {
        &self.closures[id.0 as usize]
    }

    /// The closure type of a callee with its captures.
    pub(super) fn intern(&mut self, name: &str, callee: Callee<'a>, captures: Vec<(&'a str, Type)>) -> ClosureId {
        let key = (callee.origin(), captures.iter().map(|(_, t)| t.clone()).collect());
        if let Some(id) = self.closure_ids.get(&key) {
            return *id;
        }
        let id = ClosureId(self.closures.len() as u32);
        let size = captures.iter().map(|(_, t)| self.size(t)).sum();
        self.closures.push(Closure { name: name.into(), callee, captures, size });
        self.closure_ids.insert(key, id);
        id
    }

    /// A new local.
    pub(super) fn local(&mut self, name: &str, ty: Type, span: Span) -> LocalId {
        self.locals.push(Local { name: name.to_owned(), ty, span });
        self.used.push(false);
        LocalId((self.locals.len() - 1) as u32)
    }

    /// A local's value; a constant where it is known.
    pub(super) fn read(&mut self, id: LocalId, span: Span) -> Expr {
        self.used[id.0 as usize] = true;
        known(Expr { kind: ExprKind::Local(id), ty: self.locals[id.0 as usize].ty.clone(), span })
    }

    /// Reports an error, once for each place and kind, with the calls that led there. In the standard library the
    /// place to show is the call that came from outside of it.
    pub(super) fn report(&mut self, mut diagnostic: Diagnostic) {
        if !self.reported.insert((diagnostic.span, diagnostic.code)) {
            return;
        }
        let error = diagnostic.severity == Severity::Error;
        let mut steps: Vec<(Span, Rc<str>)> =
            self.call_stack.iter().filter(|s| !self.is_definition(s)).map(|s| (s.span, s.name.clone())).collect();
        if self.in_library(diagnostic.span)
            && let Some(last) = steps.iter().rposition(|(span, _)| !self.in_library(*span))
        {
            let inner = std::mem::replace(&mut diagnostic.span, steps[last].0);
            if !self.reported.insert((diagnostic.span, diagnostic.code)) {
                return;
            }
            let name = quoted(&steps[last].1);
            let of_arguments = [Code::DimensionMismatch, Code::TypeMismatch, Code::Arguments, Code::WrongResult];
            if name.starts_with('\'') && of_arguments.contains(&diagnostic.code) {
                diagnostic.message = format!("{name} cannot be called with these arguments: {}", diagnostic.message);
                diagnostic.hint = diagnostic.hint.or_else(|| self.parameters_of_library(&steps[last].1));
            }
            let label = std::mem::take(&mut diagnostic.label);
            let label = if label.is_empty() { format!("in {name}") } else { format!("in {name}: {label}") };
            diagnostic.related.push((inner, label));
            steps.truncate(last);
            self.keep_suggestions_outside_of_the_library(&mut diagnostic);
        }
        if error {
            let long = steps.len() > 8;
            for (i, (span, name)) in steps.iter().enumerate().rev() {
                // The nearest calls and the outermost; in between they repeat themselves.
                if !long || i < 2 || i + 5 > steps.len() {
                    let step = (*span, format!("in {}, called here", quoted(name)));
                    if !diagnostic.call_stack.contains(&step) {
                        diagnostic.call_stack.push(step);
                    }
                }
            }
        }
        self.diagnostics.push(diagnostic);
    }

    /// The library's text is not the user's to change.
    fn keep_suggestions_outside_of_the_library(&self, diagnostic: &mut Diagnostic) {
        let (outside, inside): (Vec<_>, Vec<_>) = std::mem::take(&mut diagnostic.suggestions)
            .into_iter()
            .partition(|s| s.edits.iter().all(|e| !self.in_library(e.span)));
        diagnostic.hint.take_if(|hint| inside.iter().any(|s| s.message == *hint));
        diagnostic.suggestions = outside;
    }

    /// Whether names are still looked for that are meant by unknown ones: each look compares a name with all others,
    /// and nobody reads the hundredth.
    pub(super) fn suggests(&self) -> bool {
        const SUGGESTED: usize = 100;
        self.diagnostics.len() < SUGGESTED
    }

    /// Whether an error was reported.
    pub(super) fn has_errors(&self) -> bool {
        self.diagnostics.iter().any(|d| d.severity == Severity::Error)
    }

    /// Reports an error; the expression that stands for it agrees with everything.
    pub(super) fn fail(&mut self, diagnostic: Diagnostic) -> Expr {
        let span = diagnostic.span;
        self.report(diagnostic);
        error(span)
    }

    /// A step that no call made: a library's function is checked without one.
    fn is_definition(&self, step: &StackFrame) -> bool {
        let of = |m: &Module<'_>| m.definitions.get(&*step.name).is_some_and(|d| d.span() == step.span);
        self.modules.iter().any(|m| !m.std && of(m))
    }

    /// A function in a message: its name in quotes, where it has one.
    pub(super) fn called(&self, id: ClosureId) -> String {
        let name = &self.closure(id).name;
        if name.contains('|') { "this function".to_owned() } else { format!("'{name}'") }
    }

    /// The parameters of a library function, in words.
    fn parameters_of_library(&self, name: &str) -> Option<String> {
        let library = self.modules.iter().filter(|m| m.std).find_map(|m| m.definitions.get(name))?;
        let Definition::Function(decl) = library else { return None };
        let names: Vec<&str> = decl.params.iter().map(|p| super::calls::parameter(p).name).collect();
        (names.len() > 1 && !names.contains(&"")).then(|| super::calls::parameters_in_words(&names))
    }

    fn in_library(&self, span: Span) -> bool {
        self.modules.iter().any(|m| m.std && m.items.first().is_some_and(|i| i.span.file == span.file))
    }

    /// Tries something and discards its errors.
    pub(super) fn quietly<T>(&mut self, attempt: impl FnOnce(&mut Self) -> T) -> T {
        let (before, reported, exhausted) = (self.diagnostics.len(), self.reported.clone(), self.exhausted);
        let result = attempt(self);
        self.diagnostics.truncate(before);
        (self.reported, self.exhausted) = (reported, exhausted);
        result
    }

    /// Consumes fuel: one unit for each node of the tree or of a type. Reports once when it is used up; false from then
    /// on.
    pub(super) fn use_fuel(&mut self, nodes: usize, span: Span) -> bool {
        self.nodes = self.nodes.saturating_add(nodes);
        if !self.exhausted && self.options.interrupt.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed)) {
            self.exhausted = true;
            self.report(Diagnostic::new(Code::Interrupted, span, "interrupted while compiling"));
        }
        if self.nodes > self.options.nodes && !self.exhausted {
            self.exhausted = true;
            let message =
                format!("the script grows beyond {} nodes when its functions are instantiated", self.options.nodes);
            self.report(
                Diagnostic::new(Code::TooLarge, span, message)
                    .hint("long loops and deep recursion over known numbers are unrolled: shorten them, or raise the limit: --limit nodes=N"),
            );
        }
        !self.exhausted
    }

    /// Nodes of a type, counting what closures captured.
    pub(super) fn size(&self, ty: &Type) -> usize {
        match ty {
            Type::Tuple(ts) => 1 + ts.iter().map(|t| self.size(t)).sum::<usize>(),
            Type::Array(t, n) => self.size(t).saturating_mul(*n).saturating_add(1),
            Type::Record(fields) => 1 + fields.iter().map(|(_, t)| self.size(t)).sum::<usize>(),
            Type::Closure(id) => 1 + self.closure(*id).size,
            _ => 1,
        }
    }

    /// The function of an instance that is done.
    pub(super) fn function(&self, id: FunctionId) -> Option<&Function> {
        self.functions.get(id.0 as usize)?.as_ref()
    }
}

fn quoted(name: &str) -> String {
    if name.contains('|') { "a function".to_owned() } else { format!("'{name}'") }
}

/// The expression that stands for an error.
pub(super) fn error(span: Span) -> Expr {
    Expr { kind: ExprKind::Aggregate(Vec::new()), ty: Type::Error, span }
}

/// An expression whose type says its value becomes that constant.
pub(super) fn known(mut expr: Expr) -> Expr {
    match expr.ty {
        Type::Int(Some(k)) => expr.kind = ExprKind::Int(k),
        Type::Bool(Some(b)) => expr.kind = ExprKind::Bool(b),
        Type::Text(Some(ref text)) => expr.kind = ExprKind::Text(text.to_string()),
        _ => {}
    }
    expr
}

/// A constant int.
pub(super) fn int(value: i64, span: Span) -> Expr {
    Expr { kind: ExprKind::Int(value), ty: Type::Int(Some(value)), span }
}

/// A constant bool.
pub(super) fn boolean(value: bool, span: Span) -> Expr {
    Expr { kind: ExprKind::Bool(value), ty: Type::Bool(Some(value)), span }
}
