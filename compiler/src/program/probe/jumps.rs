//! Finds jumps and kinks of surfaces: values of a parameter at which a comparison changes its outcome.

use super::super::{Order, Program, Sites};
use super::shown;
use crate::diagnostic::{Code, Diagnostic};
use crate::ir::interpret::{self, Limits};
use crate::ir::scalar::Scalar;
use crate::ir::{FunctionId, Module, Op, call_graph::CallGraph};
use crate::source::Span;
use std::collections::HashSet;

/// Steps into which a parameter's range is divided.
const STEPS: usize = 24;
/// The points (u, v) that are tried; no round numbers, where surfaces have their seams.
const POINTS: [[f64; 2]; 3] = [[0.137, 0.412], [0.561, 0.783], [0.883, 0.219]];
/// Distance from the place of change at which the two sides are compared, as a share of the parameter's range.
const ASIDE: f64 = 1e-9;
/// Most operations that all of it may take.
const BUDGET: u64 = 10_000_000;

pub(super) fn probe(program: &Program) -> Vec<Diagnostic> {
    let mut probe = Probe { program, budget: BUDGET, found: Vec::new(), seen: HashSet::new() };
    for part in 0..program.parts.len() {
        if decides(&program.functions.module, program.functions.parts[part].surface.function) {
            for param in program.parts[part].active.clone() {
                probe.sweep(part, param as usize);
            }
        }
    }
    probe.found
}

/// Whether anything is compared in a function or in those that it names.
fn decides(module: &Module, function: FunctionId) -> bool {
    let all = CallGraph::new(module, &[function]).order;
    all.iter().any(|f| module.function(*f).nodes.iter().any(|n| matches!(n.op, Op::Compare(..))))
}

struct Probe<'p> {
    program: &'p Program,
    budget: u64,
    found: Vec<Diagnostic>,
    /// Comparison and parameter: one report each.
    seen: HashSet<(Span, usize)>,
}

/// Outcomes of the comparisons of a run, in order.
type Outcomes = Vec<(Span, bool)>;

/// A comparison that changes its outcome at a value of a parameter.
struct Change {
    span: Span,
    at: f64,
}

