//! Measures: values of a model's body that are reported, with their tolerances.

use super::annotations::Expected;
use super::context::{Checker, error};
use super::figures::Measuring;
use super::model::{Body, Entry};
use super::parts::is_under;
use super::typed::{self, Expr, ExprKind, LocalId, Measure, Param, Part, Statement, Type, Unary};
use super::types::Dimension;
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::source::Span;
use crate::suggest::nearest;
use crate::syntax::ast::{self, Item, MeasureDecl, PartPath, Sign, Tolerance};

/// A measure of a model's body, before it is given its full name.
pub(super) struct Measured<'a> {
    pub(super) decl: &'a MeasureDecl,
    doc: &'a str,
    span: Span,
    /// Whether it stands in a loop, so that there may be several of it.
    grouped: bool,
    value: Expr,
    /// The names of the parts that show it, and their places.
    parts: Vec<(String, Span)>,
    /// The number of parts before it.
    before: usize,
    dimension: Dimension,
    /// The lower and the upper limit of what is allowed, about the nominal value.
    limits: Option<[Expr; 2]>,
}

impl<'a> Checker<'a> {
    /// Checks a measure, and binds its name to its value.
    pub(super) fn measure(&mut self, decl: &'a MeasureDecl, item: &'a Item, body: &mut Body<'a>) {
        let measuring = Measuring {
            reported: body.is_main,
            in_loop: body.loops > 0,
            of_parts: false,
            calls: self.call_stack.len(),
        };
        let outer = self.measuring.replace(measuring);
        let value = self.expr(&decl.value);
        let of_parts = self.measuring.is_some_and(|measuring| measuring.of_parts);
        self.measuring = outer;
        let (value, dimension) = self.measured_number(value);
        let limits = decl.tolerance.as_ref().and_then(|tolerance| self.limits(tolerance, dimension));
        let value = if of_parts {
            self.bind_measured(&decl.name, value.clone());
            value
        } else {
            self.bind_name(&decl.name, value, &mut body.statements);
            Expr { span: decl.value.span, ..self.name(&decl.name.text, decl.name.span) }
        };
        let parts = decl.parts.iter().map(|part| (body.name_of_part(part), part.span)).collect();
        let (doc, span, grouped) = (item.doc.as_str(), item.span, body.loops > 0);
        let before = body.entries.len();
        body.measures.push(Measured { decl, doc, span, grouped, value, parts, before, dimension, limits });
    }

    fn measured_number(&mut self, value: Expr) -> (Expr, Dimension) {
        let span = value.span;
        let ty = value.ty.clone();
        match self.real(value) {
            Some(number) => number,
            None if ty.is_error() => (error(span), Dimension::NONE),
            None => {
                let message = format!("a measure must be a number, but this is {}", self.describe(&ty));
                (self.fail(Diagnostic::new(Code::TypeMismatch, span, message)), Dimension::NONE)
            }
        }
    }

