//! Errors of evaluations, with the place in the source and the values that led there.

use super::evaluators::Evaluator;
use super::functions::{EntryValue, REQUIRES};
use super::instance::Instance;
use super::pipeline::BuildError;
use super::{Order, Program};
use crate::ir::interpret::RunError;
use crate::ir::scalar::Scalar;
use crate::ir::{FunctionId, Module, Requirement, interpret};
use crate::jit::Trap;
use crate::source::Span;
use std::fmt::Write as _;
use thiserror::Error;

/// Most operations that are run again to find the place at which a limit on steps was met.
const REPLAYED_STEPS: u64 = 1_000_000;

/// A model could not be evaluated.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{message}")]
pub struct EvaluationError {
    /// A sentence for the user, with the place in the source (`cup.gml:12:5: ...`) and the values that led there.
    pub message: String,
    /// The place in the user's source, where it is known: the part, where the library's text is the origin.
    pub span: Option<Span>,
    /// Another place, and what it is: the part that was evaluated, where the place lies outside of it, in a function
    /// that it calls; or the origin in the library.
    pub related: Option<(Span, &'static str)>,
    /// The sentence alone.
    pub sentence: String,
    /// The part, the point and the parameters' values that led there; may be empty.
    pub circumstances: String,
}

impl EvaluationError {
    /// A sentence without a place.
    pub fn new(sentence: impl ToString) -> EvaluationError {
        let message = sentence.to_string();
        EvaluationError { sentence: message.clone(), message, span: None, related: None, circumstances: String::new() }
    }
}

/// The model or part that was being evaluated.
pub(super) struct Place<'x> {
    x: &'x [f64],
    patch: Option<usize>,
    uv: Option<[f64; 2]>,
}

