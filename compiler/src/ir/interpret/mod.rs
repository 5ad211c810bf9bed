//! The interpreter: runs functions node by node, slowly and within limits. It is the oracle against which native code
//! is tested, and it traces a non-finite result back to its origin.

use super::scalar::{self, Scalar};
use super::{FailureId, Function, FunctionId, Module, Op, Value, arithmetic};
use crate::source::Span;
use std::sync::atomic::{AtomicBool, Ordering};

mod decisions;
mod least;
mod origin;
pub use decisions::{Decision, decisions};
use least::LeastSteps;
use origin::Origin;

/// Limits of a run.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Most nodes that are evaluated.
    pub steps: u64,
    /// Most functions that run at once; never more than 1000.
    pub depth: usize,
    /// Most values that are held at once.
    pub memory: usize,
}

/// The deepest recursion that any limit allows: deeper than a script's author intends.
const MOST_DEPTH: usize = 1000;

/// Loops of so many iterations are compared with the limit on steps before they begin.
const COUNTED: u64 = 100;

/// Bytes of stack that must be left before a function is run; otherwise [`STACK_MORE`] are added.
const STACK_LEFT: usize = 128 << 10;
const STACK_MORE: usize = 2 << 20;

impl Default for Limits {
    fn default() -> Limits {
        Limits { steps: 100_000_000, depth: MOST_DEPTH, memory: 50_000_000 }
    }
}

/// Why a run ended without results.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RunError {
    /// A guard's condition did not hold; the module's `failures` has the message.
    #[error("a guard failed")]
    Failed(FailureId),
    /// More nodes were evaluated than the limit.
    #[error("the evaluation takes too many steps")]
    Steps(Span),
    /// More functions ran at once than the limit.
    #[error("the recursion is too deep")]
    Depth(Span),
    /// More values were held at once than the limit.
    #[error("the evaluation takes too much memory")]
    Memory(Span),
    /// The caller set the flag that interrupts the run.
    #[error("interrupted")]
    Interrupted(Span),
    /// The function is not valid, or has tangents that were not expanded, or the arguments do not fit it.
    #[error("the function cannot be run")]
    Malformed(Span),
}

impl RunError {
    /// The place in the source.
    #[must_use]
    pub fn span(&self, module: &Module) -> Span {
        match self {
            RunError::Failed(failure) => module.failures.get(failure.0 as usize).map_or(Span::default(), |f| f.span),
            RunError::Steps(span) | RunError::Depth(span) | RunError::Memory(span) => *span,
            RunError::Interrupted(span) | RunError::Malformed(span) => *span,
        }
    }
}

/// The results of a function for these arguments.
///
/// # Errors
/// If a guard fails or a limit is exceeded.
pub fn run(module: &Module, function: FunctionId, args: &[Scalar], limits: Limits) -> Result<Vec<Scalar>, RunError> {
    let mut interpreter = Interpreter::new(module, limits);
    interpreter.check(function, args)?;
    interpreter.run(function, args.to_vec(), Span::default())
}

/// [`run`], which ends early once another thread sets the flag.
///
/// # Errors
/// As [`run`]; `Interrupted` once the flag is set.
pub fn run_until(
    module: &Module,
    function: FunctionId,
    args: &[Scalar],
    limits: Limits,
    interrupt: &AtomicBool,
) -> Result<Vec<Scalar>, RunError> {
    let mut interpreter = Interpreter { interrupt: Some(interrupt), ..Interpreter::new(module, limits) };
    interpreter.check(function, args)?;
    interpreter.run(function, args.to_vec(), Span::default())
}

/// [`run`] for a function that takes and gives reals only.
///
/// # Errors
/// As [`run`]; `Malformed` where there is anything but reals.
pub fn run_real(module: &Module, function: FunctionId, args: &[f64], limits: Limits) -> Result<Vec<f64>, RunError> {
    let args: Vec<Scalar> = args.iter().map(|x| Scalar::Real(*x)).collect();
    let results = run(module, function, &args, limits)?;
    results.into_iter().map(Scalar::real).collect::<Option<_>>().ok_or(RunError::Malformed(Span::default()))
}

