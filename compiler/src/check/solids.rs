//! Solids: records of named surfaces with a function that says what is inside of them, and what `+`, `-` and `&` make
//! of them. The library (`std.solid`) says where a surface of either operand is kept; here names are joined.

use super::context::{Checker, error};
use super::expressions::element;
use super::operators::is_number;
use super::sides::SIDES;
use super::typed::{Expr, Statement, Type};
use crate::diagnostic::{Code, Diagnostic};
use crate::source::Span;
use crate::syntax::ast::BinaryOp;
use std::sync::Arc;

/// The name of a solid's first field, its function of points: none that a script can write.
pub(super) const INSIDE: &str = "";

/// Whether a field of a solid is none of its surfaces.
pub(super) fn is_hidden(name: &str) -> bool {
    name == INSIDE || name == SIDES
}

/// The only name of a solid that the library makes of an array of others: its surfaces are an array of theirs.
const ELEMENTS: &str = "at";

/// The module of the library with the functions below.
const MODULE: &str = "std.solid";

/// Whether a value of the type is a solid.
pub(super) fn is_solid(ty: &Type) -> bool {
    matches!(ty, Type::Record(fields) if fields.first().is_some_and(|(name, _)| &**name == INSIDE))
}

/// Whether it is a solid, or an array or a record of such.
pub(super) fn holds_solids(ty: &Type) -> bool {
    match ty {
        ty if is_solid(ty) => true,
        Type::Array(ty, n) => *n > 0 && holds_solids(ty),
        Type::Tuple(types) => !types.is_empty() && types.iter().all(holds_solids),
        Type::Record(fields) => !fields.is_empty() && fields.iter().all(|(_, ty)| holds_solids(ty)),
        _ => false,
    }
}

/// What two solids are combined to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operation {
    Union,
    Difference,
    Intersection,
}

impl Operation {
    /// The operation of an operator between solids.
    pub(super) fn of(op: BinaryOp) -> Option<Operation> {
        match op {
            BinaryOp::Add => Some(Operation::Union),
            BinaryOp::Sub => Some(Operation::Difference),
            BinaryOp::Common => Some(Operation::Intersection),
            _ => None,
        }
    }

    fn sign(self) -> char {
        match self {
            Operation::Union => '+',
            Operation::Difference => '-',
            Operation::Intersection => '&',
        }
    }

    /// The library's function of the second solid's sides, where it bounds the result from within.
    fn function_of_sides(self) -> Option<&'static str> {
        (self == Operation::Difference).then_some("_turned_sides")
    }

    /// The library's functions: what is left of the first solid's surfaces, and of the second's, beside a function of
    /// what is inside of the other; and the function of the result.
    fn functions(self) -> [&'static str; 3] {
        match self {
            Operation::Union => ["_union_first", "_union_second", "_inside_union"],
            Operation::Difference => ["_difference_first", "_difference_second", "_inside_difference"],
            Operation::Intersection => ["_intersection_first", "_intersection_second", "_inside_intersection"],
        }
    }
}

/// A solid taken apart.
pub(super) struct Operand {
    pub(super) inside: Expr,
    pub(super) sides: Vec<(Arc<str>, Expr)>,
    pub(super) surfaces: Vec<(Arc<str>, Expr)>,
}

/// The components of a record with their names.
pub(super) fn components(record: &Expr) -> Vec<(Arc<str>, Expr)> {
    let Type::Record(fields) = &record.ty else { return Vec::new() };
    fields.iter().enumerate().map(|(i, (name, _))| (name.clone(), element(record.clone(), i))).collect()
}