    /// The lower and the upper limit; none after an error.
    fn limits(&mut self, tolerance: &'a Tolerance, dimension: Dimension) -> Option<[Expr; 2]> {
        let expected = Expected::Real(dimension);
        let mut signed = |value: &'a ast::Expr, negative: bool| {
            let value = self.expr(value);
            let value = self.coerce(value, &expected, "the tolerance");
            if negative { negated(value) } else { value }
        };
        let limits = match tolerance {
            Tolerance::Error => return None,
            Tolerance::Symmetric(value) => [signed(value, true), signed(value, false)],
            Tolerance::Limits(limits) => {
                let [first, second] = limits.each_ref().map(|l| signed(&l.value, l.sign == Some(Sign::Minus)));
                if first_is_lower(limits) { [first, second] } else { [second, first] }
            }
        };
        limits.iter().all(|e| !e.ty.is_error()).then_some(limits)
    }

    /// The measures of a model. Those of a loop are numbered.
    pub(super) fn measures(&self, measured: Vec<Measured<'a>>) -> Vec<Measure> {
        let mut out: Vec<Measure> = Vec::new();
        for Measured { decl, doc, span, grouped, value, parts, dimension, limits, .. } in measured {
            let group = &decl.name.text;
            let before = out.iter().filter(|m| m.group == *group).count();
            let name = if grouped { format!("{group}[{before}]") } else { group.clone() };
            let parts = parts.into_iter().map(|(part, _)| part).collect();
            out.push(Measure {
                name,
                group: group.clone(),
                doc: doc.to_owned(),
                parts,
                dimension,
                value,
                limits,
                span,
            });
        }
        out
    }

    /// Reports names that are given twice: those of measures must differ from all others of their model.
    pub(super) fn names_of_measures(&mut self, body: &Body<'a>) {
        for (k, measured) in body.measures.iter().enumerate() {
            let name = &measured.decl.name;
            let earlier = body.measures[..k].iter().filter(|m| !std::ptr::eq(m.decl, measured.decl));
            let others = earlier.map(|m| (&m.decl.name, "another measure"));
            let declared = body.declared.iter().map(|name| (*name, "a parameter or an input"));
            let parts = body.entries.iter().map(|e| (&e.decl.name, "a part"));
            let twice = others.chain(declared).chain(parts).find(|(other, _)| other.text == name.text);
            if let Some((ast::Ident { span, .. }, what)) = twice {
                let message = format!("the measure '{}' has the name of {what}", name.text);
                let error = Diagnostic::new(Code::DuplicateName, name.span, message);
                self.report(error.related(*span, "this has the name, too").hint("give the measure another name"));
            }
        }
    }

    /// Reports parts of measures that the model does not have.
    pub(super) fn parts_of_measures(&mut self, measured: &[Measured<'a>], parts: &[Part]) {
        // After an error a part may be missing.
        if self.has_errors() {
            return;
        }
        for (name, span) in measured.iter().flat_map(|m| &m.parts) {
            if parts.iter().any(|p| p.name == *name) {
                continue;
            }
            self.report(match parts.iter().find(|p| is_under(&p.name, name)) {
                Some(first) => {
                    Diagnostic::new(Code::UnknownName, *span, format!("'{name}' is several parts: name one of them"))
                        .did_you_mean(*span, &first.name)
                }
                None => {
                    let error = Diagnostic::new(Code::UnknownName, *span, format!("the model has no part '{name}'"));
                    match nearest(name, parts.iter().map(|p| p.name.as_str())) {
                        Some(near) => error.did_you_mean(*span, near),
                        None => error,
                    }
                }
            });
        }
    }

    /// Reports tolerances that leave nothing at the defaults of the parameters. `defaults` also has the number of
    /// statements before each parameter.
    pub(super) fn check_limits(
        &mut self,
        measured: &[Measured<'a>],
        params: &[Param],
        defaults: &[(usize, Option<Expr>)],
        statements: &[Statement],
    ) {
        let limits: Vec<&Expr> = measured.iter().filter_map(|m| m.limits.as_ref()).flatten().collect();
        if limits.is_empty() || self.has_errors() {
            return;
        }
        let values = self.evaluate(at_defaults(params, defaults, statements), &[], &limits);
        let toleranced = measured.iter().filter(|m| m.limits.is_some());
        for (measure, values) in toleranced.zip(values.chunks_exact(2)) {
            let name = &measure.decl.name.text;
            let span = span_of(measure.decl.tolerance.as_ref()).unwrap_or(measure.span);
            match values {
                [Ok(lower), Ok(upper)] if lower > upper => self.report(excluded(measure, span)),
                [Ok(_), Ok(_)] => {}
                [Err(reason), _] | [_, Err(reason)] => {
                    let message = format!("the tolerance of '{name}' has no value: {reason}");
                    self.report(Diagnostic::new(Code::NotConstant, span, message));
                }
                _ => {}
            }
        }
    }
}

impl Body<'_> {
    /// The full name of a part that a measure names. One of the loop around it is that of the same turn, so far the
    /// last.
    fn name_of_part(&self, part: &PartPath) -> String {
        let turns = self.entries.iter().filter(|e| e.grouped && e.decl.name.text == part.name.text).count();
        match turns.checked_sub(1) {
            Some(turn) if self.loops > 0 && !is_numbered(part) => numbered(part, turn),
            _ => part.text.clone(),
        }
    }

    /// At the end of a turn of a loop: its measures may name parts that stand further down in it. The turn began with
    /// so many parts and measures.
    pub(super) fn name_later_parts(&mut self, (parts, measures): (usize, usize)) {
        for measured in &mut self.measures[measures..] {
            for (path, (name, _)) in measured.decl.parts.iter().zip(&mut measured.parts) {
                let of_it = |e: &&Entry<'_>| e.grouped && e.decl.name.text == path.name.text;
                let (before, later) = self.entries.split_at(measured.before);
                if is_numbered(path) || before[parts..].iter().any(|e| of_it(&e)) || !later.iter().any(|e| of_it(&e)) {
                    continue;
                }
                *name = numbered(path, before.iter().filter(of_it).count());
            }
        }
    }
}

