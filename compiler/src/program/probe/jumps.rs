//! Finds jumps and kinks of surfaces: values of a parameter at which an operation takes another side, such as a
//! comparison, a maximum or a rounding; and jumps where several parameters change at once.

use super::super::{Order, Program, Sites};
use super::ranges::{positions, setting};
use super::shown;
use crate::diagnostic::{Code, Diagnostic};
use crate::ir::interpret::{self, Decision, Limits};
use crate::ir::scalar::Scalar;
use crate::ir::{FunctionId, Module, call_graph::CallGraph};
use crate::source::Span;
use std::collections::HashSet;

/// Steps into which a parameter's range, or another line through the settings, is divided.
const STEPS: usize = 24;
/// The points (u, v) that are tried; no round numbers, where surfaces have their seams.
const POINTS: [[f64; 2]; 3] = [[0.137, 0.412], [0.561, 0.783], [0.883, 0.219]];
/// Diagonals through the ranges of all parameters, each of which is looked along at one point of a part.
const DIAGONALS: usize = 12;
/// Share of a range within which a diagonal begins and ends.
const CORNER: f64 = 0.1;
/// Distance from the place of change at which the two sides are compared, as a share of the line.
const ASIDE: f64 = 1e-9;
/// Distance of a point (u, v) at which a change that does not move over the surface is at the same place.
const BESIDE: [f64; 2] = [1e-5, -0.7e-5];
/// Changes that are looked for within a step.
const CHANGES: usize = 3;
/// Halvings of a step that find a change: to far less than [`ASIDE`].
const HALVINGS: usize = 36;
/// Most operations that all of it may take.
const BUDGET: u64 = 20_000_000;