impl<'a> Checker<'a> {
    /// `solid(surfaces, inside, sides)`: a solid of surfaces and a function that is negative inside of them,
    /// with the sides of some of the surfaces.
    pub(super) fn make_solid(&mut self, surfaces: Expr, inside: Expr, sides: Option<Expr>, span: Span) -> Expr {
        if !matches!(surfaces.ty, Type::Record(_)) {
            let message =
                format!("a solid is made of a record of surfaces, but this is {}", self.describe(&surfaces.ty));
            let error = Diagnostic::new(Code::TypeMismatch, surfaces.span, message);
            return self.fail(error.hint("name its surfaces: solid({wall: ..., top: ..., base: ...}, |p| ...)"));
        }
        if !matches!(inside.ty, Type::Closure(id) if self.accepts(id, 1)) {
            let message = format!(
                "what is inside of a solid is said by a function of a point, but this is {}",
                self.describe(&inside.ty)
            );
            let error = Diagnostic::new(Code::TypeMismatch, inside.span, message);
            return self.fail(error.hint("it gives a length that is negative inside: |p| norm(p) - radius"));
        }
        let mut statements = Vec::new();
        let whole = self.keep(surfaces, &mut statements);
        let surfaces: Vec<_> = components(&whole).into_iter().filter(|(name, _)| !is_hidden(name)).collect();
        let sides = match sides {
            Some(sides) => {
                let sides = self.keep(sides, &mut statements);
                self.sides_of_surfaces(&surfaces, &sides)
            }
            None => Some(Vec::new()),
        };
        let Some(sides) = sides else { return error(span) };
        let solid = self.joined(Operand { inside, sides, surfaces }, span);
        super::bindings::wrap(statements, solid, span)
    }

    /// `inside(solid)`: the function that is negative inside.
    pub(super) fn inside_of(&mut self, solid: Expr, span: Span) -> Expr {
        if is_solid(&solid.ty) {
            return Expr { span, ..element(solid, 0) };
        }
        let message = format!("'inside' expects a solid, but this is {}", self.describe(&solid.ty));
        self.fail(Diagnostic::new(Code::TypeMismatch, solid.span, message))
    }

    /// `keep(point, where)`: the point of a surface that is there where a length is positive.
    pub(super) fn keep_point(&mut self, point: Expr, value: Expr, span: Span) -> Expr {
        let real = match &point.ty {
            Type::Tuple(types) if types.len() == 3 && types.iter().all(is_number) => point.ty.all_real(),
            _ => None,
        };
        let Some(real) = real else {
            let message = format!("'keep' expects a point in space, but this is {}", self.describe(&point.ty));
            return self.fail(Diagnostic::new(Code::TypeMismatch, point.span, message));
        };
        let Some((value, _)) = self.number(value, "'keep'") else { return error(span) };
        let point = self.convert(point, &real);
        super::operators::binary(super::typed::Binary::Keep, point, value, real, span)
    }

    /// `a + b`, `a - b` or `a & b` of solids.
    pub(super) fn combine(&mut self, operation: Operation, a: Expr, b: Expr, span: Span) -> Expr {
        let mut statements = Vec::new();
        let Some([a, b]) = self.operands(operation, a, b, span, &mut statements) else { return error(span) };
        let solid = self.combined(operation, a, b, span);
        super::bindings::wrap(statements, solid, span)
    }

    fn combined(&mut self, operation: Operation, a: Operand, b: Operand, span: Span) -> Expr {
        if let Some((name, _)) = b.surfaces.iter().find(|(name, _)| a.surfaces.iter().any(|(other, _)| other == name)) {
            let message = format!("both of these solids have a surface '{name}'");
            let hint = format!(
                "give the second a name that goes before those of its surfaces: a {} {{name: b}}",
                operation.sign()
            );
            return self.fail(Diagnostic::new(Code::DuplicateName, span, message).hint(hint));
        }
        let [first, second, inside] = operation.functions();
        let (of_a, of_b) = (a.inside.clone(), b.inside.clone());
        let mut surfaces = Vec::new();
        for (function, operand, other) in [(first, &a, &of_b), (second, &b, &of_a)] {
            for (name, surface) in &operand.surfaces {
                let left = self.call_library(function, vec![surface.clone(), other.clone()], span);
                surfaces.push((name.clone(), left));
            }
        }
        let inside = self.call_library(inside, vec![of_a, of_b], span);
        let mut sides = a.sides;
        for (name, side) in b.sides {
            let side = match operation.function_of_sides() {
                Some(function) => self.call_library(function, vec![side], span),
                None => side,
            };
            sides.push((name, side));
        }
        self.joined(Operand { inside, sides, surfaces }, span)
    }