impl<'x> Place<'x> {
    /// The model: what all parts have in common.
    pub(super) fn of_model(x: &'x [f64]) -> Place<'x> {
        Place { x, patch: None, uv: None }
    }

    /// A part, at a point if it is known.
    pub(super) fn of_part(x: &'x [f64], patch: usize, uv: Option<[f64; 2]>) -> Place<'x> {
        Place { x, patch: Some(patch), uv }
    }
}

impl Program {
    /// Tries what the script requires of its parameters.
    pub(super) fn check_requires(&self, x: &[f64]) -> Result<(), EvaluationError> {
        let bits: Vec<u64> = x.iter().map(|x| x.to_bits()).collect();
        for (index, require) in self.functions.requires.iter().enumerate() {
            let mut holds = [0];
            let place = Place::of_model(x);
            let arguments = require.condition.arguments(&bits, &[]);
            let call = self.routines.call(REQUIRES + index, &arguments, &mut holds, self.limits);
            call.map_err(|trap| self.trapped(trap, &place))?;
            if holds[0] == 0 {
                let used = self.used_params(require);
                return Err(self.error(Some(require.span), &require.message, &place, Some(&used)));
            }
        }
        Ok(())
    }

    /// Whether one requirement holds; false where it cannot be evaluated.
    pub(super) fn holds(&self, require: usize, x: &[f64]) -> bool {
        let condition = &self.functions.requires[require].condition;
        let bits: Vec<u64> = condition.arguments(x, &[]).into_iter().map(f64::to_bits).collect();
        let mut holds = [0];
        self.routines.call(REQUIRES + require, &bits, &mut holds, self.limits).is_ok() && holds[0] != 0
    }

    /// The error for code that stopped early.
    pub(super) fn trapped(&self, trap: Trap, place: &Place<'_>) -> EvaluationError {
        match trap {
            Trap::Failure(id) => {
                let failure = &self.functions.module.failures[id.0 as usize];
                self.error(Some(failure.span), &failure.message, place, None)
            }
            Trap::Steps => {
                let message = format!("the evaluation takes more than {} steps (see --limit steps)", self.limits.steps);
                self.error(self.span_of(place), &message, place, None)
            }
            Trap::Depth => {
                let message = format!(
                    "calls are nested deeper than {} (see --limit depth), or than there is memory for",
                    self.limits.depth
                );
                self.error(self.span_of(place), &message, place, None)
            }
        }
    }

    /// An error at x with the user's statement, where it names a place of the library alone, as that of something which
    /// all parts have in common. It takes up to a second, and is for those who show the error.
    #[must_use]
    pub fn placed(&self, error: EvaluationError, x: &[f64]) -> EvaluationError {
        let span = error.span.filter(|span| span.file.is_library() && error.related.is_none());
        let part = span.and_then(|span| self.part_that_fails(span, &error.sentence, x));
        match part {
            Some(part) => self.error(span, &error.sentence, &Place::of_part(x, part, None), None),
            None => error,
        }
    }

    /// The first part in which something fails.
    fn part_that_fails(&self, span: Span, message: &str, x: &[f64]) -> Option<usize> {
        let limits = interpret::Limits { steps: REPLAYED_STEPS * 20, ..interpret::Limits::default() };
        let module = &self.functions.module;
        self.functions.parts.iter().position(|part| {
            let arguments = part.surface.arguments(x, &[0.5, 0.5]);
            let failed = match interpret::run_real(module, part.surface.function, &arguments, limits) {
                Err(RunError::Failed(id)) => &module.failures[id.0 as usize],
                _ => return false,
            };
            failed.span == span && failed.message == message
        })
    }

    /// The loop or call that meets a limit: the interpreter goes the same way until it meets one. Else the part.
    fn span_of(&self, place: &Place<'_>) -> Option<Span> {
        let limits = interpret::Limits {
            steps: u64::from(self.limits.steps).min(REPLAYED_STEPS),
            depth: self.limits.depth as usize,
            ..interpret::Limits::default()
        };
        let uv = place.uv.unwrap_or([0.5, 0.5]);
        let requires = self.functions.requires.iter().filter(|_| place.patch.is_none());
        let requires = requires.map(|r| (r.condition.function, r.condition.arguments(place.x, &[])));
        let parts = self.functions.parts.iter().enumerate();
        let parts = parts.filter(|(k, _)| place.patch.is_none_or(|patch| patch == *k));
        let parts = parts.map(|(_, p)| (p.surface.function, p.surface.arguments(place.x, &uv)));
        let met = requires.chain(parts).find_map(|(function, arguments)| {
            match interpret::run_real(&self.functions.module, function, &arguments, limits) {
                Err(RunError::Steps(span) | RunError::Depth(span)) if span.end > span.start => Some(span),
                _ => None,
            }
        });
        met.or_else(|| place.patch.map(|p| self.part_span(p)))
    }

    /// `file:line:column: message (where r = 40mm, ...)`.
    pub(super) fn error(
        &self,
        span: Option<Span>,
        message: &str,
        place: &Place<'_>,
        params: Option<&[u32]>,
    ) -> EvaluationError {
        let mut values = Vec::new();
        let part = self.part_outside_of(span, place);
        let origin = span.filter(|s| part.is_some() && s.file.is_library());
        let (span, related) = match (origin, part) {
            (Some(origin), Some(part)) => (Some(part), Some((origin, "the place in the library"))),
            (_, part) => (span, part.map(|part| (part, "the part that it is evaluated for"))),
        };
        if let Some(patch) = place.patch {
            values.push(format!("in part {}", self.patches[patch].name));
        }
        if let Some([u, v]) = place.uv {
            values.push(format!("at u = {u}, v = {v}"));
        }
        let all: Vec<u32> = (0..self.parameters.len() as u32).collect();
        let params = params.unwrap_or_else(|| place.patch.map_or(&all[..], |p| &self.patches[p].active));
        let shown: Vec<String> =
            params.iter().map(|i| self.parameters[*i as usize].equals(place.x[*i as usize])).collect();
        if !shown.is_empty() {
            values.push(format!("where {}", shown.join(", ")));
        }
        let circumstances = values.join("; ");
        let mut text = span.and_then(|s| self.sources.place(s)).map_or_else(String::new, |place| format!("{place}: "));
        text.push_str(message);
        if let (None, Some(part)) = (origin, part)
            && let Some(file) = self.sources.get(part.file)
        {
            values[0] = format!("{} of {}:{}", values[0], file.name, self.sources.line_column(part).0);
        }
        if let Some(place) = origin.and_then(|s| self.sources.place(s)) {
            values.push(format!("in the library at {place}"));
        }
        if !values.is_empty() {
            let _ = write!(text, " ({})", values.join("; "));
        }
        EvaluationError { message: text, span, related, sentence: message.to_owned(), circumstances }
    }

    /// The statement of the part that was evaluated, where the place of the failure is not within it.
    fn part_outside_of(&self, span: Option<Span>, place: &Place<'_>) -> Option<Span> {
        let (at, part) = (span?, self.part_span(place.patch?));
        let within = at.file == part.file && part.start <= at.start && at.end <= part.end;
        (!within).then_some(part)
    }

    /// The parameters that a requirement uses.
    pub(super) fn used_params(&self, require: &Requirement) -> Vec<u32> {
        let condition = &require.condition;
        let used = self.functions.module.function(condition.function).used_params();
        condition.params.iter().zip(used).filter(|(_, used)| *used).map(|(i, _)| *i).collect()
    }

    /// The error for code that cannot be made.
    pub(super) fn not_made(&self, on_grid: bool, order: Order<'_>, error: &BuildError) -> EvaluationError {
        let what = match order {
            _ if on_grid => "evaluation on grids",
            Order::Points => "points",
            Order::Partials => "derivatives by u and v",
            Order::SecondPartials => "second derivatives by u and v",
            Order::Jacobian => "derivatives by parameters",
            Order::Pullback(_) => "gradients",
            Order::Decisions => "decisions",
        };
        let span = match error {
            BuildError::Size(e) => Some(e.span()),
            BuildError::Diff(e) => Some(e.span()),
            BuildError::RecursiveKeep(span) => Some(*span),
            BuildError::Jit(_) => None,
        };
        self.error(
            span,
            &format!("{what} cannot be computed: {error}"),
            &Place { x: &[], patch: None, uv: None },
            Some(&[]),
        )
    }
}

impl Instance<'_> {
    /// The error for a result that is not finite: goes the same way again with the interpreter to find the place.
    pub(super) fn not_finite(
        &self,
        patch: usize,
        evaluator: &Evaluator,
        arguments: &[f64],
        uv: [f64; 2],
    ) -> EvaluationError {
        let program = self.program;
        let captured = self.origin_in_prelude(patch).or_else(|| self.origin_in_prelude_jacobian(patch));
        let function = evaluator.functions[evaluator.of_part[patch]];
        let found = captured.or_else(|| origin(program, &evaluator.module, function, arguments));
        let value = self.is_finite_at(patch, uv);
        self.not_finite_there(patch, found, value, Some(uv))
    }

    /// The error for a value of a part, or a derivative of one that is finite itself.
    fn not_finite_there(
        &self,
        patch: usize,
        found: Option<Span>,
        is_derivative: bool,
        uv: Option<[f64; 2]>,
    ) -> EvaluationError {
        let program = self.program;
        let span = found.filter(|s| s.end > s.start);
        let what = program.sources.quoted(span.unwrap_or_default());
        let message = if is_derivative {
            format!("the derivative of {what} is not finite")
        } else {
            format!("{what} is not a finite number")
        };
        program.error(span, &message, &Place::of_part(&self.x, patch, uv), None)
    }

    /// The error for a capture without a finite derivative, which all points have in common.
    pub(super) fn capture_not_differentiable(&self, patch: usize) -> EvaluationError {
        self.not_finite_there(patch, self.origin_in_prelude_jacobian(patch), true, None)
    }

    /// The error for sums that are too large although every term is finite.
    pub(super) fn overflow(&self, patch: usize) -> EvaluationError {
        let message = "the derivatives of the points add up to more than a number can hold";
        self.program.error(None, message, &Place::of_part(&self.x, patch, None), None)
    }

    /// The place at which a capture of a part became infinite or NaN.
    fn origin_in_prelude(&self, patch: usize) -> Option<Span> {
        let functions = &self.program.functions;
        let part = &functions.parts[patch];
        let bad = part.captures.iter().find(|c| !self.captures[**c as usize].is_finite())?;
        self.origin_of_result(functions.prelude, *bad)
    }

    /// The place at which the derivative of a part's capture became infinite or NaN.
    fn origin_in_prelude_jacobian(&self, patch: usize) -> Option<Span> {
        let functions = &self.program.functions;
        let jacobian = self.prelude_jacobian().ok()?;
        let computed = functions.parts[patch].entries.iter().filter_map(|entry| match entry.value {
            EntryValue::Computed(k) => Some(k),
            EntryValue::Constant(_) => None,
        });
        let bad = computed.into_iter().find(|k| !jacobian[*k as usize].is_finite())?;
        self.origin_of_result(functions.prelude_jacobian, bad)
    }

    /// The place at which a result of a function of the parameters became infinite or NaN.
    fn origin_of_result(&self, function: FunctionId, result: u32) -> Option<Span> {
        // The interpreter looks for the first result that is not finite: let it be the only one.
        let mut module = Module::clone(&self.program.functions.module);
        let mut function = module.function(function).clone();
        function.results = vec![function.results[result as usize]];
        function.result_names.truncate(1);
        let id = module.add(function);
        origin(self.program, &module, id, &self.x)
    }
}

/// The place at which the first result that is not finite became so.
fn origin(program: &Program, module: &Module, function: FunctionId, arguments: &[f64]) -> Option<Span> {
    let arguments: Vec<Scalar> = arguments.iter().map(|x| Scalar::Real(*x)).collect();
    interpret::non_finite(module, function, &arguments, program.replay_limits(), None).ok().flatten()
}
