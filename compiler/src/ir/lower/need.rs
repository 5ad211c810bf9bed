//! Values by need: of the records and arrays that a `let` binds, only the components that are used are computed.
//!
//! A solid made of a hundred others is a record of all their surfaces, each of which captures what is inside of the
//! other solids: a part needs one of them. Calls that give records or arrays are unfolded where a component of their
//! result is asked for, so that what the call does not need for it is not computed either.

use super::{Frame, SizeError};
use crate::check::typed::{self, Call, Expr, ExprKind, LocalId, Statement, Type};
use crate::ir::hash::HashMap;
use crate::ir::scalar::Scalar;
use crate::ir::{Failure, FailureId, Value};
use std::rc::Rc;

/// Most values by need of one function under construction; beyond that calls are not unfolded. A script could unfold
/// exponentially, by functions that each call the one before with two records, where its functions, each lowered once,
/// do not. Solids need far fewer: a plate with 100 holes has some 3,000 for each of its parts.
const MOST: usize = 1 << 16;

/// The index of a value by need in its frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct NeedId(usize);

/// The index of a scope in its frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ScopeId(usize);

/// The locals of a function whose call is unfolded, or those of the frame itself.
#[derive(Default)]
struct Scope {
    locals: HashMap<LocalId, NeedId>,
    /// The function, and the scope of its call.
    unfolded: Option<(typed::FunctionId, ScopeId)>,
}

/// What is known of a value.
#[derive(Clone)]
enum Need<'m> {
    /// It is the value of an expression in a scope.
    Expr(&'m Expr, ScopeId),
    /// It has these components.
    Components(Rc<[NeedId]>),
    /// It has these scalars.
    Scalars(Rc<[Value]>),
    /// It is another value, where some requirements are met.
    Required(NeedId, Rc<[Requirement<'m>]>),
}

/// A condition in a scope, and the failure where it does not hold.
struct Requirement<'m> {
    condition: &'m Expr,
    scope: ScopeId,
    failure: FailureId,
}

/// The values by need of a frame.
pub(super) struct Needs<'m> {
    values: Vec<Need<'m>>,
    scopes: Vec<Scope>,
    /// The scope of the expressions that are lowered at present.
    scope: ScopeId,
    /// The values of the calls that were unfolded, by function, closure and arguments.
    unfolded: HashMap<(typed::FunctionId, Vec<Argument>), NeedId>,
}

/// An argument of a call that is unfolded.
#[derive(PartialEq, Eq, Hash)]
enum Argument {
    /// By need.
    Need(NeedId),
    /// Its scalars, equal ones of which are the same.
    Scalars(Rc<[Value]>),
}

impl<'m> Needs<'m> {
    pub(super) fn new() -> Needs<'m> {
        Needs { values: Vec::new(), scopes: vec![Scope::default()], scope: ScopeId(0), unfolded: HashMap::default() }
    }

    fn add(&mut self, need: Need<'m>) -> NeedId {
        self.values.push(need);
        NeedId(self.values.len() - 1)
    }

    /// Binds a local to its scalars.
    pub(super) fn bind(&mut self, local: LocalId, scalars: Vec<Value>) {
        let id = self.add(Need::Scalars(scalars.into()));
        self.bind_in(self.scope, local, id);
    }

    fn bind_in(&mut self, scope: ScopeId, local: LocalId, id: NeedId) {
        self.scopes[scope.0].locals.insert(local, id);
    }

    fn find(&self, scope: ScopeId, local: LocalId) -> NeedId {
        let found = self.scopes[scope.0].locals.get(&local);
        *found.expect("the checker binds every local before its use, and the frame was given what it uses")
    }

    /// Whether the function is unfolded in the scope or around it.
    fn is_unfolded(&self, function: typed::FunctionId, mut scope: ScopeId) -> bool {
        while let Some((unfolded, caller)) = self.scopes[scope.0].unfolded {
            if unfolded == function {
                return true;
            }
            scope = caller;
        }
        false
    }
}