    /// The solid of an operand.
    pub(super) fn joined(&mut self, operand: Operand, span: Span) -> Expr {
        let Operand { inside, sides, surfaces } = operand;
        let sides = self.record_of(&sides, span);
        let named = surfaces.iter().map(|(name, surface)| (&**name, surface.clone()));
        self.make_record([(INSIDE, inside), (SIDES, sides)].into_iter().chain(named).collect(), span)
    }

    pub(super) fn record_of(&mut self, named: &[(Arc<str>, Expr)], span: Span) -> Expr {
        self.make_record(named.iter().map(|(name, value)| (&**name, value.clone())).collect(), span)
    }

    /// A solid's function, sides and surfaces as another one: with other surfaces, some of them new.
    pub(super) fn solid_of(&mut self, inside: Expr, sides: Expr, surfaces: Vec<(Arc<str>, Expr)>, span: Span) -> Expr {
        let sides = components(&sides);
        self.joined(Operand { inside, sides, surfaces }, span)
    }

    /// Both operands taken apart, or an error.
    fn operands(
        &mut self,
        operation: Operation,
        a: Expr,
        b: Expr,
        span: Span,
        statements: &mut Vec<Statement>,
    ) -> Option<[Operand; 2]> {
        for e in [&a, &b] {
            let solids = match &e.ty {
                ty if is_solid(ty) => true,
                Type::Record(fields) => !fields.is_empty() && fields.iter().all(|(_, ty)| holds_solids(ty)),
                _ => false,
            };
            if !solids {
                let diagnostic = self.no_solid(operation, e, span);
                self.report(diagnostic);
                return None;
            }
        }
        Some([self.operand(a, statements)?, self.operand(b, statements)?])
    }

    fn no_solid(&self, operation: Operation, e: &Expr, span: Span) -> Diagnostic {
        let sign = operation.sign();
        let message = format!("'{sign}' combines two solids here, but this is {}", self.describe(&e.ty));
        let diagnostic = Diagnostic::new(Code::TypeMismatch, e.span, message).related(span, "the operation");
        match &e.ty {
            ty if holds_solids(ty) => {
                diagnostic.hint(format!("name them, and so their surfaces: a {sign} {{holes: ...}}"))
            }
            Type::Bool(_) => diagnostic.hint("conditions are joined with 'and'"),
            Type::Record(_) => diagnostic.hint(
                "a record of surfaces becomes a solid by a function that is negative inside: solid(surfaces, |p| ...)",
            ),
            Type::Closure(id) if self.accepts(*id, 2) => diagnostic
                .hint("a surface alone has no inside; the models of std.solid are solids: ball, box, extruded, ..."),
            _ => diagnostic,
        }
    }

    /// A solid, or the union of what a record holds, taken apart.
    fn operand(&mut self, solid: Expr, statements: &mut Vec<Statement>) -> Option<Operand> {
        let Type::Record(fields) = solid.ty.clone() else { return None };
        let span = solid.span;
        let whole = self.keep(solid, statements);
        let mut values = fields.iter().enumerate().map(|(i, (name, _))| (name.clone(), element(whole.clone(), i)));
        if &*fields[0].0 == INSIDE {
            let (_, inside) = values.next()?;
            let inside = self.keep(inside, statements);
            let (_, sides) = values.next()?;
            return Some(Operand { inside, sides: components(&sides), surfaces: values.collect() });
        }
        let mut all: Option<Operand> = None;
        for (name, value) in values.collect::<Vec<_>>() {
            let next = self.group(name, value, statements)?;
            let before = all.take();
            all = Some(match before {
                None => next,
                Some(before) => {
                    let both = self.combined(Operation::Union, before, next, span);
                    self.operand(both, statements)?
                }
            });
        }
        all
    }

