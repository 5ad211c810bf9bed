//! Activity analysis: which values depend on a parameter, so that none loses its derivative silently. A rounded value
//! must not depend on one, unless it is wrapped in `stop`.

use super::context::{Checker, StackFrame};
use super::typed::{Binary, Call, CustomDerivative, Expr, ExprKind, FunctionId, LocalId, Model, Statement, Unary};
use crate::diagnostic::{Code, Diagnostic};
use std::collections::HashMap;
use std::rc::Rc;

/// The parameters that a value depends on.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Activity {
    /// All of it on a parameter (the first of several), or none of it on any.
    All(Option<u32>),
    /// Component by component.
    Each(Rc<[Activity]>),
}

const NONE: Activity = Activity::All(None);

impl Activity {
    fn component(&self, k: usize) -> Activity {
        match self {
            Activity::Each(parts) => parts.get(k).cloned().unwrap_or(NONE),
            all => all.clone(),
        }
    }

    fn each(parts: Vec<Activity>) -> Activity {
        match parts.first() {
            None => NONE,
            Some(first @ Activity::All(_)) if parts.iter().all(|p| p == first) => first.clone(),
            _ => Activity::Each(parts.into()),
        }
    }

    fn join(&self, other: &Activity) -> Activity {
        match (self, other) {
            (Activity::All(None), x) | (x, Activity::All(None)) => x.clone(),
            (Activity::All(Some(a)), Activity::All(Some(b))) => Activity::All(Some(*a.min(b))),
            (Activity::Each(parts), Activity::Each(others)) if parts.len() == others.len() => {
                Activity::each(parts.iter().zip(&**others).map(|(a, b)| a.join(b)).collect())
            }
            (a, b) => Activity::All(a.any().into_iter().chain(b.any()).min()),
        }
    }

    /// Whether any of it depends on a parameter, and on which.
    fn any(&self) -> Option<u32> {
        match self {
            Activity::All(parameter) => *parameter,
            Activity::Each(parts) => parts.iter().filter_map(Activity::any).min(),
        }
    }

    /// Every component joined with one number.
    fn with(&self, factor: Option<u32>) -> Activity {
        match (self, factor) {
            (_, None) => self.clone(),
            (Activity::All(_), Some(_)) => self.join(&Activity::All(factor)),
            (Activity::Each(parts), Some(_)) => Activity::each(parts.iter().map(|p| p.with(factor)).collect()),
        }
    }
}

/// Reports every rounding of a value that depends on a parameter.
pub(super) fn check(checker: &mut Checker<'_>, model: &Model) {
    let mut analysis = Analysis { checker, model, locals: HashMap::new(), known: HashMap::new(), running: Vec::new() };
    for (i, param) in model.params.iter().enumerate() {
        analysis.locals.insert(param.local, Activity::All(Some(i as u32)));
    }
    for statement in &model.body {
        analysis.statement(statement);
    }
    for param in &model.params {
        for bound in param.lower.iter().chain(&param.upper) {
            analysis.expr(bound);
        }
    }
    for part in &model.parts {
        let shape = analysis.expr(&part.shape);
        analysis.locals.insert(part.local, shape);
        analysis.expr(&part.point);
    }
}

struct Analysis<'m, 'c, 'a> {
    checker: &'c mut Checker<'a>,
    model: &'m Model,
    locals: HashMap<LocalId, Activity>,
    /// Results of functions by what their captures and arguments depend on.
    known: HashMap<(FunctionId, Vec<Activity>), Activity>,
    running: Vec<FunctionId>,
}

impl<'m> Analysis<'m, '_, '_> {
    fn statement(&mut self, statement: &'m Statement) {
        let activity = self.expr(statement.expr());
        if let Statement::Let(local, _) = statement {
            self.locals.insert(*local, activity);
        }
    }

    fn expr(&mut self, e: &'m Expr) -> Activity {
        if !self.checker.use_fuel(1, e.span) {
            return NONE;
        }
        stacker::maybe_grow(64 << 10, 1 << 20, || self.dispatch(e))
    }

