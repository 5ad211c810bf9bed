//! Checks that a module is well formed.

use super::call_graph::CallGraph;
use super::{Binary, CustomDerivative, Function, FunctionId, Module, Node, Op, Type, Unary, Value};

/// The first mistake in a module.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("function {function} ('{name}'){}: {problem}", node.map_or(String::new(), |n| format!(", node {n}")))]
pub struct Invalid {
    /// Index of the function.
    pub function: u32,
    /// Its name.
    pub name: String,
    /// Index of the node, if the mistake is in a node.
    pub node: Option<u32>,
    /// The kind of mistake.
    pub problem: Problem,
}

/// The ways in which a function can be malformed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Problem {
    /// Node i is not `Param(i)` for every parameter, or there is another `Param`.
    #[error("the parameters are not the first nodes")]
    Parameters,
    /// An operand is not computed before its use.
    #[error("an operand does not come before its use")]
    Order,
    /// An operand or the node itself has the wrong type.
    #[error("a type does not fit the operation")]
    Types,
    /// A result is not a value of the function, is `Multi`, or lacks its name.
    #[error("the results are not named values")]
    Results,
    /// A function, failure or result is named that does not exist.
    #[error("it names something that does not exist")]
    Reference,
    /// Arguments do not fit the parameters, or the sides of a branch or the iterations of a loop do not fit one
    /// another.
    #[error("the signatures do not fit")]
    Signature,
    /// A body of a branch, a loop or a tangent runs itself without a call.
    #[error("it is recursive, and not through a call")]
    Recursion,
}

/// Checks a whole module.
///
/// # Errors
/// The first mistake.
pub fn validate(module: &Module) -> Result<(), Invalid> {
    let invalid = |f: FunctionId, node: Option<u32>, problem| Invalid {
        function: f.0,
        name: module.functions.get(f.0 as usize).map_or(String::new(), |f| f.name.clone()),
        node,
        problem,
    };
    let all: Vec<FunctionId> = (0..module.functions.len() as u32).map(FunctionId).collect();
    for id in &all {
        check_shape(module.function(*id)).map_err(|(node, problem)| invalid(*id, node, problem))?;
    }
    // Only now is it known that every result has a type.
    for id in &all {
        let function = module.function(*id);
        for (k, node) in (0..).zip(&function.nodes) {
            check_node(module, function, node).map_err(|problem| invalid(*id, Some(k), problem))?;
        }
    }
    for (id, custom) in &module.custom_derivatives {
        check_custom_derivative(module, *id, custom).map_err(|problem| invalid(*id, None, problem))?;
    }
    let bodies = CallGraph::along(module, &all, |op| !matches!(op, Op::Call { .. }));
    match all.iter().find(|f| bodies.is_recursive(**f)) {
        Some(f) => Err(invalid(*f, None, Problem::Recursion)),
        None => Ok(()),
    }
}

/// Checks a module after a pass in debug builds and unit tests: a mistake is one of that pass.
pub(crate) fn after_pass(module: &Module, pass: &str) {
    if cfg!(any(test, debug_assertions))
        && let Err(invalid) = validate(module)
    {
        panic!("after {pass}: {invalid}\n{module}");
    }
}

/// Parameters, order of operands, results.
fn check_shape(function: &Function) -> Result<(), (Option<u32>, Problem)> {
    if function.nodes.len() < function.params.len() {
        return Err((None, Problem::Parameters));
    }
    for (i, node) in function.nodes.iter().enumerate() {
        let at = Some(i as u32);
        let expected = function.params.get(i);
        let fits = match (&node.op, expected) {
            (Op::Param(k), Some(param)) => *k as usize == i && param.ty == node.ty && node.ty != Type::Multi,
            (Op::Param(_), None) | (_, Some(_)) => false,
            _ => true,
        };
        if !fits {
            return Err((at, Problem::Parameters));
        }
        if !node.op.all_operands(|v| (v.0 as usize) < i) {
            return Err((at, Problem::Order));
        }
    }
    let named = function.results.len() == function.result_names.len();
    let real = |r: &Value| function.nodes.get(r.0 as usize).is_some_and(|n| n.ty != Type::Multi);
    if named && function.results.iter().all(real) { Ok(()) } else { Err((None, Problem::Results)) }
}

/// A custom derivative takes the function's parameters and Real tangents, and returns a Real for every result.
fn check_custom_derivative(module: &Module, f: FunctionId, custom: &CustomDerivative) -> Result<(), Problem> {
    let get = |id: FunctionId| module.functions.get(id.0 as usize).ok_or(Problem::Reference);
    let (f, derivative) = (get(f)?, get(custom.function)?);
    let tangents = custom.tangents.iter().map(|_| Type::Real);
    let params = f.params.iter().map(|p| p.ty).chain(tangents);
    require(derivative.params.iter().map(|p| p.ty).eq(params), Problem::Signature)?;
    require(derivative.results.len() == f.results.len(), Problem::Signature)?;
    require(derivative.result_types().iter().all(|t| *t == Type::Real), Problem::Types)?;
    let known = |i: &u32| f.params.get(*i as usize).is_some_and(|p| p.ty == Type::Real);
    require(custom.tangents.iter().flatten().all(known), Problem::Reference)
}

fn require(condition: bool, problem: Problem) -> Result<(), Problem> {
    if condition { Ok(()) } else { Err(problem) }
}