    /// The union of what is under one name: a solid, or an array or record of such.
    fn group(&mut self, name: Arc<str>, value: Expr, statements: &mut Vec<Statement>) -> Option<Operand> {
        let span = value.span;
        let value = match value.ty.clone() {
            Type::Array(ty, _) if is_solid(&ty) => self.call_library("union", vec![value], span),
            Type::Array(..) | Type::Tuple(_) => {
                let items = self.items("for", value, statements)?;
                let named = items.into_iter().enumerate().map(|(i, item)| (format!("{i}").into(), item));
                return self.united(name, named.collect(), true, span, statements);
            }
            Type::Record(fields) if !is_solid(&value.ty) => {
                let whole = self.keep(value, statements);
                let named = fields.iter().enumerate().map(|(i, (n, _))| (n.clone(), element(whole.clone(), i)));
                return self.united(name, named.collect(), false, span, statements);
            }
            _ => value,
        };
        let Type::Record(fields) = value.ty.clone() else { return None };
        let whole = self.keep(value, statements);
        let inside = self.keep(element(whole.clone(), 0), statements);
        let sides = element(whole.clone(), 1);
        // The surfaces of an array of solids, as `union` and `separate` have them, are those of the name.
        let (sides, surfaces) = if fields.len() == 3 && &*fields[2].0 == ELEMENTS {
            let of_elements = components(&sides).into_iter().find(|(name, _)| &**name == ELEMENTS);
            (of_elements.map_or(sides, |(_, sides)| sides), element(whole, 2))
        } else {
            let named: Vec<_> = components(&whole).into_iter().filter(|(name, _)| !is_hidden(name)).collect();
            (sides, self.record_of(&named, span))
        };
        Some(Operand { inside, sides: vec![(name.clone(), sides)], surfaces: vec![(name, surfaces)] })
    }

    /// The union of several values under one name; their surfaces are an array or a record.
    fn united(
        &mut self,
        name: Arc<str>,
        values: Vec<(Arc<str>, Expr)>,
        as_array: bool,
        span: Span,
        statements: &mut Vec<Statement>,
    ) -> Option<Operand> {
        let mut all: Option<Operand> = None;
        for (inner, value) in values {
            let next = self.group(inner, value, statements)?;
            all = Some(match all {
                None => next,
                Some(before) => {
                    let both = self.combined(Operation::Union, before, next, span);
                    self.operand(both, statements)?
                }
            });
        }
        let Operand { inside, sides, surfaces } = all?;
        let [sides, surfaces] = [sides, surfaces].map(|named| {
            if as_array {
                self.make_tuple(named.into_iter().map(|(_, value)| value).collect(), span)
            } else {
                self.record_of(&named, span)
            }
        });
        Some(Operand { inside, sides: vec![(name.clone(), sides)], surfaces: vec![(name, surfaces)] })
    }

    /// Calls a function of the library's module of solids, which every solid comes from.
    fn call_library(&mut self, name: &'static str, args: Vec<Expr>, span: Span) -> Expr {
        self.call_of(MODULE, name, args, span)
    }

    /// Calls a function of a module of the library.
    pub(super) fn call_of(&mut self, home: &'static str, name: &'static str, args: Vec<Expr>, span: Span) -> Expr {
        let module = self.modules.iter().position(|module| module.std && module.name == home);
        let Some(module) = module else {
            let message = format!("this operation needs {home}");
            return self.fail(Diagnostic::new(Code::UnknownModule, span, message).hint(format!("add: use {home}")));
        };
        let function = self.of_file(module, name, span);
        self.call_with(function, args, span)
    }
}