    fn dispatch(&mut self, e: &'m Expr) -> Activity {
        match &e.kind {
            ExprKind::Real(_) | ExprKind::Int(_) | ExprKind::Bool(_) | ExprKind::Text(_) => NONE,
            ExprKind::Local(id) => self.locals.get(id).cloned().unwrap_or(NONE),
            ExprKind::Convert(a) => self.expr(a),
            ExprKind::Unary(op, a) => self.unary(*op, a, e),
            ExprKind::Binary(op, a, b) => {
                let (a, b) = (self.expr(a), self.expr(b));
                match op {
                    Binary::Mul | Binary::Div if matches!(a, Activity::Each(_)) => a.with(b.any()),
                    Binary::Mul | Binary::Div => b.with(a.any()),
                    _ => a.join(&b),
                }
            }
            ExprKind::Compare(_, a, b) => {
                self.expr(a);
                self.expr(b);
                NONE
            }
            ExprKind::If(c, a, b) => {
                self.expr(c);
                let (a, b) = (self.expr(a), self.expr(b));
                a.join(&b)
            }
            ExprKind::Aggregate(items) => Activity::each(items.iter().map(|e| self.expr(e)).collect()),
            ExprKind::Element(a, k) => self.expr(a).component(*k),
            ExprKind::Index(a, i) => {
                let a = self.expr(a);
                self.expr(i);
                match &a {
                    Activity::Each(parts) => parts.iter().fold(NONE, |joined, p| joined.join(p)),
                    all => all.clone(),
                }
            }
            ExprKind::Block(statements, value) => {
                statements.iter().for_each(|s| self.statement(s));
                self.expr(value)
            }
            ExprKind::Call(call) | ExprKind::Derivative { call, .. } => self.call(call, e),
            ExprKind::Fold { from, to, init, accumulator, body, .. } => {
                self.expr(from);
                self.expr(to);
                let mut activity = self.expr(init);
                // It only grows; what is left then is taken as depending throughout.
                for _ in 0..4 {
                    self.locals.insert(*accumulator, activity.clone());
                    let next = activity.join(&self.expr(body));
                    if next == activity {
                        return activity;
                    }
                    activity = next;
                }
                Activity::All(activity.any())
            }
        }
    }

    fn unary(&mut self, op: Unary, a: &'m Expr, e: &Expr) -> Activity {
        let activity = self.expr(a);
        match op {
            Unary::Stop | Unary::Not => NONE,
            Unary::Floor | Unary::Ceil | Unary::Round | Unary::ToInt => {
                if let Some(parameter) = activity.any() {
                    let name = self.model.params.get(parameter as usize).map_or("?", |p| &p.declared.name);
                    let message = format!(
                        "a value that depends on the parameter '{name}' is rounded here and loses its derivative"
                    );
                    self.checker.report(
                        Diagnostic::new(Code::LostDerivative, e.span, message)
                            .hint("if this is intended, write stop(...) around the rounded value"),
                    );
                }
                NONE
            }
            _ => activity,
        }
    }

    fn call(&mut self, call: &'m Call, e: &Expr) -> Activity {
        let model = self.model;
        let Some(function) = model.functions.get(&call.function) else { return NONE };
        let closure = call.closure.as_ref().map_or(NONE, |c| self.expr(c));
        let mut given: Vec<Activity> = (0..function.captures.len()).map(|k| closure.component(k)).collect();
        for arg in &call.args {
            given.push(self.expr(arg));
        }
        let key = (call.function, given);
        if let Some(activity) = self.known.get(&key) {
            return activity.clone();
        }
        if let Some(custom_derivative) = &function.custom_derivative {
            return self.of_custom_derivative(custom_derivative, key, &function.name, e);
        }
        if self.running.contains(&call.function) {
            // Recursion at run time: whatever it gets may come out anywhere.
            return Activity::All(key.1.iter().filter_map(Activity::any).min());
        }
        let activity = self.run(call.function, &key.1, &function.name, e);
        self.known.insert(key, activity.clone());
        activity
    }

    fn run(&mut self, id: FunctionId, given: &[Activity], name: &str, e: &Expr) -> Activity {
        let model = self.model;
        let Some(function) = model.functions.get(&id) else { return NONE };
        self.running.push(id);
        self.checker.call_stack.push(StackFrame { span: e.span, name: name.into() });
        for (local, activity) in function.captures.iter().chain(&function.params).zip(given) {
            self.locals.insert(*local, activity.clone());
        }
        let activity = self.expr(&function.body);
        self.checker.call_stack.pop();
        self.running.pop();
        activity
    }

    /// A function whose derivative is given may round what it likes; the derivative may not, as it has one itself.
    fn of_custom_derivative(
        &mut self,
        custom_derivative: &CustomDerivative,
        key: (FunctionId, Vec<Activity>),
        name: &str,
        e: &Expr,
    ) -> Activity {
        let first = key.1.iter().filter_map(Activity::any).min();
        if !self.running.contains(&custom_derivative.function) && first.is_some() {
            let captures = self.model.functions[&key.0].captures.len();
            let tangents = custom_derivative.params.iter().map(|p| key.1[captures + p].clone());
            let given: Vec<Activity> = key.1.iter().cloned().chain(tangents).collect();
            self.run(custom_derivative.function, &given, name, e);
        }
        let activity = Activity::All(first);
        self.known.insert(key, activity.clone());
        activity
    }
}