/// The place in the source where the first infinity or NaN arises among the values from which the first non-finite
/// result was computed; `None` where all results are finite. Arms that were not selected do not count. If it is an
/// argument that is not finite, the place is that of its first use.
///
/// # Errors
/// As [`run_until`].
pub fn non_finite(
    module: &Module,
    function: FunctionId,
    args: &[Scalar],
    limits: Limits,
    interrupt: Option<&AtomicBool>,
) -> Result<Option<Span>, RunError> {
    let mut interpreter = Interpreter { interrupt, ..Interpreter::new(module, limits) };
    interpreter.check(function, args)?;
    let results = interpreter.run(function, args.to_vec(), Span::default())?;
    let Some(k) = results.iter().position(|r| !r.is_finite()) else { return Ok(None) };
    interpreter.steps = limits.steps;
    match interpreter.origin(function, args, k, Span::default())? {
        Origin::Node(span) | Origin::Param(_, span) => Ok(Some(span)),
    }
}

struct Interpreter<'m> {
    module: &'m Module,
    /// The rest of each limit.
    steps: u64,
    depth: usize,
    memory: usize,
    /// Ends the run once it is set.
    interrupt: Option<&'m AtomicBool>,
    /// What functions take at least.
    least: LeastSteps,
    /// The decisions so far, if the caller asked for them.
    decisions: Option<Vec<Decision>>,
}

/// The value of a node.
enum Computed {
    One(Scalar),
    Many(Vec<Scalar>),
}

impl<'m> Interpreter<'m> {
    fn new(module: &'m Module, limits: Limits) -> Interpreter<'m> {
        Interpreter {
            module,
            steps: limits.steps,
            depth: limits.depth.min(MOST_DEPTH),
            memory: limits.memory,
            interrupt: None,
            least: LeastSteps::default(),
            decisions: None,
        }
    }

    fn check(&self, function: FunctionId, args: &[Scalar]) -> Result<(), RunError> {
        let params = self.module.functions.get(function.0 as usize).map(|f| f.params.iter().map(|p| p.ty));
        let fits = params.is_some_and(|p| p.eq(args.iter().map(|a| a.ty())));
        if fits { Ok(()) } else { Err(RunError::Malformed(Span::default())) }
    }

    fn run(&mut self, function: FunctionId, args: Vec<Scalar>, span: Span) -> Result<Vec<Scalar>, RunError> {
        let module = self.module;
        let function = module.function(function);
        // The stack follows the depth, which the limit bounds.
        let values = stacker::maybe_grow(STACK_LEFT, STACK_MORE, || self.evaluate(function, &args, span))?;
        let results = function.results.iter().map(|r| one(&values, *r).ok_or(RunError::Malformed(span)));
        let results = results.collect();
        self.memory += function.nodes.len();
        results
    }

    /// The values of all nodes. The caller gives back the memory that they take.
    fn evaluate(&mut self, function: &Function, args: &[Scalar], span: Span) -> Result<Vec<Computed>, RunError> {
        self.depth = self.depth.checked_sub(1).ok_or(RunError::Depth(span))?;
        self.memory = self.memory.checked_sub(function.nodes.len()).ok_or(RunError::Memory(span))?;
        if self.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
            return Err(RunError::Interrupted(span));
        }
        let mut values = Vec::with_capacity(function.nodes.len());
        for node in &function.nodes {
            self.steps = self.steps.checked_sub(1).ok_or(RunError::Steps(node.span))?;
            let value = match &node.op {
                op if op.is_structured() => Computed::Many(self.structured(&values, op, node.span)?),
                Op::Project(multi, k) => match &values[multi.0 as usize] {
                    Computed::Many(results) => {
                        Computed::One(*results.get(*k as usize).ok_or(RunError::Malformed(node.span))?)
                    }
                    Computed::One(_) => return Err(RunError::Malformed(node.span)),
                },
                Op::Guard { condition, failure, .. } if one(&values, *condition) == Some(Scalar::Bool(false)) => {
                    return Err(RunError::Failed(*failure));
                }
                op => Computed::One(simple(op, args, |v| one(&values, v)).ok_or(RunError::Malformed(node.span))?),
            };
            if let (Some(decisions), Computed::One(result)) = (&mut self.decisions, &value)
                && let Some(side) = decisions::side(&node.op, *result, |v| one(&values, v))
            {
                decisions.push(Decision { span: node.span, side });
            }
            values.push(value);
        }
        self.depth += 1;
        Ok(values)
    }