pub(super) fn probe(program: &Program) -> Vec<Diagnostic> {
    let mut probe = Probe { program, budget: BUDGET, found: Vec::new(), seen: HashSet::new() };
    for part in 0..program.parts().len() {
        if decides(&program.functions.module, program.functions.parts[part].surface.function) {
            // Not the active ones: what only decides has no derivative.
            let params: Vec<usize> = program.influences(part).collect();
            for param in &params {
                probe.sweep(part, *param);
            }
            if params.len() > 1 {
                (0..DIAGONALS).for_each(|k| probe.diagonal(part, &params, k));
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

/// An operation that takes another side at a place of a line.
struct Change {
    span: Span,
    at: f64,
}

/// Settings from one to another, and the point of a part that is looked at.
struct Line {
    part: usize,
    uv: [f64; 2],
    from: Vec<f64>,
    to: Vec<f64>,
}

impl Line {
    /// The setting at a place from 0 to 1.
    fn at(&self, place: f64) -> Vec<f64> {
        self.from.iter().zip(&self.to).map(|(a, b)| a + (b - a) * place).collect()
    }

    fn length(&self) -> f64 {
        distance(&self.from, &self.to)
    }
}

/// The fault at a change of decisions.
enum Finding {
    /// The surface jumps by so much.
    Jump(f64),
    /// The derivative by this parameter jumps.
    Kink(usize),
}

impl Probe<'_> {
    /// Moves one parameter through its range, the others at their defaults.
    fn sweep(&mut self, part: usize, param: usize) {
        let x = self.program.defaults();
        let (low, high) = self.program.range(&x, param);
        let (mut from, mut to) = (x.clone(), x);
        (from[param], to[param]) = (low, high);
        let lines = POINTS.map(|uv| Line { part, uv, from: from.clone(), to: to.clone() });
        let mut changes: Vec<Vec<Change>> = Vec::new();
        for line in &lines {
            match self.changes(line) {
                Some(list) => changes.push(list),
                None => return,
            }
        }
        let near = |a: f64, b: f64| (a - b).abs() < 1e-6;
        for (list, line) in changes.iter().zip(&lines) {
            for change in list {
                if self.seen.contains(&(change.span, param)) {
                    continue;
                }
                // A place that is the same at all points does not depend on u and v: it is not a seam that wanders.
                let everywhere =
                    changes.iter().all(|l| l.iter().any(|c| c.span == change.span && near(c.at, change.at)));
                let warning = match self.compare(line, change, everywhere) {
                    Some(Finding::Jump(by)) => self.jump(line, change, &[param], by),
                    Some(Finding::Kink(by)) => self.kink(line, change, param, by),
                    None => continue,
                };
                self.seen.insert((change.span, param));
                self.found.push(warning);
            }
        }
    }

    /// Moves all parameters at once, from near a corner of their ranges to the opposite one. Only jumps are reported
    /// that were not seen when one parameter was moved.
    fn diagonal(&mut self, part: usize, params: &[usize], k: usize) {
        // The first binary digit of a position selects an end of the range, the others the place near it.
        let n = self.program.parameters.len();
        let near = |p: &f64, end: bool| {
            let (side, rest) = ((2.0 * p).floor(), (2.0 * p).fract());
            let share = CORNER * rest;
            Some(if (side > 0.0) == end { 1.0 - share } else { share })
        };
        let corner = |end: bool| -> Vec<Option<f64>> { positions(n, k + 1).iter().map(|p| near(p, end)).collect() };
        let (Ok(from), Ok(to)) = (setting(self.program, &corner(true)), setting(self.program, &corner(false))) else {
            return;
        };
        let line = Line { part, uv: POINTS[k % POINTS.len()], from, to };
        for change in self.changes(&line).unwrap_or_default() {
            // Bounds that follow other parameters may exclude what is between two settings that they admit.
            let x = line.at(change.at);
            if self.program.bounds(&x).iter().zip(&x).any(|((low, high), x)| x < low || x > high) {
                continue;
            }
            let Some(Finding::Jump(by)) = self.compare(&line, &change, false) else { continue };
            let Some(by_params) = self.involved(&line, &change, params) else { continue };
            if by_params.is_empty() || by_params.iter().any(|p| self.seen.contains(&(change.span, *p))) {
                continue;
            }
            let warning = self.jump(&line, &change, &by_params, by);
            self.seen.extend(by_params.iter().map(|p| (change.span, *p)));
            self.found.push(warning);
        }
    }

    /// The changes along a line; none where the evaluation fails or takes too long.
    fn changes(&mut self, line: &Line) -> Option<Vec<Change>> {
        let mut changes = Vec::new();
        let mut before: Option<(f64, Decisions)> = None;
        for step in 0..=STEPS {
            let place = step as f64 / STEPS as f64;
            let decisions = self.decisions(line, place)?;
            if let Some(mut last) = before {
                for _ in 0..CHANGES {
                    if last.1 == decisions {
                        break;
                    }
                    let (change, beyond) = self.bisect(line, last, (place, &decisions))?;
                    changes.extend(change);
                    last = beyond;
                }
            }
            before = Some((place, decisions));
        }
        Some(changes)
    }

    /// The first place between two with different decisions at which one changes; and a place beyond it.
    fn bisect(
        &mut self,
        line: &Line,
        (mut low, old): (f64, Decisions),
        (mut high, new): (f64, &Decisions),
    ) -> Option<(Option<Change>, (f64, Decisions))> {
        let mut new = new.clone();
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            let decisions = self.decisions(line, middle)?;
            if decisions == old {
                low = middle;
            } else {
                (high, new) = (middle, decisions);
            }
        }
        let first = old.iter().zip(&new).find(|(a, b)| a != b).map(|(a, _)| a.span);
        Some((first.map(|span| Change { span, at: 0.5 * (low + high) }), (high, new)))
    }

    fn decisions(&mut self, line: &Line, place: f64) -> Option<Decisions> {
        self.decisions_at(line.part, line.uv, &line.at(place))
    }

    fn decisions_at(&mut self, part: usize, uv: [f64; 2], x: &[f64]) -> Option<Decisions> {
        let functions = &self.program.functions;
        let surface = &functions.parts[part].surface;
        let args: Vec<Scalar> = surface.arguments(x, &uv).into_iter().map(Scalar::Real).collect();
        let limits = Limits { steps: self.budget, ..self.program.replay_limits() };
        let (decisions, steps) = interpret::decisions(&functions.module, surface.function, &args, limits).ok()?;
        self.budget = self.budget.saturating_sub(steps);
        Some(decisions)
    }

    /// The parameters that, moved alone, make the operation of a change take another side.
    fn involved(&mut self, line: &Line, change: &Change, params: &[usize]) -> Option<Vec<usize>> {
        let x = line.at(change.at - ASIDE);
        let of_change = |d: Decisions| -> Decisions { d.into_iter().filter(|d| d.span == change.span).collect() };
        let before = of_change(self.decisions_at(line.part, line.uv, &x)?);
        let mut involved = Vec::new();
        for param in params {
            for sign in [1.0, -1.0] {
                let mut moved = x.clone();
                moved[*param] += sign * 1e3 * ASIDE * (line.to[*param] - line.from[*param]);
                if of_change(self.decisions_at(line.part, line.uv, &moved)?) != before {
                    involved.push(*param);
                    break;
                }
            }
        }
        Some(involved)
    }

    /// Whether a change is elsewhere on the line for a point of the surface close by.
    fn wanders(&mut self, line: &Line, change: &Change) -> bool {
        let uv = [line.uv[0] + BESIDE[0], line.uv[1] + BESIDE[1]];
        let sides = [-ASIDE, ASIDE].map(|aside| {
            let decisions = self.decisions_at(line.part, uv, &line.at(change.at + aside))?;
            Some(decisions.into_iter().filter(|d| d.span == change.span).collect::<Decisions>())
        });
        sides[0].is_some() && sides[0] == sides[1]
    }

    /// The points, and the derivatives, on both sides of a change.
    fn compare(&self, line: &Line, change: &Change, everywhere: bool) -> Option<Finding> {
        let aside = ASIDE * line.length();
        // A kink in a bound itself disturbs nothing.
        let inside = change.at - ASIDE > 0.0 && change.at + ASIDE < 1.0;
        let active = &self.program.patches[line.part].active;
        let side = |sign: f64| {
            let x = line.at((change.at + sign * ASIDE).clamp(0.0, 1.0));
            let instance = self.program.instantiate(&x).ok()?;
            let (u, v) = ([line.uv[0]], [line.uv[1]]);
            let (mut point, mut jacobian) = (vec![0.0; 3], vec![0.0; 3 * active.len()]);
            instance.evaluate(line.part, Sites::Scattered(&u, &v), Order::Points, &mut point).ok()?;
            instance.evaluate(line.part, Sites::Scattered(&u, &v), Order::Jacobian, &mut jacobian).ok()?;
            Some((point, jacobian))
        };
        let ((p, dp), (q, dq)) = (side(-1.0)?, side(1.0)?);
        let norm = |a: &[f64]| distance(a, &vec![0.0; a.len()]);
        let steepest = norm(&dp).max(norm(&dq));
        let jump = distance(&p, &q);
        if jump > 1e-7 * (1.0 + norm(&p)) + 20.0 * aside * steepest {
            return Some(Finding::Jump(jump));
        }
        // Beside the steepest slope there, a slope counts that would move the surface by its own size over the range.
        let usual = (1.0 + norm(&p)) * ASIDE / aside;
        if !everywhere || !inside || distance(&dp, &dq) <= 1e-4 * steepest + 1e-5 * usual {
            return None;
        }
        let gap = |k: usize| distance(&dp[3 * k..3 * k + 3], &dq[3 * k..3 * k + 3]);
        let worst = (0..active.len()).max_by(|a, b| gap(*a).total_cmp(&gap(*b)))?;
        Some(Finding::Kink(active[worst] as usize))
    }

    fn jump(&mut self, line: &Line, change: &Change, params: &[usize], by: f64) -> Diagnostic {
        let part = &self.program.patches[line.part].name;
        let by = length(by);
        let place = self.place(line, change, params);
        let (message, hint) = if self.wanders(line, change) {
            let names: Vec<String> = params.iter().map(|p| format!("'{}'", self.program.parameters[*p].name)).collect();
            let names = names.join(" and ");
            let [u, v] = line.uv;
            (
                format!(
                    "the part '{part}' has a step of {by} that moves over its surface with {names}; \
                     at u = {u}, v = {v} it is where {place}"
                ),
                "derivatives leave this movement out, so that a fit cannot follow it: make both sides equal there, \
                 or let the step be where two parts meet",
            )
        } else {
            let hint = "make both sides equal there: a fit cannot follow a jump";
            (format!("the part '{part}' jumps by {by} where {place}"), hint)
        };
        self.warning(Code::ValueJump, change.span, line.part, message).hint(hint)
    }

    fn kink(&self, line: &Line, change: &Change, param: usize, by: usize) -> Diagnostic {
        let (part, by) = (&self.program.patches[line.part].name, &self.program.parameters[by].name);
        let place = self.place(line, change, &[param]);
        let message = format!(
            "the derivative of the part '{part}' with respect to '{by}' jumps where {place}; its value does not"
        );
        let hint = "a smooth transition, such as smoothstep(from, to, x), helps a fit past this place";
        self.warning(Code::DerivativeJump, change.span, line.part, message).hint(hint)
    }

    /// Where a change is, by the values of some parameters.
    fn place(&self, line: &Line, change: &Change, params: &[usize]) -> String {
        let x = line.at(change.at);
        let one = |i: &usize| {
            let p = &self.program.parameters[*i];
            format!("'{}' passes {}", p.name, shown(p, x[*i]))
        };
        params.iter().map(one).collect::<Vec<_>>().join(" and ")
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

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