impl<'m> Frame<'_, 'm> {
    /// Binds a local to an expression, by need where its type is so.
    pub(super) fn bind_let(&mut self, local: LocalId, value: &'m Expr) -> Result<(), SizeError> {
        if is_by_need(&value.ty) {
            let id = self.needs.add(Need::Expr(value, self.needs.scope));
            self.needs.bind_in(self.needs.scope, local, id);
        } else {
            let scalars = self.expr(value)?;
            self.needs.bind(local, scalars);
        }
        Ok(())
    }

    /// The scalars of a local.
    pub(super) fn local(&mut self, local: LocalId) -> Result<Rc<[Value]>, SizeError> {
        self.scalars_of(self.needs.find(self.needs.scope, local))
    }

    /// The scalars of component k of an expression's value.
    pub(super) fn element(&mut self, whole: &'m Expr, k: usize) -> Result<Vec<Value>, SizeError> {
        if !is_by_need(&whole.ty) {
            let (start, width) = self.lowerer.model.component(&whole.ty, k);
            return Ok(self.expr(whole)?[start..start + width].to_vec());
        }
        let whole_id = self.needs.add(Need::Expr(whole, self.needs.scope));
        let id = self.component(whole_id, &whole.ty, k)?;
        Ok(self.scalars_of(id)?.to_vec())
    }

    /// Component k of a value of a type.
    fn component(&mut self, whole: NeedId, ty: &Type, k: usize) -> Result<NeedId, SizeError> {
        Ok(match self.exposed(whole)? {
            Need::Components(ids) => ids[k],
            Need::Scalars(values) => {
                let (start, width) = self.lowerer.model.component(ty, k);
                self.needs.add(Need::Scalars(values[start..start + width].into()))
            }
            Need::Expr(..) | Need::Required(..) => whole,
        })
    }

    /// The scalars of a value.
    fn scalars_of(&mut self, id: NeedId) -> Result<Rc<[Value]>, SizeError> {
        let scalars: Rc<[Value]> = match self.needs.values[id.0].clone() {
            Need::Scalars(values) => return Ok(values),
            Need::Components(ids) => {
                let mut values = Vec::new();
                for id in ids.iter() {
                    values.extend_from_slice(&self.scalars_of(*id)?);
                }
                values.into()
            }
            Need::Expr(expr, scope) => self.within(scope, |frame| frame.expr(expr))?.into(),
            Need::Required(id, requirements) => {
                let values = self.scalars_of(id)?;
                self.required(&values, &requirements)?
            }
        };
        self.needs.values[id.0] = Need::Scalars(scalars.clone());
        Ok(scalars)
    }

    /// Does something in a scope.
    fn within<T>(&mut self, scope: ScopeId, f: impl FnOnce(&mut Self) -> T) -> T {
        let around = std::mem::replace(&mut self.needs.scope, scope);
        let result = f(self);
        self.needs.scope = around;
        result
    }

    /// Scalars where requirements are met.
    fn required(&mut self, values: &[Value], requirements: &[Requirement<'m>]) -> Result<Rc<[Value]>, SizeError> {
        let mut guarded = values.to_vec();
        // Nodes are evaluated in their order: the first requirement is the first to fail.
        for Requirement { condition, scope, failure } in requirements {
            let condition = self.within(*scope, |frame| frame.scalar(condition))?;
            guarded.iter_mut().for_each(|v| *v = self.b.guard(*v, condition, *failure));
        }
        Ok(guarded.into())
    }

    /// The value as its components, or else its scalars.
    fn exposed(&mut self, id: NeedId) -> Result<Need<'m>, SizeError> {
        let exposed = match self.needs.values[id.0].clone() {
            Need::Expr(expr, scope) => {
                self.check_size(expr.span)?;
                // The tree may be deeper than what a thread's stack has room for.
                stacker::maybe_grow(128 << 10, 2 << 20, || self.exposed_expr(expr, scope))?
            }
            Need::Required(of, requirements) => self.exposed_where(of, &requirements)?,
            exposed => return Ok(exposed),
        };
        self.needs.values[id.0] = exposed.clone();
        Ok(exposed)
    }

    /// A value where requirements are met, as its components, or else its scalars.
    fn exposed_where(&mut self, of: NeedId, requirements: &Rc<[Requirement<'m>]>) -> Result<Need<'m>, SizeError> {
        Ok(match self.exposed(of)? {
            Need::Components(ids) => {
                let required = |id: &NeedId| self.needs.add(Need::Required(*id, requirements.clone()));
                Need::Components(ids.iter().map(required).collect())
            }
            Need::Scalars(values) => Need::Scalars(self.required(&values, requirements)?),
            exposed => exposed,
        })
    }

    fn exposed_expr(&mut self, expr: &'m Expr, scope: ScopeId) -> Result<Need<'m>, SizeError> {
        match &expr.kind {
            ExprKind::Local(local) => return self.exposed(self.needs.find(scope, *local)),
            ExprKind::Aggregate(items) => {
                return Ok(Need::Components(items.iter().map(|e| self.needs.add(Need::Expr(e, scope))).collect()));
            }
            ExprKind::Element(whole, k) => {
                let whole_id = self.needs.add(Need::Expr(whole, scope));
                let id = self.component(whole_id, &whole.ty, *k)?;
                return self.exposed(id);
            }
            ExprKind::Block(statements, value) => {
                let mut requirements = Vec::new();
                for statement in statements {
                    match statement {
                        Statement::Let(local, value) => self.within(scope, |frame| frame.bind_let(*local, value))?,
                        Statement::Require { condition, message, span } => {
                            let failure = Failure { span: *span, message: message.clone() };
                            let failure = self.lowerer.module.fail(failure);
                            requirements.push(Requirement { condition, scope, failure });
                        }
                    }
                }
                if requirements.is_empty() {
                    return self.exposed_expr(value, scope);
                }
                let id = self.needs.add(Need::Expr(value, scope));
                return self.exposed_where(id, &requirements.into());
            }
            ExprKind::If(condition, then, otherwise) => {
                let condition = self.within(scope, |frame| frame.scalar(condition))?;
                if let Some(Scalar::Bool(holds)) = self.b.constant(condition) {
                    return self.exposed_expr(if holds { then } else { otherwise }, scope);
                }
            }
            ExprKind::Index(whole, i) => {
                if let Some(k) = known_index(whole, i) {
                    let whole_id = self.needs.add(Need::Expr(whole, scope));
                    let id = self.component(whole_id, &whole.ty, k)?;
                    return self.exposed(id);
                }
            }
            ExprKind::Call(call) if is_by_need(&expr.ty) && self.has_components(call) && self.unfolds(call, scope) => {
                let id = self.unfold(call, scope)?;
                return self.exposed(id);
            }
            _ => {}
        }
        Ok(Need::Scalars(self.within(scope, |frame| frame.expr(expr))?.into()))
    }

    /// The scalars of a part's point: what its surface has captured is computed by need, too.
    pub(super) fn point(&mut self, point: &'m Expr) -> Result<Rc<[Value]>, SizeError> {
        let scope = self.needs.scope;
        let id = match &point.kind {
            ExprKind::Call(call) if self.unfolds(call, scope) => self.unfold(call, scope)?,
            _ => self.needs.add(Need::Expr(point, scope)),
        };
        self.scalars_of(id)
    }

    fn has_components(&self, call: &Call) -> bool {
        has_components(&self.lowerer.model.functions[&call.function].body)
    }

    /// Whether the body of a function can stand for its call.
    fn unfolds(&self, call: &Call, scope: ScopeId) -> bool {
        let function = &self.lowerer.model.functions[&call.function];
        // The derivative of the body is not the custom one.
        function.custom_derivative.is_none()
            && self.needs.values.len() < MOST
            && !self.needs.is_unfolded(call.function, scope)
    }

    /// The value of a call as that of the function's body, in a scope with the captures and arguments.
    fn unfold(&mut self, call: &'m Call, scope: ScopeId) -> Result<NeedId, SizeError> {
        let mut arguments = Vec::new();
        for arg in call.closure.iter().map(|c| &**c).chain(&call.args) {
            arguments.push(if is_by_need(&arg.ty) {
                Argument::Need(self.source(arg, scope))
            } else {
                Argument::Scalars(self.within(scope, |frame| frame.expr(arg))?.into())
            });
        }
        let key = (call.function, arguments);
        if let Some(id) = self.needs.unfolded.get(&key) {
            return Ok(*id);
        }
        let function = &self.lowerer.model.functions[&call.function];
        let inner = ScopeId(self.needs.scopes.len());
        self.needs.scopes.push(Scope { locals: HashMap::default(), unfolded: Some((call.function, scope)) });
        let mut given = key.1.iter();
        if let (Some(closure), Some(Argument::Need(whole))) = (&call.closure, given.as_slice().first()) {
            given.next();
            for (k, local) in function.captures.iter().enumerate() {
                let id = self.component(*whole, &closure.ty, k)?;
                self.needs.bind_in(inner, *local, id);
            }
        }
        for (local, argument) in function.params.iter().zip(given) {
            let id = match argument {
                Argument::Need(id) => *id,
                Argument::Scalars(scalars) => self.needs.add(Need::Scalars(scalars.clone())),
            };
            self.needs.bind_in(inner, *local, id);
        }
        let id = self.needs.add(Need::Expr(&function.body, inner));
        self.needs.unfolded.insert(key, id);
        Ok(id)
    }

    /// A value of an expression by need: that of the local which the expression reads, through arguments that read
    /// others.
    fn source(&mut self, expr: &'m Expr, scope: ScopeId) -> NeedId {
        let ExprKind::Local(local) = expr.kind else { return self.needs.add(Need::Expr(expr, scope)) };
        let mut id = self.needs.find(scope, local);
        while let Need::Expr(Expr { kind: ExprKind::Local(local), .. }, scope) = self.needs.values[id.0] {
            id = self.needs.find(scope, *local);
        }
        id
    }
}

/// The index of an array's element where it is known.
pub(super) fn known_index(array: &Expr, index: &Expr) -> Option<usize> {
    match (&array.ty, &index.kind) {
        (Type::Array(_, n), ExprKind::Int(i)) => usize::try_from(*i).ok().filter(|i| i < n),
        _ => None,
    }
}

/// Whether the components of an expression's value can be told apart before it is computed.
fn has_components(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Aggregate(_) | ExprKind::Local(_) | ExprKind::Element(..) | ExprKind::Call(_) => true,
        ExprKind::Index(array, i) => known_index(array, i).is_some(),
        ExprKind::Block(_, value) => has_components(value),
        _ => false,
    }
}

/// Whether values of a type are computed by need: those of which a part may be much less than the whole.
fn is_by_need(ty: &Type) -> bool {
    match ty {
        Type::Record(_) | Type::Array(..) | Type::Closure(_) => true,
        Type::Tuple(types) => types.iter().any(is_by_need),
        _ => false,
    }
}
