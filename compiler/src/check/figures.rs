//! `area(part)`, `volume(part)`, `centroid(part)`, `least_distance(part, other)` and `face_angle(part, other)` in the
//! values of measures: figures of parts of the finished model. To the compiler they are values from outside, beside the
//! parameters.

use super::builtins::{Builtin, OfParts};
use super::context::{Binding, Callee, Checker, error};
use super::parts::is_under;
use super::paths::text_of;
use super::typed::{Expr, ExprKind, LocalId, Part, TakenFigure, Type};
use super::types::{Dimension, Exponent};
use crate::diagnostic::{Code, Diagnostic};
use crate::parameters::{Figure, PartFigure};
use crate::source::Span;
use crate::suggest::nearest;
use crate::syntax::ast;

/// A figure of a measure, before the parts are known.
pub(super) struct Wanted {
    figure: Figure,
    /// The names of a part, or the beginnings of the names of several: `plate.hole`; all parts if one is empty. Two of
    /// figures between parts.
    paths: Vec<String>,
    span: Span,
    local: LocalId,
}

/// The measure whose value is being checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Measuring {
    /// Whether it is one of the main model's, which are reported.
    pub(super) reported: bool,
    /// Whether it stands in a loop.
    pub(super) in_loop: bool,
    /// Whether its value takes anything of the parts, itself or by another measure.
    pub(super) of_parts: bool,
    /// The calls around it: those beyond are within functions that it calls.
    pub(super) calls: usize,
}

impl<'a> Checker<'a> {
    /// The figures of parts that a function stands for, if it does.
    pub(super) fn of_parts(&self, f: &Expr) -> Option<OfParts> {
        let Type::Closure(id) = f.ty else { return None };
        match self.closure(id).callee {
            Callee::Builtin(Builtin::OfParts(of_parts)) => Some(of_parts),
            _ => None,
        }
    }

    /// The figure that a call of a name stands for where a measure, or another number, has that name, too.
    pub(super) fn hidden_of_parts(&mut self, f: &'a ast::Expr) -> Option<OfParts> {
        let (ast::ExprKind::Name(name), true) = (&f.kind, self.measuring.is_some()) else { return None };
        let Some(Builtin::OfParts(of_parts)) = Builtin::named(name) else { return None };
        let number = |e: Expr| matches!(e.ty, Type::Real(_) | Type::Int(_));
        self.find(name, f.span).is_some_and(number).then_some(of_parts)
    }