fn check_node(module: &Module, function: &Function, node: &Node) -> Result<(), Problem> {
    let ty = |v: Value| function.ty(v);
    match &node.op {
        Op::Project(multi, k) => {
            require(ty(*multi) == Type::Multi, Problem::Types)?;
            let types = result_types(module, function, function.op(*multi))?;
            let result = types.get(*k as usize).ok_or(Problem::Reference)?;
            require(*result == node.ty, Problem::Types)
        }
        op => {
            require(op.all_operands(|v| ty(v) != Type::Multi), Problem::Types)?;
            match op {
                op if op.is_structured() => {
                    require(node.ty == Type::Multi, Problem::Types)?;
                    check_structured(module, function, op)
                }
                Op::Guard { failure, .. } if failure.0 as usize >= module.failures.len() => Err(Problem::Reference),
                op => require(simple_type(op, ty, node.ty) == Some(node.ty), Problem::Types),
            }
        }
    }
}

/// The type of an operation that runs no function; `None` where its operands' types do not fit. `declared` is the type
/// of the node.
fn simple_type(op: &Op, ty: impl Fn(Value) -> Type, declared: Type) -> Option<Type> {
    let number = |t: Type| matches!(t, Type::Real | Type::Int);
    let (fits, result) = match *op {
        Op::Param(_) => (true, declared),
        Op::Real(_) => (true, Type::Real),
        Op::Int(_) => (true, Type::Int),
        Op::Bool(_) => (true, Type::Bool),
        Op::Unary(Unary::Not, a) => (ty(a) == Type::Bool, Type::Bool),
        Op::Unary(Unary::ToReal, a) => (ty(a) == Type::Int, Type::Real),
        Op::Unary(Unary::ToInt, a) => (ty(a) == Type::Real, Type::Int),
        Op::Unary(_, a) | Op::PowInt(a, _) => (ty(a) == Type::Real, Type::Real),
        Op::Binary(Binary::And | Binary::Or, a, b) => (ty(a) == Type::Bool && ty(b) == Type::Bool, Type::Bool),
        Op::Binary(op, a, b) => {
            use Binary::{Add, Div, Max, Min, Mul, Rem, Sub};
            let integral = matches!(op, Add | Sub | Mul | Div | Rem | Min | Max);
            (ty(a) == ty(b) && (ty(a) == Type::Real || (ty(a) == Type::Int && integral)), ty(a))
        }
        Op::Compare(_, a, b) => (ty(a) == ty(b) && number(ty(a)), Type::Bool),
        Op::Select(c, a, b) => (ty(c) == Type::Bool && ty(a) == ty(b), ty(a)),
        Op::Guard { value, condition, .. } => (ty(condition) == Type::Bool, ty(value)),
        _ => (false, Type::Multi),
    };
    fits.then_some(result)
}

fn check_structured(module: &Module, function: &Function, op: &Op) -> Result<(), Problem> {
    let ty = |v: &Value| function.ty(*v);
    let takes = |f: &Function, types: &[Type]| {
        require(f.params.iter().map(|p| p.ty).eq(types.iter().copied()), Problem::Signature)
    };
    result_types(module, function, op)?;
    match op {
        Op::If { condition, then, otherwise, args } => {
            require(ty(condition) == Type::Bool, Problem::Types)?;
            let (then, otherwise) = (module.function(*then), module.function(*otherwise));
            let args: Vec<Type> = args.iter().map(ty).collect();
            takes(then, &args)?;
            takes(otherwise, &args)?;
            require(then.result_types() == otherwise.result_types(), Problem::Signature)
        }
        Op::Loop { count, body, init, invariant } => {
            require(ty(count) == Type::Int, Problem::Types)?;
            let body = module.function(*body);
            let carried: Vec<Type> = init.iter().map(ty).collect();
            let params: Vec<Type> =
                [Type::Int].into_iter().chain(carried.iter().copied()).chain(invariant.iter().map(ty)).collect();
            takes(body, &params)?;
            require(body.result_types() == carried, Problem::Signature)
        }
        Op::Call { function: callee, args } => {
            takes(module.function(*callee), &args.iter().map(ty).collect::<Vec<_>>())
        }
        Op::Tangent { function: callee, args, seeds } => {
            let callee = module.function(*callee);
            takes(callee, &args.iter().map(ty).collect::<Vec<_>>())?;
            require(seeds.is_sorted_by(|a, b| a.0 < b.0), Problem::Signature)?;
            for (i, seed) in seeds {
                let param = callee.params.get(*i as usize).ok_or(Problem::Reference)?;
                require(param.ty == Type::Real && ty(seed) == Type::Real, Problem::Types)?;
            }
            Ok(())
        }
        _ => Ok(()),
    }
}

/// The types of the results of a structured operation.
fn result_types(module: &Module, function: &Function, op: &Op) -> Result<Vec<Type>, Problem> {
    for f in op.functions() {
        require((f.0 as usize) < module.functions.len(), Problem::Reference)?;
    }
    match op {
        Op::If { then, .. } => Ok(module.function(*then).result_types()),
        Op::Loop { init, .. } => Ok(init.iter().map(|v| function.ty(*v)).collect()),
        Op::Call { function, .. } => Ok(module.function(*function).result_types()),
        Op::Tangent { function, .. } => Ok(vec![Type::Real; module.function(*function).results.len()]),
        _ => Err(Problem::Types),
    }
}