impl Probe<'_> {
    /// Moves one parameter through its range, the others at their defaults.
    fn sweep(&mut self, part: usize, param: usize) {
        let mut changes: Vec<Vec<Change>> = Vec::new();
        for uv in POINTS {
            match self.changes(part, param, uv) {
                Some(list) => changes.push(list),
                None => return,
            }
        }
        let x = self.program.defaults();
        let (low, high) = self.program.range(&x, param);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-6 * (high - low);
        for (list, uv) in changes.iter().zip(POINTS) {
            for change in list {
                if self.seen.contains(&(change.span, param)) {
                    continue;
                }
                // A place that is the same at all points does not depend on u and v: it is not a seam that wanders.
                let everywhere =
                    changes.iter().all(|l| l.iter().any(|c| c.span == change.span && near(c.at, change.at)));
                let aside = ASIDE * (high - low);
                if let Some(warning) = self.compare(part, param, uv, change, aside, everywhere) {
                    self.seen.insert((change.span, param));
                    self.found.push(warning);
                }
            }
        }
    }

    /// The changes of comparisons at a point of a part; none where the evaluation fails or takes too long.
    fn changes(&mut self, part: usize, param: usize, uv: [f64; 2]) -> Option<Vec<Change>> {
        let mut x = self.program.defaults();
        let (low, high) = self.program.range(&x, param);
        let mut changes = Vec::new();
        let mut before: Option<(f64, Outcomes)> = None;
        for step in 0..=STEPS {
            let value = low + (high - low) * step as f64 / STEPS as f64;
            let outcomes = self.outcomes(part, &mut x, param, value, uv)?;
            if let Some((last, old)) = &before
                && *old != outcomes
            {
                changes.extend(self.bisect(part, &mut x, param, uv, (*last, old.clone()), value)?);
            }
            before = Some((value, outcomes));
        }
        Some(changes)
    }

    /// The place between two values with different outcomes, and what changes there first.
    fn bisect(
        &mut self,
        part: usize,
        x: &mut [f64],
        param: usize,
        uv: [f64; 2],
        (mut low, old): (f64, Outcomes),
        mut high: f64,
    ) -> Option<Option<Change>> {
        let mut new = self.outcomes(part, x, param, high, uv)?;
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            let outcomes = self.outcomes(part, x, param, middle, uv)?;
            if outcomes == old {
                low = middle;
            } else {
                (high, new) = (middle, outcomes);
            }
        }
        let first = old.iter().zip(&new).find(|(a, b)| a != b).map(|(a, _)| a.0);
        Some(first.map(|span| Change { span, at: 0.5 * (low + high) }))
    }

    fn outcomes(&mut self, part: usize, x: &mut [f64], param: usize, value: f64, uv: [f64; 2]) -> Option<Outcomes> {
        let functions = &self.program.functions;
        let surface = &functions.parts[part].surface;
        let default = std::mem::replace(&mut x[param], value);
        let args: Vec<Scalar> = surface.arguments(x, &uv).into_iter().map(Scalar::Real).collect();
        x[param] = default;
        let limits = Limits { steps: self.budget, ..self.program.replay_limits() };
        let (outcomes, steps) = interpret::outcomes(&functions.module, surface.function, &args, limits).ok()?;
        self.budget = self.budget.saturating_sub(steps);
        Some(outcomes)
    }

    /// The points, and the derivatives, on both sides of a change.
    fn compare(
        &self,
        part: usize,
        param: usize,
        uv: [f64; 2],
        change: &Change,
        aside: f64,
        everywhere: bool,
    ) -> Option<Diagnostic> {
        let active = &self.program.parts[part].active;
        let side = |sign: f64| {
            let mut x = self.program.defaults();
            x[param] = change.at + sign * aside;
            let instance = self.program.instantiate(&x).ok()?;
            let (u, v) = ([uv[0]], [uv[1]]);
            let (mut point, mut jacobian) = (vec![0.0; 3], vec![0.0; 3 * active.len()]);
            instance.evaluate(part, Sites::Scattered(&u, &v), Order::Points, &mut point).ok()?;
            instance.evaluate(part, Sites::Scattered(&u, &v), Order::Jacobian, &mut jacobian).ok()?;
            Some((point, jacobian))
        };
        let ((p, dp), (q, dq)) = (side(-1.0)?, side(1.0)?);
        let distance = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        let norm = |a: &[f64]| distance(a, &vec![0.0; a.len()]);
        let steepest = norm(&dp).max(norm(&dq));
        let jump = distance(&p, &q);
        let jumps = jump > 1e-7 * (1.0 + norm(&p)) + 20.0 * aside * steepest;
        // Beside the steepest slope there, a slope counts that would move the surface by its own size over the range.
        let usual = (1.0 + norm(&p)) * ASIDE / aside;
        let kink = everywhere && distance(&dp, &dq) > 1e-4 * steepest + 1e-5 * usual;
        let place = self.place(param, change.at);
        let name = &self.program.parts[part].name;
        if jumps {
            let message = format!("the part '{name}' jumps by {} where {place}", length(jump));
            let hint = "make both sides equal there: a fit cannot follow a jump";
            return Some(self.warning(Code::ValueJump, change.span, part, message).hint(hint));
        }
        let worst = (0..active.len()).max_by(|a, b| {
            let gap = |k: usize| distance(&dp[3 * k..3 * k + 3], &dq[3 * k..3 * k + 3]);
            gap(*a).total_cmp(&gap(*b))
        })?;
        let by = &self.program.parameters[active[worst] as usize].name;
        kink.then(|| {
            let message = format!(
                "the derivative of the part '{name}' with respect to '{by}' jumps where {place}; its value does not"
            );
            let hint = "a smooth transition, such as smoothstep(from, to, x), helps a fit past this place";
            self.warning(Code::DerivativeJump, change.span, part, message).hint(hint)
        })
    }

    fn place(&self, param: usize, value: f64) -> String {
        let p = &self.program.parameters[param];
        format!("'{}' passes {}", p.name, shown(p, value))
    }

    /// In the user's own text: a comparison of the library is shown at the part.
    fn warning(&self, code: Code, span: Span, part: usize, message: String) -> Diagnostic {
        let label = "this changes its outcome there";
        let library = self.program.sources.get(span.file).is_none_or(|f| f.name.starts_with("std."));
        if library {
            return Diagnostic::new(code, self.program.typed.parts[part].span, message).related(span, label);
        }
        Diagnostic::new(code, span, message).label(label)
    }
}

fn length(mm: f64) -> String {
    format!("{}mm", (mm * 1e4).round() / 1e4)
}
