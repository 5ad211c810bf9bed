//! Finds jumps and kinks of surfaces: values of a parameter at which an operation takes another side, such as a
//! comparison, a maximum or a rounding.

use super::super::{Order, Program, Sites};
use super::shown;
use crate::diagnostic::{Code, Diagnostic};
use crate::ir::interpret::{self, Decision, Limits};
use crate::ir::scalar::Scalar;
use crate::ir::{FunctionId, Module, call_graph::CallGraph};
use crate::source::Span;
use std::collections::HashSet;

/// Steps into which a parameter's range is divided.
const STEPS: usize = 24;
/// The points (u, v) that are tried; no round numbers, where surfaces have their seams.
const POINTS: [[f64; 2]; 3] = [[0.137, 0.412], [0.561, 0.783], [0.883, 0.219]];
/// Distance from the place of change at which the two sides are compared, as a share of the parameter's range.
const ASIDE: f64 = 1e-9;
/// Changes that are looked for within a step.
const CHANGES: usize = 3;
/// Halvings of a step that find a change: to far less than [`ASIDE`].
const HALVINGS: usize = 36;
/// Most operations that all of it may take.
const BUDGET: u64 = 20_000_000;

pub(super) fn probe(program: &Program) -> Vec<Diagnostic> {
    let mut probe = Probe { program, budget: BUDGET, found: Vec::new(), seen: HashSet::new() };
    for part in 0..program.parts.len() {
        if decides(&program.functions.module, program.functions.parts[part].surface.function) {
            // Not the active ones: what only decides has no derivative.
            for param in program.influences(part) {
                probe.sweep(part, param);
            }
        }
    }
    probe.found
}

/// Whether anything is decided in a function or in those that it names.
fn decides(module: &Module, function: FunctionId) -> bool {
    let all = CallGraph::new(module, &[function]).order;
    all.iter().any(|f| module.function(*f).nodes.iter().any(|n| n.op.decides()))
}

struct Probe<'p> {
    program: &'p Program,
    budget: u64,
    found: Vec<Diagnostic>,
    /// Place of the operation and parameter: one report each.
    seen: HashSet<(Span, usize)>,
}

/// The decisions of a run, in order.
type Decisions = Vec<Decision>;

/// An operation that takes another side at a value of a parameter.
struct Change {
    span: Span,
    at: f64,
}

/// A parameter that is moved, the others at their defaults, and the point of a part that is looked at.
struct Run {
    part: usize,
    param: usize,
    uv: [f64; 2],
    x: Vec<f64>,
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
                if let Some(warning) = self.compare(part, param, uv, change, (low, high), everywhere) {
                    self.seen.insert((change.span, param));
                    self.found.push(warning);
                }
            }
        }
    }

    /// The changes at a point of a part; none where the evaluation fails or takes too long.
    fn changes(&mut self, part: usize, param: usize, uv: [f64; 2]) -> Option<Vec<Change>> {
        let mut run = Run { part, param, uv, x: self.program.defaults() };
        let (low, high) = self.program.range(&run.x, param);
        let mut changes = Vec::new();
        let mut before: Option<(f64, Decisions)> = None;
        for step in 0..=STEPS {
            let value = low + (high - low) * step as f64 / STEPS as f64;
            let decisions = self.decisions(&mut run, value)?;
            if let Some(mut last) = before {
                for _ in 0..CHANGES {
                    if last.1 == decisions {
                        break;
                    }
                    let (change, beyond) = self.bisect(&mut run, last, (value, &decisions))?;
                    changes.extend(change);
                    last = beyond;
                }
            }
            before = Some((value, decisions));
        }
        Some(changes)
    }

    /// The first place between two values with different decisions at which one changes; and the value beyond it.
    fn bisect(
        &mut self,
        run: &mut Run,
        (mut low, old): (f64, Decisions),
        (mut high, new): (f64, &Decisions),
    ) -> Option<(Option<Change>, (f64, Decisions))> {
        let mut new = new.clone();
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            let decisions = self.decisions(run, middle)?;
            if decisions == old {
                low = middle;
            } else {
                (high, new) = (middle, decisions);
            }
        }
        let first = old.iter().zip(&new).find(|(a, b)| a != b).map(|(a, _)| a.span);
        Some((first.map(|span| Change { span, at: 0.5 * (low + high) }), (high, new)))
    }

    fn decisions(&mut self, run: &mut Run, value: f64) -> Option<Decisions> {
        let functions = &self.program.functions;
        let surface = &functions.parts[run.part].surface;
        run.x[run.param] = value;
        let args: Vec<Scalar> = surface.arguments(&run.x, &run.uv).into_iter().map(Scalar::Real).collect();
        let limits = Limits { steps: self.budget, ..self.program.replay_limits() };
        let (decisions, steps) = interpret::decisions(&functions.module, surface.function, &args, limits).ok()?;
        self.budget = self.budget.saturating_sub(steps);
        Some(decisions)
    }

    /// The points, and the derivatives, on both sides of a change.
    fn compare(
        &self,
        part: usize,
        param: usize,
        uv: [f64; 2],
        change: &Change,
        (low, high): (f64, f64),
        everywhere: bool,
    ) -> Option<Diagnostic> {
        let aside = ASIDE * (high - low);
        // A kink in a bound itself disturbs nothing.
        let inside = change.at - aside > low && change.at + aside < high;
        let active = &self.program.parts[part].active;
        let side = |sign: f64| {
            let mut x = self.program.defaults();
            x[param] = (change.at + sign * aside).clamp(low, high);
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
        let kink = everywhere && inside && distance(&dp, &dq) > 1e-4 * steepest + 1e-5 * usual;
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

    /// In the user's own text: an operation of the library is shown at the part.
    fn warning(&self, code: Code, span: Span, part: usize, message: String) -> Diagnostic {
        let label = "this takes another side there";
        if span.file.is_library() {
            return Diagnostic::new(code, self.program.typed.parts[part].span, message).related(span, label);
        }
        Diagnostic::new(code, span, message).label(label)
    }
}

fn length(mm: f64) -> String {
    format!("{}mm", (mm * 1e4).round() / 1e4)
}