/// Whether it is written with the number of a turn.
fn is_numbered(part: &PartPath) -> bool {
    part.text[part.name.text.len()..].starts_with('[')
}

/// The part of one turn.
fn numbered(part: &PartPath, turn: usize) -> String {
    format!("{}[{turn}]{}", part.name.text, &part.text[part.name.text.len()..])
}

/// The `let`s of a model's body, and the defaults of its parameters, each before what may use it.
fn at_defaults<'e>(
    params: &[Param],
    defaults: &'e [(usize, Option<Expr>)],
    statements: &'e [Statement],
) -> Vec<(LocalId, &'e Expr)> {
    let mut all = Vec::new();
    let mut bound = 0;
    for (param, (before, default)) in params.iter().zip(defaults) {
        all.extend(typed::lets(&statements[bound..*before]));
        bound = *before;
        all.extend(default.iter().map(|e| (param.local, e)));
    }
    all.extend(typed::lets(&statements[bound..]));
    all
}

/// The error for a tolerance with its lower limit above the upper one.
fn excluded(measure: &Measured<'_>, span: Span) -> Diagnostic {
    let name = &measure.decl.name.text;
    let Some(Tolerance::Limits(limits)) = &measure.decl.tolerance else {
        let error = Diagnostic::new(Code::Tolerance, span, format!("the tolerance of '{name}' is negative"));
        let hint = "one value without a sign allows as much below as above";
        return match &measure.decl.tolerance {
            Some(Tolerance::Symmetric(ast::Expr {
                kind: ast::ExprKind::Unary(ast::UnaryOp::Neg, value),
                span,
                ..
            })) => error.suggest(hint, [Edit::remove(Span { end: value.span.start, ..*span })]),
            _ => error.hint(hint),
        };
    };
    let message = format!("the limits of '{name}' are the wrong way round: the lower one is above the upper one");
    let error = Diagnostic::new(Code::Tolerance, span, message);
    let [first, second] = limits;
    if first.sign != second.sign {
        return error;
    }
    let hint = "of two limits with one sign, the upper one comes first";
    match [first, second].map(|limit| literal(&limit.value)) {
        [Some(lower), Some(upper)] => {
            error.suggest(hint, [Edit::replace(first.value.span, upper), Edit::replace(second.value.span, lower)])
        }
        _ => error.hint(hint),
    }
}

/// A number with its unit as it is written.
fn literal(expr: &ast::Expr) -> Option<String> {
    match expr.kind {
        ast::ExprKind::Int(number) => Some(number.to_string()),
        ast::ExprKind::Real(number, unit) => Some(format!("{number}{}", unit.map_or("", ast::Unit::name))),
        _ => None,
    }
}

/// Of limits with different signs the greater is the upper one, of those with one sign the first, as in drawings.
fn first_is_lower([first, second]: &[ast::Limit; 2]) -> bool {
    let rank = |sign: Option<Sign>| match sign {
        Some(Sign::Minus) => 0,
        None => 1,
        Some(Sign::Plus) => 2,
    };
    rank(first.sign) < rank(second.sign)
}

fn span_of(tolerance: Option<&Tolerance>) -> Option<Span> {
    let values: Vec<Span> = tolerance?.values().map(|e| e.span).collect();
    Some(values.first()?.to(*values.last()?))
}

fn negated(value: Expr) -> Expr {
    let (ty, span) = (value.ty.clone(), value.span);
    if matches!(ty, Type::Error) {
        return value;
    }
    Expr { kind: ExprKind::Unary(Unary::Neg, Box::new(value)), ty, span }
}