    fn structured(&mut self, values: &[Computed], op: &Op, span: Span) -> Result<Vec<Scalar>, RunError> {
        let get = |v: &Value| one(values, *v).ok_or(RunError::Malformed(span));
        let all = |vs: &[Value]| vs.iter().map(get).collect::<Result<Vec<_>, _>>();
        match op {
            Op::If { condition, then, otherwise, args } => {
                let taken = if get(condition)? == Scalar::Bool(true) { *then } else { *otherwise };
                self.run(taken, all(args)?, span)
            }
            Op::Call { function, args } => self.run(*function, all(args)?, span),
            Op::Loop { count, body, init, invariant } => {
                let Scalar::Int(count) = get(count)? else { return Err(RunError::Malformed(span)) };
                let (mut carried, invariant) = (all(init)?, all(invariant)?);
                self.require_steps(*body, count, span)?;
                for i in 0..count {
                    carried = self.iteration(*body, i, &carried, &invariant, span)?;
                }
                Ok(carried)
            }
            _ => Err(RunError::Malformed(span)),
        }
    }

    /// Fails where a loop certainly exceeds the limit, before it has run up to that.
    fn require_steps(&mut self, body: FunctionId, count: i64, span: Span) -> Result<(), RunError> {
        let Some(count) = u64::try_from(count).ok().filter(|n| *n >= COUNTED) else { return Ok(()) };
        let steps = count.saturating_mul(self.least.steps(self.module, body).saturating_add(1));
        if steps > self.steps { Err(RunError::Steps(span)) } else { Ok(()) }
    }

    fn iteration(
        &mut self,
        body: FunctionId,
        i: i64,
        carried: &[Scalar],
        invariant: &[Scalar],
        span: Span,
    ) -> Result<Vec<Scalar>, RunError> {
        // An iteration is a step even where the body is empty.
        self.steps = self.steps.checked_sub(1).ok_or(RunError::Steps(span))?;
        let args = [&[Scalar::Int(i)], carried, invariant].concat();
        self.run(body, args, span)
    }
}

fn one(values: &[Computed], v: Value) -> Option<Scalar> {
    match values.get(v.0 as usize)? {
        Computed::One(x) => Some(*x),
        Computed::Many(_) => None,
    }
}

/// The value of an operation that runs no function; `None` where a type does not fit.
fn simple(op: &Op, args: &[Scalar], get: impl Fn(Value) -> Option<Scalar>) -> Option<Scalar> {
    match *op {
        Op::Param(i) => args.get(i as usize).copied(),
        Op::Real(bits) => Some(Scalar::Real(f64::from_bits(bits))),
        Op::Int(i) => Some(Scalar::Int(i)),
        Op::Bool(b) => Some(Scalar::Bool(b)),
        Op::Unary(op, a) => scalar::unary(op, get(a)?),
        Op::Binary(op, a, b) => scalar::binary(op, get(a)?, get(b)?),
        Op::PowInt(a, n) => Some(Scalar::Real(arithmetic::pow_int(get(a)?.real()?, n))),
        Op::Compare(op, a, b) => scalar::compare(op, get(a)?, get(b)?).map(Scalar::Bool),
        Op::Select(c, a, b) => match get(c)? {
            Scalar::Bool(c) => get(if c { a } else { b }),
            _ => None,
        },
        Op::Guard { value, .. } => get(value),
        _ => None,
    }
}
