//! Checked values to scalars to data: lowered, differentiated where they ask for it, run by the interpreter.

use super::{Data, Session, Value};
use crate::check::entered::{Asked, Checked};
use crate::check::signature::written_type;
use crate::check::typed::{self, Type};
use crate::diagnostic::{Code, Diagnostic};
use crate::diff;
use crate::ir::interpret::{self, RunError};
use crate::ir::scalar::Scalar;
use crate::ir::{FunctionId, Module, lower};
use crate::program::Parameter;

/// Values as functions of the current model's parameters.
pub(super) struct Lowered {
    pub(super) module: Module,
    pub(super) functions: Vec<FunctionId>,
}

/// The values that were asked for, in order.
pub(super) fn values(session: &Session, checked: &Checked) -> Result<Vec<Value>, Vec<Diagnostic>> {
    let lowered = lower_asked(checked)?;
    let values = checked.values.iter().flatten().zip(&lowered.functions).map(|(asked, function)| {
        let scalars = run(session, &lowered.module, *function)?;
        let data = data(&checked.model, asked, &asked.ty, &mut scalars.into_iter());
        Ok(Value { data, ty: asked.words.clone(), span: asked.span })
    });
    values.collect::<Result<_, Diagnostic>>().map_err(|e| vec![e])
}

/// The functions of what is asked for, derivatives expanded.
pub(super) fn lower_asked(checked: &Checked) -> Result<Lowered, Vec<Diagnostic>> {
    let locals: Vec<_> = checked.values.iter().flatten().map(|v| v.local).collect();
    let (mut module, functions) = lower::lower_values(&checked.model, &locals).map_err(|e| vec![e.diagnostic()])?;
    diff::expand(&mut module, &functions).map_err(|e| vec![e.diagnostic()])?;
    Ok(Lowered { module, functions })
}

/// A function's results at the current parameters; all of them finite.
pub(super) fn run(session: &Session, module: &Module, function: FunctionId) -> Result<Vec<Scalar>, Diagnostic> {
    let (parameters, x) = session.model.as_ref().map_or((&[][..], &[][..]), |m| (m.parameters(), m.values()));
    let args: Vec<Scalar> = x.iter().map(|x| Scalar::Real(*x)).collect();
    let wrong = |e: RunError| Diagnostic {
        message: format!("{}{}", message(&e, module, session), where_it_was(module, function, parameters, x)),
        ..diagnostic(&e, module)
    };
    let limits = session.options.limits;
    let results = interpret::run_until(module, function, &args, limits, &session.options.interrupt).map_err(wrong)?;
    if results.iter().all(|r| r.is_finite()) {
        return Ok(results);
    }
    let interrupt = &session.options.interrupt;
    let origin = match interpret::non_finite(module, function, &args, limits, Some(interrupt)) {
        Err(e @ RunError::Interrupted(_)) => return Err(wrong(e)),
        origin => origin.ok().flatten().unwrap_or_default(),
    };
    let what = session.sources.quoted(origin);
    let place = where_it_was(module, function, parameters, x);
    Err(Diagnostic::new(Code::NotFinite, origin, format!("{what} is not a finite number{place}")))
}

fn diagnostic(e: &RunError, module: &Module) -> Diagnostic {
    let code = match e {
        RunError::Failed(_) => Code::RunTime,
        RunError::Interrupted(_) => Code::Interrupted,
        RunError::Malformed(_) => Code::Internal,
        RunError::Steps(_) | RunError::Depth(_) | RunError::Memory(_) => Code::Limit,
    };
    Diagnostic::new(code, e.span(module), String::new())
}

fn message(e: &RunError, module: &Module, session: &Session) -> String {
    let limits = session.options.limits;
    match e {
        RunError::Failed(id) => module.failures[id.0 as usize].message.clone(),
        RunError::Steps(_) => format!("the evaluation takes more than {} steps", limits.steps),
        RunError::Depth(_) => format!("calls are nested deeper than {}", limits.depth),
        RunError::Memory(_) => format!("the evaluation holds more than {} values at once", limits.memory),
        RunError::Interrupted(_) | RunError::Malformed(_) => e.to_string(),
    }
}

/// ` (where r = 40mm)`: the parameters that a function of all of them uses.
fn where_it_was(module: &Module, function: FunctionId, parameters: &[Parameter], x: &[f64]) -> String {
    let used = module.function(function).used_params();
    let shown: Vec<String> = parameters
        .iter()
        .zip(x)
        .enumerate()
        .filter(|(i, _)| used[*i])
        .map(|(_, (parameter, x))| parameter.equals(*x))
        .collect();
    if shown.is_empty() { String::new() } else { format!(" (where {})", shown.join(", ")) }
}

/// A value's type as it would be written.
pub(super) fn written(asked: &Asked) -> String {
    match &asked.ty {
        Type::Closure(id) => asked.functions.get(id).cloned().unwrap_or_default(),
        ty => written_type(ty),
    }
}

/// Scalars back to the value that they are.
fn data(model: &typed::Model, asked: &Asked, ty: &Type, scalars: &mut dyn Iterator<Item = Scalar>) -> Data {
    let mut next = || scalars.next();
    match ty {
        Type::Real(unit) => match next() {
            Some(Scalar::Real(value)) => Data::Number { value, unit: *unit },
            Some(Scalar::Int(k)) => Data::Number { value: k as f64, unit: *unit },
            _ => Data::Number { value: f64::NAN, unit: *unit },
        },
        Type::Int(_) => Data::Int(next().map_or(0, int)),
        Type::Bool(_) => Data::Bool(next() == Some(Scalar::Bool(true))),
        Type::Text(_) | Type::Error => Data::Text(asked.text.clone()),
        Type::Range(..) => {
            let (from, to) = (next().map_or(0, int), next().map_or(0, int));
            Data::Range(from, to)
        }
        Type::Tuple(types) => Data::Tuple(types.iter().map(|t| data(model, asked, t, scalars)).collect()),
        Type::Array(t, n) => Data::Array((0..*n).map(|_| data(model, asked, t, scalars)).collect()),
        Type::Record(fields) => {
            let fields = fields.iter().map(|(name, t)| (name.to_string(), data(model, asked, t, scalars)));
            // What is inside of a solid has no name.
            Data::Record(fields.filter(|(name, _)| !name.is_empty()).collect())
        }
        Type::Closure(id) => {
            for (_, ty) in &model.closures[id.0 as usize].captures {
                data(model, asked, ty, scalars);
            }
            Data::Function(asked.functions.get(id).cloned().unwrap_or_else(|| "function".to_owned()))
        }
    }
}

fn int(scalar: Scalar) -> i64 {
    match scalar {
        Scalar::Int(k) => k,
        _ => 0,
    }
}