    /// `area(path)`, `volume(path)`, `centroid(path)`, `least_distance(path, other)` or `face_angle(path, other)`; the
    /// first three without a path of all parts.
    pub(super) fn figure(&mut self, of_parts: OfParts, of: &[&'a ast::Expr], span: Span) -> Expr {
        let name = Builtin::OfParts(of_parts).name();
        let Some(measuring) = self.measuring else { return self.outside_of_measures(name, span) };
        if self.call_stack.len() != measuring.calls {
            let message = format!("'{name}' stands in the measure itself, not in a function that it calls");
            let error = Diagnostic::new(Code::Misplaced, span, message);
            return self.fail(error.hint("give the function its value: f(area(plate))"));
        }
        let Some(paths) = self.paths_of_parts(of_parts, of, span) else { return error(span) };
        let is_each = |path: &&String| !path.is_empty() && !path.contains('[');
        if let Some(path) = paths.iter().find(is_each).filter(|_| measuring.in_loop) {
            let message = format!("'{path}' may be the parts of all turns of this loop here");
            let error = Diagnostic::new(Code::UnknownName, span, message);
            return self.fail(error.hint(format!("say which: {name}({path}[i]) with the loop's variable i")));
        }
        self.measuring = Some(Measuring { of_parts: true, ..measuring });
        let power = |exponent| Type::Real(Dimension::of_length(Exponent::new(exponent, 1).unwrap_or(Exponent::ONE)));
        let (ty, figures) = match of_parts {
            OfParts::Area => (power(2), vec![Figure::Area]),
            OfParts::Volume => (power(3), vec![Figure::Volume]),
            OfParts::Centroid => (Type::LENGTH, (0..3).map(Figure::Centroid).collect()),
            OfParts::LeastDistance => (Type::LENGTH, vec![Figure::Distance]),
            OfParts::FaceAngle => (Type::ANGLE, vec![Figure::Angle]),
        };
        let mut values: Vec<Expr> = figures
            .into_iter()
            .map(|figure| {
                if !measuring.reported {
                    // Of a model within another no measure is reported, and nothing else may use this one.
                    return Expr { kind: ExprKind::Real(0.0), ty: ty.clone(), span };
                }
                let local = self.local(name, ty.clone(), span);
                self.wanted.push(Wanted { figure, paths: paths.clone(), span, local });
                self.read(local, span)
            })
            .collect();
        if values.len() == 1 {
            return values.swap_remove(0);
        }
        let ty = Type::Tuple(vec![ty; values.len()].into());
        Expr { kind: ExprKind::Aggregate(values), ty, span }
    }

    /// The paths that the arguments of such a function are, or an error.
    fn paths_of_parts(&mut self, of_parts: OfParts, of: &[&'a ast::Expr], span: Span) -> Option<Vec<String>> {
        let name = Builtin::OfParts(of_parts).name();
        let (numbers, how) = match of_parts.is_between() {
            true => (2..=2, format!("write {name}(hole[0].wall, hole[1].wall)")),
            false => (0..=1, format!("write {name}(plate) or {name}(plate.hole[0]); {name}() is of all parts")),
        };
        if !numbers.contains(&of.len()) {
            let parts = if of_parts.is_between() { "two parts" } else { "one part, or all" };
            let message = format!("'{name}' is of {parts}, but it has {} arguments", of.len());
            self.report(Diagnostic::new(Code::Arguments, span, message).hint(how));
            return None;
        }
        let mut paths = Vec::new();
        for path in of {
            let Some(text) = self.steps_of(path).map(|steps| text_of(&steps)) else {
                let message = format!("'{name}' is of parts of the model, by their names");
                self.report(Diagnostic::new(Code::Arguments, path.span, message).hint(how));
                return None;
            };
            paths.push(text);
        }
        if paths.is_empty() {
            paths.push(String::new());
        }
        Some(paths)
    }

    pub(super) fn outside_of_measures(&mut self, name: &str, span: Span) -> Expr {
        let message = format!("'{name}' is known of the finished parts: only the value of a measure can use it");
        let error = Diagnostic::new(Code::Misplaced, span, message);
        self.fail(error.hint(format!("write it in the model: measure of_part = {name}(part)")))
    }

    /// The value of a measure that takes something of the parts, where its name is read.
    pub(super) fn measured_value(&mut self, index: usize, span: Span) -> Expr {
        let Some(measuring) = self.measuring.filter(|measuring| measuring.calls == self.call_stack.len()) else {
            let message = "this measure is of the finished parts: only other measures can use it";
            return self.fail(Diagnostic::new(Code::Misplaced, span, message));
        };
        self.measuring = Some(Measuring { of_parts: true, ..measuring });
        Expr { span, ..self.measured_values[index].clone() }
    }

    /// Binds the name of a measure that takes something of the parts.
    pub(super) fn bind_measured(&mut self, name: &'a ast::Ident, value: Expr) {
        self.env.names.push((&name.text, Binding::Measured(self.measured_values.len())));
        self.measured_values.push(value);
    }

    /// The figures that the measures use, over these parts.
    pub(super) fn figures(&mut self, parts: &[Part]) -> Vec<TakenFigure> {
        let wanted = std::mem::take(&mut self.wanted);
        // After an error a part may be missing.
        if self.has_errors() {
            return Vec::new();
        }
        let mut figures = Vec::new();
        for Wanted { figure, paths, span, local } in wanted {
            let mut of = paths.iter().map(|path| self.parts_under(path, parts, span)).collect::<Vec<_>>().into_iter();
            let (of_first, others) = (of.next().unwrap_or_default(), of.next().unwrap_or_default());
            if let Some(both) = of_first.iter().find(|part| others.contains(part)) {
                let message =
                    format!("'{}' is one of both: figures between parts are of different ones", parts[*both].name);
                self.report(Diagnostic::new(Code::Arguments, span, message));
            }
            figures.push(TakenFigure { declared: PartFigure { figure, parts: of_first, others }, local });
        }
        figures
    }

    /// The parts whose names are a path or begin with it.
    fn parts_under(&mut self, path: &str, parts: &[Part], span: Span) -> Vec<usize> {
        let is_of = |part: &Part| path.is_empty() || part.name == path || is_under(&part.name, path);
        let of: Vec<usize> = (0..parts.len()).filter(|i| is_of(&parts[*i])).collect();
        // That a model has no parts at all is said without this.
        if of.is_empty() && !path.is_empty() {
            let error = Diagnostic::new(Code::UnknownName, span, format!("the model has no part '{path}'"));
            self.report(match nearest(path, parts.iter().map(|p| p.name.as_str())) {
                Some(near) => error.hint(format!("did you mean '{near}'?")),
                None => error,
            });
        }
        of
    }
}
